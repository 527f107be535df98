//! The programs that keep the repository true: they write committed files, validate the models, and
//! measure. Users need none of them.
//!
//! ```sh
//! cargo run --release -p closecall-xtask -- --help
//! cargo run --release -p closecall-xtask -- write-references
//! ```
//!
//! Each task is a module with its own documentation.

mod fit_object_sensors;
mod fuzz_readers;
mod make_trajectory_file;
mod measure_controller;
mod plot;
mod plot_echo_widths;
mod plot_regimes;
mod render_aerial;
mod render_dataset;
mod root;
mod throughput;
mod validate_aerial;
mod validate_camera;
mod validate_cameras;
mod validate_durability;
mod validate_false_engagements;
mod validate_lane_changes;
mod validate_margin_increase;
mod validate_memory;
mod validate_mis;
mod validate_object_sensors;
mod validate_perception;
mod validate_rare;
mod validate_reference_models;
mod validate_statistics;
mod validate_tracking;
mod write_evidence;
mod write_references;

use std::process::{ExitCode, Termination};

use clap::Parser;
use root::ROOT;

/// Writes, validates and measures the statements of the repository.
#[derive(Parser)]
#[command(name = "xtask")]
enum Task {
    /// Fits the rear object-level sensor to the full chain, and writes the file that ships
    FitObjectSensors(fit_object_sensors::Args),
    /// Feeds damaged files to the readers of trajectory data
    FuzzReaders(Words),
    /// Generates a synthetic trajectory file of any size
    MakeTrajectoryFile(Words),
    /// Measures a control step of a library or an FMU, without the loop around it
    MeasureController(measure_controller::Args),
    /// Draws the predicted echo pulse widths of the LiDAR beside published ones
    PlotEchoWidths(Words),
    /// Draws the regimes of the Wiedemann 99 model
    PlotRegimes(Words),
    /// Renders labelled pictures of the aerial camera
    RenderAerial(Words),
    /// Renders labelled pictures of the rear camera
    RenderDataset(Words),
    /// Measures the speed of the loop, or counts its instructions
    Throughput(Words),
    /// Flies the aerial camera over trajectory files, and measures its losses
    ValidateAerial(Words),
    /// Measures what lens, shutter and darkness do to the classifier
    ValidateCamera(Words),
    /// Compares the two pipelines of the rear camera
    ValidateCameras(validate_cameras::Args),
    /// Kills, resumes, shares out and merges campaigns
    ValidateDurability(Words),
    /// Counts engagements for which there is no reason
    ValidateFalseEngagements(Words),
    /// Validates each lane-change criterion against known lane changes
    ValidateLaneChanges,
    /// Measures collisions by bound, critical gap and rear driver
    ValidateMarginIncrease(Words),
    /// Measures the peak memory of campaigns
    ValidateMemory(Words),
    /// Measures the promises of the margin increase system and its results
    ValidateMis(Words),
    /// Compares the object-level sensors with the full chain
    ValidateObjectSensors(validate_object_sensors::Args),
    /// Compares tracks with the truth, in every scenario
    ValidatePerception(Words),
    /// Compares the reference models of UN Regulation 157 with published outcomes
    ValidateReferenceModels(Words),
    /// Checks on a known probability that bounds hold
    ValidateStatistics(Words),
    /// Checks that the tracker's uncertainty is consistent with its errors
    ValidateTracking(Words),
    /// Writes the tables of docs/evidence that rest on outcomes
    WriteEvidence(write_evidence::Args),
    /// Writes docs/reference/scenario.md and docs/evidence/determinism.json
    WriteReferences,
}

/// The words that a task reads itself.
#[derive(clap::Args)]
struct Words {
    /// What the module of the task documents
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    words: Vec<String>,
}

fn main() -> ExitCode {
    match Task::parse() {
        Task::FitObjectSensors(args) => fit_object_sensors::main(args).report(),
        Task::FuzzReaders(Words { words }) => fuzz_readers::main(words).report(),
        Task::MakeTrajectoryFile(Words { words }) => make_trajectory_file::main(words).report(),
        Task::MeasureController(args) => measure_controller::main(&args).report(),
        Task::PlotEchoWidths(Words { words }) => plot_echo_widths::main(words).report(),
        Task::PlotRegimes(Words { words }) => plot_regimes::main(words).report(),
        Task::RenderAerial(Words { words }) => render_aerial::main(words).report(),
        Task::RenderDataset(Words { words }) => render_dataset::main(words).report(),
        Task::Throughput(Words { words }) => throughput::main(words).report(),
        Task::ValidateAerial(Words { words }) => validate_aerial::main(words).report(),
        Task::ValidateCamera(Words { words }) => validate_camera::main(words).report(),
        Task::ValidateCameras(args) => validate_cameras::main(args).report(),
        Task::ValidateDurability(Words { words }) => validate_durability::main(words).report(),
        Task::ValidateFalseEngagements(Words { words }) => validate_false_engagements::main(words).report(),
        Task::ValidateLaneChanges => {
            validate_lane_changes::main();
            ExitCode::SUCCESS
        }
        Task::ValidateMarginIncrease(Words { words }) => validate_margin_increase::main(words).report(),
        Task::ValidateMemory(Words { words }) => validate_memory::main(words).report(),
        Task::ValidateMis(Words { words }) => validate_mis::main(words).report(),
        Task::ValidateObjectSensors(args) => validate_object_sensors::main(args).report(),
        Task::ValidatePerception(Words { words }) => validate_perception::main(words).report(),
        Task::ValidateReferenceModels(Words { words }) => validate_reference_models::main(words).report(),
        Task::ValidateStatistics(Words { words }) => validate_statistics::main(words).report(),
        Task::ValidateTracking(Words { words }) => {
            validate_tracking::main(words);
            ExitCode::SUCCESS
        }
        Task::WriteEvidence(args) => write_evidence::main(args).report(),
        Task::WriteReferences => write_references::main().report(),
    }
}
