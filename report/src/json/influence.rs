//! The influences on the result of a campaign, as JSON.

use closecall_scenarios::sampling::Design;
use closecall_traffic::statistics::sensitivity::given_data::Influence;
use serde_json::{Map, Value, json};

use crate::campaign::overview::{EventInfluence, FEW_EVENTS, Overview};

/// Returns what moves the result of each scenario of a campaign.
pub(super) fn influence(overview: &Overview, design: Design) -> Value {
    let of_scenario = |scenario: &crate::campaign::overview::ScenarioOverview| {
        let events = match scenario.influence.events(design) {
            Ok(events) => json!({ "events": events.iter().map(event).collect::<Vec<_>>() }),
            Err(reason) => json!({ "events": null, "events_absent": reason }),
        };
        (scenario.name.clone(), events)
    };
    let scenarios: Map<String, Value> = overview.scenarios.iter().map(of_scenario).collect();
    Value::Object(scenarios)
}

fn event(influence: &EventInfluence) -> Value {
    let parameter = |(name, Influence { index, rates }): &(String, Influence)| {
        json!({
            "parameter": name,
            "index": index.value,
            "interval_95": index.interval_95,
            "rates": rates.iter().map(|rate| rate.value).collect::<Vec<_>>(),
            "rate_intervals_95": rates.iter().map(|rate| rate.interval_95).collect::<Vec<_>>(),
        })
    };
    let parameters = influence.parameters.as_ref().map(|list| list.iter().map(parameter).collect::<Vec<_>>());
    let mut object = json!({ "event": influence.event.name(), "samples": influence.samples, "events": influence.events, "parameters": parameters });
    if influence.parameters.is_none() {
        object["parameters_absent"] = json!(FEW_EVENTS);
    }
    object
}
