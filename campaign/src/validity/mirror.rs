//! Tests whether one outcome is the mirror image of another.
//!
//! Mirroring changes how coordinates are rounded, so that the bits may differ. The colliding
//! vehicles, the sides that they struck, and the time of the collision must agree.

use closecall_scenarios::outcome::{Collision, Outcome};
use closecall_traffic::Time;
use closecall_traffic::geometry::BoxSide;

/// Largest difference between the collision times of mirrored runs: one step of the vehicles.
const TOLERANCE: Time = Time::from_ms(10);

/// Returns true if `image` is the mirror image of `outcome`: both have the same first collision, on
/// mirrored sides, or none.
///
/// Later collisions are not compared. They depend on the order in which rapier's solver treats
/// contacts, which has no mirror image.
pub(super) fn is_mirror_image(image: &Outcome, outcome: &Outcome) -> bool {
    match (image.collisions.first(), outcome.collisions.first()) {
        (Some(image), Some(original)) => is_mirrored(image, original),
        (image, original) => image.is_none() && original.is_none(),
    }
}

fn is_mirrored(image: &Collision, original: &Collision) -> bool {
    let difference_ns = (image.time - original.time).ns().abs();
    image.between == original.between
        && image.struck_side == original.struck_side.map(mirrored)
        && difference_ns <= TOLERANCE.ns()
}

fn mirrored(side: BoxSide) -> BoxSide {
    match side {
        BoxSide::Left => BoxSide::Right,
        BoxSide::Right => BoxSide::Left,
        BoxSide::Front | BoxSide::Rear => side,
    }
}
