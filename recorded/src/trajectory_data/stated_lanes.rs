//! Lanes as files name them: which of them follow one another along the road.
//!
//! ```text
//!   edge a          junction :J_0     edge b
//!   a_1 ──────────▶ :J_0_1 ─────────▶ b_2        one strand
//!   a_0 ──────────▶ :J_0_0 ─────────▶ b_1        one strand
//!                        ramp_0 ────▶ b_0        one strand
//! ```
//!
//! A name holds for a piece of the road: an edge of SUMO, a link of Vissim, a lanelet of exiD. A
//! *strand* consists of the names that follow one another along the road. What vehicles do shows
//! which names follow one another, and not where the names lie: a position relative to a derived
//! road has errors, which add up from name to name.
//!
//! - **Edges with indices.** Lanes of one edge lie beside each other in the order of their indices.
//!   Vehicles that go from an edge to the next one show by how much the indices of the two edges
//!   differ: most of them keep their lane. Edges that are joined form a *chain*.
//! - **Lanelets.** Each is a single lane. Two of them follow one another if most vehicles that leave
//!   the one without a lane change enter the other, and most vehicles that enter the other come from
//!   the one. Lanelets that lie beside each other never do.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};

/// Share of the shorter one of two lanelets above which both cover the same part of the road, so
/// that they lie beside each other (-). Lanelets that follow one another overlap at their slanted
/// ends only. An assumption with a plausible range of 0.3 to 0.7.
const LEAST_SHARED: f64 = 0.5;

/// Share of the rows of an edge that is left out at either end of its reach (-): single positions may
/// be wrong.
const OUTLIERS: f64 = 0.02;

/// A lane as a file names it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct StatedLane {
    /// Number of the edge, the link or the lanelet.
    pub(super) edge: u64,
    /// Index of the lane in its edge, counted from the right; `None` if the edge is a single lane.
    pub(super) index: Option<i64>,
}

/// Lanes that follow one another along the road.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Strand {
    /// The edges that are joined; the order of lanes is known within them.
    pub(super) chain: u64,
    /// Number of the strand in its chain. It grows with the index.
    pub(super) number: i64,
}

/// The lane in which a row finds its vehicle.
#[derive(Clone, Copy, Debug)]
pub(super) struct LaneRow {
    pub(super) vehicle: u64,
    pub(super) lane: StatedLane,
    /// `true` if the vehicle leaves its lane in this row.
    pub(super) changes_lane: bool,
    /// Position along the reference line (m).
    pub(super) s_m: f64,
}

/// What rows show of the stated lanes of one direction of travel.
#[derive(Clone, Debug, Default)]
pub(super) struct LaneObserver {
    latest: Option<(u64, StatedLane)>,
    /// Number of vehicles that go from one lane to another without a lane change.
    successions: BTreeMap<(StatedLane, StatedLane), u64>,
    /// Pairs of lanes between which a vehicle changes lanes.
    neighbours: BTreeSet<(StatedLane, StatedLane)>,
    /// Number of rows of each edge, by metre along the road.
    reaches: BTreeMap<u64, BTreeMap<i64, u64>>,
}

/// Says that lanes of one edge continue in another edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Link {
    from: u64,
    to: u64,
    /// By how much the index falls from the one to the other.
    falls_by: i64,
}

/// The strands of one direction of travel.
#[derive(Clone, Debug, Default)]
pub(super) struct Strands {
    /// The strand of index 0 of each edge.
    edges: BTreeMap<u64, Strand>,
    /// The edges of each chain.
    chains: BTreeMap<u64, Vec<u64>>,
    neighbours: BTreeSet<(Strand, Strand)>,
}

impl LaneObserver {
    /// Adds a row. The rows of a vehicle have to follow one another.
    pub(super) fn add(&mut self, row: LaneRow) {
        let LaneRow { vehicle, lane, changes_lane, s_m } = row;
        let before = self.latest.replace((vehicle, lane)).filter(|(latest, _)| *latest == vehicle);
        if let Some((_, before)) = before
            && before != lane
        {
            if changes_lane {
                self.neighbours.insert((before, lane));
            } else {
                *self.successions.entry((before, lane)).or_default() += 1;
            }
        }
        #[expect(clippy::cast_possible_truncation, reason = "a float cast saturates")]
        let metre = s_m.floor() as i64;
        *self.reaches.entry(lane.edge).or_default().entry(metre).or_default() += 1;
    }

    /// Returns the strands that the rows show.
    pub(super) fn strands(&self) -> Strands {
        let is_by_index = self.successions.keys().any(|(from, _)| from.index.is_some());
        let mut links = self.links();
        if !is_by_index {
            links = mutual(&links);
        }
        let mut strands = Strands::apart(self.reaches.keys().copied());
        for link in links {
            strands.join(link);
        }
        let pairs = self.neighbours.iter();
        let pairs: Vec<(Strand, Strand)> =
            pairs.filter_map(|(from, to)| Some((strands.of_lane(*from)?, strands.of_lane(*to)?))).collect();
        strands.neighbours.extend(pairs.iter().flat_map(|&(from, to)| [(from, to), (to, from)]));
        strands
    }

    /// Returns the links between edges, the most frequent first.
    fn links(&self) -> Vec<Link> {
        let reaches: BTreeMap<u64, Reach> =
            self.reaches.iter().map(|(edge, metres)| (*edge, Reach::of_rows(metres))).collect();
        let is_beside = |from: &StatedLane, to: &StatedLane| match (reaches.get(&from.edge), reaches.get(&to.edge)) {
            (Some(a), Some(b)) => a.is_beside(*b),
            _ => false,
        };
        let mut votes: BTreeMap<Link, u64> = BTreeMap::new();
        for ((from, to), count) in &self.successions {
            if from.edge == to.edge || (from.index.is_none() && is_beside(from, to)) {
                continue;
            }
            let falls_by = from.index.unwrap_or_default().saturating_sub(to.index.unwrap_or_default());
            *votes.entry(Link { from: from.edge, to: to.edge, falls_by }).or_default() += count;
        }
        let mut ranked: Vec<(Link, u64)> = votes.into_iter().collect();
        ranked.sort_by_key(|(link, count)| (Reverse(*count), *link));
        ranked.into_iter().map(|(link, _)| link).collect()
    }
}

/// Returns the links, sorted by frequency, that are the most frequent one of both of their edges.
fn mutual(links: &[Link]) -> Vec<Link> {
    let (mut after, mut before) = (BTreeMap::new(), BTreeMap::new());
    for link in links {
        after.entry(link.from).or_insert(link.to);
        before.entry(link.to).or_insert(link.from);
    }
    let is_mutual = |link: &&Link| after.get(&link.from) == Some(&link.to) && before.get(&link.to) == Some(&link.from);
    links.iter().filter(is_mutual).copied().collect()
}

/// The part of the road that an edge covers (m along the road).
#[derive(Clone, Copy, Debug)]
struct Reach {
    from_m: f64,
    to_m: f64,
}

impl Reach {
    /// Returns the reach of an edge with these numbers of rows, by metre.
    fn of_rows(metres: &BTreeMap<i64, u64>) -> Self {
        let all = metres.values().sum::<u64>() as f64;
        let reached = |share: f64| {
            let mut rows = 0.0;
            let metre = metres.iter().find(|(_, count)| {
                rows += **count as f64;
                rows >= share * all
            });
            metre.map_or(0.0, |(metre, _)| *metre as f64)
        };
        Self { from_m: reached(OUTLIERS), to_m: reached(1.0 - OUTLIERS) }
    }

    fn is_beside(self, other: Self) -> bool {
        let shared_m = self.to_m.min(other.to_m) - self.from_m.max(other.from_m);
        let shorter_m = (self.to_m - self.from_m).min(other.to_m - other.from_m);
        shared_m > LEAST_SHARED * shorter_m
    }
}

impl Strands {
    /// Creates a chain for each edge.
    fn apart(edges: impl Iterator<Item = u64>) -> Self {
        let mut strands = Self::default();
        for edge in edges {
            strands.edges.insert(edge, Strand { chain: edge, number: 0 });
            strands.chains.insert(edge, vec![edge]);
        }
        strands
    }

    /// Joins the chains of two edges. Links between edges of one chain change nothing: more vehicles
    /// have shown how its edges lie.
    fn join(&mut self, link: Link) {
        let (Some(&from), Some(&to)) = (self.edges.get(&link.from), self.edges.get(&link.to)) else { return };
        if from.chain == to.chain {
            return;
        }
        let rises_by = from.number.saturating_add(link.falls_by).saturating_sub(to.number);
        let edges_of = |chain: u64| self.chains.get(&chain).map_or(0, Vec::len);
        // The edges of the shorter chain get other numbers.
        let (kept, moved, rises_by) = if edges_of(from.chain) >= edges_of(to.chain) {
            (from.chain, to.chain, rises_by)
        } else {
            (to.chain, from.chain, rises_by.saturating_neg())
        };
        let edges = self.chains.remove(&moved).unwrap_or_default();
        for edge in &edges {
            if let Some(strand) = self.edges.get_mut(edge) {
                *strand = Strand { chain: kept, number: strand.number.saturating_add(rises_by) };
            }
        }
        self.chains.entry(kept).or_default().extend(edges);
    }

    /// Returns the strand of a lane, or `None` if no row has shown its edge.
    pub(super) fn of_lane(&self, lane: StatedLane) -> Option<Strand> {
        let first = self.edges.get(&lane.edge)?;
        Some(Strand { number: first.number.saturating_add(lane.index.unwrap_or_default()), ..*first })
    }

    /// Returns `true` if a vehicle changes lanes between the two strands.
    pub(super) fn are_neighbours(&self, a: Strand, b: Strand) -> bool {
        self.neighbours.contains(&(a, b))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Visits lanes, `(edge, index)`, one after the other, 50 m each.
    fn drive(observer: &mut LaneObserver, vehicle: u64, lanes: &[(u64, Option<i64>)], changes: &[usize]) {
        for (k, (edge, index)) in lanes.iter().enumerate() {
            let lane = StatedLane { edge: *edge, index: *index };
            for step in 0..10_u32 {
                let s_m = 50.0 * k as f64 + 5.0 * f64::from(step);
                observer.add(LaneRow { vehicle, lane, changes_lane: step == 0 && changes.contains(&k), s_m });
            }
        }
    }

    #[test]
    fn indices_shift_where_a_ramp_enters_on_the_right() {
        let mut observer = LaneObserver::default();
        for vehicle in 0..5 {
            drive(&mut observer, vehicle, &[(1, Some(0)), (2, Some(0)), (3, Some(1))], &[]);
            drive(&mut observer, 10 + vehicle, &[(1, Some(1)), (2, Some(1)), (3, Some(2))], &[]);
            drive(&mut observer, 20 + vehicle, &[(7, Some(0)), (7, Some(0)), (3, Some(0))], &[]);
        }
        // One vehicle changes lanes exactly where edge 2 ends.
        drive(&mut observer, 30, &[(1, Some(1)), (2, Some(1)), (3, Some(1))], &[]);
        let strands = observer.strands();
        let of_lane = |edge, index| strands.of_lane(StatedLane { edge, index: Some(index) }).unwrap();
        assert_eq!(of_lane(1, 0), of_lane(3, 1));
        assert_eq!(of_lane(2, 1), of_lane(3, 2));
        assert_eq!(of_lane(7, 0), of_lane(3, 0));
        assert_eq!(strands.of_lane(StatedLane { edge: 9, index: Some(0) }), None);
    }

    #[test]
    fn lanelets_beside_each_other_are_no_strand_although_no_row_flags_the_lane_change() {
        let mut observer = LaneObserver::default();
        for vehicle in 0..5 {
            drive(&mut observer, vehicle, &[(1, None), (2, None), (3, None)], &[]);
            drive(&mut observer, 10 + vehicle, &[(11, None), (12, None), (13, None)], &[]);
        }
        // A lane change in the middle of a lanelet, and one where a lanelet ends.
        for (k, edge) in [1, 1, 11, 11].into_iter().enumerate() {
            let lane = StatedLane { edge, index: None };
            observer.add(LaneRow { vehicle: 30, lane, changes_lane: false, s_m: 12.0 * k as f64 });
        }
        drive(&mut observer, 31, &[(1, None), (12, None), (13, None)], &[]);
        let strands = observer.strands();
        let of_lanelet = |edge| strands.of_lane(StatedLane { edge, index: None }).unwrap();
        assert!(of_lanelet(1) == of_lanelet(2) && of_lanelet(2) == of_lanelet(3));
        assert!(of_lanelet(11) == of_lanelet(12) && of_lanelet(12) == of_lanelet(13));
        assert_ne!(of_lanelet(1), of_lanelet(11));
        assert!(!strands.are_neighbours(of_lanelet(1), of_lanelet(11)));
    }

    #[test]
    fn lanes_between_which_vehicles_change_are_neighbours() {
        let mut observer = LaneObserver::default();
        drive(&mut observer, 1, &[(1, None), (12, None)], &[1]);
        let strands = observer.strands();
        let of_lanelet = |edge| strands.of_lane(StatedLane { edge, index: None }).unwrap();
        assert!(strands.are_neighbours(of_lanelet(12), of_lanelet(1)) && of_lanelet(1) != of_lanelet(12));
    }
}
