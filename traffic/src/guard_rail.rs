//! The guard rails along both edges of the road, as the LiDAR and the camera model them.
//!
//! The rail is of the usual European type: a W-shaped beam 0.31 m high whose upper edge is 0.75 m
//! above the road, on posts 4 m apart. It stands 0.75 m from the left edge of the road and, beyond
//! a hard shoulder, 3 m from the right edge (assumptions within the usual cross-sections of German
//! motorways, RAA 2008).

/// Distance of the beam's face from the left edge of the road (m).
pub const LEFT_OFFSET_M: f64 = 0.75;
/// Distance of the beam's face from the right edge of the road (m).
pub const RIGHT_OFFSET_M: f64 = 3.0;
/// Depth of the beam (m).
pub const BEAM_DEPTH_M: f64 = 0.08;
/// Height of the beam's upper edge (m).
pub const BEAM_TOP_M: f64 = 0.75;
/// Distance between two posts (m).
pub const POST_SPACING_M: f64 = 4.0;
