//! The view from above (bird's-eye view), in a frame that moves with the ego, E. The direction of travel points to the
//! right. The picture is stretched across the road, so that lane changes are easy to see. F is the lead vehicle, R the
//! rear vehicle.
//!
//! ```text
//!   ─────────────────────────────────────────────
//!             ▬▬ R ▷▷▷
//!   ─ ─ ─ ─ ─ ─ ─ ─ ─ ─ ─ ─ ─ ─ ─ ─ ─ ─ ─ ─ ─ ─ ─
//!                    ├ 0.2 s ┤▬▬ E ▷▷├ 2.7 s ┤▬▬ F
//!   ─────────────────────────────────────────────
//! ```

use closecall_traffic::{Indicator, Lane, Source, Time, TrackStatus};
use rerun::{LineStrips2D, Points2D};

use super::RecordingError;
use super::palette::{self, Rgba};
use super::stream::Writer;
use super::vehicles::LABELLED_GAP_M;
use crate::run::film::{Film, Frame};
use closecall_simulation::outcome::CRITICAL_THW_S;

/// Factor by which the picture is stretched across the road.
pub(super) const STRETCH: f64 = 2.0;
/// Length of road shown in front of and behind the ego (m).
pub(super) const REACH_M: f64 = 80.0;
/// A line shows the distance that the vehicle travels in this time (s).
const ARROW_S: f64 = 0.5;
/// Lateral position of the text about a collision, beside the left edge of the road (m).
const COLLISION_TEXT_D_M: f64 = 1.0;
// Draw orders: a larger one lies above a smaller one.
const LANE_ORDER: f32 = 0.0;
const VELOCITY_ORDER: f32 = 1.0;
const BODY_ORDER: f32 = 2.0;
const MARK_ORDER: f32 = 3.0;

/// Returns the y coordinates of the left and the right edge of the road in the picture.
pub(super) fn edges(film: &Film) -> [f64; 2] {
    [0.0, -film.road.right_edge_m() * STRETCH]
}

pub(super) fn write(writer: &Writer<'_>, film: &Film) -> Result<(), RecordingError> {
    let times = film.times();
    write_lanes(writer, film)?;
    write_bodies(writer, film, &times)?;
    write_speeds(writer, film, &times)?;
    write_lamps(writer, film, &times)?;
    write_gaps(writer, film, &times)?;
    write_tracks(writer, film, &times)?;
    write_collisions(writer, film)
}

/// Returns the picture coordinates of a point in the road frame.
fn at(film: &Film, frame: &Frame, s_m: f64, d_m: f64) -> [f32; 2] {
    [(s_m - frame.states[film.ego].s_m) as f32, (-d_m * STRETCH) as f32]
}

/// Writes the edges of the road and the lane markings.
fn write_lanes(writer: &Writer<'_>, film: &Film) -> Result<(), RecordingError> {
    let road = &film.road;
    let lines = (0..=road.lanes()).map(|line| match line {
        0 => 0.0,
        line => road.lane_centre_m(Lane(line)) - 0.5 * road.lane_width_m(),
    });
    let strips = lines.map(|d_m| {
        let y = (-d_m * STRETCH) as f32;
        [[-2.0 * REACH_M as f32, y], [2.0 * REACH_M as f32, y]]
    });
    let edge = |line: u8| line == 0 || line == road.lanes();
    let colours = (0..=road.lanes()).map(|line| if edge(line) { palette::MARKING } else { palette::QUIET });
    let lanes = LineStrips2D::new(strips).with_colors(colours).with_radii([0.15_f32]).with_draw_order(LANE_ORDER);
    writer.write_static("bird/lanes", &lanes)
}

/// Writes a bar for each vehicle that is present, with its name and speed.
fn write_bodies(writer: &Writer<'_>, film: &Film, times: &[Time]) -> Result<(), RecordingError> {
    for (index, actor) in film.actors.iter().enumerate().filter(|(_, actor)| !actor.present_frames.is_empty()) {
        let entity = format!("bird/vehicles/{}", actor.name);
        let size = &actor.vehicle.dimensions;
        let fixed = LineStrips2D::update_fields()
            .with_colors([palette::actor(index, film.ego)])
            .with_radii([(0.5 * size.width_m * STRETCH) as f32])
            .with_draw_order(BODY_ORDER)
            .with_show_labels(true);
        writer.write_static(&entity, &fixed)?;
        let half_m = 0.5 * size.length_m;
        writer.write_rows(&entity, times, |range| {
            let rows: Vec<usize> = range.collect();
            let present =
                || rows.iter().filter(|&&row| actor.present_frames.contains(&row)).map(|&row| &film.frames[row]);
            let bar = |frame: &Frame| {
                let state = &frame.states[index];
                [-half_m, half_m].map(|along_m| at(film, frame, state.s_m + along_m, state.d_m))
            };
            let text = |frame: &Frame| format!("{} {:.1} m/s", actor.name, frame.states[index].speed_mps);
            LineStrips2D::update_fields()
                .with_strips(present().map(bar))
                .with_labels(present().map(text))
                .columns(rows.iter().map(|row| usize::from(actor.present_frames.contains(row))).collect::<Vec<_>>())
        })?;
    }
    Ok(())
}

/// Writes the velocities as lines in front of the vehicles.
fn write_speeds(writer: &Writer<'_>, film: &Film, times: &[Time]) -> Result<(), RecordingError> {
    let entity = "bird/velocity";
    writer
        .write_static(entity, &LineStrips2D::update_fields().with_radii([0.5_f32]).with_draw_order(VELOCITY_ORDER))?;
    let present = |row: usize| (0..film.actors.len()).filter(move |&actor| film.is_present(actor, row));
    writer.write_rows(entity, times, |range| {
        let all = || range.clone().flat_map(|row| present(row).map(move |actor| (row, actor)));
        let line = |(row, actor): (usize, usize)| {
            let frame: &Frame = &film.frames[row];
            let state = &frame.states[actor];
            let front_m = 0.5 * film.actors[actor].vehicle.dimensions.length_m;
            let (sin, cos) = state.heading_rad.sin_cos();
            let arrow_end_m = front_m + ARROW_S * state.speed_mps;
            [
                at(film, frame, state.s_m + front_m * cos, state.d_m + front_m * sin),
                at(film, frame, state.s_m + arrow_end_m * cos, state.d_m + arrow_end_m * sin),
            ]
        };
        LineStrips2D::new(all().map(line))
            .with_colors(all().map(|(_, actor)| palette::with_opacity(palette::actor(actor, film.ego), 170)))
            .columns(range.clone().map(|row| present(row).count()).collect::<Vec<_>>())
    })
}

/// Writes the brake lights and indicators that are on.
fn write_lamps(writer: &Writer<'_>, film: &Film, times: &[Time]) -> Result<(), RecordingError> {
    let lit = |row: usize| -> Vec<([f32; 2], Rgba)> {
        let frame = &film.frames[row];
        let mut lamps = Vec::new();
        for actor in (0..film.actors.len()).filter(|&actor| film.is_present(actor, row)) {
            let (state, size) = (&frame.states[actor], &film.actors[actor].vehicle.dimensions);
            let rear_m = state.s_m - 0.5 * size.length_m;
            if state.brake_light {
                lamps.push((at(film, frame, rear_m, state.d_m), palette::BRAKE_LIGHT));
            }
            let side = match state.indicator {
                Indicator::Off => continue,
                Indicator::Left => 0.5,
                Indicator::Right => -0.5,
            };
            lamps.push((at(film, frame, rear_m, state.d_m + side * size.width_m), palette::INDICATOR));
        }
        lamps
    };
    let rows: Vec<Vec<([f32; 2], Rgba)>> = (0..film.frames.len()).map(lit).collect();
    if rows.iter().all(Vec::is_empty) {
        return Ok(());
    }
    let entity = "bird/lamps";
    writer.write_static(entity, &Points2D::update_fields().with_radii([1.1_f32]).with_draw_order(MARK_ORDER))?;
    writer.write_rows(entity, times, |range| {
        let rows = &rows[range];
        Points2D::new(rows.iter().flatten().map(|lamp| lamp.0))
            .with_colors(rows.iter().flatten().map(|lamp| lamp.1))
            .columns(rows.iter().map(Vec::len).collect::<Vec<_>>())
    })
}

/// A gap: its ends in the picture, its colour, and the text of its time headway.
type Gap = ([[f32; 2]; 2], Rgba, String);

/// Writes the gaps in front of and behind the ego with their time headways. A critical gap is red.
fn write_gaps(writer: &Writer<'_>, film: &Film, times: &[Time]) -> Result<(), RecordingError> {
    let half_m = 0.5 * film.actors[film.ego].vehicle.dimensions.length_m;
    let gaps = |frame: &Frame| -> Vec<Gap> {
        let own = &frame.states[film.ego];
        let margins = &frame.margins;
        let sides = [(1.0, margins.gap_front_m, margins.thw_front_s), (-1.0, margins.gap_rear_m, margins.thw_rear_s)];
        let line = |(sign, gap_m, thw_s): (f64, closecall_traffic::Measured, closecall_traffic::Measured)| {
            let (gap_m, thw_s) = (gap_m.ok().filter(|&gap_m| gap_m > 0.0)?, thw_s.ok()?);
            let ends = [half_m, half_m + gap_m].map(|along_m| at(film, frame, own.s_m + sign * along_m, own.d_m));
            let colour = if thw_s < CRITICAL_THW_S { palette::CRITICAL } else { palette::SAFE };
            let text = if gap_m < LABELLED_GAP_M { String::new() } else { format!("{thw_s:.2} s") };
            Some((ends, colour, text))
        };
        sides.into_iter().filter_map(line).collect()
    };
    let rows: Vec<Vec<Gap>> = film.frames.iter().map(gaps).collect();
    let entity = "bird/gaps";
    let fixed = LineStrips2D::update_fields().with_radii([0.6_f32]).with_draw_order(MARK_ORDER).with_show_labels(true);
    writer.write_static(entity, &fixed)?;
    writer.write_rows(entity, times, |range| {
        let rows = &rows[range];
        LineStrips2D::new(rows.iter().flatten().map(|gap| gap.0))
            .with_colors(rows.iter().flatten().map(|gap| gap.1))
            .with_labels(rows.iter().flatten().map(|gap| gap.2.as_str()))
            .columns(rows.iter().map(Vec::len).collect::<Vec<_>>())
    })
}

/// Writes the outlines of the confirmed rear tracks that are probably vehicles.
fn write_tracks(writer: &Writer<'_>, film: &Film, times: &[Time]) -> Result<(), RecordingError> {
    let outlines = |frame: &Frame| -> Vec<Vec<[f32; 2]>> {
        let own = &frame.states[film.ego];
        let is_shown = |track: &&closecall_traffic::Track| {
            track.source == Source::Rear && track.status != TrackStatus::Tentative && track.class.vehicle() >= 0.5
        };
        let outline = |track: &closecall_traffic::Track| {
            let (half_m, side_m) = (0.5 * track.length_m, 0.5 * track.width_m);
            let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0]];
            let corner = |[along, across]: [f64; 2]| {
                at(film, frame, own.s_m + track.x_m() + along * half_m, own.d_m + track.y_m() + across * side_m)
            };
            corners.map(corner).to_vec()
        };
        frame.tracks.iter().filter(is_shown).map(outline).collect()
    };
    let rows: Vec<Vec<Vec<[f32; 2]>>> = film.frames.iter().map(outlines).collect();
    if rows.iter().all(Vec::is_empty) {
        return Ok(());
    }
    let entity = "bird/tracks";
    let fixed =
        LineStrips2D::update_fields().with_colors([palette::TRACK]).with_radii([0.35_f32]).with_draw_order(MARK_ORDER);
    writer.write_static(entity, &fixed)?;
    writer.write_rows(entity, times, |range| {
        let rows = &rows[range];
        LineStrips2D::new(rows.iter().flatten().map(|outline| outline.iter().copied()))
            .columns(rows.iter().map(Vec::len).collect::<Vec<_>>())
    })
}

/// Writes a mark on the first vehicle of the worst collision, from the contact on.
fn write_collisions(writer: &Writer<'_>, film: &Film) -> Result<(), RecordingError> {
    let Some(collision) = film.worst_collision() else { return Ok(()) };
    let struck = film.actors.iter().position(|actor| actor.name == collision.between[0].as_str());
    let Some(row) = film.frames.iter().position(|frame| frame.time >= collision.time) else { return Ok(()) };
    let Some(struck) = struck else { return Ok(()) };
    let frames = &film.frames[row..];
    let times: Vec<Time> = frames.iter().map(|frame| frame.time).collect();
    let entity = "bird/collision";
    let text = format!("COLLISION {:.1} m/s", collision.relative_speed_mps);
    let fixed = Points2D::update_fields()
        .with_colors([palette::CRITICAL])
        .with_radii([2.5_f32, 0.1])
        .with_labels([String::new(), text])
        .with_draw_order(MARK_ORDER)
        .with_show_labels(true);
    writer.write_static(entity, &fixed)?;
    writer.write_rows(entity, &times, |range| {
        let frames = &frames[range];
        // The text is beside the road, clear of the names of the vehicles.
        let marks = frames.iter().flat_map(|frame| {
            let state = &frame.states[struck];
            [state.d_m, COLLISION_TEXT_D_M].map(|d_m| at(film, frame, state.s_m, d_m))
        });
        Points2D::update_fields().with_positions(marks).columns(vec![2; frames.len()])
    })
}
