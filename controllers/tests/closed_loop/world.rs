//! A small closed loop for the drivers alone: point masses along the road, lane changes on quintic paths.
//!
//! E sees perfect tracks. The actuators have a first-order lag of 0.15 s and the friction limit of a dry road; lane
//! changes are paths along the road, so that braking stretches them in time. Collisions are overlaps of boxes, and end
//! the run.

use closecall_controllers::{
    Driver, DriverAction, DriverInput, DriverNote, EgoCommand, EgoController, EgoInput, LaneNeighbours, Neighbour,
    Neighbours, Odometry, SensorAvailability,
};
use closecall_traffic::{
    ClassScores, Lane, Road, Side, Source, Stream, Time, Track, TrackId, TrackStatus, Vehicle, VehicleState,
};

pub(crate) const STEP: Time = Time::from_ms(10);
const STEP_S: f64 = 0.01;
const CONTROL_PERIOD: Time = Time::from_ms(40);
const LAG_S: f64 = 0.15;
const GRIP_MPS2: f64 = 0.9 * 9.81;
const BRAKE_LIGHT_MPS2: f64 = 1.3;

/// Who drives.
pub(crate) enum Who {
    Ego(Box<dyn EgoController>),
    Human(Box<dyn Driver>, Box<Stream>),
}

/// A lane change under way.
struct Path {
    target: Lane,
    from_s_m: f64,
    from_d_m: f64,
    way_m: f64,
}

/// One vehicle.
pub(crate) struct Actor {
    pub(crate) who: Who,
    pub(crate) vehicle: Vehicle,
    pub(crate) state: VehicleState,
    pub(crate) command_mps2: f64,
    path: Option<Path>,
    /// Brakes from this time on at this rate, whatever the driver wants.
    pub(crate) brakes: Option<(f64, f64)>,
    pub(crate) notes: Vec<(Time, DriverNote)>,
}

impl Actor {
    pub(crate) fn new(who: Who, vehicle: Vehicle, s_m: f64, d_m: f64, speed_mps: f64) -> Self {
        let state = VehicleState { s_m, d_m, speed_mps, ..VehicleState::default() };
        Self { who, vehicle, state, command_mps2: 0.0, path: None, brakes: None, notes: Vec::new() }
    }

    fn integrate(&mut self, road: &Road) {
        let s = &mut self.state;
        s.acceleration_mps2 += STEP_S / LAG_S * (self.command_mps2.max(-GRIP_MPS2) - s.acceleration_mps2);
        let before = s.speed_mps;
        s.speed_mps = (before + STEP_S * s.acceleration_mps2).max(0.0);
        s.s_m += 0.5 * (before + s.speed_mps) * STEP_S;
        s.brake_light = s.acceleration_mps2 < -BRAKE_LIGHT_MPS2;
        if let Some(path) = &self.path {
            let u = ((s.s_m - path.from_s_m) / path.way_m).clamp(0.0, 1.0);
            let share = u * u * u * (10.0 - 15.0 * u + 6.0 * u * u);
            s.d_m = path.from_d_m + share * (road.lane_centre_m(path.target) - path.from_d_m);
            if u >= 1.0 {
                self.path = None;
            }
        }
    }

    fn act(&mut self, time: Time, action: &DriverAction) {
        self.command_mps2 = action.acceleration_mps2;
        self.state.indicator = action.indicator;
        if let Some(change) = action.lane_change {
            let s = &self.state;
            let way_m = (s.speed_mps * change.duration_s).max(1.0);
            self.path = Some(Path { target: change.target, from_s_m: s.s_m, from_d_m: s.d_m, way_m });
        }
        self.notes.extend(action.note.map(|note| (time, note)));
    }

    pub(crate) fn noted(&self, wanted: DriverNote) -> Option<Time> {
        self.notes.iter().find(|(_, note)| *note == wanted).map(|(time, _)| *time)
    }
}

/// All vehicles on a road of three lanes.
pub(crate) struct World {
    pub(crate) road: Road,
    pub(crate) time: Time,
    pub(crate) actors: Vec<Actor>,
    pub(crate) ego_command: Option<EgoCommand>,
    pub(crate) sensors: SensorAvailability,
    tracks: Vec<Track>,
}

/// Gap bumper to bumper from `behind` to `ahead` [m].
pub(crate) fn gap_m(ahead: &Actor, behind: &Actor) -> f64 {
    let lengths = ahead.vehicle.dimensions.length_m + behind.vehicle.dimensions.length_m;
    ahead.state.s_m - behind.state.s_m - 0.5 * lengths
}

impl World {
    pub(crate) fn new(actors: Vec<Actor>, road: Road) -> Self {
        Self { road, time: Time::ZERO, actors, ego_command: None, sensors: SensorAvailability::ALL, tracks: Vec::new() }
    }

    /// The pair of actors that overlap, if any.
    pub(crate) fn collision(&self) -> Option<(usize, usize)> {
        let overlap = |a: &Actor, b: &Actor| {
            let widths = a.vehicle.dimensions.width_m + b.vehicle.dimensions.width_m;
            gap_m(a, b).max(gap_m(b, a)) < 0.0 && (a.state.d_m - b.state.d_m).abs() < 0.5 * widths
        };
        let n = self.actors.len();
        (0..n).flat_map(|a| (a + 1..n).map(move |b| (a, b))).find(|(a, b)| overlap(&self.actors[*a], &self.actors[*b]))
    }

    /// One physics step: all read the state, then all move.
    pub(crate) fn step(&mut self) {
        let (time, road) = (self.time, self.road);
        for me in 0..self.actors.len() {
            let neighbours = self.neighbours(me);
            let control = time.is_multiple_of(CONTROL_PERIOD);
            if control && matches!(self.actors[me].who, Who::Ego(_)) {
                self.look_around(me);
            }
            let actor = &mut self.actors[me];
            let action = match &mut actor.who {
                Who::Human(driver, rng) => {
                    let input = DriverInput {
                        time,
                        vehicle: &actor.vehicle,
                        own: &actor.state,
                        neighbours: &neighbours,
                        road: &road,
                        changing_to: actor.path.as_ref().map(|path| path.target),
                        lateral_deviation_m: 0.0,
                        desired_speed_offset_mps: 0.0,
                    };
                    driver.step(&input, rng).unwrap()
                }
                Who::Ego(controller) if control => {
                    let odometry = Odometry {
                        speed_mps: actor.state.speed_mps,
                        acceleration_mps2: actor.state.acceleration_mps2,
                        yaw_rate_radps: 0.0,
                        lane: road.lane_at(actor.state.d_m),
                        lane_offset_m: 0.0,
                        length_m: actor.vehicle.dimensions.length_m,
                        width_m: actor.vehicle.dimensions.width_m,
                    };
                    let input = EgoInput { time, odometry, road: &road, tracks: &self.tracks, sensors: self.sensors };
                    let command = controller.step(&input).unwrap();
                    self.ego_command = Some(command);
                    DriverAction { acceleration_mps2: command.acceleration_mps2, ..DriverAction::default() }
                }
                Who::Ego(_) => DriverAction { acceleration_mps2: actor.command_mps2, ..DriverAction::default() },
            };
            actor.act(time, &action);
            if let Some((_, rate)) = actor.brakes.filter(|(at_s, _)| time.s() >= *at_s) {
                actor.command_mps2 = -rate;
            }
        }
        for actor in &mut self.actors {
            actor.integrate(&road);
        }
        self.time += STEP;
    }

    fn neighbours(&self, me: usize) -> Neighbours {
        let own = &self.actors[me];
        let lane = self.road.lane_at(own.state.d_m);
        Neighbours {
            own: self.in_lane(me, lane),
            left: self.road.beside(lane, Side::Left).map(|lane| self.in_lane(me, lane)),
            right: self.road.beside(lane, Side::Right).map(|lane| self.in_lane(me, lane)),
            in_path: self.nearest(me, |other| {
                let widths = own.vehicle.dimensions.width_m + other.vehicle.dimensions.width_m;
                (own.state.d_m - other.state.d_m).abs() < 0.5 * widths && gap_m(other, own) >= 0.0
            }),
        }
    }

    fn in_lane(&self, me: usize, lane: Lane) -> LaneNeighbours {
        let own = &self.actors[me];
        let reach_m = 0.5 * self.road.lane_width_m();
        let centre_m = self.road.lane_centre_m(lane);
        let inside =
            |other: &Actor| (other.state.d_m - centre_m).abs() < reach_m + 0.5 * other.vehicle.dimensions.width_m;
        LaneNeighbours {
            lead: self.nearest(me, |other| inside(other) && gap_m(other, own) >= 0.0),
            follower: self.nearest(me, |other| inside(other) && gap_m(own, other) >= 0.0),
            alongside: self.nearest(me, |other| inside(other) && gap_m(own, other).max(gap_m(other, own)) < 0.0),
        }
    }

    fn nearest(&self, me: usize, wanted: impl Fn(&Actor) -> bool) -> Option<Neighbour> {
        let own = &self.actors[me];
        let others = self.actors.iter().enumerate().filter(|(place, other)| *place != me && wanted(other));
        others
            .map(|(place, other)| Neighbour {
                actor: place,
                gap_m: gap_m(other, own).max(gap_m(own, other)),
                speed_mps: other.state.speed_mps,
                acceleration_mps2: other.state.acceleration_mps2,
                brake_light: other.state.brake_light,
                indicator: other.state.indicator,
                class: other.vehicle.class,
                length_m: other.vehicle.dimensions.length_m,
                width_m: other.vehicle.dimensions.width_m,
                lateral_offset_m: other.state.d_m - own.state.d_m,
            })
            .min_by(|a, b| a.gap_m.total_cmp(&b.gap_m))
    }

    /// Perfect tracks of all others within 150 m, in E's frame.
    fn look_around(&mut self, me: usize) {
        let (ego, road) = (&self.actors[me], &self.road);
        let lane = road.lane_at(ego.state.d_m).0;
        self.tracks.clear();
        for (place, other) in self.actors.iter().enumerate().filter(|(place, _)| *place != me) {
            let x_m = other.state.s_m - ego.state.s_m;
            let mut probability = [0.0; 3];
            let there = usize::from(road.lane_at(other.state.d_m).0 + 1).wrapping_sub(usize::from(lane));
            if x_m.abs() > 150.0 || there > 2 {
                continue;
            }
            probability[there] = 1.0;
            self.tracks.push(Track {
                id: TrackId(u32::try_from(place).unwrap()),
                source: if x_m > 0.0 { Source::Front } else { Source::Rear },
                status: TrackStatus::Confirmed,
                time: self.time,
                state: [x_m, other.state.d_m - ego.state.d_m, other.state.speed_mps, 0.0].into(),
                covariance: Default::default(),
                heading_rad: 0.0,
                length_m: other.vehicle.dimensions.length_m,
                width_m: other.vehicle.dimensions.width_m,
                class: ClassScores::certain(other.vehicle.class),
                existence: 1.0,
                lane: probability,
            });
        }
    }
}
