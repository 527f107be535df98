//! Arguments that several commands share.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use closecall_scenarios::trajectory_data::{BadRows, LayoutChoice, ReadOptions};
use closecall_sensors::SensorMode;
use closecall_simulation::Arm;
use closecall_simulation::controller::ControllerChoice;
use closecall_simulation::controller::exec::{DEFAULT_MEMORY_MIB, DEFAULT_TIMEOUT_MS, ExecSettings, NAME as EXEC};
use closecall_simulation::scenario::{ScenarioError, ScenarioFile, Setting, source};

use closecall_traffic::suggest::hint;

use super::CliError;
use super::output::print_error;
use super::protect::of_controller;

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
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
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

/// The controller under test.
#[derive(Clone, Debug, Args)]
pub(super) struct ControllerArgs {
    /// Controller of the ego vehicle: `acc`, `mis`, or `exec:COMMAND` for a program of your own, which reads a line per
    /// control step and answers with a line
    #[arg(long, value_name = "acc|mis|exec:COMMAND", default_value = "mis", value_parser = controller)]
    controller: ControllerChoice,
    /// Time limit for each answer of an `exec` controller [default: 1000]
    #[arg(long, value_name = "MS", value_parser = clap::value_parser!(u64).range(1..=600_000))]
    controller_timeout_ms: Option<u64>,
    /// Memory limit of each process of an `exec` controller [default: 1024]
    #[arg(long, value_name = "MIB", value_parser = clap::value_parser!(u64).range(1..=1_048_576))]
    controller_memory_mib: Option<u64>,
}

impl ControllerArgs {
    /// Returns the controller with its limits.
    pub(super) fn choice(&self) -> Result<ControllerChoice, CliError> {
        let (timeout_ms, memory_mib) = (self.controller_timeout_ms, self.controller_memory_mib);
        match &self.controller {
            ControllerChoice::Exec(exec) => Ok(ControllerChoice::Exec(ExecSettings {
                timeout_ms: timeout_ms.unwrap_or(exec.timeout_ms),
                memory_mib: memory_mib.unwrap_or(exec.memory_mib),
                ..exec.clone()
            })),
            built_in if timeout_ms.is_none() && memory_mib.is_none() => Ok(built_in.clone()),
            built_in => Err(CliError::Usage {
                message: format!(
                    "--controller-timeout-ms and --controller-memory-mib apply to a process, and `{built_in}` is built in: \
                     name a process with --controller exec:COMMAND"
                ),
            }),
        }
    }
}

/// Parses the name of a controller.
fn controller(text: &str) -> Result<ControllerChoice, String> {
    match text.split_once(':') {
        None if text == ControllerChoice::Acc.name() => Ok(ControllerChoice::Acc),
        None if text == ControllerChoice::Mis.name() => Ok(ControllerChoice::Mis),
        Some((EXEC, command)) => {
            let (timeout_ms, memory_mib) = (DEFAULT_TIMEOUT_MS, DEFAULT_MEMORY_MIB);
            let exec = ExecSettings { command: command.to_owned(), timeout_ms, memory_mib };
            match exec.words() {
                Some(_) => Ok(ControllerChoice::Exec(exec)),
                None => Err(format!("`{command}` is not a command: it is empty, or its quotes do not match")),
            }
        }
        _ => {
            let known = "`acc`, `mis` or `exec:COMMAND`";
            let word = text.split(':').next().unwrap_or_default();
            let suggestion = hint(word, "`acc`, `mis`, `exec`");
            Err(format!("`{text}` is not a controller: expected {known}{suggestion}"))
        }
    }
}

/// What is simulated of a scenario: its random numbers, the controller of the ego vehicle and its sensors, and settings.
#[derive(Clone, Debug, Args)]
pub(super) struct SimulationArgs {
    /// Seed of the random numbers
    #[arg(long, default_value_t = 0)]
    pub(super) seed: u64,
    #[command(flatten)]
    pub(super) arm: ArmArgs,
    #[command(flatten)]
    pub(super) set: SetArgs,
}

/// The controller of the ego vehicle, and its sensors.
#[derive(Clone, Debug, Args)]
pub(super) struct ArmArgs {
    #[command(flatten)]
    pub(super) controller: ControllerArgs,
    /// Depth of the sensor simulation [default: that of the scenario]
    #[arg(long, value_enum)]
    pub(super) sensors: Option<SensorsChoice>,
}

impl ArmArgs {
    /// Returns the files that the command of the controller names.
    pub(super) fn files(&self) -> Vec<PathBuf> {
        of_controller(&self.controller.controller)
    }

    pub(super) fn arm(&self) -> Result<Arm, CliError> {
        Ok(arm(&self.controller.choice()?, self.sensors))
    }

    /// Returns this arm; if `paired`, the baseline before it.
    pub(super) fn arms(&self, paired: bool) -> Result<Vec<Arm>, CliError> {
        let controllers = controllers(self.controller.choice()?, paired)?;
        Ok(controllers.iter().map(|controller| arm(controller, self.sensors)).collect())
    }
}

/// Returns the controllers of a run: the tested one; if `paired`, the baseline before it.
pub(super) fn controllers(tested: ControllerChoice, paired: bool) -> Result<Vec<ControllerChoice>, CliError> {
    match (paired, tested) {
        (false, tested) => Ok(vec![tested]),
        (true, ControllerChoice::Acc) => Err(CliError::Usage {
            message: "--paired compares a controller with `acc`: name another with --controller".to_owned(),
        }),
        (true, tested) => Ok(vec![ControllerChoice::Acc, tested]),
    }
}

/// Returns the arm of a controller.
pub(super) fn arm(controller: &ControllerChoice, sensors: Option<SensorsChoice>) -> Arm {
    Arm { controller: controller.factory(), sensors: sensors.map(SensorsChoice::mode) }
}

/// The layout of a trajectory file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Layout {
    /// NGSIM: the columns of the data set, in feet
    Ngsim,
    /// highD or exiD: three files
    Highd,
    /// CommonRoad XML
    Commonroad,
    /// Plain CSV, as `closecall record` writes it
    Csv,
    /// Log of a vehicle that measures its distances to the lane markings
    InCar,
}

/// How a trajectory file is read.
#[derive(Clone, Copy, Debug, Args)]
pub(super) struct ReadArgs {
    /// Layout of the trajectory file [default: recognised by its content]
    #[arg(long, value_enum)]
    layout: Option<Layout>,
    /// Skip and count rows that cannot be used, instead of refusing the file
    #[arg(long)]
    drop_bad_rows: bool,
}

impl ReadArgs {
    /// Returns true if rows that cannot be used are skipped.
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
        ReadOptions { layout, bad_rows: if self.drop_bad_rows { BadRows::Skip } else { BadRows::Reject } }
    }
}

/// Changes of single values of a scenario.
#[derive(Clone, Debug, Args)]
pub(super) struct SetArgs {
    /// Change a value of the scenario, named by a path of keys (`actor.rear.start.behind.gap-m=90`) or by a parameter
    /// (`brake-mps2=6`); can be given more than once
    #[arg(long = "set", value_name = "KEY=VALUE", help_heading = clap::builder::Resettable::Reset)]
    pub(super) settings: Vec<Setting>,
}

impl SetArgs {
    /// Reads a scenario, applies the changes, and checks it.
    pub(super) fn load(&self, path: &Path) -> Result<ScenarioFile, ScenarioError> {
        let file = source::load(path, &self.settings)?;
        for name in file.unused_parameters() {
            print_error(format_args!(
                "warning: {}: the parameter `{name}` is sampled, but not used: write \"${name}\" where its value \
                 belongs, or remove it\n",
                file.path().display()
            ));
        }
        file.check()?;
        Ok(file)
    }
}

/// Parses a finite number above 0.
pub(super) fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value.is_finite() => Ok(value),
        _ => Err(format!("`{text}` is not a number above 0")),
    }
}

/// Parses a number of samples or scenes: a whole number above 0.
pub(super) fn count(text: &str) -> Result<u64, String> {
    let reason = match text.parse::<i128>() {
        Ok(number) if number > 0 => return u64::try_from(number).map_err(|_| format!("`{text}` is too large")),
        Ok(0) => "is no sample at all",
        Ok(_) => "is negative",
        Err(_) => "is not a whole number",
    };
    Err(format!("`{text}` {reason}: a whole number of 1 or more is needed"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_count_is_a_whole_number_above_zero() {
        assert_eq!(count("200"), Ok(200));
        for (text, reason) in [("-5", "is negative"), ("0", "no sample"), ("1.5", "not a whole number"), ("", "whole")]
        {
            assert!(count(text).unwrap_err().contains(reason), "{text}");
        }
        assert!(count("99999999999999999999999").unwrap_err().contains("too large"));
    }

    #[test]
    fn a_misspelt_controller_is_answered_with_a_suggestion() {
        assert!(controller("miss").unwrap_err().ends_with("; did you mean `mis`?"));
        assert!(controller("exce:python3 a.py").unwrap_err().ends_with("; did you mean `exec`?"));
    }
}
