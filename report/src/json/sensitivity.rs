//! The result of a sensitivity study as JSON.

use closecall_campaign::sensitivity::{
    Decomposition, Factor, OutputEffects, OutputIndices, RunErrors, Screening, Sensitivity,
};
use closecall_traffic::statistics::sensitivity::jackknife::Estimate;
use closecall_traffic::statistics::sensitivity::morris::Effects;
use closecall_traffic::statistics::sensitivity::saltelli::MainEffect;
use serde_json::{Map, Value, json};

/// The reason for which an index is absent.
const NO_INDEX: &str = "the output does not vary, or changes in too few rows";
/// The reason for which an effect is absent.
const NO_EFFECT: &str = "too few runs have an output";

/// Returns the result of a sensitivity study.
pub fn sensitivity(study: &Sensitivity) -> Value {
    let factor = |factor: &Factor| json!({ "name": factor.name, "kind": factor.kind.name(), "range": factor.range, "source": factor.source });
    let left_out: Vec<Value> =
        study.left_out.iter().map(|left| json!({ "key": left.key, "reason": left.reason })).collect();
    json!({
        "scenario": study.scenario,
        "seed": study.seed,
        "settings": study.settings,
        "controllers": study.controllers,
        "greatest": study.greatest().map(|factor| &study.factors[factor].name),
        "factors": study.factors.iter().map(factor).collect::<Vec<_>>(),
        "left_out": left_out,
        "screening": study.screening.as_ref().map(|results| screening(study, results)),
        "decomposition": study.decomposition.as_ref().map(|results| decomposition(study, results)),
        "errors": run_errors(&study.errors()),
    })
}

/// Returns the errors of runs.
pub(super) fn run_errors(errors: &RunErrors) -> Value {
    let kinds =
        errors.kinds.iter().map(|(kind, (count, message))| json!({ "kind": kind, "runs": count, "message": message }));
    json!({ "count": errors.points, "kinds": kinds.collect::<Vec<_>>() })
}

/// Adds an estimate and its interval, or the reason for which there is none.
pub(super) fn insert(object: &mut Map<String, Value>, key: &str, estimate: Option<Estimate>, absent: &str) {
    object.insert(key.to_owned(), json!(estimate.map(|estimate| estimate.value)));
    object.insert(format!("{key}_interval_95"), json!(estimate.map(|estimate| estimate.interval_95)));
    if estimate.is_none() {
        object.insert(format!("{key}_absent"), json!(absent));
    }
}

fn screening(study: &Sensitivity, results: &Screening) -> Value {
    let effects = |OutputEffects { output, of_factors }: &OutputEffects| {
        let of_factor = |(factor, effects): (&Factor, &Effects)| {
            let Effects { mu, mu_star, sigma, effects, missing } = effects;
            let mut object = Map::new();
            object.insert("factor".to_owned(), json!(factor.name));
            insert(&mut object, "mu_star", *mu_star, NO_EFFECT);
            object.insert("mu".to_owned(), json!(mu));
            object.insert("sigma".to_owned(), json!(sigma));
            object.insert("effects".to_owned(), json!(effects));
            object.insert("missing".to_owned(), json!(missing));
            Value::Object(object)
        };
        let effects: Vec<Value> = study.factors.iter().zip(of_factors).map(of_factor).collect();
        json!({ "output": output.name(), "effects": effects })
    };
    json!({
        "trajectories": results.trajectories,
        "points": results.points,
        "errors": results.errors.points,
        "outputs": results.effects.iter().map(effects).collect::<Vec<_>>(),
    })
}

fn decomposition(study: &Sensitivity, results: &Decomposition) -> Value {
    let of_output = |output: &OutputIndices| {
        let groups: Vec<Value> =
            output.order().into_iter().map(|group| indices(study, results, output, group)).collect();
        let effect = |factor: usize| {
            let MainEffect { index, means } = output.main_effects[factor]?;
            Some(json!({
                "factor": study.factors[factor].name,
                "index": index.value,
                "interval_95": index.interval_95,
                "quarter_means": means.map(|mean| mean.value),
                "quarter_intervals_95": means.map(|mean| mean.interval_95),
            }))
        };
        let effects: Vec<Value> = output.strongest().into_iter().filter_map(effect).collect();
        json!({ "output": output.output.name(), "mean": output.mean, "main_effects": effects, "indices": groups })
    };
    json!({
        "rows": results.rows,
        "points": results.points,
        "errors": results.errors.points,
        "outputs": results.indices.iter().map(of_output).collect::<Vec<_>>(),
    })
}

fn indices(study: &Sensitivity, results: &Decomposition, output: &OutputIndices, group: usize) -> Value {
    let (of_group, indices) = (&results.groups[group], &output.of_groups[group]);
    let names: Vec<&str> = of_group.factors.iter().map(|factor| study.factors[*factor].name.as_str()).collect();
    let mut object = Map::new();
    object.insert("factors".to_owned(), json!(names));
    insert(&mut object, "total", indices.total, NO_INDEX);
    insert(&mut object, "first", indices.first, NO_INDEX);
    object.insert("changes".to_owned(), json!(indices.changes));
    object.insert("rows".to_owned(), json!(indices.rows));
    Value::Object(object)
}
