//! The tracker itself: one scan in, all tracks out.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use closecall_traffic::{PlanePose, Source, Time, Track, TrackId};
use nalgebra::{Matrix2, Matrix4, Rotation2, Vector2, Vector4};

use super::association::{Measurement, assign};
use super::classes::{FusedClass, vehicle_log_likelihood_ratio};
use super::config::TrackerModel;
use super::extent::TrackExtent;
use super::kalman::{GroundFilter, turned};
use super::lifecycle::Lifecycle;
use super::view::{Face, RearView};
use super::{HEADING_SPEED_MPS, TrackList};
use crate::Detection;
use crate::ego_frame::EgoFrame;

/// Speed of what is seen for the first time: E's own, within this [m/s]. Wide enough for a parked vehicle at 3 σ.
const SPEED_PRIOR_SD_MPS: f64 = 10.0;
/// Speed across the direction of travel of what is seen for the first time [m/s].
const LATERAL_SPEED_PRIOR_SD_MPS: f64 = 0.7;
/// Share by which the heading of a slow track follows that of its latest box [1].
const HEADING_GAIN: f64 = 0.1;
/// Two tracks, one within the other's box, are one vehicle that fell apart if their speeds differ by less than this
/// [m/s].
const PART_SPEED_MPS: f64 = 3.0;
/// A box is taken to be at least this wide when asking whether another is a part of it [m]: a car that is known by one
/// lamp is as wide as a car, and no two vehicles share a lane's middle side by side.
const LEAST_PART_WIDTH_M: f64 = 1.9;
/// How far a part of a vehicle may stand before its face [m].
const PART_BEFORE_FACE_M: f64 = 1.0;
/// Fewer points than this may be one lamp or the plate of a dark car.
const WHOLE_POINTS: usize = 6;
/// Where within ±0.75 m of the car's middle that is, nobody knows: standard deviation of a uniform distribution [m].
const PART_LATERAL_SD_M: f64 = 0.43;

/// A box narrower than this is that of a motorcycle, or of a part [m].
const NARROW_M: f64 = 1.2;
/// A motorcycle has no front face: wheel, fork and rider stand up to 0.9 m behind each other, and the layers meet now one,
/// now the other: standard deviation of a uniform distribution [m].
const NARROW_RANGE_SD_M: f64 = 0.26;
/// What stays unknown however often it is measured: which part of the front is the face that was seen, by class of
/// vehicle [m] (assumption: bumpers and grilles of cars and trucks; a motorcycle as above).
pub(super) const FACE_BIAS_SD_M: [f64; 3] = [0.05, 0.05, 0.26];

/// E's pose and motion, dead-reckoned in any axes that stay fixed to the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct EgoPose {
    /// Position and heading.
    pub(crate) pose: PlanePose,
    /// Speed along the heading [m/s].
    pub(crate) speed_mps: f64,
}

/// One scan's detections, all in E's frame at `time`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TrackerScan<'a> {
    /// The scan's reference time. A detection's own time says when its target was there.
    pub(crate) time: Time,
    /// E at `time`.
    pub(crate) ego: EgoPose,
    /// What the sensor can see.
    pub(crate) view: RearView,
    /// The boxes.
    pub(crate) detections: &'a [Detection],
}

#[derive(Clone, Copy, Debug)]
struct Tracked {
    id: TrackId,
    /// Middle of the face that E sees, in ground axes.
    filter: GroundFilter,
    /// Heading in ground axes [rad].
    yaw_rad: f64,
    lifecycle: Lifecycle,
    class: FusedClass,
    extent: TrackExtent,
}

impl Tracked {
    fn direction(&self) -> Vector2<f64> {
        Vector2::new(self.yaw_rad.cos(), self.yaw_rad.sin())
    }

    /// The direction of motion where it is fast, else the direction of its boxes.
    fn turn(&mut self, box_yaw_rad: f64) {
        let velocity_mps = self.filter.velocity_mps();
        self.yaw_rad = if velocity_mps.norm() > HEADING_SPEED_MPS {
            velocity_mps.y.atan2(velocity_mps.x)
        } else {
            self.yaw_rad + HEADING_GAIN * wrapped(box_yaw_rad - self.yaw_rad)
        };
    }

    /// True where `other` is a part of this vehicle.
    fn has_part(&self, other: &Self) -> bool {
        self.holds(other.filter.position_m())
            && (self.filter.velocity_mps() - other.filter.velocity_mps()).norm() < PART_SPEED_MPS
    }

    /// True where a face at `position_m` lies within this track's box.
    fn holds(&self, position_m: Vector2<f64>) -> bool {
        let (length_m, width_m) = self.extent.size_m(&self.class.scores());
        let direction = self.direction();
        let offset = position_m - self.filter.position_m();
        let (along_m, across_m) = (offset.dot(&direction), offset.perp(&direction));
        let is_along = (-length_m..=PART_BEFORE_FACE_M).contains(&along_m);
        is_along && across_m.abs() <= 0.5 * width_m.max(LEAST_PART_WIDTH_M)
    }
}

/// An angle within ±π [rad].
fn wrapped(angle_rad: f64) -> f64 {
    (angle_rad + PI).rem_euclid(TAU) - PI
}

/// Multi-object tracker for the boxes of the rear LiDAR.
#[derive(Clone, Debug)]
pub(crate) struct Tracker {
    model: TrackerModel,
    time: Time,
    tracks: Vec<Tracked>,
    measurements: Vec<Measurement>,
    assigned: Vec<Option<usize>>,
    faces: Vec<Option<Face>>,
}

impl Tracker {
    /// A tracker that has seen nothing.
    pub(crate) fn new(model: TrackerModel) -> Self {
        Self {
            model,
            time: Time::ZERO,
            tracks: Vec::new(),
            measurements: Vec::new(),
            assigned: Vec::new(),
            faces: Vec::new(),
        }
    }

    /// Takes in one scan; new tracks take their numbers from `list`.
    pub(crate) fn update(&mut self, scan: &TrackerScan<'_>, list: &mut TrackList) {
        let elapsed_s = (scan.time - self.time).s();
        self.time = scan.time;
        for track in &mut self.tracks {
            track.filter.predict(elapsed_s, track.yaw_rad);
        }
        self.measurements.clear();
        self.measurements.extend(scan.detections.iter().map(|detection| measurement(detection, scan)));
        assign(self.tracks.iter().map(|track| &track.filter), &self.measurements, &mut self.assigned);
        self.look_for_hidden(scan);
        for place in 0..self.tracks.len() {
            match self.assigned[place] {
                Some(index) => self.correct(place, index, &scan.detections[index], scan),
                None => self.miss(place),
            }
        }
        self.start_new(scan, list);
        self.forget();
    }

    /// Appends every track to `list`, predicted to `time`, when E is at `ego` and has the frame `frame`.
    pub(crate) fn report(&self, time: Time, ego: &EgoPose, frame: &EgoFrame<'_>, list: &mut TrackList) {
        let ahead_s = (time - self.time).s();
        for track in &self.tracks {
            let mut filter = track.filter;
            filter.predict(ahead_s, track.yaw_rad);
            list.tracks.push(in_ego_frame(track, &filter, ego, frame, time));
        }
    }

    fn correct(&mut self, place: usize, index: usize, detection: &Detection, scan: &TrackerScan<'_>) {
        let (track, measurement) = (&mut self.tracks[place], &self.measurements[index]);
        let position_m = measurement.position_with(&track.filter);
        let Some(innovation) = track.filter.innovation(position_m, &measurement.noise_m2) else {
            return;
        };
        track.filter.correct(&innovation);
        track.turn(scan.ego.pose.yaw_rad + detection.heading_rad);
        track.extent.look(detection);
        track.class.look(&detection.class, detection.points);
        let speed_sd_mps = track.filter.velocity_sd_mps(track.direction());
        track.lifecycle.hit(&self.model.rules, speed_sd_mps <= self.model.settled_speed_sd_mps);
        track.lifecycle.weigh(vehicle_log_likelihood_ratio(&detection.class, detection.points));
    }

    fn miss(&mut self, place: usize) {
        let could_be_seen = self.faces[place].is_some_and(|face| !face.is_hidden(&self.faces));
        let lifecycle = &mut self.tracks[place].lifecycle;
        if could_be_seen { lifecycle.miss(&self.model.rules) } else { lifecycle.unseen() }
    }

    /// Where the sensor would see each track; only those detected in this scan can hide another.
    fn look_for_hidden(&mut self, scan: &TrackerScan<'_>) {
        let turn = Rotation2::new(-scan.ego.pose.yaw_rad);
        let origin_m = Vector2::new(scan.ego.pose.x_m, scan.ego.pose.y_m);
        self.faces.clear();
        self.faces.extend(self.tracks.iter().map(|track| {
            let seen_m = turn * (track.filter.position_m() - origin_m);
            scan.view.face(seen_m.x, seen_m.y, track.extent.size_m(&track.class.scores()).1)
        }));
    }

    /// A track for each detection that belongs to none and does not lie within one.
    fn start_new(&mut self, scan: &TrackerScan<'_>, list: &mut TrackList) {
        for (index, detection) in scan.detections.iter().enumerate() {
            let measurement = &self.measurements[index];
            let is_finite = measurement.position_m.iter().chain(measurement.noise_m2.iter()).all(|x| x.is_finite());
            let is_taken = self.assigned.contains(&Some(index))
                || self.tracks.iter().any(|track| track.holds(measurement.position_m));
            if is_taken || !is_finite {
                continue;
            }
            let yaw_rad = scan.ego.pose.yaw_rad + detection.heading_rad.clamp(-FRAC_PI_2, FRAC_PI_2);
            let velocity_mps = Vector2::new(yaw_rad.cos(), yaw_rad.sin()) * scan.ego.speed_mps;
            let velocity_m2ps2 = turned(SPEED_PRIOR_SD_MPS, LATERAL_SPEED_PRIOR_SD_MPS, yaw_rad);
            let position_m = measurement.position_m + velocity_mps * measurement.age_s;
            let mut track = Tracked {
                id: list.new_id(),
                filter: GroundFilter::first(position_m, measurement.noise_m2, velocity_mps, velocity_m2ps2),
                yaw_rad,
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

/// A detection's face in ground axes, with its noise along and across the line of sight.
fn measurement(detection: &Detection, scan: &TrackerScan<'_>) -> Measurement {
    let pose = &scan.ego.pose;
    let turn = Rotation2::new(pose.yaw_rad);
    let face_m = Vector2::new(detection.face_x_m, detection.face_y_m);
    let part_sd_m = if detection.points < WHOLE_POINTS { PART_LATERAL_SD_M } else { 0.0 };
    let depth_sd_m = if detection.width_m < NARROW_M { NARROW_RANGE_SD_M } else { 0.0 };
    let noise_sd_m = (detection.range_sd_m.hypot(depth_sd_m), detection.lateral_sd_m.hypot(part_sd_m));
    let sight_rad = detection.face_y_m.atan2(detection.face_x_m - scan.view.sensor_x_m);
    Measurement {
        position_m: Vector2::new(pose.x_m, pose.y_m) + turn * face_m,
        noise_m2: turned(noise_sd_m.0, noise_sd_m.1, pose.yaw_rad + sight_rad),
        age_s: (scan.time - detection.time).s(),
    }
}

/// The track in E's frame. The covariance is that of the face that E sees, which gaps are made of; the centre is half a
/// length further.
fn in_ego_frame(track: &Tracked, filter: &GroundFilter, ego: &EgoPose, frame: &EgoFrame<'_>, time: Time) -> Track {
    let turn = Rotation2::new(-ego.pose.yaw_rad);
    let class = track.class.scores();
    let (length_m, width_m) = track.extent.size_m(&class);
    let face_m = turn * (filter.position_m() - Vector2::new(ego.pose.x_m, ego.pose.y_m));
    let heading_rad = wrapped(track.yaw_rad - ego.pose.yaw_rad);
    let away_m = if face_m.x < 0.0 { -0.5 } else { 0.5 } * length_m;
    let centre_m = face_m + Vector2::new(heading_rad.cos(), heading_rad.sin()) * away_m;
    let velocity_mps = turn * filter.velocity_mps();
    let mut both: Matrix4<f64> = Matrix4::zeros();
    let matrix: &Matrix2<f64> = turn.matrix();
    both.fixed_view_mut::<2, 2>(0, 0).copy_from(matrix);
    both.fixed_view_mut::<2, 2>(2, 2).copy_from(matrix);
    let mut covariance = both * filter.covariance * both.transpose();
    let bias_m2 = turned(FACE_BIAS_SD_M[class.best_vehicle_class() as usize], 0.0, heading_rad);
    let mut position_m2 = covariance.fixed_view_mut::<2, 2>(0, 0);
    position_m2 += bias_m2;
    let lateral_m = frame.lateral_position_m(centre_m.x, centre_m.y);
    Track {
        id: track.id,
        source: Source::Rear,
        status: track.lifecycle.status(),
        time,
        state: Vector4::new(centre_m.x, centre_m.y, velocity_mps.x, velocity_mps.y),
        covariance,
        heading_rad,
        length_m,
        width_m,
        class,
        existence: track.lifecycle.existence(),
        lane: frame.lane_probabilities(lateral_m, covariance[(1, 1)].sqrt()),
    }
}
