//! Whether a track that was not detected could have been: within the field of view, in range, and not hidden.
//!
//! A miss speaks against a track only where the sensor could have seen it. Behind a nearer track it is coasted without
//! losing belief.

/// What the rear sensor can see.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RearView {
    /// Tangent of half of the horizontal field of view [1].
    pub half_angle_tan: f64,
    /// Range beyond which nothing is expected [m].
    pub range_m: f64,
    /// Where the sensor is, ahead of E's origin [m]; negative, at the rear bumper.
    pub sensor_x_m: f64,
}

/// A face, as the sensor sees it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Face {
    distance_m: f64,
    low: f64,
    high: f64,
}

/// A track counts as hidden where nearer ones cover more than this share of its width.
const HIDDEN_SHARE: f64 = 0.5;

/// Faces nearer than this to the sensor's plane are alongside, out of view [m].
const LEAST_DISTANCE_M: f64 = 0.1;

impl RearView {
    /// The face of width `width_m` whose middle is at (`x_m`, `y_m`) in E's frame; nothing where it is out of view.
    pub(super) fn face(&self, x_m: f64, y_m: f64, width_m: f64) -> Option<Face> {
        let distance_m = self.sensor_x_m - x_m;
        let in_range = distance_m >= LEAST_DISTANCE_M && distance_m <= self.range_m;
        let in_view = y_m.abs() <= self.half_angle_tan * distance_m;
        let (low, high) = ((y_m - 0.5 * width_m) / distance_m, (y_m + 0.5 * width_m) / distance_m);
        (in_range && in_view).then_some(Face { distance_m, low, high })
    }
}

impl Face {
    /// True where one of the `others` that is nearer covers most of it.
    pub(super) fn is_hidden(&self, others: &[Option<Face>]) -> bool {
        others.iter().flatten().any(|other| {
            let overlap = self.high.min(other.high) - self.low.max(other.low);
            other.distance_m < self.distance_m && overlap > HIDDEN_SHARE * (self.high - self.low)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const VIEW: RearView = RearView { half_angle_tan: 2.3, range_m: 200.0, sensor_x_m: -2.3 };

    #[test]
    fn the_nearer_hides_the_farther_in_line() {
        let faces = [(-40.0, 0.0), (-20.0, 0.2), (-40.0, 3.75)].map(|(x, y)| VIEW.face(x, y, 1.8));
        let hidden = faces.map(|face| face.unwrap().is_hidden(&faces));
        assert_eq!(hidden, [true, false, false]);
    }

    #[test]
    fn what_is_alongside_is_out_of_view() {
        assert!(VIEW.face(-2.0, 3.75, 1.8).is_none());
        assert!(VIEW.face(-3.0, 3.75, 1.8).is_none());
        assert!(VIEW.face(-230.0, 0.0, 1.8).is_none());
    }
}
