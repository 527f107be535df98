//! The association on instances that are made from the true boxes of vehicles.

use crate::camera::{CameraConfig, Mask, Pipeline, fuse};
use crate::tracking::{RearView, TrackList, Tracker, TrackerConfig, TrackerScan};
use closecall_traffic::{
    CONTROL_STEP, Check, Choice, Environment, Num, Parameters, Road, Track, TrackStatus, VehicleClass,
    ego_frame::EgoFrame,
};

use super::*;
use crate::testing::{OWN_LANE_M, scene_vehicle, with_speed};

const EGO_S_M: f64 = 500.0;

fn camera() -> RearCamera {
    let config = CameraConfig { pipeline: Choice::Fixed(Pipeline::MaskRcnn), ..CameraConfig::default() };
    RearCamera::new(config.check(&Parameters::default()).unwrap())
}

fn ego() -> SceneVehicle {
    with_speed(scene_vehicle(0, VehicleClass::Car, EGO_S_M, OWN_LANE_M), 30.0)
}

/// Returns the box that a LiDAR without errors finds for a typical vehicle whose front is this far
/// from the ego's centre (m).
fn detection(class: VehicleClass, face_x_m: f64, face_y_m: f64) -> Detection {
    let size = class.typical_dimensions();
    Detection {
        time: Time::ZERO,
        face_x_m,
        face_y_m,
        range_sd_m: 0.1,
        lateral_sd_m: 0.1,
        heading_rad: 0.0,
        length_m: size.length_m,
        length: Extent::Assumed,
        width_m: size.width_m,
        width: Extent::Assumed,
        top_m: size.height_m,
        seen_by: SeenBy::Lidar,
        points: 50,
        is_centred: false,
        seen: crate::SeenPart::FACE,
        class: ClassScores::UNKNOWN,
    }
}

/// Returns an instance that fills the projection of a detection.
fn instance(detection: &Detection, class: VehicleClass, score: f64) -> Instance {
    let box_px = camera().detection_bounds(&ego(), detection).unwrap();
    Instance { box_px, class, score, mask: Mask::new(box_px, [28, 28], vec![1.0; 28 * 28]).unwrap() }
}

fn with_scene<T>(act: impl FnOnce(&Scene<'_>) -> T) -> T {
    let (road, environment) = (Road::straight(3), Environment::CLEAR_DAY);
    act(&Scene { time: Time::ZERO, road: &road, environment: &environment, ego: ego(), others: &[] })
}

fn associated(instances: &[Instance], detections: &[Detection]) -> ImageResult {
    with_scene(|scene| associate(&camera(), scene, instances, detections))
}

#[test]
fn a_vehicle_that_both_see_gets_the_scores_of_the_image_and_a_width_from_the_mask() {
    for (class, y_m) in [(VehicleClass::Car, 0.0), (VehicleClass::Truck, 3.75), (VehicleClass::Motorcycle, -3.75)] {
        let seen = detection(class, -30.0, y_m);
        let result = associated(&[instance(&seen, class, 0.9)], std::slice::from_ref(&seen));
        let evidence = result.evidence[0].unwrap();
        assert!((evidence.scores.0[class as usize] - 0.9).abs() < 1e-12);
        assert!((evidence.scores.0[ClassScores::BACKGROUND] - 0.1).abs() < 1e-12);
        let width_m = evidence.width_m.unwrap();
        assert!(
            (width_m - seen.width_m).abs() < 0.1 * seen.width_m,
            "{class:?}: {width_m} instead of {}",
            seen.width_m
        );
        assert!(result.alone.is_empty());
    }
}

#[test]
fn a_turned_camera_gives_the_same_widths_and_places() {
    for yaw_deg in [-20.0, 15.0, 20.0] {
        let config = CameraConfig {
            pipeline: Choice::Fixed(Pipeline::MaskRcnn),
            yaw_deg: Num::Fixed(yaw_deg),
            ..CameraConfig::default()
        };
        let camera = RearCamera::new(config.check(&Parameters::default()).unwrap());
        for (distance_m, y_m) in [(15.0, 0.0), (30.0, 3.75), (50.0, -3.75)] {
            let truth = detection(VehicleClass::Car, -distance_m, y_m);
            let box_px = camera.detection_bounds(&ego(), &truth).unwrap();
            let mask = Mask::new(box_px, [28, 28], vec![1.0; 28 * 28]).unwrap();
            let instance = Instance { box_px, class: VehicleClass::Car, score: 0.8, mask };
            let instances = std::slice::from_ref(&instance);
            let association = with_scene(|scene| associate(&camera, scene, instances, std::slice::from_ref(&truth)));
            let width_m = association.evidence[0].unwrap().width_m.unwrap();
            assert!((width_m - truth.width_m).abs() < 0.1 * truth.width_m, "{yaw_deg}°, {distance_m} m: {width_m}");
            let alone = with_scene(|scene| associate(&camera, scene, instances, &[])).alone;
            let [seen] = &alone[..] else { panic!("{alone:?}") };
            let off_m = [seen.face_x_m - truth.face_x_m, seen.face_y_m - truth.face_y_m];
            assert!(off_m[0].abs() < seen.range_sd_m && off_m[1].abs() < 1.0, "{yaw_deg}°, {distance_m} m: {off_m:?}");
        }
    }
}

#[test]
fn two_instances_of_one_vehicle_share_its_scores() {
    let seen = detection(VehicleClass::Car, -30.0, 0.0);
    let instances = [instance(&seen, VehicleClass::Car, 0.6), instance(&seen, VehicleClass::Truck, 0.3)];
    let scores = associated(&instances, &[seen]).evidence[0].unwrap().scores.0;
    for (score, wanted) in scores.iter().zip([0.6, 0.3, 0.0, 0.1]) {
        assert!((score - wanted).abs() < 1e-12, "{scores:?}");
    }
}

#[test]
fn the_image_is_evidence_against_a_lidar_detection_that_it_should_show() {
    let near = detection(VehicleClass::Car, -30.0, 0.0);
    let evidence = associated(&[], std::slice::from_ref(&near)).evidence[0].unwrap();
    assert!(evidence.scores.vehicle() < 0.25 && evidence.width_m.is_none(), "{evidence:?}");
    // 1.8 m have 20 px at 100 m.
    assert_eq!(associated(&[], &[detection(VehicleClass::Car, -115.0, 0.0)]).evidence, [None], "too small");
    assert_eq!(associated(&[], &[detection(VehicleClass::Car, -30.0, 12.0)]).evidence, [None], "beside the road");
    let hidden = detection(VehicleClass::Car, -60.0, 0.0);
    let evidence = associated(&[instance(&near, VehicleClass::Car, 0.9)], &[near, hidden]).evidence;
    assert!(evidence[0].unwrap().scores.vehicle() > 0.8);
}

#[test]
fn an_unmeasured_network_gives_no_evidence_about_clusters_that_it_does_not_show() {
    let near = detection(VehicleClass::Car, -30.0, 0.0);
    let evidence = |network: &str| {
        let text = format!("pipeline = 'mask-rcnn'\nmask-rcnn = {{ {network} }}\n");
        let config: CameraConfig = toml::from_str(&text).unwrap();
        let camera = RearCamera::new(config.check(&Parameters::default()).unwrap());
        with_scene(|scene| associate(&camera, scene, &[], std::slice::from_ref(&near))).evidence[0]
    };
    assert_eq!(evidence("model = 'other.onnx'"), None);
    let [shipped, other] = ["", "model = 'other.onnx', missed = 0.5"].map(|network| evidence(network).unwrap().scores);
    assert!(shipped.vehicle() < other.vehicle() && other.vehicle() < 0.75, "{shipped:?}, {other:?}");
    // A car at 30 m is some 80 px wide.
    assert!(evidence("min-shown-px = 60").is_some() && evidence("min-shown-px = 200").is_none());
}

#[test]
fn a_vehicle_hidden_by_nearer_vehicles_is_not_expected_in_the_image() {
    let (near, hidden) = (detection(VehicleClass::Truck, -20.0, 0.0), detection(VehicleClass::Car, -60.0, 0.0));
    let bounds: Vec<_> = [&near, &hidden].map(|seen| camera().detection_bounds(&ego(), seen)).into();
    let detections = [near, hidden];
    assert!(is_hidden(1, &bounds[1].unwrap(), &detections, &bounds));
    assert!(!is_hidden(0, &bounds[0].unwrap(), &detections, &bounds));
}

#[test]
fn a_vehicle_that_only_the_camera_sees_is_where_its_mask_meets_the_road() {
    for (distance_m, y_m) in [(15.0, 0.0), (30.0, 3.75), (50.0, -3.75)] {
        let truth = detection(VehicleClass::Car, -distance_m, y_m);
        let alone = associated(&[instance(&truth, VehicleClass::Car, 0.8)], &[]).alone;
        let [seen] = &alone[..] else { panic!("{alone:?}") };
        let off_m = [seen.face_x_m - truth.face_x_m, seen.face_y_m - truth.face_y_m];
        assert!(off_m[0].abs() < seen.range_sd_m, "{distance_m} m: {off_m:?}, {}", seen.range_sd_m);
        assert!(off_m[1].abs() < 1.0, "{distance_m} m: {off_m:?}");
        assert!(seen.range_sd_m > 0.01 * distance_m && seen.range_sd_m < 0.4 * distance_m, "{}", seen.range_sd_m);
        assert_eq!((seen.class.0[0], seen.length), (0.8, Extent::Assumed));
    }
    let far = detection(VehicleClass::Car, -90.0, 0.0);
    assert!(associated(&[instance(&far, VehicleClass::Car, 0.8)], &[]).alone.is_empty(), "too far for a flat road");
    let unsure = instance(&detection(VehicleClass::Car, -30.0, 0.0), VehicleClass::Car, 0.4);
    assert!(associated(&[unsure], &[]).alone.is_empty());
}

#[test]
fn camera_only_detections_move_with_the_ego() {
    let seen = detection(VehicleClass::Car, -30.0, 3.75);
    let exposed = Exposed { time: Time::ZERO, ego: ego() };
    with_scene(|scene| {
        let mut later = scene.ego;
        later.state.s_m += 6.0;
        let moved = moved(&seen, &exposed, &Scene { time: Time::from_ms(200), ego: later, ..*scene });
        assert!((moved.face_x_m + 36.0).abs() < 1e-9 && (moved.face_y_m - 3.75).abs() < 1e-9);
        assert_eq!(moved.time, Time::ZERO);
    });
}

/// Returns the confirmed track of a vehicle after `steps` scans. Each scan has the detections that
/// `seen` returns.
fn tracked(steps: usize, seen: impl Fn(usize) -> Vec<Detection>) -> Option<Track> {
    let (mut tracker, mut list) =
        (Tracker::new(TrackerConfig::default().check(&Parameters::default()).unwrap()), TrackList::default());
    let road = Road::straight(3);
    let mut state = ego().state;
    for step in 0..steps {
        let time = CONTROL_STEP * step as i64;
        state.s_m = EGO_S_M + 30.0 * time.s();
        let mut detections = seen(step);
        detections.iter_mut().for_each(|seen| seen.time = time);
        let view =
            RearView { half_angle_tan: 1.0, range_m: 150.0, sensor_x_m: -2.0, sensor_y_m: 0.0, axis_azimuth_rad: 0.0 };
        tracker.update(
            &TrackerScan { sensor: 0, time, road: &road, ego: state, view, rear_x_m: -2.0, detections: &detections },
            &mut list,
        );
        list.tracks.clear();
        tracker.report(time, &EgoFrame::new(&road, &state), &mut list);
    }
    list.tracks.into_iter().find(|track| track.status != TrackStatus::Tentative)
}

/// Returns whether a vehicle has a confirmed track after 4 s, if the LiDAR sees it in the first
/// `lidar_scans` scans, and the camera alone in every `camera_every`-th scan of the rest.
fn is_confirmed(lidar_scans: usize, camera_every: Option<usize>) -> bool {
    let lidar = detection(VehicleClass::Car, -30.0, 0.0);
    let camera = associated(&[instance(&lidar, VehicleClass::Car, 0.9)], &[]).alone;
    let seen = |step| match camera_every {
        _ if step < lidar_scans => vec![lidar.clone()],
        Some(every) if step % every == 0 => camera.clone(),
        _ => Vec::new(),
    };
    tracked(100, seen).is_some()
}

#[test]
fn the_camera_alone_keeps_a_confirmed_track_and_confirms_none_at_any_rate() {
    assert!(!is_confirmed(25, None), "without the camera, the track ends");
    // From 5 to 25 images per second.
    for every in 1..=5 {
        assert!(is_confirmed(25, Some(every)), "{every}: the camera keeps what the LiDAR has confirmed");
        assert!(
            !is_confirmed(0, Some(every)),
            "{every}: the distance from the image alone is too uncertain to react to"
        );
        assert!(!is_confirmed(2, Some(every)), "{every}: two scans of the LiDAR are too few");
    }
}

#[test]
fn an_image_that_keeps_denying_a_cluster_makes_it_background_until_it_shows_a_vehicle() {
    let mut seen = detection(VehicleClass::Car, -30.0, 0.0);
    // The shape of a cluster says little.
    seen.class = ClassScores([0.5, 0.1, 0.1, 0.3]);
    let with = |instances: &[Instance]| {
        let evidence = associated(instances, std::slice::from_ref(&seen)).evidence[0].unwrap();
        vec![Detection { class: fuse(&seen.class, &evidence.scores), ..seen.clone() }]
    };
    let (denied, shown) = (with(&[]), with(&[instance(&seen, VehicleClass::Car, 0.9)]));
    let [by_lidar, by_denial] =
        [vec![seen.clone()], denied.clone()].map(|scan| tracked(100, |_| scan.clone()).unwrap());
    assert!(by_lidar.class.is_vehicle(), "without images, the shape decides: {:?}", by_lidar.class);
    let background = |track: &Track| track.class.0[ClassScores::BACKGROUND];
    assert!(!by_denial.class.is_vehicle() && background(&by_denial) > 0.9, "{:?}", by_denial.class);
    // The LiDAR keeps hitting it: something is there, and it stays confirmed.
    assert!(by_denial.existence > 0.9 && by_denial.existence < by_lidar.existence, "{}", by_denial.existence);
    let back = tracked(125, |step| if step < 100 { denied.clone() } else { shown.clone() }).unwrap();
    assert!(back.class.0[VehicleClass::Car as usize] > 0.9, "a second of images that show a car: {:?}", back.class);
}
