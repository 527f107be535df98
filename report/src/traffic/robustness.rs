//! The results of the robustness study of the lane change criteria: a table, and charts over the
//! levels.

use std::fmt;

use closecall_recorded::robustness::{CriterionCounts, ReferenceKind, Robustness, Setup};
use closecall_traffic::words::counted;

use super::trajectory_charts::{Band, ChartError, Legend, Line, LineChart, Mark};

/// Names of the charts' files: over the noise, and over the offset.
pub const ROBUSTNESS_CHARTS: [&str; 2] = ["noise.svg", "offset.svg"];

/// The results of the study as a table for human readers.
#[derive(Clone, Copy, Debug)]
pub struct RobustnessText<'a>(pub &'a Robustness);

impl fmt::Display for RobustnessText<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let study = self.0;
        let reference = match study.reference_kind {
            ReferenceKind::Gradient => "jumps of the distances to the markings",
            ReferenceKind::RecordedLanes => "recorded lanes",
            ReferenceKind::EstimatedLanes => "lanes that are estimated from the traffic",
            ReferenceKind::LateralShift => "lateral shift",
        };
        let Setup { repetitions, seed, .. } = study.setup;
        let changes = counted(study.reference, "lane change");
        writeln!(f, "{changes}, by {reference}; each criterion without noise and offset:")?;
        for ((criterion, count), confirmed) in study.criteria.iter().zip(&study.undisturbed).zip(&study.confirmed) {
            writeln!(f, "  {:<9} finds {count}; {confirmed} of them are among these", criterion.name())?;
        }
        writeln!(f, "\nfound again / false ones, compared with the criterion without noise and offset")?;
        writeln!(f, "noise: mean [least, most] of {repetitions} draws, seed {seed}")?;
        let names: Vec<String> = study.criteria.iter().map(|criterion| format!("{:<40}", criterion.name())).collect();
        writeln!(f, "\nBrownian noise  {}", names.concat())?;
        let means = study.mean_noise();
        for ((level, cells), draws) in study.setup.noise_m_per_sqrt_s.iter().zip(&means).zip(&study.noise) {
            writeln!(f, "{level:>8.2} m/√s   {}", row(study, cells, draws))?;
        }
        writeln!(f, "\nlateral offset  {}", names.concat())?;
        for (level, cells) in study.setup.offset_m.iter().zip(&study.offset) {
            writeln!(f, "{level:>8.2} m      {}", row(study, cells, &[]))?;
        }
        writeln!(
            f,
            "\n!: the criterion loses more than 5 % of what it finds without noise and offset, or as many are false"
        )?;
        for line in failures(study) {
            writeln!(f, "{line}")?;
        }
        Ok(())
    }
}

/// Returns the counts of each criterion, with their range over the draws of the noise if there are
/// several.
fn row(study: &Robustness, cells: &[CriterionCounts], draws: &[Vec<CriterionCounts>]) -> String {
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
        let mark = if study.fails(criterion, &cells[criterion]) { "!" } else { " " };
        let (again, invented) = (count(criterion, |cell| cell.again), count(criterion, |cell| cell.invented));
        format!("{:<40}", format!("{again} /{invented} {mark}"))
    };
    (0..cells.len()).map(cell).collect()
}

/// Returns one line per criterion with the lowest level of noise at which it fails, sorted by that
/// level.
fn failures(study: &Robustness) -> Vec<String> {
    let or_never = |level: Option<f64>| level.unwrap_or(f64::INFINITY);
    let mut columns: Vec<(usize, Option<f64>)> =
        (0..study.criteria.len()).map(|column| (column, study.failing_noise_m_per_sqrt_s(column))).collect();
    columns.sort_by(|a, b| or_never(a.1).total_cmp(&or_never(b.1)));
    let line = |(column, first): (usize, Option<f64>)| {
        let name = study.criteria[column].name();
        if study.undisturbed[column] == 0 {
            return format!("{name} is not judged: it finds nothing even without noise");
        }
        let draws: Vec<f64> = study.failing_noise_by_repetition(column).into_iter().map(or_never).collect();
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

/// Draws the lane changes that each criterion finds, over the levels of noise and of offset, with
/// the range over the draws of the noise and the levels at which it fails. The charts (SVG) are in
/// the order of [`ROBUSTNESS_CHARTS`].
///
/// # Errors
/// [`ChartError`] if a chart cannot be drawn.
pub fn robustness_charts(study: &Robustness) -> Result<[String; 2], ChartError> {
    let levels = &study.setup;
    let means = study.mean_noise();
    let least = |column: usize| study.failing_noise_m_per_sqrt_s(column).into_iter().collect();
    let noise = Axis {
        name: "Brownian noise [m/√s]",
        levels: &levels.noise_m_per_sqrt_s,
        rows: &means,
        draws: &study.noise,
        failing: (0..study.criteria.len()).map(least).collect(),
    };
    let offset = Axis {
        name: "Lateral offset [m]",
        levels: &levels.offset_m,
        rows: &study.offset,
        draws: &[],
        failing: (0..study.criteria.len()).map(|column| failing_offsets_m(study, column)).collect(),
    };
    Ok([chart(study, &noise).svg()?, chart(study, &offset).svg()?])
}

/// Returns the offsets to either side, nearest to zero, at which a criterion fails (m).
fn failing_offsets_m(study: &Robustness, column: usize) -> Vec<f64> {
    let failing =
        study.setup.offset_m.iter().zip(&study.offset).filter(|(_, cells)| study.fails(column, &cells[column]));
    let (left, right): (Vec<f64>, Vec<f64>) = failing.map(|(level, _)| *level).partition(|level| *level < 0.0);
    left.into_iter().max_by(f64::total_cmp).into_iter().chain(right.into_iter().min_by(f64::total_cmp)).collect()
}

/// A disturbance, its levels, and the results at each level.
struct Axis<'a> {
    name: &'a str,
    levels: &'a [f64],
    rows: &'a [Vec<CriterionCounts>],
    /// The results of each draw at each level; empty if there is only one.
    draws: &'a [Vec<Vec<CriterionCounts>>],
    /// The levels from which on each criterion fails.
    failing: Vec<Vec<f64>>,
}

/// Counts above this multiple of the reference are not shown. The decisive counts stay legible.
const MOST: f64 = 1.5;

/// Number of levels that are shown beyond the level at which the last criterion fails.
const LEVELS_BEYOND: usize = 3;

fn chart(study: &Robustness, axis: &Axis<'_>) -> LineChart {
    // Far beyond the level at which the last criterion fails, the chart shows nothing new.
    let fails_at = axis.failing.iter().map(|levels| levels.iter().copied().fold(f64::NEG_INFINITY, f64::max));
    let last = fails_at.fold(f64::NEG_INFINITY, f64::max);
    let all_fail = axis.failing.iter().all(|levels| !levels.is_empty());
    let shown = axis.levels.iter().filter(|level| !all_fail || **level <= last).count() + LEVELS_BEYOND;
    let shown = shown.min(axis.levels.len());
    let points = |column: usize, value: fn(&CriterionCounts) -> f64| -> Vec<(f64, f64)> {
        let levels = axis.levels.iter().zip(axis.rows).take(shown);
        levels.map(|(level, cells)| (*level, value(&cells[column]))).collect()
    };
    let lines = study.criteria.iter().enumerate().flat_map(|(column, criterion)| {
        let name = criterion.name();
        let again = points(column, |cell| cell.again);
        let invented = points(column, |cell| cell.invented);
        [
            Line { name: format!("{name}: found again"), points: again, colour: column, faint: false },
            Line { name: format!("{name}: false ones"), points: invented, colour: column, faint: true },
        ]
    });
    let ends = |draws: &Vec<Vec<CriterionCounts>>, column: usize| {
        let again = draws.iter().map(|cells| cells[column].again);
        again.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], count| [low.min(count), high.max(count)])
    };
    let band = |column: usize| Band {
        points: axis
            .levels
            .iter()
            .zip(axis.draws)
            .take(shown)
            .map(|(level, draws)| (*level, ends(draws, column)))
            .collect(),
        colour: column,
    };
    let marks = axis.failing.iter().enumerate().flat_map(|(column, levels)| {
        let name = study.criteria[column].name();
        levels.iter().enumerate().map(move |(number, level)| Mark {
            name: if number == 0 { format!("{name} fails") } else { String::new() },
            x: *level,
            colour: column,
        })
    });
    let spread = match axis.draws.first().map_or(0, Vec::len) {
        0 | 1 => String::new(),
        draws => format!(": mean and range of {draws} draws"),
    };
    let most = study.undisturbed.iter().copied().max().unwrap_or(0).max(study.reference);
    LineChart {
        title: format!("Lane changes found, by criterion{spread}"),
        x_name: axis.name.to_owned(),
        y_name: "lane changes".to_owned(),
        lines: lines.collect(),
        level: Some(("reference".to_owned(), study.reference as f64)),
        legend: Legend::Right,
        bands: if axis.draws.is_empty() { Vec::new() } else { (0..study.criteria.len()).map(band).collect() },
        marks: marks.collect(),
        most: Some((MOST * most as f64).max(1.0)),
    }
}
