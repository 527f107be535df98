//! The ego never hits the lead vehicle, unless the rear vehicle has hit the ego first.

use std::path::Path;

use closecall_scenarios::ScenarioFile;
use closecall_scenarios::sampling::Design;
use closecall_simulation::controller::BuiltIn;
use closecall_simulation::{NoObserver, RunKey, simulate};

use crate::drive::arm;

const SCENARIO: &str = include_str!("../../../scenarios/library/low-thw-overtake.toml");

const SAMPLES: u64 = 150;
const SEED: u64 = 1;

#[test]
fn every_first_collision_of_the_ego_is_with_the_rear_vehicle() {
    let file = ScenarioFile::parse(Path::new("low-thw-overtake.toml"), SCENARIO, &[]).unwrap();
    let mut collisions = 0;
    for controller in [BuiltIn::Acc, BuiltIn::Mis] {
        for sample in 0..SAMPLES {
            let parameters = file.space().sample(Design::Random, SEED, sample, SAMPLES);
            let scenario = file.concrete(&parameters).unwrap();
            let key = RunKey { seed: SEED, sample };
            let outcome = simulate(&scenario, key, &arm(controller), &mut NoObserver).unwrap();
            if let Some(first) = outcome.ego_collisions().next() {
                let between = first.between.each_ref().map(|id| id.as_str());
                assert_eq!(between, ["ego", "rear"], "sample {sample}");
                collisions += 1;
            }
        }
    }
    assert!(collisions > 0);
}
