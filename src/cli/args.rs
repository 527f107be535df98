//! Arguments that several commands share.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use clap::error::ErrorKind;
use clap::{ArgMatches, Args, Command, FromArgMatches, ValueEnum};
use closecall_campaign::arguments::parsed_list;
use closecall_recorded::filters::{SmoothedFile, smooth_file};
use closecall_recorded::lane_change::LaneReliability;
use closecall_recorded::trajectory_data::{
    AxisOptions, BadRows, LayoutChoice, ReadOptions, TrajectoryData, TrajectoryFileError, read_with, refuse_duplicates,
};
use closecall_scenarios::{FittedFile, ScenarioError, ScenarioFile, Setting, source};
use closecall_sensors::SensorMode;
use serde::Deserialize;

use super::CliError;
use super::arms::ArmArgs;
use super::help::heading;
use super::output::{print_error, reading, warn};
use super::saved::SavedArgs;

/// The format of the output.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(super) enum Format {
    /// Text for human readers
    #[default]
    Human,
    /// One JSON value for programs; its keys are documented and stable
    Json,
}

/// The depth of the sensor simulation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum SensorsChoice {
    /// Point clouds, images, clustering, classification and tracking
    Full,
    /// Object lists with limited range, noise and delay
    Object,
    /// Tracks without any error
    GroundTruth,
}

impl SensorsChoice {
    pub(super) const fn mode(self) -> SensorMode {
        match self {
            Self::Full => SensorMode::Full,
            Self::Object => SensorMode::Object,
            Self::GroundTruth => SensorMode::GroundTruth,
        }
    }
}

/// The simulation of a scenario: its random numbers, the controller of the ego vehicle and its
/// sensors, and settings.
#[derive(Clone, Debug, Args)]
pub(super) struct SimulationArgs {
    /// Seed of the random numbers
    #[arg(long, default_value_t = 0, value_parser = closecall_campaign::arguments::seed, help_heading = heading::SAMPLES)]
    pub(super) seed: u64,
    #[command(flatten)]
    pub(super) arm: ArmArgs,
    #[command(flatten)]
    pub(super) set: SetArgs,
}

/// The layout of a trajectory file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Layout {
    /// NGSIM: the columns of the data set, in feet
    Ngsim,
    /// highD or exiD: three files
    Highd,
    /// CommonRoad XML
    Commonroad,
    /// Plain CSV, as `closecall traffic record` writes it
    Csv,
    /// Log of a vehicle that measures its distances to the lane markings
    InCar,
    /// Floating car data (FCD) of SUMO: XML, or a table
    Sumo,
    /// Vehicle record of Vissim (.fzp)
    Vissim,
    /// Trajectories of I-24 MOTION in JSON
    I24,
    /// ASAM OpenLABEL 1.0.0: cuboids of vehicles in frames
    #[value(name = "openlabel")]
    #[serde(rename = "openlabel")]
    OpenLabel,
    /// Messages of ASAM OSI: a trace file (.osi), or MCAP
    Osi,
}

/// Several trajectory files, taken together.
#[derive(Clone, Debug, Args, Deserialize)]
pub(super) struct FilesArgs {
    /// Trajectory files, whose vehicles are taken together
    #[arg(required = true, value_name = "TRAJECTORY_FILE")]
    pub(super) files: Vec<PathBuf>,
    #[command(flatten)]
    #[serde(rename = "..read")]
    pub(super) read: ReadArgs,
}

impl FilesArgs {
    /// Reads the files. None may be given twice.
    pub(super) fn read_all(&self) -> Result<Vec<TrajectoryData>, CliError> {
        let options = self.read.options();
        let data_sets = self.files.iter().map(|path| read_noting(path, options)).collect::<Result<Vec<_>, _>>()?;
        refuse_duplicates(&self.files, &data_sets).map_err(|message| CliError::Usage { message })?;
        Ok(data_sets)
    }
}

/// The files that a command takes together, by the hash of their content.
#[derive(Debug, Default)]
pub(super) struct ReadFiles(BTreeMap<String, PathBuf>);

impl ReadFiles {
    /// Notes a file. Refuses a file whose content was read before: what it holds would count twice.
    pub(super) fn note(&mut self, path: &Path, hash: &str) -> Result<(), CliError> {
        match self.0.insert(hash.to_owned(), path.to_owned()) {
            Some(first) => {
                let (first, second) = (first.display(), path.display());
                Err(CliError::usage(format!("{first} and {second} have the same content")))
            }
            None => Ok(()),
        }
    }
}

/// Reads a trajectory file, and prints the remarks that a reader of the results needs.
///
/// # Errors
/// The file cannot be read, or its content is wrong.
pub(super) fn read_noting(path: &Path, options: ReadOptions) -> Result<TrajectoryData, TrajectoryFileError> {
    let data = reading(path, || read_with(path, options))?;
    for warning in data.warnings() {
        warn(format_args!("{}: {warning}", path.display()));
    }
    advise(data.doubts_lanes, data.doubts_sides);
    Ok(data)
}

/// Reads and smooths trajectory files, each without its recorded tracks, and prints the remarks that a reader
/// of the results needs.
///
/// # Errors
/// A file cannot be read, its content is wrong, or it was read before.
pub(super) fn smooth_noting(data: &FilesArgs) -> Result<Vec<SmoothedFile>, CliError> {
    let mut read = ReadFiles::default();
    let smoothed = data.files.iter().map(|path| {
        let file = reading(path, || smooth_file(path, data.read.options()))?;
        for warning in &file.warnings {
            warn(format_args!("{}: {warning}", path.display()));
        }
        advise(file.doubts_lanes, file.doubts_sides);
        read.note(path, &file.hash)?;
        Ok::<SmoothedFile, CliError>(file)
    });
    smoothed.collect()
}

/// Warns if no lane change is found in `files`, so that nothing is judged. Returns whether that is so.
pub(super) fn warn_without_lane_changes(files: &[PathBuf], lane_changes: usize) -> bool {
    if lane_changes == 0 {
        let names: Vec<String> = files.iter().map(|file| file.display().to_string()).collect();
        warn(format_args!("{}: no lane change is found, so that nothing can be judged", names.join(", ")));
    }
    lane_changes == 0
}

/// Names the options that help if the recorded lanes are in doubt, or if left and right may be exchanged.
pub(super) fn advise(doubts_lanes: bool, doubts_sides: bool) {
    if doubts_lanes {
        print_error(format_args!("help: `--lanes none` takes no lane as recorded\n"));
    }
    if doubts_sides {
        print_error(format_args!("help: `--mirror-d --lanes-from-right` turns a mirrored file\n"));
    }
}

/// How a trajectory file is read.
#[derive(Clone, Copy, Debug, Default, Args, Deserialize)]
#[serde(default)]
pub(super) struct ReadArgs {
    /// Layout of the trajectory file [default: recognised by its content]
    #[arg(long, value_enum, help_heading = heading::DATA)]
    layout: Option<Layout>,
    /// Skip and count rows that cannot be used, instead of refusing the file
    #[arg(long, help_heading = heading::DATA)]
    pub(super) drop_bad_rows: bool,
    /// Data set to read of a file that holds several: the location of NGSIM's export
    #[arg(long, value_enum, value_name = "NAME", help_heading = heading::DATA)]
    location: Option<Location>,
    /// The lateral axis of the file is mirrored against its layout
    #[arg(long, help_heading = heading::DATA)]
    mirror_d: bool,
    /// The file counts its lanes from the right
    #[arg(long, help_heading = heading::DATA)]
    lanes_from_right: bool,
    /// The position along the road falls in the direction of travel
    #[arg(long, help_heading = heading::DATA)]
    reverse_s: bool,
    /// Lanes by which the peak criterion finds lane changes
    #[arg(long, value_enum, default_value_t, help_heading = heading::DATA)]
    pub(super) lanes: LanesChoice,
}

/// The locations of NGSIM's data sets, which its export holds together.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Location {
    /// US 101 in Los Angeles, a motorway
    #[value(name = "us-101")]
    #[serde(rename = "us-101")]
    Us101,
    /// I-80 in Emeryville, a motorway
    #[value(name = "i-80")]
    #[serde(rename = "i-80")]
    I80,
    /// Lankershim Boulevard in Los Angeles, an urban street
    Lankershim,
    /// Peachtree Street in Atlanta, an urban street
    Peachtree,
}

impl Location {
    /// Returns the name in the column `Location`.
    const fn name(self) -> &'static str {
        match self {
            Self::Us101 => "us-101",
            Self::I80 => "i-80",
            Self::Lankershim => "lankershim",
            Self::Peachtree => "peachtree",
        }
    }
}

/// The lanes by which lane changes are found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum LanesChoice {
    /// The lanes that the file states for each vehicle
    #[default]
    Recorded,
    /// None: they are estimated from the lateral positions of the traffic, or else a lateral shift by most of a lane is a lane
    /// change. For files whose lanes are missing or unreliable
    None,
}

impl LanesChoice {
    pub(super) const fn reliability(self) -> LaneReliability {
        match self {
            Self::Recorded => LaneReliability::Reliable,
            Self::None => LaneReliability::Unreliable,
        }
    }
}

impl ReadArgs {
    pub(super) fn options(&self) -> ReadOptions {
        let layout = self.layout.map(|layout| match layout {
            Layout::Ngsim => LayoutChoice::Ngsim,
            Layout::Highd => LayoutChoice::Highd,
            Layout::Commonroad => LayoutChoice::Commonroad,
            Layout::Csv => LayoutChoice::Csv,
            Layout::InCar => LayoutChoice::InCar,
            Layout::Sumo => LayoutChoice::Sumo,
            Layout::Vissim => LayoutChoice::Vissim,
            Layout::I24 => LayoutChoice::I24,
            Layout::OpenLabel => LayoutChoice::OpenLabel,
            Layout::Osi => LayoutChoice::Osi,
        });
        let Self { mirror_d, lanes_from_right, reverse_s, .. } = *self;
        let axes = AxisOptions { mirror_d, lanes_from_right, reverse_s };
        let bad_rows = if self.drop_bad_rows { BadRows::Skip } else { BadRows::Reject };
        ReadOptions {
            layout,
            bad_rows,
            axes,
            lanes: self.lanes.reliability(),
            location: self.location.map(Location::name),
        }
    }
}

/// Changes of single values of a scenario. On the command line no change undoes another.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct SetArgs {
    #[serde(rename = "set", deserialize_with = "parsed_list")]
    pub(super) settings: Vec<Setting>,
}

/// The option of [`SetArgs`].
#[derive(Args)]
struct SetOption {
    /// Change a value of the scenario, named by a path of keys (`actor.rear.start.behind.gap-m=90`),
    /// with an element of a list by its index (`actor[2].…`), or by a parameter (`brake-mps2=6`); a
    /// whole list is TOML (`'fault.rear-lidar=[{dead=true}]'`); can be given more than once. In a campaign
    /// `ARM:KEY=VALUE` sets a value of the ego stack in one arm (`acc+aeb:aeb.trigger-mps2=5`)
    #[arg(long = "set", value_name = "KEY=VALUE", help_heading = heading::SCENARIO)]
    settings: Vec<Setting>,
}

impl FromArgMatches for SetArgs {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        Self::from_arg_matches_mut(&mut matches.clone())
    }

    fn from_arg_matches_mut(matches: &mut ArgMatches) -> Result<Self, clap::Error> {
        let SetOption { settings } = SetOption::from_arg_matches_mut(matches)?;
        if let Some([first, second]) = Setting::contradiction(&settings) {
            let message = format!("--set {first} and --set {second} contradict each other: give one of them");
            return Err(clap::Error::raw(ErrorKind::ValueValidation, message));
        }
        Ok(Self { settings })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

impl Args for SetArgs {
    fn augment_args(command: Command) -> Command {
        SetOption::augment_args(command)
    }

    fn augment_args_for_update(command: Command) -> Command {
        SetOption::augment_args_for_update(command)
    }
}

impl SetArgs {
    /// Returns the changes of the scenario, and the changes of single arms: the arm, and its
    /// setting.
    pub(super) fn by_arm(&self) -> (Self, Vec<(String, String)>) {
        let (mut scenario, mut arms) = (Vec::new(), Vec::new());
        for setting in &self.settings {
            let text = setting.to_string();
            let of_arm = text.split_once('=').and_then(|(key, value)| {
                let (arm, key) = key.split_once(':')?;
                Some((arm.to_owned(), format!("{key}={value}")))
            });
            match of_arm {
                Some(of_arm) => arms.push(of_arm),
                None => scenario.push(setting.clone()),
            }
        }
        (Self { settings: scenario }, arms)
    }

    /// Reads a scenario, applies the changes, and checks it.
    pub(super) fn load(&self, path: &Path) -> Result<ScenarioFile, ScenarioError> {
        let file = source::load(path, &self.settings)?;
        file.check()?;
        Ok(file)
    }
}

/// Fitted distributions that replace the distributions of a scenario.
#[derive(Clone, Debug, Default, Args, Deserialize)]
#[serde(default)]
pub(super) struct FittedArgs {
    /// File with fitted distributions, as `traffic fit` writes it. They replace the distributions
    /// of parameters with the same name, or of parameters that were fitted to the same quantity.
    /// --set is applied after it
    #[arg(long, value_name = "FITTED.toml", help_heading = heading::SCENARIO)]
    pub(super) fitted: Option<PathBuf>,
}

impl FittedArgs {
    /// Reads a scenario, applies the fitted distributions, then the changes of `set`, and checks
    /// it.
    pub(super) fn load(&self, path: &Path, set: &SetArgs) -> Result<ScenarioFile, ScenarioError> {
        let Some(fitted) = &self.fitted else { return set.load(path) };
        let (settings, notes) = FittedFile::read(fitted)?.settings(&source::load(path, &[])?)?;
        notes.iter().for_each(|note| print_error(format_args!("note: {note}\n")));
        let replaced = SetArgs { settings: [settings, set.settings.clone()].concat() }.load(path);
        if replaced.is_err() && set.load(path).is_ok() {
            print_error(format_args!(
                "note: without --fitted the scenario is valid; a copy of {} without the lines of a parameter leaves its distribution as it is\n",
                fitted.display()
            ));
        }
        replaced
    }
}

/// A sample of a saved campaign.
#[derive(Debug, Args)]
pub(super) struct SavedSampleArgs {
    /// Folder of the campaign
    pub(super) dir: PathBuf,
    /// Number of the sample
    pub(super) sample: u64,
    /// Name of the scenario; required if the campaign has several
    #[arg(long, help_heading = heading::SAMPLES)]
    pub(super) scenario: Option<String>,
    /// Controller of the arm to run again [default: the controller under test]
    #[arg(long, value_name = "NAME", help_heading = heading::CONTROLLER)]
    pub(super) controller: Option<String>,
    #[command(flatten)]
    pub(super) saved: SavedArgs,
}
