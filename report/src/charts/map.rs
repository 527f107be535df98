//! The outcome over two parameters.

use std::io;

use plotters::prelude::*;

use super::distribution::label_of;
use super::style::{AXIS, DESCRIPTION_PX, LABEL_PX, colour, draw};
use crate::campaign::overview::{Axis, CELLS, Fate, PairBins, ScenarioOverview};
use crate::units::labelled;

/// Size of the map [px].
const SIZE: (u32, u32) = (760, 460);
/// Darkest shade of a cell in which every sample has a collision.
const DARKEST: f64 = 0.45;
/// Radius of a point [px]; those that matter are larger.
const POINT_PX: i32 = 3;
const SMALL_POINT_PX: i32 = 2;
/// Room that points at one label are spread over, in steps between labels.
const SPREAD: f64 = 0.6;

/// The map of two parameters: cells are shaded by the share of samples with a collision in any arm, points are samples.
pub(crate) fn outcome_map(scenario: &ScenarioOverview, pair: &PairBins) -> io::Result<String> {
    let [across, up] = pair.axes.map(|place| &scenario.axes[place]);
    let ([left, right], [bottom, top]) = (across.ends(), up.ends());
    draw(SIZE, |canvas| {
        let mut chart = ChartBuilder::on(canvas)
            .margin(10)
            .x_label_area_size(46)
            .y_label_area_size(70)
            .build_cartesian_2d(left..right, bottom..top)?;
        let shade = RGBColor(0xd3, 0x54, 0x00);
        let (columns, rows) = (across.cells(CELLS), up.cells(CELLS));
        let (width, height) = ((right - left) / columns as f64, (top - bottom) / rows as f64);
        for (x, cells) in pair.cells.iter().enumerate().take(columns) {
            for (y, [samples, collisions]) in cells.iter().enumerate().take(rows) {
                if *samples > 0 {
                    let share = *collisions as f64 / *samples as f64;
                    let (x, y) = (left + x as f64 * width, bottom + y as f64 * height);
                    let corners = [(x, y), (x + width, y + height)];
                    chart.draw_series([Rectangle::new(corners, shade.mix(DARKEST * share).filled())])?;
                }
            }
        }
        chart
            .configure_mesh()
            .disable_mesh()
            .axis_style(AXIS)
            .x_labels(8)
            .y_labels(8)
            .x_label_formatter(&|value| label_of(across, *value))
            .y_label_formatter(&|value| label_of(up, *value))
            .label_style(("sans-serif", LABEL_PX).into_font().color(&AXIS))
            .axis_desc_style(("sans-serif", DESCRIPTION_PX).into_font().color(&AXIS))
            .x_desc(labelled(across.name()))
            .y_desc(labelled(up.name()))
            .draw()?;
        // The order of the fates is the order of weight: what matters most is drawn last.
        for point in scenario.points() {
            let place = |axis: &Axis, salt: u64| {
                let value = point.parameters.iter().find(|(name, _)| name.as_str() == axis.name())?.1;
                Some(axis.position(value)? + spread(axis, point.sample ^ salt))
            };
            if let (Some(x), Some(y)) = (place(across, 0), place(up, u64::MAX)) {
                let radius = if point.fate == Fate::Passed { SMALL_POINT_PX } else { POINT_PX };
                chart.draw_series([Circle::new((x, y), radius, colour(point.fate).filled())])?;
            }
        }
        Ok(())
    })
}

/// Points that share a label are laid beside each other, by a hash of their number.
fn spread(axis: &Axis, number: u64) -> f64 {
    match axis {
        Axis::Numbers { .. } => 0.0,
        Axis::Labels { .. } => {
            let unit = closecall_campaign::partition::split_mix(number) as f64 / u64::MAX as f64;
            SPREAD * (unit - 0.5)
        }
    }
}
