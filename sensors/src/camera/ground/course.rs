//! The line of a road with an alignment about the lens, for the pixels of the ground.
//!
//! The line has a knot every 8 m. Near a knot, the road is the arc with the curvature of the knot:
//! the foot of a point is at most half a spacing away, where the arc deviates by κ'·h³/6 from a
//! clothoid whose curvature changes by κ' per metre. This is below 3 mm for 2e-4 1/m², and below
//! 3.2 cm at a jump from a line to an arc of the smallest radius, 250 m.

use closecall_traffic::ego_frame::EgoFrame;
use closecall_traffic::{Road, VehicleState, maths};

use super::GROUND_TO_M;

/// Distance between two knots (m).
const SPACING_M: f32 = 8.0;
/// Number of knots on each side of the lens: to the end of the ground.
const REACH: usize = 44;
const KNOTS: usize = 2 * REACH + 1;
/// Steps of the search for the knot at the foot of a point. Each one reduces the error of the
/// position along the road by the share of the angle between knot and foot.
const STEPS: usize = 3;

/// A place of the line.
#[derive(Clone, Copy, Debug, Default)]
struct Knot {
    /// Position of the point of the line, ahead and to the left of the lens, in the direction of
    /// the road at the lens (m).
    at_m: [f32; 2],
    /// Cosine and sine of the direction of the line.
    direction: [f32; 2],
    /// Curvature at d = 0 (1/m).
    curvature_per_m: f32,
    /// Length of the line d = 0 for each metre of s: a reversed road measures s along its other
    /// edge.
    scale: f32,
}

/// The line d = 0 of a road about the lens.
#[derive(Clone, Copy, Debug)]
pub(super) struct GroundCourse {
    knots: [Knot; KNOTS],
}

impl GroundCourse {
    /// Creates the line for a lens at (`s_m`, `d_m`).
    #[expect(clippy::cast_possible_truncation, reason = "images are in single precision")]
    pub(super) fn new(road: &Road, s_m: f64, d_m: f64) -> Self {
        let lens = VehicleState { s_m, d_m, ..VehicleState::default() };
        let frame = EgoFrame::new(road, &lens);
        let knots = std::array::from_fn(|index| {
            let at_s_m = s_m + f64::from(SPACING_M) * (index as f64 - REACH as f64);
            let point = frame.point(at_s_m, 0.0);
            let (sin, cos) = maths::sin_cos(point.road_yaw_rad);
            Knot {
                at_m: [point.x_m as f32, point.y_m as f32],
                direction: [cos as f32, sin as f32],
                curvature_per_m: road.parallel_curvature_per_m(at_s_m, 0.0) as f32,
                scale: road.path_scale(at_s_m, 0.0) as f32,
            }
        });
        Self { knots }
    }

    /// Returns the distance along the road from the lens, and the lateral position on the road (m),
    /// of a point ahead and to the left of the lens in the direction of the road there (m).
    pub(super) fn position_m(&self, ahead_m: f32, left_m: f32) -> [f32; 2] {
        let mut index = nearest(ahead_m);
        let mut position_m = [0.0; 2];
        for _ in 0..STEPS {
            let (offset_m, d_m) = self.near(index, ahead_m, left_m);
            position_m = [(index as f32 - REACH as f32) * SPACING_M + offset_m, d_m];
            let better = nearest(position_m[0]);
            if better == index {
                break;
            }
            index = better;
        }
        position_m
    }

    /// Returns the distance along the road from a knot, and the lateral position (m), on the arc of
    /// the knot.
    fn near(&self, index: usize, ahead_m: f32, left_m: f32) -> (f32, f32) {
        let Knot { at_m, direction: [cos, sin], curvature_per_m: k, scale } = self.knots[index];
        let (to_x, to_y) = (ahead_m - at_m[0], left_m - at_m[1]);
        let (along, across) = (to_x * cos + to_y * sin, to_y * cos - to_x * sin);
        let q = k * (along * along + across * across) - 2.0 * across;
        let d = -q / (1.0 + (1.0 + k * q).max(0.0).sqrt());
        let tangent = along / (1.0 - k * across);
        let bend = k * tangent;
        (tangent * (1.0 - bend * bend / 3.0) / scale, d)
    }
}

/// Returns the index of the knot nearest to a distance along the road from the lens (m).
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped; NaN becomes 0")]
fn nearest(along_m: f32) -> usize {
    (along_m / SPACING_M + REACH as f32 + 0.5).clamp(0.0, (KNOTS - 1) as f32) as usize
}

const _: () = assert!(SPACING_M * REACH as f32 >= GROUND_TO_M);

#[cfg(test)]
mod tests {
    use closecall_traffic::{Alignment, AlignmentPoint};

    use super::*;

    /// A line, a clothoid to an arc to the left, a clothoid to an arc to the right, and a jump back
    /// to a line.
    fn road() -> Road {
        let points = [[-300.0, 0.0], [-200.0, 0.0025], [-150.0, 0.0025], [0.0, -0.002], [80.0, -0.002], [80.0, 0.0]];
        let points = points.map(|[s_m, curvature_per_m]| AlignmentPoint { s_m, curvature_per_m });
        Road::straight(3).with_alignment(Alignment::new(&points).unwrap())
    }

    #[test]
    fn ground_beside_a_clothoid_has_the_coordinates_of_the_road_model() {
        // A line beside the left edge, and the smallest radius.
        let points = [[-150.0, 0.0], [-50.0, 0.004], [20.0, 0.004], [80.0, -0.002]];
        let points = points.map(|[s_m, curvature_per_m]| AlignmentPoint { s_m, curvature_per_m });
        let beside = Road::straight(3).with_alignment_at(Alignment::new(&points).unwrap(), 2.75);
        for road in [road(), road().reversed(), beside.clone(), beside.reversed()] {
            for lens_s_m in [-120.0, -20.0, 60.0, 150.0] {
                let lens = VehicleState { s_m: lens_s_m, d_m: -5.6, ..VehicleState::default() };
                let frame = EgoFrame::new(&road, &lens);
                let course = GroundCourse::new(&road, lens_s_m, -5.6);
                for step in 0..70 {
                    let away_m = -345.0 + 10.0 * f64::from(step);
                    for d_m in [-14.0, -11.25, -5.6, 0.0, 1.3] {
                        let point = frame.point(lens_s_m + away_m, d_m);
                        let [ahead_m, got_d_m] = course.position_m(point.x_m as f32, point.y_m as f32);
                        assert!((f64::from(got_d_m) - d_m).abs() < 0.025, "{lens_s_m} {away_m} {d_m}: {got_d_m}");
                        assert!((f64::from(ahead_m) - away_m).abs() < 0.05, "{lens_s_m} {away_m} {d_m}: {ahead_m}");
                    }
                }
            }
        }
    }

    #[test]
    fn the_arc_at_the_lens_is_no_clothoid() {
        // The test above fails for the curvature at the lens alone: 100 m away it is metres off.
        let lens = VehicleState { s_m: -20.0, ..VehicleState::default() };
        let point = EgoFrame::new(&road(), &lens).point(-120.0, 0.0);
        let arc = Road::straight(3).with_curvature(road().curvature_at_per_m(-20.0));
        let on_arc = EgoFrame::new(&arc, &lens).point(-120.0, 0.0);
        assert!((point.y_m - on_arc.y_m).abs() > 3.0, "{} {}", point.y_m, on_arc.y_m);
    }
}
