//! Ghosts: the vehicles of one film of a pair, as transparent outlines in the views of the other.
//!
//! They show where the vehicles are without the system under test, or in the recorded traffic.

use closecall_traffic::Time;
use rerun::{Boxes3D, FillMode, LineStrips2D};

use super::RecordingError;
use super::bird::Canvas;
use super::palette;
use super::stream::Writer;
use super::vehicles::yaw_rotation;
use crate::run::film::Film;

/// Opacity of an outline.
const OPACITY: u8 = 120;

/// Writes the vehicles of `other` into the 3D scene and the view from above of a film.
pub(super) fn write(writer: &Writer<'_>, canvas: &Canvas<'_>, other: &Film) -> Result<(), RecordingError> {
    for (index, _) in other
        .actors
        .iter()
        .enumerate()
        .filter(|&(index, actor)| !actor.present_frames.is_empty() && other.is_main(index))
    {
        write_outline(writer, other, index)?;
    }
    write_from_above(writer, canvas, other)
}

fn write_outline(writer: &Writer<'_>, other: &Film, index: usize) -> Result<(), RecordingError> {
    let actor = &other.actors[index];
    let size = &actor.vehicle.dimensions;
    let entity = format!("world/ghosts/{}", actor.name);
    let half = |extent_m: f64| (0.5 * extent_m) as f32;
    let fixed = Boxes3D::update_fields()
        .with_half_sizes([[half(size.length_m), half(size.width_m), half(size.height_m)]])
        .with_colors([palette::with_opacity(palette::part(actor.part), OPACITY)])
        .with_fill_mode(FillMode::MajorWireframe)
        .with_radii([0.04_f32])
        .with_labels([format!("{} {}", actor.name, other.arm_label())])
        .with_show_labels(false);
    writer.write_static(&entity, &fixed)?;
    let all_times = other.times();
    let (times, frames) = (&all_times[actor.present_frames.clone()], &other.frames[actor.present_frames.clone()]);
    writer.write_rows(&entity, times, |range| {
        let poses = frames[range].iter().map(|frame| {
            let state = &frame.states[index];
            other.road.plane_pose(state.s_m, state.d_m, state.heading_rad)
        });
        let poses: Vec<_> = poses.collect();
        Boxes3D::update_fields()
            .with_centers(poses.iter().map(|pose| [pose.x_m as f32, pose.y_m as f32, half(size.height_m)]))
            .with_quaternions(poses.iter().map(|pose| yaw_rotation(pose.yaw_rad)))
            .columns_of_unit_batches()
    })?;
    match all_times.get(actor.present_frames.end) {
        Some(&gone) => writer.write_clear(&entity, gone),
        None => Ok(()),
    }
}

fn write_from_above(writer: &Writer<'_>, canvas: &Canvas<'_>, other: &Film) -> Result<(), RecordingError> {
    let (film, entity) = (canvas.film, "bird/ghosts");
    let count = film.frames.len().min(other.frames.len());
    let times: Vec<Time> = film.frames[..count].iter().map(|frame| frame.time).collect();
    writer.write_static(entity, &LineStrips2D::update_fields().with_radii([0.2_f32]))?;
    let present =
        |row: usize| (0..other.actors.len()).filter(move |&index| other.is_main(index) && other.is_present(index, row));
    writer.write_rows(entity, &times, |range| {
        let all = || range.clone().flat_map(|row| present(row).map(move |index| (row, index)));
        let outline = |(row, index): (usize, usize)| {
            let (state, size) = (&other.frames[row].states[index], &other.actors[index].vehicle.dimensions);
            let corners = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5], [-0.5, -0.5]];
            corners.map(|[along, across]: [f64; 2]| {
                let (s_m, d_m) = (state.s_m + along * size.length_m, state.d_m + across * size.width_m);
                canvas.at(&film.frames[row], s_m, d_m)
            })
        };
        LineStrips2D::update_fields()
            .with_strips(all().map(outline))
            .with_colors(
                all().map(|(_, index)| palette::with_opacity(palette::part(other.actors[index].part), OPACITY)),
            )
            .columns(range.clone().map(|row| present(row).count()).collect::<Vec<_>>())
    })
}
