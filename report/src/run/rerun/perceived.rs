//! The ego's perception in the ego frame: the fields of view of the rear sensors, and the tracks as
//! boxes with the covariance of their position. Each group of sensors has its own entities, so the
//! user can switch each group off.

use closecall_sensors::FieldOfView;
use closecall_traffic::{Source, Time, Track, TrackStatus, maths};
use nalgebra::{Matrix2, SymmetricEigen};
use rerun::{Boxes3D, Ellipsoids3D, FillMode, LineStrips3D, Quaternion};

use super::RecordingError;
use super::palette::{self, Rgba};
use super::stream::{Writer, changes};
use super::vehicles::yaw_rotation;
use crate::run::film::Film;

/// Height of the boxes of tracks (m), since tracks have no height.
const TRACK_HEIGHT_M: f64 = 1.7;
/// Distance of the faces of a box from the faces of the track (m): the box is visible around the
/// vehicle.
const CLEARANCE_M: f64 = 0.15;
/// Half axis of an ellipse in standard deviations. The ellipse contains about 95 % of the
/// probability: √χ²₂(0.95).
const ELLIPSE_SIGMAS: f64 = 2.448;
/// Height at which ellipses are drawn (m).
const ELLIPSE_Z_M: f64 = 0.08;
/// Half of the vertical extent of an ellipse (m).
const ELLIPSE_HALF_THICKNESS_M: f64 = 0.01;
/// Height at which the field of view is drawn (m).
const FIELD_Z_M: f64 = 0.2;
/// Number of straight pieces of the arc that bounds the field of view.
const ARC_PIECES: u32 = 48;

/// Time over which paths are predicted (s): the time for which the margin increase system lets the
/// ego hold its speed.
const PREDICTION_S: f64 = 2.0;
/// Height at which paths are drawn (m).
const PATH_Z_M: f32 = 0.12;

/// The groups of sensors, with the names of their entities.
const SOURCES: [(Source, &str); 3] = [(Source::Front, "front"), (Source::Surround, "surround"), (Source::Rear, "rear")];

pub(super) fn write(writer: &Writer<'_>, film: &Film) -> Result<(), RecordingError> {
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

/// Writes the predicted paths of the confirmed tracks, at their present velocities.
fn write_predictions(
    writer: &Writer<'_>,
    entity: &str,
    times: &[Time],
    tracks: &[Vec<Track>],
) -> Result<(), RecordingError> {
    writer.write_static(entity, &LineStrips3D::update_fields().with_radii([0.05_f32]))?;
    let is_shown = |track: &&Track| track.status != TrackStatus::Tentative && track.class.vehicle() >= 0.5;
    writer.write_rows(entity, times, |range| {
        let rows = &tracks[range];
        let all = || rows.iter().flatten().filter(is_shown);
        let path = |track: &Track| {
            let ahead = |start_m: f64, speed_mps: f64| (start_m + PREDICTION_S * speed_mps) as f32;
            let (x, y) = (track.x_m(), track.y_m());
            [[x as f32, y as f32, PATH_Z_M], [ahead(x, track.vx_mps()), ahead(y, track.vy_mps()), PATH_Z_M]]
        };
        LineStrips3D::new(all().map(path))
            .with_colors(all().map(|track| palette::with_opacity(colour(track), 150)))
            .columns(rows.iter().map(|row| row.iter().filter(is_shown).count()).collect::<Vec<_>>())
    })
}

/// Writes the predicted path of the ego, at the acceleration that its controller commands.
fn write_own_path(writer: &Writer<'_>, film: &Film, times: &[Time]) -> Result<(), RecordingError> {
    if film.frames.iter().any(|frame| frame.command.is_none()) {
        return Ok(());
    }
    let entity = "world/ego/predicted";
    let fixed =
        LineStrips3D::update_fields().with_colors([palette::with_opacity(palette::EGO, 200)]).with_radii([0.07_f32]);
    writer.write_static(entity, &fixed)?;
    writer.write_rows(entity, times, |range| {
        let ends = film.frames[range.clone()].iter().map(|frame| {
            let commanded_mps2 = frame.command.map_or(0.0, |command| command.acceleration_mps2);
            let distance_m = predicted_distance_m(frame.states[film.ego].speed_mps, commanded_mps2);
            [[0.0, 0.0, PATH_Z_M], [distance_m as f32, 0.0, PATH_Z_M]]
        });
        LineStrips3D::new(ends).columns_of_unit_batches()
    })
}

/// Returns the distance until the end of the prediction or until standstill (m).
fn predicted_distance_m(speed_mps: f64, acceleration_mps2: f64) -> f64 {
    let until_standstill_s = if acceleration_mps2 < 0.0 { -speed_mps / acceleration_mps2 } else { f64::INFINITY };
    let duration_s = PREDICTION_S.min(until_standstill_s);
    speed_mps * duration_s + 0.5 * acceleration_mps2 * duration_s * duration_s
}

/// Writes the outlines of the fields of view of the rear sensors.
fn write_rear_field(writer: &Writer<'_>, film: &Film, times: &[Time]) -> Result<(), RecordingError> {
    let fields: Vec<&[FieldOfView]> = film.frames.iter().map(|frame| &frame.rear_fields[..]).collect();
    if fields.iter().all(|fields| fields.is_empty()) {
        return Ok(());
    }
    let bumper_m = -0.5 * film.actors[film.ego].vehicle.dimensions.length_m;
    let entity = "world/ego/rear_field_of_view";
    let fixed = LineStrips3D::update_fields().with_colors([palette::FIELD_OF_VIEW]).with_radii([0.05_f32]);
    writer.write_static(entity, &fixed)?;
    let rows = changes(&fields);
    let times: Vec<Time> = rows.iter().map(|&row| times[row]).collect();
    writer.write_rows(entity, &times, |range| {
        let shown: Vec<&[FieldOfView]> = rows[range].iter().map(|&row| fields[row]).collect();
        let edges = shown.iter().copied().flatten().map(|field| edge(field, bumper_m));
        LineStrips3D::new(edges).columns(shown.iter().map(|fields| fields.len()).collect::<Vec<_>>())
    })
}

/// Returns the outline of the field of view: from the sensor along one side, along the arc, and
/// back to the sensor.
fn edge(field: &FieldOfView, bumper_m: f64) -> Vec<[f32; 3]> {
    let half_rad = maths::atan(field.half_angle_tan);
    let [x_m, y_m] = [bumper_m + field.inset_m, field.left_m];
    let sensor = [x_m as f32, y_m as f32, FIELD_Z_M as f32];
    let arc = (0..=ARC_PIECES).map(|piece| {
        let angle_rad = half_rad * (2.0 * f64::from(piece) / f64::from(ARC_PIECES) - 1.0);
        let (sin, cos) = maths::sin_cos(field.azimuth_rad + angle_rad);
        [(x_m - field.range_m * cos) as f32, (y_m + field.range_m * sin) as f32, FIELD_Z_M as f32]
    });
    [sensor].into_iter().chain(arc).chain([sensor]).collect()
}

/// Writes the boxes of the tracks.
fn write_boxes(writer: &Writer<'_>, entity: &str, times: &[Time], tracks: &[Vec<Track>]) -> Result<(), RecordingError> {
    // The viewer shows the label of the box under the pointer. All labels at once would hide the
    // scene.
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

/// Writes the ellipses of the position covariances.
fn write_ellipses(
    writer: &Writer<'_>,
    entity: &str,
    times: &[Time],
    tracks: &[Vec<Track>],
) -> Result<(), RecordingError> {
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

/// Returns the half axes (m) and the orientation of the ellipse of a track's position covariance.
fn ellipse(track: &Track) -> ([f32; 3], Quaternion) {
    let position: Matrix2<f64> = track.covariance.fixed_view::<2, 2>(0, 0).into_owned();
    let axes = SymmetricEigen::new(position);
    let half_m = |index: usize| (ELLIPSE_SIGMAS * axes.eigenvalues[index].max(0.0).sqrt()) as f32;
    let first = axes.eigenvectors.column(0);
    ([half_m(0), half_m(1), ELLIPSE_HALF_THICKNESS_M as f32], yaw_rotation(maths::atan2(first[1], first[0])))
}

/// Returns the colour of a track by its status. A track that is probably no vehicle is
/// inconspicuous.
fn colour(track: &Track) -> Rgba {
    match track.status {
        _ if track.class.vehicle() < 0.5 => palette::QUIET,
        TrackStatus::Tentative => palette::QUIET,
        TrackStatus::Confirmed => palette::TRACK,
        TrackStatus::Coasting => palette::WARNING,
    }
}

/// Returns the label of a track: id, class with its score, probability of existence.
fn label(track: &Track) -> String {
    let class = track.class.best_vehicle_class();
    let score = track.class.0[class as usize];
    format!("#{} {} {score:.2}, exists {:.2}", track.id.0, class.name(), track.existence)
}
