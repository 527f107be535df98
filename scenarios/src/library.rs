//! The scenario library: the files of `scenarios/library`, which are part of the program.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::LazyLock;

use closecall_traffic::suggest::nearest;
use serde::Serialize;
use toml::{Table, Value};

use super::{ScenarioError, ScenarioFile, base};

/// Embeds scenarios of `scenarios/library`, or of a folder in it, by their names.
macro_rules! embedded {
    ($folder:literal: $($name:literal),* $(,)?) => {
        [$(($name, include_str!(concat!("../library/", $folder, "/", $name, ".toml")))),*]
    };
    ($($name:literal),* $(,)?) => {
        [$(($name, include_str!(concat!("../library/", $name, ".toml")))),*]
    };
}

/// The scenarios of the library, each with its name and its text, in alphabetical order.
const LIBRARY: [(&str, &str); 17] = embedded![
    "cut-in-into-margin",
    "cut-in-into-margin-without-cut-in",
    "empty-wet-road",
    "lead-brakes-at-any-time",
    "lead-brakes-partially",
    "left-lane-blocked",
    "low-thw-overtake",
    "low-thw-overtake-at-cut-out",
    "overtake-without-brake",
    "paper-figure",
    "rear-follower-stays",
    "rear-follower-stays-lead-brakes",
    "rear-vehicle-is-followed",
    "rear-vehicle-is-followed-without-brake",
    "rear-vehicles-one-after-another",
    "rear-vehicles-one-after-another-without-brake",
    "slow-approach",
];

/// The scenarios of the folder `traffic` of the library: those with surrounding traffic.
const TRAFFIC: [(&str, &str); 4] =
    embedded!["traffic": "busy-overtake", "busy-overtake-without-brake", "dense-traffic", "trucks-alongside"];

/// The scenarios of the folder `as-recorded`: the headline scenario with the full distributions of
/// the recordings.
const AS_RECORDED: [(&str, &str); 1] = embedded!["as-recorded": "low-thw-overtake-as-recorded"];

/// The scenarios of the folder `aeb`, which judge emergency braking.
const AEB: [(&str, &str); 2] = embedded!["aeb": "aeb-lead-brakes", "aeb-lead-brakes-gently"];
/// The scenarios of the folder `acc`, which judge adaptive cruise control.
const ACC: [(&str, &str); 2] = embedded!["acc": "acc-lead-slows", "acc-slow-vehicle-ahead"];

/// The scenario of the folder `anchor`: emergency braking under a human driver, compared with crash
/// records.
const ANCHOR: [(&str, &str); 1] = embedded!["anchor": "anchor-lead-brakes"];

/// The scenarios of the folder `ramp`: a vehicle merges from a ramp.
const RAMP: [(&str, &str); 2] = embedded!["ramp": "ramp-merges", "ramp-merges-without-merge"];

/// The scenarios of the folder `faults`: a sensor has a fault. Each file names a base and states
/// only the differences from it.
const FAULTS: [(&str, &str); 82] = embedded![
    "faults":
    "camera-dead",
    "camera-dirty",
    "camera-frozen",
    "camera-low-sun",
    "camera-main-beam",
    "camera-out-of-focus",
    "front-lidar-blocked",
    "front-lidar-blooming",
    "front-lidar-clock-offset",
    "front-lidar-crosstalk",
    "front-lidar-dead",
    "front-lidar-dirty",
    "front-lidar-dropout",
    "front-lidar-frozen",
    "front-lidar-height",
    "front-lidar-jitter",
    "front-lidar-late",
    "front-lidar-lost-frames",
    "front-lidar-noisy",
    "front-lidar-pitch",
    "front-lidar-rail-ghosts",
    "front-lidar-yaw",
    "front-radar-blocked",
    "front-radar-clock-offset",
    "front-radar-dead",
    "front-radar-dirty",
    "front-radar-dropout",
    "front-radar-frozen",
    "front-radar-ghost",
    "front-radar-jitter",
    "front-radar-late",
    "front-radar-lost-frames",
    "front-radar-noisy",
    "front-radar-yaw",
    "lidar-blocked",
    "lidar-blooming",
    "lidar-clock-offset",
    "lidar-crosstalk",
    "lidar-dead",
    "lidar-dirty",
    "lidar-dropout",
    "lidar-frozen",
    "lidar-height",
    "lidar-jitter",
    "lidar-late",
    "lidar-lost-frames",
    "lidar-misaligned",
    "lidar-noisy",
    "lidar-pitch",
    "lidar-rail-ghosts",
    "lidar-yaw",
    "map-curvature",
    "map-lane-width",
    "map-without-rails",
    "object-blocked",
    "object-clock-offset",
    "object-dead",
    "object-dirty",
    "object-dropout",
    "object-frozen",
    "object-ghost",
    "object-jitter",
    "object-late",
    "object-lost-frames",
    "object-noisy",
    "object-yaw",
    "odometry-heading",
    "odometry-lateral",
    "odometry-speed",
    "odometry-wrong",
    "surround-blocked",
    "surround-clock-offset",
    "surround-dead",
    "surround-dirty",
    "surround-dropout",
    "surround-frozen",
    "surround-ghost",
    "surround-jitter",
    "surround-late",
    "surround-lost-frames",
    "surround-noisy",
    "surround-yaw",
];

/// The scenarios of [`FAULTS`], each with the text of the whole scenario.
static EXPANDED_FAULTS: LazyLock<Vec<(&str, String)>> = LazyLock::new(|| {
    let whole = |text: &str| base::expand(text).ok().flatten().unwrap_or_else(|| text.to_owned());
    FAULTS.iter().map(|(name, text)| (*name, whole(text))).collect()
});

/// Returns all scenarios: first the ones with surrounding traffic, then other functions, and
/// scenarios with faults last.
fn all() -> impl Iterator<Item = (&'static str, &'static str)> {
    plain().chain(EXPANDED_FAULTS.iter().map(|(name, text)| (*name, text.as_str())))
}

/// Returns all scenarios that have no base.
fn plain() -> impl Iterator<Item = (&'static str, &'static str)> {
    LIBRARY.into_iter().chain(TRAFFIC).chain(AS_RECORDED).chain(AEB).chain(ACC).chain(ANCHOR).chain(RAMP)
}

/// Returns the names of the scenarios that can be a base.
pub(super) fn plain_names() -> impl Iterator<Item = &'static str> {
    plain().map(|(name, _)| name)
}

/// Returns the text of a scenario that can be a base, or `None` if the library has none of that
/// name.
pub(super) fn plain_text(name: &str) -> Option<&'static str> {
    plain().find(|(scenario, _)| *scenario == name).map(|(_, text)| text)
}

/// A name that no scenario of the library has.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the library has no scenario `{name}`, only {names}{}", suggestion(name))]
pub struct UnknownScenario {
    /// The name.
    pub name: String,
    /// The names of the library, separated by commas.
    pub names: String,
}

/// Returns the end of a message that suggests a name of the library, or an empty text if none is
/// similar.
pub(crate) fn suggestion(name: &str) -> String {
    nearest(name, names()).map(|candidate| format!("; did you mean `{candidate}`?")).unwrap_or_default()
}

/// A scenario of the library, as a list of the library describes it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct LibraryEntry {
    /// The scenario's name.
    pub name: &'static str,
    /// The question that the scenario answers.
    pub question: String,
    /// The tags.
    pub tags: Vec<String>,
    /// The requirements that the scenario tests.
    pub requirements: Vec<String>,
    /// Number of sampled parameters.
    pub parameters: usize,
    /// The criteria of the table `[gate]`, as the file writes them.
    pub gates: Vec<String>,
}

impl std::fmt::Display for LibraryEntry {
    /// Writes the name, and below it the question, the requirements and the gates, a line each.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { name, question, parameters, .. } = self;
        writeln!(f, "{name}\n  {question}\n  requirements: {}; {parameters} parameters", self.requirements.join(", "))?;
        self.gates.iter().try_for_each(|gate| writeln!(f, "  gate: {gate}"))
    }
}

impl LibraryEntry {
    fn new(name: &'static str, text: &str) -> Result<Self, ScenarioError> {
        let file = ScenarioFile::parse(&path(name), text, &[])?;
        let config = file.config();
        Ok(Self {
            name,
            question: config.description.clone(),
            tags: config.tags.clone(),
            requirements: config.requirements.clone(),
            parameters: file.space().iter().len(),
            gates: gates(text),
        })
    }
}

/// Returns the names of the scenarios in alphabetical order: first the plain ones, then the ones
/// with surrounding traffic, and the ones with faults last.
pub fn names() -> impl Iterator<Item = &'static str> {
    plain_names().chain(FAULTS.into_iter().map(|(name, _)| name))
}

/// Returns the scenarios in a folder of `scenarios/library`.
fn in_folder(folder: &str) -> &'static [(&'static str, &'static str)] {
    match folder {
        "traffic" => &TRAFFIC,
        "as-recorded" => &AS_RECORDED,
        "aeb" => &AEB,
        "acc" => &ACC,
        "anchor" => &ANCHOR,
        "ramp" => &RAMP,
        "faults" => &FAULTS,
        _ => &[],
    }
}

/// Returns the name of the scenario that a word names. The word is a name, or a folder and a name
/// such as `traffic/busy-overtake`.
pub fn named(word: &str) -> Option<&'static str> {
    match word.split_once('/') {
        Some((folder, name)) => in_folder(folder).iter().map(|(scenario, _)| *scenario).find(|other| *other == name),
        None => names().find(|name| *name == word),
    }
}

/// Returns true if a word begins with a folder of the library, such as `traffic/busy-overtake`.
pub(crate) fn has_folder(word: &str) -> bool {
    word.split_once('/').is_some_and(|(folder, _)| !in_folder(folder).is_empty())
}

/// Returns the text of a scenario, or `None` if the library has no scenario of that name.
pub fn text(name: &str) -> Option<&'static str> {
    let name = named(name)?;
    // The scenarios without a base come first: it takes time to expand the scenarios with faults.
    plain_text(name).or_else(|| all().find(|(scenario, _)| *scenario == name).map(|(_, text)| text))
}

/// Returns the path by which messages and manifests name a scenario of the library. No such file is
/// read.
pub fn path(name: &str) -> PathBuf {
    PathBuf::from(format!("library/{name}.toml"))
}

/// Describes every scenario of the library, in the order of [`names`].
///
/// # Errors
/// [`ScenarioError`] if an embedded scenario is invalid, which is a defect of the program.
pub fn entries() -> Result<Vec<LibraryEntry>, ScenarioError> {
    all().map(|(name, text)| LibraryEntry::new(name, text)).collect()
}

/// Returns the text of the scenario `from` of the library, under the name `name`.
///
/// # Errors
/// [`UnknownScenario`] if the library has no scenario `from`.
pub fn copy_of(from: &str, name: &str) -> Result<String, UnknownScenario> {
    let (from, text) = named(from)
        .and_then(|named| Some((named, text(named)?)))
        .ok_or_else(|| UnknownScenario { name: from.to_owned(), names: names().collect::<Vec<_>>().join(", ") })?;
    Ok(text.replace(&format!("name = \"{from}\""), &format!("name = \"{name}\"")))
}

/// Returns the keys at the top level in which a file differs from the scenario of the library whose
/// name it has: another file, or one with settings. What no verdict rests on does not count.
pub fn differences(file: &ScenarioFile) -> Vec<String> {
    let name = &file.config().name;
    let of_library = || ScenarioFile::parse(&path(name), text(name)?, &[]).ok();
    let Some(of_library) = of_library() else { return Vec::new() };
    let keys = |file: &ScenarioFile| Table::try_from(file.config()).unwrap_or_default();
    let (ours, theirs) = (keys(&of_library), keys(file));
    let names: BTreeSet<&String> = ours.keys().chain(theirs.keys()).collect();
    let is_other = |key: &&String| ours.get(*key) != theirs.get(*key) && !UNJUDGED.contains(&key.as_str());
    names.into_iter().filter(is_other).cloned().collect()
}

/// The keys that change no run and no judgement.
const UNJUDGED: [&str; 3] = ["description", "tags", "overridden"];

/// Returns the gates that the text of a scenario sets.
fn gates(text: &str) -> Vec<String> {
    let Ok(document) = text.parse::<Table>() else { return Vec::new() };
    let required = document.get("gate").and_then(|gate| gate.get("require")).and_then(Value::as_array);
    required.into_iter().flatten().filter_map(Value::as_str).map(str::to_owned).collect()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn a_file_with_the_name_of_the_library_says_what_is_its_own() {
        let text = text("low-thw-overtake").unwrap();
        let differences = |text: &str| differences(&ScenarioFile::parse(Path::new("a.toml"), text, &[]).unwrap());
        assert_eq!(differences(text), Vec::<String>::new());
        let weaker = text.replacen("upper(induced) <= 0.03", "upper(induced) <= 0.9", 1);
        assert_eq!(differences(&weaker), ["checks"]);
        let easier = weaker.replacen("min = 4.0, max = 8.0", "min = 1.0, max = 2.0", 1);
        assert_eq!(differences(&easier), ["checks", "parameters"]);
        assert_eq!(differences(&easier.replacen("low-thw-overtake", "own", 1)), Vec::<String>::new(), "another name");
        for name in names() {
            let file = ScenarioFile::parse(&path(name), super::text(name).unwrap(), &[]).unwrap();
            assert!(super::differences(&file).is_empty(), "{name}");
        }
    }

    #[test]
    fn the_library_holds_every_scenario_of_its_folder() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/library");
        let names_in = |folder: &Path| {
            let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
            let scenarios = files.filter(|path| path.extension().is_some_and(|extension| extension == "toml"));
            let mut names: Vec<String> =
                scenarios.map(|path| path.file_stem().unwrap().to_str().unwrap().to_owned()).collect();
            names.sort();
            names
        };
        let mut expected = names_in(&folder);
        for family in ["traffic", "as-recorded", "aeb", "acc", "anchor", "ramp", "faults"] {
            expected.extend(names_in(&folder.join(family)));
        }
        assert_eq!(names().collect::<Vec<_>>(), expected);
        for (entry, (name, text)) in entries().unwrap().into_iter().zip(all()) {
            assert_eq!(entry.name, ScenarioFile::parse(&path(name), text, &[]).unwrap().config().name);
            assert!(entry.question.ends_with('?'), "{name}: {}", entry.question);
        }
    }

    #[test]
    fn gates_are_those_of_the_text() {
        assert_eq!(gates("[gate]\nrequire = ['count(ego_collided) <= 0']\n"), ["count(ego_collided) <= 0"]);
        assert_eq!(gates("name = 'a'\n"), Vec::<String>::new());
    }

    #[test]
    fn every_copy_is_valid_under_its_new_name() {
        for text in names().map(|name| copy_of(name, "mine").unwrap()) {
            let file = ScenarioFile::parse(Path::new("mine.toml"), &text, &[]).unwrap();
            file.check().unwrap();
            assert_eq!(file.config().name, "mine");
        }
        assert!(copy_of("paper-figur", "mine").unwrap_err().to_string().contains("did you mean `paper-figure`?"));
    }
}
