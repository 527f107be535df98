//! Images of the rear cameras with the results of their networks: the windows that the crop classifier
//! evaluates, or the instances of the Mask R-CNN.
//!
//! The closed loop never renders a whole camera image. This module renders it afterwards, from the
//! same scene and the same noise. It renders every fifth pixel or so ([`Shown`]), and only at
//! selected instants, since an image costs as much as a hundred control steps. An image and its
//! marks stay visible until the next image. Faults of the camera do not appear in the images.
//!
//! The instances are the ones that the network found in the loop, at the moment of the exposure. So
//! every image of the Mask R-CNN is one that the network evaluated.

use closecall_sensors::camera::{
    Camera, ExposureKey, Frame as Exposure, FrameBuffers, Pipeline, RearCamera, Resolution,
};
use closecall_sensors::rear_exposures;
use closecall_traffic::{Time, VehicleClass, maths};
use rerun::{AsComponents, Boxes2D, Image, Pinhole, Points2D, Transform3D};

use super::RecordingError;
use super::palette::{self, Rgba};
use super::stream::Writer;
use crate::run::film::{Film, Frame};

mod instances;
mod windows;

/// Number of columns that the shown picture has about, however many the image has.
const SHOWN_COLUMNS: u16 = 256;
/// Rendered rows above and below the middle of the usual image, from above the horizon down to the
/// road just behind the ego (px).
const ROWS_PX: [u32; 2] = [170, 210];
/// Times before the critical moment for which an image is rendered, besides the first scan and the
/// moments of the encounter.
const TIMES_BEFORE: [Time; 3] = [Time::from_ms(2_000), Time::from_ms(800), Time::ZERO];
/// Least time between an image and the one before it. The image of the critical moment is rendered
/// in any case.
const LEAST_INTERVAL: Time = Time::from_ms(2_500);

/// Entity of the first camera, which moves with the ego.
const ENTITY: &str = "world/ego/camera";
/// Distance at which the scene shows the image behind the camera (m). It is near, so the image
/// hides no vehicle.
const IMAGE_DISTANCE_M: f32 = 1.2;

/// The pictures of a camera in a recording.
#[derive(Clone, Debug)]
pub(super) struct Pictures {
    /// Title of their view.
    pub(super) title: String,
    /// The entity of the pictures.
    pub(super) entity: String,
    /// The size of the pictures (px).
    pub(super) size_px: [f64; 2],
}

/// The part of the image that a recording shows.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Shown {
    /// Size of the image.
    image: Resolution,
    /// Distance between two rendered pixels, in both directions (px).
    step_px: u16,
    /// Rendered rows of the image (px).
    rows_px: std::ops::Range<u16>,
}

impl Shown {
    /// Returns the part that is shown of images of this size.
    fn of(image: Resolution) -> Self {
        let Resolution { width_px, height_px } = image;
        let [above, below] = ROWS_PX.map(|rows| rows * u32::from(width_px) / u32::from(Resolution::USUAL.width_px));
        let middle = u32::from(height_px) / 2;
        let row = |at: u32| u16::try_from(at).map_or(height_px, |row| row.min(height_px));
        Self {
            image,
            step_px: (width_px + SHOWN_COLUMNS / 2) / SHOWN_COLUMNS,
            rows_px: row(middle.saturating_sub(above))..row(middle + below),
        }
    }
}

impl Shown {
    /// Returns the size of the picture: columns and rows (px).
    fn size_px(&self) -> [f64; 2] {
        let step_px = f64::from(self.step_px);
        [f64::from(self.image.width_px) / step_px, f64::from(self.rows_px.end - self.rows_px.start) / step_px]
    }
}

/// Writes position and projection of the camera, so that the scene shows its image where it is
/// taken. The pitch of the body is left out.
fn write_pinhole(writer: &Writer<'_>, film: &Film, entity: &str, camera: &Camera) -> Result<(), RecordingError> {
    let ahead_m = camera.mount_from_rear_m - 0.5 * film.actors[film.ego].vehicle.dimensions.length_m;
    let axes = axes(camera).map(|axis| axis.map(|value| value as f32));
    let position_m = [ahead_m as f32, camera.left_m as f32, camera.mount_height_m as f32];
    writer.write_static(entity, &Transform3D::from_translation_mat3x3(position_m, axes))?;
    let Shown { image, step_px, rows_px } = Shown::of(camera.resolution);
    let (step, first_row) = (f32::from(step_px), f32::from(rows_px.start));
    let rows = f32::from(rows_px.end) - first_row;
    let [width, height] = [image.width_px, image.height_px].map(f32::from);
    let focal = camera.focal_px as f32 / step;
    let pinhole = Pinhole::from_focal_length_and_resolution([focal, focal], [width / step, rows / step])
        .with_principal_point([0.5 * width / step, (0.5 * height - first_row) / step])
        .with_image_plane_distance(IMAGE_DISTANCE_M);
    writer.write_static(entity, &pinhole)
}

/// Returns the axes of the camera in the ego frame: right, down, and the optical axis, which points
/// backward along the road if the camera has neither yaw nor pitch.
fn axes(camera: &Camera) -> [[f64; 3]; 3] {
    let ((sin, cos), (sin_yaw, cos_yaw)) = (maths::sin_cos(camera.pitch_rad), maths::sin_cos(camera.yaw_rad));
    [
        [sin_yaw, cos_yaw, 0.0],
        // The difference from 0 is no negative zero.
        [sin * cos_yaw, 0.0 - sin * sin_yaw, -cos],
        [-cos * cos_yaw, cos * sin_yaw, -sin],
    ]
}

/// Writes the images of all cameras whose images a network gets. Returns the pictures of each
/// camera that has any.
pub(super) fn write(writer: &Writer<'_>, film: &Film) -> Result<Vec<Pictures>, RecordingError> {
    let mut written = Vec::new();
    for number in 0..film.cameras.len() {
        if film.cameras[number].0.pipeline != Pipeline::Off {
            written.extend(write_camera(writer, film, number)?);
        }
    }
    Ok(written)
}

/// Writes the images of the camera with this number in the scenario.
fn write_camera(writer: &Writer<'_>, film: &Film, number: usize) -> Result<Option<Pictures>, RecordingError> {
    let (camera, key) = &film.cameras[number];
    let (title, entity) = match number {
        0 => ("Rear camera".to_owned(), ENTITY.to_owned()),
        _ => (format!("Rear camera {}", camera.name), format!("{ENTITY}s/{}", camera.name)),
    };
    write_pinhole(writer, film, &entity, camera)?;
    let exposures = rear_exposures(key, (number, camera));
    let camera = RearCamera::new(*camera);
    let is_whole = camera.camera().pipeline == Pipeline::MaskRcnn;
    let part = Shown::of(camera.camera().resolution);
    let windows_entity = format!("{entity}/windows");
    let labels_entity = labels_entity(&entity);
    writer.write_static(&labels_entity, &fixed_labels())?;
    if is_whole {
        instances::write_fixed(writer, &entity)?;
    } else {
        writer.write_static(&windows_entity, &fixed_marks())?;
    }
    let mut lists = FrameBuffers::default();
    let (mut images, mut marks) = (Vec::new(), Vec::new());
    let keyed: Vec<(&Frame, ExposureKey)> = film.frames.iter().zip(exposures).collect();
    let shown = frames_to_show(film, camera.camera());
    for &row in &shown {
        let image;
        (image, lists) = render(film, &camera, keyed[shown_row(film, camera.camera(), row)], lists);
        images.push((film.frames[row].time, image));
    }
    let images: Vec<(Time, &dyn AsComponents)> = images.iter().map(|(time, image)| (*time, image as _)).collect();
    writer.write_each(&entity, &images)?;
    if is_whole {
        let taken = shown.iter().filter_map(|row| film.frames[*row].rear_image(camera.camera()));
        instances::write(writer, (&entity, &part), taken)?;
    } else {
        marks.extend(shown.iter().map(|row| {
            let frame = &film.frames[*row];
            (frame.time, windows::windows(film, number, frame))
        }));
        let boxes: Vec<(Time, &dyn AsComponents)> = marks.iter().map(|(time, marks)| (*time, &marks.0 as _)).collect();
        writer.write_each(&windows_entity, &boxes)?;
        let labels: Vec<(Time, &dyn AsComponents)> = marks.iter().map(|(time, marks)| (*time, &marks.1 as _)).collect();
        writer.write_each(&labels_entity, &labels)?;
    }
    Ok((!images.is_empty()).then(|| Pictures { title, entity, size_px: part.size_px() }))
}

/// Returns what all boxes in the image have in common. Their own labels would be broken at the
/// width of a narrow box, and leave the picture below a near vehicle.
fn fixed_marks() -> Boxes2D {
    Boxes2D::update_fields().with_radii([-1.5_f32]).with_show_labels(false)
}

/// Returns what the labels of all boxes have in common.
fn fixed_labels() -> Points2D {
    Points2D::update_fields().with_colors([palette::LABEL]).with_radii([0.05_f32]).with_show_labels(true)
}

/// Returns the labels of boxes in the strip above the picture, each over the middle of its box. An
/// empty label is left out.
fn labels_in_strip(boxes: &[([f32; 2], [f32; 2])], labels: &[String], width_px: f64) -> Points2D {
    let shown = || boxes.iter().zip(labels).filter(|(_, label)| !label.is_empty());
    Points2D::update_fields()
        .with_positions(shown().map(|(place, label)| [label_middle(place, label, width_px), -STRIP_PX as f32]))
        .with_labels(shown().map(|(_, label)| label.as_str()))
}

/// Returns the middle of the label of a box along the strip: it does not leave the picture.
fn label_middle(([left, _], [width, _]): &([f32; 2], [f32; 2]), label: &str, width_px: f64) -> f32 {
    let half = 0.5 * label_px(label);
    (left + 0.5 * width).min(width_px as f32 - half).max(half)
}

/// Returns the width of a label in the strip (px of the picture).
fn label_px(label: &str) -> f32 {
    LETTER_PX * label.chars().count() as f32 + BETWEEN_LABELS_PX
}

/// Returns the row of the frame that the image taken in a row shows: an earlier one if the camera
/// is frozen.
fn shown_row(film: &Film, camera: &Camera, row: usize) -> usize {
    let time = film.frames[row].rear_image(camera).map_or(film.frames[row].time, |image| image.shown_time);
    film.frames[..row].partition_point(|frame| frame.time < time)
}

/// Returns the rows of the frames whose images are shown: for each selected instant, the latest
/// frame with a scan or, if the network reads whole images, with an image.
fn frames_to_show(film: &Film, camera: &Camera) -> Vec<usize> {
    let is_whole = camera.pipeline == Pipeline::MaskRcnn;
    let critical = film.critical_moment();
    let instants =
        TIMES_BEFORE.iter().map(|&before| critical - before).chain(film.moments().iter().map(|noted| noted.time));
    let has_marks = |frame: &Frame| if is_whole { frame.rear_image(camera).is_some() } else { frame.scan.is_some() };
    let rows: Vec<usize> = (0..film.frames.len()).filter(|&row| has_marks(&film.frames[row])).collect();
    let latest = |time: Time| rows.iter().rev().find(|&&row| film.frames[row].time <= time).copied();
    let mut selected: Vec<usize> = instants.filter_map(latest).chain(rows.first().copied()).collect();
    selected.sort_unstable();
    selected.dedup();
    let shown = latest(critical);
    let mut last: Option<Time> = None;
    selected.retain(|&row| {
        let time = film.frames[row].time;
        let is_kept = Some(row) == shown || last.is_none_or(|last| time - last >= LEAST_INTERVAL);
        last = if is_kept { Some(time) } else { last };
        is_kept
    });
    selected
}

/// Renders the image of a frame. The buffers `lists` are passed on to the next image.
fn render(
    film: &Film,
    camera: &RearCamera,
    (frame, key): (&Frame, ExposureKey),
    lists: FrameBuffers,
) -> (Image, FrameBuffers) {
    let (ego, others) = film.scene_vehicles(frame);
    let scene = film.scene(frame, ego, &others);
    let Shown { image, step_px, rows_px } = Shown::of(camera.camera().resolution);
    let mut exposure = Exposure::with_buffers(lists, camera.camera(), &scene, key, &[image.image()]);
    let picture = exposure.preview(step_px, rows_px);
    let image = Image::from_rgb24(picture.rgb, [picture.width, picture.height]);
    (image, exposure.into_buffers())
}

/// Returns the least corner and the size in the shown picture of a box in the image: left, top,
/// right, bottom (px).
///
/// A box that reaches beyond the picture is cut off: the viewer would make the picture smaller
/// until the box fits.
fn in_picture(shown: &Shown, [left, top, right, bottom]: [f32; 4]) -> ([f32; 2], [f32; 2]) {
    let Shown { image, step_px, rows_px } = shown;
    let scale = 1.0 / f32::from(*step_px);
    let first_row = f32::from(rows_px.start);
    let size_px = [f32::from(image.width_px), f32::from(rows_px.end - rows_px.start)];
    let inside = |at: [f32; 2]| [0, 1].map(|axis| scale * at[axis].clamp(0.0, size_px[axis]));
    let (low, high) = (inside([left, top - first_row]), inside([right, bottom - first_row]));
    (low, [0, 1].map(|axis| high[axis] - low[axis]))
}

/// Returns the entity of the labels of the boxes in the images of a camera.
fn labels_entity(entity: &str) -> String {
    format!("{entity}/labels")
}

/// Height of the strip above the picture in which the labels of the boxes lie (px of the picture):
/// a label in a window of 1280 x 720 px. On the strip, which is black, labels are legible.
pub(super) const STRIP_PX: f64 = 16.0;
/// Width of a letter of a label, and of the box of a label with the room to the next one, there (px
/// of the picture).
const LETTER_PX: f32 = 3.4;
const BETWEEN_LABELS_PX: f32 = 10.0;

/// Clears each label that would lie on one of a larger box in the strip above a picture of this
/// width.
fn clear_covered(boxes: &[([f32; 2], [f32; 2])], labels: &mut [String], width_px: f64) {
    let area = |index: usize| boxes[index].1[0] * boxes[index].1[1];
    let mut order: Vec<usize> = (0..boxes.len().min(labels.len())).collect();
    order.sort_by(|&a, &b| area(b).total_cmp(&area(a)));
    let mut taken: Vec<[f32; 2]> = Vec::new();
    for index in order {
        let (middle, half) = (label_middle(&boxes[index], &labels[index], width_px), 0.5 * label_px(&labels[index]));
        let place = [middle - half, middle + half];
        let covers = |[left, right]: &[f32; 2]| place[0] < *right && *left < place[1];
        if labels[index].is_empty() || taken.iter().any(covers) {
            labels[index].clear();
        } else {
            taken.push(place);
        }
    }
}

/// Returns the colour of a detection that the camera takes for a vehicle of this class.
fn class_colour(class: VehicleClass) -> Rgba {
    match class {
        VehicleClass::Car => palette::TRACK,
        VehicleClass::Truck => palette::WARNING,
        VehicleClass::Motorcycle => palette::SAFE,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera(text: &str) -> Camera {
        use closecall_traffic::Check;
        let config: closecall_sensors::camera::CameraConfig = serde_json::from_str(text).unwrap();
        config.check(&closecall_traffic::Parameters::default()).unwrap()
    }

    #[test]
    fn the_axes_of_the_usual_camera_look_back_and_down() {
        let (sin, cos) = maths::sin_cos(0.03);
        let usual = [[0.0, 1.0, 0.0], [sin, 0.0, -cos], [-cos, 0.0, -sin]];
        let bits = |axes: [[f64; 3]; 3]| axes.map(|axis| axis.map(f64::to_bits));
        assert_eq!(bits(axes(&camera("{}"))), bits(usual));
    }

    #[test]
    fn a_camera_turned_to_the_left_has_right_handed_axes_that_look_to_the_left() {
        for (yaw_deg, side) in [(30, 0.5), (-30, -0.5)] {
            let text = format!(r#"{{ "pitch-rad": 0.1, "yaw-deg": {yaw_deg} }}"#);
            let [right, down, axis] = axes(&camera(&text));
            assert!((axis[1] / maths::cos(0.1) - side).abs() < 1e-12 && axis[0] < 0.0 && axis[2] < 0.0, "{axis:?}");
            let cross = |a: [f64; 3], b: [f64; 3]| {
                [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
            };
            for (got, wanted) in cross(right, down).iter().zip(axis) {
                assert!((got - wanted).abs() < 1e-12, "{text}");
            }
        }
    }

    #[test]
    fn the_usual_image_is_shown_by_every_fifth_pixel() {
        let usual = Shown::of(Resolution::USUAL);
        assert_eq!((usual.step_px, usual.rows_px), (5, 230..610));
    }

    #[test]
    fn a_box_lies_at_the_same_place_of_the_picture_whatever_the_size_of_the_image() {
        let fine = Shown::of(Resolution { width_px: 2_560, height_px: 1_600 });
        let place = in_picture(&Shown::of(Resolution::USUAL), [600.0, 400.0, 700.0, 480.0]);
        assert_eq!(in_picture(&fine, [1_200.0, 800.0, 1_400.0, 960.0]), place);
    }

    #[test]
    fn an_image_with_few_rows_is_shown_whole() {
        for (width_px, height_px) in [(640, 480), (3_848, 480), (3_848, 2_168), (641, 2_168)] {
            let Shown { step_px, rows_px, .. } = Shown::of(Resolution { width_px, height_px });
            let columns = width_px / step_px;
            assert!((200..300).contains(&columns), "{columns} columns of {width_px}");
            assert!(rows_px.start < height_px / 2 && height_px / 2 < rows_px.end && rows_px.end <= height_px);
        }
        assert_eq!(Shown::of(Resolution { width_px: 3_848, height_px: 480 }).rows_px, 0..480);
    }

    #[test]
    fn the_label_of_a_box_at_the_edge_stays_above_the_picture() {
        let label = "motorcycle 0.83";
        for left in [-3.0, 0.0, 100.0, 250.0] {
            let middle = label_middle(&([left, 40.0], [6.0, 36.0]), label, 256.0);
            assert!(middle - 0.5 * label_px(label) >= 0.0 && middle + 0.5 * label_px(label) <= 256.0, "{middle}");
        }
        assert!((label_middle(&([100.0, 40.0], [6.0, 36.0]), label, 256.0) - 103.0).abs() < 1e-6, "above its box");
    }

    #[test]
    fn no_label_lies_on_that_of_a_larger_box() {
        let boxes = [([100.0, 10.0], [8.0, 20.0]), ([98.0, 10.0], [30.0, 22.0]), ([200.0, 10.0], [8.0, 8.0])];
        let mut labels = ["motorcycle 0.83", "car 1.00", "truck 0.70"].map(str::to_owned);
        clear_covered(&boxes, &mut labels, 256.0);
        assert_eq!(labels, ["", "car 1.00", "truck 0.70"]);
    }
}
