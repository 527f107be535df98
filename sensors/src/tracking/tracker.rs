//! The tracker: it updates all tracks with each scan in turn.

use closecall_traffic::{ClassScores, Road, Source, Time, Track, TrackId, VehicleClass, VehicleState, maths};

use super::TrackList;
use super::assignment::{Assignment, RESERVED};
use super::association::assign;
use super::axis::{AxisEstimate, AxisMeasurement};
use super::box_use::{BoxRole, BoxUse};
use super::classes::{FusedClass, vehicle_log_likelihood_ratio};
use super::config::TrackerModel;
use super::ends::{Ends, SidePoint};
use super::extent::TrackExtent;
use super::lifecycle::Lifecycle;
use super::measurement::{SURE_SCORE, measurement};
use super::motion::EgoRear;
use super::road_filter::{Measurement, RoadFilter, Span, in_ego_frame};
use super::view::{Face, RearView};
use crate::tracking::{Detection, SIDE_PROTRUSION_M, SeenBy};
use closecall_traffic::ego_frame::EgoFrame;

mod speeds;

/// Speed difference below which a track inside another track's box is a part of the same vehicle
/// (m/s).
const MAX_PART_SPEED_MPS: f64 = 3.0;
/// Least width assumed for a box that may contain parts (m).
///
/// A car that shows one lamp is as wide as a car, and two vehicles never drive side by side in the
/// middle of a lane.
const MIN_WHOLE_WIDTH_M: f64 = 1.9;
/// Maximum distance by which a part protrudes ahead of a vehicle's face (m).
const FRONT_MARGIN_M: f64 = 1.0;

/// Length beyond which a vehicle is no car (m; assumption): vans are up to 6.2 m long.
const LONGEST_CAR_M: f64 = 6.5;
/// Difference of width between a truck and a car (m).
const MAX_WIDER_M: f64 = 0.7;
/// Least distance between the assumed front of a vehicle and a part ahead of it that refutes the
/// assumption (m; assumption).
const FALSE_FRONT_M: f64 = 0.5;
/// Greatest length of a truck (m): European modular system, Council Directive 96/53/EC.
const LONGEST_TRUCK_M: f64 = 25.25;
/// Probability of existence from which on a track behind a truck is another vehicle rather than the
/// truck's tail (assumption).
const LEAST_TAIL_EXISTENCE: f64 = 0.5;
/// Standard deviation of the followed point up to which parts tell the length of a vehicle (m;
/// assumption).
const SPAN_SD_M: f64 = 0.5;
/// Standard deviation of the speed beyond which a track is lost whose front is unknown (m/s;
/// assumption).
const LOST_SPEED_SD_MPS: f64 = 3.0;
/// Greatest width of a box around the wheels on one side of a truck (m; assumption): twin tyres are
/// 0.6 m wide.
const WIDEST_WHEEL_M: f64 = 0.62;
/// Greatest height of a box around wheels and frame (m; assumption): less than a rider.
const HIGHEST_WHEEL_M: f64 = 1.2;
/// Greatest distance of the outer edge of wheels from the truck's side (m; assumption).
const WHEEL_AT_SIDE_M: f64 = 0.12;
/// Greatest distance behind the ego up to which a narrow and high box at a truck's side may be its
/// wheels (m; assumption). Farther away, the columns are so far apart that a rider looks as narrow.
const FARTHEST_WHEEL_M: f64 = 50.0;
/// Greatest width of a motorcycle and its rider (m; assumption). Wider boxes that are no faces are
/// the tail of a truck.
const WIDEST_MOTORCYCLE_M: f64 = 1.0;
/// Least number of points of a rider whose other edge is hidden (assumption): fewer give no track
/// that lasts.
const RIDER_POINTS: usize = 12;
/// Greatest distance between two axles of a truck, between which nothing else may be seen (m;
/// assumption).
const WHEELS_APART_M: f64 = 8.0;
/// Distance up to which parts of a vehicle adjoin (m; assumption): the distance of cab and load,
/// less than the gap between vehicles.
const ADJOINING_M: f64 = 2.0;
/// Spacing of the columns on a part's side below which the part would show a face if it were one
/// (m; assumption): up to 15 m.
const NEAR_SPACING_M: f64 = 0.15;
/// Class scores of a vehicle that is longer (assumption).
const LONG_VEHICLE: ClassScores = ClassScores([0.01, 0.97, 0.01, 0.01]);
/// Number of points from which on a box has the full weight of a scan.
const LONG_VEHICLE_POINTS: usize = 12;
/// Spacing of the columns on a side up to which its rearmost point is a point of the vehicle rather
/// than of the pattern (m; assumption).
const MAX_SPACING_M: f64 = 1.0;
/// Standard deviation of the end of a side within the last step of the columns (columns): 1/√12.
const SIDE_SD_COLUMNS: f64 = 0.3;
/// Standard deviation of a point on a side due to the noise of the ranges (m; assumption).
const SIDE_SD_M: f64 = 0.05;
/// Distance across the road up to which parts are on the same side of a vehicle (m; assumption).
const SAME_SIDE_M: f64 = 0.3;
/// Slow standard deviation of a front or a centre that follows from a side (m; assumption): wheels,
/// guards and panels lie within 0.1 m.
const SIDE_SLOW_SD_M: f64 = 0.1;
/// Error of the front of a wheel as a spacing of columns (m; assumption): it faces the sensor, so
/// that the noise of the ranges alone matters.
const WHEEL_SPACING_M: f64 = 0.1;
/// Slow standard deviation of another end on the side of a vehicle whose wheels are known (m;
/// assumption): it may move over the vehicle.
const OTHER_END_SLOW_SD_M: f64 = 0.5;
/// Difference up to which the nearest part of a vehicle shows its side (m; assumption). A part
/// farther from the ego is on the far side. A part nearer to the ego must be seen in some scans.
const SIDE_GATE_M: f64 = 0.5;
/// Standard deviation of the length of a vehicle whose front has not been in view (m; assumption),
/// by class: trucks are 7 to 19 m long.
const LENGTH_SD_M: [f64; 3] = [0.5, 4.0, 0.2];

/// The detections of one scan, all in the ego's frame at `time`.
#[derive(Clone, Copy, Debug)]
pub struct TrackerScan<'a> {
    /// Number of the sensor. A track follows the sensor that found it, and others as long as they
    /// agree.
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
    ends: Ends,
    /// The evidence of the present update's scans about the track.
    seen: Seen,
}

/// The evidence of the scans of one time about a track, from the weakest to the strongest.
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
        let is_in_box = self.contains(part_along.position_m, part_across.position_m);
        (is_in_box || self.has_tail(other)) && apart_mps < MAX_PART_SPEED_MPS
    }

    /// Returns whether `other` may be the tail of this truck, behind its assumed rear end. It is
    /// within the longest truck, and nothing shows that it is another vehicle.
    fn has_tail(&self, other: &Self) -> bool {
        let ([along, across], [tail_along, tail_across]) = (self.filter.estimate(), other.filter.estimate());
        let behind_m = along.position_m - tail_along.position_m;
        self.ends.has_front
            && self.is_truck()
            && other.lifecycle.existence() < LEAST_TAIL_EXISTENCE
            && (0.0..=LONGEST_TRUCK_M).contains(&behind_m)
            && (tail_across.position_m - across.position_m).abs() <= self.half_width_m()
    }

    /// Returns whether a face at (`s_m`, `d_m`) lies within this track's box.
    fn contains(&self, s_m: f64, d_m: f64) -> bool {
        let [rear_m, front_m] = self.span_m();
        let [_, across] = self.filter.estimate();
        s_m >= rear_m && s_m <= front_m && (d_m - across.position_m).abs() <= self.half_width_m()
    }

    /// Returns whether something seen belongs to this vehicle: it overlaps the track's box along
    /// and across the road.
    fn covers(&self, measurement: &Measurement, ego: &EgoRear) -> bool {
        let [along, across] = self.filter.estimate();
        let seen = &measurement.seen;
        let [rear_m, front_m] = self.span_m();
        let [seen_rear_m, seen_front_m] =
            seen.along_m.map(|s_m| s_m - measurement.along.time_offset_s * along.speed_mps);
        let [right_m, left_m] = seen.across_m.map(|d_m| d_m - across.position_m);
        let rear_m = if self.may_be_tail(seen, [right_m, left_m], ego) { rear_m - self.beyond_m() } else { rear_m };
        // If the front is out of view, the vehicle may be a truck whose frame was seen first.
        let half_width_m = self.half_width_m();
        let wider_m = if self.ends.has_front { half_width_m } else { half_width_m + MAX_WIDER_M };
        let nearer_m = if !seen.is_face && is_beside_lane(seen, ego) { wider_m } else { half_width_m };
        let [to_right_m, to_left_m] =
            if across.position_m > ego.d_m { [nearer_m, wider_m] } else { [wider_m, nearer_m] };
        seen_rear_m <= front_m && seen_front_m >= rear_m && right_m <= to_left_m && left_m >= -to_right_m
    }

    /// Returns whether something seen behind the vehicle's assumed rear end, between these distances
    /// to the left of the vehicle's middle (m), may belong to the vehicle.
    fn may_be_tail(&self, seen: &Span, [right_m, left_m]: [f64; 2], ego: &EgoRear) -> bool {
        let width_m = left_m - right_m;
        let is_narrow = width_m <= WIDEST_MOTORCYCLE_M;
        if seen.is_face {
            // A classifier may take wheels, and the piece of the load above them, for a motorcycle.
            let is_low = is_narrow && seen.top_m <= HIGHEST_WHEEL_M;
            let inside_m = 0.5 * self.size_m().1 - left_m.max(-right_m);
            let is_near = ego.s_m - seen.along_m[1] <= FARTHEST_WHEEL_M;
            let is_wheel = width_m <= WIDEST_WHEEL_M && inside_m.abs() <= WHEEL_AT_SIDE_M && is_near;
            return self.ends.has_front && self.is_truck() && (is_low || is_wheel);
        }
        let may_be_rider =
            is_narrow && width_m > WIDEST_WHEEL_M && seen.top_m > HIGHEST_WHEEL_M && seen.points >= RIDER_POINTS;
        !(self.ends.has_front && may_be_rider)
    }

    /// Returns the positions along the road between which parts of the vehicle lie (m). A front
    /// that is out of view may belong to the longest truck.
    fn span_m(&self) -> [f64; 2] {
        let [along, _] = self.filter.estimate();
        match self.ends.has_front {
            true => [along.position_m - self.size_m().0, along.position_m + FRONT_MARGIN_M],
            false => {
                let rear_m = along.position_m - self.ends.rearmost_m;
                [rear_m, rear_m + LONGEST_TRUCK_M]
            }
        }
    }

    /// Returns the largest distance behind the track's box at which parts of the vehicle may be
    /// seen (m). Such a part is the wheel of a trailer when the beams pass below the trailer.
    fn beyond_m(&self) -> f64 {
        let may_be_long = self.is_truck() || !self.ends.has_front;
        if may_be_long { (LONGEST_TRUCK_M - self.size_m().0).max(0.0) } else { 0.0 }
    }

    /// Returns half of the width within which parts of the vehicle lie (m).
    fn half_width_m(&self) -> f64 {
        0.5 * self.size_m().1.max(MIN_WHOLE_WIDTH_M) + SIDE_PROTRUSION_M
    }

    /// Returns whether the vehicle is surely a truck.
    fn is_truck(&self) -> bool {
        self.class.scores().0[VehicleClass::Truck as usize] >= SURE_SCORE
    }

    /// Returns whether the wheels of the vehicle tell how it moves: it is a truck, or its front is
    /// out of view.
    fn follows_wheels(&self) -> bool {
        self.is_truck() || !self.ends.has_front
    }

    /// Returns whether speed and kind of the vehicle are known well enough to confirm the track. A
    /// single end that is seen beside the ego belongs to a vehicle of any kind and length.
    fn is_settled(&self, model: &TrackerModel) -> bool {
        let [along, _] = self.filter.estimate();
        let is_known = self.ends.has_front || self.extent.spanned_m() > LONGEST_CAR_M;
        is_known && along.speed_variance_m2ps2.sqrt() <= model.settled_speed_sd_mps
    }

    /// Lets the vehicle reach back over the adjoining parts, from a point `ahead_m` ahead of the
    /// followed point.
    fn span<'a>(&mut self, ahead_m: f64, parts: impl Iterator<Item = &'a Measurement> + Clone) {
        let [along, _] = self.filter.estimate();
        if along.position_variance_m2.sqrt() > SPAN_SD_M {
            return;
        }
        let mut rearmost_m = if self.ends.has_front { 0.0 } else { self.ends.rearmost_m };
        loop {
            let reach = parts.clone().filter(|part| part.seen.spacing_m[0] <= MAX_SPACING_M).filter_map(|part| {
                let now_m = along.position_m + part.along.time_offset_s * along.speed_mps;
                let [rear_m, front_m] = part.seen.along_m.map(|s_m| now_m - s_m);
                (front_m <= rearmost_m + ADJOINING_M && rear_m > rearmost_m).then_some(rear_m)
            });
            match reach.max_by(f64::total_cmp) {
                Some(rear_m) => rearmost_m = rear_m,
                None => break,
            }
        }
        self.ends.rearmost_m = self.ends.rearmost_m.max(rearmost_m);
        self.extent.span_length((ahead_m + rearmost_m).min(LONGEST_TRUCK_M));
    }

    /// Counts a detection of the track for its lifecycle.
    fn count(&mut self, seen_by: SeenBy, model: &TrackerModel) {
        let is_settled = self.is_settled(model);
        let rules = &model.rules;
        match (seen_by, self.seen) {
            (_, Seen::Hit) | (SeenBy::CameraAlone, Seen::Kept) => {}
            (SeenBy::CameraAlone, _) => self.lifecycle.keep(rules),
            (SeenBy::Lidar, Seen::Kept) => self.lifecycle.count_kept_as_hit(rules, is_settled),
            (SeenBy::Lidar, _) => self.lifecycle.hit(rules, is_settled),
        }
        self.seen = self.seen.max(seen_in(seen_by));
    }
}

/// Multi-object tracker for the boxes of the rear LiDAR.
#[derive(Clone, Debug)]
pub struct Tracker {
    model: TrackerModel,
    /// Time of the tracks: the time of the latest scan, and the earliest possible time before the
    /// first scan.
    time: Time,
    tracks: Vec<TrackState>,
    measurements: Vec<Measurement>,
    assignment: Assignment,
    assigned: Vec<Option<usize>>,
    /// For each detection that no track is corrected with, the track whose vehicle it is a part of.
    owners: Vec<Option<usize>>,
    /// The points on the side of the track that is corrected.
    side_points: Vec<SidePoint>,
    /// The distances of its wheels behind its followed point (m).
    wheels_m: Vec<f64>,
    faces: Vec<Option<Face>>,
    /// What has become of the boxes of the latest update.
    uses: Vec<BoxUse>,
    /// Index in `uses` of the first box of the scan that is processed.
    first_use: usize,
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
            owners: Vec::with_capacity(RESERVED),
            side_points: Vec::with_capacity(RESERVED),
            wheels_m: Vec::with_capacity(RESERVED),
            faces: Vec::with_capacity(RESERVED),
            uses: Vec::with_capacity(RESERVED),
            first_use: 0,
        }
    }

    /// Updates all tracks with one scan. `list` issues the ids of new tracks.
    ///
    /// An error of the clock can date a scan before the previous scan. Such a scan counts as
    /// measured at the time of the previous scan: no filter is predicted backwards. Its
    /// measurements keep their own times, which lie before the time of the filters.
    pub fn update(&mut self, scan: &TrackerScan<'_>, list: &mut TrackList) {
        self.update_together([*scan], [], list);
    }

    /// Updates all tracks with the scans of several sensors that have the same time, one after the
    /// other. `idle` has the views of the sensors without a scan of this time.
    ///
    /// The scans count as one for the lifecycle of a track: it is hit if one of the sensors detects
    /// it, and missed if one of them could see it and none does. A track that only idle sensors
    /// could see keeps its state.
    pub fn update_together<'a>(
        &mut self,
        scans: impl IntoIterator<Item = TrackerScan<'a>>,
        idle: impl IntoIterator<Item = RearView>,
        list: &mut TrackList,
    ) {
        self.tracks.iter_mut().for_each(|track| track.seen = Seen::OutOfView);
        self.uses.clear();
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

    /// Predicts all tracks to the time of a scan, and corrects or starts the tracks that it
    /// detects.
    fn measure(&mut self, scan: &TrackerScan<'_>, list: &mut TrackList) {
        let frame = EgoFrame::new(scan.road, &scan.ego);
        let ego = Self::ego_rear(scan.road, &scan.ego, scan.rear_x_m);
        self.predict_to(scan.time, &ego);
        self.measurements.clear();
        let right_edge_m = scan.road.right_edge_m();
        let measured = scan.detections.iter().map(|detection| {
            let mut measured = measurement(detection, &frame, self.time);
            let [right_m, left_m] = measured.seen.across_m;
            if right_m > 0.0 || left_m < right_edge_m {
                // What lies entirely beside the carriageway is no part of a vehicle on it.
                (measured.seen.is_cut, measured.seen.is_face) = (false, true);
            }
            measured
        });
        self.measurements.extend(measured);
        let tracks = self.tracks.iter().map(|track| (&track.filter, 0.5 * track.size_m().0, track.ends.has_front));
        assign(tracks, &self.measurements, &mut self.assignment, &mut self.assigned);
        self.project_faces(&scan.view, &frame);
        self.find_owners(&ego);
        self.release_false_fronts(scan);
        self.begin_uses(scan);
        for track_index in 0..self.tracks.len() {
            match self.assigned[track_index] {
                Some(detection_index) => self.correct(track_index, detection_index, scan),
                None if self.is_beside(track_index) => self.correct_by_parts(track_index, scan),
                None => self.miss(track_index),
            }
        }
        self.start_tracks(scan, &ego, list);
        self.note_parts();
    }

    /// Returns the rear end of an ego in this state, whose rear end is at `rear_x_m` (m).
    fn ego_rear(road: &Road, ego: &VehicleState, rear_x_m: f64) -> EgoRear {
        let frame = EgoFrame::new(road, ego);
        EgoRear {
            s_m: ego.s_m + rear_x_m,
            d_m: ego.d_m,
            speed_mps: ego.speed_mps * maths::cos(ego.heading_rad) / frame.path_scale(ego.s_m, ego.d_m),
            half_lane_m: 0.5 * road.lane_width_m(road.lane_of(ego), ego.s_m),
        }
    }

    /// Predicts all tracks to `time`, unless they are later. The ego's rear is then at `ego`.
    fn predict_to(&mut self, time: Time, ego: &EgoRear) {
        // The time before the start of a run is negative. Before the first scan, there is nothing
        // to predict.
        let elapsed_s = if time > self.time && !self.tracks.is_empty() { (time - self.time).s() } else { 0.0 };
        self.time = time.max(self.time);
        if elapsed_s > 0.0 {
            for track in &mut self.tracks {
                track.filter.predict(elapsed_s, ego);
            }
        }
    }

    /// Appends every track to `list`, predicted to `time` and in the ego's frame `frame` at that
    /// time.
    pub fn report(&self, time: Time, frame: &EgoFrame<'_>, list: &mut TrackList) {
        for track in &self.tracks {
            let ahead_s = (time - self.time).s();
            list.tracks.push(to_track(track, track.filter.predicted(ahead_s), frame, time));
        }
    }

    /// Returns what has become of the boxes of the latest update.
    pub(crate) fn uses(&self) -> &[BoxUse] {
        &self.uses
    }

    /// Lists the boxes of a scan as ignored.
    fn begin_uses(&mut self, scan: &TrackerScan<'_>) {
        self.first_use = self.uses.len();
        let ignored =
            |index| BoxUse { sensor: scan.sensor, index, role: BoxRole::Ignored, track: None, innovation: None };
        self.uses.extend((0..scan.detections.len()).map(ignored));
    }

    /// Notes the boxes that are parts of the vehicles of tracks.
    fn note_parts(&mut self) {
        for (used, owner) in self.uses[self.first_use..].iter_mut().zip(&self.owners) {
            if let (BoxRole::Ignored, Some(track_index)) = (used.role, owner) {
                *used = BoxUse { role: BoxRole::Part, track: Some(self.tracks[*track_index].id), ..*used };
            }
        }
    }

    /// Corrects a track with its detection.
    fn correct(&mut self, track_index: usize, detection_index: usize, scan: &TrackerScan<'_>) {
        let detection = &scan.detections[detection_index];
        let track = &mut self.tracks[track_index];
        let measurement = &self.measurements[detection_index];
        let innovation = track.filter.innovation(measurement, 0.5 * track.size_m().0);
        let used = &mut self.uses[self.first_use + detection_index];
        *used = BoxUse { role: BoxRole::Corrects, track: Some(track.id), innovation: Some(innovation), ..*used };
        track.filter.correct(measurement, 0.5 * track.size_m().0, followed_sensor(detection, scan));
        track.extent.update(detection);
        track.class.update(&detection.class, detection.points);
        self.find_side_points(track_index, Some(detection_index), scan.ego.d_m);
        let track = &mut self.tracks[track_index];
        track.ends.learn(&self.side_points, 0.0);
        track.ends.learn_wheels(&self.wheels_m, 0.0);
        let of_track = self.owners.iter().zip(&self.measurements).filter(|(owner, _)| **owner == Some(track_index));
        let parts = of_track.map(|(_, part)| part).chain([&self.measurements[detection_index]]);
        track.span(0.0, parts);
        track.count(detection.seen_by, &self.model);
        track.lifecycle.add_evidence(vehicle_log_likelihood_ratio(&detection.class, detection.points));
    }

    /// Finds, for each detection without a track, the track whose vehicle it is a part of: the
    /// earliest one that covers it.
    fn find_owners(&mut self, ego: &EgoRear) {
        self.owners.clear();
        for (detection_index, measurement) in self.measurements.iter().enumerate() {
            let is_free = measurement.is_finite() && !self.assigned.contains(&Some(detection_index));
            let owner = self.tracks.iter().position(|track| is_free && track.covers(measurement, ego));
            self.owners.push(owner);
        }
    }

    /// Turns the detection that a track takes for its front into a part, if more of the vehicle is
    /// seen ahead of the detection, where the field of view cuts it off.
    fn release_false_fronts(&mut self, scan: &TrackerScan<'_>) {
        for track_index in 0..self.tracks.len() {
            let Some(detection_index) = self.assigned[track_index] else { continue };
            let face_m = self.measurements[detection_index].seen.along_m[1];
            if scan.ego.s_m + scan.rear_x_m - face_m > WHEELS_APART_M {
                continue;
            }
            let is_ahead = |part: &Measurement| part.seen.is_cut && part.seen.along_m[1] > face_m + FALSE_FRONT_M;
            if self.parts(track_index).any(|(_, part)| is_ahead(part)) {
                self.assigned[track_index] = None;
                self.owners[detection_index] = Some(track_index);
                self.tracks[track_index].ends.has_front = false;
            }
        }
    }

    /// Lists the ends of a track's parts, and of the detection that it is assigned, on the side
    /// that faces the ego, and their wheels on both sides.
    ///
    /// Parts on the far side, seen below the vehicle, end where something nearer hides them: such
    /// an end is no point of the vehicle.
    fn find_side_points(&mut self, track_index: usize, assigned: Option<usize>, ego_d_m: f64) {
        let mut points = std::mem::take(&mut self.side_points);
        let mut wheels_m = std::mem::take(&mut self.wheels_m);
        points.clear();
        wheels_m.clear();
        let [along, across] = self.tracks[track_index].filter.estimate();
        let is_left = across.position_m > ego_d_m;
        let parts =
            || self.parts(track_index).map(|(_, part)| part).chain(assigned.map(|index| &self.measurements[index]));
        let nearest_m = parts().map(|part| near_side_m(part, is_left)).fold(f64::INFINITY, f64::min);
        let follows_wheels = self.tracks[track_index].follows_wheels();
        let half_width_m = self.tracks[track_index].half_width_m() + MAX_WIDER_M;
        for part in parts() {
            let behind_m = |s_m: f64| along.position_m - (s_m - part.along.time_offset_s * along.speed_mps);
            let [right_m, left_m] = part.seen.across_m;
            let is_within = (0.5 * (right_m + left_m) - across.position_m).abs() <= half_width_m;
            if follows_wheels && is_within {
                wheels_m.extend(part.seen.wheels.along_m().iter().map(|&front_m| behind_m(front_m)));
            }
            if near_side_m(part, is_left) > nearest_m + SAME_SIDE_M {
                continue;
            }
            let ends = part.seen.along_m.into_iter().zip(part.seen.spacing_m).enumerate();
            for (end, (s_m, spacing_m)) in ends {
                // The foremost point of a part that is cut off is the edge of the field of view.
                if spacing_m <= MAX_SPACING_M && !(end == 1 && part.seen.is_cut) {
                    points.push(SidePoint { behind_m: behind_m(s_m), spacing_m });
                }
            }
        }
        self.wheels_m = wheels_m;
        self.side_points = points;
    }

    /// Returns the parts of a track's vehicle in the latest scan.
    fn parts(&self, track_index: usize) -> impl Iterator<Item = (usize, &Measurement)> {
        let of_track = self.owners.iter().zip(&self.measurements).enumerate();
        of_track.filter(move |(_, (owner, _))| **owner == Some(track_index)).map(|(index, (_, part))| (index, part))
    }

    /// Returns whether parts of a track's vehicle are seen, and its front is out of view.
    fn is_beside(&self, track_index: usize) -> bool {
        let is_in_view = self.faces[track_index].is_some() && self.tracks[track_index].ends.has_front;
        self.parts(track_index).any(|(_, part)| part.seen.is_cut || !is_in_view)
    }

    /// Corrects a track with the parts of its vehicle that are seen beside the ego.
    ///
    /// Along the road, the points on its side tell how the vehicle has moved. Across the road, its
    /// nearer side shows its centre.
    fn correct_by_parts(&mut self, track_index: usize, scan: &TrackerScan<'_>) {
        let [along, across] = self.tracks[track_index].filter.estimate();
        let now_m = |part: &Measurement, s_m: f64| s_m - part.along.time_offset_s * along.speed_mps;
        let foremost = self.parts(track_index).map(|(index, part)| (now_m(part, part.seen.along_m[1]), index));
        let Some((front_m, front_index)) = foremost.max_by(|a, b| a.0.total_cmp(&b.0)) else { return };
        let has_cut = self.parts(track_index).any(|(_, part)| part.seen.is_cut);
        let has_front = self.tracks[track_index].ends.has_front;
        // An axle that is seen alone may belong to a vehicle whose next axle is still out of view.
        let behind_m = scan.ego.s_m + scan.rear_x_m - front_m;
        let is_face = self.measurements[front_index].seen.is_face || behind_m > WHEELS_APART_M;
        if !has_front && !has_cut && is_face {
            // The front has come into view.
            let face = self.measurements[front_index].along;
            let track = &mut self.tracks[track_index];
            let [face_m, variance_m2] = face.position_now(along.speed_mps);
            track.filter.shift_along(face_m - along.position_m, variance_m2);
            track.ends.follow_front(face_m - along.position_m);
            self.owners[front_index] = None;
            return self.correct(track_index, front_index, scan);
        }
        let is_left = across.position_m > scan.ego.d_m;
        let half_width_m = 0.5 * self.tracks[track_index].size_m().1;
        let nearest = self.parts(track_index).map(|(_, part)| (near_side_m(part, is_left), part.across.time_offset_s));
        let nearest = nearest.min_by(|a, b| a.0.total_cmp(&b.0));
        self.find_side_points(track_index, None, scan.ego.d_m);
        let track = &mut self.tracks[track_index];
        let sensor = Some(scan.sensor);
        if let Some((side_m, time_offset_s)) = nearest {
            let position_m = if is_left { side_m + half_width_m } else { -side_m - half_width_m };
            let offset_m = position_m - across.position_m;
            let is_nearer = !track.ends.has_front
                && (offset_m < 0.0) == is_left
                && (SIDE_GATE_M..=MAX_WIDER_M + SIDE_GATE_M).contains(&offset_m.abs());
            if track.ends.is_side_proven(is_nearer) {
                track.filter.shift_across(offset_m, SIDE_SD_M * SIDE_SD_M);
            }
            if offset_m.abs() <= SIDE_GATE_M {
                let (white_sd_m, slow_sd_m) = (SIDE_SD_M, SIDE_SLOW_SD_M);
                let measured = AxisMeasurement { position_m, white_sd_m, slow_sd_m, time_offset_s };
                track.filter.correct_across(&measured, sensor);
            }
        }
        // A part of the vehicle is ahead of its assumed front.
        let sd_m = along.position_variance_m2.sqrt();
        track.ends.has_front &= !has_cut || front_m - along.position_m <= FRONT_MARGIN_M + 3.0 * sd_m;
        let mut slow_sd_m = SIDE_SLOW_SD_M;
        let measured = if let Some(offset_m) = track.ends.measure_wheels(&self.wheels_m, sd_m) {
            track.ends.learn(&self.side_points, offset_m);
            Some([offset_m, WHEEL_SPACING_M])
        } else {
            if track.ends.has_wheels() {
                slow_sd_m = OTHER_END_SLOW_SD_M;
            }
            let measured = track.ends.measure(&self.side_points, sd_m);
            track.ends.learn_wheels(&self.wheels_m, measured.map_or(0.0, |[offset_m, _]| offset_m));
            measured
        };
        if let Some([offset_m, spacing_m]) = measured {
            let measured = AxisMeasurement {
                position_m: along.position_m + offset_m,
                white_sd_m: maths::hypot(SIDE_SD_M, SIDE_SD_COLUMNS * spacing_m),
                slow_sd_m,
                time_offset_s: 0.0,
            };
            track.filter.correct_along(&measured, sensor);
        }
        let ahead_m = if track.ends.has_front { 0.0 } else { front_m - along.position_m };
        let of_track = self.owners.iter().zip(&self.measurements).filter(|(owner, _)| **owner == Some(track_index));
        track.span(ahead_m, of_track.map(|(_, part)| part));
        if track.extent.spanned_m() > LONGEST_CAR_M {
            track.class.update(&LONG_VEHICLE, LONG_VEHICLE_POINTS);
        }
        // A vehicle whose front is unknown and whose speed nothing measures is not followed.
        let [along, _] = track.filter.estimate();
        let is_lost = along.speed_variance_m2ps2.sqrt() > LOST_SPEED_SD_MPS;
        if track.ends.has_front || measured.is_some() || !is_lost {
            track.count(SeenBy::Lidar, &self.model);
        }
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

    /// Starts a track for each detection that is assigned to no track and does not lie within a
    /// track's box.
    fn start_tracks(&mut self, scan: &TrackerScan<'_>, ego: &EgoRear, list: &mut TrackList) {
        // A vehicle that the field of view cuts off comes before its parts, and its near side
        // before its far side.
        let nearest_cut = |tracker: &Self, after_m: f64| {
            let cut = tracker.measurements.iter().enumerate().filter(|(_, measurement)| measurement.seen.is_cut);
            let aside_m = cut.map(|(index, measurement)| {
                let [right_m, left_m] = measurement.seen.across_m.map(|d_m| d_m - scan.ego.d_m);
                (right_m.max(-left_m), index)
            });
            aside_m.filter(|(aside_m, _)| *aside_m > after_m).min_by(|a, b| a.0.total_cmp(&b.0))
        };
        let mut after_m = f64::NEG_INFINITY;
        while let Some((aside_m, detection_index)) = nearest_cut(self, after_m) {
            self.start_track(detection_index, scan, ego, list);
            after_m = aside_m;
        }
        for detection_index in 0..scan.detections.len() {
            if !self.measurements[detection_index].seen.is_cut {
                self.start_track(detection_index, scan, ego, list);
            }
        }
    }

    /// Starts a track for a detection unless it is assigned to a track or lies within a track's
    /// box.
    fn start_track(&mut self, detection_index: usize, scan: &TrackerScan<'_>, ego: &EgoRear, list: &mut TrackList) {
        let detection = &scan.detections[detection_index];
        let measurement = &self.measurements[detection_index];
        let (s_m, d_m) = (measurement.along.position_m, measurement.across.position_m);
        let seen = &measurement.seen;
        let is_taken = self.assigned.contains(&Some(detection_index))
            || self.tracks.iter().any(|track| track.contains(s_m, d_m) || track.covers(measurement, ego));
        let wheel_m = rearmost_wheel_m(measurement);
        let is_coarse = wheel_m.is_none() && seen.spacing_m[0] > MAX_SPACING_M;
        if is_taken || !measurement.is_finite() || seen.is_cut && is_coarse {
            return;
        }
        let has_front = !seen.is_cut && (seen.is_face || seen.spacing_m[0] > NEAR_SPACING_M);
        let measurement = if has_front { *measurement } else { of_rear(measurement) };
        let mut track = TrackState {
            id: list.new_id(),
            filter: RoadFilter::new(&measurement, ego.speed_mps, followed_sensor(detection, scan)),
            lifecycle: match detection.seen_by {
                SeenBy::Lidar => Lifecycle::first_hit(&self.model.rules),
                SeenBy::CameraAlone => Lifecycle::first_kept(&self.model.rules),
            },
            class: FusedClass::unknown(),
            extent: TrackExtent::default(),
            ends: Ends::new(has_front),
            seen: seen_in(detection.seen_by),
        };
        if has_front {
            track.extent.update(detection);
        } else {
            track.ends.rearmost_m = measurement.along.position_m - measurement.seen.along_m[0];
            if wheel_m.is_some() {
                track.ends.follow_wheel();
            }
        }
        track.class.update(&detection.class, detection.points);
        let used = &mut self.uses[self.first_use + detection_index];
        *used = BoxUse { role: BoxRole::Starts, track: Some(track.id), ..*used };
        self.tracks.push(track);
    }

    /// Deletes tracks that have ended, and tracks that are parts of other tracks.
    ///
    /// The face nearest to the ego is the vehicle's. Of two tracks that are parts of each other,
    /// the later one is deleted.
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

/// Returns the sensor that a track may follow for this detection: none if only the camera sees it,
/// which comes with the scan of any LiDAR.
fn followed_sensor(detection: &Detection, scan: &TrackerScan<'_>) -> Option<usize> {
    (detection.seen_by == SeenBy::Lidar).then_some(scan.sensor)
}

/// Returns whether the middle of something seen lies outside of the ego's lane.
fn is_beside_lane(seen: &Span, ego: &EgoRear) -> bool {
    let [right_m, left_m] = seen.across_m;
    (0.5 * (right_m + left_m) - ego.d_m).abs() > ego.half_lane_m
}

/// Returns the position along the road of the rearmost wheel of a part that is longer than a car
/// (m).
fn rearmost_wheel_m(part: &Measurement) -> Option<f64> {
    let [rear_m, front_m] = part.seen.along_m;
    part.seen.wheels.along_m().last().copied().filter(|_| front_m - rear_m > LONGEST_CAR_M)
}

/// Returns the measurement of the rearmost point of a vehicle whose front is out of view: of a
/// wheel, or else of its rear end.
fn of_rear(measurement: &Measurement) -> Measurement {
    let [position_m, spacing_m] = match rearmost_wheel_m(measurement) {
        Some(wheel_m) => [wheel_m, WHEEL_SPACING_M],
        None => [measurement.seen.along_m[0], measurement.seen.spacing_m[0]],
    };
    let white_sd_m = maths::hypot(SIDE_SD_M, SIDE_SD_COLUMNS * spacing_m);
    let along = AxisMeasurement { position_m, white_sd_m, slow_sd_m: SIDE_SLOW_SD_M, ..measurement.along };
    Measurement { along, ..*measurement }
}

/// Returns the position across the road of the side of a part that faces the ego (m), with the sign
/// that makes it grow with the distance from the ego.
fn near_side_m(part: &Measurement, is_left: bool) -> f64 {
    let [right_m, left_m] = part.seen.across_m;
    if is_left { right_m } else { -left_m }
}

/// Returns the evidence of a scan about the track that a detection by these sensors belongs to.
fn seen_in(seen_by: SeenBy) -> Seen {
    match seen_by {
        SeenBy::Lidar => Seen::Hit,
        SeenBy::CameraAlone => Seen::Kept,
    }
}

/// Transforms a track to the ego's frame.
///
/// The estimate along the road is the position of the face that the ego sees, which is a front. The
/// centre lies half a length behind it. The reported covariance along the road is the covariance of
/// the face, because the face defines the gap.
fn to_track(track: &TrackState, [along, across]: [AxisEstimate; 2], frame: &EgoFrame<'_>, time: Time) -> Track {
    let (length_m, width_m) = track.size_m();
    let half_length_m = 0.5 * length_m / frame.path_scale(along.position_m, across.position_m);
    let (front_m, variance_m2) = match track.ends.has_front {
        true => (along.position_m, 0.0),
        false => {
            let sd_m = LENGTH_SD_M[track.class.scores().best_vehicle_class() as usize];
            (along.position_m - track.ends.rearmost_m + 2.0 * half_length_m, sd_m * sd_m)
        }
    };
    let position_variance_m2 = along.position_variance_m2 + variance_m2;
    let centre = AxisEstimate { position_m: front_m - half_length_m, position_variance_m2, ..along };
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
        lane: frame.lane_probabilities(centre.position_m, across.position_m, across.position_variance_m2.sqrt()),
    }
}
