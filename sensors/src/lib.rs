//! What E perceives: rear LiDAR, rear camera, object-level sensors, and the tracker that they feed.
//!
//! ```text
//!            ┌ lidar/   scan pattern ─▶ ray cast ─▶ power, noise ─▶ points ─▶ ground removal ─▶ clusters ─▶ boxes ┐
//!  Scene ────┤ camera/  crop of the image at each cluster ─▶ classifier ─▶ class scores                          ├─▶ tracking/ ─▶ tracks
//!            └ object   range, noise, latency, field of view (front radar, surround; rear as a simple stand-in)  ┘
//! ```

mod detection;
mod perception;
mod scene;

pub use detection::{Detection, Extent};
pub use perception::{Health, Perception, SensorError, SensorHealth};
pub use scene::{Scene, SceneVehicle};
