//! Detection of lane changes in smoothed trajectories.

use closecall_traffic::{Lane, Side, Time, Trajectory};
use serde::Serialize;

use super::LaneChange;
use super::crossings::{Crossing, crossings};
use super::distance::by_distance;
use super::double::{RoadLanes, mark_doubles};
use super::geometry::LaneGrid;
use super::gradient;
use super::lane_reliability::LaneReliability;
use super::manoeuvre::{MIN_SHIFT_M, Manoeuvre, Sampled, height_share, manoeuvres, quintic_width_share, sweeps};
use crate::filters::{PERIOD, SmoothedTrack, SmoothedTrajectoryData, smooth_track, stays_of};
use crate::trajectory_data::{LaneMarkings, MarkingDistances};

/// Largest distance from a crossing to the manoeuvre that it belongs to, if it lies outside
/// (samples): 1 s. Vehicles pause on a marking, and the start and end of a manoeuvre are estimates.
const OUTSIDE_SAMPLES: f64 = 5.0;

/// Least lateral shift of a lane change over an estimated marking (m): vehicles sway in their lanes
/// with a standard deviation of 0.2 to 0.3 m, so that a shift by 1 m is no swaying. An assumption
/// with a plausible range of 0.8 to 1.5 m.
const MIN_ESTIMATED_SHIFT_M: f64 = 1.0;

/// The criterion by which lane changes are detected.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Criterion {
    /// Peaks of the lateral speed.
    Peak,
    /// Displacement from the lane's centre.
    Distance,
    /// Jumps of the distances to the markings. Detects nothing if these were not measured.
    Gradient,
}

impl Criterion {
    /// All criteria.
    pub const ALL: [Self; 3] = [Self::Peak, Self::Distance, Self::Gradient];

    /// Returns the name of the criterion, as on the command line and in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Peak => "peak",
            Self::Distance => "distance",
            Self::Gradient => "gradient",
        }
    }
}

/// Detects the lane changes of one track at a time.
#[derive(Clone, Debug)]
pub struct LaneChangeDetector {
    lanes: LaneReliability,
    grid: LaneGrid,
    road: RoadLanes,
    lane_width_m: f64,
}

/// The data of one track from which lane changes are detected.
#[derive(Clone, Copy, Debug)]
struct TrackData<'a> {
    recorded: &'a Trajectory,
    /// Distances to the markings for each recorded point; empty if they were not measured.
    distances: &'a [MarkingDistances],
    smoothed: &'a SmoothedTrack,
}

/// Detects the lane changes of all tracks by the peak criterion, in order of track id and time.
pub fn detect(data: &SmoothedTrajectoryData) -> Vec<LaneChange> {
    let detector = LaneChangeDetector::new(data.lanes, &data.markings);
    data.tracks.iter().flat_map(|track| detector.by_peak(track)).collect()
}

impl LaneChangeDetector {
    /// Creates a detector for tracks on the road with these `markings`.
    pub fn new(lanes: LaneReliability, markings: &LaneMarkings) -> Self {
        let (grid, road) = (LaneGrid::new(markings), RoadLanes::new(markings));
        Self { lanes, grid, road, lane_width_m: markings.typical_lane_width_m() }
    }

    /// Detects the lane changes of a track by one criterion, in order of time.
    ///
    /// `distances` holds the distances to the markings for each point of the track; it is empty if
    /// they were not measured. If the criterion requires a change of the recorded lane, a track
    /// without such a change is not smoothed.
    pub fn detect(
        &self,
        criterion: Criterion,
        recorded: &Trajectory,
        distances: &[MarkingDistances],
    ) -> Vec<LaneChange> {
        let by_lane = criterion == Criterion::Peak && self.lanes != LaneReliability::Unreliable;
        if by_lane && crossings(&stays_of(recorded)).is_empty() {
            return Vec::new();
        }
        let Some(smoothed) = smooth_track(recorded) else { return Vec::new() };
        self.detect_smoothed(criterion, TrackData { recorded, distances, smoothed: &smoothed })
    }

    /// Detects the lane changes of a track by each of `criteria`, but smooths the track only once.
    pub fn detect_by_each(
        &self,
        criteria: &[Criterion],
        recorded: &Trajectory,
        distances: &[MarkingDistances],
    ) -> Vec<Vec<LaneChange>> {
        let Some(smoothed) = smooth_track(recorded) else { return vec![Vec::new(); criteria.len()] };
        let data = TrackData { recorded, distances, smoothed: &smoothed };
        criteria.iter().map(|criterion| self.detect_smoothed(*criterion, data)).collect()
    }

    fn by_peak(&self, track: &SmoothedTrack) -> Vec<LaneChange> {
        let mut changes = match self.lanes {
            LaneReliability::Reliable => by_crossings(&track.trajectory, &crossings(&track.stays), self.lane_width_m),
            LaneReliability::Estimated => {
                by_estimated_lanes(&track.trajectory, &crossings(&track.stays), self.lane_width_m)
            }
            LaneReliability::Unreliable => by_shift(&track.trajectory, self.lane_width_m),
        };
        mark_doubles(&mut changes, &self.road);
        changes
    }

    fn detect_smoothed(&self, criterion: Criterion, data: TrackData<'_>) -> Vec<LaneChange> {
        let TrackData { recorded, distances, smoothed } = data;
        let track = &smoothed.trajectory;
        let width_m = || gradient::lane_width_m(recorded, distances).unwrap_or(self.lane_width_m);
        let mut changes = match (criterion, self.lanes) {
            (Criterion::Peak, LaneReliability::Reliable) => by_crossings(track, &crossings(&smoothed.stays), width_m()),
            (Criterion::Peak, LaneReliability::Estimated) => {
                by_estimated_lanes(track, &crossings(&smoothed.stays), width_m())
            }
            (Criterion::Peak, LaneReliability::Unreliable) => by_shift(track, width_m()),
            (Criterion::Distance, _) if distances.is_empty() => {
                by_distance(track, |k| self.grid.at(track.points[k].d_m))
            }
            (Criterion::Distance, _) => {
                let lanes = gradient::measured_lanes(recorded, distances, track, PERIOD);
                by_distance(track, |k| lanes[k])
            }
            (Criterion::Gradient, _) => by_crossings(track, &gradient::jumps(recorded, distances), width_m()),
        };
        mark_doubles(&mut changes, &self.road);
        changes
    }
}

/// Returns the lane changes whose peak of lateral speed carries the vehicle over a marking.
fn by_crossings(track: &Trajectory, crossings: &[Crossing], lane_width_m: f64) -> Vec<LaneChange> {
    let (false, Some(sampled)) = (crossings.is_empty(), Sampled::new(track)) else { return Vec::new() };
    let manoeuvres = manoeuvres(track, lane_width_m);
    let matched =
        crossings.iter().filter_map(|crossing| Some((crossing, manoeuvre_of(&sampled, crossing, &manoeuvres)?)));
    let change = |(crossing, manoeuvre): (&Crossing, &Manoeuvre)| {
        lane_change(&sampled, manoeuvre, height_share(track, lane_width_m), *crossing)
    };
    matched.map(change).collect()
}

/// Returns the lane changes over estimated markings, apart from the crossings of a vehicle that
/// sways about a marking.
fn by_estimated_lanes(track: &Trajectory, crossings: &[Crossing], lane_width_m: f64) -> Vec<LaneChange> {
    let mut changes = by_crossings(track, crossings, lane_width_m);
    changes.retain(|change| change.lateral_shift_m >= MIN_ESTIMATED_SHIFT_M);
    changes
}

/// Returns the manoeuvre that a crossing belongs to, in the direction of the crossing.
///
/// Of the manoeuvres that contain the crossing, this is the manoeuvre with the highest peak; if
/// none contains it, the nearest manoeuvre.
fn manoeuvre_of<'m>(sampled: &Sampled<'_>, crossing: &Crossing, manoeuvres: &'m [Manoeuvre]) -> Option<&'m Manoeuvre> {
    let sample = sampled.sample(crossing.time);
    let outside = |manoeuvre: &Manoeuvre| (manoeuvre.start - sample).max(sample - manoeuvre.end).max(0.0);
    let candidates = manoeuvres
        .iter()
        .filter(|manoeuvre| manoeuvre.direction == crossing.direction() && outside(manoeuvre) <= OUTSIDE_SAMPLES);
    candidates.min_by(|a, b| outside(a).total_cmp(&outside(b)).then(b.peak_mps.total_cmp(&a.peak_mps)))
}

/// Returns the lane changes whose peak of lateral speed shifts the vehicle by most of a lane, in
/// order of time.
fn by_shift(track: &Trajectory, lane_width_m: f64) -> Vec<LaneChange> {
    let Some(sampled) = Sampled::new(track) else { return Vec::new() };
    let mut changes: Vec<LaneChange> = Vec::new();
    for manoeuvre in sweeps(manoeuvres(track, lane_width_m)) {
        let span = [manoeuvre.start, manoeuvre.end];
        let shift_m = sampled.shift_m(manoeuvre.direction, span);
        if !(shift_m >= MIN_SHIFT_M) {
            continue;
        }
        let markings = (shift_m / lane_width_m).round().max(1.0);
        let first_lane = sampled.point(manoeuvre.start).lane;
        let mut share = 0.5 / markings;
        let mut from = first_lane;
        while share < 1.0 {
            let sample = sampled.sample_of_share(share, span);
            let to = beside(from, manoeuvre.direction);
            let crossing = Crossing { time: Time::from_s(sampled.time_s(sample)), from, to };
            changes.push(lane_change(&sampled, &manoeuvre, height_share(track, lane_width_m), crossing));
            from = to;
            share += 1.0 / markings;
        }
    }
    changes.sort_by(|a, b| a.crossing_s.total_cmp(&b.crossing_s));
    changes
}

/// Returns the adjacent lane in `direction`. Lane 1 has none to its left; the result is then lane 1
/// itself.
pub(super) fn beside(lane: Lane, direction: Side) -> Lane {
    match direction {
        Side::Left => Lane(lane.0.saturating_sub(1).max(1)),
        Side::Right => Lane(lane.0.saturating_add(1)),
    }
}

fn lane_change(sampled: &Sampled<'_>, manoeuvre: &Manoeuvre, height_share: f64, crossing: Crossing) -> LaneChange {
    let track = sampled.track;
    let span = [manoeuvre.start, manoeuvre.end];
    let is_recorded = manoeuvre.start >= 0.0 && manoeuvre.end <= sampled.last();
    let lateral_shift_m = sampled.shift_m(manoeuvre.direction, span);
    let width_s = manoeuvre.width * PERIOD.s();
    LaneChange {
        track_id: track.track_id,
        vehicle_id: track.vehicle_id,
        vehicle_class: track.class,
        direction: manoeuvre.direction,
        from_lane: crossing.from.0,
        to_lane: crossing.to.0,
        start_s: sampled.time_s(manoeuvre.start),
        midpoint_s: sampled.time_s(sampled.sample_of_share(0.5, span)),
        crossing_s: crossing.time.s(),
        end_s: sampled.time_s(manoeuvre.end),
        duration_s: width_s / quintic_width_share(height_share),
        width_s,
        speed_mps: sampled.point(sampled.sample(crossing.time).round()).speed_mps,
        peak_speed_mps: sampled.peak_speed_mps(manoeuvre.direction, span),
        peak_lateral_speed_mps: manoeuvre.peak_mps,
        lateral_shift_m,
        overlapping: false,
        double: false,
        complete: is_recorded && lateral_shift_m >= MIN_SHIFT_M,
    }
}

#[cfg(test)]
mod tests {
    use closecall_traffic::maths;
    use proptest::prelude::*;

    use super::*;
    use crate::filters::smooth;
    use crate::trajectory_data::test_support::{changing_track, straight_track, trajectory_data_of};

    fn detected(track: Trajectory) -> Vec<LaneChange> {
        detect(&smooth(&trajectory_data_of(vec![track])))
    }

    #[test]
    fn lane_keeping_is_no_lane_change() {
        assert!(detected(straight_track(1, 0.0, 25.0, -1.75, 200)).is_empty());
    }

    #[test]
    fn a_swerve_within_the_lane_is_no_lane_change() {
        let mut track = straight_track(1, 0.0, 25.0, -1.75, 200);
        track.points.iter_mut().enumerate().for_each(|(k, point)| point.d_m += maths::sin(0.1 * k as f64));
        assert!(detected(track).is_empty());
    }

    #[test]
    fn both_lane_changes_of_an_overtaking_manoeuvre_are_detected() {
        let out = changing_track(1, (0.0, 30.0), (-5.25, -1.75), (4.0, 5.0), 300);
        let back = changing_track(1, (0.0, 30.0), (0.0, -3.5), (18.0, 6.0), 300);
        let mut track = out.clone();
        for (point, back) in track.points.iter_mut().zip(&back.points) {
            point.d_m += back.d_m;
            point.lane = Lane(if point.d_m > -3.5 { 1 } else { 2 });
        }
        let changes = detected(track);
        assert_eq!(changes.iter().map(|change| change.direction).collect::<Vec<_>>(), [Side::Left, Side::Right]);
        assert!(changes.iter().all(|change| change.complete));
        assert!((changes[0].crossing_s - 6.5).abs() <= 0.1 && (changes[1].crossing_s - 21.0).abs() <= 0.1);
        assert!((changes[0].duration_s - 5.0).abs() < 0.25 && (changes[1].duration_s - 6.0).abs() < 0.3);
    }

    #[test]
    fn a_lane_change_beyond_the_end_of_the_track_is_not_complete() {
        let changes = detected(changing_track(1, (0.0, 30.0), (-5.25, -1.75), (4.0, 6.0), 80));
        assert_eq!(changes.len(), 1);
        assert!(!changes[0].complete && (changes[0].crossing_s - 7.0).abs() <= 0.1);
    }

    #[test]
    fn a_track_that_begins_or_ends_at_the_peak_still_has_its_crossing() {
        let whole = changing_track(1, (0.0, 30.0), (-5.25, -1.75), (4.0, 6.0), 150);
        for range in [0..76, 64..150] {
            let changes = detected(whole.with_points(whole.points[range].to_vec()));
            assert_eq!(changes.len(), 1);
            assert!(!changes[0].complete && (changes[0].crossing_s - 7.0).abs() <= 0.1);
        }
    }

    #[test]
    fn one_manoeuvre_over_two_markings_is_two_lane_changes() {
        let changes = detected(changing_track(1, (0.0, 30.0), (-8.75, -1.75), (4.0, 9.0), 180));
        assert_eq!(
            changes.iter().map(|change| (change.from_lane, change.to_lane)).collect::<Vec<_>>(),
            [(3, 2), (2, 1)]
        );
        assert!(changes.iter().all(|change| !change.complete && change.double));
    }

    #[test]
    fn a_slow_lane_change_with_a_pause_is_one_without_lanes() {
        // Two moves by half a lane. The second begins before the first has ended.
        let mut track = changing_track(1, (0.0, 30.0), (-5.25, -3.5), (3.0, 5.0), 200);
        let second = changing_track(1, (0.0, 30.0), (0.0, 1.75), (6.5, 5.0), 200);
        for (point, second) in track.points.iter_mut().zip(&second.points) {
            point.d_m += second.d_m;
            point.lane = Lane(1);
        }
        let detector = LaneChangeDetector::new(LaneReliability::Unreliable, &Default::default());
        let changes = detector.detect(Criterion::Peak, &track, &[]);
        let [change] = &changes[..] else { panic!("{}", changes.len()) };
        assert!((change.lateral_shift_m - 3.5).abs() < 0.1 && (change.crossing_s - 7.25).abs() < 0.5, "{change:?}");
        assert!(change.start_s < 3.6 && change.end_s > 10.9, "{change:?}");
    }

    /// Detects two lane changes from lane 3 to lane 1. The second begins `pause_s` after the first
    /// has begun.
    fn two_to_the_left(pause_s: f64) -> Vec<LaneChange> {
        let mut track = changing_track(1, (0.0, 30.0), (-8.75, -5.25), (3.0, 4.0), 250);
        let second = changing_track(1, (0.0, 30.0), (0.0, 3.5), (3.0 + pause_s, 4.0), 250);
        for (point, second) in track.points.iter_mut().zip(&second.points) {
            point.d_m += second.d_m;
            point.lane = Lane((-point.d_m / 3.5).floor() as u8 + 1);
        }
        detected(track)
    }

    #[test]
    fn only_overlapping_lane_changes_are_double() {
        let double = |pause_s| -> Vec<_> {
            two_to_the_left(pause_s).iter().map(|change| (change.overlapping, change.double, change.complete)).collect()
        };
        assert_eq!(double(3.5), [(true, true, false); 2]);
        assert_eq!(double(7.0), [(false, false, true); 2]);
    }

    #[test]
    fn overlapping_lane_changes_that_end_in_an_inner_lane_are_not_double() {
        let track = |id, lanes, seconds| changing_track(id, (0.0, 30.0), lanes, (4.0, seconds), 180);
        let tracks = trajectory_data_of(vec![track(1, (-8.75, -1.75), 9.0), track(2, (-12.25, -8.75), 6.0)]);
        let changes = detect(&smooth(&tracks)).into_iter();
        let flags = changes.map(|change| (change.track_id, change.overlapping, change.double));
        assert_eq!(flags.collect::<Vec<_>>(), [(1, true, false), (1, true, false), (2, false, false)]);
    }

    #[test]
    fn the_midpoint_is_at_half_of_the_lateral_shift() {
        let changes = detected(changing_track(1, (0.0, 30.0), (-5.85, -2.35), (4.0, 6.0), 150));
        assert_eq!(changes.len(), 1);
        // The crossing is later than the midpoint, because the vehicle starts to the right of its
        // lane's centre.
        assert!((changes[0].midpoint_s - 7.0).abs() < 0.05 && changes[0].crossing_s > 7.4, "{:?}", changes[0]);
    }

    /// Detects one lane change by the distance criterion, with all lateral positions displaced by
    /// `offset_m`.
    fn by_distance_with_offset(offset_m: f64) -> Vec<LaneChange> {
        let mut track = changing_track(1, (0.0, 30.0), (-5.25, -1.75), (4.0, 6.0), 150);
        track.points.iter_mut().for_each(|point| point.d_m += offset_m);
        let markings =
            trajectory_data_of(vec![changing_track(2, (0.0, 30.0), (-5.25, -1.75), (4.0, 6.0), 150)]).markings;
        LaneChangeDetector::new(LaneReliability::Unreliable, &markings).detect(Criterion::Distance, &track, &[])
    }

    #[test]
    fn the_distance_criterion_measures_the_time_on_the_marking() {
        let changes = by_distance_with_offset(0.0);
        let [change] = &changes[..] else { panic!("{}", changes.len()) };
        assert!((change.crossing_s - 7.0).abs() < 0.21 && (change.midpoint_s - 7.0).abs() <= 0.1);
        assert_eq!((change.direction, change.from_lane, change.to_lane), (Side::Left, 2, 1));
        // 1.8 m of 3.5 m at 1.875 times the mean speed and less: at least 1.65 s.
        assert!((1.6..2.3).contains(&change.duration_s), "{}", change.duration_s);
        assert!(change.complete && change.lateral_shift_m > 3.0);
        assert_eq!(by_distance_with_offset(0.5).len(), 1);
        // With an offset above (3.5 − 1.8) / 2 the vehicle is in no lane.
        assert!(by_distance_with_offset(1.0).is_empty() && by_distance_with_offset(-1.0).is_empty());
    }

    #[test]
    fn flicker_of_the_recorded_lane_is_ignored() {
        let mut track = changing_track(1, (0.0, 30.0), (-5.25, -1.75), (4.0, 6.0), 150);
        for k in [20, 21, 68, 100] {
            track.points[k].lane = Lane(3 - track.points[k].lane.0);
        }
        assert_eq!(detected(track).len(), 1);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn durations_are_recovered_within_five_percent(
            start_s in 1.0_f64..4.0,
            duration_s in 2.0_f64..12.0,
            to_the_left in any::<bool>(),
        ) {
            let lanes = if to_the_left { (-5.25, -1.75) } else { (-1.75, -5.25) };
            let changes = detected(changing_track(7, (0.0, 30.0), lanes, (start_s, duration_s), 200));
            prop_assert_eq!(changes.len(), 1);
            prop_assert!(changes[0].complete);
            let error = (changes[0].duration_s - duration_s) / duration_s;
            prop_assert!(error.abs() < 0.05, "{} instead of {duration_s}", changes[0].duration_s);
            prop_assert!((changes[0].crossing_s - start_s - 0.5 * duration_s).abs() <= 0.11);
        }
    }
}
