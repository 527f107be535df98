//! Inputs are neither overwritten nor read without a bound, and an unused part cannot fail.

use std::fs;
use std::path::Path;

use crate::support::{closecall, code, folder, headline_with, library, message, program, stderr, stdout};

#[test]
fn no_command_overwrites_an_input() {
    let folder = folder();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let text = fs::read_to_string(library("low-thw-overtake")).unwrap();
    let (scenario, traffic, rrd) = (path("sc.toml"), path("traffic.csv"), path("sc.rrd"));
    fs::write(&scenario, &text).unwrap();
    fs::hard_link(&scenario, &rrd).unwrap();
    stdout(&closecall(["traffic", "record", &scenario, "-n", "2", "-o", &traffic]), 0);
    let recorded = fs::read(&traffic).unwrap();
    let script = path("ctl.csv");
    fs::write(&script, "x").unwrap();
    let controller = format!("exec:sh {script}");
    let detour = format!("{}/../{}/sc.toml", path(""), folder.path().file_name().unwrap().to_str().unwrap());
    let cases: [&[&str]; 9] = [
        &["traffic", "record", &scenario, "-o", &scenario],
        &["traffic", "record", &scenario, "-o", &detour],
        &["run", &scenario, "--record", &rrd],
        &["run", &scenario, "--controller", &controller, "--trace", &script],
        &["traffic", "fit", &traffic, "-o", &traffic],
        &["traffic", "reenact", &traffic, "-o", &traffic],
        &["traffic", "reenact", &traffic, "--trace", &traffic],
        &["run", &scenario, "--record", &scenario],
        &["traffic", "criticality", &traffic, "--record", &traffic],
    ];
    for case in cases {
        let output = closecall(case);
        assert_eq!(code(&output), 2, "{case:?}: {}", stderr(&output));
        let said = message(&output);
        assert!(said.contains("would overwrite the input") || said.contains("must end with .rrd"), "{case:?}: {said}");
        assert_eq!(fs::read_to_string(&scenario).unwrap(), text, "{case:?}");
        assert_eq!(fs::read(&traffic).unwrap(), recorded, "{case:?}");
        assert_eq!(fs::read_to_string(&script).unwrap(), "x", "{case:?}");
    }
}

#[test]
fn a_dash_in_place_of_a_recording_is_said_to_be_no_standard_input() {
    let folder = folder();
    let cases: [&[&str]; 8] = [
        &["traffic", "inspect", "-"],
        &["traffic", "lane-changes", "-"],
        &["traffic", "criticality", "-"],
        &["traffic", "fit", "-"],
        &["traffic", "calibrate", "-"],
        &["study", "perceive", "-"],
        &["tool", "import", "-", "-o", "scenario.toml"],
        &["view", "-", "--no-open"],
    ];
    for case in cases {
        let output = program().args(case).current_dir(folder.path()).output().unwrap();
        assert_eq!(code(&output), 6, "{case:?}: {}", stderr(&output));
        let said = message(&output);
        assert!(said.contains("standard input is not read here: name a file"), "{case:?}: {said}");
        assert!(!folder.path().join("scenario.toml").exists(), "{case:?}");
    }
    // A file of this name is a file.
    fs::write(folder.path().join("-"), "").unwrap();
    let output = program().args(["traffic", "inspect", "-"]).current_dir(folder.path()).output().unwrap();
    assert_eq!(code(&output), 3, "{}", stderr(&output));
    assert!(message(&output).contains("there are no rows"), "{}", message(&output));
}

/// The system has read the file, so that no right and no disk is at fault.
#[test]
fn a_file_that_is_no_text_is_an_invalid_input_in_every_command() {
    let folder = folder();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (file, traffic, campaign) = (path("odd.toml"), path("traffic.csv"), path("campaign"));
    fs::write(&file, b"\xff\xfe\x00binary").unwrap();
    fs::create_dir(&campaign).unwrap();
    fs::copy(&file, path("campaign/manifest.json")).unwrap();
    stdout(&closecall(["traffic", "record", "overtake-without-brake", "-n", "1", "-o", &traffic]), 0);
    let cases: [&[&str]; 9] = [
        &["check", &file],
        &["run", "paper-figure", "--fitted", &file],
        &["campaign", "paper-figure", "--no-gate", "--ensemble", &file],
        &["campaign", "paper-figure", "--no-gate", "--failures-first", &file],
        &["traffic", "drift", &file, &traffic],
        &["traffic", "calibrate", &file],
        &["explain", &campaign],
        &["replay", &campaign, "0"],
        &["baseline", "compare", &campaign, &file],
    ];
    for case in cases {
        let output = closecall(case);
        assert_eq!(code(&output), 3, "{case:?}: {}", stderr(&output));
        assert!(message(&output).contains("text"), "{case:?}: {}", message(&output));
        // A file that is not there is another fault.
        let missing =
            closecall(case.iter().map(|word| word.replace(&file, &path("no.toml")).replace(&campaign, &path("no"))));
        assert_ne!(code(&missing), 3, "{case:?}: {}", stderr(&missing));
    }
}

#[test]
#[cfg(unix)]
fn an_endless_input_is_refused() {
    let endless = "/dev/zero";
    if !Path::new(endless).exists() {
        return;
    }
    let traffic = folder();
    let csv = traffic.path().join("traffic.csv");
    stdout(
        &closecall([
            "traffic",
            "record",
            library("low-thw-overtake").to_str().unwrap(),
            "-n",
            "1",
            "-o",
            csv.to_str().unwrap(),
        ]),
        0,
    );
    let csv = csv.to_str().unwrap();
    let cases: [&[&str]; 5] = [
        &["check", endless],
        &["campaign", endless, "-n", "1"],
        &["traffic", "inspect", endless],
        &["traffic", "criticality", endless],
        &["traffic", "lane-changes", csv, "--reference", endless],
    ];
    for case in cases {
        let output = closecall(case);
        assert!([3, 6].contains(&code(&output)), "{case:?}: {}", stderr(&output));
        assert!(message(&output).contains("it is a device, not a file"), "{case:?}: {}", stderr(&output));
    }
}

#[test]
fn the_path_of_onnx_runtime_matters_only_if_the_network_runs() {
    let scenario = library("low-thw-overtake");
    let scenario = scenario.to_str().unwrap();
    let with_bad_path = |args: &[&str]| {
        program().args(args).env("ORT_DYLIB_PATH", "/no/such/library.so").output().expect("the program starts")
    };
    stdout(&with_bad_path(&["check", scenario]), 0);
    stdout(&with_bad_path(&["run", scenario, "--sensors", "object"]), 0);
    let campaign = with_bad_path(&["campaign", scenario, "--no-out", "-n", "4", "--sensors", "object"]);
    assert!(![3, 6].contains(&code(&campaign)), "{}", stderr(&campaign));
    let campaign = ["campaign", scenario, "--sensors", "full", "--no-out"];
    for needed in [&["run", scenario, "--sensors", "full"], &campaign[..]] {
        let output = with_bad_path(needed);
        assert_eq!(code(&output), 6, "{}", stderr(&output));
        assert!(message(&output).contains("/no/such/library.so"), "{}", stderr(&output));
    }
}

#[test]
fn a_study_of_no_lane_change_says_so() {
    let folder = folder();
    let (scenario, traffic) = (folder.path().join("sc.toml"), folder.path().join("traffic.csv"));
    fs::write(&scenario, headline_with("duration-s = ", "duration-s = 1.0 # ")).unwrap();
    let (scenario, traffic) = (scenario.to_str().unwrap(), traffic.to_str().unwrap());
    stdout(&closecall(["traffic", "record", scenario, "-n", "1", "-o", traffic]), 0);
    let output = closecall(["traffic", "robustness", traffic, "--repetitions", "1"]);
    assert_eq!(code(&output), 4, "{}", stderr(&output));
    assert!(message(&output).contains("there is no lane change in the trajectory files"), "{}", stderr(&output));
}

#[test]
fn a_trajectory_file_with_the_ending_of_another_format_is_refused() {
    let folder = folder();
    let scenario = library("low-thw-overtake");
    for name in ["x.xyz", "x.parquet", "x", "x.csv.gz"] {
        for in_car in [&[][..], &["--in-car=rear"]] {
            let path = folder.path().join(name);
            let args = ["traffic", "record", scenario.to_str().unwrap(), "-n", "1", "-o", path.to_str().unwrap()];
            let output = closecall(args.iter().chain(in_car));
            assert_eq!(code(&output), 2, "{name}: {}", stderr(&output));
            assert!(message(&output).contains("must end with .csv"), "{name}: {}", stderr(&output));
            assert!(!path.exists());
        }
    }
}
