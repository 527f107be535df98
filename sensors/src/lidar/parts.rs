//! Parts of a face that determine the middle of a vehicle whose edges are not seen: the plate, and
//! a pair of headlamps.
//!
//! ```text
//!      ┌───────────────────────┐      A vehicle with dark paint, or one in fog, returns light from these parts alone. The plate is
//!      │ (▒▒)             (▒▒) │      in the middle of the face; the headlamps stand symmetrically about it, as two clusters if
//!      │        [█████]        │      nothing between them is seen.
//!      └───────────────────────┘
//! ```

use super::boxes::BoxFit;

/// Width of a European registration plate (m): Council Regulation (EC) No 2411/98.
const PLATE_WIDTH_M: f64 = 0.52;
/// Standard deviation of the plate's middle from the middle of the face (m; assumption). Some
/// holders are off the middle, and the plates of a few models are.
const PLATE_OFFSET_SD_M: f64 = 0.05;
/// Least distance between the inner edges of two headlamps (m): UN Regulation No 48, paragraph
/// 6.2.4.1. It exempts cars and vans; the model assumes that they keep the distance, too.
const LAMPS_APART_M: f64 = 0.6;
/// Greatest width of a headlamp (m; assumption).
const LAMP_WIDTH_M: f64 = 0.4;
/// Greatest width of a passenger car without its mirrors (m; assumption). Lamps farther apart may
/// belong to two vehicles.
const PAIR_WIDTH_M: f64 = 2.1;
/// Greatest difference in distance, and in height, of the two headlamps of a vehicle (m;
/// assumption).
const PAIR_DEPTH_M: f64 = 0.4;

/// The middle of a face that follows from its parts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Middle {
    /// Position v across the box's heading (m).
    pub(super) v_m: f64,
    /// Standard deviation of the vehicle's middle from the middle of the parts (m).
    pub(super) offset_sd_m: f64,
}

/// Returns the middle of the face from the plate, if the cluster has one that is seen in full.
pub(super) fn plate_middle(fit: &BoxFit) -> Option<Middle> {
    let [right, left] = fit.plate_m?;
    let is_plate = (left - right - PLATE_WIDTH_M).abs() <= 2.0 * fit.spacing_m;
    is_plate.then_some(Middle { v_m: 0.5 * (left + right), offset_sd_m: PLATE_OFFSET_SD_M })
}

/// Returns true if nothing is seen beside the plate on one side or both. The width is then not the
/// width of a vehicle.
pub(super) fn ends_at_plate(fit: &BoxFit) -> bool {
    let beside_m =
        fit.plate_m.map_or(f64::INFINITY, |[right, left]| (right - fit.across_m[0]).min(fit.across_m[1] - left));
    plate_middle(fit).is_some() && beside_m <= 0.5 * fit.spacing_m
}

/// Returns true if two clusters may be the two headlamps of one vehicle.
fn are_lamps(a: &BoxFit, b: &BoxFit) -> bool {
    let is_lamp = |fit: &BoxFit| fit.plate_m.is_none() && fit.width_m() <= LAMP_WIDTH_M + fit.spacing_m;
    let (right, left) = if a.across_m[0] < b.across_m[0] { (a, b) } else { (b, a) };
    // Columns at the edges of a lamp lie up to one spacing apart from them.
    let apart_m = left.across_m[0] - right.across_m[1] + a.spacing_m;
    let width_m = left.across_m[1] - right.across_m[0] - a.spacing_m;
    is_lamp(a)
        && is_lamp(b)
        && apart_m >= LAMPS_APART_M
        && width_m <= PAIR_WIDTH_M
        && (a.front_u_m - b.front_u_m).abs() <= PAIR_DEPTH_M
        && (a.top_m - b.top_m).abs() <= PAIR_DEPTH_M
}

/// Joins clusters that are the two headlamps of one vehicle: the parent of the second is the first.
/// `parents` holds for each cluster the index of the cluster that it is a part of, usually its own.
///
/// The nearest pairs come first, and a cluster belongs to one pair only. Returns true if there is a
/// pair.
pub(super) fn join_lamps(fits: &[BoxFit], parents: &mut [u32], is_pair: &mut Vec<bool>) -> bool {
    is_pair.clear();
    is_pair.resize(fits.len(), false);
    let mut any = false;
    while let Some((first, second)) = nearest_pair(fits, parents, is_pair) {
        #[expect(clippy::cast_possible_truncation, reason = "fewer clusters than points")]
        let parent = first as u32;
        parents[second] = parent;
        is_pair[first] = true;
        any = true;
    }
    any
}

/// Returns the indices of the two nearest clusters that may be a pair and belong to no other
/// vehicle.
fn nearest_pair(fits: &[BoxFit], parents: &[u32], is_pair: &[bool]) -> Option<(usize, usize)> {
    let is_free = |index: usize| parents[index] as usize == index && !is_pair[index];
    let is_whole =
        |index: usize| !parents.iter().enumerate().any(|(part, &parent)| part != index && parent as usize == index);
    let mut nearest = (f64::INFINITY, None);
    for first in (0..fits.len()).filter(|&first| is_free(first) && is_whole(first)) {
        for second in (first + 1..fits.len()).filter(|&second| is_free(second) && is_whole(second)) {
            let apart_m = (fits[first].across_m[0] - fits[second].across_m[0]).abs();
            if apart_m < nearest.0 && are_lamps(&fits[first], &fits[second]) {
                nearest = (apart_m, Some((first, second)));
            }
        }
    }
    nearest.1
}
