//! `closecall tool render`: renders labelled images of the rear camera or of an aerial one, to
//! train and to test networks.

use std::path::PathBuf;

use clap::Args;
use closecall_campaign::arguments::scene_count;
use closecall_recorded::aerial::dataset::{AerialDatasetOptions, render_aerial_dataset};
use closecall_report::json::stamped;
use closecall_sensors::datasets::{CameraLooks, Content, DatasetOptions, MAX_VEHICLES, Set, render_dataset};
use closecall_traffic::words::counted;
use serde_json::json;

use super::CliError;
use super::args::Format;
use super::help::{examples, heading};
use super::output::{during, outln, print_written};
use super::protect::must_be_new;
use crate::exit_code::ExitCode;

/// Arguments of `closecall tool render`.
#[derive(Debug, Args)]
#[command(after_help = examples([
    "closecall tool render -o images",
    "closecall tool render -n 300 --set held-out --vehicles 6..10 -o crowded",
    "closecall tool render --aerial -n 100 --seed 1 -o aerial",
]))]
pub(super) struct RenderArgs {
    /// Folder for the images. It must be new or empty
    #[arg(short, long = "out", alias = "output", value_name = "DIR", help_heading = heading::OUTPUT)]
    output: PathBuf,
    /// Number of random scenes
    #[arg(short = 'n', long = "scenes", default_value_t = 20, allow_negative_numbers = true, value_parser = scene_count, help_heading = heading::SCENES)]
    scenes: u32,
    /// Seed of the random scenes
    #[arg(long, default_value_t = 0, value_parser = closecall_campaign::arguments::seed, help_heading = heading::SCENES)]
    seed: u64,
    /// Body shapes and paints of the vehicles: the set for training, or the set that is held out
    /// from training
    #[arg(long, value_parser = ["training", "held-out"], default_value = "training", help_heading = heading::SCENES)]
    set: String,
    /// Number of vehicles in a scene, or the least and the largest one such as 6..10: 0 for empty
    /// roads; fewer where there is no room
    #[arg(long, value_name = "COUNT", default_value = "1..5", conflicts_with = "aerial", value_parser = vehicles, help_heading = heading::SCENES)]
    vehicles: [usize; 2],
    /// Render oblique aerial images with oriented boxes, in the layout of DOTA, instead of images
    /// of the rear camera
    #[arg(long, conflicts_with = "crops", help_heading = heading::OUTPUT)]
    aerial: bool,
    /// Write the crops that are the classifier's input, instead of whole images with COCO
    /// annotations
    #[arg(long, help_heading = heading::OUTPUT)]
    crops: bool,
    /// Output format
    #[arg(long, value_enum, default_value_t, help_heading = heading::OUTPUT)]
    format: Format,
}

/// Parses a number of vehicles, or the least and the largest one.
fn vehicles(text: &str) -> Result<[usize; 2], String> {
    let (least, largest) = text.split_once("..").unwrap_or((text, text));
    match (least.parse(), largest.parse()) {
        (Ok(least), Ok(largest)) if least <= largest && largest <= MAX_VEHICLES => Ok([least, largest]),
        _ => Err(format!("`{text}` is neither a number from 0 to {MAX_VEHICLES} nor two of them such as 6..10")),
    }
}

pub(super) fn render(args: &RenderArgs) -> Result<ExitCode, CliError> {
    must_be_new(&args.output)?;
    let set = if args.set == "training" { Set::Training } else { Set::HeldOut };
    let (scenes, seed) = (args.scenes, args.seed);
    if args.aerial {
        let options = AerialDatasetOptions { set, pictures: scenes, seed };
        let summary = during("rendering aerial images".to_owned(), || render_aerial_dataset(&options, &args.output))?;
        match args.format {
            Format::Json => outln!("{:#}", stamped(json!(summary), Some(seed), None)),
            Format::Human => outln!("{summary}"),
        }
        print_written(&args.output);
        return Ok(ExitCode::Pass);
    }
    let content = if args.crops { Content::Crops } else { Content::Images };
    let options = DatasetOptions { set, content, scenes, seed, looks: CameraLooks::default(), vehicles: args.vehicles };
    let summary = during("rendering images".to_owned(), || render_dataset(&options, &args.output))?;
    match args.format {
        Format::Json => outln!("{:#}", stamped(json!(summary), Some(args.seed), None)),
        Format::Human => {
            let [car, truck, motorcycle, background] = summary.labels;
            let pictures = if args.crops { "crop" } else { "image" };
            outln!("{} of {}", counted(summary.pictures, pictures), counted(summary.scenes, "scene"));
            let (cars, trucks) = (counted(car, "car"), counted(truck, "truck"));
            outln!("labels: {cars}, {trucks}, {}, {background} background", counted(motorcycle, "motorcycle"));
        }
    }
    print_written(&args.output);
    Ok(ExitCode::Pass)
}
