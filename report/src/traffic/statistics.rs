//! Statistics of recorded lane changes: a table for human readers, and box plots by vehicle class.

use std::fmt;

use closecall_scenarios::criticality::{BoxPlot, ClassStatistics, Correlation, Statistics};

use super::trajectory_charts::{BoxChart, BoxSummary, ChartError};

/// Names of the charts' files: the durations, the widths of the peaks of lateral speed, and the speeds.
pub const STATISTICS_CHARTS: [&str; 3] = ["duration.svg", "width.svg", "speed.svg"];

/// The statistics as a table for human readers.
#[derive(Clone, Copy, Debug)]
pub struct StatisticsText<'a>(pub &'a Statistics);

impl fmt::Display for StatisticsText<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let found = self.0;
        writeln!(f, "class       lane changes    left   right  complete  overlapping  parts of doubles")?;
        for class in &found.classes {
            let ClassStatistics { vehicle_class, lane_changes, to_the_left, complete, overlapping, double, .. } = class;
            let right = lane_changes - to_the_left;
            writeln!(
                f,
                "{:<10} {lane_changes:>13} {to_the_left:>7} {right:>7} {complete:>9} {overlapping:>12} {double:>17}",
                vehicle_class.name()
            )?;
        }
        writeln!(f, "\ncomplete ones           n    mean     low      25 %   50 %   75 %    high")?;
        for class in &found.classes {
            write_box(f, class, "duration [s]", class.duration_s.as_ref())?;
            write_box(f, class, "width [s]", class.width_s.as_ref())?;
            write_box(f, class, "speed [m/s]", class.speed_mps.as_ref())?;
        }
        writeln!(f, "\ncorrelation over complete ones                  n   Pearson  Spearman")?;
        for Correlation { of, with, n, pearson, spearman } in &found.correlations {
            let number = |value: &Option<f64>| value.map_or("-".to_owned(), |value| format!("{value:.2}"));
            writeln!(f, "{of:<20} {with:<20} {n:>7} {:>9} {:>9}", number(pearson), number(spearman))?;
        }
        Ok(())
    }
}

fn write_box(
    f: &mut fmt::Formatter<'_>,
    class: &ClassStatistics,
    what: &str,
    numbers: Option<&BoxPlot>,
) -> fmt::Result {
    let name = class.vehicle_class.name();
    let Some(BoxPlot { n, mean, five: [low, quarter, median, three_quarters, high], .. }) = numbers else {
        return Ok(());
    };
    writeln!(
        f,
        "{name:<6} {what:<13} {n:>5} {mean:>7.2} {low:>7.2} {quarter:>9.2} {median:>6.2} {three_quarters:>6.2} {high:>7.2}"
    )
}

/// Draws the durations, widths and speeds of complete lane changes as box plots, one box per vehicle class. The charts (SVG)
/// are in the order of [`STATISTICS_CHARTS`].
///
/// # Errors
/// [`ChartError`] if a chart cannot be drawn.
pub fn statistics_charts(found: &Statistics) -> Result<[String; 3], ChartError> {
    let chart = |title: &str, y_name: &str, value: fn(&ClassStatistics) -> Option<&BoxPlot>| {
        let boxes = found.classes.iter().filter_map(|class| Some(box_of(class, value(class)?))).collect();
        BoxChart { title: title.to_owned(), y_name: y_name.to_owned(), boxes }.svg()
    };
    Ok([
        chart("Duration of complete lane changes", "duration [s]", |class| class.duration_s.as_ref())?,
        chart("Width of the peak of lateral speed of complete lane changes", "width [s]", |class| {
            class.width_s.as_ref()
        })?,
        chart("Speed at the crossing of complete lane changes", "speed [m/s]", |class| class.speed_mps.as_ref())?,
    ])
}

fn box_of(class: &ClassStatistics, numbers: &BoxPlot) -> BoxSummary {
    let name = format!("{} (n = {})", class.vehicle_class.name(), numbers.n);
    BoxSummary { name, five: numbers.five, outliers: numbers.outliers.clone() }
}
