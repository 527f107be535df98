//! The vehicles of the other film of a pair, as see-through outlines in the world of this one: where everyone would be
//! without the system under test, or is in the recording.

use closecall_traffic::Time;
use rerun::{Boxes3D, FillMode, LineStrips2D};

use super::RecordError;
use super::bird::STRETCH;
use super::palette;
use super::stream::Writer;
use super::vehicles::about_up;
use crate::run::film::Film;

/// Opacity of an outline.
const FAINT: u8 = 120;

/// Writes the vehicles of `other` into the world of `film`, for as long as both last.
pub(super) fn write(writer: &Writer<'_>, film: &Film, other: &Film) -> Result<(), RecordError> {
    for (place, _) in other.cast.iter().enumerate().filter(|(_, member)| !member.rows.is_empty()) {
        write_outline(writer, other, place)?;
    }
    write_from_above(writer, film, other)
}

fn write_outline(writer: &Writer<'_>, other: &Film, place: usize) -> Result<(), RecordError> {
    let member = &other.cast[place];
    let size = &member.vehicle.dimensions;
    let entity = format!("world/ghosts/{}", member.name);
    let half = |extent_m: f64| (0.5 * extent_m) as f32;
    let fixed = Boxes3D::update_fields()
        .with_half_sizes([[half(size.length_m), half(size.width_m), half(size.height_m)]])
        .with_colors([palette::faint(palette::actor(place, other.ego), FAINT)])
        .with_fill_mode(FillMode::MajorWireframe)
        .with_radii([0.04_f32])
        .with_labels([format!("{} ({})", member.name, other.arm)])
        .with_show_labels(place == other.ego);
    writer.fixed(&entity, &fixed)?;
    let all_times = other.times();
    let (times, frames) = (&all_times[member.rows.clone()], &other.frames[member.rows.clone()]);
    writer.rows(&entity, times, |range| {
        let poses = frames[range].iter().map(|frame| {
            let state = &frame.states[place];
            other.road.plane_pose(state.s_m, state.d_m, state.heading_rad)
        });
        let poses: Vec<_> = poses.collect();
        Boxes3D::update_fields()
            .with_centers(poses.iter().map(|pose| [pose.x_m as f32, pose.y_m as f32, half(size.height_m)]))
            .with_quaternions(poses.iter().map(|pose| about_up(pose.yaw_rad)))
            .columns_of_unit_batches()
    })?;
    match all_times.get(member.rows.end) {
        Some(&gone) => writer.gone(&entity, gone),
        None => Ok(()),
    }
}

fn write_from_above(writer: &Writer<'_>, film: &Film, other: &Film) -> Result<(), RecordError> {
    let entity = "bird/ghosts";
    let count = film.frames.len().min(other.frames.len());
    let times: Vec<Time> = film.frames[..count].iter().map(|frame| frame.time).collect();
    writer.fixed(entity, &LineStrips2D::update_fields().with_radii([0.3_f32]))?;
    let there = |row: usize| (0..other.cast.len()).filter(move |&place| other.is_there(place, row));
    writer.rows(entity, &times, |range| {
        let all = || range.clone().flat_map(|row| there(row).map(move |place| (row, place)));
        let outline = |(row, place): (usize, usize)| {
            let from_m = film.frames[row].states[film.ego].s_m;
            let (state, size) = (&other.frames[row].states[place], &other.cast[place].vehicle.dimensions);
            let corners = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5], [-0.5, -0.5]];
            corners.map(|[along, across]: [f64; 2]| {
                let (s_m, d_m) = (state.s_m + along * size.length_m, state.d_m + across * size.width_m);
                [(s_m - from_m) as f32, (-d_m * STRETCH) as f32]
            })
        };
        LineStrips2D::update_fields()
            .with_strips(all().map(outline))
            .with_colors(all().map(|(_, place)| palette::faint(palette::actor(place, other.ego), FAINT)))
            .columns(range.clone().map(|row| there(row).count()).collect::<Vec<_>>())
    })
}
