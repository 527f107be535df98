//! The names of the vehicles in the view from above, with their speeds and headways.

use closecall_traffic::{Measured, Time};
use rerun::Points2D;

use super::super::RecordingError;
use super::super::palette::{self, Rgba};
use super::super::stream::Writer;
use super::{BETWEEN_LABELS_M, Canvas, LETTER_M, MARK_ORDER, NAMES_ABOVE_M, NAMES_BELOW_M, X_RANGE_M, clock_m};
use crate::run::film::{Frame, Part, headway_text};

/// Number of vehicles that are named, by their order among the actors.
const NAMED: usize = 5;

/// A label beside the road.
struct Name {
    x_m: f64,
    is_above: bool,
    text: String,
    colour: Rgba,
}

/// Writes the names of the vehicles with their speeds and headways: above the road those behind the ego or left of it,
/// below it the others. Names in one row are kept apart.
pub(super) fn write(writer: &Writer<'_>, canvas: &Canvas<'_>, times: &[Time]) -> Result<(), RecordingError> {
    let entity = "bird/names";
    let film = canvas.film;
    let rows: Vec<Vec<Name>> = (0..film.frames.len()).map(|row| names(canvas, row)).collect();
    let fixed = Points2D::update_fields().with_radii([0.05_f32]).with_draw_order(MARK_ORDER).with_show_labels(true);
    writer.write_static(entity, &fixed)?;
    let y_m = |name: &Name| {
        if name.is_above { canvas.top_m - NAMES_ABOVE_M } else { canvas.bottom_m() + NAMES_BELOW_M }
    };
    writer.write_rows(entity, times, |range| {
        let all = || rows[range.clone()].iter().flatten();
        Points2D::update_fields()
            .with_positions(all().map(|name| [name.x_m as f32, y_m(name) as f32]))
            .with_labels(all().map(|name| name.text.as_str()))
            .with_colors(all().map(|name| name.colour))
            .columns(rows[range.clone()].iter().map(Vec::len).collect::<Vec<_>>())
    })
}

/// Returns the names in a frame.
fn names(canvas: &Canvas<'_>, row: usize) -> Vec<Name> {
    let film = canvas.film;
    let frame = &film.frames[row];
    let own = &frame.states[film.ego];
    let named = (0..film.actors.len()).filter(|&actor| film.is_main(actor) && film.is_present(actor, row)).take(NAMED);
    let mut names: Vec<Name> = named
        .filter_map(|actor| {
            let (state, actor_name) = (&frame.states[actor], &film.actors[actor].name);
            let x_m = state.s_m - own.s_m;
            let is_shown = x_m > X_RANGE_M[0] && x_m < X_RANGE_M[1];
            let is_above =
                film.actors[actor].part == Part::Rear || state.d_m - own.d_m > 0.5 * film.road.lane_width_m();
            let headway = headway_of(frame, actor);
            let text = format!("{actor_name} {:.1} m/s{headway}", state.speed_mps);
            is_shown.then(|| Name {
                x_m,
                is_above,
                text,
                colour: palette::text(palette::part(film.actors[actor].part)),
            })
        })
        .collect();
    names.sort_by(|a, b| a.x_m.total_cmp(&b.x_m));
    for is_above in [true, false] {
        let free_from_m = X_RANGE_M[0] + if is_above { clock_m(canvas) } else { 0.0 };
        keep_apart(free_from_m, names.iter_mut().filter(|name| name.is_above == is_above));
    }
    names
}

/// Returns the headway that belongs to a vehicle, as it follows its speed.
fn headway_of(frame: &Frame, actor: usize) -> String {
    let margins = &frame.margins;
    let text =
        |thw_s: Measured, side: &str| thw_s.map_or(String::new(), |thw_s| format!(" · {} {side}", headway_text(thw_s)));
    if margins.lead.is_ok_and(|lead| lead.actor == actor) {
        text(margins.thw_front_s, "ahead")
    } else if margins.follower == Some(actor) {
        text(margins.thw_rear_s, "behind")
    } else {
        String::new()
    }
}

/// Moves names to the right so that the first begins at `free_from_m` or later and none covers the one before.
fn keep_apart<'n>(mut free_from_m: f64, names: impl Iterator<Item = &'n mut Name>) {
    for name in names {
        let half_m = 0.5 * LETTER_M * name.text.chars().count() as f64;
        let farthest_m = (X_RANGE_M[1] - half_m).max(free_from_m + half_m);
        name.x_m = name.x_m.max(free_from_m + half_m).min(farthest_m);
        free_from_m = name.x_m + half_m + BETWEEN_LABELS_M;
    }
}
