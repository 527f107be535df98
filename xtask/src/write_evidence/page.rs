//! The sections of the pages, their markers, and where their figures come from.

use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::Command;

use clap::ValueEnum;

/// How many samples are run, with which seed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Size {
    /// Of each campaign.
    pub(crate) samples: u64,
    /// Of each member of the driver ensemble, of each scenario with surrounding traffic, of each
    /// fault.
    pub(crate) member_samples: u64,
    pub(crate) seed: u64,
}

/// A section of a page, which stands between markers of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Section {
    /// Every scenario with its own drivers and full sensors, but for the next two
    Scenarios,
    /// The scenarios with surrounding traffic, likewise
    Traffic,
    /// The scenarios that judge emergency braking or cruise control
    OtherFunctions,
    /// The agreement of the object-level sensors with the full ones
    Agreement,
    /// The driver ensemble with object-level sensors
    Ensemble,
    /// Every controller that ships, on the headline
    Arms,
    /// What becomes of the goal of 2 s
    Promise,
    /// Scenarios in which nothing happens ahead
    Twins,
    /// Every scenario without its event, with object-level sensors
    EventFree,
    /// The headline with one distribution changed
    Distributions,
    /// The headline with a lead vehicle that slows down and drives on
    Slowing,
    /// Every fault of the library
    Faults,
    /// The factors that move the headline
    Sensitivity,
    /// The settings of the system
    Frontier,
    /// Emergency braking against crash records
    Anchor,
    /// What the rear sensors see in each condition
    Conditions,
    /// What other rear LiDARs see
    Lidars,
    /// What two rear LiDARs see, and what a fault of one costs
    TwoLidars,
}

/// The file of the outcomes' digests, below the folder of the repository.
const DIGESTS: &str = "docs/evidence/determinism.json";
/// The digits of a fingerprint.
const DIGITS: usize = 12;

impl Section {
    pub(crate) const ALL: [Self; 18] = [
        Self::Scenarios,
        Self::Traffic,
        Self::OtherFunctions,
        Self::Agreement,
        Self::Ensemble,
        Self::Arms,
        Self::Promise,
        Self::Twins,
        Self::EventFree,
        Self::Distributions,
        Self::Slowing,
        Self::Faults,
        Self::Sensitivity,
        Self::Frontier,
        Self::Anchor,
        Self::Conditions,
        Self::Lidars,
        Self::TwoLidars,
    ];

    /// Returns the page, below the folder of the repository.
    pub(crate) const fn page(self) -> &'static str {
        match self {
            Self::Faults => "docs/evidence/faults.md",
            Self::Sensitivity | Self::Frontier => "docs/evidence/sensitivity.md",
            Self::Anchor => "docs/evidence/anchor.md",
            Self::Conditions | Self::Lidars | Self::TwoLidars => "docs/evidence/perception.md",
            _ => "docs/evidence/mis.md",
        }
    }

    /// Returns true if the figures rest on a scenario of the library, by its name in [`DIGESTS`].
    fn rests_on(self, scenario: &str) -> bool {
        let is_headline = scenario == "low-thw-overtake";
        match self {
            Self::Scenarios => super::scenarios::have(scenario) && !super::scenarios::have_as_traffic(scenario),
            Self::Traffic => super::scenarios::have_as_traffic(scenario),
            Self::OtherFunctions => super::scenarios::have_as_other_function(scenario),
            Self::Agreement | Self::Ensemble => super::scenarios::have(scenario),
            Self::Arms | Self::Promise | Self::Distributions | Self::Slowing | Self::Sensitivity => is_headline,
            Self::Conditions | Self::Lidars | Self::TwoLidars => is_headline,
            Self::Twins => super::rows::TWINS.contains(&scenario),
            Self::EventFree => super::rows::rests_without_event_on(scenario),
            Self::Faults => is_headline || scenario.starts_with("faults/"),
            Self::Anchor => scenario.starts_with("anchor/"),
            Self::Frontier => is_headline || scenario == "lead-brakes-at-any-time",
        }
    }

    /// Returns true if the figures rest on runs with full sensors.
    const fn is_full(self) -> bool {
        self.is_full_alone() || matches!(self, Self::Agreement | Self::Faults)
    }

    /// Returns true if the figures rest on no runs with object-level sensors.
    const fn is_full_alone(self) -> bool {
        matches!(
            self,
            Self::Scenarios
                | Self::Traffic
                | Self::OtherFunctions
                | Self::Promise
                | Self::Twins
                | Self::Conditions
                | Self::Lidars
                | Self::TwoLidars
        )
    }

    /// Returns the name on the command line.
    pub(crate) fn name(self) -> String {
        self.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
    }

    fn markers(self) -> [String; 2] {
        let name = self.name();
        [
            format!("<!-- evidence {name}: `xtask write-evidence {name}` writes the lines up to the next marker -->"),
            format!("<!-- evidence {name}: end -->"),
        ]
    }
}

/// Returns the folder of the repository, for the program and for the tests of the root package.
pub(crate) fn root() -> PathBuf {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    if folder.ends_with("xtask") { folder.join("..") } else { folder.to_owned() }
}

/// Returns the text of a section between its markers.
pub(crate) fn between_markers(page: &str, section: Section) -> Result<&str, String> {
    let [begin, end] = section.markers();
    let (_, after) = page.split_once(&begin).ok_or_else(|| format!("the page has no line `{begin}`"))?;
    let (written, _) = after.split_once(&end).ok_or_else(|| format!("the page has no line `{end}`"))?;
    Ok(written)
}

/// Returns a page with something else in one section.
pub(crate) fn with_section(page: &str, section: Section, written: &str) -> Result<String, String> {
    let [begin, end] = section.markers();
    let old = between_markers(page, section)?;
    Ok(page.replacen(&format!("{begin}{old}{end}"), &format!("{begin}\n\n{}\n\n{end}", written.trim_end()), 1))
}

/// Returns a written section with the rows of the older one, too, if they are of other scenarios.
/// The rows keep the order of the older section.
pub(crate) fn with_other_rows(written: &str, older: &str) -> Result<String, String> {
    let is_row = |line: &&str| line.starts_with("| `");
    let scenario = |line: &str| line.split(" | ").next().unwrap_or_default().to_owned();
    let outcomes =
        |text: &str| Some(text.lines().find(|line| line.contains("write-evidence "))?.rsplit('|').nth(1)?.to_owned());
    if outcomes(written) != outcomes(older) {
        return Err("outcomes have changed since the other rows were measured: write all of them".to_owned());
    }
    let mut new: Vec<&str> = written.lines().filter(is_row).collect();
    let mut rows = Vec::new();
    for line in older.lines().filter(is_row) {
        let name = scenario(line);
        let renewed: Vec<&str> = new.extract_if(.., |row| scenario(row) == name).collect();
        match renewed.is_empty() {
            false => rows.extend(renewed),
            true if written.lines().any(|row| scenario(row) == name) => {}
            true => rows.push(line),
        }
    }
    rows.extend(new);
    let head: Vec<&str> = written.lines().take_while(|line| !is_row(line)).collect();
    Ok([head, rows].concat().join("\n"))
}

/// Returns the outcomes that a section depends on, in a few digits: the outcomes of [`DIGESTS`]
/// in the modes of its runs, and with full sensors also the verdict of the headline that the README
/// shows.
pub(crate) fn outcomes(section: Section) -> Result<String, Box<dyn Error>> {
    let digests: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(root().join(DIGESTS))?)?;
    let mut hasher = blake3::Hasher::new();
    let digests = digests["outcomes"].as_object().ok_or("no outcomes have digests")?;
    for (scenario, of_modes) in digests.iter().filter(|(scenario, _)| section.rests_on(scenario)) {
        let shown = if section.is_full_alone() { &of_modes["ground-truth"] } else { of_modes };
        hasher.update(format!("{scenario} {shown}").as_bytes());
    }
    if section.is_full() {
        let readme = std::fs::read_to_string(root().join("README.md"))?;
        let shown = readme.split("```text\n").nth(1).and_then(|rest| rest.split("```").next());
        let shown = shown.ok_or("the README shows no output")?;
        // The time that it took differs from machine to machine.
        let lines = shown.lines().filter(|line| !line.contains(" simulated seconds in "));
        lines.for_each(|line| _ = hasher.update(line.as_bytes()));
    }
    Ok(hasher.finalize().to_hex().chars().take(DIGITS).collect())
}

/// Returns the table that says where the figures of a section come from.
pub(crate) fn provenance(section: Section, size: Size) -> Result<String, Box<dyn Error>> {
    let printed = |program: &str, arguments: &[&str]| {
        let output = Command::new(program).args(arguments).current_dir(root()).output().ok()?;
        output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
    };
    let commit = printed("git", &["rev-parse", "--short", "HEAD"]).unwrap_or_else(|| "unknown".to_owned());
    // Files outside the program, such as these pages, may differ.
    let changes = printed("git", &["status", "--porcelain", "--", "*.rs", "*.toml", "*.onnx", "Cargo.lock"]);
    let is_whole = changes.is_some_and(|changes| changes.is_empty());
    let commit = if is_whole { commit } else { format!("{commit}, modified") };
    let date = printed("date", &["+%Y-%m-%d"]).unwrap_or_else(|| "unknown".to_owned());
    let cpus = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = cpus.lines().find_map(|line| line.strip_prefix("model name")).unwrap_or("unknown processor");
    let model = model.trim_start_matches([' ', '\t', ':']);
    let Size { samples, member_samples, seed } = size;
    let name = section.name();
    Ok(format!(
        "| commit | date | machine | command | outcomes |\n|---|---|---|---|---|\n\
         | {commit} | {date} | {model}; the result does not depend on it | `just xtask write-evidence {name} -n {samples} \
         --member-samples {member_samples} --seed {seed}` | {} |\n",
        outcomes(section)?
    ))
}
