//! Draws distributions: of each margin, by arm, and of each sampled value, by the fate of the
//! sample.

use std::io;

use maud::Markup;
use plotters::prelude::*;

use super::style::{ChartAxis, SMALL_PX, arm_colour, axes, fate_colour, inline, label_text, number_text};
use crate::campaign::overview::{Axis, BINS, CELLS, Fate, MarginBins, MarginKind};
use crate::units::labelled;

/// Room above the highest bar, as a share of its height.
const HEADROOM: f64 = 1.08;
/// Distance of the name of a limit from its line, as a share of the axis.
const LABEL_GAP: f64 = 0.01;
/// Opacity of the area below a distribution.
const AREA_OPACITY: f64 = 0.18;
/// White space on both sides of a bar, as a share of its width.
const BAR_GAP: f64 = 0.04;

/// Draws the distributions of one margin in all arms, one over the other.
pub(crate) fn margin(kind: &MarginKind, arms: &[MarginBins]) -> io::Result<Markup> {
    let most = arms.iter().flat_map(|bins| bins.counts).max().unwrap_or(0);
    inline(SMALL_PX, |canvas| {
        let x = ChartAxis {
            name: kind.title,
            range: 0.0..kind.high,
            labels: 8,
            text: Box::new(number_text(0.0, kind.high)),
            has_grid: false,
        };
        let mut plot = axes(canvas, None, &x, &count_axis(most))?;
        let width = kind.high / BINS as f64;
        for (index, bins) in arms.iter().enumerate() {
            let colour = arm_colour(index + 1 == arms.len());
            let steps = steps(&bins.counts, width);
            plot.draw_series(AreaSeries::new(steps.iter().copied(), 0.0, colour.mix(AREA_OPACITY)))?;
            plot.draw_series(LineSeries::new(steps, colour.stroke_width(2)))?;
        }
        if let Some((limit, name)) = kind.limit {
            let top = HEADROOM * most.max(1) as f64;
            let style = fate_colour(Fate::Induced).stroke_width(1);
            plot.draw_series(DashedLineSeries::new([(limit, 0.0), (limit, top)], 4, 3, style))?;
            let text = Text::new(name, (limit + LABEL_GAP * kind.high, 0.98 * top), label_text(true));
            plot.draw_series([text])?;
        }
        Ok(())
    })
}

/// Returns the corners of the steps of a distribution, whose bins have this width. Bins of equal
/// counts form one step: most bins of a small campaign are empty.
fn steps(counts: &[u64], width: f64) -> Vec<(f64, f64)> {
    let mut corners = Vec::new();
    let mut left = 0;
    for step in counts.chunk_by(PartialEq::eq) {
        let right = left + step.len();
        corners.extend([left, right].map(|edge| (edge as f64 * width, step[0] as f64)));
        left = right;
    }
    corners
}

/// Draws how many samples lie in each part of a parameter's range, by their fate.
pub(crate) fn coverage(axis: &Axis, counts: &[[u64; Fate::ALL.len()]; CELLS]) -> io::Result<Markup> {
    let cells = axis.cells(CELLS);
    let [low, high] = axis.ends();
    let most = counts.iter().map(|counts| counts.iter().sum::<u64>()).max().unwrap_or(0);
    inline(SMALL_PX, |canvas| {
        let name = labelled(axis.name());
        let mut plot = axes(canvas, None, &parameter_axis(axis, &name, 6), &count_axis(most))?;
        let width = (high - low) / cells as f64;
        let gap = BAR_GAP * width;
        for (cell, counts) in counts.iter().enumerate().take(cells) {
            let left = low + cell as f64 * width;
            let mut below = 0_u64;
            for fate in Fate::ALL {
                let above = below + counts[fate as usize];
                if above > below {
                    let corners = [(left + gap, below as f64), (left + width - gap, above as f64)];
                    plot.draw_series([Rectangle::new(corners, fate_colour(fate).filled())])?;
                }
                below = above;
            }
        }
        Ok(())
    })
}

/// Returns the vertical axis of a distribution, from zero to the largest count.
fn count_axis(most: u64) -> ChartAxis<'static> {
    // plotters may place a label between two counts. Such a label stays empty.
    let text = |count: &f64| if count.fract() == 0.0 { format!("{count:.0}") } else { String::new() };
    let range = 0.0..most.max(1) as f64 * HEADROOM;
    ChartAxis { name: "", range, labels: 4, text: Box::new(text), has_grid: true }
}

/// Returns the axis of a parameter, with at most this many labels.
pub(super) fn parameter_axis<'a>(axis: &'a Axis, name: &'a str, labels: usize) -> ChartAxis<'a> {
    let [low, high] = axis.ends();
    let text: Box<dyn Fn(&f64) -> String + 'a> = match axis {
        Axis::Numbers { low, high, .. } => Box::new(number_text(*low, *high)),
        Axis::Labels { labels, .. } => Box::new(|value: &f64| label_near(labels, *value)),
    };
    ChartAxis { name, range: low..high, labels, text, has_grid: false }
}

/// Returns the label at a position of the axis, or an empty text if the position lies between two
/// labels.
fn label_near(labels: &[String], position: f64) -> String {
    let nearest = position.round();
    let is_near = (position - nearest).abs() < 0.25 && nearest >= 0.0;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked above")]
    is_near.then(|| labels.get(nearest as usize).cloned()).flatten().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bins_of_equal_counts_form_one_step() {
        assert_eq!(
            steps(&[0, 0, 3, 3, 3, 1], 0.5),
            [(0.0, 0.0), (1.0, 0.0), (1.0, 3.0), (2.5, 3.0), (2.5, 1.0), (3.0, 1.0)]
        );
        assert_eq!(steps(&[2; 40], 1.0), [(0.0, 2.0), (40.0, 2.0)]);
        assert!(steps(&[], 1.0).is_empty());
    }
}
