//! Renders labelled images of the rear camera, for the training and the evaluation of classifiers.
//!
//! ```text
//! cargo run --release -p closecall-xtask -- render-dataset crops training 9000 0 target/crops/training
//! ```

use std::path::Path;
use std::process::ExitCode;

use closecall_sensors::camera::Sampling;
use closecall_sensors::datasets::{
    CameraLooks, Content, DatasetOptions, Set, USUAL_VEHICLES, render_dataset, render_sampled,
};

const USAGE: &str = "usage: render-dataset crops|images|SAMPLING training|held-out SCENES SEED FOLDER\n\
    SAMPLING: a file with the columns that a network reads in its first line, and the rows in its second";

fn options(words: &[String]) -> Option<(DatasetOptions, &Path)> {
    let [content, set, scenes, seed, folder] = words else { return None };
    let content = match content.as_str() {
        "crops" => Content::Crops,
        "images" => Content::Images,
        _ => return None,
    };
    let set = match set.as_str() {
        "training" => Set::Training,
        "held-out" => Set::HeldOut,
        _ => return None,
    };
    let options = DatasetOptions {
        content,
        set,
        scenes: scenes.parse().ok()?,
        seed: seed.parse().ok()?,
        looks: CameraLooks::default(),
        vehicles: USUAL_VEHICLES,
    };
    Some((options, Path::new(folder)))
}

/// Renders pictures at the columns and rows that the file `sampling` names.
#[expect(clippy::print_stdout, clippy::print_stderr, reason = "a command-line tool talks to its user")]
fn sampled(sampling: &str, set: Set, [scenes, seed]: [&str; 2], folder: &str) -> ExitCode {
    let text = std::fs::read_to_string(sampling).unwrap_or_default();
    let (columns, rows) = text.split_once('\n').unwrap_or_default();
    let (Ok(scenes), Ok(seed)) = (scenes.parse(), seed.parse()) else {
        eprintln!("{USAGE}");
        return ExitCode::from(2);
    };
    let rendered =
        Sampling::parse(columns, rows).map_err(|error| format!("{sampling}: {error}")).and_then(|sampling| {
            render_sampled(set, [scenes, seed], &sampling, Path::new(folder)).map_err(|error| error.to_string())
        });
    match rendered {
        Ok(summary) => {
            println!("{} scenes, labels {:?}", summary.scenes, summary.labels);
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(6)
        }
    }
}

#[expect(clippy::print_stdout, clippy::print_stderr, reason = "a command-line tool talks to its user")]
pub(crate) fn main(words: Vec<String>) -> ExitCode {
    if let [sampling, set @ ("training" | "held-out"), scenes, seed, folder] =
        words.iter().map(String::as_str).collect::<Vec<_>>()[..]
        && sampling.ends_with(".txt")
    {
        return sampled(sampling, if set == "training" { Set::Training } else { Set::HeldOut }, [scenes, seed], folder);
    }
    let Some((options, folder)) = options(&words) else {
        eprintln!("{USAGE}");
        return ExitCode::from(2);
    };
    match render_dataset(&options, folder) {
        Ok(summary) => {
            println!("{} scenes, {} pictures, labels {:?}", summary.scenes, summary.pictures, summary.labels);
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(6)
        }
    }
}
