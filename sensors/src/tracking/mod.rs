//! From detections to tracks: association, filter, extent, class, lifecycle.
//!
//! ```text
//!  detections of one scan ─▶ ground axes ─▶ gate, assign ─▶ filter, extent, class ─▶ confirm / coast / delete
//!                                 ▲                                                       │
//!                            E's odometry                        predict to now, E's frame ▼ tracks
//! ```
//!
//! What is followed is the middle of the face that E sees (a follower's front), not the centre of the box: the face is
//! measured, and the gap to it is what counts; half a length further lies the centre, as well as the length is known.
//! State and noise live in axes fixed to the ground, so that E's braking and turning are no manoeuvre of the others.

mod association;
mod audit;
mod classes;
mod config;
mod extent;
mod kalman;
pub(crate) mod lifecycle;
mod tracker;
mod view;

pub use audit::TrackAudit;
pub use config::{TrackerConfig, TrackerModel};
pub(crate) use tracker::{EgoPose, Tracker, TrackerScan};
pub(crate) use view::RearView;

use closecall_traffic::{Track, TrackId};

/// Spectral density of the white acceleration along the direction of travel [m²/s³].
///
/// From recorded traffic: over NGSIM US-101 (10,212 pairs of speeds 1 s apart) the variance of the change of speed is
/// 0.75, 0.79, 0.75 and 0.76 m²/s² for each second between them at lags of 0.5, 1, 2 and 3 s. That it grows in
/// proportion to the lag is what white acceleration means.
pub(crate) const ALONG_MANOEUVRE_M2PS3: f64 = 0.75;

/// The same across it [m²/s³]: 0.034 to 0.069 in the same recordings, measurement errors included.
pub(crate) const ACROSS_MANOEUVRE_M2PS3: f64 = 0.05;

/// Below this speed the direction of motion says nothing about the heading [m/s].
pub(crate) const HEADING_SPEED_MPS: f64 = 3.0;

/// The tracks of all sensors of E, and the next free number.
#[derive(Clone, Debug, Default)]
pub(crate) struct TrackList {
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
