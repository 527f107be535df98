//! Whether the recorded lanes of a file can be relied on.

/// Whether the recorded lane of a vehicle is reliable.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LaneReliability {
    /// Reliable: the peak criterion requires a change of the recorded lane.
    #[default]
    Reliable,
    /// Unreliable: the peak criterion requires a lateral shift by most of a lane and ignores the
    /// recorded lane.
    Unreliable,
    /// Estimated from the lateral positions of the traffic: the peak criterion requires a change of
    /// the estimated lane, and a lateral shift that no vehicle makes within its lane.
    Estimated,
}
