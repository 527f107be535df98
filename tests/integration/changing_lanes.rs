//! A road whose lanes change their widths along it: in the closed loop, in recordings, and in files of
//! other tools.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use closecall_scenarios::{Scenario, ScenarioFile};
use closecall_sensors::SensorMode;
use closecall_simulation::controller::BuiltIn;
use closecall_simulation::{Arm, Observer, RunEvent, RunKey, StepView, simulate};
use closecall_traffic::{Lane, Source, Time, Track};

use crate::support::{ROOT, closecall, folder, json, library, stdout};

/// The lane of the ego becomes narrower and then wider, and all lanes move to the right.
const SECTIONS: &str = "road.cross-sections=[{s-m=600.0,widths-m=[3.75,3.75,3.75]},\
                        {s-m=700.0,widths-m=[4.25,3.25,3.75]},{s-m=800.0,widths-m=[4.25,3.25,3.75]},\
                        {s-m=900.0,widths-m=[3.5,4.0,3.5],left-edge-d-m=-0.5}]";
/// Distance from a cross-section at which a driver no longer passes its kink (m).
const PASSED_M: f64 = 20.0;

/// The left lane begins between 800 and 900 m.
const BEGINS: &str = "road.cross-sections=[{s-m=800.0,widths-m=[0.0,3.75,3.75],left-edge-d-m=-3.75},\
                      {s-m=900.0,widths-m=[3.75,3.75,3.75]}]";

fn scenario(settings: &[&str]) -> Scenario {
    let settings: Vec<_> = settings.iter().map(|setting| setting.parse().unwrap()).collect();
    let file = ScenarioFile::load(&library("paper-figure"), &settings).unwrap();
    file.concrete(&file.space().nominal()).unwrap()
}

fn run(scenario: &Scenario, sensors: SensorMode, observer: &mut dyn Observer) {
    let arm = Arm { controller: BuiltIn::Mis.factory(), sensors: Some(sensors) };
    simulate(scenario, RunKey { seed: 0, sample: 0 }, &arm, observer).unwrap();
}

/// What the vehicles do on such a road.
#[derive(Default)]
struct Watch {
    /// Largest distance of the ego from the centre of its lane (m): far from a cross-section, and near
    /// one.
    beside_m: [f64; 2],
    /// Lateral positions of the ego (m): the smallest and the largest one.
    range_m: [f64; 2],
    /// Largest lateral acceleration (m/s²).
    lateral_mps2: f64,
    /// Steps of the ego outside of its lane.
    outside: usize,
    /// Steps of the rear vehicle on the centre of the left lane, and on the way there where it is not
    /// open.
    passes: usize,
    in_closed: usize,
}

impl Observer for Watch {
    fn step(&mut self, view: &StepView<'_>) {
        let road = &view.scenario.road;
        let [ego, _, rear] = view.vehicles else { unreachable!("the scenario has three vehicles") };
        self.outside += usize::from(road.lane_of(&ego.state) != Lane(2));
        let beside_m = (ego.state.d_m - road.lane_centre_m(Lane(2), ego.state.s_m)).abs();
        let is_near = road.cross_sections_m().any(|s_m| (s_m - ego.state.s_m).abs() < PASSED_M);
        let largest_m = &mut self.beside_m[usize::from(is_near)];
        *largest_m = largest_m.max(beside_m);
        self.range_m = [self.range_m[0].min(ego.state.d_m), self.range_m[1].max(ego.state.d_m)];
        self.lateral_mps2 = self.lateral_mps2.max((ego.state.speed_mps * ego.state.yaw_rate_radps).abs());
        let rear = &rear.state;
        let from_line_m = |lane| (rear.d_m - road.driving_line(Lane(lane), rear.s_m)[0]).abs();
        self.passes += usize::from(road.lane_of(rear) == Lane(1) && from_line_m(1) < 1e-6);
        self.in_closed += usize::from(from_line_m(2) > 0.3 && !road.is_open(Lane(1), [rear.s_m; 2]));
    }

    fn event(&mut self, _: Time, _: &RunEvent) {}
}

#[test]
fn vehicles_follow_their_lanes_where_the_lanes_become_wider_and_move() {
    let mut watch = Watch { range_m: [0.0, -99.0], ..Watch::default() };
    run(&scenario(&[SECTIONS]), SensorMode::GroundTruth, &mut watch);
    // From −5.625 m to −5.875 m and to −6 m.
    assert_eq!(watch.outside, 0);
    let [right_m, left_m] = watch.range_m;
    assert!((left_m + 5.625).abs() < 1e-9 && (right_m + 6.0).abs() < 1e-9, "{right_m} {left_m}");
    assert!(watch.beside_m[0] < 1e-9 && (0.005..0.02).contains(&watch.beside_m[1]), "{:?}", watch.beside_m);
    assert!((0.01..0.2).contains(&watch.lateral_mps2), "{}", watch.lateral_mps2);
    assert!(watch.passes > 10, "{} steps on the centre of the passing lane", watch.passes);
}

#[test]
fn no_vehicle_overtakes_in_a_lane_that_has_not_begun() {
    let mut watch = Watch::default();
    run(&scenario(&[BEGINS]), SensorMode::GroundTruth, &mut watch);
    assert_eq!((watch.in_closed, watch.outside), (0, 0));
    // The watch sees a vehicle that does.
    let mut closed = Watch::default();
    let sections = BEGINS.replace("s-m=800.0", "s-m=-9000.0").replace("s-m=900.0", "s-m=5844.0");
    let changes =
        "actor.rear.driver={prescribed={profile=[[0.0,36.0]],lane-changes=[{at-s=1.0,to=\"left\",duration-s=3.0}]}}";
    run(&scenario(&[&sections, changes]), SensorMode::GroundTruth, &mut closed);
    assert!(closed.in_closed > 0);
}

/// The steps in which the sensors see the rear vehicle, and the steps in which its track is in its
/// lane.
#[derive(Default)]
struct SeenInLane {
    steps: usize,
    right: usize,
}

impl Observer for SeenInLane {
    fn step(&mut self, view: &StepView<'_>) {
        let road = &view.scenario.road;
        let [ego, _, rear] = view.vehicles else { unreachable!("the scenario has three vehicles") };
        let (behind_m, beside_m) = (ego.state.s_m - rear.state.s_m, rear.state.d_m - ego.state.d_m);
        let away_m = |number: u8| (road.full_boundary_m(number, rear.state.s_m) - rear.state.d_m).abs();
        if !(15.0..60.0).contains(&behind_m) || (0..=3).map(away_m).fold(9.9, f64::min) < 0.6 {
            return;
        }
        let lane = usize::from(road.lane_of(&rear.state).0) - 1;
        let is_rear = |track: &&Track| {
            let is_near = (track.x_m() + behind_m).abs() < 8.0 && (track.y_m() - beside_m).abs() < 1.5;
            track.source == Source::Rear && is_near
        };
        if let Some(track) = view.tracks.iter().find(is_rear) {
            self.steps += 1;
            self.right += usize::from(track.lane[lane] > 0.5);
        }
    }

    fn event(&mut self, _: Time, _: &RunEvent) {}
}

#[test]
fn the_sensors_see_a_vehicle_in_its_lane() {
    for sensors in [SensorMode::Full, SensorMode::Object] {
        let mut seen = SeenInLane::default();
        run(&scenario(&[SECTIONS]), sensors, &mut seen);
        let SeenInLane { steps, right } = seen;
        assert!(steps > 20 && 20 * right >= 19 * steps, "{right} of {steps} steps in {sensors:?}");
    }
}

#[test]
fn a_campaign_on_such_a_road_has_no_errors_and_is_the_same_in_the_mirror() {
    // The validity checks of a campaign run mirrored and reversed scenarios, too.
    let words =
        ["campaign", "low-thw-overtake", "--paired", "-n", "12", "--sensors", "object", "--no-gate", "--set", SECTIONS];
    let report = json(&closecall(words.iter().chain(&["--format", "json"])), 0);
    assert_eq!(report["errors"], 0);
    assert!(report["verdict"] != "INVALID", "{}", report["reasons"]);
}

#[test]
fn a_run_on_such_a_road_is_recorded_and_drawn() {
    let folder = folder();
    let recording = folder.path().join("run.rrd");
    let words = ["run", "paper-figure", "--sensors", "full", "--set", SECTIONS, "--record"];
    stdout(&closecall([&words[..], &[recording.to_str().unwrap()]].concat()), 0);
    assert!(fs::metadata(&recording).unwrap().len() > 100_000);
}

/// Exports the scenario with these cross-sections, and returns the folder of the case.
fn export(sections: &str, form: &[&str], case: &Path) {
    let words = ["tool", "export", "paper-figure", "--sensors", "ground-truth", "--set", sections];
    stdout(&closecall([&words[..], form, &["-o", case.to_str().unwrap()]].concat()), 0);
}

/// Returns an imported case, and what the program said.
fn imported(case: &Path, output: &Path) -> (Scenario, String) {
    let words = ["tool", "import", case.join("closed-loop.xosc").to_str().unwrap(), "-o", output.to_str().unwrap()]
        .map(str::to_owned);
    let said = stdout(&closecall(words), 0);
    let file = ScenarioFile::load(output, &[]).unwrap();
    (file.concrete(&file.space().nominal()).unwrap(), said)
}

#[test]
fn an_exported_road_comes_back_with_its_lanes() {
    let course = "road.alignment=[{s-m=0.0,curvature-per-m=0.0},{s-m=700.0,curvature-per-m=0.001}]";
    for (sections, more) in [(SECTIONS, &[][..]), (BEGINS, &[]), (SECTIONS, &["--set", course])] {
        let folder = folder();
        let case = folder.path().join("case");
        export(sections, &[&["--form", "closed-loop"][..], more].concat(), &case);
        let (back, said) = imported(&case, &folder.path().join("scenario.toml"));
        assert!(!said.contains("width") && !said.contains("offset") && !said.contains("begin or end"), "{said}");
        let original = scenario(&[sections]);
        // The road of the file begins elsewhere.
        let [start_m, back_m] = [&original, &back].map(|scenario| scenario.actors[scenario.ego].start.s_m);
        let (start_m, road, original) = (start_m - back_m, &back.road, &original.road);
        for step in 0..60 {
            let s_m = 500.0 + 10.0 * f64::from(step);
            for number in 0..=3 {
                let [edge_m, expected_m] =
                    [(road, s_m - start_m), (original, s_m)].map(|(road, s_m)| road.full_boundary_m(number, s_m));
                assert!((edge_m - expected_m).abs() < 1e-6, "{number} at {s_m}: {edge_m} {expected_m}");
            }
        }
    }
}

#[test]
fn the_quality_checkers_and_other_programs_accept_such_a_road() {
    let Some(python) = closecall_testing::python_with_exchange() else { return };
    for sections in [SECTIONS, BEGINS] {
        let folder = folder();
        let case = folder.path().join("case");
        export(sections, &[], &case);
        let script = PathBuf::from(ROOT).join("tests/integration/exchange/quality.py");
        let said = stdout(&Command::new(&python).arg(script).arg(&case).output().unwrap(), 0);
        assert!(said.ends_with(", 0 issues\n"), "{said}");
    }
}

/// A road on which a lane begins beside the reference line between 300 and 360 m: the two other lanes
/// get other numbers there. It ends between 900 and 960 m.
fn renumbered_road() -> String {
    let road = include_str!("exchange/road.xodr");
    let width = |sections: &str| format!("<width sOffset=\"0\" {sections}/>");
    let full = width("a=\"3.5\"");
    let section = |s_m: u32, lanes: &[(i32, Option<i32>, Option<i32>, &str)]| {
        let lane = |(id, before, next, widths): &(i32, Option<i32>, Option<i32>, &str)| {
            let before = before.map(|id| format!("<predecessor id=\"{id}\"/>")).unwrap_or_default();
            let next = next.map(|id| format!("<successor id=\"{id}\"/>")).unwrap_or_default();
            format!("<lane id=\"{id}\" type=\"driving\" level=\"false\"><link>{before}{next}</link>{widths}</lane>")
        };
        let lanes: String = lanes.iter().map(lane).collect();
        let centre = "<center><lane id=\"0\" type=\"none\" level=\"false\"/></center>";
        format!("<laneSection s=\"{s_m}\">{centre}<right>{lanes}</right></laneSection>")
    };
    // 3.5 m over 60 m, without a kink.
    let rises = "a=\"0\" c=\"2.9166666666666666e-3\" d=\"-3.2407407407407406e-5\"";
    let falls = "a=\"3.5\" c=\"-2.9166666666666666e-3\" d=\"3.2407407407407406e-5\"";
    let offset = |s_m: u32, polynomial: &str| format!("<laneOffset s=\"{s_m}\" {polynomial}/>");
    let offsets = [
        offset(0, "a=\"0\""),
        offset(300, rises),
        offset(360, "a=\"3.5\""),
        offset(900, falls),
        offset(960, "a=\"0\""),
    ];
    let sections = [
        section(0, &[(-1, None, Some(-2), &full), (-2, None, Some(-3), &full)]),
        section(
            300,
            &[(-1, None, Some(-1), &width(rises)), (-2, Some(-1), Some(-2), &full), (-3, Some(-2), Some(-3), &full)],
        ),
        section(
            360,
            &[(-1, Some(-1), Some(-1), &full), (-2, Some(-2), Some(-2), &full), (-3, Some(-3), Some(-3), &full)],
        ),
        section(
            900,
            &[(-1, Some(-1), None, &width(falls)), (-2, Some(-2), Some(-1), &full), (-3, Some(-3), Some(-2), &full)],
        ),
        section(960, &[(-1, Some(-2), None, &full), (-2, Some(-3), None, &full)]),
    ];
    let (before, rest) = road.split_once("<lanes>").unwrap();
    let (_, behind) = rest.split_once("</lanes>").unwrap();
    format!("{before}<lanes>{}{}</lanes>{behind}", offsets.concat(), sections.concat())
}

#[test]
fn a_lane_that_begins_beside_the_reference_line_is_imported_and_the_vehicles_stay_in_their_lanes() {
    let folder = folder();
    let case = folder.path().join("case.xosc");
    fs::write(folder.path().join("road.xodr"), renumbered_road()).unwrap();
    fs::write(&case, include_str!("exchange/cut-in.xosc")).unwrap();
    let [output, trace] = ["scenario.toml", "trace.csv"].map(|name| folder.path().join(name));
    let [case, output, trace] = [&case, &output, &trace].map(|path| path.to_str().unwrap());
    // The other vehicle is far away.
    let said = stdout(&closecall(["tool", "import", case, "-o", output, "--parameter", "Gap=700"]), 0);
    assert!(said.contains("lanes whose width or place changes: lines follow them within 0.0"), "{said}");
    assert!(said.contains("lanes that get another number"), "{said}");
    let file = ScenarioFile::load(Path::new(output), &[]).unwrap();
    let scenario = file.concrete(&file.space().nominal()).unwrap();
    let road = &scenario.road;
    // The lanes of the ego do not move: the lane beside the reference line makes room to the left.
    let boundaries = |s_m: f64| [0, 1, 2, 3].map(|number| (road.full_boundary_m(number, s_m) * 1e6).round() / 1e6);
    assert_eq!([100.0, 1_500.0].map(boundaries), [[-3.5, -3.5, -7.0, -10.5]; 2]);
    assert_eq!(boundaries(600.0), [0.0, -3.5, -7.0, -10.5]);
    stdout(&closecall(["run", output, "--sensors", "ground-truth", "--set", "duration-s=30", "--trace", trace]), 0);
    let mut reader = csv::Reader::from_path(trace).unwrap();
    let headers = reader.headers().unwrap().clone();
    let column = |name: &str| headers.iter().position(|header| header == name).unwrap();
    let [actor, lane, s_m, d_m] = ["actor", "lane", "s_m", "d_m"].map(column);
    let mut farthest_m: f64 = 0.0;
    for row in reader.records().map(Result::unwrap).filter(|row| row[actor].eq_ignore_ascii_case("ego")) {
        let [s_m, d_m] = [s_m, d_m].map(|column| row[column].parse::<f64>().unwrap());
        assert_eq!(&row[lane], "2", "{s_m}");
        assert!((d_m - road.lane_centre_m(Lane(2), s_m)).abs() < 0.02, "{d_m} at {s_m}");
        farthest_m = farthest_m.max(s_m);
    }
    assert!(farthest_m > 400.0, "{farthest_m}");
}

#[test]
fn a_vehicle_in_a_lane_that_ends_comes_to_the_lane_beside_it() {
    // The ego starts in lane 2, which ends between 600 and 700 m.
    let ends = "road.cross-sections=[{s-m=600.0,widths-m=[3.75,3.75,3.75]},{s-m=700.0,widths-m=[3.75,0.0,3.75]}]";
    let mut last = None;
    let mut watch = Last(&mut last);
    run(&scenario(&[ends]), SensorMode::GroundTruth, &mut watch);
    let (ego_m, lanes, most_mps2) = last.unwrap();
    assert!(ego_m[0] > 730.0 && (ego_m[1] + 1.875).abs() < 1e-6, "{ego_m:?}");
    assert_eq!(lanes, [2, 1]);
    assert!((0.2..2.0).contains(&most_mps2), "{most_mps2}");
}

/// The position of the ego when it has come to the other lane (m), its lanes one after the other, and its largest lateral acceleration
/// (m/s²).
struct Last<'a>(&'a mut Option<([f64; 2], Vec<u8>, f64)>);

impl Observer for Last<'_> {
    fn step(&mut self, view: &StepView<'_>) {
        let ego = &view.vehicles[view.scenario.ego].state;
        let lane = view.scenario.road.lane_of(ego).0;
        let (position_m, lanes, most_mps2) = self.0.get_or_insert_default();
        if ego.s_m < 740.0 {
            *position_m = [ego.s_m, ego.d_m];
        }
        if lanes.last() != Some(&lane) {
            lanes.push(lane);
        }
        *most_mps2 = most_mps2.max((ego.speed_mps * ego.yaw_rate_radps).abs());
    }

    fn event(&mut self, _: Time, _: &RunEvent) {}
}
