//! Measures the cost of a control step of a library or an FMU.

use std::time::Instant;

use crate::external::abi::Track;
use crate::external::exchange::{Input, Setup};
use crate::external::fmu::VariableTable;
use crate::external::loaded::Loaded;
use serde_json::json;

/// The settings and the road of the measurement: cruise control and emergency braking with their
/// default values.
fn setup() -> Setup {
    let settings = json!({
        "acc": { "set_speed_mps": null, "time_gap_s": 1.0, "standstill_gap_m": 2.0 },
        "aeb": { "trigger_mps2": 4.0, "max_deceleration_mps2": 9.0, "standstill_gap_m": 0.5 },
        "mis": null,
        "automated": true,
    });
    let lane_width_m = 3.75;
    let lane_widths_m = vec![lane_width_m; 3];
    Setup { lane_width_m, lane_widths_m, speed_limit_mps: 36.1, ..Setup::of_settings(&settings) }
}

/// Returns the mean wall time of a control step with `tracks` tracks (s), over `steps` steps of one
/// run. The time includes the conversion of the tracks to the form of the interface.
///
/// # Errors
/// The message of the controller if it fails.
pub fn step_s(loaded: &Loaded, tracks: usize, steps: u32) -> Result<f64, String> {
    let mut run = loaded.start(&setup(), &VariableTable::default())?;
    let track = |index: usize| Track {
        id: u32::try_from(index).unwrap_or(u32::MAX),
        status: 1,
        x_m: 10.0 * index as f64,
        vx_mps: 30.0,
        length_m: 4.5,
        width_m: 1.8,
        existence: 1.0,
        lane: [0.0, 1.0, 0.0],
        ..Track::default()
    };
    let given: Vec<Track> = (0..tracks).map(track).collect();
    let mut input = Input::default();
    let started = Instant::now();
    for step in 0..steps {
        let view = crate::external::abi::InputView {
            time_ns: i64::from(step) * 40_000_000,
            time_s: f64::from(step) * 0.04,
            speed_mps: 30.0,
            length_m: 4.5,
            width_m: 1.8,
            front_gap_m: 35.0,
            front_speed_mps: 29.0,
            has_front: 1,
            front_works: 1,
            surround_works: 1,
            rear_works: 1,
            lane: 2,
            ..*input.values()
        };
        let mut tracks = input.into_tracks();
        tracks.clear();
        tracks.extend(given.iter().copied());
        input = Input::with(view, tracks);
        std::hint::black_box(run.step(std::hint::black_box(&input))?);
    }
    Ok(started.elapsed().as_secs_f64() / f64::from(steps))
}
