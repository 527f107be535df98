//! The campaigns, and the tables that are made of them.

use std::error::Error;
use std::fmt::Write;
use std::path::{Path, PathBuf};

use closecall_campaign::ensemble::{MemberValue, Quantity, verdicts_of_arm};
use closecall_campaign::ledger::{ArmCounts, Pairs};
use closecall_campaign::plan::Plan;
use closecall_campaign::runner::Sampling;
use closecall_campaign::summary::Summary;
use closecall_scenarios::parameters::Variation;
use closecall_scenarios::sampling::Design;
use closecall_sensors::SensorMode;
use closecall_simulation::controller::ControllerChoice;
use closecall_simulation::scenario::ScenarioFile;
use closecall_simulation::scenario::member::{ensemble_of, members};

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

/// The member of the ensemble that has columns of its own: drivers who see only the vehicle directly ahead.
const NO_ANTICIPATION: &str = "anticipation-none";

/// How many samples of each scenario are run.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Study {
    /// With the drivers of the scenario.
    pub(crate) samples: u64,
    /// With each member of the driver ensemble.
    pub(crate) member_samples: u64,
    pub(crate) seed: u64,
}

impl Study {
    /// Runs every scenario of the library, with its own drivers and with every member of the ensemble, and returns the
    /// tables.
    pub(crate) fn tables(self) -> Result<String, Box<dyn Error>> {
        let Self { samples, member_samples, seed } = self;
        let mut text = format!(
            "`cargo run --release --example write_mis -- -n {samples} --member-samples {member_samples} --seed {seed}` writes these tables: \
             {samples} samples of each scenario with seed {seed}, {member_samples} of each scenario with each member of the ensemble, \
             `object` sensors, all arms on the same samples. Intervals are exact (Clopper-Pearson, 95 %). Shares of prevented collisions \
             refer to the collisions without the system, shares of induced collisions to all samples. Arms:"
        );
        let arms: Vec<String> = ARMS.iter().map(|(name, what)| format!(" `{name}` is {what}")).collect();
        writeln!(text, "{}.", arms.join(","))?;
        text.push_str(
            "\n### The drivers of the scenarios\n\n\
             | scenario | arm | collisions without | with | prevented | share of those without | induced | share of all | both | \
             harm prevented | harm induced | largest speed deficit (m/s) |\n|---|---|---|---|---|---|---|---|---|---|---|---|\n",
        );
        let library = library()?;
        for path in &library {
            let file = ScenarioFile::load(path, &[])?;
            let name = file.config().name.clone();
            text.push_str(&rows_of(&name, &self.run(vec![file], samples)?)?);
        }
        writeln!(
            text,
            "\n### The driver ensemble\n\nEach column has its own median and worst member, and the drivers who look only at the \
             vehicle directly ahead (`{NO_ANTICIPATION}`). A scenario without humans whom a member changes has no row.\n\n\
             | scenario | arm | prevented: median | worst | `{NO_ANTICIPATION}` | induced: median | worst | `{NO_ANTICIPATION}` | change of \
             harm per sample: median | worst |\n|---|---|---|---|---|---|---|---|---|---|"
        )?;
        let members = members(&[])?;
        for path in &library {
            let ensemble = ensemble_of(&[ScenarioFile::load(path, &[])?], &members)?;
            if !ensemble.entries.is_empty() {
                text.push_str(&ensemble_rows(&self.run(ensemble.entries, member_samples)?));
            }
        }
        Ok(text)
    }

    /// Runs scenarios in all arms.
    fn run(self, files: Vec<ScenarioFile>, samples: u64) -> Result<Summary, Box<dyn Error>> {
        // If nothing varies, all samples are the same.
        let is_fixed = files.iter().all(|file| file.space().variation() == Variation::None);
        let samples = if is_fixed { 1 } else { samples };
        let sampling = Sampling { seed: self.seed, design: Design::Random, samples };
        let arms = ARMS.iter().map(|(name, _)| name.parse()).collect::<Result<Vec<ControllerChoice>, _>>()?;
        let mut plan = Plan::new(files, sampling, arms)?;
        plan.sensors = Some(SensorMode::Object);
        let summary = plan.campaign().count()?;
        match summary.scenarios.iter().find(|(_, counts)| counts.errors() > 0) {
            Some((name, counts)) => Err(format!("{name}: {} runs ended in an error", counts.errors()).into()),
            None => Ok(summary),
        }
    }
}

/// Returns the rows of the members of one scenario: one for each arm but the baseline.
fn ensemble_rows(summary: &Summary) -> String {
    let mut text = String::new();
    for (tested, arm) in summary.controllers.iter().enumerate().skip(1) {
        for verdict in verdicts_of_arm(summary, &[], tested) {
            let of = |quantity: Quantity| verdict.spreads.iter().find(|spread| spread.quantity == quantity);
            let mut cells = vec![format!("`{}`", verdict.scenario), format!("`{arm}`")];
            for quantity in [Quantity::Prevented, Quantity::Induced] {
                let spread = of(quantity);
                let unseen =
                    spread.and_then(|spread| spread.values.iter().find(|value| value.member == NO_ANTICIPATION));
                cells.push(share_cell(spread.map(|spread| &spread.median), true));
                cells.push(share_cell(spread.map(|spread| &spread.worst), true));
                cells.push(share_cell(unseen, false));
            }
            let harm = |value: Option<&MemberValue>| {
                value.map_or("-".to_owned(), |found| format!("{:+.5} `{}`", found.value, found.member))
            };
            cells.push(harm(of(Quantity::HarmChange).map(|spread| &spread.median)));
            cells.push(harm(of(Quantity::HarmChange).map(|spread| &spread.worst)));
            text.push_str(&format!("| {} |\n", cells.join(" | ")));
        }
    }
    text
}

/// Returns a share with its interval and, if `is_named`, the member that has it.
fn share_cell(value: Option<&MemberValue>, is_named: bool) -> String {
    let Some(MemberValue { member, value, interval_95 }) = value else { return "-".to_owned() };
    let name = if is_named { format!(" `{member}`") } else { String::new() };
    let interval =
        interval_95.map_or(String::new(), |[low, high]| format!(" ({:.1} to {:.1})", 100.0 * low, 100.0 * high));
    format!("{:.1} %{interval}{name}", 100.0 * value)
}

/// Returns the rows of one scenario: one for each arm but the baseline.
fn rows_of(name: &str, summary: &Summary) -> Result<String, Box<dyn Error>> {
    let Some((_, counts)) = summary.scenarios.first() else { return Ok(String::new()) };
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
