//! The reason that is stated for a margin increase system (MIS) that never engaged is the one that
//! the log of its steps shows: the reason that held longest while it could have engaged.

use closecall_campaign::runner::{Sampling, concrete};
use closecall_controllers::Reason;
use closecall_scenarios::ScenarioFile;
use closecall_scenarios::outcome::{Moment, Outcome, Phase, ReasonSpan};
use closecall_scenarios::sampling::Design;
use closecall_sensors::SensorMode;
use closecall_simulation::controller::BuiltIn;
use closecall_simulation::{Arm, CONTROL_STEP, Observer, RunEvent, RunKey, StepView, simulate};
use closecall_traffic::Time;

use crate::support::{all_of_library, closecall, json, stdout, traffic_of_library};

/// The conditions of the method on distance and closing speed.
const NEAR_M: f64 = 100.0;
const CLOSING_MPS: f64 = 10.0 / 3.6;

/// A control step as the log shows it.
struct Step {
    time: Time,
    reason: Reason,
    /// The vehicle behind, if it meets the conditions.
    near: Option<usize>,
    /// Whether it has left the lane.
    has_crossed: bool,
}

#[derive(Default)]
struct Log(Vec<Step>);

impl Observer for Log {
    fn step(&mut self, view: &StepView<'_>) {
        let speed_mps = |actor: usize| view.vehicles[actor].state.speed_mps;
        let near = view.margins.follower.filter(|rear| {
            view.margins.gap_rear_m.is_ok_and(|gap_m| gap_m <= NEAR_M)
                && speed_mps(*rear) - speed_mps(view.scenario.ego) >= CLOSING_MPS
        });
        let has_crossed = matches!(view.phase, Phase::Overtaking | Phase::After);
        self.0.push(Step { time: view.time, reason: view.command.reason, near, has_crossed });
    }

    fn event(&mut self, _: Time, _: &RunEvent) {}
}

const SEED: u64 = 46;

fn run(file: &ScenarioFile, sample: u64) -> (Outcome, Log) {
    let arm = Arm { controller: BuiltIn::Mis.factory(), sensors: Some(SensorMode::Object) };
    let sampling = Sampling { seed: SEED, design: Design::Random, samples: sample + 1 };
    let scenario = concrete(file, sampling, sample).unwrap();
    let mut log = Log::default();
    let outcome = simulate(&scenario, RunKey { seed: SEED, sample }, &arm, &mut log).unwrap();
    (outcome, log)
}

/// The numbers of control steps with each reason in the time in which the system could have
/// engaged.
fn tally(steps: &[Step], outcome: &Outcome) -> Vec<(Reason, usize)> {
    let since = |actor: usize| steps.iter().find(|step| step.near == Some(actor)).map(|step| step.time);
    let at = |time: Time| steps.iter().find(|step| step.time == time);
    let crossing = || {
        let near_until = |at: usize| steps[..=at].iter().rev().find_map(|step| step.near);
        (0..steps.len()).find_map(|at| steps[at].has_crossed.then(|| near_until(at)).flatten().map(|near| (near, at)))
    };
    let interval = match outcome.moment(Moment::Hazard) {
        Some(hazard) => at(hazard).and_then(|step| step.near).and_then(since).map(|from| (from, hazard)),
        None => crossing().and_then(|(near, at)| since(near).map(|from| (from, steps[at].time))),
    };
    let first = steps.iter().find(|step| step.near.is_some()).map(|step| step.time);
    let end = steps.last().unwrap().time;
    let (from, until) = interval.or(first.map(|first| (first, end))).unwrap_or((Time::ZERO, end));
    let mut counts: Vec<(Reason, usize)> = Vec::new();
    for step in steps.iter().filter(|step| from <= step.time && step.time < until) {
        match counts.iter_mut().find(|(reason, _)| *reason == step.reason) {
            Some((_, count)) => *count += 1,
            None => counts.push((step.reason, 1)),
        }
    }
    counts.retain(|(reason, _)| !matches!(reason, Reason::BrakingRequired | Reason::BrakingDone));
    counts
}

/// Returns the runs of equal reasons.
fn spans(steps: &[Step]) -> Vec<(Reason, Time)> {
    let mut spans: Vec<(Reason, Time)> = Vec::new();
    for step in steps {
        if spans.last().is_none_or(|(reason, _)| *reason != step.reason) {
            spans.push((step.reason, step.time));
        }
    }
    spans
}

#[test]
fn the_stated_reason_agrees_with_the_log_in_every_scenario() {
    let mut never_engaged = 0;
    for (paths, samples) in [(all_of_library(), 8), (traffic_of_library(), 2)] {
        for path in paths {
            let file = ScenarioFile::load(&path, &[]).unwrap();
            for sample in 0..samples {
                let (outcome, Log(steps)) = run(&file, sample);
                let mis = outcome.mis.as_ref().unwrap();
                let context = format!("{}, sample {sample}", file.config().name);
                let stated_span = |span: &ReasonSpan| (span.reason, Time::from_s(span.from_s));
                assert_eq!(mis.reasons.iter().map(stated_span).collect::<Vec<_>>(), spans(&steps), "{context}");
                let gaps = mis.reasons.windows(2).filter(|pair| pair[0].until_s != pair[1].from_s).count();
                assert_eq!(gaps, 0, "{context}: the intervals leave no gap");
                if mis.engaged_at_s.is_ok() {
                    continue;
                }
                never_engaged += 1;
                let counts = tally(&steps, &outcome);
                let Some(most) = counts.iter().map(|(_, count)| *count).max() else { continue };
                let stated = counts.iter().find(|(reason, _)| *reason == mis.reason);
                assert!(stated.is_some_and(|(_, count)| *count == most), "{context}: {} of {counts:?}", mis.reason);
            }
        }
    }
    assert!(never_engaged >= 16, "only {never_engaged} runs without an engagement, of {CONTROL_STEP} steps");
}

#[test]
fn a_passing_lane_that_was_occupied_until_the_braking_is_the_stated_reason_and_not_the_braking() {
    let args = ["run", "scenarios/library/traffic/busy-overtake.toml", "--seed", "1", "--sample", "0", "--paired"];
    let text = stdout(&closecall(args), 0);
    assert!(text.contains("passing lane occupied"), "{text}");
    assert!(!text.contains("emergency braking required"), "{text}");
    // The sentence and the line about the system name the same time.
    let told = text.split("the MIS stayed off: ").nth(1).unwrap().split("; faults").next().unwrap();
    assert_eq!(told, "passing lane occupied, 3.6 to 9.6 s", "{text}");
    assert!(text.contains(&format!("  MIS: {told}\n")), "{text}");
}

#[test]
fn one_step_between_two_emergency_brakings_is_no_engagement_in_any_output() {
    let args = ["run", "low-thw-overtake", "--seed", "31", "--sample", "199", "--sensors", "object"];
    let text = stdout(&closecall(args), 0);
    assert!(text.contains("the MIS stayed off: no vehicle behind in the lane"), "{text}");
    assert!(!text.contains("the MIS engaged"), "{text}");
    let object = json(&closecall(args.into_iter().chain(["--format", "json"])), 0);
    let mis = &object["mis"];
    assert!(mis["engaged_at_s"].is_null() && mis["goal_in_reach"].is_null(), "{mis}");
    assert_eq!(mis["reason"], "no vehicle behind in the lane");
    let spans = mis["reasons"].as_array().unwrap();
    assert!(spans.iter().any(|span| span["reason"] == "emergency braking done"), "the pause itself is told: {mis}");
}
