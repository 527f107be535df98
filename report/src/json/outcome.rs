//! The outcome of a run as JSON.

use closecall_scenarios::outcome::{
    Collision, Margins, MisSummary, Outcome, Promise, ReachedMoment, ReasonSpan, Unavailability,
};
use closecall_scenarios::promise::Goal;
use closecall_traffic::{Absent, Measured, Value as ParameterValue};
use serde_json::{Map, Value, json};

use crate::run::film::EncounterMetrics;

/// Inserts a value under `key`, or `null` and the reason why the value is absent.
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

/// Returns the outcome of a run in one arm.
pub fn outcome(outcome: &Outcome) -> Value {
    json!({
        "scenario": outcome.scenario,
        "seed": outcome.seed,
        "sample": outcome.sample,
        "controller": outcome.controller,
        "end": outcome.end,
        "duration_s": outcome.duration.s(),
        "parameters": parameters(outcome),
        "collisions": outcome.collisions.iter().map(collision).collect::<Vec<_>>(),
        "touches": outcome.touches.iter().map(collision).collect::<Vec<_>>(),
        "moments": outcome.moments.iter().map(moment).collect::<Vec<_>>(),
        "margins": margins(outcome),
        "mis": mis(&outcome.mis),
        "promise": outcome.promise.as_ref().map(|kept| promise(kept, outcome)),
    })
}

/// Returns the metrics of an encounter, recorded or simulated.
pub fn encounter_metrics(metrics: &EncounterMetrics) -> Value {
    let mut object = Map::new();
    insert(&mut object, "crossing_s", metrics.crossing_s);
    insert(&mut object, "thw_front_at_crossing_s", metrics.thw_front_at_crossing_s);
    insert(&mut object, "thw_rear_at_crossing_s", metrics.thw_rear_at_crossing_s);
    insert(&mut object, "min_thw_front_s", metrics.min_thw_front_s);
    insert(&mut object, "min_thw_rear_s", metrics.min_thw_rear_s);
    insert(&mut object, "max_deceleration_mps2", Ok(metrics.max_deceleration_mps2));
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

fn moment(at: &ReachedMoment) -> Value {
    json!({ "moment": at.moment, "letter": at.moment.letter(), "time_s": at.time.s(), "vehicle": at.vehicle })
}

fn margins(outcome: &Outcome) -> Value {
    let margins: &Margins = &outcome.margins;
    let mut object = Map::new();
    insert(
        &mut object,
        "min_ttc_front_s",
        outcome.ahead.map_or(Err(Absent::NotRecorded), |ahead| ahead.min_ttc_front_s),
    );
    insert(&mut object, "min_thw_front_s", margins.min_thw_front_s);
    insert(&mut object, "min_thw_rear_s", margins.min_thw_rear_s);
    insert(&mut object, "min_gap_front_m", margins.min_gap_front_m);
    insert(&mut object, "min_gap_rear_m", margins.min_gap_rear_m);
    insert(&mut object, "min_ttc_rear_s", margins.min_ttc_rear_s);
    insert(&mut object, "max_deceleration_mps2", Ok(margins.max_deceleration_mps2));
    insert(&mut object, "max_jerk_mps3", Ok(margins.max_jerk_mps3));
    insert(&mut object, "max_speed_deficit_mps", Ok(margins.max_speed_deficit_mps));
    insert(
        &mut object,
        "emergency_braking_at_s",
        outcome.ahead.map_or(Err(Absent::NotRecorded), |ahead| ahead.emergency_braking_at_s),
    );
    Value::Object(object)
}

fn promise(promise: &Promise, outcome: &Outcome) -> Value {
    let mut object = Map::new();
    object.insert("goal".to_owned(), json!(Goal::of(outcome).map(Goal::text)));
    object.insert("in_reach".to_owned(), json!(promise.in_reach));
    insert(&mut object, "thw_raised_s", promise.thw_raised_s);
    insert(&mut object, "crossing_braking_mps2", promise.crossing_braking_mps2);
    Value::Object(object)
}

fn mis(mis: &Result<MisSummary, Absent>) -> Value {
    let mut object = Map::new();
    let measured = |value: fn(&MisSummary) -> Measured| mis.as_ref().map_err(|absent| *absent).and_then(value);
    insert(&mut object, "engaged_at_s", measured(|mis| mis.engaged_at_s));
    insert(&mut object, "released_at_s", measured(|mis| mis.released_at_s));
    insert(&mut object, "thw_front_at_engagement_s", measured(|mis| mis.thw_front_at_engagement_s));
    insert(&mut object, "thw_front_at_critical_s", measured(|mis| mis.thw_front_at_critical_s));
    insert(&mut object, "mean_deceleration_mps2", measured(|mis| mis.mean_deceleration_mps2));
    object.insert("goal_in_reach".to_owned(), json!(mis.as_ref().ok().and_then(|mis| mis.goal_in_reach)));
    if let Some(unavailable) = mis.as_ref().ok().and_then(|mis| mis.unavailable.as_ref()) {
        let Unavailability { from_s, lasted_s, reason } = unavailable;
        let value = json!({ "from_s": from_s, "lasted_s": lasted_s, "reason": reason.to_string() });
        object.insert("unavailable".to_owned(), value);
    }
    if let Ok(mis) = mis {
        let span = |span: &ReasonSpan| json!({ "reason": span.reason.to_string(), "from_s": span.from_s, "until_s": span.until_s });
        object.insert("reasons".to_owned(), mis.reasons.iter().map(span).collect());
        object.insert("decided_s".to_owned(), json!(mis.decided_s));
    }
    let reason = mis.as_ref().map_or_else(ToString::to_string, |mis| mis.reason.to_string());
    object.insert("reason".to_owned(), json!(reason));
    Value::Object(object)
}
