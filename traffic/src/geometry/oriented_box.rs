//! A rectangle in the plane, turned by a yaw angle.
//!
//! ```text
//!                 left
//!        1 ┌──────────────┐ 0
//!    rear  │      + ──▶ x │  front        the order of the corners
//!        2 └──────────────┘ 3
//!                right
//! ```

use nalgebra::Vector2;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{Dimensions, PlanePose};

/// One side of a vehicle's box.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum BoxSide {
    /// The side that the vehicle's x axis points to.
    Front,
    /// The side opposite to the front.
    Rear,
    /// The side that the vehicle's y axis points to.
    Left,
    /// The side opposite to the left.
    Right,
}

impl BoxSide {
    /// All sides, in the order in which ties are broken.
    pub const ALL: [Self; 4] = [Self::Front, Self::Rear, Self::Left, Self::Right];

    /// Returns the same side in a mirror image: left and right are exchanged.
    #[must_use]
    pub const fn mirrored(self) -> Self {
        match self {
            Self::Left => Self::Right,
            Self::Right => Self::Left,
            Self::Front | Self::Rear => self,
        }
    }
}

/// A rectangle, given by its centre, size and yaw angle (counter-clockwise).
///
/// All fields must be finite, and both sizes must be positive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrientedBox {
    /// Position of the centre along the plane's x axis (m).
    pub x_m: f64,
    /// Position of the centre along the plane's y axis (m).
    pub y_m: f64,
    /// Angle from the plane's x axis to the vehicle's x axis (rad), counter-clockwise.
    pub yaw_rad: f64,
    /// Length along the vehicle's x axis (m).
    pub length_m: f64,
    /// Width along the vehicle's y axis (m).
    pub width_m: f64,
}

impl OrientedBox {
    /// Creates the box of a vehicle from the pose of its centre and its size.
    pub const fn new(pose: PlanePose, size: Dimensions) -> Self {
        let PlanePose { x_m, y_m, yaw_rad } = pose;
        Self { x_m, y_m, yaw_rad, length_m: size.length_m, width_m: size.width_m }
    }

    /// Returns the centre (m).
    pub fn centre_m(&self) -> Vector2<f64> {
        Vector2::new(self.x_m, self.y_m)
    }

    /// Returns the four corners (m), counter-clockwise: front left, rear left, rear right, front right.
    pub fn corners_m(&self) -> [Vector2<f64>; 4] {
        let centre = self.centre_m();
        Frame::new(self).corner_offsets_m().map(|offset| centre + offset)
    }

    /// Returns the radius of the circle through the corners (m).
    pub fn radius_m(&self) -> f64 {
        0.5 * self.length_m.hypot(self.width_m)
    }

    /// Returns true if the two boxes overlap or touch. NaN counts as an overlap.
    pub fn overlaps(&self, other: &Self) -> bool {
        let reach_m = 0.5 * (self.length_m + self.width_m + other.length_m + other.width_m);
        // Farther apart than their corners reach, as most pairs are: no angle needs to be known.
        let is_far = (other.centre_m() - self.centre_m()).norm_squared() > reach_m * reach_m;
        if is_far && (self.yaw_rad + other.yaw_rad).is_finite() {
            return false;
        }
        self.overlap_of_frames(other, &Frame::new(self), &Frame::new(other))
    }

    /// Returns the Euclidean distance between the two boxes (m): 0 if they overlap or touch, and for NaN.
    pub fn distance_m(&self, other: &Self) -> f64 {
        let (own, others) = (Frame::new(self), Frame::new(other));
        if self.overlap_of_frames(other, &own, &others) {
            return 0.0;
        }
        // Two disjoint convex polygons are nearest to each other at a corner of one of them.
        let offset = other.centre_m() - self.centre_m();
        let others_corners = others.corner_offsets_m().map(|corner| own.distance_squared_m2(offset + corner));
        let own_corners = own.corner_offsets_m().map(|corner| others.distance_squared_m2(corner - offset));
        let nearest = others_corners.into_iter().chain(own_corners).fold(f64::INFINITY, f64::min);
        nearest.sqrt()
    }

    fn overlap_of_frames(&self, other: &Self, own: &Frame, others: &Frame) -> bool {
        let offset = other.centre_m() - self.centre_m();
        let separates = |axis: Vector2<f64>| axis.dot(&offset).abs() > own.reach_m(axis) + others.reach_m(axis);
        !(separates(own.forward) || separates(own.left) || separates(others.forward) || separates(others.left))
    }
}

/// The axes and half sizes of a box; holds the sine and cosine of the yaw, so that they are computed only once.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frame {
    /// Unit vector that points to the front.
    pub(crate) forward: Vector2<f64>,
    /// Unit vector that points to the left.
    pub(crate) left: Vector2<f64>,
    /// Half of the length (m).
    pub(crate) half_length_m: f64,
    /// Half of the width (m).
    pub(crate) half_width_m: f64,
}

impl Frame {
    pub(crate) fn new(shape: &OrientedBox) -> Self {
        let (sin, cos) = shape.yaw_rad.sin_cos();
        Self {
            forward: Vector2::new(cos, sin),
            left: Vector2::new(-sin, cos),
            half_length_m: 0.5 * shape.length_m,
            half_width_m: 0.5 * shape.width_m,
        }
    }

    /// Returns the corners relative to the centre (m), in the order of [`OrientedBox::corners_m`].
    pub(crate) fn corner_offsets_m(&self) -> [Vector2<f64>; 4] {
        let (along, across) = (self.forward * self.half_length_m, self.left * self.half_width_m);
        [along + across, across - along, -along - across, along - across]
    }

    /// Returns the extent of the box from its centre along the unit vector `direction` (m).
    pub(crate) fn reach_m(&self, direction: Vector2<f64>) -> f64 {
        self.half_length_m * self.forward.dot(&direction).abs() + self.half_width_m * self.left.dot(&direction).abs()
    }

    /// Returns the outward normal of a side.
    pub(crate) fn normal(&self, side: BoxSide) -> Vector2<f64> {
        match side {
            BoxSide::Front => self.forward,
            BoxSide::Rear => -self.forward,
            BoxSide::Left => self.left,
            BoxSide::Right => -self.left,
        }
    }

    /// Returns the distance from the centre to a side (m).
    pub(crate) fn half_extent_m(&self, side: BoxSide) -> f64 {
        match side {
            BoxSide::Front | BoxSide::Rear => self.half_length_m,
            BoxSide::Left | BoxSide::Right => self.half_width_m,
        }
    }

    /// Returns half of the length of a side (m).
    pub(crate) fn half_span_m(&self, side: BoxSide) -> f64 {
        match side {
            BoxSide::Front | BoxSide::Rear => self.half_width_m,
            BoxSide::Left | BoxSide::Right => self.half_length_m,
        }
    }

    /// Returns the two corners at the ends of a side, relative to the centre (m).
    pub(crate) fn ends_m(&self, side: BoxSide) -> [Vector2<f64>; 2] {
        let [front_left, rear_left, rear_right, front_right] = self.corner_offsets_m();
        match side {
            BoxSide::Front => [front_right, front_left],
            BoxSide::Left => [front_left, rear_left],
            BoxSide::Rear => [rear_left, rear_right],
            BoxSide::Right => [rear_right, front_right],
        }
    }

    /// Returns the squared distance from the box to a point that is given relative to its centre (m²).
    fn distance_squared_m2(&self, point: Vector2<f64>) -> f64 {
        let beyond = |axis: Vector2<f64>, half_m: f64| (axis.dot(&point).abs() - half_m).max(0.0);
        let (along, across) = (beyond(self.forward, self.half_length_m), beyond(self.left, self.half_width_m));
        along * along + across * across
    }
}
