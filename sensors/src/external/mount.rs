//! What a program is told of a LiDAR and of a rear radar.

use closecall_traffic::Side;
use serde::{Deserialize, Serialize};

use crate::lidar::Lidar;

/// A LiDAR as a program is told of it, in the frame of the ego.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LidarMount {
    /// Name of the sensor.
    pub name: &'static str,
    /// Position ahead of the ego's centre (m).
    pub x_m: f64,
    /// Position to the left of it (m).
    pub y_m: f64,
    /// Height above the road (m).
    pub z_m: f64,
    /// Azimuth of the axis (rad): 0 is straight behind, positive to the ego's left.
    pub azimuth_rad: f64,
    /// Half of the horizontal field of view (rad).
    pub half_field_rad: f64,
    /// Range beyond which the sensor reports nothing that is of use (m).
    pub range_m: f64,
    /// Number of layers: beam = column · layers + layer.
    pub layers: usize,
    /// Number of columns.
    pub columns: usize,
    /// Time from a scan to the next (s).
    pub period_s: f64,
}

impl LidarMount {
    /// Returns the mounting of a LiDAR on an ego of this length (m).
    pub fn of(lidar: &Lidar, ego_length_m: f64) -> Self {
        let layers = lidar.kind.layers_deg.len();
        Self {
            name: lidar.name(),
            x_m: -0.5 * ego_length_m + lidar.inset_m,
            y_m: lidar.left_m,
            z_m: lidar.mount_height_m,
            azimuth_rad: lidar.azimuth_rad,
            half_field_rad: lidar.half_field_deg().to_radians(),
            range_m: lidar.reach_m(),
            layers,
            columns: lidar.kind.azimuths_deg.len(),
            period_s: lidar.kind.period_s(),
        }
    }
}

/// A rear radar as a program is told of it, in the frame of the ego.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RadarMount {
    /// Side of the ego on which the radar is.
    pub side: Side,
    /// Position ahead of the ego's centre (m).
    pub x_m: f64,
    /// Position to the left of it (m).
    pub y_m: f64,
    /// Azimuth of the axis (rad): 0 is straight behind, positive to the ego's left.
    pub azimuth_rad: f64,
    /// Half of the horizontal field of view (rad).
    pub half_field_rad: f64,
    /// Range up to which vehicles are detected (m).
    pub range_m: f64,
    /// Time from a scan to the next (s).
    pub period_s: f64,
    /// Standard deviation of a range (m).
    pub range_sd_m: f64,
    /// Standard deviation of an azimuth (rad).
    pub azimuth_sd_rad: f64,
    /// Standard deviation of a radial speed (m/s).
    pub radial_sd_mps: f64,
}
