//! Images of the rear camera, with the windows that the classifier evaluates and the class that it finds in each.
//!
//! The closed loop never renders a whole camera image. This module renders it afterwards, from the same scene and the
//! same noise. It renders every [`PIXEL_STEP`]-th pixel, and only at selected instants, since an image costs as much as
//! a hundred control steps. An image and its windows stay visible until the next image.

use crate::run::rerun::sdk::{AsComponents, Boxes2D, Image, Pinhole, Transform3D};
use closecall_camera::{Camera, ExposureKey, FOCAL_PX, Frame as Exposure, FrameBuffers, PixelRect, RearCamera};
use closecall_sensors::{Detection, rear_exposures};
use closecall_traffic::{Time, VehicleClass};

use super::RecordingError;
use super::palette::{self, Rgba};
use super::stream::Writer;
use crate::run::film::{Film, Frame};

/// Distance between two rendered pixels, in both directions (px).
const PIXEL_STEP: u16 = 5;
/// Rendered rows of the image, from above the horizon down to the road just behind the ego (px).
const PIXEL_ROWS: std::ops::Range<u16> = 230..610;
/// Times before the critical moment for which an image is rendered, besides the first scan and the moments of the encounter.
const TIMES_BEFORE: [Time; 3] = [Time::from_ms(2_000), Time::from_ms(800), Time::ZERO];
/// Least time between an image and the one before it. That of the critical moment is rendered in any case.
const LEAST_INTERVAL: Time = Time::from_ms(2_500);

/// Entity of the camera, which moves with the ego.
pub(super) const ENTITY: &str = "world/ego/camera";
/// Distance at which the scene shows the image behind the camera (m): near, so that it hides no vehicle.
const IMAGE_DISTANCE_M: f32 = 1.2;

/// Writes position and projection of the camera, so that the scene shows its image where it is taken. The pitch of the
/// body is left out.
fn write_pinhole(writer: &Writer<'_>, film: &Film, camera: &Camera) -> Result<(), RecordingError> {
    let ahead_m = camera.mount_from_rear_m - 0.5 * film.actors[film.ego].vehicle.dimensions.length_m;
    let (sin, cos) = camera.pitch_rad.sin_cos();
    // The axes of the camera in the ego frame: right, down, and backward along the road.
    let axes = [[0.0, 1.0, 0.0], [sin, 0.0, -cos], [-cos, 0.0, -sin]].map(|axis| axis.map(|value| value as f32));
    let position_m = [ahead_m as f32, 0.0, camera.mount_height_m as f32];
    writer.write_static(ENTITY, &Transform3D::from_translation_mat3x3(position_m, axes))?;
    let (step, first_row) = (f32::from(PIXEL_STEP), f32::from(PIXEL_ROWS.start));
    let rows = f32::from(PIXEL_ROWS.end) - first_row;
    let [width, height] = [PixelRect::IMAGE.width as f32, PixelRect::IMAGE.height as f32];
    let focal = FOCAL_PX as f32 / step;
    let pinhole = Pinhole::from_focal_length_and_resolution([focal, focal], [width / step, rows / step])
        .with_principal_point([0.5 * width / step, (0.5 * height - first_row) / step])
        .with_image_plane_distance(IMAGE_DISTANCE_M);
    writer.write_static(ENTITY, &pinhole)
}

/// Writes the images. Returns true if there are any.
pub(super) fn write(writer: &Writer<'_>, film: &Film) -> Result<bool, RecordingError> {
    let Some((camera, key)) = &film.camera else { return Ok(false) };
    write_pinhole(writer, film, camera)?;
    let camera = RearCamera::new(*camera);
    let windows_entity = format!("{ENTITY}/windows");
    let fixed = Boxes2D::update_fields().with_radii([-1.5_f32]).with_show_labels(true);
    writer.write_static(&windows_entity, &fixed)?;
    let mut lists = FrameBuffers::default();
    let (mut images, mut marks) = (Vec::new(), Vec::new());
    for (frame, exposure) in frames_to_render(film, rear_exposures(key)) {
        let image;
        (image, lists) = render(film, &camera, frame, (exposure, lists));
        images.push((frame.time, image));
        marks.push((frame.time, windows(film, &camera, frame)));
    }
    let images: Vec<(Time, &dyn AsComponents)> = images.iter().map(|(time, image)| (*time, image as _)).collect();
    let marks: Vec<(Time, &dyn AsComponents)> = marks.iter().map(|(time, boxes)| (*time, boxes as _)).collect();
    writer.write_each(ENTITY, &images)?;
    writer.write_each(&windows_entity, &marks)?;
    Ok(!images.is_empty())
}

/// Returns the frames to render with the keys of their noise: for each selected instant, the latest frame with a scan.
fn frames_to_render(film: &Film, keys: impl Iterator<Item = ExposureKey>) -> Vec<(&Frame, ExposureKey)> {
    let critical = film.critical_moment();
    let instants =
        TIMES_BEFORE.iter().map(|&before| critical - before).chain(film.moments().iter().map(|noted| noted.time));
    let rows_with_scan: Vec<usize> = (0..film.frames.len()).filter(|&row| film.frames[row].scan.is_some()).collect();
    let latest = |time: Time| rows_with_scan.iter().rev().find(|&&row| film.frames[row].time <= time).copied();
    let mut selected: Vec<usize> = instants.filter_map(latest).chain(rows_with_scan.first().copied()).collect();
    selected.sort_unstable();
    let shown = latest(critical);
    let mut last: Option<Time> = None;
    selected.retain(|&row| {
        let time = film.frames[row].time;
        let is_kept = Some(row) == shown || last.is_none_or(|last| time - last >= LEAST_INTERVAL);
        last = if is_kept { Some(time) } else { last };
        is_kept
    });
    let frames = film.frames.iter().zip(keys).enumerate();
    frames.filter(|(row, _)| selected.binary_search(row).is_ok()).map(|(_, frame_and_key)| frame_and_key).collect()
}

/// Renders the image of a frame. The buffers `lists` are passed on to the next image.
fn render(
    film: &Film,
    camera: &RearCamera,
    frame: &Frame,
    (key, lists): (ExposureKey, FrameBuffers),
) -> (Image, FrameBuffers) {
    let (ego, others) = film.scene_vehicles(frame);
    let scene = film.scene(frame, ego, &others);
    let mut exposure = Exposure::with_buffers(lists, camera.camera(), &scene, key, &[PixelRect::IMAGE]);
    let picture = exposure.preview(PIXEL_STEP, PIXEL_ROWS);
    let image = Image::from_rgb24(picture.rgb, [picture.width, picture.height]);
    (image, exposure.into_buffers())
}

/// Returns the windows of the detections of a frame with their classes.
fn windows(film: &Film, camera: &RearCamera, frame: &Frame) -> Boxes2D {
    let (ego, _) = film.scene_vehicles(frame);
    let boxes = frame.scan.as_ref().map_or(&[][..], |scan| &scan.boxes);
    let in_image: Vec<(&Detection, PixelRect)> =
        boxes.iter().filter_map(|found| Some((found, camera.detection_window(&ego, found)?))).collect();
    // A window that reaches beyond the image is cut off: the viewer would make the image smaller until the window fits.
    let scale = 1.0 / f32::from(PIXEL_STEP);
    let size_px = [PixelRect::IMAGE.width as f32, f32::from(PIXEL_ROWS.end - PIXEL_ROWS.start)];
    let ends = |window: &PixelRect| {
        let start = [window.left as f32, window.top as f32 - f32::from(PIXEL_ROWS.start)];
        let extent = [window.width as f32, window.height as f32];
        [0, 1].map(|axis| [start[axis], start[axis] + extent[axis]].map(|end| scale * end.clamp(0.0, size_px[axis])))
    };
    let corner = |window: &PixelRect| ends(window).map(|[low, _]| low);
    let size = |window: &PixelRect| ends(window).map(|[low, high]| high - low);
    Boxes2D::from_mins_and_sizes(
        in_image.iter().map(|(_, window)| corner(window)),
        in_image.iter().map(|(_, window)| size(window)),
    )
    .with_colors(in_image.iter().map(|(found, _)| colour(found)))
    .with_labels(in_image.iter().map(|(found, _)| label(found)))
}

fn colour(found: &Detection) -> Rgba {
    match (found.class.vehicle() >= 0.5, found.class.best_vehicle_class()) {
        (false, _) => palette::QUIET,
        (true, VehicleClass::Car) => palette::TRACK,
        (true, VehicleClass::Truck) => palette::WARNING,
        (true, VehicleClass::Motorcycle) => palette::SAFE,
    }
}

/// Returns the most likely class with its score. What is no vehicle has no label, so that the image stays visible.
fn label(found: &Detection) -> String {
    if found.class.vehicle() < 0.5 {
        return String::new();
    }
    let [car, truck, motorcycle, background] = found.class.0;
    let all = [("car", car), ("truck", truck), ("motorcycle", motorcycle), ("background", background)];
    let best = all.iter().max_by(|a, b| a.1.total_cmp(&b.1));
    best.map_or(String::new(), |(name, score)| format!("{name} {score:.2}"))
}
