//! Digests of the outcomes of every scenario of the library, with true tracks and with object-level
//! sensors.
//!
//! They show whether a change moves an outcome by a bit. A separate digest of the mathematical
//! functions shows whether these are the cause, see `docs/explanation/determinism.md`.

use std::collections::BTreeMap;
use std::error::Error;
use std::path::Path;

use closecall_campaign::runner::{Sampling, concrete, run_guarded};
use closecall_scenarios::outcome::Outcome;
use closecall_scenarios::sampling::Design;
use closecall_scenarios::source::expand;
use closecall_scenarios::{Function, Scenario, ScenarioFile};
use closecall_sensors::SensorMode;
use closecall_simulation::controller::ControllerChoice;
use closecall_simulation::{Arm, NoObserver, RunKey};
use closecall_traffic::maths;
use serde::{Deserialize, Serialize};

/// The file with the digests, relative to the root of the repository.
pub(crate) const DIGESTS: &str = "docs/evidence/determinism.json";
/// The folder of the scenarios.
const LIBRARY: &str = "scenarios/library";
/// Seed of all samples.
pub(crate) const SEED: u64 = 1001;
/// Number of samples of a scenario, each in both arms.
const SAMPLES: u64 = 3;
/// The depths of the sensor simulation whose outcomes are kept to the bit, with their names.
const MODES: [(&str, SensorMode); 2] = [("ground-truth", SensorMode::GroundTruth), ("object", SensorMode::Object)];
/// Number of arguments for which the mathematical functions are compared.
const ARGUMENTS: u32 = 20_000;
/// Number of digits of a digest.
const DIGITS: usize = 16;

/// The digests of a version of the program.
#[derive(Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Digests {
    /// Digest of the values of the mathematical functions.
    pub(crate) functions: String,
    /// Digest of the outcomes, by scenario and mode.
    pub(crate) outcomes: BTreeMap<String, BTreeMap<String, String>>,
}

fn short(hasher: &blake3::Hasher) -> String {
    hasher.finalize().to_hex().chars().take(DIGITS).collect()
}

/// Returns the digest of the values of the mathematical functions.
///
/// The arguments cover the sizes at which the simulation calls them: angles, speeds, distances and
/// probabilities.
pub(crate) fn functions() -> String {
    let mut hasher = blake3::Hasher::new();
    for step in 1..=ARGUMENTS {
        let x = f64::from(step) * 1.234_567e-3;
        let unit = f64::from(step) / f64::from(ARGUMENTS);
        let values = [
            maths::exp(x),
            maths::exp(-x),
            maths::ln(x),
            maths::sin(x),
            maths::cos(x),
            maths::tan(x),
            maths::atan(x),
            maths::powf(x, unit),
            maths::powf(x, 0.35),
        ];
        let more = [
            maths::asin(unit),
            maths::acos(unit),
            maths::atan2(x, unit),
            maths::tanh(x),
            maths::exp_m1(x),
            maths::ln_1p(x),
            maths::log10(x),
            maths::hypot(x, unit),
        ];
        values.iter().chain(&more).for_each(|value| _ = hasher.update(&value.to_bits().to_le_bytes()));
        #[expect(clippy::cast_possible_truncation, reason = "the functions of single precision are meant")]
        let single = x as f32;
        let values = [
            maths::exp(-single),
            maths::ln(single),
            maths::sin(single),
            maths::cos(single),
            maths::tan(single),
            maths::powf(single, 0.35),
        ];
        values.iter().for_each(|value| _ = hasher.update(&value.to_bits().to_le_bytes()));
    }
    short(&hasher)
}

/// Returns the arms that are run: the function's arms if a human drives the ego, and the two stacks
/// otherwise.
fn arms(file: &ScenarioFile) -> [ControllerChoice; 2] {
    match file.config().function {
        Function::AebWithHuman => ControllerChoice::of_function(Function::AebWithHuman),
        Function::Mis | Function::Aeb | Function::Acc => [ControllerChoice::ACC, ControllerChoice::MIS],
    }
}

/// Returns the digest of the outcomes of a scenario's first samples with `seed` and these sensors.
/// A sample without an outcome counts by its error.
pub(crate) fn outcomes(file: &ScenarioFile, sensors: SensorMode, seed: u64) -> Result<String, Box<dyn Error>> {
    let mut hasher = blake3::Hasher::new();
    let sampling = Sampling { seed, design: Design::Random, samples: SAMPLES };
    for sample in 0..SAMPLES {
        let scenario: Scenario = concrete(file, sampling, sample)?;
        for controller in arms(file) {
            let arm = Arm { controller: controller.factory(), sensors: Some(sensors) };
            // `serde_json` writes numbers so that they read back to the bit.
            let text = match run_guarded(&scenario, RunKey { seed, sample }, &arm, &mut NoObserver) {
                // Cost, promise, what the ego meets ahead and the vehicles of the moments follow
                // from the same motion, and have tests of their own.
                Ok(outcome) => serde_json::to_string(&Outcome {
                    cost: None,
                    promise: None,
                    ahead: None,
                    ..outcome.without_vehicles_of_moments()
                })?,
                Err(error) => error.to_string(),
            };
            hasher.update(&(text.len() as u64).to_le_bytes());
            hasher.update(text.as_bytes());
        }
    }
    Ok(short(&hasher))
}

/// Returns the digests of this program on this machine.
pub(crate) fn digests() -> Result<Digests, Box<dyn Error>> {
    let root = Path::new(crate::ROOT).join(LIBRARY);
    let mut by_scenario = BTreeMap::new();
    for path in expand(std::slice::from_ref(&root))? {
        let file = ScenarioFile::load(&path, &[])?;
        let of_mode = |(name, mode)| Ok((String::from(name), outcomes(&file, mode, SEED)?));
        let digests = MODES.into_iter().map(of_mode).collect::<Result<_, Box<dyn Error>>>()?;
        by_scenario.insert(path.strip_prefix(&root)?.with_extension("").display().to_string(), digests);
    }
    Ok(Digests { functions: functions(), outcomes: by_scenario })
}
