//! Finds the vehicles around a vehicle, lane by lane.

use closecall_controllers::{LaneNeighbours, Looks, Neighbour, Neighbours};
use closecall_traffic::metrics::bumper_gap_m;
use closecall_traffic::{Lane, Road, Side, maths};

use super::World;

/// Smallest overlap with a lane at which a vehicle counts as being in it (m). A wheel on the
/// marking does not count.
const LANE_OVERLAP_M: f64 = 0.2;
/// Lateral clearance below which two vehicles count as being in each other's path (m).
pub(super) const PATH_MARGIN_M: f64 = 0.1;

/// Position and extent of a vehicle on the road.
#[derive(Clone, Copy, Debug)]
pub(super) struct Extent {
    pub(super) s_m: f64,
    pub(super) d_m: f64,
    pub(super) length_m: f64,
    /// Half of the extent of its box across the road (m).
    half_width_m: f64,
}

impl Extent {
    pub(super) fn of(world: &World, actor: usize) -> Self {
        let (state, size) = (world.state(actor), world.vehicle(actor).dimensions);
        let half_width_m = if state.heading_rad == 0.0 {
            0.5 * size.width_m
        } else {
            let (sin, cos) = maths::sin_cos(state.heading_rad);
            0.5 * (size.length_m * sin.abs() + size.width_m * cos.abs())
        };
        Self { s_m: state.s_m, d_m: state.d_m, length_m: size.length_m, half_width_m }
    }

    /// Returns the lateral positions of the right and of the left end (m).
    pub(super) fn sides_m(&self) -> [f64; 2] {
        [self.d_m - self.half_width_m, self.d_m + self.half_width_m]
    }
}

/// A lane as neighbours see it: a vehicle is in it that reaches between these lateral positions
/// (m).
#[derive(Clone, Copy, Debug)]
pub(super) struct LaneBand {
    right_m: f64,
    left_m: f64,
}

impl LaneBand {
    /// Creates the lane at a position along the road.
    pub(super) fn new(road: &Road, lane: Lane, s_m: f64) -> Self {
        let centre_m = road.lane_centre_m(lane, s_m);
        let half_m = 0.5 * road.lane_width_m(lane, s_m) - LANE_OVERLAP_M;
        Self { right_m: centre_m - half_m, left_m: centre_m + half_m }
    }

    /// Returns whether a vehicle between these lateral positions, of its right and of its left end,
    /// is in the lane.
    pub(super) fn contains(&self, [right_m, left_m]: [f64; 2]) -> bool {
        right_m < self.left_m && left_m > self.right_m
    }
}

/// The lanes in which a vehicle has neighbours.
#[derive(Clone, Copy, Debug)]
pub(super) struct LanesAround {
    pub(super) own: Lane,
    pub(super) left: Option<Lane>,
    pub(super) right: Option<Lane>,
}

impl LanesAround {
    /// Returns the lanes around a vehicle within the sight of its driver. A lane that is too narrow
    /// for vehicles beside the vehicle is none of them.
    pub(super) fn new(road: &Road, vehicle: &Extent, looks: Looks) -> Self {
        let lane = road.lane_at(vehicle.s_m, vehicle.d_m);
        let is_open = |beside: &Lane| road.is_open(*beside, [vehicle.s_m; 2]);
        let beside = |side| if looks.adjacent { road.beside(lane, side).filter(is_open) } else { None };
        Self { own: lane, left: beside(Side::Left), right: beside(Side::Right) }
    }

    /// Sets `around` to the neighbours before any is found.
    pub(super) fn clear(&self, around: &mut Around) {
        around.own = LaneAround::default();
        around.left = self.left.map(|_| LaneAround::default());
        around.right = self.right.map(|_| LaneAround::default());
        around.in_path = None;
        around.beyond = None;
    }
}

/// A vehicle that is the nearest so far.
#[derive(Clone, Copy, Debug)]
pub(super) struct Nearest {
    pub(super) actor: usize,
    /// Gap, bumper to bumper (m).
    pub(super) gap_m: f64,
    /// Lateral position relative to the own vehicle (m).
    lateral_offset_m: f64,
}

impl Nearest {
    #[inline]
    fn neighbour(&self, world: &World) -> Neighbour {
        let (state, vehicle) = (world.state(self.actor), world.vehicle(self.actor));
        Neighbour {
            actor: self.actor,
            gap_m: self.gap_m,
            speed_mps: state.speed_mps,
            acceleration_mps2: state.acceleration_mps2,
            brake_light: state.brake_light,
            indicator: state.indicator,
            class: vehicle.class,
            length_m: vehicle.dimensions.length_m,
            width_m: vehicle.dimensions.width_m,
            lateral_offset_m: self.lateral_offset_m,
        }
    }
}

/// The nearest vehicles in one lane.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct LaneAround {
    pub(super) lead: Option<Nearest>,
    pub(super) follower: Option<Nearest>,
    alongside: Option<Nearest>,
}

impl LaneAround {
    fn describe(&self, world: &World, neighbours: &mut LaneNeighbours) {
        describe(self.lead, world, &mut neighbours.lead);
        describe(self.follower, world, &mut neighbours.follower);
        describe(self.alongside, world, &mut neighbours.alongside);
    }
}

/// Writes the state of the nearest vehicle to `neighbour`.
fn describe(nearest: Option<Nearest>, world: &World, neighbour: &mut Option<Neighbour>) {
    *neighbour = nearest.map(|nearest| nearest.neighbour(world));
}

/// The nearest vehicles around a vehicle: what [`Neighbours`] describes in full.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Around {
    pub(super) own: LaneAround,
    pub(super) left: Option<LaneAround>,
    pub(super) right: Option<LaneAround>,
    pub(super) in_path: Option<Nearest>,
    pub(super) beyond: Option<Nearest>,
}

impl Around {
    /// Returns the vehicle ahead: the nearer of the lead vehicle and the one in the path.
    pub(super) fn ahead(&self) -> Option<usize> {
        let candidates = [self.own.lead, self.in_path].into_iter().flatten();
        candidates.min_by(|a, b| a.gap_m.total_cmp(&b.gap_m)).map(|ahead| ahead.actor)
    }

    /// Writes the states of the vehicles to `neighbours`.
    pub(super) fn describe(&self, world: &World, neighbours: &mut Neighbours) {
        self.own.describe(world, &mut neighbours.own);
        for (lane, slot) in [(&self.left, &mut neighbours.left), (&self.right, &mut neighbours.right)] {
            match lane {
                Some(lane) => lane.describe(world, slot.get_or_insert_default()),
                None => *slot = None,
            }
        }
        describe(self.in_path, world, &mut neighbours.in_path);
        describe(self.beyond, world, &mut neighbours.beyond);
    }
}

/// Sets `around` to the vehicles around `actor`, which is compared with every other one.
/// [`super::search`] is faster if there are many vehicles.
pub(super) fn find(extents: &[Extent], actor: usize, road: &Road, looks: Looks, around: &mut Around) {
    let lanes = LanesAround::new(road, &extents[actor], looks);
    lanes.clear(around);
    let band_at = |lane, s_m| LaneBand::new(road, lane, s_m);
    let band = |lane| band_at(lane, extents[actor].s_m);
    let (mut own_lane, mut left, mut right) = (band(lanes.own), lanes.left.map(band), lanes.right.map(band));
    for other in (0..extents.len()).filter(|other| *other != actor) {
        let candidate = Candidate::new(extents, [actor, other]);
        let sides_m = extents[other].sides_m();
        if road.has_changing_lanes() {
            // A lane is elsewhere beside the other vehicle.
            let band = |lane| band_at(lane, extents[other].s_m);
            (own_lane, left, right) = (band(lanes.own), lanes.left.map(band), lanes.right.map(band));
        }
        if own_lane.contains(sides_m) {
            candidate.insert_into(&mut around.own);
        }
        for (band, slot) in [(&left, &mut around.left), (&right, &mut around.right)] {
            if let (Some(band), Some(slot)) = (band, slot)
                && band.contains(sides_m)
            {
                candidate.insert_into(slot);
            }
        }
        if candidate.is_in_path && candidate.ahead_m > 0.0 {
            keep_nearest(&mut around.in_path, candidate.nearest);
        }
    }
    if looks.beyond
        && let Some(ahead) = around.ahead()
    {
        for other in 0..extents.len() {
            keep_beyond(&mut around.beyond, extents, [actor, ahead, other]);
        }
    }
}

/// Puts a vehicle into `slot` if it is in the path of `actor`, ahead of the vehicle ahead, and
/// nearer than the one there.
pub(super) fn keep_beyond(slot: &mut Option<Nearest>, extents: &[Extent], [actor, ahead, other]: [usize; 3]) {
    if other == actor || other == ahead {
        return;
    }
    let from_ahead = Candidate::new(extents, [ahead, other]);
    let candidate = Candidate::new(extents, [actor, other]);
    if from_ahead.ahead_m > 0.0 && from_ahead.nearest.gap_m >= 0.0 && candidate.is_in_path {
        keep_nearest(slot, candidate.nearest);
    }
}

pub(super) fn keep_nearest(slot: &mut Option<Nearest>, candidate: Nearest) {
    // Two vehicles at the same gap have different lateral positions, unless they overlap. The
    // result therefore depends on the list of actors only if they do.
    let order = |nearest: &Nearest| (nearest.gap_m, nearest.lateral_offset_m, nearest.actor);
    if slot.is_none_or(|nearest| order(&candidate) < order(&nearest)) {
        *slot = Some(candidate);
    }
}

/// Another vehicle, relative to the vehicle whose neighbours are determined.
pub(super) struct Candidate {
    pub(super) nearest: Nearest,
    /// Distance along the road from centre to centre, positive ahead (m).
    ahead_m: f64,
    /// Whether the two vehicles are in each other's path.
    pub(super) is_in_path: bool,
}

impl Candidate {
    /// Creates the second vehicle relative to the first.
    pub(super) fn new(extents: &[Extent], [actor, other]: [usize; 2]) -> Self {
        let (extent, at) = (&extents[actor], &extents[other]);
        let ahead_m = at.s_m - extent.s_m;
        let gap_m = bumper_gap_m(ahead_m.abs(), extent.length_m, at.length_m);
        let lateral_offset_m = at.d_m - extent.d_m;
        let [right_m, left_m] = at.sides_m();
        let is_in_path = lateral_offset_m.abs() < 0.5 * (left_m - right_m) + extent.half_width_m + PATH_MARGIN_M;
        Self { nearest: Nearest { actor: other, gap_m, lateral_offset_m }, ahead_m, is_in_path }
    }

    pub(super) fn insert_into(&self, lane: &mut LaneAround) {
        let slot = if self.nearest.gap_m < 0.0 {
            &mut lane.alongside
        } else if self.ahead_m > 0.0 {
            &mut lane.lead
        } else {
            &mut lane.follower
        };
        keep_nearest(slot, self.nearest);
    }
}
