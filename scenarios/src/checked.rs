//! Concrete scenarios: every value is a number, and every number has been checked.

use closecall_controllers::external::VariableTable;
use closecall_controllers::{
    CheckedDriver, DriverConfig, ENTRY_STOP_MPS2, HumanDriver, LaneKeeping, SpeedKeeping, entry_stop_distance_m,
};
use closecall_sensors::Sensors;
use closecall_traffic::{
    ActorId, CONTROL_STEP, Check, ConfigError, Environment, GRAVITY_MPS2, KeyPath, LateralPath, Num, PHYSICS_STEP,
    Parameters, Problem, Range, Road, Time, Vehicle, VehicleState, is_kebab_name,
};

use crate::coverage::CoveragePlan;
use crate::criteria::{Expression, Quantity};
use crate::grip::lateral_grip_mps2;
use crate::outcome::LONGEST_RUN_S;

use crate::run_key::RunKey;

use super::actor::Actor;
use super::config::{ActorConfig, ControllerConfig, RandomNumbersConfig, SCHEMA_VERSION, ScenarioConfig};
use super::events::{self};
use super::fleet::FleetOf;
use super::intervention::Interventions;
use super::{inert_fault, placement, traffic};

/// Largest probability or confidence that a gate may ask for: the largest number below 1 (-).
const BELOW_ONE: f64 = 1.0 - 0.5 * f64::EPSILON;

/// A concrete scenario: every value is a number, and every number has been checked.
#[derive(Clone, Debug)]
pub struct Scenario {
    /// Its name.
    pub name: String,
    /// Longest duration of a run.
    pub duration: Time,
    /// The road.
    pub road: Road,
    /// Light, weather and surface.
    pub environment: Environment,
    /// The vehicles.
    pub actors: Vec<Actor>,
    /// Index of the ego in `actors`.
    pub ego: usize,
    /// The ego's sensors.
    pub sensors: Sensors,
    /// The parameter values that it was made with.
    pub parameters: Parameters,
    /// Step of the vehicle dynamics and the human drivers. The control step is a multiple of it.
    pub physics_step: Time,
    /// The sample whose random numbers every run uses; `None` if each run uses its own.
    pub random_numbers: Option<RandomNumbersConfig>,
    /// Stages that are replaced by the truth, and injected faults.
    pub interventions: Interventions,
    /// The names of the variables of an FMU.
    pub variables: VariableTable,
    /// Time from the input of the ego controller to the effect of its command, if it is stated.
    pub computing: Option<Time>,
}

impl Scenario {
    /// Returns the ego's name.
    pub fn ego_id(&self) -> &ActorId {
        &self.actors[self.ego].id
    }

    /// Returns the index of the lead vehicle and of the rear vehicle: the nearest vehicles ahead of
    /// the ego and behind it in its lane at the start or, if none is there, the first one of the
    /// file on that side.
    pub fn lead_and_rear(&self) -> [Option<usize>; 2] {
        let ego = &self.actors[self.ego].start;
        let lane = self.road.lane_of(ego);
        let nearest = |side: f64| {
            let distances = self.actors.iter().enumerate().map(|(index, actor)| {
                let is_in_lane = self.road.lane_of(&actor.start) == lane;
                let distance_m = side * (actor.start.s_m - ego.s_m);
                (index, distance_m, if is_in_lane { distance_m } else { f64::INFINITY })
            });
            let there = distances.filter(|(_, distance_m, _)| *distance_m > 0.0);
            there.min_by(|one, other| one.2.total_cmp(&other.2)).map(|(index, ..)| index)
        };
        [nearest(1.0), nearest(-1.0)]
    }

    /// Returns the look of the actor with this index in a run. If the actor names a fleet, its look
    /// is drawn from the fleet.
    pub fn vehicle(&self, actor: usize, key: RunKey) -> Vehicle {
        let key = self.random_numbers.map_or(key, |of| RunKey { seed: of.seed, sample: of.sample });
        let Actor { id, vehicle, fleet, .. } = &self.actors[actor];
        fleet.as_ref().map_or(*vehicle, |fleet| fleet.vehicle_in_run(*vehicle, id, key))
    }
}

impl Check for ScenarioConfig {
    type Checked = Scenario;

    fn check(&self, parameters: &Parameters) -> Result<Scenario, ConfigError> {
        self.check_names()?;
        let duration_s = parameters.number(&self.duration_s, "duration-s", Range::closed(0.1, LONGEST_RUN_S))?;
        let road = self.road.check(parameters).map_err(|error| error.within("road"))?;
        let environment = self.environment.check(parameters).map_err(|error| error.within("environment"))?;
        let duration = Time::from_s(duration_s);
        let mut actors = self.check_actors(&road, environment.friction, duration, parameters)?;
        let ego = only_ego(&actors)?;
        for (index, traffic) in self.traffic.iter().enumerate() {
            traffic::add(traffic, &mut actors, ego, &road, parameters)
                .map_err(|error| error.within_index(index).within("traffic"))?;
        }
        let interventions = Interventions::check(&self.ideal, &self.fault, parameters)?;
        interventions.apply(&mut actors, ego);
        let sensors = self.sensors.check(parameters).map_err(|error| error.within("sensors"))?;
        inert_fault::refuse(&self.fault, &sensors, &road, &environment, duration_s, parameters)?;
        let sensors = sensors.altered(interventions.sensors);
        sensors.check_mounting().map_err(|error| error.within("sensors"))?;
        Ok(Scenario {
            name: self.name.clone(),
            duration,
            road,
            environment,
            ego,
            actors,
            sensors,
            parameters: parameters.clone(),
            physics_step: PHYSICS_STEP,
            random_numbers: self.random_numbers,
            interventions,
            variables: self.controller.fmu.clone(),
            computing: self.controller.check_computing(parameters).map_err(|error| error.within("controller"))?,
        })
    }
}

impl ControllerConfig {
    /// Returns the computing time of the controller, if it is stated: at most the control period, in
    /// which it answers once.
    fn check_computing(&self, parameters: &Parameters) -> Result<Option<Time>, ConfigError> {
        let range = Range::above(0.0, CONTROL_STEP.s());
        let stated = self.computing_s.as_ref().map(|stated| parameters.number(stated, "computing-s", range));
        Ok(stated.transpose()?.map(Time::from_s))
    }
}

/// Longest name of a scenario (bytes): `NAME-SAMPLE.rrd` and the name of a temporary file beside it
/// fit into 255 bytes, which file systems allow.
const MOST_NAME_BYTES: usize = 120;

impl ScenarioConfig {
    fn check_names(&self) -> Result<(), ConfigError> {
        if self.schema_version != SCHEMA_VERSION {
            let problem = Problem::WrongCount { value: self.schema_version.into(), allowed: "schema version 1" };
            return Err(ConfigError::new("schema-version", problem));
        }
        // The entry of an ensemble is named SCENARIO@MEMBER.
        let (name, member) = self.name.split_once('@').map_or((&self.name[..], None), |(name, of)| (name, Some(of)));
        if !is_kebab_name(name) || member.is_some_and(|member| !is_kebab_name(member)) {
            let allowed = "the names of lower-case letters, digits and hyphens, starting with a letter,".to_owned();
            return Err(ConfigError::new("name", Problem::UnknownWord { value: self.name.clone(), allowed }));
        }
        if self.name.len() > MOST_NAME_BYTES {
            let allowed = format!("the names of at most {MOST_NAME_BYTES} characters, which also name files,");
            return Err(ConfigError::new("name", Problem::UnknownWord { value: self.name.clone(), allowed }));
        }
        self.check_requirements()?;
        self.check_criteria()?;
        for (index, actor) in self.actors.iter().enumerate() {
            if self.actors[..index].iter().any(|earlier| earlier.id == actor.id) {
                let problem = Problem::Duplicate { value: actor.id.to_string() };
                return Err(ConfigError::new("id", problem).within_index(index).within("actor"));
            }
        }
        self.check_event_names()
    }

    /// Checks that event names are unique across all actors, since logs and reports identify events
    /// by name.
    fn check_event_names(&self) -> Result<(), ConfigError> {
        let mut names = Vec::new();
        for (index, actor) in self.actors.iter().enumerate() {
            for (event_index, event) in actor.events.iter().enumerate() {
                if names.contains(&&event.id) {
                    let problem = Problem::Duplicate { value: event.id.to_string() };
                    let error = ConfigError::new("id", problem).within_index(event_index).within("event");
                    return Err(error.within_index(index).within("actor"));
                }
                names.push(&event.id);
            }
        }
        Ok(())
    }

    fn check_requirements(&self) -> Result<(), ConfigError> {
        let is_identifier = |requirement: &str| {
            let is_allowed = |c: char| c.is_ascii_alphanumeric() || "-._".contains(c);
            requirement.starts_with(|c: char| c.is_ascii_alphanumeric()) && requirement.chars().all(is_allowed)
        };
        for (index, requirement) in self.requirements.iter().enumerate() {
            let at = |problem| {
                let error = ConfigError { path: KeyPath::default(), problem };
                Err(error.within_index(index).within("requirements"))
            };
            if !is_identifier(requirement) {
                let allowed =
                    "the names of letters, digits, `-`, `.` and `_`, starting with a letter or digit,".to_owned();
                return at(Problem::UnknownWord { value: requirement.clone(), allowed });
            }
            if self.requirements[..index].contains(requirement) {
                return at(Problem::Duplicate { value: requirement.clone() });
            }
        }
        Ok(())
    }

    /// Checks the criteria beyond their syntax: every check belongs to a requirement, and shares
    /// are from 0 to 1.
    fn check_criteria(&self) -> Result<(), ConfigError> {
        for mark in self.checks.keys() {
            if !self.requirements.contains(mark) {
                let stated = self.requirements.join(", ");
                let stated = if stated.is_empty() { "none is stated" } else { stated.as_str() };
                let allowed = format!("the `requirements` ({stated})");
                let problem = Problem::UnknownWord { value: mark.clone(), allowed };
                return Err(ConfigError::new(mark, problem).within("checks"));
            }
        }
        if let Some([first, second]) = Expression::contradiction(&self.gate.require) {
            let rule = format!("`{first}` and `{second}` bound the same value on the same side");
            let problem = Problem::Contradiction { other: "gate.require", rule };
            return Err(ConfigError::new("require", problem).within("gate"));
        }
        // With a share of 0, what is expected need not happen.
        Range::above(0.0, 1.0).check(self.expects_share, "expects-share")?;
        if let Some(max) = self.gate.max_probability {
            Range::above(0.0, BELOW_ONE).check(max, "max-probability").map_err(|error| error.within("gate"))?;
        }
        if let Some(confidence) = self.gate.confidence {
            Range::above(0.5, BELOW_ONE).check(confidence, "confidence").map_err(|error| error.within("gate"))?;
        }
        Ok(())
    }

    /// Checks that what gates and checks ask to be covered is in the table.
    pub(crate) fn check_coverage_gates(&self, plan: &CoveragePlan) -> Result<(), ConfigError> {
        for expression in self.checks.values().flatten().chain(&self.gate.require) {
            let Quantity::Covered(name) = expression.quantity else { continue };
            if plan.target(name.as_str()).is_none() {
                let names = plan.names();
                let allowed = if names.is_empty() {
                    "the names in [coverage], which is empty".to_owned()
                } else {
                    names.join(", ")
                };
                return Err(ConfigError::new("item", Problem::UnknownWord { value: name.to_string(), allowed }));
            }
        }
        Ok(())
    }

    fn check_actors(
        &self,
        road: &Road,
        friction: f64,
        duration: Time,
        parameters: &Parameters,
    ) -> Result<Vec<Actor>, ConfigError> {
        let at = |index: usize, error: ConfigError| error.within_index(index).within("actor");
        let mut vehicles = Vec::with_capacity(self.actors.len());
        let mut fleets = Vec::with_capacity(self.actors.len());
        let mut drivers = Vec::with_capacity(self.actors.len());
        for (index, actor) in self.actors.iter().enumerate() {
            let in_vehicle = |error: ConfigError| at(index, error.within("vehicle"));
            vehicles.push(actor.vehicle.check(parameters).map_err(in_vehicle)?);
            fleets.push(FleetOf::check(&actor.vehicle).map_err(in_vehicle)?);
            drivers.push(actor.driver.check(parameters).map_err(|error| at(index, error.within("driver")))?);
        }
        let paths = self.check_paths(road, parameters)?;
        let states = placement::initial_states(
            placement::Actors { actors: &self.actors, vehicles: &vehicles, drivers: &drivers, paths: &paths },
            road,
            parameters,
        )?;
        let ids: Vec<&ActorId> = self.actors.iter().map(|actor| &actor.id).collect();
        let start = events::Start { ids: &ids, vehicles: &vehicles, states: &states };
        let mut checked = Vec::with_capacity(self.actors.len());
        for (((index, actor), driver), path) in self.actors.iter().enumerate().zip(drivers).zip(paths) {
            check_path_grip(path.as_ref(), states[index].speed_mps, friction).map_err(|error| at(index, error))?;
            check_room(&vehicles[index], &states[index], road).map_err(|error| at(index, error))?;
            check_lanes(&driver, &states[index], road).map_err(|error| at(index, error))?;
            let entering = Entering { driver: &driver, vehicle: &vehicles[index], start: &states[index] };
            entering.check(road, friction, duration).map_err(|error| at(index, error))?;
            let Keeping { lane_keeping, speed_keeping } =
                actor.check_keeping(parameters).map_err(|error| at(index, error))?;
            check_weaving(lane_keeping, states[index].speed_mps, friction).map_err(|error| at(index, error))?;
            let mut events = Vec::with_capacity(actor.events.len());
            for (event_index, event) in actor.events.iter().enumerate() {
                let locate = |error: ConfigError| at(index, error.within_index(event_index).within("event"));
                let event = event.check(&start, parameters).map_err(locate)?;
                let lane = road.lane_of(&states[index]);
                event
                    .then
                    .check_lane_change(&actor.driver, lane, road)
                    .map_err(|error| locate(error.within("then")))?;
                events.push(event);
            }
            checked.push(Actor {
                id: actor.id.clone(),
                vehicle: vehicles[index],
                start: states[index],
                driver,
                path,
                lane_keeping,
                speed_keeping,
                events,
                fleet: fleets[index],
            });
        }
        Ok(checked)
    }
}

impl ScenarioConfig {
    /// Checks the lateral paths of the actors.
    fn check_paths(&self, road: &Road, parameters: &Parameters) -> Result<Vec<Option<LateralPath>>, ConfigError> {
        let check = |(index, actor): (usize, &ActorConfig)| {
            let path = actor.path.as_ref().map(|path| actor.check_path(path, road, parameters)).transpose();
            path.map_err(|error| error.within("path").within_index(index).within("actor"))
        };
        self.actors.iter().enumerate().map(check).collect()
    }
}

impl ActorConfig {
    fn check_path(&self, path: &[[Num; 2]], road: &Road, parameters: &Parameters) -> Result<LateralPath, ConfigError> {
        if matches!(self.driver, DriverConfig::EgoStack(_)) {
            let rule = "the ego stack keeps the centre of its lane".to_owned();
            return Err(ConfigError::new("driver", Problem::Contradiction { other: "path", rule }));
        }
        let (travelled_m, across_m) = (Range::closed(0.0, 100_000.0), Range::closed(road.right_edge_m(), 0.0));
        let point = |(index, [x, d]): (usize, &[Num; 2])| -> Result<[f64; 2], ConfigError> {
            let x_m = parameters.number(x, "distance-m", travelled_m).map_err(|error| error.within_index(index))?;
            let d_m = parameters.number(d, "position-m", across_m).map_err(|error| error.within_index(index))?;
            Ok([x_m, d_m])
        };
        let points: Vec<[f64; 2]> = path.iter().enumerate().map(point).collect::<Result<_, _>>()?;
        let needed = "two pairs or more of a distance and a lateral position, with distances that increase from 0";
        LateralPath::new(&points).ok_or_else(|| ConfigError::new("distance-m", Problem::Missing { needed }))
    }
}

/// Rejects a lateral path that needs more lateral acceleration at the initial speed than drivers
/// use on this road.
fn check_path_grip(path: Option<&LateralPath>, speed_mps: f64, friction: f64) -> Result<(), ConfigError> {
    let bend_per_m = path.map_or(0.0, LateralPath::largest_second_derivative_per_m);
    let (largest_mps2, grip_mps2) = (speed_mps * speed_mps * bend_per_m, lateral_grip_mps2(friction));
    if largest_mps2 <= grip_mps2 {
        return Ok(());
    }
    let rule = format!(
        "at {speed_mps:.1} m/s such a path needs up to {largest_mps2:.2} m/s² sideways, and drivers steer up to \
         {grip_mps2:.2} m/s² on this road"
    );
    Err(ConfigError::new("path", Problem::Contradiction { other: "environment.friction", rule }))
}

/// How a driver keeps lane and speed.
struct Keeping {
    lane_keeping: Option<LaneKeeping>,
    speed_keeping: Option<SpeedKeeping>,
}

impl ActorConfig {
    /// Checks how the driver keeps lane and speed, and that its kind allows this.
    fn check_keeping(&self, parameters: &Parameters) -> Result<Keeping, ConfigError> {
        let reject = |key, rule: &str| {
            Err(ConfigError::new(key, Problem::Contradiction { other: "driver", rule: rule.to_owned() }))
        };
        match &self.driver {
            DriverConfig::EgoStack(_) if self.lane_keeping.is_some() => {
                return reject("lane-keeping", "the ego stack keeps its lane without weaving");
            }
            DriverConfig::EgoStack(_) if self.speed_keeping.is_some() => {
                return reject("speed-keeping", "the ego stack drives as its controller asks");
            }
            DriverConfig::Prescribed(_) if self.speed_keeping.is_some() => {
                return reject("speed-keeping", "a prescribed driver keeps to its list of speeds");
            }
            DriverConfig::Prescribed(_)
            | DriverConfig::EgoStack(_)
            | DriverConfig::Wiedemann99(_)
            | DriverConfig::Idm(_)
            | DriverConfig::Overtaker(_) => {}
        }
        let lane_keeping = self.lane_keeping.as_ref().map(|config| config.check(parameters));
        let speed_keeping = self.speed_keeping.as_ref().map(|config| config.check(parameters));
        Ok(Keeping {
            lane_keeping: lane_keeping.transpose().map_err(|error| error.within("lane-keeping"))?,
            speed_keeping: speed_keeping.transpose().map_err(|error| error.within("speed-keeping"))?,
        })
    }
}

/// Rejects weaving that needs more lateral acceleration at the initial speed than drivers use on
/// this road.
fn check_weaving(keeping: Option<LaneKeeping>, speed_mps: f64, friction: f64) -> Result<(), ConfigError> {
    let largest_mps2 = keeping.map_or(0.0, |keeping| 3.0 * keeping.lateral_acceleration_sd_mps2(speed_mps));
    let grip_mps2 = lateral_grip_mps2(friction);
    if largest_mps2 <= grip_mps2 {
        return Ok(());
    }
    let rule = format!(
        "at {speed_mps:.1} m/s such a weave needs up to {largest_mps2:.2} m/s² sideways, and drivers steer up to \
         {grip_mps2:.2} m/s² on this road"
    );
    let problem = Problem::Contradiction { other: "environment.friction", rule };
    Err(ConfigError::new("sdlp-m", problem).within("lane-keeping"))
}

/// Rejects a vehicle that is wider than the lane in which it starts.
fn check_room(vehicle: &Vehicle, start: &VehicleState, road: &Road) -> Result<(), ConfigError> {
    let lane = road.lane_of(start);
    let (width_m, lane_m) = (vehicle.dimensions.width_m, road.lane_width_m(lane, start.s_m));
    if width_m <= lane_m {
        return Ok(());
    }
    let [width_m, lane_m] = [width_m, lane_m].map(|width_m| (100.0 * width_m).round() / 100.0);
    let rule = format!("the vehicle is {width_m} m wide, and lane {lane}, in which it starts, is {lane_m} m wide");
    let other = if road.has_changing_lanes() { "road.cross-sections" } else { "road.lane-width-m" };
    let problem = Problem::Contradiction { other, rule };
    Err(ConfigError::new("width-m", problem).within("vehicle"))
}

/// Rejects a prescribed driver that would change to a lane that the road does not have.
fn check_lanes(driver: &CheckedDriver, start: &VehicleState, road: &Road) -> Result<(), ConfigError> {
    match driver {
        CheckedDriver::Human(HumanDriver::Prescribed(prescribed)) => prescribed
            .check_lanes(road.lane_of(start), road)
            .map_err(|error| error.within("prescribed").within("driver")),
        _ => Ok(()),
    }
}

/// Least share of the friction that the brakes of a vehicle can use (-): the share of a truck.
const LEAST_BRAKE_SHARE: f64 = 0.75;

/// An actor that may start in the acceleration lane.
struct Entering<'a> {
    driver: &'a CheckedDriver,
    vehicle: &'a Vehicle,
    start: &'a VehicleState,
}

impl Entering<'_> {
    /// Checks that the actor leaves the acceleration lane before its end, or can stop there, if it
    /// starts in that lane.
    fn check(&self, road: &Road, friction: f64, duration: Time) -> Result<(), ConfigError> {
        let Some(lane) = road.acceleration_lane() else { return Ok(()) };
        let number = road.lane_of(self.start);
        if road.entry_lane() != Some(number) {
            return Ok(());
        }
        let rest_m =
            road.path_length_m([self.start.s_m, lane.to_m], self.start.d_m) - 0.5 * self.vehicle.dimensions.length_m;
        let refuse = |key, other, rule| Err(ConfigError::new(key, Problem::Contradiction { other, rule }));
        match self.driver {
            CheckedDriver::Human(HumanDriver::Prescribed(driver)) => {
                let leaves = driver.first_lane_change().filter(|leaves| *leaves < duration).unwrap_or(duration);
                let driven_m = driver.distance_m(self.start.speed_mps, leaves);
                if !(driven_m <= rest_m) {
                    let rule = format!(
                        "the acceleration lane ends {rest_m:.1} m ahead, and the driver is still in it after {driven_m:.1} m"
                    );
                    return refuse("driver", "road.acceleration-lane", rule);
                }
            }
            CheckedDriver::Human(human) if human.can_merge() => {
                let braking_mps2 = LEAST_BRAKE_SHARE * friction * GRAVITY_MPS2;
                if !(braking_mps2 >= ENTRY_STOP_MPS2) {
                    let rule = format!(
                        "a truck can brake by {braking_mps2:.1} m/s² on this road, and a driver in the acceleration \
                         lane needs {ENTRY_STOP_MPS2} m/s² to stop before its end"
                    );
                    return refuse("start", "environment.friction", rule);
                }
                let needed_m = entry_stop_distance_m(self.start.speed_mps);
                if !(rest_m >= needed_m) {
                    let rule = format!(
                        "the acceleration lane ends {rest_m:.1} m ahead, and at {:.1} m/s the driver needs \
                         {needed_m:.1} m to stop",
                        self.start.speed_mps
                    );
                    return refuse("start", "road.acceleration-lane", rule);
                }
            }
            CheckedDriver::Human(_) | CheckedDriver::Ego(_) => {
                let rule = format!(
                    "lane {number} is the acceleration lane, and only `wiedemann99`, `idm` and `prescribed` leave it"
                );
                return refuse("driver", "start", rule);
            }
        }
        Ok(())
    }
}

/// Returns the index of the only actor with an ego stack.
fn only_ego(actors: &[Actor]) -> Result<usize, ConfigError> {
    let mut egos = actors.iter().enumerate().filter(|(_, actor)| matches!(actor.driver, CheckedDriver::Ego(_)));
    let needed = "exactly one actor with `driver = { ego-stack = … }`";
    match (egos.next(), egos.next()) {
        (Some((ego, _)), None) => Ok(ego),
        (None, _) => Err(ConfigError::new("actor", Problem::Missing { needed })),
        (Some(_), Some((second, actor))) => {
            let problem = Problem::Duplicate { value: format!("ego-stack of {}", actor.id) };
            Err(ConfigError::new("driver", problem).within_index(second).within("actor"))
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use crate::sampling::Design;
    use crate::{Scenario, ScenarioFile};

    const RAMP: &str = "acceleration-lane = { from-m = 600.0, length-m = 250.0, taper-m = 60.0 }";

    /// The ego at 30 m/s in this lane, and a vehicle. The road has three lanes, and the rightmost
    /// one is an acceleration lane.
    fn scenario(ego_lane: u8, start: &str, driver: &str, more: &str) -> Result<Scenario, String> {
        let text = format!(
            "schema-version = 1\nname = 'ramp'\nduration-s = 5.0\nroad = {{ lanes = 3, {RAMP} }}\n{more}\n\
             [[actor]]\nid = 'ego'\nvehicle = {{ class = 'car' }}\n\
             start = {{ absolute = {{ lane = {ego_lane}, s-m = 500.0, speed-mps = 30.0 }} }}\n\
             driver = {{ ego-stack = {{ acc = {{ time-gap-s = 0.7 }} }} }}\n\
             [[actor]]\nid = 'ramp'\nvehicle = {{ class = 'car' }}\nstart = {{ absolute = {{ {start} }} }}\n\
             driver = {{ {driver} }}\n"
        );
        let file = ScenarioFile::parse(Path::new("ramp.toml"), &text, &[]).map_err(|error| error.to_string())?;
        let sample = file.space().sample(Design::Random, 0, 0, 1);
        file.concrete(&sample).map_err(|error| error.to_string())
    }

    #[test]
    fn lead_and_rear_vehicle_are_told_by_their_places_and_not_by_their_order() {
        let vehicle = |id: &str, lane: u8, s_m: f64| {
            format!(
                "[[actor]]\nid = '{id}'\nvehicle = {{ class = 'car' }}\ndriver = {{ idm = {{}} }}\n\
                 start = {{ absolute = {{ lane = {lane}, s-m = {s_m:.1}, speed-mps = 30.0 }} }}\n"
            )
        };
        let roles = |vehicles: &[String]| {
            let scenario =
                scenario(2, "lane = 3, s-m = 560.0, speed-mps = 25.0", "idm = {}", &vehicles.concat()).unwrap();
            scenario.lead_and_rear().map(|index| index.map(|index| scenario.actors[index].id.to_string()))
        };
        let is = |lead: &str, rear: Option<&str>| [Some(lead.to_owned()), rear.map(str::to_owned)];
        let [beside, rear, second, front] = [
            vehicle("beside", 1, 490.0),
            vehicle("rear", 2, 450.0),
            vehicle("second", 2, 600.0),
            vehicle("front", 2, 540.0),
        ];
        assert_eq!(roles(&[beside.clone(), rear, second, front]), is("front", Some("rear")));
        assert_eq!(roles(&[beside]), is("ramp", Some("beside")), "the lane of the ego is empty");
        assert_eq!(roles(&[]), is("ramp", None));
    }

    #[test]
    fn a_vehicle_in_the_acceleration_lane_needs_a_driver_that_leaves_it_and_room_to_stop() {
        let (on_ramp, follows) = ("lane = 3, s-m = 560.0, speed-mps = 25.0", "wiedemann99 = {}");
        assert!(scenario(2, on_ramp, follows, "").is_ok());
        assert!(scenario(2, on_ramp, "idm = {}", "").is_ok());
        let refused = |ego_lane, start, driver, more| scenario(ego_lane, start, driver, more).unwrap_err();
        let error = refused(3, "lane = 1, s-m = 560.0, speed-mps = 25.0", follows, "");
        assert!(error.contains("only `wiedemann99`, `idm` and `prescribed` leave it"), "{error}");
        let overtakes =
            "overtaker = { cut-out-thw-s = 0.3, follow = { idm = { time-gap-s = 0.1 } }, reaction-s = 1.0 }";
        let error = refused(2, on_ramp, overtakes, "");
        assert!(error.contains("only `wiedemann99`, `idm` and `prescribed` leave it"), "{error}");
        let error = refused(2, "lane = 3, s-m = 780.0, speed-mps = 25.0", follows, "");
        assert!(error.contains("to stop"), "{error}");
        let error = refused(2, on_ramp, follows, "environment = { friction = 0.3 }");
        assert!(error.contains("environment.friction"), "{error}");
        // Beside the acceleration lane, all of this is allowed.
        let beside = "lane = 2, s-m = 780.0, speed-mps = 25.0";
        assert!(
            scenario(1, beside, "prescribed = { profile = [[0.0, 25.0]] }", "environment = { friction = 0.3 }").is_ok()
        );
    }

    #[test]
    fn a_prescribed_driver_leaves_the_acceleration_lane_before_its_end() {
        // The lane ends some 288 m ahead of the bumper.
        let start = "lane = 3, s-m = 560.0, speed-mps = 60.0";
        let driver = |more: &str| format!("prescribed = {{ profile = [[0.0, 60.0]]{more} }}");
        let changes =
            |at_s: &str| driver(&format!(", lane-changes = [{{ at-s = {at_s}, to = 'left', duration-s = 4.0 }}]"));
        assert!(scenario(2, start, &changes("4.7"), "").is_ok());
        let error = scenario(2, start, &changes("4.9"), "").unwrap_err();
        assert!(error.contains("is still in it after 294.0 m"), "{error}");
        // Without a lane change, the run must end before the lane does.
        let error = scenario(2, start, &driver(""), "").unwrap_err();
        assert!(error.contains("is still in it after 300.0 m"), "{error}");
        assert!(scenario(2, start, "prescribed = { profile = [[0.0, 25.0]] }", "").is_ok());
    }

    #[test]
    fn nobody_enters_the_acceleration_lane_from_the_road() {
        let start = "lane = 2, s-m = 560.0, speed-mps = 25.0";
        let change = |to: &str| {
            format!(
                "prescribed = {{ profile = [[0.0, 25.0]], lane-changes = [{{ at-s = 1, to = '{to}', duration-s = 4 }}] }}"
            )
        };
        assert!(scenario(1, start, &change("left"), "").is_ok());
        let error = scenario(1, start, &change("right"), "").unwrap_err();
        assert!(error.contains("vehicles leave and do not enter"), "{error}");
        let traffic = "[[traffic]]\nid = 'others'\ndraw = 0.5\nlanes = [3]\nvehicles = 2\nfrom-m = 150.0\n\
                       mean-thw-s = 2.5\nspeed-mps = 25.0\ndriver = { idm = {} }";
        let error = scenario(1, start, "idm = {}", traffic).unwrap_err();
        assert!(error.contains("traffic[0].lanes[0]") && error.contains("through lanes"), "{error}");
    }
}
