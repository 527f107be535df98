//! The tracker itself: one scan in, all tracks out.

use closecall_traffic::{Road, Source, Time, Track, TrackId, VehicleState};

use super::TrackList;
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
use crate::Detection;
use crate::ego_frame::EgoFrame;

/// Two tracks, one within the other's box, are one vehicle that fell apart if their speeds differ by less than this
/// [m/s].
const PART_SPEED_MPS: f64 = 3.0;
/// A box is taken to be at least this wide when asking whether another is a part of it [m]: a car that is known by one
/// lamp is as wide as a car, and no two vehicles share a lane's middle side by side.
const LEAST_PART_WIDTH_M: f64 = 1.9;
/// How far parts of a vehicle may stand out from its side [m]: mirrors, wheels.
const PROUD_SIDE_M: f64 = 0.25;
/// How far a part of a vehicle may stand before its face [m].
const PART_BEFORE_FACE_M: f64 = 1.0;

/// One scan's detections, all in E's frame at `time`.
#[derive(Clone, Copy, Debug)]
pub struct TrackerScan<'a> {
    /// The scan's reference time. A detection's own time says when its target was there.
    pub time: Time,
    /// The road, as the map has it.
    pub road: &'a Road,
    /// E at `time`, by its odometry and its place in the lane.
    pub ego: VehicleState,
    /// What the sensor can see.
    pub view: RearView,
    /// The boxes.
    pub detections: &'a [Detection],
}

#[derive(Clone, Copy, Debug)]
struct Tracked {
    id: TrackId,
    filter: RoadFilter,
    lifecycle: Lifecycle,
    class: FusedClass,
    extent: TrackExtent,
}

impl Tracked {
    /// Length and width [m].
    fn size_m(&self) -> (f64, f64) {
        self.extent.size_m(&self.class.scores())
    }

    /// True where `other` is a part of this vehicle.
    fn has_part(&self, other: &Self) -> bool {
        let ([along, across], [part_along, part_across]) = (self.filter.now(), other.filter.now());
        let apart_mps = (along.speed_mps - part_along.speed_mps).hypot(across.speed_mps - part_across.speed_mps);
        self.holds(part_along.position_m, part_across.position_m) && apart_mps < PART_SPEED_MPS
    }

    /// True where a face at (`s_m`, `d_m`) lies within this track's box.
    fn holds(&self, s_m: f64, d_m: f64) -> bool {
        let (length_m, width_m) = self.size_m();
        let [along, across] = self.filter.now();
        let is_along = (-length_m..=PART_BEFORE_FACE_M).contains(&(s_m - along.position_m));
        let half_m = 0.5 * width_m.max(LEAST_PART_WIDTH_M) + PROUD_SIDE_M;
        is_along && (d_m - across.position_m).abs() <= half_m
    }
}

/// Multi-object tracker for the boxes of the rear LiDAR.
#[derive(Clone, Debug)]
pub struct Tracker {
    model: TrackerModel,
    time: Time,
    tracks: Vec<Tracked>,
    measurements: Vec<Measurement>,
    assigned: Vec<Option<usize>>,
    faces: Vec<Option<Face>>,
}

impl Tracker {
    /// A tracker that has seen nothing.
    pub fn new(model: TrackerModel) -> Self {
        Self {
            model,
            time: Time::ZERO,
            tracks: Vec::new(),
            measurements: Vec::new(),
            assigned: Vec::new(),
            faces: Vec::new(),
        }
    }

    /// Takes in one scan, which is not older than the one before; new tracks take their numbers from `list`.
    pub fn update(&mut self, scan: &TrackerScan<'_>, list: &mut TrackList) {
        let elapsed_s = (scan.time - self.time).s();
        self.time = scan.time;
        let frame = EgoFrame::new(scan.road, &scan.ego);
        let ego_mps = scan.ego.speed_mps * scan.ego.heading_rad.cos() / frame.path_scale(scan.ego.d_m);
        let ego = EgoRear {
            s_m: scan.ego.s_m + scan.view.sensor_x_m,
            d_m: scan.ego.d_m,
            speed_mps: ego_mps,
            half_lane_m: 0.5 * scan.road.lane_width_m(),
        };
        for track in &mut self.tracks {
            track.filter.predict(elapsed_s, &ego);
        }
        self.measurements.clear();
        let measured = scan.detections.iter().map(|detection| measurement(detection, &frame, scan.time));
        self.measurements.extend(measured);
        let tracks = self.tracks.iter().map(|track| (&track.filter, 0.5 * track.size_m().0));
        assign(tracks, &self.measurements, &mut self.assigned);
        self.look_for_hidden(scan, &frame);
        for place in 0..self.tracks.len() {
            match self.assigned[place] {
                Some(index) => self.correct(place, index, &scan.detections[index]),
                None => self.miss(place),
            }
        }
        self.start_new(scan, ego_mps, list);
        self.forget();
    }

    /// Appends every track to `list`, predicted to `time`, when E has the frame `frame`.
    pub(crate) fn report(&self, time: Time, frame: &EgoFrame<'_>, list: &mut TrackList) {
        let ahead_s = (time - self.time).s();
        for track in &self.tracks {
            list.tracks.push(reported(track, track.filter.ahead(ahead_s), frame, time));
        }
    }

    fn correct(&mut self, place: usize, index: usize, detection: &Detection) {
        let track = &mut self.tracks[place];
        track.filter.correct(&self.measurements[index], 0.5 * track.size_m().0);
        track.extent.look(detection);
        track.class.look(&detection.class, detection.points);
        let [along, _] = track.filter.now();
        track.lifecycle.hit(&self.model.rules, along.speed_m2ps2.sqrt() <= self.model.settled_speed_sd_mps);
        track.lifecycle.weigh(vehicle_log_likelihood_ratio(&detection.class, detection.points));
    }

    fn miss(&mut self, place: usize) {
        let could_be_seen = self.faces[place].is_some_and(|face| !face.is_hidden(&self.faces));
        let lifecycle = &mut self.tracks[place].lifecycle;
        if could_be_seen { lifecycle.miss(&self.model.rules) } else { lifecycle.unseen() }
    }

    /// Where the sensor would see each track.
    fn look_for_hidden(&mut self, scan: &TrackerScan<'_>, frame: &EgoFrame<'_>) {
        self.faces.clear();
        self.faces.extend(self.tracks.iter().map(|track| {
            let [along, across] = track.filter.now();
            let seen = frame.point(along.position_m, across.position_m);
            scan.view.face(seen.x_m, seen.y_m, track.size_m().1)
        }));
    }

    /// A track for each detection that belongs to none and does not lie within one.
    fn start_new(&mut self, scan: &TrackerScan<'_>, ego_mps: f64, list: &mut TrackList) {
        for (index, detection) in scan.detections.iter().enumerate() {
            let measurement = &self.measurements[index];
            let (s_m, d_m) = (measurement.along.position_m, measurement.across.position_m);
            let is_taken =
                self.assigned.contains(&Some(index)) || self.tracks.iter().any(|track| track.holds(s_m, d_m));
            if is_taken || !measurement.is_finite() {
                continue;
            }
            let mut track = Tracked {
                id: list.new_id(),
                filter: RoadFilter::first(measurement, ego_mps),
                lifecycle: Lifecycle::first_hit(&self.model.rules),
                class: FusedClass::unknown(),
                extent: TrackExtent::default(),
            };
            track.extent.look(detection);
            track.class.look(&detection.class, detection.points);
            self.tracks.push(track);
        }
    }

    /// Deletes the dead, and parts of other tracks: the face nearest to E is the vehicle's. Of two that are parts of each
    /// other the younger goes.
    fn forget(&mut self) {
        let rules = self.model.rules;
        self.tracks.retain(|track| !track.lifecycle.is_dead(&rules));
        let mut place = 0;
        while place < self.tracks.len() {
            let track = &self.tracks[place];
            let is_part = self.tracks.iter().enumerate().any(|(other, whole)| {
                let is_whole = whole.has_part(track) && (other < place || !track.has_part(whole));
                other != place && is_whole
            });
            if is_part {
                self.tracks.remove(place);
            } else {
                place += 1;
            }
        }
    }
}

/// The track in E's frame. What is followed along the road is the face that E sees, a front; the centre lies half a
/// length behind it. The covariance along the road is that of the face, which gaps are made of.
fn reported(track: &Tracked, [along, across]: [AxisEstimate; 2], frame: &EgoFrame<'_>, time: Time) -> Track {
    let (length_m, width_m) = track.size_m();
    let back_m = 0.5 * length_m / frame.path_scale(across.position_m);
    let centre = AxisEstimate { position_m: along.position_m - back_m, ..along };
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
        lane: frame.lane_probabilities(across.position_m, across.position_m2.sqrt()),
    }
}
