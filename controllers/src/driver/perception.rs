//! The perception of a human driver: the surroundings with a delay, and imprecisely.
//!
//! ```text
//!   truth ─▶ memory of observations ─▶ one reaction time ago ─▶ looming threshold ─▶ extrapolated to now ─▶ Lead
//!            (≤ 100 Hz, 3 s)                                    brake light          (own motion known)
//! ```
//!
//! - *Delay.* The driver knows the surroundings as they were one reaction time ago. Drivers
//!   compensate for part of that delay: they know their own motion at once, and assume that other
//!   vehicles continue as perceived (temporal anticipation; Treiber, Kesting and Helbing, *Delays,
//!   inaccuracies and anticipation in microscopic traffic models*, Physica A 360 (2006) 71–88).
//!   Only a change in the motion of another vehicle is perceived late.
//! - *Urgency.* The shorter the perceived time to collision with the vehicle ahead, the shorter is
//!   the reaction time (Summala 2000; see [`reaction`](super::reaction)).
//! - *Looming threshold.* A driver can tell how large a speed difference is only if the visual
//!   angle of the vehicle ahead changes faster than 0.003 rad/s (Hoffmann and Mortimer, *Scaling of
//!   relative velocity between vehicles*, Accident Analysis and Prevention 28 (1996) 415–421). In
//!   reconstructed crashes drivers reacted at 0.012 to 0.04 rad/s (Maddox and Kiefer 2012). A fixed
//!   threshold is a simplification: accumulated evidence reproduces the distribution of reactions
//!   better (Xue et al., Accident Analysis and Prevention 118 (2018) 114–124). Below the threshold,
//!   the driver assumes that the vehicle ahead keeps the speed last noticed, initially the driver's
//!   own speed. The driver always knows the effect of its own accelerator and brake. Once the
//!   driver has noticed the difference, it attends to it until the difference falls below 0.0006
//!   rad/s. That value is an assumption; it is usually attributed to Michaels (*Perceptual factors
//!   in car following*, Proc. 2nd Int. Symp. on the Theory of Road Traffic Flow, 1963), whose text
//!   was not at hand. Range: 0.0003 to 0.001 rad/s.
//! - *Brake light.* The brake light is perceived with the same delay as everything else. The
//!   deceleration itself is perceived only gradually, from the change of speed. Until then, a
//!   driver who sees the brake light go on assumes a moderate deceleration.
//! - *Second leader.* A driver also sees the next vehicle beyond the vehicle ahead: through the
//!   windows of a car, and past a motorcycle. Beyond a truck, the driver sees a vehicle only if its
//!   rear reaches past the truck's side. The driver perceives the second leader in the same way as
//!   the vehicle ahead.
//!   Once the driver perceives the brake light of the second leader, it expects the vehicle ahead
//!   to brake (spatial anticipation; Treiber, Kesting and Helbing 2006). The sensitivity to the
//!   second leader is half of the sensitivity to the vehicle ahead (Hoogendoorn and Ossen 2006; see
//!   [`PerceptionConfig`]).
//! - *Leader that leaves.* A lane change takes seconds, and the driver foresees its end. Once the
//!   vehicle ahead is out of the lane, the driver reacts to the next vehicle at once, if that
//!   vehicle was in view one reaction time ago. The driver then uses what it knows of that vehicle.
//! - *Evidence.* A driver may accumulate looming evidence instead of using the threshold and the
//!   brake light: see [`evidence`].

mod acceleration;
mod config;
mod evidence;
mod known_vehicle;
mod observation;

pub(crate) use config::check_perception;
pub use config::{PerceptionConfig, PerceptionSettings};
pub use evidence::{Evidence, EvidenceConfig};

use closecall_traffic::{Lane, PHYSICS_STEP, Side, Stream, Time};

use self::known_vehicle::{KnownVehicle, PerceivedMotion};
use self::observation::{Observation, ObservedVehicle};
use super::attention::{Attention, Lapse};
use super::reaction::{MAX_REACTION_S, shortened_by_urgency};
use super::{DriverInput, Lead};

/// Slowest change of the visual angle that a driver can scale (rad/s) (Hoffmann and Mortimer 1996).
const LOOMING_THRESHOLD_RADPS: f64 = 0.003;

/// Slowest change of the visual angle that is still noticed by a driver who already attends to it
/// (rad/s): an assumption; 0.0003 to 0.001 are plausible.
const ATTENDED_THRESHOLD_RADPS: f64 = 0.0006;

/// Smallest gap by which a difference of speeds is divided (m): numerical; at a gap of zero the
/// ratio diverges.
const MIN_GAP_M: f64 = 0.1;

/// Number of stored observations: the observations within the longest reaction time, at most one in
/// each physics step, plus one at either end.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small positive constant")]
const MEMORY_CAPACITY: usize = (MAX_REACTION_S / PHYSICS_STEP.s()).round() as usize + 2;

/// A vehicle as the driver perceives it now.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PerceivedVehicle {
    /// Index in the scenario's list of actors.
    pub(crate) actor: usize,
    /// Perceived gap, speed and acceleration.
    pub(crate) lead: Lead,
    /// True while the driver perceives its brake light as on.
    pub(crate) brake_light: bool,
    /// Width (m).
    pub(crate) width_m: f64,
    /// Lateral position on the road (m).
    pub(crate) d_m: f64,
}

impl PerceivedVehicle {
    /// Returns true if this vehicle and the driver's vehicle would touch with their present lateral
    /// positions.
    pub(crate) fn is_in_path(&self, input: &DriverInput<'_>) -> bool {
        (self.d_m - input.own.d_m).abs() < 0.5 * (input.vehicle.dimensions.width_m + self.width_m)
    }
}

/// An adjacent lane as the driver perceives it now.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct PerceivedLane {
    pub(crate) lead: Option<PerceivedVehicle>,
    pub(crate) alongside: bool,
    pub(crate) follower: Option<PerceivedVehicle>,
}

/// The surroundings as the driver perceives them now.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PerceivedScene {
    /// The nearest vehicle ahead, in the driver's lane or in its path.
    pub(crate) ahead: Option<PerceivedVehicle>,
    /// The second leader: the next vehicle in the path.
    pub(crate) beyond: Option<PerceivedVehicle>,
    /// The observed side and the lane there, next to the driver's lane at the observation; `None`
    /// if there is none.
    adjacent: Option<(Side, PerceivedLane)>,
    /// The driver's lane at the observation.
    pub(crate) lane: Lane,
}

impl PerceivedScene {
    /// Returns the adjacent lane on `side`, or `None` if the driver has not observed that side.
    pub(crate) fn adjacent(&self, side: Side) -> Option<&PerceivedLane> {
        self.adjacent.as_ref().filter(|(observed, _)| *observed == side).map(|(_, lane)| lane)
    }
}

/// The perception of one driver: memory, attention and estimates.
#[derive(Clone, Debug)]
pub(crate) struct Perception {
    /// Reaction time where nothing is urgent (s).
    reaction_s: f64,
    /// Perceived 1/TTC with the vehicle ahead at the last step (1/s).
    inverse_ttc_per_s: f64,
    attention: Attention,
    /// The side whose adjacent lane the driver observes, if any.
    side: Option<Side>,
    /// Ring buffer of observations.
    memory: Vec<Observation>,
    /// Index of the oldest observation in `memory` once it is full.
    oldest: usize,
    /// Index of the observation in use, counted from the oldest.
    current: usize,
    settings: PerceptionSettings,
    /// The driver's knowledge of the vehicle ahead and of the second leader.
    leaders: [Option<KnownVehicle>; 2],
}

impl Perception {
    /// Creates the perception of a driver with the reaction time `reaction_s` (s). `side` is the
    /// side whose adjacent lane the driver observes, if any.
    pub(crate) fn new(reaction_s: f64, side: Option<Side>) -> Self {
        Self {
            reaction_s,
            inverse_ttc_per_s: 0.0,
            attention: Attention::default(),
            side,
            memory: Vec::with_capacity(MEMORY_CAPACITY),
            oldest: 0,
            current: 0,
            settings: PerceptionSettings::default(),
            leaders: [None; 2],
        }
    }

    /// Returns the same perception with other settings.
    pub(crate) fn with_settings(self, settings: PerceptionSettings) -> Self {
        Self { settings, ..self }
    }

    /// Returns the same perception with lapses of attention.
    pub(crate) fn with_lapses(self, lapse: Option<Lapse>) -> Self {
        Self { attention: Attention::new(lapse), ..self }
    }

    /// Selects the side whose adjacent lane the driver observes from now on.
    pub(crate) fn observe_side(&mut self, side: Side) {
        self.side = Some(side);
    }

    /// Stores an observation of the present, unless the driver looks away, and returns the driver's
    /// present perception.
    pub(crate) fn observe(&mut self, input: &DriverInput<'_>, rng: &mut Stream) -> PerceivedScene {
        // The first step is always observed: without any observation there is nothing to
        // extrapolate from.
        if !self.attention.is_looking_away(input.time, rng) || self.memory.is_empty() {
            self.store(input);
        }
        let due = input.time - Time::from_s(shortened_by_urgency(self.reaction_s, self.inverse_ttc_per_s));
        while self.current + 1 < self.memory.len() && self.observation(self.current + 1).time <= due {
            self.current += 1;
        }
        let observation = *self.observation(self.current);
        let extrapolation = Extrapolation {
            elapsed_s: (input.time - observation.time).s(),
            own_travel_m: input.own.s_m - observation.own_s_m,
            own_speed_then_mps: observation.own_speed_mps,
        };
        let [mut ahead, beyond] = self.perceive(self.leaders(&observation), &observation, &extrapolation, input.time);
        self.inverse_ttc_per_s = ahead
            .as_ref()
            .map_or(0.0, |ahead| (input.own.speed_mps - ahead.lead.speed_mps) / ahead.lead.gap_m.max(MIN_GAP_M));
        if let (Some(ahead), Some(beyond)) = (ahead.as_mut(), beyond.as_ref()) {
            self.anticipate(ahead, beyond);
        }
        let adjacent = observation.side.zip(observation.adjacent).map(|(side, [lead, alongside, follower])| {
            let lane = PerceivedLane {
                lead: lead.map(|observed| extrapolation.ahead(&observed, extrapolation.adjacent_speed_mps(&observed))),
                alongside: alongside.is_some(),
                follower: follower.map(|observed| extrapolation.behind(&observed)),
            };
            (side, lane)
        });
        PerceivedScene { ahead, beyond, adjacent, lane: observation.own_lane }
    }

    /// Returns the stored observation at `index`, counted from the oldest.
    fn observation(&self, index: usize) -> &Observation {
        &self.memory[(self.oldest + index) % self.memory.len()]
    }

    fn store(&mut self, input: &DriverInput<'_>) {
        let length = self.memory.len();
        if length > 0 && input.time - self.observation(length - 1).time < PHYSICS_STEP {
            return;
        }
        let observation = Observation::of(input, self.side);
        if length < MEMORY_CAPACITY {
            self.memory.push(observation);
        } else {
            self.memory[self.oldest] = observation;
            self.oldest = (self.oldest + 1) % MEMORY_CAPACITY;
            self.current = self.current.saturating_sub(1);
        }
    }

    /// Returns the vehicle ahead and the second leader of an observation. If the second leader is
    /// the vehicle ahead by now, it takes that place at once.
    fn leaders(&self, observation: &Observation) -> [Option<ObservedVehicle>; 2] {
        if !self.settings.looks_beyond() {
            return [observation.ahead, None];
        }
        let latest = self.observation(self.memory.len() - 1);
        match (latest.ahead, observation.beyond) {
            (Some(now), Some(beyond)) if now.actor == beyond.actor => [Some(beyond), None],
            _ => [observation.ahead, observation.beyond],
        }
    }

    /// Updates the driver's knowledge of the `leaders`, and returns them as perceived.
    fn perceive(
        &mut self,
        leaders: [Option<ObservedVehicle>; 2],
        observation: &Observation,
        extrapolation: &Extrapolation,
        now: Time,
    ) -> [Option<PerceivedVehicle>; 2] {
        let before = self.leaders;
        let tracked = leaders.map(|leader| {
            leader.map(|observed| {
                let same = before.into_iter().flatten().find(|vehicle| vehicle.actor == observed.actor);
                let mut vehicle = same.unwrap_or_else(|| KnownVehicle::new(&observed, observation, now));
                let perceived = vehicle.perceive(&observed, observation, self.settings.evidence, now);
                (vehicle, extrapolation.braking_ahead(&observed, &perceived))
            })
        });
        self.leaders = tracked.map(|leader| leader.map(|(vehicle, _)| vehicle));
        tracked.map(|leader| leader.map(|(_, perceived)| perceived))
    }

    /// Makes the driver expect that the vehicle ahead brakes if the second leader shows its brake
    /// light.
    fn anticipate(&self, ahead: &mut PerceivedVehicle, beyond: &PerceivedVehicle) {
        if beyond.brake_light {
            let expected_mps2 = self.settings.anticipation * beyond.lead.acceleration_mps2.min(0.0);
            ahead.lead.acceleration_mps2 = ahead.lead.acceleration_mps2.min(expected_mps2);
            ahead.brake_light = true;
        }
    }
}

/// Displacement over `time_s` due to an acceleration, relative to motion at constant speed (m). A
/// braking vehicle stops at standstill; it does not roll backwards.
fn accelerated_displacement_m(speed_mps: f64, acceleration_mps2: f64, time_s: f64) -> f64 {
    if speed_mps + acceleration_mps2 * time_s >= 0.0 {
        0.5 * acceleration_mps2 * time_s * time_s
    } else {
        -speed_mps * speed_mps / (2.0 * acceleration_mps2) - speed_mps * time_s
    }
}

/// Extrapolates an observation over the reaction time to now.
struct Extrapolation {
    elapsed_s: f64,
    own_travel_m: f64,
    own_speed_then_mps: f64,
}

impl Extrapolation {
    /// Returns the perceived speed of a vehicle in the adjacent lane (m/s): the true speed, or the
    /// driver's own speed if the driver notices no difference. The driver looks there too briefly
    /// to attend to a difference.
    fn adjacent_speed_mps(&self, observed: &ObservedVehicle) -> f64 {
        let notices = observed.visual_angle_rate_radps(self.own_speed_then_mps) >= LOOMING_THRESHOLD_RADPS;
        if notices { observed.speed_mps } else { self.own_speed_then_mps }
    }

    fn ahead(&self, observed: &ObservedVehicle, speed_mps: f64) -> PerceivedVehicle {
        self.perceived(observed, speed_mps, observed.gap_m + speed_mps * self.elapsed_s - self.own_travel_m)
    }

    /// Returns a vehicle ahead whose perceived motion is extrapolated to now.
    fn braking_ahead(&self, observed: &ObservedVehicle, motion: &PerceivedMotion) -> PerceivedVehicle {
        let mut ahead = self.ahead(observed, motion.speed_mps);
        let lead = &mut ahead.lead;
        lead.gap_m += accelerated_displacement_m(lead.speed_mps, motion.acceleration_mps2, self.elapsed_s);
        lead.speed_mps = (lead.speed_mps + motion.acceleration_mps2 * self.elapsed_s).max(0.0);
        lead.acceleration_mps2 = motion.expected_mps2;
        ahead.brake_light = motion.brake_light;
        ahead
    }

    fn behind(&self, observed: &ObservedVehicle) -> PerceivedVehicle {
        let speed_mps = self.adjacent_speed_mps(observed);
        self.perceived(observed, speed_mps, observed.gap_m + self.own_travel_m - speed_mps * self.elapsed_s)
    }

    fn perceived(&self, observed: &ObservedVehicle, speed_mps: f64, gap_m: f64) -> PerceivedVehicle {
        PerceivedVehicle {
            actor: observed.actor as usize,
            lead: Lead { gap_m, speed_mps, acceleration_mps2: 0.0 },
            brake_light: observed.brake_light,
            width_m: observed.width_m,
            d_m: observed.d_m,
        }
    }
}

#[cfg(test)]
mod tests;
