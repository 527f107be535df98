//! Rules that turn the rows of a vehicle into tracks: the clock of the file, gaps that are bridged,
//! jumps that split a track.
//!
//! | between two rows of a vehicle | becomes |
//! |---|---|
//! | the next frame | two points of one track |
//! | missing frames, for at most [`LONGEST_BRIDGE`] | interpolated points in between, which are counted |
//! | missing frames for longer | two tracks |
//! | a movement that no vehicle makes: a number that was given to another vehicle | two tracks; the jump is counted |

use std::collections::BTreeMap;

use closecall_traffic::Time;
use closecall_traffic::words::counted;
use serde::Serialize;

use super::data::MarkingDistances;
use super::source::{Clock, Row};
use crate::lane_change::{MIN_DWELL, is_stay};

/// Longest time that may be missing between two rows of one track. A car needs several times as long to
/// cross a marking.
pub(super) const LONGEST_BRIDGE: Time = Time::from_ms(500);

/// Mean duration of a lane change (s); see [`JUMP_ACROSS_MPS`].
#[expect(clippy::approx_constant, reason = "a measured duration, and no multiple of π")]
const LANE_CHANGE_S: f64 = 6.28;

/// Longest time without rows after which a vehicle is taken to have changed lanes once (s). A lane
/// change takes 6.28 s on average (see [`JUMP_ACROSS_MPS`]). An assumption with a plausible range of 5
/// to 15 s.
const LONGEST_HIDDEN: Time = Time::from_ms(10_000);
/// One in this number of lane changes may be hidden in a gap before a result is in doubt. An
/// assumption with a plausible range of 5 to 20.
const ONE_HIDDEN_IN: u64 = 10;

/// One in this number of lane changes may be cut off where a vehicle enters or leaves the recording
/// before a result is in doubt. In windows of US-101, at most one in five is cut off. An assumption with
/// a plausible range of 2 to 4.
const ONE_CUT_IN: u64 = 3;
/// Least number of lane changes that are cut off before a result is in doubt.
const LEAST_CUT: u64 = 3;

/// Excess over the recorded speed that makes a step along the road a jump (m/s). No vehicle is so
/// fast within one step; errors of NGSIM's positions stay below it.
pub(super) const JUMP_ALONG_MPS: f64 = 30.0;
/// Smallest jump along the road (m): less than the length of a car, so that two cars in one lane
/// are further apart.
pub(super) const JUMP_ALONG_M: f64 = 3.5;
/// Lateral speed of a jump (m/s). Lane changes take 6.28 s with a standard deviation of 2.0 s
/// (E. Olsen et al., "Analysis of Distribution, Frequency, and Duration of Naturalistic Lane
/// Changes", HFES 2002). On a quintic path over 3.75 m, a lane change that is shorter by two standard
/// deviations reaches 3.1 m/s for an instant. In the longest step that is bridged at 10 Hz, 0.6 s, the
/// limit is 1.8 m: less than the distance of two vehicles side by side.
pub(super) const JUMP_ACROSS_MPS: f64 = 3.0;
/// Smallest jump across the road (m): half a narrow lane, so that two vehicles side by side are
/// further apart. Errors of positions stay below it.
pub(super) const JUMP_ACROSS_M: f64 = 1.5;

/// The steps of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct FrameClock {
    /// Time between two rows of one vehicle.
    pub(super) period: Time,
    /// Difference of their frame numbers: 2 in a file with every second frame.
    pub(super) frames: i64,
}

impl FrameClock {
    /// Creates the clock of a file with every frame.
    pub(super) fn every_frame(period: Time) -> Self {
        Self { period, frames: 1 }
    }

    /// Returns the clock of `rows`, whose frames follow one another after `frame_period`.
    pub(super) fn of_rows(rows: &[Row], frame_period: Time) -> Self {
        let frames = usual_step(rows);
        Self { period: frame_period * frames, frames }
    }

    /// Returns the latest time at which a row continues a track whose last row is at `last`.
    pub(super) fn bridged_until(self, last: Time) -> Time {
        last + self.period + LONGEST_BRIDGE.max(Time::from_ns(self.period.ns() / 2))
    }
}

/// Returns the most frequent difference between the frame numbers of two successive rows of a
/// vehicle, or 1 if no vehicle has two rows.
fn usual_step(rows: &[Row]) -> i64 {
    let mut frames: Vec<(u64, Time, i64)> = rows.iter().map(|row| (row.number, row.origin, row.frame)).collect();
    frames.sort_unstable();
    let mut counts: BTreeMap<i64, usize> = BTreeMap::new();
    for pair in frames.windows(2) {
        let &[(number, origin, frame), (next_number, next_origin, next_frame)] = pair else { continue };
        if (number, origin) == (next_number, next_origin) && next_frame > frame {
            *counts.entry(next_frame - frame).or_default() += 1;
        }
    }
    // If several steps are equally frequent, the smallest counts.
    counts.into_iter().rev().max_by_key(|(_, count)| *count).map_or(1, |(step, _)| step)
}

/// How the rows of a file became tracks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Continuity {
    /// Vehicles, by their numbers in the file.
    pub vehicles: u64,
    /// Tracks: the vehicles, and the further pieces of split vehicles.
    pub pieces: u64,
    /// Gaps that were bridged.
    pub bridged_gaps: u64,
    /// Frames that were interpolated in these gaps.
    pub bridged_frames: u64,
    /// Number of movements that no vehicle makes. Each of them splits a track.
    pub jumps: u64,
    /// Rows that repeat another row in all values, and are left out.
    pub repeated_rows: u64,
    /// Changes of the recorded lane within a track.
    pub recorded_crossings: u64,
    /// Changes of the recorded lane in gaps that are not bridged: between two pieces of one vehicle.
    pub hidden_crossings: u64,
    /// Changes of the recorded lane within a track that are too near a gap or a jump to be followed. The
    /// gap or the jump splits the track of the vehicle.
    pub split_crossings: u64,
    /// Changes of the recorded lane within a track that are too near the first or the last row of the
    /// vehicle to be followed.
    pub edge_crossings: u64,
}

impl Continuity {
    /// Returns true if so many lane changes are hidden in gaps that a result is in doubt.
    pub fn hides_lane_changes(&self) -> bool {
        ONE_HIDDEN_IN * (self.hidden_crossings + self.split_crossings) > self.all_crossings()
            || self.cuts_lane_changes()
    }

    /// Returns true if so many lane changes are cut off where vehicles enter or leave the recording that
    /// a result is in doubt.
    fn cuts_lane_changes(&self) -> bool {
        self.edge_crossings >= LEAST_CUT && ONE_CUT_IN * self.edge_crossings > self.all_crossings()
    }

    /// Returns the share of the lane changes that jumps cut off (-), if it is so large that a result is in doubt.
    /// `recorded_s` is the duration of all tracks together (s).
    pub(super) fn cut_by_jumps(&self, recorded_s: f64) -> Option<f64> {
        let share = self.jumps as f64 * LANE_CHANGE_S / recorded_s;
        (self.jumps >= LEAST_CUT && ONE_HIDDEN_IN as f64 * share > 1.0).then_some(share.min(1.0))
    }

    fn all_crossings(&self) -> u64 {
        self.recorded_crossings + self.hidden_crossings
    }

    /// Returns warnings about gaps, jumps and lost lane changes, for a reader of results.
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        let split = self.pieces - self.vehicles;
        if 10 * split > self.vehicles {
            warnings.push(format!(
                "{} vehicles are recorded in {} pieces: a lane change that touches an end of a piece is incomplete",
                self.vehicles, self.pieces
            ));
        }
        if self.jumps > 0 {
            warnings.push(format!(
                "{} jumps that no vehicle makes. The track was split at each: a number may belong to several vehicles",
                self.jumps
            ));
        }
        if self.repeated_rows > 0 {
            let rows = counted(self.repeated_rows, "row");
            warnings.push(format!("left out: {rows} with the values of another row of the same vehicle and frame"));
        }
        if self.hidden_crossings > 0 {
            warnings.push(format!(
                "{} of {} changes of the recorded lane lie in gaps of more than {} s, in which no lane change can be followed",
                self.hidden_crossings,
                self.all_crossings(),
                LONGEST_BRIDGE.s()
            ));
        }
        if self.split_crossings > 0 {
            warnings.push(format!(
                "{} of {} changes of the recorded lane lie less than {} s before or after a gap or a jump that splits a track, where no \
                 lane change can be followed",
                self.split_crossings,
                self.all_crossings(),
                MIN_DWELL.s()
            ));
        }
        if self.cuts_lane_changes() {
            warnings.push(format!(
                "{} of {} changes of the recorded lane lie less than {} s after the first or before the last row of their vehicle, where \
                 no lane change can be followed: tracks have to begin before a lane change, and to end after it",
                self.edge_crossings,
                self.all_crossings(),
                MIN_DWELL.s()
            ));
        }
        if self.bridged_gaps > 0 {
            warnings.push(format!(
                "{} gaps of at most {} s were bridged by {} interpolated frames",
                self.bridged_gaps,
                LONGEST_BRIDGE.s(),
                self.bridged_frames
            ));
        }
        warnings
    }
}

/// The ends of a track that cut off a lane change: the recorded lane changes near the end, and the
/// track shows the vehicle in the lane beyond the change for less than the shortest stay in a lane.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct CutEnds {
    pub(super) start: bool,
    pub(super) end: bool,
}

impl CutEnds {
    /// Finds the cut ends in the rows of a track. Lane 0 means no lane.
    pub(super) fn of(rows: &[Row], period: Time) -> Self {
        let stays: Vec<&[Row]> = rows.chunk_by(|a, b| a.lane == b.lane).collect();
        let is_cut = |outer: &[Row], inner: &[Row]| {
            let are_lanes = [outer, inner].iter().all(|stay| stay.first().is_some_and(|row| row.lane > 0));
            are_lanes && !is_stay(period * outer.len() as i64)
        };
        let (&[first, second, ..], &[.., before_last, last]) = (&stays[..], &stays[..]) else { return Self::default() };
        let start = is_cut(first, second);
        // A single change of the lane counts once.
        let end = is_cut(last, before_last) && !(start && stays.len() == 2);
        Self { start, end }
    }
}

/// Returns true if no vehicle moves as from `before` to the later `row`.
pub(super) fn is_jump(before: &Row, row: &Row) -> bool {
    let step_s = (row.time - before.time).s();
    let along_m = row.s_m - before.s_m - 0.5 * (before.speed_mps + row.speed_mps) * step_s;
    let exceeds = |off_m: f64, mps: f64, least_m: f64| !(off_m.abs() <= (mps * step_s).max(least_m));
    // In a simulation a lane change may take a single step.
    let is_simulated_change = row.clock == Clock::Simulated && row.lane != before.lane;
    let across = !is_simulated_change && exceeds(row.d_m - before.d_m, JUMP_ACROSS_MPS, JUMP_ACROSS_M);
    exceeds(along_m, JUMP_ALONG_MPS, JUMP_ALONG_M) || across
}

/// Returns the latest time at which a row is compared with the last row of its vehicle, which is at
/// `last`.
pub(super) fn compared_until(last: Time) -> Time {
    last + LONGEST_HIDDEN
}

/// Returns true if a vehicle changes its recorded lane in the gap between `before` and the later `row`.
/// Lane 0 means no lane.
pub(super) fn hides_crossing(before: &Row, row: &Row) -> bool {
    let is_other_lane = before.lane != row.lane && before.lane > 0 && row.lane > 0;
    let is_soon = row.time > before.time && row.time <= compared_until(before.time);
    // In a simulation, another number is another road, whose lanes have other numbers.
    let is_same_road = row.clock != Clock::Simulated || row.number == before.number;
    is_other_lane && is_soon && is_same_road && !is_jump(before, row)
}

/// Returns the rows that are missing between two rows of a vehicle, or `None` if the gap is too
/// long to be bridged.
///
/// The position along the road follows the cubic polynomial with the recorded positions and speeds
/// at both ends. All other values are linear. A frame has the lane of the nearer row.
pub(super) fn bridge(before: &Row, row: &Row, clock: FrameClock) -> Option<Vec<Row>> {
    let step = row.time - before.time;
    if step > LONGEST_BRIDGE + clock.period {
        return None;
    }
    let steps = (step.ns() + clock.period.ns() / 2) / clock.period.ns();
    let missing = |k: i64| {
        let share = k as f64 / steps as f64;
        let mix = |from: f64, to: f64| from + share * (to - from);
        let cubic = {
            let (from_weight, to_weight) = (1.0 - share, share);
            let from_m = (1.0 + 2.0 * to_weight) * before.s_m + to_weight * step.s() * before.speed_mps;
            let to_m = (1.0 + 2.0 * from_weight) * row.s_m - from_weight * step.s() * row.speed_mps;
            from_weight * from_weight * from_m + to_weight * to_weight * to_m
        };
        let nearer = if 2 * k <= steps { before } else { row };
        Row {
            frame: before.frame + k * clock.frames,
            time: before.time + clock.period * k,
            s_m: cubic,
            d_m: mix(before.d_m, row.d_m),
            lane: nearer.lane,
            speed_mps: mix(before.speed_mps, row.speed_mps),
            acceleration_mps2: before.acceleration_mps2.zip(row.acceleration_mps2).map(|(from, to)| mix(from, to)),
            marking_distances: MarkingDistances::default(),
            line: row.line,
            ..*before
        }
    };
    Some((1..steps).map(missing).collect())
}

#[cfg(test)]
mod tests {
    use std::fmt::Write;
    use std::path::Path;

    use super::Continuity;
    use crate::trajectory_data::{ReadOptions, open_from};

    const HEADER: &str = "track_id,frame,time_s,s_m,d_m,lane_id,speed_mps,accel_mps2,length_m,width_m,vehicle_class\n";

    /// Reads five vehicles that enter lane 2 at frame 50 of 10 Hz, in the frames that `is_there` allows.
    fn read(is_there: impl Fn(i32) -> bool) -> Continuity {
        read_beside(0, is_there)
    }

    /// Reads the vehicles of [`read`], and in each lane `keepers` vehicles that keep their lane.
    fn read_beside(keepers: i32, is_there: impl Fn(i32) -> bool) -> Continuity {
        let mut text = HEADER.to_owned();
        for keeper in 1..=keepers {
            for (track, lane, d_m) in [(100 + keeper, 1, 1.875), (200 + keeper, 2, 5.625)] {
                for frame in (0..100).filter(|frame| is_there(*frame)) {
                    let (time_s, s_m) =
                        (0.1 * f64::from(frame), 500.0 + 60.0 * f64::from(keeper) + 3.0 * f64::from(frame));
                    writeln!(text, "{track},{frame},{time_s:.1},{s_m},{d_m},{lane},30,0,4.5,1.8,car").unwrap();
                }
            }
        }
        for track in 1..=5 {
            for frame in (0..100).filter(|frame| is_there(*frame)) {
                let (time_s, s_m) = (0.1 * f64::from(frame), 60.0 * f64::from(track) + 3.0 * f64::from(frame));
                let d_m = 1.875 + 3.75 * ((time_s - 3.0) / 4.0).clamp(0.0, 1.0);
                let lane = if frame < 50 { 1 } else { 2 };
                writeln!(text, "{track},{frame},{time_s:.1},{s_m},{d_m:.3},{lane},30,0,4.5,1.8,car").unwrap();
            }
        }
        let tracks = open_from(text.as_bytes(), Path::new("a.csv"), ReadOptions::default(), usize::MAX);
        tracks.unwrap().collect_all().unwrap().continuity
    }

    #[test]
    fn lane_changes_at_the_ends_of_tracks_are_counted_and_many_cause_doubt() {
        // In a short extract, vehicles that keep their lanes show where these lie.
        let short = read_beside(10, |frame| (46..52).contains(&frame));
        for cut in [read(|frame| frame >= 48), read(|frame| frame < 52), short] {
            assert_eq!((cut.recorded_crossings, cut.edge_crossings, cut.split_crossings), (5, 5, 0));
            assert!(
                cut.hides_lane_changes() && cut.warnings()[0].starts_with("5 of 5 changes"),
                "{:?}",
                cut.warnings()
            );
        }
        for whole in [read(|_| true), read(|frame| frame >= 45), read(|frame| frame < 55)] {
            assert_eq!((whole.recorded_crossings, whole.edge_crossings, whole.split_crossings), (5, 0, 0));
            assert!(!whole.hides_lane_changes() && whole.warnings().is_empty(), "{:?}", whole.warnings());
        }
    }

    #[test]
    fn lane_changes_beside_a_gap_are_counted() {
        // The gap begins 0.2 s after the change, or ends 0.2 s before it.
        for cut in [read(|frame| !(52..62).contains(&frame)), read(|frame| !(38..48).contains(&frame))] {
            assert_eq!((cut.pieces, cut.edge_crossings, cut.split_crossings, cut.hidden_crossings), (10, 0, 5, 0));
            assert!(cut.hides_lane_changes());
            assert!(
                cut.warnings().iter().any(|warning| warning.contains("before or after a gap")),
                "{:?}",
                cut.warnings()
            );
        }
        for beside in [read(|frame| !(55..65).contains(&frame)), read(|frame| !(35..45).contains(&frame))] {
            assert_eq!((beside.pieces, beside.split_crossings, beside.hidden_crossings), (10, 0, 0));
            assert!(!beside.hides_lane_changes(), "{:?}", beside.warnings());
        }
        // A gap of 0.2 s is bridged.
        assert_eq!(read(|frame| !(52..54).contains(&frame)).split_crossings, 0);
    }

    #[test]
    fn numbers_that_go_from_vehicle_to_vehicle_cause_doubt_and_a_swap_does_not() {
        // Ten vehicles in one lane, 40 m apart.
        let read = |number: &dyn Fn(i32, i32) -> i32| {
            let mut text = HEADER.to_owned();
            for (frame, vehicle) in (0..200).flat_map(|frame| (0..10).map(move |vehicle| (frame, vehicle))) {
                let (time_s, s_m) = (0.1 * f64::from(frame), 40 * vehicle + 3 * frame);
                let number = number(vehicle, frame);
                writeln!(text, "{number},{frame},{time_s:.1},{s_m},1.875,1,30,0,4.5,1.8,car").unwrap();
            }
            let tracks = open_from(text.as_bytes(), Path::new("a.csv"), ReadOptions::default(), usize::MAX);
            tracks.unwrap().collect_all().unwrap()
        };
        let shifted = read(&|vehicle, frame| (vehicle + frame / 50) % 10);
        assert_eq!(shifted.continuity.jumps, 30);
        let warning = "numbers are not unique for each vehicle";
        assert!(shifted.is_in_doubt && shifted.notes.iter().any(|note| note.ends_with(warning)), "{:?}", shifted.notes);
        let swapped = read(&|vehicle, frame| if frame >= 100 && vehicle < 2 { 1 - vehicle } else { vehicle });
        assert_eq!(swapped.continuity.jumps, 2);
        assert!(!swapped.is_in_doubt, "{:?}", swapped.notes);
    }

    #[test]
    fn few_lane_changes_at_the_ends_of_tracks_cause_no_doubt() {
        let edge = |recorded_crossings, edge_crossings| {
            Continuity { recorded_crossings, edge_crossings, ..Continuity::default() }.hides_lane_changes()
        };
        assert!(!edge(2, 2) && edge(3, 3) && !edge(9, 3) && edge(8, 3) && !edge(28, 4));
    }
}
