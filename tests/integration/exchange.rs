//! Cases in the formats of other tools.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use closecall_scenarios::library;
use closecall_traffic::{Alignment, AlignmentPoint, Road, maths};

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
    let texts = files
        .map(|path| (path.file_name().unwrap().to_string_lossy().into_owned(), fs::read_to_string(&path).unwrap()));
    texts.collect()
}

/// Returns the value of an attribute of the first element that begins at or behind the start of the
/// text.
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
    let points = [[-100.0, 0.0], [100.0, 0.001], [300.0, 0.001], [500.0, -0.001], [700.0, -0.001], [700.0, 0.0]];
    let points = points.map(|[s_m, curvature_per_m]| AlignmentPoint { s_m, curvature_per_m });
    let written = points
        .map(|AlignmentPoint { s_m, curvature_per_m }| format!("{{s-m={s_m:?},curvature-per-m={curvature_per_m:?}}}"));
    let straight = Road::straight(3);
    let roads = [
        ("curvature-per-m=0.0".to_owned(), straight.clone()),
        ("curvature-per-m=0.002".to_owned(), straight.with_curvature(0.002)),
        (format!("alignment=[{}]", written.join(",")), straight.with_alignment(Alignment::new(&points).unwrap())),
    ];
    for (index, (key, road)) in roads.into_iter().enumerate() {
        let words = format!("paper-figure 0 --sensors object --set road.{key}");
        let files = exported(&words, &folder.path().join(index.to_string()));
        let trace = folder.path().join("trace.csv");
        let run_words = "run paper-figure --sample 0 --sensors object --set road";
        stdout(&run(&format!("{run_words}.{key} --trace"), &trace), 0);
        // The file has the pieces of the course that vehicles use.
        assert_eq!(files["road.xodr"].matches("<spiral").count(), if index == 2 { 2 } else { 0 });
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
                let centre = road.road_position_m(x + ahead_m[name] * cos, y + ahead_m[name] * sin, 0.0);
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
    for statement in ["rear: the state of Wiedemann 99", "paint, registration plates", "front: its weaving"] {
        assert!(said.contains(statement), "{said}");
        assert!(text.contains(statement), "{statement}");
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
    // The marking is crossed after half of 6.8 s, in which the headway falls by closing × time /
    // speed.
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
fn a_folder_with_a_form_that_an_export_does_not_renew_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let words = "paper-figure --sensors ground-truth --form";
    let both = exported(&format!("{words} open-loop,closed-loop"), folder.path());
    for form in ["closed-loop", "commonroad"] {
        let output = run(&format!("tool export {words} {form} -o"), folder.path());
        assert_eq!(code(&output), 2, "{form}: {}", message(&output));
        assert!(message(&output).contains("open-loop.xosc is of an earlier export"), "{}", message(&output));
    }
    let again = exported(&format!("{words} open-loop,closed-loop"), folder.path());
    assert_eq!(again, both, "the same forms may be written again");
}

#[test]
fn options_that_belong_to_the_other_kind_of_source_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("case");
    for wrong in ["paper-figure --form closed-loop --value-sets 3", "paper-figure --form commonroad --value-sets 2"] {
        let output = run(&format!("tool export {wrong} -o"), &out);
        assert_eq!(code(&output), 2, "{wrong}: {}", message(&output));
        assert!(message(&output).contains("--value-sets is of the logical form"), "{wrong}: {}", message(&output));
    }
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
    let words = "campaign low-thw-overtake -n 2 --seed 9 --sensors ground-truth --no-gate --out";
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
    let output = closecall([
        "tool".as_ref(),
        "export".as_ref(),
        campaign.as_os_str(),
        "7".as_ref(),
        "-o".as_ref(),
        case.as_os_str(),
    ]);
    assert_eq!(code(&output), 2);
}

#[test]
fn a_vehicle_on_a_ramp_leaves_its_lane_before_the_end_in_the_closed_loop() {
    let folder = tempfile::tempdir().unwrap();
    let case = folder.path().join("case");
    let said = stdout(&run("tool export ramp-merges 3 --seed 5 --form closed-loop,logical -o", &case), 0);
    assert!(said.contains("ramp: the gap that it accepts, and its acceleration"), "{said}");
    // The import refuses a vehicle that drives where its lane has ended.
    let logical = fs::read_to_string(case.join("logical.xosc")).unwrap();
    let (before, rest) = logical.split_once("<CustomContent>").unwrap();
    let (_, behind) = rest.split_once("</CustomContent>").unwrap();
    fs::write(case.join("elements.xosc"), format!("{before}{behind}")).unwrap();
    let times = ["closed-loop.xosc", "elements.xosc"].map(|name| {
        let words = format!("tool import {} -o", case.join(name).display());
        let said = stdout(&run(&words, &folder.path().join("scenario.toml")), 0);
        let text = fs::read_to_string(folder.path().join("scenario.toml")).unwrap();
        assert!(text.contains("id = \"ramp\"") && text.contains("acceleration-lane"), "{text}");
        let line = said.lines().find(|line| line.ends_with("ramp-changes-lanes begins")).unwrap();
        line.split_whitespace().next().unwrap().to_owned()
    });
    assert_eq!(times[0], times[1]);
}

#[test]
fn a_vehicle_with_the_name_of_a_class_has_an_entry_of_its_own() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scenario.toml");
    let text = fs::read_to_string(PathBuf::from(ROOT).join("scenarios/library/low-thw-overtake.toml")).unwrap();
    fs::write(&path, text.replace("\"rear\"", "\"car\"")).unwrap();
    let case = folder.path().join("case");
    let files = exported(&format!("{} --sensors ground-truth", path.display()), &case);
    let catalog = fs::read_to_string(case.join("catalogs/vehicles/VehicleCatalog.xosc")).unwrap();
    let mut names: Vec<&str> =
        parts(&catalog, "<Vehicle ").iter().map(|entry| entry.split('"').nth(1).unwrap()).collect();
    names.sort_unstable();
    assert_eq!(names, ["car", "car-itself", "ego", "front", "motorcycle", "truck"]);
    for (file, entry) in [("open-loop", "car-itself"), ("closed-loop", "car-itself"), ("logical", "$rear_class")] {
        let (_, vehicle) = files[&format!("{file}.xosc")].split_once("<ScenarioObject name=\"car\">").unwrap();
        assert_eq!(attribute(vehicle, "entryName"), entry, "{file}");
    }
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
    let names: Vec<_> = library::names().collect();
    for name in &names {
        let case = folder.path().join(name.replace('/', "-"));
        // The checkers need their time for the points of the open loop: a short one has all elements.
        stdout(&run(&format!("tool export {name} --sensors ground-truth --set duration-s=15 -o"), &case), 0);
    }
    // A line, a spiral, an arc, and a spiral through an inflection.
    let course = "[{s-m=0.0,curvature-per-m=0.0},{s-m=200.0,curvature-per-m=0.002},\
                  {s-m=400.0,curvature-per-m=0.002},{s-m=700.0,curvature-per-m=-0.001}]";
    let words = format!("tool export paper-figure --sensors ground-truth --set road.alignment={course} -o");
    stdout(&run(&words, &folder.path().join("alignment")), 0);
    let said = quality(&python, folder.path());
    assert!(said.ends_with(", 0 issues\n"), "{said}");
    let files: usize = said.lines().last().unwrap().split(' ').next().unwrap().parse().unwrap();
    assert!(files > 5 * names.len(), "{said}");
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
    // A wrong road behind a right one.
    fs::write(&path, &files["closed-loop.xosc"]).unwrap();
    assert!(quality(&python, folder.path()).ends_with(", 0 issues\n"));
    fs::write(folder.path().join("wrong.xodr"), files["road.xodr"].replace("rule=\"RHT\"", "rule=\"right\"")).unwrap();
    let said = quality(&python, folder.path());
    assert!(said.contains("wrong.xodr: check_asam_xodr_xml_valid_schema"), "{said}");
}

/// Runs the readers of OSI on these files, and returns their results.
fn read_osi(python: &Path, files: &[PathBuf]) -> serde_json::Value {
    let script = PathBuf::from(ROOT).join("tests/integration/exchange/osi.py");
    let output = Command::new(python).arg(script).args(files).output().unwrap();
    serde_json::from_str(&stdout(&output, 0)).unwrap()
}

/// Returns the traces in a folder: `GroundTruth` first.
fn traces(folder: &Path) -> Vec<PathBuf> {
    let files = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut traces: Vec<_> = files.filter(|path| path.extension().is_some_and(|end| end == "osi")).collect();
    traces.sort();
    traces
}

#[test]
fn osi_traces_have_the_names_of_the_standard_and_other_endings_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    stdout(&run("run paper-figure --sensors ground-truth --osi", &folder.path().join("drive.osi")), 0);
    let names: Vec<_> =
        traces(folder.path()).iter().map(|path| path.file_name().unwrap().to_string_lossy().into_owned()).collect();
    assert_eq!(names.len(), 2);
    for (name, kind) in names.iter().zip(["gt", "sd"]) {
        let parts: Vec<_> = name.split('_').collect();
        assert!(parts[0].ends_with('Z') && parts[0].len() == 16, "{name}");
        assert_eq!([parts[1], parts[2], parts[3], parts[5]], [kind, "380", "0", "drive.osi"]);
        let messages: usize = parts[4].parse().unwrap();
        assert!(messages > 100, "{name}");
    }
    let output = run("run paper-figure --sensors ground-truth --osi", &folder.path().join("drive.txt"));
    assert_eq!(code(&output), 2);
    assert!(message(&output).contains("must end with `.osi` or `.mcap`"), "{}", message(&output));
}

#[test]
fn other_programs_read_the_osi_messages_of_a_run() {
    let Some(python) = closecall_testing::python_with_exchange() else { return };
    let folder = tempfile::tempdir().unwrap();
    let [mcap, osi, trace] = ["drive.mcap", "drive.osi", "trace.csv"].map(|name| folder.path().join(name));
    let words = "run low-thw-overtake --sample 3 --sensors object";
    stdout(&run(&format!("{words} --osi"), &mcap), 0);
    stdout(&run(&format!("{words} --trace"), &trace), 0);
    stdout(&run(&format!("{words} --osi"), &osi), 0);
    let summary = read_osi(&python, &[vec![mcap], traces(folder.path())].concat());
    let (truth, tracks) = (&summary["traces"]["gt"], &summary["traces"]["sd"]);
    let messages = &truth["messages"];
    assert_eq!(summary["objects"], 3);
    assert_eq!(summary["host"], 1);
    for count in [&summary["instants"], &tracks["messages"], &truth["betterosi"], &truth["named"], &tracks["betterosi"]]
    {
        assert_eq!(count, messages);
    }
    for topic in ["ground_truth", "sensor_data", "ground_truth_map"] {
        assert_eq!(summary["channels"][topic]["unknown"], 0, "{summary}");
    }
    assert_eq!(summary["channels"]["sensor_data"]["messages"], *messages);
    assert_eq!(summary["channels"]["ground_truth_map"]["messages"], 1);
    for trace in [truth, tracks] {
        assert_eq!(trace["unknown"], 0);
        assert_eq!(trace["version"], serde_json::json!([3, 8, 0]));
    }
    assert_eq!(truth["boundaries"], 4);
    let lanes: Vec<u64> = truth["lanes"].as_array().unwrap().iter().map(|lanes| lanes.as_u64().unwrap()).collect();
    assert_eq!((lanes[0], lanes[1..].iter().max()), (3, Some(&0)));
    assert!(tracks["tracks"].as_u64().unwrap() > 100 && tracks["rmse"].as_f64().unwrap() > 0.0);
    // The positions equal the positions of the trace.
    let mut reader = csv::Reader::from_path(&trace).unwrap();
    let rows: Vec<_> = reader.records().map(Result::unwrap).collect();
    let centres = truth["centres"].as_array().unwrap();
    assert_eq!(rows.len(), 3 * centres.len());
    for (message, rows) in centres.iter().zip(rows.chunks(3)) {
        for (object, row) in message[1].as_array().unwrap().iter().zip(rows) {
            let near = |index: usize, column: usize| {
                let difference = object[index].as_f64().unwrap() - row[column].parse::<f64>().unwrap();
                assert!(difference.abs() < 1e-9, "{row:?} {object}");
            };
            // On a straight road, x is s and y is d.
            near(0, 3);
            near(1, 4);
        }
    }
}

#[test]
fn a_run_as_osi_is_read_back_with_the_lane_changes_of_its_trajectory_data() {
    let folder = tempfile::tempdir().unwrap();
    let [mcap, osi, csv] = ["drive.mcap", "drive.osi", "drive.csv"].map(|name| folder.path().join(name));
    let scenario = "paper-figure --sensors ground-truth";
    stdout(&run(&format!("run {scenario} --osi"), &mcap), 0);
    stdout(&run(&format!("run {scenario} --osi"), &osi), 0);
    stdout(&run(&format!("traffic record {scenario} -n 1 -o"), &csv), 0);
    let changes = |path: &Path| -> serde_json::Value {
        serde_json::from_str(&stdout(&run("traffic lane-changes --format json", path), 0)).unwrap()
    };
    let (of_csv, of_mcap) = (changes(&csv), changes(&mcap));
    // The rear vehicle is the third actor.
    let [change] = &of_mcap.as_array().unwrap()[..] else { panic!("{of_mcap}") };
    let expected = &of_csv[0];
    for key in ["direction", "from_lane", "to_lane", "complete"] {
        assert_eq!(change[key], expected[key], "{key}");
    }
    for (key, tolerance) in [("crossing_s", 0.1), ("duration_s", 0.2), ("speed_mps", 0.1), ("lateral_shift_m", 0.05)] {
        let difference = change[key].as_f64().unwrap() - expected[key].as_f64().unwrap();
        assert!(difference.abs() <= tolerance, "{key}: {change} {expected}");
    }
    let [truth, tracks] = &traces(folder.path())[..] else { panic!() };
    assert_eq!(changes(truth), of_mcap);
    let output = run("traffic lane-changes", tracks);
    assert_eq!(code(&output), 3);
    assert!(message(&output).contains("no GroundTruth"), "{}", message(&output));
}

#[test]
fn the_lanes_are_in_each_message_on_request() {
    let Some(python) = closecall_testing::python_with_exchange() else { return };
    let folder = tempfile::tempdir().unwrap();
    let mcap = folder.path().join("drive.mcap");
    stdout(&run("run empty-wet-road --sensors ground-truth --set duration-s=2 --osi", &mcap), 0);
    stdout(
        &run(
            "run empty-wet-road --sensors ground-truth --set duration-s=2 --osi-lanes --osi",
            &folder.path().join("a.osi"),
        ),
        0,
    );
    let summary = read_osi(&python, &[vec![mcap], traces(folder.path())].concat());
    let lanes = summary["traces"]["gt"]["lanes"].as_array().unwrap();
    assert!(lanes.len() > 10 && lanes.iter().all(|count| count == &lanes[0] && count.as_u64() > Some(0)), "{summary}");
}

#[test]
fn a_sample_as_commonroad_is_read_back_with_the_positions_of_the_trace() {
    let folder = tempfile::tempdir().unwrap();
    let trace = folder.path().join("trace.csv");
    let case = folder.path().join("case");
    let files = exported("paper-figure --sensors object --form commonroad", &case);
    assert_eq!(files.keys().map(String::as_str).collect::<Vec<_>>(), ["commonroad.xml"]);
    stdout(&run("run paper-figure --sensors object --trace", &trace), 0);
    let data = closecall_recorded::trajectory_data::read(&case.join("commonroad.xml")).unwrap();
    // The ego is the vehicle of the planning problem.
    assert_eq!(data.trajectories.len(), 2);
    let mut rows = 0;
    for row in csv::Reader::from_path(&trace).unwrap().records().map(Result::unwrap) {
        let number = match &row[1] {
            "front" => 1_001,
            "rear" => 1_002,
            _ => continue,
        };
        let vehicle = data.trajectories.iter().find(|trajectory| trajectory.vehicle_id == number).unwrap();
        let time_s: f64 = row[0].parse().unwrap();
        let point = vehicle.points.iter().find(|point| (point.time.s() - time_s).abs() < 1e-6).unwrap();
        // Positions along a road of the reader begin at the start of its lanelets.
        let s_m: f64 = row[3].parse().unwrap();
        let first_m: f64 = vehicle.points[0].s_m;
        let start_m = if number == 1_001 { 525.6 } else { 375.4 };
        assert!((point.s_m - first_m - (s_m - start_m)).abs() < TOLERANCE_M, "{row:?} {point:?}");
        assert!((point.d_m - row[4].parse::<f64>().unwrap()).abs() < TOLERANCE_M, "{row:?} {point:?}");
        rows += 1;
    }
    assert!(rows > 500, "{rows}");
}

#[test]
fn commonroad_io_reads_a_sample_with_its_planning_problem() {
    let Some(python) = closecall_testing::python_with_exchange() else { return };
    let folder = tempfile::tempdir().unwrap();
    exported("paper-figure --sensors object --form commonroad", folder.path());
    let script = PathBuf::from(ROOT).join("tests/integration/exchange/commonroad.py");
    let output = Command::new(python).arg(script).arg(folder.path().join("commonroad.xml")).output().unwrap();
    let summary: serde_json::Value = serde_json::from_str(stdout(&output, 0).lines().last().unwrap()).unwrap();
    assert_eq!((summary["step_s"].as_f64(), summary["lanelets"].as_u64()), (Some(0.04), Some(3)));
    assert_eq!(summary["start"], serde_json::json!([500.0, -5.625, 30.0]));
    assert_eq!(summary["on_lanelet"], serde_json::json!([2]));
    let ends: Vec<_> = ["1001", "1002"].map(|id| summary["obstacles"][id].as_u64().unwrap()).into();
    assert!(ends[0] > 250 && ends[0] == ends[1], "{summary}");
}

/// A follower and the vehicle ahead of it at one step of a trace.
struct Pair {
    step: usize,
    /// Numbers of the two in a CommonRoad file.
    obstacles: [usize; 2],
    gap_m: f64,
    thw_s: Option<f64>,
    speeds_mps: [f64; 2],
}

/// Returns the pairs of human drivers in each 20th step of a trace. The ego is its first actor.
fn pairs(trace: &Path) -> Vec<Pair> {
    fn number(row: &[&str], column: usize) -> f64 {
        row[column].parse().unwrap()
    }
    let text = fs::read_to_string(trace).unwrap();
    let rows: Vec<Vec<&str>> = text.lines().skip(1).map(|line| line.split(',').collect()).collect();
    let actors = rows.iter().take_while(|row| row[0] == rows[0][0]).count();
    let mut pairs = Vec::new();
    for (step, rows) in rows.chunks(actors).enumerate().step_by(20) {
        for (follower, row) in rows.iter().enumerate().skip(1).filter(|(_, row)| !row[7].is_empty()) {
            let is_ahead = |other: &Vec<&str>| other[2] == row[2] && number(other, 3) > number(row, 3);
            let ahead = rows.iter().enumerate().filter(|(_, other)| is_ahead(other));
            let (lead, _) = ahead.min_by(|(_, a), (_, b)| number(a, 3).total_cmp(&number(b, 3))).unwrap();
            if lead > 0 {
                pairs.push(Pair {
                    step,
                    obstacles: [1_000 + follower, 1_000 + lead],
                    gap_m: number(row, 7),
                    thw_s: row[8].parse().ok(),
                    speeds_mps: [number(row, 5), number(&rows[lead], 5)],
                });
            }
        }
    }
    pairs
}

#[test]
fn gap_time_headway_and_time_to_collision_are_those_of_crime() {
    const TOLERANCE: f64 = 1e-6;
    let Some(python) = closecall_testing::python_with_exchange() else { return };
    let folder = tempfile::tempdir().unwrap();
    let [trace, list, case] = ["trace.csv", "pairs.json", "case"].map(|name| folder.path().join(name));
    stdout(&run("run busy-overtake --sensors ground-truth --trace", &trace), 0);
    exported("busy-overtake --sensors ground-truth --form commonroad", &case);
    let pairs = pairs(&trace);
    let queries: Vec<_> = pairs.iter().map(|pair| [pair.step, pair.obstacles[0], pair.obstacles[1]]).collect();
    fs::write(&list, serde_json::to_string(&queries).unwrap()).unwrap();
    let script = PathBuf::from(ROOT).join("tests/integration/exchange/criticality.py");
    let output = Command::new(python).arg(script).arg(case.join("commonroad.xml")).arg(list).output().unwrap();
    let computed: serde_json::Value = serde_json::from_str(stdout(&output, 0).lines().last().unwrap()).unwrap();
    let step_s = computed["step_s"].as_f64().unwrap();
    let results = computed["results"].as_array().unwrap();
    assert_eq!(results.len(), pairs.len());
    let (mut headways, mut collisions) = (0, 0);
    for (pair, result) in pairs.iter().zip(results) {
        let value = |key: &str| result[key].as_f64().unwrap_or_else(|| panic!("{key}: {result}"));
        let place = format!("step {} of {:?}: {result}", pair.step, pair.obstacles);
        assert!((value("hw_m") - pair.gap_m).abs() < TOLERANCE, "{place}: {} m", pair.gap_m);
        if result["thw_alike"] == true {
            let thw_s = pair.thw_s.unwrap();
            assert!((value("passes_s") - thw_s).abs() < TOLERANCE, "{place}: {thw_s} s");
            // CriMe counts whole steps.
            let later_s = value("thw_s") - thw_s;
            assert!((-TOLERANCE..=step_s + TOLERANCE).contains(&later_s), "{place}: {thw_s} s");
            headways += 1;
        }
        // With a smaller closing speed, the time is not determined by double-precision numbers to 1e-6.
        let closes = pair.speeds_mps[0] - pair.speeds_mps[1] > 0.1;
        if closes && result["ttc_alike"] == true {
            let [own_mps, lead_mps] = pair.speeds_mps;
            let ttc_s = closecall_traffic::metrics::time_to_collision_s(pair.gap_m, own_mps, lead_mps).unwrap();
            assert!((value("ttc_s") - ttc_s).abs() < TOLERANCE, "{place}: {ttc_s} s");
            collisions += 1;
        }
        // The formulas are the ones of the package, where it is installed.
        if let Some(package) = result["package"].as_array() {
            let keys = ["hw_m", "thw_s", "ttc_in_package_s"];
            let checked = if closes && result["ttc_alike"] == true { 3 } else { 2 };
            for (of_package, key) in package.iter().zip(keys).take(checked) {
                let is_same = match (of_package.as_f64(), result[key].as_f64()) {
                    (Some(of_package), Some(of_formula)) => (of_package - of_formula).abs() < TOLERANCE,
                    (of_package, of_formula) => of_package == of_formula,
                };
                assert!(is_same, "{place}: {key}");
            }
        }
    }
    assert!(headways > 100 && collisions > 20, "{headways} {collisions} of {}", pairs.len());
}
