//! Construction of roads from lanelets: a reference line for each road, and the lanes beside it.
//!
//! ```text
//!     ●───────────●───────────●    left bounds of the leftmost lanelets: the reference line, d = 0
//!     │  lane 1   │  lane 1   │
//!     ├───────────┼───────────┤    s ──▶
//!     │  lane 2   │  lane 2   │
//!     ●───────────●───────────●
//! ```
//!
//! Lanelets that are linked as successors, or that lie side by side in the same direction, form one
//! road. The reference line is the left bound of a chain of lanelets without a left neighbour. Of
//! all such chains, the reader takes the chain with the largest product of length and number of
//! lanes. It continues straight beyond both ends. A vehicle is in the lane of the lanelet that
//! contains its centre; lanes are counted from the left. If no lanelet of the chain contains the
//! centre (on a ramp, beside the road), the vehicle is in the lane whose middle is nearest.

use std::collections::{BTreeMap, BTreeSet};

use closecall_traffic::{Lane, maths};

use super::error::TrajectoryFileProblem;
use super::markings::LaneMarkings;
use super::reference_line::{Point, Projection, ReferenceLine};

/// Distance by which each road is shifted to the right of the previous one, so that their vehicles
/// never meet (m).
const SEPARATION_M: f64 = 1_000.0;

/// A section of a lane.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Lanelet {
    pub(super) left: Vec<Point>,
    pub(super) right: Vec<Point>,
    /// The lanelet to the left, if it has the same driving direction.
    pub(super) left_id: Option<i64>,
    /// The lanelet to the right, if it has the same driving direction.
    pub(super) right_id: Option<i64>,
    pub(super) successors: Vec<i64>,
}

/// A lanelet in the plane.
#[derive(Clone, Debug)]
struct MappedLanelet {
    id: i64,
    outline: Vec<Point>,
    successors: Vec<i64>,
}

/// The roads of a scenario.
#[derive(Clone, Debug, Default)]
pub(super) struct Roads {
    roads: Vec<Road>,
    /// Number of pairs of lanelets beside each other, and of those that lie on the other side than stated.
    pairs: usize,
    contrary_pairs: usize,
}

/// A position on one of the roads.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct RoadPosition {
    /// Position along the reference line (m).
    pub(super) s_m: f64,
    /// Lateral position, positive to the left (m).
    pub(super) d_m: f64,
    pub(super) lane: u8,
    /// Heading of the road at the position, in the plane of the scenario (rad).
    pub(super) heading_rad: f64,
    /// Whether a lanelet of the map is there.
    pub(super) is_on_map: bool,
}

#[derive(Clone, Debug)]
struct Road {
    line: ReferenceLine,
    /// Outlines of the lanelets beside the reference line, each with its lane, counted from 1 at
    /// the left.
    lanes: Vec<(u8, Vec<Point>)>,
    /// All lanelets of the road.
    lanelets: Vec<MappedLanelet>,
    /// Right edge of each lane beside the reference line (m).
    right_edges_m: Vec<f64>,
    /// Offset of the lane numbers, so that roads share no lane.
    first_lane: u8,
    /// Offset of the lateral position, so that roads do not meet (m).
    shift_m: f64,
}

impl Roads {
    /// Builds the roads that `lanelets` form, the largest first. Lanelets without extent are
    /// ignored.
    pub(super) fn from_lanelets(lanelets: &BTreeMap<i64, Lanelet>) -> Self {
        let mut by_length: Vec<(f64, Road)> =
            components(lanelets).iter().filter_map(|ids| road(lanelets, ids)).collect();
        by_length.sort_by(|a, b| b.0.total_cmp(&a.0));
        let (mut first_lane, mut shift_m) = (0_u8, 0.0);
        let mut roads = Vec::new();
        for (_, road) in by_length {
            let lanes = u8::try_from(road.right_edges_m.len()).unwrap_or(u8::MAX);
            let width_m = road.right_edges_m.last().copied().unwrap_or_default();
            roads.push(Road { first_lane, shift_m, ..road });
            first_lane = first_lane.saturating_add(lanes).saturating_add(1);
            shift_m += width_m - SEPARATION_M;
        }
        let pairs = neighbours(lanelets);
        let contrary_pairs = pairs.iter().filter(|(left, right)| lies_to_the_left(right, left)).count();
        Self { roads, pairs: pairs.len(), contrary_pairs }
    }

    /// Checks the sides of neighbours.
    ///
    /// # Errors
    /// Most of them lie on the other side than the map states.
    pub(super) fn check_neighbours(&self) -> Result<(), TrajectoryFileProblem> {
        let Self { pairs: all, contrary_pairs: contrary, .. } = *self;
        if 2 * contrary > all {
            return Err(TrajectoryFileProblem::NeighboursAgainstPosition { contrary, all });
        }
        Ok(())
    }

    pub(super) fn is_empty(&self) -> bool {
        self.roads.is_empty()
    }

    /// Returns the lane markings of all roads.
    pub(super) fn markings(&self) -> LaneMarkings {
        let of_road = |road: &Road| {
            let edges = road.right_edges_m.clone().into_iter().enumerate();
            let (first, shift_m) = (road.first_lane, road.shift_m);
            // The left edge of a later road's first lane is stored as the right edge of the omitted
            // lane before it.
            let left = (first > 0).then_some((Lane(first), shift_m));
            let lane = move |k: usize| Lane(first.saturating_add(u8::try_from(k + 1).unwrap_or(u8::MAX)));
            left.into_iter().chain(edges.map(move |(k, edge_m)| (lane(k), shift_m + edge_m))).collect::<Vec<_>>()
        };
        LaneMarkings::from_right_edges(self.roads.iter().flat_map(of_road))
    }

    /// Returns the index of the road on which a vehicle at `point` with `heading_rad` drives. The
    /// ranking prefers roads with the same driving direction, then roads with a lanelet at the
    /// point, then the nearest reference line.
    pub(super) fn road_at(&self, point: Point, heading_rad: f64) -> usize {
        let rank = |road: &Road| {
            let on = road.line.project(point);
            let is_against = maths::cos(heading_rad - on.heading_rad) < 0.0;
            (is_against, !road.holds(point), on.d_m.abs())
        };
        let ranked = self.roads.iter().map(rank).enumerate();
        let best = ranked.min_by(|(_, a), (_, b)| (a.0, a.1).cmp(&(b.0, b.1)).then(a.2.total_cmp(&b.2)));
        best.map_or(0, |(index, _)| index)
    }

    /// Returns the position of `point` on the given road.
    pub(super) fn locate(&self, road: usize, point: Point) -> Option<RoadPosition> {
        let road = self.roads.get(road)?;
        let Projection { s_m, d_m, heading_rad } = road.line.project(point);
        let inside = road.lanes.iter().find(|(_, outline)| contains(outline, point)).map(|(lane, _)| *lane);
        let lane = inside.unwrap_or_else(|| road.nearest_lane(d_m)).saturating_add(road.first_lane);
        let is_on_map = inside.is_some() || self.roads.iter().any(|road| road.holds(point));
        Some(RoadPosition { s_m, d_m: d_m + road.shift_m, lane, heading_rad, is_on_map })
    }

    /// Returns `true` if a vehicle that drives from `before` to `point` stays on its lanelet, or goes on to one that
    /// continues it.
    pub(super) fn goes_on(&self, before: Point, point: Point) -> bool {
        let at = |point: Point| self.roads.iter().flat_map(move |road| road.lanelets_at(point));
        let here: Vec<i64> = at(point).map(|lanelet| lanelet.id).collect();
        at(before).any(|lanelet| [lanelet.id].iter().chain(&lanelet.successors).any(|id| here.contains(id)))
    }
}

impl MappedLanelet {
    fn new(id: i64, lanelet: &Lanelet) -> Self {
        Self { id, outline: outline(lanelet), successors: lanelet.successors.clone() }
    }
}

impl Road {
    /// Returns its lanelets at `point`.
    fn lanelets_at(&self, point: Point) -> impl Iterator<Item = &MappedLanelet> {
        self.lanelets.iter().filter(move |lanelet| contains(&lanelet.outline, point))
    }

    /// Returns `true` if one of its lanelets is at `point`.
    fn holds(&self, point: Point) -> bool {
        self.lanelets_at(point).next().is_some()
    }

    /// Returns the lane whose middle is nearest to `d_m`.
    fn nearest_lane(&self, d_m: f64) -> u8 {
        let mut left_m = 0.0;
        let mut nearest = (f64::INFINITY, 1);
        for (k, right_m) in self.right_edges_m.iter().enumerate() {
            let off_m = (0.5 * (left_m + right_m) - d_m).abs();
            if off_m < nearest.0 {
                nearest = (off_m, u8::try_from(k + 1).unwrap_or(u8::MAX));
            }
            left_m = *right_m;
        }
        nearest.1
    }
}

/// Returns the pairs of lanelets beside each other, the left one first, as they are stated.
fn neighbours(lanelets: &BTreeMap<i64, Lanelet>) -> Vec<(&Lanelet, &Lanelet)> {
    let of_right = lanelets.values().filter_map(|left| Some((left, lanelets.get(&left.right_id?)?)));
    let of_left = lanelets.values().filter_map(|right| Some((lanelets.get(&right.left_id?)?, right)));
    of_right.chain(of_left).collect()
}

/// Returns `true` if a lanelet lies to the left of another one.
fn lies_to_the_left(lanelet: &Lanelet, of: &Lanelet) -> bool {
    let middle = |lanelet: &Lanelet| {
        let points = || lanelet.left.iter().chain(&lanelet.right);
        let count = points().count() as f64;
        (points().map(|point| point.0).sum::<f64>() / count, points().map(|point| point.1).sum::<f64>() / count)
    };
    let (Some(first), Some(last)) = (of.left.first(), of.left.last()) else { return false };
    let (here, there) = (middle(of), middle(lanelet));
    (last.0 - first.0) * (there.1 - here.1) - (last.1 - first.1) * (there.0 - here.0) > 0.0
}

/// Groups the lanelets that are linked as successors or lie side by side.
fn components(lanelets: &BTreeMap<i64, Lanelet>) -> Vec<BTreeSet<i64>> {
    let mut neighbours: BTreeMap<i64, Vec<i64>> = BTreeMap::new();
    for (id, lanelet) in lanelets {
        let joined = lanelet.successors.iter().chain(&lanelet.left_id).chain(&lanelet.right_id);
        for other in joined.filter(|other| lanelets.contains_key(other)) {
            neighbours.entry(*id).or_default().push(*other);
            neighbours.entry(*other).or_default().push(*id);
        }
    }
    let mut seen = BTreeSet::new();
    let mut components = Vec::new();
    for id in lanelets.keys() {
        let (mut component, mut open) = (BTreeSet::new(), vec![*id]);
        while let Some(id) = open.pop() {
            if seen.insert(id) {
                component.insert(id);
                open.extend(neighbours.get(&id).into_iter().flatten());
            }
        }
        if !component.is_empty() {
            components.push(component);
        }
    }
    components
}

/// Builds the road of one group of lanelets. Also returns its size, which is length times number of
/// lanes. Returns `None` if no lanelet has an extent.
fn road(lanelets: &BTreeMap<i64, Lanelet>, ids: &BTreeSet<i64>) -> Option<(f64, Road)> {
    let leftmost = |id: &&i64| lanelets.get(id).is_some_and(|lanelet| lanelet.left_id.is_none());
    let chains = ids.iter().filter(leftmost).map(|id| chain(lanelets, *id));
    let sized = chains.filter_map(|chain| {
        let line = reference_line(lanelets, &chain);
        let length_m = line.length_m()?;
        let lanes = chain.iter().map(|id| side_by_side(lanelets, *id).len()).max()?;
        Some((length_m * lanes as f64, chain, line))
    });
    let (size, chain, line) = sized.max_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)))?;
    let mut road = Road {
        line,
        lanes: Vec::new(),
        lanelets: ids.iter().filter_map(|id| Some(MappedLanelet::new(*id, lanelets.get(id)?))).collect(),
        right_edges_m: Vec::new(),
        first_lane: 0,
        shift_m: 0.0,
    };
    let mut edges_m: BTreeMap<u8, Vec<f64>> = BTreeMap::new();
    for id in &chain {
        for (k, lanelet) in side_by_side(lanelets, *id).into_iter().enumerate() {
            let lane = u8::try_from(k + 1).unwrap_or(u8::MAX);
            road.lanes.push((lane, outline(lanelet)));
            let right = lanelet.right.iter().map(|point| road.line.project(*point).d_m);
            edges_m.entry(lane).or_default().extend(right);
        }
    }
    road.right_edges_m = edges_m.into_values().filter_map(upper_median).collect();
    Some((size, road))
}

/// Returns the median, or the upper of the two middle values.
fn upper_median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

/// Returns the chain of lanelets that starts with `id`. Each next lanelet is a successor without a
/// left neighbour; the chain ends where there is none.
fn chain(lanelets: &BTreeMap<i64, Lanelet>, id: i64) -> Vec<i64> {
    let (mut chain, mut current) = (vec![id], id);
    while let Some(lanelet) = lanelets.get(&current) {
        let is_new = |id: &&i64| lanelets.contains_key(id) && !chain.contains(id);
        let is_leftmost = |id: &&i64| lanelets.get(id).is_some_and(|next| next.left_id.is_none());
        let mut next = lanelet.successors.iter().filter(is_new).filter(is_leftmost);
        let Some(next) = next.next() else { break };
        chain.push(*next);
        current = *next;
    }
    chain
}

/// Returns the lanelets side by side from `id` to the right.
fn side_by_side(lanelets: &BTreeMap<i64, Lanelet>, id: i64) -> Vec<&Lanelet> {
    let (mut seen, mut abreast, mut current) = (BTreeSet::new(), Vec::new(), Some(id));
    while let Some((id, lanelet)) = current.and_then(|id| Some((id, lanelets.get(&id)?))) {
        if !seen.insert(id) {
            break;
        }
        abreast.push(lanelet);
        current = lanelet.right_id;
    }
    abreast
}

/// Returns the reference line along the left bounds of a chain.
fn reference_line(lanelets: &BTreeMap<i64, Lanelet>, chain: &[i64]) -> ReferenceLine {
    let lanelets = chain.iter().filter_map(|id| lanelets.get(id));
    ReferenceLine::through(lanelets.flat_map(|lanelet| &lanelet.left).copied())
}

/// Returns the outline of a lanelet as a polygon.
fn outline(lanelet: &Lanelet) -> Vec<Point> {
    lanelet.left.iter().chain(lanelet.right.iter().rev()).copied().collect()
}

/// Returns `true` if `point` lies within the outline: a ray from it crosses the outline an odd
/// number of times.
fn contains(outline: &[Point], (x, y): Point) -> bool {
    let ends = outline.iter().skip(1).chain(outline.first());
    let crosses =
        |((x0, y0), (x1, y1)): (&Point, &Point)| (*y0 > y) != (*y1 > y) && x < x0 + (y - y0) / (y1 - y0) * (x1 - x0);
    outline.iter().zip(ends).filter(|edge| crosses(*edge)).count() % 2 == 1
}
