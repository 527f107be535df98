//! Validates the tracking by the rear sensors: its range, its accuracy and the consistency of its
//! covariance, over many approaches of a vehicle from behind.
//!
//! ```text
//! cargo run --release -p closecall-xtask -- validate-tracking [SEED]
//! ```
//!
//! In each approach a vehicle drives in the ego's lane, 10 to 60 km/h faster than the ego. The
//! output has one line for each type of target, with these columns:
//! - the bumper-to-bumper distances at which 95 %, 50 % and 5 % of the approaches had a confirmed
//!   track;
//! - the root mean square error of the speed, once the vehicle has been tracked for 1 s;
//! - the mean normalised estimation error squared (NEES), which is 4 if the covariance is
//!   consistent;
//! - the number of identity switches;
//! - the number of confirmed tracks without a vehicle;
//! - the share of the steps with a confirmed track in which the track is classified as a vehicle.
//!
//! No constant was tuned on the default seed, 2026: the constants of the scanner were chosen with
//! seed 11, and the constants of the tracker with other seeds.
#![expect(clippy::print_stdout, reason = "a validation prints its result")]

use closecall_sensors::{NoiseKey, Scene, SceneVehicle, SensorMode, Sensors, SensorsConfig, TrackAudit};
use closecall_traffic::metrics::{bumper_gap_m, touching_distance_m};
use closecall_traffic::{
    ActorId, CONTROL_STEP, Check, Environment, Parameters, Road, RoadConfig, Source, TrackStatus, Vehicle,
    VehicleClass, VehicleState,
};

/// Number of approaches for each type of target.
const RUNS: u64 = 40;
/// Seed if none is given.
const DEFAULT_SEED: u64 = 2026;
/// Speed of the ego (m/s).
const EGO_MPS: f64 = 30.0;
/// Lateral position of both vehicles (m), in the middle one of three lanes.
const OWN_LANE_M: f64 = -5.625;
/// Gap at the start of an approach (m).
const START_GAP_M: f64 = 190.0;
/// Gap at the end of an approach (m).
const LAST_GAP_M: f64 = 5.0;
/// Number of scans with a confirmed track after which errors count.
const SETTLING_SCANS: usize = 25;

/// A type of target and the conditions in which it approaches.
struct Case {
    name: &'static str,
    class: VehicleClass,
    paint: f64,
    environment: Environment,
    guard_rails: bool,
}

/// The results of all approaches of a case.
#[derive(Default)]
struct CaseResult {
    /// Gap of each approach at the first confirmed track (m), or 0 if there was none.
    confirmed_at_m: Vec<f64>,
    audit: TrackAudit,
    false_tracks: usize,
    /// Number of steps with a confirmed track.
    confirmed_steps: u64,
    /// Number of these steps in which the track is classified as a vehicle.
    vehicle_steps: u64,
}

fn vehicle(actor: usize, class: VehicleClass, s_m: f64, speed_mps: f64) -> SceneVehicle {
    let state = VehicleState { s_m, d_m: OWN_LANE_M, speed_mps, ..VehicleState::default() };
    SceneVehicle { actor, vehicle: Vehicle::typical(class), state, pitch_rad: 0.0 }
}

fn road(guard_rails: bool) -> Road {
    let config = RoadConfig {
        lanes: 3,
        lane_width_m: 3.75.into(),
        curvature_per_m: 0.0.into(),
        cross_sections: Vec::new(),
        alignment: Vec::new(),
        alignment_d_m: None,
        speed_limit_mps: 36.1.into(),
        overtaking_side: closecall_traffic::Side::Left,
        guard_rails,
        roadside: closecall_traffic::RoadsideConfig::default(),
        acceleration_lane: None,
    };
    config.check(&Parameters::default()).expect("a valid road")
}

/// Simulates one approach and adds its results to `result`.
fn approach(case: &Case, sensors: &Sensors, [seed, sample]: [u64; 2], result: &mut CaseResult) {
    let key = NoiseKey { seed, sample, ego: ActorId::new("ego").expect("a legal name"), actors: [].into() };
    let mut perception = sensors.build(&key).expect("no model to load");
    let road = road(case.guard_rails);
    let closing_mps = (10.0 + 50.0 * sample as f64 / (RUNS - 1) as f64) / 3.6;
    let mut ego = vehicle(0, VehicleClass::Car, 1_000.0, EGO_MPS);
    let mut rear = vehicle(1, case.class, 0.0, EGO_MPS + closing_mps);
    rear.vehicle.appearance.paint_reflectivity = case.paint;
    let [ego_m, rear_m] = [ego, rear].map(|vehicle| vehicle.vehicle.dimensions.length_m);
    // The offset varies the distances at which each side of the alternating mirror scans the
    // vehicle.
    rear.state.s_m = ego.state.s_m - touching_distance_m(ego_m, rear_m) - START_GAP_M - 0.37 * sample as f64;
    let (mut audit, mut settled, mut confirmed_scans) = (TrackAudit::default(), TrackAudit::default(), 0);
    let mut confirmed_at_m = 0.0;
    for scan in 0.. {
        let gap_m = bumper_gap_m(ego.state.s_m - rear.state.s_m, ego_m, rear_m);
        if gap_m < LAST_GAP_M {
            break;
        }
        let others = [rear];
        let time = CONTROL_STEP * scan;
        let scene = Scene { time, road: &road, environment: &case.environment, ego, others: &others };
        let tracks = perception.step(&scene).expect("finite");
        audit.observe(tracks, &scene).expect("finite");
        let of_rear = tracks.iter().filter(|track| track.source == Source::Rear);
        let confirmed = of_rear.filter(|track| track.status != TrackStatus::Tentative && track.lane[1] > 0.5);
        if let Some(track) = confirmed.max_by(|a, b| a.existence.total_cmp(&b.existence)) {
            if confirmed_scans == 0 {
                confirmed_at_m = gap_m;
            }
            confirmed_scans += 1;
            result.vehicle_steps += u64::from(track.class.vehicle() > 0.5);
            result.confirmed_steps += 1;
        }
        if confirmed_scans > SETTLING_SCANS {
            settled.observe(tracks, &scene).expect("finite");
        }
        ego.state.s_m += ego.state.speed_mps * CONTROL_STEP.s();
        rear.state.s_m += rear.state.speed_mps * CONTROL_STEP.s();
    }
    result.confirmed_at_m.push(confirmed_at_m);
    result.false_tracks += audit.false_tracks();
    result.audit.id_switches += audit.id_switches;
    result.audit.extend(&settled);
}

pub(crate) fn main(words: Vec<String>) {
    let seed = words.into_iter().next().map_or(DEFAULT_SEED, |text| text.parse().expect("a seed is a whole number"));
    let sensors = SensorsConfig::default().check(&Parameters::default()).expect("the defaults are valid");
    let day = Environment::CLEAR_DAY;
    let fog = Environment { visibility_m: 100.0, ..day };
    let wet = Environment { rain_mm_per_h: 5.0, water_film_mm: 1.0, friction: 0.6, visibility_m: 3_000.0, ..day };
    let case = |name, class, paint, environment, guard_rails| Case { name, class, paint, environment, guard_rails };
    let cases = [
        case("car, 50 % paint", VehicleClass::Car, 0.5, day, false),
        case("car, 10 % paint", VehicleClass::Car, 0.1, day, false),
        case("car, 50 %, guard rails", VehicleClass::Car, 0.5, day, true),
        case("car, 50 %, fog of 100 m", VehicleClass::Car, 0.5, fog, false),
        case("car, 50 %, rain, wet road", VehicleClass::Car, 0.5, wet, true),
        case("truck, 50 % paint", VehicleClass::Truck, 0.5, day, false),
        case("motorcycle", VehicleClass::Motorcycle, 0.5, day, false),
    ];
    for mode in [SensorMode::Object, SensorMode::Full] {
        println!("{mode:?}, {RUNS} approaches each, seed {seed}");
        println!("                            95 %    50 %     5 %   speed    NEES  switches  false  vehicle");
        for case in &cases {
            let mut result = CaseResult::default();
            for sample in 0..RUNS {
                approach(case, &sensors.with_mode(mode), [seed, sample], &mut result);
            }
            print(case, &mut result);
        }
    }
}

fn print(case: &Case, result: &mut CaseResult) {
    result.confirmed_at_m.sort_by(f64::total_cmp);
    let at = |share: f64| result.confirmed_at_m[(share * (RUNS - 1) as f64).round() as usize];
    println!(
        "{:26} {:5.0} m {:5.0} m {:5.0} m {:5.2} m/s {:5.2} {:8} {:6} {:8.3}",
        case.name,
        at(0.05),
        at(0.5),
        at(0.95),
        result.audit.speed_rmse_mps().unwrap_or(f64::NAN),
        result.audit.mean_nees().unwrap_or(f64::NAN),
        result.audit.id_switches,
        result.false_tracks,
        result.vehicle_steps as f64 / result.confirmed_steps.max(1) as f64,
    );
}
