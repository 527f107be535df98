//! The critical moment of a film as one small picture: the road from above, and how the headways came there.

use super::chart::{Chart, Curve, range_of};
use super::colours::{FRONT, REAR};
use super::strip;
use super::svg::{Anchor, Area, Letters, Stroke, Svg};
use crate::run::film::{Film, Frame};
use closecall_simulation::outcome::CRITICAL_THW_S;

const SIZE: [f64; 2] = [560.0, 330.0];
const STRIP: Area = Area { left: 10.0, top: 46.0, width: 540.0, height: 96.0 };
const CHART: Area = Area { left: 40.0, top: 172.0, width: 430.0, height: 120.0 };
/// What is shown of the road [m].
const REACH_M: [f64; 2] = [-65.0, 75.0];
/// Headways above this are not shown [s].
const MOST_THW_S: f64 = 5.0;

/// The picture, as an SVG file's text.
pub fn still(film: &Film) -> String {
    let mut svg = Svg::new(SIZE);
    let critical = film.critical_moment();
    let row = film.frames.partition_point(|frame| frame.time < critical).min(film.frames.len().saturating_sub(1));
    let grave = film.worst_collision().is_some();
    let title = format!("{} · {:.2} s", film.title(), critical.s());
    let ink = |size, colour| Letters { size, colour, anchor: Anchor::Start };
    svg.text([10.0, 18.0], &title, ink(12.0, "#222222"));
    svg.text([10.0, 35.0], &film.headline(), ink(10.0, if grave { "#c40018" } else { "#1e7d32" }));
    strip::draw(&mut svg, film, row, (STRIP, REACH_M));
    let start = film.frames.first().map_or(0.0, |frame| frame.time.s());
    let curve = |name: &str, colour, of: fn(&Frame) -> Option<f64>| Curve {
        name: name.to_owned(),
        stroke: Stroke::solid(colour, 1.8),
        points: film.frames.iter().map(|frame| (frame.time.s(), of(frame))).collect(),
    };
    let curves = vec![
        curve("front", FRONT, |frame| frame.margins.thw_front_s.ok()),
        curve("rear", REAR, |frame| frame.margins.thw_rear_s.ok()),
    ];
    let values = curves.iter().flat_map(|curve| curve.points.iter().filter_map(|point| point.1));
    let top = range_of(values, [0.0, 1.0])[1].min(MOST_THW_S);
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
