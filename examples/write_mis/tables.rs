//! The campaigns, and the tables that are made of them.

use std::error::Error;
use std::fmt::Write;
use std::path::{Path, PathBuf};

use closecall_campaign::ledger::{ArmCounts, Pairs};
use closecall_campaign::plan::Plan;
use closecall_campaign::runner::Sampling;
use closecall_campaign::summary::Summary;
use closecall_scenarios::parameters::Variation;
use closecall_scenarios::sampling::Design;
use closecall_sensors::SensorMode;
use closecall_simulation::controller::ControllerChoice;
use closecall_simulation::scenario::{ScenarioFile, Setting};

/// The line before the tables.
const BEGIN: &str = "<!-- write_mis: the lines up to the next marker are written by examples/write_mis -->";
/// The line behind the tables.
const END: &str = "<!-- write_mis: end -->";

/// The arms, the baseline first. The others are compared with it.
const ARMS: [(&str, &str); 4] = [
    ("acc", "the cruise control alone"),
    ("mis", "the paper's system"),
    ("mis-extended", "the extended system"),
    ("gap-1.6", "a constant gap of 1.6 s"),
];

/// The drivers that the scenarios are run with: a name, and the settings that make them.
#[derive(Clone, Debug)]
pub(crate) struct Member {
    name: String,
    settings: Vec<String>,
}

/// Returns the members that the tables are written for. Each further one adds a table.
pub(crate) fn members() -> Vec<Member> {
    vec![Member { name: "The drivers of the scenarios".to_owned(), settings: Vec::new() }]
}

/// How many samples of each scenario are run.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Study {
    pub(crate) samples: u64,
    pub(crate) seed: u64,
}

impl Study {
    /// Runs every scenario of the library with every member, and returns the tables.
    pub(crate) fn tables(self, members: &[Member]) -> Result<String, Box<dyn Error>> {
        let Self { samples, seed } = self;
        let mut text = format!(
            "The tables of this section are written by `cargo run --release --example write_mis -- -n {samples} --seed {seed}`: \
             {samples} samples of each scenario with seed {seed}, `object` sensors, all arms on the same samples. Intervals are exact \
             (Clopper-Pearson, 95 %): of the prevented collisions as a share of those without the system, of the induced ones as a \
             share of all samples. Arms:"
        );
        let arms: Vec<String> = ARMS.iter().map(|(name, what)| format!(" `{name}` is {what}")).collect();
        writeln!(text, "{}.", arms.join(","))?;
        for member in members {
            writeln!(text, "\n### {}\n", member.name)?;
            text.push_str(
                "| scenario | arm | collisions without | with | prevented | share of those without | induced | share of all | both | \
                 harm prevented | harm induced | largest speed deficit (m/s) |\n|---|---|---|---|---|---|---|---|---|---|---|---|\n",
            );
            for path in library()? {
                text.push_str(&self.rows(&path, member)?);
            }
        }
        Ok(text)
    }

    /// Runs one scenario, and returns its rows.
    fn rows(self, path: &Path, member: &Member) -> Result<String, Box<dyn Error>> {
        let settings = member.settings.iter().map(|text| text.parse()).collect::<Result<Vec<Setting>, _>>()?;
        let file = ScenarioFile::load(path, &settings)?;
        let name = file.config().name.clone();
        // If nothing varies, all samples are the same.
        let samples = if file.space().variation() == Variation::None { 1 } else { self.samples };
        let sampling = Sampling { seed: self.seed, design: Design::Random, samples };
        let arms = ARMS.iter().map(|(name, _)| name.parse()).collect::<Result<Vec<ControllerChoice>, _>>()?;
        let mut plan = Plan::new(vec![file], sampling, arms)?;
        plan.sensors = Some(SensorMode::Object);
        let summary = plan.campaign().count()?;
        rows_of(&name, &summary)
    }
}

/// Returns the rows of one scenario: one for each arm but the baseline.
fn rows_of(name: &str, summary: &Summary) -> Result<String, Box<dyn Error>> {
    let Some((_, counts)) = summary.scenarios.first() else { return Ok(String::new()) };
    if counts.errors() > 0 {
        return Err(format!("{name}: {} runs ended in an error", counts.errors()).into());
    }
    let mut text = String::new();
    for pair in counts.arm_pairs.iter().filter(|pair| pair.baseline == 0) {
        let (without, with) = (counts.arms[0], counts.arms[pair.tested]);
        let arm = &summary.controllers[pair.tested];
        writeln!(text, "| `{name}` | `{arm}` | {} |", cells(summary, &without, &with, &pair.pairs))?;
    }
    Ok(text)
}

/// Returns the cells of one row behind the name of the arm.
fn cells(summary: &Summary, without: &ArmCounts, with: &ArmCounts, pairs: &Pairs) -> String {
    let share = |hits: u64, of: u64| {
        let [low, high] = summary.inference.interval_95(hits, of).map(|bound| 100.0 * bound);
        if of == 0 {
            "-".to_owned()
        } else {
            format!("{:.1} % ({low:.1} to {high:.1})", 100.0 * hits as f64 / of as f64)
        }
    };
    [
        without.collisions.to_string(),
        with.collisions.to_string(),
        pairs.prevented.to_string(),
        share(pairs.prevented, without.collisions),
        pairs.induced.to_string(),
        share(pairs.induced, pairs.samples()),
        pairs.both.to_string(),
        format!("{:.2}", pairs.prevented_harm),
        format!("{:.2}", pairs.induced_harm),
        format!("{:.1}", with.max_speed_deficit_mps),
    ]
    .join(" | ")
}

/// Returns the files of the library, in alphabetical order.
fn library() -> Result<Vec<PathBuf>, Box<dyn Error>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/library");
    let mut files: Vec<PathBuf> =
        std::fs::read_dir(folder)?.map(|entry| Ok(entry?.path())).collect::<std::io::Result<_>>()?;
    files.retain(|path| path.extension().is_some_and(|end| end == "toml"));
    files.sort();
    Ok(files)
}

/// Returns the lines of a page between the markers.
pub(crate) fn between_markers(page: &str) -> Result<&str, String> {
    let (_, after) = page.split_once(BEGIN).ok_or_else(|| format!("the page has no line `{BEGIN}`"))?;
    let (tables, _) = after.split_once(END).ok_or_else(|| format!("the page has no line `{END}`"))?;
    Ok(tables)
}

/// Returns a page with other tables between its markers.
pub(crate) fn page_with(page: &str, tables: &str) -> Result<String, String> {
    let old = between_markers(page)?;
    Ok(page.replacen(&format!("{BEGIN}{old}{END}"), &format!("{BEGIN}\n\n{tables}\n{END}"), 1))
}
