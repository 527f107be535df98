//! Whether a recording's numbers can be those of road traffic: units and columns that are mixed up show here.
//!
//! A single number may be odd, and NGSIM has many that are; so medians are judged, over the beginning of the recording.
//!
//! | what | plausible | caught |
//! |---|---|---|
//! | median length of cars | 2 to 12 m | feet for metres and the reverse, length and width swapped |
//! | median width of cars | 1 to 3 m | the same |
//! | median of (distance between two frames) / (speed · time) | 0.6 to 1.6 | km/h, mph or ft/s for m/s (3.6, 2.2, 3.3), a wrong frame rate, s and d swapped, traffic that drives backwards |

use std::collections::BTreeMap;

use closecall_traffic::{Time, VehicleClass};

use super::source::{Refusal, Row};
use super::{Layout, RecordingProblem};

/// Slower vehicles say little about units: positions are noisy [m/s].
const FROM_MPS: f64 = 5.0;

/// Steps between frames that have to be there before their median is judged.
const FEWEST_STEPS: usize = 10;

/// Refuses rows whose medians no traffic has.
pub(super) fn check(rows: &[Row], layout: Layout) -> Result<(), Refusal> {
    let cars = || rows.iter().filter(|row| row.class == VehicleClass::Car);
    // In-car logs need not state the vehicle's size, and have one vehicle only, which may be any.
    if layout != Layout::InCar {
        let lengths = cars().map(|row| (row.length_m, row.line)).collect();
        judge(lengths, (2.0, 12.0), ("the median length of cars", "m", "2 to 12 m"))?;
        let widths = cars().map(|row| (row.width_m, row.line)).collect();
        judge(widths, (1.0, 3.0), ("the median width of cars", "m", "1 to 3 m"))?;
    }
    let steps = steps(rows);
    if steps.len() < FEWEST_STEPS {
        return Ok(());
    }
    let what = "the median distance between two frames, as a share of what the recorded speed makes,";
    judge(steps, (0.6, 1.6), (what, "", "0.6 to 1.6"))
}

/// Distance travelled between two rows as a share of what the speed makes, and the later row's line.
fn steps(rows: &[Row]) -> Vec<(f64, u64)> {
    let mut latest: BTreeMap<(u64, Time), &Row> = BTreeMap::new();
    let mut steps = Vec::new();
    for row in rows {
        let Some(before) = latest.insert((row.number, row.origin), row) else { continue };
        let (time_s, speed_mps) = ((row.time - before.time).s(), 0.5 * (row.speed_mps + before.speed_mps));
        let follows = row.frame == before.frame + 1 && time_s > 0.0;
        if follows && speed_mps > FROM_MPS {
            steps.push(((row.s_m - before.s_m) / (speed_mps * time_s), row.line));
        }
    }
    steps
}

/// Refuses `values` whose median lies outside `low..=high`, at the line where the median is.
fn judge(
    mut values: Vec<(f64, u64)>,
    (low, high): (f64, f64),
    (what, unit, allowed): (&'static str, &str, &'static str),
) -> Result<(), Refusal> {
    if values.is_empty() {
        return Ok(());
    }
    let middle = values.len() / 2;
    let (median, line) = *values.select_nth_unstable_by(middle, |a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))).1;
    if median >= low && median <= high {
        return Ok(());
    }
    let found = format!("{median:.3} {unit}").trim_end().to_owned();
    Err(Refusal::new(line, RecordingProblem::Implausible { what, found, allowed }))
}
