//! `closecall traffic aerial`: watches the traffic of trajectory files with an aerial camera, derives
//! trajectories from its pictures, and compares them with the truth.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use closecall_recorded::aerial::dataset::write_png;
use closecall_recorded::aerial::{Boxes, Correction, Flight, FlightOptions, Footage, fly_watched, losses};
use closecall_recorded::trajectory_data::write_trajectories;
use closecall_report::json::stamped;
use closecall_sensors::inference_backend;
use closecall_traffic::atomic::create_folder;
use closecall_traffic::words::counted;
use serde_json::{Value, json};

use super::CliError;
use super::args::{FilesArgs, Format};
use super::backend::check_backend;
use super::help::{examples, heading};
use super::output::{outln, print_text, print_written};
use super::progress::watched;
use super::protect::{files_of_trajectories, must_be_folder, protect};
use crate::exit_code::ExitCode;

/// The names of the files that a flight writes: the truth, the tracks as they are seen and with the
/// perspective bias corrected, and a picture from the middle of the flight.
const FLIGHT_FILES: [&str; 4] = ["truth.csv", "raw.csv", "corrected.csv", "picture.png"];

/// Rate and size of the pictures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum Pictures {
    /// A strip of 1280 × 192 px along the road, at 12.5 Hz
    #[default]
    Strip,
    /// 4104 × 3006 px at 20 Hz, as published. Each picture has 50 times the pixels of the strip; the
    /// detector searches it reduced to a third, which is six times the strip
    Published,
}

/// The boxes from which tracks are derived.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum BoxesChoice {
    /// Those that the detector finds in the pictures
    #[default]
    Detected,
    /// The exact boxes around all vehicles, as a perfect detector would find them; no picture is
    /// searched
    Exact,
}

/// How the perspective bias is corrected.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum CorrectionChoice {
    /// By the typical height of the class: 1.5 m for cars, 4.0 m for trucks
    #[default]
    ClassHeight,
    /// By a height that is estimated for each vehicle from the width of its box
    Silhouette,
}

/// Arguments of `closecall traffic aerial`.
#[derive(Debug, Args)]
#[command(after_help = examples([
    "closecall traffic aerial traffic.csv -o flown",
    "closecall traffic aerial trucks.csv -o flown --georeferencing-m 0 --correction silhouette",
    "closecall traffic aerial traffic.csv -o flown --pictures published --around-s 4",
]))]
pub(super) struct AerialArgs {
    #[command(flatten)]
    data: FilesArgs,
    /// Altitude of the camera in m, 40 to 400
    #[arg(long, value_name = "M", default_value_t = FlightOptions::default().altitude_m, help_heading = heading::METHOD)]
    altitude_m: f64,
    /// Angle of the optical axis from the vertical in degrees, 0 to 40: the camera hovers beside the
    /// road
    #[arg(long, value_name = "DEGREES", default_value_t = 25.0, help_heading = heading::METHOD)]
    off_nadir_deg: f64,
    /// Rate and size of the pictures
    #[arg(long, value_enum, default_value_t, help_heading = heading::METHOD)]
    pictures: Pictures,
    /// Boxes from which the tracks are derived
    #[arg(long, value_enum, default_value_t, help_heading = heading::METHOD)]
    boxes: BoxesChoice,
    /// How the perspective bias of the vehicles' heights is corrected
    #[arg(long, value_enum, default_value_t, help_heading = heading::METHOD)]
    correction: CorrectionChoice,
    /// Time before and after each lane change that is watched, in s, 2 to 1000
    #[arg(long, value_name = "S", default_value_t = FlightOptions::default().reach_s, help_heading = heading::METHOD)]
    around_s: f64,
    /// Standard deviation, along each axis, of the constant error of georeferencing in m, 0 to 5. With
    /// 0, what is left of a bias comes from the detector and the correction
    #[arg(long, value_name = "M", default_value_t = FlightOptions::default().offset_sigma_m, help_heading = heading::METHOD)]
    georeferencing_m: f64,
    /// Seed of the errors of georeferencing, the bodies and paints of the vehicles, and the ground. Each
    /// further file has the next seed
    #[arg(long, default_value_t = 0, value_parser = closecall_campaign::arguments::seed, help_heading = heading::METHOD)]
    seed: u64,
    /// Folder for the trajectories, with a folder for each file
    #[arg(short, long = "out", alias = "output", value_name = "DIR", help_heading = heading::OUTPUT)]
    output: PathBuf,
    /// Output format
    #[arg(long, value_enum, default_value_t, help_heading = heading::OUTPUT)]
    format: Format,
}

impl AerialArgs {
    fn options(&self) -> FlightOptions {
        FlightOptions {
            altitude_m: self.altitude_m,
            off_nadir_rad: self.off_nadir_deg.to_radians(),
            footage: match self.pictures {
                Pictures::Strip => Footage::Strip,
                Pictures::Published => Footage::Published,
            },
            boxes: match self.boxes {
                BoxesChoice::Detected => Boxes::Detected,
                BoxesChoice::Exact => Boxes::Exact,
            },
            correction: match self.correction {
                CorrectionChoice::ClassHeight => Correction::ClassHeight,
                CorrectionChoice::Silhouette => Correction::Silhouette,
            },
            offset_sigma_m: self.georeferencing_m,
            reach_s: self.around_s,
            seed: self.seed,
            ..FlightOptions::default()
        }
    }

    /// Returns the folder of each file, which has its name without the ending.
    fn folders(&self) -> Result<Vec<PathBuf>, CliError> {
        let mut taken = BTreeSet::new();
        let folder = |file: &PathBuf| {
            let name = file.file_stem().unwrap_or_default();
            let folder = self.output.join(name);
            if taken.insert(folder.clone()) {
                return Ok(folder);
            }
            let name = name.to_string_lossy();
            Err(CliError::usage(format!(
                "two files are named `{name}`, and the trajectories of both would be in {}",
                folder.display()
            )))
        };
        self.data.files.iter().map(folder).collect()
    }
}

pub(super) fn aerial(args: &AerialArgs) -> Result<ExitCode, CliError> {
    let folders = args.folders()?;
    let inputs = files_of_trajectories(&args.data.files);
    for path in folders.iter().flat_map(|folder| FLIGHT_FILES.map(|name| folder.join(name))) {
        protect(&inputs, &[("--out", Some(&path))])?;
    }
    folders.iter().try_for_each(|folder| must_be_folder(Some(folder)))?;
    check_backend(args.boxes == BoxesChoice::Detected)?;
    let data_sets = args.data.read_all()?;
    let (mut flights, mut summaries) = (Vec::new(), Vec::new());
    for ((number, data), (folder, file)) in (0..).zip(&data_sets).zip(folders.iter().zip(&args.data.files)) {
        let options = FlightOptions { seed: args.seed.wrapping_add(number), ..args.options() };
        let flight = watched("pictures", |progress| fly_watched(data, &options, inference_backend(), progress))?;
        save(&flight, folder)?;
        print_written(folder);
        summaries.push(summary(&flight, file, folder, options.seed));
        flights.push(flight);
    }
    let losses = losses(&flights);
    match args.format {
        Format::Json => {
            let answer = json!({ "files": summaries, "losses": losses });
            outln!("{:#}", stamped(answer, Some(args.seed), None));
        }
        Format::Human => {
            for (flight, file) in flights.iter().zip(&args.data.files) {
                outln!("{}: {}", file.display(), counted(flight.frames, "picture"));
            }
            print_text(losses);
        }
    }
    let is_in_doubt = data_sets.iter().any(|data| data.is_in_doubt);
    Ok(if is_in_doubt { ExitCode::Inconclusive } else { ExitCode::Pass })
}

fn summary(flight: &Flight, file: &Path, folder: &Path, seed: u64) -> Value {
    json!({
        "file": file.display().to_string(),
        "folder": folder.display().to_string(),
        "seed": seed,
        "pictures": flight.frames,
        "vehicles": flight.truth.trajectories.len(),
        "tracks": flight.corrected.trajectories.len(),
    })
}

/// Writes what a flight has seen into a folder, which is created if it does not exist.
fn save(flight: &Flight, folder: &Path) -> Result<(), CliError> {
    create_folder(folder)?;
    let [truth, raw, corrected, picture] = FLIGHT_FILES.map(|name| folder.join(name));
    for (data, path) in [(&flight.truth, &truth), (&flight.raw, &raw), (&flight.corrected, &corrected)] {
        write_trajectories(data, path)?;
    }
    Ok(write_png(&picture, &flight.example.image)?)
}
