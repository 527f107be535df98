//! Plane geometry of vehicles: oriented boxes, the distance between them, and the first contact of two moving ones.
//!
//! [`OrientedBox`] is a vehicle seen from above. Whether and when two vehicles touch is decided by parry, the geometry library
//! of the rapier family; the module `queries` is the only place that calls it.

mod oriented_box;
mod queries;

#[cfg(test)]
mod tests;

pub use oriented_box::{BoxSide, OrientedBox};
pub use queries::{Contact, first_contact};
