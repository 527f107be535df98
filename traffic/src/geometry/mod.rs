//! Plane geometry of vehicles: oriented boxes, the distance between them, and the first contact of two moving ones.
//!
//! A vehicle seen from above is a rectangle. Two rectangles are disjoint if and only if one of the four directions of
//! their sides separates them (the separating axis theorem for convex polygons; S. Gottschalk, M. C. Lin, D. Manocha,
//! *OBBTree*, SIGGRAPH 1996). Every function of this module rests on this theorem.

mod oriented_box;
mod swept;

#[cfg(test)]
mod tests;

pub use oriented_box::{BoxSide, OrientedBox};
pub use swept::{Contact, first_contact};
