//! Concrete scenarios: every value is a number, and every number is checked.

use closecall_controllers::{CheckedDriver, DriverConfig, HumanDriver, LaneKeeping, SpeedKeeping};
use closecall_sensors::Sensors;
use closecall_traffic::{
    ActorId, Check, ConfigError, Environment, PHYSICS_STEP, Parameters, Problem, Range, Road, Time, Vehicle,
    VehicleState,
};

use crate::world::lateral_grip_mps2;

use super::config::{ActorConfig, SCHEMA_VERSION, ScenarioConfig};
use super::events::{self, Event};
use super::placement;

/// One vehicle of a concrete scenario.
#[derive(Clone, Debug)]
pub struct Actor {
    /// Its name.
    pub id: ActorId,
    /// What it is.
    pub vehicle: Vehicle,
    /// Where it starts.
    pub start: VehicleState,
    /// Who drives it.
    pub driver: CheckedDriver,
    /// How it keeps its lane; exactly where absent.
    pub lane_keeping: Option<LaneKeeping>,
    /// How the speed that its driver wants wanders; not at all where absent.
    pub speed_keeping: Option<SpeedKeeping>,
    pub(crate) events: Vec<Event>,
}

/// A concrete scenario: everything is a number, and every number has been checked.
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
    /// The place of E among them.
    pub ego: usize,
    /// What E perceives with.
    pub sensors: Sensors,
    /// The sampled values that it was made with.
    pub parameters: Parameters,
    /// Step of vehicles and human drivers; a control step is a whole number of them.
    pub(crate) physics_step: Time,
}

impl Scenario {
    /// E's name.
    pub fn ego_id(&self) -> &ActorId {
        &self.actors[self.ego].id
    }
}

impl Check for ScenarioConfig {
    type Checked = Scenario;

    fn check(&self, parameters: &Parameters) -> Result<Scenario, ConfigError> {
        self.check_names()?;
        let duration_s = parameters.number(&self.duration_s, "duration-s", Range::closed(0.1, 3_600.0))?;
        let road = self.road.check(parameters).map_err(|error| error.within("road"))?;
        let environment = self.environment.check(parameters).map_err(|error| error.within("environment"))?;
        let actors = self.check_actors(&road, environment.friction, parameters)?;
        Ok(Scenario {
            name: self.name.clone(),
            duration: Time::from_s(duration_s),
            road,
            environment,
            ego: only_ego(&actors)?,
            actors,
            sensors: self.sensors.check(parameters).map_err(|error| error.within("sensors"))?,
            parameters: parameters.clone(),
            physics_step: PHYSICS_STEP,
        })
    }
}

impl ScenarioConfig {
    fn check_names(&self) -> Result<(), ConfigError> {
        if self.schema_version != SCHEMA_VERSION {
            let problem = Problem::WrongCount { value: self.schema_version.into(), allowed: "schema version 1" };
            return Err(ConfigError::new("schema-version", problem));
        }
        if ActorId::new(&self.name).is_err() {
            let allowed = "lower-case letters, digits and hyphens, starting with a letter".to_owned();
            return Err(ConfigError::new("name", Problem::UnknownWord { value: self.name.clone(), allowed }));
        }
        self.check_requirements()?;
        for (index, actor) in self.actors.iter().enumerate() {
            if self.actors[..index].iter().any(|earlier| earlier.id == actor.id) {
                let problem = Problem::Duplicate { value: actor.id.to_string() };
                return Err(ConfigError::new("id", problem).within_index(index).within("actor"));
            }
        }
        self.check_event_names()
    }

    /// Events are told apart by their names in logs and reports, whichever actor they belong to.
    fn check_event_names(&self) -> Result<(), ConfigError> {
        let mut names = Vec::new();
        for (index, actor) in self.actors.iter().enumerate() {
            for (place, event) in actor.events.iter().enumerate() {
                if names.contains(&&event.id) {
                    let problem = Problem::Duplicate { value: event.id.to_string() };
                    let error = ConfigError::new("id", problem).within_index(place).within("event");
                    return Err(error.within_index(index).within("actor"));
                }
                names.push(&event.id);
            }
        }
        Ok(())
    }

    fn check_requirements(&self) -> Result<(), ConfigError> {
        let is_mark = |mark: &str| {
            let is_part_of_one = |c: char| c.is_ascii_alphanumeric() || "-._".contains(c);
            mark.starts_with(|c: char| c.is_ascii_alphanumeric()) && mark.chars().all(is_part_of_one)
        };
        for (index, mark) in self.requirements.iter().enumerate() {
            let at = |problem| Err(ConfigError::new("requirements", problem).within_index(index));
            if !is_mark(mark) {
                let allowed = "letters, digits, `-`, `.` and `_`, starting with a letter or digit".to_owned();
                return at(Problem::UnknownWord { value: mark.clone(), allowed });
            }
            if self.requirements[..index].contains(mark) {
                return at(Problem::Duplicate { value: mark.clone() });
            }
        }
        Ok(())
    }

    fn check_actors(&self, road: &Road, friction: f64, parameters: &Parameters) -> Result<Vec<Actor>, ConfigError> {
        let at = |index: usize, error: ConfigError| error.within_index(index).within("actor");
        let mut vehicles = Vec::with_capacity(self.actors.len());
        for (index, actor) in self.actors.iter().enumerate() {
            let vehicle = actor.vehicle.check(parameters).map_err(|error| at(index, error.within("vehicle")))?;
            vehicles.push(vehicle);
        }
        let states = placement::place(&self.actors, &vehicles, road, parameters)?;
        let start = events::Start { actors: &self.actors, vehicles: &vehicles, states: &states };
        let mut checked = Vec::with_capacity(self.actors.len());
        for (index, actor) in self.actors.iter().enumerate() {
            let driver = actor.driver.check(parameters).map_err(|error| at(index, error.within("driver")))?;
            check_reach(&driver, states[index].speed_mps).map_err(|error| at(index, error))?;
            check_lanes(&driver, &states[index], road).map_err(|error| at(index, error))?;
            let (lane_keeping, speed_keeping) = actor.check_keeping(parameters).map_err(|error| at(index, error))?;
            check_weave(lane_keeping, states[index].speed_mps, friction).map_err(|error| at(index, error))?;
            let mut events = Vec::with_capacity(actor.events.len());
            for (place, event) in actor.events.iter().enumerate() {
                let event = event.check(&start, parameters);
                events.push(event.map_err(|error| at(index, error.within_index(place).within("event")))?);
            }
            checked.push(Actor {
                id: actor.id.clone(),
                vehicle: vehicles[index],
                start: states[index],
                driver,
                lane_keeping,
                speed_keeping,
                events,
            });
        }
        Ok(checked)
    }
}

impl ActorConfig {
    /// How the driver keeps lane and speed.
    fn check_keeping(
        &self,
        parameters: &Parameters,
    ) -> Result<(Option<LaneKeeping>, Option<SpeedKeeping>), ConfigError> {
        let refused = |key, rule: &str| {
            Err(ConfigError::new(key, Problem::Contradiction { other: "driver", rule: rule.to_owned() }))
        };
        match &self.driver {
            DriverConfig::EgoStack(_) if self.lane_keeping.is_some() => {
                return refused("lane-keeping", "the ego stack keeps its lane without weaving");
            }
            DriverConfig::EgoStack(_) if self.speed_keeping.is_some() => {
                return refused("speed-keeping", "the ego stack drives as its controller asks");
            }
            DriverConfig::Prescribed(_) if self.speed_keeping.is_some() => {
                return refused("speed-keeping", "a prescribed driver keeps to its list of speeds");
            }
            DriverConfig::Prescribed(_)
            | DriverConfig::EgoStack(_)
            | DriverConfig::Wiedemann99(_)
            | DriverConfig::Idm(_)
            | DriverConfig::Overtaker(_) => {}
        }
        let lane_keeping = self.lane_keeping.as_ref().map(|config| config.check(parameters));
        let speed_keeping = self.speed_keeping.as_ref().map(|config| config.check(parameters));
        Ok((
            lane_keeping.transpose().map_err(|error| error.within("lane-keeping"))?,
            speed_keeping.transpose().map_err(|error| error.within("speed-keeping"))?,
        ))
    }
}

/// Refuses a weave that the tyres cannot give at the speed at which its driver starts.
fn check_weave(keeping: Option<LaneKeeping>, speed_mps: f64, friction: f64) -> Result<(), ConfigError> {
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

/// Refuses an overtaking driver who never comes as close as it would have to in order to pull out.
fn check_reach(driver: &CheckedDriver, speed_mps: f64) -> Result<(), ConfigError> {
    match driver {
        CheckedDriver::Human(HumanDriver::Overtaker(overtaker)) => {
            overtaker.check_reach(speed_mps).map_err(|error| error.within("overtaker").within("driver"))
        }
        _ => Ok(()),
    }
}

/// Refuses a prescribed driver who would change to a lane that the road does not have.
fn check_lanes(driver: &CheckedDriver, start: &VehicleState, road: &Road) -> Result<(), ConfigError> {
    match driver {
        CheckedDriver::Human(HumanDriver::Prescribed(prescribed)) => prescribed
            .check_lanes(road.lane_at(start.d_m), road.lanes())
            .map_err(|error| error.within("prescribed").within("driver")),
        _ => Ok(()),
    }
}

/// The place of the one actor with an ego stack.
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
