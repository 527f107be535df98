//! A small picture of the critical moment of a film: the road from above, and the time headways up
//! to then and beyond.

use super::chart::{Chart, Curve, range_of};
use super::colours::{FRONT, REAR};
use super::svg::{Anchor, Area, Stroke, Svg, TextStyle};
use super::{points_over_time, strip};
use crate::run::film::{Film, Frame};
use closecall_scenarios::outcome::CRITICAL_THW_S;

/// Width of the picture (px): its text is legible on a page of 390 px.
const WIDTH_PX: f64 = 360.0;
/// Distance of the contents from the edges (px).
const EDGE_PX: f64 = 8.0;
/// Heights of the road and of the plot (px).
const STRIP_PX: f64 = 100.0;
const CHART_PX: f64 = 112.0;
/// Room to the left of the plot for its ticks, and to the right for its legend (px).
const TICKS_PX: f64 = 32.0;
const LEGEND_PX: f64 = 68.0;
/// Room between road and plot for the name of the plot, and below the plot for its time axis (px).
const NAME_PX: f64 = 24.0;
const AXIS_PX: f64 = 34.0;
/// Font sizes of title and result (px), and the distance of two lines as a share of the font size.
const TITLE_SIZE_PX: f64 = 12.0;
const RESULT_SIZE_PX: f64 = 11.0;
const LINE: f64 = 1.25;
/// Width of a letter as a share of the font size.
const LETTER: f64 = 0.6;
/// Ends of the visible part of the road, relative to the ego (m).
const REACH_M: [f64; 2] = [-38.0, 70.0];
/// Upper limit of the headway axis (s).
const MAX_THW_S: f64 = 5.0;

/// Returns the picture of the critical moment as the text of an SVG file.
pub fn still(film: &Film) -> String {
    let critical = film.critical_moment();
    let frame_index =
        film.frames.partition_point(|frame| frame.time < critical).min(film.frames.len().saturating_sub(1));
    let has_collision = film.worst_collision().is_some();
    let title = format!("{} · {:.2} s", film.title(), critical.s());
    let result = film.result().unwrap_or_else(|| film.headline());
    let result_colour = if has_collision { strip::CRITICAL } else { strip::SAFE };
    let texts = [(title, TITLE_SIZE_PX, "#222222"), (result, RESULT_SIZE_PX, result_colour)];
    let mut lines = Vec::new();
    let mut top = EDGE_PX;
    for (text, size, colour) in texts {
        for line in wrapped(&text, ((WIDTH_PX - 2.0 * EDGE_PX) / (LETTER * size)).floor()) {
            top += LINE * size;
            lines.push((line, [EDGE_PX, top], TextStyle { size, colour, anchor: Anchor::Start }));
        }
    }
    let strip_area = Area { left: EDGE_PX, top: top + EDGE_PX, width: WIDTH_PX - 2.0 * EDGE_PX, height: STRIP_PX };
    let chart_area = Area {
        left: TICKS_PX,
        top: strip_area.bottom() + NAME_PX,
        width: WIDTH_PX - TICKS_PX - LEGEND_PX,
        height: CHART_PX,
    };
    let mut svg = Svg::new([WIDTH_PX, chart_area.bottom() + AXIS_PX]);
    for (line, at, style) in lines {
        svg.text(at, &line, style);
    }
    strip::draw(&mut svg, film, None, frame_index, strip_area, REACH_M);
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
    chart.draw(&mut svg, chart_area);
    svg.finish()
}

/// Breaks a text at spaces into lines of at most this many letters. A longer word has a line of its
/// own.
fn wrapped(text: &str, letters: f64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split(' ') {
        match lines.last_mut() {
            Some(line) if (line.chars().count() + 1 + word.chars().count()) as f64 <= letters => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::wrapped;

    #[test]
    fn a_long_title_goes_on_in_the_next_line() {
        let lines = wrapped("busy-overtake · sample 12 · mis", 15.0);
        assert_eq!(lines, ["busy-overtake ·", "sample 12 · mis"]);
        assert_eq!(wrapped("rear-vehicles-one-after-another", 10.0).len(), 1);
    }
}
