//! The models of the encounter in the closed loop: the ego's jerk, the start, emergency braking
//! that ends, and the rear driver's brake and headway.

use closecall_campaign::runner::{Sampling, concrete};
use closecall_controllers::EgoState;
use closecall_scenarios::outcome::{Moment, Outcome, ReachedMoment};
use closecall_scenarios::sampling::Design;
use closecall_scenarios::{Scenario, ScenarioFile, Setting};
use closecall_sensors::{SceneVehicle, SensorMode};
use closecall_simulation::controller::BuiltIn;
use closecall_simulation::{Arm, NoObserver, Observer, RunEvent, RunKey, StepView, simulate};
use closecall_traffic::{ActorId, CONTROL_STEP, ParameterName, Time, Value};

use crate::support::{all_of_library, library};

/// One sample of a library scenario.
fn sample(name: &str, settings: &[&str], key: RunKey) -> Scenario {
    let settings: Vec<Setting> = settings.iter().map(|setting| setting.parse().unwrap()).collect();
    let file = ScenarioFile::load(&library(name), &settings).unwrap();
    let sampling = Sampling { seed: key.seed, design: Design::Random, samples: key.sample + 1 };
    concrete(&file, sampling, key.sample).unwrap()
}

fn run(scenario: &Scenario, key: RunKey, controller: BuiltIn, observer: &mut dyn Observer) -> Outcome {
    let arm = Arm { controller: controller.factory(), sensors: Some(SensorMode::Object) };
    simulate(scenario, key, &arm, observer).unwrap()
}

/// The ego at one control step.
#[derive(Clone, Copy)]
struct EgoStep {
    speed_mps: f64,
    commanded_mps2: f64,
    state: EgoState,
}

/// Collects the ego's commands.
#[derive(Default)]
struct Commands(Vec<EgoStep>);

impl Observer for Commands {
    fn step(&mut self, view: &StepView<'_>) {
        self.0.push(EgoStep {
            speed_mps: view.vehicles[view.scenario.ego].state.speed_mps,
            commanded_mps2: view.command.acceleration_mps2,
            state: view.command.state,
        });
    }

    fn event(&mut self, _: Time, _: &RunEvent) {}
}

/// Returns the commands of the ego up to its first collision.
fn commands(name: &str, settings: &[&str], key: RunKey, controller: BuiltIn) -> Vec<EgoStep> {
    let mut commands = Commands::default();
    let outcome = run(&sample(name, settings, key), key, controller, &mut commands);
    let steps = outcome
        .ego_collisions()
        .next()
        .map_or(usize::MAX, |collision| usize::try_from(collision.time.ns() / CONTROL_STEP.ns()).unwrap());
    commands.0.truncate(steps);
    commands.0
}

/// The tolerance of the plant's jerk: it follows steps of 25 Hz, not a ramp.
const RIPPLE: f64 = 1.1;

/// The jerk limits of the cruise control from 20 m/s on (ISO 15622), and of the margin increase
/// system (m/s³).
const JERK_LIMITS_MPS3: [(BuiltIn, f64); 2] = [(BuiltIn::Acc, 2.5), (BuiltIn::Mis, 3.0)];

/// Scenarios in which nothing but the approach of the rear vehicle happens.
const WITHOUT_EVENTS: [&str; 5] =
    ["overtake-without-brake", "left-lane-blocked", "rear-follower-stays", "slow-approach", "empty-wet-road"];

#[test]
fn without_events_the_jerk_of_the_ego_is_small() {
    for name in WITHOUT_EVENTS {
        for index in 0..10 {
            let key = RunKey { seed: 3, sample: index };
            let scenario = sample(name, &[], key);
            for (controller, limit_mps3) in JERK_LIMITS_MPS3 {
                let jerk_mps3 = run(&scenario, key, controller, &mut NoObserver).margins.max_jerk_mps3;
                assert!(jerk_mps3 < RIPPLE * limit_mps3, "{name}, sample {index}: {jerk_mps3} m/s³");
            }
        }
    }
}

#[test]
fn in_every_scenario_of_the_library_the_ego_starts_in_balance() {
    for path in all_of_library() {
        let name = path.file_stem().unwrap().to_str().unwrap();
        for index in 0..5 {
            let key = RunKey { seed: 3, sample: index };
            // Where the lead vehicle brakes at a time on the clock, it does so after the start.
            let is_timed = std::fs::read_to_string(&path).unwrap().contains("\nbrake-at-s");
            let later: &[&str] = if is_timed { &["brake-at-s=20.0"] } else { &[] };
            for step in &commands(name, later, key, BuiltIn::Acc)[..25] {
                let command_mps2 = step.commanded_mps2;
                assert!(command_mps2.abs() < 0.5, "{name}, sample {index}: {command_mps2} m/s² at the start");
            }
        }
    }
}

#[test]
fn the_acc_keeps_the_jerk_limit_of_iso_15622_unless_emergency_braking_acts() {
    let mut braked = 0;
    for index in 0..20 {
        let steps = commands("low-thw-overtake", &[], RunKey { seed: 4, sample: index }, BuiltIn::Acc);
        for pair in steps.windows(2) {
            let emergency = pair.iter().any(|step| step.state == EgoState::EmergencyBraking);
            let jerk_mps3 = (pair[1].commanded_mps2 - pair[0].commanded_mps2) / CONTROL_STEP.s();
            let limit_mps3 = (5.0 - (pair[1].speed_mps - 5.0) / 6.0).clamp(2.5, 5.0);
            assert!(emergency || jerk_mps3.abs() <= limit_mps3 + 1e-6, "sample {index}: {jerk_mps3} m/s³");
            braked += u32::from(pair[1].commanded_mps2 < -1.0);
        }
    }
    assert!(braked > 100, "only {braked} steps of braking");
}

#[test]
fn after_emergency_braking_the_ego_follows_the_comfort_command_at_once() {
    let partial = ["actor.front.event.front-brakes.then.brake.to-speed-mps=20"];
    let mut ends = 0;
    for index in 0..60 {
        let steps = commands("low-thw-overtake", &partial, RunKey { seed: 51, sample: index }, BuiltIn::Mis);
        for pair in steps.windows(2) {
            if pair[0].state == EgoState::EmergencyBraking && pair[1].state != EgoState::EmergencyBraking {
                // The cruise control brakes by at most 3.5 m/s² above 20 m/s.
                assert!(pair[1].commanded_mps2 >= -4.0, "sample {index}: {} m/s²", pair[1].commanded_mps2);
                ends += 1;
            }
        }
    }
    assert!(ends > 10, "emergency braking ended only {ends} times");
}

/// The smallest time headways of the rear vehicle over some samples without braking (s), their
/// mean.
fn mean_rear_headway_s(cc1: &str) -> f64 {
    let samples = 20;
    let total_s: f64 = (0..samples)
        .map(|index| {
            let key = RunKey { seed: 5, sample: index };
            let scenario = sample("overtake-without-brake", &["cut-out-thw-s=0.15", cc1], key);
            run(&scenario, key, BuiltIn::Acc, &mut NoObserver).margins.min_thw_rear_s.unwrap()
        })
        .sum();
    total_s / samples as f64
}

#[test]
fn a_larger_cc1_of_the_overtaker_gives_a_larger_rear_headway() {
    let [none_s, some_s] = ["rear-cc1-s=0.0", "rear-cc1-s=0.2"].map(mean_rear_headway_s);
    assert!((none_s - 0.15).abs() < 0.03, "{none_s}");
    assert!(some_s > none_s + 0.03, "{none_s} and {some_s}");
}

/// Collects the time at which the ego's brake light goes on, and the rear vehicle's acceleration
/// over time.
#[derive(Default)]
struct RearBrakes {
    light_on: Option<Time>,
    accelerations: Vec<(Time, f64)>,
}

impl Observer for RearBrakes {
    fn step(&mut self, view: &StepView<'_>) {
        let [ego, _, rear] = view.vehicles else { unreachable!("the scenario has three vehicles") };
        if ego.state.brake_light {
            self.light_on.get_or_insert(view.time);
        }
        self.accelerations.push((view.time, rear.state.acceleration_mps2));
    }

    fn event(&mut self, _: Time, _: &RunEvent) {}
}

#[test]
fn a_rear_driver_about_to_overtake_brakes_one_reaction_time_after_the_brake_light() {
    // The ego brakes by 7 m/s² long before the rear vehicle pulls out.
    let key = RunKey { seed: 1, sample: 71 };
    let scenario = sample("low-thw-overtake", &[], key);
    let name = ParameterName::new("reaction-s").unwrap();
    let Some(Value::Number(reaction_s)) = scenario.parameters.get(&name) else { panic!("{name} is a number") };
    let mut rear = RearBrakes::default();
    run(&scenario, key, BuiltIn::Acc, &mut rear);
    let due = rear.light_on.unwrap() + Time::from_s(*reaction_s + 0.5);
    let (_, then_mps2) = rear.accelerations.iter().find(|(time, _)| *time >= due).unwrap();
    assert!(*then_mps2 < -1.5, "{then_mps2} m/s² at {due}");
}

/// Returns whether any vehicle collides in one sample without the system.
fn collides_without_the_system(name: &str, key: RunKey) -> bool {
    !run(&sample(name, &[], key), key, BuiltIn::Acc, &mut NoObserver).collisions.is_empty()
}

#[test]
fn human_drivers_do_not_collide_where_nothing_happens_ahead() {
    for name in ["rear-vehicle-is-followed-without-brake", "rear-vehicles-one-after-another-without-brake"] {
        for index in 0..100 {
            let key = RunKey { seed: 5001, sample: index };
            assert!(!collides_without_the_system(name, key), "{name}, sample {index}");
        }
    }
}

#[test]
fn a_driver_does_not_turn_back_into_the_vehicle_that_it_overtakes() {
    for index in [127, 1133, 1185, 1461, 1860] {
        let key = RunKey { seed: 5001, sample: index };
        assert!(!collides_without_the_system("rear-vehicle-is-followed-without-brake", key), "sample {index}");
    }
}

#[test]
fn a_driver_who_pulls_out_behind_another_one_does_not_strike_the_vehicle_that_both_overtake() {
    for index in [274, 467, 859, 861] {
        let key = RunKey { seed: 7, sample: index };
        assert!(!collides_without_the_system("rear-vehicles-one-after-another-without-brake", key), "sample {index}");
    }
}

/// Notes the gap along the road from each vehicle to the ego (m) at each control step. A vehicle whose front has passed the ego's
/// rear end has a negative gap.
#[derive(Default)]
struct GapsBehind(Vec<(Time, Vec<(ActorId, f64)>)>);

impl Observer for GapsBehind {
    fn step(&mut self, view: &StepView<'_>) {
        let ego = view.vehicles[view.scenario.ego];
        let gap_m = |other: &SceneVehicle| {
            let lengths_m = ego.vehicle.dimensions.length_m + other.vehicle.dimensions.length_m;
            ego.state.s_m - other.state.s_m - 0.5 * lengths_m
        };
        let gaps = view.vehicles.iter().map(|other| (view.scenario.actors[other.actor].id.clone(), gap_m(other)));
        self.0.push((view.time, gaps.collect()));
    }

    fn event(&mut self, _: Time, _: &RunEvent) {}
}

#[test]
fn a_moment_with_several_vehicles_behind_has_the_one_that_is_there() {
    let name = "rear-vehicles-one-after-another";
    let mut names = Vec::new();
    for index in 0..12 {
        let key = RunKey { seed: 2, sample: index };
        for controller in [BuiltIn::Acc, BuiltIn::Mis] {
            let mut gaps = GapsBehind::default();
            let outcome = run(&sample(name, &[], key), key, controller, &mut gaps);
            let gap_m = |reached: &ReachedMoment| {
                let vehicle = reached.vehicle.clone().unwrap();
                let (_, step) = gaps.0.iter().find(|(time, _)| *time == reached.time).unwrap();
                step.iter().find(|(id, _)| *id == vehicle).unwrap().1
            };
            if let Some(reached) = outcome.reached(Moment::CriticalDistance) {
                assert!((-5.0..=5.01).contains(&gap_m(reached)), "sample {index}: {reached:?} {} m", gap_m(reached));
                names.push(reached.vehicle.clone().unwrap());
            }
            if let Some(reached) = outcome.reached(Moment::Hazard) {
                assert!((-0.01..=100.01).contains(&gap_m(reached)), "sample {index}: {reached:?} {} m", gap_m(reached));
            }
            if let Some(reached) = outcome.reached(Moment::FrontBrakes) {
                assert!(gap_m(reached) < 0.0, "sample {index}: {reached:?} {} m", gap_m(reached));
            }
        }
    }
    assert!(names.iter().any(|name| name.as_str() != "rear"), "no sample distinguishes the vehicles: {names:?}");
}
