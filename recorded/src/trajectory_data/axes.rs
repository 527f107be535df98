//! Checks whether the recorded lanes agree with the lateral positions. Options repair a file in
//! which they do not.
//!
//! Lane 1 is the leftmost lane, and `d` falls to the right. A file that counts its lanes from the
//! right, or whose lateral position points the other way, has every lane change on the wrong side.
//! If the layout states lane markings, each vehicle has to be between the markings of its lane.

use std::collections::{BTreeMap, BTreeSet};

use closecall_traffic::Lane;
use closecall_traffic::statistics::quantiles::median;

use super::error::TrajectoryFileProblem;
use super::estimated_lanes::{LEAST_RESULTANT, LEAST_VEHICLES, Period};
use super::markings::{LaneMarkings, MarkedCarriageway};
use super::plausible::MIN_SPEED_MPS;
use super::source::{ReadError, Row};
use crate::lane_change::LaneReliability;

/// Least number of rows of a lane whose position is judged.
const LEAST_ROWS: usize = 10;
/// Least distance between the middles of two lanes (m). Below it, the positions say nothing about
/// the order of the lanes.
const LEAST_DISTANCE_M: f64 = 1.0;

/// Number of pairs of neighbouring lanes against the order of their numbers, for each pair in order,
/// above which the lanes lie in the opposite order: ramps may have numbers beside the count.
const REVERSED: usize = 3;

/// Distance outside of its lane beyond which a vehicle is misplaced (m): above the errors of lane
/// numbers while a vehicle crosses a marking, below half a lane.
const MISPLACED_M: f64 = 0.5;
/// Share of a carriageway's rows with misplaced vehicles above which a reader of results is warned,
/// and the share above which the file is refused (-). Recordings of US-101 with the median markings
/// stay below 0.01; lane numbers that are wrong by one reach 0.3 to 1. Assumptions with plausible
/// ranges of 0.02 to 0.1 and 0.1 to 0.3.
const WARNED_SHARE: f64 = 0.05;
const REFUSED_SHARE: f64 = 0.2;

/// Median distance of the vehicles of a carriageway from the middles of their lanes above which a reader
/// of results is warned (m): a quarter of a lane. Drivers keep to the middle within a few decimetres. An
/// assumption with a plausible range of 0.6 to 1.2 m.
const SHIFTED_M: f64 = 0.9;

/// Distance to the left of its carriageway beyond which a vehicle is on another road (m): more than a
/// narrow shoulder beside the median. An assumption with a plausible range of 1 to 3 m.
const OUTSIDE_LEFT_M: f64 = 2.0;
/// The same to the right (m): more than a merging lane of 3.75 m and a shoulder of 3 m. An assumption
/// with a plausible range of 7 to 10 m.
const OUTSIDE_RIGHT_M: f64 = 8.0;

/// Directions of the file that differ from the documented ones.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AxisOptions {
    /// The lateral position points to the other side than the layout states.
    pub mirror_d: bool,
    /// Lane 1 is the rightmost lane.
    pub lanes_from_right: bool,
    /// The position along the road falls in the direction of travel.
    pub reverse_s: bool,
}

/// What turns the rows of a file into the documented directions.
#[derive(Clone, Debug, Default)]
pub(super) struct Axes {
    options: AxisOptions,
    /// The sum of the old and the new number of a lane that belongs to no marked carriageway.
    lane_sum: u8,
    /// The marked carriageways, each with the sum of the old and the new lateral position of a vehicle if
    /// positions are mirrored (m).
    carriageways: Vec<(MarkedCarriageway, f64)>,
}

impl Axes {
    /// Returns the choices of the options for a file that begins with `rows` and states `markings`.
    pub(super) fn new(options: AxisOptions, rows: &[Row], markings: Option<&LaneMarkings>) -> Self {
        let most = rows.iter().map(|row| row.lane).max().unwrap_or(0);
        let mut axes = Self { options, lane_sum: most.saturating_add(1), carriageways: Vec::new() };
        if let Some(markings) = markings {
            let of_road = |road: MarkedCarriageway| (road, mirror_m(&road, options, rows, markings));
            axes.carriageways = markings.carriageways().into_iter().map(of_road).collect();
        }
        axes
    }

    /// Turns a row. Lane 0, which means no lane, stays. Each marked carriageway is turned by itself.
    pub(super) fn turn(&self, row: &mut Row) {
        let carriageway = self.carriageways.iter().find(|(road, _)| road.holds(row.lane));
        if self.options.reverse_s {
            row.s_m = -row.s_m;
        }
        if self.options.mirror_d {
            row.d_m = carriageway.map_or(0.0, |(_, mirror_m)| *mirror_m) - row.d_m;
        }
        if self.options.lanes_from_right && row.lane > 0 {
            row.lane = from_left(carriageway.map(|(road, _)| road), self.lane_sum, row.lane);
        }
    }
}

/// Returns the number of a lane that is counted from the right.
fn from_left(carriageway: Option<&MarkedCarriageway>, lane_sum: u8, lane: u8) -> u8 {
    let sum = carriageway.map_or(lane_sum, |road| road.first.saturating_add(road.last));
    sum.saturating_sub(lane).max(1)
}

/// Returns the sum of the old and the new lateral position on a carriageway whose positions are mirrored
/// (m): twice its left edge, or, if the file is mirrored elsewhere, the sum that puts most vehicles into
/// the middles of their lanes.
fn mirror_m(road: &MarkedCarriageway, options: AxisOptions, rows: &[Row], markings: &LaneMarkings) -> f64 {
    let at_the_edge_m = 2.0 * road.left_m;
    let sum_m = |row: &Row| {
        let lane = if options.lanes_from_right { from_left(Some(road), 0, row.lane) } else { row.lane };
        let (left_m, right_m) = (markings.left_edge_m(Lane(lane))?, markings.right_edge_m(Lane(lane))?);
        Some(0.5 * (left_m + right_m) + row.d_m)
    };
    let sums_m: Vec<f64> = rows.iter().filter(|row| road.holds(row.lane)).filter_map(sum_m).collect();
    if !options.mirror_d || sums_m.is_empty() {
        return at_the_edge_m;
    }
    let usual_m = median(sums_m);
    if (usual_m - at_the_edge_m).abs() < LEAST_DISTANCE_M { at_the_edge_m } else { usual_m }
}

/// Rejects rows in which nearly all neighbouring lanes lie in the opposite order of their numbers, or,
/// if the recorded lanes count, more of them than in their order.
pub(super) fn check_order(
    rows: &[Row],
    markings: Option<&LaneMarkings>,
    reliability: LaneReliability,
) -> Result<(), ReadError> {
    let mut lanes: BTreeMap<u8, Vec<f64>> = BTreeMap::new();
    for row in rows.iter().filter(|row| row.lane > 0) {
        lanes.entry(row.lane).or_default().push(row.d_m);
    }
    let middles: Vec<(u8, f64)> = lanes
        .into_iter()
        .filter(|(_, positions)| positions.len() >= LEAST_ROWS)
        .map(|(lane, mut positions)| {
            let middle = positions.len() / 2;
            (lane, *positions.select_nth_unstable_by(middle, f64::total_cmp).1)
        })
        .collect();
    let (mut agree, mut contradict) = (0, 0);
    let mut wrong: Option<[(u8, f64); 2]> = None;
    // Ramps and bays have numbers beside the count: only neighbours are compared.
    for pair in middles.windows(2).filter(|pair| pair[0].0 + 1 == pair[1].0) {
        agree += usize::from(pair[0].1 - pair[1].1 > LEAST_DISTANCE_M);
        if pair[1].1 - pair[0].1 > LEAST_DISTANCE_M {
            contradict += 1;
            let first = wrong.filter(|[_, last]| last.0 == pair[0].0).map_or(pair[0], |[first, _]| first);
            wrong = Some([first, pair[1]]);
        }
    }
    let Some([first, last]) = wrong.filter(|_| contradict > agree) else { return Ok(()) };
    let carriageways = markings.map(LaneMarkings::carriageways).unwrap_or_default();
    let own = carriageways.iter().find(|road| road.holds(first.0));
    // To the right of the left edge, positions are negative.
    let is_mirrored = first.1 + last.1 > 2.0 * own.map_or(0.0, |road| road.left_m);
    let lanes = [first.0, last.0];
    let apart_m = last.1 - first.1;
    if contradict <= REVERSED * agree {
        return match reliability {
            LaneReliability::Reliable => {
                Err(ReadError::of_file(TrajectoryFileProblem::LanesOutOfOrder { lanes, apart_m }))
            }
            LaneReliability::Unreliable | LaneReliability::Estimated => Ok(()),
        };
    }
    Err(ReadError::of_file(TrajectoryFileProblem::LanesAgainstPosition { lanes, apart_m, is_mirrored }))
}

/// Rejects rows in which many vehicles are far beside their carriageway, in either lane at its edges.
pub(super) fn check_carriageways(rows: &[Row], markings: &LaneMarkings) -> Result<(), ReadError> {
    for road in markings.carriageways() {
        let Some(right_m) = markings.right_edge_m(Lane(road.last)) else { continue };
        let (mut outside, mut all) = (0_usize, 0_usize);
        for row in rows.iter().filter(|row| road.holds(row.lane)) {
            let is_outside = row.d_m > road.left_m + OUTSIDE_LEFT_M || row.d_m < right_m - OUTSIDE_RIGHT_M;
            outside += usize::from(is_outside);
            all += 1;
        }
        let share = outside as f64 / all.max(1) as f64;
        if all >= LEAST_ROWS && share > REFUSED_SHARE {
            let (lanes, percent) = ([road.first, road.last], 100.0 * share);
            return Err(ReadError::of_file(TrajectoryFileProblem::BesideCarriageway { lanes, percent }));
        }
    }
    Ok(())
}

/// Rejects rows in which many vehicles are not between the markings of their lane. Returns a warning
/// if some are not, or if most drive beside the middles of their lanes. To the side of a carriageway, a
/// vehicle counts as being in the lane at its edge.
pub(super) fn check_markings(rows: &[Row], markings: &LaneMarkings) -> Result<Option<String>, ReadError> {
    let mut warning = None;
    for road in markings.carriageways() {
        let MarkedCarriageway { first, last, .. } = road;
        let (mut misplaced, mut all) = (0_usize, 0_usize);
        let mut offsets_m = Vec::new();
        for row in rows.iter().filter(|row| road.holds(row.lane)) {
            let (left, right) = (markings.left_edge_m(Lane(row.lane)), markings.right_edge_m(Lane(row.lane)));
            let Some((left_m, right_m)) = left.zip(right) else { continue };
            let is_too_far_left = row.lane > first && row.d_m > left_m + MISPLACED_M;
            let is_too_far_right = row.lane < last && row.d_m < right_m - MISPLACED_M;
            misplaced += usize::from(is_too_far_left || is_too_far_right);
            offsets_m.push(row.d_m - 0.5 * (left_m + right_m));
            all += 1;
        }
        let share = misplaced as f64 / all.max(1) as f64;
        if all < LEAST_ROWS {
            continue;
        }
        if share <= WARNED_SHARE {
            warning = warning.or(shifted([first, last], median(offsets_m)));
            continue;
        }
        let problem = TrajectoryFileProblem::LanesBesideMarkings { lanes: [first, last], percent: 100.0 * share };
        if share > REFUSED_SHARE {
            return Err(ReadError::of_file(problem));
        }
        warning = warning.or(Some(problem.to_string()));
    }
    Ok(warning)
}

/// What becomes of lanes in which a reader places vehicles by their positions, if these are wrong.
pub(super) const MISPLACED: &str =
    "the positions or the lanes count from elsewhere, and lane changes are wrong or missing";

/// Returns the doubt about lanes in which a reader places vehicles by their positions: many vehicles drive beside
/// the road. Vehicles that stand there do not count.
pub(super) fn doubt_of_edges(rows: &[Row], markings: &LaneMarkings) -> Option<String> {
    markings.carriageways().into_iter().find_map(|road| {
        let MarkedCarriageway { first, last, .. } = road;
        let mut vehicles = BTreeSet::new();
        let (mut beside, mut all) = (0_usize, 0_usize);
        for row in rows.iter().filter(|row| road.holds(row.lane) && row.speed_mps > MIN_SPEED_MPS) {
            let (left, right) = (markings.left_edge_m(Lane(row.lane)), markings.right_edge_m(Lane(row.lane)));
            let Some((left_m, right_m)) = left.zip(right) else { continue };
            beside += usize::from(row.d_m > left_m + MISPLACED_M || row.d_m < right_m - MISPLACED_M);
            all += 1;
            vehicles.insert(row.number);
        }
        let percent = 100.0 * beside as f64 / all.max(1) as f64;
        (vehicles.len() >= LEAST_VEHICLES && percent > 100.0 * WARNED_SHARE).then(|| {
            format!(
                "in {percent:.0} % of the rows of lanes {first} to {last}, a vehicle drives more than {MISPLACED_M} m beside the lanes: \
                 {MISPLACED}"
            )
        })
    })
}

/// Returns the doubt about lanes in which a reader places vehicles by their positions: the vehicles as a whole drive
/// beside the middles of the lanes. They then cross markings while they keep their lanes, or change lanes that are
/// not there.
pub(super) fn doubt_of_middles(rows: &[Row], markings: &LaneMarkings) -> Option<String> {
    markings.carriageways().into_iter().find_map(|road| {
        let MarkedCarriageway { first, last, .. } = road;
        let mut vehicles = BTreeSet::new();
        let (mut offsets, mut widths_m) = (Vec::new(), Vec::new());
        for row in rows.iter().filter(|row| road.holds(row.lane)) {
            let (left, right) = (markings.left_edge_m(Lane(row.lane)), markings.right_edge_m(Lane(row.lane)));
            let Some((left_m, right_m)) = left.zip(right) else { continue };
            widths_m.push(left_m - right_m);
            offsets.push((row.d_m - 0.5 * (left_m + right_m)) / (left_m - right_m));
            vehicles.insert(row.number);
        }
        if vehicles.len() < LEAST_VEHICLES {
            return None;
        }
        // Offsets have no end: half a lane to the left of one middle is half a lane to the right of another.
        let Period { resultant, phase_m: lanes, .. } = Period::of(&offsets, 1.0..=1.0);
        let shift_m = median(widths_m) * if lanes > 0.5 { lanes - 1.0 } else { lanes };
        let side = if shift_m > 0.0 { "left" } else { "right" };
        (resultant >= LEAST_RESULTANT && shift_m.abs() > SHIFTED_M).then(|| {
            format!(
                "in lanes {first} to {last}, vehicles drive {:.1} m to the {side} of the middles of the lanes, on average: {MISPLACED}",
                shift_m.abs()
            )
        })
    })
}

/// Returns the warning for vehicles in `lanes` that drive `shift_m` to the left of the middles, if that is
/// far.
fn shifted(lanes: [u8; 2], shift_m: f64) -> Option<String> {
    let side = if shift_m > 0.0 { "left" } else { "right" };
    (shift_m.abs() > SHIFTED_M).then(|| {
        format!(
            "on the carriageway with the lanes {} to {}, vehicles drive {:.1} m to the {side} of the middles of their lanes, as the median: \
             the lane markings or the positions are wrong",
            lanes[0],
            lanes[1],
            shift_m.abs()
        )
    })
}

#[cfg(test)]
mod tests {
    use crate::trajectory_data::{AxisOptions, ReadOptions, TrajectoryFileProblem, open_from};
    use std::fmt::Write;
    use std::path::Path;

    const AS_DOCUMENTED: AxisOptions = AxisOptions { mirror_d: false, lanes_from_right: false, reverse_s: false };
    const FROM_RIGHT: AxisOptions = AxisOptions { lanes_from_right: true, ..AS_DOCUMENTED };
    const MIRRORED: AxisOptions = AxisOptions { mirror_d: true, ..AS_DOCUMENTED };

    /// Returns a file with two vehicles in two lanes.
    fn file(lanes: [u8; 2], to_the_right_m: [f64; 2]) -> String {
        let mut text =
            "track_id,frame,time_s,s_m,d_m,lane_id,speed_mps,accel_mps2,length_m,width_m,vehicle_class\n".to_owned();
        for (track, (lane, d_m)) in lanes.into_iter().zip(to_the_right_m).enumerate() {
            for frame in 0..20 {
                let (time_s, s_m) = (0.1 * f64::from(frame), 3.0 * f64::from(frame));
                writeln!(text, "{track},{frame},{time_s:.1},{s_m},{d_m},{lane},30,0,4.5,1.8,car").unwrap();
            }
        }
        text
    }

    fn read(text: &str, axes: AxisOptions) -> Result<Vec<(u8, f64)>, TrajectoryFileProblem> {
        let options = ReadOptions { axes, ..ReadOptions::default() };
        let tracks = open_from(text.as_bytes(), Path::new("a.csv"), options, usize::MAX);
        let data = tracks.and_then(|tracks| tracks.collect_all()).map_err(|error| error.problem)?;
        Ok(data.trajectories.iter().map(|track| (track.points[0].lane.0, track.points[0].d_m)).collect())
    }

    #[test]
    fn lanes_against_the_lateral_position_are_refused_and_the_named_option_mends_them() {
        let right = vec![(1, -1.875), (2, -5.625)];
        assert_eq!(read(&file([1, 2], [1.875, 5.625]), AS_DOCUMENTED).unwrap(), right);
        let from_right = file([2, 1], [1.875, 5.625]);
        let error = read(&from_right, AS_DOCUMENTED).unwrap_err();
        assert!(error.to_string().contains("from the right"), "{error}");
        assert_eq!(read(&from_right, FROM_RIGHT).unwrap(), right);
        let mirrored = file([1, 2], [-1.875, -5.625]);
        let error = read(&mirrored, AS_DOCUMENTED).unwrap_err();
        assert!(error.to_string().contains("points to the left"), "{error}");
        assert_eq!(read(&mirrored, MIRRORED).unwrap(), right);
        // The wrong option does not pass either.
        assert!(read(&file([1, 2], [1.875, 5.625]), MIRRORED).is_err());
    }
}
