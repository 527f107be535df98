//! The state of an object-level sensor for one vehicle.

use crate::tracking::axis::{AxisEstimate, AxisFilter};
use crate::tracking::lifecycle::Lifecycle;
use closecall_traffic::{TrackId, TrackStatus};

use super::config::MAX_LATENCY_STEPS;
use super::errors::TargetErrors;
use super::faulty::FaultStreams;
use super::fit::{PitchedRanges, TargetRanges};
use super::noise::TargetNoise;

/// Length of the pieces of road on which a vehicle beyond its range is seen or not (m): the usual
/// length of the distances at which the full chain sees a dark SUV 90 to 130 m away.
const PIECE_M: f64 = 5.0;
/// Number of such pieces: 200 m. Farther away, nothing is seen beyond its range.
pub(super) const PIECES: usize = 40;

/// A track with its filters.
#[derive(Clone, Copy, Debug)]
pub(super) struct Filters {
    pub(super) id: TrackId,
    pub(super) lifecycle: Lifecycle,
    /// The filters along and across the road.
    pub(super) axes: [AxisFilter; 2],
    /// Whether the vehicle has been near enough for its class to be known.
    pub(super) is_classified: bool,
}

/// The estimate of one vehicle at the end of one scan, predicted by the latency.
#[derive(Clone, Copy, Debug)]
pub(super) struct Report {
    pub(super) id: TrackId,
    pub(super) lifecycle: Lifecycle,
    pub(super) along: AxisEstimate,
    pub(super) across: AxisEstimate,
    pub(super) is_classified: bool,
}

/// The sensor's state for one vehicle, whether the vehicle is seen or not.
#[derive(Clone, Debug)]
pub(super) struct Target {
    pub(super) actor: usize,
    /// Number of standard deviations by which the range of this vehicle deviates (-).
    pub(super) range_deviation: f64,
    /// The distances in this weather at which the vehicle is seen, over the pitch of the ego.
    pub(super) pitched: PitchedRanges,
    /// These distances under the pitch of the latest scan.
    pub(super) ranges: TargetRanges,
    /// A random number from 0 to 1 for each piece of the road behind, which tells whether the
    /// vehicle is seen there.
    pub(super) pieces: [f64; PIECES],
    /// The errors of the sensor in this weather.
    pub(super) errors: TargetErrors,
    pub(super) noise: TargetNoise,
    /// The track; `None` without one.
    pub(super) filters: Option<Filters>,
    /// Ring buffer of the latest reports; the index is the step modulo the length.
    pub(super) reports: [Option<Report>; MAX_LATENCY_STEPS + 1],
    /// The latest filters, in the same order, if the sensor has faults: a latency that changes
    /// predicts them by their own age.
    pub(super) history: Vec<Option<Filters>>,
    /// What faults do to the measurements of the vehicle; drawn from in each step if the sensor has
    /// faults.
    pub(super) fault_streams: Option<FaultStreams>,
}

impl Target {
    /// Returns whether a vehicle that is seen at this share of the distances is seen at this one
    /// (m).
    pub(super) fn is_seen_at(&self, distance_m: f64, share: f64) -> bool {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a distance is not negative")]
        let piece = (distance_m / PIECE_M) as usize;
        self.pieces.get(piece).is_some_and(|drawn| *drawn < share)
    }

    /// Returns whether the vehicle has a confirmed track.
    pub(super) fn is_confirmed(&self) -> bool {
        self.filters.as_ref().is_some_and(|track| track.lifecycle.status() != TrackStatus::Tentative)
    }
}
