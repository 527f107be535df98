//! Finds the neighbours of all vehicles, in a time that grows about linearly with their number.
//!
//! ```text
//!   lane 1   ──●──────●───────────●──▶ s      each lane has its vehicles in order along the road: a search starts at the
//!   lane 2   ─────●──────[own]────●──▶        own position, and goes on in both directions until no vehicle farther away
//!   lane 3   ●────────●──────●───────▶        can be nearer, bumper to bumper, than the one found
//! ```
//!
//! The result equals the result of [`super::neighbours::find`] to the bit.

use std::ops::RangeInclusive;

use closecall_controllers::{Looks, Neighbours};
use closecall_traffic::metrics::bumper_gap_m;
use closecall_traffic::{Lane, Road};

use super::World;
use super::neighbours::{
    self, Around, Candidate, Extent, LaneAround, LaneBand, LanesAround, Nearest, PATH_MARGIN_M, keep_beyond,
    keep_nearest,
};

/// Number of vehicles up to which it is faster to compare all pairs.
pub(super) const FEW: usize = 8;

/// A vehicle in a list that is sorted along the road.
#[derive(Clone, Copy, Debug)]
struct Entry {
    s_m: f64,
    actor: usize,
}

/// The vehicles of a road, sorted along it, lane by lane. The memory is reused from step to step.
#[derive(Debug, Default)]
pub(super) struct NeighbourSearch {
    /// Position and extent of each vehicle.
    extents: Vec<Extent>,
    /// All vehicles.
    order: Vec<Entry>,
    /// The vehicles in each lane. A vehicle may be in several.
    lanes: Vec<Vec<Entry>>,
    /// The vehicles whose path touches each strip. The strips are the lanes at their full width,
    /// and the areas beyond the road on both sides.
    strips: Vec<Vec<Entry>>,
    /// The strips that the path of each vehicle touches.
    touched: Vec<RangeInclusive<usize>>,
    /// For each vehicle, the number of vehicles of each lane, and then of each strip that it
    /// touches, that come before it in `order`.
    ranks: Vec<usize>,
    /// The lanes.
    bands: Vec<LaneBand>,
    /// Length of the longest vehicle (m).
    longest_m: f64,
    /// Number of pairs of vehicles that were compared.
    #[cfg(test)]
    visits: std::cell::Cell<usize>,
}

impl NeighbourSearch {
    /// Replaces `neighbours` by the vehicles around each vehicle, within the sight of each driver.
    pub(super) fn find_all(&mut self, world: &World, road: &Road, looks: &[Looks], neighbours: &mut [Neighbours]) {
        self.extents.clear();
        self.extents.extend((0..world.len()).map(|actor| Extent::of(world, actor)));
        // The lists hold lanes that have one place along the road.
        let few = world.len() <= FEW || road.has_changing_lanes();
        if !few {
            self.sort(road);
        }
        let mut around = Around::default();
        for ((actor, neighbours), looks) in neighbours.iter_mut().enumerate().zip(looks) {
            if few {
                neighbours::find(&self.extents, actor, road, *looks, &mut around);
            } else {
                self.find(actor, road, *looks, &mut around);
            }
            around.describe(world, neighbours);
        }
    }

    /// Sorts the vehicles into the lists.
    fn sort(&mut self, road: &Road) {
        let lanes = usize::from(road.lanes());
        self.lanes.resize_with(lanes, Vec::new);
        self.strips.resize_with(lanes + 2, Vec::new);
        self.lanes.iter_mut().chain(&mut self.strips).for_each(Vec::clear);
        self.longest_m = self.extents.iter().map(|extent| extent.length_m).fold(0.0, f64::max);
        if self.order.len() != self.extents.len() {
            self.order.clear();
            self.order.extend((0..self.extents.len()).map(|actor| Entry { s_m: 0.0, actor }));
        }
        // The order hardly changes from step to step, so that the list is almost sorted.
        for entry in &mut self.order {
            entry.s_m = self.extents[entry.actor].s_m;
        }
        self.order.sort_unstable_by(|a, b| a.s_m.total_cmp(&b.s_m).then(a.actor.cmp(&b.actor)));
        self.touched.clear();
        self.touched.extend(self.extents.iter().map(|extent| strips(road, extent.sides_m())));
        self.bands.clear();
        self.bands.extend((1..=road.lanes()).map(|lane| LaneBand::new(road, Lane(lane), 0.0)));
        let lists = self.lanes.len() + self.strips.len();
        self.ranks.resize(lists * self.extents.len(), 0);
        for &entry in &self.order {
            let ranks = &mut self.ranks[lists * entry.actor..][..lists];
            let (in_lanes, in_strips) = ranks.split_at_mut(self.lanes.len());
            let sides_m = self.extents[entry.actor].sides_m();
            for ((rank, list), band) in in_lanes.iter_mut().zip(&mut self.lanes).zip(&self.bands) {
                *rank = list.len();
                if band.contains(sides_m) {
                    list.push(entry);
                }
            }
            let touched = self.touched[entry.actor].clone();
            for (rank, list) in in_strips[touched.clone()].iter_mut().zip(&mut self.strips[touched]) {
                *rank = list.len();
                list.push(entry);
            }
        }
    }

    /// Returns the number of vehicles of a lane that come before a vehicle.
    fn rank_in_lane(&self, actor: usize, lane: usize) -> usize {
        self.ranks[(self.lanes.len() + self.strips.len()) * actor + lane]
    }

    /// Returns the vehicles of a strip whose centre is ahead of the centre of a vehicle, which
    /// touches the strip.
    fn ahead_in_strip(&self, actor: usize, strip: usize) -> &[Entry] {
        let rank = self.rank_in_lane(actor, self.lanes.len() + strip);
        let list = &self.strips[strip][rank..];
        let own_s_m = self.extents[actor].s_m;
        let level = list.iter().take_while(|entry| entry.s_m <= own_s_m).count();
        &list[level..]
    }

    /// Sets `around` to the vehicles around `actor`.
    fn find(&self, actor: usize, road: &Road, looks: Looks, around: &mut Around) {
        let lanes = LanesAround::new(road, &self.extents[actor], looks);
        lanes.clear(around);
        self.fill(actor, lanes.own, &mut around.own);
        if let (Some(lane), Some(slot)) = (lanes.left, &mut around.left) {
            self.fill(actor, lane, slot);
        }
        if let (Some(lane), Some(slot)) = (lanes.right, &mut around.right) {
            self.fill(actor, lane, slot);
        }
        for strip in self.touched[actor].clone() {
            self.fill_path(actor, self.ahead_in_strip(actor, strip), &mut around.in_path);
        }
        if looks.beyond
            && let Some(ahead) = around.ahead()
        {
            self.fill_beyond([actor, ahead], &mut around.beyond);
        }
    }

    /// Fills `slot` with the nearest vehicle in the path of `actor` that is ahead of the vehicle
    /// ahead.
    fn fill_beyond(&self, [actor, ahead]: [usize; 2], slot: &mut Option<Nearest>) {
        for strip in self.touched[actor].clone() {
            for entry in self.ahead_in_strip(actor, strip) {
                if self.is_beyond(actor, entry, slot) {
                    break;
                }
                #[cfg(test)]
                self.visits.set(self.visits.get() + 1);
                keep_beyond(slot, &self.extents, [actor, ahead, entry.actor]);
            }
        }
    }

    /// Fills `slot` with the neighbours of `actor` in a lane.
    fn fill(&self, actor: usize, lane: Lane, slot: &mut LaneAround) {
        let lane = usize::from(lane.0) - 1;
        // A vehicle at the same position along the road is alongside, whichever of the two comes
        // first.
        let (behind, ahead) = self.lanes[lane].split_at(self.rank_in_lane(actor, lane));
        for entry in ahead {
            if self.is_beyond(actor, entry, &slot.lead) {
                break;
            }
            self.visit(actor, entry, |candidate| candidate.insert_into(slot));
        }
        for entry in behind.iter().rev() {
            if self.is_beyond(actor, entry, &slot.follower) {
                break;
            }
            self.visit(actor, entry, |candidate| candidate.insert_into(slot));
        }
    }

    /// Fills `slot` with the nearest vehicle in the path of `actor`, of the vehicles that are
    /// `ahead`.
    fn fill_path(&self, actor: usize, ahead: &[Entry], slot: &mut Option<Nearest>) {
        for entry in ahead {
            if self.is_beyond(actor, entry, slot) {
                break;
            }
            self.visit(actor, entry, |candidate| {
                if candidate.is_in_path {
                    keep_nearest(slot, candidate.nearest);
                }
            });
        }
    }

    /// Returns whether a vehicle and all farther ones have a greater gap than the nearest neighbour
    /// so far.
    fn is_beyond(&self, actor: usize, entry: &Entry, nearest: &Option<Nearest>) -> bool {
        let extent = &self.extents[actor];
        let least_gap_m = bumper_gap_m((entry.s_m - extent.s_m).abs(), extent.length_m, self.longest_m);
        nearest.is_some_and(|nearest| nearest.gap_m < least_gap_m)
    }

    /// Calls `each` with another vehicle, relative to `actor`.
    fn visit(&self, actor: usize, entry: &Entry, each: impl FnOnce(Candidate)) {
        if entry.actor != actor {
            #[cfg(test)]
            self.visits.set(self.visits.get() + 1);
            each(Candidate::new(&self.extents, [actor, entry.actor]));
        }
    }
}

/// Returns the indices of the strips that the path of a vehicle between these lateral positions
/// touches. Two paths with a common point have a common strip, whatever the rounding, because the
/// index never falls to the right.
fn strips(road: &Road, [right_m, left_m]: [f64; 2]) -> RangeInclusive<usize> {
    let right_edge_m = road.right_edge_m();
    let strip = |d_m: f64| match road.lane_at(0.0, d_m) {
        _ if d_m > 0.0 => 0,
        _ if d_m < right_edge_m => usize::from(road.lanes()) + 1,
        Lane(lane) => usize::from(lane),
    };
    strip(left_m + PATH_MARGIN_M)..=strip(right_m - PATH_MARGIN_M)
}

#[cfg(test)]
mod tests {
    use closecall_traffic::{ActorId, PHYSICS_STEP, Vehicle, VehicleClass, VehicleState};
    use proptest::prelude::*;

    use super::super::state::InitialVehicle;
    use super::*;

    fn world(road: Road, vehicles: &[(VehicleClass, f64, f64, f64)]) -> World {
        let initial = |(index, &(class, s_m, d_m, heading_rad)): (usize, &(VehicleClass, f64, f64, f64))| {
            let state = VehicleState { s_m, d_m, heading_rad, speed_mps: 30.0, ..VehicleState::default() };
            let id = ActorId::new(&format!("v{index}")).unwrap();
            InitialVehicle {
                id,
                vehicle: Vehicle::typical(class),
                state,
                path: None,
                weave: None,
                has_ideal_actuators: false,
            }
        };
        World::new(road, 0.9, PHYSICS_STEP, vehicles.iter().enumerate().map(initial).collect())
    }

    fn vehicle() -> impl Strategy<Value = (VehicleClass, f64, f64, f64)> {
        // Positions on a grid: some vehicles overlap or are at the same position.
        let s_m = prop_oneof![(0..40_i32).prop_map(|cell| 5.0 * f64::from(cell)), 0.0..400.0_f64];
        let d_m = prop_oneof![prop::sample::select(vec![-1.875, -5.625, -9.375]), -14.0..3.0_f64];
        (prop::sample::select(VehicleClass::ALL.to_vec()), s_m, d_m, -0.3..0.3_f64)
    }

    proptest! {
        #[test]
        fn the_search_finds_what_comparing_all_pairs_finds(
            vehicles in prop::collection::vec(vehicle(), 1..30),
            widths_m in prop::sample::select(vec![[3.75; 3], [3.0, 3.75, 4.5], [4.5, 2.5, 3.25]]),
        ) {
            let road = Road::straight(3).with_lane_widths(&widths_m);
            let world = world(road.clone(), &vehicles);
            let mut neighbours = vec![Neighbours::default(); world.len()];
            let mut search = NeighbourSearch::default();
            for looks in [Looks::AROUND, Looks::AHEAD, Looks::AROUND] {
                search.find_all(&world, &road, &vec![looks; world.len()], &mut neighbours);
                for (actor, neighbours) in neighbours.iter().enumerate() {
                    let all = world.neighbours(actor);
                    let ahead = Neighbours { left: None, right: None, beyond: None, ..all };
                    prop_assert_eq!(*neighbours, if looks.adjacent { all } else { ahead });
                }
            }
        }
    }

    #[test]
    fn the_number_of_comparisons_grows_linearly_with_the_number_of_vehicles() {
        let road = Road::straight(3);
        let comparisons = |number: usize| {
            let vehicles: Vec<_> = (0..number)
                .map(|index| {
                    let class = if index % 7 == 0 { VehicleClass::Truck } else { VehicleClass::Car };
                    // Every eleventh vehicle changes lanes, and the others deviate from the centre
                    // of their lanes.
                    let d_m = -1.875 - 3.75 * (index % 3) as f64 + 0.1 * (index % 5) as f64;
                    let d_m = if index % 11 == 0 { d_m + 1.5 } else { d_m };
                    (class, 12.0 * index as f64, d_m, 0.0)
                })
                .collect();
            let world = world(road.clone(), &vehicles);
            let mut search = NeighbourSearch::default();
            let looks = vec![Looks::AROUND; number];
            search.find_all(&world, &road, &looks, &mut vec![Neighbours::default(); number]);
            search.visits.get()
        };
        let (few, many) = (comparisons(50), comparisons(500));
        assert!(many < 12 * few, "{few} comparisons for 50 vehicles, {many} for 500");
        assert!(many < 500 * 15, "{many} comparisons for 500 vehicles");
    }
}
