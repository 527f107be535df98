//! The comparison of two campaigns as JSON.

use closecall_campaign::compare::ScenarioComparison;
use serde_json::{Map, Value, json};

/// Returns the changes from one campaign to a later one, by scenario. `differences` are the
/// differences of the two manifests, `tolerance` is the share by which a quantile of a margin may
/// fall, and `is_pass` says whether the later campaign is accepted.
pub fn comparison(scenarios: &[ScenarioComparison], differences: &[String], tolerance: f64, verdict: &str) -> Value {
    let scenario = |scenario: &ScenarioComparison| {
        let margins: Map<String, Value> = scenario
            .margins
            .iter()
            .map(|margin| {
                let means = margin.means();
                let value = json!({
                    "samples": margin.samples,
                    "mean_baseline": means.map(|means| means.baseline),
                    "mean": means.map(|means| means.current),
                    "worst_sample": margin.worst.map(|worst| worst.sample),
                    "worst_change": margin.worst.map(|worst| worst.change),
                });
                (margin.key.to_owned(), value)
            })
            .collect();
        let object = json!({
            "samples": scenario.samples,
            "same": scenario.same,
            "newly_failing": scenario.newly_failing,
            "fixed": scenario.fixed,
            "still_failing": scenario.still_failing,
            "newly_in_error": scenario.newly_in_error,
            "no_longer_in_error": scenario.no_longer_in_error,
            "still_in_error": scenario.still_in_error,
            "margins": margins,
            "margin_regressions": scenario.margin_regressions(tolerance),
        });
        (scenario.scenario.clone(), object)
    };
    json!({
        "verdict": verdict,
        "differences": differences,
        "tolerance": tolerance,
        "scenarios": scenarios.iter().map(scenario).collect::<Map<String, Value>>(),
    })
}
