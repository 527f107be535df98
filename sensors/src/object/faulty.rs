//! What faults make of the tracks of an object-level sensor, and what its monitor notices of them.

use closecall_traffic::{ClassScores, Source, Time, Track, TrackId, TrackStatus, VehicleClass};
use nalgebra::{Matrix4, Vector4};

use closecall_tracking::TrackList;

use super::sensor::ScanInput;
use crate::faults::{NOTICED_AFTER_SCANS, ObjectFault};

/// Length and width of a vehicle that is not there (m): those of a usual car.
const GHOST_SIZE_M: [f64; 2] = [4.6, 1.8];
/// Standard deviations of its position (m) and speed (m/s): those of a settled track.
const GHOST_SD: [f64; 2] = [0.15, 0.3];
/// Score of its class, car.
const GHOST_CONFIDENCE: f64 = 0.97;

/// The memory of a sensor with faults.
#[derive(Clone, Debug, Default)]
pub(super) struct Faulty {
    /// Number of latest successive steps in which the sensor delivered nothing, or the same tracks again.
    failed_steps: u32,
    /// The tracks that a frozen sensor repeats.
    held: Option<Vec<Track>>,
    /// The id of the track without a vehicle.
    ghost_id: Option<TrackId>,
}

impl Faulty {
    /// Counts one step with this fault. `in_view` are the numbers of vehicles in view, and of those whose measurement arrives.
    ///
    /// A sensor that loses the measurement of every vehicle in view delivers nothing, whether it is dead or not.
    pub(super) fn observe(&mut self, fault: &ObjectFault, [in_view, measured]: [usize; 2]) {
        let is_silent = fault.dropout > 0.0 && in_view > 0 && measured == 0;
        let has_failed = fault.is_dead || fault.is_frozen || is_silent;
        self.failed_steps = if has_failed { self.failed_steps.saturating_add(1) } else { 0 };
    }

    /// Returns whether a monitor has noticed the fault. The monitor finds that nothing arrives, or that the noise of successive
    /// measurements is the same.
    pub(super) fn is_noticed(&self) -> bool {
        self.failed_steps >= NOTICED_AFTER_SCANS
    }

    /// Replaces the tracks from `before` on by those of the step in which the sensor froze, with the present time.
    pub(super) fn hold(&mut self, is_frozen: bool, before: usize, time: Time, list: &mut TrackList) {
        if !is_frozen {
            self.held = None;
            return;
        }
        let held = self.held.get_or_insert_with(|| list.tracks[before..].to_vec());
        list.tracks.truncate(before);
        list.tracks.extend(held.iter().map(|track| Track { time, ..track.clone() }));
    }

    /// Returns the track without a vehicle, whose fault began `since_s` ago; `None` once it would have reached the ego.
    pub(super) fn ghost(
        &mut self,
        [gap_m, closing_mps]: [f64; 2],
        since_s: f64,
        is_ahead: bool,
        (source, input): (Source, &ScanInput<'_>),
        list: &mut TrackList,
    ) -> Option<Track> {
        let gap_m = gap_m - closing_mps * since_s;
        if !(gap_m >= 0.0) {
            return None;
        }
        let ego = &input.scene.ego;
        let [length_m, width_m] = GHOST_SIZE_M;
        let sign = if is_ahead { 1.0 } else { -1.0 };
        let x_m = sign * (gap_m + 0.5 * (length_m + ego.vehicle.dimensions.length_m));
        let [position, speed] = GHOST_SD.map(|sd| sd * sd);
        let rest = (1.0 - GHOST_CONFIDENCE) / 3.0;
        let mut scores = [rest; 4];
        scores[VehicleClass::Car as usize] = GHOST_CONFIDENCE;
        let id = *self.ghost_id.get_or_insert_with(|| list.new_id());
        Some(Track {
            id,
            source,
            status: TrackStatus::Confirmed,
            time: input.scene.time,
            state: Vector4::new(x_m, 0.0, ego.state.speed_mps - sign * closing_mps, 0.0),
            covariance: Matrix4::from_diagonal(&Vector4::new(position, position, speed, speed)),
            heading_rad: 0.0,
            length_m,
            width_m,
            class: ClassScores(scores),
            existence: GHOST_CONFIDENCE,
            lane: input.frame.lane_probabilities(ego.state.d_m, GHOST_SD[0]),
        })
    }
}
