//! The failure of a sensor model.

use closecall_traffic::Time;

/// The failure of a sensor model. It leaves the sensors in an undefined state and ends the run.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SensorError {
    /// A quantity that must be finite is not.
    #[error("failed to measure: {quantity} is not finite at {time}")]
    NotFinite {
        /// The quantity.
        quantity: &'static str,
        /// The scene's time.
        time: Time,
    },
    /// Two implementations of DBSCAN give different clusters, in a run that compares them. The
    /// boxes of that scan are not used.
    #[error("{different} of {points} clustered points have another label by another DBSCAN at {time}")]
    Clusterings {
        /// Number of points whose labels differ.
        different: usize,
        /// Number of points.
        points: usize,
        /// End of the scan.
        time: Time,
    },
    /// A perception program did not give a valid answer. It has been ended.
    #[error("failed to perceive{}: `{program}`: {reason}", time.map_or_else(String::new, |time| format!(" at {time}")))]
    Program {
        /// The program, as the scenario names it.
        program: String,
        /// What is wrong, with the field of the answer.
        reason: String,
        /// Whether the wall clock caused the error.
        is_late: bool,
        /// The time of the question; `None` if the program was asked none.
        time: Option<Time>,
    },
    /// The classifier could not be loaded or run.
    #[error("failed to classify: {reason}")]
    Classifier {
        /// The classifier's message.
        reason: String,
    },
}
