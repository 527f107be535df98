//! A driver's observation at one time: the true state of the vehicles around it.

use closecall_traffic::{Lane, Side, Time, VehicleClass};

use crate::driver::{DriverInput, LaneNeighbours, Neighbour};

/// Distance from a driver's eyes to the front bumper (m): an assumption; 1.5 to 2.5 are plausible.
const EYES_TO_BUMPER_M: f64 = 2.0;

/// State of another vehicle at the time of an observation.
#[derive(Clone, Copy, Debug)]
pub(super) struct ObservedVehicle {
    pub(super) actor: u32,
    pub(super) brake_light: bool,
    pub(super) gap_m: f64,
    pub(super) speed_mps: f64,
    pub(super) acceleration_mps2: f64,
    pub(super) width_m: f64,
    /// Lateral position on the road (m).
    pub(super) d_m: f64,
}

/// State of the surroundings at one time.
#[derive(Clone, Copy, Debug)]
pub(super) struct Observation {
    pub(super) time: Time,
    pub(super) own_s_m: f64,
    pub(super) own_speed_mps: f64,
    pub(super) own_lane: Lane,
    pub(super) ahead: Option<ObservedVehicle>,
    /// The second leader, where the driver sees it: the next vehicle in the path.
    pub(super) beyond: Option<ObservedVehicle>,
    /// The side of the adjacent lane that was observed.
    pub(super) side: Option<Side>,
    /// Lead vehicle, vehicle alongside and follower in that lane; `None` if there is no such lane.
    pub(super) adjacent: Option<[Option<ObservedVehicle>; 3]>,
}

impl Observation {
    pub(super) fn of(input: &DriverInput<'_>, side: Option<Side>) -> Self {
        let near = input.neighbours;
        let own_d_m = input.own.d_m;
        let nearer = match (near.own.lead.as_ref(), near.in_path.as_ref()) {
            (Some(lead), Some(in_path)) if in_path.gap_m < lead.gap_m => Some(in_path),
            (Some(lead), _) => Some(lead),
            (None, in_path) => in_path,
        };
        let adjacent: Option<&LaneNeighbours> = match side {
            Some(Side::Left) => near.left.as_ref(),
            Some(Side::Right) => near.right.as_ref(),
            None => None,
        };
        let observe = |neighbour: &Neighbour| ObservedVehicle::of(neighbour, own_d_m);
        Self {
            time: input.time,
            own_s_m: input.own.s_m,
            own_speed_mps: input.own.speed_mps,
            own_lane: input.road.lane_at(input.own.s_m, own_d_m),
            ahead: nearer.map(observe),
            beyond: near.beyond.as_ref().filter(|beyond| nearer.is_none_or(|ahead| shows(ahead, beyond))).map(observe),
            side,
            adjacent: adjacent
                .map(|lane| [&lane.lead, &lane.alongside, &lane.follower].map(|n| n.as_ref().map(observe))),
        }
    }
}

/// Returns true if a driver sees the vehicle `beyond` the vehicle `ahead`: through the windows of a
/// car, past a motorcycle, and behind a truck only where part of its rear reaches past the truck.
fn shows(ahead: &Neighbour, beyond: &Neighbour) -> bool {
    let ends = |vehicle: &Neighbour| {
        let distance_m = vehicle.gap_m.max(0.0) + EYES_TO_BUMPER_M;
        let half_width_m = 0.5 * vehicle.width_m;
        [vehicle.lateral_offset_m - half_width_m, vehicle.lateral_offset_m + half_width_m]
            .map(|end_m| end_m / distance_m)
    };
    let ([ahead_right, ahead_left], [right, left]) = (ends(ahead), ends(beyond));
    ahead.class != VehicleClass::Truck || right < ahead_right || left > ahead_left
}

impl ObservedVehicle {
    fn of(neighbour: &Neighbour, own_d_m: f64) -> Self {
        Self {
            actor: u32::try_from(neighbour.actor).unwrap_or(u32::MAX - 1),
            brake_light: neighbour.brake_light,
            gap_m: neighbour.gap_m,
            speed_mps: neighbour.speed_mps,
            acceleration_mps2: neighbour.acceleration_mps2,
            width_m: neighbour.width_m,
            d_m: own_d_m + neighbour.lateral_offset_m,
        }
    }

    /// Rate at which the vehicle's visual angle grows or shrinks, observed from a vehicle at
    /// `own_mps` (rad/s). Infinite at a gap of zero.
    pub(super) fn visual_angle_rate_radps(&self, own_mps: f64) -> f64 {
        self.width_m * (self.speed_mps - own_mps).abs() / (self.gap_m * self.gap_m)
    }
}
