//! When and how two vehicles touch.

use closecall_traffic::geometry::{BoxSide, OrientedBox, first_contact};
use nalgebra::Vector2;

use crate::outcome::ClosedBy;

/// First touch of two vehicles within one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Touch {
    /// The two, by their places in the list of actors, in the order of their names.
    pub(super) pair: [usize; 2],
    /// The share of the step that had passed, 0 to 1.
    pub(super) fraction: f64,
    /// Which side of each was struck.
    pub(super) struck_side: [BoxSide; 2],
}

/// All pairs that touch within a step between the two lists of boxes and are not among `known`, in order of time, and of
/// `by_name` where they touch at once.
pub(super) fn find(
    [before, after]: [&[OrientedBox]; 2],
    by_name: &[usize],
    known: &[[usize; 2]],
    found: &mut Vec<Touch>,
) {
    found.clear();
    for (place, &first) in by_name.iter().enumerate() {
        for &second in &by_name[place + 1..] {
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
    // Stable: what touches at once stays in the order of the names.
    found.sort_by(|one, other| one.fraction.total_cmp(&other.fraction));
}

/// The outward normal of a box's side, in the plane.
fn outward(shape: &OrientedBox, side: BoxSide) -> Vector2<f64> {
    let (sin, cos) = shape.yaw_rad.sin_cos();
    match side {
        BoxSide::Front => Vector2::new(cos, sin),
        BoxSide::Rear => Vector2::new(-cos, -sin),
        BoxSide::Left => Vector2::new(-sin, cos),
        BoxSide::Right => Vector2::new(sin, -cos),
    }
}

/// Which of the two closed the gap: the one that moves towards the other's struck side.
///
/// Judged along the normal of the struck side that faces the approach most squarely.
pub(super) fn closed_by(shapes: [&OrientedBox; 2], sides: [BoxSide; 2], velocities_mps: [Vector2<f64>; 2]) -> ClosedBy {
    let relative = velocities_mps[0] - velocities_mps[1];
    let from_first = outward(shapes[0], sides[0]);
    let from_second = -outward(shapes[1], sides[1]);
    let normal = if relative.dot(&from_first) >= relative.dot(&from_second) { from_first } else { from_second };
    let first = velocities_mps[0].dot(&normal) > 0.0;
    let second = velocities_mps[1].dot(&normal) < 0.0;
    match (first, second) {
        (true, true) => ClosedBy::Both,
        (false, true) => ClosedBy::Second,
        // Neither moves along the normal only where both stand within rounding; the relative motion is then the first's.
        _ => ClosedBy::First,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_one_behind_closes_a_rear_end_collision() {
        let ahead = OrientedBox { x_m: 4.6, y_m: 0.0, yaw_rad: 0.0, length_m: 4.6, width_m: 1.85 };
        let behind = OrientedBox { x_m: 0.0, ..ahead };
        let fast = Vector2::new(30.0, 0.0);
        let slow = Vector2::new(20.0, 0.0);
        assert_eq!(closed_by([&ahead, &behind], [BoxSide::Rear, BoxSide::Front], [slow, fast]), ClosedBy::Second);
        assert_eq!(closed_by([&behind, &ahead], [BoxSide::Front, BoxSide::Rear], [fast, slow]), ClosedBy::First);
    }

    #[test]
    fn the_one_that_swerves_closes_a_side_collision() {
        let left = OrientedBox { x_m: 0.0, y_m: 1.85, yaw_rad: 0.0, length_m: 4.6, width_m: 1.85 };
        let right = OrientedBox { y_m: 0.0, ..left };
        let (straight, swerving) = (Vector2::new(30.0, 0.0), Vector2::new(30.0, 1.0));
        assert_eq!(closed_by([&left, &right], [BoxSide::Right, BoxSide::Left], [straight, swerving]), ClosedBy::Second);
    }
}
