//! Tests of the tracker on simulated detections against the true states.

use closecall_traffic::statistics::consistency::{Consistency, Credibility};
use closecall_traffic::{
    ActorId, CONTROL_STEP, Check, ClassScores, Environment, Parameters, Road, Stream, Track, TrackId, TrackStatus,
    VehicleClass, stream,
};
use rand::RngExt;

use crate::lidar::FACE_SD_M;
use crate::surroundings::transform_scene;
use crate::testing::{OWN_LANE_M, scene_vehicle, with_speed};
use crate::tracking::motion::{ACROSS_MODES, ALONG_MODES, Mode, Situation};
use crate::tracking::road_filter::{SLOW_DISTANCE_M, SLOW_TIME_S};
use crate::tracking::{RearView, TrackList, Tracker, TrackerScan};
use crate::{Detection, Extent, Scene, SceneVehicle, SeenBy, SeenPart, TrackAudit, TrackerConfig};
use closecall_traffic::{StandardNormal, ego_frame::EgoFrame, maths};

const LEFT_LANE_M: f64 = -1.875;
pub(super) const PERIOD_S: f64 = CONTROL_STEP.s();
const RANGE_SD_M: f64 = 0.1;
const LATERAL_SD_M: f64 = 0.15;
/// Slow share of the lateral error's variance.
const SLOW_LATERAL_SHARE: f64 = 0.7;

fn normal(rng: &mut Stream) -> f64 {
    rng.sample(StandardNormal)
}

/// The motion of a vehicle with a free lane ahead along one axis, drawn from the tracker's modes.
struct Motion {
    modes: &'static [Mode],
    mode: usize,
    acceleration_mps2: f64,
    /// Speed minus the speed at the start (m/s).
    speed_mps: f64,
}

impl Motion {
    fn new(modes: &'static [Mode], rng: &mut Stream) -> Self {
        let priors = modes.iter().map(|mode| mode.prior_probability);
        let mode = draw_index(priors, rng).unwrap();
        Self { modes, mode, acceleration_mps2: modes[mode].acceleration_sd_mps2 * normal(rng), speed_mps: 0.0 }
    }

    fn advance(&mut self, rng: &mut Stream) {
        let rates_per_s = self.modes[self.mode].rates_per_s(Situation::FREE);
        self.mode = draw_index(rates_per_s.iter().map(|rate| rate * PERIOD_S), rng).unwrap_or(self.mode);
        let mode = &self.modes[self.mode];
        let persistence = if mode.persistence_s > 0.0 { maths::exp(-PERIOD_S / mode.persistence_s) } else { 0.0 };
        let increment_mps2 = mode.acceleration_sd_mps2 * (1.0 - persistence * persistence).sqrt() * normal(rng);
        self.acceleration_mps2 = persistence * self.acceleration_mps2 + increment_mps2;
        let white_mps = (mode.white_density_m2ps3 * PERIOD_S).sqrt() * normal(rng);
        let decayed_mps = maths::exp(-PERIOD_S / mode.speed_decay_s) * self.speed_mps;
        self.speed_mps = decayed_mps + self.acceleration_mps2 * PERIOD_S + white_mps;
    }
}

/// Draws an index with these probabilities; returns `None` with the remaining probability.
fn draw_index(probabilities: impl Iterator<Item = f64>, rng: &mut Stream) -> Option<usize> {
    let mut remaining = rng.random::<f64>();
    for (index, probability) in probabilities.enumerate() {
        remaining -= probability;
        if remaining < 0.0 {
            return Some(index);
        }
    }
    None
}

/// A simulated scene of the ego and other vehicles, with the tracker under test.
struct Bench {
    road: Road,
    ego: SceneVehicle,
    others: Vec<SceneVehicle>,
    scans: i64,
    rng: Stream,
    /// Slow error of the detected face: ahead along the vehicle, and across the line of sight (m).
    slow_m: [f64; 2],
    /// Motion of the manoeuvring vehicles along and across the road.
    motion: [Motion; 2],
    tracker: Tracker,
    list: TrackList,
    audit: TrackAudit,
}

impl Bench {
    fn new(sample: u64, others: Vec<SceneVehicle>) -> Self {
        let model = TrackerConfig::default().check(&Parameters::default()).unwrap();
        let mut rng = stream(3, sample, &ActorId::new("ego").unwrap(), "tracker-test");
        Self {
            slow_m: [FACE_SD_M, SLOW_LATERAL_SHARE.sqrt() * LATERAL_SD_M].map(|sd_m| sd_m * normal(&mut rng)),
            motion: [ALONG_MODES, ACROSS_MODES].map(|modes| Motion::new(modes, &mut rng)),
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

    /// Moves all vehicles by one scan period. With `manoeuvre`, the others accelerate, coast, weave
    /// and brake as in traffic.
    fn advance(&mut self, manoeuvre: bool) {
        self.scans += 1;
        for vehicle in self.others.iter_mut().chain([&mut self.ego]) {
            let state = &mut vehicle.state;
            let path_scale = self.road.path_scale(state.s_m, state.d_m);
            state.s_m += PERIOD_S * state.speed_mps * maths::cos(state.heading_rad) / path_scale;
            state.d_m += PERIOD_S * state.speed_mps * maths::sin(state.heading_rad);
        }
        if manoeuvre {
            let before_mps = self.motion[0].speed_mps;
            self.motion.iter_mut().for_each(|motion| motion.advance(&mut self.rng));
            let [along, across] = &self.motion;
            for vehicle in &mut self.others {
                vehicle.state.speed_mps += along.speed_mps - before_mps;
                vehicle.state.heading_rad = maths::asin(across.speed_mps / vehicle.state.speed_mps);
            }
        }
    }

    /// Performs one scan that detects the vehicles for which `sees` is true, and returns the tracks
    /// after it.
    fn scan(&mut self, sees: impl Fn(usize) -> bool) -> &[Track] {
        let (road, ego, others) = (self.road.clone(), self.ego, self.others.clone());
        let time = CONTROL_STEP * self.scans;
        let scene = Scene { time, road: &road, environment: &Environment::CLEAR_DAY, ego, others: &others };
        let mut truths = Vec::new();
        transform_scene(&scene, &mut truths).unwrap();
        let mut detections = Vec::new();
        let closing_mps = others.first().map_or(0.0, |other| (other.state.speed_mps - ego.state.speed_mps).abs());
        let slow_share = maths::exp(-PERIOD_S / SLOW_TIME_S - closing_mps * PERIOD_S / SLOW_DISTANCE_M);
        for (slow_m, sd_m) in self.slow_m.iter_mut().zip([FACE_SD_M, SLOW_LATERAL_SHARE.sqrt() * LATERAL_SD_M]) {
            *slow_m = slow_share * *slow_m + (1.0 - slow_share * slow_share).sqrt() * sd_m * normal(&mut self.rng);
        }
        let white_lateral_m = (1.0 - SLOW_LATERAL_SHARE).sqrt() * LATERAL_SD_M;
        let white_range_m = (RANGE_SD_M * RANGE_SD_M - FACE_SD_M * FACE_SD_M).sqrt();
        for truth in truths.iter().filter(|truth| sees(truth.actor)) {
            let ahead_m = 0.5 * truth.length_m + self.slow_m[0];
            let face = (truth.x_m + ahead_m * truth.cos, truth.y_m + ahead_m * truth.sin);
            let sight = maths::atan2(face.1, face.0 + 2.3);
            let (sin, cos) = maths::sin_cos(sight);
            let (along, across) =
                (white_range_m * normal(&mut self.rng), self.slow_m[1] + white_lateral_m * normal(&mut self.rng));
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
                seen_by: SeenBy::Lidar,
                points: 20,
                is_centred: false,
                seen: SeenPart::FACE,
                class: ClassScores([0.6, 0.1, 0.1, 0.2]),
            });
        }
        let view = RearView { half_angle_tan: 2.3, range_m: 200.0, sensor_x_m: -2.3, ..RearView::default() };
        let scan =
            TrackerScan { sensor: 0, time, road: &road, ego: ego.state, view, rear_x_m: -2.3, detections: &detections };
        self.list.tracks.clear();
        self.tracker.update(&scan, &mut self.list);
        self.tracker.report(time, &EgoFrame::new(&road, &ego.state), &mut self.list);
        self.audit.observe(&self.list.tracks, &scene).unwrap();
        &self.list.tracks
    }
}

pub(super) fn follower(s_m: f64, d_m: f64, speed_mps: f64) -> SceneVehicle {
    with_speed(scene_vehicle(1, VehicleClass::Car, s_m, d_m), speed_mps)
}

#[test]
fn the_mean_nees_is_within_its_95_percent_bounds() {
    let nees_after_3_s = |sample| {
        let mut bench = Bench::new(sample, vec![follower(900.0, OWN_LANE_M, 32.0)]);
        for _ in 0..75 {
            bench.scan(|_| true);
            bench.advance(true);
        }
        bench.audit = TrackAudit::default();
        bench.scan(|_| true);
        bench.audit.nees
    };
    let runs: Vec<Vec<f64>> = (0..3_000).map(nees_after_3_s).collect();
    let consistency = Consistency::of(&runs).unwrap();
    assert_eq!(consistency.credibility(), Credibility::Consistent, "{consistency:?}");
}

#[test]
fn a_track_keeps_its_id_through_a_lane_change() {
    let runs = 20_u32;
    let mut sum = 0.0;
    for sample in 0..runs {
        let mut bench = Bench::new(sample.into(), vec![follower(960.0, OWN_LANE_M, 32.0)]);
        for _ in 0..50 {
            bench.scan(|_| true);
            bench.advance(false);
        }
        // A lane change of 3.75 m in 4 s, with a smooth start.
        let id = bench.list.tracks[0].id;
        bench.audit = TrackAudit::default();
        for step in 0..100 {
            let progress = f64::from(step) / 100.0;
            let lateral_mps = 3.75 / 4.0 * 30.0 * progress * progress * (1.0 - progress) * (1.0 - progress);
            bench.others[0].state.heading_rad = maths::atan(lateral_mps / 32.0);
            bench.advance(false);
            let tracks = bench.scan(|_| true);
            assert_eq!((tracks.len(), tracks[0].id), (1, id), "scan {step} of run {sample}");
        }
        assert!(bench.list.tracks[0].lane[0] > 0.99, "{:?}", bench.list.tracks[0].lane);
        sum += bench.audit.mean_nees().unwrap();
    }
    let nees = sum / f64::from(runs);
    assert!(nees < 8.0, "{nees}");
}

#[test]
fn the_speed_error_is_small_after_about_a_second() {
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
        audit.extend(&bench.audit);
    }
    let rmse_mps = audit.speed_rmse_mps().unwrap();
    assert!(rmse_mps <= 0.7, "{rmse_mps} m/s");
}

#[test]
fn braking_and_turning_of_the_ego_does_not_disturb_other_tracks() {
    let mut bench = Bench::new(1, vec![follower(950.0, OWN_LANE_M, 30.0)]);
    for _ in 0..50 {
        bench.scan(|_| true);
        bench.advance(false);
    }
    bench.audit = TrackAudit::default();
    for step in 0..25 {
        bench.ego.state.speed_mps -= 8.0 * PERIOD_S;
        bench.ego.state.heading_rad = 0.04 * maths::sin(f64::from(step) * 0.3);
        bench.advance(false);
        bench.scan(|_| true);
    }
    assert!(bench.audit.speed_rmse_mps().unwrap() < 0.5, "{:?}", bench.audit.speed_rmse_mps());
    let track = bench.list.tracks[0].clone();
    assert_eq!(track.status, TrackStatus::Confirmed);
    assert!(maths::hypot(track.vy_mps(), track.vx_mps() - 30.0) < 30.0 * 0.05, "{:?}", track.state);
}

#[test]
fn a_vehicle_missed_in_every_other_scan_is_confirmed_and_keeps_its_id() {
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
fn two_vehicles_in_neighbouring_lanes_of_a_bend_keep_their_ids() {
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
fn a_track_hidden_by_a_nearer_one_coasts_and_keeps_its_existence_probability() {
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
    // The nearer vehicle is in view: without detections it loses its existence probability, and
    // then its track.
    for _ in 0..30 {
        bench.advance(false);
        bench.scan(|actor| actor == 1);
    }
    assert_eq!(bench.list.tracks.len(), 1);
}

#[test]
fn a_detection_that_is_not_finite_starts_no_track() {
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
