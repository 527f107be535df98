//! The view from above (bird's-eye view), in a frame that moves with the ego, E. The direction of
//! travel points to the right. F is the lead vehicle, R the rear vehicle.
//!
//! ```text
//!   with MIS · 11.88 s   rear 36.7 m/s · 0.20 s behind
//!   ─────────────────────────────────────────────
//!             ▬▬ R ▷▷▷
//!   ─ ─ ─ ─ ─ ─ ─ ─ ─ ─ ─ ─ ─ ─ ─ ─ ─ ─ ─ ─ ─ ─ ─
//!                    ├─────┤▬▬ E ▷▷├────────┤▬▬ F
//!   ─────────────────────────────────────────────
//!              ego 21.5 m/s   front 30.0 m/s · 2.66 s ahead
//!   -20 m        0 m         20 m         40 m
//! ```
//!
//! In a pair, the roads lie below each other, so both have one metre axis.

mod names;

use closecall_traffic::{Indicator, Measured, Source, Time, Track, TrackStatus, maths};
use rerun::{LineStrips2D, Points2D};

use super::RecordingError;
use super::palette::{self, Rgba};
use super::stream::Writer;
use super::truth::{belongs_to_a_vehicle, is_false_track_of_other_sensors};
use crate::run::film::{Film, Frame};
use closecall_scenarios::outcome::{CRITICAL_THW_S, Collision};

/// Factor by which the picture is stretched across the road.
const STRETCH: f64 = 1.0;
/// Height that a label needs above or below a road (px).
const LABEL_ROOM_PX: f64 = 15.0;
/// Rear and front end of the road in the picture, relative to the ego (m).
pub(super) const X_RANGE_M: [f64; 2] = [-35.0, 75.0];
/// A line shows the distance that the vehicle travels in this time (s).
const ARROW_S: f64 = 0.5;
/// Room for the clock and the names above a road of three lanes (m in the picture). Wider roads
/// make the drawing smaller, and its labels not: all rooms and distances of labels grow by
/// [`Canvas::label_scale`].
const ABOVE_M: f64 = 4.8;
/// Room for the names below the road (m in the picture).
const BELOW_M: f64 = 4.6;
/// Room for the axis below the last road (m in the picture). Its numbers hang below it, and take 22
/// px, which are 5.8 m in a window of 1280 x 720 px.
const AXIS_M: f64 = 6.4;
/// Distance of the clock and the names above from the road (m in the picture). A label hangs below
/// its point.
const NAMES_ABOVE_M: f64 = 4.4;
/// Distance of the names below and of the axis from the road (m in the picture).
const NAMES_BELOW_M: f64 = 0.3;
const AXIS_BELOW_M: f64 = 5.2;
/// Distance between two marks of the axis (m).
const AXIS_STEP_M: i32 = 10;
/// Marks of the axis that have a number are at least this many steps apart.
const AXIS_NUMBERED: i32 = 2;
/// Letters of the longest number on the axis: `-20 m`.
const NUMBER_LETTERS: usize = 5;
/// Width of the view in a window of 1280 x 720 px (px).
const VIEW_WIDTH_PX: f64 = 700.0;
/// Its least and its largest height, by layout, with one road and with two (px).
const VIEW_HEIGHTS_PX: [[f64; 2]; 2] = [[105.0, 190.0], [155.0, 250.0]];
/// Share of the visible width that labels may use. In other windows the view has another shape.
const LABELLED_SHARE: f64 = 0.9;
/// Width of a letter of a label, and of the box of a label with the room to the next one (px).
const LETTER_PX: f64 = 6.2;
const BETWEEN_LABELS_PX: f64 = 18.0;
/// Letters of the clock besides the name of the arm.
const CLOCK_LETTERS: usize = 10;
/// Word before the time of a film that has ended.
const ENDED: &str = "ended ";
// Draw orders: a larger one lies above a smaller one.
const LANE_ORDER: f32 = 0.0;
const VELOCITY_ORDER: f32 = 1.0;
const BODY_ORDER: f32 = 2.0;
const MARK_ORDER: f32 = 3.0;

/// The road of one film in the picture.
#[derive(Clone, Copy)]
pub(super) struct Canvas<'a> {
    pub(super) film: &'a Film,
    /// Position of the left edge of the road across the picture (m in the picture).
    top_m: f64,
    /// True if the metre axis is below this road.
    has_axis: bool,
    /// True if another film goes on after the end of this one.
    ends_early: bool,
    /// Least and largest number of pixels of a metre in a window of 1280 x 720 px.
    px_per_m: [f64; 2],
    /// Factor of the rooms and distances of labels.
    label_scale: f64,
}

impl<'a> Canvas<'a> {
    /// Returns the canvases of the films, below each other.
    pub(super) fn of_films(films: &'a [Film]) -> Vec<Self> {
        let mut top_m = 0.0;
        let end = Film::span(films)[1];
        let heights_px = VIEW_HEIGHTS_PX[usize::from(films.len() > 1)];
        let roads_m: Vec<f64> = films.iter().map(|film| -film.road.right_edge_m() * STRETCH).collect();
        let label_scale = label_scale(&roads_m, heights_px[0]);
        let mut canvases = Vec::new();
        for (index, film) in films.iter().enumerate() {
            let (has_axis, ends_early) = (index + 1 == films.len(), film.end() < end);
            canvases.push(Self { film, top_m, has_axis, ends_early, px_per_m: [1.0; 2], label_scale });
            top_m += label_scale * (ABOVE_M + BELOW_M) - film.road.right_edge_m() * STRETCH;
        }
        // The viewer fits the drawing into the view: wide roads make it smaller, and its labels
        // not.
        let whole_m = top_m + label_scale * AXIS_M;
        let px_per_m =
            heights_px.map(|height_px| (VIEW_WIDTH_PX / (X_RANGE_M[1] - X_RANGE_M[0])).min(height_px / whole_m));
        for canvas in &mut canvases {
            canvas.px_per_m = px_per_m;
        }
        canvases
    }

    /// Returns the room that a label takes, with the distance to the next one (m in the picture).
    fn label_m(&self, letters: usize) -> f64 {
        (LETTER_PX * letters as f64 + BETWEEN_LABELS_PX) / self.px_per_m[0]
    }

    /// Returns the left and the right end of the room for labels, relative to the ego (m). It is
    /// wider than the road that is meant to be shown if the height of the view limits the drawing.
    fn labelled_m(&self) -> [f64; 2] {
        let half_m = 0.5 * (X_RANGE_M[1] - X_RANGE_M[0]).max(LABELLED_SHARE * VIEW_WIDTH_PX / self.px_per_m[1]);
        [-half_m, half_m].map(|side_m| 0.5 * (X_RANGE_M[0] + X_RANGE_M[1]) + side_m)
    }

    /// Returns the upper and the lower end of the drawing (m in the picture).
    pub(super) fn range_m(&self) -> [f64; 2] {
        let below_m = BELOW_M + if self.has_axis { AXIS_M } else { 0.0 };
        [self.top_m - self.label_scale * ABOVE_M, self.bottom_m() + self.label_scale * below_m]
    }

    /// Returns the height of the clock and of the names above the road (m in the picture).
    fn above_m(&self) -> f64 {
        self.top_m - self.label_scale * NAMES_ABOVE_M
    }

    /// Returns the height of the names below the road (m in the picture).
    fn below_m(&self) -> f64 {
        self.bottom_m() + self.label_scale * NAMES_BELOW_M
    }

    /// Returns the position of the right edge of the road across the picture (m in the picture).
    fn bottom_m(&self) -> f64 {
        self.top_m - self.film.road.right_edge_m() * STRETCH
    }

    /// Returns the picture coordinates of a point in the road frame.
    pub(super) fn at(&self, frame: &Frame, s_m: f64, d_m: f64) -> [f32; 2] {
        [(s_m - frame.states[self.film.ego].s_m) as f32, (self.top_m - d_m * STRETCH) as f32]
    }
}

/// Returns the factor, at least 1, of the rooms for labels beside roads of these widths (m): in a
/// view of this height (px), each label above a road then has the pixels that it needs.
fn label_scale(roads_m: &[f64], height_px: f64) -> f64 {
    let labels_m = roads_m.len() as f64 * (ABOVE_M + BELOW_M) + AXIS_M;
    let whole_m: f64 = roads_m.iter().sum();
    (LABEL_ROOM_PX * whole_m / (ABOVE_M * height_px - LABEL_ROOM_PX * labels_m)).max(1.0)
}

pub(super) fn write(writer: &Writer<'_>, canvas: &Canvas<'_>) -> Result<(), RecordingError> {
    let times = canvas.film.times();
    write_lanes(writer, canvas, &times)?;
    if canvas.has_axis {
        write_axis(writer, canvas)?;
    }
    write_clock(writer, canvas, &times)?;
    write_bodies(writer, canvas, &times)?;
    names::write(writer, canvas, &times)?;
    write_speeds(writer, canvas, &times)?;
    write_lamps(writer, canvas, &times)?;
    write_gaps(writer, canvas, &times)?;
    write_tracks(writer, canvas, &times)?;
    write_collisions(writer, canvas)
}

/// Writes the edges of the road and the lane markings. If the widths of the lanes change, they move
/// past the ego.
fn write_lanes(writer: &Writer<'_>, canvas: &Canvas<'_>, times: &[Time]) -> Result<(), RecordingError> {
    let road = &canvas.film.road;
    // A drawing of wide roads shows more than the stretch that is meant.
    let reach_m = X_RANGE_M.map(|x_m| 8.0 * x_m);
    let strips = (0..=road.lanes()).map(|line| {
        let y = (canvas.top_m - road.full_boundary_m(line, 0.0) * STRETCH) as f32;
        reach_m.map(|x_m| [x_m as f32, y])
    });
    let edge = |line: u8| line == 0 || line == road.lanes();
    let colours = (0..=road.lanes()).map(|line| if edge(line) { palette::MARKING } else { palette::QUIET });
    let lanes = LineStrips2D::new(strips).with_colors(colours).with_radii([0.12_f32]).with_draw_order(LANE_ORDER);
    if !road.has_changing_lanes() {
        return writer.write_static("bird/lanes", &lanes);
    }
    let fixed = LineStrips2D { strips: None, ..lanes };
    writer.write_static("bird/lanes", &fixed)?;
    let strips = |frame: &Frame| {
        let ego_m = frame.states[canvas.film.ego].s_m;
        let [from_m, to_m] = reach_m.map(|x_m| ego_m + x_m);
        let mut along_m: Vec<f64> = road.stretches_m([from_m, to_m]).iter().map(|[start_m, _]| *start_m).collect();
        along_m.push(to_m);
        let strip = |line: u8| -> Vec<[f32; 2]> {
            along_m.iter().map(|s_m| canvas.at(frame, *s_m, road.full_boundary_m(line, *s_m))).collect()
        };
        (0..=road.lanes()).map(strip).collect::<Vec<_>>()
    };
    writer.write_rows("bird/lanes", times, |range| {
        let frames = &canvas.film.frames[range];
        LineStrips2D::update_fields().with_strips(frames.iter().flat_map(strips)).columns(vec![
            usize::from(road.lanes())
                + 1;
            frames.len()
        ])
    })
}

/// Writes the metre axis below the road.
fn write_axis(writer: &Writer<'_>, canvas: &Canvas<'_>) -> Result<(), RecordingError> {
    let y = (canvas.bottom_m() + canvas.label_scale * AXIS_BELOW_M) as f32;
    let [first, last] = X_RANGE_M.map(|x_m| (x_m as i32) / AXIS_STEP_M);
    let marks: Vec<i32> = (first..=last).collect();
    let x = |mark: i32| (mark * AXIS_STEP_M) as f32;
    let ends = [[x(first), y], [x(last), y]];
    let strips = marks.iter().map(|&mark| [[x(mark), y - 0.7], [x(mark), y + 0.7]]);
    let lines = LineStrips2D::new(std::iter::once(ends).chain(strips))
        .with_colors([palette::NEUTRAL])
        .with_radii([0.09_f32])
        .with_draw_order(LANE_ORDER);
    writer.write_static("bird/axis", &lines)?;
    let apart = (canvas.label_m(NUMBER_LETTERS) / f64::from(AXIS_STEP_M)).ceil() as i32;
    let numbered: Vec<i32> = marks.into_iter().filter(|mark| mark % apart.max(AXIS_NUMBERED) == 0).collect();
    let numbers = Points2D::new(numbered.iter().map(|&mark| [x(mark), y]))
        .with_labels(numbered.iter().map(|mark| format!("{} m", mark * AXIS_STEP_M)))
        .with_colors([palette::LABEL])
        .with_radii([0.05_f32])
        .with_show_labels(true);
    writer.write_static("bird/axis/numbers", &numbers)
}

/// Returns the room that the clock takes (m in the picture).
fn clock_m(canvas: &Canvas<'_>) -> f64 {
    let ended = if canvas.ends_early { ENDED.chars().count() } else { 0 };
    canvas.label_m(canvas.film.arm_label().chars().count() + CLOCK_LETTERS + ended)
}

/// Returns the text at the end of the row above the road from a collision on.
fn collision_mark(film: &Film, collision: &Collision) -> String {
    film.mark_text(collision)
}

/// Returns the room that the text about the collision takes in a frame (m in the picture).
fn collision_m(canvas: &Canvas<'_>, row: usize) -> f64 {
    let film = canvas.film;
    let happened = |collision: &&Collision| film.frames[row].time >= collision.time;
    film.worst_collision()
        .filter(happened)
        .map_or(0.0, |collision| canvas.label_m(collision_mark(film, collision).chars().count()))
}

/// Returns the name of the arm with a time. The last frame stays while another film goes on.
pub(super) fn clock_text(canvas: &Canvas<'_>, time: Time) -> String {
    let film = canvas.film;
    let ended = if canvas.ends_early && time == film.end() { ENDED } else { "" };
    format!("{} · {ended}{:.2} s", film.arm_label(), time.s())
}

/// Writes the name of the arm with the time of the frame. A label is centred at its point.
fn write_clock(writer: &Writer<'_>, canvas: &Canvas<'_>, times: &[Time]) -> Result<(), RecordingError> {
    let at = [(canvas.labelled_m()[0] + 0.5 * clock_m(canvas)) as f32, canvas.above_m() as f32];
    let entity = "bird/clock";
    let fixed = Points2D::new([at]).with_colors([palette::LABEL]).with_radii([0.05_f32]).with_show_labels(true);
    writer.write_static(entity, &fixed)?;
    writer.write_rows(entity, times, |range| {
        let texts = times[range].iter().map(|time| clock_text(canvas, *time));
        Points2D::update_fields().with_labels(texts).columns_of_unit_batches()
    })
}

/// Writes a bar for each vehicle that is present.
fn write_bodies(writer: &Writer<'_>, canvas: &Canvas<'_>, times: &[Time]) -> Result<(), RecordingError> {
    let entity = "bird/vehicles";
    let film = canvas.film;
    writer.write_static(entity, &LineStrips2D::update_fields().with_draw_order(BODY_ORDER))?;
    let present = |row: usize| (0..film.actors.len()).filter(move |&actor| film.is_present(actor, row));
    writer.write_rows(entity, times, |range| {
        let all = || range.clone().flat_map(|row| present(row).map(move |actor| (row, actor)));
        let width_m = |actor: usize| film.actors[actor].vehicle.dimensions.width_m * STRETCH;
        let bar = |(row, actor): (usize, usize)| {
            let frame: &Frame = &film.frames[row];
            let state = &frame.states[actor];
            // The ends of a line are round.
            let half_m = 0.5 * (film.actors[actor].vehicle.dimensions.length_m - width_m(actor)).max(0.1);
            [-half_m, half_m].map(|along_m| canvas.at(frame, state.s_m + along_m, state.d_m))
        };
        LineStrips2D::update_fields()
            .with_strips(all().map(bar))
            .with_colors(all().map(|(_, actor)| palette::part(film.actors[actor].part)))
            .with_radii(all().map(|(_, actor)| (0.5 * width_m(actor)) as f32))
            .columns(range.clone().map(|row| present(row).count()).collect::<Vec<_>>())
    })
}

/// Writes the velocities as lines in front of the vehicles.
fn write_speeds(writer: &Writer<'_>, canvas: &Canvas<'_>, times: &[Time]) -> Result<(), RecordingError> {
    let film = canvas.film;
    let entity = "bird/velocity";
    writer
        .write_static(entity, &LineStrips2D::update_fields().with_radii([0.35_f32]).with_draw_order(VELOCITY_ORDER))?;
    let present =
        |row: usize| (0..film.actors.len()).filter(move |&actor| film.is_main(actor) && film.is_present(actor, row));
    writer.write_rows(entity, times, |range| {
        let all = || range.clone().flat_map(|row| present(row).map(move |actor| (row, actor)));
        let line = |(row, actor): (usize, usize)| {
            let frame: &Frame = &film.frames[row];
            let state = &frame.states[actor];
            let front_m = 0.5 * film.actors[actor].vehicle.dimensions.length_m;
            let (sin, cos) = maths::sin_cos(state.heading_rad);
            let arrow_end_m = front_m + ARROW_S * state.speed_mps;
            [
                canvas.at(frame, state.s_m + front_m * cos, state.d_m + front_m * sin),
                canvas.at(frame, state.s_m + arrow_end_m * cos, state.d_m + arrow_end_m * sin),
            ]
        };
        LineStrips2D::new(all().map(line))
            .with_colors(all().map(|(_, actor)| palette::with_opacity(palette::part(film.actors[actor].part), 150)))
            .columns(range.clone().map(|row| present(row).count()).collect::<Vec<_>>())
    })
}

/// Writes the brake lights and indicators that are on.
fn write_lamps(writer: &Writer<'_>, canvas: &Canvas<'_>, times: &[Time]) -> Result<(), RecordingError> {
    let film = canvas.film;
    let lit = |row: usize| -> Vec<([f32; 2], Rgba)> {
        let frame = &film.frames[row];
        let mut lamps = Vec::new();
        for actor in (0..film.actors.len()).filter(|&actor| film.is_present(actor, row)) {
            let (state, size) = (&frame.states[actor], &film.actors[actor].vehicle.dimensions);
            let rear_m = state.s_m - 0.5 * size.length_m;
            if state.brake_light {
                lamps.push((canvas.at(frame, rear_m, state.d_m), palette::BRAKE_LIGHT));
            }
            let side = match state.indicator {
                Indicator::Off => continue,
                Indicator::Left => 0.5,
                Indicator::Right => -0.5,
            };
            lamps.push((canvas.at(frame, rear_m, state.d_m + side * size.width_m), palette::INDICATOR));
        }
        lamps
    };
    let rows: Vec<Vec<([f32; 2], Rgba)>> = (0..film.frames.len()).map(lit).collect();
    if rows.iter().all(Vec::is_empty) {
        return Ok(());
    }
    let entity = "bird/lamps";
    writer.write_static(entity, &Points2D::update_fields().with_radii([0.8_f32]).with_draw_order(MARK_ORDER))?;
    writer.write_rows(entity, times, |range| {
        let rows = &rows[range];
        Points2D::new(rows.iter().flatten().map(|lamp| lamp.0))
            .with_colors(rows.iter().flatten().map(|lamp| lamp.1))
            .columns(rows.iter().map(Vec::len).collect::<Vec<_>>())
    })
}

/// A gap: its ends in the picture, and its colour.
type Gap = ([[f32; 2]; 2], Rgba);

/// Writes the gaps in front of and behind the ego. A critical gap is red.
fn write_gaps(writer: &Writer<'_>, canvas: &Canvas<'_>, times: &[Time]) -> Result<(), RecordingError> {
    let film = canvas.film;
    let half_m = 0.5 * film.actors[film.ego].vehicle.dimensions.length_m;
    let gaps = |frame: &Frame| -> Vec<Gap> {
        let ego = &frame.states[film.ego];
        let margins = &frame.margins;
        let sides = [(1.0, margins.gap_front_m, margins.thw_front_s), (-1.0, margins.gap_rear_m, margins.thw_rear_s)];
        let line = |(sign, gap_m, thw_s): (f64, Measured, Measured)| {
            let (gap_m, thw_s) = (gap_m.ok().filter(|&gap_m| gap_m > 0.0)?, thw_s.ok()?);
            let ends = [half_m, half_m + gap_m].map(|along_m| canvas.at(frame, ego.s_m + sign * along_m, ego.d_m));
            let colour = if thw_s < CRITICAL_THW_S { palette::CRITICAL } else { palette::SAFE };
            Some((ends, colour))
        };
        sides.into_iter().filter_map(line).collect()
    };
    let rows: Vec<Vec<Gap>> = film.frames.iter().map(gaps).collect();
    let entity = "bird/gaps";
    let fixed = LineStrips2D::update_fields().with_radii([0.45_f32]).with_draw_order(MARK_ORDER);
    writer.write_static(entity, &fixed)?;
    writer.write_rows(entity, times, |range| {
        let rows = &rows[range];
        LineStrips2D::new(rows.iter().flatten().map(|gap| gap.0))
            .with_colors(rows.iter().flatten().map(|gap| gap.1))
            .columns(rows.iter().map(Vec::len).collect::<Vec<_>>())
    })
}

/// An outline: its corners in the picture, and its colour.
type Outline = (Vec<[f32; 2]>, Rgba);

/// Writes the outlines of the confirmed rear tracks that are probably vehicles, and of all false
/// tracks, which have a colour of their own.
fn write_tracks(writer: &Writer<'_>, canvas: &Canvas<'_>, times: &[Time]) -> Result<(), RecordingError> {
    let film = canvas.film;
    let outlines = |frame: &Frame| -> Vec<Outline> {
        let ego = &frame.states[film.ego];
        let outline = |track: &Track| {
            let (half_m, side_m) = (0.5 * track.length_m, 0.5 * track.width_m);
            let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0]];
            let corner = |[along, across]: [f64; 2]| {
                canvas.at(frame, ego.s_m + track.x_m() + along * half_m, ego.d_m + track.y_m() + across * side_m)
            };
            let colour = if belongs_to_a_vehicle(film, frame, track) { palette::TRACK } else { palette::FALSE_TRACK };
            (corners.map(corner).to_vec(), colour)
        };
        frame.tracks.iter().filter(|track| is_shown_track(film, frame, track)).map(outline).collect()
    };
    let rows: Vec<Vec<Outline>> = film.frames.iter().map(outlines).collect();
    if rows.iter().all(Vec::is_empty) {
        return Ok(());
    }
    let entity = "bird/tracks";
    let fixed = LineStrips2D::update_fields().with_radii([0.25_f32]).with_draw_order(MARK_ORDER);
    writer.write_static(entity, &fixed)?;
    writer.write_rows(entity, times, |range| {
        let rows = &rows[range];
        LineStrips2D::new(rows.iter().flatten().map(|(outline, _)| outline.iter().copied()))
            .with_colors(rows.iter().flatten().map(|(_, colour)| *colour))
            .columns(rows.iter().map(Vec::len).collect::<Vec<_>>())
    })
}

/// Returns true for a confirmed rear track that is probably a vehicle, and for a false track of the
/// other sensors.
fn is_shown_track(film: &Film, frame: &Frame, track: &Track) -> bool {
    let is_of_rear =
        track.source == Source::Rear && track.status != TrackStatus::Tentative && track.class.vehicle() >= 0.5;
    is_of_rear || is_false_track_of_other_sensors(film, frame, track)
}

/// Writes a mark on the first vehicle of the worst collision, from the contact on.
fn write_collisions(writer: &Writer<'_>, canvas: &Canvas<'_>) -> Result<(), RecordingError> {
    let film = canvas.film;
    let Some(collision) = film.worst_collision() else { return Ok(()) };
    let struck = film.actors.iter().position(|actor| actor.name == collision.between[0].as_str());
    let Some(row) = film.frames.iter().position(|frame| frame.time >= collision.time) else { return Ok(()) };
    let Some(struck) = struck else { return Ok(()) };
    let frames = &film.frames[row..];
    let times: Vec<Time> = frames.iter().map(|frame| frame.time).collect();
    let entity = "bird/collision";
    let text = collision_mark(film, collision);
    let half_m = 0.5 * canvas.label_m(text.chars().count());
    let text_at = [(canvas.labelled_m()[1] - half_m) as f32, canvas.above_m() as f32];
    let fixed = Points2D::update_fields()
        .with_colors([palette::CRITICAL, palette::LABEL])
        .with_radii([1.6_f32, 0.05])
        .with_labels([String::new(), text])
        .with_draw_order(MARK_ORDER)
        .with_show_labels(true);
    writer.write_static(entity, &fixed)?;
    writer.write_rows(entity, &times, |range| {
        let frames = &frames[range];
        // The text is beside the road, clear of the names of the vehicles.
        let marks = frames.iter().flat_map(|frame| {
            let state = &frame.states[struck];
            [canvas.at(frame, state.s_m, state.d_m), text_at]
        });
        Points2D::update_fields().with_positions(marks).columns(vec![2; frames.len()])
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_beside_wide_roads_have_the_room_of_labels_beside_narrow_ones() {
        let [lanes_3_m, lanes_6_m] = [3.0 * 3.75, 6.0 * 3.66];
        let [one_px, two_px] = VIEW_HEIGHTS_PX.map(|[least_px, _]| least_px);
        assert_eq!([label_scale(&[lanes_3_m], one_px), label_scale(&[lanes_3_m; 2], two_px)], [1.0; 2]);
        for (roads_m, height_px) in [(&[lanes_6_m][..], one_px), (&[lanes_6_m; 2][..], two_px)] {
            let scale = label_scale(roads_m, height_px);
            let labels_m = scale * (roads_m.len() as f64 * (ABOVE_M + BELOW_M) + AXIS_M);
            let room_px = scale * ABOVE_M * height_px / (roads_m.iter().sum::<f64>() + labels_m);
            assert!(scale > 1.2 && (room_px - LABEL_ROOM_PX).abs() < 1e-9, "{scale}: {room_px} px");
        }
    }
}
