//! Plane geometry of vehicles: oriented boxes, their distance, and the moment at which two moving ones touch.
//!
//! A vehicle seen from above is a rectangle. Two of them are disjoint if and only if one of the four directions of
//! their sides separates them (the separating axis theorem for convex polygons; S. Gottschalk, M. C. Lin, D. Manocha,
//! *OBBTree*, SIGGRAPH 1996); everything here rests on that.

mod oriented_box;
mod swept;

#[cfg(test)]
mod tests;

pub use oriented_box::{BoxSide, OrientedBox};
pub use swept::{Contact, first_contact};
