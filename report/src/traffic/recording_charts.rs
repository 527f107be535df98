//! Charts as SVG: lines over a level, and boxes by class.
//!
//! SVG carries its own text, so no font has to be there; equal values give equal bytes.

use plotters::coord::Shift;
use plotters::prelude::*;

/// Width and height of a chart [px].
const SIZE_PX: (u32, u32) = (860, 520);

/// A chart that could not be drawn.
#[derive(Debug, thiserror::Error)]
#[error("failed to draw the chart \"{title}\": {message}")]
pub struct ChartError {
    /// Its title.
    pub title: String,
    /// The drawing library's reason.
    pub message: String,
}

/// One line, with its name.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    /// What the legend says.
    pub name: String,
    /// Points from left to right.
    pub points: Vec<(f64, f64)>,
    /// Which colour; lines that belong together share it.
    pub colour: usize,
    /// True for what only accompanies another line.
    pub faint: bool,
}

/// Where a legend covers nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Legend {
    /// At the bottom, on the left.
    LowerLeft,
    /// At the bottom, in the middle.
    LowerMiddle,
}

/// Lines over a common axis.
#[derive(Clone, Debug, PartialEq)]
pub struct LineChart {
    /// Above the chart.
    pub title: String,
    /// Below the horizontal axis, with its unit.
    pub x_name: String,
    /// Beside the vertical axis, with its unit.
    pub y_name: String,
    /// The lines.
    pub lines: Vec<Line>,
    /// A level that is drawn across, with its name.
    pub level: (String, f64),
    /// Where the legend stands.
    pub legend: Legend,
}

/// The five numbers of a box, in rising order.
#[derive(Clone, Debug, PartialEq)]
pub struct BoxOf {
    /// Below the box.
    pub name: String,
    /// Lower whisker, lower quartile, median, upper quartile, upper whisker.
    pub five: [f64; 5],
    /// Values beyond the whiskers.
    pub outliers: Vec<f64>,
}

/// Boxes side by side.
#[derive(Clone, Debug, PartialEq)]
pub struct BoxChart {
    /// Above the chart.
    pub title: String,
    /// Beside the vertical axis, with its unit.
    pub y_name: String,
    /// The boxes, from left to right.
    pub boxes: Vec<BoxOf>,
}

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Drawn = Result<(), DrawingAreaErrorKind<std::io::Error>>;

impl LineChart {
    /// The chart as the text of an SVG file.
    ///
    /// # Errors
    /// [`ChartError`] where the drawing library fails.
    pub fn svg(&self) -> Result<String, ChartError> {
        svg(&self.title, |area| self.draw(area))
    }

    fn draw(&self, area: &Area<'_>) -> Drawn {
        let points = || self.lines.iter().flat_map(|line| line.points.iter().copied());
        let x = range(points().map(|point| point.0), None);
        let y = range(points().map(|point| point.1).chain([self.level.1]), Some(0.0));
        let mut chart = ChartBuilder::on(area)
            .caption(&self.title, ("sans-serif", 20))
            .margin(14)
            .x_label_area_size(46)
            .y_label_area_size(60)
            .build_cartesian_2d(x.clone(), y)?;
        chart.configure_mesh().x_desc(&self.x_name).y_desc(&self.y_name).light_line_style(WHITE).draw()?;
        let level = [(x.start, self.level.1), (x.end, self.level.1)];
        chart
            .draw_series(DashedLineSeries::new(level, 4, 4, BLACK.stroke_width(1)))?
            .label(&self.level.0)
            .legend(|(x, y)| PathElement::new([(x, y), (x + 18, y)], BLACK));
        for line in &self.lines {
            let style = colour(line.colour).mix(if line.faint { 0.35 } else { 1.0 }).stroke_width(2);
            chart
                .draw_series(LineSeries::new(line.points.iter().copied(), style).point_size(3))?
                .label(&line.name)
                .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], style));
        }
        let position = match self.legend {
            Legend::LowerLeft => SeriesLabelPosition::LowerLeft,
            Legend::LowerMiddle => SeriesLabelPosition::LowerMiddle,
        };
        chart
            .configure_series_labels()
            .position(position)
            .background_style(WHITE.mix(0.85))
            .border_style(BLACK.mix(0.3))
            .draw()?;
        Ok(())
    }
}

impl BoxChart {
    /// The chart as the text of an SVG file.
    ///
    /// # Errors
    /// [`ChartError`] where the drawing library fails.
    pub fn svg(&self) -> Result<String, ChartError> {
        svg(&self.title, |area| self.draw(area))
    }

    fn draw(&self, area: &Area<'_>) -> Drawn {
        let values = self.boxes.iter().flat_map(|one| one.five.iter().chain(&one.outliers).copied());
        let y = range(values, Some(0.0));
        let mut chart = ChartBuilder::on(area)
            .caption(&self.title, ("sans-serif", 20))
            .margin(14)
            .x_label_area_size(46)
            .y_label_area_size(60)
            .build_cartesian_2d(-0.5..self.boxes.len() as f64 - 0.5, y)?;
        let name = |x: &f64| {
            let place = x.round();
            let is_middle = (x - place).abs() < 1e-9 && place >= 0.0;
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small whole number")]
            let found = is_middle.then(|| self.boxes.get(place as usize)).flatten();
            found.map_or(String::new(), |one| one.name.clone())
        };
        chart
            .configure_mesh()
            .disable_x_mesh()
            .x_labels(2 * self.boxes.len() + 1)
            .x_label_formatter(&name)
            .y_desc(&self.y_name)
            .light_line_style(WHITE)
            .draw()?;
        for (place, one) in self.boxes.iter().enumerate() {
            chart.draw_series(elements(place, one))?;
            let dot = |value: &f64| Circle::new((place as f64, *value), 3, colour(place).stroke_width(1));
            chart.draw_series(one.outliers.iter().map(dot))?;
        }
        Ok(())
    }
}

/// The box, its median and its whiskers.
fn elements<'a>(place: usize, one: &BoxOf) -> Vec<DynElement<'static, SVGBackend<'a>, (f64, f64)>> {
    const HALF_BOX: f64 = 0.22;
    const HALF_CAP: f64 = 0.1;
    let x = place as f64;
    let [low, quarter, median, three_quarters, high] = one.five;
    let style = BLACK.stroke_width(1);
    let line = |a: (f64, f64), b: (f64, f64)| PathElement::new(vec![a, b], style).into_dyn();
    vec![
        Rectangle::new([(x - HALF_BOX, quarter), (x + HALF_BOX, three_quarters)], colour(place).mix(0.45).filled())
            .into_dyn(),
        Rectangle::new([(x - HALF_BOX, quarter), (x + HALF_BOX, three_quarters)], style).into_dyn(),
        PathElement::new(vec![(x - HALF_BOX, median), (x + HALF_BOX, median)], BLACK.stroke_width(3)).into_dyn(),
        line((x, low), (x, quarter)),
        line((x, three_quarters), (x, high)),
        line((x - HALF_CAP, low), (x + HALF_CAP, low)),
        line((x - HALF_CAP, high), (x + HALF_CAP, high)),
    ]
}

fn svg(title: &str, draw: impl FnOnce(&Area<'_>) -> Drawn) -> Result<String, ChartError> {
    let mut text = String::new();
    let area = SVGBackend::with_string(&mut text, SIZE_PX).into_drawing_area();
    let drawn = area.fill(&WHITE).and_then(|()| draw(&area)).and_then(|()| area.present());
    drop(area);
    match drawn {
        Ok(()) => Ok(text),
        Err(error) => Err(ChartError { title: title.to_owned(), message: error.to_string() }),
    }
}

/// From the smallest to the largest value with a margin, and `from` in any case; never empty.
fn range(values: impl Iterator<Item = f64>, from: Option<f64>) -> std::ops::Range<f64> {
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

/// Colours that the colour-blind tell apart: M. Okabe and K. Ito, Color Universal Design (2008).
const fn colour(index: usize) -> RGBColor {
    match index % 4 {
        0 => RGBColor(0, 114, 178),
        1 => RGBColor(213, 94, 0),
        2 => RGBColor(0, 158, 115),
        _ => RGBColor(204, 121, 167),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chart_names_its_lines_and_is_the_same_twice() {
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
            level: ("reference".to_owned(), 3.0),
            legend: Legend::LowerLeft,
        };
        let svg = chart.svg().unwrap();
        for text in ["<svg", "Noise", "peak", "distance", "reference", "level", "count"] {
            assert!(svg.contains(text), "{text}");
        }
        assert_eq!(svg, chart.svg().unwrap());
    }

    #[test]
    fn boxes_are_named_and_an_empty_chart_is_still_one() {
        let one = BoxOf { name: "car (n = 9)".to_owned(), five: [1.0, 2.0, 3.0, 4.0, 6.0], outliers: vec![9.0] };
        let chart = |boxes| BoxChart { title: "Durations".to_owned(), y_name: "s".to_owned(), boxes }.svg().unwrap();
        assert!(chart(vec![one.clone()]).contains("car (n = 9)"));
        assert!(chart(vec![one.clone(), one]).contains("</svg>"));
        assert!(chart(Vec::new()).contains("Durations"));
    }
}
