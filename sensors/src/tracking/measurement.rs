//! Conversion of a detection to a measurement in road axes, with its error split into a slow and a
//! white part.
//!
//! The error of a fitted box depends on where the scan's columns and layers hit the vehicle. This
//! changes slowly as the vehicle approaches, so most of the error is the same from scan to scan.
//! Only the range noise is new in each scan. The shares below were measured on the boxes of the
//! library's scenarios. At 2 to 50 m, the errors of scans 0.4 s apart correlate by 0.9 and more
//! along the road, and by 0.5 across; at 50 to 80 m by 0.7; beyond by less than 0.1.

use closecall_traffic::{Time, VehicleClass, maths};

use super::axis::AxisMeasurement;
use super::road_filter::{Measurement, Span};
use crate::tracking::{Detection, Extent};
use closecall_traffic::ego_frame::EgoFrame;

/// Standard deviation of the slow error along the line of sight, by vehicle class (m).
///
/// It depends on the part of the bumper or grille that counts as the face. On a motorcycle, wheel,
/// fork and rider stand behind each other.
const FACE_SLOW_SD_M: [f64; 3] = [0.034, 0.034, 0.15];
/// Slow share of the error variance across the road: it depends on where the outermost columns hit
/// the edges.
const ACROSS_SLOW_SHARE: f64 = 0.7;
/// Number of points from which on [`ALONG_SLOW_SHARE`] applies.
///
/// The error along the road then depends almost only on where the points lie, which is the same in
/// the next scan. Fewer points jump from layer to layer with the sides of the mirror.
const MANY_POINTS: usize = 25;
/// Slow share of the error variance along the road for a box of many points.
const ALONG_SLOW_SHARE: f64 = 0.9;
/// Least white share of the error variance.
const MIN_WHITE_SHARE: f64 = 0.02;
/// Number of points below which a box may be one lamp or the plate of a dark car.
const MIN_WHOLE_FACE_POINTS: usize = 6;
/// Standard deviation of the distance from the vehicle's middle beyond which a box is a part of the
/// vehicle, rather than its face (m): the value of a box half as wide as a car. Up to the same
/// deviation across the road, a face whose edges or whose plate are seen shows the middle.
const PART_SD_M: f64 = 0.2;
/// Maximum distance of a lamp or a plate from the middle of a car or truck (m). Nothing else is
/// seen of a vehicle with dark paint or in fog.
const MAX_PART_OFFSET_M: f64 = 0.8;

/// Score from which a class is sure enough to tell a vehicle from a part of a truck (assumption).
pub(crate) const SURE_SCORE: f64 = 0.7;

/// Converts a detection to a measurement, for a scan that ended at `time` with the ego's frame
/// `frame`.
pub(crate) fn measurement(detection: &Detection, frame: &EgoFrame<'_>, time: Time) -> Measurement {
    let (s_m, d_m) = frame.road_position_m(detection.face_x_m, detection.face_y_m);
    let class = detection.class.best_vehicle_class();
    let part_offset_sd_m = match class {
        _ if detection.is_centred => 0.0,
        _ if detection.points < MIN_WHOLE_FACE_POINTS => uniform_sd_m(MAX_PART_OFFSET_M),
        VehicleClass::Motorcycle => 0.0,
        VehicleClass::Car | VehicleClass::Truck => uniform_sd_m(MAX_PART_OFFSET_M - 0.5 * detection.width_m),
    };
    // The position holds at the detection's own time; the target has moved on since.
    let time_offset_s = -(time - detection.time).s();
    let axis = |position_m, sd_m: f64, slow_m2: f64| {
        let variance_m2 = sd_m * sd_m;
        let slow_m2 = slow_m2.min((1.0 - MIN_WHITE_SHARE) * variance_m2);
        AxisMeasurement {
            position_m,
            white_sd_m: (variance_m2 - slow_m2).sqrt(),
            slow_sd_m: slow_m2.sqrt(),
            time_offset_s,
        }
    };
    let slow_share = if detection.points < MANY_POINTS { 0.0 } else { ALONG_SLOW_SHARE };
    let along_slow_m2 =
        FACE_SLOW_SD_M[class as usize].powi(2).max(slow_share * detection.range_sd_m * detection.range_sd_m);
    let lateral_sd_m = maths::hypot(detection.lateral_sd_m, part_offset_sd_m);
    Measurement {
        along: axis(s_m, detection.range_sd_m, along_slow_m2),
        across: axis(d_m, lateral_sd_m, ACROSS_SLOW_SHARE * lateral_sd_m * lateral_sd_m),
        is_part: part_offset_sd_m > PART_SD_M,
        knows_middle: (detection.is_centred || detection.width == Extent::Seen) && lateral_sd_m <= PART_SD_M,
        // A vehicle follows the road closely enough for its sides to be along it.
        seen: Span {
            is_cut: detection.seen.is_cut,
            is_face: !detection.seen.is_cut && is_face(detection),
            along_m: detection.seen.along_m.map(|along_m| s_m + along_m),
            across_m: detection.seen.across_m.map(|across_m| d_m + across_m),
            spacing_m: detection.seen.spacing_m,
            wheels: detection.seen.wheels.shifted(s_m),
            top_m: detection.top_m,
            points: detection.points,
        },
    }
}

/// Returns whether a detection shows the face of a vehicle rather than a wheel, a guard or the tail
/// of a truck: both of its edges are seen, and it is classified as a vehicle. A classifier alone
/// takes the wheels of a truck for a car.
fn is_face(detection: &Detection) -> bool {
    detection.width == Extent::Seen && detection.class.0[detection.class.best_vehicle_class() as usize] >= SURE_SCORE
}

/// Returns the standard deviation of a uniform distribution over ±`half_width_m` (m), or 0 if
/// `half_width_m` is negative.
fn uniform_sd_m(half_width_m: f64) -> f64 {
    half_width_m.max(0.0) / 3.0_f64.sqrt()
}

#[cfg(test)]
mod tests {
    use closecall_traffic::{ClassScores, Road, VehicleState};

    use super::*;
    use crate::tracking::{SeenBy, SeenPart};

    /// Returns the standard deviation of the measured position across the road for a box 40 m
    /// behind the ego (m).
    fn across_sd_m(width_m: f64, points: usize, class: VehicleClass) -> f64 {
        let Measurement { across, .. } = of_box(width_m, Extent::Seen, points, class);
        maths::hypot(across.white_sd_m, across.slow_sd_m)
    }

    /// Returns the measurement of a box 40 m behind the ego.
    fn of_box(width_m: f64, width: Extent, points: usize, class: VehicleClass) -> Measurement {
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
            width,
            top_m: 1.5,
            seen_by: SeenBy::Lidar,
            points,
            is_centred: false,
            seen: SeenPart::FACE,
            class: ClassScores(scores),
        };
        let ego = VehicleState { s_m: 1_000.0, d_m: -5.625, speed_mps: 30.0, ..VehicleState::default() };
        measurement(&detection, &EgoFrame::new(&Road::straight(3), &ego), Time::ZERO)
    }

    #[test]
    fn a_lamp_is_a_part_and_a_face_with_both_edges_shows_the_middle() {
        let shape = |width_m, width, points| {
            let Measurement { is_part, knows_middle, .. } = of_box(width_m, width, points, VehicleClass::Car);
            (is_part, knows_middle)
        };
        assert_eq!(shape(0.4, Extent::Seen, 12), (true, false));
        assert_eq!(shape(1.7, Extent::Seen, 4), (true, false));
        assert_eq!(shape(1.7, Extent::Seen, 12), (false, true));
        // One edge is hidden: the width is the class's width.
        assert_eq!(shape(1.8, Extent::Assumed, 12), (false, false));
    }

    #[test]
    fn a_box_that_may_be_a_lamp_or_a_plate_has_a_larger_lateral_deviation() {
        // In fog and on dark paint, only retroreflectors are seen: a plate with a width of 0.5 m,
        // or the plate and one lamp.
        let parts_m = [0.5, 1.1].map(|width_m| across_sd_m(width_m, 12, VehicleClass::Car));
        assert!(parts_m[0] > 0.3 && parts_m[1] > 0.14 && parts_m[1] < parts_m[0], "{parts_m:?}");
        assert!((across_sd_m(1.7, 12, VehicleClass::Car) - 0.05).abs() < 1e-12);
        assert!((across_sd_m(0.7, 12, VehicleClass::Motorcycle) - 0.05).abs() < 1e-12);
        assert!(across_sd_m(0.7, 3, VehicleClass::Motorcycle) > 0.4);
    }
}
