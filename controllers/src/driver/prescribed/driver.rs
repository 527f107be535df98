//! The prescribed driver: adapts a profile to the simulation loop.

use closecall_traffic::{Indicator, Stream};

use super::Prescribed;
use super::profile::SpeedProfile;
use crate::driver::{Driver, DriverAction, DriverError, DriverInput, DriverNote, LaneChange, Looks, finite};

/// Gain with which a deviation from the prescribed speed is removed (1/s); well below the
/// actuators' 1/0.15 s.
const SPEED_GAIN_PER_S: f64 = 2.0;

/// Hardest braking commanded to follow a profile (m/s²): dry friction.
const MAX_BRAKING_MPS2: f64 = 9.0;

/// Largest acceleration commanded to follow a profile (m/s²).
const MAX_ACCELERATION_MPS2: f64 = 5.0;

/// A driver that follows a profile.
#[derive(Clone, Debug)]
pub(crate) struct PrescribedDriver {
    profile: Prescribed,
    /// Speeds of the profile; `None` until the first step gives the initial speed.
    speeds: Option<SpeedProfile>,
    /// Index of the next lane change.
    next_change: usize,
    /// Indicator for the present or most recent lane change.
    change_indicator: Indicator,
}

impl PrescribedDriver {
    pub(super) fn new(profile: Prescribed) -> Self {
        Self { profile, speeds: None, next_change: 0, change_indicator: Indicator::Off }
    }
}

impl Driver for PrescribedDriver {
    fn step(&mut self, input: &DriverInput<'_>, _: &mut Stream) -> Result<DriverAction, DriverError> {
        let own_mps = finite(input.own.speed_mps, "own speed", input.time)?;
        let speeds = self.speeds.get_or_insert_with(|| self.profile.speeds_from(own_mps));
        let (speed_mps, slope_mps2) = speeds.at(input.time.s());
        let requested_mps2 = slope_mps2 + SPEED_GAIN_PER_S * (speed_mps - own_mps);
        let requested_mps2 = finite(requested_mps2, "acceleration of a profile", input.time)?;
        let acceleration_mps2 = requested_mps2.clamp(-MAX_BRAKING_MPS2, MAX_ACCELERATION_MPS2);
        let lane_change = self.lane_change(input);
        let is_changing = lane_change.is_some() || input.lane_change_target.is_some();
        Ok(DriverAction {
            acceleration_mps2,
            indicator: if is_changing { self.change_indicator } else { Indicator::Off },
            note: lane_change.map(|_| DriverNote::CutOutStarted),
            lane_change,
        })
    }

    fn looks(&self) -> Looks {
        Looks::AHEAD
    }
}

impl PrescribedDriver {
    /// Returns the lane change that begins now, if any.
    fn lane_change(&mut self, input: &DriverInput<'_>) -> Option<LaneChange> {
        let change = *self.profile.lane_changes.get(self.next_change).filter(|change| input.time >= change.at)?;
        self.next_change += 1;
        let target = input.road.beside(input.road.lane_of(input.own), change.to)?;
        self.change_indicator = Indicator::towards(change.to);
        Some(LaneChange { target, duration_s: change.duration_s })
    }
}
