//! The controllers of the ego vehicle on the command line: the controller under test, its baseline
//! and its references.

use std::path::PathBuf;

use clap::Args;
use closecall_campaign::arguments::{parsed_list, parsed_option};
use closecall_campaign::plan::{check_functions, check_mis};
use closecall_scenarios::{Function, ScenarioFile};
use closecall_simulation::Arm;
use closecall_simulation::controller::{ArmList, ControllerChoice};
use serde::Deserialize;

use super::CliError;
use super::args::SensorsChoice;
use super::argument::Argument;
use super::help::heading;
use super::protect::files_of_controller;
use super::saved::LimitArgs;

/// The controller under test.
#[derive(Clone, Debug, Default, Args, Deserialize)]
#[serde(default)]
pub(super) struct ControllerArgs {
    /// Controller of the ego vehicle [default: the controller of the function that the scenario judges, in most scenarios `mis`]: `acc`, `mis`, `mis-ttce`, `mis-extended`,
    /// `acc-aeb`, `acc+aeb` and `cruise+aeb` (stacks whose functions are switched), `human-aeb` and `human+aeb` (the human driver
    /// that the scenario gives the ego), `blind` and `crawl` (slower from the start,
    /// without looking back), `gap-SECONDS` (cruise control with a longer time gap:
    /// `gap-1.2`, `gap-1.6`, `gap-2.0`), `r157-gap` (the minimum following distance of UN Regulation 157), `r157-driver` and
    /// `r157-fsm` (its reference models), `lib:PATH` (a shared library of your own), `fmu:PATH` (an FMU), or `exec:COMMAND` for a
    /// program of your own, which reads a line per control step and answers with a line. A built-in controller takes settings of its own:
    /// `acc+aeb:aeb.trigger-mps2=5`
    #[arg(long, value_name = "acc|mis|gap-SECONDS|…|lib:PATH|fmu:PATH|exec:COMMAND", help_heading = heading::CONTROLLER)]
    #[serde(deserialize_with = "parsed_option")]
    controller: Option<ControllerChoice>,
    #[command(flatten)]
    #[serde(rename = "..limits")]
    pub(super) limits: LimitArgs,
}

impl ControllerArgs {
    /// Returns the controller with its limits, for a scenario that judges this function.
    pub(super) fn choice(&self, function: Function) -> Result<ControllerChoice, CliError> {
        let [_, tested] = ControllerChoice::of_function(function);
        let controller = self.controller.clone().unwrap_or(tested);
        Ok(self.limited(&[controller])?.swap_remove(0))
    }

    /// Returns true if the command line names the controller.
    pub(super) const fn is_named(&self) -> bool {
        self.controller.is_some()
    }

    /// Returns the controllers, after a trial of each. Those that are processes get the limits of the
    /// command line.
    fn limited(&self, controllers: &[ControllerChoice]) -> Result<Vec<ControllerChoice>, CliError> {
        let (timeout_ms, memory_mib) = self.limits.stated();
        if let (Some(last), true) = (controllers.last(), timeout_ms.is_some() || memory_mib.is_some())
            && !controllers.iter().any(ControllerChoice::has_limits)
        {
            return Err(CliError::usage(format!(
                "{} and {} apply to a process, and `{last}` is built in: name a process, `exec:COMMAND`, `lib:PATH` or `fmu:PATH`, with {}",
                Argument("controller-timeout-ms"),
                Argument("controller-memory-mib"),
                Argument("controller")
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
    /// Depth of the sensor simulation [default: as in the scenario]
    #[arg(long, value_enum, help_heading = heading::CONTROLLER)]
    pub(super) sensors: Option<SensorsChoice>,
}

impl ArmArgs {
    /// Returns the files that the command of the controller names.
    pub(super) fn files(&self) -> Vec<PathBuf> {
        self.controller.controller.iter().flat_map(files_of_controller).collect()
    }

    /// Returns the arm of a scenario that judges this function.
    pub(super) fn arm(&self, function: Function) -> Result<Arm, CliError> {
        Ok(arm(&self.controller.choice(function)?, self.sensors))
    }
}

/// The controllers with which the controller under test is compared.
#[derive(Clone, Debug, Default, Args, Deserialize)]
#[serde(default)]
pub(super) struct ComparisonArgs {
    /// Also run every sample with the baseline controller, on the same random numbers: short for
    /// `--arms acc,CONTROLLER` if a scenario judges the margin increase system
    #[arg(long, help_heading = heading::CONTROLLER)]
    pub(super) paired: bool,
    /// Controllers that run on the same samples and random numbers. The first is the baseline, the
    /// last is the controller under test, and references lie between them. An `exec:COMMAND` takes
    /// the rest of its list: put it last, or give --arms several times
    #[arg(long, value_name = "CONTROLLER,CONTROLLER…", conflicts_with_all = ["paired", "controller"], help_heading = heading::CONTROLLER)]
    #[serde(deserialize_with = "parsed_list")]
    pub(super) arms: Vec<ArmList>,
}

impl ComparisonArgs {
    /// Returns the controllers in the order of the arms. `by_default` compares with the baseline
    /// even without `--paired`, unless the controller under test is the baseline itself.
    pub(super) fn controllers(
        &self,
        tested: &ControllerArgs,
        function: Function,
        by_default: bool,
    ) -> Result<Vec<ControllerChoice>, CliError> {
        if self.arms.is_empty() {
            let [baseline, _] = ControllerChoice::of_function(function);
            let tested = tested.choice(function)?;
            if tested == baseline && self.paired {
                return Err(CliError::usage(format!(
                    "{} compares a controller with `{baseline}`: name another with {}",
                    Argument("paired"),
                    Argument("controller")
                )));
            }
            let is_paired = self.paired || (by_default && tested != baseline);
            return Ok(if is_paired { vec![baseline, tested] } else { vec![tested] });
        }
        let arms = ArmList::joined(&self.arms)?;
        tested.limited(&arms)
    }

    /// Returns the arms of a run of a scenario, with the settings of single arms.
    pub(super) fn arms(
        &self,
        tested: &ArmArgs,
        file: &ScenarioFile,
        settings: &[(String, String)],
    ) -> Result<Vec<Arm>, CliError> {
        let controllers = self.controllers(&tested.controller, file.config().function, false)?;
        let controllers = tuned(controllers, settings)?;
        check_mis(file, &controllers)?;
        check_functions(file, &controllers)?;
        let controllers = ControllerChoice::factories(&controllers, None);
        let sensors = tested.sensors.map(SensorsChoice::mode);
        Ok(controllers.into_iter().map(|controller| Arm { controller, sensors }).collect())
    }

    /// Returns the files that the commands of the controllers name.
    pub(super) fn files(&self, tested: &ArmArgs) -> Vec<PathBuf> {
        let arms = self.arms.iter().flat_map(|list| &list.0).flat_map(files_of_controller);
        tested.files().into_iter().chain(arms).collect()
    }
}

/// Returns the controllers with the settings that the command line gives to single arms.
///
/// # Errors
/// No arm has the name of a setting, or an arm cannot have it.
pub(super) fn tuned(
    controllers: Vec<ControllerChoice>,
    settings: &[(String, String)],
) -> Result<Vec<ControllerChoice>, CliError> {
    let names: Vec<String> = controllers.iter().map(ToString::to_string).collect();
    let mut controllers = controllers;
    for (arm, setting) in settings {
        let Some(index) = names.iter().position(|name| name == arm) else {
            let arms = names.join("`, `");
            let set = Argument("set");
            return Err(CliError::usage(format!("{set} {arm}:{setting}: no arm is `{arm}`, only `{arms}`")));
        };
        let fail = |error| CliError::usage(format!("{} {arm}:{setting}: {error}", Argument("set")));
        controllers[index] = controllers[index].with_setting(setting).map_err(fail)?;
    }
    Ok(controllers)
}

/// Returns the arm of a controller.
pub(super) fn arm(controller: &ControllerChoice, sensors: Option<SensorsChoice>) -> Arm {
    Arm { controller: controller.factory(), sensors: sensors.map(SensorsChoice::mode) }
}
