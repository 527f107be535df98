//! With true tracks the margin increase system (MIS) engages if and only if its conditions hold,
//! and reaches a goal that it reports as reachable. These tests evaluate the conditions from the
//! true state of the vehicles, independently of the controller.

use closecall_campaign::runner::{Sampling, concrete};
use closecall_controllers::EgoState;
use closecall_scenarios::outcome::{Moment, Outcome};
use closecall_scenarios::sampling::Design;
use closecall_scenarios::{ScenarioFile, Setting};
use closecall_sensors::SensorMode;
use closecall_simulation::controller::BuiltIn;
use closecall_simulation::{Arm, CONTROL_STEP, Observer, RunEvent, RunKey, StepView, simulate};
use closecall_traffic::Time;

use crate::support::library;

/// The conditions of the method.
const ENGAGE_GAP_M: f64 = 100.0;
const ENGAGE_CLOSING_MPS: f64 = 10.0 / 3.6;
const SHORT_THW_S: f64 = 1.5;

/// Tolerance of a comparison for rounding.
const ROUNDING: f64 = 1e-9;

/// The time at which the conditions first hold, and the time at which the MIS first engages.
#[derive(Default)]
struct Engagement {
    conditions_hold: Option<Time>,
    engaged: Option<Time>,
    /// True if the conditions do not hold at the step at which the MIS engages.
    is_too_early: bool,
}

impl Observer for Engagement {
    fn step(&mut self, view: &StepView<'_>) {
        let speed_mps = |actor: usize| view.vehicles[actor].state.speed_mps;
        let closing_mps = view.margins.follower.map(|rear| speed_mps(rear) - speed_mps(view.scenario.ego));
        // In these scenarios only the rear vehicle uses the left lane, which is therefore free
        // while that vehicle is in the ego's lane.
        let all_hold = view.margins.gap_rear_m.is_ok_and(|gap_m| gap_m <= ENGAGE_GAP_M + ROUNDING)
            && closing_mps.is_some_and(|closing_mps| closing_mps >= ENGAGE_CLOSING_MPS - ROUNDING)
            && view.margins.thw_front_s.is_ok_and(|thw_s| thw_s < SHORT_THW_S + ROUNDING);
        if all_hold {
            self.conditions_hold.get_or_insert(view.time);
        }
        if view.command.state == EgoState::Increasing && self.engaged.is_none() {
            self.engaged = Some(view.time);
            self.is_too_early = !all_hold;
        }
    }

    fn event(&mut self, _: Time, _: &RunEvent) {}
}

/// Runs samples of a scenario with the MIS and true tracks.
fn run(name: &str, settings: &[&str], samples: u64) -> Vec<(Engagement, Outcome)> {
    let settings: Vec<Setting> = settings.iter().map(|setting| setting.parse().unwrap()).collect();
    let file = ScenarioFile::load(&library(name), &settings).unwrap();
    let arm = Arm { controller: BuiltIn::Mis.factory(), sensors: Some(SensorMode::GroundTruth) };
    let sampling = Sampling { seed: 11, design: Design::Random, samples };
    let run_sample = |sample| {
        let scenario = concrete(&file, sampling, sample).unwrap();
        let mut engagement = Engagement::default();
        let outcome = simulate(&scenario, RunKey { seed: 11, sample }, &arm, &mut engagement).unwrap();
        (engagement, outcome)
    };
    (0..samples).map(run_sample).collect()
}

#[test]
fn the_mis_engages_within_two_control_steps_of_its_conditions_and_never_before() {
    let mut engagements = 0;
    for name in ["low-thw-overtake", "overtake-without-brake", "rear-follower-stays", "slow-approach", "paper-figure"] {
        for (sample, (engagement, _)) in run(name, &[], 60).iter().enumerate() {
            assert!(!engagement.is_too_early, "{name}, sample {sample}");
            match (engagement.conditions_hold, engagement.engaged) {
                (Some(hold), Some(engaged)) => {
                    let delay = engaged - hold;
                    assert!(
                        delay <= CONTROL_STEP + CONTROL_STEP,
                        "{name}, sample {sample}: {delay} after the conditions"
                    );
                    engagements += 1;
                }
                (None, None) => {}
                (hold, engaged) => {
                    panic!("{name}, sample {sample}: the conditions hold at {hold:?}, the MIS engages at {engaged:?}")
                }
            }
        }
    }
    assert!(engagements > 150, "only {engagements} engagements");
}

#[test]
fn the_mis_does_not_engage_if_one_condition_is_missing() {
    for (settings, condition) in [
        (["actor.ego.driver.ego-stack.automated=false"], "not automated"),
        (["actor.ego.driver.ego-stack.mis.short-thw-s=0.3"], "long front headway"),
        (["actor.ego.driver.ego-stack.mis.engage-gap-m=1.0"], "rear vehicle far away"),
        (["actor.ego.driver.ego-stack.mis.engage-closing-mps=30.0"], "rear vehicle not approaching"),
    ] {
        for (engagement, outcome) in run("overtake-without-brake", &settings, 12) {
            assert_eq!(engagement.engaged, None, "{condition}: {outcome:?}");
        }
    }
}

/// The headway that the MIS has to gain (s).
const GAIN_S: f64 = 2.0;
/// The shortfall of the gain that is tolerated (s).
const SHORT_BY_S: f64 = 0.1;

/// `cargo run --release -p closecall-xtask -- validate-mis` does the same with more samples.
#[test]
fn a_goal_that_is_in_reach_is_reached_unless_the_lead_vehicle_brakes_first() {
    let mut reached = 0;
    for name in ["overtake-without-brake", "low-thw-overtake"] {
        for (sample, (_, outcome)) in run(name, &[], 100).iter().enumerate() {
            let (mis, critical) = (outcome.mis.as_ref().unwrap(), outcome.moment(Moment::CriticalDistance));
            let lead_brakes_first = match (outcome.moment(Moment::FrontBrakes), critical) {
                (Some(brakes), Some(critical)) => brakes <= critical,
                (_, None) => true,
                (None, _) => false,
            };
            if mis.goal_in_reach == Some(true) && !lead_brakes_first {
                let gained_s = mis.thw_front_at_critical_s.unwrap() - mis.thw_front_at_engagement_s.unwrap();
                assert!(gained_s >= GAIN_S - SHORT_BY_S, "{name}, sample {sample}: {gained_s} s");
                reached += 1;
            }
        }
    }
    assert!(reached > 20, "only {reached} goals");
}
