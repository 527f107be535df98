//! From a box to a measurement of a track: the face in road axes, and how much of its error is new in each scan.
//!
//! The errors of a fitted box come from where the columns and layers meet the vehicle. That changes slowly, as the
//! vehicle comes nearer, so that most of the error is the same from scan to scan; only the noise of the ranges is new.
//! The shares below were measured on the boxes of the library's scenarios: at 2 to 50 m the errors of scans 0.4 s apart
//! correlate by 0.9 and more along, and by 0.5 across; at 50 to 80 m by 0.7; beyond by less than 0.1.

use closecall_traffic::{Time, VehicleClass};

use super::axis::AxisMeasurement;
use super::road_filter::Measurement;
use crate::Detection;
use crate::ego_frame::EgoFrame;

/// The slow part of the error along the line of sight, by class of vehicle [m]: which part of bumper or grille is the
/// face, or of a motorcycle, of which wheel, fork and rider stand behind each other.
const FACE_SLOW_SD_M: [f64; 3] = [0.034, 0.034, 0.15];
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
/// How far a lamp or a plate may be from the middle of a car or truck [m]. Dark paint and fog leave nothing else to be seen.
const OUTERMOST_PART_M: f64 = 0.8;

/// What a box says of a track, for a scan that ended at `time` in the frame `frame`.
pub(super) fn measurement(detection: &Detection, frame: &EgoFrame<'_>, time: Time) -> Measurement {
    let (s_m, d_m) = frame.road_position_m(detection.face_x_m, detection.face_y_m);
    let class = detection.class.best_vehicle_class();
    let part_sd_m = match class {
        _ if detection.points < WHOLE_POINTS => uniform_sd_m(OUTERMOST_PART_M),
        VehicleClass::Motorcycle => 0.0,
        VehicleClass::Car | VehicleClass::Truck => uniform_sd_m(OUTERMOST_PART_M - 0.5 * detection.width_m),
    };
    // The target was there at the detection's own time: it has moved on since.
    let lever_s = -(time - detection.time).s();
    let axis = |position_m, sd_m: f64, slow_m2: f64| {
        let variance_m2 = sd_m * sd_m;
        let slow_m2 = slow_m2.min((1.0 - LEAST_NEW_SHARE) * variance_m2);
        AxisMeasurement { position_m, white_sd_m: (variance_m2 - slow_m2).sqrt(), slow_sd_m: slow_m2.sqrt(), lever_s }
    };
    let slow_share = if detection.points < MANY_POINTS { 0.0 } else { ALONG_SLOW_SHARE };
    let along_slow_m2 =
        FACE_SLOW_SD_M[class as usize].powi(2).max(slow_share * detection.range_sd_m * detection.range_sd_m);
    let lateral_sd_m = detection.lateral_sd_m.hypot(part_sd_m);
    Measurement {
        along: axis(s_m, detection.range_sd_m, along_slow_m2),
        across: axis(d_m, lateral_sd_m, ACROSS_SLOW_SHARE * lateral_sd_m * lateral_sd_m),
    }
}

/// Standard deviation of what lies anywhere within ±`half_m` [m]; none where that is below 0.
fn uniform_sd_m(half_m: f64) -> f64 {
    half_m.max(0.0) / 3.0_f64.sqrt()
}

#[cfg(test)]
mod tests {
    use closecall_traffic::{ClassScores, Road, VehicleState};

    use super::*;
    use crate::Extent;

    /// Standard deviation of the position across of a box 40 m behind E [m].
    fn across_sd_m(width_m: f64, points: usize, class: VehicleClass) -> f64 {
        let mut scores = [0.0; 4];
        scores[class as usize] = 1.0;
        let detection = Detection {
            time: Time::ZERO,
            face_x_m: -42.3,
            face_y_m: 0.0,
            range_sd_m: 0.03,
            lateral_sd_m: 0.05,
            heading_rad: 0.0,
            length_m: 4.6,
            length: Extent::Assumed,
            width_m,
            width: Extent::Seen,
            top_m: 1.5,
            points,
            class: ClassScores(scores),
        };
        let ego = VehicleState { s_m: 1_000.0, d_m: -5.625, speed_mps: 30.0, ..VehicleState::default() };
        let Measurement { across, .. } = measurement(&detection, &EgoFrame::new(&Road::straight(3), &ego), Time::ZERO);
        across.white_sd_m.hypot(across.slow_sd_m)
    }

    #[test]
    fn where_a_lamp_or_a_plate_sits_on_its_car_nobody_knows() {
        // In fog and on dark paint retroreflectors are all that is seen: a plate of 0.5 m, or that and one lamp.
        let parts_m = [0.5, 1.1].map(|width_m| across_sd_m(width_m, 12, VehicleClass::Car));
        assert!(parts_m[0] > 0.3 && parts_m[1] > 0.14 && parts_m[1] < parts_m[0], "{parts_m:?}");
        assert!((across_sd_m(1.7, 12, VehicleClass::Car) - 0.05).abs() < 1e-12);
        assert!((across_sd_m(0.7, 12, VehicleClass::Motorcycle) - 0.05).abs() < 1e-12);
        assert!(across_sd_m(0.7, 3, VehicleClass::Motorcycle) > 0.4);
    }
}
