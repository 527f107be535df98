//! A chart of curves over the distance, as SVG, and the legend of several charts.

use crate::escape::escaped;
use std::fmt::Write;

use maud::{Markup, PreEscaped, html};

use closecall_studies::perception::approach::GAPS_M;
use closecall_studies::perception::figures::{CurvePoint, PointErrors};
use closecall_traffic::maths;

/// Size of a chart (px), and of its margins: left, right, above, below.
const SIZE_PX: [f64; 2] = [430.0, 240.0];
const MARGINS_PX: [f64; 4] = [46.0, 12.0, 28.0, 40.0];
/// Colours of the lines: Okabe and Ito, Color Universal Design (2008).
pub(super) const COLOURS: [&str; 7] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000"];
/// Dashes of the lines of the second study, and of the lines beyond the colours.
const DASHES: [&str; 4] = ["", "6 3", "2 3", "8 3 2 3"];
/// Width of the last line that is drawn (px), the additional width of each line below it, and the
/// greatest width. If lines coincide, each line shows at the edges of the next.
const WIDTHS_PX: [f64; 3] = [1.6, 0.8, 5.6];
/// Number of intervals between the ticks of the vertical axis.
const TICKS: u8 = 4;
/// Distance between the ticks of the horizontal axis (m).
const TICK_M: f64 = 25.0;

/// The curves of a case of a study.
pub(super) struct Line<'a> {
    /// The name in the legend.
    pub(super) name: String,
    /// The curves.
    pub(super) curve: &'a [CurvePoint],
    /// Number of the study, and of the line within the study.
    pub(super) place: [usize; 2],
}

impl Line<'_> {
    fn colour(&self) -> &'static str {
        COLOURS[self.place[1] % COLOURS.len()]
    }

    fn dash(&self) -> &'static str {
        DASHES[(self.place[0] + self.place[1] / COLOURS.len()) % DASHES.len()]
    }
}

/// The content of a chart.
pub(super) struct Chart {
    /// The title, with the unit.
    pub(super) title: &'static str,
    /// The value at a point of a curve, if it has one.
    pub(super) value: fn(&CurvePoint) -> Option<f64>,
    /// The interval of that value, if it has one.
    pub(super) interval: fn(&CurvePoint) -> Option<[f64; 2]>,
}

impl Chart {
    /// Returns the chart of the probability of a track.
    pub(super) const PROBABILITY: Self = Self {
        title: "probability of a confirmed track",
        value: |point| Some(point.confirmed.value),
        interval: |point| Some(point.confirmed.interval_95),
    };

    /// Returns the charts of the errors: bias, root mean square and 95 % quantile of each.
    pub(super) const ERRORS: [Self; 9] = [
        Self::of_errors("along the road: bias (m)", |point| error(point, 0, |errors| errors.bias)),
        Self::of_errors("along the road: root mean square error (m)", |point| error(point, 0, |errors| errors.rmse)),
        Self::of_errors("along the road: 95 % of the errors are below (m)", |point| {
            error(point, 0, |errors| errors.q95)
        }),
        Self::of_errors("across the road: bias (m)", |point| error(point, 1, |errors| errors.bias)),
        Self::of_errors("across the road: root mean square error (m)", |point| error(point, 1, |errors| errors.rmse)),
        Self::of_errors("across the road: 95 % of the errors are below (m)", |point| {
            error(point, 1, |errors| errors.q95)
        }),
        Self::of_errors("speed: bias (m/s)", |point| error(point, 2, |errors| errors.bias)),
        Self::of_errors("speed: root mean square error (m/s)", |point| error(point, 2, |errors| errors.rmse)),
        Self::of_errors("speed: 95 % of the errors are below (m/s)", |point| error(point, 2, |errors| errors.q95)),
    ];

    const fn of_errors(title: &'static str, value: fn(&CurvePoint) -> Option<f64>) -> Self {
        Self { title, value, interval: |_| None }
    }

    /// Returns the chart of these lines as SVG.
    pub(super) fn svg(&self, lines: &[Line<'_>]) -> PreEscaped<String> {
        let values: Vec<f64> = lines.iter().flat_map(|line| line.curve.iter().filter_map(self.value)).collect();
        let top = nice(values.iter().fold(0.0_f64, |most, value| most.max(value.abs())));
        let low = if values.iter().any(|value| *value < 0.0) { -top } else { 0.0 };
        let [width, height] = SIZE_PX;
        let [left, right, above, below] = MARGINS_PX;
        let frame = Frame { low, top };
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" role=\"img\" \
             font-family=\"DejaVu Sans, sans-serif\" font-size=\"11\" fill=\"#333\"><title>{0}</title>\
             <text x=\"{left}\" y=\"{1}\" font-size=\"12\">{0}</text>",
            escaped(self.title),
            above - 12.0
        );
        // Writing to a string does not fail.
        let mut put = |text: std::fmt::Arguments<'_>| svg.write_fmt(text).unwrap_or_default();
        for tick in 0..=TICKS {
            let value = low + (top - low) * f64::from(tick) / f64::from(TICKS);
            let at = frame.y(value);
            let stroke = if low < 0.0 && value == 0.0 { "#8a929b" } else { "#e3e7ec" };
            put(format_args!(
                "<path d=\"M{left} {at:.1}H{:.1}\" stroke=\"{stroke}\"/><text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
                width - right,
                left - 6.0,
                at + 4.0,
                format!("{value:.4}").trim_end_matches('0').trim_end_matches('.')
            ));
        }
        let gaps_m = (0_u8..).map(|tick| TICK_M * f64::from(tick)).take_while(|gap_m| *gap_m <= GAPS_M[0]);
        for gap_m in gaps_m {
            let at = frame.x(gap_m);
            put(format_args!(
                "<text x=\"{at:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{gap_m}</text>",
                height - below + 16.0
            ));
        }
        put(format_args!(
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">gap from its front to the ego's rear (m)</text>",
            0.5 * (left + width - right),
            height - 7.0
        ));
        for (index, line) in lines.iter().enumerate() {
            self.draw(line, [index, lines.len()], &frame, &mut svg);
        }
        svg.push_str("</svg>");
        PreEscaped(svg)
    }

    /// Draws the line with the number `index` of `count` lines.
    fn draw(&self, line: &Line<'_>, [index, count]: [usize; 2], frame: &Frame, svg: &mut String) {
        let (colour, dash) = (line.colour(), line.dash());
        let [last_px, wider_px, widest_px] = WIDTHS_PX;
        let mut put = |text: std::fmt::Arguments<'_>| svg.write_fmt(text).unwrap_or_default();
        let points = line.curve.iter().filter_map(|point| Some((point, (self.value)(point)?)));
        let path: Vec<String> =
            points.map(|(point, value)| format!("{:.1} {:.1}", frame.x(point.gap_m), frame.y(value))).collect();
        if path.is_empty() {
            return;
        }
        put(format_args!(
            "<path class=\"curve\" d=\"M{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"{:.1}\" \
             stroke-linecap=\"round\" stroke-dasharray=\"{dash}\"/>",
            path.join("L"),
            (last_px + wider_px * (count - 1 - index) as f64).min(widest_px)
        ));
        for point in line.curve {
            let Some([low, high]) = (self.interval)(point) else { continue };
            // Bars side by side do not hide each other.
            let at = frame.x(point.gap_m) + 1.5 * (index as f64 - 0.5 * count as f64);
            put(format_args!(
                "<path d=\"M{at:.1} {:.1}V{:.1}\" stroke=\"{colour}\" stroke-opacity=\"0.5\"/>",
                frame.y(low),
                frame.y(high)
            ));
        }
    }
}

/// The area of a chart within its axes.
struct Frame {
    low: f64,
    top: f64,
}

impl Frame {
    fn x(&self, gap_m: f64) -> f64 {
        let [left, right, ..] = MARGINS_PX;
        left + (SIZE_PX[0] - left - right) * gap_m / GAPS_M[0]
    }

    fn y(&self, value: f64) -> f64 {
        let [.., above, below] = MARGINS_PX;
        let share = ((value - self.low) / (self.top - self.low)).min(1.0);
        SIZE_PX[1] - below - (SIZE_PX[1] - above - below) * share
    }
}

fn error(point: &CurvePoint, index: usize, figure: fn(&PointErrors) -> f64) -> Option<f64> {
    point.errors.map(|errors| figure(&errors[index]))
}

/// Returns the legend of the charts of these lines.
pub(super) fn legend(lines: &[Line<'_>]) -> Markup {
    let note = |index: usize| {
        let line = &lines[index];
        let is_same = |other: &&Line<'_>| other.curve == line.curve;
        match lines[..index].iter().find(is_same) {
            _ if line.curve.iter().all(|point| !(point.confirmed.value > 0.0)) => " (no track)".to_owned(),
            Some(earlier) => format!(" (the same as {})", earlier.name),
            None => String::new(),
        }
    };
    html! {
        ul.lines {
            @for (index, line) in lines.iter().enumerate() {
                li {
                    svg.swatch width="34" height="10" aria-hidden="true" {
                        path d="M0 5H34" stroke=(line.colour()) stroke-width="2.5" stroke-dasharray=(line.dash()) {}
                    }
                    (line.name) (note(index))
                }
            }
        }
    }
}

/// Returns the next value at which an axis may end: 1, 2 or 5 times a power of ten.
fn nice(largest: f64) -> f64 {
    if !(largest > 0.0) {
        return 1.0;
    }
    let power = maths::powf(10.0, maths::log10(largest).floor());
    [1.0, 2.0, 5.0, 10.0].into_iter().map(|step| step * power).find(|end| *end >= largest - 1e-12).unwrap_or(largest)
}
