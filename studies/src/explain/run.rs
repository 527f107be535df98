//! The runs of an explanation.

use closecall_controllers::CheckedDriver;
use closecall_scenarios::causal::causal_sentence;
use closecall_scenarios::outcome::Outcome;
use closecall_scenarios::{MisState, Setting, SettingError};
use closecall_simulation::controller::ControllerChoice;
use closecall_simulation::{Arm, NoObserver};
use rayon::prelude::*;

use super::usual::{unusual, usual_settings};
use super::{Cause, Explanation, MisEffect, MisRun, Stage, StageRun};
use crate::attribution::attribute;
use crate::case::{Case, CausesError, fails};

/// Explains a case. Returns `None` if no vehicle collides in it.
///
/// # Errors
/// [`CausesError`] if the sample itself has no outcome. A run with a replaced stage that has no
/// outcome does not prevent the failure; its message is kept.
pub fn explain(case: &Case) -> Result<Option<Explanation>, CausesError> {
    let (outcome, collision) = attribute(case, &[])?;
    let Some(collision) = collision else { return Ok(None) };
    let sensors = case.sensors();
    let (mut present, mut missing) = (Vec::new(), Vec::new());
    for stage in Stage::ALL {
        match stage.missing(sensors, &case.file) {
            None => present.push([stage].to_vec()),
            Some(reason) => missing.push((stage, reason.to_owned())),
        }
    }
    let scenario = case.concrete(&[])?;
    let run = |stages: &Vec<Stage>| {
        let unusual = unusual(stages[0], case, &scenario);
        let perfect = StageRun { unusual: unusual.clone(), ..replaced(case, stages) };
        // A stage that is out of order may be the cause although its perfection brings about
        // another failure.
        let usual = usual_settings(stages[0], case);
        if unusual.is_none() || perfect.prevents || usual.is_empty() {
            return vec![perfect];
        }
        vec![perfect, StageRun { unusual, is_usual: true, ..with_settings(case, stages, usual) }]
    };
    let stages: Vec<StageRun> = present.par_iter().flat_map(run).collect();
    let first_of = |is_unusual: bool| {
        stages.iter().find(|run| run.prevents && (run.unusual.is_some() || !is_unusual)).map(|run| run.stages[0])
    };
    let first = first_of(true).or(first_of(false));
    let mut pairs = Vec::new();
    let cause = match first {
        Some(stage) => Cause::Stage { stage },
        None => {
            pairs = tried_pairs(case, &present);
            match pairs.iter().find(|run| run.prevents).map(|run| &run.stages[..]) {
                Some(&[first, second]) => Cause::Pair { stages: [first, second] },
                _ => Cause::None,
            }
        }
    };
    Ok(Some(Explanation {
        scenario: case.file.config().name.clone(),
        seed: case.sampling.seed,
        sample: case.sample,
        controller: case.arm.controller.name().to_owned(),
        sensors: sensors.name().to_owned(),
        happened: causal_sentence(&scenario, case.arm.sensors, case.arm.goal_s(&scenario), &outcome),
        collision,
        stages,
        missing,
        pairs,
        cause,
        mis: mis_effect(case, &outcome)?,
    }))
}

/// Runs the case with every pair of stages replaced, in the order of the chain.
fn tried_pairs(case: &Case, present: &[Vec<Stage>]) -> Vec<StageRun> {
    let stages: Vec<Stage> = present.iter().flatten().copied().collect();
    let pairs: Vec<[Stage; 2]> = stages
        .iter()
        .enumerate()
        .flat_map(|(index, &first)| stages[index + 1..].iter().map(move |&second| [first, second]))
        .collect();
    pairs.par_iter().map(|pair| replaced(case, pair)).collect()
}

/// Runs the case with stages replaced.
fn replaced(case: &Case, stages: &[Stage]) -> StageRun {
    with_settings(case, stages, stages.iter().map(|stage| stage.setting_text()).collect())
}

/// Runs the case with settings that replace stages.
fn with_settings(case: &Case, stages: &[Stage], texts: Vec<String>) -> StageRun {
    let settings: Result<Vec<Setting>, SettingError> = texts.iter().map(|text| text.parse()).collect();
    let result = match settings {
        Ok(settings) => case.run(&settings).map_err(|error| error.to_string()),
        Err(error) => Err(error.to_string()),
    };
    StageRun::new(stages, texts, result)
}

/// Returns the role of the margin increase system in the failure; `None` if the controller has
/// none.
fn mis_effect(case: &Case, outcome: &Outcome) -> Result<Option<MisEffect>, CausesError> {
    let scenario = case.concrete(&[])?;
    let CheckedDriver::Ego(settings) = &scenario.actors[scenario.ego].driver else { return Ok(None) };
    if !case.arm.controller.has_mis(settings) {
        return Ok(None);
    }
    let without = Arm { controller: ControllerChoice::ACC.factory(), sensors: case.arm.sensors };
    let is_induced = case.run_as(&[], &without, &mut NoObserver).is_ok_and(|outcome| !fails(&outcome));
    let mut tried: Vec<Vec<MisState>> = MisState::ALL.map(|state| vec![state]).to_vec();
    tried.push(MisState::ALL.to_vec());
    let runs = if is_induced { tried.iter().map(|off| without_mis(case, off)).collect() } else { Vec::new() };
    let state = runs.iter().find(|run: &&MisRun| run.prevents && run.off.len() == 1).map(|run| run.off[0]);
    let summary = outcome.mis.as_ref().ok();
    Ok(Some(MisEffect {
        is_induced,
        runs,
        state,
        engaged_at_s: summary.and_then(|mis| mis.engaged_at_s.ok()),
        released_at_s: summary.and_then(|mis| mis.released_at_s.ok()),
        mean_deceleration_mps2: summary.and_then(|mis| mis.mean_deceleration_mps2.ok()),
    }))
}

/// Runs the case with the margin increase system switched off in some states.
fn without_mis(case: &Case, off: &[MisState]) -> MisRun {
    let names: Vec<String> = off.iter().map(|state| format!("\"{}\"", state.name())).collect();
    let setting = format!("ideal.without-mis=[{}]", names.join(", "));
    let outcome = setting.parse().map(|parsed: Setting| case.run(&[parsed]));
    let prevents = matches!(&outcome, Ok(Ok(outcome)) if !fails(outcome));
    MisRun { off: off.to_vec(), setting, prevents }
}
