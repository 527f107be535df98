//! `[coverage]`: bins and crosses that samples hit, a gate on them, and samples that fill the holes with known weights.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;

use serde_json::Value;

use crate::support::{ROOT, closecall, code, folder, json, message, program, stdout};

/// Bins of the gap at the start, which decides whether the ego collides: it does below 10 m.
const GAPS: &str = r#"
[coverage.item.gap]
parameter = "gap-m"
edges = [1, 10, 25, 35, 60]
[coverage.item.hit]
measure = "ego_collided"
[coverage.item.light]
odd = "natural-illuminance"
[coverage.cross.gap-by-hit]
items = ["gap", "hit"]
at-least = 2
without = [["1 to 10", "no"], ["10 to 25", "yes"], ["25 to 35", "yes"], ["35 to 60", "yes"]]
"#;

/// Writes the scenario of known collision probability, 3.167·10⁻⁵, with a table `[coverage]`.
fn scenario(folder: &Path, table: &str) -> PathBuf {
    let text = fs::read_to_string(Path::new(ROOT).join("tests/fixtures/known-rare-probability.toml")).unwrap();
    let path = folder.join("covered.toml");
    fs::write(&path, format!("{text}\n{table}")).unwrap();
    path
}

fn campaign(path: &Path, words: &str) -> Output {
    let fixed = ["campaign", path.to_str().unwrap(), "--controller", "acc", "-n", "200", "--seed", "3"];
    closecall(fixed.into_iter().chain(words.split_whitespace()))
}

fn item<'a>(value: &'a Value, name: &str) -> &'a Value {
    let items = value["coverage"][0]["coverage"].as_array().unwrap();
    items.iter().find(|item| item["name"] == name).unwrap()
}

#[test]
fn holes_are_named_in_every_report_and_a_gate_judges_them() {
    let place = folder();
    let path = scenario(place.path(), GAPS);
    let text = stdout(&campaign(&path, "--no-gate"), 0);
    for part in [
        "gap: 3 of 4 bins (75 %); holes: gap-m 1 to 10",
        "gap-by-hit: 3 of 4 bins (75 %); holes: gap-m 1 to 10, ego_collided yes",
        "light: 1 of 3 bins (33.3 %); holes: natural-illuminance low-ambient; natural-illuminance night",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
    for (gate, exit) in [(0.75, 0), (0.76, 1), (1.0, 1)] {
        let output = campaign(&path, &format!("--gate coverage(gap)>={gate}"));
        assert_eq!(code(&output), exit, "{gate}: {}", stdout(&output, exit));
    }
    let open = stdout(&campaign(&path, "--gate coverage(gaps)>=0.1"), 4);
    assert!(open.contains("has no value in any scenario"), "{open}");

    let out = place.path().join("out");
    let kept = campaign(&path, &format!("--format json --no-gate --out {}", out.display()));
    let value = json(&kept, 0);
    let gap = item(&value, "gap");
    assert_eq!((&gap["covered"], &gap["holes"][0]["bins"][0]), (&3.into(), &"1 to 10".into()));
    let hits: u64 = gap["bins"].as_array().unwrap().iter().map(|bin| bin["hits"].as_u64().unwrap()).sum();
    assert_eq!(hits + gap["outside"].as_u64().unwrap(), 200, "each sample is counted once");
    let weights: f64 = gap["bins"].as_array().unwrap().iter().map(|bin| bin["weight"].as_f64().unwrap()).sum();
    assert!((weights - 1.0).abs() < 1e-9, "{weights}");
    assert!(item(&value, "hit")["bins"][0]["weight"].is_null(), "nobody knows the probability of a measure");
    for report in ["report.html", "summary.md"] {
        let text = fs::read_to_string(out.join(report)).unwrap();
        assert!(text.contains("gap-by-hit"), "{report}");
    }
}

#[test]
fn the_design_coverage_fills_holes_and_its_weights_give_back_the_probability() {
    let place = folder();
    let path = scenario(place.path(), &format!("{GAPS}\n[coverage]\nfill = \"gap\"\n"));
    let value = json(&campaign(&path, "--design coverage --no-gate --format json"), 0);
    let gap = item(&value, "gap");
    assert_eq!(gap["covered"], 4);
    for bin in gap["bins"].as_array().unwrap() {
        assert_eq!(bin["hits"], 50, "the bins are visited in turn");
    }
    assert_eq!(gap["bins"][0]["collided"][0], 50);
    // The probability of the fixture, which 200 plain samples do not show.
    let rate = gap["weighted_collision_rates"][0].as_f64().unwrap();
    assert!((rate / 3.166_793e-5 - 1.0).abs() < 1e-6, "{rate}");
    assert!(value["controllers"]["acc"]["interval_95"].is_null());

    // What depends on how often something happens is open; what happened at all is not.
    let open = stdout(&campaign(&path, "--design coverage --gate share(ego_collided)<=0.9"), 4);
    assert!(open.contains("visit each bin as often as any other"), "{open}");
    let bounded = campaign(&path, "--design coverage --max-probability 0.9");
    assert!(message(&bounded).contains("needs independent samples"), "{}", message(&bounded));
    assert_eq!(code(&campaign(&path, "--design coverage --max-collisions 50")), 0);
    assert_eq!(code(&campaign(&path, "--design coverage --max-collisions 49")), 1);

    // A sample is what it is without the others: a replay runs the same one.
    let out = place.path().join("out");
    campaign(&path, &format!("--design coverage --no-gate --out {}", out.display()));
    let replayed = closecall(["replay", out.to_str().unwrap(), "4"]);
    assert!(stdout(&replayed, 0).contains("COLLISION"), "sample 4 is in the first bin");

    // Parts, and a campaign that was cut off, have the same bytes.
    let parts = ["1/2", "2/2"].map(|part| {
        let out = place.path().join(part.replace('/', "-"));
        campaign(&path, &format!("--design coverage --no-gate --partition {part} --out {}", out.display()));
        out
    });
    let merged = place.path().join("merged");
    let words = ["tool", "merge", parts[0].to_str().unwrap(), parts[1].to_str().unwrap(), "--no-gate", "--out"];
    let out_of_merge = [merged.to_str().unwrap(), "--format", "json"];
    let whole = json(&closecall(words.into_iter().chain(out_of_merge)), 0);
    let table = |folder: &Path| fs::read(folder.join("outcomes.parquet")).unwrap();
    assert!(table(&out) == table(&merged));
    // Weights and rates equal the whole campaign's, to the bit.
    assert_eq!(item(&whole, "gap"), gap);
}

#[test]
fn what_cannot_be_covered_is_refused_with_its_key() {
    let place = folder();
    let refused = |table: &str, words: &str, exit: i32| {
        let output = campaign(&scenario(place.path(), table), words);
        assert_eq!(code(&output), exit, "{table}");
        message(&output)
    };
    assert!(refused(GAPS, "--design coverage", 2).contains("`[coverage]` names under `fill`"));
    let unknown = refused("[coverage.item.gap]\nparameter = \"gap\"\nedges = [1, 2]", "", 3);
    assert!(unknown.contains("coverage.item.gap.parameter") && unknown.contains("it has gap-m"), "{unknown}");
    let measured = format!("{GAPS}\n[coverage]\nfill = \"gap-by-hit\"\n");
    assert!(refused(&measured, "", 3).contains("items that are parameters and not correlated"));
    let gate = format!("{GAPS}\n[gate]\nrequire = [\"coverage(gaps) >= 0.5\"]\n");
    let said = refused(&gate, "", 3);
    assert!(said.contains("is `gaps`, but one of gap, hit, light, gap-by-hit is needed"), "{said}");
}

#[test]
fn bins_that_a_setting_widens_are_overridden_where_a_check_asks_for_them() {
    let place = folder();
    let gaps = "[coverage.item.gap]\nparameter = \"gap-m\"\nedges = [1, 10, 60]";
    let table = format!("{gaps}\n[checks]\nODD-1 = [\"coverage(gap) >= 1\"]\n");
    let path = scenario(place.path(), &table);
    let text =
        fs::read_to_string(&path).unwrap().replacen("\nduration-s", "\nrequirements = [\"ODD-1\"]\nduration-s", 1);
    fs::write(&path, text).unwrap();
    assert_eq!(code(&campaign(&path, "")), 1, "the hole misses the requirement");
    let weakened = campaign(&path, "--set coverage.item.gap.edges=[0,60]");
    let text = stdout(&weakened, 4);
    assert!(text.contains("OVERRIDDEN") && text.contains("what is to be covered"), "{text}");
    // Whoever asks: the file, the command line, or a project file.
    let path = scenario(place.path(), gaps);
    let wider = "--set coverage.item.gap.edges=[0,60]";
    assert_eq!(code(&campaign(&path, "--gate coverage(gap)>=1")), 1);
    let text = stdout(&campaign(&path, &format!("{wider} --gate coverage(gap)>=1")), 4);
    assert!(text.contains("OVERRIDDEN") && text.contains("what is to be covered"), "{text}");
    fs::write(place.path().join("closecall.toml"), "[gate]\nrequire = ['coverage(gap) >= 1']\n").unwrap();
    let in_project = |more: &[&str]| {
        let words = ["campaign", path.to_str().unwrap(), "--controller", "acc", "-n", "200", "--seed", "3", "--no-out"];
        program().args(words).args(more).current_dir(place.path()).output().unwrap()
    };
    assert_eq!(code(&in_project(&[])), 1);
    assert!(stdout(&in_project(&["--set", "coverage.item.gap.edges=[0,60]"]), 4).contains("OVERRIDDEN"));
    // If nobody asks, nothing is weakened.
    let text = stdout(&campaign(&path, &format!("{wider} --gate count(ego_collided)<=0")), 0);
    assert!(text.contains("PASS"), "{text}");
}
