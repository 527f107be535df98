//! From detections to tracks: association, filter, extent, class, lifecycle.
//!
//! ```text
//!  detections of one scan ─▶ road axes ─▶ gate, assign ─▶ filter, extent, class ─▶ confirm / coast / delete
//!                                ▲                                                       │
//!                      E's odometry, the map                    predict to now, E's frame ▼ tracks
//! ```
//!
//! What is followed is the middle of the face that E sees (a follower's front), not the centre of the box: the face is
//! measured, and the gap to it is what counts; half a length further lies the centre, as well as the length is known.
//! State and noise live in road axes, so that neither E's braking and turning nor a bend of the road is a manoeuvre of
//! the others.

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

pub use audit::{NEES_95, TrackAudit};
pub use config::{TrackerConfig, TrackerModel};
pub use consistency::{Consistency, Credibility};
pub use tracker::{Tracker, TrackerScan};
pub use view::RearView;

use closecall_traffic::{Track, TrackId};

/// The tracks of all sensors of E as they are reported, and the next free number.
#[derive(Clone, Debug, Default)]
pub struct TrackList {
    /// The tracks of the latest step.
    pub(crate) tracks: Vec<Track>,
    next_id: u32,
}

impl TrackList {
    /// A number that no track of this run has had.
    pub(crate) fn new_id(&mut self) -> TrackId {
        let id = TrackId(self.next_id);
        self.next_id += 1;
        id
    }
}

#[cfg(test)]
mod tests;
