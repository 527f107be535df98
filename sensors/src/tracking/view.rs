//! Visibility of tracks for the rear sensor: field of view, range, and occlusion by nearer tracks.
//!
//! A missing detection counts against a track only if the sensor could have seen the vehicle. A
//! track behind a nearer track coasts and keeps its existence probability.

use closecall_traffic::maths;

/// Field of view and mounting of a rear sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RearView {
    /// Tangent of half of the horizontal field of view.
    pub half_angle_tan: f64,
    /// Range beyond which no detection is expected (m).
    pub range_m: f64,
    /// Position of the sensor ahead of the ego's origin (m); negative, because the sensor is at the
    /// rear bumper.
    pub sensor_x_m: f64,
    /// Position of the sensor to the left of the ego's centre line (m).
    pub sensor_y_m: f64,
    /// Azimuth of the sensor's axis (rad): 0 is straight behind, positive to the ego's left.
    pub axis_azimuth_rad: f64,
}

/// A vehicle's face as the sensor sees it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Face {
    distance_m: f64,
    /// Slope (lateral position over distance) of the right edge.
    low_slope: f64,
    /// Slope of the left edge.
    high_slope: f64,
}

/// Share of a face's width; a nearer face that covers more than this share hides the face.
const HIDDEN_SHARE: f64 = 0.5;

/// Least distance from the sensor's plane (m). Nearer faces are alongside the ego and out of view.
const MIN_DISTANCE_M: f64 = 0.1;

/// Greatest azimuth from straight behind at which a turned sensor is expected to detect a vehicle
/// (rad): 80°. Beyond it, a vehicle reaches past the sensor, and its front is not seen.
pub const MAX_SIDE_AZIMUTH_RAD: f64 = 80.0 * std::f64::consts::PI / 180.0;

impl RearView {
    /// Returns whether a point of the ego's frame (m) is in view.
    pub fn contains(&self, x_m: f64, y_m: f64) -> bool {
        self.face(x_m, y_m, 0.0).is_some()
    }

    /// Returns the face of width `width_m` whose middle is at (`x_m`, `y_m`) in the ego's frame.
    /// Returns `None` if it is out of view.
    pub(crate) fn face(&self, x_m: f64, y_m: f64, width_m: f64) -> Option<Face> {
        let (distance_m, y_m) = (self.sensor_x_m - x_m, y_m - self.sensor_y_m);
        let in_range = distance_m >= MIN_DISTANCE_M && distance_m <= self.range_m;
        let in_view = if self.axis_azimuth_rad == 0.0 {
            y_m.abs() <= self.half_angle_tan * distance_m
        } else {
            let azimuth_rad = maths::atan2(y_m, distance_m);
            (azimuth_rad - self.axis_azimuth_rad).abs() <= maths::atan(self.half_angle_tan)
                && azimuth_rad.abs() <= MAX_SIDE_AZIMUTH_RAD
        };
        let (low_slope, high_slope) = ((y_m - 0.5 * width_m) / distance_m, (y_m + 0.5 * width_m) / distance_m);
        (in_range && in_view).then_some(Face { distance_m, low_slope, high_slope })
    }
}

impl Face {
    /// Returns whether one of the nearer faces in `others` covers most of this face.
    pub(crate) fn is_hidden(&self, others: &[Option<Face>]) -> bool {
        others.iter().flatten().any(|other| {
            let overlap = self.high_slope.min(other.high_slope) - self.low_slope.max(other.low_slope);
            other.distance_m < self.distance_m && overlap > HIDDEN_SHARE * (self.high_slope - self.low_slope)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const VIEW: RearView =
        RearView { half_angle_tan: 2.3, range_m: 200.0, sensor_x_m: -2.3, sensor_y_m: 0.0, axis_azimuth_rad: 0.0 };

    #[test]
    fn a_nearer_face_hides_a_farther_one_in_line() {
        let faces = [(-40.0, 0.0), (-20.0, 0.2), (-40.0, 3.75)].map(|(x, y)| VIEW.face(x, y, 1.8));
        let hidden = faces.map(|face| face.unwrap().is_hidden(&faces));
        assert_eq!(hidden, [true, false, false]);
    }

    #[test]
    fn faces_alongside_or_beyond_the_range_are_out_of_view() {
        assert!(VIEW.face(-2.0, 3.75, 1.8).is_none());
        assert!(VIEW.face(-3.0, 3.75, 1.8).is_none());
        assert!(VIEW.face(-230.0, 0.0, 1.8).is_none());
    }

    #[test]
    fn a_corner_sensor_sees_its_own_side() {
        // 60° to each side of an axis that points 45° to the left.
        let corner = RearView { half_angle_tan: 1.732, sensor_y_m: 0.8, axis_azimuth_rad: 0.785, ..VIEW };
        let sees = |x, y| corner.face(x, y, 1.8).is_some();
        assert!(sees(-5.0, 4.0) && sees(-40.0, 0.0) && sees(-40.0, 3.75));
        assert!(!sees(-6.0, -3.75) && VIEW.face(-6.0, -3.75, 1.8).is_some());
        // 10 m to the side and 1 m behind, the vehicle is within the field of the sensor, but
        // reaches past it.
        assert!(!sees(-2.8, 10.0));
    }
}
