//! Who is around a vehicle, lane by lane.

use closecall_controllers::{LaneNeighbours, Neighbour, Neighbours};
use closecall_traffic::metrics::bumper_gap_m;
use closecall_traffic::{Lane, Road, Side};

use super::World;

/// A box that reaches less than this into a lane does not count as being in it [m]: a wheel on the marking.
const LANE_OVERLAP_M: f64 = 0.2;
/// Boxes that pass each other at less than this lateral distance count as being in each other's path [m].
const PATH_MARGIN_M: f64 = 0.1;

/// The vehicles around `actor`.
pub(super) fn around(world: &World, actor: usize, road: &Road) -> Neighbours {
    let own_lane = road.lane_at(world.state(actor).d_m);
    let left = road.beside(own_lane, Side::Left);
    let right = road.beside(own_lane, Side::Right);
    let mut around = Neighbours {
        own: LaneNeighbours::default(),
        left: left.map(|_| LaneNeighbours::default()),
        right: right.map(|_| LaneNeighbours::default()),
        in_path: None,
    };
    for other in 0..world.len() {
        if other == actor {
            continue;
        }
        let seen = Seen::new(world, actor, other);
        if seen.is_in(road, own_lane) {
            seen.enter(&mut around.own);
        }
        if let (Some(lane), Some(slot)) = (left, &mut around.left)
            && seen.is_in(road, lane)
        {
            seen.enter(slot);
        }
        if let (Some(lane), Some(slot)) = (right, &mut around.right)
            && seen.is_in(road, lane)
        {
            seen.enter(slot);
        }
        if seen.is_in_path() && seen.ahead_m > 0.0 {
            keep_nearest(&mut around.in_path, seen.neighbour);
        }
    }
    around
}

fn keep_nearest(slot: &mut Option<Neighbour>, candidate: Neighbour) {
    // No two vehicles at the same gap have the same lateral position, unless they overlap: the order of the list decides
    // nothing.
    let order = |neighbour: &Neighbour| (neighbour.gap_m, neighbour.lateral_offset_m);
    if slot.is_none_or(|known| order(&candidate) < order(&known)) {
        *slot = Some(candidate);
    }
}

/// Another vehicle from a driver's point of view.
struct Seen {
    neighbour: Neighbour,
    /// Centre to centre along the road, positive ahead [m].
    ahead_m: f64,
    /// Lateral extent [m]: right and left end.
    reach_m: [f64; 2],
    own_half_width_m: f64,
}

impl Seen {
    fn new(world: &World, actor: usize, other: usize) -> Self {
        let (own, state) = (world.state(actor), world.state(other));
        let (own_size, size) = (world.vehicle(actor).dimensions, world.vehicle(other).dimensions);
        let ahead_m = state.s_m - own.s_m;
        let half_width_m = half_extent_across_m(size.length_m, size.width_m, state.heading_rad);
        let neighbour = Neighbour {
            actor: other,
            gap_m: bumper_gap_m(ahead_m.abs(), own_size.length_m, size.length_m),
            speed_mps: state.speed_mps,
            acceleration_mps2: state.acceleration_mps2,
            brake_light: state.brake_light,
            indicator: state.indicator,
            class: world.vehicle(other).class,
            length_m: size.length_m,
            width_m: size.width_m,
            lateral_offset_m: state.d_m - own.d_m,
        };
        Self {
            neighbour,
            ahead_m,
            reach_m: [state.d_m - half_width_m, state.d_m + half_width_m],
            own_half_width_m: half_extent_across_m(own_size.length_m, own_size.width_m, own.heading_rad),
        }
    }

    fn is_in(&self, road: &Road, lane: Lane) -> bool {
        let centre_m = road.lane_centre_m(lane);
        let half_m = 0.5 * road.lane_width_m() - LANE_OVERLAP_M;
        self.reach_m[0] < centre_m + half_m && self.reach_m[1] > centre_m - half_m
    }

    fn is_in_path(&self) -> bool {
        let half_width_m = 0.5 * (self.reach_m[1] - self.reach_m[0]);
        self.neighbour.lateral_offset_m.abs() < half_width_m + self.own_half_width_m + PATH_MARGIN_M
    }

    fn enter(&self, lane: &mut LaneNeighbours) {
        if self.neighbour.gap_m < 0.0 {
            keep_nearest(&mut lane.alongside, self.neighbour);
        } else if self.ahead_m > 0.0 {
            keep_nearest(&mut lane.lead, self.neighbour);
        } else {
            keep_nearest(&mut lane.follower, self.neighbour);
        }
    }
}

/// Half of what a box covers across the road [m].
fn half_extent_across_m(length_m: f64, width_m: f64, heading_rad: f64) -> f64 {
    let (sin, cos) = heading_rad.sin_cos();
    0.5 * (length_m * sin.abs() + width_m * cos.abs())
}
