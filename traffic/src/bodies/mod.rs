//! Body shapes: the proportions from which the LiDAR and the camera both build the bodies of
//! vehicles.
//!
//! ```text
//!                  ┌─▶ lidar/shapes   convex solids with materials ─▶ points
//!  BodyShape ─▶ Proportions
//!                  └─▶ camera/shapes  meshes with colours and lamps ─▶ images
//! ```
//!
//! Proportions are scaled to the vehicle's own length, width and height. They are typical values
//! read off drawings, not the values of a specific model.

mod car;
mod motorcycle;
mod proportions;
mod truck;

pub use car::{CarProportions, GREENHOUSE_FOOT_HALF_WIDTH};
pub use motorcycle::{HEAD_BACK_M, HIP_X_M, Lamps, MotorcycleProportions, RIDER, WHEEL_RADIUS_M};
pub use proportions::{HalfExtent, Proportions};
pub use truck::{
    CAB_M, CRATE, DECK, LOAD_FLOOR_M, LOAD_GAP_M, Load, SCREEN_RAKE_M, Slab, TANK_FLOOR_M, TruckProportions, VISOR,
};
