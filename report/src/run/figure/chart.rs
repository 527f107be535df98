//! A line chart: axes with round ticks, curves with gaps, reference levels, and the marked moments
//! of the encounter.

use super::svg::{Anchor, Area, Stroke, Svg, TextStyle};
use closecall_traffic::maths;
use closecall_traffic::statistics::format::without_trailing_zeros;

/// Colour of text and axes.
pub(super) const INK: &str = "#222222";
/// Colour of grid lines.
pub(super) const FAINT: &str = "#dddddd";
/// Colour of the lines that mark moments.
const MOMENT: &str = "#8a8a8a";
/// Colour of reference levels, which are solid and thin: the curves of a baseline are dashed.
const LIMIT: &str = "#d62728";
const TICK_FONT_SIZE_PX: f64 = 10.0;
const NAME_FONT_SIZE_PX: f64 = 11.0;
/// Distance of two moments below which their letters are at different heights (px).
const CLOSE_PX: f64 = 12.0;
/// Approximate number of ticks of an axis.
const TICK_COUNT: f64 = 5.0;

/// The lower and upper end of an axis.
pub(super) type Range = [f64; 2];

/// A curve. An absent value leaves a gap.
pub(super) struct Curve<'a> {
    pub(super) name: String,
    pub(super) stroke: Stroke<'a>,
    pub(super) points: Vec<(f64, Option<f64>)>,
}

/// A chart with its contents.
pub(super) struct Chart<'a> {
    pub(super) name: &'a str,
    pub(super) x: Range,
    pub(super) y: Range,
    pub(super) curves: Vec<Curve<'a>>,
    /// Reference levels with their names.
    pub(super) levels: Vec<(f64, String)>,
    /// Marked positions on the x axis with their style.
    pub(super) moments: &'a [(f64, char)],
    /// Name of the x axis; `None` if the chart below carries it.
    pub(super) x_name: Option<&'a str>,
}

impl Chart<'_> {
    /// Draws the chart into `area`.
    pub(super) fn draw(&self, svg: &mut Svg, area: Area) {
        self.axes(svg, area);
        svg.clipped(area, |svg| {
            for &(at, _) in self.moments {
                let x = self.x_of(at, area);
                svg.line([x, area.top], [x, area.bottom()], Stroke { dash: Some("1 3"), ..Stroke::solid(MOMENT, 0.9) });
            }
            for (level, _) in &self.levels {
                let y = self.y_of(*level, area);
                svg.line([area.left, y], [area.right(), y], Stroke::solid(LIMIT, 0.8));
            }
            for curve in &self.curves {
                for piece in pieces(&curve.points) {
                    let points: Vec<[f64; 2]> =
                        piece.iter().map(|&(x, y)| [self.x_of(x, area), self.y_of(y, area)]).collect();
                    svg.polyline(&points, curve.stroke);
                }
            }
        });
        let mut last_x = f64::NEG_INFINITY;
        let mut is_low = false;
        for &(at, letter) in self.moments.iter().filter(|(at, _)| *at >= self.x[0] && *at <= self.x[1]) {
            let style = TextStyle { size: NAME_FONT_SIZE_PX, colour: INK, anchor: Anchor::Start };
            let x = self.x_of(at, area);
            // Letters close to each other alternate in height.
            is_low = x - last_x < CLOSE_PX && !is_low;
            last_x = x;
            svg.text([x + 2.0, area.top + if is_low { 24.0 } else { 12.0 }], &letter.to_string(), style);
        }
        for (level, name) in self.levels.iter().filter(|(level, _)| *level >= self.y[0] && *level <= self.y[1]) {
            let style = TextStyle { size: 9.0, colour: LIMIT, anchor: Anchor::End };
            svg.text([area.right() - 4.0, self.y_of(*level, area) - 3.0], name, style);
        }
        self.legend(svg, area);
    }

    fn x_of(&self, value: f64, area: Area) -> f64 {
        area.left + (value - self.x[0]) / (self.x[1] - self.x[0]) * area.width
    }

    fn y_of(&self, value: f64, area: Area) -> f64 {
        area.bottom() - (value - self.y[0]) / (self.y[1] - self.y[0]) * area.height
    }

    fn axes(&self, svg: &mut Svg, area: Area) {
        let style = |anchor| TextStyle { size: TICK_FONT_SIZE_PX, colour: INK, anchor };
        for tick in ticks(self.y) {
            let y = self.y_of(tick, area);
            svg.line([area.left, y], [area.right(), y], Stroke::solid(FAINT, 0.6));
            svg.text([area.left - 5.0, y + 3.5], &tick_text(tick), style(Anchor::End));
        }
        for tick in ticks(self.x) {
            let x = self.x_of(tick, area);
            svg.line([x, area.top], [x, area.bottom()], Stroke::solid(FAINT, 0.6));
            svg.text([x, area.bottom() + 13.0], &tick_text(tick), style(Anchor::Middle));
        }
        svg.frame(area, Stroke::solid(INK, 0.8));
        let name = TextStyle { size: NAME_FONT_SIZE_PX, colour: INK, anchor: Anchor::Start };
        svg.text([area.left, area.top - 5.0], self.name, name);
        if let Some(x_name) = self.x_name {
            svg.text([area.right(), area.bottom() + 26.0], x_name, style(Anchor::End));
        }
    }

    fn legend(&self, svg: &mut Svg, area: Area) {
        for (row, curve) in self.curves.iter().filter(|curve| !curve.name.is_empty()).enumerate() {
            let y = area.top + 13.0 + 13.0 * row as f64;
            let x = area.right() + 8.0;
            svg.line([x, y - 3.5], [x + 20.0, y - 3.5], curve.stroke);
            let style = TextStyle { size: TICK_FONT_SIZE_PX, colour: INK, anchor: Anchor::Start };
            svg.text([x + 25.0, y], &curve.name, style);
        }
    }
}

/// Splits a curve at its gaps. Pieces of a single point are dropped.
fn pieces(points: &[(f64, Option<f64>)]) -> Vec<Vec<(f64, f64)>> {
    let mut pieces: Vec<Vec<(f64, f64)>> = vec![Vec::new()];
    for &(x, y) in points {
        match (y.filter(|y| y.is_finite()), pieces.last_mut()) {
            (Some(y), Some(piece)) => piece.push((x, y)),
            (None, Some(piece)) if !piece.is_empty() => pieces.push(Vec::new()),
            _ => {}
        }
    }
    pieces.retain(|piece| piece.len() > 1);
    pieces
}

/// Returns the round values within a range. They are 1, 2 or 5 times a power of ten apart.
pub(super) fn ticks([low, high]: Range) -> Vec<f64> {
    let rough = (high - low) / TICK_COUNT;
    if !(rough > 0.0 && rough.is_finite()) {
        return Vec::new();
    }
    let power = maths::powf(10.0, maths::log10(rough).floor());
    let step = [1.0, 2.0, 5.0, 10.0].into_iter().map(|step| step * power).find(|step| *step >= rough);
    let step = step.unwrap_or(rough);
    let mut ticks = Vec::new();
    let mut count = (low / step).ceil();
    while count * step <= high + 1e-9 * step {
        ticks.push(count * step);
        count += 1.0;
    }
    ticks
}

/// Returns the text of a tick, without trailing zeros and without a negative zero.
pub(super) fn tick_text(value: f64) -> String {
    without_trailing_zeros(&format!("{value:.2}")).replace('-', "\u{2212}")
}

/// Returns a range that contains all finite `values` and the range `at_least`, with some room
/// beyond the values.
pub(super) fn range_of(values: impl Iterator<Item = f64>, at_least: Range) -> Range {
    let finite = values.filter(|value| value.is_finite());
    let [low, high] = finite.fold(at_least, |[low, high], value| [low.min(value), high.max(value)]);
    let room = 0.05 * (high - low);
    [low - if low < at_least[0] { room } else { 0.0 }, high + room]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_within_the_range() {
        assert_eq!(ticks([0.0, 4.2]), [0.0, 1.0, 2.0, 3.0, 4.0]);
        assert_eq!(ticks([-9.0, 4.0]), [-5.0, 0.0]);
        assert_eq!(ticks([1.0, 1.0]), [] as [f64; 0]);
        assert_eq!(tick_text(-0.0), "0");
        assert_eq!(tick_text(-2.5), "\u{2212}2.5");
    }

    #[test]
    fn a_gap_splits_a_curve() {
        let points = [
            (0.0, Some(1.0)),
            (1.0, Some(2.0)),
            (2.0, None),
            (3.0, Some(f64::NAN)),
            (4.0, Some(1.0)),
            (5.0, Some(1.0)),
        ];
        assert_eq!(pieces(&points).len(), 2);
    }
}
