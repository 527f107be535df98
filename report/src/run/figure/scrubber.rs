//! The view from above of each film, to be moved along in time by a slider, for a page that is
//! opened as a file.
//!
//! The page's script moves the vehicles. The positions stand in the page, [`EVERY`]-th frame only.

use std::fmt::Write as _;

use maud::{Markup, PreEscaped, html};

use super::colours::{colour, legend_name};
use super::road::{STRETCH, road};
use crate::run::film::Film;

/// Number of frames between two positions of the slider.
const EVERY: usize = 5;
/// Returns the views of the films below each other, with one slider, which stands at the critical
/// moment of the last.
pub(crate) fn scrubber(films: &[Film]) -> Markup {
    let last = |film: &Film| film.frames.len().saturating_sub(1) / EVERY;
    let Some(tested) = films.last() else { return Markup::default() };
    let critical = tested.critical_moment();
    let start = tested.frames.partition_point(|frame| frame.time < critical) / EVERY;
    let rows: Vec<String> = films.iter().map(rows).collect();
    html! {
        div.scrubber hidden {
            @for film in films {
                p { strong { (film.arm_label()) } ": " output {} }
                (road(film, &boxes(film)))
            }
            label {
                "Time " input type="range" min="0" max=(films.iter().map(last).max().unwrap_or(0)) value=(start);
            }
            p.legend {
                @for actor in 0..tested.actors.len() {
                    @let name = legend_name(tested, actor);
                    @if !name.is_empty() { span.key style={ "--key:" (colour(tested, actor)) } { (name) } }
                }
            }
            script type="application/json" { (PreEscaped(format!("[{}]", rows.join(",")))) }
        }
    }
}

/// Returns a box for each vehicle.
fn boxes(film: &Film) -> Markup {
    html! {
        @for (index, actor) in film.actors.iter().enumerate() {
            @let size = &actor.vehicle.dimensions;
            @let [length_m, width_m] = [size.length_m, size.width_m * STRETCH];
            rect x=(format!("{:.1}", -0.5 * length_m)) y=(format!("{:.1}", -0.5 * width_m))
                width=(format!("{length_m:.1}")) height=(format!("{width_m:.1}")) rx="0.6" fill=(colour(film, index)) {
                title { (actor.name) }
            }
        }
    }
}

/// Returns one row per position of the slider: time, front and rear headway, then two coordinates
/// per vehicle.
fn rows(film: &Film) -> String {
    let mut rows = String::from("[");
    for (number, (index, frame)) in film.frames.iter().enumerate().step_by(EVERY).enumerate() {
        let headway =
            |thw_s: closecall_traffic::Measured| thw_s.map_or("null".to_owned(), |thw_s| format!("{thw_s:.2}"));
        let margins = &frame.margins;
        let (front, rear) = (headway(margins.thw_front_s), headway(margins.thw_rear_s));
        let comma = if number > 0 { "," } else { "" };
        // Writing to a string cannot fail.
        let _ = write!(rows, "{comma}[{:.2},{front},{rear}", frame.time.s());
        for (actor, state) in frame.states.iter().enumerate() {
            let ahead_m = state.s_m - frame.states[film.ego].s_m;
            let _ = match film.is_present(actor, index) {
                true => write!(rows, ",{ahead_m:.1},{:.1}", -state.d_m * STRETCH),
                false => write!(rows, ",null,null"),
            };
        }
        rows.push(']');
    }
    rows.push(']');
    rows
}
