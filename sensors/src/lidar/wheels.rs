//! The fronts of the wheels of a vehicle beside the sensor.
//!
//! ```text
//!       ╭──────────────────────────────╮ ┌─────┐
//!       ╰──────────────────────────────╯ │     │
//!         ┏━━━━━━━┓ ═════════════ ┏━┓    └─┏━┓─┘   guard, cab
//!       ──┗━━━━━━━┛───────────────┗━┛──────┗━┛──   the wheels alone reach down to the road
//!                 ▲                 ▲        ▲     their fronts face a sensor that looks back
//! ```
//!
//! Other ends on the side of a truck seem to move over it while it passes: beams at another height
//! meet other parts, a tank is round, and weak returns from a side at a small angle are lost. The
//! wheels keep their places, and beams meet their fronts almost at a right angle.

use closecall_traffic::maths;

use super::LidarScan;
use super::boxes::BoxFit;
use crate::tracking::WheelFronts;

/// Height below which nothing of a truck but its wheels is seen (m; assumption): cabs, frames and
/// lateral guards end above it.
const WHEELS_BELOW_M: f32 = 0.33;
/// Depth of the points on the front of a wheel (m; assumption): the noise of the ranges.
const FACE_DEPTH_M: f64 = 0.12;
/// Width of a wheel's front that is seen (m; assumption): half of a tyre, up to twin tyres. The
/// points on a side, which end anywhere, are narrower, and a bumper is wider.
const FACE_WIDTH_M: [f64; 2] = [0.15, 0.7];
/// Least distance between the fronts of two wheels (m; assumption): the diameter of a small wheel.
const LEAST_APART_M: f64 = 0.7;
/// Least number of points on the front of a wheel (assumption).
const LEAST_POINTS: usize = 3;

/// Returns the fronts of the wheels of a cluster, as positions along its box. `low` is memory that
/// the next call may reuse.
pub(super) fn wheel_fronts(fit: &BoxFit, members: &[u32], scan: &LidarScan, low: &mut Vec<[f64; 2]>) -> WheelFronts {
    let (sin, cos) = maths::sin_cos(fit.heading_rad);
    low.clear();
    let indices = members.iter().map(|&member| member as usize).filter(|&index| scan.z_m[index] < WHEELS_BELOW_M);
    low.extend(indices.map(|index| {
        let (x, y) = (f64::from(scan.x_m[index]), f64::from(scan.y_m[index]));
        [x * cos + y * sin, y * cos - x * sin]
    }));
    // From the front to the rear.
    low.sort_unstable_by(|a, b| b[0].total_cmp(&a[0]).then(b[1].total_cmp(&a[1])));
    let mut fronts = WheelFronts::NONE;
    let mut rest = &low[..];
    while let [[front_m, _], behind @ ..] = rest {
        let within = |depth_m: f64| rest.partition_point(|[along_m, _]| *along_m > front_m - depth_m);
        let face = &rest[..within(FACE_DEPTH_M)];
        let width_m = width_m(face);
        rest = if width_m > FACE_WIDTH_M[1] {
            // A bumper, with the noise behind it.
            &rest[within(LEAST_APART_M)..]
        } else if width_m >= FACE_WIDTH_M[0] && face.len() >= LEAST_POINTS {
            fronts.add(face.iter().map(|[along_m, _]| along_m).sum::<f64>() / face.len() as f64);
            &rest[within(LEAST_APART_M)..]
        } else {
            behind
        };
    }
    fronts
}

/// Returns the extent of points across the box (m).
fn width_m(points: &[[f64; 2]]) -> f64 {
    let across_m = || points.iter().map(|[_, across_m]| *across_m);
    across_m().fold(f64::NEG_INFINITY, f64::max) - across_m().fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use crate::lidar::LaneGeometry;

    use super::*;

    /// Returns the fronts of the wheels among these points (x, y, z), in a cluster of all of them.
    fn fronts(points: &[[f32; 3]]) -> Vec<f64> {
        let mut scan = LidarScan::default();
        for &[x, y, z] in points {
            scan.x_m.push(x);
            scan.y_m.push(y);
            scan.z_m.push(z);
            scan.intensity.push(0.3);
            scan.offset_ns.push(0);
            scan.beam.push(0);
        }
        let members: Vec<u32> = (0..).take(points.len()).collect();
        let lane = LaneGeometry {
            heading_rad: 0.0,
            curvature_per_m: 0.0,
            course: None,
            edges_m: [5.6, -5.6],
            region_m: [9.5, -9.5],
        };
        let fit = BoxFit::new(&members, &scan, &lane);
        wheel_fronts(&fit, &members, &scan, &mut Vec::new()).along_m().to_vec()
    }

    /// Returns points on the front and on the side of a wheel whose front is at `x`.
    fn wheel(x: f32) -> Vec<[f32; 3]> {
        let face = [0.0, 0.1, 0.2, 0.3].map(|across| [x, 2.5 + across, 0.2]);
        let side = [0.3, 0.6, 0.9].map(|behind| [x - behind, 2.5, 0.2]);
        face.into_iter().chain(side).collect()
    }

    #[test]
    fn each_wheel_has_its_front() {
        let points = [wheel(-6.0), wheel(-7.4), wheel(-14.0)].concat();
        assert_eq!(fronts(&points), [-6.0, f64::from(-7.4_f32), -14.0]);
    }

    #[test]
    fn points_of_a_side_and_of_higher_parts_are_no_wheels() {
        // A side that the beams show from anywhere on has no face.
        let side: Vec<[f32; 3]> = (0_u8..40).map(|index| [-6.0 - 0.1 * f32::from(index), 2.5, 0.2]).collect();
        assert_eq!(fronts(&side), [0.0; 0]);
        // A guard begins above the wheels' height, and a bumper is wider than a wheel.
        let guard: Vec<[f32; 3]> = wheel(-6.0).into_iter().map(|[x, y, _]| [x, y, 0.6]).collect();
        assert_eq!(fronts(&guard), [0.0; 0]);
        let bumper: Vec<[f32; 3]> = (0_u8..18).map(|index| [-6.0, 2.0 + 0.1 * f32::from(index), 0.3]).collect();
        assert_eq!(fronts(&bumper), [0.0; 0]);
    }
}
