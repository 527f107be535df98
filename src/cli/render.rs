//! `closecall render`: renders labelled images of the rear camera, to train and to test classifiers.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use closecall_campaign::arguments::scene_count;
use closecall_report::json::stamped;
use closecall_sensors::camera::dataset::{Content, DatasetOptions, Set, render_dataset};
use serde_json::json;

use super::CliError;
use super::args::Format;
use super::output::outln;
use crate::exit_code::ExitCode;

/// The purpose of the images.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum Purpose {
    /// Body shapes and paints for training
    #[default]
    Training,
    /// Body shapes and paints that are not used for training
    HeldOut,
}

/// Arguments of `closecall render`.
#[derive(Debug, Args)]
pub(super) struct RenderArgs {
    /// Folder for the images
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Number of random scenes
    #[arg(short = 'n', long = "scenes", default_value_t = 20, allow_negative_numbers = true, value_parser = scene_count)]
    scenes: u32,
    /// Seed of the random scenes
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Body shapes and paints of the vehicles
    #[arg(long, value_enum, default_value_t)]
    set: Purpose,
    /// Write the crops that are the classifier's input, instead of whole images with COCO annotations
    #[arg(long)]
    crops: bool,
    /// Output format
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

pub(super) fn render(args: &RenderArgs) -> Result<ExitCode, CliError> {
    let options = DatasetOptions {
        set: match args.set {
            Purpose::Training => Set::Training,
            Purpose::HeldOut => Set::HeldOut,
        },
        content: if args.crops { Content::Crops } else { Content::Images },
        scenes: args.scenes,
        seed: args.seed,
    };
    let summary = render_dataset(&options, &args.output)?;
    match args.format {
        Format::Json => outln!("{:#}", stamped(json!(summary), Some(args.seed), None)),
        Format::Human => {
            let [car, truck, motorcycle, background] = summary.labels;
            outln!("{} images of {} scenes written to {}", summary.pictures, summary.scenes, args.output.display());
            outln!("labels: {car} cars, {truck} trucks, {motorcycle} motorcycles, {background} background");
        }
    }
    Ok(ExitCode::Pass)
}
