//! False alarms, and things that stand along the road.

use closecall_traffic::{Check, Parameters, RoadConfig};

use super::*;

/// Number of beams in a scan of the SCALA.
const BEAMS: f64 = 10_448.0;

fn road(text: &str) -> Road {
    let config: RoadConfig = toml::from_str(&format!("lanes = 3\n{text}")).unwrap();
    config.check(&Parameters::default()).unwrap()
}

/// Returns the number of points of `source`, of boxes, and of boxes that are classified as
/// vehicles, over 20 complete scans.
fn counts(setup: &mut TestScene, lidar: &mut RearLidar, source: PointSource) -> [usize; 3] {
    let mut counts = [0; 3];
    for scan_index in 0..20 {
        // The ego passes the things along the road.
        setup.ego.state.s_m += 1.2;
        let detections = setup.detect(lidar, scan_index);
        counts[0] += count(lidar.completed().unwrap().truth(), source);
        counts[1] += detections.len();
        counts[2] += detections.iter().filter(|detection| detection.class.vehicle() > 0.5).count();
    }
    counts
}

#[test]
fn false_alarms_come_at_their_rate_and_single_ones_make_no_box() {
    let with_rate = |false_alarm_rate| {
        let mut lidar = RearLidar::new(Lidar { false_alarm_rate, ..Lidar::default() });
        counts(&mut TestScene::new(), &mut lidar, PointSource::False)
    };
    assert_eq!(with_rate(0.0), [0, 0, 0]);
    for rate in [1e-4, 1e-3, 1e-2] {
        let [points, boxes, _] = with_rate(rate);
        let expected = 20.0 * BEAMS * rate;
        assert!((points as f64 - expected).abs() < 4.0 * expected.sqrt(), "{points} instead of {expected}");
        // Three of them would have to fall within the radius of the clustering.
        assert!(boxes <= points / 50, "{boxes} boxes of {points} points");
    }
    // Boxes come only at a rate far above the rate of any receiver, and most of them are no
    // vehicles.
    let [_, boxes, vehicles] = with_rate(0.1);
    assert!(boxes > 0 && vehicles < boxes, "{boxes} {vehicles}");
}

#[test]
fn false_alarms_change_no_other_point_and_a_blind_sensor_is_still_found_dark() {
    let mut scans = [0.0, 1e-3].map(|false_alarm_rate| {
        let mut lidar = RearLidar::new(Lidar { false_alarm_rate, ..Lidar::default() });
        TestScene::new().with(VehicleClass::Car, 30.0, 0.0).detect(&mut lidar, 3);
        let scan = lidar.latest();
        let points = lidar.truth().points.iter().enumerate().filter(|(_, point)| point.source != PointSource::False);
        points.map(|(index, _)| [scan.x_m[index], scan.y_m[index], scan.z_m[index]]).collect::<Vec<_>>()
    });
    assert!(scans[0].len() > 50);
    assert_eq!(std::mem::take(&mut scans[0]), scans[1]);
    let blind = Lidar { false_alarm_rate: 1e-3, window_transmission: 0.0, ..Lidar::default() };
    let mut lidar = RearLidar::new(blind);
    TestScene::new().detect(&mut lidar, 0);
    assert!(!lidar.latest().is_empty() && lidar.is_dark());
    let mut lidar = RearLidar::new(Lidar { window_transmission: 1.0, ..blind });
    TestScene::new().detect(&mut lidar, 0);
    assert!(!lidar.is_dark());
}

#[test]
fn signs_gantries_and_trees_give_points_and_boxes_that_an_empty_road_does_not() {
    let along = |text: &str| {
        let mut setup = TestScene::new();
        setup.road = road(text);
        // In the right lane, next to the objects beside the road.
        setup.ego.state.d_m = -9.4;
        counts(&mut setup, &mut RearLidar::new(Lidar::default()), PointSource::Roadside)
    };
    assert_eq!(along(""), [0, 0, 0]);
    for text in ["sign-spacing-m = 40", "gantry-spacing-m = 60", "tree-spacing-m = 20"] {
        let [points, boxes, vehicles] = along(&format!("roadside.{text}"));
        assert!(points > 200 && boxes > 5, "{text}: {points} points, {boxes} boxes");
        assert!(vehicles < boxes, "{text}: {vehicles} of {boxes} boxes are taken for vehicles");
    }
}

#[test]
fn a_sensor_sees_the_retro_reflective_face_only_from_the_side_of_the_traffic() {
    let materials = |road: Road| {
        let mut setup = TestScene::new();
        let (s_m, d_m) = (1_000.0, -9.4);
        (setup.ego.state.s_m, setup.ego.state.d_m) = if road.is_reversed() { (-s_m, -11.25 - d_m) } else { (s_m, d_m) };
        setup.road = road.clone();
        let mut lidar = RearLidar::new(Lidar::default());
        setup.detect(&mut lidar, 0);
        let returns_from = |material| lidar.truth().points.iter().filter(|point| point.material == material).count();
        [returns_from(Material::Sign), returns_from(Material::Steel)]
    };
    let signs = road("roadside.sign-spacing-m = 25");
    // The rear sensor looks at the backs of the signs that the ego has passed; the front sensor,
    // whose road is turned, at the faces.
    let [rear, front] = [materials(signs.clone()), materials(signs.reversed())];
    assert!(rear[0] < rear[1] && front[0] > 5 * rear[0].max(1), "{rear:?} {front:?}");
}

#[test]
fn a_wrong_spacing_is_answered_with_key_and_allowed_range() {
    let config: RoadConfig = toml::from_str("lanes = 3\nroadside.sign-spacing-m = 1").unwrap();
    let error = config.check(&Parameters::default()).unwrap_err().to_string();
    assert_eq!(error, "`roadside.sign-spacing-m` is 1, but a number from 5 to 10000 is needed");
}
