//! The tracker: it updates all tracks with one scan after the other.

use closecall_traffic::{Road, Source, Time, Track, TrackId, VehicleState, maths};

use super::TrackList;
use super::assignment::{Assignment, RESERVED};
use super::association::assign;
use super::axis::AxisEstimate;
use super::classes::{FusedClass, vehicle_log_likelihood_ratio};
use super::config::TrackerModel;
use super::extent::TrackExtent;
use super::lifecycle::Lifecycle;
use super::measurement::measurement;
use super::motion::EgoRear;
use super::road_filter::{Measurement, RoadFilter, in_ego_frame};
use super::view::{Face, RearView};
use crate::tracking::{Detection, SIDE_PROTRUSION_M, SeenBy};
use closecall_traffic::ego_frame::EgoFrame;

/// Speed difference below which a track inside another track's box is a part of the same vehicle (m/s).
const MAX_PART_SPEED_MPS: f64 = 3.0;
/// Least width assumed for a box that may contain parts (m).
///
/// A car that shows one lamp is as wide as a car, and two vehicles never drive side by side in the middle of a
/// lane.
const MIN_WHOLE_WIDTH_M: f64 = 1.9;
/// Maximum distance by which a part stands out ahead of a vehicle's face (m).
const FRONT_MARGIN_M: f64 = 1.0;

/// The detections of one scan, all in the ego's frame at `time`.
#[derive(Clone, Copy, Debug)]
pub struct TrackerScan<'a> {
    /// Number of the sensor. A track follows the sensor that found it, and others as long as they agree.
    pub sensor: usize,
    /// Reference time of the scan. [`Detection::time`] is the time at which a box's position holds.
    pub time: Time,
    /// The road from the map.
    pub road: &'a Road,
    /// State of the ego at `time`, from its odometry and its position in the lane.
    pub ego: VehicleState,
    /// Field of view and mounting of the sensor.
    pub view: RearView,
    /// Position of the ego's rear end ahead of its origin (m); negative.
    pub rear_x_m: f64,
    /// The detections.
    pub detections: &'a [Detection],
}

/// The state of one track.
#[derive(Clone, Copy, Debug)]
struct TrackState {
    id: TrackId,
    filter: RoadFilter,
    lifecycle: Lifecycle,
    class: FusedClass,
    extent: TrackExtent,
    /// What the scans of the present update show of it.
    seen: Seen,
}

/// What the scans of one time show of a track, from the least to the most.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
enum Seen {
    /// No sensor could see it.
    #[default]
    OutOfView,
    /// Only sensors that have no scan of this time could see it.
    NotScanned,
    /// A sensor could see it, and none did.
    Missed,
    /// Only a sensor that confirms nothing detected it.
    Kept,
    /// A sensor that confirms detected it.
    Hit,
}

impl TrackState {
    /// Returns length and width (m).
    fn size_m(&self) -> (f64, f64) {
        self.extent.size_m(&self.class.scores())
    }

    /// Returns whether `other` is a part of this vehicle.
    fn has_part(&self, other: &Self) -> bool {
        let ([along, across], [part_along, part_across]) = (self.filter.estimate(), other.filter.estimate());
        let apart_mps = maths::hypot(along.speed_mps - part_along.speed_mps, across.speed_mps - part_across.speed_mps);
        self.contains(part_along.position_m, part_across.position_m) && apart_mps < MAX_PART_SPEED_MPS
    }

    /// Returns whether a face at (`s_m`, `d_m`) lies within this track's box.
    fn contains(&self, s_m: f64, d_m: f64) -> bool {
        let (length_m, width_m) = self.size_m();
        let [along, across] = self.filter.estimate();
        let is_along = (-length_m..=FRONT_MARGIN_M).contains(&(s_m - along.position_m));
        let half_width_m = 0.5 * width_m.max(MIN_WHOLE_WIDTH_M) + SIDE_PROTRUSION_M;
        is_along && (d_m - across.position_m).abs() <= half_width_m
    }
}

/// Multi-object tracker for the boxes of the rear LiDAR.
#[derive(Clone, Debug)]
pub struct Tracker {
    model: TrackerModel,
    /// Time of the tracks: that of the latest scan, and the earliest possible one before the first scan.
    time: Time,
    tracks: Vec<TrackState>,
    measurements: Vec<Measurement>,
    assignment: Assignment,
    assigned: Vec<Option<usize>>,
    faces: Vec<Option<Face>>,
}

impl Tracker {
    /// Creates a tracker without tracks.
    pub fn new(model: TrackerModel) -> Self {
        Self {
            model,
            time: Time::from_ns(i64::MIN),
            tracks: Vec::with_capacity(RESERVED),
            measurements: Vec::with_capacity(RESERVED),
            assignment: Assignment::new(),
            assigned: Vec::with_capacity(RESERVED),
            faces: Vec::with_capacity(RESERVED),
        }
    }

    /// Updates all tracks with one scan. `list` issues the ids of new tracks.
    ///
    /// A scan that is dated before the previous one, as an error of the clock causes it, counts as measured at the time of the
    /// previous one: no filter is predicted backwards. Its measurements keep their own times, which lie before that of the filters.
    pub fn update(&mut self, scan: &TrackerScan<'_>, list: &mut TrackList) {
        self.update_together([*scan], [], list);
    }

    /// Updates all tracks with the scans of several sensors that have the same time, one after the other. `idle` has the views of
    /// the sensors without a scan of this time.
    ///
    /// The scans count as one for the lifecycle of a track: it is hit if one of the sensors detects it, and missed if one of them
    /// could see it and none does. A track that only idle sensors could see keeps its state.
    pub fn update_together<'a>(
        &mut self,
        scans: impl IntoIterator<Item = TrackerScan<'a>>,
        idle: impl IntoIterator<Item = RearView>,
        list: &mut TrackList,
    ) {
        self.tracks.iter_mut().for_each(|track| track.seen = Seen::OutOfView);
        let mut latest = None;
        for scan in scans {
            self.measure(&scan, list);
            latest = Some(scan);
        }
        if let Some(latest) = latest {
            for view in idle {
                let frame = EgoFrame::new(latest.road, &latest.ego);
                self.project_faces(&view, &frame);
                for (track, face) in self.tracks.iter_mut().zip(&self.faces) {
                    track.seen = if face.is_some() { track.seen.max(Seen::NotScanned) } else { track.seen };
                }
            }
        }
        for track in &mut self.tracks {
            match track.seen {
                Seen::OutOfView => track.lifecycle.skip(),
                Seen::Missed => track.lifecycle.miss(&self.model.rules),
                Seen::NotScanned | Seen::Kept | Seen::Hit => {}
            }
        }
        self.delete_tracks();
    }

    /// Predicts all tracks to the time of a scan, and corrects or starts those that it detects.
    fn measure(&mut self, scan: &TrackerScan<'_>, list: &mut TrackList) {
        // The time before the start of a run is negative. Before the first scan, there is nothing to predict.
        let elapsed_s =
            if scan.time > self.time && !self.tracks.is_empty() { (scan.time - self.time).s() } else { 0.0 };
        self.time = scan.time.max(self.time);
        let frame = EgoFrame::new(scan.road, &scan.ego);
        let ego_mps = scan.ego.speed_mps * maths::cos(scan.ego.heading_rad) / frame.path_scale(scan.ego.d_m);
        let ego = EgoRear {
            s_m: scan.ego.s_m + scan.rear_x_m,
            d_m: scan.ego.d_m,
            speed_mps: ego_mps,
            half_lane_m: 0.5 * scan.road.lane_width_m(),
        };
        if elapsed_s > 0.0 {
            for track in &mut self.tracks {
                track.filter.predict(elapsed_s, &ego);
            }
        }
        self.measurements.clear();
        let measured = scan.detections.iter().map(|detection| measurement(detection, &frame, self.time));
        self.measurements.extend(measured);
        let tracks = self.tracks.iter().map(|track| (&track.filter, 0.5 * track.size_m().0));
        assign(tracks, &self.measurements, &mut self.assignment, &mut self.assigned);
        self.project_faces(&scan.view, &frame);
        for track_index in 0..self.tracks.len() {
            match self.assigned[track_index] {
                Some(detection_index) => self.correct(track_index, detection_index, scan),
                None => self.miss(track_index),
            }
        }
        self.start_tracks(scan, ego_mps, list);
    }

    /// Appends every track to `list`, predicted to `time` and in the ego's frame `frame` at that time.
    pub fn report(&self, time: Time, frame: &EgoFrame<'_>, list: &mut TrackList) {
        for track in &self.tracks {
            let ahead_s = (time - self.time).s();
            list.tracks.push(to_track(track, track.filter.predicted(ahead_s), frame, time));
        }
    }

    /// Corrects a track with its detection.
    fn correct(&mut self, track_index: usize, detection_index: usize, scan: &TrackerScan<'_>) {
        let detection = &scan.detections[detection_index];
        let track = &mut self.tracks[track_index];
        track.filter.correct(
            &self.measurements[detection_index],
            0.5 * track.size_m().0,
            followed_sensor(detection, scan),
        );
        track.extent.update(detection);
        track.class.update(&detection.class, detection.points);
        let [along, _] = track.filter.estimate();
        let is_settled = along.speed_variance_m2ps2.sqrt() <= self.model.settled_speed_sd_mps;
        let rules = &self.model.rules;
        match (detection.seen_by, track.seen) {
            (_, Seen::Hit) | (SeenBy::CameraAlone, Seen::Kept) => {}
            (SeenBy::CameraAlone, _) => track.lifecycle.keep(rules),
            (SeenBy::Lidar, Seen::Kept) => track.lifecycle.count_kept_as_hit(rules, is_settled),
            (SeenBy::Lidar, _) => track.lifecycle.hit(rules, is_settled),
        }
        track.seen = track.seen.max(seen_in(detection));
        track.lifecycle.add_evidence(vehicle_log_likelihood_ratio(&detection.class, detection.points));
    }

    /// Notes whether a scan could have detected a track that it did not detect.
    fn miss(&mut self, track_index: usize) {
        let could_be_seen = self.faces[track_index].is_some_and(|face| !face.is_hidden(&self.faces));
        let track = &mut self.tracks[track_index];
        track.seen = if could_be_seen { track.seen.max(Seen::Missed) } else { track.seen };
    }

    /// Computes each track's face as the sensor sees it.
    fn project_faces(&mut self, view: &RearView, frame: &EgoFrame<'_>) {
        self.faces.clear();
        self.faces.extend(self.tracks.iter().map(|track| {
            let [along, across] = track.filter.estimate();
            let seen = frame.point(along.position_m, across.position_m);
            view.face(seen.x_m, seen.y_m, track.size_m().1)
        }));
    }

    /// Starts a track for each detection that is assigned to no track and does not lie within a track's box.
    fn start_tracks(&mut self, scan: &TrackerScan<'_>, ego_mps: f64, list: &mut TrackList) {
        for (detection_index, detection) in scan.detections.iter().enumerate() {
            let measurement = &self.measurements[detection_index];
            let (s_m, d_m) = (measurement.along.position_m, measurement.across.position_m);
            let is_taken = self.assigned.contains(&Some(detection_index))
                || self.tracks.iter().any(|track| track.contains(s_m, d_m));
            if is_taken || !measurement.is_finite() {
                continue;
            }
            let mut track = TrackState {
                id: list.new_id(),
                filter: RoadFilter::new(measurement, ego_mps, followed_sensor(detection, scan)),
                lifecycle: match detection.seen_by {
                    SeenBy::Lidar => Lifecycle::first_hit(&self.model.rules),
                    SeenBy::CameraAlone => Lifecycle::first_kept(&self.model.rules),
                },
                class: FusedClass::unknown(),
                extent: TrackExtent::default(),
                seen: seen_in(detection),
            };
            track.extent.update(detection);
            track.class.update(&detection.class, detection.points);
            self.tracks.push(track);
        }
    }

    /// Deletes tracks that have ended, and tracks that are parts of other tracks.
    ///
    /// The face nearest to the ego is the vehicle's. Of two tracks that are parts of each other, the later one is
    /// deleted.
    fn delete_tracks(&mut self) {
        let rules = self.model.rules;
        self.tracks.retain(|track| !track.lifecycle.should_delete(&rules));
        let mut track_index = 0;
        while track_index < self.tracks.len() {
            let track = &self.tracks[track_index];
            let is_part = self.tracks.iter().enumerate().any(|(other, whole)| {
                let is_whole = whole.has_part(track) && (other < track_index || !track.has_part(whole));
                other != track_index && is_whole
            });
            if is_part {
                self.tracks.remove(track_index);
            } else {
                track_index += 1;
            }
        }
    }
}

/// Returns the sensor that a track may follow for this detection: none if only the camera sees it, which comes with the scan of any LiDAR.
fn followed_sensor(detection: &Detection, scan: &TrackerScan<'_>) -> Option<usize> {
    (detection.seen_by == SeenBy::Lidar).then_some(scan.sensor)
}

/// Returns what a scan shows of a track that this detection belongs to.
fn seen_in(detection: &Detection) -> Seen {
    match detection.seen_by {
        SeenBy::Lidar => Seen::Hit,
        SeenBy::CameraAlone => Seen::Kept,
    }
}

/// Transforms a track to the ego's frame.
///
/// The estimate along the road is that of the face that the ego sees, which is a front. The centre lies half a length
/// behind it. The reported covariance along the road is that of the face, because the face defines the gap.
fn to_track(track: &TrackState, [along, across]: [AxisEstimate; 2], frame: &EgoFrame<'_>, time: Time) -> Track {
    let (length_m, width_m) = track.size_m();
    let half_length_m = 0.5 * length_m / frame.path_scale(across.position_m);
    let centre = AxisEstimate { position_m: along.position_m - half_length_m, ..along };
    let estimate = in_ego_frame(&[centre, across], frame);
    Track {
        id: track.id,
        source: Source::Rear,
        status: track.lifecycle.status(),
        time,
        state: estimate.state,
        covariance: estimate.covariance,
        heading_rad: estimate.heading_rad,
        length_m,
        width_m,
        class: track.class.scores(),
        existence: track.lifecycle.existence(),
        lane: frame.lane_probabilities(across.position_m, across.position_variance_m2.sqrt()),
    }
}
