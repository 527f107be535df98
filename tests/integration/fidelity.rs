//! `study fidelity`: two campaigns of the same samples, and those that are none.

use std::path::{Path, PathBuf};
use std::process::Output;

use crate::support::{closecall, code, folder, json, library, message, stdout};

fn campaign(out: &Path, words: &str) -> PathBuf {
    let path = library("low-thw-overtake");
    let fixed = ["campaign", path.to_str().unwrap(), "--paired", "--no-gate", "--out", out.to_str().unwrap()];
    let ran = closecall(fixed.into_iter().chain(words.split_whitespace()));
    assert_eq!(code(&ran), 0, "{}", message(&ran));
    out.to_owned()
}

fn study(full: &Path, fast: &Path, more: &[&str]) -> Output {
    let words = ["study", "fidelity", full.to_str().unwrap(), fast.to_str().unwrap()];
    closecall(words.iter().chain(more))
}

#[test]
fn fast_runs_narrow_the_interval_of_a_rate_and_other_campaigns_are_refused() {
    let place = folder();
    let at = |name: &str| place.path().join(name);
    let full = campaign(&at("full"), "-n 150 --seed 1 --sensors object --no-validity-checks");
    let fast = campaign(&at("fast"), "-n 900 --seed 1 --sensors ground-truth --no-validity-checks");
    let value = json(&study(&full, &fast, &["--format", "json"]), 0);
    let report = &value["scenarios"][0];
    assert_eq!(
        (&report["samples"], &report["more_samples"], &report["left_out"]),
        (&150.into(), &750.into(), &0.into())
    );
    let of_baseline = &report["rates"][0];
    assert_eq!(of_baseline["of"], "ego_collided: acc");
    let width = |interval: &serde_json::Value| interval[1].as_f64().unwrap() - interval[0].as_f64().unwrap();
    let sharp = width(&of_baseline["estimate"]["interval_95"]);
    // The cruise control does not look back: the modes hardly differ in its arm.
    assert!(of_baseline["correlation"].as_f64().unwrap() > 0.9, "{of_baseline}");
    assert!(sharp < 0.6 * width(&of_baseline["plain_interval_95"]), "{of_baseline}");
    // The exact interval of all fast samples, of which 900 are known, is about as wide: the fast runs give no more than they have.
    assert!(of_baseline["estimate"]["worth_samples"].as_f64().unwrap() < 900.0, "{of_baseline}");
    let induced = &report["rates"][3];
    assert_eq!(induced["of"], "induced");
    assert!(induced["estimate"].is_null(), "few events have no such interval: {induced}");
    let text = stdout(&study(&full, &fast, &[]), 0);
    assert!(text.contains("worth ") && text.contains("events are too few or too many"), "{text}");

    let other = campaign(&at("other-seed"), "-n 900 --seed 2 --sensors ground-truth --no-validity-checks");
    for (one, two, part) in [
        (&full, &other, "sampling.seed"),
        (&fast, &full, "the fast campaign needs more of them"),
        (&full, &full, "sensors: the same there and here"),
    ] {
        let refused = study(one, two, &[]);
        assert_eq!(code(&refused), 2, "{part}");
        assert!(message(&refused).contains(part), "{part}: {}", message(&refused));
    }
    let sobol = campaign(&at("sobol"), "-n 160 --seed 1 --sensors ground-truth --design sobol --no-validity-checks");
    assert!(message(&study(&full, &sobol, &[])).contains("independent samples"));
}
