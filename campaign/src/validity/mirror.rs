//! Whether one outcome is the mirror image of another.
//!
//! Mirroring changes how coordinates are rounded, so that bits cannot be asked for; what follows from them can: who
//! collided with whom, on which sides, and when.

use closecall_traffic::Time;
use closecall_traffic::geometry::BoxSide;

use closecall_simulation::outcome::{Collision, Outcome};

/// First touches of mirrored runs are no further apart than one step of the vehicles.
const SAME_TIME: Time = Time::from_ms(10);

/// True where `image` is the mirror image of `outcome`: the same first collision, on the mirrored sides, or none.
///
/// What follows a first collision depends on how rapier's solver orders its contacts, which has no mirror image.
pub(super) fn is_mirror_image(image: &Outcome, outcome: &Outcome) -> bool {
    match (image.collisions.first(), outcome.collisions.first()) {
        (Some(image), Some(original)) => is_mirrored(image, original),
        (image, original) => image.is_none() && original.is_none(),
    }
}

fn is_mirrored(image: &Collision, original: &Collision) -> bool {
    let apart_ns = (image.time - original.time).ns().abs();
    image.between == original.between
        && image.struck_side == original.struck_side.map(mirrored)
        && apart_ns <= SAME_TIME.ns()
}

fn mirrored(side: BoxSide) -> BoxSide {
    match side {
        BoxSide::Left => BoxSide::Right,
        BoxSide::Right => BoxSide::Left,
        BoxSide::Front | BoxSide::Rear => side,
    }
}
