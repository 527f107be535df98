//! The use that the tracker makes of each box of a scan. Tables and tests read it. It does not feed
//! back into perception.

use closecall_traffic::TrackId;

/// The innovation of a measurement along one axis: measured minus predicted position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Innovation {
    /// Mean over the modes of motion (m).
    pub innovation_m: f64,
    /// Predicted variance of the innovation (m²): the mean over the modes plus the spread of the
    /// modes.
    pub variance_m2: f64,
}

/// The use of a box by the tracker.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BoxRole {
    /// The tracker rejects the box: the box lies in the box of a track, or has no usable position.
    #[default]
    Ignored,
    /// The box is a part of the vehicle of a track, such as a wheel.
    Part,
    /// The box has corrected a track.
    Corrects,
    /// The box has started a track.
    Starts,
}

impl BoxRole {
    /// Returns the name in tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Ignored => "ignored",
            Self::Part => "part",
            Self::Corrects => "corrects",
            Self::Starts => "starts",
        }
    }
}

/// One box, with its use.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoxUse {
    /// Number of the sensor in the chain.
    pub(crate) sensor: usize,
    /// Index of the box in its scan.
    pub index: usize,
    /// The use of the box.
    pub role: BoxRole,
    /// The track that the box belongs to; `None` if the box is ignored.
    pub track: Option<TrackId>,
    /// The innovations along and across the road before the correction, if the box corrects a
    /// track.
    pub innovation: Option<[Innovation; 2]>,
}
