//! Controllers written in Rust: the one of the example `own_controller`, and one that panics.

use std::sync::Arc;

use closecall_controllers::{ControllerError, EgoCommand, EgoController, EgoInput, EgoSettings, EgoStack};
use closecall_scenarios::ScenarioFile;
use closecall_simulation::ControllerFactory;

use crate::support::library;

#[path = "../../examples/own_controller.rs"]
#[expect(dead_code, reason = "the example's `main` is not called here")]
mod example;

#[test]
fn the_controller_of_the_example_runs_a_campaign() {
    let file = ScenarioFile::load(&library("low-thw-overtake"), &[]).unwrap();
    let counts = example::against_cruise_control(file, Arc::new(example::RoomMakers), 40).unwrap();
    assert_eq!((counts.samples, counts.errors(), counts.invalid), (40, 0, 0));
    // The controller has an effect: some sample ends differently than with the cruise control
    // alone.
    assert!(counts.pairs.prevented + counts.pairs.induced > 0, "{counts:?}");
}

/// An ego stack that panics if the ego is fast.
struct Panics {
    stack: EgoStack,
}

/// The speed from which on the controller panics (m/s): about half of the samples reach it.
const TOO_FAST_MPS: f64 = 31.6;

impl EgoController for Panics {
    fn step(&mut self, input: &EgoInput<'_>) -> Result<EgoCommand, ControllerError> {
        assert!(input.odometry.speed_mps < TOO_FAST_MPS, "the ego is too fast");
        self.stack.step(input)
    }
}

struct PanicsFactory;

impl ControllerFactory for PanicsFactory {
    fn name(&self) -> &str {
        "panics"
    }

    fn has_mis(&self, _: &EgoSettings) -> bool {
        false
    }

    fn build(&self, settings: &EgoSettings) -> Box<dyn EgoController> {
        Box::new(Panics { stack: EgoStack::without_mis(*settings) })
    }
}

#[test]
fn a_panic_is_an_error_of_its_own_sample_only() {
    let file = ScenarioFile::load(&library("overtake-without-brake"), &[]).unwrap();
    let counts = example::against_cruise_control(file, Arc::new(PanicsFactory), 24).unwrap();
    let [cruise, tested] = counts.arms[..] else { panic!("two arms") };
    assert_eq!((cruise.outcomes, cruise.errors), (24, 0));
    assert!(tested.errors > 0 && tested.outcomes > 0, "{tested:?}");
    assert_eq!((tested.outcomes + tested.errors, counts.invalid), (24, 0));
}
