//! The rear LiDAR as a whole: what it sees of vehicles at known places.

use closecall_traffic::{ActorId, Environment, Road, Stream, Time, VehicleClass, VehicleState, stream};
use proptest::prelude::*;

use super::*;
use crate::testing::{scene_vehicle, with_speed};
use crate::{Detection, Extent, Scene, SceneVehicle};

/// E's lane is the middle one of three.
const LANE_D_M: f64 = -5.625;
const SPEED_MPS: f64 = 30.0;
/// From E's origin to its rear bumper [m].
const REAR_M: f64 = 2.3;

struct Stage {
    time: Time,
    road: Road,
    environment: Environment,
    ego: SceneVehicle,
    others: Vec<SceneVehicle>,
}

impl Stage {
    fn new() -> Self {
        let ego = with_speed(scene_vehicle(0, VehicleClass::Car, 1_000.0, LANE_D_M), SPEED_MPS);
        Self { time: Time::ZERO, road: Road::straight(3), environment: Environment::CLEAR_DAY, ego, others: Vec::new() }
    }

    /// With a vehicle whose front is `gap_m` behind E's rear, `left_m` to the left of E, as fast as E.
    fn with(mut self, class: VehicleClass, gap_m: f64, left_m: f64) -> Self {
        let half = 0.5 * class.typical_dimensions().length_m;
        let s_m = self.ego.state.s_m - REAR_M - gap_m - half;
        let vehicle = scene_vehicle(self.others.len() + 1, class, s_m, LANE_D_M + left_m);
        self.others.push(with_speed(vehicle, SPEED_MPS));
        self
    }

    fn scene(&self) -> Scene<'_> {
        Scene { time: self.time, road: &self.road, environment: &self.environment, ego: self.ego, others: &self.others }
    }

    /// Looks once, at the side of the mirror that belongs to `look`, with noise that does too.
    fn look(&mut self, lidar: &mut RearLidar, look: i64) -> Vec<Detection> {
        self.time = Time::from_ns(PERIOD_NS * look);
        lidar.scan(&self.scene(), &mut random(look.unsigned_abs()));
        lidar.detect().unwrap().to_vec()
    }

    /// Points on the first of the others, mean over 20 scans.
    fn mean_points(&mut self) -> f64 {
        let mut lidar = RearLidar::new(Lidar::default());
        let mut points = 0;
        for look in 0..20 {
            self.look(&mut lidar, look);
            points += count(lidar.truth(), PointSource::Actor(1));
        }
        points as f64 / 20.0
    }
}

fn random(sample: u64) -> Stream {
    stream(0, sample, &ActorId::new("ego").unwrap(), "lidar")
}

fn count(truth: &ScanTruth, source: PointSource) -> usize {
    truth.points.iter().filter(|point| point.source == source).count()
}

/// Beams whose centres meet the upright rectangle, by the formula of the pattern alone.
fn hand_count(mirror: Mirror, distance_m: f64, half_width_m: f64, [low_m, high_m]: [f64; 2]) -> usize {
    let pattern = Pattern::scala_2();
    let meets = |&beam: &u16| {
        let (azimuth, elevation) = pattern.direction_rad(mirror, beam);
        let height = 0.6 + distance_m / azimuth.cos() * elevation.tan();
        (distance_m * azimuth.tan()).abs() < half_width_m && height > low_m && height < high_m
    };
    (0..u16::try_from(BEAMS).unwrap()).filter(meets).count()
}

#[test]
fn the_counts_on_a_truck_are_those_of_the_pattern() {
    for gap_m in [3.0, 10.0, 30.0, 60.0] {
        let mut stage = Stage::new().with(VehicleClass::Truck, gap_m, 0.0);
        let mut lidar = RearLidar::new(Lidar { dropout: 0.0, ..Lidar::default() });
        for look in 0..2 {
            stage.look(&mut lidar, look);
            let mirror = lidar.latest().mirror;
            let points = lidar.latest().beam.iter().zip(&lidar.truth().points);
            let on = points.filter(|(_, point)| point.source == PointSource::Actor(1));
            let mut beams: Vec<u16> = on.map(|(&beam, _)| beam).collect();
            beams.dedup();
            // The cabin's front is 2.51 m wide and reaches from 0.35 m to 3.8 m: at least the beams whose centres meet
            // it, and at most those whose footprints touch the vehicle, wheels and load taken in.
            let footprint = [gap_m * 0.0625_f64.to_radians(), gap_m * 0.3_f64.to_radians()];
            let least = hand_count(mirror, gap_m, 1.255, [0.35, 3.8]);
            let most =
                hand_count(mirror, gap_m, 1.275 + 1.2 * footprint[0], [-1.2 * footprint[1], 4.0 + 1.2 * footprint[1]]);
            assert!((least..=most).contains(&beams.len()), "{} not in {least}..={most} at {gap_m} m", beams.len());
            assert!(most as f64 / least as f64 - 1.0 < 0.6, "{least} {most}");
        }
    }
}

#[test]
fn the_counts_on_a_car_are_those_that_recordings_show() {
    for gap_m in [3.0, 4.0, 5.0] {
        let points = Stage::new().with(VehicleClass::Car, gap_m, 0.0).mean_points();
        assert!((2_500.0..=4_100.0).contains(&points), "{points} at {gap_m} m");
    }
    let points = Stage::new().with(VehicleClass::Car, 30.0, 0.0).mean_points();
    // 28 columns by the 4 or 5 layers between 0.18 m and 1.5 m.
    assert!((100.0..=160.0).contains(&points), "{points}");
    let points = Stage::new().with(VehicleClass::Car, 100.0, 0.0).mean_points();
    assert!((5.0..=20.0).contains(&points), "{points}");
}

#[test]
fn a_motorcycle_at_100_m_fills_three_columns() {
    let mut stage = Stage::new().with(VehicleClass::Motorcycle, 100.0, 0.0);
    // A receiver that misses nothing shows the geometry alone.
    let mut lidar = RearLidar::new(Lidar { dropout: 0.0, nominal_range_m: 500.0, ..Lidar::default() });
    for look in 0..2 {
        stage.look(&mut lidar, look);
        let points = lidar.latest().beam.iter().zip(&lidar.truth().points);
        let on = points.filter(|(_, point)| point.source == PointSource::Actor(1));
        let mut columns: Vec<usize> = on.map(|(&beam, _)| usize::from(beam) / LAYERS).collect();
        columns.sort_unstable();
        columns.dedup();
        assert!((3..=4).contains(&columns.len()), "{columns:?}");
    }
}

#[test]
fn dark_paint_rain_and_fog_shorten_the_sight() {
    let seen = |reflectivity: f64, environment: Environment, gap_m: f64| {
        let mut stage = Stage::new().with(VehicleClass::Car, gap_m, 0.0);
        stage.environment = environment;
        stage.others[0].vehicle.appearance.paint_reflectivity = reflectivity;
        stage.mean_points()
    };
    let clear = Environment::CLEAR_DAY;
    let rain = Environment { rain_mm_per_h: 50.0, ..clear };
    let fog = |visibility_m| Environment { visibility_m, ..clear };
    // At 90 m every step makes a difference; two-way transmission: rain 0.54, fog of 200 m 0.03.
    let counts = [
        seen(0.8, clear, 90.0),
        seen(0.5, clear, 90.0),
        seen(0.5, rain, 90.0),
        seen(0.1, clear, 90.0),
        seen(0.5, fog(200.0), 90.0),
    ];
    assert!(counts.windows(2).all(|pair| pair[0] > pair[1]), "{counts:?}");
    let fogs = [seen(0.5, fog(1_000.0), 50.0), seen(0.5, fog(200.0), 50.0), seen(0.5, fog(100.0), 50.0)];
    assert!(fogs.windows(2).all(|pair| pair[0] > pair[1]), "{fogs:?}");
}

#[test]
fn vehicles_hide_each_other() {
    let mut stage = Stage::new().with(VehicleClass::Motorcycle, 40.0, 0.0).with(VehicleClass::Truck, 10.0, 0.0);
    let mut lidar = RearLidar::new(Lidar::default());
    stage.look(&mut lidar, 0);
    assert_eq!(count(lidar.truth(), PointSource::Actor(1)), 0);
    stage.others.pop();
    stage.look(&mut lidar, 0);
    assert!(count(lidar.truth(), PointSource::Actor(1)) > 10);
}

#[test]
fn pitch_under_braking_moves_the_beams_and_levelling_undoes_it() {
    let mut stage = Stage::new().with(VehicleClass::Truck, 30.0, 0.0);
    let mut lidar = RearLidar::new(Lidar { levelling_sd_rad: 0.0, ..Lidar::default() });
    let mut means = |pitch_rad: f64| {
        stage.ego.pitch_rad = pitch_rad;
        stage.look(&mut lidar, 0);
        let scan = lidar.latest();
        let lowest = (0..scan.len()).filter(|&at| lidar.truth().points[at].material == Material::Plate);
        let (mut layers, mut heights, mut n) = (0.0, 0.0, 0.0);
        for at in lowest {
            layers += f64::from(scan.beam[at] % 16);
            heights += f64::from(scan.z_m[at]);
            n += 1.0;
        }
        assert!(n > 0.0);
        (layers / n, heights / n)
    };
    // Half a group of layers: 1.205°.
    let (level, braking) = (means(0.0), means(1.205_f64.to_radians()));
    let moved = level.0 - braking.0;
    assert!((1.0..=3.0).contains(&moved), "{moved} layers");
    assert!((level.1 - braking.1).abs() < 0.2, "{level:?} {braking:?}");
}

#[test]
fn wet_roads_raise_spray_behind_e_and_dry_ones_do_not() {
    let mut stage = Stage::new().with(VehicleClass::Car, 20.0, 0.0);
    let mut lidar = RearLidar::new(Lidar::default());
    let mut spray = |film_mm: f64, speed_mps: f64| {
        stage.environment.water_film_mm = film_mm;
        stage.ego.state.speed_mps = speed_mps;
        let found = stage.look(&mut lidar, 0);
        let points: Vec<_> = lidar.truth().points.iter().filter(|at| at.source == PointSource::Spray).collect();
        assert!(points.iter().all(|point| point.range_m < 15.0));
        // Spray hides nobody, and is no vehicle.
        assert_eq!(found.iter().filter(|box_| box_.class.vehicle() > 0.5).count(), 1, "{found:?}");
        points.len()
    };
    assert_eq!(spray(0.0, 30.0), 0);
    assert_eq!(spray(1.0, 10.0), 0);
    let (some, more) = (spray(0.5, 30.0), spray(1.5, 30.0));
    assert!(some > 20 && more > some, "{some} {more}");
}

#[test]
fn fog_sends_false_returns_and_is_no_vehicle() {
    let mut stage = Stage::new();
    stage.environment.visibility_m = 60.0;
    let mut lidar = RearLidar::new(Lidar::default());
    let found = stage.look(&mut lidar, 0);
    assert!(count(lidar.truth(), PointSource::Fog) > 20);
    assert!(found.iter().all(|box_| box_.class.vehicle() < 0.5), "{found:?}");
}

fn guarded(curvature_per_m: f64) -> Road {
    let text = format!("lanes = 3\nguard-rails = true\ncurvature-per-m = {curvature_per_m:.6}");
    let config: closecall_traffic::RoadConfig = toml::from_str(&text).unwrap();
    closecall_traffic::Check::check(&config, &closecall_traffic::Parameters::default()).unwrap()
}

#[test]
fn guard_rails_are_seen_and_told_from_vehicles() {
    for curvature in [0.0, 0.0025, -0.0025] {
        let mut stage = Stage::new().with(VehicleClass::Car, 30.0, 0.0).with(VehicleClass::Car, 20.0, -3.75);
        stage.road = guarded(curvature);
        let mut lidar = RearLidar::new(Lidar::default());
        for look in 0..2 {
            let found = stage.look(&mut lidar, look);
            assert!(count(lidar.truth(), PointSource::GuardRail) > 50, "{curvature}");
            let vehicles: Vec<_> = found.iter().filter(|box_| box_.class.vehicle() > 0.5).collect();
            assert_eq!(vehicles.len(), 2, "{curvature}: {vehicles:?}");
        }
    }
}

#[test]
fn a_bend_bends_the_boxes_with_it() {
    let mut stage = Stage::new().with(VehicleClass::Car, 60.0, 0.0);
    stage.road = Road::straight(3).with_curvature(0.0025);
    let mut lidar = RearLidar::new(Lidar::default());
    let found = stage.look(&mut lidar, 0);
    assert_eq!(found.len(), 1);
    // Chord of a circle of 394 m radius... of E's lane: y = κ·x²/2 with κ = 0.0025/(1 + 0.0025·5.625).
    let kappa = 0.0025 / (1.0 + 0.0025 * 5.625);
    let expected = 0.5 * kappa * found[0].face_x_m.powi(2);
    assert!((found[0].face_y_m - expected).abs() < 0.2, "{} for {expected}", found[0].face_y_m);
    assert!((found[0].heading_rad - kappa * found[0].face_x_m).abs() < 0.02, "{}", found[0].heading_rad);
}

#[test]
fn what_stands_still_is_where_it_stands_at_the_end_of_the_scan() {
    let mut stage = Stage::new().with(VehicleClass::Truck, 30.0, 0.0);
    stage.others[0].state.speed_mps = 0.0;
    let mut lidar = RearLidar::new(Lidar::default());
    let found = stage.look(&mut lidar, 5);
    assert!((found[0].face_x_m + REAR_M + 30.0).abs() < 0.1, "{}", found[0].face_x_m);
    // What drives is where it was when it was measured.
    stage.others[0].state.speed_mps = SPEED_MPS;
    let found = stage.look(&mut lidar, 5);
    let since_s = (stage.time - found[0].time).s();
    assert!((0.006..0.009).contains(&since_s), "{since_s}");
    let expected = -REAR_M - 30.0 - SPEED_MPS * since_s;
    assert!((found[0].face_x_m - expected).abs() < 0.1, "{} for {expected}", found[0].face_x_m);
}

#[test]
fn scans_are_the_same_to_the_bit_whatever_was_scanned_before() {
    let mut stage = Stage::new().with(VehicleClass::Car, 12.0, 0.3).with(VehicleClass::Truck, 40.0, -3.75);
    stage.road = guarded(0.001);
    stage.environment.water_film_mm = 0.5;
    let mut fresh = RearLidar::new(Lidar::default());
    let first = stage.look(&mut fresh, 3);
    let mut used = RearLidar::new(Lidar::default());
    Stage::new().with(VehicleClass::Motorcycle, 3.0, 0.0).look(&mut used, 8);
    let second = stage.look(&mut used, 3);
    let bits = |lidar: &RearLidar| -> Vec<u32> {
        let scan = lidar.latest();
        let columns = [&scan.x_m, &scan.y_m, &scan.z_m, &scan.intensity];
        columns.into_iter().flatten().map(|value| value.to_bits()).collect()
    };
    assert_eq!(bits(&fresh), bits(&used));
    assert_eq!(fresh.truth(), used.truth());
    assert_eq!(first, second);
}

#[test]
fn another_vehicle_leaves_the_noise_of_other_beams_alone() {
    let mut alone = Stage::new().with(VehicleClass::Car, 20.0, 0.0);
    let mut beside = Stage::new().with(VehicleClass::Car, 20.0, 0.0).with(VehicleClass::Car, 20.0, 7.0);
    let (mut a, mut b) = (RearLidar::new(Lidar::default()), RearLidar::new(Lidar::default()));
    alone.look(&mut a, 0);
    beside.look(&mut b, 0);
    let points = |lidar: &RearLidar| -> Vec<(u16, u32)> {
        let scan = lidar.latest();
        let on = |&at: &usize| lidar.truth().points[at].source == PointSource::Actor(1);
        (0..scan.len()).filter(on).map(|at| (scan.beam[at], scan.x_m[at].to_bits())).collect()
    };
    assert_eq!(points(&a), points(&b));
}

/// Detections that belong to the first of the others, with its true face.
fn first_face(stage: &Stage, found: &[Detection]) -> Option<(Detection, f64, f64)> {
    let state: &VehicleState = &stage.others[0].state;
    let half = 0.5 * stage.others[0].vehicle.dimensions.length_m;
    let near = |box_: &&Detection| {
        let since_s = (stage.time - box_.time).s();
        let x = state.s_m + half - SPEED_MPS * since_s - stage.ego.state.s_m;
        (box_.face_x_m - x).abs() < 2.5 && (box_.face_y_m - (state.d_m - LANE_D_M)).abs() < 1.5
    };
    let box_ = found.iter().find(near)?;
    let since_s = (stage.time - box_.time).s();
    let x = state.s_m + half - SPEED_MPS * since_s - stage.ego.state.s_m;
    Some((box_.clone(), box_.face_x_m - x, box_.face_y_m - (state.d_m - LANE_D_M)))
}

#[test]
fn the_stated_deviations_of_faces_are_those_that_occur() {
    for class in VehicleClass::ALL {
        let (mut along, mut across, mut n) = (0.0, 0.0, 0.0);
        for step in 0..120_i32 {
            let gap = 4.0 + 0.75 * f64::from(step);
            let left = [0.0, 3.75, -3.75, 0.7][step as usize % 4];
            let mut stage = Stage::new().with(class, gap, left);
            let mut lidar = RearLidar::new(Lidar::default());
            let found = stage.look(&mut lidar, step.into());
            let Some((box_, dx, dy)) = first_face(&stage, &found) else { continue };
            along += (dx / box_.range_sd_m).powi(2);
            across += (dy / box_.lateral_sd_m).powi(2);
            n += 1.0;
        }
        let (along, across) = (f64::sqrt(along / n), f64::sqrt(across / n));
        assert!(n > 90.0, "{class:?}: {n} found");
        assert!((0.4..=1.6).contains(&along), "{class:?}: along {along}");
        assert!((0.3..=1.6).contains(&across), "{class:?}: across {across}");
    }
}

#[test]
fn classes_and_widths_are_told_by_shape() {
    for class in VehicleClass::ALL {
        for body_shape in 0..4 {
            for gap in [4.0, 10.0, 25.0, 50.0] {
                let mut stage = Stage::new().with(class, gap, 0.0);
                stage.others[0].vehicle.appearance.body_shape = body_shape;
                let found = stage.look(&mut RearLidar::new(Lidar::default()), 1);
                let (box_, ..) = first_face(&stage, &found).unwrap();
                assert_eq!(box_.class.best_vehicle_class(), class, "{body_shape} at {gap} m: {box_:?}");
                assert!(box_.class.vehicle() > 0.6, "{body_shape} at {gap} m: {box_:?}");
                assert_eq!(box_.width, Extent::Seen);
                let width = class.typical_dimensions().width_m;
                assert!((box_.width_m - width).abs() < 0.35, "{} for {width} at {gap} m", box_.width_m);
            }
        }
    }
}

#[test]
fn clusters_are_vehicles() {
    let mut report = SegmentationReport::default();
    let mut lidar = RearLidar::new(Lidar::default());
    for step in 0..60_i32 {
        let along = f64::from(step);
        let mut stage = Stage::new()
            .with(VehicleClass::Car, 2.0 + 1.5 * along, 0.0)
            .with(VehicleClass::Truck, 5.0 + along, -3.75)
            .with(VehicleClass::Motorcycle, 60.0 - along, 3.75)
            .with(VehicleClass::Car, 25.0 + 1.2 * along, 3.75);
        stage.look(&mut lidar, step.into());
        lidar.report(&mut report);
    }
    assert!(report.vehicles > 180, "{report:?}");
    let share = |count: usize| count as f64 / report.vehicles as f64;
    assert!(share(report.over_segmented) < 0.03, "{report:?}");
    assert!(share(report.under_segmented) < 0.03, "{report:?}");
    assert!(share(report.missed) < 0.03, "{report:?}");
}

fn placed_vehicle() -> impl Strategy<Value = SceneVehicle> {
    let class = prop::sample::select(VehicleClass::ALL.to_vec());
    (class, -130.0..8.0_f64, -9.0..9.0_f64, -0.4..0.4_f64, -0.03..0.03_f64, 0..4_u8).prop_map(
        |(class, along, left, heading_rad, pitch_rad, body_shape)| {
            let mut vehicle = scene_vehicle(1, class, 1_000.0 + along, LANE_D_M + left);
            vehicle.state.heading_rad = heading_rad;
            vehicle.pitch_rad = pitch_rad;
            vehicle.vehicle.appearance.body_shape = body_shape;
            vehicle
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn brute_force_and_the_quick_cast_agree(
        others in prop::collection::vec(placed_vehicle(), 0..5),
        (curvature, pitch_rad, plus) in (-0.0025..0.0025_f64, -0.04..0.04_f64, any::<bool>()),
    ) {
        let mut stage = Stage::new();
        stage.others = others;
        stage.road = guarded(curvature);
        stage.ego.pitch_rad = pitch_rad;
        stage.time = Time::from_ns(if plus { 0 } else { PERIOD_NS });
        let mut scanner = Scanner::new(Lidar::default());
        scanner.assert_cast_agrees_with_brute_force(&stage.scene());
    }
}
