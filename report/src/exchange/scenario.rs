//! The common parts of all forms of a scenario: header, entities, and the frame of the storyboard.

use closecall_scenarios::openscenario::CONTENT_PROPERTY;

use super::closed_loop::Role;
use super::element::Element;
use super::trigger::{at, trigger};
use super::vehicles::{CATALOG, property};
use crate::date::today;

/// Folder of the vehicle catalogue in a case.
pub(super) const CATALOG_FOLDER: &str = "catalogs/vehicles";
/// Name of the road's file in a case.
pub(super) const ROAD_FILE: &str = "road.xodr";

/// Returns a header that lists what the file cannot express. `source` is the text of the scenario
/// file, and the hash of the elements that stand beside the header.
pub(super) fn header(description: &str, unsaid: &[String], source: Option<(&str, &str)>) -> Element {
    let numbered = |(index, statement): (usize, &String)| property(&format!("not-said-{}", index + 1), statement);
    let header = Element::new("FileHeader")
        .with("revMajor", 1)
        .with("revMinor", 3)
        .with("date", format!("{}T00:00:00", today()))
        .with("description", description)
        .with("author", "Closecall");
    if unsaid.is_empty() && source.is_none() {
        return header;
    }
    let properties = Element::new("Properties").children(unsaid.iter().enumerate().map(numbered));
    let properties = properties.children(source.map(|(_, hash)| property(CONTENT_PROPERTY, hash)));
    header.child(properties.children(source.map(|(text, _)| Element::new("CustomContent").containing(text))))
}

/// A document of the kind that a player runs.
#[derive(Clone)]
pub(super) struct Document {
    pub(super) header: Element,
    /// Declarations of parameters; none for a concrete scenario.
    pub(super) parameters: Vec<Element>,
    /// The vehicles: name, entry of the catalogue, and role.
    pub(super) entities: Vec<(String, String, Role)>,
    /// The actions at the beginning, for all and for each vehicle.
    pub(super) init: Vec<Element>,
    /// The manoeuvres of each vehicle that has some.
    pub(super) groups: Vec<Element>,
    pub(super) duration_s: f64,
}

impl Document {
    /// Returns the text of the document.
    pub(super) fn text(self) -> String {
        let catalog = Element::new("Directory").with("path", CATALOG_FOLDER).within("VehicleCatalog");
        let road = Element::new("LogicFile").with("filepath", ROAD_FILE).within("RoadNetwork");
        let parameters =
            (!self.parameters.is_empty()).then(|| Element::new("ParameterDeclarations").children(self.parameters));
        let story = (!self.groups.is_empty()).then(|| {
            let act = Element::new("Act")
                .with("name", "act")
                .children(self.groups)
                .child(trigger("StartTrigger", at("act-starts", 0.0.into())));
            Element::new("Story").with("name", "story").child(act)
        });
        let storyboard = Element::new("Storyboard")
            .child(Element::new("Init").child(Element::new("Actions").children(self.init)))
            .children(story)
            .child(trigger("StopTrigger", at("run-ends", self.duration_s.into())));
        Element::new("OpenSCENARIO")
            .child(self.header)
            .children(parameters)
            .child(Element::new("CatalogLocations").child(catalog))
            .child(road)
            .child(Element::new("Entities").children(self.entities.iter().map(entity)))
            .child(storyboard)
            .document()
    }
}

fn entity((name, entry, role): &(String, String, Role)) -> Element {
    let vehicle = Element::new("CatalogReference").with("catalogName", CATALOG).with("entryName", entry);
    let controller = match role {
        Role::Human => None,
        Role::Ego { controller } => {
            let named = Element::new("Controller")
                .with("name", controller)
                .child(Element::new("Properties").child(property("closecall-controller", controller)));
            Some(named.within("ObjectController"))
        }
    };
    Element::new("ScenarioObject").with("name", name).child(vehicle).children(controller)
}

/// Returns the group of the manoeuvres of one vehicle.
pub(super) fn group(actor: &str, events: Vec<Element>) -> Element {
    let actors = Element::new("Actors")
        .with("selectTriggeringEntities", "false")
        .child(Element::new("EntityRef").with("entityRef", actor));
    Element::new("ManeuverGroup")
        .with("name", format!("{actor}-group"))
        .with("maximumExecutionCount", 1)
        .child(actors)
        .child(Element::new("Maneuver").with("name", format!("{actor}-maneuver")).children(events))
}

/// Returns the actions of one vehicle at the beginning.
pub(super) fn private(actor: &str, actions: impl IntoIterator<Item = Element>) -> Element {
    let actions = actions.into_iter().map(|action| action.within("PrivateAction"));
    Element::new("Private").with("entityRef", actor).children(actions)
}

/// Returns the action that puts a vehicle somewhere.
pub(super) fn teleport(position: Element) -> Element {
    position.within("Position").within("TeleportAction")
}
