//! With true tracks the margin increase system engages when, and only when, its conditions hold; and it keeps what it says
//! of its goal. The conditions are worked out here from the truth, apart from the controller.

use closecall_campaign::runner::{Sampling, concrete};
use closecall_controllers::EgoState;
use closecall_scenarios::sampling::Design;
use closecall_sensors::SensorMode;
use closecall_simulation::controller::BuiltIn;
use closecall_simulation::outcome::{Moment, Outcome};
use closecall_simulation::scenario::{ScenarioFile, Setting};
use closecall_simulation::{Arm, CONTROL_STEP, Happening, Observer, RunKey, StepView, simulate};
use closecall_traffic::Time;

use crate::support::library;

/// The method's conditions.
const ENGAGE_GAP_M: f64 = 100.0;
const ENGAGE_CLOSING_MPS: f64 = 10.0 / 3.6;
const SHORT_THW_S: f64 = 1.5;

/// What rounding may make of a comparison.
const ROUNDING: f64 = 1e-9;

/// When the conditions first held, and when the system first engaged.
#[derive(Default)]
struct Watch {
    held: Option<Time>,
    engaged: Option<Time>,
    /// True where it engaged at a step at which they did not hold.
    too_early: bool,
}

impl Observer for Watch {
    fn step(&mut self, view: &StepView<'_>) {
        let speed_mps = |actor: usize| view.vehicles[actor].state.speed_mps;
        let closing_mps = view.margins.follower.map(|rear| speed_mps(rear) - speed_mps(view.scenario.ego));
        // In these scenarios nobody but R ever uses the left lane, so that it is free while R is in E's.
        let holds = view.margins.gap_rear_m.is_ok_and(|gap_m| gap_m <= ENGAGE_GAP_M + ROUNDING)
            && closing_mps.is_some_and(|closing_mps| closing_mps >= ENGAGE_CLOSING_MPS - ROUNDING)
            && view.margins.thw_front_s.is_ok_and(|thw_s| thw_s < SHORT_THW_S + ROUNDING);
        if holds {
            self.held.get_or_insert(view.time);
        }
        if view.command.state == EgoState::Increasing && self.engaged.is_none() {
            self.engaged = Some(view.time);
            self.too_early = !holds;
        }
    }

    fn happening(&mut self, _: Time, _: &Happening) {}
}

fn watch(name: &str, settings: &[&str], samples: u64) -> Vec<(Watch, Outcome)> {
    let settings: Vec<Setting> = settings.iter().map(|setting| setting.parse().unwrap()).collect();
    let file = ScenarioFile::load(&library(name), &settings).unwrap();
    let arm = Arm { controller: BuiltIn::Mis.factory(), sensors: Some(SensorMode::GroundTruth) };
    let sampling = Sampling { seed: 11, design: Design::Random, samples };
    let run = |sample| {
        let scenario = concrete(&file, sampling, sample).unwrap();
        let mut watch = Watch::default();
        let outcome = simulate(&scenario, RunKey { seed: 11, sample }, &arm, &mut watch).unwrap();
        (watch, outcome)
    };
    (0..samples).map(run).collect()
}

#[test]
fn it_engages_within_two_control_steps_of_its_conditions_and_never_before() {
    let mut engagements = 0;
    for name in ["low-thw-overtake", "overtake-without-brake", "rear-follower-stays", "slow-approach", "paper-figure"] {
        for (sample, (watch, _)) in watch(name, &[], 60).iter().enumerate() {
            assert!(!watch.too_early, "{name}, sample {sample}");
            match (watch.held, watch.engaged) {
                (Some(held), Some(engaged)) => {
                    let late = engaged - held;
                    assert!(late <= CONTROL_STEP + CONTROL_STEP, "{name}, sample {sample}: {late} late");
                    engagements += 1;
                }
                (None, None) => {}
                (held, engaged) => panic!("{name}, sample {sample}: held {held:?}, engaged {engaged:?}"),
            }
        }
    }
    assert!(engagements > 150, "{engagements}");
}

#[test]
fn each_missing_condition_keeps_it_from_engaging() {
    for (settings, what) in [
        (["actor.ego.driver.ego-stack.automated=false"], "not automated"),
        (["actor.ego.driver.ego-stack.mis.short-thw-s=0.3"], "front margin long"),
        (["actor.ego.driver.ego-stack.mis.engage-gap-m=1.0"], "rear far"),
        (["actor.ego.driver.ego-stack.mis.engage-closing-mps=30.0"], "rear not approaching"),
    ] {
        for (watch, outcome) in watch("overtake-without-brake", &settings, 12) {
            assert_eq!(watch.engaged, None, "{what}: {outcome:?}");
        }
    }
}

/// The gain that is promised, and by how much it may fall short [s].
const GAIN_S: f64 = 2.0;
const SHORT_BY_S: f64 = 0.1;

/// More samples: `cargo run --release --example validate_mis`.
#[test]
fn a_goal_said_to_be_in_reach_is_reached_unless_f_brakes_first() {
    let mut kept = 0;
    for name in ["overtake-without-brake", "low-thw-overtake"] {
        for (sample, (_, outcome)) in watch(name, &[], 100).iter().enumerate() {
            let (mis, critical) = (outcome.mis.unwrap(), outcome.moment(Moment::CriticalDistance));
            let f_brakes_first = match (outcome.moment(Moment::FrontBrakes), critical) {
                (Some(brakes), Some(critical)) => brakes <= critical,
                (_, None) => true,
                (None, _) => false,
            };
            if mis.goal_in_reach == Some(true) && !f_brakes_first {
                let gained_s = mis.thw_front_at_critical_s.unwrap() - mis.thw_front_at_engagement_s.unwrap();
                assert!(gained_s >= GAIN_S - SHORT_BY_S, "{name}, sample {sample}: {gained_s} s");
                kept += 1;
            }
        }
    }
    assert!(kept > 20, "{kept}");
}
