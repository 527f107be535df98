//! The attribution of the first collision of a run.

use std::sync::Arc;

use closecall_campaign::runner::run_guarded;
use closecall_controllers::{EgoController, EgoSettings, EgoState, R157Driver};
use closecall_scenarios::outcome::{ClosedBy, Collision, Moment, Outcome, Phase};
use closecall_scenarios::{Scenario, Setting};
use closecall_sensors::SensorMode;
use closecall_simulation::{Arm, ControllerFactory, NoObserver, RunKey};
use closecall_traffic::geometry::BoxSide;
use closecall_traffic::{ActorId, GRAVITY_MPS2, VehicleState};
use serde::{Deserialize, Serialize};

use super::Trace;
use super::counterfactual::{Braking, Pair};
use crate::case::{Case, CausesError, fails};

/// The competent and careful driver of UN Regulation 157 in the place of the ego: it starts where
/// the ego starts, and follows with its gap.
struct CarefulEgo;

impl ControllerFactory for CarefulEgo {
    fn name(&self) -> &str {
        "r157-driver-in-place-of-ego"
    }

    fn settings(&self, settings: &EgoSettings) -> EgoSettings {
        R157Driver::settings(*settings).with_time_gap(settings.time_gap_s())
    }

    fn has_mis(&self, _: &EgoSettings) -> bool {
        false
    }

    fn build(&self, settings: &EgoSettings) -> Box<dyn EgoController> {
        Box::new(R157Driver::new(self.settings(settings)))
    }
}

/// A vehicle of a collision.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Party {
    /// The name.
    pub actor: ActorId,
    /// The side that was struck.
    pub side: BoxSide,
}

/// How a collision was avoidable. `None`: undecided. The answers for the striking vehicle are
/// decided if its front strikes the rear of the other vehicle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Avoidable {
    /// By the competent and careful driver of UN Regulation 157 in the place of the striking
    /// vehicle.
    pub careful_in_striking: Option<bool>,
    /// By this driver in the place of the ego; `None` if the run with it has no outcome.
    pub careful_as_ego: Option<bool>,
    /// By full braking of the striking vehicle as soon as the hazard can be perceived.
    pub full_braking_from_hazard: Option<bool>,
    /// By full braking of the striking vehicle from the start.
    pub full_braking_from_start: Option<bool>,
}

impl Avoidable {
    /// Returns the answer in words: the weakest means that avoids the collision.
    pub fn words(self) -> &'static str {
        match self {
            Self { careful_in_striking: Some(true), careful_as_ego: Some(true), .. } => "either careful driver",
            Self { careful_in_striking: Some(true), .. } => "a careful driver of the striking vehicle",
            Self { careful_as_ego: Some(true), .. } => "a careful driver in place of the ego",
            Self { full_braking_from_hazard: Some(true), .. } => "full braking from the hazard on only",
            Self { full_braking_from_start: Some(true), .. } => "full braking from the start only",
            Self { careful_in_striking: None, .. } => "not decided",
            _ => "nothing that was tried",
        }
    }
}

/// The attribution of the first collision of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Attribution {
    /// Time of the first contact (s).
    pub time_s: f64,
    /// The vehicle that closed the gap.
    pub striking: Party,
    /// The other vehicle.
    pub struck: Party,
    /// Whether both moved towards each other.
    pub is_mutual: bool,
    /// Phase of the encounter.
    pub phase: Phase,
    /// Whether the lead vehicle had begun to brake before the contact.
    pub is_after_lead_braking: bool,
    /// State of the ego stack at the contact.
    pub ego_state: EgoState,
    /// Relative speed at the contact (m/s).
    pub relative_speed_mps: f64,
    /// Largest change of velocity of a vehicle of the collision (m/s).
    pub delta_v_mps: f64,
    /// Further collisions of the run.
    pub further_collisions: usize,
    /// How it was avoidable.
    pub avoidable: Avoidable,
}

impl Attribution {
    /// Returns the phase in words: of the encounter, of the braking of the lead vehicle, and of the
    /// system.
    pub fn phase_words(&self) -> String {
        format!("{}, {}", braking_words(self.phase, self.is_after_lead_braking), state_word(self.ego_state))
    }
}

/// Returns the phase of the encounter, and whether the lead vehicle had begun to brake, in words.
pub fn braking_words(phase: Phase, is_after_lead_braking: bool) -> String {
    let when = if is_after_lead_braking { "after" } else { "without" };
    format!("{}, {when} braking of the lead vehicle", phase_word(phase))
}

/// Returns the phase of the encounter in a word.
pub fn phase_word(phase: Phase) -> &'static str {
    match phase {
        Phase::Approach => "approach",
        Phase::Critical => "critical",
        Phase::Overtaking => "overtaking",
        Phase::After => "after overtaking",
    }
}

/// Returns the action of the ego stack in a state.
pub fn state_word(state: EgoState) -> &'static str {
    match state {
        EgoState::Following => "ego following",
        EgoState::Increasing => "MIS braking",
        EgoState::Holding => "MIS holding",
        EgoState::Releasing => "MIS returning the margin",
        EgoState::EmergencyBraking => "emergency braking",
    }
}

/// Runs a case with further settings, and attributes its first collision. Returns the outcome, and
/// `None` if no vehicle collides.
///
/// # Errors
/// [`CausesError`] if the sample has no outcome.
pub fn attribute(case: &Case, settings: &[Setting]) -> Result<(Outcome, Option<Attribution>), CausesError> {
    let scenario = case.concrete(settings)?;
    let mut trace = Trace::default();
    let outcome = case.run_as(settings, &case.arm, &mut trace)?;
    let Some(collision) = outcome.collisions.first() else { return Ok((outcome, None)) };
    let as_ego = careful_ego_avoids(&scenario, case.key());
    let attribution = avoidable(collision, &scenario, case.key(), &trace.states, as_ego)
        .map(|avoidable| attribution_of(collision, &outcome, trace.ego_state, avoidable));
    Ok((outcome, attribution))
}

/// Returns whether no vehicle collides with the competent and careful driver of UN Regulation 157
/// in the place of the ego; `None` if this run has no outcome.
pub(super) fn careful_ego_avoids(scenario: &Scenario, key: RunKey) -> Option<bool> {
    let careful = Arm { controller: Arc::new(CarefulEgo), sensors: Some(SensorMode::GroundTruth) };
    run_guarded(scenario, key, &careful, &mut NoObserver).ok().map(|outcome| !fails(&outcome))
}

/// Returns how a collision was avoidable; `None` if one of its vehicles is not in the scenario.
/// `states` are the states of all vehicles at each physics step up to the collision.
pub(super) fn avoidable(
    collision: &Collision,
    scenario: &Scenario,
    key: RunKey,
    states: &[Vec<VehicleState>],
    careful_as_ego: Option<bool>,
) -> Option<Avoidable> {
    let roles = collision.roles();
    let index = |role: usize| scenario.actors.iter().position(|actor| actor.id == collision.between[role]);
    let indices = [index(roles[0])?, index(roles[1])?];
    let vehicles = indices.map(|index| scenario.vehicle(index, key));
    let sides = roles.map(|role| collision.struck_side[role]);
    let pair = Pair { states, step_s: scenario.physics_step.s(), indices, vehicles, sides };
    let full_mps2 = scenario.environment.friction * GRAVITY_MPS2;
    let full_from_hazard = pair.is_avoided(Braking::FullFromHazard(full_mps2));
    let full_from_start = match full_from_hazard {
        Some(true) => Some(true),
        _ => pair.is_avoided(Braking::FullFromStart(full_mps2)),
    };
    Some(Avoidable {
        careful_in_striking: pair.is_avoided(Braking::Careful),
        careful_as_ego,
        full_braking_from_hazard: full_from_hazard,
        full_braking_from_start: full_from_start,
    })
}

fn attribution_of(collision: &Collision, outcome: &Outcome, ego_state: EgoState, avoidable: Avoidable) -> Attribution {
    let roles = collision.roles();
    let party = |role: usize| Party { actor: collision.between[role].clone(), side: collision.struck_side[role] };
    Attribution {
        time_s: collision.time.s(),
        striking: party(roles[0]),
        struck: party(roles[1]),
        is_mutual: collision.closed_by == ClosedBy::Both,
        phase: collision.phase,
        is_after_lead_braking: outcome.moment(Moment::FrontBrakes).is_some_and(|time| time <= collision.time),
        ego_state,
        relative_speed_mps: collision.relative_speed_mps,
        delta_v_mps: collision.delta_v_mps[0].max(collision.delta_v_mps[1]),
        further_collisions: outcome.collisions.len() - 1,
        avoidable,
    }
}
