//! Which vehicles an object-level sensor sees: field of view, range, and vehicles that hide each other.
//!
//! ```text
//!        sensor at the bumper ▷ ─ ─ ─ ─ ─ ─ ─ ─ high ▕▔▔▔▏
//!                              `─ ─ ─ ─ ─ ─ ─ ─ low  ▕▁▁▁▏   a box covers the slopes low … high, from `near` on
//! ```
//!
//! Slopes (left over outward) order the directions as angles do and need no arc tangent.

use crate::surroundings::OtherVehicle;

/// Where a sensor looks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum View {
    /// From the front bumper, ahead.
    Ahead,
    /// All round the body.
    Around,
    /// From the rear bumper, back.
    Behind,
}

/// How far and how wide a sensor sees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Field {
    pub(super) view: View,
    /// Distance from the bumper, or the body, to the nearest face [m].
    pub(super) range_m: f64,
    /// Tangent of half of the field of view [1].
    pub(super) half_angle_tan: f64,
}

/// A vehicle is detected where at least this share of its angular width is in view (assumption: a quarter of a car's
/// rear still returns more than the thresholds of radar or LiDAR need).
const NEEDED_SHARE: f64 = 0.25;

/// Parts of a box nearer to the sensor's plane than this are seen as if at this distance, so that slopes stay finite [m].
const MIN_OUTWARD_M: f64 = 0.1;

/// The directions that one vehicle covers.
#[derive(Clone, Copy, Debug)]
struct Silhouette {
    actor: usize,
    near_m: f64,
    low: f64,
    high: f64,
}

/// The vehicles that one sensor sees, worked out for each scan in memory that is used again.
#[derive(Clone, Debug, Default)]
pub(super) struct Visibility {
    silhouettes: Vec<Silhouette>,
    covered: Vec<(f64, f64)>,
}

impl Visibility {
    /// Looks at all vehicles from a sensor of E, whose size is `ego_m` (length, width).
    pub(super) fn look(&mut self, view: View, others: &[OtherVehicle], ego_m: [f64; 2]) {
        self.silhouettes.clear();
        let outward = match view {
            View::Ahead => 1.0,
            View::Behind => -1.0,
            View::Around => return,
        };
        let silhouettes = others.iter().filter_map(|other| silhouette(other, outward, 0.5 * ego_m[0]));
        self.silhouettes.extend(silhouettes);
    }

    /// True where `other` is within the field of view, in range, and not hidden.
    pub(super) fn sees(&mut self, field: &Field, other: &OtherVehicle, ego_m: [f64; 2]) -> bool {
        if field.view == View::Around {
            return box_distance_m(other, ego_m) <= field.range_m;
        }
        let Some(target) = self.silhouettes.iter().find(|seen| seen.actor == other.actor).copied() else {
            return false;
        };
        let (low, high) = (target.low.max(-field.half_angle_tan), target.high.min(field.half_angle_tan));
        if !(target.near_m <= field.range_m && low < high) {
            return false;
        }
        self.covered.clear();
        for nearer in self.silhouettes.iter().filter(|seen| seen.near_m < target.near_m) {
            let overlap = (nearer.low.max(low), nearer.high.min(high));
            if overlap.0 < overlap.1 {
                self.covered.push(overlap);
            }
        }
        let free = (high - low) - union_width(&mut self.covered);
        free >= NEEDED_SHARE * (target.high - target.low)
    }
}

/// The directions that `other` covers, seen from the bumper at `mount_m` from E's centre; none where it lies wholly on
/// the other side.
fn silhouette(other: &OtherVehicle, outward: f64, mount_m: f64) -> Option<Silhouette> {
    let (ahead_m, left_m) = (0.5 * other.length_m, 0.5 * other.width_m);
    let corners = [(ahead_m, left_m), (ahead_m, -left_m), (-ahead_m, left_m), (-ahead_m, -left_m)];
    let mut seen = Silhouette { actor: other.actor, near_m: f64::INFINITY, low: f64::INFINITY, high: -f64::INFINITY };
    let mut far_m = -f64::INFINITY;
    for (ahead_m, left_m) in corners {
        let out_m = outward * (other.x_m + ahead_m * other.cos - left_m * other.sin) - mount_m;
        let slope = (other.y_m + ahead_m * other.sin + left_m * other.cos) / out_m.max(MIN_OUTWARD_M);
        seen.near_m = seen.near_m.min(out_m);
        far_m = far_m.max(out_m);
        seen.low = seen.low.min(slope);
        seen.high = seen.high.max(slope);
    }
    (far_m > MIN_OUTWARD_M).then_some(seen)
}

/// Distance between E's box and `other`'s, both taken as parallel [m].
fn box_distance_m(other: &OtherVehicle, ego_m: [f64; 2]) -> f64 {
    let along_m = other.x_m.abs() - 0.5 * (other.length_m + ego_m[0]);
    let across_m = other.y_m.abs() - 0.5 * (other.width_m + ego_m[1]);
    along_m.max(0.0).hypot(across_m.max(0.0))
}

/// Total width of the union of intervals; sorts them.
fn union_width(intervals: &mut [(f64, f64)]) -> f64 {
    intervals.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let mut width = 0.0;
    let mut end = f64::NEG_INFINITY;
    for &(low, high) in intervals.iter() {
        if high > end {
            width += high - low.max(end);
            end = high;
        }
    }
    width
}

#[cfg(test)]
mod tests {
    use closecall_traffic::VehicleClass;

    use super::*;

    #[test]
    fn a_union_counts_overlaps_once() {
        assert_eq!(union_width(&mut [(2.0, 3.0), (0.0, 1.0), (0.5, 1.5), (0.6, 0.7)]), 2.5);
        assert_eq!(union_width(&mut []), 0.0);
    }

    fn car(actor: usize, x_m: f64, y_m: f64) -> OtherVehicle {
        OtherVehicle {
            actor,
            class: VehicleClass::Car,
            length_m: 4.6,
            width_m: 1.85,
            road_m: [x_m, y_m],
            road_mps: [0.0; 2],
            x_m,
            y_m,
            heading_rad: 0.0,
            sin: 0.0,
            cos: 1.0,
            speed_mps: 0.0,
        }
    }

    const BEHIND: Field = Field { view: View::Behind, range_m: 120.0, half_angle_tan: 2.3 };

    fn seen(field: Field, others: &[OtherVehicle]) -> Vec<bool> {
        let mut visibility = Visibility::default();
        visibility.look(field.view, others, [4.6, 1.85]);
        others.iter().map(|other| visibility.sees(&field, other, [4.6, 1.85])).collect()
    }

    #[test]
    fn the_nearer_hides_the_farther() {
        let in_line = [car(1, -60.0, 0.0), car(2, -20.0, 0.0), car(3, -60.0, 3.75), car(4, 30.0, 0.0)];
        assert_eq!(seen(BEHIND, &in_line), [false, true, true, false]);
        assert_eq!(seen(Field { view: View::Ahead, ..BEHIND }, &in_line), [false, false, false, true]);
        assert_eq!(seen(BEHIND, &[car(1, -127.0, 0.0)]), [false], "beyond its range");
        assert_eq!(seen(BEHIND, &[car(1, -5.0, 8.0)]), [false], "too far to the side");
    }

    #[test]
    fn surround_sees_what_is_near_the_body() {
        let around = Field { view: View::Around, range_m: 14.0, half_angle_tan: f64::INFINITY };
        let others = [car(1, 0.0, 3.75), car(2, 18.0, 3.75), car(3, 19.5, 0.0), car(4, -15.0, -3.75)];
        assert_eq!(seen(around, &others), [true, true, false, true]);
    }
}
