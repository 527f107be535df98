//! The human drivers follow the scenario file in the closed loop.

use std::collections::BTreeMap;
use std::io::Write;
use std::path::Path;

use closecall_campaign::runner::{Sampling, concrete};
use closecall_scenarios::sampling::Design;
use closecall_scenarios::{Scenario, ScenarioFile};
use closecall_sensors::SensorMode;
use closecall_simulation::controller::BuiltIn;
use closecall_simulation::{Arm, Observer, RunEvent, RunKey, StepView, simulate};
use closecall_traffic::{ParameterName, Time, Value, maths};
use statrs::distribution::{ContinuousCDF, LogNormal};

use crate::support::{closecall, folder, library, stdout};

/// The number of samples of each distribution.
const SAMPLES: u64 = 300;

/// An ego far behind the vehicles of a test, in another lane.
const DISTANT_EGO: &str = "[[actor]]\nid = \"ego\"\nvehicle = { class = \"car\" }\n\
                           start = { absolute = { lane = 1, s-m = -900.0, speed-mps = 20.0 } }\n\
                           driver = { ego-stack = { acc = { time-gap-s = 1.0 } } }\n";

/// Significance level of the Kolmogorov–Smirnov tests.
const LEVEL: f64 = 0.01;

/// Returns the largest distance between the distribution of `values` and `cdf`, and the probability
/// of a distance at least as large.
fn kolmogorov_smirnov(mut values: Vec<f64>, cdf: impl Fn(f64) -> f64) -> (f64, f64) {
    values.sort_by(f64::total_cmp);
    let n = values.len() as f64;
    let distance = values
        .iter()
        .enumerate()
        .map(|(index, value)| {
            let expected = cdf(*value);
            (expected - index as f64 / n).max((index + 1) as f64 / n - expected)
        })
        .fold(0.0, f64::max);
    // Stephens' form of the asymptotic distribution (Journal of the Royal Statistical Society B 32
    // (1970) 115–122).
    let lambda = (n.sqrt() + 0.12 + 0.11 / n.sqrt()) * distance;
    let term = |k: i32| 2.0 * f64::from(k % 2 * 2 - 1) * maths::exp(-2.0 * f64::from(k * k) * lambda * lambda);
    (distance, (1..=100).map(term).sum::<f64>().clamp(0.0, 1.0))
}

/// Fails if `values` do not follow the distribution `cdf`. Prints the result past the capture of
/// the test runner.
fn assert_follows(quantity: &str, values: Vec<f64>, cdf: impl Fn(f64) -> f64) {
    let n = values.len();
    let (distance, p) = kolmogorov_smirnov(values, cdf);
    writeln!(std::io::stderr(), "{quantity}: Kolmogorov-Smirnov D = {distance:.4}, p = {p:.3}, n = {n}")
        .expect("standard error");
    assert!(p > LEVEL, "{quantity}: D = {distance}, p = {p}");
}

fn arm(controller: BuiltIn) -> Arm {
    Arm { controller: controller.factory(), sensors: Some(SensorMode::GroundTruth) }
}

fn sample(file: &ScenarioFile, seed: u64, index: u64) -> Scenario {
    concrete(file, Sampling { seed, design: Design::Random, samples: SAMPLES }, index).unwrap()
}

const ROAD: &str = r#"
schema-version = 1
name = "drivers"
duration-s = 20.0
road = { lanes = 3, lane-width-m = 3.75, curvature-per-m = 0.0, speed-limit-mps = 36.1, overtaking-side = "left" }
"#;

/// The ego follows the lead vehicle, the rear vehicle follows the ego. The lead vehicle brakes
/// after 12 s.
const REACTION: &str = r#"
[[actor]]
id = "ego"
vehicle = { class = "car" }
start = { absolute = { lane = 2, s-m = 500.0, speed-mps = 30.0 } }
driver = { ego-stack = { acc = { time-gap-s = 0.8 }, aeb = {} } }

[[actor]]
id = "front"
vehicle = { class = "car" }
start = { ahead = { of = "ego", thw-s = 0.8, speed-mps = 30.0 } }
driver = { prescribed = { profile = [[0.0, 30.0]] } }
[[actor.event]]
id = "front-brakes"
when = { at-s = 12.0 }
then = { brake = { deceleration-mps2 = 6.0 } }

[[actor]]
id = "rear"
vehicle = { class = "car" }
start = { behind = { of = "ego", thw-s = 1.0, speed-mps = 30.0 } }
driver = { wiedemann99 = { cc1-s = 0.9, reaction-s = { log-normal = { median = 0.9, sigma = 0.3 } }, perception = { anticipation = 0.0 } } }
"#;

/// The time at which the ego's brake light goes on, and the time at which the rear vehicle then
/// decelerates.
#[derive(Default)]
struct BrakeLight {
    on: Option<Time>,
    rear_decelerates: Option<Time>,
}

impl Observer for BrakeLight {
    fn step(&mut self, view: &StepView<'_>) {
        // More than the oscillation of a following driver, which is 0.25 m/s².
        const DECELERATES_MPS2: f64 = -0.3;
        let [ego, _, rear] = view.vehicles else { unreachable!("the scenario has three vehicles") };
        if ego.state.brake_light && self.on.is_none() {
            self.on = Some(view.time);
        }
        if self.on.is_some() && self.rear_decelerates.is_none() && rear.state.acceleration_mps2 < DECELERATES_MPS2 {
            self.rear_decelerates = Some(view.time);
        }
    }

    fn event(&mut self, _: Time, _: &RunEvent) {}
}

#[test]
fn the_delay_between_brake_light_and_deceleration_follows_the_reaction_time_of_the_scenario() {
    let file = ScenarioFile::parse(Path::new("reaction.toml"), &format!("{ROAD}{REACTION}"), &[]).unwrap();
    let delays: Vec<f64> = (0..SAMPLES)
        .map(|index| {
            let mut light = BrakeLight::default();
            let key = RunKey { seed: 5, sample: index };
            simulate(&sample(&file, 5, index), key, &arm(BuiltIn::Acc), &mut light).unwrap();
            let on = light.on.unwrap();
            assert!(on > Time::from_s(12.0), "sample {index}: the brake light is on at {on}");
            (light.rear_decelerates.unwrap() - on).s()
        })
        .collect();
    let expected = LogNormal::new(maths::ln(0.9), 0.3).unwrap();
    assert_follows("delay between the ego's brake light and the rear vehicle's deceleration", delays, |delay_s| {
        expected.cdf(delay_s)
    });
}

/// The rear vehicle's time headway to the ego when its centre crosses the lane marking.
#[derive(Default)]
struct Crossing {
    /// Distance beyond the marking (m) and time headway (s) at the step before.
    before: Option<(f64, f64)>,
    thw_s: Option<f64>,
}

impl Observer for Crossing {
    fn step(&mut self, view: &StepView<'_>) {
        let index = |id: &str| view.scenario.actors.iter().position(|actor| actor.id.as_str() == id).unwrap();
        let [ego, rear] = ["ego", "rear"].map(|id| &view.vehicles[index(id)]);
        let lengths_m = ego.vehicle.dimensions.length_m + rear.vehicle.dimensions.length_m;
        let thw_s = (ego.state.s_m - rear.state.s_m - 0.5 * lengths_m) / rear.state.speed_mps;
        let marking_m = view.scenario.road.full_boundary_m(1, 0.0);
        let beyond_m = rear.state.d_m - marking_m;
        if let (Some((beyond_before_m, thw_before_s)), None) = (self.before, self.thw_s)
            && beyond_m >= 0.0
        {
            let share = beyond_before_m / (beyond_before_m - beyond_m);
            self.thw_s = Some(thw_before_s + share * (thw_s - thw_before_s));
        }
        self.before = Some((beyond_m, thw_s));
    }

    fn event(&mut self, _: Time, _: &RunEvent) {}
}

/// Returns the scenario `overtake-without-brake` as it ships, and with a rear vehicle that weaves
/// in its lane and varies its speed.
fn steady_and_weaving() -> [ScenarioFile; 2] {
    let text = std::fs::read_to_string(library("overtake-without-brake")).unwrap();
    let folder = folder();
    let load = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        ScenarioFile::load(&path, &[]).unwrap()
    };
    let weaving = "lane-keeping = { sdlp-m = 0.2 }\nspeed-keeping = { acceleration-noise-mps2 = 0.1 }\n\n[sensors]";
    assert!(text.contains("[[actor]]\nid = \"rear\"") && text.contains("\n\n[sensors]"));
    [load("steady.toml", &text), load("weaving.toml", &text.replace("\n[sensors]", weaving))]
}

#[test]
fn the_marking_of_a_lane_of_its_own_width_is_crossed_at_the_headway_of_the_scenario() {
    let name = ParameterName::new("cut-out-thw-s").unwrap();
    let largest_error_s = |widths: &str| {
        let settings = [format!("road.lane-width-m={widths}").parse().unwrap()];
        let file = ScenarioFile::load(&library("overtake-without-brake"), &settings).unwrap();
        let errors_s = (0..5).map(|index| {
            let (mut crossing, scenario) = (Crossing::default(), sample(&file, 5, index));
            simulate(&scenario, RunKey { seed: 5, sample: index }, &arm(BuiltIn::Acc), &mut crossing).unwrap();
            let Some(Value::Number(drawn_s)) = scenario.parameters.get(&name) else { panic!("{name} is a number") };
            (crossing.thw_s.unwrap() - drawn_s).abs()
        });
        errors_s.fold(0.0, f64::max)
    };
    let [equal_s, wide_s, narrow_s] = ["3.75", "[5.0,3.0,3.75]", "[3.0,5.0,3.75]"].map(largest_error_s);
    // Half way between the centres, 0.5 m beside the marking, the error would be several times as large.
    assert!(wide_s < 2.0 * equal_s && narrow_s < 2.0 * equal_s, "{equal_s} {wide_s} {narrow_s}");
}

#[test]
fn the_headway_at_the_crossing_of_the_marking_follows_the_distribution_of_the_scenario() {
    let [file, weaving] = steady_and_weaving();
    let name = ParameterName::new("cut-out-thw-s").unwrap();
    let expected = file.space().get(&name).unwrap().distribution.clone();
    let headway_s = |file: &ScenarioFile, controller, index| {
        let mut crossing = Crossing::default();
        let key = RunKey { seed: 5, sample: index };
        let scenario = sample(file, 5, index);
        simulate(&scenario, key, &arm(controller), &mut crossing).unwrap();
        let Some(Value::Number(drawn_s)) = scenario.parameters.get(&name) else { panic!("{name} is a number") };
        (crossing.thw_s.unwrap(), *drawn_s)
    };
    let without: Vec<f64> = (0..SAMPLES).map(|index| headway_s(&file, BuiltIn::Acc, index).0).collect();
    assert_follows("the rear vehicle's headway at the crossing of the marking", without, |thw_s| {
        expected.cdf(thw_s).unwrap()
    });
    // The driver predicts its crossing from the ego's deceleration, as it perceives it, and from
    // its own present offset. With the MIS the ego's deceleration changes, and while weaving the
    // offset changes. The headway is then only close to the drawn one.
    for (when, file, controller) in [("with the MIS", &file, BuiltIn::Mis), ("while weaving", &weaving, BuiltIn::Acc)] {
        let crossings: Vec<(f64, f64)> = (0..SAMPLES).map(|index| headway_s(file, controller, index)).collect();
        let headways_s = crossings.iter().map(|(thw_s, _)| *thw_s).collect();
        let (distance, p) = kolmogorov_smirnov(headways_s, |thw_s| expected.cdf(thw_s).unwrap());
        let mut errors_s: Vec<f64> = crossings.iter().map(|(thw_s, drawn_s)| thw_s - drawn_s).collect();
        errors_s.sort_by(f64::total_cmp);
        let [low_s, median_s, high_s] = [5, 50, 95].map(|percent| errors_s[errors_s.len() * percent / 100]);
        writeln!(
            std::io::stderr(),
            "the same {when}: D = {distance:.4}, p = {p:.3}; off by {low_s:.3}, {median_s:.3}, {high_s:.3} s (5, 50, 95 %)"
        )
        .expect("standard error");
        assert!(median_s.abs() < 0.03, "{when}: {median_s}");
        assert!(low_s > -0.15 && high_s < 0.15, "{when}: {low_s} to {high_s}");
    }
}

/// Runs the vehicles of a test with an ego far behind them in another lane. Returns the rows of the
/// trace by actor.
fn traced(actors: &str, duration_s: f64) -> BTreeMap<String, Vec<Row>> {
    let folder = folder();
    let (path, trace) = (folder.path().join("drivers.toml"), folder.path().join("trace.csv"));
    let road = ROAD.replace("duration-s = 20.0", &format!("duration-s = {duration_s}"));
    std::fs::write(&path, format!("{road}{actors}{DISTANT_EGO}")).unwrap();
    let path = path.to_str().unwrap();
    stdout(&closecall(["check", path]), 0);
    stdout(
        &closecall([
            "run",
            path,
            "--controller",
            "acc",
            "--sensors",
            "ground-truth",
            "--trace",
            trace.to_str().unwrap(),
        ]),
        0,
    );
    let mut rows: BTreeMap<String, Vec<Row>> = BTreeMap::new();
    for line in std::fs::read_to_string(&trace).unwrap().lines().skip(1) {
        let cells: Vec<&str> = line.split(',').collect();
        let number = |column: usize| cells[column].parse::<f64>().ok();
        rows.entry(cells[1].to_owned()).or_default().push(Row {
            time_s: number(0).unwrap(),
            speed_mps: number(5).unwrap(),
            acceleration_mps2: number(6).unwrap(),
            gap_m: number(7),
        });
    }
    rows
}

/// A row of a trace.
struct Row {
    time_s: f64,
    speed_mps: f64,
    acceleration_mps2: f64,
    gap_m: Option<f64>,
}

/// Returns a lead vehicle and a follower as tables of a scenario file.
fn pair(profile: &str, follower: &str) -> String {
    format!(
        "[[actor]]\nid = \"lead\"\nvehicle = {{ class = \"car\" }}\n\
         start = {{ absolute = {{ lane = 2, s-m = 400.0, speed-mps = 27.3 }} }}\n\
         driver = {{ prescribed = {profile} }}\n\
         [[actor]]\nid = \"tail\"\nvehicle = {{ class = \"car\" }}\n\
         start = {{ behind = {{ of = \"lead\", gap-m = 61.0, speed-mps = 29.1 }} }}\ndriver = {follower}\n"
    )
}

#[test]
fn a_wiedemann_99_driver_keeps_its_gap_in_the_band_of_the_model() {
    for (cc1_s, reaction) in [(0.35, ""), (0.75, ""), (1.2, ""), (0.55, ", reaction-s = 0.8")] {
        // The lead vehicle slows from 27.3 m/s to 21.7 m/s within 4 s, and keeps that speed.
        let profile = "{ profile = [[0.0, 27.3], [40.0, 27.3], [44.0, 21.7]] }";
        let follower = format!("{{ wiedemann99 = {{ cc1-s = {cc1_s}{reaction} }} }}");
        let rows = &traced(&pair(profile, &follower), 200.0)["tail"];
        let settled: Vec<f64> = rows.iter().filter(|row| row.time_s > 120.0).map(|row| row.gap_m.unwrap()).collect();
        let safe_m = 1.5 + cc1_s * 21.7;
        let (least_m, most_m) =
            settled.iter().fold((f64::INFINITY, 0.0_f64), |(least, most), gap| (least.min(*gap), most.max(*gap)));
        assert!(least_m > safe_m - 0.1 && most_m < safe_m + 4.1, "cc1 {cc1_s} s: {least_m} to {most_m}, {safe_m}");
        assert!(rows.iter().all(|row| row.acceleration_mps2 > -4.0 && row.gap_m.unwrap() > 1.5), "cc1 {cc1_s} s");
    }
}

#[test]
fn a_column_of_followers_stops_without_contact_behind_a_lead_vehicle_with_prescribed_accelerations() {
    let mut actors = pair(
        "{ acceleration-profile = [[6.0, 1.1], [9.0, 0.0], [30.0, -5.3]] }",
        "{ wiedemann99 = { cc1-s = 0.9, reaction-s = 0.7, hardest-braking-mps2 = 8.0 } }",
    );
    for (id, lead, driver) in [
        (
            "second",
            "tail",
            "{ wiedemann99 = { cc1-s = 0.8, hardest-braking-mps2 = 8.0, reaction-s = { log-normal = { median = 0.7, sigma = 0.2 } } } }",
        ),
        ("third", "second", "{ idm = { time-gap-s = 1.0, reaction-s = 0.6, hardest-braking-mps2 = 8.0 } }"),
        ("fourth", "third", "{ wiedemann99 = { cc1-s = 0.7, hardest-braking-mps2 = 8.0 } }"),
    ] {
        actors += &format!(
            "[[actor]]\nid = \"{id}\"\nvehicle = {{ class = \"car\" }}\n\
             start = {{ behind = {{ of = \"{lead}\", thw-s = 1.3, speed-mps = 28.0 }} }}\ndriver = {driver}\n"
        );
    }
    let rows = traced(&actors, 75.0);
    let lead_at = |time_s: f64| rows["lead"].iter().find(|row| row.time_s >= time_s).unwrap().speed_mps;
    // 27.3 + 3 · 1.1 = 30.6 m/s; braking at 5.3 m/s² from there takes 5.8 s.
    assert!((lead_at(20.0) - 30.6).abs() < 0.05 && lead_at(36.5) < 0.05, "{} {}", lead_at(20.0), lead_at(36.5));
    for follower in ["tail", "second", "third", "fourth"] {
        let rows = &rows[follower];
        let least_m = rows.iter().map(|row| row.gap_m.unwrap()).fold(f64::INFINITY, f64::min);
        assert!(least_m > 1.0, "{follower}: {least_m}");
        assert!(rows.last().unwrap().speed_mps < 0.5, "{follower}");
    }
}

#[test]
fn a_loaded_scenario_holds_the_track_of_a_recorded_vehicle_and_no_longer_needs_the_trajectory_file() {
    let folder = folder();
    let trajectories = folder.path().join("own.csv");
    let library = library("overtake-without-brake");
    stdout(
        &closecall(["traffic", "record", library.to_str().unwrap(), "-n", "1", "-o", trajectories.to_str().unwrap()]),
        0,
    );
    let actors = pair("{ recorded = { file = \"own.csv\", track-id = 1 } }", "{ wiedemann99 = {} }");
    let path = folder.path().join("scenario.toml");
    let text = format!("{ROAD}{actors}{DISTANT_EGO}");
    std::fs::write(&path, &text).unwrap();
    let file = ScenarioFile::load(&path, &[]).unwrap();
    assert!(file.text().contains("profile") && !file.text().contains("recorded"), "{}", file.text());
    std::fs::remove_file(&trajectories).unwrap();
    let again = ScenarioFile::parse(&path, file.text(), &[]).unwrap();
    assert_eq!((again.text(), again.config()), (file.text(), file.config()));
    // The scenario as it was written needs the trajectory file. The error names the file, and the
    // line that asks for it.
    let error = ScenarioFile::parse(&path, &text, &[]).unwrap_err().to_string();
    let line = 1 + text.lines().position(|line| line.contains("recorded")).unwrap();
    assert!(error.contains(&format!("scenario.toml:{line}")) && error.contains("own.csv"), "{error}");
}
