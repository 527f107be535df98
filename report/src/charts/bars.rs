//! Small bars that stand in the cells of a table.

use std::io;

use maud::Markup;
use plotters::prelude::*;

use super::style::{Canvas, Drawn, GRID, arm_colour, fate_colour, sized};
use crate::campaign::overview::Fate;

/// Size of a bar on the page (px).
const SIZE_PX: (u32, u32) = (228, 18);
/// Drawing units in a pixel: plotters draws in whole units.
const UNITS_PER_PX: u32 = 8;
/// Room to the left and to the right of the scale (px).
const SIDE_PX: f64 = 4.0;
/// Length of the scale (px).
const SCALE_PX: f64 = 220.0;
/// Opacity of an interval.
const INTERVAL_OPACITY: f64 = 0.4;

/// Draws the rate of an arm as a dot on its 95 % interval. The scale ends at the probability
/// `most`.
pub(crate) fn rate(rate: Option<f64>, [low, high]: [f64; 2], most: f64, is_tested: bool) -> io::Result<Markup> {
    let x_px = |probability: f64| SIDE_PX + if most > 0.0 { SCALE_PX * probability / most } else { 0.0 };
    let colour = arm_colour(is_tested);
    bar(|canvas| {
        canvas.draw(&rectangle([SIDE_PX, 8.0], [SIDE_PX + SCALE_PX, 10.0], GRID.filled()))?;
        let end_px = x_px(high).max(x_px(low) + 1.0);
        canvas.draw(&rectangle([x_px(low), 6.0], [end_px, 12.0], colour.mix(INTERVAL_OPACITY).filled()))?;
        match rate {
            Some(rate) => canvas.draw(&Circle::new(units([x_px(rate), 9.0]), length(4.0), colour.filled())),
            None => Ok(()),
        }
    })
}

/// Draws the prevented collisions to the left of the middle, and the induced ones to the right. The
/// longest bar of the table stands for `most` collisions.
pub(crate) fn balance(prevented: u64, induced: u64, most: u64) -> io::Result<Markup> {
    let middle_px = SIDE_PX + 0.5 * SCALE_PX;
    let width_px = |count: u64| 0.5 * SCALE_PX * count as f64 / most as f64;
    bar(|canvas| {
        let left = [middle_px - width_px(prevented), 3.0];
        canvas.draw(&rectangle(left, [middle_px, 15.0], fate_colour(Fate::Prevented).filled()))?;
        let right = [middle_px + width_px(induced), 15.0];
        canvas.draw(&rectangle([middle_px, 3.0], right, fate_colour(Fate::Induced).filled()))?;
        canvas.draw(&rectangle([middle_px - 0.5, 0.0], [middle_px + 0.5, 18.0], GRID.filled()))
    })
}

fn bar(paint: impl FnOnce(&Canvas<'_>) -> Drawn) -> io::Result<Markup> {
    let (width, height) = SIZE_PX;
    let attributes =
        format!("width=\"{width}\" height=\"{height}\" role=\"img\" aria-label=\"Intervals of the shares\"");
    sized((UNITS_PER_PX * width, UNITS_PER_PX * height), &attributes, paint)
}

fn rectangle(upper_left_px: [f64; 2], lower_right_px: [f64; 2], style: ShapeStyle) -> Rectangle<(i32, i32)> {
    Rectangle::new([units(upper_left_px), units(lower_right_px)], style)
}

fn units(point_px: [f64; 2]) -> (i32, i32) {
    let [x, y] = point_px.map(length);
    (x, y)
}

fn length(px: f64) -> i32 {
    #[expect(clippy::cast_possible_truncation, reason = "a few thousand units")]
    let units = (px * f64::from(UNITS_PER_PX)).round() as i32;
    units
}
