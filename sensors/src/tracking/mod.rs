//! Multi-object tracking of the rear LiDAR's detections: association, filter, extent, class and lifecycle.
//!
//! ```text
//!  detections of one scan ─▶ road axes ─▶ gate, assign ─▶ filter, extent, class ─▶ confirm / coast / delete
//!                                ▲                                                        │
//!                      ego odometry and map                      tracks ◀─ ego frame ◀─ predict to now
//! ```
//!
//! Along the road, a track follows the middle of the face that the ego sees (a follower's front), not the centre of the
//! box: the face is measured, and it defines the gap. The centre lies half a length behind it, with the uncertainty of
//! the length. State and noise are in road axes, so that neither the ego's braking and turning nor a bend of the road
//! looks like a manoeuvre of another vehicle.

mod association;
mod audit;
pub(crate) mod axis;
mod classes;
mod config;
mod consistency;
mod extent;
pub(crate) mod lifecycle;
mod measurement;
pub(crate) mod motion;
pub(crate) mod road_filter;
mod tracker;
mod view;

pub use audit::{NEES_QUANTILE_95, TrackAudit};
pub use config::{TrackerConfig, TrackerModel};
pub use consistency::{Consistency, Credibility};
pub use tracker::{Tracker, TrackerScan};
pub use view::RearView;

use closecall_traffic::{Track, TrackId};

/// The reported tracks of all sensors of the ego, and the next free track id.
#[derive(Clone, Debug, Default)]
pub struct TrackList {
    /// The tracks of the latest step.
    pub(crate) tracks: Vec<Track>,
    next_id: u32,
}

impl TrackList {
    /// Returns an id that no track of this run has had.
    pub(crate) fn new_id(&mut self) -> TrackId {
        let id = TrackId(self.next_id);
        self.next_id += 1;
        id
    }
}

#[cfg(test)]
mod tests;
