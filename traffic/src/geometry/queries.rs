//! Distance, overlap and first contact of boxes, decided by parry, the geometry library of the
//! rapier family.
//!
//! | question | answered by |
//! |---|---|
//! | distance and overlap of two boxes | parry's distance and intersection test of two cuboids |
//! | what separates two boxes at a moment, and by how much | parry's separating axes of two cuboids |
//! | first contact within a time step | the loop in [`first_contact`] over these axes |
//!
//! Over a step each box moves along a straight line and turns at a constant rate, in the direction
//! of the smaller angle. An axis n that separates the boxes by s keeps them apart for at least s /
//! (−n·v + ωₐ rₐ + ω_b r_b), where v is the relative velocity of the centres, and ω and r are the
//! yaw rates and radii. The loop advances through the step by such safe amounts until no axis
//! separates the boxes: conservative advancement (B. Mirtich, *Impulse-based dynamic simulation of
//! rigid body systems*, UC Berkeley 1996). It cannot miss a contact, however thin or fast the boxes
//! are. Without rotation it is exact.
//!
//! # Why not parry's own cast
//!
//! `cast_shapes_nonlinear` bisects along one direction, and treats an interval as free if both of
//! its ends are free. In 200,000 random steps with turns of up to 1.5 rad, it missed 6 of 54,244
//! contacts, one of them 0.12 m deep. Its contacts begin up to 0.22 µm before the boxes touch,
//! which in a slow approach is a thousandth of a step. A corner that passes another at 0.7 mm is a
//! contact to it if the first bisection happens to meet a root of the first direction; a test of
//! this module has the case. It takes 1.5 to 4 µs, and panics at NaN. The loop here misses nothing
//! in the same steps, ends within 1.3e-12 m of the contact, and takes 0.1 to 0.4 µs.
//!
//! # Precision
//!
//! The package is `parry2d-f64`, beside the `parry2d` in `f32` of rapier. In `f32`, casts of
//! 200,000 steps of traffic began up to 5 mm before the contact, and about 100 of them found a
//! contact of vehicles that pass each other. All positions are relative to the first box, so a
//! large position along the road costs no digits.

use std::f64::consts::TAU;

use nalgebra::Vector2;
use parry2d_f64::math::{Pose, Vector};
use parry2d_f64::query::{details, sat};
use parry2d_f64::shape::Cuboid;

use super::{BoxSide, OrientedBox};

/// Separation below which boxes count as touching (m): a picometre, well above the rounding error
/// of differences between road coordinates.
const TOUCH_M: f64 = 1e-12;

/// The time of the first contact of two boxes, and the sides that touch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Share of the step that has passed at the first contact, 0 to 1; 0 if the boxes overlap from
    /// the start.
    pub fraction: f64,
    /// The struck side of the first and of the second box.
    pub sides: [BoxSide; 2],
}

impl OrientedBox {
    /// Returns true if the two boxes overlap or touch. NaN counts as an overlap.
    pub fn overlaps(&self, other: &Self) -> bool {
        details::intersection_test_cuboid_cuboid(&self.relative_pose(other), &cuboid(self), &cuboid(other))
    }

    /// Returns the Euclidean distance between the two boxes (m): 0 if they overlap or touch, and
    /// for NaN.
    pub fn distance_m(&self, other: &Self) -> f64 {
        details::distance_cuboid_cuboid(&self.relative_pose(other), &cuboid(self), &cuboid(other))
    }

    /// Returns the pose of another box in the frame of this box.
    fn relative_pose(&self, other: &Self) -> Pose {
        pose(Vector2::zeros(), self.yaw_rad).inv_mul(&pose(other.centre_m() - self.centre_m(), other.yaw_rad))
    }
}

/// Finds the first contact of two boxes that move from their first to their second pose within a
/// step.
///
/// The size of each box is taken from its first pose. Boxes that touch at the very end of the step
/// have a contact at fraction 1. NaN counts as a contact, so that it can never look safe. Returns
/// `None` if the boxes do not touch.
pub fn first_contact(
    a_from: &OrientedBox,
    a_to: &OrientedBox,
    b_from: &OrientedBox,
    b_to: &OrientedBox,
) -> Option<Contact> {
    let start = b_from.centre_m() - a_from.centre_m();
    let end = b_to.centre_m() - a_to.centre_m();
    if circles_stay_apart(a_from, b_from, start, end) {
        return None;
    }
    let shapes = [cuboid(a_from), cuboid(b_from)];
    let shift_m = end - start;
    let [a_turn_rad, b_turn_rad] = [smaller_turn_rad(a_from, a_to), smaller_turn_rad(b_from, b_to)];
    let turning_m = a_turn_rad.abs() * a_from.radius_m() + b_turn_rad.abs() * b_from.radius_m();
    let mut fraction = 0.0;
    loop {
        let a = pose(Vector2::zeros(), a_from.yaw_rad + fraction * a_turn_rad);
        let b = pose(start + shift_m * fraction, b_from.yaw_rad + fraction * b_turn_rad);
        let axes = Axes::new(&a.inv_mul(&b), &shapes);
        let safe_for = axes.directions(&a).into_iter().fold(0.0_f64, |longest, (separation_m, direction)| {
            if separation_m > TOUCH_M {
                let closing_m = -(direction.x * shift_m.x + direction.y * shift_m.y);
                longest.max(separation_m / (closing_m.max(0.0) + turning_m))
            } else {
                longest
            }
        });
        let next = fraction + safe_for;
        if next > 1.0 {
            return None;
        }
        // This also covers an advance that is lost in rounding.
        if next <= fraction {
            return Some(Contact { fraction, sides: axes.touching_sides() });
        }
        fraction = next;
    }
}

/// Returns true if the circumscribed circles of the boxes do not meet while the centre of `b` moves
/// from `start` to `end` relative to the centre of `a`.
///
/// It takes 5 ns, and the axes of a pair take 50 ns. Most pairs are far apart.
fn circles_stay_apart(a: &OrientedBox, b: &OrientedBox, start: Vector2<f64>, end: Vector2<f64>) -> bool {
    let square = |x: f64| x * x;
    // The bound (rₐ + r_b)² ≤ 2 (rₐ² + r_b²) needs no square root.
    let reach_squared = 0.5 * (square(a.length_m) + square(a.width_m) + square(b.length_m) + square(b.width_m));
    let passes_beside = |from: f64, to: f64| from * to > 0.0 && square(from).min(square(to)) > reach_squared;
    passes_beside(start.x, end.x) || passes_beside(start.y, end.y)
}

/// Returns the change of yaw in the direction of the smaller angle (rad).
fn smaller_turn_rad(from: &OrientedBox, to: &OrientedBox) -> f64 {
    let turn_rad = to.yaw_rad - from.yaw_rad;
    turn_rad - (turn_rad / TAU).round() * TAU
}

fn cuboid(shape: &OrientedBox) -> Cuboid {
    Cuboid::new(Vector::new(0.5 * shape.length_m, 0.5 * shape.width_m))
}

/// Returns parry's pose of a box.
fn pose(centre_m: Vector2<f64>, yaw_rad: f64) -> Pose {
    Pose::new(Vector::new(centre_m.x, centre_m.y), yaw_rad)
}

/// For each of two boxes, the direction in its frame towards the other that separates them most (or
/// fails least to), and the separation (m), which is negative if the boxes overlap along it.
struct Axes {
    relative: Pose,
    a: (f64, Vector),
    b: (f64, Vector),
}

impl Axes {
    /// Asks parry for the axes. `relative` is the pose of the second box in the frame of the first.
    fn new(relative: &Pose, [a, b]: &[Cuboid; 2]) -> Self {
        let separating = sat::cuboid_cuboid_find_local_separating_normal_oneway;
        Self { relative: *relative, a: separating(a, b, relative), b: separating(b, a, &relative.inverse()) }
    }

    /// Returns the separations with their directions in the plane, from the first box to the
    /// second. `a` is the pose of the first box.
    fn directions(&self, a: &Pose) -> [(f64, Vector); 2] {
        let rotation = a.rotation;
        [(self.a.0, rotation * self.a.1), (self.b.0, rotation * (self.relative.rotation * -self.b.1))]
    }

    /// Returns the sides that touch: the side of the axis that separated the boxes last, and the
    /// side that faces it.
    fn touching_sides(&self) -> [BoxSide; 2] {
        let rotation = self.relative.rotation;
        if self.a.0 >= self.b.0 {
            [facing_side(self.a.1), facing_side(rotation.inverse() * -self.a.1)]
        } else {
            [facing_side(rotation * -self.b.1), facing_side(self.b.1)]
        }
    }
}

/// Returns the side of a box whose outward normal is nearest to a direction in the box's frame.
fn facing_side(direction: Vector) -> BoxSide {
    if direction.x.abs() >= direction.y.abs() {
        if direction.x >= 0.0 { BoxSide::Front } else { BoxSide::Rear }
    } else if direction.y >= 0.0 {
        BoxSide::Left
    } else {
        BoxSide::Right
    }
}
