//! A vehicle merges from a ramp: in the closed loop, and in files of other tools.

use std::fs;

use closecall_campaign::runner::{Sampling, concrete};
use closecall_scenarios::sampling::Design;
use closecall_scenarios::{Scenario, ScenarioFile};
use closecall_sensors::SensorMode;
use closecall_simulation::controller::BuiltIn;
use closecall_simulation::{Arm, Observer, RunEvent, RunKey, StepView, simulate};
use closecall_traffic::{Lane, Time, VehicleState};

use crate::support::{closecall, folder, json, library, stdout};

const SEED: u64 = 5;
const SAMPLES: u64 = 40;
/// Distance from the centre of the acceleration lane up to which a vehicle has not left it (m): a
/// quarter of the lane.
const IN_LANE_M: f64 = 0.9;
/// Distance beyond the end of the full width that a front can reach on the way out of the lane (m).
/// A lane change from standstill takes 10 m.
const ON_THE_WAY_M: f64 = 3.0;

/// Watches the vehicle from the ramp.
struct Watch<'a> {
    scenario: &'a Scenario,
    actor: usize,
    last: VehicleState,
    /// Where it crossed the marking (m).
    crossed_m: Option<f64>,
}

impl Observer for Watch<'_> {
    fn wants_steps(&self) -> bool {
        false
    }

    fn step(&mut self, _: &StepView<'_>) {}

    fn event(&mut self, _: Time, _: &RunEvent) {}

    fn moved(&mut self, time: Time, vehicles: &mut dyn Iterator<Item = VehicleState>) {
        let state = vehicles.nth(self.actor).unwrap();
        let road = &self.scenario.road;
        let (lane, entry) = (road.acceleration_lane().unwrap(), road.entry_lane().unwrap());
        let front_m = state.s_m + 0.5 * self.scenario.actors[self.actor].vehicle.dimensions.length_m;
        if road.lane_of(&state) == entry {
            assert!(front_m <= lane.taper_end_m, "at {time}: {front_m} m");
            if (state.d_m - road.lane_centre_m(entry, state.s_m)).abs() < IN_LANE_M {
                assert!(front_m <= lane.to_m + ON_THE_WAY_M, "at {time}: {front_m} m");
            }
        } else if self.crossed_m.is_none() {
            self.crossed_m = Some(state.s_m);
            assert!(state.s_m > lane.from_m, "at {time}: it left the ramp at {} m", state.s_m);
        }
        self.last = state;
    }
}

#[test]
fn vehicles_merge_from_the_ramp_before_the_acceleration_lane_ends() {
    let file = ScenarioFile::load(&library("ramp/ramp-merges"), &[]).unwrap();
    let (mut merged, mut in_first_half) = (0, 0);
    for index in 0..SAMPLES {
        let key = RunKey { seed: SEED, sample: index };
        let sampling = Sampling { seed: SEED, design: Design::Random, samples: SAMPLES };
        let scenario = concrete(&file, sampling, index).unwrap();
        let actor = scenario.actors.iter().position(|actor| actor.id.as_str() == "ramp").unwrap();
        let start = scenario.actors[actor].start;
        assert_eq!(scenario.road.lane_of(&start), Lane(3));
        let mut watch = Watch { scenario: &scenario, actor, last: start, crossed_m: None };
        let arm = Arm { controller: BuiltIn::Mis.factory(), sensors: Some(SensorMode::Object) };
        simulate(&scenario, key, &arm, &mut watch).unwrap();
        let lane = scenario.road.acceleration_lane().unwrap();
        merged += u32::from(scenario.road.lane_of(&watch.last) == Lane(2));
        in_first_half += u32::from(watch.crossed_m.is_some_and(|at_m| at_m < 0.5 * (lane.from_m + lane.to_m)));
    }
    // A run ends 2 s after a collision, which may be before the vehicle has merged.
    assert!(merged >= 36, "{merged} of {SAMPLES}");
    // In free traffic vehicles merge early (Daamen, Loot and Hoogendoorn 2010), where a gap is there.
    assert!(in_first_half >= 4, "{in_first_half} of {SAMPLES}");
}

#[test]
fn a_campaign_where_a_ramp_merges_has_no_errors_and_is_the_same_in_the_mirror() {
    for name in ["ramp/ramp-merges", "ramp/ramp-merges-without-merge"] {
        let path = library(name);
        let words = ["campaign", path.to_str().unwrap(), "--paired", "-n", "20", "--sensors", "object", "--no-gate"];
        // The validity checks of a campaign run mirrored scenarios, too.
        let report = json(&closecall(words.iter().chain(&["--format", "json"])), 0);
        assert_eq!(report["errors"], 0, "{name}");
        assert!(report["verdict"] != "INVALID", "{name}: {}", report["reasons"]);
    }
}

#[test]
fn an_export_says_that_it_cannot_say_which_gap_a_merging_vehicle_accepts() {
    let folder = folder();
    let words = ["tool", "export", "ramp-merges", "--sensors", "object", "--form", "closed-loop", "-o"];
    let said = stdout(&closecall([&words[..], &[folder.path().to_str().unwrap()]].concat()), 0);
    assert!(said.contains("ramp: the gap that it accepts, and its acceleration"), "{said}");
    assert!(!said.contains("front: the gap that it accepts"), "{said}");
}

#[test]
fn the_acceleration_lane_of_an_exported_road_is_imported() {
    let folder = folder();
    let case = folder.path().join("case");
    let words = ["tool", "export", "ramp-merges-without-merge", "--sensors", "object", "--form", "closed-loop", "-o"];
    stdout(&closecall([&words[..], &[case.to_str().unwrap()]].concat()), 0);
    let road = fs::read_to_string(case.join("road.xodr")).unwrap();
    assert_eq!(road.matches("<laneSection").count(), 3, "{road}");
    let output = folder.path().join("scenario.toml");
    let import = ["tool", "import", case.join("closed-loop.xosc").to_str().unwrap(), "-o", output.to_str().unwrap()]
        .map(str::to_owned);
    let said = stdout(&closecall(import), 0);
    assert!(!said.contains("lanes that begin or end") && !said.contains("width changes"), "{said}");
    let scenario: toml::Table = toml::from_str(&fs::read_to_string(&output).unwrap()).unwrap();
    let road = &scenario["road"];
    assert_eq!(road["lanes"].as_integer(), Some(3));
    for (key, expected) in [("length-m", 250.0), ("taper-m", 90.0)] {
        let value = road["acceleration-lane"][key].as_float().unwrap();
        assert!((value - expected).abs() < 1e-6, "{key}: {value}");
    }
}
