//! The Mask R-CNN finds the same vehicles in this process and in Python's ONNX Runtime, and other
//! networks are refused.
//!
//! The tests need the shared library of the `onnxruntime` wheel. Python got whole images; Rust gets
//! only the pixels that the network reads.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::path::{Path, PathBuf};

use closecall_sensors::camera::{
    Backend, HEIGHT_PX, Image, Instance, InstanceDetector, LabelMap, Mask, MaskRcnnInput, SHIPPED_MODEL, WIDTH_PX,
};
use closecall_traffic::VehicleClass;

/// Maximum differences of a box's sides (px) and of a score, and minimum intersection over union of
/// two masks.
const BOX_PX: f64 = 0.5;
const SCORE: f64 = 1e-3;
const MASK_OVERLAP: f64 = 0.98;
/// Side of a mask in cells.
const CELLS: usize = 28;

fn backend() -> Option<Backend> {
    closecall_testing::onnxruntime().map(|library: PathBuf| Backend::OnnxRuntime(library))
}

fn mask_overlap(first: &Mask, second: &Mask) -> f64 {
    let (first, second) = (first.pixels(), second.pixels());
    let count = |both: &dyn Fn(bool, bool) -> bool| first.iter().zip(&second).filter(|(a, b)| both(**a, **b)).count();
    let union = count(&|a, b| a || b);
    if union == 0 { 1.0 } else { count(&|a, b| a && b) as f64 / union as f64 }
}

fn assert_same(instance: &Instance, sides: &[f64], score: f64, cells: &[f32]) {
    for (side, wanted) in instance.box_px.iter().zip(sides) {
        assert!((side - wanted).abs() <= BOX_PX, "{:?} instead of {sides:?}", instance.box_px);
    }
    assert!((instance.score - score).abs() <= SCORE, "{} instead of {score}", instance.score);
    let area: [f64; 4] = sides.try_into().expect("four sides");
    let wanted = Mask::new(area, [CELLS, CELLS], cells.to_vec()).expect("a mask");
    let share = mask_overlap(&instance.mask, &wanted);
    assert!(share >= MASK_OVERLAP, "masks overlap by {share}");
}

#[test]
fn rust_and_python_find_the_same() {
    let Some(backend) = backend() else { return };
    let mut detector = InstanceDetector::shipped(&backend).unwrap();
    let [width, height] = [detector.sampling().columns().len(), detector.sampling().rows().len()];
    let answers: Vec<serde_json::Value> = serde_json::from_str(include_str!("mask_rcnn_golden/answers.json")).unwrap();
    let masks: Vec<f32> = include_bytes!("mask_rcnn_golden/masks.f32")
        .chunks_exact(4)
        .map(|bytes| f32::from_le_bytes(bytes.try_into().unwrap()))
        .collect();
    let mut masks = masks.chunks_exact(CELLS * CELLS);
    let pictures = include_bytes!("mask_rcnn_golden/pictures.rgb").chunks_exact(width * height * 3);
    assert!(pictures.len() >= 3 && pictures.len() == answers.len());
    let mut compared = 0;
    for (rgb, answer) in pictures.zip(&answers) {
        let numbers = |key: &str| -> Vec<f64> { serde_json::from_value(answer[key].clone()).unwrap() };
        let picture = Image { width: width as u32, height: height as u32, rgb: rgb.to_vec() };
        let instances = detector.detect(&picture).unwrap();
        assert_eq!(detector.detect(&picture).unwrap(), instances, "the same picture gives the same bits");
        let (labels, scores) = (numbers("labels"), numbers("scores"));
        assert_eq!(instances.len(), scores.len());
        let boxes: Vec<Vec<f64>> = serde_json::from_value(answer["boxes"].clone()).unwrap();
        for (index, instance) in instances.iter().enumerate() {
            assert_eq!(instance.class as usize + 1, labels[index] as usize);
            assert_same(instance, &boxes[index], scores[index], masks.next().unwrap());
            compared += usize::from(instance.score > 0.5);
        }
    }
    assert!(compared >= 4, "{compared}");
}

#[test]
fn a_network_with_another_layout_is_refused_with_both_layouts() {
    let Some(backend) = backend() else { return };
    let error = InstanceDetector::new(SHIPPED_MODEL, None, &backend).unwrap_err().to_string();
    for part in [
        "inputs pixels",
        "outputs scores",
        "wanted are an input float [3, 800, 1280]",
        "masks float [n, 1, height, width]",
        "without masks the first three, or one output float [1, n, 6]",
    ] {
        assert!(error.contains(part), "{part}: {error}");
    }
    let error = InstanceDetector::new(b"no network", None, &backend).unwrap_err().to_string();
    assert!(error.starts_with("failed to read the classifier's network"), "{error}");
}

/// The first pixel of the picture for other networks: red, green and blue.
const FIRST_PIXEL: [u8; 3] = [51, 102, 204];

/// Returns the instances that a network of `xtask/training/mask_rcnn_layouts.py` finds in a black
/// picture whose first pixel is [`FIRST_PIXEL`].
fn found_by(file: &str, input: MaskRcnnInput, backend: &Backend) -> Vec<Instance> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/mask_rcnn_layouts");
    let bytes = std::fs::read(folder.join(file)).unwrap();
    let labels = LabelMap::parse("3=car 8=truck 4=motorcycle").unwrap();
    let mut detector = InstanceDetector::new(&bytes, Some(&labels), backend).unwrap().with_input(input);
    let [width, height] = [usize::from(WIDTH_PX), usize::from(HEIGHT_PX)];
    let mut rgb = vec![0; width * height * 3];
    rgb[..3].copy_from_slice(&FIRST_PIXEL);
    detector.detect(&Image { width: width as u32, height: height as u32, rgb }).unwrap()
}

fn assert_found(instances: &[Instance], scores: [f64; 3]) {
    let classes = [VehicleClass::Car, VehicleClass::Truck, VehicleClass::Motorcycle];
    assert_eq!(instances.iter().map(|instance| instance.class).collect::<Vec<_>>(), classes);
    for (instance, score) in instances.iter().zip(scores) {
        assert!((instance.score - score).abs() < 1e-4, "{} instead of {score}", instance.score);
    }
    assert_eq!(instances[1].box_px, [700.0, 380.0, 800.0, 480.0]);
}

#[test]
fn the_layout_of_the_model_zoo_is_read_and_gets_blue_green_and_red_less_their_means() {
    let Some(backend) = backend() else { return };
    let instances = found_by("model-zoo.onnx", MaskRcnnInput::BgrMean, &backend);
    // The network adds the means again.
    assert_found(&instances, [0.8, 0.4, 0.2]);
    let inside = instances[1].mask.pixels().iter().filter(|inside| **inside).count();
    assert_eq!(inside, 100 * 100, "cells of 28 x 28 fill the box");
    let wrong = found_by("model-zoo.onnx", MaskRcnnInput::Rgb, &backend);
    assert!((wrong[0].score - 0.8).abs() > 0.1, "the input matters");
}

#[test]
fn the_layout_of_torchvision_is_read_with_a_batch_and_with_masks_of_the_size_of_the_image() {
    let Some(backend) = backend() else { return };
    let instances = found_by("torchvision.onnx", MaskRcnnInput::Rgb, &backend);
    assert_found(&instances, [0.2, 0.4, 0.8]);
    assert_eq!(instances[0].mask.extent_px(), Some([0.0, 0.0, 1280.0, 800.0]));
}

#[test]
fn a_detector_without_masks_is_read_from_three_outputs_or_from_rows() {
    let Some(backend) = backend() else { return };
    for file in ["boxes.onnx", "rows.onnx"] {
        let instances = found_by(file, MaskRcnnInput::Rgb, &backend);
        assert_found(&instances, [0.2, 0.4, 0.8]);
        for Instance { box_px, mask, .. } in &instances {
            assert_eq!(mask.extent_px(), Some(*box_px), "{file}: the box takes the place of the mask");
        }
        let inside = instances[1].mask.pixels().iter().filter(|inside| **inside).count();
        assert_eq!(inside, 100 * 100, "{file}");
    }
}

#[test]
fn an_image_without_a_vehicle_has_no_instance() {
    let Some(backend) = backend() else { return };
    // The scores are the first pixel: a score of 0 is an empty row.
    let bytes = include_bytes!("mask_rcnn_layouts/rows.onnx");
    let labels = LabelMap::parse("3=car").unwrap();
    let mut detector = InstanceDetector::new(bytes, Some(&labels), &backend).unwrap();
    assert_eq!(detector.detect(&black()).unwrap(), []);
}

fn black() -> Image {
    let [width, height] = [usize::from(WIDTH_PX), usize::from(HEIGHT_PX)];
    Image { width: width as u32, height: height as u32, rgb: vec![0; width * height * 3] }
}

/// Returns the error of a network whose file is `bytes`, with these values for the colours of a
/// pixel.
fn error_of(bytes: &[u8], input: MaskRcnnInput, backend: &Backend) -> String {
    let labels = LabelMap::parse("3=car 8=truck 4=motorcycle").unwrap();
    let detector = InstanceDetector::new(bytes, Some(&labels), backend).unwrap();
    detector.with_input(input).with_name("own.onnx").detect(&black()).unwrap_err().to_string()
}

/// Returns the bytes of a file with the first occurrence of a number replaced by another number. The
/// files hold the boxes `[600, 400, 640, 440]`, `[700, 380, 800, 480]` and `[500, 400, 520, 440]`.
fn replaced(bytes: &[u8], from: f32, to: f32) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    let place = bytes.windows(4).position(|window| window == from.to_le_bytes()).expect("the number");
    bytes[place..place + 4].copy_from_slice(&to.to_le_bytes());
    bytes
}

#[test]
fn an_answer_that_is_no_box_or_no_probability_is_an_error_that_names_network_and_tensor() {
    let Some(backend) = backend() else { return };
    let zoo = include_bytes!("mask_rcnn_layouts/model-zoo.onnx");
    let torchvision = include_bytes!("mask_rcnn_layouts/torchvision.onnx");
    let rgb = |bytes: &[u8]| error_of(bytes, MaskRcnnInput::Rgb, &backend);
    // The boxes have 700 for the left side of one, and 480 for its lower side.
    for side in [f32::NAN, f32::INFINITY, 900.0] {
        let error = rgb(&replaced(torchvision, 700.0, side));
        assert!(error.contains("own.onnx") && error.contains("`boxes`"), "{error}");
    }
    // The scores are the values of the first pixel and the mean of its channel, as a share of 255.
    for mean in [f32::NAN, f32::NEG_INFINITY, 7.0 * 255.0, -1.0] {
        let error = rgb(&replaced(zoo, 102.9801, mean));
        assert!(error.contains("own.onnx") && error.contains("`6572`") && error.contains("0 to 1"), "{error}");
    }
    // A network that takes shares of full brightness, and gets bytes less their means.
    let error = error_of(torchvision, MaskRcnnInput::BgrMean, &backend);
    assert!(error.contains("own.onnx") && error.contains("`scores`"), "{error}");
}

#[test]
fn a_wrong_answer_of_a_detector_without_masks_is_an_error_that_names_its_place() {
    let Some(backend) = backend() else { return };
    let boxes = include_bytes!("mask_rcnn_layouts/boxes.onnx");
    let rows = include_bytes!("mask_rcnn_layouts/rows.onnx");
    let rgb = |bytes: &[u8]| error_of(bytes, MaskRcnnInput::Rgb, &backend);
    // No number, a box that ends before it begins, and boxes beyond each side of the image.
    for (from, to) in [(700.0, f32::NAN), (800.0, f32::INFINITY), (700.0, 900.0), (800.0, -1.0), (480.0, 379.0)] {
        let error = rgb(&replaced(boxes, from, to));
        assert!(error.contains("own.onnx") && error.contains("`boxes`") && error.contains("in the image"), "{error}");
        let error = rgb(&replaced(rows, from, to));
        assert!(error.contains("own.onnx") && error.contains("`output0`") && error.contains("in the image"), "{error}");
    }
    let beyond = replaced(&replaced(rows, 700.0, 1300.0), 800.0, 1400.0);
    assert!(rgb(&beyond).contains("in the image"), "{}", rgb(&beyond));
    // The third value of the second row.
    let error = rgb(&replaced(rows, 800.0, f32::NAN));
    assert!(error.contains("NaN as value 8"), "{error}");
    // 8 is the label of the second row.
    let error = rgb(&replaced(rows, 8.0, 7.5));
    assert!(error.contains("7.5 as value 11") && error.contains("whole labels"), "{error}");
    for file in [&boxes[..], rows] {
        let error = error_of(file, MaskRcnnInput::BgrMean, &backend);
        assert!(error.contains("own.onnx") && error.contains("probabilities from 0 to 1"), "{error}");
    }
}

#[test]
fn boxes_in_shares_of_the_image_are_refused() {
    let Some(backend) = backend() else { return };
    let mut bytes = include_bytes!("mask_rcnn_layouts/boxes.onnx").to_vec();
    for side_px in [600.0, 400.0, 640.0, 440.0, 700.0, 380.0, 800.0, 480.0, 500.0, 400.0, 520.0, 440.0] {
        bytes = replaced(&bytes, side_px, side_px / f32::from(WIDTH_PX));
    }
    let labels = LabelMap::parse("3=car").unwrap();
    let mut detector = InstanceDetector::new(&bytes, Some(&labels), &backend).unwrap();
    let mut picture = black();
    picture.rgb[..3].copy_from_slice(&FIRST_PIXEL);
    let error = detector.detect(&picture).unwrap_err().to_string();
    assert!(error.contains("`boxes`") && error.contains("not in shares of it"), "{error}");
}

#[test]
fn a_network_without_labels_is_refused() {
    let Some(backend) = backend() else { return };
    let bytes = include_bytes!("mask_rcnn_layouts/model-zoo.onnx");
    let error = InstanceDetector::new(bytes, None, &backend).unwrap_err().to_string();
    assert!(error.contains("3=car 4=motorcycle 8=truck"), "{error}");
}

#[test]
fn labels_that_are_not_mapped_are_left_out() {
    let Some(backend) = backend() else { return };
    let map = LabelMap::parse("2=truck").unwrap();
    let mut detector =
        InstanceDetector::new(closecall_sensors::camera::SHIPPED_MASK_RCNN, Some(&map), &backend).unwrap();
    let [width, height] = [detector.sampling().columns().len(), detector.sampling().rows().len()];
    let answers: Vec<serde_json::Value> = serde_json::from_str(include_str!("mask_rcnn_golden/answers.json")).unwrap();
    let pictures = include_bytes!("mask_rcnn_golden/pictures.rgb").chunks_exact(width * height * 3);
    for (rgb, answer) in pictures.zip(&answers) {
        let labels: Vec<u64> = serde_json::from_value(answer["labels"].clone()).unwrap();
        let picture = Image { width: width as u32, height: height as u32, rgb: rgb.to_vec() };
        let trucks = labels.iter().filter(|label| **label == 2).count();
        assert_eq!(detector.detect(&picture).unwrap().len(), trucks);
    }
}
