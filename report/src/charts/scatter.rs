//! Points with intervals in both directions. Some are marked.

use std::io;
use std::ops::Range;

use plotters::prelude::*;

use super::style::{ChartAxis, FILE_PX, axes, label_text, number_text, svg};

/// One point.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ScatterPoint {
    /// The value along each axis.
    pub(crate) at: [f64; 2],
    /// The 95 % interval along each axis.
    pub(crate) intervals_95: [[f64; 2]; 2],
    /// The text beside a marked point.
    pub(crate) label: String,
    /// True for a marked point.
    pub(crate) is_marked: bool,
}

const MARKED: RGBColor = RGBColor(0xd5, 0x5e, 0x00);
const OTHER: RGBColor = RGBColor(0x8d, 0x99, 0xa6);
/// Opacity of the intervals of points that are not marked.
const FAINT: f64 = 0.35;
/// Radius of the points (px).
const POINT_PX: i32 = 4;
/// Distance of a label from its point (px).
const LABEL_PX: (i32, i32) = (7, -14);
/// Free space at the ends of an axis, as a share of its range.
const MARGIN: f64 = 0.06;

/// Returns the SVG of the points. `names` are the names of the axes.
pub(crate) fn scatter(points: &[ScatterPoint], title: &str, names: [&str; 2]) -> io::Result<String> {
    let [across, up] = [0, 1].map(|axis| range(points, axis));
    let axis = |name, range: &Range<f64>| ChartAxis {
        name,
        range: range.clone(),
        labels: 10,
        text: Box::new(number_text(range.start, range.end)),
        has_grid: true,
    };
    let drawn = svg(FILE_PX, |canvas| {
        let mut plot = axes(canvas, Some(title), &axis(names[0], &across), &axis(names[1], &up))?;
        // Marked points are drawn last, over the others.
        let (marked, others): (Vec<&ScatterPoint>, Vec<&ScatterPoint>) =
            points.iter().partition(|point| point.is_marked);
        for point in others.into_iter().chain(marked) {
            let [x, y] = point.at;
            let [[left, right], [low, high]] = point.intervals_95;
            let line = if point.is_marked { MARKED.to_rgba() } else { OTHER.mix(FAINT) };
            plot.draw_series([
                PathElement::new([(left, y), (right, y)], line),
                PathElement::new([(x, low), (x, high)], line),
            ])?;
            let colour = if point.is_marked { MARKED } else { OTHER };
            plot.draw_series([Circle::new((x, y), POINT_PX, colour.filled())])?;
            if point.is_marked {
                let text = Text::new(point.label.clone(), LABEL_PX, label_text(false));
                plot.draw_series([EmptyElement::at((x, y)) + text])?;
            }
        }
        Ok(())
    });
    drawn.map_err(|error| io::Error::other(error.to_string()))
}

/// Returns the range of an axis that holds all intervals.
fn range(points: &[ScatterPoint], axis: usize) -> Range<f64> {
    let ends = || points.iter().flat_map(|point| point.intervals_95[axis]).filter(|end| end.is_finite());
    let (low, high) = (ends().fold(f64::INFINITY, f64::min), ends().fold(f64::NEG_INFINITY, f64::max));
    if !(low < high) {
        return 0.0..1.0;
    }
    let margin = MARGIN * (high - low);
    low - margin..high + margin
}
