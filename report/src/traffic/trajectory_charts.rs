//! Charts of statistics over trajectory data, each in an SVG file of its own: lines over a
//! reference level, and box plots by vehicle class.

use std::ops::Range;

use plotters::prelude::*;

use crate::charts::style::{
    Canvas, ChartAxis, Drawn, FILE_PX, axes, file_svg, legend_text, number_text, series_colour,
};

/// Opacity of a faint line.
const FAINT_OPACITY: f64 = 0.35;
/// Length of a line in the legend (px).
const LEGEND_LINE_PX: i32 = 18;
/// Width of the area for a legend beside the lines, as a share of the width of the lines (-): a
/// legend takes 190 px of 800 px.
const LEGEND_SHARE: f64 = 0.33;
/// Largest number of points of a line that are drawn as dots.
const MAX_DOTS: usize = 50;
/// Largest number of labels on an axis of numbers.
const LABELS: usize = 10;

/// Opacity of the range behind a line, and of a dot.
const BAND_OPACITY: f64 = 0.15;
const DOT_OPACITY: f64 = 0.7;
/// Width over which the dots of a box are spread, as a share of the distance between two boxes (-).
const DOTS: f64 = 0.36;
/// The golden ratio, whose multiples spread the dots evenly.
const GOLDEN: f64 = 0.618_033_988_749_895;
/// Width of a letter of a box's name with the room between two names (px).
const LETTER_PX: usize = 7;

/// A chart that cannot be drawn.
#[derive(Debug, thiserror::Error)]
#[error("failed to draw the chart \"{title}\": {message}")]
pub struct ChartError {
    /// The chart's title.
    pub title: String,
    /// The drawing library's reason.
    pub message: String,
}

/// One line of a chart.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    /// The name in the legend.
    pub name: String,
    /// The points, in rising order of x. Points that are not finite are left out.
    pub points: Vec<(f64, f64)>,
    /// The index of the colour. Lines that belong together share a colour.
    pub colour: usize,
    /// True if the line is drawn pale, beside a more important line.
    pub faint: bool,
}

/// The range of the values at each x, drawn as an area of the colour of a line.
#[derive(Clone, Debug, PartialEq)]
pub struct Band {
    /// x, and the smallest and the largest value there, in rising order of x.
    pub points: Vec<(f64, [f64; 2])>,
    /// The index of the colour.
    pub colour: usize,
}

/// A vertical line at a value of the horizontal axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Mark {
    /// The name in the legend; empty if another mark has it.
    pub name: String,
    /// The value.
    pub x: f64,
    /// The index of the colour.
    pub colour: usize,
}

/// The position of the legend, to be chosen so that it covers no line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Legend {
    /// At the bottom, on the left.
    LowerLeft,
    /// At the bottom, in the middle.
    LowerMiddle,
    /// On the right, beside the lines.
    Right,
}

/// Lines over a common axis.
#[derive(Clone, Debug, PartialEq)]
pub struct LineChart {
    /// The title above the chart.
    pub title: String,
    /// The name of the horizontal axis, with its unit.
    pub x_name: String,
    /// The name of the vertical axis, with its unit.
    pub y_name: String,
    /// The lines.
    pub lines: Vec<Line>,
    /// The name and the value of a reference level, which is drawn as a dashed line.
    pub level: Option<(String, f64)>,
    /// The position of the legend.
    pub legend: Legend,
    /// The ranges behind the lines.
    pub bands: Vec<Band>,
    /// The vertical lines.
    pub marks: Vec<Mark>,
    /// The largest value of the vertical axis, if larger values do not matter. Lines end where they
    /// exceed it.
    pub most: Option<f64>,
}

/// One box of a box plot.
#[derive(Clone, Debug, PartialEq)]
pub struct BoxSummary {
    /// The name below the box.
    pub name: String,
    /// Lower whisker, lower quartile, median, upper quartile and upper whisker.
    pub five: [f64; 5],
    /// All values, drawn as dots.
    pub values: Vec<f64>,
}

/// Boxes side by side.
#[derive(Clone, Debug, PartialEq)]
pub struct BoxChart {
    /// The title above the chart.
    pub title: String,
    /// The name of the vertical axis, with its unit.
    pub y_name: String,
    /// The boxes, from left to right.
    pub boxes: Vec<BoxSummary>,
}

impl LineChart {
    /// Returns the chart as the text of an SVG file.
    ///
    /// # Errors
    /// [`ChartError`] if the drawing library fails.
    pub fn svg(&self) -> Result<String, ChartError> {
        file(&self.title, |canvas| self.draw(canvas))
    }

    pub(super) fn draw(&self, canvas: &Canvas<'_>) -> Drawn {
        let points = || self.lines.iter().flat_map(|line| line.points.iter().copied());
        let mut x = number_axis(&self.x_name, range(points().map(|point| point.0), None));
        let level = self.level.iter().map(|level| level.1);
        let highest = self.bands.iter().flat_map(|band| band.points.iter().map(|(_, ends)| ends[1]));
        let values = points().map(|point| point.1).chain(level).chain(highest);
        let most = self.most.unwrap_or(f64::INFINITY);
        let y = number_axis(&self.y_name, range(values.map(|value| value.min(most)), Some(0.0)));
        let ends = [x.range.start, x.range.end];
        if self.legend == Legend::Right {
            x.range.end += LEGEND_SHARE * (x.range.end - x.range.start);
        }
        let mut plot = axes(canvas, Some(&self.title), &x, &y)?;
        let legend_line =
            |style: ShapeStyle| move |(x, y): (i32, i32)| PathElement::new([(x, y), (x + LEGEND_LINE_PX, y)], style);
        if let Some((name, level)) = &self.level {
            let line = ends.map(|x| (x, *level));
            plot.draw_series(DashedLineSeries::new(line, 4, 4, BLACK.stroke_width(1)))?
                .label(name)
                .legend(legend_line(BLACK.stroke_width(1)));
        }
        for Band { points, colour } in &self.bands {
            let lower = points.iter().map(|(x, [low, _])| (*x, low.min(most)));
            let upper = points.iter().rev().map(|(x, [_, high])| (*x, high.min(most)));
            let area: Vec<(f64, f64)> = lower.chain(upper).collect();
            plot.draw_series([Polygon::new(area, series_colour(*colour).mix(BAND_OPACITY).filled())])?;
        }
        for Mark { name, x, colour } in &self.marks {
            let style = series_colour(*colour).stroke_width(1);
            let line = [(*x, y.range.start), (*x, y.range.end)];
            let drawn = plot.draw_series(DashedLineSeries::new(line, 2, 4, style))?;
            if !name.is_empty() {
                drawn.label(name).legend(move |(x, y)| PathElement::new([(x + 9, y - 6), (x + 9, y + 6)], style));
            }
        }
        for line in &self.lines {
            let opacity = if line.faint { FAINT_OPACITY } else { 1.0 };
            let style = series_colour(line.colour).mix(opacity).stroke_width(2);
            let points = below(&line.points, most);
            let dots_px = if line.points.len() > MAX_DOTS { 0 } else { 3 };
            plot.draw_series(LineSeries::new(points, style).point_size(dots_px))?
                .label(&line.name)
                .legend(legend_line(style));
        }
        let position = match self.legend {
            Legend::LowerLeft => SeriesLabelPosition::LowerLeft,
            Legend::LowerMiddle => SeriesLabelPosition::LowerMiddle,
            Legend::Right => SeriesLabelPosition::UpperRight,
        };
        plot.configure_series_labels()
            .position(position)
            .label_font(legend_text())
            .background_style(WHITE.mix(0.85))
            .border_style(BLACK.mix(0.3))
            .draw()
    }
}

/// Returns the finite points of a line up to the value `most`, with the point at which the line
/// exceeds it.
fn below(points: &[(f64, f64)], most: f64) -> Vec<(f64, f64)> {
    let mut shown: Vec<(f64, f64)> = Vec::new();
    for &(x, y) in points.iter().filter(|(x, y)| x.is_finite() && y.is_finite()) {
        if y <= most {
            shown.push((x, y));
            continue;
        }
        if let Some(&(from_x, from_y)) = shown.last() {
            shown.push((from_x + (most - from_y) / (y - from_y) * (x - from_x), most));
        }
        break;
    }
    shown
}

impl BoxChart {
    /// Returns the chart as the text of an SVG file.
    ///
    /// # Errors
    /// [`ChartError`] if the drawing library fails.
    pub fn svg(&self) -> Result<String, ChartError> {
        let longest = self.boxes.iter().map(|summary| summary.name.chars().count()).max().unwrap_or(0);
        let boxes_px = self.boxes.len().saturating_mul(longest.saturating_mul(LETTER_PX));
        let width = FILE_PX.0.max(u32::try_from(boxes_px).unwrap_or(u32::MAX));
        sized_file(&self.title, (width, FILE_PX.1), |canvas| self.draw(canvas))
    }

    fn draw(&self, canvas: &Canvas<'_>) -> Drawn {
        let x = ChartAxis {
            name: "",
            range: -0.5..self.boxes.len() as f64 - 0.5,
            labels: 2 * self.boxes.len() + 1,
            text: Box::new(|x: &f64| self.name_at(*x)),
            has_grid: false,
        };
        let values = self.boxes.iter().flat_map(|summary| summary.five.iter().chain(&summary.values).copied());
        let y = number_axis(&self.y_name, range(values, Some(0.0)));
        let mut plot = axes(canvas, Some(&self.title), &x, &y)?;
        for (index, summary) in self.boxes.iter().enumerate() {
            plot.draw_series(elements(index, summary))?;
            // The dots lie beside each other: equal values do not cover each other.
            let beside = |number: usize| DOTS * ((number as f64 * GOLDEN).fract() - 0.5);
            let dot = |(number, value): (usize, &f64)| {
                let style = series_colour(index).mix(DOT_OPACITY).filled();
                Circle::new((index as f64 + beside(number), *value), 2, style)
            };
            plot.draw_series(summary.values.iter().enumerate().map(dot))?;
        }
        Ok(())
    }

    /// Returns the name of the box at `x`; empty if `x` is between two boxes.
    fn name_at(&self, x: f64) -> String {
        let nearest = x.round();
        let is_middle = (x - nearest).abs() < 1e-9 && nearest >= 0.0;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small whole number")]
        let summary = is_middle.then(|| self.boxes.get(nearest as usize)).flatten();
        summary.map_or(String::new(), |summary| summary.name.clone())
    }
}

/// Returns the box, its median and its whiskers.
fn elements<'a>(index: usize, summary: &BoxSummary) -> Vec<DynElement<'static, SVGBackend<'a>, (f64, f64)>> {
    const HALF_BOX: f64 = 0.22;
    const HALF_CAP: f64 = 0.1;
    let x = index as f64;
    let [low, quarter, median, three_quarters, high] = summary.five;
    let style = BLACK.stroke_width(1);
    let line = |a: (f64, f64), b: (f64, f64)| PathElement::new(vec![a, b], style).into_dyn();
    let corners = [(x - HALF_BOX, quarter), (x + HALF_BOX, three_quarters)];
    vec![
        Rectangle::new(corners, series_colour(index).mix(0.45).filled()).into_dyn(),
        Rectangle::new(corners, style).into_dyn(),
        PathElement::new(vec![(x - HALF_BOX, median), (x + HALF_BOX, median)], BLACK.stroke_width(3)).into_dyn(),
        line((x, low), (x, quarter)),
        line((x, three_quarters), (x, high)),
        line((x - HALF_CAP, low), (x + HALF_CAP, low)),
        line((x - HALF_CAP, high), (x + HALF_CAP, high)),
    ]
}

pub(super) fn number_axis(name: &str, range: Range<f64>) -> ChartAxis<'_> {
    let text = Box::new(number_text(range.start, range.end));
    ChartAxis { name, range, labels: LABELS, text, has_grid: true }
}

/// Returns the SVG of a chart on a white background.
pub(super) fn file(title: &str, draw: impl FnOnce(&Canvas<'_>) -> Drawn) -> Result<String, ChartError> {
    sized_file(title, FILE_PX, draw)
}

/// Returns the SVG of a chart of this size (px) on a white background.
fn sized_file(title: &str, size_px: (u32, u32), draw: impl FnOnce(&Canvas<'_>) -> Drawn) -> Result<String, ChartError> {
    let drawn = file_svg(size_px, draw);
    drawn.map_err(|error| ChartError { title: title.to_owned(), message: error.to_string() })
}

/// Returns the range from the smallest to the largest finite value, with a margin. The range
/// includes `from` if there is one, and is never empty.
pub(super) fn range(values: impl Iterator<Item = f64>, from: Option<f64>) -> Range<f64> {
    const MARGIN: f64 = 0.06;
    let finite = values.filter(|value| value.is_finite()).chain(from);
    let (low, high) = finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
    if low > high {
        return 0.0..1.0;
    }
    let margin = if high > low { MARGIN * (high - low) } else { 1.0 };
    let start = if from == Some(low) { low } else { low - margin };
    start..high + margin
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chart_names_its_lines_and_is_the_same_when_drawn_again() {
        let line = |name: &str, colour, faint| Line {
            name: name.to_owned(),
            points: vec![(0.0, 3.0), (1.0, f64::NAN), (2.0, 1.0)],
            colour,
            faint,
        };
        let chart = LineChart {
            title: "Noise".to_owned(),
            x_name: "level".to_owned(),
            y_name: "count".to_owned(),
            lines: vec![line("peak", 0, false), line("distance", 1, true)],
            level: Some(("reference".to_owned(), 3.0)),
            legend: Legend::LowerLeft,
            bands: vec![Band { points: vec![(0.0, [2.0, 3.5]), (2.0, [0.5, 2.0])], colour: 0 }],
            marks: vec![Mark { name: "peak fails".to_owned(), x: 1.5, colour: 0 }],
            most: None,
        };
        let svg = chart.svg().unwrap();
        for text in ["<svg", "Noise", "peak", "distance", "reference", "level", "count", "peak fails", "polygon"] {
            assert!(svg.contains(text), "{text}");
        }
        assert_eq!(svg, chart.svg().unwrap());
    }

    #[test]
    fn a_line_ends_where_it_exceeds_the_axis() {
        let points = [(0.0, 2.0), (1.0, 4.0), (2.0, 8.0), (3.0, 1.0)];
        assert_eq!(below(&points, 6.0), [(0.0, 2.0), (1.0, 4.0), (1.5, 6.0)]);
        assert_eq!(below(&points, f64::INFINITY), points);
    }

    #[test]
    fn boxes_are_named_and_a_chart_without_boxes_is_drawn() {
        let summary =
            BoxSummary { name: "car (n = 9)".to_owned(), five: [1.0, 2.0, 3.0, 4.0, 6.0], values: vec![1.0, 2.0, 9.0] };
        let chart = |boxes| BoxChart { title: "Durations".to_owned(), y_name: "s".to_owned(), boxes }.svg().unwrap();
        assert!(chart(vec![summary.clone()]).contains("car (n = 9)"));
        assert!(chart(vec![summary.clone(), summary]).contains("</svg>"));
        assert!(chart(Vec::new()).contains("Durations"));
    }
}
