//! Evaluates the triggers of a storyboard and their conditions.
//!
//! ```text
//!  trigger   = group OR group OR …
//!  group     = condition AND condition AND …
//!  condition = value, then edge, then delay
//! ```

use closecall_traffic::maths;

use super::dom::{ImportError, Node};
use super::plane::RoadPoint;
use super::reader::is_true;
use super::storyboard::{ElementState, Storyboard};
use super::world::Vehicle;

/// Difference of two values that are the same but for rounding: numerical.
const SAME: f64 = 1e-9;

/// What a condition remembers from step to step: its last value, and when it became true.
#[derive(Clone, Debug, Default)]
pub(super) struct Memory {
    last_value: Option<bool>,
    fired_s: Option<f64>,
}

impl Storyboard<'_> {
    /// Returns whether a trigger is true. An absent trigger, or one without conditions, is true at
    /// once.
    pub(super) fn is_triggered(&mut self, trigger: Option<&Node>) -> Result<bool, ImportError> {
        let Some(trigger) = trigger.filter(|trigger| !trigger.children.is_empty()) else { return Ok(true) };
        let mut any_group_holds = false;
        for group in trigger.all("ConditionGroup") {
            let mut all_hold = true;
            if group.children.is_empty() {
                return Err(self.reader.error(group, "it needs a `Condition`"));
            }
            for condition in group.all("Condition") {
                // Every condition is evaluated in every step, because an edge depends on the value
                // in the step before.
                all_hold &= self.holds(condition)?;
            }
            any_group_holds |= all_hold;
        }
        Ok(any_group_holds)
    }

    /// Returns whether a condition is true, with its edge and its delay.
    fn holds(&mut self, node: &Node) -> Result<bool, ImportError> {
        let value = self.value(node)?;
        let edge = self.reader.text(node, "conditionEdge")?;
        let delay_s = self.reader.number_or(node, "delay", 0.0)?;
        let time_s = self.time_s;
        let memory = self.memories.entry(node.id).or_default();
        let last_value = memory.last_value.replace(value);
        let is_now = match edge.as_str() {
            "none" => value,
            "rising" => last_value == Some(false) && value,
            "falling" => last_value == Some(true) && !value,
            "risingOrFalling" => last_value.is_some_and(|last_value| last_value != value),
            _ => return Err(self.reader.error(node, format!("`conditionEdge` is `{edge}`"))),
        };
        if is_now && memory.fired_s.is_none() {
            memory.fired_s = Some(time_s);
        }
        // A condition with a delay becomes true after the delay, and then stays true.
        Ok(match delay_s > 0.0 {
            true => memory.fired_s.is_some_and(|fired_s| time_s >= fired_s + delay_s - SAME),
            false => is_now,
        })
    }

    /// Returns the value of a condition, without its edge and its delay.
    fn value(&self, node: &Node) -> Result<bool, ImportError> {
        let inner = self.reader.only(node)?;
        let reader = &self.reader;
        match inner.name.as_str() {
            "ByValueCondition" => self.by_value(reader.only(inner)?),
            "ByEntityCondition" => {
                let entities = reader.child(inner, &["TriggeringEntities"])?;
                let rule = reader.text(entities, "triggeringEntitiesRule")?;
                let condition = reader.only(reader.child(inner, &["EntityCondition"])?)?;
                let mut values = Vec::new();
                for entity in entities.all("EntityRef") {
                    values.push(self.by_entity(self.vehicle(entity, "entityRef")?, condition)?);
                }
                if values.is_empty() {
                    return Err(reader.error(entities, "it needs an `EntityRef`"));
                }
                match rule.as_str() {
                    "any" => Ok(values.contains(&true)),
                    "all" => Ok(!values.contains(&false)),
                    _ => Err(reader.error(entities, format!("`triggeringEntitiesRule` is `{rule}`"))),
                }
            }
            _ => Err(reader.error(inner, "this kind of condition is not read")),
        }
    }

    fn by_value(&self, node: &Node) -> Result<bool, ImportError> {
        let reader = &self.reader;
        match node.name.as_str() {
            "SimulationTimeCondition" => self.compare(node, self.time_s),
            "ParameterCondition" => {
                // The check of the document has put the value in place of the name.
                let value = reader.text(node, "parameterRef")?;
                let (rule, limit) = (reader.text(node, "rule")?, reader.text(node, "value")?);
                match (value.trim().parse(), rule.as_str()) {
                    (Ok(number), _) => self.compare(node, number),
                    (Err(_), "equalTo") => Ok(value == limit),
                    (Err(_), "notEqualTo") => Ok(value != limit),
                    (Err(_), _) => {
                        let message = format!("`rule` is `{rule}`, and `{value}` is not a number and so has no order");
                        Err(reader.error(node, message))
                    }
                }
            }
            "StoryboardElementStateCondition" => {
                let stated = reader.text(node, "storyboardElementRef")?;
                let state = reader.text(node, "state")?;
                let kind = reader.text(node, "storyboardElementType")?;
                let named: Vec<_> =
                    self.elements.iter().filter(|element| element.kind == kind && element.is_named(&stated)).collect();
                let id = match named[..] {
                    [element] => element.id,
                    [] => return Err(reader.error(node, format!("there is no {kind} `{stated}` in the storyboard"))),
                    [first, ..] => {
                        let (count, path) = (named.len(), first.path.join("::"));
                        let message =
                            format!("`{stated}` is the name of {count} elements: one of them is the {kind} `{path}`");
                        return Err(reader.error(node, message));
                    }
                };
                let Some(element) = self.states.get(&id) else { return Ok(state == "standbyState") };
                let ElementState { started_s, ended_s } = *element;
                let has_started = started_s <= self.time_s;
                match state.as_str() {
                    "startTransition" => Ok(has_started),
                    "runningState" => Ok(has_started && ended_s.is_none()),
                    "endTransition" | "completeState" | "stopTransition" => Ok(ended_s.is_some()),
                    "standbyState" | "skipTransition" => Ok(false),
                    _ => Err(reader.error(node, format!("`state` is `{state}`"))),
                }
            }
            _ => Err(reader.error(node, "this condition is not read")),
        }
    }

    fn by_entity(&self, vehicle: &Vehicle, node: &Node) -> Result<bool, ImportError> {
        let reader = &self.reader;
        match node.name.as_str() {
            "TimeHeadwayCondition" => {
                let other = self.vehicle(node, "entityRef")?;
                let distance_m = vehicle.distance_m(other, is_true(node, "freespace"));
                // A vehicle behind, or one that stands, has no headway.
                Ok(distance_m >= 0.0
                    && vehicle.speed_mps > 0.0
                    && self.compare(node, distance_m / vehicle.speed_mps)?)
            }
            "TimeToCollisionCondition" => {
                let target = reader.child(node, &["TimeToCollisionConditionTarget"])?;
                let entity = reader.only(target)?;
                let is_free_space = is_true(node, "freespace");
                let (distance_m, other_mps) = match entity.name.as_str() {
                    "EntityRef" => {
                        let other = self.vehicle(entity, "entityRef")?;
                        (vehicle.distance_m(other, is_free_space), other.speed_mps)
                    }
                    _ => (vehicle.distance_to_m(self.place_on_road(entity)?.s_m, is_free_space), 0.0),
                };
                let closing_mps = (vehicle.speed_mps - other_mps) * distance_m.signum();
                Ok(closing_mps > 0.0 && self.compare(node, distance_m.abs() / closing_mps)?)
            }
            "RelativeDistanceCondition" => {
                let other = self.vehicle(node, "entityRef")?;
                self.compare(node, vehicle.distance_m(other, is_true(node, "freespace")).abs())
            }
            "DistanceCondition" => {
                let place = self.place_on_road(reader.child(node, &["Position"])?)?;
                let along_m = vehicle.distance_to_m(place.s_m, is_true(node, "freespace")).abs();
                // Without a type, the standard means the straight distance.
                let is_along = node.raw("relativeDistanceType").is_some() || is_true(node, "alongRoute");
                let across_m = if is_along { 0.0 } else { self.across_m(vehicle, &place) };
                self.compare(node, maths::hypot(along_m, across_m))
            }
            "ReachPositionCondition" => {
                let place = self.place_on_road(reader.child(node, &["Position"])?)?;
                let away_m = maths::hypot(place.s_m - vehicle.s_m, self.across_m(vehicle, &place));
                Ok(away_m <= reader.number(node, "tolerance")?)
            }
            "SpeedCondition" => self.compare(node, vehicle.speed_mps),
            "AccelerationCondition" => self.compare(node, vehicle.acceleration_mps2.abs()),
            "RelativeSpeedCondition" => {
                let other = self.vehicle(node, "entityRef")?;
                self.compare(node, vehicle.speed_mps - other.speed_mps)
            }
            "TraveledDistanceCondition" => Ok(vehicle.travelled_m >= reader.number(node, "value")?),
            _ => Err(reader.error(node, "this condition is not read")),
        }
    }

    /// Returns the place on the road that an element `Position` states.
    fn place_on_road(&self, node: &Node) -> Result<RoadPoint, ImportError> {
        self.on_road(self.reader.only(node)?, None)
    }

    /// Returns the distance between a vehicle and a place across the road (m).
    fn across_m(&self, vehicle: &Vehicle, place: &RoadPoint) -> f64 {
        let centre_m =
            self.road.index(vehicle.lane).map_or(f64::NAN, |index| self.road.file_centre_m(index, vehicle.s_m));
        place.t_m - (centre_m + vehicle.offset_m)
    }

    fn compare(&self, node: &Node, left: f64) -> Result<bool, ImportError> {
        let right = self.reader.number(node, "value")?;
        let rule = self.reader.text(node, "rule")?;
        Ok(match rule.as_str() {
            "greaterThan" => left > right,
            "greaterOrEqual" => left >= right,
            "lessThan" => left < right,
            "lessOrEqual" => left <= right,
            "equalTo" => (left - right).abs() <= SAME,
            "notEqualTo" => (left - right).abs() > SAME,
            _ => return Err(self.reader.error(node, format!("`rule` is `{rule}`"))),
        })
    }
}
