//! The boundary between the ego stack and the loop: what a controller is given, and what it answers.

use closecall_traffic::{Lane, Road, Time, Track};
use serde::{Deserialize, Serialize};

use super::{MisPlan, Reason};

/// E's knowledge of its own motion, from wheel speeds, inertial sensors and lane camera.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
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
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
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

impl EgoInput<'_> {
    /// Refuses input that is not finite: comparisons and `min` would let it pass for something safe.
    ///
    /// # Errors
    /// [`ControllerError::NotFinite`], with what it is.
    pub fn check_finite(&self) -> Result<(), ControllerError> {
        let refuse = |what| Err(ControllerError::NotFinite { what, time: self.time });
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
    /// A controller that does not ship failed for a reason of its own.
    #[error("failed at {time}: {reason}")]
    Own {
        /// What happened, in words.
        reason: String,
        /// When.
        time: Time,
    },
}

/// Who drives E: called once for each control step (25 Hz), in order of time.
///
/// This is where a controller of your own plugs in. It is given what a vehicle can know, E's odometry and the tracks of
/// its sensors, and answers with an acceleration and its state; the loop sees to sensors, actuators and everybody else.
/// One value drives one run, so that whatever it remembers starts afresh with each sample. It may fail, or even panic: that
/// sample then ends as an error, and the campaign goes on.
///
/// ```
/// use closecall_controllers::{ControllerError, EgoCommand, EgoController, EgoInput, EgoState, Reason};
///
/// /// Brakes gently while anything confirmed is behind.
/// struct Shy;
///
/// impl EgoController for Shy {
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
/// A whole one, with the factory that a campaign asks for and a campaign around it, is `examples/own_controller.rs`. A
/// controller in another language runs as a process of its own: `--controller exec:COMMAND`.
pub trait EgoController: Send {
    /// The command for the time until the next control step.
    ///
    /// # Errors
    /// [`ControllerError`] where no command could be worked out.
    fn step(&mut self, input: &EgoInput<'_>) -> Result<EgoCommand, ControllerError>;
}
