//! The whole encounter on one page, as in the method's figure: the road at the moments (a) to (e), the trajectories in
//! the road frame, and the plots with the moments marked.
//!
//! Of two films the first is the baseline: its curves are dashed, and its moments are not marked.

use closecall_scenarios::criticality::CRITICAL_TTCE_S;
use closecall_traffic::Time;

use super::chart::{Chart, Curve, Range, range_of};
use super::colours::{EGO, FRONT, REAR, colour};
use super::strip;
use super::svg::{Anchor, Area, Letters, Stroke, Svg};
use crate::run::film::{Film, Frame, state_word};
use closecall_simulation::outcome::CRITICAL_THW_S;

const WIDTH: f64 = 900.0;
const LEFT: f64 = 62.0;
const INNER: f64 = WIDTH - LEFT - LEGEND;
/// Room for names of curves beside the plots.
const LEGEND: f64 = 110.0;
const STRIP_HEIGHT: f64 = 74.0;
const STRIP_PERIOD: f64 = 96.0;
const CHART_HEIGHT: f64 = 112.0;
const CHART_PERIOD: f64 = 150.0;
const BAND_HEIGHT: f64 = 16.0;
const INK: &str = "#222222";
/// What the strips show of the road behind E and ahead of it [m].
const REACH_M: [f64; 2] = [-125.0, 95.0];
/// Where a film has no moments, this many instants are shown, evenly up to the critical one.
const INSTANTS: u8 = 4;
/// Plots end this long after the last moment that matters [s].
const AFTER_S: f64 = 8.0;
const BASELINE_DASH: &str = "5 3";

/// The figure of one film, or of a baseline and the film that is compared with it, as an SVG file's text.
pub fn encounter(films: &[Film]) -> String {
    let Some(film) = films.last() else { return Svg::new([WIDTH, 1.0]).finish() };
    let instants = instants(film);
    let charts = charts(films);
    let top_of_charts = 64.0 + STRIP_PERIOD * instants.len() as f64 + 34.0;
    let height = top_of_charts + CHART_PERIOD * charts.len() as f64 + 3.0 * BAND_HEIGHT + 30.0;
    let mut svg = Svg::new([WIDTH, height]);
    title(&mut svg, films);
    for (place, (time, letter, text)) in instants.iter().enumerate() {
        let top = 76.0 + STRIP_PERIOD * place as f64;
        let area = Area { left: LEFT, top, width: INNER, height: STRIP_HEIGHT };
        let row = film.frames.partition_point(|frame| frame.time <= *time).saturating_sub(1);
        let letters = |size, anchor| Letters { size, colour: INK, anchor };
        svg.text([LEFT - 12.0, top + 0.5 * STRIP_HEIGHT + 4.0], &format!("({letter})"), letters(14.0, Anchor::End));
        svg.text([LEFT, top - 5.0], &format!("{:.2} s: {text}", time.s()), letters(11.0, Anchor::Start));
        strip::draw(&mut svg, film, row, (area, REACH_M));
    }
    let marks: Vec<(f64, char)> = instants.iter().map(|(time, letter, _)| (time.s(), *letter)).collect();
    let count = charts.len();
    for (place, chart) in charts.into_iter().enumerate() {
        let is_trajectory = place == 0;
        let x_name = if place + 1 == count { Some("time [s]") } else { chart.x_name };
        let top = top_of_charts + CHART_PERIOD * place as f64;
        let area = Area { left: LEFT, top, width: INNER, height: CHART_HEIGHT };
        let moments = if is_trajectory { along_the_road(film, &instants) } else { marks.clone() };
        Chart { moments: &moments, x_name, ..chart }.draw(&mut svg, area);
    }
    bands(&mut svg, films, height - 3.0 * BAND_HEIGHT - 12.0);
    svg.finish()
}

fn title(svg: &mut Svg, films: &[Film]) {
    let letters = |size, colour| Letters { size, colour, anchor: Anchor::Start };
    let names = films.iter().map(Film::title).collect::<Vec<_>>().join(" and ");
    svg.text([LEFT, 20.0], &names, letters(13.0, INK));
    for (row, film) in films.iter().enumerate() {
        let grave = film.worst_collision().is_some();
        let line = if films.len() > 1 { format!("{}: {}", film.arm(), film.headline()) } else { film.headline() };
        svg.text([LEFT, 36.0 + 14.0 * row as f64], &line, letters(11.0, if grave { "#c40018" } else { "#1e7d32" }));
    }
}

/// The instants to show: the moments that were reached and where E collided; else some on the way to the critical one.
fn instants(film: &Film) -> Vec<(Time, char, String)> {
    let moments = film.moments().iter();
    let mut instants: Vec<_> =
        moments.map(|noted| (noted.time, noted.moment.letter(), noted.moment.text().to_owned())).collect();
    if let Some(collision) = film.worst_collision() {
        instants.push((collision.time, '!', "collision".to_owned()));
    } else if instants.is_empty() {
        let (start, critical) = (film.frames.first().map_or(Time::ZERO, |frame| frame.time), film.critical_moment());
        let at = |part: u8| start.s() + (critical - start).s() * f64::from(part) / f64::from(INSTANTS);
        instants =
            (0..=INSTANTS).map(|part| (Time::from_s(at(part)), char::from(b'1' + part), String::new())).collect();
    }
    instants.sort_by_key(|(time, ..)| *time);
    instants
}

/// Where E is at the instants [m].
fn along_the_road(film: &Film, instants: &[(Time, char, String)]) -> Vec<(f64, char)> {
    let place = |time: Time| film.frame_at(time).map(|frame| frame.states[film.ego].s_m);
    instants.iter().filter_map(|(time, letter, _)| Some((place(*time)?, *letter))).collect()
}

/// How the curves of a film are drawn: dashed where another one follows.
fn stroke(films: &[Film], place: usize, colour: &'static str) -> Stroke<'static> {
    let is_baseline = place + 1 < films.len();
    Stroke { colour, width: if is_baseline { 1.1 } else { 1.8 }, dash: is_baseline.then_some(BASELINE_DASH) }
}

/// Every plot, the trajectories first.
fn charts(films: &[Film]) -> Vec<Chart<'static>> {
    let span = span(films);
    let headways = over_time(films, &[("front", FRONT), ("rear", REAR)], |frame, which| match which {
        0 => frame.margins.thw_front_s.ok(),
        _ => frame.margins.thw_rear_s.ok(),
    });
    let gaps = over_time(films, &[("front", FRONT), ("rear", REAR)], |frame, which| match which {
        0 => frame.margins.gap_front_m.ok(),
        _ => frame.margins.gap_rear_m.ok(),
    });
    let limits = films.last().map_or(&[][..], |film| &film.acceleration_limits);
    let limits = limits.iter().map(|limit| (limit.value, limit.name.clone())).collect();
    let plot = |name, curves: Vec<Curve<'static>>, levels: Vec<(f64, String)>, [low, high]: Range, most: Range| {
        let values = curves.iter().flat_map(|curve| curve.points.iter().filter_map(|point| point.1));
        let [bottom, top] = range_of(values, [low, high]);
        Chart { name, x: span, y: [bottom.max(most[0]), top.min(most[1])], curves, levels, moments: &[], x_name: None }
    };
    let free = [f64::NEG_INFINITY, f64::INFINITY];
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
        plot("speed [m/s]", motion(films, |state| state.speed_mps), Vec::new(), least_speed(films), free),
        plot("acceleration [m/s²]", motion(films, |state| state.acceleration_mps2), limits, [-2.0, 1.0], [-12.0, 6.0]),
    ]
}

/// The range that all speeds have in common at least: an empty range at the first one.
fn least_speed(films: &[Film]) -> Range {
    let first = films.last().and_then(|film| Some(film.frames.first()?.states[film.ego].speed_mps));
    first.map_or([0.0, 1.0], |speed_mps| [speed_mps - 1.0, speed_mps + 1.0])
}

/// From the first instant of any film to some time after the last one that matters [s].
fn span(films: &[Film]) -> Range {
    let starts = films.iter().filter_map(|film| film.frames.first()).map(|frame| frame.time.s());
    let ends = films.iter().map(|film| {
        let noted = film.moments().last().map_or(film.critical_moment(), |noted| noted.time);
        film.end().s().min(noted.max(film.critical_moment()).s() + AFTER_S)
    });
    let (start, end) = (starts.fold(f64::INFINITY, f64::min), ends.fold(f64::NEG_INFINITY, f64::max));
    if start < end { [start, end] } else { [0.0, 1.0] }
}

/// The rows of a film within the span of the plots.
fn rows(films: &[Film], film: &Film) -> std::ops::Range<usize> {
    let [_, end] = span(films);
    0..film.frames.partition_point(|frame| frame.time.s() <= end)
}

/// Curves of every film; only those of the last one are named.
fn over_time(
    films: &[Film],
    curves: &[(&str, &'static str)],
    of: impl Fn(&Frame, usize) -> Option<f64>,
) -> Vec<Curve<'static>> {
    let curve = |place: usize, which: usize| {
        let (name, colour) = curves[which];
        Curve {
            name: named(films, place, name),
            stroke: stroke(films, place, colour),
            points: films[place].frames.iter().map(|frame| (frame.time.s(), of(frame, which))).collect(),
        }
    };
    (0..films.len())
        .flat_map(|place| (0..curves.len()).map(move |which| (place, which)))
        .map(|(a, b)| curve(a, b))
        .collect()
}

/// The name of a curve, with its arm where there are several.
fn named(films: &[Film], place: usize, name: &str) -> String {
    if films.len() > 1 { format!("{name} ({})", films[place].arm()) } else { name.to_owned() }
}

fn encounters(films: &[Film]) -> Vec<Curve<'static>> {
    let curve = |place: usize| Curve {
        name: named(films, place, "TTCE"),
        stroke: stroke(films, place, REAR),
        points: (0..films[place].frames.len())
            .map(|row| {
                let time_s = films[place].frames[row].time.s();
                (time_s, films[place].encounter(row).map(|encounter| encounter.ttce_s))
            })
            .collect(),
    };
    (0..films.len()).map(curve).collect()
}

/// A quantity of every vehicle over time.
fn motion(films: &[Film], of: fn(&closecall_traffic::VehicleState) -> f64) -> Vec<Curve<'static>> {
    let curve = |place: usize, actor: usize| {
        let film = &films[place];
        let is_named = place + 1 == films.len();
        Curve {
            name: if is_named { film.cast[actor].name.clone() } else { String::new() },
            stroke: stroke(films, place, colour(actor, film.ego)),
            points: (0..film.frames.len())
                .map(|row| {
                    let frame = &film.frames[row];
                    (frame.time.s(), film.is_there(actor, row).then(|| of(&frame.states[actor])))
                })
                .collect(),
        }
    };
    let actors = |place: usize| (0..films[place].cast.len()).map(move |actor| (place, actor));
    (0..films.len()).flat_map(actors).map(|(place, actor)| curve(place, actor)).collect()
}

/// The ways of all vehicles in the road frame: across the road over along it.
fn trajectories(films: &[Film]) -> Chart<'static> {
    let mut curves = Vec::new();
    for (place, film) in films.iter().enumerate() {
        for (actor, member) in film.cast.iter().enumerate() {
            let rows = rows(films, film).map(|row| {
                let state = &film.frames[row].states[actor];
                (state.s_m, film.is_there(actor, row).then_some(state.d_m))
            });
            let is_named = place + 1 == films.len();
            curves.push(Curve {
                name: if is_named { member.name.clone() } else { String::new() },
                stroke: stroke(films, place, colour(actor, film.ego)),
                points: rows.collect(),
            });
        }
    }
    let places = curves.iter().flat_map(|curve| curve.points.iter().filter(|point| point.1.is_some()));
    let (low, high) =
        places.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), point| (low.min(point.0), high.max(point.0)));
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

/// The state of the ego stack of each film, as a coloured band on the plots' time axis.
fn bands(svg: &mut Svg, films: &[Film], top: f64) {
    let [start, end] = span(films);
    let x_of = |time_s: f64| LEFT + (time_s - start) / (end - start) * INNER;
    for (row, film) in films.iter().enumerate() {
        let y = top + (BAND_HEIGHT + 4.0) * row as f64;
        let letters = |colour, anchor| Letters { size: 10.0, colour, anchor };
        svg.text([LEFT - 6.0, y + 12.0], film.arm(), letters(INK, Anchor::End));
        let states: Vec<_> = film.frames[rows(films, film)]
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
            svg.clipped(area, |svg| {
                svg.text([area.left + 4.0, y + 12.0], state_word(state), letters("#ffffff", Anchor::Start));
            });
            first = next;
        }
    }
}

fn band_colour(state: closecall_controllers::EgoState) -> &'static str {
    use closecall_controllers::EgoState;
    match state {
        EgoState::Following => "#8a8f98",
        EgoState::Increasing => EGO,
        EgoState::Holding => "#1e7d32",
        EgoState::Releasing => "#6d5fa8",
        EgoState::EmergencyBraking => "#c40018",
    }
}
