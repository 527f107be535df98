//! Recordings of the pipeline `mask-rcnn` show the instances, and recordings of the crop classifier
//! show its windows.
//!
//! The instances are given: `sensors/tests/mask_rcnn.rs` tests the results of the network.

use arrow::array::{Array, BinaryArray, FixedSizeListArray, Float32Array, ListArray, UInt8Array};
use closecall_sensors::RearImage;
use closecall_sensors::camera::{CameraConfig, Instance, Mask, Pipeline};
use closecall_traffic::{Check, Parameters, VehicleClass};

use super::*;

/// Boxes in the image: left, top, right, bottom (px). The last one lies above the shown rows.
const BOXES_PX: [[f64; 4]; 4] =
    [[600.0, 380.0, 700.0, 480.0], [100.0, 390.0, 300.0, 700.0], [900.0, 395.0, 940.0, 420.0], [0.0, 0.0, 50.0, 50.0]];
const SCORES: [f64; 4] = [0.98, 0.75, 0.2, 0.9];

fn instances() -> Vec<Instance> {
    let instances = BOXES_PX.iter().zip(SCORES).zip([
        VehicleClass::Car,
        VehicleClass::Truck,
        VehicleClass::Motorcycle,
        VehicleClass::Car,
    ]);
    instances
        .map(|((box_px, score), class)| {
            // The left half of the box belongs to the vehicle.
            let mask = Mask::new(*box_px, [4, 1], vec![1.0, 1.0, 0.0, 0.0]).unwrap();
            Instance { box_px: *box_px, class, score, mask }
        })
        .collect()
}

/// Returns a film whose camera took an image in every fifth step, with the same instances in each.
fn film_with_images() -> Film {
    let mut film = filmed("low-thw-overtake", ControllerChoice::MIS, Some(SensorMode::Full), Level::Full);
    film.cameras[0].0.pipeline = Pipeline::MaskRcnn;
    for frame in film.frames.iter_mut().step_by(5) {
        let (time, shown_time) = (frame.time, frame.time);
        frame.rear_images = vec![RearImage { camera: "rear-camera", time, shown_time, instances: instances() }];
    }
    film
}

/// Returns the pairs of numbers of a component in the first row of a chunk.
fn pairs(chunk: &Chunk, component: &str) -> Vec<[f32; 2]> {
    let column = chunk.components().values().find(|column| column.descriptor.component.as_str() == component).unwrap();
    let row = column.list_array.value(0);
    let row = row.as_any().downcast_ref::<FixedSizeListArray>().unwrap();
    let numbers = row.values().as_any().downcast_ref::<Float32Array>().unwrap().values().to_vec();
    numbers[2 * row.offset()..][..2 * row.len()].chunks_exact(2).map(|pair| [pair[0], pair[1]]).collect()
}

#[test]
fn the_pinhole_has_the_size_of_the_picture_that_is_shown_of_a_larger_image() {
    let mut film = filmed("low-thw-overtake", ControllerChoice::MIS, Some(SensorMode::Full), Level::Full);
    let shown = |film: Film| {
        let all = chunks(&[film], StoreKind::Recording);
        let of_camera = |chunk: &&Chunk| chunk.entity_path().to_string() == "/mis/world/ego/camera";
        let has = |chunk: &&Chunk| {
            chunk.components().values().any(|column| column.descriptor.component.as_str() == "Pinhole:resolution")
        };
        pairs(all.iter().filter(of_camera).find(has).unwrap(), "Pinhole:resolution")
    };
    let config = r#"{ "resolution": { "width-px": 2560, "height-px": 1200 }, "yaw-deg": 20 }"#;
    let config: CameraConfig = serde_json::from_str(config).unwrap();
    film.cameras[0].0 = config.check(&Parameters::default()).unwrap();
    // Every tenth of 2560 columns, and of the rows from 260 to 1020.
    assert_eq!(shown(film), [[256.0, 76.0]]);
}

#[test]
fn the_image_shows_the_instances_of_the_network_and_no_windows() {
    let film = film_with_images();
    let (times, all) = (
        film.frames.iter().step_by(5).map(|frame| frame.time.ns()).collect::<Vec<i64>>(),
        chunks(&[film], StoreKind::Recording),
    );
    let chunks_of = |entity: &str| -> Vec<&Chunk> {
        all.iter().filter(|chunk| chunk.entity_path().to_string() == format!("/mis/world/ego/camera{entity}")).collect()
    };
    assert!(chunks_of("/windows").is_empty());
    let time = TimelineName::from_static_str(TIME_TIMELINE);
    let moving = |entity: &str| -> Vec<&Chunk> {
        chunks_of(entity).into_iter().filter(|chunk| chunk.timelines().contains_key(&time)).collect()
    };
    let [images, boxes, masks] = ["", "/instances", "/masks"].map(moving);
    assert!(images.len() >= 3);
    for of_entity in [&images, &boxes, &masks] {
        let times_of_masks: Vec<i64> = of_entity.iter().map(|chunk| chunk.timelines()[&time].times_raw()[0]).collect();
        assert_eq!(times_of_masks.len(), images.len());
        assert!(
            times_of_masks.iter().all(|time| times.contains(time)),
            "only what the network saw: {times_of_masks:?}"
        );
    }
    for chunk in boxes {
        // Every fifth pixel of the rows 230 to 610 is shown, and the fourth box lies above them.
        let expected: Vec<[[f32; 2]; 2]> = BOXES_PX[..3]
            .iter()
            .map(|[left, top, right, bottom]| {
                let [low, high] = [top, bottom].map(|row| (row.min(610.0) - 230.0) / 5.0);
                [[(left + right) / 10.0, (low + high) / 2.0], [(right - left) / 10.0, (high - low) / 2.0]]
                    .map(|pair| pair.map(|x| x as f32))
            })
            .collect();
        let boxes: Vec<_> =
            pairs(chunk, "Boxes2D:centers").into_iter().zip(pairs(chunk, "Boxes2D:half_sizes")).collect();
        assert_eq!(boxes.len(), expected.len());
        for ((centre, half), [wanted_centre, wanted_half]) in boxes.iter().zip(&expected) {
            for axis in [0, 1] {
                assert!((centre[axis] - wanted_centre[axis]).abs() < 1e-3, "{centre:?} {wanted_centre:?}");
                assert!((half[axis] - wanted_half[axis]).abs() < 1e-3, "{half:?} {wanted_half:?}");
            }
        }
        assert_eq!(texts(chunk, "Boxes2D:labels"), ["car 0.98", "truck 0.75", ""]);
    }
    for chunk in masks {
        let pixels = bytes(chunk, "SegmentationImage:buffer");
        assert_eq!(pixels.len(), 256 * 76);
        let at = |u: usize, v: usize| pixels[(v - 230) / 5 * 256 + u / 5];
        assert_eq!([at(620, 430), at(690, 430), at(120, 500), at(910, 405), at(500, 300)], [1, 0, 2, 0, 0]);
    }
}

/// Returns the bytes of a component in the first row of a chunk.
fn bytes(chunk: &Chunk, component: &str) -> Vec<u8> {
    let column = chunk.components().values().find(|column| column.descriptor.component.as_str() == component).unwrap();
    let row = column.list_array.value(0);
    if let Some(binary) = row.as_any().downcast_ref::<BinaryArray>() {
        return binary.value(0).to_vec();
    }
    let list = row.as_any().downcast_ref::<ListArray>().unwrap().value(0);
    list.as_any().downcast_ref::<UInt8Array>().unwrap().values().to_vec()
}

#[test]
fn a_frozen_camera_shows_the_scene_that_it_holds() {
    let images_of = |film: Film| -> Vec<Vec<u8>> {
        let all = chunks(&[film], StoreKind::Recording);
        let is_image =
            |chunk: &&Chunk| chunk.entity_path().to_string() == "/mis/world/ego/camera" && !chunk.is_static();
        all.iter().filter(is_image).map(|chunk| bytes(chunk, "Image:buffer")).collect()
    };
    let moving = film_with_images();
    let mut frozen = moving.clone();
    let first = frozen.frames[0].time;
    for frame in &mut frozen.frames {
        frame.rear_images.iter_mut().for_each(|image| image.shown_time = first);
    }
    let [moving, frozen] = [moving, frozen].map(images_of);
    assert_eq!(moving.len(), frozen.len());
    assert!(frozen.iter().all(|image| *image == frozen[0]));
    assert!(moving.iter().any(|image| *image != moving[0]));
}
