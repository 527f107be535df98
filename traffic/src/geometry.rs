//! Plane geometry of vehicles: oriented boxes.
