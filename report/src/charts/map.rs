//! Draws the map of the outcomes over two parameters.

use std::io;

use maud::Markup;
use plotters::prelude::*;

use super::distribution::parameter_axis;
use super::style::{COLLISIONS, Drawn, MAP_PX, Plot, WIDEST_MAP_PX, axes, fate_colour, scaled};
use crate::campaign::overview::{Axis, CELLS, Fate, PairBins, Point, ScenarioOverview};
use crate::units::labelled;

/// Opacity of a cell in which every sample has a collision.
const LARGEST_OPACITY: f64 = 0.45;
/// Radius of the point of a sample with a collision (px).
const POINT_PX: i32 = 3;
/// Radius of the point of a sample without a collision (px).
const SMALL_POINT_PX: i32 = 2;
/// Width over which the points at one label are spread, in steps between labels.
const SPREAD: f64 = 0.6;

/// Draws the map of two parameters. The shade of a cell is the share of its samples with a
/// collision in the arm under test. Points are samples.
pub(crate) fn outcome_map(scenario: &ScenarioOverview, pair: &PairBins) -> io::Result<Markup> {
    let [across, up] = pair.axes.map(|index| &scenario.axes[index]);
    scaled(MAP_PX, WIDEST_MAP_PX, |canvas| {
        let [x_name, y_name] = [across, up].map(|axis| labelled(axis.name()));
        let (x, y) = (parameter_axis(across, &x_name, 5), parameter_axis(up, &y_name, 8));
        let mut plot = axes(canvas, None, &x, &y)?;
        draw_cells(&mut plot, pair, across, up)?;
        // Fates are ordered by their weight: the gravest is drawn last.
        for point in scenario.points() {
            if let (Some(x), Some(y)) = (position(across, point, 0), position(up, point, u64::MAX)) {
                let radius = if point.fate == Fate::Passed { SMALL_POINT_PX } else { POINT_PX };
                plot.draw_series([Circle::new((x, y), radius, fate_colour(point.fate).filled())])?;
            }
        }
        Ok(())
    })
}

/// Returns the colour of a cell with this share of samples with a collision, as a style sheet
/// writes it.
pub(crate) fn cell_css(share: f64) -> String {
    let RGBColor(red, green, blue) = COLLISIONS;
    format!("rgba({red}, {green}, {blue}, {:.2})", LARGEST_OPACITY * share)
}

fn draw_cells(plot: &mut Plot<'_, '_>, pair: &PairBins, across: &Axis, up: &Axis) -> Drawn {
    let ([left, right], [bottom, top]) = (across.ends(), up.ends());
    let (columns, rows) = (across.cells(CELLS), up.cells(CELLS));
    let (width, height) = ((right - left) / columns as f64, (top - bottom) / rows as f64);
    for (column, cells) in pair.cells.iter().enumerate().take(columns) {
        for (row, [samples, _, collisions]) in cells.iter().enumerate().take(rows) {
            if *collisions > 0 {
                let share = *collisions as f64 / *samples as f64;
                let (x, y) = (left + column as f64 * width, bottom + row as f64 * height);
                let shade = COLLISIONS.mix(LARGEST_OPACITY * share).filled();
                plot.draw_series([Rectangle::new([(x, y), (x + width, y + height)], shade)])?;
            }
        }
    }
    Ok(())
}

/// Returns the position of a sample along an axis; `salt` makes the spread of the two axes
/// independent.
fn position(axis: &Axis, point: &Point, salt: u64) -> Option<f64> {
    let value = point.parameters.iter().find(|(name, _)| name.as_str() == axis.name())?.1;
    Some(axis.position(value)? + spread(axis, point.sample ^ salt))
}

/// Returns the distance of a point from its label: points at one label are spread by a hash of the
/// sample's number.
fn spread(axis: &Axis, number: u64) -> f64 {
    match axis {
        Axis::Numbers { .. } => 0.0,
        Axis::Labels { .. } => {
            let share = closecall_campaign::partition::split_mix(number) as f64 / u64::MAX as f64;
            SPREAD * (share - 0.5)
        }
    }
}
