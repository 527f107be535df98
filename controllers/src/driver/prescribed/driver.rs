//! The profile in the loop.

use closecall_traffic::Stream;

use super::Prescribed;
use super::profile::SpeedProfile;
use crate::driver::{Driver, DriverAction, DriverError, DriverInput, finite};

/// How fast a deviation from the prescribed speed is removed [1/s]; well below the actuators' 1/0.15 s.
const SPEED_GAIN_PER_S: f64 = 2.0;

/// Strongest braking that is asked for to follow a profile [m/s²]: dry friction.
const STRONGEST_BRAKING_MPS2: f64 = 9.0;

/// Strongest acceleration that is asked for to follow a profile [m/s²].
const STRONGEST_ACCELERATION_MPS2: f64 = 5.0;

/// Follows a profile.
#[derive(Clone, Debug)]
pub(crate) struct PrescribedDriver {
    profile: Prescribed,
    /// The profile's speeds, known with the speed at the start.
    speeds: Option<SpeedProfile>,
}

impl PrescribedDriver {
    pub(super) fn new(profile: Prescribed) -> Self {
        Self { profile, speeds: None }
    }
}

impl Driver for PrescribedDriver {
    fn step(&mut self, input: &DriverInput<'_>, _: &mut Stream) -> Result<DriverAction, DriverError> {
        let own_mps = finite(input.own.speed_mps, "own speed", input.time)?;
        let speeds = self.speeds.get_or_insert_with(|| self.profile.speeds_from(own_mps));
        let (speed_mps, slope_mps2) = speeds.at(input.time.s());
        let wanted = slope_mps2 + SPEED_GAIN_PER_S * (speed_mps - own_mps);
        let wanted = finite(wanted, "acceleration of a profile", input.time)?;
        let acceleration_mps2 = wanted.clamp(-STRONGEST_BRAKING_MPS2, STRONGEST_ACCELERATION_MPS2);
        Ok(DriverAction { acceleration_mps2, ..DriverAction::default() })
    }
}
