//! The monitors of the sensors in scenes without a fault, and with one.

use closecall_traffic::{ActorId, CONTROL_STEP, Check, Environment, Parameters, Road, RoadConfig, VehicleClass, maths};

use crate::faults::{FaultEntries, LidarFaultConfig};
use crate::monitors::{Alarm, Alarms};
use crate::testing::{OWN_LANE_M, scene_vehicle, with_speed};
use crate::{Alterations, NoiseKey, Scene, SceneVehicle, SensorAlarms, SensorsConfig};

const EGO_S_M: f64 = 1_000.0;
const RAIN: Environment =
    Environment { rain_mm_per_h: 10.0, water_film_mm: 1.0, visibility_m: 2_000.0, ..Environment::CLEAR_DAY };
const FOG: Environment = Environment { visibility_m: 300.0, ..Environment::CLEAR_DAY };

/// A drive of 10 s.
#[derive(Clone)]
struct Drive<'a> {
    sensors: &'a str,
    fault: &'a str,
    road: Road,
    environment: Environment,
    speed_mps: f64,
    has_neighbours: bool,
}

impl Default for Drive<'_> {
    fn default() -> Self {
        let (road, environment) = (Road::straight(3), Environment::CLEAR_DAY);
        Self { sensors: "", fault: "", road, environment, speed_mps: 30.0, has_neighbours: false }
    }
}

impl Drive<'_> {
    /// Returns the alarms of each step.
    fn run(self) -> Vec<SensorAlarms> {
        let text = format!("mode = \"full\"\nrear-camera.pipeline = \"off\"\n{}", self.sensors);
        let sensors = toml::from_str::<SensorsConfig>(&text).unwrap().check(&Parameters::default()).unwrap();
        let entries: Vec<LidarFaultConfig> =
            if self.fault.is_empty() { Vec::new() } else { vec![toml::from_str(self.fault).unwrap()] };
        let entries = FaultEntries { rear_lidar: &entries, ..FaultEntries::default() };
        let faults = entries.check(&Parameters::default()).unwrap();
        let sensors = sensors.altered(Alterations { faults, ..Alterations::default() });
        let key = NoiseKey { seed: 8, sample: 0, ego: ActorId::new("ego").unwrap(), actors: [].into() };
        let mut perception = sensors.build(&key).unwrap();
        let at = |actor, class, ahead_m: f64, left_m: f64| {
            with_speed(scene_vehicle(actor, class, EGO_S_M + ahead_m, OWN_LANE_M + left_m), self.speed_mps)
        };
        let mut ego = at(0, VehicleClass::Car, 0.0, 0.0);
        let mut others: Vec<SceneVehicle> = Vec::new();
        if self.has_neighbours {
            others.push(at(1, VehicleClass::Truck, -8.0, 3.75));
            others.push(at(2, VehicleClass::Truck, -9.0, -3.75));
            others.push(at(3, VehicleClass::Car, -11.0, 0.0));
            others.push(at(4, VehicleClass::Car, 12.0, 0.0));
        }
        let mut alarms = Vec::new();
        for step in 0..250 {
            ego.pitch_rad = 0.01 * maths::sin(0.05 * f64::from(step));
            let scene = Scene {
                time: CONTROL_STEP * i64::from(step),
                road: &self.road,
                environment: &self.environment,
                ego,
                others: &others,
            };
            perception.step(&scene).unwrap();
            alarms.push(perception.alarms());
            for vehicle in others.iter_mut().chain([&mut ego]) {
                vehicle.state.s_m += CONTROL_STEP.s() * vehicle.state.speed_mps;
            }
        }
        alarms
    }
}

fn road(text: &str) -> Road {
    toml::from_str::<RoadConfig>(text).unwrap().check(&Parameters::default()).unwrap()
}

#[test]
fn faultless_sensors_raise_nothing_on_any_road_in_any_weather_and_at_a_standstill() {
    let usual = Drive::default();
    let rails = road("lanes = 3\nguard-rails = true\ncurvature-per-m = 0.001");
    let drives = [
        usual.clone(),
        Drive { speed_mps: 0.0, ..usual.clone() },
        Drive { road: rails.clone(), ..usual },
        Drive { has_neighbours: true, ..usual.clone() },
        Drive { has_neighbours: true, speed_mps: 0.0, road: rails, ..usual },
        Drive { environment: RAIN, has_neighbours: true, ..usual.clone() },
        Drive { environment: FOG, ..usual.clone() },
        Drive { environment: RAIN, speed_mps: 0.0, ..usual },
    ];
    let sensors = [
        "",
        "front-lidar = {}",
        "rear-lidar = { azimuth-deg = 40, left-m = 0.8, roll-deg = 2 }",
        "rear-lidar.model = \"os1-64\"",
        "rear-lidar.model = \"pandar-xt-16\"",
        "rear-lidar = { mount-height-m = 1.0, dropout = 0.1 }",
        "rear-lidar = { window-transmission = 0.8, levelling-sd-rad = 0.001 }",
    ];
    for sensors in sensors {
        for (number, drive) in drives.iter().enumerate() {
            for (step, alarms) in (Drive { sensors, ..drive.clone() }).run().into_iter().enumerate() {
                let all = alarms.front.and(alarms.surround).and(alarms.rear);
                // Weather may leave less than half of the range.
                let is_false = all.iter().any(|alarm| alarm != Alarm::ShortRange);
                assert!(!is_false, "{sensors}, drive {number}: {all} in step {step}");
            }
        }
    }
}

#[test]
fn a_blocked_sector_anywhere_is_noticed_and_forgotten_when_it_is_free() {
    let sectors = [(-65.0, 3.0), (-40.2, 3.0), (-1.5, 3.0), (0.0, 3.0), (20.7, 3.0), (62.0, 3.0)];
    let wide = [(-3.0, 6.0), (10.0, 20.0), (-30.0, 60.0), (-60.0, 100.0)];
    for (from_deg, width_deg) in sectors.into_iter().chain(wide) {
        let fault = format!(
            "blocked-from-deg = {from_deg:.1}\nblocked-to-deg = {:.1}\nfrom-s = 1.0\nuntil-s = 6.0",
            from_deg + width_deg
        );
        let alarms = Drive { fault: &fault, ..Drive::default() }.run();
        let is_blocked = |alarms: &SensorAlarms| alarms.rear.contains(Alarm::BlockedSector);
        let first = alarms.iter().position(is_blocked).unwrap_or_default();
        // From step 25 on, within 4 s.
        assert!((26..125).contains(&first), "{from_deg}: {first}");
        let is_other = |alarms: &SensorAlarms| alarms.rear.iter().any(|alarm| alarm != Alarm::BlockedSector);
        assert!(!alarms.iter().any(is_other), "{from_deg} for {width_deg}");
        assert!(alarms[200..].iter().all(|alarms| alarms.rear.is_empty()), "{from_deg}");
    }
}

#[test]
fn a_vehicle_in_a_blocked_sector_changes_nothing_and_a_wet_road_shows_no_fault() {
    let fault = "blocked-from-deg = -1.5\nblocked-to-deg = 1.5";
    let beside = Drive { fault, has_neighbours: true, ..Drive::default() }.run();
    assert!(beside.iter().any(|alarms| alarms.rear.contains(Alarm::BlockedSector)));
    let wet = Drive { fault, environment: RAIN, ..Drive::default() }.run();
    assert!(wet.iter().all(|alarms| !alarms.rear.contains(Alarm::BlockedSector)), "the monitor pauses");
}

#[test]
fn small_errors_of_the_mounting_are_tolerated_and_none_of_the_transport_is_there() {
    for fault in ["pitch-deg = 0.05", "height-m = 0.01", "yaw-deg = 1.0", "delay-s = 0.04", "lost-frames = 0.02"] {
        let alarms = Drive { fault, ..Drive::default() }.run();
        assert!(alarms.iter().all(|alarms| *alarms == SensorAlarms::default()), "{fault}");
    }
}

#[test]
fn each_fault_raises_its_alarm_and_only_the_sensor_that_has_it_does() {
    for (fault, alarm) in [
        ("dropout = 0.6", Alarm::MissingReturns),
        ("window-transmission = 0.5", Alarm::MissingReturns),
        ("height-m = -0.05", Alarm::WrongHeight),
        ("pitch-deg = -0.5", Alarm::WrongHeight),
        ("range-noise-m = 0.3", Alarm::NoisyRanges),
        ("lost-frames = 0.6", Alarm::LostScans),
        ("delay-s = 0.2", Alarm::LateScans),
        ("jitter-s = 0.2", Alarm::LateScans),
        ("clock-offset-s = -0.05", Alarm::LateScans),
        ("clock-offset-s = 0.05", Alarm::LateScans),
    ] {
        let alarms = Drive { fault, sensors: "front-lidar = {}", ..Drive::default() }.run();
        let last = alarms[249];
        assert!(last.rear == Alarms::NONE.with_if(alarm, true), "{fault}: {:?}", last.rear);
        assert!(last.front.is_empty() && last.surround.is_empty(), "{fault}");
    }
}
