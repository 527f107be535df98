//! The timeline strip of a sample: for each arm the states of the ego, the reasons of the margin
//! increase system (MIS), and the moments.
//!
//! ```text
//!  with MIS   ┌ following ──────┬ increasing ┬ braking ┐    states of the ego stack
//!             ├ too far ──┬ engaged ─────────┴─────────┤    reasons of the MIS
//!             └─────────(b)────(c)─(d)───────┃─────────┘    moments, and collisions in red
//! ```

use closecall_controllers::EgoState;
use closecall_traffic::Time;
use maud::{Markup, html};

use super::encounter::band_colour;
use crate::run::film::{Film, ego_state_name};

/// Size of the strip of one arm (px).
const WIDTH_PX: f64 = 700.0;
const HEIGHT_PX: f64 = 74.0;
/// Height of a band, and the places of the bands and of the moments (px).
const BAND_PX: f64 = 18.0;
const STATES_PX: f64 = 4.0;
const REASONS_PX: f64 = 26.0;
const MOMENTS_PX: f64 = 58.0;
/// Width of a letter (px).
const LETTER_PX: f64 = 6.2;
const REASON: &str = "#e9eaec";
const OTHER_REASON: &str = "#d5dae1";
const COLLISION: &str = "#c40018";

/// Returns the strips of all films, on one time axis.
pub(crate) fn timeline(films: &[Film]) -> Markup {
    let [start, end] = Film::span(films);
    let axis = Axis { start_s: start.s(), span_s: (end - start).s().max(1.0) };
    html! {
        @for film in films {
            figure {
                svg viewBox={ "0 0 " (WIDTH_PX) " " (HEIGHT_PX) } role="img" aria-label={ "Timeline, " (film.arm_label()) } font-size="11" {
                    @for (state, from_s, until_s) in states(film) {
                        (axis.band(from_s, until_s, STATES_PX, ego_state_name(state), [band_colour(state), "#ffffff"]))
                    }
                    @for (index, (reason, from_s, until_s)) in reasons(film).into_iter().enumerate() {
                        (axis.band(from_s, until_s, REASONS_PX, &reason, [if index % 2 == 0 { REASON } else { OTHER_REASON }, "#222222"]))
                    }
                    @for noted in film.moments() {
                        (axis.mark(noted.time, "#55606d", 1, noted.moment.letter().map_or("·".to_owned(), String::from), &film.letters.moment_label(noted)))
                    }
                    @for collision in film.collisions() {
                        (axis.mark(collision.time, COLLISION, 2, "!".to_owned(), "collision"))
                    }
                }
                figcaption {
                    (film.arm_label()) ", " (format!("{:.1} to {:.1} s", axis.start_s, axis.start_s + axis.span_s))
                    ": states of the ego stack, reasons of the MIS, moments"
                    @for noted in film.moments() {
                        @if let Some(letter) = noted.moment.letter() { " · (" (letter) ") " (format!("{:.1} s ", noted.time.s())) (film.letters.moment_text(noted)) }
                    }
                }
            }
        }
    }
}

/// The time axis of the strips.
struct Axis {
    start_s: f64,
    span_s: f64,
}

impl Axis {
    fn x(&self, time_s: f64) -> f64 {
        (time_s - self.start_s) / self.span_s * WIDTH_PX
    }

    /// Returns a band with its text, if the text has room. The colours belong to the band and to
    /// the text.
    fn band(&self, from_s: f64, until_s: f64, top_px: f64, text: &str, [fill, ink]: [&str; 2]) -> Markup {
        let (left, width) = (self.x(from_s), self.x(until_s) - self.x(from_s));
        let has_room = LETTER_PX * text.chars().count() as f64 + 8.0 < width;
        html! {
            rect x=(format!("{left:.1}")) y=(top_px) width=(format!("{:.1}", width.max(0.5))) height=(BAND_PX) fill=(fill) {
                title { (text) (format!(", {from_s:.1} to {until_s:.1} s")) }
            }
            @if has_room { text x=(format!("{:.1}", left + 4.0)) y=(top_px + 13.0) fill=(ink) { (text) } }
        }
    }

    fn mark(&self, time: Time, colour: &str, width: u8, letter: String, text: &str) -> Markup {
        let x = format!("{:.1}", self.x(time.s()));
        html! {
            line x1=(x) x2=(x) y1="0" y2=(MOMENTS_PX) stroke=(colour) stroke-width=(width) {}
            text x=(x) y=(MOMENTS_PX + 11.0) text-anchor="middle" fill=(colour) { (letter) title { (text) (format!(", {:.2} s", time.s())) } }
        }
    }
}

/// Returns the states of the ego stack with their intervals (s).
fn states(film: &Film) -> Vec<(EgoState, f64, f64)> {
    let mut spans: Vec<(EgoState, f64, f64)> = Vec::new();
    for frame in &film.frames {
        let (Some(command), time_s) = (frame.command, frame.time.s()) else { continue };
        match spans.last_mut() {
            Some((state, _, until_s)) if *state == command.state => *until_s = time_s,
            last => {
                if let Some((_, _, until_s)) = last {
                    *until_s = time_s;
                }
                spans.push((command.state, time_s, time_s));
            }
        }
    }
    spans
}

/// Returns the reasons of the MIS with their intervals (s).
fn reasons(film: &Film) -> Vec<(String, f64, f64)> {
    let mis = film.outcome().and_then(|outcome| outcome.mis.as_ref().ok());
    let spans = mis.map_or(&[][..], |mis| &mis.reasons);
    spans.iter().map(|span| (span.reason.to_string(), span.from_s, span.until_s)).collect()
}
