//! The second half of a step: all vehicles act and move, and the run may end.

use closecall_controllers::{DriverInput, DriverNote, EgoState};

use super::Run;
use crate::run::phase::AFTER_COLLISION;
use crate::run::{Observer, RunEvent, SampleError};
use crate::world::Action;
use closecall_scenarios::outcome::{EndReason, Moment};

impl Run<'_> {
    /// Determines the actions of all vehicles, from the current state: of the human drivers, of the
    /// scenario's events, and of the ego controller. If a human drives the ego, the controller acts
    /// only by emergency braking.
    pub(super) fn decide_actions(&mut self, observer: &mut dyn Observer) -> Result<(), SampleError> {
        let time = self.world.time();
        self.events.update(&self.world, |event| {
            observer.event(time, &RunEvent::EventTriggered { event: event.to_owned() });
        });
        let ego = self.scenario.ego;
        self.take_effect();
        let commanded_mps2 = self.acting.map_or(0.0, |command| command.acceleration_mps2);
        self.actions[ego] = Action { acceleration_mps2: commanded_mps2, ..Action::default() };
        for human in &mut self.humans {
            let actor = human.actor;
            if self.world.is_wrecked(actor) {
                continue;
            }
            let input = DriverInput {
                time,
                vehicle: self.world.vehicle(actor),
                own: self.world.state(actor),
                neighbours: &self.neighbours[actor],
                road: &self.scenario.road,
                lane_change_target: self.world.lane_change_target(actor),
                lateral_deviation_m: self.world.lateral_deviation_m(actor),
                desired_speed_offset_mps: human.desired_speed_noise.as_mut().map_or(0.0, |noise| noise.at(time)),
            };
            let action = human
                .driver
                .step(&input, &mut human.rng)
                .map_err(|source| SampleError::Driver { actor: self.scenario.actors[actor].id.clone(), source })?;
            if let Some(note) = action.note {
                if note == DriverNote::CutOutStarted {
                    self.events.note_cut_out(actor, time);
                    if !self.world.is_wrecked(ego) && self.margins.follower == Some(actor) {
                        self.moments.note(Moment::CutOut, time, Some(&self.scenario.actors[actor].id));
                    }
                }
                observer.event(time, &RunEvent::DriverNote { actor, note });
            }
            if actor == ego {
                let braking = self.acting.filter(|command| command.state == EgoState::EmergencyBraking);
                let most_mps2 = braking.map_or(f64::INFINITY, |command| command.acceleration_mps2);
                self.actions[ego].acceleration_mps2 = action.acceleration_mps2.min(most_mps2);
                continue;
            }
            self.actions[actor] = Action {
                acceleration_mps2: self
                    .events
                    .requested_mps2(actor, &self.world)
                    .map_or(action.acceleration_mps2, |event_mps2| event_mps2.min(action.acceleration_mps2)),
                lane_change: action.lane_change.or(self.events.lane_change(actor, &self.world, &self.scenario.road)),
                indicator: action.indicator,
            };
        }
        Ok(())
    }

    /// Moves the world by one step and reports new collisions to the observer.
    pub(super) fn advance(&mut self, observer: &mut dyn Observer) {
        let (collisions_before, touches_before) = (self.world.collisions().len(), self.world.touches().len());
        self.world.step(&self.actions, self.encounter.phase());
        for index in collisions_before..self.world.collisions().len() {
            let collision = &self.world.collisions()[index];
            if collision.involves(self.scenario.ego_id()) {
                let is_ahead = self.is_ahead_of_ego(index);
                self.meter.note_collision(is_ahead);
            }
            observer.event(collision.time, &RunEvent::Collision(collision.clone()));
        }
        for touch in &self.world.touches()[touches_before..] {
            observer.event(touch.time, &RunEvent::Touch(touch.clone()));
        }
    }

    /// Returns whether the other vehicle of a collision of the ego has its centre ahead of the
    /// ego's. `collision` is an index into the list of collisions.
    fn is_ahead_of_ego(&self, collision: usize) -> bool {
        let ego = self.scenario.ego;
        let between = &self.world.collisions()[collision].between;
        let other = self
            .scenario
            .actors
            .iter()
            .position(|actor| actor.id != *self.scenario.ego_id() && between.contains(&actor.id));
        other.is_some_and(|other| self.world.state(other).s_m > self.world.state(ego).s_m)
    }

    /// Returns why the run has ended, or `None` if it goes on.
    pub(super) fn end(&self) -> Option<EndReason> {
        let time = self.world.time();
        if let Some(first) = self.world.collisions().first() {
            if time >= first.time + AFTER_COLLISION {
                return Some(EndReason::Collision);
            }
        } else if self.stands_still() {
            return Some(EndReason::Standstill);
        }
        (time >= self.scenario.duration).then_some(EndReason::Duration)
    }

    /// Returns whether the ego, its lead vehicle and all vehicles behind it stand still. The ego
    /// can then not collide.
    fn stands_still(&self) -> bool {
        let ego = self.scenario.ego;
        let ego_state = self.world.state(ego);
        let lead = self.neighbours[ego].own.lead.map(|lead| lead.actor);
        ego_state.speed_mps == 0.0
            && (0..self.world.len()).all(|actor| {
                let state = self.world.state(actor);
                let matters = state.s_m <= ego_state.s_m || Some(actor) == lead;
                !matters || state.speed_mps == 0.0
            })
    }
}
