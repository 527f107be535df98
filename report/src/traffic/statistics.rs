//! Statistics of recorded lane changes: a table for human readers, and box plots by trajectory file
//! and vehicle class.

use std::fmt;

use closecall_recorded::criticality::{BoxPlot, ClassStatistics, Correlation, CriticalLaneChange, Statistics};
use closecall_recorded::lane_change::LaneChange;

use super::trajectory_charts::{BoxChart, BoxSummary, ChartError};

/// Names of the charts' files: the durations, the widths of the peaks of lateral speed, and the
/// speeds at the crossing and at the peak.
pub const STATISTICS_CHARTS: [&str; 4] = ["duration.svg", "width.svg", "speed.svg", "peak-speed.svg"];

/// The statistics as a table for human readers.
#[derive(Clone, Copy, Debug)]
pub struct StatisticsText<'a>(pub &'a Statistics);

impl fmt::Display for StatisticsText<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let statistics = self.0;
        writeln!(f, "class       lane changes    left   right  complete  overlapping  parts of doubles")?;
        for class in &statistics.classes {
            let ClassStatistics { vehicle_class, lane_changes, to_the_left, complete, overlapping, double, .. } = class;
            let right = lane_changes - to_the_left;
            writeln!(
                f,
                "{:<10} {lane_changes:>13} {to_the_left:>7} {right:>7} {complete:>9} {overlapping:>12} {double:>17}",
                vehicle_class.name()
            )?;
        }
        writeln!(f, "\ncomplete ones           n    mean     low      25 %   50 %   75 %    high")?;
        for class in &statistics.classes {
            write_box(f, class, "duration [s]", class.duration_s.as_ref())?;
            write_box(f, class, "width [s]", class.width_s.as_ref())?;
            write_box(f, class, "speed [m/s]", class.speed_mps.as_ref())?;
        }
        writeln!(f, "\ncorrelation over complete ones                  n   Pearson  Spearman")?;
        for Correlation { of, with, n, pearson, spearman } in &statistics.correlations {
            let number = |value: &Option<f64>| value.map_or("-".to_owned(), |value| format!("{value:.2}"));
            writeln!(f, "{of:<20} {with:<20} {n:>7} {:>9} {:>9}", number(pearson), number(spearman))?;
        }
        Ok(())
    }
}

fn write_box(
    f: &mut fmt::Formatter<'_>,
    class: &ClassStatistics,
    metric: &str,
    numbers: Option<&BoxPlot>,
) -> fmt::Result {
    let name = class.vehicle_class.name();
    let Some(BoxPlot { n, mean, five: [low, quarter, median, three_quarters, high], .. }) = numbers else {
        return Ok(());
    };
    writeln!(
        f,
        "{name:<6} {metric:<13} {n:>5} {mean:>7.2} {low:>7.2} {quarter:>9.2} {median:>6.2} {three_quarters:>6.2} {high:>7.2}"
    )
}

/// The lane changes of one trajectory file.
#[derive(Clone, Debug)]
pub struct RecordedChanges {
    /// Name of the trajectory data.
    pub name: String,
    /// The lane changes of the file.
    pub changes: Vec<CriticalLaneChange>,
}

/// A quantity of a lane change in a box plot.
pub(super) struct Boxed {
    pub(super) file: &'static str,
    title: &'static str,
    y_name: &'static str,
    value: fn(&LaneChange) -> f64,
}

/// The quantities that have box plots.
pub(super) const BOXED: [Boxed; 4] = [
    Boxed { file: "duration", title: "Duration", y_name: "duration [s]", value: |change| change.duration_s },
    Boxed {
        file: "width",
        title: "Width of the peak of lateral speed",
        y_name: "width [s]",
        value: |change| change.width_s,
    },
    Boxed { file: "speed", title: "Speed at the crossing", y_name: "speed [m/s]", value: |change| change.speed_mps },
    Boxed {
        file: "peak-speed",
        title: "Speed at the peak of lateral speed",
        y_name: "speed [m/s]",
        value: |change| change.peak_speed_mps,
    },
];

/// Draws the durations, widths and speeds of complete lane changes as box plots with the single
/// values, one box per trajectory file and vehicle class. The charts (SVG) are in the order of
/// [`STATISTICS_CHARTS`].
///
/// # Errors
/// [`ChartError`] if a chart cannot be drawn.
pub fn statistics_charts(recordings: &[RecordedChanges]) -> Result<[String; 4], ChartError> {
    let boxes = |boxed: &Boxed| {
        let of_file = |recording: &RecordedChanges| {
            let mut boxes = by_class(&recording.changes, boxed);
            if recordings.len() > 1 {
                boxes.iter_mut().for_each(|summary| summary.name = format!("{} {}", recording.name, summary.name));
            }
            boxes
        };
        recordings.iter().flat_map(of_file).collect()
    };
    let [duration, width, speed, peak_speed] = BOXED.each_ref().map(|boxed| box_chart(boxed, boxes(boxed)).svg());
    Ok([duration?, width?, speed?, peak_speed?])
}

pub(super) fn box_chart(boxed: &Boxed, boxes: Vec<BoxSummary>) -> BoxChart {
    BoxChart { title: format!("{} of complete lane changes", boxed.title), y_name: boxed.y_name.to_owned(), boxes }
}

pub(super) fn summary<'a>(
    name: &str,
    changes: impl Iterator<Item = &'a CriticalLaneChange>,
    boxed: &Boxed,
) -> Option<BoxSummary> {
    let complete = changes.filter(|change| change.lane_change.complete);
    let values: Vec<f64> = complete.map(|change| (boxed.value)(&change.lane_change)).collect();
    let BoxPlot { n, five, .. } = BoxPlot::of(values.clone())?;
    Some(BoxSummary { name: format!("{name} (n = {n})"), five, values })
}

pub(super) fn by_class(all: &[CriticalLaneChange], boxed: &Boxed) -> Vec<BoxSummary> {
    let classes = closecall_traffic::VehicleClass::ALL.into_iter();
    classes
        .filter_map(|class| {
            summary(class.name(), all.iter().filter(|change| change.lane_change.vehicle_class == class), boxed)
        })
        .collect()
}
