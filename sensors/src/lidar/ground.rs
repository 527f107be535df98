//! Selection of the points that may belong to a vehicle: the points in the region of interest that
//! are not on the ground.
//!
//! The road returns light only where beams meet it steeply enough: within about 20 m at the usual
//! mounting height. A point near z = 0 therefore counts as ground up to [`ground_reach_m`]: 40 m,
//! and more for a stronger or a higher sensor. Beyond that distance a low point is kept, since it
//! can only originate from an object on the road. Its height is the height of the beam's centre,
//! with an error of up to half a footprint.

use crate::tracking::MAX_SIDE_AZIMUTH_RAD;
use closecall_traffic::{Environment, Time, maths};

use super::bare_road::farthest_road_return_m;
use super::candidate::Candidate;
use super::config::REACH_M;
use super::material::asphalt;
use super::noise::MAX_NORMAL;
use super::power::LinkBudget;
use super::{LaneGeometry, Lidar, LidarScan};
use crate::SensorError;

/// Distance from the sensor up to which the road may give returns, at least (m).
const MIN_GROUND_REACH_M: f32 = 40.0;
/// Distance by which the pitch of the ego and the motion within a sweep may change the distance of
/// a return (m).
const GROUND_MARGIN_M: f32 = 1.0;
/// Height below which a point counts as ground, at distance zero (m).
pub(crate) const GROUND_M: f32 = 0.10;
/// Increase of that height per metre of distance (rad). It covers three standard deviations of the
/// levelling error, and the footprint, whose near edge returns more light than its far edge.
pub(crate) const GROUND_SLOPE: f32 = 0.005;
/// Intensity below which a near return counts as a droplet. A tyre at 60° still has 0.025. The
/// method is low-intensity outlier removal after Park et al. 2020, "Fast and accurate desnowing
/// algorithm for LiDAR point clouds".
const DROPLET_INTENSITY: f32 = 0.02;
/// Distance up to which returns are checked for droplets (m).
const DROPLET_REACH_M: f32 = 15.0;

/// Number of points that are tested side by side.
const LANES: usize = 16;

/// Returns the distance from this sensor up to which a dry road may give returns (m), in whole
/// metres.
#[expect(clippy::cast_possible_truncation, reason = "distances are in single precision")]
pub(crate) fn ground_reach_m(lidar: &Lidar) -> f32 {
    let link = LinkBudget::new(lidar, &Environment::CLEAR_DAY);
    if lidar.is_exact {
        // Without noise, no return is stronger than its power.
        return MIN_GROUND_REACH_M;
    }
    let strength_m = asphalt(&Environment::CLEAR_DAY) * lidar.mount_height_m;
    let farthest_m = farthest_road_return_m(&link, strength_m as f32) + MAX_NORMAL * link.range_sd_m(1.0);
    (farthest_m + GROUND_MARGIN_M).ceil().max(MIN_GROUND_REACH_M)
}

/// Writes the points that may belong to vehicles into `candidates`.
///
/// # Errors
/// Returns [`SensorError::NotFinite`] if a point is not finite.
pub(crate) fn select_candidates(
    scan: &LidarScan,
    lane: &LaneGeometry,
    time: Time,
    candidates: &mut Vec<Candidate>,
) -> Result<(), SensorError> {
    candidates.clear();
    #[expect(clippy::cast_possible_truncation, reason = "points are in single precision")]
    let (slope, bend) = (-lane.heading_rad as f32, 0.5 * lane.curvature_per_m as f32);
    match &lane.course {
        None => select(scan, lane, |x: f32| (slope + bend * x) * x, time, candidates),
        #[expect(clippy::cast_possible_truncation, reason = "points are in single precision")]
        Some(course) => select(scan, lane, |x: f32| course.y_m(x.into()) as f32, time, candidates),
    }
}

/// Does what [`select_candidates`] does along a path whose lateral position is a function of the
/// longitudinal position.
fn select(
    scan: &LidarScan,
    lane: &LaneGeometry,
    path_y_m: impl Fn(f32) -> f32,
    time: Time,
    candidates: &mut Vec<Candidate>,
) -> Result<(), SensorError> {
    #[expect(clippy::cast_possible_truncation, reason = "points are in single precision")]
    let [left_end_m, right_end_m] = lane.region_m.map(|end_m| end_m as f32);
    let max_side_tan = maths::tan(MAX_SIDE_AZIMUTH_RAD) as f32;
    let is_straight = scan.axis_azimuth_rad == 0.0;
    let position_m = |x: f32, y: f32| [scan.sensor_x_m - x, y - path_y_m(x)];
    // Written without branches, so that the points are tested side by side in vector registers.
    for first in (0..scan.len()).step_by(LANES) {
        let chunk = first..scan.len().min(first + LANES);
        let points = scan.x_m[chunk.clone()].iter().zip(&scan.y_m[chunk.clone()]);
        let points = points.zip(&scan.z_m[chunk.clone()]).zip(&scan.intensity[chunk]);
        let (mut kept, mut are_finite) = ([false; LANES], true);
        for ((((&x, &y), &z), &intensity), kept) in points.zip(&mut kept) {
            are_finite &= (x + y + z + intensity).is_finite();
            let [back_m, left_m] = position_m(x, y);
            let inside = (back_m > 0.0) & (back_m < REACH_M) & (left_m < left_end_m) & (left_m > right_end_m);
            let beside_m = y - scan.sensor_y_m;
            let range_m = (back_m * back_m + beside_m * beside_m).sqrt();
            let ground = (range_m < scan.resolution.ground_reach_m) & (z < GROUND_M + GROUND_SLOPE * range_m);
            let droplet = (range_m < DROPLET_REACH_M) & (intensity < DROPLET_INTENSITY);
            // A sensor that is turned to a side also sees along the ego's flank, where a vehicle
            // has no front that it could see.
            let is_behind = is_straight | (beside_m.abs() <= max_side_tan * back_m);
            *kept = inside & is_behind & !ground & !droplet;
        }
        if !are_finite {
            return Err(SensorError::NotFinite { quantity: "a LiDAR point", time });
        }
        for (lane, _) in kept.iter().enumerate().filter(|(_, kept)| **kept) {
            let [back_m, left_m] = position_m(scan.x_m[first + lane], scan.y_m[first + lane]);
            #[expect(clippy::cast_possible_truncation, reason = "a scan has at most two points per beam")]
            let index = (first + lane) as u32;
            candidates.push(Candidate { index, back_m, left_m });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const LANE: LaneGeometry = LaneGeometry {
        heading_rad: 0.0,
        curvature_per_m: 0.0,
        course: None,
        edges_m: [5.6, -5.6],
        region_m: [9.5, -9.5],
    };

    fn kept(points: &[[f32; 4]]) -> Result<Vec<u32>, SensorError> {
        kept_on(&LANE, points)
    }

    fn kept_on(lane: &LaneGeometry, points: &[[f32; 4]]) -> Result<Vec<u32>, SensorError> {
        let mut scan = LidarScan { sensor_x_m: -2.3, ..LidarScan::default() };
        for &[x, y, z, intensity] in points {
            scan.x_m.push(x);
            scan.y_m.push(y);
            scan.z_m.push(z);
            scan.intensity.push(intensity);
        }
        let mut kept = Vec::new();
        select_candidates(&scan, lane, Time::ZERO, &mut kept)?;
        Ok(kept.into_iter().map(|candidate| candidate.index).collect())
    }

    #[test]
    fn ground_distant_points_and_droplets_are_removed() {
        let points = [
            [-12.0, 0.0, 0.05, 0.1],
            [-12.0, 0.0, 0.40, 0.1],
            [-12.0, 12.0, 0.40, 0.1],
            [-4.0, 0.0, 0.40, 0.01],
            [-90.0, 0.0, 0.05, 0.01],
        ];
        assert_eq!(kept(&points), Ok(vec![1, 4]));
    }

    #[test]
    fn points_beyond_the_region_of_interest_are_removed() {
        let points = [[-30.0, 5.7, 0.6, 0.1], [-30.0, 6.3, 0.6, 0.1], [-30.0, -8.0, 0.6, 0.1], [-30.0, -8.5, 0.6, 0.1]];
        assert_eq!(kept(&points), Ok(vec![0, 1, 2, 3]));
        let lane = LaneGeometry { region_m: [5.85, -8.1], ..LANE };
        assert_eq!(kept_on(&lane, &points), Ok(vec![0, 2]));
    }

    #[test]
    fn a_point_with_a_nan_coordinate_is_an_error() {
        assert!(kept(&[[-12.0, f32::NAN, 0.4, 0.1]]).is_err());
    }
}
