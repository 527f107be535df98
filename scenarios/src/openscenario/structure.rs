//! The elements of which a storyboard is built. Any other element at these places is refused: it would
//! be left out in silence.

use super::dom::{ImportError, Node};
use super::reader::Reader;

/// The elements that may stand inside an element, by ASAM OpenSCENARIO XML 1.3. What is inside an
/// action or a condition is checked where it is read.
const INSIDE: [(&str, &[&str]); 19] = [
    (
        "OpenSCENARIO",
        &[
            "FileHeader",
            "ParameterDeclarations",
            "VariableDeclarations",
            "MonitorDeclarations",
            "CatalogLocations",
            "RoadNetwork",
            "Entities",
            "Storyboard",
        ],
    ),
    ("RoadNetwork", &["LogicFile", "SceneGraphFile", "TrafficSignals", "UsedArea"]),
    ("Storyboard", &["Init", "Story", "StopTrigger"]),
    ("Init", &["Actions"]),
    ("Actions", &["GlobalAction", "UserDefinedAction", "Private"]),
    ("Private", &["PrivateAction"]),
    ("Story", &["ParameterDeclarations", "Act"]),
    ("Act", &["ManeuverGroup", "StartTrigger", "StopTrigger"]),
    ("ManeuverGroup", &["Actors", "CatalogReference", "Maneuver"]),
    ("Actors", &["EntityRef"]),
    ("Maneuver", &["ParameterDeclarations", "Event"]),
    ("Event", &["Action", "StartTrigger"]),
    ("Action", &["PrivateAction", "GlobalAction", "UserDefinedAction"]),
    ("StartTrigger", &["ConditionGroup"]),
    ("StopTrigger", &["ConditionGroup"]),
    ("ConditionGroup", &["Condition"]),
    ("Condition", &["ByEntityCondition", "ByValueCondition"]),
    ("ByEntityCondition", &["TriggeringEntities", "EntityCondition"]),
    ("TriggeringEntities", &["EntityRef"]),
];

/// Checks that only elements are in the document that OpenSCENARIO has at their places.
///
/// # Errors
/// [`ImportError`] at the first other element.
pub(super) fn check(reader: &Reader, node: &Node) -> Result<(), ImportError> {
    let Some((name, allowed)) = INSIDE.iter().find(|(name, _)| *name == node.name) else { return Ok(()) };
    for child in &node.children {
        if !allowed.contains(&child.name.as_str()) {
            let message = format!("it is no element of `{name}`, which can have {}", allowed.join(", "));
            return Err(reader.error(child, message));
        }
        check(reader, child)?;
    }
    Ok(())
}
