//! What a human driver perceives: the surroundings with a delay, and less precisely than they are.
//!
//! ```text
//!   truth ─▶ memory of observations ─▶ one reaction time ago ─▶ looming threshold ─▶ extrapolated to now ─▶ Lead
//!            (≤ 100 Hz, 3 s)                                    brake light          (own motion known)
//! ```
//!
//! - *Delay.* The driver knows the surroundings as they were one reaction time ago. Drivers compensate for part of that
//!   delay: they know their own motion at once, and assume that other vehicles continue as perceived (temporal
//!   anticipation; Treiber, Kesting and Helbing, *Delays, inaccuracies and anticipation in microscopic traffic models*,
//!   Physica A 360 (2006) 71–88). Only a change in the motion of another vehicle is perceived late.
//! - *Looming threshold.* A driver can tell how large a speed difference is only if the visual angle of the vehicle ahead
//!   changes faster than 0.003 rad/s (Hoffmann and Mortimer, *Scaling of relative velocity between vehicles*, Accident
//!   Analysis and Prevention 28 (1996) 415–421). In reconstructed crashes drivers reacted at 0.012 to 0.04 rad/s (Maddox
//!   and Kiefer 2012). A fixed threshold is a simplification: accumulated evidence reproduces the distribution of
//!   reactions better (Xue et al., Accident Analysis and Prevention 118 (2018) 114–124). Below the threshold, the driver
//!   assumes that the vehicle ahead keeps the
//!   speed last noticed, initially the driver's own speed. The driver always knows the effect of its own accelerator
//!   and brake. Once noticed, the difference is attended to until it falls below 0.0006 rad/s. That
//!   value is an assumption; it is usually attributed to Michaels (*Perceptual factors in car following*, Proc. 2nd Int.
//!   Symp. on the Theory of Road Traffic Flow, 1963), whose text was not at hand. Range: 0.0003 to 0.001 rad/s.
//! - *Brake light.* The brake light is perceived with the same delay as everything else. The deceleration itself is
//!   perceived only gradually, from the change of speed. Until then, a driver who sees the brake light go on assumes a
//!   moderate deceleration.

use closecall_traffic::{Lane, PHYSICS_STEP, Side, Stream, Time};

use super::attention::{Attention, Lapse};
use super::reaction::MAX_REACTION_S;
use super::{DriverInput, LaneNeighbours, Lead, Neighbour};

/// Slowest change of the visual angle that a driver can scale (rad/s) (Hoffmann and Mortimer 1996).
const LOOMING_THRESHOLD_RADPS: f64 = 0.003;

/// Slowest change of the visual angle that is still noticed by a driver who already attends to it (rad/s): an
/// assumption; 0.0003 to 0.001 are plausible.
const ATTENDED_THRESHOLD_RADPS: f64 = 0.0006;

/// Time constant of the low-pass filter with which a deceleration is perceived from the change of speed (s): an
/// assumption; 0.3 to 1 are plausible.
const ACCELERATION_TIME_CONSTANT_S: f64 = 0.6;

/// Deceleration that a driver assumes when the brake light ahead goes on, before it is perceived (m/s²): an assumption, at
/// the lower end of comfortable braking (2 to 3.4).
const ASSUMED_BRAKING_MPS2: f64 = 2.0;

/// Time for which a brake light stands for [`ASSUMED_BRAKING_MPS2`] (s). Afterwards, the perceived deceleration counts. An
/// assumption; 0.5 to 2 are plausible.
const ASSUMED_BRAKING_DURATION_S: f64 = 1.0;

/// Number of stored observations: those within the longest reaction time, at most one in each physics step, plus one at
/// either end.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small positive constant")]
const MEMORY_CAPACITY: usize = (MAX_REACTION_S / PHYSICS_STEP.s()).round() as usize + 2;

/// State of another vehicle at the time of an observation.
#[derive(Clone, Copy, Debug)]
struct ObservedVehicle {
    actor: u32,
    brake_light: bool,
    gap_m: f64,
    speed_mps: f64,
    acceleration_mps2: f64,
    width_m: f64,
    /// Lateral position on the road (m).
    d_m: f64,
}

/// State of the surroundings at one time.
#[derive(Clone, Copy, Debug)]
struct Observation {
    time: Time,
    own_s_m: f64,
    own_speed_mps: f64,
    own_lane: Lane,
    ahead: Option<ObservedVehicle>,
    /// The side of the adjacent lane that was observed.
    side: Option<Side>,
    /// Lead vehicle, vehicle alongside and follower in that lane; `None` if there is no such lane.
    adjacent: Option<[Option<ObservedVehicle>; 3]>,
}

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
    /// The observed side and the lane there, next to the driver's lane at the observation; `None` if there is none.
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
    reaction: Time,
    attention: Attention,
    speed_estimate: Option<SpeedEstimate>,
    /// The side whose adjacent lane the driver observes, if any.
    side: Option<Side>,
    /// Ring buffer of observations.
    memory: Vec<Observation>,
    /// Index of the oldest observation in `memory` once it is full.
    oldest: usize,
    /// Index of the observation in use, counted from the oldest.
    current: usize,
    acceleration_estimate: AccelerationEstimate,
}

/// Perceived speed of the vehicle ahead.
#[derive(Clone, Copy, Debug)]
struct SpeedEstimate {
    actor: u32,
    speed_mps: f64,
    /// True while the driver has noticed the difference to the own speed and attends to it.
    attended: bool,
}

/// Perceived acceleration of the vehicle ahead.
#[derive(Clone, Copy, Debug)]
struct AccelerationEstimate {
    actor: u32,
    acceleration_mps2: f64,
    light_on_for_s: f64,
    time: Time,
}

impl Perception {
    /// Creates the perception of a driver with the reaction time `reaction_s` (s). `side` is the side whose adjacent
    /// lane the driver observes, if any.
    pub(crate) fn new(reaction_s: f64, side: Option<Side>) -> Self {
        Self {
            reaction: Time::from_s(reaction_s),
            attention: Attention::default(),
            speed_estimate: None,
            side,
            memory: Vec::with_capacity(MEMORY_CAPACITY),
            oldest: 0,
            current: 0,
            acceleration_estimate: AccelerationEstimate::new(u32::MAX, Time::ZERO),
        }
    }

    /// Returns the same perception with lapses of attention.
    pub(crate) fn with_lapses(self, lapse: Option<Lapse>) -> Self {
        Self { attention: Attention::new(lapse), ..self }
    }

    /// Selects the side whose adjacent lane the driver observes from now on.
    pub(crate) fn observe_side(&mut self, side: Side) {
        self.side = Some(side);
    }

    /// Stores an observation of the present, unless the driver looks away, and returns what the driver perceives now.
    pub(crate) fn observe(&mut self, input: &DriverInput<'_>, rng: &mut Stream) -> PerceivedScene {
        // The first step is always observed: without any observation there is nothing to extrapolate from.
        if !self.attention.is_looking_away(input.time, rng) || self.memory.is_empty() {
            self.store(input);
        }
        let due = input.time - self.reaction;
        while self.current + 1 < self.memory.len() && self.observation(self.current + 1).time <= due {
            self.current += 1;
        }
        let observation = *self.observation(self.current);
        let extrapolation = Extrapolation {
            elapsed_s: (input.time - observation.time).s(),
            own_travel_m: input.own.s_m - observation.own_s_m,
            own_speed_then_mps: observation.own_speed_mps,
        };
        let perceived_mps2 = self.estimate_acceleration_mps2(observation.ahead.as_ref(), input.time);
        let mut ahead = observation.ahead.map(|observed| {
            extrapolation.ahead(&observed, self.estimate_speed_mps(&observed, observation.own_speed_mps))
        });
        if observation.ahead.is_none() {
            self.speed_estimate = None;
        }
        if let Some(ahead) = &mut ahead {
            let lead = &mut ahead.lead;
            let estimated_mps2 = self.acceleration_estimate.acceleration_mps2;
            lead.gap_m += accelerated_displacement_m(lead.speed_mps, estimated_mps2, extrapolation.elapsed_s);
            lead.speed_mps = (lead.speed_mps + estimated_mps2 * extrapolation.elapsed_s).max(0.0);
            lead.acceleration_mps2 = perceived_mps2;
        }
        let adjacent = observation.side.zip(observation.adjacent).map(|(side, [lead, alongside, follower])| {
            let lane = PerceivedLane {
                lead: lead.map(|observed| extrapolation.ahead(&observed, extrapolation.adjacent_speed_mps(&observed))),
                alongside: alongside.is_some(),
                follower: follower.map(|observed| extrapolation.behind(&observed)),
            };
            (side, lane)
        });
        PerceivedScene { ahead, adjacent, lane: observation.own_lane }
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

    /// Updates and returns the perceived speed of the vehicle ahead (m/s).
    fn estimate_speed_mps(&mut self, observed: &ObservedVehicle, own_mps: f64) -> f64 {
        let known = self.speed_estimate.filter(|estimate| estimate.actor == observed.actor);
        let SpeedEstimate { speed_mps, attended, .. } =
            known.unwrap_or(SpeedEstimate { actor: observed.actor, speed_mps: own_mps, attended: false });
        let threshold = if attended { ATTENDED_THRESHOLD_RADPS } else { LOOMING_THRESHOLD_RADPS };
        let attended = observed.visual_angle_rate_radps(own_mps) >= threshold;
        // A driver also notices that the observed speed differs from the one assumed so far.
        let notices = attended || observed.visual_angle_rate_radps(speed_mps) >= LOOMING_THRESHOLD_RADPS;
        let speed_mps = if notices { observed.speed_mps } else { speed_mps };
        self.speed_estimate = Some(SpeedEstimate { actor: observed.actor, speed_mps, attended });
        speed_mps
    }

    /// Updates the perceived acceleration of the vehicle ahead and returns the one that the driver reckons with (m/s²):
    /// the perceived one, or the one that the driver assumes because of the brake light.
    fn estimate_acceleration_mps2(&mut self, observed: Option<&ObservedVehicle>, now: Time) -> f64 {
        let estimate = &mut self.acceleration_estimate;
        let Some(observed) = observed else {
            estimate.actor = u32::MAX;
            return 0.0;
        };
        let step_s = (now - estimate.time).s();
        if observed.speed_mps <= 0.0 {
            // A driver sees at once that a vehicle stands: it no longer brakes.
            *estimate = AccelerationEstimate::new(observed.actor, now);
            return 0.0;
        }
        if estimate.actor == observed.actor {
            let share = step_s / (ACCELERATION_TIME_CONSTANT_S + step_s);
            estimate.acceleration_mps2 += share * (observed.acceleration_mps2 - estimate.acceleration_mps2);
            estimate.light_on_for_s = if observed.brake_light { estimate.light_on_for_s + step_s } else { 0.0 };
        } else {
            *estimate = AccelerationEstimate::new(observed.actor, now);
        }
        estimate.time = now;
        if observed.brake_light && estimate.light_on_for_s < ASSUMED_BRAKING_DURATION_S {
            estimate.acceleration_mps2.min(-ASSUMED_BRAKING_MPS2)
        } else {
            estimate.acceleration_mps2
        }
    }
}

impl AccelerationEstimate {
    /// An estimate of zero for a vehicle first observed at `time`.
    fn new(actor: u32, time: Time) -> Self {
        Self { actor, acceleration_mps2: 0.0, light_on_for_s: 0.0, time }
    }
}

impl Observation {
    fn of(input: &DriverInput<'_>, side: Option<Side>) -> Self {
        let near = input.neighbours;
        let own_d_m = input.own.d_m;
        let nearer = match (near.own.lead.as_ref(), near.in_path.as_ref()) {
            (Some(lead), Some(in_path)) if in_path.gap_m < lead.gap_m => Some(in_path),
            (Some(lead), _) => Some(lead),
            (None, in_path) => in_path,
        };
        let adjacent: Option<&LaneNeighbours> = match side {
            Some(Side::Left) => near.left.as_ref(),
            Some(Side::Right) => near.right.as_ref(),
            None => None,
        };
        let observe = |neighbour: &Neighbour| ObservedVehicle::of(neighbour, own_d_m);
        Self {
            time: input.time,
            own_s_m: input.own.s_m,
            own_speed_mps: input.own.speed_mps,
            own_lane: input.road.lane_at(own_d_m),
            ahead: nearer.map(observe),
            side,
            adjacent: adjacent
                .map(|lane| [&lane.lead, &lane.alongside, &lane.follower].map(|n| n.as_ref().map(observe))),
        }
    }
}

impl ObservedVehicle {
    fn of(neighbour: &Neighbour, own_d_m: f64) -> Self {
        Self {
            actor: u32::try_from(neighbour.actor).unwrap_or(u32::MAX - 1),
            brake_light: neighbour.brake_light,
            gap_m: neighbour.gap_m,
            speed_mps: neighbour.speed_mps,
            acceleration_mps2: neighbour.acceleration_mps2,
            width_m: neighbour.width_m,
            d_m: own_d_m + neighbour.lateral_offset_m,
        }
    }

    /// Rate at which the vehicle's visual angle grows or shrinks, observed from a vehicle at `own_mps` (rad/s).
    /// Infinite at a gap of zero.
    fn visual_angle_rate_radps(&self, own_mps: f64) -> f64 {
        self.width_m * (self.speed_mps - own_mps).abs() / (self.gap_m * self.gap_m)
    }
}

/// Displacement over `time_s` due to an acceleration, relative to motion at constant speed (m). A braking vehicle stops
/// at standstill; it does not roll backwards.
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
    /// Perceived speed of a vehicle in the adjacent lane (m/s): its own, or the driver's if no difference is noticed.
    /// The driver looks there too briefly to attend to a difference.
    fn adjacent_speed_mps(&self, observed: &ObservedVehicle) -> f64 {
        let notices = observed.visual_angle_rate_radps(self.own_speed_then_mps) >= LOOMING_THRESHOLD_RADPS;
        if notices { observed.speed_mps } else { self.own_speed_then_mps }
    }

    fn ahead(&self, observed: &ObservedVehicle, speed_mps: f64) -> PerceivedVehicle {
        self.perceived(observed, speed_mps, observed.gap_m + speed_mps * self.elapsed_s - self.own_travel_m)
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
