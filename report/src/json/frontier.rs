//! The result of a frontier as JSON.

use closecall_campaign::frontier::{Frontier, Point};
use serde_json::{Map, Value, json};

use super::sensitivity::{insert, run_errors};

/// Returns the result of a frontier.
pub fn frontier(frontier: &Frontier) -> Value {
    let point = |point: &Point| {
        let mut object = Map::new();
        object.insert("values".to_owned(), json!(point.values));
        object.insert("optimal".to_owned(), json!(point.is_optimal));
        object.insert("samples".to_owned(), json!(point.samples));
        object.insert("collisions_without".to_owned(), json!(point.collisions_without));
        object.insert("collisions".to_owned(), json!(point.collisions));
        object.insert("prevented".to_owned(), json!(point.pairs.prevented));
        object.insert("induced".to_owned(), json!(point.pairs.induced));
        object.insert("prevented_harm".to_owned(), json!(point.pairs.prevented_harm));
        object.insert("induced_harm".to_owned(), json!(point.pairs.induced_harm));
        insert(&mut object, "prevented_share", point.prevented, "no collision in the baseline");
        insert(&mut object, "induced_share", point.induced, "no sample has an outcome");
        insert(&mut object, "speed_lost_mps", point.speed_lost_mps, "fewer than two samples have an outcome");
        Value::Object(object)
    };
    json!({
        "scenario": frontier.scenario,
        "seed": frontier.seed,
        "settings": frontier.settings,
        "samples": frontier.samples,
        "controllers": frontier.controllers,
        "keys": frontier.keys,
        "points": frontier.points.iter().map(point).collect::<Vec<_>>(),
        "errors": run_errors(&frontier.errors),
    })
}
