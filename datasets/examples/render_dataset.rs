//! Renders labelled images of the rear camera, for the training and the evaluation of classifiers.
//!
//! ```text
//! cargo run --release -p closecall-datasets --example render_dataset -- crops training 9000 0 target/crops/training
//! ```

use std::path::Path;
use std::process::ExitCode;

use closecall_datasets::{CameraLooks, Content, DatasetOptions, Set, render_dataset};

const USAGE: &str = "usage: render_dataset crops|images training|held-out SCENES SEED FOLDER";

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
    };
    Some((options, Path::new(folder)))
}

#[expect(clippy::print_stdout, clippy::print_stderr, reason = "a command-line tool talks to its user")]
fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
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
