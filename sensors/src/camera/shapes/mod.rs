//! Body shapes: the geometry of vehicles of each class and of roadside furniture.
//!
//! The LiDAR builds its bodies from the same [`Proportions`], so both sensors see the same extents.
//! The shapes in [`HELD_OUT_SHAPES`] never appear in training: the model card evaluates the
//! classifier on them.

mod body;
mod car;
mod motorcycle;
mod roadside;
mod truck;

use body::Body;
pub use body::HELD_OUT_SHAPES;
pub(crate) use body::{build_vehicle, vehicle};
pub(crate) use roadside::{Roadside, roadside};
