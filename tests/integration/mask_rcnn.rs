//! The pipeline `mask-rcnn` from the command line.

use std::path::Path;

use crate::support::{closecall, code, folder, json_file, library, stderr};

const PIPELINE: [&str; 2] = ["--set", "sensors.rear-camera.pipeline=mask-rcnn"];

fn campaign<'a>(scenario: &'a str, out: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    let args =
        ["campaign", scenario, "-n", "2", "--seed", "5", "--sensors", "full", "--no-gate", "--no-validity-checks"];
    args.iter().chain(&["--set", "duration-s=12", "--out", out]).chain(&PIPELINE).chain(more).copied().collect()
}

/// Returns the message of a command that is refused.
fn refused(args: &[&str]) -> String {
    let output = closecall(args);
    assert_eq!(code(&output), 3, "{args:?}: {}", stderr(&output));
    stderr(&output)
}

#[test]
fn without_onnx_runtime_it_says_how_to_get_it() {
    let scenario = library("low-thw-overtake");
    let scenario = scenario.to_str().unwrap();
    let out = folder();
    let out = out.path().join("out");
    for args in [
        campaign(scenario, out.to_str().unwrap(), &[]),
        ["run", scenario, "--sensors", "full"].iter().chain(&PIPELINE).copied().collect(),
        ["study", "sensors", scenario, "--quick"].iter().chain(&PIPELINE).copied().collect::<Vec<&str>>(),
    ] {
        let text = refused(&args);
        assert!(text.contains("pip install onnxruntime") && text.contains("--onnxruntime PATH"), "{args:?}: {text}");
    }
    assert!(!out.exists(), "nothing is written");
}

/// Writes a scenario in which a parameter gives the pipeline, which is the crop classifier nearly
/// always.
fn sampled_pipeline(folder: &Path) -> String {
    let path = folder.join("sampled-pipeline.toml");
    let text = "base = \"low-thw-overtake\"\nname = \"sampled-pipeline\"\n\
                [parameters]\ncamera = { choice = { crop-classifier = 0.99, mask-rcnn = 0.01 } }\n\
                [sensors.rear-camera]\npipeline = \"$camera\"\n";
    std::fs::write(&path, text).unwrap();
    path.to_str().unwrap().to_owned()
}

#[test]
fn a_pipeline_that_a_parameter_can_give_needs_onnx_runtime_and_is_in_the_manifest() {
    let folder = folder();
    let (scenario, out) = (sampled_pipeline(folder.path()), folder.path().join("out"));
    let out_text = out.to_str().unwrap();
    let campaign = |mode: &str, more: &[&str]| {
        let usual = ["campaign", &scenario, "-n", "1", "--sensors", mode, "--no-gate", "--no-validity-checks"];
        let set = ["--set", "duration-s=2", "--out", out_text];
        closecall(usual.iter().chain(&set).chain(more))
    };
    let output = campaign("full", &[]);
    assert_eq!(code(&output), 3, "{}", stderr(&output));
    let text = stderr(&output);
    assert!(text.contains("pip install onnxruntime") && !out.exists(), "{text}");
    // A mode without images needs no network.
    let output = campaign("object", &[]);
    assert!(out.join("manifest.json").exists(), "{}", stderr(&output));
    std::fs::remove_dir_all(&out).unwrap();
    let Some(library_file) = closecall_testing::onnxruntime() else { return };
    let output = campaign("full", &["--onnxruntime", library_file.to_str().unwrap()]);
    assert!(out.join("manifest.json").exists(), "{}", stderr(&output));
    let manifest = std::fs::read_to_string(out.join("manifest.json")).unwrap();
    assert!(manifest.contains("\"rear-mask-rcnn\""), "{manifest}");
}

#[test]
fn a_network_with_another_layout_is_refused_before_any_work() {
    let Some(library_file) = closecall_testing::onnxruntime() else { return };
    let scenario = library("low-thw-overtake");
    let out = folder();
    let out = out.path().join("out");
    let wrong = "sensors.rear-camera.mask-rcnn.model=sensors/models/rear-classifier.onnx";
    let more = ["--onnxruntime", library_file.to_str().unwrap(), "--set", wrong];
    let text = refused(&campaign(scenario.to_str().unwrap(), out.to_str().unwrap(), &more));
    for part in ["rear-classifier.onnx", "wanted are", "masks float [n, 1, height, width]"] {
        assert!(text.contains(part), "{part}: {text}");
    }
    let missing = "sensors.rear-camera.mask-rcnn.model=nowhere.onnx";
    let more = ["--onnxruntime", library_file.to_str().unwrap(), "--set", missing];
    let output = closecall(campaign(scenario.to_str().unwrap(), out.to_str().unwrap(), &more));
    assert_eq!(code(&output), 6, "{}", stderr(&output));
    assert!(stderr(&output).contains("failed to read nowhere.onnx: "), "{}", stderr(&output));
}

#[test]
fn a_network_whose_scores_are_no_probabilities_ends_the_samples_in_an_error_that_names_it() {
    let Some(library_file) = closecall_testing::onnxruntime() else { return };
    let scenario = library("low-thw-overtake");
    let folder = folder();
    let out = folder.path().join("out");
    let model = "sensors/tests/mask_rcnn_layouts/torchvision.onnx";
    let network = format!("sensors.rear-camera.mask-rcnn.model={model}");
    // The network takes shares of full brightness, not bytes less their means.
    let [labels, input] = ["labels=3=car 8=truck 4=motorcycle", "input=bgr-mean"]
        .map(|value| format!("sensors.rear-camera.mask-rcnn.{value}"));
    let sets = ["--set", &network, "--set", &labels, "--set", &input];
    let more = [&["--onnxruntime", library_file.to_str().unwrap()], &sets[..]].concat();
    let output = closecall(campaign(scenario.to_str().unwrap(), out.to_str().unwrap(), &more));
    let text = format!("{}{}", stderr(&output), String::from_utf8_lossy(&output.stdout));
    assert_eq!(code(&output), 5, "{text}");
    for part in [model, "`scores`", "probabilities from 0 to 1"] {
        assert!(text.contains(part), "{part}: {text}");
    }
}

#[test]
fn one_and_three_jobs_give_the_same_bits() {
    let Some(library_file) = closecall_testing::onnxruntime() else { return };
    let scenario = library("low-thw-overtake");
    let folder = folder();
    let outcomes = |jobs: &str| {
        let out = folder.path().join(jobs);
        let more = ["--onnxruntime", library_file.to_str().unwrap(), "--paired", "--jobs", jobs];
        // After 12 s, the events that the scenario expects have not happened: no verdict is wanted,
        // but the same one.
        let output = closecall(campaign(scenario.to_str().unwrap(), out.to_str().unwrap(), &more));
        let verdict = code(&output);
        let read = |path: &Path| std::fs::read(path).unwrap();
        (verdict, read(&out.join("outcomes.parquet")))
    };
    let (one_job, three_jobs) = (outcomes("1"), outcomes("3"));
    assert_eq!(one_job.0, three_jobs.0);
    assert!(one_job.1 == three_jobs.1, "the outcomes differ");
}

#[test]
fn the_study_characterises_it() {
    let Some(library_file) = closecall_testing::onnxruntime() else { return };
    let scenario = library("low-thw-overtake");
    let folder = folder();
    let out = folder.path().join("study");
    let (library_file, out_text) = (library_file.to_str().unwrap(), out.to_str().unwrap());
    let rare = ["--set", "sensors.rear-camera.mask-rcnn.rate-hz=1"];
    let args =
        ["study", "sensors", scenario.to_str().unwrap(), "-n", "1", "--onnxruntime", library_file, "--out", out_text];
    let output = closecall(args.iter().chain(&PIPELINE).chain(&rare));
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let study = json_file(&out.join("sensors.json"));
    let accuracy = |name: &str| {
        let of_case = |case: &&serde_json::Value| case["case"].as_str().is_some_and(|case| case.starts_with(name));
        let case = study["cases"].as_array().unwrap().iter().find(of_case).unwrap();
        case["class_accuracy"]["value"].as_f64().unwrap()
    };
    assert!(accuracy("usual") > 0.9 && accuracy("truck") > 0.9 && accuracy("motorcycle") > 0.9);
    // The LiDAR confirms a track in fog before the image shows a vehicle there.
    assert!(accuracy("fog, visibility 100 m") < accuracy("usual") - 0.1);
}
