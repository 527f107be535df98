//! The state of an object-level sensor for one vehicle.

use crate::tracking::axis::{AxisEstimate, AxisFilter};
use crate::tracking::lifecycle::Lifecycle;
use closecall_traffic::{TrackId, TrackStatus};

use super::config::MAX_LATENCY_STEPS;
use super::errors::TargetErrors;
use super::faulty::FaultStreams;
use super::noise::TargetNoise;

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
    /// Range in this weather (m).
    pub(super) range_m: f64,
    /// Distance in this weather up to which the class of the vehicle is known (m).
    pub(super) class_range_m: f64,
    /// Its errors in this weather.
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
    /// Returns whether the vehicle has a confirmed track.
    pub(super) fn is_confirmed(&self) -> bool {
        self.filters.as_ref().is_some_and(|track| track.lifecycle.status() != TrackStatus::Tentative)
    }
}
