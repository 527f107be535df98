//! The result of a campaign as JSON.

use closecall_campaign::arm_pairs::{CORRECTION, PairResult, pair_results};
use closecall_campaign::gate::{Answer, Evaluation, ExpectationResult, GateResult, RequirementResult};
use closecall_campaign::harm;
use closecall_campaign::ledger::{Inference, Pairs};
use closecall_campaign::summary::{Counts, Summary};
use closecall_campaign::validity::CheckCounts;
use closecall_campaign::verdict::Judgement;
use closecall_scenarios::promise::{Goal, Hindrance};
use serde_json::{Map, Value, json};

use super::influence::influence;
use super::stamp::stamped;
use crate::campaign::coverage::coverage_json;
use crate::campaign::overview::{ErrorGroup, Overview, ScenarioOverview};
use crate::campaign::words::{reasons, sentence};
use crate::campaign::{CampaignReport, ensemble_json};

/// Returns the result of a campaign: its counts, its verdict, the influence of parameters, and its
/// origin. `wall_s` is its wall time (s), `None` for a merged campaign.
pub fn campaign_report(report: &CampaignReport<'_>, wall_s: Option<f64>) -> Value {
    let (tally, manifest) = (report.tally, report.manifest);
    let mut value = campaign(&tally.summary, report.judged, wall_s);
    value["influence"] = influence(&tally.overview, manifest.sampling.design);
    value["flaky_samples"] = flaky_samples(&tally.overview);
    let verdicts = ensemble_json(&tally.summary, manifest);
    if verdicts.as_array().is_some_and(|verdicts| !verdicts.is_empty()) {
        value["ensemble"] = verdicts;
    }
    stamped(value, Some(manifest.sampling.seed), Some(&manifest.settings()))
}

/// Returns the flaky samples of each scenario and arm, with the message of the first failure.
fn flaky_samples(overview: &Overview) -> Value {
    let of_scenario = |scenario: &ScenarioOverview| -> Vec<Value> {
        let of_arm = |(arm, flaky): (&String, &ErrorGroup)| {
            json!({
                "scenario": scenario.name,
                "controller": arm,
                "samples": flaky.count,
                "first_sample": flaky.first_sample,
                "first_message": flaky.message,
            })
        };
        scenario.flaky.iter().map(of_arm).collect()
    };
    json!(overview.scenarios.iter().flat_map(of_scenario).collect::<Vec<_>>())
}

/// Returns the counts of a campaign and its verdict. `wall_s` is its wall time (s), `None` for a
/// merged campaign.
pub fn campaign(summary: &Summary, judged: &Judgement, wall_s: Option<f64>) -> Value {
    let total = summary.total();
    let mut object = counts(summary, &total);
    if summary.scenarios.len() > 1 {
        unpool(&mut object, summary);
    }
    object.insert("verdict".to_owned(), json!(judged.verdict()));
    object.insert("sentence".to_owned(), json!(sentence(judged, summary.scenarios.len())));
    object.insert("gates".to_owned(), json!(judged.gates.iter().map(gate).collect::<Vec<_>>()));
    object.insert("requirements".to_owned(), json!(judged.requirements.iter().map(requirement).collect::<Vec<_>>()));
    object.insert("expectations".to_owned(), json!(judged.expectations.iter().map(expectation).collect::<Vec<_>>()));
    object.insert("reasons".to_owned(), json!(reasons(judged)));
    object.insert("failures".to_owned(), summary.failures_json());
    object.insert("probabilities".to_owned(), probabilities(judged));
    object.insert("flaky_gate".to_owned(), json!(judged.flaky));
    if !judged.coverage.is_empty() {
        object.insert("coverage".to_owned(), coverage_json(judged));
    }
    object.insert("wall_s".to_owned(), json!(wall_s));
    let scenarios: Map<String, Value> = summary
        .scenarios
        .iter()
        .map(|(name, scenario)| (name.clone(), Value::Object(counts(summary, scenario))))
        .collect();
    object.insert("scenarios".to_owned(), Value::Object(scenarios));
    Value::Object(object)
}

/// Replaces values that would treat several scenarios as one sample. The rate is the mean over the
/// scenarios, each with the same weight. An interval and a test belong to each scenario.
fn unpool(object: &mut Map<String, Value>, summary: &Summary) {
    const REASON: &str = "scenarios are not pooled into one sample: see each scenario";
    if let Some(Value::Object(controllers)) = object.get_mut("controllers") {
        for (index, name) in summary.controllers.iter().enumerate() {
            let Some(Value::Object(controller)) = controllers.get_mut(name) else { continue };
            controller.insert("collision_rate".to_owned(), json!(summary.mean_collision_rate(index)));
            controller.insert("collision_rate_weights".to_owned(), json!("each scenario has the same weight"));
            controller.insert("interval_95".to_owned(), Value::Null);
            controller.insert("interval_95_absent".to_owned(), json!(REASON));
        }
    }
    // The pairs of arms stand with each scenario.
    object.remove("arm_pairs");
    if let Some(Value::Object(paired)) = object.get_mut("paired") {
        paired.insert("mcnemar_p".to_owned(), Value::Null);
        paired.insert("mcnemar_p_absent".to_owned(), json!(REASON));
    }
}

fn gate(gate: &GateResult) -> Value {
    let Evaluation { value, interval_95, samples, hits, answer, needed, .. } = gate.evaluation;
    let passed = match answer {
        Answer::Met => Some(true),
        Answer::Missed => Some(false),
        Answer::Open(_) => None,
    };
    let mut object = json!({
        "scenario": gate.scenario,
        "criterion": gate.expression.to_string(),
        "subject": gate.expression.subject(),
        "operator": gate.expression.operator.to_string(),
        "bound": gate.expression.bound,
        "value": value,
        "interval_95": interval_95,
        "samples": samples,
        "hits": interval_95.map(|_| hits),
        "passed": passed,
        "source": gate.source.to_string(),
    });
    if let Answer::Open(reason) = answer {
        object["passed_absent"] = json!(reason.text());
        object["samples_needed"] = json!(needed);
    }
    object
}

fn requirement(requirement: &RequirementResult) -> Value {
    json!({
        "requirement": requirement.mark,
        "scenario": requirement.scenario,
        "result": requirement.standing.word(),
    })
}

fn expectation(expectation: &ExpectationResult) -> Value {
    let expects: Vec<&str> = expectation.expects.iter().map(|flag| flag.measure().name).collect();
    json!({
        "scenario": expectation.scenario,
        "expects": expects,
        "happened": expectation.happened,
        "samples": expectation.samples,
        "share": expectation.share(),
        "least_share": expectation.least_share,
    })
}

fn counts(summary: &Summary, counts: &Counts) -> Map<String, Value> {
    let mut object = Map::new();
    object.insert("samples".to_owned(), json!(counts.samples));
    object.insert("errors".to_owned(), json!(counts.errors()));
    object.insert("flaky".to_owned(), json!(counts.flaky()));
    object.insert("invalid".to_owned(), json!(counts.invalid));
    object.insert("simulated_s".to_owned(), json!(counts.simulated_s));
    let mut controllers = Map::new();
    for (name, arm) in summary.controllers.iter().zip(&counts.arms) {
        let mut controller = Map::new();
        controller.insert("collisions".to_owned(), json!(arm.collisions));
        controller.insert("touches".to_owned(), json!(arm.touches));
        controller.insert("imposed_hard".to_owned(), json!(arm.imposed));
        controller.insert("imposed_hard_share".to_owned(), json!(arm.imposed_share()));
        let mean_imposed_mps2 = arm.mean_cost().map(|cost| cost.imposed_braking_mps2);
        controller.insert("mean_imposed_braking_mps2".to_owned(), json!(mean_imposed_mps2));
        controller.insert("collision_rate".to_owned(), json!(arm.collision_rate()));
        controller.insert("interval_95".to_owned(), json!(arm.interval_95(summary.inference)));
        if summary.inference == Inference::Design {
            controller.insert("interval_95_absent".to_owned(), json!(DEPENDENT));
        }
        controller.insert("interval_method".to_owned(), json!(summary.inference.method()));
        controller.insert("max_speed_deficit_mps".to_owned(), json!(arm.max_speed_deficit_mps));
        controller.insert("errors".to_owned(), json!(arm.errors));
        controller.insert("flaky".to_owned(), json!(arm.flaky));
        controller.insert("engagements".to_owned(), json!(arm.engagements));
        controller.insert("engagement_rate".to_owned(), json!(arm.engagement_rate()));
        controller.insert("goals_in_reach".to_owned(), json!(arm.goals_in_reach));
        controller.insert("max_jerk_mps3".to_owned(), json!(arm.max_jerk_mps3));
        controller.insert("max_delta_v_mps".to_owned(), json!(arm.max_delta_v_mps));
        controller.insert("harm".to_owned(), json!(arm.harm));
        controllers.insert(name.clone(), Value::Object(controller));
    }
    object.insert("controllers".to_owned(), Value::Object(controllers));
    if summary.is_paired() {
        object.insert("paired".to_owned(), paired(&counts.pairs, summary.inference));
        let why = |(why, times): &(Hindrance, u64)| json!({ "reason": why.to_string(), "samples": times });
        object.insert("not_prevented".to_owned(), counts.not_prevented.iter().map(why).collect());
        let results = pair_results(summary, counts);
        object.insert("arm_pairs".to_owned(), json!(results.iter().map(arm_pair).collect::<Vec<_>>()));
    }
    let goal = |(goal, times): &(Goal, u64)| json!({ "goal": goal.text(), "samples": times });
    object.insert("goals".to_owned(), counts.goals.iter().map(goal).collect());
    object.insert("checks".to_owned(), checks(&counts.checks));
    object
}

/// Why the samples of a design have no interval and no test.
const DEPENDENT: &str = "the samples of the designs sobol, grid and coverage are not independent";

fn paired(pairs: &Pairs, inference: Inference) -> Value {
    let mut object = json!({
        "prevented": pairs.prevented,
        "induced": pairs.induced,
        "both": pairs.both,
        "neither": pairs.neither,
        "induced_of_others": pairs.induced_of_others,
        "both_of_others": pairs.both_of_others,
        "prevented_harm": pairs.prevented_harm,
        "induced_harm": pairs.induced_harm,
        "harm_weight": harm::WEIGHT,
        "mcnemar_p": pairs.mcnemar_p(inference),
    });
    match inference {
        Inference::FixedSamples => {}
        Inference::Sequential => {
            object["mcnemar_p_absent"] = json!("the number of samples was not fixed in advance");
        }
        Inference::Design => object["mcnemar_p_absent"] = json!(DEPENDENT),
    }
    object
}

fn arm_pair(result: &PairResult<'_>) -> Value {
    let pairs = result.pairs;
    json!({
        "baseline": result.baseline,
        "tested": result.tested,
        "prevented": pairs.prevented,
        "prevented_interval_95": result.prevented_95,
        "induced": pairs.induced,
        "induced_interval_95": result.induced_95,
        "both": pairs.both,
        "neither": pairs.neither,
        "prevented_harm": pairs.prevented_harm,
        "induced_harm": pairs.induced_harm,
        "mcnemar_p": result.mcnemar_p,
        "mcnemar_p_corrected": result.corrected_p,
        "correction": CORRECTION,
    })
}

fn checks(counts: &CheckCounts) -> Value {
    let broken: Map<String, Value> =
        counts.broken().map(|(check, count)| (check.name().to_owned(), json!(count))).collect();
    json!({ "runs": counts.runs, "not_checked": counts.not_checked, "flips": counts.flips, "flip_rate": counts.flip_rate(), "broken": broken })
}

/// Returns the findings of the gate on the probability of a collision, by scenario.
fn probabilities(judged: &Judgement) -> Value {
    Value::Object(judged.probabilities.iter().map(|(name, finding)| (name.clone(), json!(finding))).collect())
}
