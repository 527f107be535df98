//! Writes a plot with a legend.

use std::error::Error;
use std::path::PathBuf;

use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;

/// A plot with its axes, to which series are added.
pub(crate) type Plane<'a> = ChartContext<'a, SVGBackend<'a>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

/// Writes a plot to the path in the first word. `ranges` has the ends of both axes.
pub(crate) fn write(
    words: Vec<String>,
    size_px: (u32, u32),
    caption: &str,
    ranges: [(f64, f64); 2],
    draw: impl FnOnce(&mut Plane<'_>) -> Result<(), Box<dyn Error>>,
) -> Result<(), Box<dyn Error>> {
    let path: PathBuf = words.into_iter().next().ok_or("give the path of the SVG to write")?.into();
    let area = SVGBackend::new(&path, size_px).into_drawing_area();
    area.fill(&WHITE)?;
    let [x, y] = ranges;
    let mut chart = ChartBuilder::on(&area)
        .caption(caption, ("sans-serif", 22))
        .margin(12)
        .x_label_area_size(46)
        .y_label_area_size(56)
        .build_cartesian_2d(x.0..x.1, y.0..y.1)?;
    draw(&mut chart)?;
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperRight)
        .background_style(WHITE.mix(0.85))
        .border_style(BLACK)
        .draw()?;
    area.present()?;
    Ok(())
}

/// Returns the values from the start of a range up to its end, at a distance of `step`.
pub(crate) fn steps((from, to): (f64, f64), step: f64) -> impl Iterator<Item = f64> {
    (0..).map(move |index| from + f64::from(index) * step).take_while(move |value| *value < to)
}
