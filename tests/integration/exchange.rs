//! Cases in the formats of other tools.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use closecall_scenarios::library::LIBRARY;
use closecall_traffic::{Road, maths};

use crate::support::{ROOT, closecall, code, message, stdout};

/// Distance within which the positions of a file agree with the trace (m).
const TOLERANCE_M: f64 = 0.01;

/// Runs the program with these words and the path of an output.
fn run(words: &str, output: &Path) -> Output {
    let words = words.split_whitespace().map(Into::into).chain([output.as_os_str().to_owned()]);
    closecall(words.collect::<Vec<_>>())
}

/// Exports a sample, and returns the texts of the files by their names.
fn exported(words: &str, folder: &Path) -> BTreeMap<String, String> {
    stdout(&run(&format!("tool export {words} -o"), folder), 0);
    let files = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).filter(|path| path.is_file());
    let texts = files.map(|path| {
        (path.file_name().unwrap().to_string_lossy().into_owned(), fs::read_to_string(&path).unwrap())
    });
    texts.collect()
}

/// Returns the value of an attribute of the first element that begins at or behind the start of the text.
fn attribute<'a>(text: &'a str, name: &str) -> &'a str {
    let (_, rest) = text.split_once(&format!(" {name}=\"")).unwrap_or_else(|| panic!("{name}: {text:.200}"));
    rest.split('"').next().unwrap()
}

fn number(text: &str, name: &str) -> f64 {
    attribute(text, name).parse().unwrap()
}

/// Returns the parts of a text that begin behind each occurrence of `start`.
fn parts<'a>(text: &'a str, start: &str) -> Vec<&'a str> {
    text.split(start).skip(1).collect()
}

#[test]
fn the_open_loop_form_has_the_positions_of_the_trace() {
    let folder = tempfile::tempdir().unwrap();
    for (index, curvature) in [0.0, 0.002].into_iter().enumerate() {
        let words = format!("paper-figure 0 --sensors object --set road.curvature-per-m={curvature}");
        let files = exported(&words, &folder.path().join(index.to_string()));
        let trace = folder.path().join("trace.csv");
        let run_words = "run paper-figure --sample 0 --sensors object --set road.curvature-per-m";
        stdout(&run(&format!("{run_words}={curvature} --trace"), &trace), 0);
        let road = Road::straight(3).with_curvature(curvature);
        let catalog = folder.path().join(index.to_string()).join("catalogs/vehicles/VehicleCatalog.xosc");
        let catalog = fs::read_to_string(catalog).unwrap();
        let ahead_m: BTreeMap<_, _> = parts(&catalog, "<Vehicle ")
            .into_iter()
            .map(|vehicle| {
                let centre = vehicle.split_once("<Center").unwrap().1;
                (vehicle.split('"').nth(1).unwrap().to_owned(), number(centre, "x"))
            })
            .collect();
        let mut positions = BTreeMap::new();
        for trajectory in parts(&files["open-loop.xosc"], "<Trajectory ") {
            let name = trajectory.split('"').nth(1).unwrap().strip_suffix("-trajectory").unwrap();
            for vertex in parts(trajectory, "<Vertex") {
                let [x, y, h] = ["x", "y", "h"].map(|key| number(vertex, key));
                let (sin, cos) = maths::sin_cos(h);
                let centre = road.road_position_m(x + ahead_m[name] * cos, y + ahead_m[name] * sin);
                positions.insert((name.to_owned(), (number(vertex, "time") * 1e3).round() as i64), centre);
            }
        }
        let mut rows = 0;
        let mut reader = csv::Reader::from_path(&trace).unwrap();
        let headers = reader.headers().unwrap().clone();
        let column = |name: &str| headers.iter().position(|header| header == name).unwrap();
        let [time, actor, s, d] = ["time_s", "actor", "s_m", "d_m"].map(column);
        for row in reader.records() {
            let row = row.unwrap();
            let value = |column: usize| row[column].parse::<f64>().unwrap();
            let (s_m, d_m) = positions[&(row[actor].to_owned(), (value(time) * 1e3).round() as i64)];
            assert!((s_m - value(s)).abs() < TOLERANCE_M, "{row:?}: {s_m}");
            assert!((d_m - value(d)).abs() < TOLERANCE_M, "{row:?}: {d_m}");
            rows += 1;
        }
        assert!(rows > 1_000, "{rows}");
        assert_eq!(rows, positions.len());
    }
}

#[test]
fn a_case_lists_what_it_cannot_say_in_its_header_and_on_the_terminal() {
    let folder = tempfile::tempdir().unwrap();
    let said = stdout(&run("tool export rear-follower-stays --form closed-loop -o", folder.path()), 0);
    let text = fs::read_to_string(folder.path().join("closed-loop.xosc")).unwrap();
    for what in ["rear: the state of Wiedemann 99", "paint, registration plates", "front: its weaving"] {
        assert!(said.contains(what), "{said}");
        assert!(text.contains(what), "{what}");
    }
    assert!(attribute(&text, "description").ends_with("closed loop"));
    assert!(!folder.path().join("open-loop.xosc").exists());
}

#[test]
fn the_closed_loop_has_the_manoeuvres_with_their_triggers_and_names_the_controller() {
    let folder = tempfile::tempdir().unwrap();
    let text = &exported("paper-figure --controller acc --form closed-loop", folder.path())["closed-loop.xosc"];
    assert!(text.contains("<Controller name=\"acc\">"), "{text}");
    // The ego has no manoeuvre of its own.
    assert!(!text.contains("ego-group"));
    let brakes = text.split_once("<Event name=\"front-brakes\"").unwrap().1;
    assert_eq!(number(brakes.split_once("<SpeedActionDynamics").unwrap().1, "value"), 6.0);
    assert_eq!(number(brakes.split_once("<SimulationTimeCondition").unwrap().1, "value"), 12.0);
    let changes = text.split_once("<Event name=\"rear-changes-lanes\"").unwrap().1;
    assert_eq!(attribute(changes.split_once("<AbsoluteTargetLane").unwrap().1, "value"), "-1");
    // The marking is crossed after half of 6.8 s, in which the headway falls by closing × time / speed.
    let closing_mps = 20.0 / 3.0;
    let expected_s = 0.2 + closing_mps * 3.4 / (30.0 + closing_mps);
    let begins_s = number(changes.split_once("<TimeHeadwayCondition").unwrap().1, "value");
    assert!((begins_s - expected_s).abs() < 1e-9, "{begins_s} {expected_s}");
}

#[test]
fn the_value_set_has_the_parameters_of_the_samples() {
    let folder = tempfile::tempdir().unwrap();
    let words = "low-thw-overtake 5 --seed 7 --form logical --value-sets 3";
    let files = exported(words, folder.path());
    let sets = parts(&files["logical-values.xosc"], "<ParameterValueSet>");
    assert_eq!(sets.len(), 3);
    for (set, sample) in sets.into_iter().zip(5..) {
        let words = ["run", "low-thw-overtake", "--seed", "7", "--sensors", "ground-truth", "--format", "json"];
        let sample = format!("--sample={sample}");
        let outcome = stdout(&closecall(words.into_iter().chain([sample.as_str()])), 0);
        let outcome: serde_json::Value = serde_json::from_str(&outcome).unwrap();
        let parameters = outcome["parameters"].as_object().unwrap();
        assert_eq!(parts(set, "<ParameterAssignment").len(), parameters.len());
        for assignment in parts(set, "<ParameterAssignment") {
            let expected = &parameters[&attribute(assignment, "parameterRef").replace('_', "-")];
            let value = attribute(assignment, "value");
            match expected.as_f64() {
                Some(number) => assert_eq!(value.parse::<f64>().unwrap(), number),
                None => assert_eq!(expected, value),
            }
        }
    }
    // Each parameter is declared, and has a distribution.
    let declared = parts(&files["logical.xosc"], "<ParameterDeclaration ").len();
    assert_eq!(declared, parts(&files["logical-distributions.xosc"], "<StochasticDistribution ").len());
    let log_normal = files["logical-distributions.xosc"].split_once("parameterName=\"cut_out_thw_s\"").unwrap().1;
    let [mean, variance] = ["expectedValue", "variance"].map(|name| number(log_normal, name));
    let sigma_squared = maths::ln(1.0 + variance / (mean * mean));
    assert!((sigma_squared.sqrt() - 0.58).abs() < 1e-12);
    assert!((mean / (1.0 + variance / (mean * mean)).sqrt() - 0.758).abs() < 1e-12);
}

#[test]
fn a_scenario_without_parameters_has_no_values_and_no_distributions() {
    let folder = tempfile::tempdir().unwrap();
    let files = exported("paper-figure --form logical", folder.path());
    let names: Vec<_> = files.keys().map(String::as_str).collect();
    assert_eq!(names, ["logical.xosc", "road.xodr"]);
    assert!(!files["logical.xosc"].contains("ParameterDeclaration"));
}

#[test]
fn options_that_belong_to_the_other_kind_of_source_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("case");
    let output = run("tool export paper-figure --arm acc -o", &out);
    assert_eq!(code(&output), 2);
    assert!(message(&output).contains("belong to a campaign"), "{}", message(&output));
    let output = run("tool export no-such-scenario -o", &out);
    assert_ne!(code(&output), 0);
    assert!(!out.exists());
}

#[test]
fn a_sample_of_a_campaign_is_exported_with_its_seed() {
    let folder = tempfile::tempdir().unwrap();
    let campaign = folder.path().join("campaign");
    let words = "campaign paper-figure -n 2 --seed 9 --sensors ground-truth --no-gate --out";
    code(&run(words, &campaign));
    let case = folder.path().join("case");
    let output = closecall([
        "tool".as_ref(),
        "export".as_ref(),
        campaign.as_os_str(),
        "1".as_ref(),
        "-o".as_ref(),
        case.as_os_str(),
    ]);
    stdout(&output, 0);
    let text = fs::read_to_string(case.join("open-loop.xosc")).unwrap();
    assert!(attribute(&text, "description").contains("sample 1 of seed 9"), "{text:.400}");
    let output = closecall(["tool".as_ref(), "export".as_ref(), campaign.as_os_str(), "7".as_ref(), "-o".as_ref(), case.as_os_str()]);
    assert_eq!(code(&output), 2);
}

/// Runs the quality checkers of ASAM on the files below these folders.
fn quality(python: &Path, folder: &Path) -> String {
    let script = PathBuf::from(ROOT).join("tests/integration/exchange/quality.py");
    let output = Command::new(python).arg(script).arg(folder).output().unwrap();
    stdout(&output, 0)
}

#[test]
fn the_quality_checkers_find_no_issue_in_any_scenario_of_the_library() {
    let Some(python) = closecall_testing::python_with_exchange() else { return };
    let folder = tempfile::tempdir().unwrap();
    for scenario in LIBRARY {
        stdout(&run(&format!("tool export {} --sensors ground-truth -o", scenario.name), &folder.path().join(scenario.name.replace('/', "-"))), 0);
    }
    let said = quality(&python, folder.path());
    assert!(said.ends_with(", 0 issues\n"), "{said}");
    let files: usize = said.lines().last().unwrap().split(' ').next().unwrap().parse().unwrap();
    assert!(files > 5 * LIBRARY.len(), "{said}");
}

#[test]
fn the_quality_checkers_find_what_is_wrong() {
    let Some(python) = closecall_testing::python_with_exchange() else { return };
    let folder = tempfile::tempdir().unwrap();
    let files = exported("paper-figure --form closed-loop", folder.path());
    let path = folder.path().join("closed-loop.xosc");
    for (right, wrong) in [("frictionScaleFactor=", "friction="), ("entityRef=\"front\"", "entityRef=\"nobody\"")] {
        fs::write(&path, files["closed-loop.xosc"].replace(right, wrong)).unwrap();
        let said = quality(&python, folder.path());
        assert!(!said.ends_with(", 0 issues\n"), "{wrong}: {said}");
    }
}
