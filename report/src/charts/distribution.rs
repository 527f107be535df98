//! Distributions: of the margins, arm by arm, and of the sampled values, by what became of the samples.

use std::io;

use plotters::prelude::*;

use super::style::{AXIS, DESCRIPTION_PX, GRID, LABEL_PX, arm_colour, colour, draw};
use crate::campaign::overview::{Axis, BINS, CELLS, Fate, MarginBins, MarginKind};
use crate::units::labelled;

/// Size of a small chart [px].
const SMALL: (u32, u32) = (420, 220);
/// Room above the highest bar, as a share of it.
const HEADROOM: f64 = 1.08;

/// The distribution of one margin, the arms over each other.
pub(crate) fn margin(kind: &MarginKind, arms: &[MarginBins]) -> io::Result<String> {
    let most = arms.iter().flat_map(|bins| bins.counts).max().unwrap_or(0).max(1) as f64;
    draw(SMALL, |canvas| {
        let mut chart = ChartBuilder::on(canvas)
            .margin(8)
            .margin_right(20)
            .x_label_area_size(38)
            .y_label_area_size(48)
            .build_cartesian_2d(0.0..kind.high, 0.0..most * HEADROOM)?;
        chart
            .configure_mesh()
            .disable_x_mesh()
            .light_line_style(WHITE)
            .bold_line_style(GRID)
            .axis_style(AXIS)
            .y_labels(4)
            .y_label_formatter(&whole)
            .label_style(("sans-serif", LABEL_PX).into_font().color(&AXIS))
            .axis_desc_style(("sans-serif", DESCRIPTION_PX).into_font().color(&AXIS))
            .x_desc(kind.title)
            .draw()?;
        let width = kind.high / BINS as f64;
        for (place, bins) in arms.iter().enumerate() {
            let colour = arm_colour(place + 1 == arms.len());
            let steps: Vec<(f64, f64)> = bins
                .counts
                .iter()
                .enumerate()
                .flat_map(|(bin, &count)| [bin as f64, bin as f64 + 1.0].map(|edge| (edge * width, count as f64)))
                .collect();
            chart.draw_series(AreaSeries::new(steps.iter().copied(), 0.0, colour.mix(0.18)))?;
            chart.draw_series(LineSeries::new(steps, colour.stroke_width(2)))?;
        }
        Ok(())
    })
}

/// How the samples cover one parameter, and what became of them in each part of it.
pub(crate) fn coverage(axis: &Axis, counts: &[[u64; Fate::ALL.len()]; CELLS]) -> io::Result<String> {
    let cells = axis.cells(CELLS);
    let [low, high] = axis.ends();
    let most = counts.iter().map(|counts| counts.iter().sum::<u64>()).max().unwrap_or(0).max(1) as f64;
    draw(SMALL, |canvas| {
        let mut chart = ChartBuilder::on(canvas)
            .margin(8)
            .margin_right(20)
            .x_label_area_size(38)
            .y_label_area_size(48)
            .build_cartesian_2d(low..high, 0.0..most * HEADROOM)?;
        let label = |value: &f64| label_of(axis, *value);
        chart
            .configure_mesh()
            .disable_x_mesh()
            .light_line_style(WHITE)
            .bold_line_style(GRID)
            .axis_style(AXIS)
            .x_labels(6)
            .y_labels(4)
            .x_label_formatter(&label)
            .y_label_formatter(&whole)
            .label_style(("sans-serif", LABEL_PX).into_font().color(&AXIS))
            .axis_desc_style(("sans-serif", DESCRIPTION_PX).into_font().color(&AXIS))
            .x_desc(labelled(axis.name()))
            .draw()?;
        let width = (high - low) / cells as f64;
        // A sliver of white between two bars.
        let gap = 0.04 * width;
        for (cell, counts) in counts.iter().enumerate().take(cells) {
            let left = low + cell as f64 * width;
            let mut below = 0_u64;
            for fate in Fate::ALL {
                let above = below + counts[fate as usize];
                let corners = [(left + gap, below as f64), (left + width - gap, above as f64)];
                chart.draw_series([Rectangle::new(corners, colour(fate).filled())])?;
                below = above;
            }
        }
        Ok(())
    })
}

/// A count at its place of an axis; nothing between two counts.
fn whole(count: &f64) -> String {
    if count.fract() == 0.0 { format!("{count:.0}") } else { String::new() }
}

/// The text at a place of an axis: the label that stands there, or the number.
pub(super) fn label_of(axis: &Axis, value: f64) -> String {
    match axis {
        Axis::Numbers { low, high, .. } => {
            // As many digits as a hundredth of the axis needs.
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few digits")]
            let digits = (2.0 - (high - low).log10().floor()).clamp(0.0, 6.0) as usize;
            let text = format!("{value:.digits$}");
            if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
        }
        Axis::Labels { labels, .. } => {
            let nearest = value.round();
            let is_there = (value - nearest).abs() < 0.25 && nearest >= 0.0;
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked above")]
            is_there.then(|| labels.get(nearest as usize).cloned()).flatten().unwrap_or_default()
        }
    }
}
