//! Measures the share of collisions for several bounds and critical gaps of the margin increase
//! system.
//!
//! ```sh
//! cargo run --release -p closecall-xtask -- validate-margin-increase [SAMPLES] [SEED]
//! ```
//!
//! Every sample runs with the cruise control alone (`acc`) and with the margin increase system
//! (`mis`), with true tracks. Four tables result:
//!
//! 1. `low-thw-overtake`: the bound on the system's braking, and the critical gap d_c
//! 2. `low-thw-overtake`: the bound, if the rear driver reacts slowly
//! 3. `overtake-without-brake`: the bound, if the rear driver reacts slowly and the lead vehicle
//!    does not brake
//! 4. `low-thw-overtake`: the lateral acceleration that the rear driver accepts in evasive
//!    steering, without the system
//!
//! A share of collisions has its 95 % interval (Clopper and Pearson) beside it. The speed deficit
//! is the largest amount by which the ego is slower than the lead vehicle in a run; the tables give
//! the value that 95 % of the samples stay below. The default is 1000 samples of seed 1, a tuning
//! seed. The documentation of `closecall_controllers` (`controllers/src/ego/mis/mod.rs`,
//! `controllers/src/driver/overtaker/config.rs`) cites these figures.
#![expect(clippy::print_stdout, reason = "a validation prints its result")]

use std::error::Error;
use std::path::Path;

use closecall_campaign::runner::{Sampling, concrete};
use closecall_scenarios::sampling::Design;
use closecall_scenarios::{ScenarioFile, Setting};
use closecall_sensors::SensorMode;
use closecall_simulation::controller::BuiltIn;
use closecall_simulation::{Arm, NoObserver, RunKey, SampleError, simulate};
use closecall_traffic::statistics::interval::clopper_pearson;
use closecall_traffic::statistics::quantiles::quantile;
use rayon::iter::{IntoParallelIterator, ParallelIterator};

/// The lead vehicle brakes while the rear vehicle is near.
const BRAKES: &str = "low-thw-overtake";

/// The same without braking of the lead vehicle.
const DOES_NOT_BRAKE: &str = "overtake-without-brake";

/// Bounds on the braking of the margin increase system (m/s²).
const BOUNDS_MPS2: [f64; 3] = [1.0, 2.0, 3.0];

/// Critical gaps d_c (m).
const CRITICAL_GAPS_M: [f64; 2] = [5.0, 10.0];

/// Default critical gap (m).
const CRITICAL_GAP_M: f64 = 5.0;

/// Reaction time of a slow rear driver (s). In the scenario the median is 1.25 s.
const SLOW_REACTION_S: f64 = 2.0;

/// Lateral accelerations that the rear driver accepts in evasive steering (m/s²).
const EVASIVE_MPS2: [f64; 4] = [0.0, 1.0, 2.0, 4.3];

const CONFIDENCE: f64 = 0.95;

/// The result of one sample.
#[derive(Clone, Copy)]
struct Seen {
    collided: bool,
    speed_deficit_mps: f64,
}

/// The samples of one measurement.
#[derive(Clone, Copy)]
struct Study {
    samples: u64,
    seed: u64,
}

impl Study {
    /// Runs a scenario of the library with `settings` applied.
    fn run(self, scenario: &str, controller: BuiltIn, settings: &[String]) -> Result<Vec<Seen>, Box<dyn Error>> {
        let settings = settings.iter().map(|setting| setting.parse()).collect::<Result<Vec<Setting>, _>>()?;
        let file =
            ScenarioFile::load(&Path::new("scenarios/library").join(scenario).with_extension("toml"), &settings)?;
        let sampling = Sampling { seed: self.seed, design: Design::Random, samples: self.samples };
        let arm = Arm { controller: controller.factory(), sensors: Some(SensorMode::GroundTruth) };
        let run = |sample| {
            let scenario = concrete(&file, sampling, sample)?;
            let key = RunKey { seed: self.seed, sample };
            let outcome = simulate(&scenario, key, &arm, &mut NoObserver)?;
            let speed_deficit_mps = outcome.margins.max_speed_deficit_mps;
            Ok(Seen { collided: outcome.ego_collided(), speed_deficit_mps })
        };
        let seen: Result<Vec<Seen>, SampleError> = (0..self.samples).into_par_iter().map(run).collect();
        Ok(seen?)
    }

    /// Prints one row for each bound and critical gap, below a row for the cruise control alone.
    fn print_bounds(self, scenario: &str, critical_gaps_m: &[f64], rear: &[String]) -> Result<(), Box<dyn Error>> {
        println!(
            "| bound (m/s²) | d_c (m) | collisions | share | 95 % interval | prevented | induced | deficit (m/s) |"
        );
        println!("|---|---|---|---|---|---|---|---|");
        let without = self.run(scenario, BuiltIn::Acc, rear)?;
        println!("| without | | {} | | | {:.1} |", cells(&without), deficit_95_mps(&without));
        for critical_gap_m in critical_gaps_m {
            for bound_mps2 in BOUNDS_MPS2 {
                let mut settings = rear.to_vec();
                settings.push(format!("actor.ego.driver.ego-stack.mis.max-deceleration-mps2={bound_mps2:.1}"));
                settings.push(format!("actor.ego.driver.ego-stack.mis.critical-gap-m={critical_gap_m:.1}"));
                let with = self.run(scenario, BuiltIn::Mis, &settings)?;
                let pairs = || without.iter().zip(&with);
                let prevented = pairs().filter(|(without, with)| without.collided && !with.collided).count();
                let induced = pairs().filter(|(without, with)| !without.collided && with.collided).count();
                println!(
                    "| {bound_mps2} | {critical_gap_m} | {} | {prevented} | {induced} | {:.1} |",
                    cells(&with),
                    deficit_95_mps(&with)
                );
            }
        }
        Ok(())
    }
}

/// Returns the speed deficit that 95 % of the samples stay below (m/s).
fn deficit_95_mps(seen: &[Seen]) -> f64 {
    let mut deficits_mps: Vec<f64> = seen.iter().map(|seen| seen.speed_deficit_mps).collect();
    deficits_mps.sort_by(f64::total_cmp);
    quantile(&deficits_mps, 0.95)
}

/// Returns the number of collisions, their share and its interval, as three cells of a table.
fn cells(seen: &[Seen]) -> String {
    let hits = seen.iter().filter(|seen| seen.collided).count() as u64;
    let samples = seen.len() as u64;
    let [low, high] = clopper_pearson(hits, samples, CONFIDENCE).map(|share| 100.0 * share);
    let share = 100.0 * hits as f64 / samples as f64;
    format!("{hits} | {share:.1} % | {low:.1} to {high:.1} %")
}

pub(crate) fn main(words: Vec<String>) -> Result<(), Box<dyn Error>> {
    let mut arguments = words.into_iter();
    let samples = arguments.next().map_or(Ok(1000), |text| text.parse())?;
    let seed = arguments.next().map_or(Ok(1), |text| text.parse())?;
    let study = Study { samples, seed };
    println!("{samples} samples, seed {seed}, true tracks\n\n{BRAKES}:\n");
    study.print_bounds(BRAKES, &CRITICAL_GAPS_M, &[])?;
    let slow = [format!("reaction-s={SLOW_REACTION_S:.1}")];
    for scenario in [BRAKES, DOES_NOT_BRAKE] {
        println!("\n{scenario}, the rear driver reacts after {SLOW_REACTION_S} s:\n");
        study.print_bounds(scenario, &[CRITICAL_GAP_M], &slow)?;
    }
    println!("\n{BRAKES}, evasive steering of the rear driver, without the system:\n");
    println!("| lateral acceleration (m/s²) | collisions | share | 95 % interval |");
    println!("|---|---|---|---|");
    for evasive_mps2 in EVASIVE_MPS2 {
        let setting = format!("actor.rear.driver.overtaker.evasive-lateral-mps2={evasive_mps2:.1}");
        println!("| {evasive_mps2} | {} |", cells(&study.run(BRAKES, BuiltIn::Acc, &[setting])?));
    }
    Ok(())
}
