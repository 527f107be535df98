//! Measures the speed of the whole loop for each depth of the sensor simulation, kind of road and
//! number of vehicles.
//!
//! ```sh
//! cargo run --release -p closecall-xtask -- throughput [ROUNDS [MODE]...]
//! cargo run --release -p closecall-xtask -- throughput instructions
//! ```
//!
//! The first command prints one line of JSON per mode, with the simulated seconds per second of
//! processor time. The modes take turns: other programs on the machine then disturb all modes
//! alike. The time is the time of this thread alone (`/proc/thread-self/schedstat`; wall time where
//! there is none). Before each mode a fixed loop is timed: `per_calibration` is the number of
//! simulated seconds in the time of that loop, which makes figures of different machines
//! comparable. Where Callgrind is installed, the lines have the instructions of the counted modes.
//! A second line for each mode has the wall time of each stage, see [`stages`]. If modes are named,
//! only these are timed, without instructions. No validity check is run; a campaign's checks come
//! on top.
//!
//! The second command counts instructions with Callgrind (Debian's package `valgrind`), see
//! [`instructions`].

#![expect(clippy::print_stdout, reason = "a measurement prints its figures")]

mod instructions;
mod modes;
mod stages;
mod traffic;

use std::collections::BTreeMap;
use std::error::Error;
use std::time::Instant;

use closecall_scenarios::Scenario;
use closecall_traffic::CONTROL_STEP;
use modes::{Mode, modes};
use serde_json::json;

/// Number of rounds if none is given.
const ROUNDS: u32 = 3;
/// Number of steps of the calibration loop.
const CALIBRATION_STEPS: u32 = 20_000_000;

/// The time that a mode takes.
struct Timing {
    mode: Mode,
    scenarios: Vec<Scenario>,
    simulated_s: f64,
    cpu_s: f64,
    calibration_s: f64,
}

impl Timing {
    fn new(mode: Mode) -> Result<Self, Box<dyn Error>> {
        let scenarios = mode.scenarios(mode.samples)?;
        Ok(Self { mode, scenarios, simulated_s: 0.0, cpu_s: 0.0, calibration_s: 0.0 })
    }

    /// Runs every sample once.
    fn measure(&mut self) -> Result<(), Box<dyn Error>> {
        self.calibration_s += timed(calibrate).1;
        // The kernel counts processor time in steps of a few milliseconds: all samples are timed
        // together.
        let run = |(sample, scenario): (u64, &Scenario)| self.mode.run(scenario, sample);
        let (simulated_s, cpu_s) = timed(|| (0..).zip(&self.scenarios).map(run).sum::<Result<f64, _>>());
        self.simulated_s += simulated_s?;
        self.cpu_s += cpu_s;
        Ok(())
    }

    /// Prints the figures. `millions` are the counted instructions per simulated second, in
    /// millions.
    fn print(&self, rounds: u32, millions: Option<f64>) {
        let speed = self.simulated_s / self.cpu_s;
        let calibration_s = self.calibration_s / f64::from(rounds);
        let line = json!({
            "mode": self.mode.name,
            "vehicles": self.scenarios.first().map_or(0, |scenario| scenario.actors.len()),
            "runs": self.scenarios.len() * rounds as usize,
            "control_steps": (self.simulated_s / CONTROL_STEP.s()).round(),
            "simulated_s": self.simulated_s,
            "cpu_s": self.cpu_s,
            "simulated_s_per_cpu_s": speed,
            "calibration_s": calibration_s,
            "per_calibration": speed * calibration_s,
            "million_instructions_per_simulated_s": millions,
        });
        println!("{line}");
    }
}

/// Returns the processor time of this thread (s), or `None` where the kernel does not state it.
fn thread_s() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    text.split_whitespace().next()?.parse::<f64>().ok().map(|ns| ns * 1e-9)
}

/// Calls `work` and returns its result with the time that it took (s).
fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let (from, started) = (thread_s(), Instant::now());
    let result = work();
    let wall_s = started.elapsed().as_secs_f64();
    (result, from.zip(thread_s()).map_or(wall_s, |(from, to)| to - from))
}

/// The calibration loop: integer and floating-point operations that depend on each other, without
/// memory.
fn calibrate() {
    let (mut bits, mut sum) = (1_u64, 0.0_f64);
    for _ in 0..CALIBRATION_STEPS {
        bits = bits.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        sum = 0.5 * sum + (bits >> 11) as f64;
    }
    std::hint::black_box(sum);
}

/// Prints the time of each stage of a mode (µs of wall time per simulated second).
fn print_stages(timing: &Timing) -> Result<(), Box<dyn Error>> {
    let stages = timing.mode.stages(&timing.scenarios)?;
    let per_s = |time_s: f64| (1e8 * time_s / stages.simulated_s).round() / 1e2;
    let line = json!({
        "stages_of": timing.mode.name,
        "control_steps": stages.control_steps,
        "physics_steps": stages.physics_steps,
        "us_per_simulated_s": {
            "before the first step": per_s(stages.start_s),
            "neighbours and margins": per_s(stages.neighbours_s),
            "sensors and trackers": per_s(stages.sensors_s),
            "ego stack": per_s(stages.stack_s),
            "report of the step": per_s(stages.report_s),
            "drivers, motion and contacts": per_s(stages.motion_s),
        },
    });
    println!("{line}");
    Ok(())
}

/// Times the modes of these names, or all modes with their instructions if there are none.
fn time(rounds: u32, names: &[&str]) -> Result<(), Box<dyn Error>> {
    let mut timings = modes(|name| names.is_empty() || names.contains(&name))?
        .into_iter()
        .map(Timing::new)
        .collect::<Result<Vec<_>, _>>()?;
    if let Some(unknown) = names.iter().find(|name| timings.iter().all(|timing| timing.mode.name != **name)) {
        return Err(format!("no mode is called `{unknown}`").into());
    }
    // The first run of a thread loads the network.
    if let Some(full) = timings.iter().find(|timing| timing.mode.name == "full") {
        full.mode.run(&full.scenarios[0], 0)?;
    }
    for _ in 0..rounds {
        for timing in &mut timings {
            timing.measure()?;
        }
    }
    // Without Callgrind there are no counts.
    let counts = if names.is_empty() { instructions::count_all().unwrap_or_default() } else { BTreeMap::new() };
    for timing in &timings {
        timing.print(rounds, counts.get(&timing.mode.name).copied());
    }
    timings.iter().try_for_each(print_stages)
}

pub(crate) fn main(arguments: Vec<String>) -> Result<(), Box<dyn Error>> {
    match &arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        [] => time(ROUNDS, &[]),
        ["instructions"] => instructions::check(),
        ["instructions", "write"] => instructions::write(),
        [instructions::RUN, mode, samples] => instructions::run(mode, samples.parse()?, None),
        [instructions::RUN, mode, samples, duration_s] => {
            instructions::run(mode, samples.parse()?, Some(duration_s.parse()?))
        }
        [rounds, names @ ..] => time(rounds.parse()?, names),
    }
}
