//! Charts of statistics over trajectory data, each in an SVG file of its own: lines over a reference level, and box plots
//! by vehicle class.

use std::ops::Range;

use plotters::prelude::*;

use crate::charts::style::{Canvas, ChartAxis, Drawn, FILE_PX, axes, legend_text, number_text, series_colour, svg};

/// Opacity of a faint line.
const FAINT_OPACITY: f64 = 0.35;
/// Length of a line in the legend (px).
const LEGEND_LINE_PX: i32 = 18;
/// Width of the area for a legend beside the lines, as a share of the width of the lines (-).
const LEGEND_SHARE: f64 = 0.2;
/// Largest number of points of a line that are drawn as dots.
const MAX_DOTS: usize = 50;
/// Largest number of labels on an axis of numbers.
const LABELS: usize = 10;

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
    /// True if the line is drawn pale, beside a line that matters more.
    pub faint: bool,
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
}

/// One box of a box plot.
#[derive(Clone, Debug, PartialEq)]
pub struct BoxSummary {
    /// The name below the box.
    pub name: String,
    /// Lower whisker, lower quartile, median, upper quartile and upper whisker.
    pub five: [f64; 5],
    /// Values beyond the whiskers.
    pub outliers: Vec<f64>,
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
        let y = number_axis(&self.y_name, range(points().map(|point| point.1).chain(level), Some(0.0)));
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
        for line in &self.lines {
            let opacity = if line.faint { FAINT_OPACITY } else { 1.0 };
            let style = series_colour(line.colour).mix(opacity).stroke_width(2);
            let points = line.points.iter().copied().filter(|(x, y)| x.is_finite() && y.is_finite());
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

impl BoxChart {
    /// Returns the chart as the text of an SVG file.
    ///
    /// # Errors
    /// [`ChartError`] if the drawing library fails.
    pub fn svg(&self) -> Result<String, ChartError> {
        file(&self.title, |canvas| self.draw(canvas))
    }

    fn draw(&self, canvas: &Canvas<'_>) -> Drawn {
        let x = ChartAxis {
            name: "",
            range: -0.5..self.boxes.len() as f64 - 0.5,
            labels: 2 * self.boxes.len() + 1,
            text: Box::new(|x: &f64| self.name_at(*x)),
            has_grid: false,
        };
        let values = self.boxes.iter().flat_map(|one| one.five.iter().chain(&one.outliers).copied());
        let y = number_axis(&self.y_name, range(values, Some(0.0)));
        let mut plot = axes(canvas, Some(&self.title), &x, &y)?;
        for (index, one) in self.boxes.iter().enumerate() {
            plot.draw_series(elements(index, one))?;
            let dot = |value: &f64| Circle::new((index as f64, *value), 3, series_colour(index).stroke_width(1));
            plot.draw_series(one.outliers.iter().map(dot))?;
        }
        Ok(())
    }

    /// Returns the name of the box at `x`; empty if `x` is between two boxes.
    fn name_at(&self, x: f64) -> String {
        let nearest = x.round();
        let is_middle = (x - nearest).abs() < 1e-9 && nearest >= 0.0;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small whole number")]
        let found = is_middle.then(|| self.boxes.get(nearest as usize)).flatten();
        found.map_or(String::new(), |one| one.name.clone())
    }
}

/// Returns the box, its median and its whiskers.
fn elements<'a>(index: usize, one: &BoxSummary) -> Vec<DynElement<'static, SVGBackend<'a>, (f64, f64)>> {
    const HALF_BOX: f64 = 0.22;
    const HALF_CAP: f64 = 0.1;
    let x = index as f64;
    let [low, quarter, median, three_quarters, high] = one.five;
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
    let drawn = svg(FILE_PX, |canvas| canvas.fill(&WHITE).and_then(|()| draw(canvas)));
    drawn.map_err(|error| ChartError { title: title.to_owned(), message: error.to_string() })
}

/// Returns the range from the smallest to the largest finite value, with a margin. The range includes `from` if there is
/// one, and is never empty.
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
        };
        let svg = chart.svg().unwrap();
        for text in ["<svg", "Noise", "peak", "distance", "reference", "level", "count"] {
            assert!(svg.contains(text), "{text}");
        }
        assert_eq!(svg, chart.svg().unwrap());
    }

    #[test]
    fn boxes_are_named_and_a_chart_without_boxes_is_drawn() {
        let one = BoxSummary { name: "car (n = 9)".to_owned(), five: [1.0, 2.0, 3.0, 4.0, 6.0], outliers: vec![9.0] };
        let chart = |boxes| BoxChart { title: "Durations".to_owned(), y_name: "s".to_owned(), boxes }.svg().unwrap();
        assert!(chart(vec![one.clone()]).contains("car (n = 9)"));
        assert!(chart(vec![one.clone(), one]).contains("</svg>"));
        assert!(chart(Vec::new()).contains("Durations"));
    }
}
