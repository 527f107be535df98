//! A driver's perception of the acceleration of another vehicle: gradually, from the change of its
//! speed, and by its brake light.

use closecall_traffic::Time;

use super::ObservedVehicle;

/// Time constant of the low-pass filter with which a deceleration is perceived from the change of
/// speed (s): an assumption; 0.3 to 1 are plausible.
const ACCELERATION_TIME_CONSTANT_S: f64 = 0.6;

/// Deceleration that a driver assumes when the brake light ahead goes on, before it is perceived
/// (m/s²): an assumption, at the lower end of comfortable braking (2 to 3.4).
pub(super) const ASSUMED_BRAKING_MPS2: f64 = 2.0;

/// Time for which a driver takes a brake light to mean [`ASSUMED_BRAKING_MPS2`] (s). Afterwards,
/// the perceived deceleration counts. An assumption; 0.5 to 2 are plausible.
const ASSUMED_BRAKING_DURATION_S: f64 = 1.0;

/// Perceived acceleration of a vehicle ahead.
#[derive(Clone, Copy, Debug)]
pub(super) struct AccelerationEstimate {
    pub(super) acceleration_mps2: f64,
    light_on_for_s: f64,
    time: Time,
}

impl AccelerationEstimate {
    /// An estimate of zero for a vehicle first observed at `time`.
    pub(super) fn new(time: Time) -> Self {
        Self { acceleration_mps2: 0.0, light_on_for_s: 0.0, time }
    }

    /// Updates the perceived acceleration of the vehicle. Returns the acceleration that the driver
    /// expects (m/s²): the perceived acceleration, or the acceleration that the driver assumes
    /// because of the brake light.
    pub(super) fn update_mps2(&mut self, observed: &ObservedVehicle, now: Time) -> f64 {
        let step_s = (now - self.time).s();
        if observed.speed_mps <= 0.0 {
            // A driver sees at once that a vehicle stands: it no longer brakes.
            *self = Self::new(now);
            return 0.0;
        }
        let share = step_s / (ACCELERATION_TIME_CONSTANT_S + step_s);
        self.acceleration_mps2 += share * (observed.acceleration_mps2 - self.acceleration_mps2);
        self.light_on_for_s = if observed.brake_light { self.light_on_for_s + step_s } else { 0.0 };
        self.time = now;
        if observed.brake_light && self.light_on_for_s < ASSUMED_BRAKING_DURATION_S {
            self.acceleration_mps2.min(-ASSUMED_BRAKING_MPS2)
        } else {
            self.acceleration_mps2
        }
    }
}
