//! Tests of the full rear chain: the range and accuracy at which a rear vehicle is tracked.
//!
//! The tests use few runs. `just xtask validate-tracking` gives the figures.
#![expect(clippy::unwrap_used, reason = "a test that cannot be set up has failed")]

use closecall_sensors::{Health, NoiseKey, Perception, Scene, SceneVehicle, SensorMode, SensorsConfig, TrackAudit};
use closecall_traffic::metrics::{bumper_gap_m, touching_distance_m};
use closecall_traffic::{
    ActorId, CONTROL_STEP, Check, Environment, Parameters, Road, Source, Track, TrackStatus, Vehicle, VehicleClass,
    VehicleState,
};

const OWN_LANE_M: f64 = -5.625;

/// The ego at 30 m/s and one rear vehicle in its lane, on a clear day.
struct Approach {
    road: Road,
    ego: SceneVehicle,
    rear: SceneVehicle,
    perception: Box<dyn Perception>,
    scans: i64,
}

impl Approach {
    fn new(class: VehicleClass, gap_m: f64, closing_kmh: f64, sample: u64) -> Self {
        let vehicle = |actor, class, s_m, speed_mps| {
            let state = VehicleState { s_m, d_m: OWN_LANE_M, speed_mps, ..VehicleState::default() };
            SceneVehicle { actor, vehicle: Vehicle::typical(class), state, pitch_rad: 0.0 }
        };
        let ego = vehicle(0, VehicleClass::Car, 1_000.0, 30.0);
        let touching_m = touching_distance_m(ego.vehicle.dimensions.length_m, class.typical_dimensions().length_m);
        let key = NoiseKey { seed: 5, sample, ego: ActorId::new("ego").unwrap(), actors: [].into() };
        let sensors = SensorsConfig::default().check(&Parameters::default()).unwrap().with_mode(SensorMode::Full);
        Self {
            road: Road::straight(3),
            ego,
            rear: vehicle(1, class, 1_000.0 - gap_m - touching_m, 30.0 + closing_kmh / 3.6),
            perception: sensors.build(&key).unwrap(),
            scans: 0,
        }
    }

    fn gap_m(&self) -> f64 {
        let [ego_m, rear_m] = [&self.ego, &self.rear].map(|vehicle| vehicle.vehicle.dimensions.length_m);
        bumper_gap_m(self.ego.state.s_m - self.rear.state.s_m, ego_m, rear_m)
    }

    /// Performs one control step, passes the tracks to `audit`, and returns the confirmed rear tracks.
    fn step(&mut self, audit: &mut TrackAudit) -> Vec<Track> {
        let others = [self.rear];
        let time = CONTROL_STEP * self.scans;
        let environment = &Environment::CLEAR_DAY;
        let scene = Scene { time, road: &self.road, environment, ego: self.ego, others: &others };
        let tracks = self.perception.step(&scene).unwrap();
        audit.observe(tracks, &scene).unwrap();
        let confirmed = |track: &&Track| track.source == Source::Rear && track.status != TrackStatus::Tentative;
        let tracks = tracks.iter().filter(confirmed).cloned().collect();
        self.scans += 1;
        for vehicle in [&mut self.ego, &mut self.rear] {
            vehicle.state.s_m += vehicle.state.speed_mps * CONTROL_STEP.s();
        }
        tracks
    }

    /// Returns the gap at which the rear vehicle is first confirmed in the ego's lane, or 0 if it is not confirmed down
    /// to a gap of `until_m`.
    fn confirmed_at_m(mut self, until_m: f64) -> f64 {
        let mut audit = TrackAudit::default();
        while self.gap_m() > until_m {
            let gap_m = self.gap_m();
            if self.step(&mut audit).iter().any(|track| track.lane[1] > 0.5) {
                return gap_m;
            }
        }
        0.0
    }
}

#[test]
fn a_car_is_confirmed_beyond_100_m() {
    for sample in 0..6_u32 {
        let closing_kmh = 10.0 + 10.0 * f64::from(sample);
        let approach = Approach::new(VehicleClass::Car, 132.0, closing_kmh, sample.into());
        let at_m = approach.confirmed_at_m(95.0);
        assert!(at_m >= 100.0, "{closing_kmh} km/h: {at_m} m");
    }
}

#[test]
fn a_motorcycle_is_confirmed_beyond_60_m() {
    for sample in 0..6_u32 {
        let closing_kmh = 10.0 + 10.0 * f64::from(sample);
        let approach = Approach::new(VehicleClass::Motorcycle, 105.0, closing_kmh, sample.into());
        let at_m = approach.confirmed_at_m(55.0);
        assert!(at_m >= 60.0, "{closing_kmh} km/h: {at_m} m");
    }
}

#[test]
fn one_vehicle_gives_one_track_with_an_accurate_speed() {
    for class in VehicleClass::ALL {
        let mut approach = Approach::new(class, 90.0, 40.0, 7);
        let mut audit = TrackAudit::default();
        let (mut settling, mut ids) = (25, Vec::new());
        while approach.gap_m() > 6.0 {
            let tracks = approach.step(&mut audit);
            ids.extend(tracks.iter().map(|track| track.id));
            if !tracks.is_empty() && settling > 0 {
                settling -= 1;
                audit = TrackAudit::default();
            }
        }
        ids.sort_unstable();
        ids.dedup();
        assert_eq!(ids.len(), 1, "{class:?}");
        assert_eq!((audit.id_switches, audit.false_tracks()), (0, 0), "{class:?}");
        let rmse_mps = audit.speed_rmse_mps().unwrap();
        assert!(rmse_mps <= 0.7, "{class:?}: {rmse_mps} m/s");
        let nees = audit.mean_nees().unwrap();
        // No vehicle manoeuvres here, so the errors are smaller than the covariance must allow for.
        assert!(nees < 6.0, "{class:?}: {nees}");
    }
}

#[test]
fn an_empty_road_behind_gives_no_track() {
    let mut approach = Approach::new(VehicleClass::Car, 400.0, 0.0, 3);
    let mut audit = TrackAudit::default();
    for _ in 0..100 {
        assert!(approach.step(&mut audit).is_empty());
    }
}

/// Returns the health of the rear sensors after 2 s on an empty road.
fn health_on_an_empty_road(lidar: &str, environment: &Environment) -> Health {
    let config: SensorsConfig =
        toml::from_str(&format!("mode = \"full\"\nrear-lidar = {{ {lidar} }}\nrear-camera = {{ pipeline = \"off\" }}"))
            .unwrap();
    let key = NoiseKey { seed: 6, sample: 0, ego: ActorId::new("ego").unwrap(), actors: [].into() };
    let mut perception = config.check(&Parameters::default()).unwrap().build(&key).unwrap();
    let road = Road::straight(3);
    let state = VehicleState { s_m: 1_000.0, d_m: OWN_LANE_M, speed_mps: 30.0, ..VehicleState::default() };
    let ego = SceneVehicle { actor: 0, vehicle: Vehicle::typical(VehicleClass::Car), state, pitch_rad: 0.0 };
    for scan in 0..50 {
        let scene = Scene { time: CONTROL_STEP * scan, road: &road, environment, ego, others: &[] };
        perception.step(&scene).unwrap();
    }
    perception.health().rear
}

#[test]
fn health_reports_a_blocked_window_and_fog_but_not_an_empty_road() {
    let day = Environment::CLEAR_DAY;
    let fog = Environment { visibility_m: 100.0, ..day };
    let wet = Environment { rain_mm_per_h: 5.0, water_film_mm: 1.0, friction: 0.6, visibility_m: 3_000.0, ..day };
    assert_eq!(health_on_an_empty_road("", &day), Health::Ok);
    assert_eq!(health_on_an_empty_road("", &wet), Health::Ok);
    assert_eq!(health_on_an_empty_road("", &fog), Health::Degraded);
    assert_eq!(health_on_an_empty_road("window-transmission = 0.4", &day), Health::Degraded);
    assert_eq!(health_on_an_empty_road("window-transmission = 0.0", &day), Health::Failed);
}

#[test]
fn the_same_key_gives_the_same_bits() {
    let run = || {
        let mut approach = Approach::new(VehicleClass::Car, 60.0, 40.0, 9);
        let mut audit = TrackAudit::default();
        let states = (0..25).flat_map(|_| approach.step(&mut audit)).flat_map(|track| track.state.data.0[0]);
        states.map(f64::to_bits).collect::<Vec<_>>()
    };
    let bits = run();
    assert!(!bits.is_empty());
    assert_eq!(bits, run());
}
