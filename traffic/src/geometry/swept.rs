//! Continuous collision detection: the first contact of two moving boxes within a time step.
//!
//! Over a step each box moves along a straight line and turns at a constant rate, in the direction of the smaller
//! angle. Seen from box *a*, a side of *a* with outward normal n(τ) and half extent e has the following clearance g to
//! the corner c(τ) of *b*, where d(τ) is the vector from the centre of *a* to that of *b*, and ωₐ and ω_b are the yaw
//! rates:
//!
//! ```text
//! g(τ)  = n·(d + c) − e
//! g'(τ) = n·v + ωₐ (Jn)·d + (ω_b − ωₐ) n·(Jc)             v = d', J turns by 90°
//! |g''| ≤ ωₐ² |d| + 2 |ωₐ| |v| + (ω_b − ωₐ)² |c| =: K
//! ```
//!
//! The side therefore separates the boxes at least until the first root of g + g'δ − ½Kδ² of any corner. The algorithm
//! advances through the step by such safe amounts; for each it uses the side, of either box, that allows the longest
//! advance. This is conservative advancement (B. Mirtich, *Impulse-based dynamic simulation of rigid body systems*, UC
//! Berkeley 1996) of second order. It cannot miss a contact, however thin or fast the boxes are. Without rotation each
//! advance is exact; with rotation the advances converge quadratically.

use std::f64::consts::TAU;

use nalgebra::Vector2;

use super::oriented_box::Frame;
use super::{BoxSide, OrientedBox};

/// Clearance below which boxes count as touching (m): a picometre, well above the rounding error of differences between
/// road coordinates.
const TOUCH_M: f64 = 1e-12;

/// Difference of depth below which the two corners of a side touch at the same time (m): the contact is then flat.
const FLUSH_M: f64 = 1e-6;

/// The time and place of the first contact of two boxes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Share of the step that has passed at the first contact, 0 to 1; 0 if the boxes overlap from the start.
    pub fraction: f64,
    /// Position of the contact along the plane's x axis (m).
    pub x_m: f64,
    /// Position of the contact along the plane's y axis (m).
    pub y_m: f64,
    /// The struck side of the first and of the second box.
    pub sides: [BoxSide; 2],
}

/// Finds the first contact of two boxes that move from their first to their second pose within a step.
///
/// The size of each box is taken from its first pose. Boxes that touch at the very end of the step have a contact at
/// fraction 1. NaN counts as a contact, so that it can never look safe. Returns `None` if the boxes do not touch.
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
    Sweep::new([Moving::new(a_from, a_to), Moving::new(b_from, b_to)], start, end).first_contact()
}

/// Returns true if the circumscribed circles of the boxes do not meet while the centre of `b`, relative to that of `a`,
/// moves from `start` to `end`.
fn circles_stay_apart(a: &OrientedBox, b: &OrientedBox, start: Vector2<f64>, end: Vector2<f64>) -> bool {
    let square = |x: f64| x * x;
    // The bound (rₐ + r_b)² ≤ 2 (rₐ² + r_b²) needs no square root.
    let reach_squared = 0.5 * (square(a.length_m) + square(a.width_m) + square(b.length_m) + square(b.width_m));
    let passes_beside = |from: f64, to: f64| from * to > 0.0 && square(from).min(square(to)) > reach_squared;
    passes_beside(start.x, end.x) || passes_beside(start.y, end.y)
}

/// A box that moves in a straight line and turns at a constant rate over the step.
#[derive(Clone, Copy, Debug)]
struct Moving {
    /// The box at the start of the step.
    shape: OrientedBox,
    /// Displacement of the centre over the step (m).
    shift: Vector2<f64>,
    /// Change of yaw over the step (rad), in the direction of the smaller angle.
    turn_rad: f64,
}

impl Moving {
    fn new(from: &OrientedBox, to: &OrientedBox) -> Self {
        let turn = to.yaw_rad - from.yaw_rad;
        let full_turns = (turn / TAU).round();
        Self { shape: *from, shift: to.centre_m() - from.centre_m(), turn_rad: turn - full_turns * TAU }
    }

    fn centre_m(&self, fraction: f64) -> Vector2<f64> {
        self.shape.centre_m() + self.shift * fraction
    }

    fn frame(&self, fraction: f64) -> Frame {
        Frame::new(&OrientedBox { yaw_rad: self.shape.yaw_rad + fraction * self.turn_rad, ..self.shape })
    }
}

/// A side of one box, and its separation from the other box at one moment.
#[derive(Clone, Copy, Debug)]
struct Separation {
    /// Index of the box that the side belongs to: 0 or 1.
    owner: usize,
    side: BoxSide,
    /// Distance from the side to the nearest corner of the other box (m); negative if the corner is behind the side.
    clearance_m: f64,
    /// Share of the step for which the side is certain to separate the boxes; infinite if until the end of the step.
    safe_for: f64,
}

/// The relative movement of two boxes within a step. Index 0 is box a, index 1 is box b.
#[derive(Clone, Copy, Debug)]
struct Sweep {
    boxes: [Moving; 2],
    /// Vector from the centre of a to that of b at the start of the step (m).
    start: Vector2<f64>,
    /// Change of that vector over the step (m).
    change: Vector2<f64>,
    /// Bound K on the second derivative of the clearances (m), by the owner of the side.
    curvature_m: [f64; 2],
}

impl Sweep {
    fn new(boxes: [Moving; 2], start: Vector2<f64>, end: Vector2<f64>) -> Self {
        let change = end - start;
        let curvature_m = [0, 1].map(|owner| {
            let own_turn = boxes[owner].turn_rad;
            let relative_turn = boxes[1 - owner].turn_rad - own_turn;
            if own_turn == 0.0 && relative_turn == 0.0 {
                return 0.0;
            }
            let farthest = start.norm().max(end.norm());
            own_turn * own_turn * farthest
                + 2.0 * own_turn.abs() * change.norm()
                + relative_turn * relative_turn * boxes[1 - owner].shape.radius_m()
        });
        Self { boxes, start, change, curvature_m }
    }

    fn first_contact(&self) -> Option<Contact> {
        let mut fraction = 0.0;
        loop {
            let frames = self.boxes.map(|moving| moving.frame(fraction));
            let separations = self.separations(&frames, fraction);
            let safe_for = separations.iter().fold(0.0_f64, |longest, separation| longest.max(separation.safe_for));
            if safe_for == f64::INFINITY {
                return None;
            }
            let next = (fraction + safe_for).min(1.0);
            // This also covers an advance that is lost in rounding.
            if next <= fraction {
                return Some(self.contact(&separations, &frames, fraction));
            }
            fraction = next;
        }
    }

    /// Returns the vector from the centre of the owner's box to that of the other box (m).
    fn offset(&self, owner: usize, fraction: f64) -> Vector2<f64> {
        let from_a_to_b = self.start + self.change * fraction;
        if owner == 0 { from_a_to_b } else { -from_a_to_b }
    }

    /// Evaluates the sides that can separate the boxes: of each box, the two that face the centre of the other.
    fn separations(&self, frames: &[Frame; 2], fraction: f64) -> [Separation; 4] {
        [(0, false), (0, true), (1, false), (1, true)].map(|(owner, lateral)| {
            let offset = self.offset(owner, fraction);
            let side = if lateral {
                if frames[owner].left.dot(&offset) >= 0.0 { BoxSide::Left } else { BoxSide::Right }
            } else {
                if frames[owner].forward.dot(&offset) >= 0.0 { BoxSide::Front } else { BoxSide::Rear }
            };
            self.separation(owner, side, frames, fraction)
        })
    }

    /// Evaluates the clearance between a side and the corners of the other box, now and later (formulas in the module
    /// documentation).
    fn separation(&self, owner: usize, side: BoxSide, frames: &[Frame; 2], fraction: f64) -> Separation {
        let normal = frames[owner].normal(side);
        let turned = perpendicular(normal);
        let offset = self.offset(owner, fraction);
        let change = if owner == 0 { self.change } else { -self.change };
        let own_turn = self.boxes[owner].turn_rad;
        let relative_turn = self.boxes[1 - owner].turn_rad - own_turn;

        let centre_clearance = normal.dot(&offset) - frames[owner].half_extent_m(side);
        let centre_rate = normal.dot(&change) + own_turn * turned.dot(&offset);
        let clearance_m = centre_clearance - frames[1 - owner].reach_m(normal);
        if clearance_m <= TOUCH_M || clearance_m.is_nan() {
            return Separation { owner, side, clearance_m, safe_for: 0.0 };
        }
        let safe_for = frames[1 - owner].corner_offsets_m().into_iter().fold(f64::INFINITY, |safe_for, corner| {
            let clearance = centre_clearance + normal.dot(&corner);
            let rate = centre_rate + relative_turn * normal.dot(&perpendicular(corner));
            safe_for.min(positive_for(clearance, rate, self.curvature_m[owner], 1.0 - fraction))
        });
        Separation { owner, side, clearance_m, safe_for }
    }

    /// Describes the contact at `fraction`: the side that separated the boxes last, and the part of the other box that
    /// reached it.
    fn contact(&self, separations: &[Separation; 4], frames: &[Frame; 2], fraction: f64) -> Contact {
        let mut last = separations[0];
        for separation in separations {
            if separation.clearance_m > last.clearance_m {
                last = *separation;
            }
        }
        let (own, other) = (&frames[last.owner], &frames[1 - last.owner]);
        let normal = own.normal(last.side);
        let mut facing = BoxSide::Front;
        for side in BoxSide::ALL {
            if other.normal(side).dot(&normal) < other.normal(facing).dot(&normal) {
                facing = side;
            }
        }

        let offset = self.offset(last.owner, fraction);
        let [first, second] = other.ends_m(facing).map(|end| end + offset);
        let tangent = perpendicular(normal);
        let [depth_first, depth_second] = [first, second].map(|end| normal.dot(&end));
        let struck = if (depth_first - depth_second).abs() > FLUSH_M {
            if depth_first < depth_second { first } else { second }
        } else {
            let half_m = own.half_span_m(last.side);
            let [from, to] = [first, second].map(|end| tangent.dot(&end).clamp(-half_m, half_m));
            normal * depth_first + tangent * (0.5 * (from + to))
        };
        let b_owns = last.owner == 1;
        let owner_centre = self.boxes[last.owner].centre_m(fraction);
        Contact {
            fraction,
            x_m: owner_centre.x + struck.x,
            y_m: owner_centre.y + struck.y,
            sides: if b_owns { [facing, last.side] } else { [last.side, facing] },
        }
    }
}

/// Returns how long `value + rate·δ − ½·curvature·δ²` stays positive if `value` is positive: infinity if until `end`,
/// and 0 for NaN.
fn positive_for(value: f64, rate: f64, curvature: f64, end: f64) -> f64 {
    // The parabola is concave: if it is positive at both ends, it is positive between them.
    if value + rate * end - 0.5 * curvature * end * end > 0.0 {
        return f64::INFINITY;
    }
    let root = (rate * rate + 2.0 * curvature * value).sqrt();
    // Of the two equivalent forms of the root, this takes the one without cancellation. `max` turns NaN into 0.
    let duration = if rate > 0.0 { (rate + root) / curvature } else { 2.0 * value / (root - rate) };
    duration.max(0.0).min(end)
}

/// Returns `vector` rotated counter-clockwise by 90°.
fn perpendicular(vector: Vector2<f64>) -> Vector2<f64> {
    Vector2::new(-vector.y, vector.x)
}
