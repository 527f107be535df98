//! Conditions, triggers, and the events that they start.

use super::element::Element;
use super::expression::Expression;

/// Returns a condition on a value, without an edge.
fn condition(name: &str, delay_s: Expression, inner: Element) -> Element {
    Element::new("Condition").with("name", name).with("delay", delay_s).with("conditionEdge", "none").child(inner)
}

/// Returns the condition that the simulation has run for this time (s).
pub(super) fn at(name: &str, time_s: Expression) -> Element {
    let time = Element::new("SimulationTimeCondition").with("value", time_s).with("rule", "greaterOrEqual");
    condition(name, 0.0.into(), time.within("ByValueCondition"))
}

/// Returns the condition that the time headway of `from` to `to`, bumper to bumper, is below a
/// value (s).
pub(super) fn headway_below(name: &str, from: &str, to: &str, thw_s: Expression) -> Element {
    let headway = Element::new("TimeHeadwayCondition")
        .with("entityRef", to)
        .with("value", thw_s)
        .with("freespace", "true")
        .with("coordinateSystem", "road")
        .with("relativeDistanceType", "longitudinal")
        .with("rule", "lessThan");
    condition(name, 0.0.into(), by_entity(from, headway))
}

/// Returns the condition that the gap of `from` to `to`, bumper to bumper, is below a value (m).
pub(super) fn gap_below(name: &str, from: &str, to: &str, gap_m: Expression) -> Element {
    let gap = Element::new("RelativeDistanceCondition")
        .with("entityRef", to)
        .with("relativeDistanceType", "longitudinal")
        .with("coordinateSystem", "road")
        .with("value", gap_m)
        .with("freespace", "true")
        .with("rule", "lessThan");
    condition(name, 0.0.into(), by_entity(from, gap))
}

/// Returns the condition that a vehicle has driven a distance since the start (m).
pub(super) fn travelled(name: &str, entity: &str, distance_m: Expression) -> Element {
    let distance = Element::new("TraveledDistanceCondition").with("value", distance_m);
    condition(name, 0.0.into(), by_entity(entity, distance))
}

/// Returns the condition that an event of this name started some time ago (s).
pub(super) fn started(name: &str, event: &str, delay_s: Expression) -> Element {
    let state = Element::new("StoryboardElementStateCondition")
        .with("storyboardElementType", "event")
        .with("storyboardElementRef", event)
        .with("state", "startTransition");
    condition(name, delay_s, state.within("ByValueCondition"))
}

fn by_entity(entity: &str, inner: Element) -> Element {
    let entities = Element::new("TriggeringEntities")
        .with("triggeringEntitiesRule", "any")
        .child(Element::new("EntityRef").with("entityRef", entity));
    Element::new("ByEntityCondition").child(entities).child(inner.within("EntityCondition"))
}

/// Returns a trigger with one condition.
pub(super) fn trigger(name: &'static str, condition: Element) -> Element {
    condition.within("ConditionGroup").within(name)
}

/// Returns an event that happens once. `priority` determines the fate of running events.
pub(super) fn event(name: &str, priority: &str, action: Element, condition: Element) -> Element {
    Element::new("Event")
        .with("name", name)
        .with("priority", priority)
        .with("maximumExecutionCount", 1)
        .child(Element::new("Action").with("name", format!("{name}-action")).child(action.within("PrivateAction")))
        .child(trigger("StartTrigger", condition))
}
