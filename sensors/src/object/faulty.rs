//! The effects of faults on the measurements and the tracks of an object-level sensor, and the
//! faults that its monitor notices.

use closecall_traffic::{
    CONTROL_STEP, ClassScores, Source, StandardNormal, Stream, Time, Track, TrackId, TrackStatus, VehicleClass, maths,
};
use nalgebra::{Matrix4, Vector4};
use rand::RngExt;

use crate::tracking::TrackList;

use super::arrivals::Arrivals;
use super::noise::{MeasurementErrors, NoiseKey};
use super::sector::Blocked;
use super::sensor::ScanInput;
use super::visibility::{Direction, NEEDED_SHARE};
use crate::faults::{FaultList, NOTICED_AFTER_SCANS, ObjectFault};
use crate::monitors::{Arrival, TransportMonitor};
use crate::surroundings::OtherVehicle;

/// Length and width of a vehicle that does not exist (m): a usual car.
const GHOST_SIZE_M: [f64; 2] = [4.6, 1.8];
/// Standard deviations of its position (m) and speed (m/s), as of a settled track.
const GHOST_SD: [f64; 2] = [0.15, 0.3];
/// Score of its class, car.
const GHOST_CONFIDENCE: f64 = 0.97;

/// The random numbers of the faults for one vehicle.
#[derive(Clone, Debug)]
pub(super) struct FaultStreams {
    /// Decides which measurements are lost.
    losses: Stream,
    /// The additional noise.
    noise: Stream,
}

impl FaultStreams {
    /// Creates the streams for the vehicle with the index `actor`.
    pub(super) fn new(key: &NoiseKey, channel: &str, actor: usize) -> Self {
        let [losses, noise] =
            ["fault", "fault-noise"].map(|purpose| key.stream_about(&format!("{channel}-{purpose}"), actor));
        Self { losses, noise }
    }
}

/// The faults of a sensor, with its memory of them.
#[derive(Clone, Debug, Default)]
pub(super) struct Faulty {
    faults: FaultList<ObjectFault>,
    /// What holds in this step.
    fault: ObjectFault,
    /// Decides which scans are lost and late; `None` without faults.
    rng: Option<Stream>,
    is_frame_lost: bool,
    arrivals: Arrivals,
    /// Age of the newest scan that has arrived (steps).
    age_steps: usize,
    blocked: Blocked,
    transport: TransportMonitor,
    /// Number of latest successive steps in which the sensor delivered nothing, or the same tracks
    /// again.
    failed_steps: u32,
    /// The tracks that a frozen sensor repeats.
    held: Option<Vec<Track>>,
    /// The id of the track without a vehicle.
    ghost_id: Option<TrackId>,
}

impl Faulty {
    /// Creates the memory of a sensor with these faults, whose scans are lost and late by random
    /// numbers of `rng`.
    pub(super) fn new(faults: FaultList<ObjectFault>, rng: Stream) -> Self {
        let rng = (!faults.is_empty()).then_some(rng);
        Self { faults, rng, ..Self::default() }
    }

    /// Returns whether the sensor has faults at some time.
    pub(super) fn has_faults(&self) -> bool {
        self.rng.is_some()
    }

    /// Begins a step of a sensor that looks in this direction and has a latency of `latency_steps`
    /// without faults.
    pub(super) fn begin(&mut self, time: Time, step: usize, (direction, latency_steps): (Direction, usize)) {
        let Some(rng) = &mut self.rng else { return };
        let [lost, late]: [f64; 2] = rng.random();
        self.fault = self.faults.at(time).unwrap_or_default();
        self.is_frame_lost = lost < self.fault.lost_frames;
        let more_s = self.fault.delay_s + late * self.fault.jitter_s;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "checked to be at most some seconds"
        )]
        let more_steps = (more_s / CONTROL_STEP.s()).round() as usize;
        self.age_steps = self.arrivals.observe(step, latency_steps + more_steps);
        self.blocked.set(&self.fault.blocked_deg, direction);
        if self.age_steps <= step {
            // The scan of this age arrives in this step.
            let late_s = (self.age_steps as f64 - latency_steps as f64) * CONTROL_STEP.s();
            let lateness_s = late_s - self.fault.clock_offset_s;
            let is_lost = self.is_frame_lost || self.fault.is_dead;
            self.transport.observe(Arrival { is_lost, lateness_s });
        }
    }

    /// Returns the monitor of the arrivals of the scans.
    pub(super) fn transport(&self) -> &TransportMonitor {
        &self.transport
    }

    /// Returns the share of the range that is left.
    pub(super) fn range_share(&self) -> f64 {
        self.fault.range_share
    }

    /// Returns the slopes in which the sensor sees nothing.
    pub(super) fn blocked_slopes(&self) -> &[[f64; 2]] {
        self.blocked.slopes()
    }

    /// Returns whether a blocked azimuth hides the vehicle from a sensor that looks around.
    pub(super) fn hides(&mut self, other: &OtherVehicle) -> bool {
        self.blocked.hidden_share(other) > 1.0 - NEEDED_SHARE
    }

    /// Returns the age of the newest scan that has arrived (steps).
    pub(super) fn age_steps(&self) -> usize {
        self.age_steps
    }

    /// Returns whether the scan of this step does not arrive.
    pub(super) fn is_frame_lost(&self) -> bool {
        self.is_frame_lost
    }

    /// Returns the errors of a measurement plus the errors that the faults add.
    pub(super) fn spoil(&self, errors: MeasurementErrors, streams: Option<&mut FaultStreams>) -> MeasurementErrors {
        let Some(FaultStreams { losses, noise }) = streams else { return errors };
        // Drawn in any case: whether the sensor itself loses the scan depends on the distance,
        // which differs between two arms.
        let drawn: f64 = losses.random();
        let is_lost = errors.is_lost || drawn < self.fault.dropout;
        let [along, across, speed]: [f64; 3] = std::array::from_fn(|_| noise.sample(StandardNormal));
        let [along_m, across_m] = errors.position_m;
        let [along_sd_m, across_sd_m] = self.fault.noise_m;
        MeasurementErrors {
            position_m: [along_m + along_sd_m * along, across_m + across_sd_m * across],
            speed_mps: errors.speed_mps + self.fault.speed_noise_mps * speed,
            is_lost,
            ..errors
        }
    }

    /// Returns by how much a wrong mounting and a wrong clock move a vehicle along and across the
    /// road (m).
    ///
    /// A sensor at `mount_m` ahead of the ego's middle that is turned to the left sees everything
    /// turned to the right. A scan that is dated too late counts as measured from where the ego is
    /// then, and the vehicle as having been there by then.
    pub(super) fn shift_m(&self, other: &OtherVehicle, mount_m: f64, input: &ScanInput<'_>) -> [f64; 2] {
        let [mut along_m, mut across_m] = [0.0; 2];
        if self.fault.yaw_rad != 0.0 {
            let (sin, cos) = maths::sin_cos(self.fault.yaw_rad);
            let ahead_m = other.x_m - mount_m;
            let turned = (mount_m + ahead_m * cos + other.y_m * sin, other.y_m * cos - ahead_m * sin);
            let (s_m, d_m) = input.frame.road_position_m(other.x_m, other.y_m);
            let (turned_s_m, turned_d_m) = input.frame.road_position_m(turned.0, turned.1);
            (along_m, across_m) = (turned_s_m - s_m, turned_d_m - d_m);
        }
        let offset_s = self.fault.clock_offset_s;
        if offset_s != 0.0 {
            let ego_state = &input.scene.ego.state;
            let (sin, cos) = maths::sin_cos(ego_state.heading_rad);
            let own_mps = [
                ego_state.speed_mps * cos / input.frame.path_scale(ego_state.s_m, ego_state.d_m),
                ego_state.speed_mps * sin,
            ];
            along_m += (own_mps[0] - other.road_mps[0]) * offset_s;
            across_m += (own_mps[1] - other.road_mps[1]) * offset_s;
        }
        [along_m, across_m]
    }

    /// Counts one step. `in_view` are the numbers of vehicles in view, and of those whose
    /// measurement arrives.
    ///
    /// A sensor whose scan does not arrive, or that loses the measurement of every vehicle in view,
    /// delivers nothing, whether it is dead or not.
    pub(super) fn observe(&mut self, [in_view, measured]: [usize; 2]) {
        let fault = &self.fault;
        let is_silent = fault.dropout > 0.0 && in_view > 0 && measured == 0;
        let has_failed = fault.is_dead || fault.is_frozen || is_silent || self.is_frame_lost;
        self.failed_steps = if has_failed { self.failed_steps.saturating_add(1) } else { 0 };
    }

    /// Returns whether the sensor delivers nothing.
    pub(super) fn is_dead(&self) -> bool {
        self.fault.is_dead
    }

    /// Returns whether a monitor has noticed the fault. The monitor finds that nothing arrives, or
    /// that the noise of successive measurements is the same.
    pub(super) fn is_noticed(&self) -> bool {
        self.failed_steps >= NOTICED_AFTER_SCANS
    }

    /// Replaces the tracks from `before` on by the tracks of the step in which the sensor froze,
    /// with the present time.
    pub(super) fn hold(&mut self, before: usize, time: Time, list: &mut TrackList) {
        if !self.fault.is_frozen {
            self.held = None;
            return;
        }
        let held = self.held.get_or_insert_with(|| list.tracks[before..].to_vec());
        list.tracks.truncate(before);
        list.tracks.extend(held.iter().map(|track| Track { time, ..track.clone() }));
    }

    /// Returns the track without a vehicle, if there is one; `None` once it would have reached the
    /// ego.
    pub(super) fn ghost(
        &mut self,
        is_ahead: bool,
        source: Source,
        input: &ScanInput<'_>,
        list: &mut TrackList,
    ) -> Option<Track> {
        let [gap_m, closing_mps] = self.fault.ghost?;
        let since_s = self.faults.since_s(input.scene.time, |fault| fault.ghost.is_some()).unwrap_or(0.0);
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
            lane: input.frame.lane_probabilities(ego.state.s_m, ego.state.d_m, GHOST_SD[0]),
        })
    }
}
