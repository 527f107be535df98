//! The modes of the loop that are measured: depth of the sensor simulation, kind of road, and
//! number of vehicles.

use std::error::Error;
use std::path::Path;

use closecall_campaign::runner::{Sampling, concrete};
use closecall_scenarios::sampling::Design;
use closecall_scenarios::{Scenario, ScenarioFile, Setting};
use closecall_sensors::SensorMode;
use closecall_simulation::controller::BuiltIn;
use closecall_simulation::{Arm, NoObserver, RunKey, simulate};

use super::stages::{Stages, stages};
use super::traffic::traffic;

/// Seed of all samples.
const SEED: u64 = 9;
/// Settings of a wet road in rain.
const WET: [&str; 3] = ["environment.water-film-mm=1", "environment.rain-mm-per-h=5", "environment.friction=0.6"];
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
    /// Returns the same mode with runs that end after `duration_s` (s).
    pub(crate) fn cut(mut self, duration_s: f64) -> Result<Self, Box<dyn Error>> {
        let setting: Setting = format!("duration-s={duration_s}").parse()?;
        self.file = ScenarioFile::parse(self.file.path(), self.file.text(), &[setting])?;
        Ok(self)
    }

    /// Returns the concrete scenarios of the first `samples` samples.
    pub(crate) fn scenarios(&self, samples: u64) -> Result<Vec<Scenario>, Box<dyn Error>> {
        let sampling = Sampling { seed: SEED, design: Design::Random, samples };
        Ok((0..samples).map(|sample| concrete(&self.file, sampling, sample)).collect::<Result<_, _>>()?)
    }

    /// Runs a sample and returns its simulated time (s).
    pub(crate) fn run(&self, scenario: &Scenario, sample: u64) -> Result<f64, Box<dyn Error>> {
        Ok(simulate(scenario, RunKey { seed: SEED, sample }, &self.arm(), &mut NoObserver)?.duration.s())
    }

    /// Runs the samples and returns the time of each stage.
    pub(crate) fn stages(&self, scenarios: &[Scenario]) -> Result<Stages, Box<dyn Error>> {
        let runs = (0..).zip(scenarios).map(|(sample, scenario)| (scenario, RunKey { seed: SEED, sample }));
        Ok(stages(runs, &self.arm())?)
    }

    fn arm(&self) -> Arm {
        Arm { controller: BuiltIn::Mis.factory(), sensors: Some(self.sensors) }
    }
}

/// The modes from which some are chosen.
struct Chosen<W> {
    is_wanted: W,
    modes: Vec<Mode>,
}

impl<W: Fn(&str) -> bool> Chosen<W> {
    /// Adds a mode if it is wanted. Its scenario is read then only: all of them take 200 million
    /// instructions.
    fn add(
        &mut self,
        name: &str,
        sensors: SensorMode,
        samples: u64,
        file: impl FnOnce() -> Result<ScenarioFile, Box<dyn Error>>,
    ) -> Result<(), Box<dyn Error>> {
        if (self.is_wanted)(name) {
            self.modes.push(Mode { name: name.to_owned(), sensors, file: file()?, samples });
        }
        Ok(())
    }
}

/// Returns a scenario of the library with settings.
fn library(name: &str, settings: &[&str]) -> Result<ScenarioFile, Box<dyn Error>> {
    let path = Path::new(crate::ROOT).join("scenarios/library").join(name);
    let settings = settings.iter().map(|setting| setting.parse()).collect::<Result<Vec<Setting>, _>>()?;
    Ok(ScenarioFile::load(&path, &settings)?)
}

/// Returns the modes to measure: all modes, or the modes with the wanted names.
pub(crate) fn modes(is_wanted: impl Fn(&str) -> bool) -> Result<Vec<Mode>, Box<dyn Error>> {
    use SensorMode::{Full, GroundTruth, Object};
    let mut chosen = Chosen { is_wanted, modes: Vec::new() };
    let headline = |settings: &'static [&'static str]| move || library("low-thw-overtake.toml", settings);
    let busy = || library("traffic/busy-overtake.toml", &[]);
    chosen.add("ground-truth", GroundTruth, 40, headline(&[]))?;
    chosen.add("object", Object, 40, headline(&[]))?;
    chosen.add("lidar", Full, 6, headline(&["sensors.rear-camera.pipeline=off"]))?;
    chosen.add("full", Full, 6, headline(&[]))?;
    chosen.add("full, guard rails", Full, 6, headline(&["road.guard-rails=true"]))?;
    chosen.add("full, wet road", Full, 6, headline(&WET))?;
    chosen.add("full, fog", Full, 4, headline(&["environment.visibility-m=200"]))?;
    chosen.add("object, busy-overtake", Object, 6, busy)?;
    chosen.add("full, busy-overtake", Full, 1, busy)?;
    let railed = || {
        let settings = ["road.guard-rails=true".parse()?];
        Ok(ScenarioFile::parse(Path::new("traffic.toml"), &traffic(10), &settings)?)
    };
    chosen.add("full, guard rails, 10 vehicles", Full, 1, railed)?;
    for vehicles in VEHICLES {
        let file = || Ok(ScenarioFile::parse(Path::new("traffic.toml"), &traffic(vehicles), &[])?);
        // The clock counts in steps of milliseconds: runs with few vehicles are repeated.
        let light = 10 * (100 / vehicles as u64);
        for (name, sensors, samples) in
            [("ground-truth", GroundTruth, light), ("object", Object, light), ("full", Full, 1)]
        {
            chosen.add(&format!("{name}, {vehicles} vehicles"), sensors, samples, file)?;
        }
    }
    Ok(chosen.modes)
}
