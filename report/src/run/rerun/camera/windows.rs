//! The windows of the image that the crop classifier evaluates, with the class that it finds in
//! each.

use closecall_sensors::Detection;
use closecall_sensors::camera::{Pipeline, PixelRect, RearCamera, best_camera};

use super::{Shown, class_colour, clear_covered, in_picture, labels_in_strip};
use crate::run::film::{Film, Frame};
use crate::run::rerun::palette::{self, Rgba};
use rerun::{Boxes2D, Points2D};

/// Returns the windows of the detections of a frame that the camera with this number classifies,
/// with their classes, and their labels.
pub(super) fn windows(film: &Film, number: usize, frame: &Frame) -> (Boxes2D, Points2D) {
    let (ego, _) = film.scene_vehicles(frame);
    let boxes = frame.scan.as_ref().map_or(&[][..], |scan| &scan.boxes);
    let cameras: Vec<RearCamera> = film.cameras.iter().map(|(camera, _)| RearCamera::new(*camera)).collect();
    let used = || cameras.iter().enumerate().filter(|(_, camera)| camera.camera().pipeline != Pipeline::Off);
    let working = || used().filter(|(_, camera)| !frame.failed_cameras.contains(&camera.camera().name));
    let owner = |detection: &Detection| {
        best_camera(working(), &ego, detection).or_else(|| best_camera(used(), &ego, detection))
    };
    let camera = &cameras[number];
    let in_image: Vec<(&Detection, PixelRect)> = boxes
        .iter()
        .filter(|detection| owner(detection) == Some(number))
        .filter_map(|detection| Some((detection, camera.detection_window(&ego, detection)?)))
        .collect();
    let part = Shown::of(camera.camera().resolution);
    let ends = |window: &PixelRect| {
        let [left, top] = [window.left, window.top].map(|start| start as f32);
        in_picture(&part, [left, top, left + window.width as f32, top + window.height as f32])
    };
    let shown: Vec<([f32; 2], [f32; 2])> = in_image.iter().map(|(_, window)| ends(window)).collect();
    let mut labels: Vec<String> = in_image.iter().map(|(detection, _)| label(detection)).collect();
    let width_px = part.size_px()[0];
    clear_covered(&shown, &mut labels, width_px);
    let points = labels_in_strip(&shown, &labels, width_px);
    let boxes = Boxes2D::from_mins_and_sizes(shown.iter().map(|ends| ends.0), shown.iter().map(|ends| ends.1))
        .with_colors(in_image.iter().map(|(detection, _)| colour(detection)))
        .with_labels(labels);
    (boxes, points)
}

fn colour(detection: &Detection) -> Rgba {
    match (detection.class.vehicle() >= 0.5, detection.class.best_vehicle_class()) {
        (false, _) => palette::QUIET,
        (true, class) => class_colour(class),
    }
}

/// Returns the most likely class with its score. A window without a vehicle has no label, so the
/// image stays visible.
fn label(detection: &Detection) -> String {
    if detection.class.vehicle() < 0.5 {
        return String::new();
    }
    let [car, truck, motorcycle, background] = detection.class.0;
    let all = [("car", car), ("truck", truck), ("motorcycle", motorcycle), ("background", background)];
    let best = all.iter().max_by(|a, b| a.1.total_cmp(&b.1));
    best.map_or(String::new(), |(name, score)| format!("{name} {score:.2}"))
}
