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

use crate::{Dimensions, PlanePose, maths};

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

    /// Returns the four corners (m), counter-clockwise: front left, rear left, rear right, front
    /// right.
    pub fn corners_m(&self) -> [Vector2<f64>; 4] {
        let (sin, cos) = maths::sin_cos(self.yaw_rad);
        let along = Vector2::new(cos, sin) * (0.5 * self.length_m);
        let across = Vector2::new(-sin, cos) * (0.5 * self.width_m);
        [along + across, across - along, -along - across, along - across].map(|offset| self.centre_m() + offset)
    }

    /// Returns the radius of the circle through the corners (m).
    pub fn radius_m(&self) -> f64 {
        0.5 * maths::hypot(self.length_m, self.width_m)
    }
}
