//! The boundary between the ego stack and the loop: what a controller is given, and what it answers.

use closecall_traffic::{Lane, Road, Time, Track};
use serde::{Deserialize, Serialize};

use super::{MisPlan, Reason};

/// E's knowledge of its own motion, from wheel speeds, inertial sensors and lane camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Odometry {
    /// Speed [m/s].
    pub speed_mps: f64,
    /// Acceleration along the vehicle [m/s²].
    pub acceleration_mps2: f64,
    /// Yaw rate [rad/s].
    pub yaw_rate_radps: f64,
    /// The lane that E drives in.
    pub lane: Lane,
    /// Position to the left of that lane's centre [m].
    pub lane_offset_m: f64,
    /// Length of E itself [m]: tracks give centres, gaps are bumper to bumper.
    pub length_m: f64,
    /// Width of E itself [m].
    pub width_m: f64,
}

/// Which groups of sensors can be relied on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SensorAvailability {
    /// The radar that looks ahead.
    pub front: bool,
    /// The short-range sensors to both sides.
    pub surround: bool,
    /// The sensors that look back.
    pub rear: bool,
}

impl SensorAvailability {
    /// Every sensor works.
    pub const ALL: Self = Self { front: true, surround: true, rear: true };
}

/// What an ego controller is given at each control step: its own odometry and tracks, never the truth.
#[derive(Clone, Copy, Debug)]
pub struct EgoInput<'a> {
    /// The time of this step.
    pub time: Time,
    /// E's own motion.
    pub odometry: Odometry,
    /// The road, as a map would give it.
    pub road: &'a Road,
    /// Everything the sensors report, tentative tracks too.
    pub tracks: &'a [Track],
    /// Which sensors work.
    pub sensors: SensorAvailability,
}

/// What the ego stack is doing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum EgoState {
    /// Adaptive cruise control alone.
    #[default]
    Following,
    /// The margin increase system slows down to raise the front time headway.
    Increasing,
    /// Inside the critical phase the margin is used up instead of braking.
    Holding,
    /// The margin is given back smoothly.
    Releasing,
    /// Emergency braking.
    EmergencyBraking,
}

/// What an ego controller answers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EgoCommand {
    /// Acceleration asked of the actuators [m/s²]; must be finite.
    pub acceleration_mps2: f64,
    /// What the stack is doing.
    pub state: EgoState,
    /// Why it does it.
    pub reason: Reason,
    /// What the margin increase system last worked out, where it follows a vehicle behind.
    pub plan: Option<MisPlan>,
}

/// A controller that failed. Its state is undefined afterwards; the run ends as an error.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ControllerError {
    /// A number that has to be finite was not.
    #[error("failed to control: {what} is not finite at {time}")]
    NotFinite {
        /// The quantity.
        what: &'static str,
        /// When.
        time: Time,
    },
}

/// Who drives E: called once for each control step (25 Hz), in order of time.
pub trait EgoController: Send {
    /// The command for the time until the next control step.
    ///
    /// # Errors
    /// [`ControllerError`] where no command could be worked out.
    fn step(&mut self, input: &EgoInput<'_>) -> Result<EgoCommand, ControllerError>;
}
