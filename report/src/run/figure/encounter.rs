//! The figure of a whole encounter, laid out like the paper's: the road at the moments (a) to (e),
//! the trajectories in the road frame, and plots over time with the moments marked.
//!
//! If there are two films, the first is the baseline. Its curves are dashed, its vehicles are
//! outlines, and its moments are not marked. Before the other strips, the figure shows the road at
//! the baseline's hazard, moment (a), and at its collision.

use closecall_recorded::criticality::CRITICAL_TTCE_S;
use closecall_traffic::Time;

use super::chart::{Chart, Curve, Range, range_of};
use super::colours::{EGO, FRONT, REAR, colour, legend_name};
use super::svg::{Anchor, Area, Stroke, Svg, TextStyle};
use super::{points_over_time, strip};
use crate::run::film::{Film, Frame, ego_state_name};
use closecall_scenarios::outcome::{CRITICAL_THW_S, Moment};

const WIDTH: f64 = 900.0;
const LEFT: f64 = 78.0;
const INNER: f64 = WIDTH - LEFT - LEGEND;
/// Width of the legend beside the plots (px).
const LEGEND: f64 = 158.0;
const STRIP_HEIGHT: f64 = 74.0;
const STRIP_PERIOD: f64 = 96.0;
const CHART_HEIGHT: f64 = 112.0;
const CHART_PERIOD: f64 = 150.0;
const BAND_HEIGHT: f64 = 16.0;
/// Width of a letter in a band of states (px).
const LETTER_PX: f64 = 6.0;
const INK: &str = "#222222";
/// Rear and front end of the road that the strips show, relative to the ego (m).
const REACH_M: [f64; 2] = [-125.0, 95.0];
/// Number of equal intervals up to the critical moment whose ends are shown if a film has no
/// moments.
const FALLBACK_INTERVALS: u8 = 4;
/// Time that the plots show after the last marked moment (s).
const AFTER_S: f64 = 8.0;
const BASELINE_DASH: &str = "5 3";

/// Returns the figure of one film, or of a baseline and the film compared with it, as the text of
/// an SVG file.
pub fn encounter(films: &[Film]) -> String {
    let Some(film) = films.last() else { return Svg::new([WIDTH, 1.0]).finish() };
    let instants = instants(film);
    let baseline = films.first().filter(|_| films.len() > 1);
    let charts = charts(films);
    let of_baseline: Vec<Instant> = baseline.map(worst_instants).unwrap_or_default();
    let tested = instants.iter().map(|instant| ((film, baseline), instant));
    let strips = of_baseline.iter().filter_map(|instant| Some(((baseline?, None), instant))).chain(tested);
    let strips: Vec<((&Film, Option<&Film>), &Instant)> = strips.collect();
    let top_of_charts = 64.0 + STRIP_PERIOD * strips.len() as f64 + 34.0;
    let height = top_of_charts + CHART_PERIOD * charts.len() as f64 + 3.0 * BAND_HEIGHT + 30.0;
    let mut svg = Svg::new([WIDTH, height]);
    title(&mut svg, films);
    let count = strips.len();
    for (index, ((film, other), (time, letter, text))) in strips.into_iter().enumerate() {
        let top = 76.0 + STRIP_PERIOD * index as f64;
        let area = Area { left: LEFT, top, width: INNER, height: STRIP_HEIGHT };
        // For a collision, the figure shows the first frame in which the vehicles touch.
        let is_collision = film.worst_collision().is_some_and(|collision| collision.time == *time);
        let frames_before =
            film.frames.partition_point(|frame| frame.time < *time || !is_collision && frame.time == *time);
        let last = film.frames.len().saturating_sub(1);
        let frame_index = if is_collision { frames_before.min(last) } else { frames_before.saturating_sub(1) };
        let style = |size, anchor| TextStyle { size, colour: INK, anchor };
        svg.text([LEFT - 12.0, top + 0.5 * STRIP_HEIGHT + 4.0], &format!("({letter})"), style(14.0, Anchor::End));
        svg.text([LEFT, top - 5.0], &format!("{:.2} s: {text}", time.s()), style(11.0, Anchor::Start));
        strip::draw(&mut svg, film, other, frame_index, area, REACH_M);
        if index + 1 == count {
            strip::scale(&mut svg, area, REACH_M);
        }
        if let Some(other) = other {
            let at = [LEFT + INNER, top - 5.0];
            svg.text(at, &format!("outlines: {}", other.arm_label()), style(10.0, Anchor::End));
        }
    }
    let marks: Vec<(f64, char)> = instants.iter().map(|(time, letter, _)| (time.s(), *letter)).collect();
    let chart_count = charts.len();
    for (index, chart) in charts.into_iter().enumerate() {
        let is_trajectory = index == 0;
        let x_name = if index + 1 == chart_count { Some("time [s]") } else { chart.x_name };
        let top = top_of_charts + CHART_PERIOD * index as f64;
        let area = Area { left: LEFT, top, width: INNER, height: CHART_HEIGHT };
        let moments = if is_trajectory { ego_positions(film, &instants) } else { marks.clone() };
        Chart { moments: &moments, x_name, ..chart }.draw(&mut svg, area);
    }
    bands(&mut svg, films, height - 3.0 * BAND_HEIGHT - 12.0);
    svg.finish()
}

fn title(svg: &mut Svg, films: &[Film]) {
    let style = |size, colour| TextStyle { size, colour, anchor: Anchor::Start };
    svg.text([LEFT, 20.0], &format!("{} · {}", Film::verdict_word(films), names(films)), style(13.0, INK));
    for (row, film) in films.iter().enumerate() {
        let has_collision = film.worst_collision().is_some();
        let result = film.result().unwrap_or_else(|| film.headline());
        svg.text(
            [LEFT, 36.0 + 14.0 * row as f64],
            &format!("{}: {result}", film.arm_label()),
            style(11.0, if has_collision { "#c40018" } else { "#1e7d32" }),
        );
    }
}

/// Returns the titles of the films. A pair of one sample has its scenario, its seed and its number
/// once: the line has no room for them twice.
fn names(films: &[Film]) -> String {
    let outcomes = if let [baseline, tested] = films { baseline.outcome().zip(tested.outcome()) } else { None };
    match outcomes {
        Some((a, b)) if a.scenario == b.scenario && (a.seed, a.sample) == (b.seed, b.sample) => {
            let arms = films.iter().map(Film::arm).collect::<Vec<_>>().join(" and ");
            format!("{} · {arms} · seed {} · sample {}", a.scenario, a.seed, a.sample)
        }
        _ => films.iter().map(Film::title).collect::<Vec<_>>().join(" and "),
    }
}

/// A time to show, with its letter and text.
type Instant = (Time, char, String);

/// Returns moment (a) and the collision of the baseline, if it reached them.
fn worst_instants(baseline: &Film) -> Vec<Instant> {
    let arm = baseline.arm_label();
    let hazard = baseline.moments().iter().find(|noted| noted.moment == Moment::Hazard);
    let hazard = hazard.and_then(|noted| {
        Some((noted.time, noted.moment.letter()?, format!("{} ({arm})", baseline.letters.moment_text(noted))))
    });
    let collision = baseline.worst_collision().map(|collision| (collision.time, '!', format!("collision ({arm})")));
    hazard.into_iter().chain(collision).collect()
}

/// Returns the instants to show, in order of time, each with its letter and text: the moments of
/// the paper that the run reached, and the collision. If there are none, instants at equal
/// distances up to the critical moment are returned.
fn instants(film: &Film) -> Vec<Instant> {
    let moments = film.moments().iter();
    let mut instants: Vec<_> = moments
        .filter_map(|noted| Some((noted.time, noted.moment.letter()?, film.letters.moment_text(noted))))
        .collect();
    if let Some(collision) = film.worst_collision() {
        instants.push((collision.time, '!', "collision".to_owned()));
    } else if instants.is_empty() {
        let (start, critical) = (film.frames.first().map_or(Time::ZERO, |frame| frame.time), film.critical_moment());
        let at = |part: u8| start.s() + (critical - start).s() * f64::from(part) / f64::from(FALLBACK_INTERVALS);
        instants = (0..=FALLBACK_INTERVALS)
            .map(|part| (Time::from_s(at(part)), char::from(b'1' + part), String::new()))
            .collect();
    }
    instants.sort_by_key(|(time, ..)| *time);
    instants
}

/// Returns the position of the ego along the road (m) at each instant, with the letter of the
/// instant.
fn ego_positions(film: &Film, instants: &[Instant]) -> Vec<(f64, char)> {
    let ego_s_m = |time: Time| film.frame_at(time).map(|frame| frame.states[film.ego].s_m);
    instants.iter().filter_map(|(time, letter, _)| Some((ego_s_m(*time)?, *letter))).collect()
}

/// Returns the line style of the curves of a film: thin and dashed for the baseline.
fn stroke(films: &[Film], film_index: usize, colour: &'static str) -> Stroke<'static> {
    let is_baseline = film_index + 1 < films.len();
    Stroke { colour, width: if is_baseline { 1.1 } else { 1.8 }, dash: is_baseline.then_some(BASELINE_DASH) }
}

/// Returns all charts, with the trajectories first.
fn charts(films: &[Film]) -> Vec<Chart<'static>> {
    let span = span(films);
    let headways = over_time(films, &[("front", FRONT), ("rear", REAR)], |frame, curve| match curve {
        0 => frame.margins.thw_front_s.ok(),
        _ => frame.margins.thw_rear_s.ok(),
    });
    let gaps = over_time(films, &[("front", FRONT), ("rear", REAR)], |frame, curve| match curve {
        0 => frame.margins.gap_front_m.ok(),
        _ => frame.margins.gap_rear_m.ok(),
    });
    let limits = films.last().map_or(&[][..], |film| &film.acceleration_limits);
    let limits = limits.iter().map(|limit| (limit.value, limit.name.clone())).collect();
    let plot = |name, curves: Vec<Curve<'static>>, levels: Vec<(f64, String)>, [low, high]: Range, limits: Range| {
        let values = curves.iter().flat_map(|curve| curve.points.iter().filter_map(|point| point.1));
        let [bottom, top] = range_of(values, [low, high]);
        Chart {
            name,
            x: span,
            y: [bottom.max(limits[0]), top.min(limits[1])],
            curves,
            levels,
            moments: &[],
            x_name: None,
        }
    };
    let unlimited = [f64::NEG_INFINITY, f64::INFINITY];
    vec![
        trajectories(films),
        plot("time headway [s]", headways, vec![(CRITICAL_THW_S, "critical 0.9 s".to_owned())], [0.0, 1.0], [0.0, 5.0]),
        plot("gap [m]", gaps, Vec::new(), [0.0, 10.0], [0.0, 150.0]),
        plot(
            "time to closest encounter, TTCE [s]",
            encounters(films),
            vec![(CRITICAL_TTCE_S, "critical 2.6 s".to_owned())],
            [0.0, 3.0],
            [0.0, 10.0],
        ),
        plot("speed [m/s]", motion(films, |state| state.speed_mps), Vec::new(), initial_speed_range(films), unlimited),
        plot("acceleration [m/s²]", motion(films, |state| state.acceleration_mps2), limits, [-2.0, 1.0], [-12.0, 6.0]),
    ]
}

/// Returns the range that the speed axis contains at least: 1 m/s below and above the initial speed
/// of the ego.
fn initial_speed_range(films: &[Film]) -> Range {
    let first = films.last().and_then(|film| Some(film.frames.first()?.states[film.ego].speed_mps));
    first.map_or([0.0, 1.0], |speed_mps| [speed_mps - 1.0, speed_mps + 1.0])
}

/// Returns the time span of the plots (s). It begins at the first instant of any film. It ends
/// [`AFTER_S`] after the last of the moments and critical moments, or at the end of the films if
/// that comes first.
fn span(films: &[Film]) -> Range {
    let starts = films.iter().filter_map(|film| film.frames.first()).map(|frame| frame.time.s());
    let ends = films.iter().map(|film| {
        let last_moment = film.moments().last().map_or(film.critical_moment(), |noted| noted.time);
        film.end().s().min(last_moment.max(film.critical_moment()).s() + AFTER_S)
    });
    let (start, end) = (starts.fold(f64::INFINITY, f64::min), ends.fold(f64::NEG_INFINITY, f64::max));
    if start < end { [start, end] } else { [0.0, 1.0] }
}

/// Returns the indices of the frames of a film within the time span of the plots.
fn frames_shown(films: &[Film], film: &Film) -> std::ops::Range<usize> {
    let [_, end] = span(films);
    0..film.frames.partition_point(|frame| frame.time.s() <= end)
}

/// Returns a curve over time for each film and each of `curves`, which are pairs of a name and a
/// colour: the first of the vehicle ahead, the second of the vehicle behind. `value` reads the
/// value of the curve with the given index from a frame. A curve is interrupted where another
/// vehicle begins.
fn over_time(
    films: &[Film],
    curves: &[(&str, &'static str)],
    value: impl Fn(&Frame, usize) -> Option<f64>,
) -> Vec<Curve<'static>> {
    let curve = |film_index: usize, curve_index: usize| {
        let (name, colour) = curves[curve_index];
        let vehicle: fn(&Frame) -> Option<usize> = if curve_index == 0 { Frame::lead } else { Frame::follower };
        Curve {
            name: named(films, film_index, name),
            stroke: stroke(films, film_index, colour),
            points: points_over_time(&films[film_index].frames, vehicle, |frame| value(frame, curve_index)),
        }
    };
    (0..films.len())
        .flat_map(|film_index| (0..curves.len()).map(move |curve_index| (film_index, curve_index)))
        .map(|(a, b)| curve(a, b))
        .collect()
}

/// Returns the name of a curve, followed by the name of its arm if there are several films.
fn named(films: &[Film], film_index: usize, name: &str) -> String {
    if films.len() > 1 { format!("{name} ({})", films[film_index].arm_label()) } else { name.to_owned() }
}

/// Returns the curve of the time to closest encounter for each film.
fn encounters(films: &[Film]) -> Vec<Curve<'static>> {
    let curve = |film_index: usize| Curve {
        name: named(films, film_index, "TTCE"),
        stroke: stroke(films, film_index, REAR),
        points: (0..films[film_index].frames.len())
            .map(|index| {
                let time_s = films[film_index].frames[index].time.s();
                (time_s, films[film_index].soonest_encounter(index).map(|encounter| encounter.ttce_s))
            })
            .collect(),
    };
    (0..films.len()).map(curve).collect()
}

/// Returns a quantity of each vehicle over time for each film. Only the curves of the last film
/// have names.
fn motion(films: &[Film], value: fn(&closecall_traffic::VehicleState) -> f64) -> Vec<Curve<'static>> {
    let curve = |film_index: usize, actor: usize| {
        let film = &films[film_index];
        let is_named = film_index + 1 == films.len();
        Curve {
            name: if is_named { legend_name(film, actor) } else { String::new() },
            stroke: stroke(films, film_index, colour(film, actor)),
            points: (0..film.frames.len())
                .map(|index| {
                    let frame = &film.frames[index];
                    (frame.time.s(), film.is_present(actor, index).then(|| value(&frame.states[actor])))
                })
                .collect(),
        }
    };
    let actors = |film_index: usize| (0..films[film_index].actors.len()).map(move |actor| (film_index, actor));
    (0..films.len()).flat_map(actors).map(|(film_index, actor)| curve(film_index, actor)).collect()
}

/// Returns the trajectories of all vehicles in the road frame: d over s.
fn trajectories(films: &[Film]) -> Chart<'static> {
    let mut curves = Vec::new();
    for (film_index, film) in films.iter().enumerate() {
        for actor in 0..film.actors.len() {
            let points = frames_shown(films, film).map(|index| {
                let state = &film.frames[index].states[actor];
                (state.s_m, film.is_present(actor, index).then_some(state.d_m))
            });
            let is_named = film_index + 1 == films.len();
            curves.push(Curve {
                name: if is_named { legend_name(film, actor) } else { String::new() },
                stroke: stroke(films, film_index, colour(film, actor)),
                points: points.collect(),
            });
        }
    }
    let points = curves.iter().flat_map(|curve| curve.points.iter().filter(|point| point.1.is_some()));
    let (low, high) =
        points.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), point| (low.min(point.0), high.max(point.0)));
    let right_m = films.iter().map(|film| film.road.right_edge_m()).fold(-1.0, f64::min);
    Chart {
        name: "trajectories in the road frame: d [m] over s [m]; letters stand where E is",
        x: if low < high { [low, high] } else { [0.0, 1.0] },
        y: [right_m, 0.0],
        curves,
        levels: Vec::new(),
        moments: &[],
        x_name: Some("s [m]"),
    }
}

/// Draws the state of the ego stack of each film as a coloured band below the plots, on their time
/// axis.
fn bands(svg: &mut Svg, films: &[Film], top: f64) {
    let [start, end] = span(films);
    let x_of = |time_s: f64| LEFT + (time_s - start) / (end - start) * INNER;
    for (row, film) in films.iter().enumerate() {
        let y = top + (BAND_HEIGHT + 4.0) * row as f64;
        let style = |colour, anchor| TextStyle { size: 10.0, colour, anchor };
        svg.text([LEFT - 6.0, y + 12.0], film.arm_label(), style(INK, Anchor::End));
        let states: Vec<_> = film.frames[frames_shown(films, film)]
            .iter()
            .filter_map(|frame| Some((frame.time.s(), frame.command?.state)))
            .collect();
        let mut first = 0;
        while first < states.len() {
            let state = states[first].1;
            let next = (first..states.len()).find(|&at| states[at].1 != state).unwrap_or(states.len());
            let until = states.get(next).or(states.last()).map_or(start, |at| at.0);
            let area = Area {
                left: x_of(states[first].0),
                top: y,
                width: x_of(until) - x_of(states[first].0),
                height: BAND_HEIGHT,
            };
            svg.rect(area, band_colour(state));
            let name = ego_state_name(state);
            if LETTER_PX * name.len() as f64 + 8.0 < area.width {
                svg.text([area.left + 4.0, y + 12.0], name, style("#ffffff", Anchor::Start));
            }
            first = next;
        }
    }
}

/// Returns the colour of a state of the ego stack.
pub(super) fn band_colour(state: closecall_controllers::EgoState) -> &'static str {
    use closecall_controllers::EgoState;
    match state {
        EgoState::Following => "#8a8f98",
        EgoState::Increasing => EGO,
        EgoState::Holding => "#1e7d32",
        EgoState::Releasing => "#6d5fa8",
        EgoState::EmergencyBraking => "#c40018",
    }
}
