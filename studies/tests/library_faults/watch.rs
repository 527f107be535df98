//! One drive with the sensors of a scenario: their view of one vehicle.

use closecall_scenarios::{Scenario, ScenarioFile, library};
use closecall_sensors::faults::Faults;
use closecall_sensors::lidar::PointSource;
use closecall_sensors::monitors::Alarms;
use closecall_sensors::{Health, NoiseKey, Scene, SceneVehicle, Sensors};
use closecall_traffic::{
    ActorId, CONTROL_STEP, Environment, Road, Source, Track, TrackStatus, Vehicle, VehicleClass, VehicleState,
};

const EGO_S_M: f64 = 1_000.0;
const EGO_MPS: f64 = 30.0;
/// Lateral position of the ego: the middle one of three lanes (m).
const EGO_D_M: f64 = -5.625;

/// The sensor that a fault concerns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Of {
    FrontRadar,
    FrontLidar,
    Surround,
    RearObject,
    RearLidar,
    RearCamera,
}

impl Of {
    pub(crate) fn source(self) -> Source {
        match self {
            Self::FrontRadar | Self::FrontLidar => Source::Front,
            Self::Surround => Source::Surround,
            Self::RearObject | Self::RearLidar | Self::RearCamera => Source::Rear,
        }
    }

    pub(crate) fn looks_ahead(self) -> bool {
        self.source() == Source::Front
    }
}

/// The vehicle that the sensor watches.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Car {
    /// Gap between the bumpers: ahead of the ego for the sensors that look ahead, and behind it for
    /// the others (m).
    pub(crate) gap_m: f64,
    /// Lateral offset from the ego, positive to the left (m).
    pub(crate) left_m: f64,
    pub(crate) closing_mps: f64,
}

/// The observation of one step.
#[derive(Clone, Debug)]
pub(crate) struct Step {
    /// The tracks of the sensor that a function may act on.
    pub(crate) tracks: Vec<Track>,
    pub(crate) health: Health,
    /// What the monitors of the sensor have noticed.
    pub(crate) alarms: Alarms,
    /// Heights of the points on vehicles (m).
    pub(crate) points_z_m: Vec<f32>,
    /// Number of points where nothing is.
    pub(crate) false_points: usize,
}

impl Step {
    /// Returns the track of the vehicle that the sensor watches.
    pub(crate) fn track(&self) -> Option<&Track> {
        self.tracks.iter().min_by(|a, b| a.y_m().abs().total_cmp(&b.y_m().abs()))
    }
}

/// Loads a scenario of the library. A broken one fails the test.
pub(crate) fn load(name: &str, settings: &[&str]) -> Scenario {
    let settings: Vec<_> = settings.iter().map(|setting| setting.parse().unwrap()).collect();
    let text = library::text(name).unwrap_or_else(|| panic!("the library has no scenario `{name}`"));
    let file = ScenarioFile::parse(&library::path(name), text, &settings).unwrap_or_else(|error| panic!("{error}"));
    file.concrete(&file.space().nominal()).unwrap_or_else(|error| panic!("{name}: {error}"))
}

fn vehicle(actor: usize, s_m: f64, d_m: f64, speed_mps: f64) -> SceneVehicle {
    let state = VehicleState { s_m, d_m, speed_mps, ..VehicleState::default() };
    SceneVehicle { actor, vehicle: Vehicle::typical(VehicleClass::Car), state, pitch_rad: 0.0 }
}

/// Drives with the sensors, on the road and in the light of the scenario.
pub(crate) fn drive(sensor: Of, sensors: &Sensors, scenario: &Scenario, (car, steps): (Option<Car>, i64)) -> Vec<Step> {
    let ego_id = ActorId::new("ego").unwrap();
    let mut perception = sensors.build(&NoiseKey { seed: 3, sample: 1, ego: ego_id, actors: [].into() }).unwrap();
    let environment = Environment { light: scenario.environment.light, ..Environment::CLEAR_DAY };
    let road: &Road = &scenario.road;
    let mut ego = vehicle(0, EGO_S_M, EGO_D_M, EGO_MPS);
    let length_m = ego.vehicle.dimensions.length_m;
    let sign = if sensor.looks_ahead() { 1.0 } else { -1.0 };
    let of_car = |car: Car| {
        let s_m = EGO_S_M + sign * (car.gap_m + length_m);
        vehicle(1, s_m, EGO_D_M + car.left_m, EGO_MPS - sign * car.closing_mps)
    };
    let mut others: Vec<SceneVehicle> = car.map(of_car).into_iter().collect();
    let mut shown = Vec::new();
    for step in 0..steps {
        let scene = Scene { time: CONTROL_STEP * step, road, environment: &environment, ego, others: &others };
        let is_own = |track: &&Track| track.source == sensor.source() && track.status != TrackStatus::Tentative;
        let tracks = perception.step(&scene).unwrap().iter().filter(is_own).cloned().collect();
        let (health, alarms) = (perception.health(), perception.alarms());
        let (health, alarms) = match sensor.source() {
            Source::Front => (health.front, alarms.front),
            Source::Surround => (health.surround, alarms.surround),
            Source::Rear => (health.rear, alarms.rear),
        };
        let (mut points_z_m, mut false_points) = (Vec::new(), 0);
        for mounted in perception.lidars().iter().filter(|mounted| mounted.looks_ahead == sensor.looks_ahead()) {
            let (scan, truth) = (mounted.lidar.latest(), mounted.lidar.truth());
            for (index, point) in truth.points.iter().enumerate() {
                match point.source {
                    PointSource::Actor(_) => points_z_m.push(scan.z_m[index]),
                    PointSource::False => false_points += 1,
                    _ => {}
                }
            }
        }
        shown.push(Step { tracks, health, alarms, points_z_m, false_points });
        for vehicle in others.iter_mut().chain([&mut ego]) {
            vehicle.state.s_m += vehicle.state.speed_mps * CONTROL_STEP.s();
        }
    }
    shown
}

/// The same drive without the faults of a scenario, and with them.
pub(crate) struct Pair {
    pub(crate) usual: Vec<Step>,
    pub(crate) faulty: Vec<Step>,
}

/// Drives with the sensors of a scenario without its faults, and with them: from their start to
/// their end if `is_timed`, and else for the whole drive.
pub(crate) fn pair(name: &str, sensor: Of, (car, steps): (Option<Car>, i64), is_timed: bool) -> Pair {
    let without_camera = "sensors.rear-camera.pipeline=\"off\"";
    // False points then come from the fault.
    let settings: &[&str] = match sensor {
        Of::RearCamera => &[],
        Of::RearLidar => &[without_camera, "sensors.rear-lidar.false-alarm-rate=0.0"],
        Of::FrontLidar => &[without_camera, "sensors.front-lidar.false-alarm-rate=0.0"],
        _ => &[without_camera],
    };
    let scenario = load(name, settings);
    let sensors = scenario.sensors;
    let faults = *sensors.faults();
    assert_ne!(faults, Faults::default(), "{name} has no fault");
    let faulty = sensors.with_faults(if is_timed { faults } else { faults.throughout() });
    Pair {
        usual: drive(sensor, &sensors.with_faults(Faults::default()), &scenario, (car, steps)),
        faulty: drive(sensor, &faulty, &scenario, (car, steps)),
    }
}
