//! The chain behind the rear LiDARs on recorded scans: boxes and tracks without a simulated sensor.
//!
//! ```text
//!  recorded scans ─▶ boxes ─▶ queue ─▶ tracker ─▶ tracks of each control step
//!                       ▲                 ▲
//!             place of the ego on the road, from the recording
//! ```
//!
//! It is the chain of mode `full` without its camera: boxes are classified by their shape alone.
//! The same scans at the same places give the same bits as in the run that has recorded them.

use closecall_traffic::ego_frame::EgoFrame;
use closecall_traffic::{ActorId, Road, Time, Track, VehicleState};

use crate::lidar::{Lidar, PointError, PointFrame, RecordedPoints, ScanMotion};
use crate::lidar_chain::LidarChain;
use crate::object::NoiseKey;
use crate::tracking::TrackList;
use crate::{SensorError, Sensors};

/// A recorded scan that cannot be processed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RecordedScanError {
    /// A point cannot be used.
    #[error(transparent)]
    Point(#[from] PointError),
    /// The processing fails.
    #[error(transparent)]
    Sensor(#[from] SensorError),
}

/// The rear LiDARs of a scenario, whose scans come from a recording.
pub struct RecordedPerception {
    chain: LidarChain,
    lidars: Vec<Lidar>,
    frame: PointFrame,
    ego_length_m: f64,
    list: TrackList,
}

impl RecordedPerception {
    /// Creates the chain of the rear LiDARs before its first step. The points are in `frame`, on an
    /// ego of this length (m).
    pub fn new(sensors: &Sensors, frame: PointFrame, ego_length_m: f64) -> Self {
        let model = sensors.full_model();
        let lidars: Vec<Lidar> = model.rear_lidars().collect();
        #[expect(clippy::unwrap_used, reason = "a legal name")]
        let ego = ActorId::new("ego").unwrap();
        // Nothing is drawn: neither scans nor faults are simulated.
        let key = NoiseKey { seed: 0, sample: 0, ego, actors: [].into() };
        let chain = LidarChain::new(lidars.iter().copied(), model.tracker, &key, ["recorded", "recorded-fault"]);
        Self { chain, lidars, frame, ego_length_m, list: TrackList::default() }
    }

    /// Returns the time from a scan to the next of the slowest LiDAR (s).
    pub fn longest_period_s(&self) -> f64 {
        self.lidars.iter().map(|lidar| lidar.kind.period_s()).fold(0.0, f64::max)
    }

    /// Detects boxes in a scan of the LiDAR with this number, which ended where the ego was at
    /// `place`. Returns the number of points outside of the field of view, which are left out.
    ///
    /// # Errors
    /// [`RecordedScanError`] if a point cannot be used.
    pub fn take(
        &mut self,
        sensor: usize,
        points: RecordedPoints,
        road: &Road,
        ego: VehicleState,
    ) -> Result<usize, RecordedScanError> {
        let motion = ScanMotion { speed_mps: ego.speed_mps, yaw_rate_radps: ego.yaw_rate_radps };
        let (scan, outside) = points.into_scan(&self.lidars[sensor], self.frame, self.ego_length_m, motion)?;
        self.chain.take_recorded(sensor, &scan, (road, ego))?;
        Ok(outside)
    }

    /// Goes on by a control step to `time`, at which the ego is at `place`, and returns the tracks.
    /// The scans up to this time have been taken.
    pub fn step(&mut self, time: Time, (road, ego): (&Road, VehicleState)) -> &[Track] {
        self.list.tracks.clear();
        self.chain.update_tracker(-0.5 * self.ego_length_m, &mut self.list);
        self.chain.report(time, &EgoFrame::new(road, &ego), &mut self.list);
        &self.list.tracks
    }
}
