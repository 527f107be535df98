//! The tracker on simulated detections, held against the truth that they were drawn from.

use closecall_traffic::{
    ActorId, Check, ClassScores, Environment, Parameters, Road, Stream, Time, TrackStatus, VehicleClass, stream,
};
use rand::RngExt;
use rand_distr::StandardNormal;

use super::*;
use crate::ego_frame::EgoFrame;
use crate::surroundings::survey;
use crate::testing::{scene_vehicle, with_speed};
use crate::{Detection, Extent, Scene, SceneVehicle};

const OWN_LANE_M: f64 = -5.625;
const LEFT_LANE_M: f64 = -1.875;
const PERIOD_S: f64 = 0.04;
const RANGE_SD_M: f64 = 0.1;
const LATERAL_SD_M: f64 = 0.15;
const FACE_SD_M: f64 = 0.04;
/// How the others accelerate where they do, and for how long.
const ACCELERATION_SD_MPS2: f64 = 0.7;
const PERSISTENCE_S: f64 = 2.0;

fn normal(rng: &mut Stream) -> f64 {
    rng.sample(StandardNormal)
}

/// E and others in motion, with the tracker that follows them.
struct Bench {
    road: Road,
    ego: SceneVehicle,
    others: Vec<SceneVehicle>,
    scans: i64,
    rng: Stream,
    /// By how much the face that is seen stands before the box's, for the whole run [m].
    face_bias_m: f64,
    /// The acceleration of those who manoeuvre [m/s²].
    acceleration_mps2: f64,
    tracker: Tracker,
    list: TrackList,
    audit: TrackAudit,
}

impl Bench {
    fn new(sample: u64, others: Vec<SceneVehicle>) -> Self {
        let model = TrackerConfig::default().check(&Parameters::default()).unwrap();
        let mut rng = stream(3, sample, &ActorId::new("ego").unwrap(), "tracker-test");
        Self {
            face_bias_m: FACE_SD_M * normal(&mut rng),
            acceleration_mps2: 0.0,
            road: Road::straight(3),
            ego: with_speed(scene_vehicle(0, VehicleClass::Car, 1_000.0, OWN_LANE_M), 30.0),
            others,
            scans: 0,
            rng,
            tracker: Tracker::new(model),
            list: TrackList::default(),
            audit: TrackAudit::default(),
        }
    }

    /// Everybody goes on by one scan; with `manoeuvre` the others accelerate and coast as in traffic.
    fn advance(&mut self, manoeuvre: bool) {
        self.scans += 1;
        let persists = (-PERIOD_S / PERSISTENCE_S).exp();
        let kick_mps2 = ACCELERATION_SD_MPS2 * (1.0 - persists * persists).sqrt() * normal(&mut self.rng);
        self.acceleration_mps2 = persists * self.acceleration_mps2 + kick_mps2;
        let acceleration_mps2 = if manoeuvre { self.acceleration_mps2 } else { 0.0 };
        for vehicle in self.others.iter_mut().chain([&mut self.ego]) {
            let state = &mut vehicle.state;
            let stretch = 1.0 - self.road.curvature_per_m() * state.d_m;
            state.s_m += PERIOD_S * state.speed_mps * state.heading_rad.cos() / stretch;
            state.d_m += PERIOD_S * state.speed_mps * state.heading_rad.sin();
        }
        for vehicle in &mut self.others {
            vehicle.state.speed_mps += acceleration_mps2 * PERIOD_S;
        }
    }

    /// One scan that sees those vehicles for which `sees` is true, and the tracks after it.
    fn scan(&mut self, sees: impl Fn(usize) -> bool) -> &[Track] {
        let (road, ego, others) = (self.road, self.ego, self.others.clone());
        let time = Time::from_ms(40) * self.scans;
        let scene = Scene { time, road: &road, environment: &Environment::CLEAR_DAY, ego, others: &others };
        let mut truths = Vec::new();
        survey(&scene, &mut truths).unwrap();
        let mut detections = Vec::new();
        for truth in truths.iter().filter(|truth| sees(truth.actor)) {
            let ahead_m = 0.5 * truth.length_m + self.face_bias_m;
            let face = (truth.x_m + ahead_m * truth.cos, truth.y_m + ahead_m * truth.sin);
            let sight = face.1.atan2(face.0 + 2.3);
            let (sin, cos) = sight.sin_cos();
            let (along, across) = (RANGE_SD_M * normal(&mut self.rng), LATERAL_SD_M * normal(&mut self.rng));
            detections.push(Detection {
                time,
                face_x_m: face.0 + along * cos - across * sin,
                face_y_m: face.1 + along * sin + across * cos,
                range_sd_m: RANGE_SD_M,
                lateral_sd_m: LATERAL_SD_M,
                heading_rad: truth.heading_rad,
                length_m: 4.6,
                length: Extent::Assumed,
                width_m: truth.width_m,
                width: Extent::Seen,
                top_m: 1.5,
                points: 20,
                class: ClassScores([0.6, 0.1, 0.1, 0.2]),
            });
        }
        let view = RearView { half_angle_tan: 2.3, range_m: 200.0, sensor_x_m: -2.3 };
        self.list.tracks.clear();
        let scan = TrackerScan { time, road: &road, ego: ego.state, view, detections: &detections };
        self.tracker.update(&scan, &mut self.list);
        self.tracker.report(time, &EgoFrame::new(&road, &ego.state), &mut self.list);
        self.audit.observe(&self.list.tracks, &scene).unwrap();
        &self.list.tracks
    }
}

fn follower(s_m: f64, d_m: f64, speed_mps: f64) -> SceneVehicle {
    with_speed(scene_vehicle(1, VehicleClass::Car, s_m, d_m), speed_mps)
}

#[test]
fn normalised_errors_squared_do_not_exceed_their_95_percent_bound() {
    let runs = 300_u32;
    let mut sum = 0.0;
    for sample in 0..runs {
        let mut bench = Bench::new(sample.into(), vec![follower(900.0, OWN_LANE_M, 32.0)]);
        for _ in 0..75 {
            bench.scan(|_| true);
            bench.advance(true);
        }
        bench.audit = TrackAudit::default();
        bench.scan(|_| true);
        sum += bench.audit.mean_nees().unwrap();
    }
    // The sum over n runs is χ² with 4n degrees of freedom. Nobody changes lanes here, which the filter has to allow
    // for: the errors across are smaller than it says, but not absurdly so.
    let n = f64::from(runs);
    let mean = sum / n;
    assert!(mean < 4.0 + 1.96 * (8.0 / n).sqrt() && mean > 1.5, "{mean}");
}

#[test]
fn a_lane_change_is_followed_under_one_number() {
    let mut bench = Bench::new(3, vec![follower(960.0, OWN_LANE_M, 32.0)]);
    for _ in 0..50 {
        bench.scan(|_| true);
        bench.advance(false);
    }
    // 3.75 m within 4 s, at first as if nothing happened.
    let number = bench.list.tracks[0].id;
    bench.audit = TrackAudit::default();
    for step in 0..100 {
        let way = f64::from(step) / 100.0;
        let lateral_mps = 3.75 / 4.0 * 30.0 * way * way * (1.0 - way) * (1.0 - way);
        bench.others[0].state.heading_rad = (lateral_mps / 32.0).atan();
        bench.advance(false);
        let tracks = bench.scan(|_| true);
        assert_eq!((tracks.len(), tracks[0].id), (1, number), "{step}");
    }
    assert!(bench.list.tracks[0].lane[0] > 0.99, "{:?}", bench.list.tracks[0].lane);
    let nees = bench.audit.mean_nees().unwrap();
    assert!(nees < 8.0, "{nees}");
}

#[test]
fn speed_is_known_after_a_second() {
    let mut audit = TrackAudit::default();
    for sample in 0..40 {
        let mut bench = Bench::new(sample, vec![follower(890.0, OWN_LANE_M, 40.0)]);
        for step in 0..100 {
            bench.scan(|_| true);
            if step == 30 {
                bench.audit = TrackAudit::default();
            }
            bench.advance(true);
        }
        audit.matched_steps += bench.audit.matched_steps;
        audit.speed_error_sum_m2ps2 += bench.audit.speed_error_sum_m2ps2;
    }
    let rmse_mps = audit.speed_rmse_mps().unwrap();
    assert!(rmse_mps <= 0.7, "{rmse_mps} m/s");
}

#[test]
fn the_egos_braking_and_turning_is_no_motion_of_others() {
    let mut bench = Bench::new(1, vec![follower(950.0, OWN_LANE_M, 30.0)]);
    for _ in 0..50 {
        bench.scan(|_| true);
        bench.advance(false);
    }
    bench.audit = TrackAudit::default();
    for step in 0..25 {
        bench.ego.state.speed_mps -= 8.0 * PERIOD_S;
        bench.ego.state.heading_rad = 0.04 * (f64::from(step) * 0.3).sin();
        bench.advance(false);
        bench.scan(|_| true);
    }
    assert!(bench.audit.speed_rmse_mps().unwrap() < 0.5, "{:?}", bench.audit.speed_rmse_mps());
    let track = bench.list.tracks[0].clone();
    assert_eq!(track.status, TrackStatus::Confirmed);
    assert!(track.vy_mps().hypot(track.vx_mps() - 30.0) < 30.0 * 0.05, "{:?}", track.state);
}

#[test]
fn alternate_misses_confirm_and_keep_the_number() {
    let mut bench = Bench::new(2, vec![follower(870.0, OWN_LANE_M, 36.0)]);
    let mut confirmed_after = None;
    for step in 0..150 {
        let tracks = bench.scan(|_| step % 2 == 0);
        assert_eq!(tracks.len(), 1, "scan {step}");
        assert_eq!(tracks[0].id, TrackId(0));
        if tracks[0].status != TrackStatus::Tentative {
            confirmed_after.get_or_insert(step);
        }
        bench.advance(false);
    }
    assert!(confirmed_after.is_some_and(|scans| scans <= 8), "{confirmed_after:?}");
    assert!(bench.list.tracks[0].existence > 0.99);
    assert_eq!(bench.list.tracks[0].class.best_vehicle_class(), VehicleClass::Car);
}

#[test]
fn side_by_side_in_a_bend_the_numbers_stay() {
    let mut left = follower(940.0, LEFT_LANE_M, 34.0);
    left.actor = 2;
    let mut bench = Bench::new(4, vec![follower(960.0, OWN_LANE_M, 30.0), left]);
    bench.road = bench.road.with_curvature(0.001);
    for _ in 0..200 {
        bench.scan(|_| true);
        bench.advance(false);
    }
    assert_eq!(bench.audit.id_switches, 0);
    assert_eq!(bench.audit.false_tracks(), 0);
    let lanes: Vec<_> = bench.list.tracks.iter().map(|track| track.lane.map(f64::round)).collect();
    assert_eq!(lanes, [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]);
}

#[test]
fn a_track_coasts_behind_a_nearer_one_without_losing_belief() {
    let mut near = follower(980.0, OWN_LANE_M, 30.0);
    near.actor = 2;
    let mut bench = Bench::new(5, vec![follower(940.0, OWN_LANE_M, 30.0), near]);
    for _ in 0..30 {
        bench.scan(|_| true);
        bench.advance(false);
    }
    let before = bench.list.tracks[0].existence;
    for _ in 0..20 {
        let tracks = bench.scan(|actor| actor == 2);
        assert_eq!(tracks[0].status, TrackStatus::Coasting);
        assert_eq!(tracks[0].existence.to_bits(), before.to_bits());
        bench.advance(false);
    }
    let back = bench.scan(|_| true);
    assert_eq!((back[0].id, back[0].status), (TrackId(0), TrackStatus::Confirmed));
    // The nearer one in plain view would have lost belief, and then its track.
    for _ in 0..30 {
        bench.advance(false);
        bench.scan(|actor| actor == 1);
    }
    assert_eq!(bench.list.tracks.len(), 1);
}

#[test]
fn a_detection_that_is_not_finite_starts_nothing() {
    let mut bench = Bench::new(6, vec![follower(f64::MAX, OWN_LANE_M, 30.0)]);
    assert!(bench.scan(|_| true).iter().all(|track| track.state.iter().all(|x| x.is_finite())));
}

#[test]
fn the_same_detections_give_the_same_bits() {
    let run = || {
        let mut bench = Bench::new(8, vec![follower(940.0, OWN_LANE_M, 34.0)]);
        let mut bits = Vec::new();
        for _ in 0..50 {
            bits.extend(bench.scan(|_| true).iter().flat_map(|track| track.state.map(f64::to_bits).data.0[0]));
            bench.advance(true);
        }
        bits
    };
    assert_eq!(run(), run());
    assert!(!run().is_empty());
}
