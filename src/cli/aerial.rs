//! `closecall traffic aerial`: watches traffic with an aerial camera, and compares what detector and
//! tracker make of the pictures with the truth.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use clap::Args;
use closecall_recorded::aerial::dataset::write_png;
use closecall_recorded::aerial::{Acquisition, AerialError, Flight, FlightOptions, fly, losses};
use closecall_recorded::trajectory_data::write_trajectories;
use closecall_report::json::stamped;
use closecall_sensors::inference_backend;

use super::CliError;
use super::args::{FilesArgs, Format};
use super::backend::check_backend;
use super::help::{examples, heading};
use super::output::{out, outln, print_written};
use super::protect::{of_trajectories, protect};
use crate::exit_code::ExitCode;

/// Arguments of `closecall traffic aerial`.
#[derive(Debug, Args)]
#[command(after_help = examples([
    "closecall traffic aerial traffic.csv",
    "closecall traffic aerial traffic.csv --off-nadir 15 --altitude 120 -o flown",
    "closecall traffic aerial traffic.csv --reach-s 2 --published-rates --format json",
]))]
pub(super) struct AerialArgs {
    #[command(flatten)]
    data: FilesArgs,
    /// Altitude of the camera in m: 40 to 400
    #[arg(long, value_name = "M", default_value_t = 100.0, help_heading = heading::METHOD)]
    altitude: f64,
    /// Angle of the optical axis from the nadir in degrees: 0 to 40
    #[arg(long, value_name = "DEGREES", default_value_t = 25.0, allow_negative_numbers = true, help_heading = heading::METHOD)]
    off_nadir: f64,
    /// Time before and after each lane change that is watched in s: 2 to 1000
    #[arg(long, value_name = "S", default_value_t = 7.0, help_heading = heading::METHOD)]
    reach_s: f64,
    /// Pictures of 4104 × 3006 px at 20 Hz, instead of a strip of 1280 × 192 px at 12.5 Hz. It takes
    /// about a hundred times as long, and 110 MB for each thread
    #[arg(long, help_heading = heading::METHOD)]
    published_rates: bool,
    /// Seed of the errors of georeferencing, the paints and the ground
    #[arg(long, default_value_t = 0, value_parser = closecall_campaign::arguments::seed, help_heading = heading::METHOD)]
    seed: u64,
    /// Folder for a folder of each file, with the truth, the tracks as they are seen and corrected, and
    /// a picture
    #[arg(short, long = "out", alias = "output", value_name = "DIR", help_heading = heading::OUTPUT)]
    output: Option<PathBuf>,
    /// Output format
    #[arg(long, value_enum, default_value_t, help_heading = heading::OUTPUT)]
    format: Format,
}

pub(super) fn aerial(args: &AerialArgs) -> Result<ExitCode, CliError> {
    let folder_of = |file: &Path| args.output.as_ref().map(|folder| folder.join(file.file_stem().unwrap_or_default()));
    let folders: Vec<Option<PathBuf>> = args.data.files.iter().map(|file| folder_of(file)).collect();
    let mut names = BTreeSet::new();
    if let Some(twice) = folders.iter().flatten().find(|folder| !names.insert(*folder)) {
        return Err(CliError::usage(format!("two files would be written to {}: rename one of them", twice.display())));
    }
    for folder in folders.iter().flatten() {
        protect(&of_trajectories(&args.data.files), &[("--out", Some(folder))])?;
    }
    check_backend(true)?;
    let mut flights = Vec::new();
    for ((number, data), folder) in (0_u64..).zip(args.data.read_all()?).zip(&folders) {
        let options = FlightOptions {
            altitude_m: args.altitude,
            off_nadir_rad: args.off_nadir.to_radians(),
            reach_s: args.reach_s,
            acquisition: if args.published_rates { Acquisition::PUBLISHED } else { Acquisition::STRIP },
            seed: args.seed.wrapping_add(number),
            ..FlightOptions::default()
        };
        let flight = fly(&data, &options, inference_backend())?;
        if let Some(folder) = folder {
            save(&flight, folder)?;
            print_written(folder);
        }
        flights.push(flight);
    }
    let losses = losses(&flights);
    match args.format {
        Format::Json => outln!("{:#}", stamped(serde_json::json!(losses), Some(args.seed), None)),
        Format::Human => out!("{losses}"),
    }
    Ok(ExitCode::Pass)
}

/// Writes the truth, both kinds of tracks, and a picture.
fn save(flight: &Flight, folder: &Path) -> Result<(), CliError> {
    let created = std::fs::create_dir_all(folder);
    created.map_err(|source| AerialError::Folder { path: folder.to_owned(), source })?;
    let path = |name: &str| folder.join(name);
    for data in [&flight.truth, &flight.raw, &flight.corrected] {
        write_trajectories(data, &path(&format!("{}.csv", data.name)))?;
    }
    write_png(&path(&format!("{}.png", flight.truth.name)), &flight.example.image)?;
    Ok(())
}
