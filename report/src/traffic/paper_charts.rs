//! Charts of criticality: how often each value of a metric occurs, with its threshold, and the
//! shares of critical lane changes to the left and to the right.

use std::collections::BTreeMap;
use std::fmt;

use closecall_recorded::criticality::{
    CRITICAL_A_LAT_MPS2, CRITICAL_A_LON_MPS2, CRITICAL_DCE_M, CRITICAL_DISTANCE_M, CRITICAL_SPEED_FACTOR,
    CRITICAL_TTCE_S, Counted, CriticalLaneChange, DEFAULT_SPEED_LIMIT_MPS, shares,
};
use closecall_traffic::Side;
use closecall_traffic::metrics::CRITICAL_THW_S;
use plotters::prelude::*;

use super::trajectory_charts::{ChartError, file, number_axis, range};
use crate::charts::style::{Canvas, ChartAxis, Drawn, axes, legend_text, series_colour};
use crate::units::labelled;

/// Largest number of labels on an axis of counts.
const COUNT_LABELS: usize = 6;
/// Number of bars of a histogram.
const BARS: usize = 20;
/// Half of the width of a bar of shares, as a share of the distance between two metrics (-).
const HALF_BAR: f64 = 0.16;

/// Names of the metrics that have a chart each.
pub const METRICS: [&str; 7] = ["distance_m", "speed_mps", "a_lon_mps2", "a_lat_mps2", "thw_s", "dce_m", "ttce_s"];

/// Draws how often the values of each metric occur among complete lane changes, with the
/// thresholds. The charts (SVG) are in the order of [`METRICS`].
///
/// # Errors
/// [`ChartError`] if a chart cannot be drawn.
pub fn criticality_charts(
    changes: &[CriticalLaneChange],
    speed_limit_mps: Option<f64>,
) -> Result<Vec<String>, ChartError> {
    METRICS.iter().map(|metric| histogram(changes, metric, speed_limit_mps)).collect()
}

/// The values of a metric that are critical.
#[derive(Clone, Copy)]
enum Critical {
    Above(f64),
    Below(f64),
}

impl Critical {
    fn threshold(self) -> f64 {
        match self {
            Self::Above(threshold) | Self::Below(threshold) => threshold,
        }
    }
}

impl fmt::Display for Critical {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Above(threshold) => write!(f, "critical above {threshold:.1}"),
            Self::Below(threshold) => write!(f, "critical below {threshold:.1}"),
        }
    }
}

/// Returns the critical values of a metric.
fn critical(metric: &str, speed_limit_mps: Option<f64>) -> Critical {
    match metric {
        "distance_m" => Critical::Below(CRITICAL_DISTANCE_M),
        "speed_mps" => Critical::Above(CRITICAL_SPEED_FACTOR * speed_limit_mps.unwrap_or(DEFAULT_SPEED_LIMIT_MPS)),
        "a_lon_mps2" => Critical::Above(CRITICAL_A_LON_MPS2),
        "a_lat_mps2" => Critical::Above(CRITICAL_A_LAT_MPS2),
        "thw_s" => Critical::Below(CRITICAL_THW_S),
        "dce_m" => Critical::Below(CRITICAL_DCE_M),
        _ => Critical::Below(CRITICAL_TTCE_S),
    }
}

/// Draws how often the values of a metric occur among complete lane changes, with the threshold
/// (SVG).
///
/// # Errors
/// [`ChartError`] if the chart cannot be drawn.
pub(super) fn histogram(
    changes: &[CriticalLaneChange],
    metric: &str,
    speed_limit_mps: Option<f64>,
) -> Result<String, ChartError> {
    let value_of = |change: &CriticalLaneChange| {
        change.metrics.named().into_iter().find(|(name, _)| *name == metric).and_then(|(_, result)| result.value())
    };
    let complete = changes.iter().filter(|change| change.lane_change.complete);
    let values: Vec<f64> = complete.filter_map(value_of).filter(|value| value.is_finite()).collect();
    let name = labelled(metric);
    let title = format!("{name} of {} complete lane changes", values.len());
    let critical = critical(metric, speed_limit_mps);
    file(&title, |canvas| draw_histogram(canvas, &title, &name, &values, critical))
}

/// Returns the number of values in each bar. Bar 0 begins at the threshold, so no bar holds both
/// critical values and others.
fn bars(values: &[f64], threshold: f64, width: f64) -> BTreeMap<i32, u32> {
    let mut bars = BTreeMap::new();
    for value in values {
        #[expect(clippy::cast_possible_truncation, reason = "a small whole number")]
        let bar = ((value - threshold) / width).floor() as i32;
        *bars.entry(bar).or_default() += 1;
    }
    bars
}

/// Returns a vertical axis from zero that counts in whole numbers.
fn whole_number_axis(name: &str, end: f64) -> ChartAxis<'_> {
    // A label between two counts stays empty.
    let text = |count: &f64| if count.fract() == 0.0 { format!("{count:.0}") } else { String::new() };
    ChartAxis { name, range: 0.0..end, labels: COUNT_LABELS, text: Box::new(text), has_grid: true }
}

fn draw_histogram(canvas: &Canvas<'_>, title: &str, name: &str, values: &[f64], critical: Critical) -> Drawn {
    let threshold = critical.threshold();
    let x = number_axis(name, range(values.iter().copied().chain([threshold]), Some(0.0)));
    let (start, width) = (x.range.start, (x.range.end - x.range.start) / BARS as f64);
    let bars = bars(values, threshold, width);
    let largest = bars.values().copied().max().unwrap_or(0);
    let y = whole_number_axis("lane changes", (1.1 * f64::from(largest)).max(1.0));
    let mut plot = axes(canvas, Some(title), &x, &y)?;
    plot.draw_series(bars.iter().map(|(bar, count)| {
        let left = threshold + f64::from(*bar) * width;
        let corners = [(left.max(start), 0.0), (left + width, f64::from(*count))];
        Rectangle::new(corners, series_colour(0).mix(0.6).filled())
    }))?;
    let line = [(threshold, 0.0), (threshold, y.range.end)];
    plot.draw_series(DashedLineSeries::new(line, 6, 4, series_colour(1).stroke_width(2)))?
        .label(critical.to_string())
        .legend(|(x, y)| PathElement::new([(x, y), (x + 18, y)], series_colour(1).stroke_width(2)));
    plot.configure_series_labels()
        .position(SeriesLabelPosition::UpperRight)
        .label_font(legend_text())
        .background_style(WHITE.mix(0.85))
        .draw()
}

/// Draws the shares of critical lane changes by metric, to the left and to the right, with exact 95
/// % intervals (SVG).
///
/// # Errors
/// [`ChartError`] if the chart cannot be drawn.
pub(super) fn share_chart(changes: &[CriticalLaneChange]) -> Result<String, ChartError> {
    let title = "Critical share of complete lane changes, with 95 % intervals";
    file(title, |canvas| draw_shares(canvas, title, changes))
}

fn draw_shares(canvas: &Canvas<'_>, title: &str, changes: &[CriticalLaneChange]) -> Drawn {
    let x = ChartAxis {
        name: "",
        range: -0.5..METRICS.len() as f64 - 0.5,
        labels: 2 * METRICS.len() + 1,
        text: Box::new(|x: &f64| name_at(*x)),
        has_grid: false,
    };
    let y = number_axis("share [%]", 0.0..100.0);
    let mut plot = axes(canvas, Some(title), &x, &y)?;
    for (index, side) in [Side::Left, Side::Right].into_iter().enumerate() {
        let is_on = |change: &&CriticalLaneChange| change.lane_change.direction == side;
        let to_side: Vec<CriticalLaneChange> = changes.iter().filter(is_on).cloned().collect();
        let side_shares = shares(&to_side, Counted::Complete);
        let colour = series_colour(index);
        // Two bars stand side by side: the left one for lane changes to the left.
        let offset = if side == Side::Left { -HALF_BAR } else { HALF_BAR };
        let centre = |metric: usize| metric as f64 + offset;
        let bars = side_shares.metrics.iter().enumerate().filter_map(|(metric, share)| {
            let corners = [(centre(metric) - HALF_BAR, 0.0), (centre(metric) + HALF_BAR, 100.0 * share.share?)];
            Some(Rectangle::new(corners, colour.mix(0.6).filled()))
        });
        let name =
            format!("to the {} (n = {})", if side == Side::Left { "left" } else { "right" }, side_shares.lane_changes);
        plot.draw_series(bars)?
            .label(name)
            .legend(move |(x, y)| Rectangle::new([(x, y - 5), (x + 14, y + 5)], colour.mix(0.6).filled()));
        let intervals = side_shares.metrics.iter().enumerate().filter_map(|(metric, share)| {
            let [low, high] = share.interval_95?;
            let points = [(centre(metric), 100.0 * low), (centre(metric), 100.0 * high)];
            Some(PathElement::new(points, BLACK.stroke_width(1)))
        });
        plot.draw_series(intervals)?;
    }
    plot.configure_series_labels()
        .position(SeriesLabelPosition::UpperRight)
        .label_font(legend_text())
        .background_style(WHITE.mix(0.85))
        .draw()
}

/// Returns the name of the metric at `x`, without its unit; empty if `x` is between two metrics.
fn name_at(x: f64) -> String {
    let nearest = x.round();
    let is_middle = (x - nearest).abs() < 1e-9 && nearest >= 0.0;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small whole number")]
    let name = is_middle.then(|| METRICS.get(nearest as usize)).flatten();
    name.map_or(String::new(), |name| name.rsplit_once('_').map_or(*name, |(name, _unit)| name).to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_bar_of_a_histogram_holds_critical_and_other_values() {
        // Bars from 0.7 to 0.9 and from 0.9 to 1.1.
        let counts = bars(&[0.05, 0.71, 0.899, 0.9, 1.0, 1.75], 0.9, 0.2);
        assert_eq!(counts, BTreeMap::from([(-5, 1), (-1, 2), (0, 2), (4, 1)]));
    }

    #[test]
    fn the_axis_of_counts_has_whole_numbers_only() {
        let axis = whole_number_axis("lane changes", 2.2);
        let texts: Vec<String> = [0.0, 0.5, 1.0, 1.5, 2.0].iter().map(|count| (axis.text)(count)).collect();
        assert_eq!(texts, ["0", "", "1", "", "2"]);
    }
}
