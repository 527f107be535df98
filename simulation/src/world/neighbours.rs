//! Finds the vehicles around a vehicle, lane by lane.

use closecall_controllers::{LaneNeighbours, Neighbour, Neighbours};
use closecall_traffic::metrics::bumper_gap_m;
use closecall_traffic::{Lane, Road, Side};

use super::World;

/// Smallest overlap with a lane at which a vehicle counts as being in it (m). A wheel on the marking does not count.
const LANE_OVERLAP_M: f64 = 0.2;
/// Lateral clearance below which two vehicles count as being in each other's path (m).
const PATH_MARGIN_M: f64 = 0.1;

/// Returns the vehicles around `actor`.
pub(super) fn find(world: &World, actor: usize, road: &Road) -> Neighbours {
    let own_lane = road.lane_at(world.state(actor).d_m);
    let left = road.beside(own_lane, Side::Left);
    let right = road.beside(own_lane, Side::Right);
    let mut around = Neighbours {
        own: LaneNeighbours::default(),
        left: left.map(|_| LaneNeighbours::default()),
        right: right.map(|_| LaneNeighbours::default()),
        in_path: None,
        beyond: None,
    };
    for other in 0..world.len() {
        if other == actor {
            continue;
        }
        let candidate = Candidate::new(world, actor, other);
        if candidate.is_in(road, own_lane) {
            candidate.insert_into(&mut around.own);
        }
        if let (Some(lane), Some(slot)) = (left, &mut around.left)
            && candidate.is_in(road, lane)
        {
            candidate.insert_into(slot);
        }
        if let (Some(lane), Some(slot)) = (right, &mut around.right)
            && candidate.is_in(road, lane)
        {
            candidate.insert_into(slot);
        }
        if candidate.is_in_path() && candidate.ahead_m > 0.0 {
            keep_nearest(&mut around.in_path, candidate.neighbour);
        }
    }
    around.beyond = beyond(world, actor, &around);
    around
}

/// Returns the nearest vehicle ahead of the one that is ahead of `actor`, in the path of that one.
fn beyond(world: &World, actor: usize, around: &Neighbours) -> Option<Neighbour> {
    let candidates = [around.own.lead, around.in_path].into_iter().flatten();
    let ahead = candidates.min_by(|a, b| a.gap_m.total_cmp(&b.gap_m))?;
    let mut nearest = None;
    for other in (0..world.len()).filter(|&other| other != actor && other != ahead.actor) {
        let from_ahead = Candidate::new(world, ahead.actor, other);
        if from_ahead.ahead_m > 0.0 && from_ahead.neighbour.gap_m >= 0.0 && from_ahead.is_in_path() {
            keep_nearest(&mut nearest, Candidate::new(world, actor, other).neighbour);
        }
    }
    nearest
}

fn keep_nearest(slot: &mut Option<Neighbour>, candidate: Neighbour) {
    // Two vehicles at the same gap have different lateral positions, unless they overlap. The result therefore does not
    // depend on the order of the list of actors.
    let order = |neighbour: &Neighbour| (neighbour.gap_m, neighbour.lateral_offset_m);
    if slot.is_none_or(|known| order(&candidate) < order(&known)) {
        *slot = Some(candidate);
    }
}

/// Another vehicle, relative to the vehicle whose neighbours are determined.
struct Candidate {
    neighbour: Neighbour,
    /// Distance along the road from centre to centre, positive ahead (m).
    ahead_m: f64,
    /// Lateral position of its right end (m).
    right_m: f64,
    /// Lateral position of its left end (m).
    left_m: f64,
    own_half_width_m: f64,
}

impl Candidate {
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
            right_m: state.d_m - half_width_m,
            left_m: state.d_m + half_width_m,
            own_half_width_m: half_extent_across_m(own_size.length_m, own_size.width_m, own.heading_rad),
        }
    }

    fn is_in(&self, road: &Road, lane: Lane) -> bool {
        let centre_m = road.lane_centre_m(lane);
        let half_m = 0.5 * road.lane_width_m() - LANE_OVERLAP_M;
        self.right_m < centre_m + half_m && self.left_m > centre_m - half_m
    }

    fn is_in_path(&self) -> bool {
        let half_width_m = 0.5 * (self.left_m - self.right_m);
        self.neighbour.lateral_offset_m.abs() < half_width_m + self.own_half_width_m + PATH_MARGIN_M
    }

    fn insert_into(&self, lane: &mut LaneNeighbours) {
        if self.neighbour.gap_m < 0.0 {
            keep_nearest(&mut lane.alongside, self.neighbour);
        } else if self.ahead_m > 0.0 {
            keep_nearest(&mut lane.lead, self.neighbour);
        } else {
            keep_nearest(&mut lane.follower, self.neighbour);
        }
    }
}

/// Returns half of the extent of a box across the road (m).
fn half_extent_across_m(length_m: f64, width_m: f64, heading_rad: f64) -> f64 {
    let (sin, cos) = heading_rad.sin_cos();
    0.5 * (length_m * sin.abs() + width_m * cos.abs())
}
