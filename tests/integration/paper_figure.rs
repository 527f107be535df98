//! The scenario `paper-figure` reproduces the figure of the paper: its numbers, and its five
//! moments.

use closecall_campaign::runner::{Sampling, concrete};
use closecall_scenarios::ScenarioFile;
use closecall_scenarios::outcome::{ClosedBy, Moment, Outcome};
use closecall_scenarios::sampling::Design;
use closecall_simulation::controller::BuiltIn;
use closecall_simulation::{Arm, Observer, RunEvent, RunKey, StepView, simulate};
use closecall_traffic::geometry::BoxSide;
use closecall_traffic::{ActorId, Time};

use crate::support::library;

/// The ego's acceleration (m/s²) at each control step.
#[derive(Default)]
struct Accelerations(Vec<(Time, f64)>);

impl Observer for Accelerations {
    fn step(&mut self, view: &StepView<'_>) {
        self.0.push((view.time, view.vehicles[view.scenario.ego].state.acceleration_mps2));
    }

    fn event(&mut self, _: Time, _: &RunEvent) {}
}

/// Runs the scenario, which has no random parameter.
fn run(controller: BuiltIn) -> (Outcome, Accelerations) {
    let file = ScenarioFile::load(&library("paper-figure"), &[]).unwrap();
    let scenario = concrete(&file, Sampling { seed: 0, design: Design::Random, samples: 1 }, 0).unwrap();
    let mut accelerations = Accelerations::default();
    let arm = Arm { controller: controller.factory(), sensors: None };
    let outcome = simulate(&scenario, RunKey { seed: 0, sample: 0 }, &arm, &mut accelerations).unwrap();
    (outcome, accelerations)
}

#[test]
fn a_deceleration_of_one_metre_per_second_squared_gains_two_seconds_of_headway() {
    let (outcome, _) = run(BuiltIn::Mis);
    let mis = outcome.mis.unwrap();
    assert_eq!(mis.goal_in_reach, Some(true));
    let mean_mps2 = mis.mean_deceleration_mps2.unwrap();
    assert!((0.9..=1.1).contains(&mean_mps2), "{mean_mps2}");
    let gained_s = mis.thw_front_at_critical_s.unwrap() - mis.thw_front_at_engagement_s.unwrap();
    assert!((1.9..=2.1).contains(&gained_s), "{gained_s}");
}

#[test]
fn a_plan_for_the_time_to_closest_encounter_brakes_too_gently_for_the_figure() {
    let gained_s = |controller| {
        let mis = run(controller).0.mis.unwrap();
        mis.thw_front_at_critical_s.unwrap() - mis.thw_front_at_engagement_s.unwrap()
    };
    let [critical_gap, ttce] = [BuiltIn::Mis, BuiltIn::MisTtce].map(gained_s);
    assert!(ttce < 1.8 && critical_gap >= 1.9, "{ttce} {critical_gap}");
}

/// Returns the letters of the moments of a run, in their order.
fn letters(outcome: &Outcome) -> String {
    outcome.moments.iter().filter_map(|noted| noted.moment.letter()).collect()
}

#[test]
fn the_moments_of_the_figure_occur_the_hazard_without_the_system_alone() {
    let (with, _) = run(BuiltIn::Mis);
    // The lead vehicle brakes as soon as the rear vehicle is at the critical distance.
    assert_eq!(letters(&with), "bced");
    assert!(with.moment(Moment::Crossed).unwrap() < with.moment(Moment::Concluded).unwrap());
    let (without, _) = run(BuiltIn::Acc);
    assert!(letters(&without).starts_with("bda") || letters(&without).starts_with("bcda"), "{}", letters(&without));
}

/// The comfort limit, and the overshoot of the actuators that is tolerated (m/s²).
const GENTLE_MPS2: f64 = 1.0 + 0.01;

#[test]
fn the_ego_does_not_brake_for_the_lead_vehicle_until_the_rear_vehicle_has_passed() {
    let (outcome, accelerations) = run(BuiltIn::Mis);
    assert!(outcome.collisions.is_empty(), "{:?}", outcome.collisions);
    let [critical, brakes, concluded] = [Moment::CriticalDistance, Moment::FrontBrakes, Moment::Concluded]
        .map(|moment| outcome.moment(moment).unwrap());
    assert!(critical <= brakes && brakes < concluded);
    let mut last_mps2 = 0.0_f64;
    for (time, acceleration_mps2) in accelerations.0.iter().filter(|(time, _)| *time <= concluded) {
        assert!(*acceleration_mps2 >= -GENTLE_MPS2, "{acceleration_mps2} m/s² at {time}");
        // From the critical distance on, the ego releases the brake and does not apply it again.
        if *time > critical {
            assert!(*acceleration_mps2 >= last_mps2 - 1e-6 || last_mps2 == 0.0, "{acceleration_mps2} m/s² at {time}");
            last_mps2 = *acceleration_mps2;
        }
    }
    let brakes_afterwards = accelerations.0.iter().any(|(time, mps2)| *time > concluded && *mps2 < -1.5);
    assert!(brakes_afterwards, "the ego never brakes for the lead vehicle, so the test shows nothing");
}

#[test]
fn without_the_mis_the_same_sample_ends_in_a_rear_end_collision_and_a_second_one() {
    let (outcome, _) = run(BuiltIn::Acc);
    let id = |name| ActorId::new(name).unwrap();
    let first = &outcome.collisions[0];
    assert_eq!(first.between, [id("ego"), id("rear")]);
    assert_eq!(first.struck_side, [BoxSide::Rear, BoxSide::Front]);
    assert_eq!(first.closed_by, ClosedBy::Second);
    assert!(outcome.moment(Moment::FrontBrakes).unwrap() < first.time);
    // The impact pushes the ego into the lead vehicle.
    assert_eq!(outcome.collisions[1].between, [id("ego"), id("front")]);
}
