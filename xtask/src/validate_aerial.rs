//! Measures the losses of the aerial acquisition: a camera follows the traffic of each trajectory
//! file, and the program compares the tracks of detector and tracker with the truth.
//!
//! ```text
//! validate_aerial DIR FILE… [--off-nadir DEGREES] [--altitude M] [--seed N]
//! ```
//!
//! For each file it writes a folder with `NAME-truth.csv`, `NAME-aerial-raw.csv` and
//! `NAME-aerial-corrected.csv`, which `closecall traffic lane-changes` reads, and `NAME-truth.png`,
//! a picture from the middle of the flight; and prints the losses over all files.
#![expect(clippy::print_stdout, reason = "its output is what it is for")]

use std::path::{Path, PathBuf};

use closecall_recorded::aerial::dataset::write_png;
use closecall_recorded::aerial::{FlightOptions, fly, losses};
use closecall_recorded::trajectory_data::{read, write_trajectories};
use closecall_sensors::camera::Backend;

pub(crate) fn main(words: Vec<String>) -> Result<(), Box<dyn std::error::Error>> {
    let (mut options, mut files, mut folder) = (FlightOptions::default(), Vec::new(), None);
    let mut arguments = words.into_iter();
    while let Some(argument) = arguments.next() {
        let mut number = || -> Result<f64, Box<dyn std::error::Error>> {
            let text = arguments.next().ok_or_else(|| format!("{argument} needs a number"))?;
            Ok(text.parse().map_err(|error| format!("{argument} {text}: {error}"))?)
        };
        match argument.as_str() {
            "--off-nadir" => options.off_nadir_rad = number()?.to_radians(),
            "--altitude" => options.altitude_m = number()?,
            "--seed" => options.seed = number()?.to_bits(),
            _ if folder.is_none() => folder = Some(PathBuf::from(&argument)),
            _ => files.push(PathBuf::from(&argument)),
        }
    }
    let Some(folder) = folder.filter(|_| !files.is_empty()) else {
        return Err("usage: validate-aerial DIR FILE… [--off-nadir DEGREES] [--altitude M] [--seed N]".into());
    };
    let library = std::env::var_os("ORT_DYLIB_PATH").map(PathBuf::from);
    let backend = Backend::choose(None, library);
    let mut flights = Vec::new();
    for (number, file) in files.iter().enumerate() {
        let options = FlightOptions { seed: options.seed.wrapping_add(number as u64), ..options };
        let flight = fly(&read(file)?, &options, &backend)?;
        save(&flight, &folder.join(file.file_stem().unwrap_or_default()))?;
        println!("{}: {} pictures", file.display(), flight.frames);
        flights.push(flight);
    }
    println!("\n{}", losses(&flights));
    Ok(())
}

fn save(flight: &closecall_recorded::aerial::Flight, folder: &Path) -> Result<(), Box<dyn std::error::Error>> {
    std::fs::create_dir_all(folder)?;
    let path = |name: &str| folder.join(name);
    write_trajectories(&flight.truth, &path(&format!("{}.csv", flight.truth.name)))?;
    for data in [&flight.raw, &flight.corrected] {
        write_trajectories(data, &path(&format!("{}.csv", data.name)))?;
    }
    write_png(&path(&format!("{}.png", flight.truth.name)), &flight.example.image)?;
    Ok(())
}
