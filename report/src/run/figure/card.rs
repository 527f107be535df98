//! The incident card of a sample: one page for a ticket, which loads nothing. It has the event and
//! its cause in one sentence for each arm, by whom each collision was avoidable, both arms from
//! above in real time, the headways, and the command that runs the sample again.
//!
//! The animation is SMIL, part of SVG, and needs no script.

use std::fmt::Write as _;

use closecall_traffic::{Measured, Time};
use maud::{Markup, html};

use super::colours::{FRONT, REAR, colour};
use super::is_another;
use super::road::{REACH_M, STRETCH, road};
use crate::campaign::html::page::document;
use crate::run::film::{Film, Frame, Part};
use closecall_scenarios::outcome::CRITICAL_THW_S;

/// Time shown before and after the moment at which the recording opens.
const BEFORE: Time = Time::from_ms(12_000);
const AFTER: Time = Time::from_ms(3_000);
/// Time between two positions of a vehicle. The browser moves it evenly in between.
const STEP: Time = Time::from_ms(200);
/// Distance at which a vehicle is out of sight (m).
const AWAY_M: f64 = 400.0;
/// Size of the letter on a vehicle (m in the picture): 11 px on a page of 390 px.
const LETTER_M: f64 = 3.7;
/// Distance of the name of a vehicle that collides above its body (m in the picture).
const NAME_ABOVE_M: f64 = 0.4;
/// Height of a capital letter as a share of its size.
const CAPITAL: f64 = 0.73;
/// Size of a plot of headways, its font, and its margin (px). It fits a page of 390 px.
const PLOT_PX: [f64; 2] = [380.0, 150.0];
const FONT_PX: f64 = 12.0;
const MARGIN_PX: f64 = 26.0;
/// Base line of the title of a plot of headways (px): above the plot, which begins at half the
/// margin.
const TITLE_BASE_PX: f64 = 10.0;
/// Upper end of the axis of headways (s).
const MOST_THW_S: f64 = 4.0;
const CRITICAL: &str = "#c40018";

/// Returns the card as a page. `replay` is the command that runs the sample again.
pub(crate) fn card(films: &[Film], replay: &str) -> String {
    let Some(tested) = films.last() else { return String::new() };
    let window = Window::of(films);
    let sample = tested.outcome().map_or_else(String::new, |outcome| {
        format!("{} · seed {} · sample {}", outcome.scenario, outcome.seed, outcome.sample)
    });
    let verdict = Film::verdict_word(films);
    let body = html! {
        h1 { (verdict) ": " (sample) }
        (sections(films, window))
        p { "Run it again, in the campaign's folder:" }
        pre.command tabindex="0" { (replay) }
    };
    document(&format!("{verdict}: {sample}"), &body).into_string()
}

/// Returns both arms from above with their headways, as a part of a page.
pub(crate) fn incident(films: &[Film]) -> Markup {
    sections(films, Window::of(films))
}

fn sections(films: &[Film], window: Window) -> Markup {
    html! {
        @for film in films {
            section.incident {
                h2 { (film.arm_label()) }
                @if let Some(sentence) = film.sentence() {
                    p.failure[film.worst_collision().is_some()] { (sentence.to_string()) }
                }
                @for text in film.avoidable_texts() { p { (text) } }
                figure { (road(film, &vehicles(film, window))) (headways(film, window)) }
            }
        }
        p.note {
            "From above, in real time, from " (format!("{:.1}", window.from.s())) " to " (format!("{:.1}", window.to.s()))
            " s: E is the ego, F the lead vehicle, R the rear vehicle; other traffic is grey, with a name where it collides. The road is drawn twice as wide as it is. "
            "Below: time headway in front (orange) and behind (pink), with the threshold of 0.9 s."
        }
    }
}

/// The time that a card shows.
#[derive(Clone, Copy)]
struct Window {
    from: Time,
    to: Time,
}

impl Window {
    /// Returns the time around the moment at which a recording of the films opens.
    fn of(films: &[Film]) -> Self {
        let shown = Film::shown_moment(films);
        let [start, end] = Film::span(films);
        Self { from: (shown - BEFORE).max(start), to: (shown + AFTER).min(end) }
    }

    /// Returns the times of the positions.
    fn times(self) -> impl Iterator<Item = Time> {
        let steps = (self.to - self.from).ns() / STEP.ns();
        (0..=steps).map(move |step| self.from + STEP * step)
    }

    /// Returns the duration of the animation as SVG writes it.
    fn duration(self) -> String {
        format!("{:.1}s", (self.to - self.from).s().max(STEP.s()))
    }
}

/// Returns the index of the frame at a time: the first or the last one outside of the film.
fn frame_index(film: &Film, time: Time) -> usize {
    film.frames.partition_point(|frame| frame.time <= time).saturating_sub(1)
}

/// Returns the vehicles that move.
fn vehicles(film: &Film, window: Window) -> Markup {
    html! { @for actor in 0..film.actors.len() { (vehicle(film, actor, window)) } }
}

/// Returns a vehicle that moves. One that never comes into view has no place on the card.
fn vehicle(film: &Film, actor: usize, window: Window) -> Markup {
    let size = &film.actors[actor].vehicle.dimensions;
    let [length_m, width_m] = [size.length_m, size.width_m * STRETCH];
    let mut is_seen = false;
    let mut positions = String::new();
    for time in window.times() {
        let index = frame_index(film, time);
        let Some(frame) = film.frames.get(index) else { continue };
        let ahead_m = frame.states[actor].s_m - frame.states[film.ego].s_m;
        let is_there = film.is_present(actor, index) && ahead_m.abs() < AWAY_M;
        is_seen |= is_there && ahead_m > REACH_M[0] - length_m && ahead_m < REACH_M[1] + length_m;
        let x_m = if is_there { ahead_m } else { AWAY_M };
        let separator = if positions.is_empty() { "" } else { ";" };
        // Writing to a string cannot fail.
        let _ = write!(positions, "{separator}{x_m:.1} {:.1}", -frame.states[actor].d_m * STRETCH);
    }
    if !is_seen {
        return Markup::default();
    }
    let letter = match film.actors[actor].part {
        Part::Ego => "E",
        Part::Lead => "F",
        Part::Rear => "R",
        Part::Other(_) | Part::Background => "",
    };
    html! {
        g {
            animateTransform attributeName="transform" type="translate" dur=(window.duration()) repeatCount="indefinite" values=(positions) {}
            rect x=(format!("{:.1}", -0.5 * length_m)) y=(format!("{:.1}", -0.5 * width_m)) width=(format!("{length_m:.1}"))
                height=(format!("{width_m:.1}")) rx="0.6" fill=(colour(film, actor)) { title { (film.actors[actor].name) } }
            text y=(format!("{:.2}", 0.5 * CAPITAL * LETTER_M)) font-size=(LETTER_M) text-anchor="middle" fill="#ffffff" { (letter) }
            // Whom the sentence names is named here, too. All other traffic has no name.
            @if letter.is_empty() && film.is_labelled(actor) {
                text y=(format!("{:.2}", -0.5 * width_m - NAME_ABOVE_M)) font-size=(LETTER_M) text-anchor="middle" fill=(colour(film, actor)) {
                    (film.vehicle_letter(actor))
                }
            }
        }
    }
}

/// Returns a curve as the path of an SVG file. It is interrupted where there is no point, and where
/// the next point belongs to another vehicle.
fn path(points: impl Iterator<Item = Option<(Option<usize>, [f64; 2])>>) -> String {
    let mut path = String::new();
    let (mut is_open, mut last) = (false, None);
    for point in points {
        let Some((vehicle, [x, y])) = point else {
            is_open = false;
            continue;
        };
        let goes_on = is_open && !is_another(last, vehicle);
        // Writing to a string cannot fail.
        let _ = write!(path, "{}{x:.0} {y:.1} ", if goes_on { 'L' } else { 'M' });
        (is_open, last) = (true, vehicle);
    }
    path
}

/// Returns the headways over time, with a line that moves along.
fn headways(film: &Film, window: Window) -> Markup {
    let [width, height] = PLOT_PX;
    let span_s = (window.to - window.from).s().max(STEP.s());
    let x = |time: Time| MARGIN_PX + (time - window.from).s() / span_s * (width - 2.0 * MARGIN_PX);
    let y = |thw_s: f64| height - MARGIN_PX - (thw_s.min(MOST_THW_S) / MOST_THW_S) * (height - 1.5 * MARGIN_PX);
    let curve = |headway: fn(&Frame) -> (Option<usize>, Measured)| {
        path(window.times().map(|time| {
            let (vehicle, thw_s) = headway(film.frames.get(frame_index(film, time))?);
            Some((vehicle, [x(time), y(thw_s.ok()?)]))
        }))
    };
    let (left, right) = (format!("{:.0}", x(window.from)), format!("{:.0}", x(window.to)));
    let collisions = film.collisions().iter().map(|collision| collision.time);
    let shown = collisions.filter(|time| *time >= window.from && *time <= window.to);
    html! {
        svg viewBox={ "0 0 " (width) " " (height) } role="img" aria-label={ "Time headways, " (film.arm_label()) } {
            @for thw_s in [0.0, 1.0, 2.0, 3.0, 4.0] {
                line x1=(left) x2=(right) y1=(format!("{:.1}", y(thw_s))) y2=(format!("{:.1}", y(thw_s))) stroke="#dfe4ea" {}
                text x="20" y=(format!("{:.1}", y(thw_s) + 4.0)) font-size=(FONT_PX) text-anchor="end" fill="#55606d" { (format!("{thw_s:.0}")) }
            }
            text x=(left) y=(TITLE_BASE_PX) font-size=(FONT_PX) fill="#55606d" { "time headway [s]" }
            line x1=(left) x2=(right) y1=(format!("{:.1}", y(CRITICAL_THW_S))) y2=(format!("{:.1}", y(CRITICAL_THW_S))) stroke=(CRITICAL) stroke-dasharray="4 3" {}
            path fill="none" stroke=(FRONT) stroke-width="2" d=(curve(|frame| (frame.lead(), frame.margins.thw_front_s))) {}
            path fill="none" stroke=(REAR) stroke-width="2" d=(curve(|frame| (frame.follower(), frame.margins.thw_rear_s))) {}
            @for time in shown {
                line x1=(format!("{:.0}", x(time))) x2=(format!("{:.0}", x(time))) y1=(0.5 * MARGIN_PX) y2=(height - MARGIN_PX) stroke=(CRITICAL) stroke-width="2" {}
            }
            line x1=(left) x2=(left) y1=(0.5 * MARGIN_PX) y2=(height - MARGIN_PX) stroke="#1d242c" {
                @for end in ["x1", "x2"] {
                    animate attributeName=(end) from=(left) to=(right) dur=(window.duration()) repeatCount="indefinite" {}
                }
            }
            text x=(left) y=(height - 8.0) font-size=(FONT_PX) fill="#55606d" { (format!("{:.1} s", window.from.s())) }
            text x=(right) y=(height - 8.0) font-size=(FONT_PX) text-anchor="end" fill="#55606d" { (format!("{:.1} s", window.to.s())) }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::road::REACH_M;
    use super::{FONT_PX, LETTER_M, PLOT_PX, path};

    #[test]
    fn letters_and_ticks_are_legible_in_the_frame_of_a_phone() {
        // The frame of a page of 390 px.
        let frame_px = 360.0;
        assert!(LETTER_M * frame_px / (REACH_M[1] - REACH_M[0]) >= 11.0);
        assert!(FONT_PX * frame_px / PLOT_PX[0] >= 11.0);
    }

    #[test]
    fn a_curve_does_not_join_the_headways_of_two_vehicles() {
        let point = |vehicle, x| Some((vehicle, [x, 1.0]));
        let of_two = [point(Some(2), 0.0), point(Some(2), 1.0), point(Some(3), 2.0), point(Some(3), 3.0)];
        assert_eq!(path(of_two.into_iter()), "M0 1.0 L1 1.0 M2 1.0 L3 1.0 ");
        let with_gap = [point(Some(2), 0.0), None, point(Some(2), 2.0), point(Some(2), 3.0)];
        assert_eq!(path(with_gap.into_iter()), "M0 1.0 M2 1.0 L3 1.0 ");
        // A vehicle in the path is not yet in the lane.
        let without_name = [point(None, 0.0), point(Some(2), 1.0)];
        assert_eq!(path(without_name.into_iter()), "M0 1.0 L1 1.0 ");
    }
}
