//! Every scenario of the library: in every arm, with every member of the driver ensemble, and in
//! both sensor modes.

use std::error::Error;
use std::fmt::Write;
use std::path::PathBuf;

use closecall_campaign::ensemble::{MemberValue, Quantity, verdicts_of_arm};
use closecall_campaign::execution::Campaign;
use closecall_campaign::ledger::{ArmCounts, Pairs};
use closecall_campaign::plan::Plan;
use closecall_campaign::runner::Sampling;
use closecall_campaign::summary::Summary;
use closecall_scenarios::ScenarioFile;
use closecall_scenarios::member::{ensemble_of, members};
use closecall_scenarios::parameters::Variation;
use closecall_scenarios::sampling::Design;
use closecall_sensors::SensorMode;
use closecall_simulation::controller::ControllerChoice;
use closecall_studies::perception::agreement::{Agreement, Pair};

use super::page::{self, Size};

/// The arms, the baseline first. The others are compared with it.
const ARMS: [(&str, &str); 4] = [
    ("acc", "the cruise control alone"),
    ("mis", "the paper's system"),
    ("mis-extended", "the extended system"),
    ("gap-1.6", "a constant gap of 1.6 s"),
];

/// The member of the ensemble that has columns of its own: drivers who see only the vehicle
/// directly ahead.
const NO_ANTICIPATION: &str = "anticipation-none";

/// The folders of scenarios that judge the margin increase system. Faults have a page of their own,
/// and the headline as recorded a table: in some of its samples there is no room for `gap-1.6`.
const FOLDERS: [&str; 3] = ["", "ramp", TRAFFIC];

/// The folder of the scenarios with surrounding traffic, which take longer.
const TRAFFIC: &str = "traffic";

/// The folders of scenarios that judge another function. Emergency braking beside a human driver
/// has a page of its own.
const OTHER_FUNCTIONS: [&str; 2] = ["acc", "aeb"];

/// Returns the folder of a scenario, by its path below the folder of the library.
fn folder_of(scenario: &str) -> &str {
    scenario.rsplit_once('/').map_or("", |(folder, _)| folder)
}

/// Returns true if the tables have a scenario, by its path below the folder of the library.
pub(super) fn have(scenario: &str) -> bool {
    FOLDERS.contains(&folder_of(scenario))
}

/// Returns true if a scenario has surrounding traffic, by its path below the folder of the library.
pub(super) fn have_as_traffic(scenario: &str) -> bool {
    folder_of(scenario) == TRAFFIC
}

/// Returns true if the table of the other functions has a scenario, by its path below the folder of
/// the library.
pub(super) fn have_as_other_function(scenario: &str) -> bool {
    OTHER_FUNCTIONS.contains(&folder_of(scenario))
}

/// A scenario of the library, with the number of samples that its table rests on.
struct Entry {
    /// The folder of the scenario, below the folder of the library.
    folder: &'static str,
    file: ScenarioFile,
    samples: u64,
}

/// The head of a table of pairs of arms.
const COLUMNS: &str = "\n| scenario | arm | samples | collisions without | with | prevented | share of those without | \
                       induced | share of all | both | harm prevented | harm induced | largest speed deficit (m/s) |\n\
                       |---|---|---|---|---|---|---|---|---|---|---|---|---|\n";

/// Returns the description of the table of a section.
fn head(sentence: &str) -> String {
    let arms: Vec<String> = ARMS.iter().map(|(name, meaning)| format!(" `{name}` is {meaning}")).collect();
    format!(
        "{sentence} All arms run on the same samples. Intervals are exact (Clopper-Pearson, 95 %). Shares of prevented \
         collisions refer to the collisions without the system, shares of induced collisions to all samples. Arms:{}.\n",
        arms.join(",")
    )
}

/// Returns the table of the scenarios with their own drivers but for those with surrounding traffic.
pub(super) fn library(size: Size, only: &[String]) -> Result<String, Box<dyn Error>> {
    table(size, only, |folder| folder != TRAFFIC)
}

/// Returns the table of the scenarios with surrounding traffic, with their own drivers.
pub(super) fn traffic(size: Size, only: &[String]) -> Result<String, Box<dyn Error>> {
    table(size, only, |folder| folder == TRAFFIC)
}

/// Returns the table of the scenarios of these folders in every arm. It takes hours: each scenario's
/// rows appear as soon as they are known.
#[expect(clippy::print_stderr, reason = "a program on the command line")]
fn table(size: Size, only: &[String], has: impl Fn(&str) -> bool) -> Result<String, Box<dyn Error>> {
    let mut text = head(&format!("Each scenario with seed {} and `full` sensors.", size.seed));
    text.push_str(COLUMNS);
    let arms = ARMS.map(|(name, _)| name);
    for Entry { file, samples, .. } in entries(size, only)?.into_iter().filter(|entry| has(entry.folder)) {
        let size = Size { samples, ..size };
        let name = file.config().name.clone();
        let rows = rows_of(&name, samples, &run(vec![file], size, Some(SensorMode::Full), &arms)?)?;
        eprint!("{rows}");
        text.push_str(&rows);
    }
    Ok(text)
}

/// Returns the table of the scenarios that judge emergency braking or cruise control.
pub(super) fn other_functions(size: Size, only: &[String]) -> Result<String, Box<dyn Error>> {
    let Size { samples, seed, .. } = size;
    let mut text = format!(
        "Scenarios that judge emergency braking or cruise control, with seed {seed} and `full` sensors. Each is compared \
         with the same stack without the function.\n{COLUMNS}"
    );
    for path in OTHER_FUNCTIONS.map(files_of).into_iter().collect::<Result<Vec<_>, _>>()?.concat() {
        let file = ScenarioFile::load(&path, &[])?;
        let arms = ControllerChoice::of_function(file.config().function).map(|arm| arm.to_string());
        let arms = arms.each_ref().map(String::as_str);
        let name = file.config().name.clone();
        if is_meant(&name, only) {
            text.push_str(&rows_of(&name, samples, &run(vec![file], size, Some(SensorMode::Full), &arms)?)?);
        }
    }
    Ok(text)
}

/// Returns the agreement of the sensor modes in every scenario.
pub(super) fn agreement(size: Size, only: &[String]) -> Result<String, Box<dyn Error>> {
    let Size { member_samples, seed, .. } = size;
    let mut text = format!(
        "Collisions of the ego with the controller `mis`, on the same samples with `full` and with `object` sensors, with \
         seed {seed}. κ is Cohen's; it is undefined if no run or every run collides.\n\n\
         | scenario | samples | collisions: `full` | `object` | samples that differ | κ |\n|---|---|---|---|---|---|\n"
    );
    for Entry { file, samples, .. } in entries(size, only)? {
        let samples = samples.min(member_samples);
        let agreement = Agreement::of(&file, seed, samples)?;
        let collisions = |has: fn(&Pair) -> bool| agreement.pairs.iter().filter(|pair| has(pair)).count();
        writeln!(
            text,
            "| `{}` | {samples} | {} | {} | {} | {} |",
            file.config().name,
            collisions(|pair| pair.full.has_collided),
            collisions(|pair| pair.object.has_collided),
            collisions(Pair::differs),
            agreement.kappa().map_or_else(|| "-".to_owned(), |kappa| format!("{kappa:.2}"))
        )?;
    }
    Ok(text)
}

/// Returns the table of the driver ensemble.
pub(super) fn ensemble(size: Size) -> Result<String, Box<dyn Error>> {
    let Size { member_samples, seed, .. } = size;
    let mut text = head(&format!(
        "{member_samples} samples of each scenario with each member of the ensemble, with seed {seed} and `object` sensors."
    ));
    writeln!(
        text,
        "\nEach column has its own median and worst member, and the drivers who look only at the vehicle directly ahead \
         (`{NO_ANTICIPATION}`). The intervals of the median and the worst member are simultaneous. A scenario without \
         humans whom a member changes has no row.\n\n\
         | scenario | arm | prevented: median | worst | `{NO_ANTICIPATION}` | induced: median | worst | \
         `{NO_ANTICIPATION}` | change of harm per sample: median | worst |\n|---|---|---|---|---|---|---|---|---|---|"
    )?;
    let members = members(&[])?;
    let size = Size { samples: member_samples, ..size };
    for Entry { file, .. } in entries(size, &[])? {
        let ensemble = ensemble_of(&[file], &members)?;
        if !ensemble.entries.is_empty() {
            let arms = ARMS.map(|(name, _)| name);
            text.push_str(&ensemble_rows(&run(ensemble.entries, size, Some(SensorMode::Object), &arms)?));
        }
    }
    Ok(text)
}

/// Returns the scenarios that judge the margin increase system, folder by folder in alphabetical
/// order; scenarios with surrounding traffic come last. `only` names those that are meant; it is
/// empty for all.
fn entries(size: Size, only: &[String]) -> Result<Vec<Entry>, Box<dyn Error>> {
    let mut entries = Vec::new();
    for folder in FOLDERS {
        let samples = if folder == TRAFFIC { size.member_samples } else { size.samples };
        for path in files_of(folder)? {
            let file = ScenarioFile::load(&path, &[])?;
            // If nothing varies, all samples are the same.
            let is_fixed = file.space().variation() == Variation::None;
            if is_meant(&file.config().name, only) {
                entries.push(Entry { folder, file, samples: if is_fixed { 1 } else { samples } });
            }
        }
    }
    Ok(entries)
}

/// Returns true if a scenario is one of these, or if these are none.
fn is_meant(name: &str, only: &[String]) -> bool {
    only.is_empty() || only.iter().any(|meant| meant == name)
}

/// Runs scenarios in arms, the baseline first; with the sensors of the scenario if `mode` is
/// `None`.
pub(super) fn run(
    files: Vec<ScenarioFile>,
    size: Size,
    mode: Option<SensorMode>,
    arms: &[&str],
) -> Result<Summary, Box<dyn Error>> {
    let summary = campaign(files, size, mode, arms)?.count()?;
    match summary.scenarios.iter().find(|(_, counts)| counts.errors() > 0) {
        Some((name, counts)) => Err(format!("{name}: {} runs ended in an error", counts.errors()).into()),
        None => Ok(summary),
    }
}

/// Returns a campaign of all these scenarios.
pub(super) fn campaign(
    files: Vec<ScenarioFile>,
    size: Size,
    mode: Option<SensorMode>,
    arms: &[&str],
) -> Result<Campaign, Box<dyn Error>> {
    let sampling = Sampling { seed: size.seed, design: Design::Random, samples: size.samples };
    let arms = arms.iter().map(|name| name.parse()).collect::<Result<Vec<ControllerChoice>, _>>()?;
    let mut plan = Plan::new(files, sampling, arms)?;
    plan.sensors = mode;
    Ok(plan.campaign())
}

/// Returns the rows of the members of one scenario: one for each arm but the baseline.
fn ensemble_rows(summary: &Summary) -> String {
    let mut text = String::new();
    for (tested, arm) in summary.controllers.iter().enumerate().skip(1) {
        for verdict in verdicts_of_arm(summary, &[], tested) {
            let spread_of = |quantity: Quantity| verdict.spreads.iter().find(|spread| spread.quantity == quantity);
            let mut cells = vec![format!("`{}`", verdict.scenario), format!("`{arm}`")];
            for quantity in [Quantity::Prevented, Quantity::Induced] {
                let spread = spread_of(quantity);
                let unseen =
                    spread.and_then(|spread| spread.values.iter().find(|value| value.member == NO_ANTICIPATION));
                cells.push(share_cell(spread.map(|spread| &spread.median), true));
                cells.push(share_cell(spread.map(|spread| &spread.worst), true));
                cells.push(share_cell(unseen, false));
            }
            let harm = |value: Option<&MemberValue>| {
                value.map_or("-".to_owned(), |extreme| format!("{:+.5} `{}`", extreme.value, extreme.member))
            };
            cells.push(harm(spread_of(Quantity::HarmChange).map(|spread| &spread.median)));
            cells.push(harm(spread_of(Quantity::HarmChange).map(|spread| &spread.worst)));
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
fn rows_of(name: &str, samples: u64, summary: &Summary) -> Result<String, Box<dyn Error>> {
    let Some((_, counts)) = summary.scenarios.first() else { return Ok(String::new()) };
    let mut text = String::new();
    for pair in counts.arm_pairs.iter().filter(|pair| pair.baseline == 0) {
        let (without, with) = (counts.arms[0], counts.arms[pair.tested]);
        let arm = &summary.controllers[pair.tested];
        writeln!(text, "| `{name}` | `{arm}` | {samples} | {} |", cells(summary, &without, &with, &pair.pairs))?;
    }
    Ok(text)
}

/// Returns a share in per cent with its exact interval.
pub(super) fn share(summary: &Summary, hits: u64, total: u64) -> String {
    match summary.inference.interval_95(hits, total) {
        Some([low, high]) if total > 0 => {
            let share = 100.0 * hits as f64 / total as f64;
            format!("{share:.1} % ({:.1} to {:.1})", 100.0 * low, 100.0 * high)
        }
        _ => "-".to_owned(),
    }
}

/// Returns the cells of one row behind the name of the arm.
fn cells(summary: &Summary, without: &ArmCounts, with: &ArmCounts, pairs: &Pairs) -> String {
    [
        without.collisions.to_string(),
        with.collisions.to_string(),
        pairs.prevented.to_string(),
        share(summary, pairs.prevented, without.collisions),
        pairs.induced.to_string(),
        share(summary, pairs.induced, pairs.samples()),
        pairs.both.to_string(),
        format!("{:.2}", pairs.prevented_harm),
        format!("{:.2}", pairs.induced_harm),
        format!("{:.1}", with.max_speed_deficit_mps),
    ]
    .join(" | ")
}

/// Returns the scenario files of a folder of the library, in alphabetical order.
pub(super) fn files_of(folder: &str) -> Result<Vec<PathBuf>, Box<dyn Error>> {
    let folder = page::root().join("scenarios/library").join(folder);
    let mut files: Vec<PathBuf> =
        std::fs::read_dir(folder)?.map(|entry| Ok(entry?.path())).collect::<std::io::Result<_>>()?;
    files.retain(|path| path.extension().is_some_and(|end| end == "toml"));
    files.sort();
    Ok(files)
}
