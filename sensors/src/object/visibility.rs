//! Visibility of vehicles for an object-level sensor: field of view, range, and occlusion by other
//! vehicles.
//!
//! ```text
//!        sensor at the bumper ▷ ─ ─ ─ ─ ─ ─ ─ ─ high ▕▔▔▔▏
//!                              `─ ─ ─ ─ ─ ─ ─ ─ low  ▕▁▁▁▏   a box covers the slopes low … high from `near_m` on
//! ```
//!
//! A slope is the distance to the left divided by the distance outward. Slopes order directions as
//! angles do, without an arc tangent.

use closecall_traffic::metrics::bumper_gap_m;
use closecall_traffic::{Dimensions, maths};

use crate::surroundings::OtherVehicle;

/// Viewing direction of a sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Direction {
    /// From the front bumper, ahead.
    Ahead,
    /// In all directions, from the ego's body.
    Around,
    /// From the rear bumper, back.
    Behind,
}

impl Direction {
    /// Returns on which side of the ego's middle the sensor is: 1 ahead, −1 behind, 0 for those
    /// around.
    pub(super) fn sign(self) -> f64 {
        match self {
            Self::Ahead => 1.0,
            Self::Around => 0.0,
            Self::Behind => -1.0,
        }
    }
}

/// Field of view and range of a sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Field<'a> {
    pub(super) direction: Direction,
    /// Maximum distance from the bumper, or from the body, to a vehicle's nearest face (m).
    pub(super) range_m: f64,
    /// Tangent of half of the field of view.
    pub(super) half_angle_tan: f64,
    /// Slopes in which the sensor sees nothing.
    pub(super) blocked: &'a [[f64; 2]],
}

/// Share of a vehicle's angular width that must be in view for a detection (assumption: a quarter
/// of a car's rear still returns more than the thresholds of radar or LiDAR need).
pub(super) const NEEDED_SHARE: f64 = 0.25;

/// Least outward distance for which slopes are computed (m). Parts of a box that are nearer to the
/// sensor's plane are treated as if at this distance, so that slopes stay finite.
const MIN_OUTWARD_M: f64 = 0.1;

/// The range of slopes that one vehicle covers.
#[derive(Clone, Copy, Debug)]
struct Silhouette {
    /// Outward distance of the nearest corner (m).
    near_m: f64,
    /// Least slope.
    low: f64,
    /// Greatest slope.
    high: f64,
}

/// The visibility of all vehicles for one sensor, computed for each scan in reused memory.
#[derive(Clone, Debug, Default)]
pub(super) struct Visibility {
    /// In the order of the vehicles; `None` for one behind the sensor's plane.
    silhouettes: Vec<Option<Silhouette>>,
    /// The parts of one vehicle's range of slopes that nearer vehicles cover.
    covered: Vec<(f64, f64)>,
}

impl Visibility {
    /// Computes the silhouettes of all vehicles as seen from a sensor of the ego, of the size
    /// `ego`.
    pub(super) fn update(&mut self, direction: Direction, others: &[OtherVehicle], ego: &Dimensions) {
        self.silhouettes.clear();
        self.silhouettes.reserve(others.len());
        self.covered.clear();
        self.covered.reserve(others.len());
        let outward = match direction {
            Direction::Ahead => 1.0,
            Direction::Behind => -1.0,
            Direction::Around => return,
        };
        let silhouettes = others.iter().map(|other| silhouette(other, outward, 0.5 * ego.length_m));
        self.silhouettes.extend(silhouettes);
    }

    /// Returns whether the nearest part of the vehicle with this place in the list is at most
    /// `range_m` away in the direction of view (m).
    pub(super) fn is_within(&self, range_m: f64, place: usize) -> bool {
        range_m == f64::INFINITY || self.near_m(place).is_some_and(|near_m| near_m <= range_m)
    }

    /// Returns the distance of the nearest part of the vehicle with this place in the list, in the
    /// direction of view (m); `None` for one behind the sensor's plane.
    pub(super) fn near_m(&self, place: usize) -> Option<f64> {
        self.silhouette(place).map(|seen| seen.near_m)
    }

    fn silhouette(&self, place: usize) -> Option<Silhouette> {
        self.silhouettes.get(place).copied().flatten()
    }

    /// Returns whether `other`, with this place in the list, is within the field of view, in range,
    /// and not hidden.
    pub(super) fn sees(&mut self, field: &Field<'_>, place: usize, other: &OtherVehicle, ego: &Dimensions) -> bool {
        if field.direction == Direction::Around {
            return box_distance_m(other, ego) <= field.range_m;
        }
        let Some(target) = self.silhouette(place) else { return false };
        let (low, high) = (target.low.max(-field.half_angle_tan), target.high.min(field.half_angle_tan));
        if !(target.near_m <= field.range_m && low < high) {
            return false;
        }
        self.covered.clear();
        for [from, to] in field.blocked {
            let overlap = (from.max(low), to.min(high));
            if overlap.0 < overlap.1 {
                self.covered.push(overlap);
            }
        }
        for nearer in self.silhouettes.iter().flatten().filter(|seen| seen.near_m < target.near_m) {
            let overlap = (nearer.low.max(low), nearer.high.min(high));
            if overlap.0 < overlap.1 {
                self.covered.push(overlap);
            }
        }
        let free = (high - low) - union_width(&mut self.covered);
        free >= NEEDED_SHARE * (target.high - target.low)
    }
}

/// Returns the silhouette of `other`, seen from the bumper at the distance `mount_m` from the ego's
/// centre.
///
/// Returns `None` if `other` lies entirely on the inner side of the sensor's plane.
fn silhouette(other: &OtherVehicle, outward: f64, mount_m: f64) -> Option<Silhouette> {
    let (ahead_m, left_m) = (0.5 * other.length_m, 0.5 * other.width_m);
    let corners = [(ahead_m, left_m), (ahead_m, -left_m), (-ahead_m, left_m), (-ahead_m, -left_m)];
    let mut seen = Silhouette { near_m: f64::INFINITY, low: f64::INFINITY, high: -f64::INFINITY };
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

/// Returns the distance between the boxes of the ego and of `other` as if both were parallel (m).
fn box_distance_m(other: &OtherVehicle, ego: &Dimensions) -> f64 {
    let along_m = bumper_gap_m(other.x_m.abs(), other.length_m, ego.length_m);
    let across_m = other.y_m.abs() - 0.5 * (other.width_m + ego.width_m);
    maths::hypot(along_m.max(0.0), across_m.max(0.0))
}

/// Returns the total width of the union of `intervals`, which it sorts.
pub(super) fn union_width(intervals: &mut [(f64, f64)]) -> f64 {
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
    fn union_width_counts_overlaps_once() {
        assert_eq!(union_width(&mut [(2.0, 3.0), (0.0, 1.0), (0.5, 1.5), (0.6, 0.7)]), 2.5);
        assert_eq!(union_width(&mut []), 0.0);
    }

    fn car(actor: usize, x_m: f64, y_m: f64) -> OtherVehicle {
        OtherVehicle {
            actor,
            class: VehicleClass::Car,
            appearance: closecall_traffic::Vehicle::typical(VehicleClass::Car).appearance,
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

    const EGO: Dimensions = VehicleClass::Car.typical_dimensions();
    const BEHIND: Field<'_> = Field { direction: Direction::Behind, range_m: 120.0, half_angle_tan: 2.3, blocked: &[] };

    fn seen(field: Field<'_>, others: &[OtherVehicle]) -> Vec<bool> {
        let mut visibility = Visibility::default();
        visibility.update(field.direction, others, &EGO);
        others.iter().enumerate().map(|(place, other)| visibility.sees(&field, place, other, &EGO)).collect()
    }

    #[test]
    fn a_nearer_vehicle_hides_a_farther_one_in_line() {
        let in_line = [car(1, -60.0, 0.0), car(2, -20.0, 0.0), car(3, -60.0, 3.75), car(4, 30.0, 0.0)];
        assert_eq!(seen(BEHIND, &in_line), [false, true, true, false]);
        assert_eq!(seen(Field { direction: Direction::Ahead, ..BEHIND }, &in_line), [false, false, false, true]);
        assert_eq!(seen(BEHIND, &[car(1, -127.0, 0.0)]), [false], "beyond the range");
        assert_eq!(seen(BEHIND, &[car(1, -5.0, 8.0)]), [false], "outside the field of view");
    }

    #[test]
    fn a_blot_hides_a_vehicle_if_less_than_a_quarter_of_it_is_free() {
        // The car 60 m behind, with its front at 55.4 m, covers the slopes of ±0.0167.
        let in_line = [car(1, -60.0, 0.0)];
        for (blocked, is_seen) in
            [([-0.02, 0.008], true), ([-0.02, 0.009], false), ([-0.008, 0.02], true), ([0.02, 0.1], true)]
        {
            assert_eq!(seen(Field { blocked: &[blocked], ..BEHIND }, &in_line), [is_seen], "{blocked:?}");
        }
        let left = [car(1, -60.0, 3.75)];
        assert_eq!(seen(Field { blocked: &[[0.03, 0.1]], ..BEHIND }, &left), [false], "the left is positive");
        assert_eq!(seen(Field { blocked: &[[-0.1, -0.03]], ..BEHIND }, &left), [true]);
    }

    #[test]
    fn surround_sensors_see_vehicles_near_the_ego_body() {
        let around = Field { direction: Direction::Around, range_m: 14.0, half_angle_tan: f64::INFINITY, blocked: &[] };
        let others = [car(1, 0.0, 3.75), car(2, 18.0, 3.75), car(3, 19.5, 0.0), car(4, -15.0, -3.75)];
        assert_eq!(seen(around, &others), [true, true, false, true]);
    }
}
