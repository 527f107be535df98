//! Tests the whole chain from the point cloud to the track at a constant gap. The beams then hit
//! the same places in each scan of one side of the mirror, and the errors of the boxes never
//! average out.

use rand::RngExt;

use crate::tracking::{RearView, TrackList, Tracker, TrackerScan};
use closecall_traffic::ego_frame::EgoFrame;
use closecall_traffic::statistics::consistency::Consistency;
use closecall_traffic::{
    ActorId, CONTROL_STEP, Check, Environment, Parameters, Road, TrackStatus, VehicleClass, stream,
};

use super::tracking::{PERIOD_S, follower};
use crate::lidar::{Lidar, LidarConfig, RearLidar};
use crate::testing::{OWN_LANE_M, scene_vehicle, with_speed};
use crate::{Scene, TrackAudit, TrackerConfig};

/// Gaps from the ego's rear to the front of the other vehicle (m).
const GAPS_M: [f64; 8] = [30.0, 40.0, 50.0, 60.0, 70.0, 80.0, 90.0, 100.0];
/// Reflectivities of the paint.
const PAINTS: [f64; 5] = [0.1, 0.2, 0.35, 0.5, 0.8];

/// The track of a car straight behind, from 10 s on, over 100 scans of either side of the mirror.
struct FollowedTrack {
    /// Number of scans of either side of the mirror after which the track was confirmed. It coasts
    /// after a scan that misses it.
    scans: [u32; 2],
    /// Mean lateral error after these scans (m).
    errors_m: [f64; 2],
    audit: TrackAudit,
}

/// Follows a car with this paint at a constant gap for 18 s.
fn at_gap(gap_m: f64, paint_reflectivity: f64, sample: u64) -> FollowedTrack {
    let road = Road::straight(3);
    let mut ego = with_speed(scene_vehicle(0, VehicleClass::Car, 1_000.0, OWN_LANE_M), 30.0);
    let behind_m = gap_m + ego.vehicle.dimensions.length_m;
    let mut others = vec![follower(ego.state.s_m - behind_m, OWN_LANE_M, 30.0)];
    others[0].vehicle.appearance.paint_reflectivity = paint_reflectivity;
    let mut lidar = RearLidar::new(Lidar::default());
    let mut rng = stream(5, sample, &ActorId::new("ego").unwrap(), "fixed-gap");
    let mut tracker = Tracker::new(TrackerConfig::default().check(&Parameters::default()).unwrap());
    let (mut list, mut audit) = (TrackList::default(), TrackAudit::default());
    let (mut error_sums_m, mut scans) = ([0.0; 2], [0_u32; 2]);
    for scan in 0..450 {
        let time = CONTROL_STEP * scan;
        for vehicle in others.iter_mut().chain([&mut ego]) {
            vehicle.state.s_m += PERIOD_S * vehicle.state.speed_mps;
        }
        let scene = Scene { time, road: &road, environment: &Environment::CLEAR_DAY, ego, others: &others };
        lidar.scan(&scene, &mut rng);
        let view = RearView { half_angle_tan: 2.3, range_m: 200.0, sensor_x_m: -2.3, ..RearView::default() };
        let detections = lidar.detect().unwrap();
        list.tracks.clear();
        tracker.update(
            &TrackerScan { sensor: 0, time, road: &road, ego: ego.state, view, rear_x_m: -2.3, detections },
            &mut list,
        );
        tracker.report(time, &EgoFrame::new(&road, &ego.state), &mut list);
        if scan < 250 {
            continue;
        }
        audit.observe(&list.tracks, &scene).unwrap();
        if let Some(track) = list.tracks.iter().find(|track| track.status == TrackStatus::Confirmed) {
            let side = usize::from(scan % 2 == 1);
            error_sums_m[side] += track.y_m();
            scans[side] += 1;
        }
    }
    let errors_m = [0, 1].map(|side| error_sums_m[side] / f64::from(scans[side]));
    FollowedTrack { scans, errors_m, audit }
}

/// Mean lateral error that a track may have (m).
const LIMIT_M: f64 = 0.05;

#[test]
fn a_track_at_a_constant_gap_is_where_the_vehicle_is() {
    let mut runs = Vec::new();
    for (row, &gap_m) in (0..).zip(&GAPS_M) {
        for (column, &paint) in (0..).zip(&PAINTS) {
            let FollowedTrack { scans, errors_m, audit } = at_gap(gap_m, paint, 10 * row + column);
            // Up to 86 m, the plate of every car returns enough light
            // (docs/evidence/perception.md); beyond, the body of a bright car does.
            let is_followed = gap_m <= 80.0 || paint >= 0.5;
            let most = scans[0].max(scans[1]);
            assert!(!is_followed || most >= 99, "{scans:?} scans at {gap_m} m with {paint}");
            // A track that comes and goes after scans of the same side is not at a constant
            // distance from the points that the beams hit.
            if most < 99 {
                continue;
            }
            for (scans, error_m) in scans.into_iter().zip(errors_m) {
                assert!(scans == 0 || error_m.abs() <= LIMIT_M, "{error_m} at {gap_m} m with {paint}");
            }
            let scans = scans[0] + scans[1];
            let across: f64 = audit.nees_by_axis.iter().map(|[_, across]| across).sum();
            assert!(across < 4.0 * f64::from(scans), "{across} of {scans} at {gap_m} m with {paint}");
            runs.push(audit.nees);
        }
    }
    let consistency = Consistency::of(&runs).unwrap();
    assert!(consistency.mean < 4.0, "{consistency:?}");
}

/// Largest mean lateral error at every half metre (m): after scans that always confirm the track,
/// and after scans that confirm it sometimes. Weak returns hide half beams, and columns are up to
/// 0.21 m apart and always the same: the beams then cannot tell more.
const EVERYWHERE_M: [f64; 2] = [0.051, 0.07];
/// Numbers of scans, of 100, from which on each of these holds.
const SCANS: [u32; 2] = [90, 20];

#[test]
fn at_every_half_metre_a_track_at_a_constant_gap_is_where_the_vehicle_is() {
    // At some gaps, one side of the mirror sees the plate of a dark car, and the other always the
    // same lamp.
    let check_at = |half_metres: u32, paint: f64| {
        let gap_m = 0.5 * f64::from(half_metres);
        let FollowedTrack { scans, errors_m, audit } = at_gap(gap_m, paint, half_metres.into());
        for (scans, error_m) in scans.into_iter().zip(errors_m) {
            for (limit_m, _) in EVERYWHERE_M.into_iter().zip(SCANS).filter(|(_, least)| scans >= *least) {
                assert!(error_m.abs() <= limit_m, "{error_m} at {gap_m} m with {paint}, after {scans} scans");
            }
        }
        let across: f64 = audit.nees_by_axis.iter().map(|[_, across]| across).sum();
        assert!(across <= 4.0 * audit.nees_by_axis.len() as f64, "{across} at {gap_m} m with {paint}");
        let is_followed = gap_m <= 80.0 || paint >= 0.35;
        assert!(!is_followed || scans[0].max(scans[1]) >= SCANS[1], "{scans:?} scans at {gap_m} m with {paint}");
    };
    for half_metres in 60..=200 {
        let paints = if half_metres % 2 == 0 { [0.1, 0.16, 0.35, 0.8] } else { [0.14, 0.2, 0.25, 0.5] };
        paints.into_iter().for_each(|paint| check_at(half_metres, paint));
    }
}

/// Errors of the middles of boxes around cars at random places behind a LiDAR.
struct Boxes {
    count: f64,
    /// Root mean square (m; columns of `step_deg`).
    rms: [f64; 2],
    /// Mean of the squared errors over their variances.
    nees: f64,
}

/// Measures cars with this paint, up to `most_m` behind and up to 0.3 m aside of a LiDAR, 600
/// scans.
fn boxes(lidar: &str, step_deg: f64, paint: f64, most_m: f64) -> Boxes {
    let config: LidarConfig = toml::from_str(lidar).unwrap();
    let lidar = config.check(&Parameters::default()).unwrap();
    let road = Road::straight(3);
    let ego = with_speed(scene_vehicle(0, VehicleClass::Car, 1_000.0, OWN_LANE_M), 30.0);
    let mut rng = stream(5, 0, &ActorId::new("ego").unwrap(), "edges");
    let (mut squares, mut nees, mut count) = ([0.0; 2], 0.0, 0.0);
    let mut rear = RearLidar::new(lidar);
    for scan in 0..600 {
        let (gap_m, off_m) = (20.0 + (most_m - 20.0) * rng.random::<f64>(), 0.6 * rng.random::<f64>() - 0.3);
        let behind_m = gap_m + ego.vehicle.dimensions.length_m;
        let mut others = [follower(ego.state.s_m - behind_m, OWN_LANE_M + off_m, 30.0)];
        others[0].vehicle.appearance.paint_reflectivity = paint;
        let environment = &Environment::CLEAR_DAY;
        rear.scan(&Scene { time: CONTROL_STEP * scan, road: &road, environment, ego, others: &others }, &mut rng);
        let [detection] = rear.detect().unwrap() else { continue };
        let error_m = detection.face_y_m - off_m;
        squares[0] += error_m * error_m;
        squares[1] += (error_m / (gap_m * step_deg.to_radians())).powi(2);
        nees += (error_m / detection.lateral_sd_m).powi(2);
        count += 1.0;
    }
    Boxes { count, rms: squares.map(|sum: f64| (sum / count).sqrt()), nees: nees / count }
}

#[test]
fn the_powers_of_the_beams_tell_where_within_a_column_an_edge_lies() {
    // The paint and the greatest gap with which half a beam exceeds the detection threshold.
    for (paint, most_m) in [(0.2, 45.0), (0.35, 60.0), (0.8, 85.0)] {
        let statistics = boxes("", 0.125, paint, most_m);
        assert!(statistics.count > 590.0, "{} boxes with {paint}", statistics.count);
        // Edges anywhere within a column would give 0.2.
        assert!(statistics.rms[1] < 0.15, "{} with {paint}", statistics.rms[1]);
        assert!((0.4..1.6).contains(&statistics.nees), "{} with {paint}", statistics.nees);
    }
}

#[test]
fn a_box_is_as_sure_as_the_pattern_of_its_lidar_allows() {
    // Gaps between footprints, footprints as wide as a step, overlapping ones, and a face across
    // the end of the fine field.
    let of_width = |deg: &str| {
        let width = format!("beam-width-deg = {deg}");
        format!("[pattern]\n{}", include_str!("../../lidars/scala-2.toml").replace("beam-width-deg = 0.125", &width))
    };
    let (narrow, wide, very_wide) = (of_width("0.04"), of_width("0.2"), of_width("0.375"));
    for (lidar, step_deg, most_m) in [
        ("model = \"os1-64\"", 0.3515625, 35.0),
        ("model = \"pandar-xt-16\"", 0.18, 30.0),
        (&narrow, 0.125, 60.0),
        (&wide, 0.125, 60.0),
        (&very_wide, 0.125, 60.0),
        ("azimuth-deg = 15", 0.25, 60.0),
        ("azimuth-deg = -15", 0.25, 60.0),
        ("azimuth-deg = 25", 0.25, 60.0),
        ("window-transmission = 0.6", 0.125, 60.0),
    ] {
        for paint in [0.2, 0.5] {
            let statistics = boxes(lidar, step_deg, paint, most_m);
            let text = format!("{lidar} with {paint}: {} {:?} {}", statistics.count, statistics.rms, statistics.nees);
            assert!(statistics.count > 590.0 && (0.25..1.6).contains(&statistics.nees), "{text}");
        }
    }
}

/// Returns position and speed of the tracks after each of 100 scans. The first is the scan of step
/// `first`. A car approaches at 5 m/s.
fn states_from(first: i64) -> Vec<Vec<[f64; 4]>> {
    let road = Road::straight(3);
    let ego = with_speed(scene_vehicle(0, VehicleClass::Car, 1_000.0, OWN_LANE_M), 0.0);
    let mut others = vec![follower(940.0, OWN_LANE_M, 5.0)];
    let mut lidar = RearLidar::new(Lidar::default());
    let mut rng = stream(5, 0, &ActorId::new("ego").unwrap(), "before-zero");
    let mut tracker = Tracker::new(TrackerConfig::default().check(&Parameters::default()).unwrap());
    let mut list = TrackList::default();
    let mut states = Vec::new();
    for scan in 0..100 {
        let time = CONTROL_STEP * (first + scan);
        others[0].state.s_m += PERIOD_S * others[0].state.speed_mps;
        let scene = Scene { time, road: &road, environment: &Environment::CLEAR_DAY, ego, others: &others };
        lidar.scan(&scene, &mut rng);
        let view = RearView { half_angle_tan: 2.3, range_m: 200.0, sensor_x_m: -2.3, ..RearView::default() };
        let detections = lidar.detect().unwrap();
        list.tracks.clear();
        tracker.update(
            &TrackerScan { sensor: 0, time, road: &road, ego: ego.state, view, rear_x_m: -2.3, detections },
            &mut list,
        );
        tracker.report(time, &EgoFrame::new(&road, &ego.state), &mut list);
        states.push(list.tracks.iter().map(|track| track.state.into()).collect());
    }
    states
}

#[test]
fn scans_before_time_zero_give_the_same_tracks_as_later_scans() {
    let later = states_from(0);
    assert!(!later[99].is_empty());
    assert!(states_from(-50) == later);
}
