//! The lateral extent of a box, from its edges and from the plate.

use super::boxes::BoxFit;
use super::parts::{ends_at_plate, plate_middle};
use crate::Extent;
use closecall_traffic::maths;

/// Standard deviation of an edge's lateral position (columns): the edge lies somewhere within the
/// last step, 1/√12 = 0.29.
const EDGE_SD_COLUMNS: f64 = 0.3;
/// Additional lateral standard deviation if a side is seen, from which mirrors and wheels protrude
/// (m).
const SIDE_SD_M: f64 = 0.02;
/// Relative increase of an edge's standard deviation at [`LOST_EDGE_RANGE_M`].
///
/// The probability that the outermost columns are lost to weak returns grows with distance. The
/// increase is proportional to the square of the distance.
const LOST_EDGE_GROWTH: f64 = 0.6;
/// Distance that [`LOST_EDGE_GROWTH`] refers to (m).
const LOST_EDGE_RANGE_M: f64 = 100.0;
/// Minimum lateral standard deviation of a detection (m).
const MIN_LATERAL_SD_M: f64 = 0.004;

/// The lateral extent of a box: its middle, with standard deviation, and its width.
pub(super) struct Across {
    pub(super) middle_m: f64,
    pub(super) sd_m: f64,
    pub(super) width_m: f64,
    pub(super) extent: Extent,
    /// Whether the middle is the middle of the plate.
    pub(super) is_by_plate: bool,
}

/// Returns the lateral extent of a box from its visible edges and the typical width of its class.
pub(super) fn across(fit: &BoxFit, [right_hidden, left_hidden]: [bool; 2], typical_m: f64) -> Across {
    let [right, left] = fit.across_m;
    let seen = left - right;
    let lost_share = LOST_EDGE_GROWTH * (fit.range_m / LOST_EDGE_RANGE_M).powi(2);
    let edge_sd = EDGE_SD_COLUMNS * fit.spacing_m * (1.0 + lost_share);
    let told_sd = fit.edges.map_or(edge_sd, |edges| edges.sd_share * edge_sd);
    // An edge lies between the inner sub-rays of two beams: the outermost beam that meets the face,
    // and the next beam.
    let mean_columns = 0.5 - 0.25 * fit.footprint_columns;
    let [right_shift, left_shift] = fit.edges.map_or([0.0; 2], |edges| edges.shifts);
    let right_m = right - (mean_columns + right_shift) * fit.spacing_m;
    let left_m = left + (mean_columns + left_shift) * fit.spacing_m;
    let missing = (typical_m - seen).max(0.0);
    let (middle_m, sd_m) = match (right_hidden, left_hidden) {
        // Weak returns may have lost columns on both sides alike.
        (false, false) => (0.5 * (left_m + right_m), told_sd / f64::sqrt(2.0)),
        (true, false) => (left_m - 0.5 * (left_m - right).max(typical_m), told_sd),
        (false, true) => (right_m + 0.5 * (left - right_m).max(typical_m), told_sd),
        (true, true) => (0.5 * (left + right), edge_sd),
    };
    let lost = missing / f64::sqrt(12.0);
    let both_seen = !right_hidden && !left_hidden && !ends_at_plate(fit);
    let extent = if both_seen && missing < 2.0 * fit.spacing_m + 0.2 { Extent::Seen } else { Extent::Assumed };
    let sd_m = match extent {
        Extent::Seen => maths::hypot(sd_m, 0.5 * lost),
        Extent::Assumed => maths::hypot(sd_m, lost),
    };
    let width_m = match extent {
        Extent::Seen => left_m - right_m,
        Extent::Assumed => seen.max(typical_m),
    };
    let side_sd_m = if fit.sees_side() { SIDE_SD_M } else { 0.0 };
    let sd_m = maths::hypot(sd_m.max(MIN_LATERAL_SD_M), side_sd_m);
    let by_edges = Across { middle_m, sd_m, width_m, extent, is_by_plate: false };
    let Some(plate) = plate_middle(fit) else {
        return by_edges;
    };
    // Both hold: the mean is weighted by the inverse variances.
    // A plate saturates the receiver, however little of it a beam meets.
    let plate_m2 = 0.5 * edge_sd * edge_sd + plate.offset_sd_m * plate.offset_sd_m;
    let share = sd_m * sd_m / (sd_m * sd_m + plate_m2);
    Across {
        middle_m: middle_m + share * (plate.v_m - middle_m),
        sd_m: (share * plate_m2).sqrt(),
        is_by_plate: true,
        ..by_edges
    }
}
