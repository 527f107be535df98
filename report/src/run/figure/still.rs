//! A small picture of the critical moment of a film: the road from above, and the time headways up
//! to then and beyond.

use super::chart::{Chart, Curve, range_of};
use super::colours::{FRONT, REAR};
use super::svg::{Anchor, Area, Stroke, Svg, TextStyle};
use super::{points_over_time, strip};
use crate::run::film::{Film, Frame};
use closecall_scenarios::outcome::CRITICAL_THW_S;

const SIZE: [f64; 2] = [560.0, 330.0];
const STRIP: Area = Area { left: 10.0, top: 46.0, width: 540.0, height: 96.0 };
const CHART: Area = Area { left: 40.0, top: 172.0, width: 430.0, height: 120.0 };
/// Ends of the visible part of the road, relative to the ego (m).
const REACH_M: [f64; 2] = [-65.0, 75.0];
/// Upper limit of the headway axis (s).
const MAX_THW_S: f64 = 5.0;

/// Returns the picture of the critical moment as the text of an SVG file.
pub fn still(film: &Film) -> String {
    let mut svg = Svg::new(SIZE);
    let critical = film.critical_moment();
    let frame_index =
        film.frames.partition_point(|frame| frame.time < critical).min(film.frames.len().saturating_sub(1));
    let has_collision = film.worst_collision().is_some();
    let title = format!("{} · {:.2} s", film.title(), critical.s());
    let style = |size, colour| TextStyle { size, colour, anchor: Anchor::Start };
    svg.text([10.0, 18.0], &title, style(12.0, "#222222"));
    svg.text(
        [10.0, 35.0],
        &film.result().unwrap_or_else(|| film.headline()),
        style(10.0, if has_collision { "#c40018" } else { "#1e7d32" }),
    );
    strip::draw(&mut svg, (film, None), frame_index, (STRIP, REACH_M));
    let start = film.frames.first().map_or(0.0, |frame| frame.time.s());
    let curve = |name: &str, colour, vehicle: fn(&Frame) -> Option<usize>, value: fn(&Frame) -> Option<f64>| Curve {
        name: name.to_owned(),
        stroke: Stroke::solid(colour, 1.8),
        points: points_over_time(&film.frames, vehicle, value),
    };
    let curves = vec![
        curve("front", FRONT, Frame::lead, |frame| frame.margins.thw_front_s.ok()),
        curve("rear", REAR, Frame::follower, |frame| frame.margins.thw_rear_s.ok()),
    ];
    let values = curves.iter().flat_map(|curve| curve.points.iter().filter_map(|point| point.1));
    let top = range_of(values, [0.0, 1.0])[1].min(MAX_THW_S);
    let moments = [(critical.s(), '!')];
    let chart = Chart {
        name: "time headway [s]",
        x: [start, film.end().s().max(start + 1.0)],
        y: [0.0, top],
        curves,
        levels: vec![(CRITICAL_THW_S, "0.9 s".to_owned())],
        moments: &moments,
        x_name: Some("time [s]"),
    };
    chart.draw(&mut svg, CHART);
    svg.finish()
}
