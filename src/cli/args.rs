//! Arguments that several commands share.

use std::path::Path;

use clap::{Args, ValueEnum};
use closecall_scenarios::recordings::{BadRows, LayoutChoice, ReadOptions};
use closecall_sensors::SensorMode;

use super::CliError;
use closecall_simulation::Arm;
use closecall_simulation::controller::ControllerChoice;
use closecall_simulation::controller::exec::{DEFAULT_MEMORY_MIB, DEFAULT_TIMEOUT_MS, ExecSettings, NAME as EXEC};
use closecall_simulation::scenario::{ScenarioError, ScenarioFile, Setting};

/// For whom output is written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(super) enum Format {
    /// For people
    #[default]
    Human,
    /// For programs: one JSON value, documented and stable
    Json,
}

/// How much of the sensors is simulated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Sensing {
    /// Point cloud, clustering, tracking
    Full,
    /// Objects with range, noise, delay
    Object,
    /// Perfect tracks
    GroundTruth,
}

impl Sensing {
    pub(super) const fn mode(self) -> SensorMode {
        match self {
            Self::Full => SensorMode::Full,
            Self::Object => SensorMode::Object,
            Self::GroundTruth => SensorMode::GroundTruth,
        }
    }
}

/// Which controller is under test.
#[derive(Clone, Debug, Args)]
pub(super) struct ControllerArgs {
    /// Controller of the ego vehicle: acc, mis, or exec:COMMAND, a process of your own that reads and answers lines
    #[arg(long, value_name = "acc|mis|exec:COMMAND", default_value = "mis", value_parser = controller)]
    controller: ControllerChoice,
    /// With exec: time allowed for each answer [default: 1000]
    #[arg(long, value_name = "MS", value_parser = clap::value_parser!(u64).range(1..=600_000))]
    controller_timeout_ms: Option<u64>,
    /// With exec: memory allowed to each process [default: 1024]
    #[arg(long, value_name = "MIB", value_parser = clap::value_parser!(u64).range(1..=1_048_576))]
    controller_memory_mib: Option<u64>,
}

impl ControllerArgs {
    /// The controller with what is allowed to it.
    pub(super) fn choice(&self) -> Result<ControllerChoice, CliError> {
        let (timeout_ms, memory_mib) = (self.controller_timeout_ms, self.controller_memory_mib);
        match &self.controller {
            ControllerChoice::Exec(exec) => Ok(ControllerChoice::Exec(ExecSettings {
                timeout_ms: timeout_ms.unwrap_or(exec.timeout_ms),
                memory_mib: memory_mib.unwrap_or(exec.memory_mib),
                ..exec.clone()
            })),
            own if timeout_ms.is_none() && memory_mib.is_none() => Ok(own.clone()),
            own => Err(CliError::Usage {
                message: format!(
                    "--controller-timeout-ms and --controller-memory-mib bound a process, and `{own}` is none: name one \
                     with --controller exec:COMMAND"
                ),
            }),
        }
    }
}

/// Reads the name of a controller.
fn controller(text: &str) -> Result<ControllerChoice, String> {
    match text.split_once(':') {
        None if text == ControllerChoice::Acc.name() => Ok(ControllerChoice::Acc),
        None if text == ControllerChoice::Mis.name() => Ok(ControllerChoice::Mis),
        Some((EXEC, command)) => {
            let (timeout_ms, memory_mib) = (DEFAULT_TIMEOUT_MS, DEFAULT_MEMORY_MIB);
            let exec = ExecSettings { command: command.to_owned(), timeout_ms, memory_mib };
            match exec.words() {
                Some(_) => Ok(ControllerChoice::Exec(exec)),
                None => Err(format!("`{command}` is no command: its quotes do not match, or it is empty")),
            }
        }
        _ => Err(format!("`{text}` is no controller: there are acc, mis and exec:COMMAND")),
    }
}

/// Who controls E, and what it perceives with.
#[derive(Clone, Debug, Args)]
pub(super) struct ArmArgs {
    #[command(flatten)]
    pub(super) controller: ControllerArgs,
    /// Depth of the sensor simulation; the scenario's own where absent
    #[arg(long, value_enum)]
    pub(super) sensors: Option<Sensing>,
}

impl ArmArgs {
    pub(super) fn arm(&self) -> Result<Arm, CliError> {
        Ok(arm(&self.controller.choice()?, self.sensors))
    }

    /// This arm alone; of a pair, the baseline before it.
    pub(super) fn arms(&self, paired: bool) -> Result<Vec<Arm>, CliError> {
        let controllers = controllers(self.controller.choice()?, paired)?;
        Ok(controllers.iter().map(|controller| arm(controller, self.sensors)).collect())
    }
}

/// The controllers of a run: the tested one, of a pair after the baseline.
pub(super) fn controllers(tested: ControllerChoice, paired: bool) -> Result<Vec<ControllerChoice>, CliError> {
    match (paired, tested) {
        (false, tested) => Ok(vec![tested]),
        (true, ControllerChoice::Acc) => Err(CliError::Usage {
            message: "--paired compares a controller with `acc`: name another with --controller".to_owned(),
        }),
        (true, tested) => Ok(vec![ControllerChoice::Acc, tested]),
    }
}

/// An arm of a controller.
pub(super) fn arm(controller: &ControllerChoice, sensors: Option<Sensing>) -> Arm {
    Arm { controller: controller.factory(), sensors: sensors.map(Sensing::mode) }
}

/// The layout of a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Layout {
    /// NGSIM's columns in feet
    Ngsim,
    /// highD's or exiD's three files
    Highd,
    /// CommonRoad XML
    Commonroad,
    /// The plain CSV that `closecall record` writes
    Csv,
    /// A log of one vehicle that sees the lane markings
    InCar,
}

/// How a recording is read.
#[derive(Clone, Copy, Debug, Args)]
pub(super) struct ReadArgs {
    /// Layout of the recording; told by its content where absent
    #[arg(long, value_enum)]
    layout: Option<Layout>,
    /// Leave out rows that cannot be used, and count them, instead of refusing the recording
    #[arg(long)]
    drop_bad_rows: bool,
}

impl ReadArgs {
    /// True where rows that cannot be used are left out.
    pub(super) fn drops_bad_rows(&self) -> bool {
        self.drop_bad_rows
    }

    pub(super) fn options(&self) -> ReadOptions {
        let layout = self.layout.map(|layout| match layout {
            Layout::Ngsim => LayoutChoice::Ngsim,
            Layout::Highd => LayoutChoice::Highd,
            Layout::Commonroad => LayoutChoice::Commonroad,
            Layout::Csv => LayoutChoice::Csv,
            Layout::InCar => LayoutChoice::InCar,
        });
        ReadOptions { layout, bad_rows: if self.drop_bad_rows { BadRows::Drop } else { BadRows::Refuse } }
    }
}

/// Changes of single values.
#[derive(Clone, Debug, Args)]
pub(super) struct SetArgs {
    /// Change a value of the scenario: a path of keys (`actor.rear.start.behind.gap-m=90`), or a parameter's name
    /// (`brake-mps2=6`); may be given more than once
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(super) settings: Vec<Setting>,
}

impl SetArgs {
    /// Reads a scenario with these changes, and checks it.
    pub(super) fn load(&self, path: &Path) -> Result<ScenarioFile, ScenarioError> {
        let file = ScenarioFile::load(path, &self.settings)?;
        for name in file.unused_parameters() {
            super::output::complain(format_args!(
                "warning: {}: the parameter `{name}` is sampled but used nowhere: write \"${name}\" where its value \
                 belongs, or remove it\n",
                path.display()
            ));
        }
        file.check()?;
        Ok(file)
    }
}

/// A finite number above 0.
pub(super) fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value.is_finite() => Ok(value),
        _ => Err(format!("`{text}` is not a number above 0")),
    }
}
