//! A boundary as text for the console, and its chart.

use std::fmt::{self, Display, Formatter};
use std::io;

use closecall_campaign::boundary::{Boundary, Crossing, Slice, Surveyed};
use closecall_traffic::statistics::format::{DIGITS, percent, significant};
use closecall_traffic::words::counted;

use super::aligned::{error_lines, write_rows};
use super::frontier::short;
use crate::charts::{BoundaryMap, BoundaryPoint, boundary_map};

/// The standard normal quantile of 97.5 %.
const Z_95: f64 = 1.96;

/// A boundary as text.
#[derive(Clone, Copy, Debug)]
pub(super) struct BoundaryText<'a>(pub(super) &'a Boundary);

/// Returns the names of the columns of the slices.
pub(super) fn heads(boundary: &Boundary) -> [String; 2] {
    let [first, second] = boundary.keys.each_ref().map(|key| short(key));
    [first.to_owned(), format!("boundary in {second} (95 %)")]
}

/// Returns the cells of a slice.
pub(super) fn cells(slice: &Slice) -> [String; 2] {
    let number = |value: f64| significant(value, DIGITS);
    let crossing = |Crossing { second, interval_95: [low, high] }: &Crossing| {
        format!("{} ({} to {})", number(*second), number(*low), number(*high))
    };
    let undecided: Vec<String> =
        slice.undecided.iter().map(|[low, high]| format!("{} to {}", number(*low), number(*high))).collect();
    let text = match slice.fails {
        None => {
            let crossings = slice.crossings.iter().map(crossing).collect::<Vec<_>>().join(", ");
            // The text of a crossing has its interval.
            let is_of_crossing = |ends: &[f64; 2]| slice.crossings.iter().any(|crossing| crossing.interval_95 == *ends);
            let others = slice.undecided.iter().zip(&undecided).filter(|range| !is_of_crossing(range.0));
            let others: Vec<&str> = others.map(|(_, text)| text.as_str()).collect();
            match &others[..] {
                [] => crossings,
                ranges => format!("{crossings}; also undecided from {}", ranges.join(", ")),
            }
        }
        Some(fails) => {
            let side = if fails { "happens" } else { "does not happen" };
            let sure = match &undecided[..] {
                [] => String::new(),
                ranges => format!("; undecided from {}", ranges.join(", ")),
            };
            format!("no crossing in range: the event {side}{sure}")
        }
    };
    [number(slice.first), text]
}

/// Returns what the runs are.
pub(super) fn about(boundary: &Boundary) -> String {
    let (runs, seed, sample) = (counted(boundary.runs.len(), "run"), boundary.seed, boundary.sample);
    let controllers = boundary.controllers.join(" and ");
    format!(
        "{runs}, {controllers}, seed {seed}; other parameters at their nominal values, random numbers of sample {sample}"
    )
}

/// Returns the ranges of the parameters.
pub(super) fn ranges(boundary: &Boundary) -> String {
    let range = |index: usize| {
        let [low, high] = boundary.ranges[index].map(|end| significant(end, DIGITS));
        format!("{} from {low} to {high}", boundary.keys[index])
    };
    format!("{}, {}", range(0), range(1))
}

/// Returns the shares of the area, how well the runs are predicted, and what the intervals leave
/// out.
pub(super) fn statements(surveyed: &Surveyed) -> [String; 3] {
    let (area, check) = (surveyed.area, surveyed.check);
    let scatter = significant(Z_95 * surveyed.noise_sd, DIGITS);
    let [passes, fails, undecided] = [area.passes, area.fails, area.undecided].map(percent);
    [
        format!("area: the event happens in {fails}, does not happen in {passes}, and {undecided} is undecided"),
        format!(
            "each run predicted from the others: {} of {} have the predicted sign ({:.1} expected), {} of the {} first ones; {} are in their 95 % interval",
            check.signs, check.runs, check.signs_expected, check.start_signs, check.start_runs, check.inside_95
        ),
        format!(
            "intervals and shares are of the surface; they leave out the scatter of single runs about it, ±{scatter} in the unit of the number (95 %)"
        ),
    ]
}

/// Returns the sentences that end the output: nothing if the boundary is conclusive.
pub(super) fn verdict(boundary: &Boundary) -> Vec<String> {
    match &boundary.surveyed {
        None => vec![format!("INCONCLUSIVE: there is no surface: {}", boundary.absent())],
        Some(surveyed) => surveyed.doubts.iter().map(|doubt| format!("INCONCLUSIVE: {doubt}")).collect(),
    }
}

impl Display for BoundaryText<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let boundary = self.0;
        writeln!(f, "{}: boundary of `{}`", boundary.scenario, boundary.event)?;
        writeln!(f, "{}", ranges(boundary))?;
        writeln!(f, "{}\n", about(boundary))?;
        if let Some(surveyed) = &boundary.surveyed {
            let mut rows = vec![heads(boundary).to_vec()];
            rows.extend(surveyed.slices.iter().map(|slice| cells(slice).to_vec()));
            write_rows(f, &rows)?;
            writeln!(f)?;
            statements(surveyed).iter().try_for_each(|line| writeln!(f, "{line}"))?;
        }
        let without = boundary.runs.len() - boundary.runs_with_value();
        if without > 0 {
            writeln!(f, "{} without a value of `{}`, left out", counted(without, "run"), boundary.quantity)?;
        }
        for line in error_lines(&boundary.errors, "runs").into_iter().chain(verdict(boundary)) {
            writeln!(f, "{line}")?;
        }
        Ok(())
    }
}

/// Returns the chart of a boundary with its name.
pub(super) fn charts(boundary: &Boundary) -> io::Result<Vec<(&'static str, String)>> {
    let title = format!("{}: {}", boundary.scenario, boundary.event);
    let points = boundary.runs.iter().map(|run| BoundaryPoint { at: run.at, happens: run.happens }).collect();
    let map = boundary.surveyed.as_ref().map(|surveyed| &surveyed.map);
    let chart = BoundaryMap {
        title: &title,
        names: boundary.keys.each_ref().map(|key| short(key)),
        ranges: boundary.ranges,
        means: map.map_or(&[][..], |map| &map.means[..]),
        decided: map.map_or(&[][..], |map| &map.decided[..]),
        points,
    };
    Ok(vec![("map", boundary_map(&chart)?)])
}
