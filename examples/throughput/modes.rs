//! The modes of the loop that are measured: depth of the sensor simulation, kind of road, and number of vehicles.

use std::error::Error;
use std::fmt::Write;
use std::path::Path;

use closecall_campaign::runner::{Sampling, concrete};
use closecall_scenarios::sampling::Design;
use closecall_sensors::SensorMode;
use closecall_simulation::controller::BuiltIn;
use closecall_simulation::scenario::{Scenario, ScenarioFile, Setting};
use closecall_simulation::{Arm, NoObserver, RunKey, simulate};

/// Seed of all samples.
const SEED: u64 = 9;
/// Duration of the runs in dense traffic (s).
const TRAFFIC_S: f64 = 10.0;
/// Distance between two vehicles of a lane in dense traffic (m): a time headway of 1.8 s at 30 m/s, bumper to bumper.
const SPACING_M: f64 = 60.0;
/// Numbers of vehicles in dense traffic.
const VEHICLES: [usize; 5] = [3, 10, 30, 60, 100];

/// What is measured.
pub(crate) struct Mode {
    /// Its name.
    pub(crate) name: String,
    sensors: SensorMode,
    file: ScenarioFile,
    /// Number of samples in a round.
    pub(crate) samples: u64,
}

impl Mode {
    fn new(name: &str, sensors: SensorMode, file: &ScenarioFile, samples: u64) -> Self {
        Self { name: name.to_owned(), sensors, file: file.clone(), samples }
    }

    /// Returns the concrete scenarios of the first `samples` samples.
    pub(crate) fn scenarios(&self, samples: u64) -> Result<Vec<Scenario>, Box<dyn Error>> {
        let sampling = Sampling { seed: SEED, design: Design::Random, samples };
        Ok((0..samples).map(|sample| concrete(&self.file, sampling, sample)).collect::<Result<_, _>>()?)
    }

    /// Runs a sample and returns its simulated time (s).
    pub(crate) fn run(&self, scenario: &Scenario, sample: u64) -> Result<f64, Box<dyn Error>> {
        let arm = Arm { controller: BuiltIn::Mis.factory(), sensors: Some(self.sensors) };
        Ok(simulate(scenario, RunKey { seed: SEED, sample }, &arm, &mut NoObserver)?.duration.s())
    }
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
pub(crate) fn modes() -> Result<Vec<Mode>, Box<dyn Error>> {
    let headline = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/library/low-thw-overtake.toml");
    let load = |settings: &[&str]| -> Result<ScenarioFile, Box<dyn Error>> {
        let settings = settings.iter().map(|setting| setting.parse()).collect::<Result<Vec<Setting>, _>>()?;
        Ok(ScenarioFile::load(&headline, &settings)?)
    };
    let plain = load(&[])?;
    let wet = ["environment.water-film-mm=1", "environment.rain-mm-per-h=5", "environment.friction=0.6"];
    let mut modes = vec![
        Mode::new("ground-truth", SensorMode::GroundTruth, &plain, 40),
        Mode::new("object", SensorMode::Object, &plain, 40),
        Mode::new("lidar", SensorMode::Full, &load(&["sensors.rear-camera.pipeline=off"])?, 6),
        Mode::new("full", SensorMode::Full, &plain, 6),
        Mode::new("full, guard rails", SensorMode::Full, &load(&["road.guard-rails=true"])?, 6),
        Mode::new("full, wet road", SensorMode::Full, &load(&wet)?, 6),
        Mode::new("full, fog", SensorMode::Full, &load(&["environment.visibility-m=200"])?, 4),
    ];
    for vehicles in VEHICLES {
        let file = ScenarioFile::parse(Path::new("traffic.toml"), &traffic(vehicles), &[])?;
        // The clock counts in steps of milliseconds: runs with few vehicles are repeated.
        let light = 10 * (100 / vehicles as u64);
        for (name, sensors, samples) in [
            ("ground-truth", SensorMode::GroundTruth, light),
            ("object", SensorMode::Object, light),
            ("full", SensorMode::Full, 1),
        ] {
            modes.push(Mode::new(&format!("{name}, {vehicles} vehicles"), sensors, &file, samples));
        }
    }
    Ok(modes)
}
