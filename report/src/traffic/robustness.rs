//! What the robustness study of the lane change criteria found: a table, and charts over the levels.

use std::fmt;

use closecall_scenarios::lane_change::Criterion;
use closecall_scenarios::robustness::{CriterionCounts, ReferenceKind, Robustness, Setup};

use super::trajectory_charts::{ChartError, Legend, Line, LineChart};

/// Names of the charts' files: over the noise, and over the offset.
pub const ROBUSTNESS_CHARTS: [&str; 2] = ["noise.svg", "offset.svg"];

/// The results of the study as a table for human readers.
#[derive(Clone, Copy, Debug)]
pub struct RobustnessText<'a>(pub &'a Robustness);

impl fmt::Display for RobustnessText<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let found = self.0;
        let reference = match found.reference_kind {
            ReferenceKind::Gradient => "jumps of the distances to the markings",
            ReferenceKind::RecordedLanes => "recorded lanes",
        };
        let Setup { repetitions, seed, .. } = found.setup;
        writeln!(f, "{} lane changes, by {reference}; each criterion without noise and offset:", found.reference)?;
        for (criterion, known) in found.criteria.iter().zip(&found.undisturbed) {
            writeln!(f, "  {:<9} finds {known}", criterion.name())?;
        }
        writeln!(f, "\nfound again / all found / false ones; noise: mean of {repetitions} draws, seed {seed}")?;
        let names: Vec<String> = found.criteria.iter().map(|criterion| format!("{:<26}", criterion.name())).collect();
        writeln!(f, "\nBrownian noise  {}", names.concat())?;
        for (level, cells) in found.setup.noise_m_per_sqrt_s.iter().zip(&found.noise) {
            writeln!(f, "{level:>8.2} m/√s   {}", row(found, cells))?;
        }
        writeln!(f, "\nlateral offset  {}", names.concat())?;
        for (level, cells) in found.setup.offset_m.iter().zip(&found.offset) {
            writeln!(f, "{level:>8.2} m      {}", row(found, cells))?;
        }
        writeln!(
            f,
            "\n!: the criterion loses more than 5 % of what it finds without noise and offset, or more than 5 % are false"
        )?;
        for line in failures(found) {
            writeln!(f, "{line}")?;
        }
        Ok(())
    }
}

fn row(found: &Robustness, cells: &[CriterionCounts]) -> String {
    let cell = |(criterion, cell): (usize, &CriterionCounts)| {
        let mark = if found.fails(criterion, cell) { "!" } else { " " };
        format!("{:<26}", format!("{:>6.1} /{:>6.1} /{:>5.1} {mark}", cell.again, cell.found, cell.invented))
    };
    cells.iter().enumerate().map(cell).collect()
}

/// Returns one line per criterion with the lowest level of noise at which it fails, sorted by that level.
fn failures(found: &Robustness) -> Vec<String> {
    let mut from: Vec<(Option<f64>, Criterion)> = (0..)
        .zip(&found.criteria)
        .map(|(column, criterion)| (found.failing_noise_m_per_sqrt_s(column), *criterion))
        .collect();
    from.sort_by(|a, b| a.0.unwrap_or(f64::INFINITY).total_cmp(&b.0.unwrap_or(f64::INFINITY)));
    let line = |(level, criterion): &(Option<f64>, Criterion)| match level {
        Some(level) => format!("{} first fails at a noise of {level} m/√s", criterion.name()),
        None => format!("{} fails at no level of noise", criterion.name()),
    };
    from.iter().map(line).collect()
}

/// Draws the lane changes that each criterion finds, over the levels of noise and of offset. The charts (SVG) are in the
/// order of [`ROBUSTNESS_CHARTS`].
///
/// # Errors
/// [`ChartError`] if a chart cannot be drawn.
pub fn robustness_charts(found: &Robustness) -> Result<[String; 2], ChartError> {
    let levels = &found.setup;
    let noise = Axis { name: "Brownian noise [m/√s]", levels: &levels.noise_m_per_sqrt_s, rows: &found.noise };
    let offset = Axis { name: "Lateral offset [m]", levels: &levels.offset_m, rows: &found.offset };
    let draw = |legend, axis| LineChart { legend, ..chart(found, &axis) }.svg();
    Ok([draw(Legend::LowerLeft, noise)?, draw(Legend::LowerMiddle, offset)?])
}

/// A disturbance, its levels, and the results at each level.
struct Axis<'a> {
    name: &'a str,
    levels: &'a [f64],
    rows: &'a [Vec<CriterionCounts>],
}

fn chart(found: &Robustness, axis: &Axis<'_>) -> LineChart {
    let points = |column: usize, value: fn(&CriterionCounts) -> f64| -> Vec<(f64, f64)> {
        axis.levels.iter().zip(axis.rows).map(|(level, cells)| (*level, value(&cells[column]))).collect()
    };
    let lines = found.criteria.iter().enumerate().flat_map(|(column, criterion)| {
        let name = criterion.name();
        let again = points(column, |cell| cell.again);
        let all = points(column, |cell| cell.found);
        [
            Line { name: format!("{name}: found again"), points: again, colour: column, faint: false },
            Line { name: format!("{name}: all that is found"), points: all, colour: column, faint: true },
        ]
    });
    LineChart {
        title: "Lane changes found, by criterion".to_owned(),
        x_name: axis.name.to_owned(),
        y_name: "lane changes".to_owned(),
        lines: lines.collect(),
        level: ("reference".to_owned(), found.reference as f64),
        legend: Legend::LowerLeft,
    }
}
