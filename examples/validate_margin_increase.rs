//! Measures the share of collisions for several bounds and critical gaps of the margin increase system.
//!
//! ```sh
//! cargo run --release --example validate_margin_increase -- [SAMPLES] [SEED]
//! ```
//!
//! Every sample of the scenario `low-thw-overtake` runs with the cruise control alone (`acc`) and with the margin
//! increase system (`mis`), with true tracks. Three tables result:
//!
//! 1. the bound on the system's braking, and the critical gap d_c
//! 2. the bound, if the rear driver reacts slowly
//! 3. the lateral acceleration that the rear driver accepts in evasive steering, without the system
//!
//! A share has its 95 % interval (Clopper and Pearson) beside it. The default is 1000 samples of seed 1, a tuning seed.
//! The documentation of `closecall_controllers` (`controllers/src/ego/mis/mod.rs`,
//! `controllers/src/driver/overtaker/config.rs`) cites these figures.
#![expect(clippy::print_stdout, reason = "a validation prints its result")]

use std::error::Error;
use std::path::Path;

use closecall_campaign::runner::{Sampling, concrete};
use closecall_scenarios::sampling::Design;
use closecall_sensors::SensorMode;
use closecall_simulation::controller::BuiltIn;
use closecall_simulation::scenario::{ScenarioFile, Setting};
use closecall_simulation::{Arm, NoObserver, RunKey, SampleError, simulate};
use closecall_statistics::interval::clopper_pearson;
use rayon::iter::{IntoParallelIterator, ParallelIterator};

const SCENARIO: &str = "scenarios/library/low-thw-overtake.toml";

/// Bounds on the braking of the margin increase system (m/s²).
const BOUNDS_MPS2: [f64; 3] = [1.0, 2.0, 3.0];

/// Critical gaps d_c (m).
const CRITICAL_GAPS_M: [f64; 2] = [5.0, 10.0];

/// Default critical gap (m).
const CRITICAL_GAP_M: f64 = 5.0;

/// Reaction time of a slow rear driver (s). In the scenario the median is 0.9 s.
const SLOW_REACTION_S: f64 = 2.0;

/// Lateral accelerations that the rear driver accepts in evasive steering (m/s²).
const EVASIVE_MPS2: [f64; 3] = [0.0, 1.0, 2.0];

const CONFIDENCE: f64 = 0.95;

/// The samples of one measurement.
#[derive(Clone, Copy)]
struct Study {
    samples: u64,
    seed: u64,
}

impl Study {
    /// Runs the scenario with `settings` applied. Returns for each sample whether the ego collided.
    fn collisions(self, controller: BuiltIn, settings: &[String]) -> Result<Vec<bool>, Box<dyn Error>> {
        let settings = settings.iter().map(|setting| setting.parse()).collect::<Result<Vec<Setting>, _>>()?;
        let file = ScenarioFile::load(Path::new(SCENARIO), &settings)?;
        let sampling = Sampling { seed: self.seed, design: Design::Random, samples: self.samples };
        let arm = Arm { controller: controller.factory(), sensors: Some(SensorMode::GroundTruth) };
        let run = |sample| {
            let scenario = concrete(&file, sampling, sample)?;
            let key = RunKey { seed: self.seed, sample };
            Ok(simulate(&scenario, key, &arm, &mut NoObserver)?.ego_collided())
        };
        let collided: Result<Vec<bool>, SampleError> = (0..self.samples).into_par_iter().map(run).collect();
        Ok(collided?)
    }

    /// Prints one row for each bound and critical gap, below a row for the cruise control alone.
    fn print_bounds(self, critical_gaps_m: &[f64], rear: &[String]) -> Result<(), Box<dyn Error>> {
        println!("| bound (m/s²) | d_c (m) | collisions | share and 95 % interval | prevented | induced |");
        println!("|---|---|---|---|---|---|");
        let without = self.collisions(BuiltIn::Acc, rear)?;
        println!("| without | | {} | | |", cells(&without));
        for critical_gap_m in critical_gaps_m {
            for bound_mps2 in BOUNDS_MPS2 {
                let mut settings = rear.to_vec();
                settings.push(format!("actor.ego.driver.ego-stack.mis.max-deceleration-mps2={bound_mps2:.1}"));
                settings.push(format!("actor.ego.driver.ego-stack.mis.critical-gap-m={critical_gap_m:.1}"));
                let with = self.collisions(BuiltIn::Mis, &settings)?;
                let pairs = || without.iter().zip(&with);
                let prevented = pairs().filter(|(without, with)| **without && !**with).count();
                let induced = pairs().filter(|(without, with)| !**without && **with).count();
                println!("| {bound_mps2} | {critical_gap_m} | {} | {prevented} | {induced} |", cells(&with));
            }
        }
        Ok(())
    }
}

/// Returns the number of collisions and their share with its interval, as two cells of a table.
fn cells(collided: &[bool]) -> String {
    let hits = collided.iter().filter(|hit| **hit).count() as u64;
    let samples = collided.len() as u64;
    let [low, high] = clopper_pearson(hits, samples, CONFIDENCE).map(|share| 100.0 * share);
    let share = 100.0 * hits as f64 / samples as f64;
    format!("{hits} | {share:.1} % ({low:.1} to {high:.1})")
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let samples = arguments.next().map_or(Ok(1000), |text| text.parse())?;
    let seed = arguments.next().map_or(Ok(1), |text| text.parse())?;
    let study = Study { samples, seed };
    println!("low-thw-overtake, {samples} samples, seed {seed}, true tracks\n");
    study.print_bounds(&CRITICAL_GAPS_M, &[])?;
    println!("\nThe rear driver reacts after {SLOW_REACTION_S} s:\n");
    let slow = format!("reaction-s={SLOW_REACTION_S:.1}");
    study.print_bounds(&[CRITICAL_GAP_M], &[slow])?;
    println!("\nEvasive steering of the rear driver, without the system:\n");
    println!("| lateral acceleration (m/s²) | collisions | share and 95 % interval |");
    println!("|---|---|---|");
    for evasive_mps2 in EVASIVE_MPS2 {
        let setting = format!("actor.rear.driver.overtaker.evasive-lateral-mps2={evasive_mps2:.1}");
        println!("| {evasive_mps2} | {} |", cells(&study.collisions(BuiltIn::Acc, &[setting])?));
    }
    Ok(())
}
