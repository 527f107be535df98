//! What the robustness study of the lane change criteria found: a table, and charts over the levels.

use std::fmt;

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
        for ((criterion, known), confirmed) in found.criteria.iter().zip(&found.undisturbed).zip(&found.confirmed) {
            writeln!(f, "  {:<9} finds {known}; {confirmed} of them are among these", criterion.name())?;
        }
        writeln!(f, "\nfound again / false ones, compared with the criterion without noise and offset")?;
        writeln!(f, "noise: mean [least, most] of {repetitions} draws, seed {seed}")?;
        let names: Vec<String> = found.criteria.iter().map(|criterion| format!("{:<40}", criterion.name())).collect();
        writeln!(f, "\nBrownian noise  {}", names.concat())?;
        let means = found.mean_noise();
        for ((level, cells), draws) in found.setup.noise_m_per_sqrt_s.iter().zip(&means).zip(&found.noise) {
            writeln!(f, "{level:>8.2} m/√s   {}", row(found, cells, draws))?;
        }
        writeln!(f, "\nlateral offset  {}", names.concat())?;
        for (level, cells) in found.setup.offset_m.iter().zip(&found.offset) {
            writeln!(f, "{level:>8.2} m      {}", row(found, cells, &[]))?;
        }
        writeln!(
            f,
            "\n!: the criterion loses more than 5 % of what it finds without noise and offset, or as many are false"
        )?;
        for line in failures(found) {
            writeln!(f, "{line}")?;
        }
        Ok(())
    }
}

/// Returns the counts of each criterion, with their range over the draws of the noise if there are several.
fn row(found: &Robustness, cells: &[CriterionCounts], draws: &[Vec<CriterionCounts>]) -> String {
    let count = |criterion: usize, value: fn(&CriterionCounts) -> f64| {
        let mean = value(&cells[criterion]);
        if draws.len() < 2 {
            return format!("{mean:>6.1}");
        }
        let values = || draws.iter().map(|cells| value(&cells[criterion]));
        let (least, most) = (values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max));
        format!("{mean:>6.1} [{least}, {most}]")
    };
    let cell = |criterion: usize| {
        let mark = if found.fails(criterion, &cells[criterion]) { "!" } else { " " };
        let (again, invented) = (count(criterion, |cell| cell.again), count(criterion, |cell| cell.invented));
        format!("{:<40}", format!("{again} /{invented} {mark}"))
    };
    (0..cells.len()).map(cell).collect()
}

/// Returns one line per criterion with the lowest level of noise at which it fails, sorted by that level.
fn failures(found: &Robustness) -> Vec<String> {
    let or_never = |level: Option<f64>| level.unwrap_or(f64::INFINITY);
    let mut columns: Vec<(usize, Option<f64>)> =
        (0..found.criteria.len()).map(|column| (column, found.failing_noise_m_per_sqrt_s(column))).collect();
    columns.sort_by(|a, b| or_never(a.1).total_cmp(&or_never(b.1)));
    let line = |(column, first): (usize, Option<f64>)| {
        let name = found.criteria[column].name();
        if found.undisturbed[column] == 0 {
            return format!("{name} is not judged: it finds nothing even without noise");
        }
        let draws: Vec<f64> = found.failing_noise_by_repetition(column).into_iter().map(or_never).collect();
        let shown = |level: f64| if level.is_finite() { format!("{level} m/√s") } else { "no level".to_owned() };
        let (least, most) =
            (draws.iter().copied().fold(f64::INFINITY, f64::min), draws.into_iter().fold(0.0, f64::max));
        let single = format!("single draws: {} to {}", shown(least), shown(most));
        match first {
            Some(level) => format!("{name} first fails at a noise of {level} m/√s ({single})"),
            None => format!("{name} fails at no level of noise ({single})"),
        }
    };
    columns.into_iter().map(line).collect()
}

/// Draws the lane changes that each criterion finds, over the levels of noise and of offset. The charts (SVG) are in the
/// order of [`ROBUSTNESS_CHARTS`].
///
/// # Errors
/// [`ChartError`] if a chart cannot be drawn.
pub fn robustness_charts(found: &Robustness) -> Result<[String; 2], ChartError> {
    let levels = &found.setup;
    let means = found.mean_noise();
    let noise = Axis { name: "Brownian noise [m/√s]", levels: &levels.noise_m_per_sqrt_s, rows: &means };
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
        level: Some(("reference".to_owned(), found.reference as f64)),
        legend: Legend::LowerLeft,
    }
}
