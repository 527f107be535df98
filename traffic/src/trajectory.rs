//! Recorded movements of one vehicle.

use crate::{Dimensions, Lane, Time, VehicleClass};

/// One instant of a recorded vehicle, in the road frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrajectoryPoint {
    /// When.
    pub time: Time,
    /// Position of the centre along the road [m].
    pub s_m: f64,
    /// Lateral position of the centre, positive to the left, 0 at the left edge of the leftmost lane [m].
    pub d_m: f64,
    /// Speed along the road [m/s].
    pub speed_mps: f64,
    /// Acceleration along the road [m/s²].
    pub acceleration_mps2: f64,
    /// Speed to the left [m/s].
    pub lateral_speed_mps: f64,
    /// Acceleration to the left [m/s²].
    pub lateral_acceleration_mps2: f64,
    /// The lane, as recorded.
    pub lane: Lane,
}

/// The recorded movement of one vehicle without gaps.
#[derive(Clone, Debug, PartialEq)]
pub struct Trajectory {
    /// The recording's number for this piece of track.
    pub track_id: u64,
    /// Kind of the vehicle.
    pub class: VehicleClass,
    /// Size of the vehicle; its height is typical of the class where not recorded.
    pub dimensions: Dimensions,
    /// Its instants, equally spaced in time.
    pub points: Vec<TrajectoryPoint>,
}
