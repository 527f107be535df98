//! A reference line along a road, and the projection of points onto it.

/// A point in a plane (m).
pub(super) type Point = (f64, f64);

/// Maximum distance at which two points count as one (m).
const SAME_POINT_M: f64 = 1e-6;

/// A polyline. It continues straight beyond both ends.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct ReferenceLine {
    /// The points, each with its distance along the line (m).
    points: Vec<(Point, f64)>,
}

/// The position of a point relative to a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Projection {
    /// Distance along the line (m).
    pub(super) s_m: f64,
    /// Distance to the left of the line (m).
    pub(super) d_m: f64,
    /// Heading of the line at that position (rad).
    pub(super) heading_rad: f64,
}

impl ReferenceLine {
    /// Builds the line through `points`.
    pub(super) fn through(points: impl Iterator<Item = Point>) -> Self {
        let mut line: Vec<(Point, f64)> = Vec::new();
        for point in points {
            let Some(((x, y), s_m)) = line.last() else {
                line.push((point, 0.0));
                continue;
            };
            let step_m = (point.0 - x).hypot(point.1 - y);
            if step_m > SAME_POINT_M {
                let s_m = s_m + step_m;
                line.push((point, s_m));
            }
        }
        Self { points: line }
    }

    /// Returns the length of the line (m), or `None` if it has no extent.
    pub(super) fn length_m(&self) -> Option<f64> {
        self.points.last().filter(|_| self.points.len() > 1).map(|(_, s_m)| *s_m)
    }

    /// Projects a point onto the nearest position of the line.
    pub(super) fn project(&self, (x, y): Point) -> Projection {
        let last = self.points.len().saturating_sub(2);
        let mut nearest = (f64::INFINITY, Projection { s_m: 0.0, d_m: 0.0, heading_rad: 0.0 });
        for (k, pair) in self.points.windows(2).enumerate() {
            let (((x0, y0), s0), ((x1, y1), s1)) = (pair[0], pair[1]);
            let length = s1 - s0;
            let (ux, uy) = ((x1 - x0) / length, (y1 - y0) / length);
            let low = if k == 0 { f64::NEG_INFINITY } else { 0.0 };
            let high = if k == last { f64::INFINITY } else { length };
            let along = ((x - x0) * ux + (y - y0) * uy).clamp(low, high);
            let distance = (x - x0 - along * ux).hypot(y - y0 - along * uy);
            if distance < nearest.0 {
                let side = (ux * (y - y0) - uy * (x - x0)).signum();
                nearest = (distance, Projection { s_m: s0 + along, d_m: side * distance, heading_rad: uy.atan2(ux) });
            }
        }
        nearest.1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_project_onto_the_nearest_position_and_the_line_continues_straight() {
        let corner = ReferenceLine::through([(0.0, 0.0), (10.0, 0.0), (10.0, 0.0), (10.0, 10.0)].into_iter());
        assert_eq!(corner.length_m(), Some(20.0));
        let at = |x, y| {
            let projection = corner.project((x, y));
            (projection.s_m, projection.d_m)
        };
        assert_eq!(at(4.0, 1.0), (4.0, 1.0));
        assert_eq!(at(4.0, -2.0), (4.0, -2.0));
        assert_eq!(at(-3.0, 1.0), (-3.0, 1.0));
        assert_eq!(at(8.5, 6.0), (16.0, 1.5));
        assert_eq!(at(11.0, 25.0), (35.0, -1.0));
        assert_eq!(ReferenceLine::through([(1.0, 1.0), (1.0, 1.0)].into_iter()).length_m(), None);
    }
}
