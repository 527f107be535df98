//! Positions of the lane markings, derived from the recorded lanes.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;

use closecall_traffic::{Lane, Trajectory};
use serde::Serialize;

/// Lane width if the data gives none (m). It is the usual width on motorways in built-up areas and
/// lies between NGSIM's 3.4 m and the 3.75 m of motorways outside of them.
pub const DEFAULT_LANE_WIDTH_M: f64 = 3.5;

/// Lane widths that roads have (m): from the narrow lanes at roadworks, 2.5 m, to single-lane
/// ramps, 5.5 m. The lanes of motorways are 3.25 to 3.75 m wide.
pub const LANE_WIDTHS_M: RangeInclusive<f64> = 2.5..=5.5;

/// Least width of the strip without vehicles between two carriageways (m): three lanes of 3.75 m, the
/// widest of motorways (RAA 2008), may be empty on one carriageway. An assumption with a plausible
/// range of 8 to 20 m.
pub(super) const CARRIAGEWAY_GAP_M: f64 = 12.0;

/// A carriageway between known markings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct MarkedCarriageway {
    /// Number of its leftmost lane.
    pub(super) first: u8,
    /// Number of its rightmost lane.
    pub(super) last: u8,
    /// Lateral position of its left edge (m).
    pub(super) left_m: f64,
}

impl MarkedCarriageway {
    /// Returns true if `lane` is one of its lanes.
    pub(super) fn holds(&self, lane: u8) -> bool {
        (self.first..=self.last).contains(&lane)
    }
}

/// Lateral positions of lane markings.
///
/// A marking lies where the recorded lane of vehicles changes to the adjacent lane. Its position is
/// the median over all such changes, each taken halfway between its two frames. The left edge of
/// lane 1 is d = 0 by definition.
///
/// Vehicles that merge give positions beside the marking. Therefore only markings are used that
/// leave lanes of [`LANE_WIDTHS_M`] between them: of all such sets, the reader uses the set with
/// the most changes of lane.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LaneMarkings {
    /// Right edge of each lane (m), by lane number.
    right_edge_m: BTreeMap<u8, f64>,
    /// The markings that are not used.
    ignored: Vec<IgnoredMarking>,
}

/// A marking that is not used, because a lane beside it would be narrower or wider than lanes are.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct IgnoredMarking {
    /// The lane to the left of the marking.
    pub right_of_lane: u8,
    /// The lateral position of the marking (m).
    pub d_m: f64,
    /// Number of lane changes from which its position derives.
    pub crossings: usize,
}

impl std::fmt::Display for IgnoredMarking {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { right_of_lane, d_m, crossings } = self;
        write!(
            f,
            "the marking between lanes {right_of_lane} and {} at d = {d_m:.2} m, from {crossings} lane changes, is not used: a lane \
             beside it would not be {} to {} m wide",
            u16::from(*right_of_lane) + 1,
            LANE_WIDTHS_M.start(),
            LANE_WIDTHS_M.end(),
        )
    }
}

/// A marking as the lane changes show it.
#[derive(Clone, Copy, Debug)]
struct Observed {
    /// The lane to the left of it; 0 for the left edge of lane 1.
    left_lane: u8,
    d_m: f64,
    crossings: usize,
}

impl Observed {
    /// Returns true if the lanes between this marking and `right` have a plausible mean width.
    fn fits(&self, right: &Self) -> bool {
        right.left_lane > self.left_lane
            && LANE_WIDTHS_M.contains(&((self.d_m - right.d_m) / f64::from(right.left_lane - self.left_lane)))
    }
}

impl LaneMarkings {
    /// Derives the markings from the recorded lanes of `trajectories`.
    pub fn from_trajectories(trajectories: &[Trajectory]) -> Self {
        Self::from_tracks(trajectories.iter())
    }

    /// Works like [`LaneMarkings::from_trajectories`], for tracks that are not in one slice.
    pub fn from_tracks<'t>(trajectories: impl Iterator<Item = &'t Trajectory>) -> Self {
        let mut observer = MarkingObserver::default();
        trajectories.for_each(|track| observer.add(track));
        observer.finish()
    }

    /// Derives the markings from the positions of crossings, by the lane to their left.
    fn from_crossings(crossings: BTreeMap<u8, Vec<f64>>) -> Self {
        let edge = Observed { left_lane: 0, d_m: 0.0, crossings: 0 };
        let observed = crossings.into_iter().filter_map(|(left_lane, positions)| {
            let crossings = positions.len();
            Some(Observed { left_lane, d_m: median(positions)?, crossings })
        });
        let observed: Vec<Observed> = std::iter::once(edge).chain(observed).collect();
        let used = best_chain(&observed);
        let mut markings = Self::default();
        for (marking, is_used) in observed.iter().zip(used).skip(1) {
            let &Observed { left_lane, d_m, crossings } = marking;
            if is_used {
                markings.right_edge_m.insert(left_lane, d_m);
            } else {
                markings.ignored.push(IgnoredMarking { right_of_lane: left_lane, d_m, crossings });
            }
        }
        markings
    }

    /// Creates markings from the right edge of each lane (m), which the data states.
    pub fn from_right_edges(right_edges_m: impl IntoIterator<Item = (Lane, f64)>) -> Self {
        let right_edge_m = right_edges_m.into_iter().map(|(lane, edge_m)| (lane.0, edge_m)).collect();
        Self { right_edge_m, ignored: Vec::new() }
    }

    /// Returns the markings that are not used, from left to right.
    pub fn ignored(&self) -> &[IgnoredMarking] {
        &self.ignored
    }

    /// Returns the lateral position of the marking to the right of `lane` (m), or `None` if it is
    /// unknown.
    pub fn right_edge_m(&self, lane: Lane) -> Option<f64> {
        self.right_edge_m.get(&lane.0).copied()
    }

    /// Returns the lateral position of the marking to the left of `lane` (m), or `None` if it is
    /// unknown.
    pub fn left_edge_m(&self, lane: Lane) -> Option<f64> {
        if lane.0 == 1 { Some(0.0) } else { self.right_edge_m(Lane(lane.0.checked_sub(1)?)) }
    }

    /// Returns true if `lane` is the number that the readers leave out between two carriageways: its
    /// markings are the edges of both.
    pub fn is_median(&self, lane: Lane) -> bool {
        let edges = self.left_edge_m(lane).zip(self.right_edge_m(lane));
        lane.0 > 1 && edges.is_some_and(|(left_m, right_m)| left_m - right_m >= CARRIAGEWAY_GAP_M)
    }

    /// Returns the carriageways whose lanes have known markings, from left to right.
    pub(super) fn carriageways(&self) -> Vec<MarkedCarriageway> {
        let mut carriageways: Vec<MarkedCarriageway> = Vec::new();
        for &lane in self.right_edge_m.keys().filter(|lane| !self.is_median(Lane(**lane))) {
            let Some(left_m) = self.left_edge_m(Lane(lane)) else { continue };
            match carriageways.last_mut() {
                Some(carriageway) if carriageway.last + 1 == lane => carriageway.last = lane,
                _ => carriageways.push(MarkedCarriageway { first: lane, last: lane, left_m }),
            }
        }
        carriageways
    }

    /// Returns the width of `lane` (m), or `None` unless both of its markings are known and it lies
    /// in [`LANE_WIDTHS_M`].
    pub fn lane_width_m(&self, lane: Lane) -> Option<f64> {
        let width = self.left_edge_m(lane)? - self.right_edge_m(lane)?;
        LANE_WIDTHS_M.contains(&width).then_some(width)
    }

    /// Returns the median width of the lanes between neighbouring known markings (m), or
    /// [`DEFAULT_LANE_WIDTH_M`] if there are none. Lanes between which no marking is known share
    /// their width.
    pub fn typical_lane_width_m(&self) -> f64 {
        let edges = std::iter::once((0, 0.0)).chain(self.right_edge_m.iter().map(|(lane, d_m)| (*lane, *d_m)));
        let edges: Vec<(u8, f64)> = edges.collect();
        let widths = edges.windows(2).flat_map(|pair| {
            let lanes = pair[1].0.saturating_sub(pair[0].0);
            let width_m = (pair[0].1 - pair[1].1) / f64::from(lanes);
            std::iter::repeat_n(width_m, usize::from(lanes)).filter(|width_m| LANE_WIDTHS_M.contains(width_m))
        });
        median(widths.collect()).unwrap_or(DEFAULT_LANE_WIDTH_M)
    }
}

/// Gathers where recorded lanes change, one track after the other.
#[derive(Clone, Debug, Default)]
pub struct MarkingObserver {
    /// Positions of the crossings (m), by the lane to their left.
    crossings: BTreeMap<u8, Vec<f64>>,
}

impl MarkingObserver {
    /// Adds the crossings of a track.
    pub fn add(&mut self, track: &Trajectory) {
        for pair in track.points.windows(2) {
            let [before, after] = pair else { continue };
            if before.lane.0.abs_diff(after.lane.0) == 1 {
                let left = before.lane.0.min(after.lane.0);
                self.crossings.entry(left).or_default().push(0.5 * (before.d_m + after.d_m));
            }
        }
    }

    /// Derives the markings from the crossings.
    pub fn finish(self) -> LaneMarkings {
        LaneMarkings::from_crossings(self.crossings)
    }
}

/// Returns, for each of the markings from left to right, whether it belongs to the set with the
/// most lane changes in which all neighbours fit. Of two such sets the larger one counts; if both
/// are equal, the set further left.
fn best_chain(observed: &[Observed]) -> Vec<bool> {
    /// The best set that ends with a marking.
    #[derive(Clone, Copy)]
    struct Chain {
        crossings: usize,
        markings: usize,
        before: Option<usize>,
    }
    let mut chains: Vec<Chain> = Vec::with_capacity(observed.len());
    for marking in observed {
        let mut best = Chain { crossings: marking.crossings, markings: 1, before: None };
        for (index, (chain, left)) in chains.iter().zip(observed).enumerate() {
            let longer = (chain.crossings + marking.crossings, chain.markings + 1);
            if left.fits(marking) && longer > (best.crossings, best.markings) {
                best = Chain { crossings: longer.0, markings: longer.1, before: Some(index) };
            }
        }
        chains.push(best);
    }
    let mut used = vec![false; observed.len()];
    let rank = |index: &usize| (chains[*index].crossings, chains[*index].markings, std::cmp::Reverse(*index));
    let mut last = (0..chains.len()).max_by_key(rank);
    while let Some(index) = last {
        used[index] = true;
        last = chains[index].before;
    }
    used
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    let upper = *values.get(middle)?;
    Some(if values.len() % 2 == 1 { upper } else { 0.5 * (values[middle - 1] + upper) })
}

#[cfg(test)]
mod tests {
    use closecall_traffic::{Time, TrajectoryPoint, VehicleClass};

    use super::*;

    /// A track that changes from `lane` to the next lane at the lateral position `d_m`.
    fn crossing(lane: u8, d_m: f64) -> Trajectory {
        let point = |k: u8| TrajectoryPoint {
            time: Time::from_ms(100 * i64::from(k)),
            s_m: 2.0 * f64::from(k),
            d_m: d_m + 0.1 * (1.5 - f64::from(k)),
            speed_mps: 20.0,
            acceleration_mps2: 0.0,
            lateral_speed_mps: 0.0,
            lateral_acceleration_mps2: 0.0,
            lane: Lane(if k < 2 { lane } else { lane + 1 }),
        };
        let class = VehicleClass::Car;
        let dimensions = class.typical_dimensions();
        Trajectory { track_id: 1, vehicle_id: 1, class, dimensions, points: (0..4).map(point).collect() }
    }

    #[test]
    fn the_number_between_two_carriageways_is_no_lane() {
        let edges = [(1, -3.5), (2, -7.0), (3, -1_007.0), (4, -1_010.5)].map(|(lane, edge_m)| (Lane(lane), edge_m));
        let markings = LaneMarkings::from_right_edges(edges);
        let medians: Vec<u8> = (1..=5).filter(|lane| markings.is_median(Lane(*lane))).collect();
        assert_eq!(medians, [3]);
        let carriageways = [(1, 2, 0.0), (4, 4, -1_007.0)];
        let carriageways = carriageways.map(|(first, last, left_m)| MarkedCarriageway { first, last, left_m });
        assert_eq!(markings.carriageways(), carriageways);
    }

    #[test]
    fn a_merging_vehicle_does_not_make_a_narrow_lane() {
        // As in a window of US-101: one vehicle merges into lane 6 beside the marking.
        let tracks = [(3, -10.21), (5, -17.19), (5, -17.2), (5, -17.0), (6, -18.6)].map(|(lane, d)| crossing(lane, d));
        let markings = LaneMarkings::from_trajectories(&tracks);
        assert!((markings.typical_lane_width_m() - 3.403).abs() < 1e-3, "{}", markings.typical_lane_width_m());
        assert_eq!(markings.right_edge_m(Lane(6)), None);
        let [ignored] = markings.ignored() else { panic!("{:?}", markings.ignored()) };
        assert_eq!((ignored.right_of_lane, ignored.crossings), (6, 1));
        assert!(ignored.to_string().contains("lanes 6 and 7 at d = -18.60 m"), "{ignored}");
    }

    #[test]
    fn the_wrong_one_of_two_markings_is_ignored_wherever_it_is() {
        // The first marking is wrong, and one lane change shows it; the later lane changes agree
        // with each other.
        let tracks = [(1, -5.2), (2, -7.0), (2, -7.1), (3, -10.5)].map(|(lane, d)| crossing(lane, d));
        let markings = LaneMarkings::from_trajectories(&tracks);
        assert_eq!((markings.right_edge_m(Lane(1)), markings.right_edge_m(Lane(3))), (None, Some(-10.5)));
        assert!((markings.typical_lane_width_m() - 3.525).abs() < 1e-9, "{}", markings.typical_lane_width_m());
    }

    #[test]
    fn markings_lie_where_the_recorded_lane_changes() {
        let markings = LaneMarkings::from_trajectories(&[crossing(1, -3.4), crossing(1, -3.6), crossing(2, -7.1)]);
        assert!((markings.right_edge_m(Lane(1)).unwrap() + 3.5).abs() < 1e-9);
        assert!((markings.lane_width_m(Lane(2)).unwrap() - 3.6).abs() < 1e-9);
        assert_eq!(markings.lane_width_m(Lane(3)), None);
        assert!((markings.typical_lane_width_m() - 3.55).abs() < 1e-9);
        assert_eq!(LaneMarkings::default().typical_lane_width_m(), DEFAULT_LANE_WIDTH_M);
    }
}
