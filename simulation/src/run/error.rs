//! What keeps a sample from having an outcome.

use closecall_controllers::{ControllerError, DriverError};
use closecall_sensors::SensorError;
use closecall_traffic::{ActorId, ConfigError, Time};

/// A run that could not be carried to its end. It is an error of this sample: counted, reported, never a pass.
///
/// Nothing of the run remains but its key: the same sample can be run again.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SampleError {
    /// The sampled values do not make a valid scenario.
    #[error("failed to make the concrete scenario: {0}")]
    Scenario(ConfigError),
    /// The sensors could not be set up or failed on the way.
    #[error("the sensors {0}")]
    Sensors(#[from] SensorError),
    /// The ego controller failed.
    #[error("the ego controller {0}")]
    Controller(#[from] ControllerError),
    /// The ego controller's command is not a finite number.
    #[error("the ego controller asked for an acceleration of {value} m/s² at {time}")]
    Command {
        /// What it asked for.
        value: f64,
        /// When.
        time: Time,
    },
    /// A human driver failed.
    #[error("the driver of `{actor}` {source}")]
    Driver {
        /// Whose driver.
        actor: ActorId,
        /// Why.
        source: DriverError,
    },
    /// It did not come to its end in time.
    #[error("no outcome within {limit_s} s of wall time")]
    Timeout {
        /// Longest wall time that was allowed [s].
        limit_s: f64,
    },
    /// Something panicked.
    #[error("a panic: {message}")]
    Panic {
        /// What it said.
        message: String,
    },
}

impl SampleError {
    /// A short word for the kind of error, for reports.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Scenario(_) => "scenario",
            Self::Sensors(_) => "sensors",
            Self::Controller(_) => "controller",
            Self::Command { .. } => "command",
            Self::Driver { .. } => "driver",
            Self::Timeout { .. } => "timeout",
            Self::Panic { .. } => "panic",
        }
    }
}
