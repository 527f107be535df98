//! From a box to a measurement of a track: the face in road axes, and how much of its error is new in each scan.
//!
//! The errors of a fitted box come from where the columns and layers meet the vehicle. That changes slowly, as the
//! vehicle comes nearer, so that most of the error is the same from scan to scan; only the noise of the ranges is new.
//! The shares below were measured on the boxes of the library's scenarios: at 2 to 50 m the errors of scans 0.4 s apart
//! correlate by 0.9 and more along, and by 0.5 across; at 50 to 80 m by 0.7; beyond by less than 0.1.

use closecall_traffic::Time;

use super::axis::AxisMeasurement;
use super::road_filter::Measurement;
use crate::Detection;
use crate::ego_frame::EgoFrame;

/// The slow part of the error along the line of sight, by class of vehicle [m]: which part of bumper or grille is the
/// face, or of a motorcycle, of which wheel, fork and rider stand behind each other.
const FACE_SLOW_SD_M: [f64; 3] = [0.04, 0.04, 0.15];
/// The slow share of the variance across: where the outermost columns meet the edges.
const ACROSS_SLOW_SHARE: f64 = 0.7;
/// From so many points on, nearly all of the error along comes from where they lie, and is the same again in the next
/// scan [1]; fewer jump from layer to layer with the sides of the mirror.
const MANY_POINTS: usize = 25;
const ALONG_SLOW_SHARE: f64 = 0.9;
/// Least share of the variance that is taken as new in each scan.
const LEAST_NEW_SHARE: f64 = 0.02;
/// Fewer points than this may be one lamp or the plate of a dark car.
const WHOLE_POINTS: usize = 6;
/// Where within ±0.75 m of the car's middle that is, nobody knows: standard deviation of a uniform distribution [m].
const PART_LATERAL_SD_M: f64 = 0.43;

/// What a box says of a track, for a scan that ended at `time` in the frame `frame`.
pub(super) fn measurement(detection: &Detection, frame: &EgoFrame<'_>, time: Time) -> Measurement {
    let (s_m, d_m) = frame.road_position_m(detection.face_x_m, detection.face_y_m);
    let part_sd_m = if detection.points < WHOLE_POINTS { PART_LATERAL_SD_M } else { 0.0 };
    let class = detection.class.best_vehicle_class() as usize;
    // The target was there at the detection's own time: it has moved on since.
    let lever_s = -(time - detection.time).s();
    let axis = |position_m, sd_m: f64, slow_m2: f64| {
        let variance_m2 = sd_m * sd_m;
        let slow_m2 = slow_m2.min((1.0 - LEAST_NEW_SHARE) * variance_m2);
        AxisMeasurement { position_m, white_sd_m: (variance_m2 - slow_m2).sqrt(), slow_sd_m: slow_m2.sqrt(), lever_s }
    };
    let slow_share = if detection.points < MANY_POINTS { 0.0 } else { ALONG_SLOW_SHARE };
    let along_slow_m2 = FACE_SLOW_SD_M[class].powi(2).max(slow_share * detection.range_sd_m * detection.range_sd_m);
    let lateral_sd_m = detection.lateral_sd_m.hypot(part_sd_m);
    Measurement {
        along: axis(s_m, detection.range_sd_m, along_slow_m2),
        across: axis(d_m, lateral_sd_m, ACROSS_SLOW_SHARE * lateral_sd_m * lateral_sd_m),
    }
}
