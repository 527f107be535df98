//! `closecall robustness`: how much noise and offset each criterion for lane changes bears.

use std::path::{Path, PathBuf};

use clap::Args;
use closecall_scenarios::lane_change::Criterion;
use closecall_scenarios::recordings::open;
use closecall_scenarios::robustness::{Cell, Measured, ReferenceKind, Robustness, Setup, Study};
use rayon::prelude::*;

use super::CliError;
use super::args::{Format, ReadArgs};
use super::output::outln;
use crate::exit_code::ExitCode;
use closecall_report::traffic::recording_charts::{Legend, Line, LineChart};
use closecall_scenarios::atomic::{WriteError, write_file};

/// Arguments of `closecall robustness`.
#[derive(Debug, Args)]
pub(super) struct RobustnessArgs {
    /// Recordings, studied together: an in-car log, or recorded traffic
    #[arg(required = true)]
    recordings: Vec<PathBuf>,
    #[command(flatten)]
    read: ReadArgs,
    /// Seed of the noise
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Draws of the noise at each level
    #[arg(long, default_value_t = Setup::default().repetitions, value_parser = clap::value_parser!(u64).range(1..=10_000))]
    repetitions: u64,
    /// Folder for the charts, `noise.svg` and `offset.svg`
    #[arg(long, value_name = "DIR")]
    plot: Option<PathBuf>,
    /// Output for people or for programs
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

pub(super) fn robustness(args: &RobustnessArgs) -> Result<ExitCode, CliError> {
    let setup = Setup { seed: args.seed, repetitions: args.repetitions, ..Setup::default() };
    let mut studies = Vec::new();
    for path in &args.recordings {
        studies.push(study_of(path, &args.read)?);
    }
    let mut found: Option<Robustness> = None;
    for study in &studies {
        let cases = Study::cases(&setup);
        // In the order of the cases, however many threads there are.
        let results: Vec<Vec<Cell>> = cases.par_iter().map(|case| study.run(case)).collect();
        let one = study.robustness(&setup, &results);
        if let Some(all) = &mut found {
            if !all.add(&one) {
                let message = "in-car logs and recorded traffic have different references: study them apart";
                return Err(CliError::Usage { message: message.to_owned() });
            }
        } else {
            found = Some(one);
        }
    }
    let Some(found) = found else { return Ok(ExitCode::Pass) };
    if let Some(folder) = &args.plot {
        plot(&found, folder)?;
    }
    match args.format {
        Format::Json => outln!("{:#}", json(&found)),
        Format::Human => print(&found),
    }
    Ok(ExitCode::Pass)
}

fn study_of(path: &Path, read: &ReadArgs) -> Result<Study, CliError> {
    let mut tracks = open(path, read.options())?;
    let mut measured: Vec<Measured> = Vec::new();
    while let Some(track) = tracks.next_track()? {
        measured.push((track.trajectory, track.markings));
    }
    measured.sort_by_key(|(track, _)| track.track_id);
    Ok(Study::new(measured, tracks.markings()))
}

fn json(found: &Robustness) -> serde_json::Value {
    let fails = found.criteria.iter().enumerate();
    let fails = fails.map(|(column, criterion)| (criterion.name().to_owned(), found.fails_from_noise(column).into()));
    let mut value = serde_json::json!(found);
    value["fails_from_noise_m_per_sqrt_s"] = serde_json::Value::Object(fails.collect());
    value
}

fn print(found: &Robustness) {
    let reference = match found.reference_kind {
        ReferenceKind::Gradient => "jumps of the distances to the markings",
        ReferenceKind::RecordedLanes => "recorded lanes",
    };
    let Setup { repetitions, seed, .. } = found.setup;
    outln!("{} lane changes, by {reference}; undisturbed, of these", found.reference);
    for (criterion, known) in found.criteria.iter().zip(&found.undisturbed) {
        outln!("  {:<9} finds {known}", criterion.name());
    }
    outln!("\nfound again / all found / of them invented; noise: mean of {repetitions} draws, seed {seed}");
    let names: Vec<String> = found.criteria.iter().map(|criterion| format!("{:<26}", criterion.name())).collect();
    outln!("\nBrownian noise  {}", names.concat());
    for (level, cells) in found.setup.noise_m_per_sqrt_s.iter().zip(&found.noise) {
        outln!("{level:>8.2} m/√s   {}", row(found, cells));
    }
    outln!("\nlateral offset  {}", names.concat());
    for (level, cells) in found.setup.offset_m.iter().zip(&found.offset) {
        outln!("{level:>8.2} m      {}", row(found, cells));
    }
    outln!("\n!: more than 5 % lost of what it finds undisturbed, or more than 5 % invented");
    for line in failures(found) {
        outln!("{line}");
    }
}

fn row(found: &Robustness, cells: &[Cell]) -> String {
    let cell = |(criterion, cell): (usize, &Cell)| {
        let mark = if found.fails(criterion, cell) { "!" } else { " " };
        format!("{:<26}", format!("{:>6.1} /{:>6.1} /{:>5.1} {mark}", cell.again, cell.found, cell.invented))
    };
    cells.iter().enumerate().map(cell).collect()
}

/// From which noise on each criterion fails, the first one first.
fn failures(found: &Robustness) -> Vec<String> {
    let mut from: Vec<(Option<f64>, Criterion)> =
        (0..).zip(&found.criteria).map(|(column, criterion)| (found.fails_from_noise(column), *criterion)).collect();
    from.sort_by(|a, b| a.0.unwrap_or(f64::INFINITY).total_cmp(&b.0.unwrap_or(f64::INFINITY)));
    let line = |(level, criterion): &(Option<f64>, Criterion)| match level {
        Some(level) => format!("{} first fails at a noise of {level} m/√s", criterion.name()),
        None => format!("{} fails at no level of noise", criterion.name()),
    };
    from.iter().map(line).collect()
}

fn plot(found: &Robustness, folder: &Path) -> Result<(), CliError> {
    std::fs::create_dir_all(folder).map_err(|source| WriteError::new(folder, source))?;
    let levels = &found.setup;
    let noise = ("Brownian noise [m/√s]", &levels.noise_m_per_sqrt_s, &found.noise);
    let offset = ("Lateral offset [m]", &levels.offset_m, &found.offset);
    for (name, legend, (x_name, levels, rows)) in
        [("noise.svg", Legend::LowerLeft, noise), ("offset.svg", Legend::LowerMiddle, offset)]
    {
        let svg = LineChart { legend, ..chart(found, x_name, levels, rows) }.svg()?;
        write_file(&folder.join(name), |file| file.write_all(svg.as_bytes()))?;
    }
    Ok(())
}

fn chart(found: &Robustness, x_name: &str, levels: &[f64], rows: &[Vec<Cell>]) -> LineChart {
    let line = |column: usize, criterion: &Criterion, (value, what): (fn(&Cell) -> f64, &str), faint| Line {
        name: format!("{}: {what}", criterion.name()),
        points: levels.iter().zip(rows).map(|(level, cells)| (*level, value(&cells[column]))).collect(),
        colour: column,
        faint,
    };
    let lines = found.criteria.iter().enumerate().flat_map(|(column, criterion)| {
        [
            line(column, criterion, (|cell| cell.again, "found again"), false),
            line(column, criterion, (|cell| cell.found, "all that is found"), true),
        ]
    });
    LineChart {
        title: "Lane changes found, by criterion".to_owned(),
        x_name: x_name.to_owned(),
        y_name: "lane changes".to_owned(),
        lines: lines.collect(),
        level: ("reference".to_owned(), found.reference as f64),
        legend: Legend::LowerLeft,
    }
}
