//! Perception held against the truth: vehicles behind E that it knows of, those that it misses, and tracks of nothing.
//!
//! A vehicle is known where a confirmed rear track's near face lies within [`MATCH_M`] of its own. It is missed where it
//! is in the rear sensor's field of view all the same; what is hidden behind another counts as missed too.

use closecall_sensors::FieldOfView;
use closecall_traffic::{Source, Time, Track, TrackStatus};
use rerun::{Boxes3D, FillMode, Quaternion};

use super::RecordError;
use super::palette::{self, Rgba};
use super::stream::Writer;
use super::vehicles::yaw_rotation;
use crate::run::film::{Film, Frame};

/// Distance of the near faces up to which a track belongs to a vehicle [m], as the audit of tracking has it.
const MATCH_M: f64 = 3.0;
/// Boxes of the truth are this much larger than the vehicle, so that they are seen around it [m].
const CLEARANCE_M: f64 = 0.05;
/// Boxes of false tracks have no height of their own [m].
const FALSE_HEIGHT_M: f64 = 1.5;

/// A box in E's frame.
#[derive(Clone, Copy)]
struct Shape {
    centre_m: [f32; 3],
    half_m: [f32; 3],
    turn: Quaternion,
}

/// What is right and wrong in one frame.
#[derive(Default)]
struct Verdict {
    known: Vec<Shape>,
    missed: Vec<Shape>,
    false_tracks: Vec<Shape>,
}

/// A layer: its name, its colour, and which of the shapes are in it.
type Layer = (&'static str, Rgba, fn(&Verdict) -> &Vec<Shape>);

/// Writes the layers; names those that are there for whoever wants them.
pub(super) fn write(writer: &Writer<'_>, film: &Film) -> Result<Vec<String>, RecordError> {
    if film.frames.iter().all(|frame| frame.tracks.is_empty() && frame.rear_field.is_none()) {
        return Ok(Vec::new());
    }
    let times = film.times();
    let verdicts: Vec<Verdict> = film.frames.iter().map(|frame| judge(film, frame)).collect();
    let layers: [Layer; 3] = [
        ("known", palette::TRUTH, |verdict| &verdict.known),
        ("missed", palette::MISSED, |verdict| &verdict.missed),
        ("false_tracks", palette::FALSE_TRACK, |verdict| &verdict.false_tracks),
    ];
    for (name, colour, of) in layers {
        let shapes: Vec<&Vec<Shape>> = verdicts.iter().map(of).collect();
        write_layer(writer, (&format!("world/ego/truth/{name}"), colour), &times, &shapes)?;
    }
    Ok(vec!["world/ego/truth/known".to_owned()])
}

fn write_layer(
    writer: &Writer<'_>,
    (entity, colour): (&str, Rgba),
    times: &[Time],
    shapes: &[&Vec<Shape>],
) -> Result<(), RecordError> {
    let fixed =
        Boxes3D::update_fields().with_fill_mode(FillMode::MajorWireframe).with_radii([0.05_f32]).with_colors([colour]);
    writer.write_static(entity, &fixed)?;
    // Only frames in which there is something, and the first after them: the rest stays as it is.
    let rows: Vec<usize> =
        (0..shapes.len()).filter(|&row| row == 0 || !shapes[row].is_empty() || !shapes[row - 1].is_empty()).collect();
    let times: Vec<Time> = rows.iter().map(|&row| times[row]).collect();
    writer.write_rows(entity, &times, |range| {
        let rows = &rows[range];
        let all = || rows.iter().flat_map(|&row| shapes[row]);
        Boxes3D::update_fields()
            .with_centers(all().map(|shape| shape.centre_m))
            .with_half_sizes(all().map(|shape| shape.half_m))
            .with_quaternions(all().map(|shape| shape.turn))
            .columns(rows.iter().map(|&row| shapes[row].len()).collect::<Vec<_>>())
    })
}

fn judge(film: &Film, frame: &Frame) -> Verdict {
    let mut verdict = Verdict::default();
    let confirmed = |track: &&Track| track.source == Source::Rear && track.status != TrackStatus::Tentative;
    let tracks: Vec<&Track> = frame.tracks.iter().filter(confirmed).collect();
    let others = (0..film.actors.len()).filter(|&actor| actor != film.ego);
    let poses: Vec<(usize, [f64; 3])> = others.map(|actor| (actor, film.in_ego_frame(frame, actor))).collect();
    let bumper_m = -0.5 * film.actors[film.ego].vehicle.dimensions.length_m;
    let length_m = |actor: usize| film.actors[actor].vehicle.dimensions.length_m;
    for &(actor, pose) in &poses {
        let face = face_m(pose, length_m(actor));
        if face[0] > bumper_m || !frame.rear_field.is_none_or(|field| sees(&field, bumper_m, face)) {
            continue;
        }
        let is_known = tracks.iter().any(|track| near(face, track_face_m(track)));
        let shape = truth(film, actor, pose);
        if is_known { verdict.known.push(shape) } else { verdict.missed.push(shape) }
    }
    for track in tracks.iter().filter(|track| track.class.vehicle() > 0.5) {
        let of_any = |&(actor, pose): &(usize, [f64; 3])| near(face_m(pose, length_m(actor)), track_face_m(track));
        if !poses.iter().any(of_any) {
            verdict.false_tracks.push(claimed(track));
        }
    }
    verdict
}

fn truth(film: &Film, actor: usize, [x_m, y_m, yaw_rad]: [f64; 3]) -> Shape {
    let size = &film.actors[actor].vehicle.dimensions;
    let half = |extent_m: f64| (0.5 * extent_m + CLEARANCE_M) as f32;
    Shape {
        centre_m: [x_m as f32, y_m as f32, 0.5 * size.height_m as f32],
        half_m: [half(size.length_m), half(size.width_m), half(size.height_m)],
        turn: yaw_rotation(yaw_rad),
    }
}

fn claimed(track: &Track) -> Shape {
    let half = |extent_m: f64| (0.5 * extent_m) as f32;
    Shape {
        centre_m: [track.x_m() as f32, track.y_m() as f32, half(FALSE_HEIGHT_M)],
        half_m: [half(track.length_m), half(track.width_m), half(FALSE_HEIGHT_M)],
        turn: yaw_rotation(track.heading_rad),
    }
}

/// The middle of the face of a box that is nearest to E [m].
fn face_m([x_m, y_m, yaw_rad]: [f64; 3], length_m: f64) -> [f64; 2] {
    let ahead_m = if x_m < 0.0 { 0.5 * length_m } else { -0.5 * length_m };
    let (sin, cos) = yaw_rad.sin_cos();
    [x_m + ahead_m * cos, y_m + ahead_m * sin]
}

fn track_face_m(track: &Track) -> [f64; 2] {
    face_m([track.x_m(), track.y_m(), track.heading_rad], track.length_m)
}

fn near(one: [f64; 2], other: [f64; 2]) -> bool {
    (one[0] - other[0]).hypot(one[1] - other[1]) <= MATCH_M
}

fn sees(field: &FieldOfView, bumper_m: f64, [x_m, y_m]: [f64; 2]) -> bool {
    let back_m = bumper_m - x_m;
    back_m.hypot(y_m) <= field.range_m && y_m.abs() <= field.half_angle_tan * back_m
}
