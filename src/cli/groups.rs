//! The commands that belong to a group: `closecall traffic …`, `closecall study …` and
//! `closecall tool …`.

use clap::Subcommand;

use super::command::command;
use super::help::examples;
use super::{
    CliError, aerial, calibrate, causes, chain, drift, export, fidelity, generate, import, inspect, merge, paper,
    perceive, record, reenact, render, robustness, sample, schema, sensors, statistics, study, trajectories,
};
use crate::exit_code::ExitCode;

/// From recorded traffic to scenarios.
#[derive(Debug, Subcommand)]
#[command(after_help = examples([
    "closecall traffic inspect traffic.csv",
    "closecall traffic fit traffic.csv -o fitted.toml",
    "closecall traffic reenact traffic.csv --record beside.rrd",
]))]
pub(super) enum Traffic {
    /// Turn recordings into scenarios, run them with the system and without it, and report what
    /// becomes of each recorded encounter
    Chain(chain::ChainArgs),
    /// Report the flaws of a trajectory file: gaps, jumps, overlaps, and rows that cannot be used
    Inspect(inspect::InspectArgs),
    /// Find the lane changes in a trajectory file
    LaneChanges(trajectories::LaneChangesArgs),
    /// Compute how critical each lane change of a trajectory file is
    Criticality(trajectories::CriticalityArgs),
    /// Fit the distributions of a logical scenario to trajectory files
    Fit(trajectories::FitArgs),
    /// Check whether new trajectory files still match the distributions that a scenario was fitted
    /// to
    Drift(drift::DriftArgs),
    /// Compute durations, speeds, counts and correlations of recorded lane changes
    Statistics(statistics::StatisticsArgs),
    /// Study how much noise and offset the criteria for lane changes tolerate
    Robustness(robustness::RobustnessArgs),
    /// Draw the figures of the published method on any set of trajectory files, with one page of
    /// all
    Paper(paper::PaperArgs),
    /// Simulate an encounter of recorded traffic with the controller under test in the ego vehicle,
    /// and compare the two
    Reenact(reenact::ReenactArgs),
    /// Sample a recorded lane change: the other vehicles drive as recorded, a parameter of a driver
    /// varies
    Sample(sample::SampleArgs),
    /// Simulate samples of a scenario, and write their traffic as a trajectory file
    Record(record::RecordArgs),
    /// Calibrate a car-following model on recorded pairs, and judge it on pairs that were held out
    Calibrate(calibrate::CalibrateArgs),
    /// Watch the traffic of trajectory files with an aerial camera, derive trajectories from its
    /// pictures, and compare them with the truth
    Aerial(aerial::AerialArgs),
}

/// Results that are computed from many runs and judged by no gate.
#[derive(Debug, Subcommand)]
#[command(after_help = examples([
    "closecall study sensors --quick",
    "closecall study sensitivity low-thw-overtake --out study",
    "closecall study exposure --counted 20/5000 --campaign closecall-results",
]))]
pub(super) enum Study {
    /// Find the assumption that moves the result of a scenario most
    Sensitivity(study::SensitivityArgs),
    /// Compare settings of a system: what each prevents, induces, and costs in speed
    Frontier(study::FrontierArgs),
    /// Find the boundary of failing and passing along two parameters, with its uncertainty
    Boundary(study::BoundaryArgs),
    /// Hold emergency braking under human drivers against crash records: how often the ego strikes, and is struck from behind
    Anchor(study::AnchorArgs),
    /// Map the margin that the system reaches, over approach speed, detection distance and front time headway
    Map(causes::MapArgs),
    /// Count how often the encounter happens in trajectory files, and state the net effect of the
    /// system per 10^6 km
    Exposure(causes::ExposureArgs),
    /// Narrow the intervals of a campaign's rates with a larger campaign of fast sensors
    Fidelity(fidelity::FidelityArgs),
    /// Study the rear sensors without a controller: detection, errors, classes and consistency over distance and conditions
    Sensors(sensors::SensorsArgs),
    /// Run the chain behind the rear LiDARs on recorded scans: tracks, and their errors if there are labels
    Perceive(perceive::PerceiveArgs),
}

/// What other programs read: files for editors, shells and networks, and campaigns that were made
/// in parts.
#[derive(Debug, Subcommand)]
#[command(after_help = examples([
    "closecall tool schema > scenario.schema.json",
    "closecall tool render -n 100 -o images",
    "closecall tool merge part-1 part-2 --out merged",
]))]
pub(super) enum Tool {
    /// Print the JSON Schema of scenario files
    #[command(after_help = examples([
        "closecall tool schema",
        "closecall tool schema > scenario.schema.json",
        "closecall tool schema | python3 -m json.tool",
    ]))]
    Schema,
    /// Print a script that completes commands and options in a shell
    Completions(generate::CompletionsArgs),
    /// Print the manual page, or write one for each command
    Man(generate::ManArgs),
    /// Render labelled images of the rear camera, or of an aerial one
    Render(render::RenderArgs),
    /// Write a sample as OpenSCENARIO and OpenDRIVE, for other simulators and players
    Export(export::ExportArgs),
    /// Make a scenario file of an OpenSCENARIO XML scenario
    Import(import::ImportArgs),
    /// Merge the parts of a campaign that ran on several machines, and judge the result
    Merge(merge::MergeArgs),
}

impl Traffic {
    /// Runs the command.
    pub(super) fn run(&self) -> Result<ExitCode, CliError> {
        match self {
            Self::Chain(args) => chain::chain(args),
            Self::Inspect(args) => inspect::inspect(args),
            Self::LaneChanges(args) => trajectories::lane_changes(args),
            Self::Criticality(args) => trajectories::criticality(args),
            Self::Fit(args) => trajectories::fit(args),
            Self::Drift(args) => drift::drift(args),
            Self::Statistics(args) => statistics::statistics(args),
            Self::Robustness(args) => robustness::robustness(args),
            Self::Paper(args) => paper::paper(args),
            Self::Reenact(args) => reenact::reenact(args),
            Self::Sample(args) => sample::sample(args),
            Self::Record(args) => record::record(args),
            Self::Calibrate(args) => calibrate::calibrate(args),
            Self::Aerial(args) => aerial::aerial(args),
        }
    }
}

impl Study {
    /// Runs the command.
    pub(super) fn run(&self) -> Result<ExitCode, CliError> {
        match self {
            Self::Sensitivity(args) => study::sensitivity(args),
            Self::Frontier(args) => study::frontier(args),
            Self::Boundary(args) => study::boundary(args),
            Self::Anchor(args) => study::anchor(args),
            Self::Map(args) => causes::map(args),
            Self::Exposure(args) => causes::exposure(args),
            Self::Fidelity(args) => fidelity::fidelity(args),
            Self::Sensors(args) => sensors::sensors(args),
            Self::Perceive(args) => perceive::perceive(args),
        }
    }
}

impl Tool {
    /// Runs the command.
    pub(super) fn run(&self) -> Result<ExitCode, CliError> {
        match self {
            Self::Schema => Ok(schema::schema()),
            Self::Completions(args) => generate::completions(args, command()),
            Self::Man(args) => generate::man(args, command()),
            Self::Render(args) => render::render(args),
            Self::Export(args) => export::export(args),
            Self::Import(args) => import::import_file(args),
            Self::Merge(args) => merge::merge(args),
        }
    }
}
