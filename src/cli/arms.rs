//! The controllers of the ego vehicle on the command line: the one under test, and those it is compared with.

use std::path::PathBuf;

use clap::Args;
use closecall_campaign::plan::check_mis;
use closecall_scenarios::ScenarioFile;
use closecall_simulation::Arm;
use closecall_simulation::controller::{ArmList, ControllerChoice};

use super::CliError;
use super::args::SensorsChoice;
use super::help::heading;
use super::protect::of_controller;
use super::saved::LimitArgs;

/// The controller under test.
#[derive(Clone, Debug, Args)]
pub(super) struct ControllerArgs {
    /// Controller of the ego vehicle: `acc`, `mis`, `mis-ttce`, `mis-extended`, `blind` and `crawl` (slower from the start,
    /// without looking back), `gap-SECONDS` (cruise control with a longer time gap:
    /// `gap-1.2`, `gap-1.6`, `gap-2.0`), `r157-gap` (the minimum following distance of UN Regulation 157), `r157-driver` and
    /// `r157-fsm` (its reference models), `lib:PATH` (a shared library of your own), `fmu:PATH` (an FMU), or `exec:COMMAND` for a
    /// program of your own, which reads a line per control step and answers with a line
    #[arg(long, value_name = "acc|mis|gap-SECONDS|…|lib:PATH|fmu:PATH|exec:COMMAND", default_value = "mis", help_heading = heading::CONTROLLER)]
    controller: ControllerChoice,
    #[command(flatten)]
    pub(super) limits: LimitArgs,
}

impl ControllerArgs {
    /// Returns the controller with its limits.
    pub(super) fn choice(&self) -> Result<ControllerChoice, CliError> {
        Ok(self.limited(std::slice::from_ref(&self.controller))?.swap_remove(0))
    }

    /// Returns the controllers, the processes among them with the limits of the command line. Each is tried.
    fn limited(&self, controllers: &[ControllerChoice]) -> Result<Vec<ControllerChoice>, CliError> {
        let (timeout_ms, memory_mib) = (self.limits.controller_timeout_ms, self.limits.controller_memory_mib);
        if let (Some(last), true) = (controllers.last(), timeout_ms.is_some() || memory_mib.is_some())
            && !controllers.iter().any(ControllerChoice::has_limits)
        {
            return Err(CliError::usage(format!(
                "--controller-timeout-ms and --controller-memory-mib apply to a process, and `{last}` is built in: \
                     name a process with --controller exec:COMMAND, lib:PATH or fmu:PATH"
            )));
        }
        let limited: Vec<_> = controllers.iter().map(|choice| choice.limited(timeout_ms, memory_mib)).collect();
        limited.iter().try_for_each(|choice| choice.try_in(None))?;
        Ok(limited)
    }
}

/// The controller of the ego vehicle, and its sensors.
#[derive(Clone, Debug, Args)]
pub(super) struct ArmArgs {
    #[command(flatten)]
    pub(super) controller: ControllerArgs,
    /// Depth of the sensor simulation [default: that of the scenario]
    #[arg(long, value_enum, help_heading = heading::CONTROLLER)]
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
}

/// What the controller under test is compared with.
#[derive(Clone, Debug, Args)]
pub(super) struct ComparisonArgs {
    /// Also run every sample with the baseline controller `acc`, on the same random numbers: short for
    /// `--arms acc,CONTROLLER`
    #[arg(long, help_heading = heading::CONTROLLER)]
    pub(super) paired: bool,
    /// Controllers that run on the same samples and random numbers. The first is the baseline, the last is the one under
    /// test, those between are references. An `exec:COMMAND` takes the rest of its list: let it stand last, or give --arms
    /// several times
    #[arg(long, value_name = "CONTROLLER,CONTROLLER…", conflicts_with_all = ["paired", "controller"], help_heading = heading::CONTROLLER)]
    pub(super) arms: Vec<ArmList>,
}

impl ComparisonArgs {
    /// Returns the controllers in the order of the arms. `by_default` compares with the baseline even without `--paired`,
    /// unless the controller under test is the baseline itself.
    pub(super) fn controllers(
        &self,
        tested: &ControllerArgs,
        by_default: bool,
    ) -> Result<Vec<ControllerChoice>, CliError> {
        if self.arms.is_empty() {
            return match tested.choice()? {
                ControllerChoice::ACC if self.paired => {
                    Err(CliError::usage("--paired compares a controller with `acc`: name another with --controller"))
                }
                tested if self.paired || (by_default && tested != ControllerChoice::ACC) => {
                    Ok(vec![ControllerChoice::ACC, tested])
                }
                tested => Ok(vec![tested]),
            };
        }
        let arms = ArmList::joined(&self.arms)?;
        tested.limited(&arms)
    }

    /// Returns the arms of a run of a scenario.
    pub(super) fn arms(&self, tested: &ArmArgs, file: &ScenarioFile) -> Result<Vec<Arm>, CliError> {
        let controllers = self.controllers(&tested.controller, false)?;
        check_mis(file, &controllers)?;
        let controllers = ControllerChoice::factories(&controllers, None);
        let sensors = tested.sensors.map(SensorsChoice::mode);
        Ok(controllers.into_iter().map(|controller| Arm { controller, sensors }).collect())
    }

    /// Returns the files that the commands of the controllers name.
    pub(super) fn files(&self, tested: &ArmArgs) -> Vec<PathBuf> {
        let arms = self.arms.iter().flat_map(|list| &list.0).flat_map(of_controller);
        tested.files().into_iter().chain(arms).collect()
    }
}

/// Returns the arm of a controller.
pub(super) fn arm(controller: &ControllerChoice, sensors: Option<SensorsChoice>) -> Arm {
    Arm { controller: controller.factory(), sensors: sensors.map(SensorsChoice::mode) }
}
