//! Results as JSON with stable keys. An absent value is `null`, and the key `…_absent` beside it states the reason.

use closecall_campaign::gate::{Answer, Evaluation, ExpectationResult, GateResult, RequirementResult};
use closecall_campaign::harm;
use closecall_campaign::ledger::{Inference, Pairs};
use closecall_campaign::manifest::version;
use closecall_campaign::summary::{Counts, Summary};
use closecall_campaign::validity::CheckCounts;
use closecall_campaign::verdict::Judgement;
use closecall_report::run::film::Course;
use closecall_simulation::outcome::{Collision, Margins, MisSummary, MomentAt, Outcome};
use closecall_simulation::scenario::Setting;
use closecall_traffic::{Absent, Measured, Value as ParameterValue};
use serde_json::{Map, Value, json};

/// Inserts a value under `key`, or `null` and the reason for which it is absent.
fn insert(object: &mut Map<String, Value>, key: &str, measured: Measured) {
    match measured {
        Ok(value) => {
            object.insert(key.to_owned(), json!(value));
        }
        Err(absent) => {
            object.insert(key.to_owned(), Value::Null);
            object.insert(format!("{key}_absent"), json!(absent.to_string()));
        }
    }
}

/// The version of the keys of `--format json`. It changes if a key changes its meaning, not if one is added.
const SCHEMA_VERSION: u32 = 1;

/// Adds how an output was made: to an object, or to each object of a list. Keys that are there already stay.
pub(super) fn stamped(mut value: Value, seed: Option<u64>, settings: Option<&[Setting]>) -> Value {
    let objects = match &mut value {
        Value::Array(list) => list.iter_mut().collect(),
        one => vec![one],
    };
    let version = version();
    for object in objects.into_iter().filter_map(Value::as_object_mut) {
        let mut add = |key: &str, value: Value| {
            object.entry(key.to_owned()).or_insert(value);
        };
        add("schema_version", json!(SCHEMA_VERSION));
        add("closecall_version", json!(version));
        if let Some(seed) = seed {
            add("seed", json!(seed));
        }
        if let Some(settings) = settings {
            add("settings", settings.iter().map(ToString::to_string).collect());
        }
    }
    value
}

/// Returns the object of `run --format json`.
pub(super) fn outcome(outcome: &Outcome) -> Value {
    json!({
        "scenario": outcome.scenario,
        "seed": outcome.seed,
        "sample": outcome.sample,
        "controller": outcome.controller,
        "end": outcome.end,
        "duration_s": outcome.duration.s(),
        "parameters": parameters(outcome),
        "collisions": outcome.collisions.iter().map(collision).collect::<Vec<_>>(),
        "moments": outcome.moments.iter().map(moment).collect::<Vec<_>>(),
        "margins": margins(&outcome.margins),
        "mis": mis(&outcome.mis),
    })
}

/// Returns the margins of an encounter, recorded or simulated.
pub(super) fn course(course: &Course) -> Value {
    let mut object = Map::new();
    insert(&mut object, "crossing_s", course.crossing_s);
    insert(&mut object, "thw_front_at_crossing_s", course.thw_front_at_crossing_s);
    insert(&mut object, "thw_rear_at_crossing_s", course.thw_rear_at_crossing_s);
    insert(&mut object, "min_thw_front_s", course.min_thw_front_s);
    insert(&mut object, "min_thw_rear_s", course.min_thw_rear_s);
    insert(&mut object, "max_deceleration_mps2", Ok(course.max_deceleration_mps2));
    Value::Object(object)
}

fn parameters(outcome: &Outcome) -> Map<String, Value> {
    let value = |value: &ParameterValue| match value {
        ParameterValue::Number(number) => json!(number),
        ParameterValue::Label(label) => json!(label),
    };
    outcome.parameters.iter().map(|(name, parameter)| (name.to_string(), value(parameter))).collect()
}

fn collision(collision: &Collision) -> Value {
    let [first, second] = &collision.between;
    json!({
        "time_s": collision.time.s(),
        "between": collision.between,
        "struck_side": collision.struck_side,
        "closed_by": collision.closed_by,
        "phase": collision.phase,
        "relative_speed_mps": collision.relative_speed_mps,
        "delta_v_mps": { first.as_str(): collision.delta_v_mps[0], second.as_str(): collision.delta_v_mps[1] },
    })
}

fn moment(at: &MomentAt) -> Value {
    json!({ "moment": at.moment, "letter": at.moment.letter(), "time_s": at.time.s() })
}

fn margins(margins: &Margins) -> Value {
    let mut object = Map::new();
    insert(&mut object, "min_thw_front_s", margins.min_thw_front_s);
    insert(&mut object, "min_thw_rear_s", margins.min_thw_rear_s);
    insert(&mut object, "min_gap_front_m", margins.min_gap_front_m);
    insert(&mut object, "min_gap_rear_m", margins.min_gap_rear_m);
    insert(&mut object, "min_ttc_rear_s", margins.min_ttc_rear_s);
    insert(&mut object, "max_deceleration_mps2", Ok(margins.max_deceleration_mps2));
    insert(&mut object, "max_jerk_mps3", Ok(margins.max_jerk_mps3));
    insert(&mut object, "max_speed_deficit_mps", Ok(margins.max_speed_deficit_mps));
    Value::Object(object)
}

fn mis(mis: &Result<MisSummary, Absent>) -> Value {
    let mut object = Map::new();
    let of = |value: fn(&MisSummary) -> Measured| mis.as_ref().map_err(|absent| *absent).and_then(value);
    insert(&mut object, "engaged_at_s", of(|mis| mis.engaged_at_s));
    insert(&mut object, "released_at_s", of(|mis| mis.released_at_s));
    insert(&mut object, "thw_front_at_engagement_s", of(|mis| mis.thw_front_at_engagement_s));
    insert(&mut object, "thw_front_at_critical_s", of(|mis| mis.thw_front_at_critical_s));
    insert(&mut object, "mean_deceleration_mps2", of(|mis| mis.mean_deceleration_mps2));
    object.insert("goal_in_reach".to_owned(), json!(mis.as_ref().ok().and_then(|mis| mis.goal_in_reach)));
    let reason = mis.as_ref().map_or_else(ToString::to_string, |mis| mis.reason.to_string());
    object.insert("reason".to_owned(), json!(reason));
    Value::Object(object)
}

/// Returns the object of `campaign --format json`. `wall_s` is `None` for a merged campaign.
pub(super) fn campaign(summary: &Summary, judged: &Judgement, wall_s: Option<f64>) -> Value {
    let total = summary.total();
    let mut object = counts(summary, &total);
    if summary.scenarios.len() > 1 {
        unpool(&mut object, summary);
    }
    object.insert("verdict".to_owned(), json!(judged.verdict()));
    object.insert("gates".to_owned(), json!(judged.gates.iter().map(gate).collect::<Vec<_>>()));
    object.insert("requirements".to_owned(), json!(judged.requirements.iter().map(requirement).collect::<Vec<_>>()));
    object.insert("expectations".to_owned(), json!(judged.expectations.iter().map(expectation).collect::<Vec<_>>()));
    object.insert("reasons".to_owned(), json!(judged.reasons));
    object.insert("probabilities".to_owned(), probabilities(judged));
    object.insert("wall_s".to_owned(), json!(wall_s));
    let scenarios: Map<String, Value> = summary
        .scenarios
        .iter()
        .map(|(name, scenario)| (name.clone(), Value::Object(counts(summary, scenario))))
        .collect();
    object.insert("scenarios".to_owned(), Value::Object(scenarios));
    Value::Object(object)
}

/// Replaces what would treat several scenarios as one sample. The rate is the mean over the scenarios, each with the same
/// weight; an interval and a test stand with each scenario.
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
    if let Some(Value::Object(paired)) = object.get_mut("paired") {
        paired.insert("mcnemar_p".to_owned(), Value::Null);
        paired.insert("mcnemar_p_absent".to_owned(), json!(REASON));
    }
}

fn gate(gate: &GateResult) -> Value {
    let Evaluation { value, interval_95, samples, answer } = gate.evaluation;
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
        "passed": passed,
        "source": gate.source.to_string(),
    });
    if let Answer::Open(reason) = answer {
        object["passed_absent"] = json!(reason.text());
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
    object.insert("invalid".to_owned(), json!(counts.invalid));
    object.insert("simulated_s".to_owned(), json!(counts.simulated_s));
    let mut controllers = Map::new();
    for (name, arm) in summary.controllers.iter().zip(&counts.arms) {
        let mut controller = Map::new();
        controller.insert("collisions".to_owned(), json!(arm.collisions));
        controller.insert("collision_rate".to_owned(), json!(arm.collision_rate()));
        controller.insert("interval_95".to_owned(), json!(arm.interval_95(summary.inference)));
        controller.insert("interval_method".to_owned(), json!(summary.inference.method()));
        controller.insert("max_speed_deficit_mps".to_owned(), json!(arm.max_speed_deficit_mps));
        controller.insert("errors".to_owned(), json!(arm.errors));
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
    }
    object.insert("checks".to_owned(), checks(&counts.checks));
    object
}

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
    if inference == Inference::Sequential {
        object["mcnemar_p_absent"] = json!("the number of samples was not fixed in advance");
    }
    object
}

fn checks(counts: &CheckCounts) -> Value {
    let broken: Map<String, Value> =
        counts.broken().map(|(check, count)| (check.name().to_owned(), json!(count))).collect();
    json!({ "runs": counts.runs, "flips": counts.flips, "flip_rate": counts.flip_rate(), "broken": broken })
}

/// Returns the findings of the gate on the probability of a collision, by scenario.
fn probabilities(judged: &Judgement) -> Value {
    Value::Object(judged.probabilities.iter().map(|(name, finding)| (name.clone(), json!(finding))).collect())
}
