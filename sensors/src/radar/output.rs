//! The output of the radars for display: each detection with the vehicle that it comes from.

use closecall_traffic::Time;

use crate::Health;
use crate::tracking::RadarDetection;

/// The origin of a detection of a radar. The ego does not know it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RadarSource {
    /// A vehicle, given by its index in the scenario's list of actors.
    Vehicle(usize),
    /// The mirror image of a vehicle behind a guard rail: a vehicle that does not exist. The index
    /// names the mirrored vehicle.
    MirrorImage(usize),
    /// A fault of the sensor: a vehicle that does not exist.
    Fault,
}

impl RadarSource {
    /// Returns whether a vehicle is where the radar detects one.
    pub const fn exists(self) -> bool {
        matches!(self, Self::Vehicle(_))
    }
}

/// A detection of a radar with its origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RadarReturn {
    /// The measurement, in the ego's frame at the time of the scan.
    pub measured: RadarDetection,
    /// The origin.
    pub source: RadarSource,
}

/// The pair of rear radars with its latest scan, for display.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MountedRadars<'a> {
    /// Health of the two radars together, as the ego knows it.
    pub health: Health,
    /// Time of the latest scan; `None` before the first.
    pub time: Option<Time>,
    /// The detections of the left and of the right radar in that scan.
    pub returns: [&'a [RadarReturn]; 2],
}
