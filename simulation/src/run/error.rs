//! The errors that keep a sample from having an outcome.

use closecall_controllers::{ControllerError, DriverError};
use closecall_sensors::SensorError;
use closecall_traffic::statistics::format::exact;
use closecall_traffic::{ActorId, ConfigError, Time};

/// Largest acceleration that an ego controller may ask for, in either direction (m/s²). The tyres
/// limit what the vehicle does, at some 10 m/s²; racing cars brake with some 50 m/s². A larger
/// number has another unit, such as mm/s². An assumption; 20 to 1,000 are plausible.
pub(super) const LARGEST_COMMAND_MPS2: f64 = 100.0;

/// A run that could not be completed. It is an error of this sample: it is counted and reported,
/// and never passes.
///
/// Only the key of the run remains; the same sample can be run again.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SampleError {
    /// The sampled parameter values do not result in a valid scenario.
    #[error("failed to make the concrete scenario: {0}")]
    Scenario(ConfigError),
    /// The ego cannot start in balance with the gap of its controller, because another vehicle is
    /// in the way.
    #[error(
        "failed to start the ego at the gap of `{controller}`: it is {moved_m:.1} m from where the scenario places the ego, and \
         `{actor}` leaves {room_m:.1} m"
    )]
    Start {
        /// The controller.
        controller: String,
        /// Distance from the place of the scenario (m).
        moved_m: f64,
        /// The vehicle in the way.
        actor: ActorId,
        /// The gap to that vehicle at the place of the scenario (m).
        room_m: f64,
    },
    /// The sensors could not be set up, or failed during the run.
    #[error("the sensors {0}")]
    Sensors(#[from] SensorError),
    /// The ego controller failed.
    #[error("the ego controller {0}")]
    Controller(#[from] ControllerError),
    /// The acceleration that the ego controller commanded is no number that a vehicle could follow.
    #[error(
        "the ego controller asked for an acceleration of {} m/s² at {time}: it must be a number from -{limit} to {limit}",
        exact(*.value),
        limit = LARGEST_COMMAND_MPS2
    )]
    Command {
        /// The commanded acceleration (m/s²).
        value: f64,
        /// Time of the command.
        time: Time,
    },
    /// A human driver failed.
    #[error("the driver of `{actor}` {source}")]
    Driver {
        /// The driver's vehicle.
        actor: ActorId,
        /// The reason.
        source: DriverError,
    },
    /// The run exceeded its limit of wall time.
    #[error("no outcome within {limit_s} s of wall time")]
    Timeout {
        /// The limit of wall time (s).
        limit_s: f64,
    },
    /// The run panicked.
    #[error("a panic: {message}")]
    Panic {
        /// The panic's message.
        message: String,
    },
}

impl SampleError {
    /// Returns true if the wall clock caused the error: the same run may have an outcome on another
    /// machine.
    pub const fn is_late(&self) -> bool {
        matches!(
            self,
            Self::Timeout { .. }
                | Self::Controller(ControllerError::Late { .. })
                | Self::Sensors(SensorError::Program { is_late: true, .. })
        )
    }

    /// Returns a one-word name of the kind of error, for reports.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Scenario(_) => "scenario",
            Self::Start { .. } => "start",
            Self::Sensors(_) => "sensors",
            Self::Controller(_) => "controller",
            Self::Command { .. } => "command",
            Self::Driver { .. } => "driver",
            Self::Timeout { .. } => "timeout",
            Self::Panic { .. } => "panic",
        }
    }
}
