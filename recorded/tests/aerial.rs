//! The shipped detector on held-out renders, and a flight over simulated traffic.

#![expect(clippy::unwrap_used, reason = "a test that cannot be set up has failed")]

use std::collections::BTreeSet;

use closecall_recorded::aerial::dataset::{AerialDatasetOptions, dataset_picture};
use closecall_recorded::aerial::{Boxes, Correction, Detector, FlightOptions, fly, intersection_over_union, losses};
use closecall_recorded::trajectory_data::{LaneMarkings, TrajectoryData};
use closecall_sensors::camera::Backend;
use closecall_sensors::datasets::Set;
use closecall_traffic::geometry::OrientedBox;
use closecall_traffic::{Dimensions, Lane, Time, Trajectory, TrajectoryPoint, VehicleClass};

fn plane(image_box: &closecall_recorded::aerial::ImageBox) -> OrientedBox {
    let [x_m, y_m] = image_box.centre_px;
    OrientedBox { x_m, y_m, yaw_rad: image_box.angle_rad, length_m: image_box.length_px, width_m: image_box.width_px }
}

/// Returns the share of a class's visible vehicles that are detected, and the share of the
/// detections that are right.
fn recall_and_precision(class: VehicleClass, pictures: u32) -> [f64; 2] {
    let mut detector = Detector::shipped(&Backend::Tract).unwrap();
    let options = AerialDatasetOptions { set: Set::HeldOut, pictures, seed: 77 };
    let (mut wanted, mut detected, mut right, mut given) = (0, 0, 0, 0);
    for index in 0..pictures {
        let (picture, scene, _) = dataset_picture(&options, index).unwrap();
        let [width, height] = [picture.image.width, picture.image.height].map(f64::from);
        let detections = detector.detect(&picture.image, 0.3).unwrap();
        let class_of = |id: u64| scene.vehicles.iter().find(|vehicle| vehicle.id == id).unwrap().vehicle.class;
        for label in picture.labels.iter().filter(|label| class_of(label.id) == class && label.is_visible) {
            let [x, y] = label.image_box.centre_px;
            if !(0.0..width).contains(&x) || !(0.0..height).contains(&y) {
                continue;
            }
            let is_found = detections.iter().any(|detection| {
                detection.class == class
                    && intersection_over_union(&plane(&detection.image_box), &plane(&label.image_box)) >= 0.5
            });
            wanted += 1;
            detected += usize::from(is_found);
        }
        for detection in detections.iter().filter(|detection| detection.class == class) {
            given += 1;
            right += usize::from(picture.labels.iter().any(|label| {
                class_of(label.id) == class
                    && intersection_over_union(&plane(&detection.image_box), &plane(&label.image_box)) >= 0.5
            }));
        }
    }
    assert!(wanted > 20, "{wanted}");
    [detected as f64 / wanted as f64, right as f64 / given as f64]
}

#[test]
fn the_shipped_detector_finds_cars_and_trucks_on_held_out_renders() {
    for class in [VehicleClass::Car, VehicleClass::Truck] {
        let [recall, precision] = recall_and_precision(class, 12);
        assert!(recall > 0.85 && precision > 0.85, "{class:?}: recall {recall}, precision {precision}");
    }
}

#[test]
fn the_same_picture_gives_the_same_bytes_and_the_same_detections() {
    let options = AerialDatasetOptions { set: Set::HeldOut, pictures: 2, seed: 5 };
    let detect = || {
        let (picture, _, _) = dataset_picture(&options, 1).unwrap();
        let detections = Detector::shipped(&Backend::Tract).unwrap().detect(&picture.image, 0.2).unwrap();
        (picture.image, detections)
    };
    assert_eq!(detect(), detect());
    let (other, _, _) = dataset_picture(&AerialDatasetOptions { seed: 6, ..options }, 1).unwrap();
    assert_ne!(other.image, detect().0);
}

/// A vehicle at constant speed that changes from the right lane to the left one between 2 and 7 s
/// if `changes`.
fn vehicle(id: u64, class: VehicleClass, start_m: f64, speed_mps: f64, changes: bool) -> Trajectory {
    let point = |k: i64| {
        let time_s = 0.1 * k as f64;
        let share = ((time_s - 2.0) / 5.0).clamp(0.0, 1.0);
        let path = share.powi(3) * (10.0 - 15.0 * share + 6.0 * share * share);
        let slope = 30.0 * share * share * (1.0 - share).powi(2) / 5.0;
        let (d_m, lateral_speed_mps) = if changes { (-5.25 + 3.5 * path, 3.5 * slope) } else { (-5.25, 0.0) };
        TrajectoryPoint {
            time: Time::from_ms(100 * k),
            s_m: start_m + speed_mps * time_s,
            d_m,
            speed_mps,
            acceleration_mps2: 0.0,
            lateral_speed_mps,
            lateral_acceleration_mps2: 0.0,
            lane: Lane(if d_m < -3.5 { 2 } else { 1 }),
        }
    };
    let dimensions = Dimensions { ..class.typical_dimensions() };
    Trajectory { track_id: id, vehicle_id: id, class, dimensions, points: (0..=90).map(point).collect() }
}

#[test]
fn a_flight_follows_all_vehicles_and_the_correction_removes_the_bias_of_trucks() {
    let car = vehicle(1, VehicleClass::Car, 0.0, 28.0, true);
    let truck = vehicle(2, VehicleClass::Truck, 45.0, 24.0, true);
    let lead = vehicle(3, VehicleClass::Car, -40.0, 26.0, false);
    let data = TrajectoryData::new("own", Time::from_ms(100), vec![car, truck, lead]);
    let flight =
        fly(&data, &FlightOptions { offset_sigma_m: 0.0, ..FlightOptions::default() }, &Backend::Tract).unwrap();
    let result = losses(std::slice::from_ref(&flight));
    for row in &result.rows {
        assert!(row.followed.unwrap() > 0.9 && row.id_switches == 0, "{row:?}");
        let peak = row.lane_changes[0];
        assert_eq!((peak.wanted, peak.found, peak.invented), (1, 1, 0), "{row:?}");
    }
    let [raw, corrected] = [&result.rows[2], &result.rows[3]].map(|row| row.bias_across_m.unwrap());
    assert!((0.6..1.4).contains(&raw), "a truck seems to drive about a metre beside its place: {raw}");
    assert!(corrected.abs() < 0.5 * raw, "{corrected} of {raw}");
    let text = result.to_string();
    assert!(["truck corrected", "thw_s", "ID switches"].iter().all(|words| text.contains(words)), "{text}");
}

#[test]
fn each_carriageway_is_flown_over_by_itself() {
    let tracks = |first_id: u64, moved_m: f64, lanes: u8| {
        let car = vehicle(first_id, VehicleClass::Car, 0.0, 28.0, true);
        let lead = vehicle(first_id + 1, VehicleClass::Car, 40.0, 26.0, false);
        [car, lead].map(|mut track| {
            for point in &mut track.points {
                point.d_m -= moved_m;
                point.lane.0 += lanes;
            }
            track
        })
    };
    let both = [tracks(1, 0.0, 0), tracks(3, 1_007.0, 3)].concat();
    let edges = [-3.5, -7.0, -1_007.0, -1_010.5, -1_014.0];
    let markings = LaneMarkings::from_right_edges((1..).map(Lane).zip(edges));
    let data = TrajectoryData { markings, ..TrajectoryData::new("two", Time::from_ms(100), both) };
    let options = FlightOptions { boxes: Boxes::Exact, offset_sigma_m: 0.0, ..FlightOptions::default() };
    let flight = fly(&data, &options, &Backend::Tract).unwrap();
    let losses = losses(std::slice::from_ref(&flight));
    let row = &losses.rows[1];
    assert!(row.followed.unwrap() > 0.9 && row.bias_across_m.unwrap().abs() < 0.3, "{row:?}");
    let peak = row.lane_changes[0];
    assert_eq!((peak.wanted, peak.found, peak.invented), (2, 2, 0), "{row:?}");
    let lanes: BTreeSet<u8> =
        flight.corrected.trajectories.iter().flat_map(|track| &track.points).map(|point| point.lane.0).collect();
    assert_eq!(lanes, BTreeSet::from([1, 2, 4, 5]));
    // Vehicles that drive beside all lanes are in no picture.
    let far = TrajectoryData::new("far", Time::from_ms(100), tracks(1, 200.0, 0).to_vec());
    assert!(fly(&far, &options, &Backend::Tract).unwrap_err().to_string().contains("no vehicle is within a picture"));
}

#[test]
fn with_exact_boxes_the_silhouette_places_trucks_of_any_height_and_the_height_of_the_class_does_not() {
    let truck = vehicle(2, VehicleClass::Truck, 0.0, 22.0, true);
    let data = TrajectoryData::new("own", Time::from_ms(100), vec![truck]);
    // The seed chooses the body: boxes of 4 m, and lower coaches, tankers and platforms.
    let bias_m = |correction, seed| {
        let boxes = Boxes::Exact;
        let options = FlightOptions { boxes, correction, seed, offset_sigma_m: 0.0, ..FlightOptions::default() };
        let result = losses(&[fly(&data, &options, &Backend::Tract).unwrap()]);
        assert_eq!((result.rows[3].class, result.rows[3].is_corrected), (VehicleClass::Truck, true));
        assert!(result.rows[3].followed.unwrap() > 0.9, "{:?}", result.rows[3]);
        result.rows[3].bias_across_m.unwrap()
    };
    let seeds = [0, 1, 4, 5, 6, 7];
    let silhouettes = seeds.map(|seed| bias_m(Correction::Silhouette, seed));
    assert!(silhouettes.iter().all(|bias_m| bias_m.abs() < 0.08), "{silhouettes:?}");
    let classes = seeds.map(|seed| bias_m(Correction::ClassHeight, seed));
    assert!(classes.iter().any(|bias_m| *bias_m < -0.15), "some of the trucks are lower: {classes:?}");
}

#[test]
fn wrong_options_and_empty_traffic_are_refused() {
    let data = TrajectoryData::new("own", Time::from_ms(100), vec![vehicle(1, VehicleClass::Car, 0.0, 30.0, false)]);
    for (options, words) in [
        (
            FlightOptions { altitude_m: 5.0, ..FlightOptions::default() },
            "`altitude` is 5, which is not from 40 to 400 m",
        ),
        (FlightOptions { off_nadir_rad: f64::NAN, ..FlightOptions::default() }, "from 0 to 40 degrees"),
        (FlightOptions { jitter_sigma_m: -1.0, ..FlightOptions::default() }, "from 0 to 5 m"),
    ] {
        let message = fly(&data, &options, &Backend::Tract).unwrap_err().to_string();
        assert!(message.contains(words), "{message}");
    }
    let empty = TrajectoryData::new("nothing", Time::from_ms(100), Vec::new());
    let message = fly(&empty, &FlightOptions::default(), &Backend::Tract).unwrap_err().to_string();
    assert!(message.contains("nothing") && message.contains("no vehicle changes lanes"), "{message}");
}
