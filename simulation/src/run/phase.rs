//! The parts of an encounter with a vehicle that comes up from behind.
//!
//! ```text
//!   Approach ──▶ Critical ──▶ Overtaking ──▶ After
//!      ▲            │ falls back     │ returns behind E
//!      └────────────┴────────────────┘
//! ```
//!
//! The vehicle in question, the challenger, is the latest one that was behind E in E's lane.

use closecall_traffic::Time;
use closecall_traffic::metrics::{CRITICAL_THW_S, bumper_gap_m};

use crate::outcome::Phase;
use crate::world::World;

/// Follows the phase of the encounter, step by step.
#[derive(Debug, Default)]
pub(crate) struct Encounter {
    challenger: Option<usize>,
    phase: Phase,
    reached_critical_gap: bool,
}

impl Encounter {
    /// The phase now.
    pub(crate) fn phase(&self) -> Phase {
        self.phase
    }

    /// Takes in one step and returns the phase. `follower` is the vehicle behind E in E's lane, with its time headway.
    pub(crate) fn update(&mut self, world: &World, ego: usize, follower: Option<(usize, f64)>) -> Phase {
        if let Some((actor, thw_s)) = follower {
            self.challenger = Some(actor);
            self.phase = if thw_s < CRITICAL_THW_S { Phase::Critical } else { Phase::Approach };
        } else if let Some(actor) = self.challenger {
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

    /// True the first time that the challenger, in whatever lane, is `critical_gap_m` or less behind E.
    pub(crate) fn reaches(&mut self, world: &World, ego: usize, critical_gap_m: f64) -> bool {
        if self.reached_critical_gap {
            return false;
        }
        let Some(actor) = self.challenger else { return false };
        self.reached_critical_gap = self.gap_m(world, ego, actor) <= critical_gap_m;
        self.reached_critical_gap
    }

    /// Gap from the challenger's front to E's rear along the road [m]; negative once the challenger is past that.
    fn gap_m(&self, world: &World, ego: usize, actor: usize) -> f64 {
        let [ego_m, actor_m] = [ego, actor].map(|index| world.vehicle(index).dimensions.length_m);
        bumper_gap_m(world.state(ego).s_m - world.state(actor).s_m, ego_m, actor_m)
    }
}

/// How long a run goes on after its first collision: a second impact of the cascade is still seen.
pub(crate) const AFTER_COLLISION: Time = Time::from_ms(2_000);
