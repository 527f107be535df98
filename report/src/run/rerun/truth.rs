//! Compares perception with the ground truth behind the ego: known vehicles, missed vehicles, and
//! false tracks.
//!
//! A vehicle in the field of view of the rear sensor counts as known if the near face of a
//! confirmed rear track lies within [`MATCH_DISTANCE_M`] of its own near face. Otherwise it counts
//! as missed, even if another vehicle hides it.
//!
//! A false track is a confirmed track to which no vehicle belongs. For the front sensor and the
//! side sensors, a vehicle beside the ego has no near face, so its box decides.

use closecall_sensors::FieldOfView;
use closecall_traffic::{Source, Time, Track, TrackStatus, maths};
use rerun::{Boxes3D, FillMode, Quaternion};

use super::RecordingError;
use super::palette::{self, Rgba};
use super::stream::Writer;
use super::vehicles::yaw_rotation;
use crate::run::film::{Film, Frame};

/// Largest distance of the near faces of a track and of its vehicle (m); the same as in the audit
/// of the tracking.
const MATCH_DISTANCE_M: f64 = 3.0;
/// Distance of the faces of a ground-truth box from the faces of the vehicle (m): the box is
/// visible around it.
const CLEARANCE_M: f64 = 0.05;
/// Height of the boxes of false tracks (m), since tracks have no height.
const FALSE_HEIGHT_M: f64 = 1.5;

/// The label of a track to which no vehicle belongs.
pub(super) const NO_VEHICLE: &str = "does not exist";

/// A box in the ego frame.
#[derive(Clone, Copy)]
struct Shape {
    centre_m: [f32; 3],
    half_m: [f32; 3],
    rotation: Quaternion,
}

/// The comparison for one frame.
#[derive(Default)]
struct FrameComparison {
    detected: Vec<Shape>,
    missed: Vec<Shape>,
    false_tracks: Vec<Shape>,
}

/// A layer: its name, its colour, and the function that selects its shapes.
type Layer = (&'static str, Rgba, fn(&FrameComparison) -> &Vec<Shape>);

/// Writes the layers, and returns the entities that the scene hides until the user switches them
/// on.
pub(super) fn write(writer: &Writer<'_>, film: &Film) -> Result<Vec<String>, RecordingError> {
    if film.frames.iter().all(|frame| frame.tracks.is_empty() && frame.rear_fields.is_empty()) {
        return Ok(Vec::new());
    }
    let times = film.times();
    let comparisons: Vec<FrameComparison> = film.frames.iter().map(|frame| compare(film, frame)).collect();
    let layers: [Layer; 3] = [
        ("known", palette::TRUTH, |comparison| &comparison.detected),
        ("missed", palette::MISSED, |comparison| &comparison.missed),
        ("false_tracks", palette::FALSE_TRACK, |comparison| &comparison.false_tracks),
    ];
    for (name, colour, shapes_of) in layers {
        let shapes: Vec<&Vec<Shape>> = comparisons.iter().map(shapes_of).collect();
        let label = (name == "false_tracks").then_some(NO_VEHICLE);
        write_layer(writer, &format!("world/ego/truth/{name}"), colour, label, &times, &shapes)?;
    }
    Ok(vec!["world/ego/truth/known".to_owned()])
}

fn write_layer(
    writer: &Writer<'_>,
    entity: &str,
    colour: Rgba,
    label: Option<&str>,
    times: &[Time],
    shapes: &[&Vec<Shape>],
) -> Result<(), RecordingError> {
    let fixed =
        Boxes3D::update_fields().with_fill_mode(FillMode::MajorWireframe).with_radii([0.05_f32]).with_colors([colour]);
    // One label stands for every box.
    match label {
        Some(label) => writer.write_static(entity, &fixed.with_labels([label]).with_show_labels(false))?,
        None => writer.write_static(entity, &fixed)?,
    }
    // Rows are written for the frames with shapes and for the frame after them, which clears the
    // shapes.
    let rows: Vec<usize> =
        (0..shapes.len()).filter(|&row| row == 0 || !shapes[row].is_empty() || !shapes[row - 1].is_empty()).collect();
    let times: Vec<Time> = rows.iter().map(|&row| times[row]).collect();
    writer.write_rows(entity, &times, |range| {
        let rows = &rows[range];
        let all = || rows.iter().flat_map(|&row| shapes[row]);
        Boxes3D::update_fields()
            .with_centers(all().map(|shape| shape.centre_m))
            .with_half_sizes(all().map(|shape| shape.half_m))
            .with_quaternions(all().map(|shape| shape.rotation))
            .columns(rows.iter().map(|&row| shapes[row].len()).collect::<Vec<_>>())
    })
}

/// Compares the tracks of a frame with the vehicles.
fn compare(film: &Film, frame: &Frame) -> FrameComparison {
    let mut comparison = FrameComparison::default();
    let confirmed = |track: &&Track| track.source == Source::Rear && track.status != TrackStatus::Tentative;
    let tracks: Vec<&Track> = frame.tracks.iter().filter(confirmed).collect();
    let others = (0..film.actors.len()).filter(|&actor| actor != film.ego);
    let poses: Vec<(usize, [f64; 3])> = others.map(|actor| (actor, film.in_ego_frame(frame, actor))).collect();
    let bumper_m = -0.5 * film.actors[film.ego].vehicle.dimensions.length_m;
    let length_m = |actor: usize| film.actors[actor].vehicle.dimensions.length_m;
    for &(actor, pose) in &poses {
        let face = face_m(pose, length_m(actor));
        if face[0] > bumper_m || !is_in_a_field(&frame.rear_fields, bumper_m, face) {
            continue;
        }
        let is_known = tracks.iter().any(|track| are_close(face, track_face_m(track)));
        let shape = true_shape(film, actor, pose);
        if is_known { comparison.detected.push(shape) } else { comparison.missed.push(shape) }
    }
    let of_rear = tracks.iter().copied().filter(|track| track.class.vehicle() > 0.5);
    let false_of_rear = of_rear.filter(|track| !belongs_to_a_vehicle(film, frame, track));
    let of_others = frame.tracks.iter().filter(|track| is_false_track_of_other_sensors(film, frame, track));
    comparison.false_tracks = false_of_rear.chain(of_others).map(track_shape).collect();
    comparison
}

/// Returns true if the front sensor or a side sensor reports a vehicle where none is. After a
/// collision the perception of the ego rests, and its tracks say nothing.
pub(super) fn is_false_track_of_other_sensors(film: &Film, frame: &Frame, track: &Track) -> bool {
    let is_reported = track.source != Source::Rear && track.status == TrackStatus::Confirmed;
    let has_collided = film.worst_collision().is_some_and(|collision| frame.time >= collision.time);
    is_reported && track.class.vehicle() > 0.5 && !has_collided && !belongs_to_a_vehicle(film, frame, track)
}

/// Returns true if any vehicle is where the track is.
pub(super) fn belongs_to_a_vehicle(film: &Film, frame: &Frame, track: &Track) -> bool {
    let is_there = |actor: usize| {
        let (pose, size) = (film.in_ego_frame(frame, actor), &film.actors[actor].vehicle.dimensions);
        match track.source {
            Source::Rear => are_close(face_m(pose, size.length_m), track_face_m(track)),
            Source::Front | Source::Surround => is_near_box(pose, [size.length_m, size.width_m], track),
        }
    };
    (0..film.actors.len()).any(|actor| actor != film.ego && is_there(actor))
}

/// Returns true if the centre of a track is in the box of a vehicle (length and width in m), or
/// close to it.
fn is_near_box([x_m, y_m, yaw_rad]: [f64; 3], size_m: [f64; 2], track: &Track) -> bool {
    let (dx_m, dy_m) = (track.x_m() - x_m, track.y_m() - y_m);
    let (sin, cos) = maths::sin_cos(yaw_rad);
    let from_centre_m = [cos * dx_m + sin * dy_m, cos * dy_m - sin * dx_m];
    (0..2).all(|axis| from_centre_m[axis].abs() <= 0.5 * size_m[axis] + MATCH_DISTANCE_M)
}

/// Returns the box of a vehicle.
fn true_shape(film: &Film, actor: usize, [x_m, y_m, yaw_rad]: [f64; 3]) -> Shape {
    let size = &film.actors[actor].vehicle.dimensions;
    let half = |extent_m: f64| (0.5 * extent_m + CLEARANCE_M) as f32;
    Shape {
        centre_m: [x_m as f32, y_m as f32, 0.5 * size.height_m as f32],
        half_m: [half(size.length_m), half(size.width_m), half(size.height_m)],
        rotation: yaw_rotation(yaw_rad),
    }
}

/// Returns the box of a track.
fn track_shape(track: &Track) -> Shape {
    let half = |extent_m: f64| (0.5 * extent_m) as f32;
    Shape {
        centre_m: [track.x_m() as f32, track.y_m() as f32, half(FALSE_HEIGHT_M)],
        half_m: [half(track.length_m), half(track.width_m), half(FALSE_HEIGHT_M)],
        rotation: yaw_rotation(track.heading_rad),
    }
}

/// Returns the centre of the face of a box that is nearest to the ego (m).
fn face_m([x_m, y_m, yaw_rad]: [f64; 3], length_m: f64) -> [f64; 2] {
    let ahead_m = if x_m < 0.0 { 0.5 * length_m } else { -0.5 * length_m };
    let (sin, cos) = maths::sin_cos(yaw_rad);
    [x_m + ahead_m * cos, y_m + ahead_m * sin]
}

/// Returns the centre of the near face of a track (m).
fn track_face_m(track: &Track) -> [f64; 2] {
    face_m([track.x_m(), track.y_m(), track.heading_rad], track.length_m)
}

/// Returns true if two faces are close enough for a track to belong to a vehicle.
fn are_close(first: [f64; 2], second: [f64; 2]) -> bool {
    maths::hypot(first[0] - second[0], first[1] - second[1]) <= MATCH_DISTANCE_M
}

/// Returns true if a point in the ego frame lies in one of the fields of view, or if their limits
/// are not simulated.
fn is_in_a_field(fields: &[FieldOfView], bumper_m: f64, [x_m, y_m]: [f64; 2]) -> bool {
    fields.is_empty() || fields.iter().any(|field| field.contains(bumper_m - x_m, y_m))
}
