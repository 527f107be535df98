//! Multi-object tracking of the rear LiDAR's detections: association, filter, extent, class and
//! lifecycle.
//!
//! The crate knows no truth: it sees detections, the ego's odometry and the map.
//!
//! ```text
//!  detections of one scan ─▶ road axes ─▶ gate, assign ─▶ filter, extent, class ─▶ confirm / coast / delete
//!                                ▲                                                        │
//!                      ego odometry and map                      tracks ◀─ ego frame ◀─ predict to now
//! ```
//!
//! Along the road, a track follows the middle of the face that the ego sees (a follower's front),
//! not the centre of the box: the face is measured, and it defines the gap. The centre lies half a
//! length behind it, with the uncertainty of the length. State and noise are in road axes: neither
//! the ego's braking and turning nor a bend of the road then looks like a manoeuvre of another
//! vehicle.

mod assignment;
mod association;
pub mod axis;
mod box_use;
mod classes;
mod config;
mod detection;
mod ends;
mod extent;
mod gaussian;
mod lane;
pub mod lifecycle;
mod measurement;
pub mod motion;
mod radar;
pub mod road_filter;
mod track_list;
mod tracker;
mod view;

pub use box_use::{BoxRole, BoxUse, Innovation};
pub use config::{DETECTION_PROBABILITY, MAX_LATENCY_STEPS, TrackerConfig, TrackerModel};
pub use detection::{Detection, Extent, SIDE_PROTRUSION_M, SeenBy, SeenPart, WheelFronts};
pub use gaussian::Gaussian;
pub use lane::LaneGeometry;
pub use radar::{RadarDetection, RadarScan};
pub use track_list::TrackList;
pub use tracker::{Tracker, TrackerScan};
pub use view::{MAX_SIDE_AZIMUTH_RAD, RearView};
