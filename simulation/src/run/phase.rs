//! Determines the phase of the encounter with a rear vehicle.
//!
//! ```text
//!   Approach ──▶ Critical ──▶ Overtaking ──▶ After
//!      ▲            │ falls back     │ returns behind the ego
//!      └────────────┴────────────────┘
//! ```
//!
//! The rear vehicle is the one that was last behind the ego in the ego's lane.

use closecall_traffic::Time;
use closecall_traffic::metrics::{CRITICAL_THW_S, bumper_gap_m};

use crate::world::World;
use closecall_scenarios::outcome::Phase;

/// The vehicle behind the ego in the ego's lane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Follower {
    /// Index of the vehicle in the list of actors.
    pub(crate) actor: usize,
    /// Time headway of the vehicle to the ego (s).
    pub(crate) thw_s: f64,
}

/// Tracks the phase of the encounter from step to step.
#[derive(Debug, Default)]
pub(crate) struct Encounter {
    /// Index of the rear vehicle in the list of actors.
    rear: Option<usize>,
    phase: Phase,
    reached_critical_gap: bool,
}

impl Encounter {
    /// Returns the current phase.
    pub(crate) fn phase(&self) -> Phase {
        self.phase
    }

    /// Returns the index of the rear vehicle in the list of actors. `None` if no vehicle was behind
    /// the ego.
    pub(crate) fn rear(&self) -> Option<usize> {
        self.rear
    }

    /// Updates the phase by one step and returns it. `follower` is the vehicle behind the ego in
    /// the ego's lane.
    pub(crate) fn update(&mut self, world: &World, ego: usize, follower: Option<Follower>) -> Phase {
        if let Some(Follower { actor, thw_s }) = follower {
            self.rear = Some(actor);
            self.phase = if thw_s < CRITICAL_THW_S { Phase::Critical } else { Phase::Approach };
        } else if let Some(actor) = self.rear {
            self.phase = match self.gap_m(world, ego, actor) {
                gap_m
                    if gap_m < -(world.vehicle(ego).dimensions.length_m + world.vehicle(actor).dimensions.length_m) =>
                {
                    Phase::After
                }
                _ if self.phase == Phase::After => Phase::After,
                _ => Phase::Overtaking,
            };
        }
        self.phase
    }

    /// Returns true once: the first time that the rear vehicle, in any lane, is `critical_gap_m` or
    /// less behind the ego.
    pub(crate) fn reaches_critical_gap(&mut self, world: &World, ego: usize, critical_gap_m: f64) -> bool {
        if self.reached_critical_gap {
            return false;
        }
        let Some(actor) = self.rear else { return false };
        self.reached_critical_gap = self.gap_m(world, ego, actor) <= critical_gap_m;
        self.reached_critical_gap
    }

    /// Returns the gap along the road from the front of the rear vehicle `actor` to the rear end of
    /// the ego (m). It is negative once the front has passed that end.
    fn gap_m(&self, world: &World, ego: usize, actor: usize) -> f64 {
        let [ego_m, actor_m] = [ego, actor].map(|index| world.vehicle(index).dimensions.length_m);
        bumper_gap_m(world.state(ego).s_m - world.state(actor).s_m, ego_m, actor_m)
    }
}

/// Duration of a run after its first collision: a second impact of a pile-up is still observed.
pub(crate) const AFTER_COLLISION: Time = Time::from_ms(2_000);
