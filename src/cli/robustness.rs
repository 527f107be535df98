//! `closecall robustness`: studies how much noise and offset each criterion for lane changes tolerates.

use std::path::{Path, PathBuf};

use clap::Args;
use closecall_report::traffic::recording_charts::{Legend, Line, LineChart};
use closecall_scenarios::atomic::{WriteError, write_file};
use closecall_scenarios::lane_change::Criterion;
use closecall_scenarios::recordings::open;
use closecall_scenarios::robustness::{Cell, Measured, ReferenceKind, Robustness, Setup, Study};
use rayon::prelude::*;

use super::CliError;
use super::args::{Format, ReadArgs};
use super::json::stamped;
use super::output::{outln, print_error, print_written};
use super::protect::{of_trajectories, protect};
use crate::exit_code::ExitCode;

/// Arguments of `closecall robustness`.
#[derive(Debug, Args)]
pub(super) struct RobustnessArgs {
    /// Trajectory files, studied together: either in-car logs or recorded traffic
    #[arg(required = true, value_name = "TRAJECTORY_FILE")]
    files: Vec<PathBuf>,
    #[command(flatten)]
    read: ReadArgs,
    /// Seed of the noise
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Number of draws of the noise at each level
    #[arg(long, default_value_t = Setup::default().repetitions, value_parser = clap::value_parser!(u64).range(1..=10_000))]
    repetitions: u64,
    /// Folder for the charts `noise.svg` and `offset.svg`
    #[arg(long, value_name = "DIR")]
    plot: Option<PathBuf>,
    /// Output format
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

pub(super) fn robustness(args: &RobustnessArgs) -> Result<ExitCode, CliError> {
    let charts = args.plot.as_ref().map(|folder| ["noise.svg", "offset.svg"].map(|name| folder.join(name)));
    for chart in charts.iter().flatten() {
        protect(&of_trajectories(&args.files), &[("--plot", Some(chart))])?;
    }
    let setup = Setup { seed: args.seed, repetitions: args.repetitions, ..Setup::default() };
    let mut studies = Vec::new();
    for path in &args.files {
        studies.push(study_of(path, &args.read)?);
    }
    let mut found: Option<Robustness> = None;
    for study in &studies {
        let cases = Study::cases(&setup);
        // The results are in the order of the cases for any number of threads.
        let results: Vec<Vec<Cell>> = cases.par_iter().map(|case| study.run(case)).collect();
        let one = study.robustness(&setup, &results);
        if let Some(all) = &mut found {
            if !all.add(&one) {
                let message = "in-car logs and recorded traffic have different references: study them separately";
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
        Format::Json => outln!("{:#}", stamped(json(&found), None, None)),
        Format::Human => print(&found),
    }
    if found.reference == 0 {
        print_error(format_args!("there is no lane change in the trajectory files: nothing was studied\n"));
        return Ok(ExitCode::Inconclusive);
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
    outln!("{} lane changes, by {reference}; each criterion without noise and offset:", found.reference);
    for (criterion, known) in found.criteria.iter().zip(&found.undisturbed) {
        outln!("  {:<9} finds {known}", criterion.name());
    }
    outln!("\nfound again / all found / false ones; noise: mean of {repetitions} draws, seed {seed}");
    let names: Vec<String> = found.criteria.iter().map(|criterion| format!("{:<26}", criterion.name())).collect();
    outln!("\nBrownian noise  {}", names.concat());
    for (level, cells) in found.setup.noise_m_per_sqrt_s.iter().zip(&found.noise) {
        outln!("{level:>8.2} m/√s   {}", row(found, cells));
    }
    outln!("\nlateral offset  {}", names.concat());
    for (level, cells) in found.setup.offset_m.iter().zip(&found.offset) {
        outln!("{level:>8.2} m      {}", row(found, cells));
    }
    outln!(
        "\n!: the criterion loses more than 5 % of what it finds without noise and offset, or more than 5 % are false"
    );
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

/// Returns one line per criterion with the lowest level of noise at which it fails, sorted by that level.
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
    let noise = Axis { name: "Brownian noise [m/√s]", levels: &levels.noise_m_per_sqrt_s, rows: &found.noise };
    let offset = Axis { name: "Lateral offset [m]", levels: &levels.offset_m, rows: &found.offset };
    for (name, legend, axis) in [("noise.svg", Legend::LowerLeft, noise), ("offset.svg", Legend::LowerMiddle, offset)] {
        let svg = LineChart { legend, ..chart(found, &axis) }.svg()?;
        let path = folder.join(name);
        write_file(&path, |file| file.write_all(svg.as_bytes()))?;
        print_written(&path);
    }
    Ok(())
}

/// A disturbance, its levels, and the results at each level.
struct Axis<'a> {
    name: &'a str,
    levels: &'a [f64],
    rows: &'a [Vec<Cell>],
}

fn chart(found: &Robustness, axis: &Axis<'_>) -> LineChart {
    let points = |column: usize, value: fn(&Cell) -> f64| -> Vec<(f64, f64)> {
        axis.levels.iter().zip(axis.rows).map(|(level, cells)| (*level, value(&cells[column]))).collect()
    };
    let lines = found.criteria.iter().enumerate().flat_map(|(column, criterion)| {
        let name = criterion.name();
        let again = points(column, |cell| cell.again);
        let all = points(column, |cell| cell.found);
        [
            Line { name: format!("{name}: found again"), points: again, colour: column, faint: false },
            Line { name: format!("{name}: all that is found"), points: all, colour: column, faint: true },
        ]
    });
    LineChart {
        title: "Lane changes found, by criterion".to_owned(),
        x_name: axis.name.to_owned(),
        y_name: "lane changes".to_owned(),
        lines: lines.collect(),
        level: ("reference".to_owned(), found.reference as f64),
        legend: Legend::LowerLeft,
    }
}
