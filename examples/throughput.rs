//! Measures the speed of the whole loop: simulated seconds per second of processor time, for each depth of the sensor
//! simulation, kind of road and number of vehicles.
//!
//! ```sh
//! cargo run --release --example throughput -- [ROUNDS]
//! ```
//!
//! One line of JSON per mode goes to standard output. The modes take turns, so that other programs on the machine disturb
//! all of them alike, and time is that of this thread alone (`/proc/thread-self/schedstat`; wall time where there is none).
//! Before each mode a fixed loop is timed: `per_calibration` is the number of simulated seconds in the time of that loop,
//! which makes figures of different machines comparable. No validity check is run; a campaign's checks come on top.

#![expect(clippy::print_stdout, reason = "a measurement prints its figures")]

use std::error::Error;
use std::fmt::Write;
use std::path::Path;
use std::time::Instant;

use closecall_campaign::runner::{Sampling, concrete};
use closecall_scenarios::sampling::Design;
use closecall_sensors::SensorMode;
use closecall_simulation::controller::BuiltIn;
use closecall_simulation::scenario::{Scenario, ScenarioFile, Setting};
use closecall_simulation::{Arm, NoObserver, RunKey, simulate};
use closecall_traffic::CONTROL_STEP;
use serde_json::json;

/// Number of rounds if none is given.
const ROUNDS: u32 = 3;
/// Seed of all samples.
const SEED: u64 = 9;
/// Number of steps of the calibration loop.
const CALIBRATION_STEPS: u32 = 20_000_000;
/// Duration of the runs in dense traffic (s).
const TRAFFIC_S: f64 = 10.0;
/// Distance between two vehicles of a lane in dense traffic (m): a time headway of 1.8 s at 30 m/s, bumper to bumper.
const SPACING_M: f64 = 60.0;
/// Numbers of vehicles in dense traffic.
const VEHICLES: [usize; 5] = [3, 10, 30, 60, 100];

/// What is measured.
struct Mode {
    name: String,
    sensors: SensorMode,
    scenarios: Vec<Scenario>,
    simulated_s: f64,
    cpu_s: f64,
    calibration_s: f64,
}

impl Mode {
    fn new(name: &str, sensors: SensorMode, file: &ScenarioFile, samples: u64) -> Result<Self, Box<dyn Error>> {
        let sampling = Sampling { seed: SEED, design: Design::Random, samples };
        let scenarios = (0..samples).map(|sample| concrete(file, sampling, sample)).collect::<Result<_, _>>()?;
        Ok(Self { name: name.to_owned(), sensors, scenarios, simulated_s: 0.0, cpu_s: 0.0, calibration_s: 0.0 })
    }

    /// Runs every sample once.
    fn measure(&mut self) -> Result<(), Box<dyn Error>> {
        let arm = Arm { controller: BuiltIn::Mis.factory(), sensors: Some(self.sensors) };
        self.calibration_s += timed(calibrate).1;
        for (sample, scenario) in (0..).zip(&self.scenarios) {
            let (outcome, cpu_s) = timed(|| simulate(scenario, RunKey { seed: SEED, sample }, &arm, &mut NoObserver));
            self.simulated_s += outcome?.duration.s();
            self.cpu_s += cpu_s;
        }
        Ok(())
    }

    fn print(&self, rounds: u32) {
        let speed = self.simulated_s / self.cpu_s;
        let calibration_s = self.calibration_s / f64::from(rounds);
        let line = json!({
            "mode": self.name,
            "vehicles": self.scenarios.first().map_or(0, |scenario| scenario.actors.len()),
            "runs": self.scenarios.len() * rounds as usize,
            "control_steps": (self.simulated_s / CONTROL_STEP.s()).round(),
            "simulated_s": self.simulated_s,
            "cpu_s": self.cpu_s,
            "simulated_s_per_cpu_s": speed,
            "calibration_s": calibration_s,
            "per_calibration": speed * calibration_s,
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

/// The calibration loop: integer and floating-point operations that depend on each other, without memory.
fn calibrate() {
    let (mut bits, mut sum) = (1_u64, 0.0_f64);
    for _ in 0..CALIBRATION_STEPS {
        bits = bits.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        sum = 0.5 * sum + (bits >> 11) as f64;
    }
    std::hint::black_box(sum);
}

/// Returns the text of a scenario with `vehicles` vehicles in three lanes, the ego in their middle.
fn traffic(vehicles: usize) -> String {
    let mut text = format!(
        "schema-version = 1\nname = \"traffic-{vehicles}\"\nduration-s = {TRAFFIC_S:.1}\n\
         road = {{ lanes = 3, lane-width-m = 3.75, curvature-per-m = 0.0, speed-limit-mps = 36.1, overtaking-side = \"left\" }}\n\
         [sensors]\nmode = \"full\"\n"
    );
    for index in 0..vehicles {
        let (lane, row) = (index % 3 + 1, index / 3);
        let s_m = 500.0 + SPACING_M * row as f64 + 10.0 * lane as f64;
        let is_ego = index == vehicles / 6 * 3 + 1;
        let id = if is_ego { "ego".to_owned() } else { format!("v{index:03}") };
        let driver = if is_ego {
            "{ ego-stack = { acc = { time-gap-s = 1.5 }, aeb = {}, mis = {} } }"
        } else {
            "{ wiedemann99 = {} }"
        };
        let _ = write!(
            text,
            "[[actor]]\nid = \"{id}\"\nvehicle = {{ class = \"car\" }}\n\
             start = {{ absolute = {{ lane = {lane}, s-m = {s_m:.1}, speed-mps = 30.0 }} }}\ndriver = {driver}\n"
        );
    }
    text
}

/// Returns the modes that are measured.
fn modes() -> Result<Vec<Mode>, Box<dyn Error>> {
    let headline = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/library/low-thw-overtake.toml");
    let load = |settings: &[&str]| -> Result<ScenarioFile, Box<dyn Error>> {
        let settings = settings.iter().map(|setting| setting.parse()).collect::<Result<Vec<Setting>, _>>()?;
        Ok(ScenarioFile::load(&headline, &settings)?)
    };
    let plain = load(&[])?;
    let wet = ["environment.water-film-mm=1", "environment.rain-mm-per-h=5", "environment.friction=0.6"];
    let mut modes = vec![
        Mode::new("ground-truth", SensorMode::GroundTruth, &plain, 40)?,
        Mode::new("object", SensorMode::Object, &plain, 40)?,
        Mode::new("lidar", SensorMode::Full, &load(&["sensors.rear-camera.pipeline=off"])?, 6)?,
        Mode::new("full", SensorMode::Full, &plain, 6)?,
        Mode::new("full, guard rails", SensorMode::Full, &load(&["road.guard-rails=true"])?, 6)?,
        Mode::new("full, wet road", SensorMode::Full, &load(&wet)?, 6)?,
        Mode::new("full, fog", SensorMode::Full, &load(&["environment.visibility-m=200"])?, 4)?,
    ];
    for vehicles in VEHICLES {
        let file = ScenarioFile::parse(Path::new("traffic.toml"), &traffic(vehicles), &[])?;
        for (name, sensors) in
            [("ground-truth", SensorMode::GroundTruth), ("object", SensorMode::Object), ("full", SensorMode::Full)]
        {
            modes.push(Mode::new(&format!("{name}, {vehicles} vehicles"), sensors, &file, 1)?);
        }
    }
    Ok(modes)
}

fn main() -> Result<(), Box<dyn Error>> {
    let rounds = std::env::args().nth(1).map_or(Ok(ROUNDS), |text| text.parse())?;
    let mut modes = modes()?;
    // The first run of a thread loads the network.
    let warm_up = Arm { controller: BuiltIn::Mis.factory(), sensors: Some(SensorMode::Full) };
    simulate(&modes[3].scenarios[0], RunKey { seed: SEED, sample: 0 }, &warm_up, &mut NoObserver)?;
    for _ in 0..rounds {
        for mode in &mut modes {
            mode.measure()?;
        }
    }
    for mode in &modes {
        mode.print(rounds);
    }
    Ok(())
}
