//! Draws the echo pulse widths that the model of the SCALA 2 predicts, beside the published widths
//! of a LiDAR of the same maker.
//!
//! ```sh
//! cargo run --release -p closecall-xtask -- plot-echo-widths docs/evidence/echo-width.svg
//! ```
//!
//! The lines are for surfaces that face the sensor and fill its beam. The marks are three boards of
//! reflectivity 0.5 before an Ibeo LUX 2010 (`docs/evidence/lidar.md` has the source). The source
//! gives lengths, without saying whether light passes them once or twice.

use std::error::Error;

use closecall_sensors::lidar::{LidarConfig, echo_pulse_width_ns};
use closecall_traffic::{Check, Num, Parameters};
use plotters::prelude::*;

use crate::plot::{self, Plane, steps};

/// Ranges of the axes: range (m) and echo pulse width (ns).
const RANGE_M: (f64, f64) = (0.0, 220.0);
const WIDTH_NS: (f64, f64) = (0.0, 24.0);
const NEAREST_M: f64 = 5.0;
const STEP_M: f64 = 0.5;
const SIZE_PX: (u32, u32) = (900, 560);
/// Length of light in a nanosecond (m).
const M_PER_NS: f64 = 0.299_792_458;
/// Name, reflectivity and window transmission of each line.
const LINES: [(&str, f64, f64); 4] = [
    ("plate in use (20π)", 62.83, 1.0),
    ("reflectivity 0.5", 0.5, 1.0),
    ("reflectivity 0.5, window transmits 0.5", 0.5, 0.5),
    ("reflectivity 0.1", 0.1, 1.0),
];
/// Colours of the lines, then of the marks, by their places in the palette: none is too light on white.
const COLOURS: [usize; 6] = [0, 1, 12, 3, 4, 5];
/// Size of the labels (px).
const LABEL_PX: u32 = 15;
/// Range (m) and published echo pulse width (m) of the boards.
const MEASURED: [(f64, f64); 3] = [(19.865, 1.829), (14.995, 1.989), (9.984, 2.029)];

pub(crate) fn main(words: Vec<String>) -> Result<(), Box<dyn Error>> {
    plot::write(words, SIZE_PX, "Echo pulse width", [RANGE_M, WIDTH_NS], draw)
}

fn draw(chart: &mut Plane<'_>) -> Result<(), Box<dyn Error>> {
    let font = ("sans-serif", LABEL_PX);
    let mut mesh = chart.configure_mesh();
    mesh.light_line_style(WHITE).label_style(font).x_desc("range [m]").y_desc("echo pulse width [ns]").draw()?;
    for (index, (name, reflectivity, window_transmission)) in LINES.into_iter().enumerate() {
        let config = LidarConfig { window_transmission: Num::Fixed(window_transmission), ..LidarConfig::default() };
        let lidar = config.check(&Parameters::default())?;
        let point = |range_m: f64| (range_m, echo_pulse_width_ns(&lidar, reflectivity, range_m));
        let points = steps((NEAREST_M, RANGE_M.1), STEP_M).map(point).filter(|(_, width_ns)| *width_ns > 0.0);
        let line = Palette99::pick(COLOURS[index]).stroke_width(2);
        chart
            .draw_series(LineSeries::new(points, line))?
            .label(name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 16, y)], line));
    }
    let readings = [("LUX 2010, if light passes the length twice", 2.0), ("LUX 2010, if light passes it once", 1.0)];
    for (index, (name, passes)) in readings.into_iter().enumerate() {
        let mark = Palette99::pick(COLOURS[LINES.len() + index]).filled();
        let points = MEASURED.map(|(range_m, length_m)| (range_m, passes * length_m / M_PER_NS));
        chart
            .draw_series(points.into_iter().map(|point| Circle::new(point, 4, mark)))?
            .label(name)
            .legend(move |(x, y)| Circle::new((x + 8, y), 4, mark));
    }
    Ok(())
}
