//! A driver's knowledge of the motion of one vehicle ahead, from one observation to the next.

use closecall_traffic::Time;

use super::acceleration::AccelerationEstimate;
use super::evidence::{Belief, Evidence, Looming};
use super::observation::{Observation, ObservedVehicle};
use super::{ATTENDED_THRESHOLD_RADPS, LOOMING_THRESHOLD_RADPS};

/// A driver's knowledge of the motion of one vehicle ahead.
#[derive(Clone, Copy, Debug)]
pub(super) struct KnownVehicle {
    /// Index of the vehicle.
    pub(super) actor: u32,
    /// Speed last noticed (m/s).
    speed_mps: f64,
    /// True while the driver has noticed the difference to the own speed and attends to it.
    attended: bool,
    acceleration: AccelerationEstimate,
    /// The expectation of a driver who accumulates evidence, and the time of the last accumulated
    /// observation.
    belief: Option<(Belief, Time)>,
}

/// The motion of a vehicle ahead at an observation, as perceived.
#[derive(Clone, Copy, Debug)]
pub(super) struct PerceivedMotion {
    /// Speed (m/s).
    pub(super) speed_mps: f64,
    /// Acceleration since the observation (m/s²).
    pub(super) acceleration_mps2: f64,
    /// Acceleration that the driver expects from now on (m/s²).
    pub(super) expected_mps2: f64,
    /// True if the driver perceives the brake light as on.
    pub(super) brake_light: bool,
}

impl KnownVehicle {
    /// A vehicle that the driver sees for the first time, and believes to drive at the own speed.
    pub(super) fn new(observed: &ObservedVehicle, observation: &Observation, now: Time) -> Self {
        Self {
            actor: observed.actor,
            speed_mps: observation.own_speed_mps,
            attended: false,
            acceleration: AccelerationEstimate::new(now),
            belief: None,
        }
    }

    /// Updates the driver's knowledge, and returns the perceived motion.
    pub(super) fn perceive(
        &mut self,
        observed: &ObservedVehicle,
        observation: &Observation,
        evidence: Option<Evidence>,
        now: Time,
    ) -> PerceivedMotion {
        let expected_mps2 = self.acceleration.update_mps2(observed, now);
        match evidence {
            None => PerceivedMotion {
                speed_mps: self.notice_speed_mps(observed, observation.own_speed_mps),
                acceleration_mps2: self.acceleration.acceleration_mps2,
                expected_mps2,
                brake_light: observed.brake_light,
            },
            Some(evidence) => self.accumulate(observed, observation, evidence),
        }
    }

    /// Returns the motion as a driver perceives it who accumulates evidence. The brake light counts
    /// once the driver has noticed that the vehicle slows down.
    fn accumulate(
        &mut self,
        observed: &ObservedVehicle,
        observation: &Observation,
        evidence: Evidence,
    ) -> PerceivedMotion {
        let seen = Looming {
            actor: observed.actor,
            gap_m: observed.gap_m,
            speed_mps: observed.speed_mps,
            acceleration_mps2: self.acceleration.acceleration_mps2,
            step_s: self.belief.map_or(0.0, |(_, last)| (observation.time - last).s()),
        };
        let before = self.belief.map(|(belief, _)| belief);
        let belief = Belief::updated(before, evidence, seen, observation.own_speed_mps);
        self.belief = Some((belief, observation.time));
        PerceivedMotion {
            speed_mps: belief.speed_mps,
            acceleration_mps2: belief.acceleration_mps2,
            expected_mps2: belief.acceleration_mps2,
            brake_light: observed.brake_light && belief.acceleration_mps2 < 0.0,
        }
    }

    /// Updates and returns the speed of a driver who notices differences above the looming
    /// threshold (m/s).
    fn notice_speed_mps(&mut self, observed: &ObservedVehicle, own_mps: f64) -> f64 {
        let threshold = if self.attended { ATTENDED_THRESHOLD_RADPS } else { LOOMING_THRESHOLD_RADPS };
        self.attended = observed.visual_angle_rate_radps(own_mps) >= threshold;
        // A driver also notices that the observed speed differs from the assumed speed.
        let notices = self.attended || observed.visual_angle_rate_radps(self.speed_mps) >= LOOMING_THRESHOLD_RADPS;
        if notices {
            self.speed_mps = observed.speed_mps;
        }
        self.speed_mps
    }
}
