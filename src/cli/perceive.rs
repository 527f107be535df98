//! `closecall study perceive`: the chain behind the rear LiDARs on recorded scans.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use closecall_campaign::runner::{Sampling, concrete};
use closecall_recorded::scans::{Labels, Poses, Recording, ScanOptions};
use closecall_report::perception::RecordedReport;
use closecall_report::tables::TrackRecorder;
use closecall_scenarios::sampling::Design;
use closecall_scenarios::{Scenario, ScenarioFile};
use closecall_sensors::RecordedPerception;
use closecall_sensors::lidar::PointFrame;
use closecall_simulation::RunKey;
use closecall_studies::perception::recorded::{RecordedInput, study_recording};

use super::CliError;
use super::args::{Format, SetArgs};
use super::help::{examples, heading};
use super::output::{outln, print_text, print_written, reading, warn};
use super::protect::{must_be_writable, protect};
use crate::exit_code::ExitCode;

/// Frame of recorded points.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum Frame {
    /// The ego's at the end of the scan, with its motion compensated
    #[default]
    Ego,
    /// The sensor's when it measured the point
    Sensor,
}

/// Meaning of the time of a recorded scan.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum Stamp {
    /// Its end
    #[default]
    End,
    /// Its start
    Start,
}

/// Arguments of `closecall study perceive`.
#[derive(Debug, Args)]
#[command(after_help = examples([
    "closecall study perceive scans.parquet",
    "closecall study perceive drive.mcap my-sensors.toml --frame sensor --stamp start",
    "closecall study perceive clouds my-sensors.toml --labels boxes.csv --tracks tracks.parquet",
]))]
pub(super) struct PerceiveArgs {
    /// Recorded scans: a folder of *.pcd files with scans.csv, a table *.parquet, or a file *.mcap
    /// with PointCloud2 messages of ROS 2
    recording: PathBuf,
    /// Scenario file, or name of a scenario of the library, whose rear LiDARs have recorded the
    /// scans, at the nominal values of its parameters
    #[arg(default_value = "low-thw-overtake")]
    scenario: PathBuf,
    /// Table with the poses of the ego [default: poses.csv of the recording, or its Odometry
    /// messages]
    #[arg(long, value_name = "FILE.csv", help_heading = heading::DATA)]
    poses: Option<PathBuf>,
    /// Table with the other vehicles, to which the tracks are compared [default: labels.csv of the
    /// recording, if it has one]
    #[arg(long, value_name = "FILE.csv", help_heading = heading::DATA)]
    labels: Option<PathBuf>,
    /// Frame of the points: x ahead, y to the left, z up in both
    #[arg(long, value_enum, default_value_t, help_heading = heading::DATA)]
    frame: Frame,
    /// What the time of a scan is
    #[arg(long, value_enum, default_value_t, help_heading = heading::DATA)]
    stamp: Stamp,
    /// Factor from recorded intensities to reflectivities: 1 for a white surface that faces the
    /// sensor
    #[arg(long, default_value_t = 1.0, value_parser = scale, help_heading = heading::DATA)]
    intensity_scale: f32,
    /// Leave out points whose position is not finite, or the origin: beams without a return
    #[arg(long, help_heading = heading::DATA)]
    drop_invalid: bool,
    /// Sample of the scenario whose parameters hold, in place of the nominal values: the sample of the run
    /// that has recorded the scans
    #[arg(long, value_name = "N", help_heading = heading::SAMPLES)]
    sample: Option<u64>,
    /// Seed of that sample
    #[arg(long, default_value_t = 0, value_parser = closecall_campaign::arguments::seed, requires = "sample", help_heading = heading::SAMPLES)]
    seed: u64,
    #[command(flatten)]
    set: SetArgs,
    /// Write the tracks: a table with one row per control step and track, with the columns of `run`
    #[arg(long, value_name = "FILE.parquet", value_parser = closecall_campaign::arguments::parquet, help_heading = heading::OUTPUT)]
    tracks: Option<PathBuf>,
    /// Output format
    #[arg(long, value_enum, default_value_t, help_heading = heading::OUTPUT)]
    format: Format,
}

/// Parses a factor of intensities.
fn scale(text: &str) -> Result<f32, String> {
    let factor = text.parse::<f32>().ok().filter(|factor| *factor > 0.0 && factor.is_finite());
    factor.ok_or_else(|| format!("a number above 0 and up to {:e} is needed", f32::MAX))
}

impl PerceiveArgs {
    /// Returns the sample of the scenario, and its key.
    fn concrete(&self, file: &ScenarioFile) -> Result<(Scenario, RunKey), CliError> {
        let key = RunKey { seed: self.seed, sample: self.sample.unwrap_or_default() };
        let scenario = match self.sample {
            None => file.concrete(&file.space().nominal())?,
            Some(sample) => {
                let sampling = Sampling { seed: self.seed, design: Design::Random, samples: sample.saturating_add(1) };
                concrete(file, sampling, sample).map_err(|source| CliError::Sample { sample, source })?
            }
        };
        if scenario.sensors.program().is_some() {
            let message = "the scenario has a perception program: only a run starts one, and this study shows the built-in chain; \
                           --set 'sensors.perception=\"built-in\"' takes it";
            return Err(CliError::usage(message));
        }
        Ok((scenario, key))
    }

    fn options(&self, scenario: &Scenario) -> ScanOptions {
        let model = scenario.sensors.full_model();
        ScanOptions {
            lidars: model.rear_lidars().map(|lidar| lidar.name()).collect(),
            front: model.front_lidar.map(|lidar| lidar.name()),
            intensity_scale: self.intensity_scale,
            drops_invalid: self.drop_invalid,
            stamp_is_start: self.stamp == Stamp::Start,
        }
    }
}

pub(super) fn perceive(args: &PerceiveArgs) -> Result<ExitCode, CliError> {
    let inputs = [Some(&args.recording), args.poses.as_ref(), args.labels.as_ref()];
    let inputs: Vec<PathBuf> = inputs.into_iter().flatten().cloned().collect();
    protect(&inputs, &[("--tracks", args.tracks.as_deref())])?;
    must_be_writable(args.tracks.as_deref())?;
    let file = args.set.load(&args.scenario)?;
    let (scenario, key) = args.concrete(&file)?;
    let options = args.options(&scenario);
    let lidars = options.lidars.clone();
    let mut recording = Recording::open(&args.recording, options)?;
    let poses = recording.poses(args.poses.as_deref())?;
    if scenario.road.alignment().is_some() && !poses.has_map() {
        let message = "the scenario has `road.alignment`, on which the poses have no place: they need `s_m`, `d_m` and \
                       `heading_rad`; without them, the road is the arc that the ego drives";
        return Err(CliError::usage(message));
    }
    poses.check_on(&scenario.road)?;
    let labels = labels(&recording, args.labels.as_deref(), &poses)?;
    let ego = scenario.vehicle(scenario.ego, key);
    let frame = match args.frame {
        Frame::Ego => PointFrame::Ego,
        Frame::Sensor => PointFrame::Sensor,
    };
    let start = &scenario.actors[scenario.ego].start;
    let lane = scenario.road.lane_of(start);
    let input = RecordedInput {
        recording,
        lidars,
        poses: &poses,
        labels: labels.as_ref(),
        perception: RecordedPerception::new(&scenario.sensors, frame, ego.dimensions.length_m),
        road: scenario.road.clone(),
        lane_d_m: scenario.road.lane_centre_m(lane, start.s_m),
        ego,
    };
    let mut recorder = TrackRecorder::default();
    let name = |vehicle: usize| labels.as_ref().map(|labels| labels.names[vehicle].clone()).unwrap_or_default();
    let study = reading(&args.recording, || {
        study_recording(input, &mut |step| {
            if args.tracks.is_some() {
                let truth = step.scene.map(|scene| (scene, &name as &dyn Fn(usize) -> String));
                recorder.record(step.time, step.tracks, truth);
            }
        })
    })?;
    if let Some(doubt) = study.doubt() {
        warn(format_args!("{}: {doubt}", args.recording.display()));
    }
    let report =
        RecordedReport { recording: args.recording.display().to_string(), scenario: file.config().name.clone(), study };
    match args.format {
        Format::Json => outln!("{:#}", report.json()),
        Format::Human => print_text(&report),
    }
    if let Some(tracks) = &args.tracks {
        recorder.write(tracks)?;
        print_written(tracks);
    }
    Ok(ExitCode::Pass)
}

/// Reads the labels: from the file if it is given, else the labels beside the recording, if
/// there are any.
fn labels(recording: &Recording, file: Option<&Path>, poses: &Poses) -> Result<Option<Labels>, CliError> {
    let beside = recording.companion("labels");
    let path = file.or_else(|| beside.exists().then_some(&*beside));
    Ok(path.map(|path| Labels::read(path, poses)).transpose()?)
}
