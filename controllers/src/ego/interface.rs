//! The interface between an ego controller and the simulation loop: the input and the command of a
//! control step.

use closecall_traffic::{Lane, Road, Time, Track};
use serde::{Deserialize, Serialize};

use super::{MisPlan, Reason};

/// The ego's measurement of its own motion, from wheel speeds, inertial sensors and lane camera.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Odometry {
    /// Speed (m/s).
    pub speed_mps: f64,
    /// Longitudinal acceleration (m/s²).
    pub acceleration_mps2: f64,
    /// Yaw rate (rad/s).
    pub yaw_rate_radps: f64,
    /// The lane of the ego.
    pub lane: Lane,
    /// Lateral offset from the centre of that lane (m), positive to the left.
    pub lane_offset_m: f64,
    /// Length of the ego (m); needed because tracks give the centres of vehicles, while gaps are
    /// bumper to bumper.
    pub length_m: f64,
    /// Width of the ego (m).
    pub width_m: f64,
}

/// The groups of sensors that work.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SensorAvailability {
    /// The front radar.
    pub front: bool,
    /// The short-range sensors on both sides.
    pub surround: bool,
    /// The rear sensors.
    pub rear: bool,
}

impl SensorAvailability {
    /// All sensors work.
    pub const ALL: Self = Self { front: true, surround: true, rear: true };
}

/// The input of an ego controller at each control step: its own odometry and tracks, never the
/// ground truth.
#[derive(Clone, Copy, Debug)]
pub struct EgoInput<'a> {
    /// The time of this step.
    pub time: Time,
    /// The motion of the ego.
    pub odometry: Odometry,
    /// The road, as a map describes it.
    pub road: &'a Road,
    /// Curvature of the road at the ego (1/m), as the map describes it; positive to the left.
    pub curvature_per_m: f64,
    /// All tracks that the sensors report, including tentative ones.
    pub tracks: &'a [Track],
    /// The groups of sensors that work.
    pub sensors: SensorAvailability,
}

impl EgoInput<'_> {
    /// Refuses input that is not finite, because comparisons and `min` could otherwise make it look
    /// safe.
    ///
    /// # Errors
    /// [`ControllerError::NotFinite`] with the name of the quantity.
    pub fn check_finite(&self) -> Result<(), ControllerError> {
        let refuse = |quantity| Err(ControllerError::NotFinite { quantity, time: self.time });
        if !self.odometry.speed_mps.is_finite() {
            return refuse("own speed");
        }
        for track in self.tracks {
            let sizes = [track.length_m, track.existence, track.lane[0], track.lane[1], track.lane[2]];
            if !track.state.iter().chain(&sizes).all(|value| value.is_finite()) {
                return refuse("a track");
            }
        }
        Ok(())
    }
}

/// The state of the ego stack.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum EgoState {
    /// Only the adaptive cruise control is active.
    #[default]
    Following,
    /// The margin increase system slows the ego down to raise its front time headway.
    Increasing,
    /// The ego is in the critical phase and uses up the margin instead of braking.
    Holding,
    /// The ego returns the margin smoothly.
    Releasing,
    /// Emergency braking.
    EmergencyBraking,
}

/// The command of an ego controller.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EgoCommand {
    /// Commanded acceleration (m/s²). The closed loop refuses one beyond ±100 m/s².
    pub acceleration_mps2: f64,
    /// The state of the stack.
    pub state: EgoState,
    /// The reason for the state.
    pub reason: Reason,
    /// The plan of the margin increase system, while it has a rear vehicle as its target.
    pub plan: Option<MisPlan>,
}

/// The error of a controller that failed. Its state is undefined afterwards, and the run ends as an
/// error.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ControllerError {
    /// A number that must be finite is not.
    #[error("failed to control: {quantity} is not finite at {time}")]
    NotFinite {
        /// The quantity.
        quantity: &'static str,
        /// The time of the control step.
        time: Time,
    },
    /// A controller from outside Closecall failed for a reason of its own.
    #[error("failed at {time}: {reason}")]
    Own {
        /// The failure, in words.
        reason: String,
        /// The time of the control step.
        time: Time,
    },
    /// A controller from outside Closecall did not answer in time, by the wall clock. The same run
    /// may succeed on another machine.
    #[error("failed at {time}: {reason}")]
    Late {
        /// The failure, in words.
        reason: String,
        /// The time of the control step.
        time: Time,
    },
}

/// A controller of the ego, called once per control step (25 Hz) in order of time.
///
/// Implement this trait to test your own controller. A controller receives the knowledge of a real
/// vehicle: the odometry of the ego and the tracks of its sensors. It returns an acceleration and
/// its state. The loop simulates the sensors, the actuators and all other vehicles. One instance
/// drives one run, so that each sample starts without memory of another. A controller may fail or
/// even panic: that sample then ends as an error, and the campaign continues.
///
/// ```
/// use closecall_controllers::{ControllerError, EgoCommand, EgoController, EgoInput, EgoState, Reason};
///
/// /// Brakes gently while any track is behind the ego.
/// struct GentleBraking;
///
/// impl EgoController for GentleBraking {
///     fn step(&mut self, input: &EgoInput<'_>) -> Result<EgoCommand, ControllerError> {
///         input.check_finite()?;
///         let followed = input.tracks.iter().any(|track| track.x_m() < 0.0);
///         Ok(EgoCommand {
///             acceleration_mps2: if followed { -0.5 } else { 0.0 },
///             state: if followed { EgoState::Increasing } else { EgoState::Following },
///             reason: Reason::External,
///             plan: None,
///         })
///     }
/// }
/// ```
///
/// A complete example with a factory and a campaign is `examples/own_controller.rs`. A controller
/// in another language runs as a process of its own: `--controller exec:COMMAND`.
pub trait EgoController: Send {
    /// Returns the command for the time until the next control step.
    ///
    /// # Errors
    /// [`ControllerError`] if no command could be computed.
    fn step(&mut self, input: &EgoInput<'_>) -> Result<EgoCommand, ControllerError>;

    /// Returns the number of the process that computes the commands; `None` if this thread does, or
    /// if no step was made yet.
    fn process(&self) -> Option<u32> {
        None
    }

    /// Ends the run, which has an outcome only if this succeeds. `time` is its end. A controller
    /// that is a process checks here that the process has given no more answers than it was asked
    /// for.
    ///
    /// # Errors
    /// [`ControllerError`] if the commands of the run cannot be trusted.
    fn finish(&mut self, time: Time) -> Result<(), ControllerError> {
        let _ = time;
        Ok(())
    }
}
