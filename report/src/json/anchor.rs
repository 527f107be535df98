//! The study of emergency braking against crash records, as JSON.

use closecall_studies::anchor::{Anchor, Paired, Quantity, Row};
use serde_json::{Map, Value, json};

use super::sensitivity::{insert, run_errors};

/// Returns the study as JSON.
pub fn anchor(anchor: &Anchor) -> Value {
    let conclusion = |quantity: Quantity| {
        let mover = anchor
            .mover(quantity)
            .map(|(row, [own, moved])| json!({ "setting": row.setting, "from": own, "to": moved }));
        let values = json!({
            "published_ratio": quantity.published(),
            "ensemble_range": anchor.range(quantity),
            "covered": anchor.covers(quantity),
            "members_whose_interval_contains_it": anchor.agreeing(quantity).collect::<Vec<_>>(),
            "moved_most_by": mover,
        });
        (quantity.key().to_owned(), values)
    };
    json!({
        "scenario": anchor.scenario,
        "seed": anchor.seed,
        "settings": anchor.settings,
        "samples": anchor.samples,
        "controllers": anchor.controllers,
        "members": anchor.members.iter().map(row).collect::<Vec<_>>(),
        "without_effect": anchor.without_effect,
        "variations": anchor.variations.iter().map(row).collect::<Vec<_>>(),
        "conclusions": Quantity::ALL.map(conclusion).into_iter().collect::<Map<String, Value>>(),
        "errors": run_errors(&anchor.errors),
    })
}

fn row(row: &Row) -> Value {
    let counts = |paired: &Paired| {
        let mut object = Map::new();
        object.insert("without".to_owned(), json!(paired.without()));
        object.insert("with".to_owned(), json!(paired.with()));
        object.insert("both".to_owned(), json!(paired.both));
        insert(&mut object, "ratio", paired.ratio(), "the outcome does not happen without emergency braking");
        Value::Object(object)
    };
    json!({
        "name": row.name,
        "setting": row.setting,
        "samples": row.samples,
        "striking": counts(&row.striking),
        "struck": counts(&row.struck),
    })
}
