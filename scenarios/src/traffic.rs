//! Surrounding traffic: many vehicles from a few lines of the scenario file.
//!
//! ```text
//!  lane 1        ▭ ───── g ────▶ ▭ ── g ─▶ ▭           g: gaps of a shifted exponential distribution
//!  lane 2   R ───▶ E ──▶ F                             the vehicles of the file stay where they are
//!  lane 3   ▭ ── g ─▶ ▭ ─────── g ──────▶ ▭
//!           from-m
//! ```
//!
//! The headways of vehicles that do not interact are exponential; with a least headway they are
//! Cowan's model M2 (R. J. Cowan, *Useful headway models*, Transportation Research 9 (1975)
//! 371–375). Everything is drawn from one number, the key `draw`: as a parameter of the scenario it
//! is sampled, recorded and fixed like any other.

use closecall_controllers::{CheckedDriver, DriverConfig};
use closecall_traffic::{
    ActorId, Check, ConfigError, KeyPath, Lane, Num, Parameters, Problem, Range, Road, Segment, Stream, Vehicle,
    VehicleClass, VehicleState, stream,
};
use closecall_traffic::{Exp1, StandardNormal, metrics::touching_distance_m};
use rand::RngExt;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Actor;
use super::fleet::FleetOf;

/// Name of the random stream of a vehicle.
const CHANNEL: &str = "traffic";
/// Largest number of vehicles in one block.
const MAX_VEHICLES: u32 = 200;
/// Number of standard deviations within which a speed lies.
const SPEED_DEVIATIONS: f64 = 2.0;
/// Least headway if the file gives none (s): an assumption, below most of the headways that drivers
/// keep; 0.5 to 2 are plausible.
const LEAST_THW_S: f64 = 1.0;
/// Distance that is added so that rounding lets no gap be too short (m).
const ROUNDING_M: f64 = 1e-6;

/// Vehicles around the ego. They are named ID-1, ID-2 and so on, and are placed lane by lane from
/// the rear; where an actor of the file is in the way, they leave a gap. Give exactly one of
/// `mean-thw-s` and `density-per-km`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct TrafficConfig {
    /// Beginning of the vehicles' names: a name as of an actor.
    pub id: ActorId,
    /// The number from which everything is drawn (-): a parameter with a uniform
    /// distribution from 0 to 1 gives other traffic in each sample, a fixed number the same.
    pub draw: Num,
    /// The lanes, counted from 1 for the leftmost lane. The vehicles are dealt to them in turn.
    pub lanes: Vec<Lane>,
    /// Number of vehicles, 1 to 200.
    pub vehicles: u32,
    /// Position from which each lane is filled, relative to the ego, positive ahead (m).
    pub from_m: Num,
    /// Mean time headway, bumper to bumper (s).
    pub mean_thw_s: Option<Num>,
    /// Mean number of vehicles in a kilometre of a lane (1/km).
    pub density_per_km: Option<Num>,
    /// Least time headway (s). Default: 1.
    pub min_thw_s: Option<Num>,
    /// Mean speed (m/s).
    pub speed_mps: Num,
    /// Standard deviation of the speeds (m/s), which lie within two of them. Default: 0.
    pub speed_sd_mps: Option<Num>,
    /// Weights of the classes. Default: cars only.
    pub classes: Option<ClassWeightsConfig>,
    /// Fleet of the library from which paint, colour, body shape and plate of each vehicle are
    /// drawn. If absent, nothing is drawn.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fleet: Option<String>,
    /// The drivers: a human driver model.
    pub driver: DriverConfig,
}

/// Weights of the vehicle classes: a vehicle is of a class with the probability of its weight over
/// the sum of the weights.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct ClassWeightsConfig {
    /// Weight of passenger cars (-). Default: 0.
    pub car: Option<Num>,
    /// Weight of trucks (-). Default: 0.
    pub truck: Option<Num>,
    /// Weight of motorcycles (-). Default: 0.
    pub motorcycle: Option<Num>,
}

/// Adds the vehicles of one block to `actors`, whose element `ego` is the ego.
///
/// # Errors
/// [`ConfigError`] if a value is out of range, if the driver is not human, or if a name is taken.
pub(super) fn add(
    config: &TrafficConfig,
    actors: &mut Vec<Actor>,
    ego: usize,
    road: &Road,
    parameters: &Parameters,
) -> Result<(), ConfigError> {
    let block = Block::new(config, road, parameters)?;
    let from_m =
        actors[ego].start.s_m + parameters.number(&config.from_m, "from-m", Range::closed(-5_000.0, 5_000.0))?;
    let mut ends: Vec<Option<Rear>> = vec![None; config.lanes.len()];
    for number in 0..config.vehicles {
        let id = block.name(number)?;
        if actors.iter().any(|actor| actor.id == id) {
            return Err(ConfigError::new("id", Problem::Duplicate { value: id.to_string() }));
        }
        let mut rng = stream(block.draw.to_bits(), 0, &id, CHANNEL);
        let drawn = block.draw_vehicle(&mut rng);
        let turn = number as usize % config.lanes.len();
        let length_m = drawn.vehicle.dimensions.length_m;
        let wanted_m = match ends[turn] {
            Some(rear) => rear.s_m + touching_distance_m(rear.length_m, length_m) + drawn.thw_s * rear.speed_mps,
            // The first vehicles of the lanes are not abreast.
            None => from_m + rng.random::<f64>() * block.mean_thw_s * block.speed_mps,
        };
        let line = |s_m| road.driving_line(config.lanes[turn], s_m)[0];
        let start = VehicleState { speed_mps: drawn.speed_mps, ..VehicleState::default() };
        let wanted = VehicleState { s_m: wanted_m, d_m: line(wanted_m), ..start };
        let s_m = block.free_position_m(actors, &drawn.vehicle, wanted);
        let lane = config.lanes[turn];
        if !road.is_open(lane, [s_m; 2]) {
            let (width_m, least_m) = (road.lane_width_m(lane, s_m), Road::LANE_WIDTH_M.low());
            let rule = format!(
                "`{id}` starts at {s_m:.1} m, where lane {lane} is {width_m:.2} m wide: a vehicle starts in a lane of \
                 {least_m} m or more"
            );
            return Err(ConfigError::new("lanes", Problem::Contradiction { other: "road.cross-sections", rule }));
        }
        ends[turn] = Some(Rear { s_m, length_m, speed_mps: drawn.speed_mps });
        actors.push(Actor {
            id,
            vehicle: drawn.vehicle,
            start: VehicleState { s_m, d_m: line(s_m), ..start },
            driver: block.driver.clone(),
            path: None,
            lane_keeping: None,
            speed_keeping: None,
            events: Vec::new(),
            fleet: block.fleet,
        });
    }
    Ok(())
}

/// The last vehicle of a lane so far.
#[derive(Clone, Copy, Debug)]
struct Rear {
    s_m: f64,
    length_m: f64,
    speed_mps: f64,
}

/// The drawn values of one vehicle.
struct Drawn {
    vehicle: Vehicle,
    speed_mps: f64,
    /// Time headway of the vehicle behind (s).
    thw_s: f64,
}

/// The checked values of a block.
struct Block<'a> {
    id: &'a ActorId,
    draw: f64,
    mean_thw_s: f64,
    min_thw_s: f64,
    speed_mps: f64,
    speed_sd_mps: f64,
    /// The classes with their weights.
    classes: Vec<(VehicleClass, f64)>,
    driver: CheckedDriver,
    fleet: Option<FleetOf>,
}

impl<'a> Block<'a> {
    fn new(config: &'a TrafficConfig, road: &Road, parameters: &Parameters) -> Result<Self, ConfigError> {
        if !(1..=MAX_VEHICLES).contains(&config.vehicles) {
            let problem =
                Problem::WrongCount { value: config.vehicles.into(), allowed: "a number of vehicles from 1 to 200" };
            return Err(ConfigError::new("vehicles", problem));
        }
        if config.lanes.is_empty() {
            return Err(ConfigError::new("lanes", Problem::Missing { needed: "at least one lane" }));
        }
        let at = |index, problem| {
            let path = KeyPath(vec![Segment::Key("lanes".to_owned()), Segment::Index(index)]);
            Err(ConfigError { path, problem })
        };
        for (index, lane) in config.lanes.iter().enumerate() {
            if !(1..=road.lanes()).contains(&lane.0) {
                return at(index, Problem::UnknownLane { value: lane.0, lanes: road.lanes() });
            }
            if road.entry_lane() == Some(*lane) {
                let rule = "surrounding traffic starts in the through lanes".to_owned();
                return at(index, Problem::Contradiction { other: "road.acceleration-lane", rule });
            }
        }
        let driver = config.driver.check(parameters).map_err(|error| error.within("driver"))?;
        if matches!(driver, CheckedDriver::Ego(_)) {
            let rule = "the drivers of the surrounding traffic are human".to_owned();
            return Err(
                ConfigError::new("ego-stack", Problem::Contradiction { other: "traffic", rule }).within("driver")
            );
        }
        let classes = classes(config, parameters).map_err(|error| error.within("classes"))?;
        let number = |num: &Num, key, range| parameters.number(num, key, range);
        let speed_mps = number(&config.speed_mps, "speed-mps", Range::above(0.0, 80.0))?;
        let speed_sd_mps =
            parameters.number_or(config.speed_sd_mps.as_ref(), "speed-sd-mps", Range::closed(0.0, 10.0), 0.0)?;
        let min_thw_s =
            parameters.number_or(config.min_thw_s.as_ref(), "min-thw-s", Range::closed(0.2, 10.0), LEAST_THW_S)?;
        let mean_thw_s = mean_thw_s(config, &classes, speed_mps, parameters)?;
        if !(mean_thw_s >= min_thw_s) {
            let rule = format!("the mean headway of {mean_thw_s:.2} s is below the least of {min_thw_s} s");
            let key = if config.mean_thw_s.is_some() { "mean-thw-s" } else { "density-per-km" };
            return Err(ConfigError::new(key, Problem::Contradiction { other: "min-thw-s", rule }));
        }
        let draw = number(&config.draw, "draw", Range::UNIT)?;
        let fleet = config.fleet.as_deref().map(FleetOf::of_name).transpose()?;
        Ok(Self { id: &config.id, draw, mean_thw_s, min_thw_s, speed_mps, speed_sd_mps, classes, driver, fleet })
    }

    fn name(&self, number: u32) -> Result<ActorId, ConfigError> {
        let name = format!("{}-{}", self.id, number + 1);
        ActorId::new(&name).map_err(|_| {
            let allowed = "a name to which a number can be appended".to_owned();
            ConfigError::new("id", Problem::UnknownWord { value: self.id.to_string(), allowed })
        })
    }

    fn draw_vehicle(&self, rng: &mut Stream) -> Drawn {
        let sum: f64 = self.classes.iter().map(|(_, weight)| weight).sum();
        let mut left = rng.random::<f64>() * sum;
        let mut class = self.classes[0].0;
        for &(candidate, weight) in &self.classes {
            class = candidate;
            left -= weight;
            if left < 0.0 {
                break;
            }
        }
        let deviation = rng.sample::<f64, _>(StandardNormal).clamp(-SPEED_DEVIATIONS, SPEED_DEVIATIONS);
        Drawn {
            vehicle: Vehicle::typical(class),
            speed_mps: (self.speed_mps + deviation * self.speed_sd_mps).max(0.0),
            thw_s: self.min_thw_s + rng.sample::<f64, _>(Exp1) * (self.mean_thw_s - self.min_thw_s),
        }
    }

    /// Returns the position nearest to the wanted one, there or ahead, at which the least headway
    /// is kept to all vehicles that are at the same place across the road.
    fn free_position_m(&self, actors: &[Actor], vehicle: &Vehicle, wanted: VehicleState) -> f64 {
        let mut s_m = wanted.s_m;
        loop {
            let in_the_way = actors.iter().find_map(|actor| {
                let across_m = 0.5 * (actor.vehicle.dimensions.width_m + vehicle.dimensions.width_m);
                if (actor.start.d_m - wanted.d_m).abs() > across_m {
                    return None;
                }
                let touching_m = touching_distance_m(actor.vehicle.dimensions.length_m, vehicle.dimensions.length_m);
                let behind_m = touching_m + self.min_thw_s * wanted.speed_mps;
                let ahead_m = touching_m + self.min_thw_s * actor.start.speed_mps;
                let is_free = s_m <= actor.start.s_m - behind_m || s_m >= actor.start.s_m + ahead_m;
                (!is_free).then_some(actor.start.s_m + ahead_m + ROUNDING_M)
            });
            match in_the_way {
                Some(ahead_m) => s_m = ahead_m,
                None => return s_m,
            }
        }
    }
}

/// Returns the classes with a weight above 0.
fn classes(config: &TrafficConfig, parameters: &Parameters) -> Result<Vec<(VehicleClass, f64)>, ConfigError> {
    let Some(weights) = &config.classes else { return Ok(vec![(VehicleClass::Car, 1.0)]) };
    let mut classes = Vec::new();
    for (class, key, weight) in [
        (VehicleClass::Car, "car", &weights.car),
        (VehicleClass::Truck, "truck", &weights.truck),
        (VehicleClass::Motorcycle, "motorcycle", &weights.motorcycle),
    ] {
        let weight = parameters.number_or(weight.as_ref(), key, Range::closed(0.0, 1_000.0), 0.0)?;
        if weight > 0.0 {
            classes.push((class, weight));
        }
    }
    if classes.is_empty() {
        return Err(ConfigError::new("car", Problem::Missing { needed: "one class with a weight above 0" }));
    }
    Ok(classes)
}

/// Returns the mean headway of the block (s).
fn mean_thw_s(
    config: &TrafficConfig,
    classes: &[(VehicleClass, f64)],
    speed_mps: f64,
    parameters: &Parameters,
) -> Result<f64, ConfigError> {
    match (&config.mean_thw_s, &config.density_per_km) {
        (Some(num), None) => parameters.number(num, "mean-thw-s", Range::above(0.0, 600.0)),
        (None, Some(num)) => {
            let density_per_km = parameters.number(num, "density-per-km", Range::above(0.0, 200.0))?;
            let sum: f64 = classes.iter().map(|(_, weight)| weight).sum();
            let length_m: f64 =
                classes.iter().map(|(class, weight)| class.typical_dimensions().length_m * weight / sum).sum();
            Ok((1_000.0 / density_per_km - length_m) / speed_mps)
        }
        (Some(_), Some(_)) => {
            let rule = "only one of the two may be given".to_owned();
            Err(ConfigError::new("mean-thw-s", Problem::Contradiction { other: "density-per-km", rule }))
        }
        (None, None) => {
            let needed = "one of `mean-thw-s` and `density-per-km`";
            Err(ConfigError::new("mean-thw-s", Problem::Missing { needed }))
        }
    }
}

#[cfg(test)]
mod tests;
