//! The manifest of a campaign's folder: everything that determines the outcomes and that a replay
//! needs.

use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use closecall_scenarios::sampling::Design;
use closecall_scenarios::{Scenario, ScenarioFile, Setting};
use closecall_sensors::SensorMode;
use closecall_sensors::external::{BUILT_IN, ProgramKind, ProgramSettings};
use closecall_simulation::Arm;
use closecall_simulation::controller::ControllerChoice;
use closecall_traffic::input;
use object::{Object, ReadCache};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::fingerprint::{self, Fingerprint};
use super::ledger::Inference;
use super::left_out::LeftOut;
use super::partition::Partition;
use super::sampling::Sampling;
use super::validity::CheckPlan;

/// The version of the layout of a campaign's folder.
pub const MANIFEST_VERSION: u32 = 2;

/// Length of the build's identifier in a version (hexadecimal digits).
const BUILD_DIGITS: usize = 16;

/// The file that holds this program, if it is not the executable.
static PROGRAM: OnceLock<PathBuf> = OnceLock::new();

/// The commit that this program is built from, if it is known and the sources do not differ from
/// it.
static COMMIT: OnceLock<&'static str> = OnceLock::new();

/// Number of parts of the executable that are hashed at the same time.
const HASH_PARTS: u64 = 8;

/// Returns the version of this program: the release and what tells two builds of it apart,
/// `0.1.0+0a1b2c3d4e5f`.
///
/// The commit tells builds apart. Two builds of one commit, such as the command and the Python
/// package, compute the same outcomes. If the sources differ from the commit, or have none, the
/// identifier of the executable tells builds apart. The linker computes it from the content of the
/// executable (`readelf -n`: the build ID). An executable without an identifier is hashed, which
/// takes longer than a short campaign.
pub fn version() -> String {
    let release = env!("CARGO_PKG_VERSION");
    if let Some(commit) = COMMIT.get() {
        return format!("{release}+{commit}");
    }
    let program = PROGRAM.get().map_or_else(std::env::current_exe, |path| Ok(path.clone()));
    let build = program.and_then(|path| match build_id(&path) {
        Some(id) => Ok(id.iter().map(|byte| format!("{byte:02x}")).collect()),
        None => parts_hash(&path).map(|hash| hash.to_hex().to_string()),
    });
    match build {
        Ok(build) => format!("{release}+{}", build.chars().take(BUILD_DIGITS).collect::<String>()),
        Err(_) => release.to_owned(),
    }
}

/// Sets the commit that this program is built from.
pub fn set_commit(commit: &'static str) {
    COMMIT.get_or_init(|| commit);
}

/// Sets the file that holds this program, if it is not the executable: the library that an
/// interpreter has loaded.
pub fn set_program(library: PathBuf) {
    PROGRAM.get_or_init(|| library);
}

/// Returns the identifier that the linker wrote into an executable, or `None` if there is none of
/// at least [`BUILD_DIGITS`] digits.
fn build_id(path: &Path) -> Option<Vec<u8>> {
    let file = ReadCache::new(input::open(path).ok()?);
    let executable = object::File::parse(&file).ok()?;
    let of_mach = || executable.mach_uuid().ok().flatten().map(|id| id.to_vec());
    let id = executable.build_id().ok().flatten().map(<[u8]>::to_vec).or_else(of_mach)?;
    (2 * id.len() >= BUILD_DIGITS).then_some(id)
}

/// Returns the BLAKE3 hash of a file, without loading the file into memory.
pub(crate) fn file_hash(path: &Path) -> io::Result<blake3::Hash> {
    let mut hasher = blake3::Hasher::new();
    hasher.update_reader(input::open(path)?)?;
    Ok(hasher.finalize())
}

/// Returns the BLAKE3 hash of the hashes of [`HASH_PARTS`] parts of a file of equal length, without
/// loading the file into memory.
fn parts_hash(path: &Path) -> io::Result<blake3::Hash> {
    let length = path.metadata()?.len().div_ceil(HASH_PARTS);
    let part_hash = |part: u64| -> io::Result<blake3::Hash> {
        let mut file = input::open(path)?;
        file.seek(SeekFrom::Start(part * length))?;
        let mut hasher = blake3::Hasher::new();
        hasher.update_reader(file.take(length))?;
        Ok(hasher.finalize())
    };
    std::thread::scope(|scope| {
        let parts: Vec<_> = (0..HASH_PARTS).map(|part| scope.spawn(move || part_hash(part))).collect();
        let mut hasher = blake3::Hasher::new();
        for part in parts {
            let hash = part.join().map_err(|_| io::Error::other("failed to hash the executable"))??;
            hasher.update(hash.as_bytes());
        }
        Ok(hasher.finalize())
    })
}

/// One scenario of a campaign.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ManifestScenario {
    /// The scenario's name.
    pub name: String,
    /// The file from which it was read.
    pub path: String,
    /// BLAKE3 hash of `text`.
    pub blake3: String,
    /// The content of the file, with all settings applied.
    pub text: String,
    /// The settings, each as `key=value`.
    #[serde(default)]
    pub settings: Vec<String>,
}

/// A network that the sensors use.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ManifestModel {
    /// The network's name.
    pub name: String,
    /// BLAKE3 hash of its file.
    pub blake3: String,
    /// The inference backend that runs it.
    pub backend: String,
}

/// Everything that determines the outcomes of a campaign.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// Version of the folder's layout: [`MANIFEST_VERSION`] of the program that wrote it.
    pub manifest_version: u32,
    /// Version of the program: see [`version`].
    pub closecall_version: String,
    /// The scenarios.
    pub scenarios: Vec<ManifestScenario>,
    /// How the samples are drawn.
    pub sampling: Sampling,
    /// The part of the samples that this folder is for; `None` for all of them.
    pub partition: Option<Partition>,
    /// The controllers: the baseline first if there are several, the one under test last,
    /// references between them.
    pub arms: Vec<ControllerChoice>,
    /// The sensors; `None` for the sensors of each scenario.
    pub sensors: Option<SensorMode>,
    /// The samples that are checked for validity.
    pub checks: CheckPlan,
    /// The rule that determines the number of samples.
    pub inference: Inference,
    /// The networks that the sensors use.
    pub models: Vec<ManifestModel>,
    /// Longest wall time of a sample in one arm (s).
    pub sample_timeout_s: f64,
    /// How often a sample runs again in a new process after its worker process has crashed or hung.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub retry_crashed: u32,
    /// The identities of the controllers that run as processes.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub controllers: Vec<Fingerprint>,
    /// The folder in which the program ran, to which paths in the command of a controller are
    /// relative.
    #[serde(default)]
    pub working_folder: Option<PathBuf>,
    /// Scenarios and members of a driver ensemble that were not run, because the member changes
    /// nothing in the scenario.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub without_effect: Vec<(String, String)>,
    /// Scenarios that were not run, because a fault of them cannot act with the sensors.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub left_out: Vec<LeftOut>,
    /// True if the seed was drawn when the campaign began, so that nobody knew it before. A seed
    /// that was named stays named, however the campaign is resumed.
    #[serde(default)]
    pub has_drawn_seed: bool,
    /// True if the campaign has chosen its folder itself, so that a later one may take its place.
    #[serde(default)]
    pub replaceable: bool,
    /// The command line.
    pub command: Vec<String>,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde passes a reference")]
const fn is_zero(count: &u32) -> bool {
    *count == 0
}

/// Keys of a manifest that do not affect the outcomes, or whose differences another message names.
const INCIDENTAL: [&str; 5] = ["command", "working_folder", "has_drawn_seed", "replaceable", "controllers"];
/// Keys of a scenario in a manifest that do not affect the outcomes, which follow from its text.
const INCIDENTAL_OF_SCENARIO: [&str; 2] = ["path", "settings"];

impl Manifest {
    /// Returns one message for each difference between the two manifests that can affect outcomes.
    /// If there is none, the outcomes of both campaigns agree to the last bit.
    pub fn differences(&self, other: &Self) -> Vec<String> {
        let mut differences = Vec::new();
        match (serde_json::to_value(self), serde_json::to_value(other)) {
            (Ok(there), Ok(here)) => compare("", &there, &here, &mut differences),
            // Every manifest can be written as JSON; if one could not, the two could not be known
            // to agree.
            _ => differences.push("the manifest cannot be compared".to_owned()),
        }
        differences.extend(fingerprint::differences(&self.controllers, &other.controllers));
        differences
    }

    /// Works like [`Self::differences`]. If the campaigns differ in their number of samples, the
    /// message says why this one does not grow to it.
    pub fn differences_in_growth(&self, other: &Self) -> Vec<String> {
        let mut differences = self.differences(other);
        if let Some(why) = self.keeps_its_number(other) {
            let of_number = |difference: &&mut String| difference.starts_with("sampling.samples: ");
            differences.iter_mut().filter(of_number).for_each(|difference| difference.push_str(&format!(" ({why})")));
        }
        differences
    }

    /// Returns true if `other` is the same campaign with more samples: it begins with the same
    /// samples.
    pub fn grows_to(&self, other: &Self) -> bool {
        let (sampling, more) = (self.sampling, other.sampling);
        let grown = Self { sampling: Sampling { samples: more.samples, ..sampling }, ..self.clone() };
        sampling.samples < more.samples && self.keeps_its_number(other).is_none() && grown.differences(other).is_empty()
    }

    /// Returns why the campaign does not grow to the number of samples of `other`; `None` if it
    /// does, or if both numbers are the same. A Sobol sequence and the bins of a coverage cross go
    /// on after any number of samples.
    fn keeps_its_number(&self, other: &Self) -> Option<&'static str> {
        let (has, wanted) = (self.sampling.samples, other.sampling.samples);
        match (self.inference, self.sampling.design) {
            _ if has == wanted => None,
            (Inference::Sequential, _) => {
                Some("a campaign that its outcomes or the clock end keeps its largest number of samples")
            }
            (_, Design::Grid) => Some("a grid does not grow: its points depend on their number"),
            _ if wanted < has => Some("a campaign gets more samples, and not fewer"),
            _ => None,
        }
    }

    /// Returns the settings: `--set` applies to every scenario.
    pub fn settings(&self) -> Vec<Setting> {
        let texts = self.scenarios.first().map_or(&[][..], |scenario| &scenario.settings);
        texts.iter().filter_map(|text| text.parse().ok()).collect()
    }

    /// Returns the manifest as JSON without the parts that do not affect the outcomes: the command
    /// line, whether it named a folder or a seed, the working folder, the paths of the scenario
    /// files, the partition, and the build of the program. It is the same for a campaign that ran
    /// in one go, in parts or with interruptions. Returns `None` if it cannot be written as JSON.
    pub fn determining_json(&self) -> Option<String> {
        let mut whole = self.whole();
        if let Some(end) = whole.closecall_version.find('+') {
            whole.closecall_version.truncate(end);
        }
        let mut value = serde_json::to_value(whole).ok()?;
        for name in ["command", "has_drawn_seed", "replaceable", "working_folder"] {
            value.as_object_mut()?.remove(name);
        }
        for scenario in value.get_mut("scenarios")?.as_array_mut()? {
            for name in INCIDENTAL_OF_SCENARIO {
                scenario.as_object_mut()?.remove(name);
            }
        }
        serde_json::to_string(&value).ok()
    }

    /// Returns the BLAKE3 hash of [`Self::determining_json`].
    pub fn configuration(&self) -> String {
        blake3::hash(self.determining_json().unwrap_or_default().as_bytes()).to_string()
    }

    /// Returns the folder in which the controllers of the campaign run, or `None` if it does not
    /// exist.
    pub fn controller_folder(&self) -> Option<&Path> {
        self.working_folder.as_deref().filter(|folder| folder.is_dir())
    }

    /// Returns one message for each difference between the controllers of the campaign and those
    /// that its commands start now.
    ///
    /// Only the controllers of the arms with these names are started.
    pub fn changed_controllers(&self, scenario: &Scenario, names: &[&str]) -> Vec<String> {
        let fingerprint = |choice| Fingerprint::of_choice(choice, self.controller_folder(), Some(scenario));
        let arms = self.arms.iter().zip(self.arm_names());
        let chosen = arms.filter(|(_, name)| names.contains(&name.as_str())).map(|(arm, _)| arm);
        let program = scenario.sensors.running_program();
        let program = program.map(|program| Fingerprint::of_program(&program, Some(scenario)));
        let now: Vec<_> = chosen.filter_map(fingerprint).chain(program).collect();
        let is_asked = |one: &&Fingerprint| now.iter().any(|other| other.command == one.command);
        let there: Vec<_> = self.controllers.iter().filter(is_asked).cloned().collect();
        fingerprint::differences(&there, &now)
    }

    /// Returns the perception programs that the scenarios name, each once. They run in the folder
    /// of the controllers.
    pub fn programs(&self) -> Vec<ProgramSettings> {
        let mut programs: Vec<ProgramSettings> = Vec::new();
        for scenario in &self.scenarios {
            let file = ScenarioFile::parse(Path::new(&scenario.path), &scenario.text, &[]);
            // A text that is no scenario cannot run either.
            let program = file.ok().and_then(|file| file.with_program_in(self.controller_folder()).program());
            programs.extend(program.filter(|program| !programs.contains(program)));
        }
        programs
    }

    /// Returns the values of `sensors.perception` in the texts of the scenarios, each once, without
    /// the built-in chain.
    ///
    /// The rest of a text does not matter. [`Self::programs`] misses the program of a text that is
    /// no scenario at this moment. Such a text may be a scenario elsewhere: beside another file, or
    /// with sampled values in place of the nominal ones.
    pub(crate) fn perceptions(&self) -> Vec<String> {
        let mut perceptions: Vec<String> = Vec::new();
        for scenario in &self.scenarios {
            // A text that is not TOML runs nothing.
            let text = toml::from_str::<toml::Table>(&scenario.text).unwrap_or_default();
            let perception = text.get("sensors").and_then(|sensors| sensors.get("perception"));
            let named = perception.and_then(toml::Value::as_str).filter(|name| *name != BUILT_IN);
            perceptions.extend(named.map(str::to_owned).filter(|name| !perceptions.contains(name)));
        }
        perceptions
    }

    /// Returns the commands, libraries and FMUs that the arms and the sensors run.
    pub fn foreign_code(&self) -> Vec<String> {
        let arms = self.arms.iter().filter(|arm| arm.exec().is_some() || arm.native().is_some());
        // An object of a Python program is not in the folder.
        let is_hosted = |name: &String| ProgramKind::split(name).is_some_and(|(kind, _)| kind == ProgramKind::Hosted);
        let perceptions = self.perceptions().into_iter().filter(|name| !is_hosted(name));
        arms.map(ToString::to_string).chain(perceptions).collect()
    }

    /// Returns the arms, the baseline first.
    pub fn arms(&self) -> Vec<Arm> {
        let controllers = ControllerChoice::factories(&self.arms, self.controller_folder());
        controllers.into_iter().map(|controller| Arm { controller, sensors: self.sensors }).collect()
    }

    /// Returns the names of the arms in reports and records.
    pub fn arm_names(&self) -> Vec<String> {
        ControllerChoice::names(&self.arms)
    }

    /// Returns the manifest of the whole campaign. This one may describe a part of it.
    pub fn whole(&self) -> Self {
        Self { partition: None, ..self.clone() }
    }
}

fn compare(key: &str, there: &Value, here: &Value, differences: &mut Vec<String>) {
    let within = |name: &str| if key.is_empty() { name.to_owned() } else { format!("{key}.{name}") };
    match (there, here) {
        (Value::Object(there), Value::Object(here)) => {
            let names = there.keys().chain(here.keys().filter(|name| !there.contains_key(*name)));
            let incidental: &[&str] = match key.split_once('.') {
                None if key.is_empty() => &INCIDENTAL,
                Some(("scenarios", _)) => &INCIDENTAL_OF_SCENARIO,
                _ => &[],
            };
            for name in names.filter(|name| !incidental.contains(&name.as_str())) {
                let part = |object: &serde_json::Map<String, Value>| object.get(name).cloned().unwrap_or(Value::Null);
                compare(&within(name), &part(there), &part(here), differences);
            }
        }
        (Value::Array(there), Value::Array(here)) if there.len() == here.len() => {
            for (index, (there, here)) in there.iter().zip(here).enumerate() {
                let name = there.get("name").and_then(Value::as_str).map_or_else(|| index.to_string(), str::to_owned);
                compare(&within(&name), there, here, differences);
            }
        }
        (Value::String(there), Value::String(here)) if there.contains('\n') || here.contains('\n') => {
            if let Some(line) = first_difference(there, here) {
                differences.push(format!("{key}: {line}"));
            }
        }
        _ if there == here => {}
        _ => {
            let [there, here] =
                [there, here].map(|value| shortened(&names(value).unwrap_or_else(|| value.to_string())));
            differences.push(format!("{key}: {there} there, {here} here"));
        }
    }
}

/// Returns the names of the elements of a list that all have one; `None` of another value.
fn names(value: &Value) -> Option<String> {
    let name = |element: &Value| element.get("name")?.as_str().map(str::to_owned);
    let names: Option<Vec<String>> = value.as_array()?.iter().map(name).collect();
    names.filter(|names| !names.is_empty()).map(|names| names.join(", "))
}

/// Largest number of characters of a value in a message.
const VALUE_CHARACTERS: usize = 120;

/// Returns the beginning of a value that is too long for a message.
fn shortened(text: &str) -> String {
    match text.char_indices().nth(VALUE_CHARACTERS) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.to_owned(),
    }
}

/// Returns the first line in which two texts differ, in words.
fn first_difference(there: &str, here: &str) -> Option<String> {
    let (mut there_lines, mut here_lines) = (there.lines(), here.lines());
    let mut line = 0;
    loop {
        line += 1;
        match (there_lines.next(), here_lines.next()) {
            (None, None) => return (there != here).then(|| "the ends of the texts differ".to_owned()),
            (there, here) if there == here => {}
            (there, here) => {
                let shown = |text: Option<&str>| {
                    text.map_or_else(|| "nothing".to_owned(), |text| format!("`{}`", shortened(text)))
                };
                return Some(format!("line {line} is {} there, {} here", shown(there), shown(here)));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use closecall_simulation::controller::exec::ExecSettings;

    use super::*;

    fn manifest() -> Manifest {
        Manifest {
            manifest_version: MANIFEST_VERSION,
            closecall_version: "0.1.0+00".to_owned(),
            scenarios: vec![ManifestScenario {
                name: "headline".to_owned(),
                path: "a.toml".to_owned(),
                blake3: "11".to_owned(),
                text: "one\ntwo\n".to_owned(),
                settings: Vec::new(),
            }],
            sampling: Sampling { seed: 1, design: Design::Random, samples: 10 },
            partition: None,
            arms: vec![ControllerChoice::MIS],
            sensors: None,
            checks: CheckPlan::default(),
            inference: Inference::default(),
            models: Vec::new(),
            sample_timeout_s: 300.0,
            controllers: Vec::new(),
            working_folder: None,
            retry_crashed: 0,
            without_effect: Vec::new(),
            left_out: Vec::new(),
            has_drawn_seed: false,
            replaceable: false,
            command: vec!["closecall".to_owned()],
        }
    }

    #[test]
    fn the_version_names_the_build() {
        let id = build_id(&std::env::current_exe().unwrap());
        #[cfg(target_os = "linux")]
        assert!(id.is_some(), "the linker writes a build ID");
        let digits = id.unwrap_or_default().iter().map(|byte| format!("{byte:02x}")).collect::<String>();
        let version = version();
        let (release, build) = version.split_once('+').unwrap();
        assert_eq!((release, build.len()), (env!("CARGO_PKG_VERSION"), BUILD_DIGITS));
        assert!(digits.is_empty() || digits.starts_with(build), "{digits} {build}");
        // A file that is not an executable has no identifier.
        assert_eq!(build_id(Path::new(env!("CARGO_MANIFEST_DIR")).join("Cargo.toml").as_path()), None);
    }

    #[test]
    fn the_hash_of_the_parts_covers_every_byte() {
        let path = tempfile::NamedTempFile::new().unwrap().into_temp_path();
        let hash_of = |bytes: &[u8]| {
            std::fs::write(&path, bytes).unwrap();
            parts_hash(&path).unwrap()
        };
        for length in [0, 1, 8, 1_003] {
            let mut bytes = vec![7; length];
            let hash = hash_of(&bytes);
            assert_eq!(hash_of(&bytes), hash);
            for changed in [0, length / 2, length.saturating_sub(1)].into_iter().filter(|at| *at < length) {
                bytes[changed] += 1;
                assert_ne!(hash_of(&bytes), hash);
                bytes[changed] -= 1;
            }
            bytes.push(7);
            assert_ne!(hash_of(&bytes), hash);
        }
    }

    #[test]
    fn the_command_and_paths_are_no_differences() {
        let mut other = manifest();
        other.command.push("--jobs=2".to_owned());
        other.scenarios[0].path = "b.toml".to_owned();
        assert_eq!(manifest().differences(&other), Vec::<String>::new());
        other.replaceable = true;
        assert_eq!(manifest().differences(&other), Vec::<String>::new());
        other.has_drawn_seed = true;
        assert_eq!(manifest().differences(&other), Vec::<String>::new());
        other.partition = Some("1/3".parse().unwrap());
        assert_eq!(manifest().determining_json(), other.determining_json());
    }

    #[test]
    fn a_campaign_grows_unless_its_samples_depend_on_their_number() {
        let with = |samples, design| Manifest { sampling: Sampling { seed: 1, design, samples }, ..manifest() };
        let of_design = |samples, design| Manifest { inference: Inference::Design, ..with(samples, design) };
        assert!(with(10, Design::Random).grows_to(&with(11, Design::Random)));
        assert!(of_design(10, Design::Sobol).grows_to(&of_design(11, Design::Sobol)));
        assert!(of_design(10, Design::Coverage).grows_to(&of_design(11, Design::Coverage)));
        assert!(!with(10, Design::Random).grows_to(&of_design(11, Design::Sobol)));
        assert!(!with(10, Design::Random).grows_to(&with(9, Design::Random)));
        assert!(!with(10, Design::Random).grows_to(&with(10, Design::Random)));
        assert!(!of_design(10, Design::Grid).grows_to(&of_design(20, Design::Grid)));
        assert!(!with(10, Design::Random).grows_to(&Manifest { retry_crashed: 1, ..with(20, Design::Random) }));
        let sequential = |samples| Manifest { inference: Inference::Sequential, ..with(samples, Design::Random) };
        assert!(!sequential(10).grows_to(&sequential(20)));
    }

    #[test]
    fn a_campaign_that_does_not_grow_says_why() {
        let with = |samples, design| Manifest { sampling: Sampling { seed: 1, design, samples }, ..manifest() };
        let sequential = |samples| Manifest { inference: Inference::Sequential, ..with(samples, Design::Random) };
        let said = |there: &Manifest, here: &Manifest| there.differences_in_growth(here).join("; ");
        let grid = said(&with(32, Design::Grid), &with(64, Design::Grid));
        assert_eq!(
            grid,
            "sampling.samples: 32 there, 64 here (a grid does not grow: its points depend on their number)"
        );
        assert!(
            said(&with(10, Design::Sobol), &with(9, Design::Sobol))
                .ends_with("9 here (a campaign gets more samples, and not fewer)")
        );
        assert!(
            said(&sequential(10), &sequential(20)).contains("20 here (a campaign that its outcomes or the clock end")
        );
        assert_eq!(said(&with(10, Design::Random), &with(20, Design::Random)), "sampling.samples: 10 there, 20 here");
        let other_seed = Manifest { sampling: Sampling { seed: 2, ..with(10, Design::Grid).sampling }, ..manifest() };
        assert_eq!(said(&with(10, Design::Grid), &other_seed), "sampling.seed: 1 there, 2 here");
    }

    /// A folder could else hide the program from the question whether it may run, and run it.
    #[test]
    fn a_program_is_named_whatever_else_is_wrong_with_the_scenario() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/library/low-thw-overtake.toml");
        let library = std::fs::read_to_string(path).unwrap();
        let with = |sensors: &str| {
            let mut manifest = manifest();
            manifest.scenarios[0].text = library.replacen("[sensors]\n", &format!("[sensors]\n{sensors}\n"), 1);
            manifest
        };
        let program = "perception = \"exec:sh evil.sh\"";
        let hidden = [
            String::new(),
            // A file that is beside the scenario in the folder only.
            "rear-lidar.pattern-file = \"beside.toml\"".to_owned(),
            // A parameter that some samples only have in the allowed range.
            "rear-lidar.mount-height-m = \"$no-such-parameter\"".to_owned(),
            "no-such-key = 1".to_owned(),
        ];
        for (index, more) in hidden.iter().enumerate() {
            let manifest = with(&format!("{program}\n{more}"));
            assert_eq!(manifest.programs().len(), usize::from(index == 0), "{more}");
            assert_eq!(manifest.foreign_code(), ["exec:sh evil.sh"], "{more}");
        }
        assert_eq!(with("perception = \"lib:./evil.so\"").foreign_code(), ["lib:./evil.so"]);
        for harmless in ["", "perception = \"built-in\"", "perception = \"python:mine\""] {
            assert_eq!(with(harmless).foreign_code(), Vec::<String>::new(), "{harmless}");
        }
        assert_eq!(with("perception = \"python:mine\"").perceptions(), ["python:mine"]);
    }

    #[test]
    fn another_command_of_a_controller_is_a_difference() {
        let with = |command: &str| {
            let exec = ExecSettings { command: command.to_owned(), timeout_ms: 1_000, memory_mib: 1_024 };
            Manifest { arms: vec![ControllerChoice::Exec(exec)], ..manifest() }
        };
        let differences = with("python3 a.py").differences(&with("python3 a.py --fast"));
        assert!(differences.len() == 1 && differences[0].contains("--fast"), "{differences:?}");
    }

    #[test]
    fn every_difference_is_named_with_both_values() {
        let mut other = manifest();
        other.closecall_version = "0.1.0+01".to_owned();
        other.sampling.seed = 2;
        other.partition = Some("1/3".parse().unwrap());
        other.arms = vec![ControllerChoice::ACC, ControllerChoice::MIS];
        other.sensors = Some(SensorMode::Full);
        other.sample_timeout_s = 10.0;
        other.scenarios[0].text = "one\nthree\n".to_owned();
        let mut differences = manifest().differences(&other);
        differences.sort();
        assert_eq!(
            differences,
            [
                "arms: [\"mis\"] there, [\"acc\",\"mis\"] here",
                "closecall_version: \"0.1.0+00\" there, \"0.1.0+01\" here",
                "partition: null there, \"1/3\" here",
                "sample_timeout_s: 300.0 there, 10.0 here",
                "sampling.seed: 1 there, 2 here",
                "scenarios.headline.text: line 2 is `two` there, `three` here",
                "sensors: null there, \"full\" here",
            ]
        );
        let mut longer = manifest();
        longer.scenarios.push(ManifestScenario { name: "twin".to_owned(), ..longer.scenarios[0].clone() });
        assert_eq!(manifest().differences(&longer), ["scenarios: headline there, headline, twin here"]);
    }
}
