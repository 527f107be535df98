//! Draws the regimes of the Wiedemann 99 model in the plane of speed difference and gap, and the
//! trajectory of a follower.
//!
//! ```sh
//! cargo run --release -p closecall-xtask -- plot-regimes docs/reference/wiedemann99-regimes.svg
//! ```
//!
//! The colours show the regime that the model itself reports, for a driver with the defaults of
//! Vissim behind a lead vehicle at 30 m/s, before the driver has perceived anything. The lines are
//! the thresholds of the model. The trajectory shows a driver that approaches the lead vehicle at
//! 36 m/s, with an actuator lag of 0.15 s, over two minutes.

use std::error::Error;

use closecall_controllers::{Lead, Regime, Wiedemann99, Wiedemann99Config, Wiedemann99Model};
use closecall_traffic::{Check, Parameters};
use plotters::prelude::*;

use crate::plot::{self, Plane, steps};

const LEAD_MPS: f64 = 30.0;
const DESIRED_MPS: f64 = 36.0;
/// Ranges of the axes: speed of the lead vehicle minus own speed (m/s), and gap (m).
const OPENING_MPS: (f64, f64) = (-7.0, 5.0);
const GAP_M: (f64, f64) = (0.0, 110.0);
/// Size of a coloured cell: speed difference (m/s) and gap (m).
const CELL: (f64, f64) = (0.1, 1.0);
const SIZE_PX: (u32, u32) = (900, 640);
const STEP_S: f64 = 0.01;
const DURATION_S: f64 = 120.0;
const LAG_S: f64 = 0.15;

const REGIMES: [(Regime, &str, RGBColor); 4] = [
    (Regime::Free, "free", RGBColor(224, 242, 224)),
    (Regime::Approaching, "approaching", RGBColor(255, 236, 190)),
    (Regime::Following, "following", RGBColor(205, 226, 250)),
    (Regime::Emergency, "emergency", RGBColor(250, 205, 205)),
];

fn lead(gap_m: f64) -> Lead {
    Lead { gap_m, speed_mps: LEAD_MPS, acceleration_mps2: 0.0 }
}

/// Returns the regime of a driver that has not perceived anything yet.
fn regime(driver: &Wiedemann99, opening_mps: f64, gap_m: f64) -> Regime {
    let mut model = Wiedemann99Model::new(driver);
    model.acceleration_mps2(LEAD_MPS - opening_mps, DESIRED_MPS, Some(&lead(gap_m)));
    model.regime()
}

/// Splits a row of cells into stretches with the same regime. Returns two opposite corners and the
/// regime of each.
fn stretches(driver: &Wiedemann99, gap_m: f64) -> Vec<([(f64, f64); 2], Regime)> {
    let mut stretches: Vec<([(f64, f64); 2], Regime)> = Vec::new();
    for opening_mps in steps(OPENING_MPS, CELL.0) {
        let end = (opening_mps + CELL.0, gap_m + CELL.1);
        let cell_regime = regime(driver, opening_mps + 0.5 * CELL.0, gap_m + 0.5 * CELL.1);
        match stretches.last_mut() {
            Some((corners, last)) if *last == cell_regime => corners[1] = end,
            _ => stretches.push(([(opening_mps, gap_m), end], cell_regime)),
        }
    }
    stretches
}

/// Returns the speed difference (m/s) and the gap (m) at each step of a driver that approaches from
/// behind.
fn approach(driver: &Wiedemann99) -> Vec<(f64, f64)> {
    let mut model = Wiedemann99Model::new(driver);
    let (mut gap_m, mut speed_mps, mut actual_mps2) = (GAP_M.1, DESIRED_MPS, 0.0);
    let mut way = Vec::new();
    for _ in steps((0.0, DURATION_S), STEP_S) {
        let wanted_mps2 = model.acceleration_mps2(speed_mps, DESIRED_MPS, Some(&lead(gap_m)));
        actual_mps2 += STEP_S / LAG_S * (wanted_mps2 - actual_mps2);
        let next_mps = f64::max(speed_mps + STEP_S * actual_mps2, 0.0);
        gap_m += STEP_S * (LEAD_MPS - 0.5 * (speed_mps + next_mps));
        speed_mps = next_mps;
        way.push((LEAD_MPS - speed_mps, gap_m));
    }
    way
}

/// Returns the label of each threshold, and its points in the plane.
fn thresholds(driver: &Wiedemann99) -> Vec<(&'static str, Vec<(f64, f64)>)> {
    let model = Wiedemann99Model::new(driver);
    let over_speed = |threshold: fn(&closecall_controllers::Thresholds) -> f64| {
        let point = |opening: f64| (opening, threshold(&model.thresholds(LEAD_MPS - opening, &lead(GAP_M.0))));
        steps(OPENING_MPS, CELL.0).map(point).filter(|(_, gap)| (GAP_M.0..GAP_M.1).contains(gap)).collect()
    };
    let over_gap = |threshold: fn(&closecall_controllers::Thresholds) -> f64| {
        let point = |gap: f64| (threshold(&model.thresholds(LEAD_MPS, &lead(gap))), gap);
        let inside = |(opening, _): &(f64, f64)| (OPENING_MPS.0..OPENING_MPS.1).contains(opening);
        steps(GAP_M, CELL.1).map(point).filter(inside).collect()
    };
    vec![
        ("safe = cc0 + cc1·v", over_speed(|thresholds| thresholds.safe_m)),
        ("follow = safe + cc2", over_speed(|thresholds| thresholds.follow_m)),
        ("approach = follow + cc3·(Δv − cc4)", over_speed(|thresholds| thresholds.approach_m)),
        ("closing is noticed: cc4 − c·g²", over_gap(|thresholds| thresholds.closing_mps)),
        ("opening is noticed: cc5 + c·g²", over_gap(|thresholds| thresholds.opening_mps)),
    ]
}

pub(crate) fn main(words: Vec<String>) -> Result<(), Box<dyn Error>> {
    let driver = Wiedemann99Config::default().check(&Parameters::default())?;
    plot::write(words, SIZE_PX, "Wiedemann 99 behind a leader at 30 m/s", [OPENING_MPS, GAP_M], |chart| {
        draw(chart, &driver)?;
        let (x, y) = ("Δv = speed of the leader − own speed [m/s]", "gap, bumper to bumper [m]");
        chart.configure_mesh().disable_mesh().x_desc(x).y_desc(y).draw()?;
        Ok(())
    })
}

fn draw(chart: &mut Plane<'_>, driver: &Wiedemann99) -> Result<(), Box<dyn Error>> {
    let cells: Vec<_> = steps(GAP_M, CELL.1).flat_map(|gap_m| stretches(driver, gap_m)).collect();
    for (regime, name, colour) in REGIMES {
        let style = colour.filled();
        let of_regime = cells.iter().filter(|(_, cell_regime)| *cell_regime == regime);
        chart
            .draw_series(of_regime.map(|(corners, _)| Rectangle::new(*corners, style)))?
            .label(name)
            .legend(move |(x, y)| Rectangle::new([(x, y - 5), (x + 16, y + 5)], style));
    }
    for (index, (name, points)) in thresholds(driver).into_iter().enumerate() {
        let line = Palette99::pick(index + 2).stroke_width(2);
        chart
            .draw_series(LineSeries::new(points, line))?
            .label(name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 16, y)], line));
    }
    let line = BLACK.stroke_width(1);
    chart
        .draw_series(LineSeries::new(approach(driver), line))?
        .label("a driver who comes up at 36 m/s")
        .legend(move |(x, y)| PathElement::new([(x, y), (x + 16, y)], line));
    Ok(())
}
