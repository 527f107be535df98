//! Scenarios of OpenSCENARIO become scenario files, or are refused by name.

use std::fs;
use std::path::{Path, PathBuf};

use crate::support::{closecall, code, json, message, stdout};

const SCENARIO: &str = include_str!("exchange/cut-in.xosc");
const ROAD: &str = include_str!("exchange/road.xodr");

/// Writes a scenario and its road into a folder, and returns the path of the scenario.
fn written(folder: &Path, scenario: &str, road: &str) -> PathBuf {
    fs::write(folder.join("road.xodr"), road).unwrap();
    let path = folder.join("case.xosc");
    fs::write(&path, scenario).unwrap();
    path
}

/// The road, but straight: each lane is as long as the reference line.
fn straight_road() -> String {
    let straight = ROAD.replace("<arc curvature=\"0.001\"/>", "<line/>");
    assert_ne!(straight, ROAD);
    straight
}

/// Imports a file with further options.
fn imported(path: &Path, output: &Path, more: &[&str]) -> std::process::Output {
    let (path, output) = (path.to_str().unwrap(), output.to_str().unwrap());
    closecall([&["tool", "import", path, "-o", output], more].concat())
}

/// Returns the time (s) of an event in the printed list.
fn time_of(said: &str, event: &str) -> f64 {
    let line = said.lines().find(|line| line.ends_with(event)).unwrap_or_else(|| panic!("{event}: {said}"));
    line.split_whitespace().next().unwrap().parse().unwrap()
}

#[test]
fn a_cut_in_has_the_starts_speeds_and_lane_changes_of_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("scenario.toml");
    let said = stdout(&imported(&written(folder.path(), SCENARIO, ROAD), &output, &[]), 0);
    // The ego closes 10 m/s from 60 m to 30 m, its speed times the headway.
    assert!((time_of(&said, "cut-in begins") - 3.0).abs() <= 0.011, "{said}");
    assert!((time_of(&said, "cut-in ends") - 7.0).abs() <= 0.011, "{said}");
    assert!((time_of(&said, "brake begins") - 7.5).abs() <= 0.021, "{said}");
    assert!((time_of(&said, "brake ends") - 12.5).abs() <= 0.031, "{said}");
    assert!(!said.contains("is named"), "{said}");
    let text = fs::read_to_string(&output).unwrap();
    let scenario: toml::Table = toml::from_str(&text).unwrap();
    assert_eq!(scenario["road"]["lanes"].as_integer(), Some(2));
    assert_eq!(scenario["road"]["curvature-per-m"].as_float(), Some(0.001));
    assert!((scenario["road"]["speed-limit-mps"].as_float().unwrap() - 120.0 / 3.6).abs() < 1e-9);
    let actors = scenario["actor"].as_array().unwrap();
    let start = |index: usize| &actors[index]["start"]["absolute"];
    // The centre of the box lies ahead of the rear axle.
    assert_eq!(start(0)["s-m"].as_float(), Some(51.4));
    assert_eq!((start(1)["s-m"].as_float(), start(1)["lane"].as_integer()), (Some(114.0), Some(2)));
    assert_eq!(start(1)["speed-mps"].as_float(), Some(20.0));
    assert_eq!(actors[1]["vehicle"]["class"].as_str(), Some("truck"));
    let driver = &actors[1]["driver"]["prescribed"];
    assert_eq!(driver["lane-changes"][0]["to"].as_str(), Some("left"));
    assert_eq!(driver["lane-changes"][0]["duration-s"].as_float(), Some(4.0));
    let profile = driver["profile"].as_array().unwrap();
    let lowest = profile.iter().map(|point| point[1].as_float().unwrap()).fold(f64::INFINITY, f64::min);
    assert!((lowest - 10.0).abs() < 1e-6, "{text}");
    let run = ["run", output.to_str().unwrap(), "--sensors", "ground-truth", "--format", "json"];
    json(&closecall(run), 0);
}

#[test]
fn parameters_and_the_ego_are_options() {
    let folder = tempfile::tempdir().unwrap();
    let (path, output) = (written(folder.path(), SCENARIO, &straight_road()), folder.path().join("scenario.toml"));
    let said = stdout(&imported(&path, &output, &["--parameter", "Gap=80"]), 0);
    assert!((time_of(&said, "cut-in begins") - 5.0).abs() <= 0.011, "{said}");
    let refused = imported(&path, &output, &["--parameter", "Gab=80"]);
    assert_eq!(code(&refused), 3);
    assert!(message(&refused).contains("no parameter `Gab`, only EgoSpeed, Gap, Headway"), "{}", message(&refused));
    let said = stdout(&imported(&path, &output, &["--ego", "Slow_Truck"]), 0);
    // What the ego does in the file is said not to happen.
    assert!(said.contains("`LateralAction` of `Slow_Truck`, the ego"), "{said}");
    let refused = imported(&path, &output, &["--ego", "ego"]);
    assert_eq!(code(&refused), 3);
    assert!(message(&refused).contains("name one of Ego, Slow_Truck"), "{}", message(&refused));
}

#[test]
fn a_logical_scenario_of_closecall_comes_back_as_it_left() {
    let folder = tempfile::tempdir().unwrap();
    let case = folder.path().join("case");
    let words = ["tool", "export", "low-thw-overtake", "--form", "logical", "-o", case.to_str().unwrap()];
    stdout(&closecall(words), 0);
    let output = folder.path().join("scenario.toml");
    stdout(&imported(&case.join("logical.xosc"), &output, &[]), 0);
    let run = |scenario: &str| {
        let words = ["run", scenario, "--sample", "4", "--seed", "2", "--sensors", "object", "--format", "json"];
        let outcome = json(&closecall(words), 0);
        (outcome["parameters"].clone(), outcome["collisions"].clone(), outcome["margins"].clone())
    };
    assert_eq!(run(output.to_str().unwrap()), run("low-thw-overtake"));
    let edited = |path: &Path, right: &str, wrong: &str| {
        let text = fs::read_to_string(case.join("logical.xosc")).unwrap();
        assert!(text.contains(right), "{right}");
        fs::write(path, text.replacen(right, wrong, 1)).unwrap();
    };
    // What the file or the command line changes is applied, or refused.
    let fixed = folder.path().join("fixed.toml");
    stdout(&imported(&case.join("logical.xosc"), &fixed, &["--parameter", "closing_mps=9.5", "--ego", "ego"]), 0);
    assert_eq!(run(fixed.to_str().unwrap()).0["closing-mps"], 9.5);
    fs::remove_file(&output).unwrap();
    let path = case.join("edited.xosc");
    for (right, wrong) in [
        ("<ParameterDeclaration name=\"closing_mps\" parameterType=\"double\" value=\"", "&1"),
        ("<Storyboard>", "<Storyboard><!-- --><Foo/>"),
        ("name=\"closecall-content\"", "name=\"content\""),
    ] {
        edited(&path, right, &wrong.replace("&1", &format!("{right}1")));
        let refused = imported(&path, &output, &[]);
        assert_eq!(code(&refused), 3, "{wrong}: {}", message(&refused));
        assert!(message(&refused).contains("`FileHeader`: it carries a scenario file"), "{}", message(&refused));
    }
    for (more, word) in [
        (["--parameter", "nosuch=9.5"], "there is no parameter `nosuch`, only brake_mps2"),
        (["--ego", "rear"], "the ego of its scenario is `ego`"),
    ] {
        let refused = imported(&case.join("logical.xosc"), &output, &more);
        assert_eq!(code(&refused), 3, "{word}: {}", message(&refused));
        assert!(message(&refused).contains(word), "{}", message(&refused));
    }
    assert!(!output.exists());
    // White space between the elements is no edit.
    edited(&path, "<Storyboard>", "\n<Storyboard>\n\n");
    stdout(&imported(&path, &output, &[]), 0);
}

#[test]
fn a_vehicle_that_keeps_its_distance_becomes_a_driver_that_follows() {
    for name in ["rear-follower-stays", "rear-follower-stays-lead-brakes"] {
        let folder = tempfile::tempdir().unwrap();
        let case = folder.path().join("case");
        let words = ["tool", "export", name, "--sensors", "object", "--form", "closed-loop", "-o"];
        stdout(&closecall([&words[..], &[case.to_str().unwrap()]].concat()), 0);
        let output = folder.path().join("scenario.toml");
        let said = stdout(&imported(&case.join("closed-loop.xosc"), &output, &[]), 0);
        assert!(said.contains("`rear` follows `ego`: from the start, a driver of Wiedemann 99"), "{said}");
        let text = fs::read_to_string(&output).unwrap();
        let scenario: toml::Table = toml::from_str(&text).unwrap();
        let rear = scenario["actor"].as_array().unwrap().iter().find(|actor| actor["id"].as_str() == Some("rear"));
        // The library draws cc1 from 0.1 to 0.4 s.
        let cc1_s = rear.unwrap()["driver"]["wiedemann99"]["cc1-s"].as_float().unwrap();
        assert!((0.1..=0.4).contains(&cc1_s), "{text}");
        let run = ["run", output.to_str().unwrap(), "--sensors", "ground-truth", "--format", "json"];
        json(&closecall(run), 0);
    }
}

#[test]
fn the_open_loop_that_closecall_exports_is_imported_with_its_speeds() {
    let folder = tempfile::tempdir().unwrap();
    let case = folder.path().join("case");
    let words = ["tool", "export", "rear-follower-stays", "--sensors", "object", "--form", "open-loop", "-o"];
    stdout(&closecall([&words[..], &[case.to_str().unwrap()]].concat()), 0);
    let output = folder.path().join("scenario.toml");
    let said = stdout(&imported(&case.join("open-loop.xosc"), &output, &[]), 0);
    assert!(said.contains("of the trajectory of `rear`, speeds and lane changes are read"), "{said}");
    let text = fs::read_to_string(&output).unwrap();
    let scenario: toml::Table = toml::from_str(&text).unwrap();
    let rear = scenario["actor"].as_array().unwrap().iter().find(|actor| actor["id"].as_str() == Some("rear")).unwrap();
    let profile = rear["driver"]["prescribed"]["profile"].as_array().unwrap();
    // It closes in on the ego, and slows down behind it.
    let speed_mps = |point: &toml::Value| point[1].as_float().unwrap();
    assert!(speed_mps(&profile[0]) > speed_mps(profile.last().unwrap()) + 1.0, "{text}");
    let run = ["run", output.to_str().unwrap(), "--sensors", "ground-truth", "--format", "json"];
    json(&closecall(run), 0);
}

/// Returns the scenario with a trajectory in place of the lane change, through points with time
/// (s), lane and position (m).
fn with_trajectory(attributes: &str, points: &[(f64, i32, f64)]) -> String {
    let start = SCENARIO.find("<LateralAction>").unwrap();
    let end = SCENARIO.find("</LateralAction>").unwrap() + "</LateralAction>".len();
    let vertices: String = points
        .iter()
        .map(|(at_s, lane, s_m)| {
            format!(
                "<Vertex time=\"{at_s}\"><Position><LanePosition roadId=\"1\" laneId=\"{lane}\" s=\"{s_m}\"/>\
                 </Position></Vertex>"
            )
        })
        .collect();
    let action = format!(
        "<RoutingAction><FollowTrajectoryAction><TrajectoryRef><Trajectory name=\"path\" closed=\"false\"><Shape>\
         <Polyline>{vertices}</Polyline></Shape></Trajectory></TrajectoryRef><TimeReference><Timing {attributes}/>\
         </TimeReference><TrajectoryFollowingMode followingMode=\"position\"/></FollowTrajectoryAction></RoutingAction>"
    );
    [&SCENARIO[..start], action.as_str(), &SCENARIO[end..]].concat()
}

#[test]
fn a_trajectory_becomes_speeds_and_lane_changes() {
    const TIMING: &str = "domainAbsoluteRelative=\"relative\" scale=\"1\" offset=\"0\"";
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("scenario.toml");
    // The cut-in begins at 3 s, when the truck is at 170 m.
    let points = [(0.0, -2, 170.0), (1.0, -2, 190.0), (5.0, -1, 270.0), (8.0, -1, 330.0)];
    let path = written(folder.path(), &with_trajectory(TIMING, &points), &straight_road());
    let said = stdout(&imported(&path, &output, &[]), 0);
    assert!((time_of(&said, "cut-in ends") - 11.0).abs() <= 0.021, "{said}");
    let text = fs::read_to_string(&output).unwrap();
    let scenario: toml::Table = toml::from_str(&text).unwrap();
    let change = &scenario["actor"][1]["driver"]["prescribed"]["lane-changes"][0];
    assert_eq!(change["to"].as_str(), Some("left"));
    // From 10 % to 90 % of the way it takes 3.2 s, as the path of a lane change of 6.3 s.
    assert!((change["duration-s"].as_float().unwrap() - 6.315).abs() < 0.01, "{text}");
    let never = TIMING.replace("relative", "never");
    let absolute = TIMING.replace("relative", "absolute");
    // Time, lane and position along the road.
    type Vertices<'a> = &'a [(f64, i32, f64)];
    let wrong: [(&str, Vertices<'_>, &str); 7] = [
        (TIMING, &[(0.0, -2, 100.0), (1.0, -2, 120.0)], "its trajectory begins at s = 100.00 m"),
        (TIMING, &[(0.0, -2, 170.0), (1.0, -2, 160.0)], "-10.00 m/s"),
        (TIMING, &[(0.0, -2, 170.0), (0.0, -2, 190.0)], "`time` must grow"),
        (TIMING, &[(0.0, -2, 170.0)], "two vertices"),
        (TIMING, &[(0.0, -2, 170.0), (1.0, -3, 190.0)], "lane -3 is not a driving lane"),
        (&never, &points, "one of absolute, relative"),
        (&absolute, &points, "begins at 0.00 s, and its event at 3.0"),
    ];
    for (attributes, points, word) in wrong {
        fs::remove_file(&output).ok();
        let refused =
            imported(&written(folder.path(), &with_trajectory(attributes, points), &straight_road()), &output, &[]);
        let said = message(&refused);
        assert_eq!(code(&refused), 3, "{said}");
        assert!(said.contains("case.xosc:") && said.contains(word), "{word}: {said}");
        assert!(!output.exists());
    }
    let nurbs = with_trajectory(TIMING, &points).replace("Polyline>", "Nurbs>");
    let refused = imported(&written(folder.path(), &nurbs, &straight_road()), &output, &[]);
    assert!(message(&refused).contains("`Nurbs`: it is not read"), "{}", message(&refused));
}

#[test]
fn a_position_in_the_plane_is_a_position_on_the_road() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("scenario.toml");
    let in_plane = |attributes: &str| {
        SCENARIO.replacen(
            "<LanePosition roadId=\"1\" laneId=\"-1\" s=\"50\" offset=\"0\"/>",
            &format!("<WorldPosition {attributes}/>"),
            1,
        )
    };
    let straight = ROAD.replace("<arc curvature=\"0.001\"/>", "<line/>");
    let path = written(folder.path(), &in_plane("x=\"50\" y=\"-1.75\" h=\"0\""), &straight);
    stdout(&imported(&path, &output, &[]), 0);
    let scenario: toml::Table = toml::from_str(&fs::read_to_string(&output).unwrap()).unwrap();
    let start = &scenario["actor"][0]["start"]["absolute"];
    assert_eq!((start["s-m"].as_float(), start["lane"].as_integer()), (Some(51.4), Some(1)));
    let anywhere = straight.replace("hdg=\"0\"", "");
    for (attributes, road, word) in [
        ("x=\"50\" y=\"-1.75\" h=\"1.57\"", straight.as_str(), "not the direction of the road"),
        ("x=\"50\" y=\"9\" h=\"0\"", straight.as_str(), "10.75 m beside the nearest lane"),
        ("x=\"50\" y=\"-1.75\"", anywhere.as_str(), "needs a road whose course is imported"),
    ] {
        fs::remove_file(&output).ok();
        let refused = imported(&written(folder.path(), &in_plane(attributes), road), &output, &[]);
        let said = message(&refused);
        assert_eq!(code(&refused), 3, "{said}");
        assert!(said.contains("`WorldPosition`") && said.contains(word), "{said}");
        assert!(!output.exists());
    }
}

#[test]
fn a_file_of_values_gives_one_of_its_combinations_to_the_scenario_that_it_names() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("scenario.toml");
    written(folder.path(), SCENARIO, &straight_road());
    let path = folder.path().join("values.xosc");
    let values = "<OpenSCENARIO><FileHeader revMajor=\"1\" revMinor=\"3\" date=\"2026-01-01T00:00:00\" \
                  description=\"\" author=\"\"/>\n<ParameterValueDistribution><ScenarioFile \
                  filepath=\"case.xosc\"/>\n<Deterministic><DeterministicSingleParameterDistribution \
                  parameterName=\"Gap\"><DistributionSet><Element value=\"60\"/><Element \
                  value=\"80\"/></DistributionSet></DeterministicSingleParameterDistribution></Deterministic>\
                  </ParameterValueDistribution></OpenSCENARIO>";
    fs::write(&path, values).unwrap();
    let said = stdout(&imported(&path, &output, &["--value-set", "2"]), 0);
    assert!(said.contains("value set 2 of 2: Gap = 80"), "{said}");
    assert!((time_of(&said, "cut-in begins") - 5.0).abs() <= 0.011, "{said}");
    fs::write(&path, values.replace("<Element value=\"60\"/>", "")).unwrap();
    let said = stdout(&imported(&path, &output, &[]), 0);
    assert!((time_of(&said, "cut-in begins") - 5.0).abs() <= 0.011, "{said}");
    fs::remove_file(&output).unwrap();
    let first = &["--value-set", "1"];
    let wrong: [(&str, &str, &[&str], &str); 9] = [
        ("", "", &[], "it has 2 combinations of values: choose one value set from 1 to 2"),
        ("", "", &["--value-set", "3"], "from 1 to 2"),
        ("", "", &["--value-set", "0"], "from 1 to 2"),
        ("\"Gap\"", "\"Gab\"", first, "there is no parameter `Gab`"),
        ("value=\"60\"", "value=\"wide\"", first, "`Gap`, whose value is given from outside: `value` is `wide`"),
        ("value=\"60\"", "worth=\"60\"", first, "`worth` is not an attribute"),
        ("case.xosc", "cases.xosc", first, "values.xosc:2: `ScenarioFile`: failed to read"),
        ("case.xosc", "values.xosc", first, "must name a scenario"),
        ("</OpenSCENARIO>", "<Storyboard/></OpenSCENARIO>", first, "`Storyboard`: a file of values has nothing beside"),
    ];
    for (right, wrong, more, word) in wrong {
        let text = if right.is_empty() { values.to_owned() } else { values.replace(right, wrong) };
        fs::write(&path, text).unwrap();
        let refused = imported(&path, &output, more);
        let said = message(&refused);
        assert_eq!(code(&refused), 3, "{wrong}: {said}");
        assert!(said.contains(".xosc:") && said.contains(word), "{word}: {said}");
        assert!(!output.exists(), "{wrong}");
    }
    let refused = imported(&folder.path().join("case.xosc"), &output, &["--value-set", "1"]);
    assert!(message(&refused).contains("not a file of values"), "{}", message(&refused));
}

/// Returns a file of distributions for the scenario `case.xosc`.
fn distributions(attributes: &str, inner: &[(&str, &str)]) -> String {
    let inner: String = inner
        .iter()
        .map(|(name, inner)| {
            format!("<StochasticDistribution parameterName=\"{name}\">{inner}</StochasticDistribution>\n")
        })
        .collect();
    format!(
        "<OpenSCENARIO><FileHeader revMajor=\"1\" revMinor=\"3\" date=\"2026-01-01T00:00:00\" description=\"\" \
         author=\"\"/><ParameterValueDistribution><ScenarioFile filepath=\"case.xosc\"/><Stochastic {attributes}>\n\
         {inner}</Stochastic></ParameterValueDistribution></OpenSCENARIO>"
    )
}

#[test]
fn a_file_of_distributions_gives_one_of_its_draws_to_the_scenario_that_it_names() {
    const RUNS: &str = "numberOfTestRuns=\"3\" randomSeed=\"7\"";
    const UNIFORM: &str = "<UniformDistribution><Range lowerLimit=\"60\" upperLimit=\"80\"/></UniformDistribution>";
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("scenario.toml");
    written(folder.path(), SCENARIO, ROAD);
    let path = folder.path().join("values.xosc");
    fs::write(&path, distributions(RUNS, &[("Gap", UNIFORM)])).unwrap();
    let gap_of = |number: &str| {
        let said = stdout(&imported(&path, &output, &["--value-set", number]), 0);
        let note = format!("draw {number} of 3 with the random seed 7: Gap = ");
        let gap_m: f64 = said.lines().find_map(|line| line.trim().strip_prefix(&note)).unwrap().parse().unwrap();
        // The ego closes 10 m/s until it is 30 m behind.
        assert!((time_of(&said, "cut-in begins") - (gap_m - 30.0) / 10.0).abs() <= 0.021, "{said}");
        gap_m
    };
    let gaps_m = ["1", "2", "3"].map(gap_of);
    assert!(gaps_m.iter().all(|gap_m| (60.0..80.0).contains(gap_m)), "{gaps_m:?}");
    assert!(gaps_m[0] != gaps_m[1] && gaps_m[1] != gaps_m[2], "{gaps_m:?}");
    assert_eq!(["1", "2", "3"].map(gap_of), gaps_m);
    // A distribution of whole numbers is drawn, too, and one draw needs no choice.
    let poisson =
        "<PoissonDistribution expectedValue=\"65\"><Range lowerLimit=\"60\" upperLimit=\"70\"/></PoissonDistribution>";
    fs::write(&path, distributions("numberOfTestRuns=\"1\"", &[("Gap", poisson)])).unwrap();
    let said = stdout(&imported(&path, &output, &[]), 0);
    let note = "draw 1 of 1 with no stated random seed, which is taken as 0: Gap = ";
    let gap_m: f64 = said.lines().find_map(|line| line.trim().strip_prefix(note)).unwrap().parse().unwrap();
    assert!(gap_m.fract() == 0.0 && (60.0..=70.0).contains(&gap_m), "{said}");
    fs::remove_file(&output).unwrap();
    let first = &["--value-set", "1"];
    let user = "<UserDefinedDistribution type=\"mine\"/>";
    let wide = UNIFORM.replace("80", "wide");
    // Attributes, name of the parameter, its distribution, options, and a part of the message.
    type Case<'a> = (&'a str, &'a str, &'a str, &'a [&'a str], &'a str);
    let wrong: [Case<'_>; 8] = [
        (RUNS, "Gap", UNIFORM, &[], "it has 3 draws of values: choose one value set from 1 to 3"),
        (RUNS, "Gap", UNIFORM, &["--value-set", "4"], "from 1 to 3"),
        (RUNS, "Gab", UNIFORM, first, "there is no parameter `Gab`"),
        (RUNS, "Gap", user, first, "`UserDefinedDistribution`: this distribution is not read"),
        (RUNS, "Gap", &wide, first, "`upperLimit` is `wide`"),
        (RUNS, "Gap", "", first, "`StochasticDistribution`: it needs exactly one"),
        ("numberOfTestRuns=\"-3\"", "Gap", UNIFORM, first, "`Stochastic`: `numberOfTestRuns` is `-3`"),
        ("randomSeed=\"7\"", "Gap", UNIFORM, first, "`Stochastic`: it needs `numberOfTestRuns`"),
    ];
    for (attributes, name, inner, more, word) in wrong {
        fs::write(&path, distributions(attributes, &[(name, inner)])).unwrap();
        let refused = imported(&path, &output, more);
        let said = message(&refused);
        assert_eq!(code(&refused), 3, "{word}: {said}");
        assert!(said.contains(".xosc:") && said.contains(word), "{word}: {said}");
        assert!(!output.exists(), "{word}");
    }
}

/// Returns the parameters of a scenario file.
fn parameters(path: &Path) -> toml::Table {
    let scenario: toml::Table = toml::from_str(&fs::read_to_string(path).unwrap()).unwrap();
    scenario["parameters"].as_table().unwrap().clone()
}

/// Returns the numbers of a distribution, in their order, or nothing if it has another form.
fn numbers(value: &toml::Value) -> Vec<f64> {
    match value {
        toml::Value::Float(number) => vec![*number],
        toml::Value::Integer(number) => vec![*number as f64],
        toml::Value::Array(values) => values.iter().flat_map(numbers).collect(),
        toml::Value::Table(table) => table.values().flat_map(numbers).collect(),
        _ => Vec::new(),
    }
}

#[test]
fn the_distributions_that_closecall_exports_come_back_as_distributions() {
    const FORMS: [&str; 6] = ["uniform", "truncated-normal", "log-normal", "choice", "empirical", "fixed"];
    let folder = tempfile::tempdir().unwrap();
    let exported = |name: &str, settings: &[&str]| {
        let case = folder.path().join(name);
        let words = ["tool", "export", "low-thw-overtake", "--form", "logical", "-o", case.to_str().unwrap()];
        let settings: Vec<&str> = settings.iter().flat_map(|setting| ["--set", *setting]).collect();
        stdout(&closecall([&words[..], &settings[..]].concat()), 0);
        case
    };
    let case = exported("case", &[]);
    let changed = exported(
        "changed",
        &[
            "parameters.brake-mps2.uniform.max=7.7",
            "parameters.reaction-s.log-normal.sigma=0.37",
            "parameters.cut-out-thw-s.log-normal.median=0.61",
            "parameters.hardest-braking-mps2.truncated-normal.mean=6.1",
            "parameters.rear-class.choice.car=0.7",
            "parameters.front-thw-s.empirical.quantiles=[0.5, 0.55, 0.7, 0.9]",
            "rear-cc1-s=0.02",
        ],
    );
    let scenario = |case: &Path, file: &str, name: &str| {
        let output = folder.path().join(name);
        let said = stdout(&imported(&case.join(file), &output, &[]), 0);
        (parameters(&output), said)
    };
    let (before, _) = scenario(&case, "logical.xosc", "before.toml");
    // The same distributions leave the scenario as it is, with the origin of each.
    let (same, said) = scenario(&case, "logical-distributions.xosc", "same.toml");
    assert_eq!(same, before);
    assert!(said.contains("the distributions ask for 1 run with the random seed 0"), "{said}");
    // Other distributions replace the ones in the scenario.
    let (right, _) = scenario(&changed, "logical.xosc", "right.toml");
    fs::copy(changed.join("logical-distributions.xosc"), case.join("other.xosc")).unwrap();
    let (other, said) = scenario(&case, "other.xosc", "other.toml");
    assert!(said.contains("`brake-mps2` has the `UniformDistribution` of line "), "{said}");
    assert_eq!(other.keys().collect::<Vec<_>>(), right.keys().collect::<Vec<_>>());
    let mut replaced = 0;
    for (name, right) in &right {
        let form = FORMS.into_iter().find(|form| right.get(form).is_some()).unwrap();
        let forms = FORMS.into_iter().filter(|form| other[name].get(form).is_some());
        assert_eq!(forms.collect::<Vec<_>>(), [form], "{name}");
        let (right, is, was) =
            (numbers(&right[form]), numbers(&other[name][form]), before[name].get(form).map(numbers));
        assert_eq!(is.len(), right.len(), "{name}");
        for (is, right) in is.iter().zip(&right) {
            assert!((is - right).abs() <= 1e-12 * right.abs(), "{name}: {is} {right}");
        }
        if was != Some(right) {
            replaced += 1;
            assert!(other[name].get("fitted").is_none(), "{name}");
            assert!(other[name]["assumed"].as_str().unwrap().ends_with("other.xosc"), "{name}");
        }
    }
    assert_eq!(replaced, 7);
    let file = folder.path().join("other.toml");
    let run = ["run", file.to_str().unwrap(), "--sensors", "ground-truth", "--format", "json"];
    json(&closecall(run), 0);
    // One draw of the distributions has values.
    let drawn = folder.path().join("drawn.toml");
    let said = stdout(&imported(&case.join("other.xosc"), &drawn, &["--value-set", "1"]), 0);
    assert!(said.contains("draw 1 of 1 with the random seed 0: "), "{said}");
    assert!(parameters(&drawn).values().all(|parameter| parameter.get("fixed").is_some()));
    // What no parameter of a scenario file can have is refused by name.
    let text = fs::read_to_string(case.join("other.xosc")).unwrap();
    let brake = &text[text.find("<StochasticDistribution parameterName=\"brake_mps2\">").unwrap()..];
    let brake = &brake[..brake.find("</StochasticDistribution>").unwrap()];
    for (wrong, word) in [
        (
            "<PoissonDistribution expectedValue=\"5\"/>",
            "`PoissonDistribution`: `brake-mps2`: it has several single numbers",
        ),
        (
            "<ProbabilityDistributionSet><Element value=\"full\" weight=\"1\"/></ProbabilityDistributionSet>",
            "`ProbabilityDistributionSet`: `brake-mps2`: `full` is not a number",
        ),
    ] {
        let start = "<StochasticDistribution parameterName=\"brake_mps2\">";
        fs::write(case.join("wrong.xosc"), text.replace(brake, &format!("{start}{wrong}"))).unwrap();
        let refused = imported(&case.join("wrong.xosc"), &folder.path().join("wrong.toml"), &[]);
        assert_eq!(code(&refused), 3);
        assert!(message(&refused).contains("wrong.xosc:") && message(&refused).contains(word), "{}", message(&refused));
    }
    let missing = text.replace("\"brake_mps2\"", "\"braking\"");
    fs::write(case.join("wrong.xosc"), missing).unwrap();
    let refused = imported(&case.join("wrong.xosc"), &folder.path().join("wrong.toml"), &[]);
    assert!(message(&refused).contains("there is no parameter `braking`, only brake_mps2"), "{}", message(&refused));
    assert!(!folder.path().join("wrong.toml").exists());
}

/// Returns the scenario with a synchronisation of the truck in place of the lane change, which
/// begins at 3 s. Then the ego is at 140 m and drives 30 m/s, and the truck at 170 m with 20 m/s.
fn synchronised(attributes: &str, master_m: f64, target_m: f64, rest: &str) -> String {
    let start = SCENARIO.find("<LateralAction>").unwrap();
    let end = SCENARIO.find("</LateralAction>").unwrap() + "</LateralAction>".len();
    let action = format!(
        "<SynchronizeAction {attributes}><TargetPositionMaster><LanePosition roadId=\"1\" laneId=\"-1\" \
         s=\"{master_m}\"/></TargetPositionMaster><TargetPosition><LanePosition roadId=\"1\" laneId=\"-2\" \
         s=\"{target_m}\"/></TargetPosition>{rest}</SynchronizeAction>"
    );
    [&SCENARIO[..start], action.as_str(), &SCENARIO[end..]].concat()
}

#[test]
fn a_synchronised_vehicle_arrives_at_its_target_when_its_master_does() {
    const MASTER: &str = "masterEntityRef=\"Ego\" targetTolerance=\"1\" targetToleranceMaster=\"1\"";
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("scenario.toml");
    let end = |inner: &str| format!("<FinalSpeed>{inner}</FinalSpeed>");
    let steady = |inner: &str| end(&format!("<AbsoluteSpeed value=\"24\">{inner}</AbsoluteSpeed>"));
    let relative = |value: &str, kind: &str| {
        end(&format!("<RelativeSpeedToMaster value=\"{value}\" speedTargetValueType=\"{kind}\"/>"))
    };
    // The ego needs 10 s for 300 m. The truck has 230 m to drive, at a mean speed of 23 m/s.
    for (rest, final_mps, steady_from_s) in [
        (String::new(), 26.0, 13.0),
        (end("<AbsoluteSpeed value=\"20\"/>"), 20.0, 13.0),
        (steady("<TargetTimeSteadyState time=\"2\"/>"), 24.0, 11.0),
        (steady("<TargetDistanceSteadyState distance=\"72\"/>"), 24.0, 10.0),
        (relative("-5", "delta"), 25.0, 13.0),
        (relative("0.7", "factor"), 21.0, 13.0),
    ] {
        let path = written(folder.path(), &synchronised(MASTER, 440.0, 400.0, &rest), &straight_road());
        let said = stdout(&imported(&path, &output, &[]), 0);
        assert!((time_of(&said, "cut-in ends") - 13.0).abs() <= 0.021, "{rest}: {said}");
        assert!(said.contains("`Slow_Truck` arrives at its target at 13.00 s"), "{said}");
        let text = fs::read_to_string(&output).unwrap();
        let scenario: toml::Table = toml::from_str(&text).unwrap();
        let profile = scenario["actor"][1]["driver"]["prescribed"]["profile"].as_array().unwrap();
        let points: Vec<[f64; 2]> =
            profile.iter().map(|point| [0, 1].map(|index| point[index].as_float().unwrap())).collect();
        let speed_mps = |at_s: f64| {
            let after = points.iter().position(|[time_s, _]| *time_s > at_s).unwrap();
            let ([t0, v0], [t1, v1]) = (points[after - 1], points[after]);
            v0 + (v1 - v0) * (at_s - t0) / (t1 - t0)
        };
        // The truck starts at 110 m; 4 m more lead to the centre of its box.
        let driven_m: f64 = (0..1_300).map(|step| 0.01 * speed_mps(0.01 * f64::from(step) + 0.005)).sum();
        assert!((110.0 + driven_m - 400.0).abs() < 0.1, "{rest}: {driven_m}: {text}");
        for at_s in [steady_from_s, 13.0] {
            assert!((speed_mps(at_s) - final_mps).abs() < 0.05, "{rest}: {at_s}: {text}");
        }
        let run = ["run", output.to_str().unwrap(), "--sensors", "ground-truth", "--format", "json"];
        json(&closecall(run), 0);
    }
}

#[test]
fn a_synchronisation_that_no_vehicle_can_keep_is_refused_with_the_reason() {
    const MASTER: &str = "masterEntityRef=\"Ego\"";
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("scenario.toml");
    let right = synchronised(MASTER, 440.0, 400.0, "");
    let slows = "<ManeuverGroup name=\"others\" maximumExecutionCount=\"1\"><Actors selectTriggeringEntities=\"false\">\
                 <EntityRef entityRef=\"Ego\"/></Actors><Maneuver name=\"slows\"><Event name=\"slows\" \
                 priority=\"parallel\" maximumExecutionCount=\"1\"><Action name=\"slows-action\"><PrivateAction>\
                 <LongitudinalAction><SpeedAction><SpeedActionDynamics dynamicsShape=\"linear\" value=\"2\" \
                 dynamicsDimension=\"rate\"/><SpeedActionTarget><AbsoluteTargetSpeed value=\"20\"/></SpeedActionTarget>\
                 </SpeedAction></LongitudinalAction></PrivateAction></Action><StartTrigger><ConditionGroup><Condition \
                 name=\"later\" delay=\"0\" conditionEdge=\"none\"><ByValueCondition><SimulationTimeCondition \
                 value=\"AT\" rule=\"greaterThan\"/></ByValueCondition></Condition></ConditionGroup></StartTrigger>\
                 </Event></Maneuver></ManeuverGroup>";
    let with_group =
        |at_s: &str| right.replacen("</ManeuverGroup>", &format!("</ManeuverGroup>{}", slows.replace("AT", at_s)), 1);
    let lane = "<TargetPosition><LanePosition roadId=\"1\" laneId=\"-2\" s=\"400\"/>";
    let final_speed = |speed: &str| synchronised(MASTER, 440.0, 400.0, &format!("<FinalSpeed>{speed}</FinalSpeed>"));
    for (scenario, element, word) in [
        (synchronised(MASTER, 100.0, 400.0, ""), "TargetPositionMaster", "`Ego` is not before it"),
        (synchronised(MASTER, 440.0, 100.0, ""), "TargetPosition", "m behind `Slow_Truck`"),
        (synchronised(MASTER, 440.0, 250.0, ""), "SynchronizeAction", "0 to 100 m/s are possible"),
        (synchronised(MASTER, 290.0, 400.0, ""), "SynchronizeAction", "-9 to 5 m/s² are possible"),
        (synchronised(MASTER, 20_000.0, 400.0, ""), "SynchronizeAction", "does not arrive at its target within 300 s"),
        (right.replace(MASTER, "masterEntityRef=\"Slow_Truck\""), "SynchronizeAction", "the vehicle itself"),
        (right.replace(MASTER, "masterEntityRef=\"Nobody\""), "SynchronizeAction", "only Ego, Slow_Truck"),
        (right.replace(MASTER, ""), "SynchronizeAction", "it needs `masterEntityRef`"),
        (right.replace(lane, "<TargetPosition>"), "TargetPosition", "exactly one element"),
        (
            right.replace(lane, "<TargetPosition><RelativeLanePosition entityRef=\"Ego\" dLane=\"0\" ds=\"9\"/>"),
            "RelativeLanePosition",
            "only `WorldPosition` and `LanePosition` are read",
        ),
        (right.replace(lane, &lane.replace("s=", "offset=\"9\" s=")), "LanePosition", "beside the nearest lane"),
        (final_speed("<AbsoluteSpeed value=\"-3\"/>"), "AbsoluteSpeed", "a speed of -3 m/s"),
        (
            final_speed("<AbsoluteSpeed value=\"20\"><TargetTimeSteadyState time=\"12\"/></AbsoluteSpeed>"),
            "SynchronizeAction",
            "must be shorter than",
        ),
        (with_group("6"), "SynchronizeAction", "`Ego` changes its speed on the way"),
    ] {
        let _ = fs::remove_file(&output);
        let refused = imported(&written(folder.path(), &scenario, ROAD), &output, &[]);
        let said = message(&refused);
        assert_eq!(code(&refused), 3, "{word}: {said}");
        assert!(said.contains("case.xosc:") && said.contains(&format!("`{element}`: ")), "{word}: {said}");
        assert!(said.contains(word), "{word}: {said}");
        assert!(!output.exists(), "{word}");
    }
    // After the arrival, and if it has begun before, a change of speed is known. From 2 s to 7 s, the
    // ego comes to 235 m and to 20 m/s.
    for (at_s, arrival_s) in [("14", 13.0), ("2", 7.0 + 205.0 / 20.0)] {
        let said = stdout(&imported(&written(folder.path(), &with_group(at_s), ROAD), &output, &[]), 0);
        assert!((time_of(&said, "cut-in ends") - arrival_s).abs() <= 0.031, "{said}");
    }
}

#[test]
fn a_distance_that_no_driver_keeps_is_refused_with_the_reason() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("scenario.toml");
    let start = SCENARIO.find("<LateralAction>").unwrap();
    let end = SCENARIO.find("</LateralAction>").unwrap() + "</LateralAction>".len();
    for (attributes, word) in [
        ("distance=\"20\" continuous=\"false\"", "`continuous` must be `true`"),
        ("distance=\"20\" continuous=\"true\"", "`Slow_Truck` is not behind `Ego`"),
        ("distance=\"-20\" continuous=\"true\"", "`distance` is `-20`"),
    ] {
        let action = format!("<LongitudinalDistanceAction entityRef=\"Ego\" freespace=\"true\" {attributes}/>");
        let action = format!("<LongitudinalAction>{action}</LongitudinalAction>");
        let scenario = [&SCENARIO[..start], action.as_str(), &SCENARIO[end..]].concat();
        let refused = imported(&written(folder.path(), &scenario, ROAD), &output, &[]);
        let said = message(&refused);
        assert_eq!(code(&refused), 3, "{said}");
        assert!(said.contains("`LongitudinalDistanceAction`") && said.contains(word), "{said}");
        assert!(!output.exists());
    }
}

#[test]
fn a_scenario_command_says_which_command_imports_xml() {
    let folder = tempfile::tempdir().unwrap();
    let path = written(folder.path(), SCENARIO, ROAD);
    let output = closecall(["run", path.to_str().unwrap()]);
    assert_eq!(code(&output), 3);
    assert!(message(&output).contains("closecall tool import"), "{}", message(&output));
}

/// Faults of a scenario: a text, its replacement, and the words that the message must have.
fn faults() -> Vec<(&'static str, &'static str, &'static [&'static str])> {
    vec![
        ("<OpenSCENARIO>", "<OpenScenario>", &["OpenSCENARIO"]),
        ("</OpenSCENARIO>", "", &["ends before its root element"]),
        ("revMajor=\"1\"", "revMajor=\"2\"", &[":3:", "FileHeader", "1.0 to 1.3"]),
        ("${$EgoSpeed / 3.6}", "${$EgoFast / 3.6}", &["AbsoluteTargetSpeed", "EgoFast", "EgoSpeed"]),
        ("${$EgoSpeed / 3.6}", "${$EgoSpeed / 0}", &["AbsoluteTargetSpeed", "finite"]),
        ("${$EgoSpeed / 3.6}", "fast", &["AbsoluteTargetSpeed", "fast", "number"]),
        ("${$EgoSpeed / 3.6}", "NaN", &["AbsoluteTargetSpeed", "NaN", "number"]),
        ("road.xodr", "no-such-road.xodr", &[":11:", "LogicFile", "no-such-road.xodr"]),
        ("roadId=\"1\"", "roadId=\"7\"", &["case.xosc:42: `LanePosition`", "no road `7`", "road.xodr, only 1"]),
        ("laneId=\"-1\"", "laneId=\"-3\"", &["case.xosc:42: `LanePosition`", "lane -3", "road.xodr, only -1, -2"]),
        ("s=\"50\" offset=\"0\"", "s=\"50\" offset=\"0.5\"", &["LanePosition", "offset"]),
        ("vehicleCategory=\"truck\"", "vehicleCategory=\"tram\"", &[":26:", "Vehicle", "tram"]),
        ("<Dimensions length=\"12\" width=\"2.5\" height=\"4\"/>", "", &["Vehicle", "BoundingBox/Dimensions"]),
        (
            "entityRef=\"Slow_Truck\" value=",
            "entityRef=\"Fast_Truck\" value=",
            &["TimeHeadwayCondition", "Fast_Truck", "Ego, Slow_Truck"],
        ),
        (
            "<LaneChangeActionDynamics dynamicsShape=\"sinusoidal\" value=\"4\"",
            "<LaneChangeActionDynamics dynamicsShape=\"sinusoidal\" value=\"40\"",
            &["LaneChangeAction", "1.5 to 20 s"],
        ),
        (
            "RelativeTargetLane entityRef=\"Ego\" value=\"0\"",
            "RelativeTargetLane entityRef=\"Ego\" value=\"4\"",
            &["RelativeTargetLane", "only -1, -2"],
        ),
        ("<LaneChangeAction>", "<LaneOffsetAction continuous=\"false\">", &["it is not an XML document"]),
        ("TimeHeadwayCondition", "OffroadCondition", &["OffroadCondition", "not read"]),
        (
            "storyboardElementRef=\"cut-in\"",
            "storyboardElementRef=\"cut-on\"",
            &["StoryboardElementStateCondition", "cut-on"],
        ),
        ("conditionEdge=\"none\"", "conditionEdge=\"sharp\"", &["Condition", "sharp"]),
        ("rule=\"lessThan\"", "rule=\"nearly\"", &["TimeHeadwayCondition", "nearly"]),
        ("<Storyboard>", "<Storyboard><Foo/>", &["`Foo`", "no element of `Storyboard`", "Init, Story, StopTrigger"]),
        ("<Story ", "<Tale/><Story ", &["`Tale`", "no element of `Storyboard`"]),
        ("${$EgoSpeed / 3.6}", "-50", &["AbsoluteTargetSpeed", "-50 m/s; 0 to 100 m/s"]),
        ("name=\"Slow_Truck\"", "name=\"Ego\"", &["ScenarioObject", "an entity `Ego` already"]),
        ("length=\"12\"", "length=\"-12\"", &[":29:", "`Dimensions`", "`length` is -12; 1 to 26 m are needed"]),
        ("length=\"12\"", "length=\"500\"", &[":29:", "`Dimensions`", "`length` is 500; 1 to 26 m are needed"]),
        (
            "entityRef=\"Slow_Truck\" value=",
            "\n\nentityRef=\"Fast_Truck\"\nvalue=",
            &["case.xosc:90: `TimeHeadwayCondition`", "Fast_Truck"],
        ),
        (
            "value=\"2\" dynamicsDimension=\"rate\"",
            "value=\"-1e9\" dynamicsDimension=\"rate\"",
            &["case.xosc:102: `SpeedActionDynamics`", "-1000000000.00 m/s²; -12 to 12 m/s² are possible"],
        ),
        (
            "value=\"2\" dynamicsDimension=\"rate\"",
            "value=\"0.1\" dynamicsDimension=\"time\"",
            &["case.xosc:102: `SpeedActionDynamics`", "-100.00 m/s²; -12 to 12 m/s² are possible"],
        ),
        (
            "dynamicsShape=\"step\" value=\"0\" dynamicsDimension=\"time\"",
            "dynamicsShape=\"linear\" value=\"-1\" dynamicsDimension=\"time\"",
            &["case.xosc:47: `SpeedActionDynamics`", "`value` is -1; a number of at least 0"],
        ),
        ("s=\"50\"", "s=\"-1e9\"", &["case.xosc:42: `LanePosition`", "0 to 3000 m, the length of the road"]),
        ("ds=\"$Gap\"", "ds=\"1e9\"", &["case.xosc:55: `RelativeLanePosition`", "`Slow_Truck`", "s-m"]),
        ("<Center x=\"4\"", "<Center x=\"1e9\"", &["case.xosc:28: `Center`", "`x` is 1000000000; -12 to 12 m"]),
        ("mass=\"1600\"", "mass=\"1e9\"", &["case.xosc:15: `Vehicle`", "100 to 60000 kg are needed"]),
        ("a cut-in, for tests", "a cut-in\0", &["U+0000 is not allowed"]),
        ("a cut-in, for tests", "a cut-in&#1;", &["FileHeader"]),
    ]
}

/// Attributes that no version of the standard has, or not with this value: a text, its replacement,
/// and the words that the message must have.
fn faults_of_attributes() -> Vec<(&'static str, &'static str, &'static [&'static str])> {
    vec![
        ("<Event name=", "<Event colour=\"red\" name=", &["`Event`", "`colour` is not an attribute", "name, priority"]),
        ("<Init>", "<Init speed=\"3\">", &["`Init`", "`speed` is not an attribute of it, which can have none"]),
        ("<Init>", "<Init/><Init>", &["`Init`", "`Storyboard` has one already"]),
        ("<Storyboard>", "<Storyboard>now", &["`Storyboard`", "`now`", "no text is allowed"]),
        ("priority=\"parallel\"", "priority=\"foo\"", &["`Event`", "`foo`", "overwrite, override, parallel, skip"]),
        ("maximumExecutionCount=\"1\"", "maximumExecutionCount=\"-1\"", &["`ManeuverGroup`", "`-1`", "at least 0"]),
        ("maximumExecutionCount=\"1\"", "maximumExecutionCount=\"2\"", &["`ManeuverGroup`", "`2`", "must be 1"]),
        ("\"sinusoidal\"", "\"wavy\"", &["`LaneChangeActionDynamics`", "`wavy`", "cubic, linear, sinusoidal, step"]),
        ("dynamicsDimension=\"time\"", "dynamicsDimension=\"hours\"", &["`hours`", "distance, rate, time"]),
        ("freespace=\"false\"", "freespace=\"maybe\"", &["`TimeHeadwayCondition`", "`maybe`", "true, false"]),
        ("freespace=", "coordinateSystem=\"moon\" freespace=", &["`coordinateSystem` is `moon`", "entity, lane, road"]),
        ("freespace=", "coordinateSystem=\"world\" freespace=", &["`world`", "not read, only entity, lane, road"]),
        ("freespace=", "relativeDistanceType=\"far\" freespace=", &["`relativeDistanceType` is `far`", "lateral"]),
        ("freespace=", "relativeDistanceType=\"lateral\" freespace=", &["`lateral`", "only longitudinal"]),
        ("freespace=", "routingAlgorithm=\"widest\" freespace=", &["`routingAlgorithm` is `widest`", "shortest"]),
        ("value=\"$Headway\"", "value=\"-1\"", &["`TimeHeadwayCondition`", "`value` is `-1`", "at least 0"]),
        ("delay=\"0.5\"", "delay=\"-5\"", &["`Condition`", "`delay` is `-5`", "at least 0"]),
        ("conditionEdge=\"none\"", "conditionEdge=\"$Gap\"", &["`Condition`", "`60`", "falling, none, rising"]),
        ("<EntityRef entityRef=\"Slow_Truck\"/>", "", &["`PrivateAction`", "`Actors` has no `EntityRef`"]),
        ("<EntityRef entityRef=\"Ego\"/>", "", &["`TriggeringEntities`", "it needs an `EntityRef`"]),
        ("triggeringEntitiesRule=\"any\"", "triggeringEntitiesRule=\"some\"", &["TriggeringEntities", "all, any"]),
        ("selectTriggeringEntities=\"false\"", "selectTriggeringEntities=\"true\"", &["`Actors`", "not read"]),
        ("storyboardElementType=\"event\"", "storyboardElementType=\"act\"", &["there is no act `cut-in`"]),
        ("storyboardElementType=\"event\"", "storyboardElementType=\"deed\"", &["`deed`", "act, action, event"]),
        ("state=\"completeState\"", "state=\"done\"", &["`state` is `done`", "completeState, endTransition"]),
        ("speedTargetValueType=\"delta\"", "speedTargetValueType=\"sum\"", &["RelativeTargetSpeed", "delta, factor"]),
        (
            "<AbsoluteTargetSpeed value=\"10\"/>",
            "<RelativeTargetSpeed entityRef=\"Ego\" value=\"-5\" speedTargetValueType=\"delta\" continuous=\"true\"/>",
            &["case.xosc:102: `SpeedActionDynamics`", "`dynamicsShape` must be `step`"],
        ),
        ("continuous=\"false\"", "continuous=\"no\"", &["`RelativeTargetSpeed`", "`continuous` is `no`"]),
        ("laneId=\"-1\"", "laneId=\"-1.5\"", &["`LanePosition`", "`laneId` is `-1.5`", "whole number"]),
        ("vehicleCategory=\"truck\"", "vehicleCategory=\"lorry\"", &[":26:", "`lorry`", "bicycle, bus, car"]),
        ("mass=\"1600\"", "mass=\"-1600\"", &["`Vehicle`", "`mass` is `-1600`", "at least 0"]),
        ("parameterType=\"double\"", "parameterType=\"float\"", &["`ParameterDeclaration`", "`float`", "double"]),
        ("value=\"60\"", "value=\"wide\"", &["`ParameterDeclaration`", "the double `Gap`", "`wide`"]),
        ("name=\"Gap\"", "name=\"Headway\"", &["`ParameterDeclaration`", "`Headway` is declared before"]),
    ]
}

#[test]
fn a_wrong_scenario_is_refused_with_file_line_and_element_and_nothing_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("scenario.toml");
    let mut count = 0;
    for (right, wrong, words) in faults().into_iter().chain(faults_of_attributes()) {
        assert!(SCENARIO.contains(right), "{right}");
        let path = written(folder.path(), &SCENARIO.replacen(right, wrong, 1), ROAD);
        let refused = imported(&path, &output, &[]);
        let said = message(&refused);
        assert_eq!(code(&refused), 3, "{wrong}: {said}");
        assert!(said.contains("case.xosc:") || said.contains("road.xodr:"), "{wrong}: {said}");
        for word in words {
            assert!(said.contains(word), "{wrong}: {word}: {said}");
        }
        assert!(!output.exists(), "{wrong}");
        count += 1;
    }
    assert!(count >= 20, "{count}");
}

/// Returns the scenario with a shift within the lane in place of its lane change.
fn with_offset(dynamics: &str, target: &str, attributes: &str) -> String {
    let start = SCENARIO.find("<LaneChangeAction>").unwrap();
    let end = start + SCENARIO[start..].find("</LaneChangeAction>").unwrap() + "</LaneChangeAction>".len();
    let action = format!(
        "<LaneOffsetAction {attributes}><LaneOffsetActionDynamics {dynamics}/>\
         <LaneOffsetTarget>{target}</LaneOffsetTarget></LaneOffsetAction>"
    );
    [&SCENARIO[..start], action.as_str(), &SCENARIO[end..]].concat()
}

#[test]
fn a_lane_offset_becomes_a_lateral_path_that_the_vehicle_drives() {
    const DYNAMICS: &str = "dynamicsShape=\"sinusoidal\" maxLateralAcc=\"0.3\"";
    const TARGET: &str = "<AbsoluteTargetLaneOffset value=\"0.8\"/>";
    let folder = tempfile::tempdir().unwrap();
    let (output, trace) = (folder.path().join("scenario.toml"), folder.path().join("trace.csv"));
    let path = written(folder.path(), &with_offset(DYNAMICS, TARGET, "continuous=\"false\""), ROAD);
    let said = stdout(&imported(&path, &output, &[]), 0);
    // π √(0.8 / (2 × 0.3)) = 3.628 s.
    assert!((time_of(&said, "cut-in begins") - 3.0).abs() <= 0.011, "{said}");
    assert!((time_of(&said, "cut-in ends") - 6.628).abs() <= 0.021, "{said}");
    let scenario: toml::Table = toml::from_str(&fs::read_to_string(&output).unwrap()).unwrap();
    let points: Vec<_> = scenario["actor"][1]["path"].as_array().unwrap().iter().map(numbers).collect();
    assert_eq!(points[0], [0.0, -5.25], "the centre of the lane");
    assert!((points.last().unwrap()[1] + 4.45).abs() < 1e-6, "{points:?}");
    let words = ["run", output.to_str().unwrap(), "--sensors", "ground-truth", "--trace", trace.to_str().unwrap()];
    stdout(&closecall(words), 0);
    let text = fs::read_to_string(&trace).unwrap();
    let rows: Vec<Vec<&str>> = text.lines().skip(1).map(|line| line.split(',').collect()).collect();
    let at_m = |at_s: f64| -> f64 {
        let is_it = |row: &&Vec<&str>| row[1] == "Slow_Truck" && (row[0].parse::<f64>().unwrap() - at_s).abs() < 0.021;
        rows.iter().find(is_it).unwrap()[4].parse().unwrap()
    };
    for (at_s, expected_m) in [(2.8, -5.25), (4.8, -4.85), (7.0, -4.45), (12.0, -4.45)] {
        assert!((at_m(at_s) - expected_m).abs() < 0.03, "{at_s}: {}", at_m(at_s));
    }
    fs::remove_file(&output).unwrap();
    // A vehicle can start beside the centre, too, and drives there until its lane change.
    let beside = SCENARIO.replace("ds=\"$Gap\" offset=\"0\"", "ds=\"$Gap\" offset=\"-0.5\"");
    assert_ne!(beside, SCENARIO);
    stdout(&imported(&written(folder.path(), &beside, ROAD), &output, &[]), 0);
    let scenario: toml::Table = toml::from_str(&fs::read_to_string(&output).unwrap()).unwrap();
    let points: Vec<_> = scenario["actor"][1]["path"].as_array().unwrap().iter().map(numbers).collect();
    assert_eq!(points, [[0.0, -5.75], [10.0, -5.75]]);
    json(&closecall(["run", output.to_str().unwrap(), "--sensors", "ground-truth", "--format", "json"]), 0);
    fs::remove_file(&output).unwrap();

    let relative = "<RelativeTargetLaneOffset entityRef=\"Ego\" value=\"0.5\"/>";
    let shift = with_offset(DYNAMICS, TARGET, "continuous=\"false\"");
    let second = shift[shift.find("<LateralAction>").unwrap()..shift.find("</LateralAction>").unwrap()].to_owned();
    let brake = SCENARIO.rfind("<LongitudinalAction>").unwrap();
    let brake_end = brake + SCENARIO[brake..].find("</LongitudinalAction>").unwrap() + "</LongitudinalAction>".len();
    let after_change = [&SCENARIO[..brake], second.as_str(), "</LateralAction>", &SCENARIO[brake_end..]].concat();
    for (wrong, words) in [
        (
            with_offset(&DYNAMICS.replace("sinusoidal", "linear"), TARGET, ""),
            ["`LaneOffsetActionDynamics`", "only cubic"],
        ),
        (
            with_offset("dynamicsShape=\"cubic\"", TARGET, ""),
            ["`LaneOffsetActionDynamics`", "it needs `maxLateralAcc`"],
        ),
        (
            with_offset(&DYNAMICS.replace("0.3", "0"), TARGET, ""),
            ["`LaneOffsetActionDynamics`", "is 0; a number above 0"],
        ),
        (
            with_offset(DYNAMICS, &TARGET.replace("0.8", "1.8"), ""),
            ["`AbsoluteTargetLaneOffset`", "1.8 m beside the centre of the lane; -1.75 to 1.75 m"],
        ),
        (
            with_offset(DYNAMICS, relative, "continuous=\"true\""),
            ["`LaneOffsetAction`", "follow the offset of another"],
        ),
        (after_change, ["`LaneOffsetAction`", "`Slow_Truck` changes lanes before it"]),
        (beside.replace("offset=\"-0.5\"", "offset=\"-2\""), ["`RelativeLanePosition`", "`offset` leads -2 m beside"]),
    ] {
        let refused = imported(&written(folder.path(), &wrong, ROAD), &output, &[]);
        let said = message(&refused);
        assert_eq!(code(&refused), 3, "{words:?}: {said}");
        assert!(said.contains("case.xosc:") && words.iter().all(|word| said.contains(word)), "{words:?}: {said}");
        assert!(!output.exists(), "{words:?}");
    }
}

#[test]
fn an_acceleration_is_checked_where_a_vehicle_of_the_scenario_has_it() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("scenario.toml");
    // A vehicle starts with its target speed, whatever the rate.
    let (right, hard) = ("dynamicsShape=\"step\" value=\"0\" dynamicsDimension=\"time\"", "value=\"1e9\"");
    let rate = format!("dynamicsShape=\"linear\" {hard} dynamicsDimension=\"rate\"");
    assert!(SCENARIO.contains(right));
    let path = written(folder.path(), &SCENARIO.replacen(right, &rate, 1), ROAD);
    let said = stdout(&imported(&path, &output, &[]), 0);
    assert!(said.contains("`Ego` starts with the target speed"), "{said}");
    fs::remove_file(&output).unwrap();
    // The controller drives the ego, whatever its actions ask for.
    let (right, hard) = ("value=\"2\" dynamicsDimension=\"rate\"", "value=\"40\" dynamicsDimension=\"rate\"");
    assert!(SCENARIO.contains(right));
    let path = written(folder.path(), &SCENARIO.replacen(right, hard, 1), ROAD);
    let refused = imported(&path, &output, &[]);
    assert_eq!(code(&refused), 3);
    assert!(message(&refused).contains("-40.00 m/s²; -12 to 12 m/s² are possible"), "{}", message(&refused));
    assert!(!output.exists());
    stdout(&imported(&path, &output, &["--ego", "Slow_Truck"]), 0);
    assert!(output.exists());
}

/// Returns a lane section on the right of a road.
fn lane_section(s_m: u32, lanes: &[(i32, &str, &str)]) -> String {
    let lane = |(id, kind, rest): &(i32, &str, &str)| format!("<lane id=\"{id}\" type=\"{kind}\">{rest}</lane>");
    let lanes: String = lanes.iter().map(lane).collect();
    format!("<laneSection s=\"{s_m}\"><right>{lanes}</right></laneSection>")
}

#[test]
fn a_ramp_beside_a_shoulder_lies_where_the_file_has_it() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("scenario.toml");
    const LANE: &str = "<width sOffset=\"0\" a=\"3.5\"/>";
    const ENDS: &str = "<width sOffset=\"400\" a=\"3.5\" c=\"-0.00105\" d=\"7e-6\"/>";
    let imported_with = |widths: &str| {
        let with_ramp = [(-1, "driving", LANE), (-2, "driving", LANE), (-3, "entry", widths), (-4, "shoulder", LANE)];
        let after = lane_section(1_000, &[(-1, "driving", LANE), (-2, "driving", LANE), (-3, "shoulder", LANE)]);
        let sections = format!("</laneSection>{}{after}", lane_section(500, &with_ramp));
        let road = ROAD.replacen("</laneSection>", &sections, 1);
        let said = stdout(&imported(&written(folder.path(), SCENARIO, &road), &output, &[]), 0);
        assert!(!said.contains("between its lanes"), "{said}");
        (said, fs::read_to_string(&output).unwrap())
    };
    let rises =
        "<width sOffset=\"0\" a=\"0\" c=\"0.001640625\" d=\"-1.3671875e-05\"/><width sOffset=\"80\" a=\"3.5\"/>";
    let (_, text) = imported_with(&format!("{rises}{ENDS}"));
    assert!(text.contains("acceleration-lane = { from-m = 580.0, length-m = 320.0, taper-m = 100.0 }"), "{text}");
    // It has no width at first.
    let later = rises.replace("\"0\" a=", "\"50\" a=").replace("\"80\"", "\"130\"");
    let (_, text) = imported_with(&format!("<width sOffset=\"0\" a=\"0\"/>{later}{ENDS}"));
    assert!(text.contains("acceleration-lane = { from-m = 630.0, length-m = 270.0, taper-m = 100.0 }"), "{text}");
    // It becomes wider on its way, as no acceleration lane of a scenario does.
    let widens = "<width sOffset=\"200\" a=\"3.5\" b=\"0.005\"/><width sOffset=\"300\" a=\"4\"/>\
                  <width sOffset=\"400\" a=\"4\" c=\"-0.0012\" d=\"8e-6\"/>";
    let (said, text) = imported_with(&format!("{rises}{widens}"));
    assert!(text.contains("cross-sections") && !text.contains("acceleration-lane"), "{text}");
    assert!(said.contains("lanes whose width or place changes"), "{said}");
}

#[test]
fn a_lane_that_gets_another_number_where_nothing_moves_is_the_same_lane() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("scenario.toml");
    // A median ends, and the offset of the lanes takes its place.
    let lane = |before: i32| format!("<link><predecessor id=\"{before}\"/></link><width sOffset=\"0\" a=\"3.5\"/>");
    let (full, [first, second]) = ("<width sOffset=\"0\" a=\"3.5\"/>", [-2, -3].map(lane));
    let median = "<width sOffset=\"0\" a=\"2\"/>";
    let sections = lane_section(0, &[(-1, "median", median), (-2, "driving", full), (-3, "driving", full)])
        + &lane_section(500, &[(-1, "driving", &first), (-2, "driving", &second)]);
    let (before, rest) = ROAD.split_once("<laneSection").unwrap();
    let (_, after) = rest.split_once("</laneSection>").unwrap();
    let offset = "<laneOffset s=\"0\" a=\"0\"/><laneOffset s=\"500\" a=\"-2\"/>";
    let road = format!("{before}{offset}{sections}{after}");
    let scenario = SCENARIO.replace("laneId=\"-1\"", "laneId=\"-2\"");
    let said = stdout(&imported(&written(folder.path(), &scenario, &road), &output, &[]), 0);
    assert!(said.contains("lanes that get another number"), "{said}");
    let run = ["run", output.to_str().unwrap(), "--sensors", "ground-truth"];
    stdout(&closecall(run), 0);
}

#[test]
fn a_wrong_road_is_refused_with_file_line_and_element() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("scenario.toml");
    let faults: [(&str, &str, &str); 33] = [
        ("<OpenDRIVE>", "<OpenStreet>", "it is not an XML"),
        ("</OpenDRIVE>", "", "ends before its root element"),
        ("OpenDRIVE", "Roads", "`OpenDRIVE`"),
        ("id=\"1\"", "id=\"2\"", "no road `1`"),
        ("id=\"1\"", "", "no road `1`"),
        ("<planView>", "<planView><planView>", "not an XML"),
        ("planView", "plan", "no `planView`"),
        ("curvature=\"0.001\"", "", "needs `curvature`"),
        ("curvature=\"0.001\"", "curvature=\"round\"", "`curvature` is `round`"),
        ("curvature=\"0.001\"", "curvature=\"inf\"", "`curvature` is `inf`"),
        ("<arc curvature=\"0.001\"/>", "", "`geometry`: its first element must be its shape, one of line, arc, spiral"),
        ("lanes>", "ways>", "no `lanes`"),
        ("laneSection", "section", "no `laneSection`"),
        ("right>", "left>", "lanes on the `left` have numbers above 0"),
        ("type=\"driving\"", "type=\"walking\"", "not a driving lane"),
        ("id=\"-1\"", "id=\"one\"", "`id` is `one`"),
        ("a=\"3.5\"", "", "needs `a`"),
        ("a=\"3.5\"", "a=\"wide\"", "`a` is `wide`"),
        ("<width sOffset=\"0\" a=\"3.5\" b=\"0\" c=\"0\" d=\"0\"/>", "", "no `width`"),
        ("a=\"3.5\"", "a=\"35\"", "at 50 m it is 35; a lane"),
        ("a=\"3.5\"", "a=\"-3\"", "`width`: `a` is -3; a width has 0 to 100 m"),
        ("curvature=\"0.001\"", "curvature=\"1e9\"", "`arc`: `curvature` is beyond 0.2 1/m"),
        ("<road ", "<road id=\"1\"/><road ", "`road`: a road before it has the number `1` already"),
        ("length=\"", "length=\"-", "`length` is -"),
        ("id=\"-2\"", "id=\"-1\"", "a lane before it has the number -1 already"),
        ("hdg=\"0\"", "hdg=\"abc\"", "road.xodr:6: `geometry`: `hdg` is `abc`"),
        ("<geometry s=\"0\"", "<geometry s=\"nan\"", "road.xodr:6: `geometry`: `s` is `nan`"),
        ("max=\"120\"", "max=\"fast\"", "road.xodr:5: `speed`: `max` is `fast`"),
        ("max=\"120\"", "max=\"-360\"", "`max` is -360 km/h; 0 to 100 m/s are needed, or `no limit`"),
        ("unit=\"km/h\"", "unit=\"knots\"", "`unit` is `knots`; one of m/s, km/h, mph"),
        ("a=\"2.5\"", "a=\"nan\"", "`width`: `a` is `nan`"),
        ("id=\"-3\"", "id=\"-3.5\"", "`lane`: `id` is -3.5; a whole number"),
        ("junction=\"-1\"", "junction=\"-1\" rule=\"UK\"", "`rule` is `UK`; one of RHT, LHT"),
    ];
    for (right, wrong, word) in faults {
        assert!(ROAD.contains(right), "{right}");
        let road = match word {
            "`OpenDRIVE`"
            | "no `planView`"
            | "no `lanes`"
            | "no `laneSection`"
            | "lanes on the `left` have numbers above 0"
            | "not a driving lane"
            | "at 50 m it is 35; a lane" => ROAD.replace(right, wrong),
            _ => ROAD.replacen(right, wrong, 1),
        };
        let refused = imported(&written(folder.path(), SCENARIO, &road), &output, &[]);
        let said = message(&refused);
        assert_eq!(code(&refused), 3, "{wrong}: {said}");
        assert!(said.contains(word), "{wrong}: {word}: {said}");
        // A position that names no road or no lane is an error of the scenario.
        let is_of_scenario = word.starts_with("no road") || word == "not a driving lane";
        assert!(said.contains(if is_of_scenario { "case.xosc:42: `LanePosition`" } else { "road.xodr:" }), "{said}");
        assert!(!output.exists(), "{wrong}");
    }
}

#[test]
fn a_wrong_vehicle_of_a_catalogue_is_an_error_of_the_catalogue() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("scenario.toml");
    let start = SCENARIO.find("<Vehicle name=\"truck\"").unwrap();
    let end = start + SCENARIO[start..].find("</Vehicle>").unwrap() + "</Vehicle>".len();
    let locations =
        "<CatalogLocations><VehicleCatalog><Directory path=\"catalogs\"/></VehicleCatalog></CatalogLocations>";
    let reference = "<CatalogReference catalogName=\"cars\" entryName=\"truck\"/>";
    let scenario = [&SCENARIO[..start], reference, &SCENARIO[end..]].concat().replace("<CatalogLocations/>", locations);
    let vehicle = SCENARIO[start..end].replace("<Vehicle ", "<Vehicle\n");
    let catalog = format!("<OpenSCENARIO>\n<Catalog name=\"cars\">\n{vehicle}</Catalog></OpenSCENARIO>");
    let path = written(folder.path(), &scenario, ROAD);
    fs::create_dir(folder.path().join("catalogs")).unwrap();
    let catalog_path = folder.path().join("catalogs/cars.xosc");
    fs::write(&catalog_path, &catalog).unwrap();
    stdout(&imported(&path, &output, &[]), 0);
    fs::remove_file(&output).unwrap();
    for (right, wrong, words) in [
        ("length=\"12\"", "length=\"120\"", ["cars.xosc:7: `Dimensions`", "`length` is 120; 1 to 26 m"]),
        ("x=\"4\"", "x=\"-1e9\"", ["cars.xosc:6: `Center`", "`x` is -1000000000; -12 to 12 m"]),
        ("name=\"truck\"", "mass=\"1e9\" name=\"truck\"", ["cars.xosc:3: `Vehicle`", "100 to 60000 kg"]),
        ("maxSteering=\"0\"", "maxSteering=\"-1\"", ["cars.xosc:10: `RearAxle`", "at least 0"]),
    ] {
        assert!(catalog.contains(right), "{right}");
        fs::write(&catalog_path, catalog.replacen(right, wrong, 1)).unwrap();
        let refused = imported(&path, &output, &[]);
        assert_eq!(code(&refused), 3, "{wrong}");
        assert!(words.iter().all(|word| message(&refused).contains(word)), "{}", message(&refused));
        assert!(!output.exists(), "{wrong}");
    }
}

#[test]
fn an_action_ends_with_its_event_so_that_a_condition_sees_it() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("scenario.toml");
    let by_action = SCENARIO.replacen(
        "storyboardElementType=\"event\" storyboardElementRef=\"cut-in\"",
        "storyboardElementType=\"action\" storyboardElementRef=\"cut-in-action\"",
        1,
    );
    assert!(by_action != SCENARIO);
    let said = stdout(&imported(&written(folder.path(), &by_action, ROAD), &output, &[]), 0);
    assert!((time_of(&said, "brake begins") - 7.5).abs() <= 0.021, "{said}");
}

/// Returns a trigger by the state of an element.
fn by_state(kind: &str, path: &str, state: &str) -> String {
    format!(
        "<StoryboardElementStateCondition storyboardElementType=\"{kind}\" storyboardElementRef=\"{path}\" \
         state=\"{state}\"/>"
    )
}

/// Returns the scenario with a further manoeuvre, whose event `brake` begins by a condition and
/// slows the truck down by 2 m/s in 2 s.
fn with_second_brake(condition: &str) -> String {
    let maneuver = format!(
        "<Maneuver name=\"later\"><Event name=\"brake\" priority=\"parallel\" maximumExecutionCount=\"1\">\
         <Action name=\"brake-action\"><PrivateAction><LongitudinalAction><SpeedAction>\
         <SpeedActionDynamics dynamicsShape=\"linear\" value=\"2\" dynamicsDimension=\"time\"/>\
         <SpeedActionTarget><AbsoluteTargetSpeed value=\"8\"/></SpeedActionTarget>\
         </SpeedAction></LongitudinalAction></PrivateAction></Action><StartTrigger><ConditionGroup>\
         <Condition name=\"then\" delay=\"1\" conditionEdge=\"none\"><ByValueCondition>{condition}</ByValueCondition>\
         </Condition></ConditionGroup></StartTrigger></Event></Maneuver>"
    );
    let text = SCENARIO.replacen("        </ManeuverGroup>", &format!("{maneuver}</ManeuverGroup>"), 1);
    assert!(text != SCENARIO);
    text
}

#[test]
fn elements_with_one_name_have_states_of_their_own() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("scenario.toml");
    // The act has the name of an event, and goes on when the event ends.
    let text = SCENARIO.replacen("<Act name=\"act\">", "<Act name=\"cut-in\">", 1);
    let said = stdout(&imported(&written(folder.path(), &text, ROAD), &output, &[]), 0);
    assert!((time_of(&said, "brake begins") - 7.5).abs() <= 0.021, "{said}");
    // The first event `brake` ends at 12.5 s, and the second one ends by itself.
    for path in ["maneuver::brake", "story::act::group::maneuver::brake"] {
        let text = with_second_brake(&by_state("event", path, "completeState"));
        let said = stdout(&imported(&written(folder.path(), &text, ROAD), &output, &[]), 0);
        assert!((time_of(&said, " maneuver ends") - 12.5).abs() <= 0.031, "{said}");
        assert!((time_of(&said, "later ends") - 15.5).abs() <= 0.041, "{said}");
        assert_eq!(said.matches("brake ends").count(), 2, "{said}");
    }
    let text = with_second_brake(&by_state("event", "brake", "completeState"));
    let refused = imported(&written(folder.path(), &text, ROAD), &output, &[]);
    assert_eq!(code(&refused), 3);
    let word = "`brake` is the name of 2 elements: one of them is the event `story::act::group::maneuver::brake`";
    assert!(message(&refused).contains(word), "{}", message(&refused));
}

#[test]
fn what_stands_around_events_ends_with_the_last_of_them() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("scenario.toml");
    let act = |name: &str, group: &str, condition: &str| {
        let text = with_second_brake(condition);
        let maneuver = text.split_once("<Maneuver name=\"later\">").unwrap().1.split_once("</Maneuver>").unwrap().0;
        format!(
            "<Act name=\"{name}\"><ManeuverGroup name=\"{group}\" maximumExecutionCount=\"1\">\
             <Actors selectTriggeringEntities=\"false\"><EntityRef entityRef=\"Slow_Truck\"/></Actors>\
             <Maneuver name=\"later\">{maneuver}</Maneuver></ManeuverGroup><StartTrigger/></Act>"
        )
    };
    for (kind, name) in [("maneuverGroup", "group"), ("act", "act"), ("story", "story")] {
        let second = act("second", "others", &by_state(kind, name, "completeState"));
        let text =
            SCENARIO.replacen("    <StopTrigger>", &format!("<Story name=\"more\">{second}</Story><StopTrigger>"), 1);
        assert!(text != SCENARIO);
        let said = stdout(&imported(&written(folder.path(), &text, ROAD), &output, &[]), 0);
        assert!((time_of(&said, "later ends") - 15.5).abs() <= 0.061, "{kind}: {said}");
    }
}

#[test]
fn a_place_of_the_road_triggers_by_distance_time_and_arrival() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("scenario.toml");
    let headway =
        "<TimeHeadwayCondition entityRef=\"Slow_Truck\" value=\"$Headway\" freespace=\"false\" rule=\"lessThan\"/>";
    let place = |lane: i32| format!("<Position><LanePosition roadId=\"1\" laneId=\"{lane}\" s=\"230\"/></Position>");
    let along = "coordinateSystem=\"road\" relativeDistanceType=\"longitudinal\"";
    // The ego drives 30 m/s from 50 m on; its front is 3.7 m ahead of its reference point.
    let conditions = [
        (
            format!(
                "<DistanceCondition value=\"30\" freespace=\"false\" rule=\"lessThan\">{}</DistanceCondition>",
                place(-1)
            ),
            5.0,
        ),
        (
            format!(
                "<DistanceCondition value=\"30\" freespace=\"true\" rule=\"lessThan\" {along}>{}</DistanceCondition>",
                place(-2)
            ),
            (150.0 - 3.7) / 30.0,
        ),
        // The centres of the lanes are 3.5 m apart.
        (
            format!(
                "<DistanceCondition value=\"4\" freespace=\"false\" rule=\"lessThan\">{}</DistanceCondition>",
                place(-2)
            ),
            (180.0 - (16.0_f64 - 3.5 * 3.5).sqrt()) / 30.0,
        ),
        (format!("<ReachPositionCondition tolerance=\"6\">{}</ReachPositionCondition>", place(-1)), 174.0 / 30.0),
        (
            format!(
                "<TimeToCollisionCondition value=\"2\" freespace=\"false\" rule=\"lessThan\">\
                 <TimeToCollisionConditionTarget>{}</TimeToCollisionConditionTarget></TimeToCollisionCondition>",
                place(-1)
            ),
            4.0,
        ),
    ];
    for (condition, expected_s) in conditions {
        let text = SCENARIO.replacen(headway, &condition, 1);
        assert!(text != SCENARIO);
        let said = stdout(&imported(&written(folder.path(), &text, ROAD), &output, &[]), 0);
        assert!((time_of(&said, "cut-in begins") - expected_s).abs() <= 0.021, "{condition}: {expected_s} s: {said}");
    }
}

#[test]
fn a_speed_follows_the_shape_of_its_action() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("scenario.toml");
    let linear = "dynamicsShape=\"linear\" value=\"2\" dynamicsDimension=\"rate\"";
    // After a quarter of the time, the share of the change is 1/4, 5/32 and (1 - cos 45°) / 2.
    for (shape, share) in [("linear", 0.25), ("cubic", 0.15625), ("sinusoidal", 0.146_446_6)] {
        let text =
            SCENARIO.replacen(linear, &format!("dynamicsShape=\"{shape}\" value=\"8\" dynamicsDimension=\"time\""), 1);
        let said = stdout(&imported(&written(folder.path(), &text, ROAD), &output, &[]), 0);
        let begins_s = time_of(&said, "brake begins");
        let scenario: toml::Table = toml::from_str(&fs::read_to_string(&output).unwrap()).unwrap();
        let profile = scenario["actor"][1]["driver"]["prescribed"]["profile"].as_array().unwrap();
        let points: Vec<[f64; 2]> =
            profile.iter().map(|point| [0, 1].map(|index| point[index].as_float().unwrap())).collect();
        let pair = points.windows(2).find(|pair| pair[1][0] >= begins_s + 2.0).unwrap();
        let [[t0, v0], [t1, v1]] = [pair[0], pair[1]];
        let speed_mps = v0 + (v1 - v0) * (begins_s + 2.0 - t0) / (t1 - t0);
        assert!((speed_mps - (20.0 - 10.0 * share)).abs() < 0.02, "{shape}: {speed_mps} m/s");
    }
}

#[test]
fn the_controllers_of_a_file_are_named_as_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("scenario.toml");
    let controller = "<ObjectController><Controller name=\"driver\"><Properties/></Controller></ObjectController>";
    let text = SCENARIO.replace("    </ScenarioObject>", &format!("{controller}</ScenarioObject>"));
    assert_eq!(text.matches(controller).count(), 2);
    let said = stdout(&imported(&written(folder.path(), &text, ROAD), &output, &[]), 0);
    assert!(said.contains("line 24: the controller of `Ego`: the controller under test drives instead"), "{said}");
    assert!(said.contains("line 35: the controller of `Slow_Truck`: it drives as the actions say"), "{said}");
}

/// A scenario with a second act, in which the truck slows down from 4 s on. Its manoeuvre has
/// the name of the first act's. The first act stops at 5 s, within the lane change.
fn with_two_acts() -> String {
    let trigger = |kind: &str, name: &str, time_s: u32| {
        format!(
            "<{kind}><ConditionGroup><Condition name=\"{name}\" delay=\"0\" conditionEdge=\"none\"><ByValueCondition>\
             <SimulationTimeCondition value=\"{time_s}\" rule=\"greaterOrEqual\"/></ByValueCondition></Condition>\
             </ConditionGroup></{kind}>"
        )
    };
    let action = "<PrivateAction><LongitudinalAction><SpeedAction>\
                  <SpeedActionDynamics dynamicsShape=\"linear\" value=\"8\" dynamicsDimension=\"time\"/>\
                  <SpeedActionTarget><AbsoluteTargetSpeed value=\"12\"/></SpeedActionTarget>\
                  </SpeedAction></LongitudinalAction></PrivateAction>";
    let second = format!(
        "<Act name=\"second\"><ManeuverGroup name=\"slower\" maximumExecutionCount=\"1\">\
         <Actors selectTriggeringEntities=\"false\"><EntityRef entityRef=\"Slow_Truck\"/></Actors>\
         <Maneuver name=\"maneuver\"><Event name=\"slow-down\" priority=\"overwrite\" maximumExecutionCount=\"1\">\
         <Action name=\"slow-down-action\">{action}</Action>{}</Event></Maneuver></ManeuverGroup>{}</Act>",
        trigger("StartTrigger", "slow", 4),
        trigger("StartTrigger", "second-begins", 0)
    );
    let text = SCENARIO.replacen("      </Act>", &format!("{}</Act>{second}", trigger("StopTrigger", "stop", 5)), 1);
    assert!(text != SCENARIO);
    text
}

#[test]
fn the_stop_trigger_of_an_act_ends_the_events_of_that_act_alone() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("scenario.toml");
    let said = stdout(&imported(&written(folder.path(), &with_two_acts(), ROAD), &output, &[]), 0);
    // An event overwrites the others of its manoeuvre, and none of another manoeuvre with the same name.
    assert!((time_of(&said, "slow-down begins") - 4.0).abs() <= 0.011, "{said}");
    assert!((time_of(&said, "cut-in ends") - 5.0).abs() <= 0.021, "{said}");
    assert!(said.contains("`cut-in` ends at 5.00 s within its lane change"), "{said}");
    assert!(!said.contains("brake begins"), "the act of this event has stopped: {said}");
    assert!((time_of(&said, "slow-down ends") - 12.0).abs() <= 0.021, "{said}");
    let text = fs::read_to_string(&output).unwrap();
    let scenario: toml::Table = toml::from_str(&text).unwrap();
    let profile = scenario["actor"][1]["driver"]["prescribed"]["profile"].as_array().unwrap();
    let lowest = profile.iter().map(|point| point[1].as_float().unwrap()).fold(f64::INFINITY, f64::min);
    assert!((lowest - 12.0).abs() < 1e-6, "{text}");
}

#[test]
fn thousands_of_parameters_do_not_slow_the_storyboard() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("scenario.toml");
    let declarations = |letter: char| {
        (1..8_000)
            .map(|number| {
                let before = number - 1;
                format!(
                    "<ParameterDeclaration name=\"{letter}{number}\" parameterType=\"double\" \
                     value=\"${{${letter}{before} + 0}}\"/>\n"
                )
            })
            .collect::<String>()
    };
    let first = |letter: char, value: &str| {
        format!("<ParameterDeclaration name=\"{letter}0\" parameterType=\"double\" value=\"{value}\"/>")
    };
    let outer = format!("<ParameterDeclarations>{}{}", first('p', "1.0"), declarations('p'));
    let inner = format!(
        "<Story name=\"story\"><ParameterDeclarations>{}{}</ParameterDeclarations>",
        first('q', "$p7999"),
        declarations('q')
    );
    let many = SCENARIO
        .replacen("<ParameterDeclarations>", &outer, 1)
        .replacen("<Story name=\"story\">", &inner, 1)
        .replacen("value=\"$Headway\"", "value=\"$q7999\"", 1);
    let said = stdout(&imported(&written(folder.path(), &many, ROAD), &output, &[]), 0);
    assert!((time_of(&said, "cut-in begins") - 3.0).abs() <= 0.011, "{said}");
}

#[test]
fn an_entity_bomb_is_refused_before_it_grows() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("scenario.toml");
    let bomb = format!(
        "<!DOCTYPE OpenSCENARIO [<!ENTITY a \"{}\">{}]>",
        "lol".repeat(100),
        (1..10)
            .map(|level| format!("<!ENTITY a{level} \"{}\">", format!("&a{};", level - 1).repeat(10)))
            .collect::<String>()
    );
    let with_bomb = SCENARIO.replacen("<OpenSCENARIO>", &format!("{bomb}<OpenSCENARIO>"), 1);
    let refused = imported(&written(folder.path(), &with_bomb, ROAD), &output, &[]);
    assert_eq!(code(&refused), 3);
    assert!(message(&refused).contains("document type declaration"), "{}", message(&refused));
    // Without its declaration, the name has no value.
    let with_name = SCENARIO.replacen("a cut-in, for tests", "&a9;", 1);
    let refused = imported(&written(folder.path(), &with_name, ROAD), &output, &[]);
    assert_eq!(code(&refused), 3);
    assert!(message(&refused).contains("FileHeader"), "{}", message(&refused));
    let deep = format!("{}{}", "<a>".repeat(100_000), "</a>".repeat(100_000));
    let refused = imported(&written(folder.path(), &deep, ROAD), &output, &[]);
    assert_eq!(code(&refused), 3);
    assert!(message(&refused).contains("200 levels"), "{}", message(&refused));
    assert!(!output.exists());
}

#[test]
fn a_place_beyond_the_edge_of_a_lane_lies_in_the_lane_beside_it() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("scenario.toml");
    // 3.3 m to the left of the centre of lane -2, which lies 5.25 m to the right of the edge.
    let beside = SCENARIO.replace("ds=\"$Gap\" offset=\"0\"", "ds=\"$Gap\" offset=\"3.3\"");
    assert_ne!(beside, SCENARIO);
    // It starts in the ego's lane, and changes to the lane to its right.
    let target = "RelativeTargetLane entityRef=\"Ego\" value=";
    let beside = beside.replace(&format!("{target}\"0\""), &format!("{target}\"-1\""));
    stdout(&imported(&written(folder.path(), &beside, ROAD), &output, &[]), 0);
    let scenario: toml::Table = toml::from_str(&fs::read_to_string(&output).unwrap()).unwrap();
    let truck = &scenario["actor"][1];
    assert_eq!(truck["start"]["absolute"]["lane"].as_integer(), Some(1));
    let [_, d_m] = numbers(&truck["path"][0])[..] else { panic!("{truck}") };
    assert!((d_m + 1.95).abs() < 1e-9, "{d_m}");
    fs::remove_file(&output).unwrap();
    for (offset, reach) in [("5.3", "from -1.75 to 5.25 m beside it"), ("-1.8", "from -1.75 to 5.25 m beside it")] {
        let wrong = beside.replace("\"3.3\"", &format!("\"{offset}\""));
        let refused = imported(&written(folder.path(), &wrong, ROAD), &output, &[]);
        assert_eq!(code(&refused), 3, "{offset}: {}", message(&refused));
        assert!(message(&refused).contains(reach), "{offset}: {}", message(&refused));
        assert!(!output.exists());
    }
}

/// The road of an imported scenario.
fn road_of(scenario: &Path) -> toml::Value {
    toml::from_str::<toml::Table>(&fs::read_to_string(scenario).unwrap()).unwrap()["road"].clone()
}

/// Returns the road with a lane section from `at_m` on that has the lanes with these numbers.
fn with_second_section(at_m: f64, lanes: &[i32]) -> String {
    let width = "<width sOffset=\"0\" a=\"3.5\" b=\"0\" c=\"0\" d=\"0\"/>";
    let lane = |id: &i32| format!("<lane id=\"{id}\" type=\"driving\" level=\"false\">{width}</lane>");
    let lanes: String = lanes.iter().map(lane).collect();
    let section = format!("<laneSection s=\"{at_m}\"><right>{lanes}</right></laneSection></lanes>");
    ROAD.replacen("</lanes>", &section, 1)
}

#[test]
fn a_vehicle_drives_only_where_the_road_has_its_lane() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("scenario.toml");
    let of = |road: &str| imported(&written(folder.path(), SCENARIO, road), &output, &[]);
    // The truck leaves lane -2 at 3 s, 170 m along the road.
    let said = stdout(&of(&with_second_section(400.0, &[-1])), 0);
    let note =
        "lanes that begin or end (a boundary jumps by 3.50 m at 400 m): the lane section at 50 m gives the lanes";
    assert!(said.contains(note), "{said}");
    assert_eq!(road_of(&output)["lanes"].as_integer(), Some(2));
    json(&closecall(["run", output.to_str().unwrap(), "--sensors", "ground-truth", "--format", "json"]), 0);
    // A lane that begins before the vehicles is there, and a section with the same lanes needs no note.
    let begins = with_second_section(20.0, &[-1, -2, -3]);
    let said = stdout(&of(&begins), 0);
    assert!(said.contains("lanes that begin or end"), "{said}");
    assert_eq!(road_of(&output)["lanes"].as_integer(), Some(3));
    assert!(!stdout(&of(&with_second_section(400.0, &[-1, -2])), 0).contains("begin or end"));
    fs::remove_file(&output).unwrap();
    let renumbered = with_second_section(150.0, &[-1, -2, -3]).replacen(
        "level=\"false\"><width",
        "level=\"false\"><link><successor id=\"-2\"/></link><width",
        1,
    );
    for (road, place, why) in [
        (with_second_section(150.0, &[-1]), "case.xosc:", "`Slow_Truck` drives in lane -2 at 2.0"),
        (with_second_section(80.0, &[-1]), "case.xosc:", "drives in lane -2 at 0.00 s, 110.0 m along the road"),
        (with_second_section(400.0, &[-2]), "case.xosc:", "`Ego` drives in lane -1 at "),
        (renumbered, "road.xodr:11: `successor`", "lane -1 goes on as lane -2"),
    ] {
        let refused = of(&road);
        let said = message(&refused);
        assert_eq!(code(&refused), 3, "{why}: {said}");
        assert!(said.contains(place) && said.contains(why), "{why}: {said}");
        assert!(!output.exists(), "{why}");
    }
}

#[test]
fn the_lanes_have_the_widths_and_places_of_the_file_and_the_road_one_limit() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("scenario.toml");
    let of = |road: &str| imported(&written(folder.path(), SCENARIO, road), &output, &[]);
    // From 3.5 m to 3.25 m over 40 m.
    let narrows = "<width sOffset=\"0\" a=\"3.5\" b=\"-0.00625\" c=\"0\" d=\"0\"/>\
                   <width sOffset=\"40\" a=\"3.25\" b=\"0\" c=\"0\" d=\"0\"/>";
    let road = ROAD.replace("<width sOffset=\"0\" a=\"3.5\" b=\"0\" c=\"0\" d=\"0\"/>", narrows);
    assert_ne!(road, ROAD);
    let said = stdout(&of(&road), 0);
    assert!(!said.contains("lanes whose width") && !said.contains("lanes of other widths"), "{said}");
    assert_eq!(road_of(&output).get("lane-width-m"), None);
    let sections = |text: &str| toml::from_str::<toml::Table>(text).unwrap()["cross-sections"].clone();
    let expected = "cross-sections = [{ s-m = 0.0, widths-m = [3.5, 3.5] }, { s-m = 40.0, widths-m = [3.25, 3.25] }, \
                    { s-m = 3000.0, widths-m = [3.25, 3.25] }]";
    assert_eq!(road_of(&output)["cross-sections"], sections(expected));
    // Lanes that become too wide have the widths of the start.
    let said = stdout(&of(&road.replace("a=\"3.25\"", "a=\"3.25\" b=\"0.001\"").replace(" b=\"0\" c", " c")), 0);
    let note = "lanes whose width changes (lane -1 is up to 6.21 m wide, and 2.5 to 5 m are allowed): each has the width at 50 m";
    assert!(said.contains(note), "{said}");

    let speed = "<speed sOffset=\"0\" max=\"80\" unit=\"km/h\"/></lane>";
    let said =
        stdout(&of(&ROAD.replacen("</lane>\n          <lane id=\"-2\"", &format!("{speed}<lane id=\"-2\""), 1)), 0);
    assert!(said.contains("the road has speed limits that change from place to place"), "{said}");
    assert!((road_of(&output)["speed-limit-mps"].as_float().unwrap() - 120.0 / 3.6).abs() < 1e-9);
    let offset = "<lanes><laneOffset s=\"0\" a=\"0\" b=\"0.01\" c=\"0\" d=\"0\"/>";
    let said = stdout(&of(&ROAD.replacen("<lanes>", offset, 1)), 0);
    assert!(!said.contains("offset"), "{said}");
    let expected = "cross-sections = [{ s-m = 0.0, widths-m = [3.5, 3.5], left-edge-d-m = -30.0 }, \
                    { s-m = 3000.0, widths-m = [3.5, 3.5] }]";
    assert_eq!(road_of(&output)["cross-sections"], sections(expected));
    assert_eq!(road_of(&output)["alignment-d-m"].as_float(), Some(-30.0));
    fs::remove_file(&output).unwrap();
    for (wrong, word) in [
        (road.replace("a=\"3.25\"", "a=\"2.25\""), "`width`: at 50 m it is 2.25; a lane of a scenario has a width of"),
        (ROAD.replacen("</lane>", &speed.replace("80", "fast"), 2), "`speed`: `max` is `fast`"),
    ] {
        let refused = of(&wrong);
        assert_eq!(code(&refused), 3, "{word}: {}", message(&refused));
        assert!(message(&refused).contains(word), "{word}: {}", message(&refused));
        assert!(!output.exists());
    }
}

#[test]
fn lanes_beside_the_reference_line_keep_their_distance_from_it() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("scenario.toml");
    let offset = "<lanes><laneOffset s=\"0\" a=\"-2.75\" b=\"0\" c=\"0\" d=\"0\"/>";
    let road = ROAD.replacen("<lanes>", offset, 1).replacen("curvature=\"0.001\"", "curvature=\"0.004\"", 1);
    let said = stdout(&imported(&written(folder.path(), SCENARIO, &road), &output, &[]), 0);
    let of_the_road: Vec<&str> = said.lines().map(str::trim).filter(|line| line.starts_with("the road ")).collect();
    assert_eq!(of_the_road, ["the road has lanes that a scenario does not have: `shoulder`"], "{said}");
    assert_eq!(alignment_of(&output), [[0.0, 0.004], [3_000.0, 0.004]]);
    assert_eq!(road_of(&output)["alignment-d-m"].as_float(), Some(2.75));
    json(&closecall(["run", output.to_str().unwrap(), "--sensors", "object", "--format", "json"]), 0);
    // The road comes back from an export: the same line, and the same distance of the lanes.
    let case = folder.path().join("case");
    let words =
        ["tool", "export", output.to_str().unwrap(), "--sensors", "ground-truth", "--form", "closed-loop", "-o"];
    stdout(&closecall([&words[..], &[case.to_str().unwrap()]].concat()), 0);
    let back = folder.path().join("back.toml");
    stdout(&imported(&case.join("closed-loop.xosc"), &back, &[]), 0);
    assert!(alignment_of(&back).iter().all(|[_, curvature_per_m]| (curvature_per_m - 0.004).abs() < 1e-12));
    assert_eq!(road_of(&back)["alignment-d-m"].as_float(), Some(2.75));
    // A tighter curve is said to be straight, as a reference line that is far away.
    for (right, wrong, note) in [
        (
            "0.004",
            "0.0041",
            "a curvature of up to 0.0041 1/m, and a scenario has up to 0.004 1/m: the road is straight",
        ),
        ("-2.75", "-60", "a reference line 60 m beside its lanes, and -50 to 50 m are possible: the road is straight"),
    ] {
        let said = stdout(&imported(&written(folder.path(), SCENARIO, &road.replace(right, wrong)), &output, &[]), 0);
        assert!(said.contains(note), "{said}");
    }
}

/// The scenarios of others that are imported; all others are refused, each at a line and an
/// element.
const IMPORTED: [&str; 11] = [
    "alks_decelerate",
    "cut-in",
    "highway_driver",
    "slow-lead-vehicle",
    "alks_scenario_4_1_1_free_driving_template",
    "alks_scenario_4_1_2_swerving_lead_vehicle_template",
    "alks_scenario_4_1_3_side_vehicle_template",
    "alks_scenario_4_3_1_follow_lead_vehicle_comfortable_template",
    "alks_scenario_4_3_2_follow_lead_vehicle_emergency_brake_template",
    "alks_scenario_4_4_1_cut_in_no_collision_template",
    "alks_scenario_4_4_2_cut_in_unavoidable_collision_template",
];

#[test]
fn each_scenario_of_others_is_imported_and_runs_or_is_refused_by_name() {
    let Some(data) = closecall_testing::data() else { return };
    let folders = ["esmini_openx/xosc", "osc_alks/concrete_scenarios", "osc_alks"].map(|name| data.join(name));
    if folders.iter().any(|folder| !folder.is_dir()) {
        closecall_testing::skip(closecall_testing::Need::Data, "CLOSECALL_DATA has no esmini_openx and osc_alks");
        return;
    }
    let work = tempfile::tempdir().unwrap();
    let output = work.path().join("scenario.toml");
    let (mut ran, mut refused) = (Vec::new(), 0);
    for folder in folders {
        let entries = fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path());
        for path in entries.filter(|path| path.extension().is_some_and(|end| end == "xosc")) {
            let _ = fs::remove_file(&output);
            let result = imported(&path, &output, &[]);
            let stem = path.file_stem().unwrap().to_string_lossy().into_owned();
            if code(&result) == 0 {
                let scenario = output.to_str().unwrap();
                let run = ["run", scenario, "--sensors", "ground-truth", "--set", "duration-s=25", "--format", "json"];
                json(&closecall(run), 0);
                ran.push(stem);
            } else {
                let said = message(&result);
                assert_eq!(code(&result), 3, "{said}");
                assert!(said.contains(".xosc:") && said.contains('`'), "{said}");
                assert!(!output.exists(), "{said}");
                refused += 1;
            }
        }
    }
    ran.sort();
    let mut expected: Vec<_> = IMPORTED.map(str::to_owned).into();
    expected.sort();
    assert_eq!(ran, expected);
    assert!(refused >= 20, "{refused}");
}

/// Returns the scenario with further vehicles, each with the position of its start.
fn with_vehicles(vehicles: &[(&str, String)]) -> String {
    let (_, car) = SCENARIO.split_once("<ScenarioObject name=\"Ego\">").unwrap();
    let (car, _) = car.split_once("</ScenarioObject>").unwrap();
    let (mut objects, mut starts) = (String::new(), String::new());
    for (name, position) in vehicles {
        objects.push_str(&format!("<ScenarioObject name=\"{name}\">{car}</ScenarioObject>"));
        starts.push_str(&format!(
            "<Private entityRef=\"{name}\"><PrivateAction><TeleportAction><Position>{position}</Position></TeleportAction>\
             </PrivateAction></Private>"
        ));
    }
    // Their starts stand before the others'.
    SCENARIO.replacen("</Entities>", &format!("{objects}</Entities>"), 1).replacen(
        "<Actions>",
        &format!("<Actions>{starts}"),
        1,
    )
}

#[test]
fn starts_relative_to_each_other_in_turn_are_found_and_a_circle_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("scenario.toml");
    let behind = |other: &str| format!("<RelativeLanePosition entityRef=\"{other}\" dLane=\"0\" ds=\"-10\"/>");
    let chain = with_vehicles(&[("d", behind("c")), ("c", behind("b")), ("b", behind("a")), ("a", behind("Ego"))]);
    stdout(&imported(&written(folder.path(), &chain, ROAD), &output, &[]), 0);
    let text = fs::read_to_string(&output).unwrap();
    let scenario: toml::Table = toml::from_str(&text).unwrap();
    let starts: Vec<f64> = scenario["actor"]
        .as_array()
        .unwrap()
        .iter()
        .map(|actor| actor["start"]["absolute"]["s-m"].as_float().unwrap())
        .collect();
    assert_eq!(starts, [51.4, 114.0, 11.4, 21.4, 31.4, 41.4]);
    fs::remove_file(&output).unwrap();
    let circle = with_vehicles(&[("a", behind("b")), ("b", behind("a"))]);
    let refused = imported(&written(folder.path(), &circle, ROAD), &output, &[]);
    assert_eq!(code(&refused), 3);
    let said = message(&refused);
    assert!(said.contains("`RelativeLanePosition`: it is relative to `b`, which starts nowhere"), "{said}");
    assert!(!output.exists());
}

#[test]
fn an_event_that_never_begins_and_a_box_beside_its_vehicle_are_noted() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("scenario.toml");
    let changed = SCENARIO.replacen("<Center x=\"4\" y=\"0\"", "<Center x=\"4\" y=\"-0.4\"", 1);
    let path = written(folder.path(), &changed, ROAD);
    let said = stdout(&imported(&path, &output, &["--parameter", "Headway=0"]), 0);
    assert!(said.contains("the event `cut-in` never begins, and its actions are left out"), "{said}");
    assert!(said.contains("line 28: the centre of the box lies 0.40 m beside the reference point"), "{said}");
}

#[test]
fn a_relative_speed_below_zero_is_noted() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("scenario.toml");
    let relative = "<RelativeTargetSpeed entityRef=\"Slow_Truck\" value=\"-15\" speedTargetValueType=\"delta\" \
                    continuous=\"true\"/>";
    let action = format!(
        "<Event name=\"slower\" priority=\"parallel\" maximumExecutionCount=\"1\"><Action name=\"slower-action\">\
         <PrivateAction><LongitudinalAction><SpeedAction><SpeedActionDynamics dynamicsShape=\"step\" value=\"0\" \
         dynamicsDimension=\"time\"/><SpeedActionTarget>{relative}</SpeedActionTarget></SpeedAction></LongitudinalAction>\
         </PrivateAction></Action></Event>"
    );
    let place = "<LanePosition roadId=\"1\" laneId=\"-2\" s=\"10\"/>".to_owned();
    let group = format!(
        "<ManeuverGroup name=\"second\" maximumExecutionCount=\"1\"><Actors selectTriggeringEntities=\"false\"><EntityRef \
         entityRef=\"last\"/></Actors><Maneuver name=\"slow\">{action}</Maneuver></ManeuverGroup>"
    );
    let scenario =
        with_vehicles(&[("last", place)]).replacen("</ManeuverGroup>", &format!("</ManeuverGroup>{group}"), 1);
    let said = stdout(&imported(&written(folder.path(), &scenario, ROAD), &output, &[]), 0);
    assert!(said.contains("`last` stands where its relative speed is below 0, from 10.0"), "{said}");
    assert_eq!(said.matches("relative speed is below 0").count(), 1, "{said}");
}

/// Returns the names of the vehicles of a scenario of OpenSCENARIO, in their order.
fn entities(path: &Path) -> Vec<String> {
    let text = fs::read_to_string(path).unwrap();
    let name = |part: &str| part.split('"').next().unwrap().to_owned();
    text.split("<ScenarioObject name=\"").skip(1).map(name).collect()
}

/// Returns the names of the actors of a scenario file.
fn actors(path: &Path) -> Vec<String> {
    let scenario: toml::Table = toml::from_str(&fs::read_to_string(path).unwrap()).unwrap();
    let actors = scenario["actor"].as_array().unwrap();
    actors.iter().map(|actor| actor["id"].as_str().unwrap().to_owned()).collect()
}

#[test]
fn the_vehicles_of_others_keep_their_names_there_and_back() {
    let Some(data) = closecall_testing::data() else { return };
    let folders = ["esmini_openx/xosc", "osc_alks/concrete_scenarios"].map(|name| data.join(name));
    if folders.iter().any(|folder| !folder.is_dir()) {
        closecall_testing::skip(closecall_testing::Need::Data, "CLOSECALL_DATA has no esmini_openx and osc_alks");
        return;
    }
    let work = tempfile::tempdir().unwrap();
    let output = work.path().join("scenario.toml");
    let case = work.path().join("case");
    let mut mixed = 0;
    for path in folders.iter().flat_map(|folder| fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path())) {
        let is_imported =
            path.file_stem().is_some_and(|stem| IMPORTED.contains(&stem.to_string_lossy().as_ref())) && path.is_file();
        if !is_imported {
            continue;
        }
        let said = stdout(&imported(&path, &output, &[]), 0);
        assert!(!said.contains("is named"), "{said}");
        let names = entities(&path);
        assert_eq!(actors(&output), names, "{}", path.display());
        mixed += usize::from(names.iter().any(|name| name.contains(|c: char| c.is_ascii_uppercase() || c == '_')));
        let words =
            ["tool", "export", output.to_str().unwrap(), "--sensors", "ground-truth", "-o", case.to_str().unwrap()];
        stdout(&closecall(words), 0);
        for form in ["open-loop", "closed-loop"] {
            let exported = case.join(form).with_extension("xosc");
            assert_eq!(entities(&exported), names, "{}", exported.display());
            let again = work.path().join("again.toml");
            // The ego of the file need not be named `Ego`.
            stdout(&imported(&exported, &again, &["--ego", &names[0]]), 0);
            assert_eq!(actors(&again), names, "{}", exported.display());
            fs::remove_file(&again).unwrap();
        }
        fs::remove_dir_all(&case).unwrap();
        fs::remove_file(&output).unwrap();
    }
    assert!(mixed >= 5, "{mixed}");
}

#[test]
fn names_that_differ_in_case_or_in_odd_characters_alone_stay_two_vehicles() {
    let folder = tempfile::tempdir().unwrap();
    // The names of a curve and of an entry of a catalogue, and a letter of a text, are names, too.
    let long = "x".repeat(300);
    let more = ["Slow_truck", "Slow Truck", "commanded", "car", "F", "_lead_", &long];
    let place = |s_m: i32| format!("<LanePosition roadId=\"1\" laneId=\"-1\" s=\"{s_m}\"/>");
    let vehicles: Vec<_> = more.into_iter().zip((210..).step_by(20).map(place)).collect();
    let scenario = with_vehicles(&vehicles);
    let path = written(folder.path(), &scenario, ROAD);
    let output = folder.path().join("scenario.toml");
    let said = stdout(&imported(&path, &output, &[]), 0);
    assert_eq!(said.matches("is named").count(), 1, "{said}");
    let expected = ["Ego", "Slow_Truck", "Slow_truck", "Slow_Truck_2", "commanded", "car", "F", "_lead_", &long];
    assert!(said.contains("`Slow Truck` is named `Slow_Truck_2`: a name has letters (a-z, A-Z), digits"), "{said}");
    assert_eq!(actors(&output), expected);
    // A setting, a table, a recording and an export tell them apart.
    let file = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (trace, recording, case) = (file("trace.csv"), file("run.rrd"), file("case"));
    let words =
        ["run", output.to_str().unwrap(), "--sensors", "ground-truth", "--trace", &trace, "--record", &recording];
    let set = ["--set", "actor.Slow_truck.start.absolute.speed-mps=11"];
    stdout(&closecall([&words[..], &set].concat()), 0);
    let table = fs::read_to_string(&trace).unwrap();
    let speeds: Vec<_> = expected
        .map(|name| table.lines().find(|row| row.split(',').nth(1) == Some(name)).unwrap().split(',').nth(5).unwrap())
        .to_vec();
    assert_eq!((speeds[2], speeds.iter().filter(|speed| **speed == "11").count()), ("11", 1), "{speeds:?}");
    stdout(&closecall(["tool", "export", output.to_str().unwrap(), "--sensors", "ground-truth", "-o", &case]), 0);
    assert_eq!(entities(Path::new(&case).join("open-loop.xosc").as_path()), expected);
    let again = folder.path().join("again.toml");
    stdout(&imported(&Path::new(&case).join("closed-loop.xosc"), &again, &[]), 0);
    assert_eq!(actors(&again), expected);
    // A guess at the ego would be one of two.
    let two = scenario.replacen("\"Slow Truck\"", "\"ego\"", 2);
    fs::write(&path, two).unwrap();
    let refused = imported(&path, &output, &[]);
    assert_eq!(code(&refused), 3);
    assert!(
        message(&refused).contains("`Ego` and `ego` could be the ego: name one of Ego, Slow_Truck"),
        "{}",
        message(&refused)
    );
    stdout(&imported(&path, &output, &["--ego", "ego"]), 0);
}

#[test]
fn a_combination_of_a_variation_file_that_breaks_the_constraints_of_its_scenario_is_refused() {
    let Some(data) = closecall_testing::data() else { return };
    let path = data.join("osc_alks/alks_scenario_4_4_1_cut_in_no_collision_variation.xosc");
    if !path.is_file() {
        closecall_testing::skip(closecall_testing::Need::Data, "CLOSECALL_DATA has no osc_alks");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("scenario.toml");
    // At 20 km/h, a vehicle that is 50 km/h slower would drive backwards.
    let cases: [(&[&str], &str); 2] = [
        (&[], "it has 52500 combinations of values: choose one value set from 1 to 52500"),
        (&["--value-set", "1"], "its constraints are"),
    ];
    for (more, word) in cases {
        let refused = imported(&path, &output, more);
        let said = message(&refused);
        assert_eq!(code(&refused), 3, "{said}");
        assert!(said.contains(".xosc:") && said.contains(word), "{said}");
        assert!(!output.exists());
    }
}

#[test]
fn the_events_of_a_cut_in_are_those_of_esmini_within_a_step() {
    let Some(data) = closecall_testing::data() else { return };
    let path = data.join("esmini_openx/xosc/cut-in.xosc");
    if !path.is_file() {
        closecall_testing::skip(closecall_testing::Need::Data, "CLOSECALL_DATA has no esmini_openx");
        return;
    }
    // The step of esmini's test, and the rounding of a time to it.
    const STEP_S: f64 = 0.01 + 1e-9;
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("scenario.toml");
    let said = stdout(&imported(&path, &output, &[]), 0);
    assert!((time_of(&said, "OvertakerBrakeEvent begins") - 7.74).abs() <= STEP_S, "{said}");
    assert!((time_of(&said, "CutInManeuver ends") - 16.74).abs() <= STEP_S, "{said}");
    assert!((time_of(&said, "storyboard ends") - 21.74).abs() <= STEP_S, "{said}");
}

/// Returns the alignment of an imported scenario, as pairs of position and curvature.
fn alignment_of(scenario: &Path) -> Vec<[f64; 2]> {
    let scenario: toml::Table = toml::from_str(&fs::read_to_string(scenario).unwrap()).unwrap();
    let points = scenario["road"]["alignment"].as_array().unwrap();
    points.iter().map(|point| ["s-m", "curvature-per-m"].map(|key| point[key].as_float().unwrap())).collect()
}

#[test]
fn a_road_of_lines_arcs_and_spirals_is_the_alignment_of_the_scenario() {
    let folder = tempfile::tempdir().unwrap();
    let case = folder.path().join("case");
    let course = "road.alignment=[{s-m=0.0,curvature-per-m=0.0},{s-m=200.0,curvature-per-m=0.002},\
                  {s-m=300.0,curvature-per-m=0.002},{s-m=450.0,curvature-per-m=-0.001}]";
    let export = ["tool", "export", "paper-figure", "--form", "closed-loop", "--set", course, "-o"];
    stdout(&closecall([&export[..], &[case.to_str().unwrap()]].concat()), 0);
    let output = folder.path().join("scenario.toml");
    stdout(&imported(&case.join("closed-loop.xosc"), &output, &[]), 0);
    let points = alignment_of(&output);
    // The road of the file begins before the first vehicle, and ends behind the last one.
    let start_m = points[1][0];
    let inner: Vec<[f64; 2]> = points[1..points.len() - 1].iter().map(|[s, k]| [s - start_m, *k]).collect();
    assert_eq!(inner.len(), 4, "{points:?}");
    for ([s_m, curvature_per_m], expected) in
        inner.iter().zip([[0.0, 0.0], [200.0, 0.002], [300.0, 0.002], [450.0, -0.001]])
    {
        assert!((s_m - expected[0]).abs() < 1e-9 && (curvature_per_m - expected[1]).abs() < 1e-12, "{points:?}");
    }
    let run = ["run", output.to_str().unwrap(), "--sensors", "ground-truth", "--format", "json"];
    json(&closecall(run), 0);
}

#[test]
fn heights_other_roads_and_the_end_of_a_road_are_noted() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("scenario.toml");
    let profile = |height: &str, slope: &str| {
        format!(
            "</planView><elevationProfile><elevation s=\"0\" a=\"12\" b=\"{height}\" c=\"0\" d=\"0\"/></elevationProfile>\
             <lateralProfile><superelevation s=\"0\" a=\"{slope}\" b=\"0\" c=\"0\" d=\"0\"/></lateralProfile>"
        )
    };
    let road = |from: &str, to: &str| {
        let text = straight_road().replace(from, to);
        assert!(text != straight_road(), "{from}");
        text
    };
    let (_, rest) = ROAD.split_once("<road ").unwrap();
    let second = rest.split_once("</road>").unwrap().0.replace("id=\"1\"", "id=\"2\"");
    let cases = [
        (road("</planView>", &profile("0", "0")), None),
        (road("</planView>", &profile("0.03", "0")), Some("the road has a height that changes")),
        (road("</planView>", &profile("0", "0.04")), Some("the road has a slope across it")),
        (road("</road>", &format!("</road><road {second}</road>")), Some("the road has 1 road beside it in its file")),
        // The ego drives 30 m/s from 50 m on, and the truck 20 m/s from 110 m on.
        (road("length=\"3000\"", "length=\"500\""), Some("`Ego` drives beyond the end of the road at 15.01 s")),
        (road("length=\"3000\"", "length=\"700\""), None),
    ];
    for (text, note) in cases {
        let said = stdout(&imported(&written(folder.path(), SCENARIO, &text), &output, &[]), 0);
        let notes = ["a height", "a slope", "beside it in its file", "beyond the end"];
        let said_notes = notes.iter().filter(|note| said.contains(**note)).count();
        assert_eq!(said_notes, usize::from(note.is_some()), "{said}");
        assert!(note.is_none_or(|note| said.contains(note)), "{said}");
    }
}

#[test]
fn a_winding_road_keeps_all_its_curves() {
    let Some(data) = closecall_testing::data() else { return };
    let path = data.join("osc_alks/concrete_scenarios/alks_scenario_4_1_1_free_driving_template.xosc");
    if !path.is_file() {
        closecall_testing::skip(closecall_testing::Need::Data, "CLOSECALL_DATA has no osc_alks");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("scenario.toml");
    stdout(&imported(&path, &output, &[]), 0);
    // The road of the file has 33 lines, arcs and spirals, with radii from 250 m to 2000 m.
    let points = alignment_of(&output);
    assert_eq!(points.len(), 34, "{points:?}");
    for expected in [[600.0, 0.004], [1_300.0, -0.004], [4_900.0, -0.0005]] {
        assert!(points.contains(&expected), "{expected:?}: {points:?}");
    }
}

#[test]
fn a_road_of_cubics_is_followed_within_the_distance_that_the_note_states() {
    let Some(data) = closecall_testing::data() else { return };
    let path = data.join("esmini_openx/xosc/cut-in.xosc");
    if !path.is_file() {
        closecall_testing::skip(closecall_testing::Need::Data, "CLOSECALL_DATA has no esmini_openx");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("scenario.toml");
    stdout(&imported(&path, &output, &[]), 0);
    let text = fs::read_to_string(&output).unwrap();
    let note = text.split_once("pieces with a linear curvature follow them within ").unwrap().1;
    let within_m: f64 = note.split(' ').next().unwrap().parse().unwrap();
    // The reference line of e6mini.xodr bends to the right, and then is straight.
    let points = alignment_of(&output);
    assert!(within_m < 0.05 && points.len() > 10, "{within_m} {points:?}");
    assert!(points.iter().all(|[_, curvature_per_m]| (-0.000_5..0.000_1).contains(curvature_per_m)), "{points:?}");
}
