//! Finds the vehicles around a vehicle, lane by lane.

use closecall_controllers::{LaneNeighbours, Neighbour, Neighbours};
use closecall_traffic::metrics::bumper_gap_m;
use closecall_traffic::{Lane, Road, Side};

use super::World;

/// Smallest overlap with a lane at which a vehicle counts as being in it (m). A wheel on the marking does not count.
const LANE_OVERLAP_M: f64 = 0.2;
/// Lateral clearance below which two vehicles count as being in each other's path (m).
pub(super) const PATH_MARGIN_M: f64 = 0.1;

/// The lanes in which a vehicle has neighbours.
#[derive(Clone, Copy, Debug)]
pub(super) struct LanesAround {
    pub(super) own: Lane,
    pub(super) left: Option<Lane>,
    pub(super) right: Option<Lane>,
}

impl LanesAround {
    /// Returns the lanes around a vehicle at the lateral position `d_m`.
    pub(super) fn new(road: &Road, d_m: f64) -> Self {
        let own = road.lane_at(d_m);
        Self { own, left: road.beside(own, Side::Left), right: road.beside(own, Side::Right) }
    }

    /// Returns the neighbours before any is found.
    pub(super) fn nobody(&self) -> Neighbours {
        Neighbours {
            own: LaneNeighbours::default(),
            left: self.left.map(|_| LaneNeighbours::default()),
            right: self.right.map(|_| LaneNeighbours::default()),
            in_path: None,
            beyond: None,
        }
    }
}

/// Returns the vehicles around `actor`, which is compared with every other one. `half_width_m` is the function of this
/// name, or returns its values. [`super::search`] is faster if the neighbours of many vehicles are needed.
pub(super) fn find(world: &World, actor: usize, road: &Road, half_width_m: impl Fn(usize) -> f64) -> Neighbours {
    let LanesAround { own: own_lane, left, right } = LanesAround::new(road, world.state(actor).d_m);
    let mut around = LanesAround { own: own_lane, left, right }.nobody();
    for other in 0..world.len() {
        if other == actor {
            continue;
        }
        let candidate = Candidate::new(world, [actor, other], [actor, other].map(&half_width_m));
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
    around.beyond = beyond(world, actor, &around, &half_width_m);
    around
}

/// Returns the nearest vehicle ahead of the one that is ahead of `actor`, in the path of that one.
fn beyond(world: &World, actor: usize, around: &Neighbours, half_width_m: impl Fn(usize) -> f64) -> Option<Neighbour> {
    let ahead = ahead(around)?;
    let mut nearest = None;
    for other in 0..world.len() {
        keep_beyond(&mut nearest, world, [actor, ahead, other], &half_width_m);
    }
    nearest
}

/// Returns the vehicle ahead of the one with these neighbours.
pub(super) fn ahead(around: &Neighbours) -> Option<usize> {
    let candidates = [around.own.lead, around.in_path].into_iter().flatten();
    candidates.min_by(|a, b| a.gap_m.total_cmp(&b.gap_m)).map(|ahead| ahead.actor)
}

/// Puts a vehicle into `slot` if it is ahead of the vehicle ahead of `actor`, in its path, and nearer than the one there.
pub(super) fn keep_beyond(
    slot: &mut Option<Neighbour>,
    world: &World,
    [actor, ahead, other]: [usize; 3],
    half_width_m: impl Fn(usize) -> f64,
) {
    if other == actor || other == ahead {
        return;
    }
    let relative = |own: usize| Candidate::new(world, [own, other], [own, other].map(&half_width_m));
    let from_ahead = relative(ahead);
    if from_ahead.ahead_m > 0.0 && from_ahead.neighbour.gap_m >= 0.0 && from_ahead.is_in_path() {
        keep_nearest(slot, relative(actor).neighbour);
    }
}

pub(super) fn keep_nearest(slot: &mut Option<Neighbour>, candidate: Neighbour) {
    // Two vehicles at the same gap have different lateral positions, unless they overlap. The result therefore depends on the
    // list of actors only if they do.
    let order = |neighbour: &Neighbour| (neighbour.gap_m, neighbour.lateral_offset_m, neighbour.actor);
    if slot.is_none_or(|known| order(&candidate) < order(&known)) {
        *slot = Some(candidate);
    }
}

/// Another vehicle, relative to the vehicle whose neighbours are determined.
pub(super) struct Candidate {
    pub(super) neighbour: Neighbour,
    /// Distance along the road from centre to centre, positive ahead (m).
    ahead_m: f64,
    /// Lateral position of its right end (m).
    right_m: f64,
    /// Lateral position of its left end (m).
    left_m: f64,
    own_half_width_m: f64,
}

impl Candidate {
    /// Creates the second vehicle relative to the first. `half_widths_m` are those of [`half_width_m`].
    pub(super) fn new(world: &World, [actor, other]: [usize; 2], half_widths_m: [f64; 2]) -> Self {
        let (own, state) = (world.state(actor), world.state(other));
        let (own_size, size) = (world.vehicle(actor).dimensions, world.vehicle(other).dimensions);
        let ahead_m = state.s_m - own.s_m;
        let [own_half_width_m, half_width_m] = half_widths_m;
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
            own_half_width_m,
        }
    }

    fn is_in(&self, road: &Road, lane: Lane) -> bool {
        is_in(road, lane, [self.right_m, self.left_m])
    }

    pub(super) fn is_in_path(&self) -> bool {
        let half_width_m = 0.5 * (self.left_m - self.right_m);
        self.neighbour.lateral_offset_m.abs() < half_width_m + self.own_half_width_m + PATH_MARGIN_M
    }

    pub(super) fn insert_into(&self, lane: &mut LaneNeighbours) {
        if self.neighbour.gap_m < 0.0 {
            keep_nearest(&mut lane.alongside, self.neighbour);
        } else if self.ahead_m > 0.0 {
            keep_nearest(&mut lane.lead, self.neighbour);
        } else {
            keep_nearest(&mut lane.follower, self.neighbour);
        }
    }
}

/// Returns whether a vehicle between these lateral positions, of its right and of its left end, is in a lane.
pub(super) fn is_in(road: &Road, lane: Lane, [right_m, left_m]: [f64; 2]) -> bool {
    let centre_m = road.lane_centre_m(lane);
    let half_m = 0.5 * road.lane_width_m() - LANE_OVERLAP_M;
    right_m < centre_m + half_m && left_m > centre_m - half_m
}

/// Returns half of the extent of a vehicle's box across the road (m).
pub(super) fn half_width_m(world: &World, actor: usize) -> f64 {
    let (sin, cos) = world.state(actor).heading_rad.sin_cos();
    let size = world.vehicle(actor).dimensions;
    0.5 * (size.length_m * sin.abs() + size.width_m * cos.abs())
}
