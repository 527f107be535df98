//! A program with what the chain keeps of it from step to step.

use closecall_traffic::ego_frame::EgoFrame;
use closecall_traffic::{Time, Track, VehicleState};

use super::answered::OutsideTracks;
use super::{
    LidarMount, OutsideCamera, OutsideRadarScan, OutsideScan, PerceptionAnswer, PerceptionProgram, PerceptionQuestion,
    Pose, RadarMount,
};
use crate::lidar::Lidar;
use crate::radar::RearRadar;
use crate::tracking::TrackList;
use crate::{Scene, SensorError};

/// A program with what the chain keeps of it from step to step.
pub(crate) struct Outside {
    program: Box<dyn PerceptionProgram>,
    lidars: Vec<Lidar>,
    mounts: Vec<LidarMount>,
    radar: Option<RearRadar>,
    radar_mounts: Vec<RadarMount>,
    /// The rear cameras, if the program gets images.
    cameras: Vec<OutsideCamera>,
    latency_s: f64,
    /// The ego's state at the first question, which is the frame of all poses.
    first: Option<VehicleState>,
    tracks: OutsideTracks,
}

impl Outside {
    /// Creates the program of a run, whose LiDARs and radars that look back are these, in their
    /// order. `latency_s` is the time from a scan to the tracks that a controller gets of it (s).
    pub(crate) fn new(
        program: Box<dyn PerceptionProgram>,
        (lidars, radar): (Vec<Lidar>, Option<RearRadar>),
        cameras: Vec<OutsideCamera>,
        latency_s: f64,
    ) -> Self {
        Self {
            program,
            lidars,
            mounts: Vec::new(),
            radar,
            radar_mounts: Vec::new(),
            cameras,
            latency_s,
            first: None,
            tracks: OutsideTracks::default(),
        }
    }

    /// Asks the program about scans of the LiDARs and of the radars, and images of the scene.
    /// `believed` is the scene as the ego believes it to be.
    ///
    /// # Errors
    /// [`SensorError::Program`] if there is no valid answer.
    pub(crate) fn ask(
        &mut self,
        [scene, believed]: [&Scene<'_>; 2],
        (scans, radar_scans): (&[OutsideScan], &[OutsideRadarScan]),
    ) -> Result<PerceptionAnswer, SensorError> {
        let pose = self.pose(believed);
        let length_m = believed.ego.vehicle.dimensions.length_m;
        if self.mounts.is_empty() {
            self.mounts.extend(self.lidars.iter().map(|lidar| LidarMount::of(lidar, length_m)));
            self.radar_mounts.extend(self.radar.iter().flat_map(|radar| radar.mounts(length_m)));
        }
        let mut images = self.cameras.iter_mut().map(|camera| camera.image(scene));
        let (image, additional_images) = (images.next().flatten(), images.flatten().collect::<Vec<_>>());
        let mut cameras = self.cameras.iter().map(|camera| camera.mount(length_m));
        let (camera, additional_cameras) = (cameras.next(), cameras.collect::<Vec<_>>());
        self.program.perceive(&PerceptionQuestion {
            time: believed.time,
            scans,
            radar_scans,
            image: image.as_ref(),
            additional_images: &additional_images,
            camera,
            additional_cameras: &additional_cameras,
            lidars: &self.mounts,
            radars: &self.radar_mounts,
            ego: believed.ego.state,
            pose,
            size: believed.ego.vehicle.dimensions,
            road: believed.road,
            latency_s: self.latency_s,
        })
    }

    /// Keeps tracks that the program has answered, whose states hold `offset` after the time of the
    /// question. They are due from `step` on.
    pub(crate) fn keep(&mut self, believed: &Scene<'_>, offset: Time, tracks: Vec<Track>, step: u64) {
        let pose = self.pose(believed);
        self.tracks.push((believed.time + offset, pose), tracks, step);
    }

    /// Appends the tracks that are due in `step` to `list`.
    pub(crate) fn report(&mut self, step: u64, believed: &Scene<'_>, frame: &EgoFrame<'_>, list: &mut TrackList) {
        let pose = self.pose(believed);
        self.tracks.report(step, (believed.time, pose), frame, list);
    }

    /// Ends the program.
    ///
    /// # Errors
    /// [`SensorError::Program`] if it has written more than its answers.
    pub(crate) fn finish(&mut self, time: Time) -> Result<(), SensorError> {
        self.program.finish(time)
    }

    fn pose(&mut self, believed: &Scene<'_>) -> Pose {
        let state = believed.ego.state;
        Pose::of(believed.road, self.first.get_or_insert(state), &state)
    }
}
