//! Flaws of trajectory data: the number of each kind, and the location of its first occurrence.
//!
//! | flaw | what counts |
//! |---|---|
//! | gap | a piece of a vehicle's track beyond the first: frames are missing before it, for too long to be bridged |
//! | jump | a piece before which no frame is missing, and a step that contradicts the recorded speed: it deviates by more than 10 m/s along the road, or moves faster than 5 m/s sideways, and the deviation is at least 0.5 m |
//! | acceleration | a track point with more than 12 m/s² (no tyre brakes harder), recorded or derived from two speeds that differ by at least 0.5 m/s |
//! | overlap | two vehicles in one lane at one instant whose boxes overlap lengthwise |
//! | reused number | a piece that cannot be the same vehicle: other class or size, or out of reach of the previous piece |
//!
//! [`SkippedRows`](super::SkippedRows) holds the rows that could not be used at all.
//!
//! The inspector examines tracks one by one. To find overlaps it stores the positions of the latest
//! 4 million track points. If a file is sorted by vehicle and a later track begins before the
//! stored positions, the track points before them count as unchecked.

use std::collections::BTreeMap;

use closecall_traffic::{Dimensions, Time, Trajectory, TrajectoryPoint, VehicleClass};
use serde::Serialize;

use super::data::{RecordedTrack, TrajectoryData};

/// Maximum difference between the speed of a step along the road and the recorded speed (m/s). At
/// 10 Hz, it amounts to a metre per step.
const JUMP_MPS: f64 = 10.0;

/// Maximum lateral speed of a step (m/s). Lane changes stay below 2 m/s.
const SIDEWAYS_JUMP_MPS: f64 = 5.0;

/// Minimum deviation of a jump (m). At high rates, a centimetre of noise is fast.
const JUMP_M: f64 = 0.5;

/// Maximum acceleration or deceleration of a vehicle on tyres (m/s²).
const IMPOSSIBLE_MPS2: f64 = 12.0;

/// Minimum difference between two speeds that counts (m/s). At high rates, smaller differences say
/// nothing about the acceleration.
const SPEED_STEP_MPS: f64 = 0.5;

/// Maximum difference between the recorded sizes of one vehicle (m).
const SAME_SIZE_M: f64 = 0.3;

/// Maximum speed of a vehicle between two pieces of its track (m/s).
const REACH_MPS: f64 = 70.0;

/// Maximum number of track points stored to find overlaps: 200 MB.
const MAX_STORED_POINTS: usize = 4 << 20;

/// Number of flaws in trajectory data.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct FlawCounts {
    /// Tracks without gaps.
    pub tracks: usize,
    /// Vehicles.
    pub vehicles: usize,
    /// Points of all tracks.
    pub instants: usize,
    /// Pieces of a vehicle's track beyond the first.
    pub gaps: usize,
    /// Steps between two frames that contradict the recorded speed.
    pub jumps: usize,
    /// Pairs of vehicles in one lane that overlap lengthwise at one instant.
    pub overlaps: usize,
    /// Track points with an acceleration that no vehicle reaches.
    pub accelerations: usize,
    /// Pieces of a track that cannot be the same vehicle as the previous piece.
    pub reused_numbers: usize,
}

/// The location of a flaw.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FlawLocation {
    /// Line of the file, if known.
    pub line: Option<u64>,
    /// Number of the track.
    pub track_id: u64,
    /// Time (s).
    pub time_s: f64,
    /// Description of the flaw.
    pub what: String,
}

/// The flaws of one kind.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Flaw {
    /// Number of flaws.
    pub count: usize,
    /// The first flaw found.
    pub first: Option<FlawLocation>,
}

/// The flaws of trajectory data, by kind. The documentation of the `quality` module defines the
/// kinds.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Flaws {
    /// Missing frames between two pieces of a track.
    pub gaps: Flaw,
    /// Steps that contradict the recorded speed.
    pub jumps: Flaw,
    /// Vehicles that overlap in one lane.
    pub overlaps: Flaw,
    /// Accelerations that no vehicle reaches.
    pub accelerations: Flaw,
    /// Pieces that cannot be the same vehicle.
    pub reused_numbers: Flaw,
}

impl Flaws {
    /// Returns the flaws with their names.
    pub fn named(&self) -> [(&'static str, &Flaw); 5] {
        [
            ("gaps", &self.gaps),
            ("jumps", &self.jumps),
            ("overlaps", &self.overlaps),
            ("impossible accelerations", &self.accelerations),
            ("reused numbers", &self.reused_numbers),
        ]
    }
}

/// Counts the flaws of `data`.
pub fn count_flaws(data: &TrajectoryData) -> FlawCounts {
    let mut inspector = QualityInspector::default();
    for track in &data.trajectories {
        inspector.add_trajectory(track, &[]);
    }
    inspector.count_flaws()
}

/// Examines tracks one by one.
#[derive(Debug)]
pub struct QualityInspector {
    most_stored_points: usize,
    flaws: Flaws,
    tracks: usize,
    instants: usize,
    vehicles: BTreeMap<u64, LastSeen>,
    occupied: BTreeMap<Time, Vec<OccupiedSpan>>,
    stored_points: usize,
    discarded_until: Option<Time>,
    unchecked: usize,
    span: Option<(Time, Time)>,
}

/// A vehicle as it was last seen.
#[derive(Clone, Copy, Debug)]
struct LastSeen {
    class: VehicleClass,
    dimensions: Dimensions,
    time: Time,
    s_m: f64,
}

/// The part of a lane that a vehicle occupies.
#[derive(Clone, Copy, Debug)]
struct OccupiedSpan {
    lane: u8,
    from_m: f64,
    to_m: f64,
    track_id: u64,
}

impl Default for QualityInspector {
    fn default() -> Self {
        Self::storing(MAX_STORED_POINTS)
    }
}

impl QualityInspector {
    /// Creates an inspector that stores at most this many track points to find overlaps, 50 bytes
    /// each. It does not check the points that come too late.
    pub fn storing(most_stored_points: usize) -> Self {
        Self {
            most_stored_points,
            flaws: Flaws::default(),
            tracks: 0,
            instants: 0,
            vehicles: BTreeMap::new(),
            occupied: BTreeMap::new(),
            stored_points: 0,
            discarded_until: None,
            unchecked: 0,
            span: None,
        }
    }

    /// Examines the next track.
    pub fn add(&mut self, track: &RecordedTrack) {
        self.add_trajectory(&track.trajectory, &track.lines);
    }

    /// Returns the flaws found so far.
    pub fn flaws(&self) -> &Flaws {
        &self.flaws
    }

    /// Returns the number of track points that were not compared with the others to find overlaps.
    pub fn unchecked_points(&self) -> usize {
        self.unchecked
    }

    /// Returns the first and the last instant.
    pub fn span(&self) -> Option<(Time, Time)> {
        self.span
    }

    /// Returns the number of flaws found so far.
    pub fn count_flaws(&self) -> FlawCounts {
        FlawCounts {
            tracks: self.tracks,
            vehicles: self.vehicles.len(),
            instants: self.instants,
            gaps: self.flaws.gaps.count,
            jumps: self.flaws.jumps.count,
            overlaps: self.flaws.overlaps.count,
            accelerations: self.flaws.accelerations.count,
            reused_numbers: self.flaws.reused_numbers.count,
        }
    }

    fn add_trajectory(&mut self, track: &Trajectory, lines: &[u64]) {
        self.tracks += 1;
        self.instants += track.points.len();
        let (Some(first), Some(last)) = (track.points.first(), track.points.last()) else { return };
        self.span = Some(self.span.map_or((first.time, last.time), |(a, b)| (a.min(first.time), b.max(last.time))));
        self.add_piece(track, lines, first, last);
        for (k, pair) in track.points.windows(2).enumerate() {
            if let [before, point] = pair {
                self.add_step(track.track_id, lines.get(k + 1).copied(), before, point);
            }
        }
        for (k, point) in track.points.iter().enumerate() {
            if !(point.acceleration_mps2.abs() <= IMPOSSIBLE_MPS2) {
                let description = || format!("{:.1} m/s² recorded", point.acceleration_mps2);
                self.flaws.accelerations.record(lines.get(k).copied(), track.track_id, point.time, description);
            }
            self.check_overlaps(track, point, lines.get(k).copied());
        }
    }

    /// Counts gaps and reused numbers before a piece of a track.
    fn add_piece(&mut self, track: &Trajectory, lines: &[u64], first: &TrajectoryPoint, last: &TrajectoryPoint) {
        let (class, dimensions) = (track.class, track.dimensions);
        let seen = LastSeen { class, dimensions, time: last.time, s_m: last.s_m };
        let Some(before) = self.vehicles.insert(track.vehicle_id, seen) else { return };
        let line = lines.first().copied();
        let missing_s = (first.time - before.time).s();
        // The reader splits a track where no frame is missing only at a jump.
        let step_s = track.points.get(1).map_or(0.0, |second| (second.time - first.time).s());
        if missing_s > 0.0 && missing_s <= 1.5 * step_s {
            let jump = || format!("vehicle {} moves as no vehicle does: the track was split", track.vehicle_id);
            self.flaws.jumps.record(line, track.track_id, first.time, jump);
        } else {
            let gap = || format!("vehicle {} is missing for {missing_s:.2} s before", track.vehicle_id);
            self.flaws.gaps.record(line, track.track_id, first.time, gap);
        }
        let differs = |a: f64, b: f64| !((a - b).abs() <= SAME_SIZE_M);
        let other = before.class != class
            || differs(before.dimensions.length_m, dimensions.length_m)
            || differs(before.dimensions.width_m, dimensions.width_m);
        let travelled_m = first.s_m - before.s_m;
        let is_out_of_reach = !(travelled_m >= -JUMP_M && travelled_m <= REACH_MPS * missing_s.abs() + JUMP_M);
        if other || is_out_of_reach {
            let why = if other { "has another class or size than" } else { "is out of reach of" };
            let description =
                || format!("vehicle {} {why} the one of this number {missing_s:.1} s before", track.vehicle_id);
            self.flaws.reused_numbers.record(line, track.track_id, first.time, description);
        }
    }

    /// Counts jumps and accelerations between two track points.
    fn add_step(&mut self, track_id: u64, line: Option<u64>, before: &TrajectoryPoint, point: &TrajectoryPoint) {
        let step_s = (point.time - before.time).s();
        let speed_mps = 0.5 * (before.speed_mps + point.speed_mps);
        let (along_m, across_m) = (point.s_m - before.s_m - speed_mps * step_s, point.d_m - before.d_m);
        let is_jump = |off_m: f64, limit_mps: f64| !(off_m.abs() <= (limit_mps * step_s).max(JUMP_M));
        if is_jump(along_m, JUMP_MPS) || is_jump(across_m, SIDEWAYS_JUMP_MPS) {
            let description = || format!("{along_m:.2} m along and {across_m:.2} m across beside what its speed makes");
            self.flaws.jumps.record(line, track_id, point.time, description);
        }
        let change_mps = point.speed_mps - before.speed_mps;
        if !(change_mps.abs() <= (IMPOSSIBLE_MPS2 * step_s).max(SPEED_STEP_MPS))
            && point.acceleration_mps2.abs() <= IMPOSSIBLE_MPS2
        {
            let description = || format!("from {:.1} to {:.1} m/s in {step_s:.3} s", before.speed_mps, point.speed_mps);
            self.flaws.accelerations.record(line, track_id, point.time, description);
        }
    }

    /// Counts overlaps with the vehicles in the same lane at the same instant.
    fn check_overlaps(&mut self, track: &Trajectory, point: &TrajectoryPoint, line: Option<u64>) {
        if self.discarded_until.is_some_and(|until| point.time <= until) {
            self.unchecked += 1;
            return;
        }
        let half_m = 0.5 * track.dimensions.length_m;
        let (from_m, to_m) = (point.s_m - half_m, point.s_m + half_m);
        let span = OccupiedSpan { lane: point.lane.0, from_m, to_m, track_id: track.track_id };
        let others = self.occupied.entry(point.time).or_default();
        for other in others.iter().filter(|other| other.lane == span.lane && other.from_m < to_m && from_m < other.to_m)
        {
            let overlap_m = to_m.min(other.to_m) - from_m.max(other.from_m);
            let description = || format!("overlaps track {} by {overlap_m:.2} m in lane {}", other.track_id, span.lane);
            self.flaws.overlaps.record(line, track.track_id, point.time, description);
        }
        others.push(span);
        self.stored_points += 1;
        while self.stored_points > self.most_stored_points
            && let Some((time, discarded)) = self.occupied.pop_first()
        {
            self.stored_points -= discarded.len();
            self.discarded_until = Some(time);
        }
    }
}

impl Flaw {
    /// Counts a flaw and keeps the first flaw.
    fn record(&mut self, line: Option<u64>, track_id: u64, time: Time, description: impl FnOnce() -> String) {
        self.count += 1;
        if self.first.is_none() {
            self.first = Some(FlawLocation { line, track_id, time_s: time.s(), what: description() });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trajectory_data::test_support::{straight_track, trajectory_data_of};

    #[test]
    fn flaws_are_counted() {
        let mut jumping = straight_track(2, 100.0, 20.0, -5.0, 10);
        jumping.points[5].s_m += 5.0;
        let mut piece = straight_track(3, 0.0, 20.0, -8.0, 10);
        piece.vehicle_id = 2;
        let close = straight_track(4, 3.0, 20.0, -1.75, 4);
        let data = trajectory_data_of(vec![straight_track(1, 0.0, 20.0, -1.75, 10), jumping, piece, close]);
        let flaws = count_flaws(&data);
        let expected = FlawCounts {
            tracks: 4,
            vehicles: 3,
            instants: 34,
            gaps: 1,
            jumps: 2,
            overlaps: 4,
            accelerations: 0,
            // The piece starts 100 m behind vehicle 2, at the same time.
            reused_numbers: 1,
        };
        assert_eq!(flaws, expected);
    }

    #[test]
    fn a_lateral_jump_is_counted_once_and_located() {
        let mut track = straight_track(7, 0.0, 20.0, -1.75, 10);
        track.points.iter_mut().skip(4).for_each(|point| point.d_m -= 0.8);
        let mut inspector = QualityInspector::default();
        inspector.add_trajectory(&track, &(11..21).collect::<Vec<_>>());
        let jumps = &inspector.flaws().jumps;
        let first = jumps.first.as_ref().unwrap();
        assert_eq!((jumps.count, first.line, first.track_id, first.time_s), (1, Some(15), 7, 0.4));
        assert!(first.what.contains("-0.80 m across"), "{}", first.what);
    }

    #[test]
    fn accelerations_beyond_tyre_limits_are_counted() {
        let mut braking = straight_track(1, 0.0, 20.0, -1.75, 10);
        braking.points[3].acceleration_mps2 = -14.0;
        let mut stopping = straight_track(2, 100.0, 20.0, -1.75, 10);
        stopping.points[9].speed_mps = 17.0;
        assert_eq!(count_flaws(&trajectory_data_of(vec![braking, stopping])).accelerations, 2);
    }

    #[test]
    fn a_lane_change_is_not_a_flaw() {
        let track =
            crate::trajectory_data::test_support::changing_track(1, (0.0, 30.0), (-5.25, -1.75), (4.0, 3.0), 150);
        let flaws = count_flaws(&trajectory_data_of(vec![track]));
        assert_eq!((flaws.jumps, flaws.accelerations, flaws.gaps), (0, 0, 0));
    }
}
