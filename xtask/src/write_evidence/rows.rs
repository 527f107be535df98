//! Tables with a campaign in each row.

use std::error::Error;
use std::fmt::Write;
use std::ops::ControlFlow;
use std::path::PathBuf;

use closecall_campaign::ledger::{ArmCounts, Pairs};
use closecall_campaign::summary::Summary;
use closecall_scenarios::{ScenarioFile, Setting};
use closecall_sensors::SensorMode;

use super::page::{self, Size};
use super::scenarios::{campaign, files_of, run, share};

/// A row of a table of pairs: the words in its first cell, and the changes of the scenario.
struct Row {
    words: &'static str,
    settings: &'static [&'static str],
}

const HEADLINE: &str = "low-thw-overtake";

/// The headline with one distribution changed.
const DISTRIBUTIONS: [Row; 9] = [
    Row { words: "nothing", settings: &[] },
    Row {
        words: "reaction time: median 0.75 s (an expected event)",
        settings: &["parameters.reaction-s.log-normal.median=0.75"],
    },
    Row { words: "reaction time: median 1.5 s (surprise)", settings: &["parameters.reaction-s.log-normal.median=1.5"] },
    Row { words: "evasive steering: none", settings: &["evasive-lateral-mps2=0.0"] },
    Row { words: "evasive steering: 1 m/s²", settings: &["evasive-lateral-mps2=1.0"] },
    Row { words: "evasive steering: 4.3 m/s²", settings: &["evasive-lateral-mps2=4.3"] },
    Row { words: "hardest braking: 5 m/s²", settings: &["hardest-braking-mps2=5.0"] },
    Row { words: "hardest braking: 8 m/s²", settings: &["hardest-braking-mps2=8.0"] },
    Row { words: "cc1: 0.15 s", settings: &["rear-cc1-s=0.15"] },
];

/// Scenarios in which nothing happens ahead: the twins of scenarios with a hazard, and scenarios
/// that never had a hazard.
pub(super) const TWINS: [&str; 10] = [
    "cut-in-into-margin-without-cut-in",
    "overtake-without-brake",
    "rear-follower-stays",
    "rear-vehicle-is-followed-without-brake",
    "rear-vehicles-one-after-another-without-brake",
    "slow-approach",
    "empty-wet-road",
    "traffic/busy-overtake-without-brake",
    "traffic/dense-traffic",
    "traffic/trucks-alongside",
];

/// Scenarios in which the lead vehicle brakes, with the parameter of its speed and the arms that
/// run them. Without the braking they have no twin in the library: the drivers of [`TWINS`]
/// differ from theirs.
const BRAKING: [(&str, &str, [&str; 2]); 3] = [
    (HEADLINE, "cruise-mps", ["acc", "mis"]),
    ("as-recorded/low-thw-overtake-as-recorded", "following-mps", ["acc", "mis"]),
    ("anchor/anchor-lead-brakes", "following-mps", ["human-aeb", "human+aeb"]),
];

/// A scenario in which nobody can overtake, and nothing happens ahead.
const BLOCKED: &str = "left-lane-blocked";

/// Returns true if a scenario is run without its event.
pub(super) fn rests_without_event_on(scenario: &str) -> bool {
    scenario == BLOCKED || TWINS.contains(&scenario) || BRAKING.iter().any(|(name, ..)| *name == scenario)
}

/// The controllers that ship, the baseline first.
const ARMS: [&str; 9] = ["acc", "mis", "mis-ttce", "mis-extended", "gap-1.2", "gap-1.6", "gap-2.0", "blind", "crawl"];

/// The columns of a table of pairs behind the first.
const COLUMNS: &str =
    "samples | collisions without | with | prevented | share of those without (95 %) | induced | share of all (95 %)";

/// Loads a scenario of the library.
fn load(name: &str, settings: &[&str]) -> Result<ScenarioFile, Box<dyn Error>> {
    let path: PathBuf = page::root().join("scenarios/library").join(name).with_extension("toml");
    let settings = settings.iter().map(|text| text.parse()).collect::<Result<Vec<Setting>, _>>()?;
    Ok(ScenarioFile::load(&path, &settings)?)
}

/// Runs a scenario with the cruise control alone and with the system.
fn pair(file: ScenarioFile, size: Size, mode: Option<SensorMode>) -> Result<Summary, Box<dyn Error>> {
    run(vec![file], size, mode, &["acc", "mis"])
}

/// Returns the cells of a pair of arms.
fn cells(summary: &Summary, [without, with]: [&ArmCounts; 2], pairs: &Pairs) -> String {
    [
        pairs.samples().to_string(),
        without.collisions.to_string(),
        with.collisions.to_string(),
        pairs.prevented.to_string(),
        share(summary, pairs.prevented, without.collisions),
        pairs.induced.to_string(),
        share(summary, pairs.induced, pairs.samples()),
    ]
    .join(" | ")
}

/// Returns the cells of the first scenario of a campaign with two arms.
fn cells_of(summary: &Summary) -> Result<String, Box<dyn Error>> {
    let (_, counts) = summary.scenarios.first().ok_or("a campaign without a scenario")?;
    Ok(cells(summary, [&counts.arms[0], &counts.arms[1]], &counts.pairs))
}

/// Returns the head of a table of pairs.
fn header(first: &str) -> String {
    format!("| {first} | {COLUMNS} |\n|---|---|---|---|---|---|---|---|\n")
}

/// Returns a table of changes of a scenario, with object-level sensors.
fn changes(first: &str, size: Size, rows: &[Row]) -> Result<String, Box<dyn Error>> {
    let mut text = header(first);
    for Row { words, settings } in rows {
        let summary = pair(load(HEADLINE, settings)?, size, Some(SensorMode::Object))?;
        writeln!(text, "| {words} | {} |", cells_of(&summary)?)?;
    }
    Ok(text)
}

/// The headline with one distribution changed.
pub(super) fn distributions(size: Size) -> Result<String, Box<dyn Error>> {
    changes("what is changed", size, &DISTRIBUTIONS)
}

/// The headline with a lead vehicle that slows down and drives on.
pub(super) fn slowing(size: Size) -> Result<String, Box<dyn Error>> {
    let settings = &["actor.front.event.front-brakes.then.brake.to-speed-mps=20.0"];
    changes("lead vehicle", size, &[Row { words: "brakes to 20 m/s", settings }])
}

/// Every controller that ships, on the headline with object-level sensors: the collisions that it
/// prevents and induces, and its costs.
pub(super) fn arms(size: Size) -> Result<String, Box<dyn Error>> {
    let summary = run(vec![load(HEADLINE, &[])?], size, Some(SensorMode::Object), &ARMS)?;
    let (_, counts) = summary.scenarios.first().ok_or("a campaign without a scenario")?;
    let mut text = format!(
        "`{HEADLINE}` with `object` sensors, every arm on the same samples, beside `acc`. The means are over all samples, \
         until the lead vehicle brakes.\n\n\
         | arm | {COLUMNS} | time lost (s) | largest speed deficit (m/s): mean | hardest braking of the vehicle behind (m/s²): \
         mean |\n|---|---|---|---|---|---|---|---|---|---|---|\n"
    );
    for pair in counts.arm_pairs.iter().filter(|pair| pair.baseline == 0) {
        let (without, with) = (&counts.arms[0], &counts.arms[pair.tested]);
        let mean = with.mean_cost().unwrap_or_default();
        let means =
            [mean.time_lost_s, mean.speed_deficit_mps, mean.imposed_braking_mps2].map(|mean| format!("{mean:.2}"));
        let cells = cells(&summary, [without, with], &pair.pairs);
        writeln!(text, "| `{}` | {cells} | {} |", summary.controllers[pair.tested], means.join(" | "))?;
    }
    Ok(text)
}

/// What becomes of the goal, on the headline with full sensors.
pub(super) fn promise(size: Size) -> Result<String, Box<dyn Error>> {
    let summary = pair(load(HEADLINE, &[])?, size, Some(SensorMode::Full))?;
    let (_, counts) = summary.scenarios.first().ok_or("a campaign without a scenario")?;
    let mut text = format!(
        "`{HEADLINE}` with `full` sensors.\n\n| what becomes of the goal | of {} encounters |\n|---|---|\n",
        counts.samples
    );
    for (goal, samples) in &counts.goals {
        writeln!(text, "| {} | {samples} |", goal.text())?;
    }
    writeln!(text, "\n| why a collision is not prevented | of {} |\n|---|---|", counts.pairs.both)?;
    for (hindrance, samples) in &counts.not_prevented {
        writeln!(text, "| {hindrance} | {samples} |")?;
    }
    Ok(text)
}

/// Scenarios in which nothing happens ahead, with full sensors.
pub(super) fn twins(size: Size) -> Result<String, Box<dyn Error>> {
    let mut text = header("scenario");
    for name in TWINS {
        let samples = if name.starts_with("traffic/") { size.member_samples } else { size.samples };
        let summary = pair(load(name, &[])?, Size { samples, ..size }, Some(SensorMode::Full))?;
        writeln!(text, "| `{name}` | {} |", cells_of(&summary)?)?;
    }
    Ok(text)
}

/// Every scenario without its event, with object-level sensors: the collisions that its drivers
/// have without the system, and those that the system induces.
pub(super) fn event_free(size: Size) -> Result<String, Box<dyn Error>> {
    let mut text = "`object` sensors. The arms are `acc` and `mis`; in `anchor-lead-brakes` a human drives the ego, without and \
                    with emergency braking. In the rows that say so, the lead vehicle keeps its speed instead of braking.\n\n\
                    | scenario | samples | the ego collides without the system | others collide with each other without it | \
                    induced | share of all (95 %) |\n|---|---|---|---|---|---|\n"
        .to_owned();
    let mut row = |words: &str, file: ScenarioFile, arms: &[&str], samples| -> Result<(), Box<dyn Error>> {
        let campaign = campaign(vec![file], Size { samples, ..size }, Some(SensorMode::Object), arms)?;
        let mut summary = campaign.summary();
        let mut others = 0_u64;
        campaign.run(None, |next| {
            summary.push(next.record);
            others += u64::from(next.record.tallies().first().is_some_and(|without| without.others_collided));
            ControlFlow::Continue(())
        })?;
        let (_, counts) = summary.scenarios.first().ok_or("a campaign without a scenario")?;
        let Pairs { induced, .. } = counts.pairs;
        let (samples, collisions) = (counts.pairs.samples(), counts.arms[0].collisions);
        let share = share(&summary, induced, samples);
        writeln!(text, "| {words} | {samples} | {collisions} | {others} | {induced} | {share} |")?;
        Ok(())
    };
    for name in TWINS.into_iter().chain([BLOCKED]) {
        let samples = if name.starts_with("traffic/") { size.member_samples } else { size.samples };
        row(&format!("`{name}`"), load(name, &[])?, &["acc", "mis"], samples)?;
    }
    for (name, speed, arms) in BRAKING {
        let keeps_speed = format!("actor.front.event.front-brakes.then.brake.to-speed-mps=${speed}");
        row(&format!("`{name}`, no braking"), load(name, &[&keeps_speed])?, &arms, size.samples)?;
    }
    Ok(text)
}

/// Every fault of the library, with the sensors that its scenario states, beside the headline
/// without one.
pub(super) fn faults(size: Size) -> Result<String, Box<dyn Error>> {
    let size = Size { samples: size.member_samples, ..size };
    let mut text = format!(
        "| fault | {COLUMNS} | samples in which the system is not available |\n|---|---|---|---|---|---|---|---|---|\n"
    );
    let mut row = |name: &str, file: ScenarioFile, mode| -> Result<(), Box<dyn Error>> {
        let summary = pair(file, size, mode)?;
        let unavailable = summary.scenarios.first().map_or(0, |(_, counts)| counts.arms[1].unavailable);
        writeln!(text, "| {name} | {} | {unavailable} |", cells_of(&summary)?)?;
        Ok(())
    };
    row("none, `full`", load(HEADLINE, &[])?, Some(SensorMode::Full))?;
    row("none, `object`", load(HEADLINE, &[])?, Some(SensorMode::Object))?;
    for path in files_of("faults")? {
        let name = path.file_stem().and_then(|stem| stem.to_str()).unwrap_or_default().to_owned();
        row(&format!("`{name}`"), ScenarioFile::load(&path, &[])?, None)?;
    }
    Ok(text)
}
