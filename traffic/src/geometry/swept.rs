//! The first moment at which two moving boxes touch within a time step.
//!
//! Over a step each box moves along a straight line and turns at a constant rate (by the shorter way). Seen from box
//! *a*, with d(τ) from its centre to that of *b*, a side of *a* with outward normal n(τ) and half extent e clears the
//! corner c(τ) of *b* by
//!
//! ```text
//! g(τ)  = n·(d + c) − e
//! g'(τ) = n·v + ωₐ (Jn)·d + (ω_b − ωₐ) n·(Jc)             v = d', J turns by 90°
//! |g''| ≤ ωₐ² |d| + 2 |ωₐ| |v| + (ω_b − ωₐ)² |c| =: K
//! ```
//!
//! so that the side separates the boxes at least until the first root of g + g'δ − ½Kδ² of any corner. The step is
//! walked through in such safe advances, each by the side (of either box) that allows the longest: conservative
//! advancement (B. Mirtich, *Impulse-based dynamic simulation of rigid body systems*, UC Berkeley 1996) of second
//! order. No contact can be missed, however thin or fast the boxes; without rotation each advance is exact, with it
//! they converge quadratically.

use std::f64::consts::TAU;

use nalgebra::Vector2;

use super::oriented_box::Frame;
use super::{BoxSide, OrientedBox};

/// Boxes nearer than this touch [m]: a picometre, well above the rounding of differences of road coordinates.
const TOUCH_M: f64 = 1e-12;

/// Two corners whose depths differ by less touch together [m]: what is flush to within a micrometre meets flatly.
const FLUSH_M: f64 = 1e-6;

/// Where and when two boxes touch first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Share of the step that has passed at the first touch, 0 to 1; 0 where the boxes overlap from the start.
    pub fraction: f64,
    /// Where they touch, along the plane's x axis [m].
    pub x_m: f64,
    /// Where they touch, along the plane's y axis [m].
    pub y_m: f64,
    /// The side that was struck, of the first and of the second box.
    pub sides: [BoxSide; 2],
}

/// The first contact of two boxes that move from their first to their second pose within a step.
///
/// Both poses of a box have the size of the first. Boxes that touch at the very end of the step are in contact at
/// fraction 1. NaN is taken for a contact: it can never look safe.
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

/// True where the circles around the boxes do not meet while the second centre moves from `start` to `end`, seen from
/// the first.
fn circles_stay_apart(a: &OrientedBox, b: &OrientedBox, start: Vector2<f64>, end: Vector2<f64>) -> bool {
    let square = |x: f64| x * x;
    // (rₐ + r_b)² ≤ 2 (rₐ² + r_b²), which needs no root.
    let reach_squared = 0.5 * (square(a.length_m) + square(a.width_m) + square(b.length_m) + square(b.width_m));
    let passes_beside = |from: f64, to: f64| from * to > 0.0 && square(from).min(square(to)) > reach_squared;
    passes_beside(start.x, end.x) || passes_beside(start.y, end.y)
}

/// A box that moves straight and turns at a constant rate over the step.
#[derive(Clone, Copy, Debug)]
struct Moving {
    /// The box at the start.
    shape: OrientedBox,
    /// Movement of the centre over the step [m].
    shift: Vector2<f64>,
    /// Yaw over the whole step [rad], by the shorter way.
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

/// A side of one box, and how it separates it from the other at one moment.
#[derive(Clone, Copy, Debug)]
struct Separation {
    /// Whose side: 0 or 1.
    owner: usize,
    side: BoxSide,
    /// Distance from the side to the nearest corner of the other box [m]; negative behind the side.
    clearance_m: f64,
    /// Share of the step for which the side separates the boxes for certain; infinite where to the end of the step.
    safe_for: f64,
}

/// The relative movement of two boxes within a step; index 0 is box a, 1 is box b.
#[derive(Clone, Copy, Debug)]
struct Sweep {
    boxes: [Moving; 2],
    /// From the centre of a to that of b at the start [m].
    start: Vector2<f64>,
    /// Change of that over the step [m].
    change: Vector2<f64>,
    /// Bound of the clearances' second derivative, by the owner of the side [m].
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
            // Also where the advance is lost in rounding.
            if next <= fraction {
                return Some(self.contact(&separations, &frames, fraction));
            }
            fraction = next;
        }
    }

    /// From the centre of the owner's box to that of the other [m].
    fn offset(&self, owner: usize, fraction: f64) -> Vector2<f64> {
        let from_a_to_b = self.start + self.change * fraction;
        if owner == 0 { from_a_to_b } else { -from_a_to_b }
    }

    /// The sides that can separate the boxes: of each box, the two that face the other's centre.
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

    /// How a side clears the other box's corners, now and later (formulas in the module's documentation).
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

    /// What touches at `fraction`: the side that separated the boxes last, and what of the other box reached it.
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

/// How long `value + rate·δ − ½·curvature·δ²` stays positive, where `value` is; infinite where until `end`, and 0 for
/// NaN.
fn positive_for(value: f64, rate: f64, curvature: f64, end: f64) -> f64 {
    // The parabola is concave: positive at both ends is positive between them.
    if value + rate * end - 0.5 * curvature * end * end > 0.0 {
        return f64::INFINITY;
    }
    let root = (rate * rate + 2.0 * curvature * value).sqrt();
    // Of the two forms of the root, the one that does not cancel. `max` turns NaN into 0.
    let duration = if rate > 0.0 { (rate + root) / curvature } else { 2.0 * value / (root - rate) };
    duration.max(0.0).min(end)
}

/// `vector` turned counter-clockwise by 90°.
fn perpendicular(vector: Vector2<f64>) -> Vector2<f64> {
    Vector2::new(-vector.y, vector.x)
}
