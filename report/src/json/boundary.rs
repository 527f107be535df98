//! The result of a boundary as JSON.

use closecall_campaign::boundary::{Boundary, Crossing, Doubt, Ran, Slice, Surveyed};
use serde_json::{Map, Value, json};

use super::sensitivity::run_errors;

/// Returns the result of a boundary.
pub fn boundary(boundary: &Boundary) -> Value {
    let mut object = Map::new();
    let mut add = |key: &str, value: Value| object.insert(key.to_owned(), value);
    add("scenario", json!(boundary.scenario));
    add("seed", json!(boundary.seed));
    add("sample", json!(boundary.sample));
    add("settings", json!(boundary.settings));
    add("controllers", json!(boundary.controllers));
    add("event", json!(boundary.event));
    add("quantity", json!(boundary.quantity));
    add("keys", json!(boundary.keys));
    add("ranges", json!(boundary.ranges));
    add("conclusive", json!(boundary.is_conclusive()));
    add("surface", json!(boundary.surveyed.as_ref().map(surface)));
    if boundary.surveyed.is_none() {
        add("surface_absent", json!(boundary.absent()));
    }
    add("runs", boundary.runs.iter().map(run).collect());
    add("errors", run_errors(&boundary.errors));
    Value::Object(object)
}

fn surface(surveyed: &Surveyed) -> Value {
    let Surveyed { slices, area, check, noise_sd, doubts, .. } = surveyed;
    json!({
        "doubts": doubts.iter().map(Doubt::to_string).collect::<Vec<_>>(),
        "area": { "passes": area.passes, "fails": area.fails, "undecided": area.undecided },
        "leave_one_out": {
            "runs": check.runs,
            "signs": check.signs,
            "signs_expected": check.signs_expected,
            "probability": check.probability,
            "start_runs": check.start_runs,
            "start_signs": check.start_signs,
            "inside_95": check.inside_95,
        },
        "noise_sd": noise_sd,
        "slices": slices.iter().map(slice).collect::<Vec<_>>(),
    })
}

fn slice(slice: &Slice) -> Value {
    let crossing = |crossing: &Crossing| json!({ "second": crossing.second, "interval_95": crossing.interval_95 });
    json!({
        "first": slice.first,
        "crossings": slice.crossings.iter().map(crossing).collect::<Vec<_>>(),
        "fails": slice.fails,
        "undecided": slice.undecided,
    })
}

fn run(run: &Ran) -> Value {
    json!({ "at": run.at, "value": run.value, "event": run.happens, "start": run.is_start })
}
