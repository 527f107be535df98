//! Outcomes have the bits that `docs/evidence/determinism.json` states, in every scenario of the
//! library: no change moves one unnoticed.

use std::path::Path;

use closecall::scenarios::ScenarioFile;
use closecall::sensors::SensorMode;

use crate::support::{ROOT, library};

#[path = "../../xtask/src/write_references/digests.rs"]
mod generator;

use generator::{DIGESTS, Digests, SEED};

/// The smallest number of scenarios that have digests.
const LEAST_SCENARIOS: usize = 90;

/// Returns the committed digests.
fn committed() -> Digests {
    serde_json::from_str(&std::fs::read_to_string(Path::new(ROOT).join(DIGESTS)).unwrap()).unwrap()
}

#[test]
fn outcomes_of_the_library_have_the_stated_bits() {
    let stated = committed();
    assert!(stated.outcomes.len() >= LEAST_SCENARIOS, "{}", stated.outcomes.len());
    assert_eq!(generator::functions(), stated.functions, "the mathematical functions differ from {DIGESTS}");
    let now = generator::digests().unwrap();
    let changed: Vec<_> =
        now.outcomes.iter().filter(|(name, digest)| stated.outcomes.get(*name) != Some(digest)).collect();
    assert!(
        changed.is_empty() && now == stated,
        "other outcomes than before: {changed:?}. If that is meant, `cargo run --release -p closecall-xtask -- write-references` writes {DIGESTS}; \
         say in the change log what changes"
    );
}

#[test]
fn a_digest_tells_modes_and_seeds_apart() {
    let file = ScenarioFile::load(&library("low-thw-overtake"), &[]).unwrap();
    let digest = |mode, seed| generator::outcomes(&file, mode, seed).unwrap();
    let object = digest(SensorMode::Object, SEED);
    assert_eq!(object, digest(SensorMode::Object, SEED));
    assert_ne!(object, digest(SensorMode::Object, SEED + 1));
    assert_ne!(object, digest(SensorMode::GroundTruth, SEED));
}
