//! What the rear camera saw, with the windows that the network looked at, and what it took them for.
//!
//! In the loop the camera's image is never drawn as a whole. Here it is drawn again, from the same scene and the same
//! noise: every [`STEP`]-th pixel, at the instants that matter, since a picture costs as much as a hundred control steps.
//! It stands, with its windows, until the next.

use closecall_sensors::camera::{ExposureKey, Frame as Exposure, Lists, PixelRect, RearCamera};
use closecall_sensors::{Detection, rear_exposures};
use closecall_traffic::{Time, VehicleClass};
use rerun::{Boxes2D, Image};

use super::RecordError;
use super::palette::{self, Rgba};
use super::stream::Writer;
use crate::run::film::{Film, Frame};

/// One pixel in so many is drawn, in both directions.
const STEP: u16 = 5;
/// Rows of the image that are drawn: from above the horizon down to the road just behind E.
const ROWS: std::ops::Range<u16> = 230..610;
/// Images are drawn so long before the critical moment, beside the first scan and those at the moments (a) to (e).
const BEFORE: [Time; 3] = [Time::from_ms(2_000), Time::from_ms(800), Time::ZERO];

/// Writes the images; true where there are any.
pub(super) fn write(writer: &Writer<'_>, film: &Film) -> Result<bool, RecordError> {
    let Some((camera, key)) = &film.camera else { return Ok(false) };
    let camera = RearCamera::new(*camera);
    let fixed = Boxes2D::update_fields().with_radii([-1.5_f32]).with_show_labels(true);
    writer.write_static("camera/windows", &fixed)?;
    let mut lists = Lists::default();
    let mut drawn = false;
    for (frame, exposure) in chosen(film, rear_exposures(key)) {
        let image;
        (image, lists) = draw(film, &camera, frame, (exposure, lists));
        writer.write_from("camera", frame.time, &image)?;
        write_windows(writer, film, &camera, frame)?;
        drawn = true;
    }
    Ok(drawn)
}

/// The frames to draw, each with the key of its noise: at every instant that matters the latest one with a scan.
fn chosen(film: &Film, keys: impl Iterator<Item = ExposureKey>) -> Vec<(&Frame, ExposureKey)> {
    let critical = film.critical_moment();
    let instants = BEFORE.iter().map(|&before| critical - before).chain(film.moments().iter().map(|noted| noted.time));
    let scanned: Vec<usize> = (0..film.frames.len()).filter(|&row| film.frames[row].scan.is_some()).collect();
    let latest = |time: Time| scanned.iter().rev().find(|&&row| film.frames[row].time <= time).copied();
    let mut wanted: Vec<usize> = instants.filter_map(latest).chain(scanned.first().copied()).collect();
    wanted.sort_unstable();
    let frames = film.frames.iter().zip(keys).enumerate();
    frames.filter(|(row, _)| wanted.binary_search(row).is_ok()).map(|(_, chosen)| chosen).collect()
}

fn draw(film: &Film, camera: &RearCamera, frame: &Frame, (key, lists): (ExposureKey, Lists)) -> (Image, Lists) {
    let (ego, others) = film.scene_vehicles(frame);
    let scene = film.scene(frame, ego, &others);
    let mut exposure = Exposure::reusing(lists, camera.camera(), &scene, key, &[PixelRect::IMAGE]);
    let picture = exposure.preview(STEP, ROWS);
    let image = Image::from_rgb24(picture.rgb, [picture.width, picture.height]);
    (image, exposure.into_lists())
}

fn write_windows(writer: &Writer<'_>, film: &Film, camera: &RearCamera, frame: &Frame) -> Result<(), RecordError> {
    let (ego, _) = film.scene_vehicles(frame);
    let boxes = frame.scan.as_ref().map_or(&[][..], |scan| &scan.boxes);
    let seen: Vec<(&Detection, PixelRect)> =
        boxes.iter().filter_map(|found| Some((found, camera.window_of(&ego, found)?))).collect();
    let scale = 1.0 / f32::from(STEP);
    let corner = |window: &PixelRect| [window.left as f32 * scale, (window.top as f32 - f32::from(ROWS.start)) * scale];
    let size = |window: &PixelRect| [window.width as f32 * scale, window.height as f32 * scale];
    let windows = Boxes2D::from_mins_and_sizes(
        seen.iter().map(|(_, window)| corner(window)),
        seen.iter().map(|(_, window)| size(window)),
    )
    .with_colors(seen.iter().map(|(found, _)| colour(found)))
    .with_labels(seen.iter().map(|(found, _)| label(found)));
    writer.write_from("camera/windows", frame.time, &windows)
}

fn colour(found: &Detection) -> Rgba {
    match (found.class.vehicle() >= 0.5, found.class.best_vehicle_class()) {
        (false, _) => palette::QUIET,
        (true, VehicleClass::Car) => palette::TRACK,
        (true, VehicleClass::Truck) => palette::WARNING,
        (true, VehicleClass::Motorcycle) => palette::SAFE,
    }
}

/// The likeliest class with its score.
fn label(found: &Detection) -> String {
    let [car, truck, motorcycle, background] = found.class.0;
    let all = [("car", car), ("truck", truck), ("motorcycle", motorcycle), ("background", background)];
    let best = all.iter().max_by(|a, b| a.1.total_cmp(&b.1));
    best.map_or(String::new(), |(name, score)| format!("{name} {score:.2}"))
}
