//! What E perceives, in its own frame: where its rear sensor looks, and tracks as boxes with their uncertainty, apart
//! for each group of sensors so that each can be switched off in the viewer.

use closecall_sensors::FieldOfView;
use closecall_traffic::{Source, Time, Track, TrackStatus};
use nalgebra::{Matrix2, SymmetricEigen};
use rerun::{Boxes3D, Ellipsoids3D, FillMode, LineStrips3D, Quaternion};

use super::RecordError;
use super::palette::{self, Rgba};
use super::stream::{Writer, changes};
use super::vehicles::yaw_rotation;
use crate::run::film::Film;

/// Height that boxes of tracks are drawn with, since tracks have none [m].
const TRACK_HEIGHT_M: f64 = 1.7;
/// Boxes are drawn this much larger than the track says, so that they stay visible around the vehicle [m].
const CLEARANCE_M: f64 = 0.15;
/// Ellipses hold about 95 % of the probability: √χ²₂(0.95).
const ELLIPSE_SIGMAS: f64 = 2.448;
const ELLIPSE_Z_M: f64 = 0.08;
const ELLIPSE_HALF_THICKNESS_M: f64 = 0.01;
/// The field of view is drawn at this height, its arc in this many pieces.
const FIELD_Z_M: f64 = 0.2;
const ARC_PIECES: u32 = 48;

/// How far ahead paths are predicted [s]: for as long as the margin increase system lets E hold on.
const PREDICTED_S: f64 = 2.0;
/// Height at which paths are drawn [m].
const PATH_Z_M: f32 = 0.12;

const SOURCES: [(Source, &str); 3] = [(Source::Front, "front"), (Source::Surround, "surround"), (Source::Rear, "rear")];

pub(super) fn write(writer: &Writer<'_>, film: &Film) -> Result<(), RecordError> {
    let times = film.times();
    write_rear_field(writer, film, &times)?;
    for (source, name) in SOURCES {
        let of_source = |tracks: &'_ [Track]| -> Vec<Track> {
            tracks.iter().filter(|track| track.source == source).cloned().collect()
        };
        let tracks: Vec<Vec<Track>> = film.frames.iter().map(|frame| of_source(&frame.tracks)).collect();
        if tracks.iter().all(Vec::is_empty) {
            continue;
        }
        write_boxes(writer, &format!("world/ego/tracks/{name}/boxes"), &times, &tracks)?;
        write_ellipses(writer, &format!("world/ego/tracks/{name}/covariance"), &times, &tracks)?;
        write_predictions(writer, &format!("world/ego/tracks/{name}/predicted"), &times, &tracks)?;
    }
    write_own_path(writer, film, &times)
}

/// Where confirmed tracks will be, each at its present velocity.
fn write_predictions(
    writer: &Writer<'_>,
    entity: &str,
    times: &[Time],
    tracks: &[Vec<Track>],
) -> Result<(), RecordError> {
    writer.write_static(entity, &LineStrips3D::update_fields().with_radii([0.05_f32]))?;
    let is_shown = |track: &&Track| track.status != TrackStatus::Tentative && track.class.vehicle() >= 0.5;
    writer.write_rows(entity, times, |range| {
        let rows = &tracks[range];
        let all = || rows.iter().flatten().filter(is_shown);
        let path = |track: &Track| {
            let ahead = |of: f64, speed_mps: f64| (of + PREDICTED_S * speed_mps) as f32;
            let (x, y) = (track.x_m(), track.y_m());
            [[x as f32, y as f32, PATH_Z_M], [ahead(x, track.vx_mps()), ahead(y, track.vy_mps()), PATH_Z_M]]
        };
        LineStrips3D::new(all().map(path))
            .with_colors(all().map(|track| palette::with_opacity(colour(track), 150)))
            .columns(rows.iter().map(|row| row.iter().filter(is_shown).count()).collect::<Vec<_>>())
    })
}

/// Where E will be at the acceleration that its controller asks for.
fn write_own_path(writer: &Writer<'_>, film: &Film, times: &[Time]) -> Result<(), RecordError> {
    if film.frames.iter().any(|frame| frame.command.is_none()) {
        return Ok(());
    }
    let entity = "world/ego/predicted";
    let fixed = LineStrips3D::update_fields().with_colors([palette::with_opacity(palette::EGO, 200)]).with_radii([0.07_f32]);
    writer.write_static(entity, &fixed)?;
    writer.write_rows(entity, times, |range| {
        let ends = film.frames[range.clone()].iter().map(|frame| {
            let asked_mps2 = frame.command.map_or(0.0, |command| command.acceleration_mps2);
            let way_m = way_m(frame.states[film.ego].speed_mps, asked_mps2);
            [[0.0, 0.0, PATH_Z_M], [way_m as f32, 0.0, PATH_Z_M]]
        });
        LineStrips3D::new(ends).columns_of_unit_batches()
    })
}

/// The way until the end of the prediction, or until a stand [m].
fn way_m(speed_mps: f64, acceleration_mps2: f64) -> f64 {
    let until_stand_s = if acceleration_mps2 < 0.0 { -speed_mps / acceleration_mps2 } else { f64::INFINITY };
    let lasts_s = PREDICTED_S.min(until_stand_s);
    speed_mps * lasts_s + 0.5 * acceleration_mps2 * lasts_s * lasts_s
}

/// The edge of what the rear sensor sees, from the rear bumper on.
fn write_rear_field(writer: &Writer<'_>, film: &Film, times: &[Time]) -> Result<(), RecordError> {
    let fields: Vec<Option<FieldOfView>> = film.frames.iter().map(|frame| frame.rear_field).collect();
    if fields.iter().all(Option::is_none) {
        return Ok(());
    }
    let bumper_m = -0.5 * film.actors[film.ego].vehicle.dimensions.length_m;
    let entity = "world/ego/rear_field_of_view";
    let fixed = LineStrips3D::update_fields().with_colors([palette::FIELD_OF_VIEW]).with_radii([0.05_f32]);
    writer.write_static(entity, &fixed)?;
    let rows = changes(&fields);
    let times: Vec<Time> = rows.iter().map(|&row| times[row]).collect();
    writer.write_rows(entity, &times, |range| {
        let shown: Vec<Option<FieldOfView>> = rows[range].iter().map(|&row| fields[row]).collect();
        let edges = shown.iter().flatten().map(|field| edge(field, bumper_m));
        LineStrips3D::new(edges).columns(shown.iter().map(|field| usize::from(field.is_some())).collect::<Vec<_>>())
    })
}

/// From the sensor along one side, round the arc, and back.
fn edge(field: &FieldOfView, bumper_m: f64) -> Vec<[f32; 3]> {
    let half_rad = field.half_angle_tan.atan();
    let sensor = [bumper_m as f32, 0.0, FIELD_Z_M as f32];
    let arc = (0..=ARC_PIECES).map(|piece| {
        let angle_rad = half_rad * (2.0 * f64::from(piece) / f64::from(ARC_PIECES) - 1.0);
        let (sin, cos) = angle_rad.sin_cos();
        [(bumper_m - field.range_m * cos) as f32, (field.range_m * sin) as f32, FIELD_Z_M as f32]
    });
    [sensor].into_iter().chain(arc).chain([sensor]).collect()
}

fn write_boxes(writer: &Writer<'_>, entity: &str, times: &[Time], tracks: &[Vec<Track>]) -> Result<(), RecordError> {
    // Labels are shown where the pointer is: all at once they would hide the scene.
    let fixed = Boxes3D::update_fields()
        .with_fill_mode(FillMode::MajorWireframe)
        .with_radii([0.035_f32])
        .with_show_labels(false);
    writer.write_static(entity, &fixed)?;
    writer.write_rows(entity, times, |range| {
        let rows = &tracks[range];
        let all = || rows.iter().flatten();
        let half = |length_m: f64| (0.5 * length_m + CLEARANCE_M) as f32;
        Boxes3D::update_fields()
            .with_centers(all().map(|track| [track.x_m() as f32, track.y_m() as f32, half(TRACK_HEIGHT_M)]))
            .with_half_sizes(all().map(|track| [half(track.length_m), half(track.width_m), half(TRACK_HEIGHT_M)]))
            .with_quaternions(all().map(|track| yaw_rotation(track.heading_rad)))
            .with_colors(all().map(colour))
            .with_labels(all().map(label))
            .columns(rows.iter().map(Vec::len).collect::<Vec<_>>())
    })
}

fn write_ellipses(writer: &Writer<'_>, entity: &str, times: &[Time], tracks: &[Vec<Track>]) -> Result<(), RecordError> {
    let fixed = Ellipsoids3D::update_fields().with_fill_mode(FillMode::MajorWireframe).with_line_radii([0.02_f32]);
    writer.write_static(entity, &fixed)?;
    writer.write_rows(entity, times, |range| {
        let rows = &tracks[range];
        let all = || rows.iter().flatten();
        let ellipses: Vec<([f32; 3], Quaternion)> = all().map(ellipse).collect();
        Ellipsoids3D::update_fields()
            .with_centers(all().map(|track| [track.x_m() as f32, track.y_m() as f32, ELLIPSE_Z_M as f32]))
            .with_half_sizes(ellipses.iter().map(|ellipse| ellipse.0))
            .with_quaternions(ellipses.iter().map(|ellipse| ellipse.1))
            .with_colors(all().map(colour))
            .columns(rows.iter().map(Vec::len).collect::<Vec<_>>())
    })
}

/// Half axes and direction of the ellipse of a track's position.
fn ellipse(track: &Track) -> ([f32; 3], Quaternion) {
    let position: Matrix2<f64> = track.covariance.fixed_view::<2, 2>(0, 0).into_owned();
    let axes = SymmetricEigen::new(position);
    let half_m = |index: usize| (ELLIPSE_SIGMAS * axes.eigenvalues[index].max(0.0).sqrt()) as f32;
    let first = axes.eigenvectors.column(0);
    ([half_m(0), half_m(1), ELLIPSE_HALF_THICKNESS_M as f32], yaw_rotation(first[1].atan2(first[0])))
}

/// What is more likely no vehicle stays in the background.
fn colour(track: &Track) -> Rgba {
    match track.status {
        _ if track.class.vehicle() < 0.5 => palette::QUIET,
        TrackStatus::Tentative => palette::QUIET,
        TrackStatus::Confirmed => palette::TRACK,
        TrackStatus::Coasting => palette::WARNING,
    }
}

/// Number, class with its score, existence.
fn label(track: &Track) -> String {
    let class = track.class.best_vehicle_class();
    let score = track.class.0[class as usize];
    format!("#{} {} {score:.2}, exists {:.2}", track.id.0, class.name(), track.existence)
}
