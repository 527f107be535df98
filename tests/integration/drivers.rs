//! The human drivers in the whole loop: what a scenario file asks of them is what they do.

use std::collections::BTreeMap;
use std::io::Write;
use std::path::Path;

use closecall_campaign::runner::{Sampling, concrete};
use closecall_scenarios::sampling::Design;
use closecall_sensors::SensorMode;
use closecall_simulation::controller::BuiltIn;
use closecall_simulation::scenario::{Scenario, ScenarioFile};
use closecall_simulation::{Arm, Happening, Observer, RunKey, StepView, simulate};
use closecall_traffic::{ParameterName, Time, Value};
use statrs::distribution::{ContinuousCDF, LogNormal};

use crate::support::{closecall, folder, library, stdout};

/// Samples of each distribution.
const SAMPLES: u64 = 300;

/// Level at which a Kolmogorov–Smirnov test rejects.
const LEVEL: f64 = 0.01;

/// Largest distance of the drawn values' distribution from the one asked for, and the probability of one as large.
fn kolmogorov_smirnov(mut drawn: Vec<f64>, cdf: impl Fn(f64) -> f64) -> (f64, f64) {
    drawn.sort_by(f64::total_cmp);
    let n = drawn.len() as f64;
    let distance = drawn
        .iter()
        .enumerate()
        .map(|(place, value)| {
            let expected = cdf(*value);
            (expected - place as f64 / n).max((place + 1) as f64 / n - expected)
        })
        .fold(0.0, f64::max);
    // Stephens' form of the asymptotic distribution (Journal of the Royal Statistical Society B 32 (1970) 115–122).
    let lambda = (n.sqrt() + 0.12 + 0.11 / n.sqrt()) * distance;
    let term = |k: i32| 2.0 * f64::from(k % 2 * 2 - 1) * (-2.0 * f64::from(k * k) * lambda * lambda).exp();
    (distance, (1..=100).map(term).sum::<f64>().clamp(0.0, 1.0))
}

/// Prints a test's result past the test runner's capture, and fails where it rejects.
fn must_follow(what: &str, drawn: Vec<f64>, cdf: impl Fn(f64) -> f64) {
    let n = drawn.len();
    let (distance, p) = kolmogorov_smirnov(drawn, cdf);
    writeln!(std::io::stderr(), "{what}: Kolmogorov-Smirnov D = {distance:.4}, p = {p:.3}, n = {n}")
        .expect("standard error");
    assert!(p > LEVEL, "{what}: D = {distance}, p = {p}");
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

/// E follows F, R follows E; F brakes after 12 s.
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
driver = { wiedemann99 = { cc1-s = 0.9, reaction-s = { log-normal = { median = 0.9, sigma = 0.3 } } } }
"#;

/// When E's brake light goes on, and when R decelerates afterwards.
#[derive(Default)]
struct BrakeLight {
    on: Option<Time>,
    answered: Option<Time>,
}

impl Observer for BrakeLight {
    fn step(&mut self, view: &StepView<'_>) {
        // More than the oscillation of following, which is 0.25 m/s².
        const DECELERATES_MPS2: f64 = -0.3;
        let [ego, _, rear] = view.vehicles else { unreachable!("three vehicles drive here") };
        if ego.state.brake_light && self.on.is_none() {
            self.on = Some(view.time);
        }
        if self.on.is_some() && self.answered.is_none() && rear.state.acceleration_mps2 < DECELERATES_MPS2 {
            self.answered = Some(view.time);
        }
    }

    fn happening(&mut self, _: Time, _: &Happening) {}
}

#[test]
fn the_delay_between_brake_light_and_deceleration_is_the_reaction_time_asked_for() {
    let file = ScenarioFile::parse(Path::new("reaction.toml"), &format!("{ROAD}{REACTION}"), &[]).unwrap();
    let delays: Vec<f64> = (0..SAMPLES)
        .map(|index| {
            let mut light = BrakeLight::default();
            let key = RunKey { seed: 5, sample: index };
            simulate(&sample(&file, 5, index), key, &arm(BuiltIn::Acc), &mut light).unwrap();
            let on = light.on.unwrap();
            assert!(on > Time::from_s(12.0), "sample {index}: on at {on}");
            (light.answered.unwrap() - on).s()
        })
        .collect();
    let asked = LogNormal::new(0.9_f64.ln(), 0.3).unwrap();
    must_follow("delay between E's brake light and R's deceleration", delays, |delay_s| asked.cdf(delay_s));
}

/// R's time headway to E at the moment at which its centre crosses the marking.
#[derive(Default)]
struct Crossing {
    before: Option<(f64, f64)>,
    thw_s: Option<f64>,
}

impl Observer for Crossing {
    fn step(&mut self, view: &StepView<'_>) {
        let place = |id: &str| view.scenario.actors.iter().position(|actor| actor.id.as_str() == id).unwrap();
        let [ego, rear] = [place("ego"), place("rear")].map(|place| &view.vehicles[place]);
        let lengths_m = ego.vehicle.dimensions.length_m + rear.vehicle.dimensions.length_m;
        let thw_s = (ego.state.s_m - rear.state.s_m - 0.5 * lengths_m) / rear.state.speed_mps;
        let marking_m = -view.scenario.road.lane_width_m();
        let beyond_m = rear.state.d_m - marking_m;
        if let (Some((beyond_before_m, thw_before_s)), None) = (self.before, self.thw_s)
            && beyond_m >= 0.0
        {
            let share = beyond_before_m / (beyond_before_m - beyond_m);
            self.thw_s = Some(thw_before_s + share * (thw_s - thw_before_s));
        }
        self.before = Some((beyond_m, thw_s));
    }

    fn happening(&mut self, _: Time, _: &Happening) {}
}

/// The overtaking that nobody brakes in, as it ships and with an R that weaves and whose wanted speed wanders.
fn steady_and_human() -> [ScenarioFile; 2] {
    let text = std::fs::read_to_string(library("overtake-without-brake")).unwrap();
    let folder = folder();
    let load = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        ScenarioFile::load(&path, &[]).unwrap()
    };
    let human = "lane-keeping = { sdlp-m = 0.2 }\nspeed-keeping = { acceleration-noise-mps2 = 0.1 }\n\n[sensors]";
    assert!(text.contains("[[actor]]\nid = \"rear\"") && text.contains("\n\n[sensors]"));
    [load("steady.toml", &text), load("human.toml", &text.replace("\n[sensors]", human))]
}

#[test]
fn the_headway_at_the_crossing_of_the_marking_is_the_one_asked_for() {
    let [file, human] = steady_and_human();
    let name = ParameterName::new("cut-out-thw-s").unwrap();
    let asked = file.space().get(&name).unwrap().distribution.clone();
    let headway_s = |file: &ScenarioFile, controller, index| {
        let mut crossing = Crossing::default();
        let key = RunKey { seed: 5, sample: index };
        let scenario = sample(file, 5, index);
        simulate(&scenario, key, &arm(controller), &mut crossing).unwrap();
        let Some(Value::Number(asked_s)) = scenario.parameters.get(&name) else { panic!("{name} is a number") };
        (crossing.thw_s.unwrap(), *asked_s)
    };
    let without: Vec<f64> = (0..SAMPLES).map(|index| headway_s(&file, BuiltIn::Acc, index).0).collect();
    must_follow("R's headway at the crossing of the marking", without, |thw_s| asked.cdf(thw_s).unwrap());
    // With the system, E brakes while R is on its way to the marking: R foresees the braking that it has felt, no more. And one
    // who weaves foresees that it stays as far beside its path as it is, which it does not.
    for (who, file, controller) in [("with the system", &file, BuiltIn::Mis), ("while weaving", &human, BuiltIn::Acc)] {
        let found: Vec<(f64, f64)> = (0..SAMPLES).map(|index| headway_s(file, controller, index)).collect();
        let drawn = found.iter().map(|(thw_s, _)| *thw_s).collect();
        let (distance, p) = kolmogorov_smirnov(drawn, |thw_s| asked.cdf(thw_s).unwrap());
        let mut errors_s: Vec<f64> = found.iter().map(|(thw_s, asked_s)| thw_s - asked_s).collect();
        errors_s.sort_by(f64::total_cmp);
        let [low_s, median_s, high_s] = [5, 50, 95].map(|percent| errors_s[errors_s.len() * percent / 100]);
        writeln!(
            std::io::stderr(),
            "the same {who}: D = {distance:.4}, p = {p:.3}; off by {low_s:.3}, {median_s:.3}, {high_s:.3} s (5, 50, 95 %)"
        )
        .expect("standard error");
        assert!(median_s.abs() < 0.03, "{who}: {median_s}");
        assert!(low_s > -0.15 && high_s < 0.15, "{who}: {low_s} to {high_s}");
    }
}

/// E far behind in another lane, and the vehicles of a test.
fn traced(actors: &str, duration_s: f64) -> BTreeMap<String, Vec<Row>> {
    let folder = folder();
    let (path, trace) = (folder.path().join("drivers.toml"), folder.path().join("trace.csv"));
    let ego = "[[actor]]\nid = \"ego\"\nvehicle = { class = \"car\" }\n\
               start = { absolute = { lane = 1, s-m = -900.0, speed-mps = 20.0 } }\n\
               driver = { ego-stack = { acc = { time-gap-s = 1.0 } } }\n";
    let road = ROAD.replace("duration-s = 20.0", &format!("duration-s = {duration_s}"));
    std::fs::write(&path, format!("{road}{actors}{ego}")).unwrap();
    let path = path.to_str().unwrap();
    stdout(&closecall(["check", path]), 0);
    stdout(&closecall(["run", path, "--sensors", "ground-truth", "--trace", trace.to_str().unwrap()]), 0);
    let mut rows: BTreeMap<String, Vec<Row>> = BTreeMap::new();
    for line in std::fs::read_to_string(&trace).unwrap().lines().skip(1) {
        let cells: Vec<&str> = line.split(',').collect();
        let number = |place: usize| cells[place].parse::<f64>().ok();
        rows.entry(cells[1].to_owned()).or_default().push(Row {
            time_s: number(0).unwrap(),
            speed_mps: number(5).unwrap(),
            acceleration_mps2: number(6).unwrap(),
            gap_m: number(7),
        });
    }
    rows
}

/// One row of a trace.
struct Row {
    time_s: f64,
    speed_mps: f64,
    acceleration_mps2: f64,
    gap_m: Option<f64>,
}

/// A leader, and a follower behind it.
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
fn a_trace_shows_the_gap_of_wiedemann_99_in_its_band() {
    for (cc1_s, reaction) in [(0.35, ""), (0.75, ""), (1.2, ""), (0.55, ", reaction-s = 0.8")] {
        // 27.3 m/s, then down to 21.7 m/s within 4 s, and kept.
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
fn a_cascade_of_followers_comes_to_rest_behind_a_leader_that_accelerates_and_brakes_by_a_list() {
    let mut actors = pair(
        "{ acceleration-profile = [[6.0, 1.1], [9.0, 0.0], [30.0, -5.3]] }",
        "{ wiedemann99 = { cc1-s = 0.9, reaction-s = 0.7 } }",
    );
    for (id, of, driver) in [
        (
            "second",
            "tail",
            "{ wiedemann99 = { cc1-s = 0.8, reaction-s = { log-normal = { median = 0.7, sigma = 0.2 } } } }",
        ),
        ("third", "second", "{ idm = { time-gap-s = 1.0, reaction-s = 0.6 } }"),
        ("fourth", "third", "{ wiedemann99 = { cc1-s = 0.7 } }"),
    ] {
        actors += &format!(
            "[[actor]]\nid = \"{id}\"\nvehicle = {{ class = \"car\" }}\n\
             start = {{ behind = {{ of = \"{of}\", thw-s = 1.3, speed-mps = 28.0 }} }}\ndriver = {driver}\n"
        );
    }
    let rows = traced(&actors, 75.0);
    let lead_at = |time_s: f64| rows["lead"].iter().find(|row| row.time_s >= time_s).unwrap().speed_mps;
    // 27.3 + 3 · 1.1 = 30.6 m/s, which are braked away at 5.3 m/s² in 5.8 s.
    assert!((lead_at(20.0) - 30.6).abs() < 0.05 && lead_at(36.5) < 0.05, "{} {}", lead_at(20.0), lead_at(36.5));
    for follower in ["tail", "second", "third", "fourth"] {
        let rows = &rows[follower];
        let least_m = rows.iter().map(|row| row.gap_m.unwrap()).fold(f64::INFINITY, f64::min);
        assert!(least_m > 1.0, "{follower}: {least_m}");
        assert!(rows.last().unwrap().speed_mps < 0.5, "{follower}");
    }
}

#[test]
fn a_recorded_vehicle_is_followed_and_the_scenario_needs_the_recording_no_more() {
    let folder = folder();
    let recording = folder.path().join("own.csv");
    let library = library("overtake-without-brake");
    stdout(&closecall(["record", library.to_str().unwrap(), "-n", "1", "-o", recording.to_str().unwrap()]), 0);
    let actors = pair("{ recorded = { file = \"own.csv\", track-id = 1 } }", "{ wiedemann99 = {} }");
    let ego = "[[actor]]\nid = \"ego\"\nvehicle = { class = \"car\" }\n\
               start = { absolute = { lane = 1, s-m = -900.0, speed-mps = 20.0 } }\n\
               driver = { ego-stack = { acc = { time-gap-s = 1.0 } } }\n";
    let path = folder.path().join("scenario.toml");
    let text = format!("{ROAD}{actors}{ego}");
    std::fs::write(&path, &text).unwrap();
    let file = ScenarioFile::load(&path, &[]).unwrap();
    assert!(file.text().contains("profile") && !file.text().contains("recorded"), "{}", file.text());
    std::fs::remove_file(&recording).unwrap();
    let again = ScenarioFile::parse(&path, file.text(), &[]).unwrap();
    assert_eq!(again.text(), file.text());
    // Without the recording, the file as it was written says what is missing and where.
    let error = ScenarioFile::parse(&path, &text, &[]).unwrap_err().to_string();
    let line = 1 + text.lines().position(|line| line.contains("recorded")).unwrap();
    assert!(error.contains(&format!("scenario.toml:{line}")) && error.contains("own.csv"), "{error}");
}
