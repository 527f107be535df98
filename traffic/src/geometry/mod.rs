//! Plane geometry of vehicles: oriented boxes, the distance between them, and the first contact of
//! two moving boxes.
//!
//! [`OrientedBox`] is a vehicle seen from above. parry, the geometry library of the rapier family,
//! decides whether and when two vehicles touch. Only the module `queries` calls it.

mod oriented_box;
mod queries;

#[cfg(test)]
mod tests;

pub use oriented_box::{BoxSide, OrientedBox};
pub use queries::{Contact, first_contact};
