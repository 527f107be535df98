//! What the tracker has made of each box of a scan. It is for tables and for tests: nothing here
//! feeds back into perception.

use closecall_traffic::TrackId;

/// The innovation of a measurement along one axis: measured minus predicted position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Innovation {
    /// Mean over the modes of motion (m).
    pub innovation_m: f64,
    /// Its predicted variance (m²): the mean over the modes, and the spread of the modes.
    pub variance_m2: f64,
}

impl Innovation {
    /// Returns the normalised innovation squared (NIS), whose mean is 1 for a consistent filter
    /// (Bar-Shalom, Li, Kirubarajan 2001, section 5.4.2).
    pub fn nis(&self) -> f64 {
        self.innovation_m * self.innovation_m / self.variance_m2
    }
}

/// What the tracker has done with a box.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BoxRole {
    /// It has rejected the box: it lies in the box of a track, or has no usable position.
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

/// What the tracker has made of one box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoxUse {
    /// Number of the sensor in the chain.
    pub(crate) sensor: usize,
    /// Index of the box in its scan.
    pub index: usize,
    /// What the tracker has done with it.
    pub role: BoxRole,
    /// The track that it belongs to; `None` if it is ignored.
    pub track: Option<TrackId>,
    /// The innovations along and across the road before the correction, if the box corrects a
    /// track.
    pub innovation: Option<[Innovation; 2]>,
}
