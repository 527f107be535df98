//! The scenario's events in a run: when they are triggered, and which acceleration or lane change
//! they then request.

use closecall_controllers::LaneChange;
use closecall_traffic::metrics::time_headway_s;
use closecall_traffic::{Road, Time};

use crate::world::World;
use closecall_scenarios::{Brake, Effect, Event, Scenario, Trigger};

/// One event and whether it has been triggered.
struct EventState {
    /// Index of its actor.
    actor: usize,
    event: Event,
    /// Time at which it was triggered.
    triggered_at: Option<Time>,
}

/// All events of a run.
pub(super) struct Events {
    states: Vec<EventState>,
    /// Time at which each actor started to change lanes in order to overtake.
    cut_outs: Vec<Option<Time>>,
}

/// Gain of the speed controller that ends a braking at its final speed (1/s).
const SPEED_GAIN_PER_S: f64 = 4.0;

impl Events {
    pub(super) fn new(scenario: &Scenario) -> Self {
        let states = scenario
            .actors
            .iter()
            .enumerate()
            .flat_map(|(actor, setup)| {
                setup.events.iter().map(move |event| EventState { actor, event: event.clone(), triggered_at: None })
            })
            .collect();
        Self { states, cut_outs: vec![None; scenario.actors.len()] }
    }

    /// Notes the time at which `actor` first started to change lanes in order to overtake.
    pub(super) fn note_cut_out(&mut self, actor: usize, time: Time) {
        self.cut_outs[actor].get_or_insert(time);
    }

    /// Triggers every event whose condition holds for the first time, and calls `on_trigger` with
    /// its name.
    pub(super) fn update(&mut self, world: &World, mut on_trigger: impl FnMut(&str)) {
        let now = world.time();
        for state in &mut self.states {
            if state.triggered_at.is_none() && holds(&state.event.when, world, &self.cut_outs, now) {
                state.triggered_at = Some(now);
                on_trigger(state.event.id.as_str());
            }
        }
    }

    /// Returns the acceleration that the triggered events of `actor` request (m/s²): the strongest
    /// braking among them. Returns `None` if no such event of `actor` has been triggered.
    pub(super) fn requested_mps2(&self, actor: usize, world: &World) -> Option<f64> {
        self.states
            .iter()
            .filter(|state| state.actor == actor && state.triggered_at.is_some())
            .filter_map(|state| match &state.event.then {
                Effect::Brake(brake) => Some(braking_mps2(brake, world.state(actor).speed_mps)),
                Effect::LaneChange { .. } => None,
            })
            .min_by(f64::total_cmp)
    }

    /// Returns the lane change that an event of `actor` requests now. Returns `None` if there is
    /// none, or no such lane.
    pub(super) fn lane_change(&self, actor: usize, world: &World, road: &Road) -> Option<LaneChange> {
        let is_now = |state: &&EventState| state.actor == actor && state.triggered_at == Some(world.time());
        self.states.iter().filter(is_now).find_map(|state| match state.event.then {
            Effect::Brake(_) => None,
            Effect::LaneChange { to, duration_s } => {
                let state = world.state(actor);
                let way_m = [state.s_m, state.s_m + duration_s * state.speed_mps];
                let target = road.beside(road.lane_of(state), to).filter(|target| road.is_open(*target, way_m))?;
                Some(LaneChange { target, duration_s })
            }
        })
    }
}

/// Returns whether the condition of a trigger holds at `now`.
fn holds(when: &Trigger, world: &World, cut_outs: &[Option<Time>], now: Time) -> bool {
    match *when {
        Trigger::At(time) => now >= time,
        Trigger::CutOutStarted { actor, delay } => cut_outs[actor].is_some_and(|since| now >= since + delay),
        Trigger::ThwBelow { from, to, thw_s } => world
            .neighbours(from)
            .own
            .lead
            .filter(|lead| lead.actor == to)
            .and_then(|lead| time_headway_s(lead.gap_m, world.state(from).speed_mps).ok())
            .is_some_and(|now_s| now_s < thw_s),
    }
}

/// Returns the acceleration of a braking event (m/s²): constant, and fading out as the final speed
/// is approached.
fn braking_mps2(brake: &Brake, speed_mps: f64) -> f64 {
    let left_mps = speed_mps - brake.to_speed_mps;
    if brake.to_speed_mps == 0.0 {
        -brake.deceleration_mps2
    } else {
        -(SPEED_GAIN_PER_S * left_mps).min(brake.deceleration_mps2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn braking_is_constant_and_ends_at_its_final_speed() {
        let brake = Brake { deceleration_mps2: 5.0, to_speed_mps: 20.0 };
        assert_eq!(braking_mps2(&brake, 30.0), -5.0);
        assert_eq!(braking_mps2(&brake, 20.0), 0.0);
        assert!(braking_mps2(&brake, 19.0) > 0.0);
        assert_eq!(braking_mps2(&Brake { to_speed_mps: 0.0, ..brake }, 0.1), -5.0);
    }
}
