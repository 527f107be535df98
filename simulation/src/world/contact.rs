//! Detects when two vehicles first touch, on which sides, and which of them closed the gap.

use closecall_traffic::geometry::{BoxSide, OrientedBox, first_contact};
use nalgebra::Vector2;

use crate::outcome::ClosedBy;

/// The boxes of all vehicles before and after one step, in the order of the list of actors.
#[derive(Clone, Copy, Debug)]
pub(super) struct StepBoxes<'a> {
    /// At the start of the step.
    pub(super) before: &'a [OrientedBox],
    /// At the end of the step.
    pub(super) after: &'a [OrientedBox],
}

/// First contact of two vehicles within one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Touch {
    /// Indices of the two vehicles in the list of actors, in the order of the vehicles' names.
    pub(super) pair: [usize; 2],
    /// Fraction of the step that had passed at the contact, 0 to 1.
    pub(super) fraction: f64,
    /// The side of each vehicle that was struck, in the order of `pair`.
    pub(super) struck_side: [BoxSide; 2],
}

/// Replaces the content of `found` by the pairs of vehicles that touch within a step and are not among `known`.
///
/// `by_name` holds the indices of the actors in the order of their names. The pairs are sorted by time; pairs with equal
/// times are in the order of `by_name`.
pub(super) fn find(boxes: StepBoxes<'_>, by_name: &[usize], known: &[[usize; 2]], found: &mut Vec<Touch>) {
    let StepBoxes { before, after } = boxes;
    found.clear();
    for (rank, &first) in by_name.iter().enumerate() {
        for &second in &by_name[rank + 1..] {
            if known.contains(&[first, second]) {
                continue;
            }
            let contact = first_contact(&before[first], &after[first], &before[second], &after[second]);
            if let Some(contact) = contact {
                let struck_side = contact.sides;
                found.push(Touch { pair: [first, second], fraction: contact.fraction, struck_side });
            }
        }
    }
    // The sort is stable: pairs that touch at the same time stay in the order of the names.
    found.sort_by(|one, other| one.fraction.total_cmp(&other.fraction));
}

/// Returns the outward normal of a side of a box, in the plane.
fn outward(shape: &OrientedBox, side: BoxSide) -> Vector2<f64> {
    let (sin, cos) = shape.yaw_rad.sin_cos();
    match side {
        BoxSide::Front => Vector2::new(cos, sin),
        BoxSide::Rear => Vector2::new(-cos, -sin),
        BoxSide::Left => Vector2::new(-sin, cos),
        BoxSide::Right => Vector2::new(sin, -cos),
    }
}

/// A vehicle at the moment of a contact.
#[derive(Clone, Copy, Debug)]
pub(super) struct StruckVehicle<'a> {
    /// Its box.
    pub(super) shape: &'a OrientedBox,
    /// The side that was struck.
    pub(super) side: BoxSide,
    /// Its velocity in the plane (m/s).
    pub(super) velocity_mps: Vector2<f64>,
}

/// Returns which of two vehicles closed the gap: the one that moves towards the struck side of the other.
///
/// Motion is measured along the normal of one of the two struck sides: the one along which they approach faster.
pub(super) fn closed_by(first: StruckVehicle<'_>, second: StruckVehicle<'_>) -> ClosedBy {
    let relative = first.velocity_mps - second.velocity_mps;
    let from_first = outward(first.shape, first.side);
    let from_second = -outward(second.shape, second.side);
    let normal = if relative.dot(&from_first) >= relative.dot(&from_second) { from_first } else { from_second };
    let first_approaches = first.velocity_mps.dot(&normal) > 0.0;
    let second_approaches = second.velocity_mps.dot(&normal) < 0.0;
    match (first_approaches, second_approaches) {
        (true, true) => ClosedBy::Both,
        (false, true) => ClosedBy::Second,
        // If neither approaches, both stand within rounding. The gap is then attributed to the first vehicle.
        _ => ClosedBy::First,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn struck(shape: &OrientedBox, side: BoxSide, velocity_mps: Vector2<f64>) -> StruckVehicle<'_> {
        StruckVehicle { shape, side, velocity_mps }
    }

    #[test]
    fn the_vehicle_behind_closes_a_rear_end_collision() {
        let ahead = OrientedBox { x_m: 4.6, y_m: 0.0, yaw_rad: 0.0, length_m: 4.6, width_m: 1.85 };
        let behind = OrientedBox { x_m: 0.0, ..ahead };
        let fast = Vector2::new(30.0, 0.0);
        let slow = Vector2::new(20.0, 0.0);
        let (ahead, behind) = (struck(&ahead, BoxSide::Rear, slow), struck(&behind, BoxSide::Front, fast));
        assert_eq!(closed_by(ahead, behind), ClosedBy::Second);
        assert_eq!(closed_by(behind, ahead), ClosedBy::First);
    }

    #[test]
    fn the_vehicle_that_swerves_closes_a_side_collision() {
        let left = OrientedBox { x_m: 0.0, y_m: 1.85, yaw_rad: 0.0, length_m: 4.6, width_m: 1.85 };
        let right = OrientedBox { y_m: 0.0, ..left };
        let (straight, swerving) = (Vector2::new(30.0, 0.0), Vector2::new(30.0, 1.0));
        let (left, right) = (struck(&left, BoxSide::Right, straight), struck(&right, BoxSide::Left, swerving));
        assert_eq!(closed_by(left, right), ClosedBy::Second);
    }
}
