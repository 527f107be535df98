//! A road with lanes of their own widths: in the closed loop, in recordings, and in files of other
//! tools.

use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use closecall_recorded::trajectory_data;
use closecall_scenarios::ScenarioFile;
use closecall_sensors::SensorMode;
use closecall_simulation::controller::BuiltIn;
use closecall_simulation::{Arm, Observer, RunEvent, RunKey, StepView, simulate};
use closecall_traffic::{Lane, Source, Time, Track};

use crate::support::{ROOT, closecall, code, folder, json, library, message, stdout};

/// The ego drives in the lane of 3.25 m, and is overtaken in the lane of 4 m.
const WIDTHS: &str = "road.lane-width-m=[4.0,3.25,3.5]";
const EDGES_M: [f64; 3] = [-4.0, -7.25, -10.75];
const PASSING_CENTRE_M: f64 = -2.0;
const OWN_CENTRE_M: f64 = -5.625;

/// Runs the program with these words, the widths, and a path.
fn with_widths(words: &str, path: &Path) -> std::process::Output {
    let words = words.split_whitespace().map(OsString::from);
    closecall(words.chain([path.as_os_str().to_owned(), "--set".into(), WIDTHS.into()]))
}

/// A row of a trace: time (s), lane and lateral position (m).
type Row = (f64, u8, f64);

/// Returns the rows of an actor in a trace.
fn rows(trace: &Path, actor: &str) -> Vec<Row> {
    let mut reader = csv::Reader::from_path(trace).unwrap();
    let headers = reader.headers().unwrap().clone();
    let column = |name: &str| headers.iter().position(|header| header == name).unwrap();
    let [time, who, lane, d] = ["time_s", "actor", "lane", "d_m"].map(column);
    let rows = reader.records().map(Result::unwrap).filter(|row| &row[who] == actor);
    rows.map(|row| (row[time].parse().unwrap(), row[lane].parse().unwrap(), row[d].parse().unwrap())).collect()
}

#[test]
fn a_vehicle_overtakes_on_the_centre_of_a_wider_lane_and_is_recorded() {
    let folder = folder();
    let [trace, recording] = ["trace.csv", "run.rrd"].map(|name| folder.path().join(name));
    let words = format!("run paper-figure --sensors full --format json --trace {} --record", trace.display());
    json(&with_widths(&words, &recording), 0);
    assert!(fs::metadata(&recording).unwrap().len() > 100_000);
    assert!(rows(&trace, "ego").iter().all(|(_, lane, d_m)| (*lane, *d_m) == (2, OWN_CENTRE_M)));
    let rear = rows(&trace, "rear");
    assert_eq!((rear[0].1, rear[0].2), (2, OWN_CENTRE_M));
    let crossed = rear.iter().position(|(_, lane, _)| *lane == 1).unwrap();
    assert!(rear[crossed - 1].2 <= EDGES_M[0] && rear[crossed].2 > EDGES_M[0], "{:?}", rear[crossed]);
    let passes = rear.iter().filter(|(_, _, d_m)| (d_m - PASSING_CENTRE_M).abs() < 1e-6).count();
    assert!(passes > 10, "{passes} rows on the centre of the passing lane");
    assert!(rear.iter().all(|(_, _, d_m)| *d_m < PASSING_CENTRE_M + 1e-6));
}

/// The steps in which the sensors see the rear vehicle, and the steps in which its track is in its
/// lane: in the passing lane, and in the lane of the ego.
#[derive(Default)]
struct SeenInLane {
    steps: [usize; 2],
    right: [usize; 2],
}

impl Observer for SeenInLane {
    fn step(&mut self, view: &StepView<'_>) {
        let road = &view.scenario.road;
        let [ego, _, rear] = view.vehicles else { unreachable!("the scenario has three vehicles") };
        let (behind_m, beside_m) = (ego.state.s_m - rear.state.s_m, rear.state.d_m - ego.state.d_m);
        let to_edge_m = (0..=3)
            .map(|number| (road.full_boundary_m(number, rear.state.s_m) - rear.state.d_m).abs())
            .fold(9.9, f64::min);
        if !(15.0..60.0).contains(&behind_m) || to_edge_m < 0.6 {
            return;
        }
        let lane = usize::from(road.lane_of(&rear.state).0) - 1;
        let is_rear = |track: &&Track| {
            let is_near = (track.x_m() + behind_m).abs() < 8.0 && (track.y_m() - beside_m).abs() < 1.5;
            track.source == Source::Rear && is_near
        };
        if let Some(track) = view.tracks.iter().find(is_rear) {
            self.steps[lane] += 1;
            self.right[lane] += usize::from(track.lane[lane] > 0.5);
        }
    }

    fn event(&mut self, _: Time, _: &RunEvent) {}
}

#[test]
fn the_sensors_see_a_vehicle_in_its_lane() {
    for sensors in [SensorMode::Full, SensorMode::Object] {
        let mut seen = SeenInLane::default();
        for lane in 1..=2 {
            let settings = [WIDTHS.to_owned(), format!("actor.rear.start.behind.lane={lane}")];
            let settings = settings.map(|setting| setting.parse().unwrap());
            let file = ScenarioFile::load(&library("paper-figure"), &settings).unwrap();
            let scenario = file.concrete(&file.space().nominal()).unwrap();
            let arm = Arm { controller: BuiltIn::Mis.factory(), sensors: Some(sensors) };
            simulate(&scenario, RunKey { seed: 0, sample: 0 }, &arm, &mut seen).unwrap();
        }
        for (steps, right) in seen.steps.into_iter().zip(seen.right) {
            assert!(steps > 20 && 20 * right >= 19 * steps, "{right} of {steps} steps in {sensors:?}");
        }
    }
}

#[test]
fn files_of_other_tools_have_the_widths_of_the_lanes() {
    let folder = folder();
    let case = folder.path().join("case");
    stdout(&with_widths("tool export paper-figure --sensors ground-truth -o", &case), 0);
    let road = fs::read_to_string(case.join("road.xodr")).unwrap();
    let widths: Vec<&str> = road
        .split("<width ")
        .skip(1)
        .map(|lane| lane.split("a=\"").nth(1).unwrap().split('"').next().unwrap())
        .collect();
    assert_eq!(widths, ["4", "3.25", "3.5"]);
    let mcap = folder.path().join("drive.mcap");
    stdout(&with_widths("run paper-figure --sensors ground-truth --osi", &mcap), 0);
    let commonroad = folder.path().join("commonroad");
    stdout(&with_widths("tool export paper-figure --sensors ground-truth --form commonroad -o", &commonroad), 0);
    for file in [mcap, commonroad.join("commonroad.xml")] {
        let data = trajectory_data::read(&file).unwrap();
        for (lane, edge_m) in (1..).zip(EDGES_M) {
            let read_m = data.markings.right_edge_m(Lane(lane)).unwrap();
            assert!((read_m - edge_m).abs() < 1e-6, "{}: lane {lane}: {read_m}", file.display());
        }
    }
    let Some(python) = closecall_testing::python_with_exchange() else { return };
    let script = PathBuf::from(ROOT).join("tests/integration/exchange/quality.py");
    let said = stdout(&Command::new(python).arg(script).arg(&case).output().unwrap(), 0);
    assert!(said.ends_with(", 0 issues\n"), "{said}");
}

#[test]
fn an_exported_road_comes_back_with_the_widths_of_its_lanes() {
    let folder = folder();
    let case = folder.path().join("case");
    stdout(&with_widths("tool export paper-figure --sensors ground-truth --form closed-loop -o", &case), 0);
    let output = folder.path().join("scenario.toml");
    let import = ["tool", "import", case.join("closed-loop.xosc").to_str().unwrap(), "-o", output.to_str().unwrap()]
        .map(str::to_owned);
    let said = stdout(&closecall(import), 0);
    assert!(!said.contains("width") && !said.contains("between its lanes"), "{said}");
    let text = fs::read_to_string(&output).unwrap();
    let scenario: toml::Table = toml::from_str(&text).unwrap();
    let widths: Vec<f64> =
        scenario["road"]["lane-width-m"].as_array().unwrap().iter().map(|width| width.as_float().unwrap()).collect();
    assert_eq!(widths, [4.0, 3.25, 3.5]);
    let lanes: Vec<Option<i64>> = scenario["actor"]
        .as_array()
        .unwrap()
        .iter()
        .map(|actor| actor["start"]["absolute"]["lane"].as_integer())
        .collect();
    assert_eq!(lanes, [Some(2); 3]);
    // The imported scenario, exported again, has the same road.
    let again = folder.path().join("again");
    let words =
        ["tool", "export", output.to_str().unwrap(), "--sensors", "ground-truth", "--form", "closed-loop", "-o"];
    stdout(&closecall([&words[..], &[again.to_str().unwrap()]].concat()), 0);
    let lanes = |case: &Path| {
        let road = fs::read_to_string(case.join("road.xodr")).unwrap();
        road.split_once("<lanes>").unwrap().1.to_owned()
    };
    assert_eq!(lanes(&again), lanes(&case));
}

#[test]
fn a_campaign_on_such_a_road_has_no_errors_and_is_the_same_in_the_mirror() {
    // The validity checks of a campaign run mirrored and reversed scenarios, too.
    let words =
        ["campaign", "low-thw-overtake", "--paired", "-n", "12", "--sensors", "object", "--no-gate", "--set", WIDTHS];
    let report = json(&closecall(words.iter().chain(&["--format", "json"])), 0);
    assert_eq!(report["errors"], 0);
    assert!(report["verdict"] != "INVALID", "{}", report["reasons"]);
}

#[test]
fn widths_are_set_together_or_one_by_one_and_wrong_ones_are_refused_by_their_key() {
    let check = |settings: &[&str]| {
        let words = settings.iter().flat_map(|setting| ["--set", setting]);
        closecall(["check", "paper-figure"].into_iter().chain(words))
    };
    for settings in [
        &["road.lane-width-m=3.5"][..],
        &["road.lane-width-m=[3.5,3.25,3.75]"],
        &["road.lane-width-m=[3.5,3.25,3.75]", "road.lane-width-m.1=3.0"],
        &["road.lane-width-m=[3.5,3.25,3.75]", "road.lane-width-m[2]=3.0"],
        &["road.lanes=2", "road.lane-width-m=[3.5,3.25]"],
    ] {
        stdout(&check(settings), 0);
    }
    for (settings, words) in [
        (&["road.lane-width-m=[3.5,3.25]"][..], "`road.lane-width-m` contradicts `lanes`: it has 2 widths"),
        (&[WIDTHS, "road.lanes=4"], "it has 3 widths and the road has 4 lanes"),
        (&["road.lane-width-m=[3.5,0,3.5]"], "`road.lane-width-m[1]` is 0, but a number from 2.5 to 5 is needed"),
        (&["road.lane-width-m=[3.5,-1.5,3.5]"], "`road.lane-width-m[1]` is -1.5, but a number from 2.5 to 5"),
        (&["road.lane-width-m=[3.5,3.5,12]"], "`road.lane-width-m[2]` is 12, but a number from 2.5 to 5 is needed"),
        (&["road.lane-width-m=wide"], "`wide` is neither a number nor a parameter"),
        (
            &["road.lane-width-m=true"],
            "a number, a parameter such as \"$name\", or a list with one of them for each lane",
        ),
        (&["road.lane-width-m.1=3.5"], "`road.lane-width-m.1` leads nowhere"),
        (&[WIDTHS, "road.lane-width-m.3=3.5"], "the list `lane-width-m` has the elements 0 to 2"),
        (
            &["road.lane-width-m=[3.5,2.5,3.5]", "actor.rear.vehicle.class=truck"],
            "the vehicle is 2.55 m wide, and lane 2, in which it starts, is 2.5 m wide",
        ),
    ] {
        let refused = check(settings);
        assert!(code(&refused) == 3 || code(&refused) == 2, "{settings:?}: {}", message(&refused));
        assert!(message(&refused).contains(words), "{settings:?}: {}", message(&refused));
    }
}
