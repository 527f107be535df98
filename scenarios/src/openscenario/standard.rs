//! The elements of ASAM OpenSCENARIO XML that the import reads: their attributes with the values
//! that are allowed, and the elements that may stand inside.
//!
//! The table is the union of the schemas 1.0.0, 1.1.1, 1.2.0 and 1.3.0 of ASAM
//! (`OpenSCENARIO.xsd`), so that a file of each version is read. It differs from them in three
//! places: a range is stated where the text of the standard has one, a lane is an integer, and of
//! some enumerations only a part is read ([`some`]).
//!
//! An attribute of the table that nothing reads has no meaning for a scenario of parallel lanes:
//!
//! | attributes | reason |
//! |---|---|
//! | height and tilt, axles, `Performance`, `model3d`, `role` | a vehicle has class, box and mass |
//! | `routingAlgorithm`, `alongRoute` | all lanes run along the one road |
//! | `followingMode` | a vehicle of a scenario cannot leave its physical limits |
//! | `Sun`, `Wind`, clouds, `TimeOfDay`, `wetness` | a note says what of the environment is read |
//!
//! An element without a row is refused where it is read.

use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::sync::LazyLock;

use super::formula::{Values, resolve};

/// An element.
#[derive(Debug)]
pub(super) struct Element {
    pub(super) name: &'static str,
    pub(super) attributes: &'static [Attribute],
    /// The names of the elements inside; `*` follows the name of one that may stand more than once.
    pub(super) children: &'static [&'static str],
    /// What the import does with it.
    pub(super) usage: Use,
}

/// What the import does with an element.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Use {
    /// It is read.
    Read,
    /// It and all inside it concern neither the motion of a vehicle nor the road, or the reader of
    /// the element says so itself.
    Ignored,
    /// It is left out, and a note says so with this reason.
    Noted(&'static str),
}

/// An attribute.
#[derive(Debug)]
pub(super) struct Attribute {
    pub(super) name: &'static str,
    kind: Kind,
}

/// The values of an attribute.
#[derive(Clone, Copy, Debug)]
enum Kind {
    /// A text in which a `$` has no meaning.
    Plain,
    Text,
    /// The name of a parameter, which its value replaces.
    Parameter,
    /// A finite number.
    Number,
    /// A finite number of at least 0.
    AtLeast0,
    /// A finite number from the first to the second, in a unit.
    Within(f64, f64, &'static str),
    /// A whole number.
    Integer,
    /// A whole number of at least 0.
    Count,
    /// The number 1.
    Once,
    Boolean,
    /// One of the words of the standard, and the words of it that are read.
    Word {
        standard: &'static [&'static str],
        read: &'static [&'static str],
    },
}

impl Attribute {
    /// Returns the value of a text with its parameters replaced: a number in Rust's notation, a
    /// word as it is.
    ///
    /// # Errors
    /// The message, which names the attribute and says which values are allowed.
    pub(super) fn checked(&self, text: &str, values: &Values<'_>) -> Result<String, String> {
        let name = self.name;
        if matches!(self.kind, Kind::Plain) {
            return Ok(text.to_owned());
        }
        if matches!(self.kind, Kind::Parameter) {
            let parameter = text.trim().trim_start_matches('$');
            let value = values.get(parameter).map(str::to_owned);
            return value.ok_or_else(|| format!("`{name}`: {}", values.unknown(parameter)));
        }
        let value = match resolve(text, values) {
            // Programs compose names of texts, such as `${Brake + _ + $Number}`: no other element
            // refers to such a name.
            Err(_) if name == "name" && text.trim_start().starts_with("${") => return Ok(text.to_owned()),
            value => value.map_err(|message| format!("`{name}`: {message}"))?,
        };
        let number = || match value.trim().parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(number),
            _ => Err(format!("`{name}` is `{value}`; a number is needed")),
        };
        let whole = |least: f64| match number()? {
            number if number.fract() == 0.0 && (least..=f64::from(i32::MAX)).contains(&number) => Ok(number),
            _ => Err(format!("`{name}` is `{value}`; a whole number of at least {least} is needed")),
        };
        match self.kind {
            Kind::Plain | Kind::Parameter | Kind::Text => Ok(value),
            Kind::Number => Ok(number()?.to_string()),
            Kind::AtLeast0 => match number()? {
                number if number >= 0.0 => Ok(number.to_string()),
                _ => Err(format!("`{name}` is `{value}`; a number of at least 0 is needed")),
            },
            Kind::Within(low, high, unit) => match number()? {
                number if (low..=high).contains(&number) => Ok(number.to_string()),
                _ => {
                    let [low, high] = [low, high].map(|limit| (limit * 1e5).round() / 1e5);
                    Err(format!("`{name}` is `{value}`; {low} to {high} {unit} are needed, in each version"))
                }
            },
            Kind::Integer => Ok(whole(f64::from(i32::MIN))?.to_string()),
            Kind::Count => Ok(whole(0.0)?.to_string()),
            Kind::Once => match whole(0.0)? {
                1.0 => Ok("1".to_owned()),
                _ => Err(format!("`{name}` is `{value}`; it must be 1: it happens once")),
            },
            Kind::Boolean => is_one_of(name, &value, &BOOLEAN).map(|()| value),
            Kind::Word { standard, read } => {
                is_one_of(name, &value, standard)?;
                if !read.contains(&value.as_str()) {
                    return Err(format!("`{name}` is `{value}`, which is not read, only {}", read.join(", ")));
                }
                Ok(value)
            }
        }
    }
}

/// Checks that a word is one of those that are allowed.
fn is_one_of(name: &str, value: &str, allowed: &[&str]) -> Result<(), String> {
    match allowed.contains(&value) {
        true => Ok(()),
        false => Err(format!("`{name}` is `{value}`; one of {} is needed", allowed.join(", "))),
    }
}

/// Checks that the value of a parameter has the type that its declaration states.
///
/// # Errors
/// The message, which says what is needed.
pub(super) fn check_type(value: &str, kind: &str) -> Result<(), String> {
    let attribute = match kind {
        "double" => number("value"),
        "integer" | "int" => integer("value"),
        "unsignedInt" | "unsignedShort" => count("value"),
        "boolean" => boolean("value"),
        _ => return Ok(()),
    };
    match attribute.kind {
        Kind::Boolean => is_one_of(attribute.name, value, &BOOLEAN),
        _ => attribute.checked(value, &Values::default()).map(|_| ()),
    }
}

/// Returns the element of this name, or `None` if it is not in the table.
pub(super) fn element_of(name: &str) -> Option<&'static Element> {
    static BY_NAME: LazyLock<BTreeMap<&str, &Element>> =
        LazyLock::new(|| ELEMENTS.iter().map(|element| (element.name, element)).collect());
    BY_NAME.get(name).copied()
}

const fn element(name: &'static str, attributes: &'static [Attribute], children: &'static [&'static str]) -> Element {
    Element { name, attributes, children, usage: Use::Read }
}

const fn ignored(name: &'static str) -> Element {
    Element { name, attributes: &[], children: &[], usage: Use::Ignored }
}

const fn noted(name: &'static str, reason: &'static str) -> Element {
    Element { name, attributes: &[], children: &[], usage: Use::Noted(reason) }
}

const fn plain(name: &'static str) -> Attribute {
    Attribute { name, kind: Kind::Plain }
}

const fn text(name: &'static str) -> Attribute {
    Attribute { name, kind: Kind::Text }
}

const fn parameter(name: &'static str) -> Attribute {
    Attribute { name, kind: Kind::Parameter }
}

const fn number(name: &'static str) -> Attribute {
    Attribute { name, kind: Kind::Number }
}

const fn at_least_0(name: &'static str) -> Attribute {
    Attribute { name, kind: Kind::AtLeast0 }
}

const fn within(name: &'static str, low: f64, high: f64, unit: &'static str) -> Attribute {
    Attribute { name, kind: Kind::Within(low, high, unit) }
}

const fn integer(name: &'static str) -> Attribute {
    Attribute { name, kind: Kind::Integer }
}

const fn count(name: &'static str) -> Attribute {
    Attribute { name, kind: Kind::Count }
}

const fn once(name: &'static str) -> Attribute {
    Attribute { name, kind: Kind::Once }
}

const fn boolean(name: &'static str) -> Attribute {
    Attribute { name, kind: Kind::Boolean }
}

const fn word(name: &'static str, standard: &'static [&'static str]) -> Attribute {
    Attribute { name, kind: Kind::Word { standard, read: standard } }
}

/// An enumeration that is read in part.
const fn some(name: &'static str, standard: &'static [&'static str], read: &'static [&'static str]) -> Attribute {
    Attribute { name, kind: Kind::Word { standard, read } }
}

const BOOLEAN: [&str; 4] = ["true", "false", "1", "0"];
const FALSE: [&str; 2] = ["false", "0"];
/// The coordinate systems that are one on a road of parallel lanes.
const ALONG_THE_ROAD: [&str; 3] = ["entity", "lane", "road"];
const LONGITUDINAL: [&str; 1] = ["longitudinal"];
const PARAMETER_TYPE: [&str; 8] =
    ["boolean", "dateTime", "double", "integer", "string", "unsignedInt", "unsignedShort", "int"];
const RULE: [&str; 6] = ["equalTo", "greaterThan", "lessThan", "greaterOrEqual", "lessOrEqual", "notEqualTo"];
const VEHICLE_CATEGORY: [&str; 10] =
    ["bicycle", "bus", "car", "motorbike", "semitrailer", "trailer", "train", "tram", "truck", "van"];
const ROLE: [&str; 8] =
    ["none", "ambulance", "civil", "fire", "military", "police", "publicTransport", "roadAssistance"];
const CLOUD_STATE: [&str; 5] = ["cloudy", "free", "overcast", "rainy", "skyOff"];
const FRACTIONAL_CLOUD_COVER: [&str; 10] = [
    "zeroOktas",
    "oneOktas",
    "twoOktas",
    "threeOktas",
    "fourOktas",
    "fiveOktas",
    "sixOktas",
    "sevenOktas",
    "eightOktas",
    "nineOktas",
];
const PRECIPITATION_TYPE: [&str; 3] = ["dry", "rain", "snow"];
const WETNESS: [&str; 5] = ["dry", "moist", "wetWithPuddles", "lowFlooded", "highFlooded"];
const DYNAMICS_DIMENSION: [&str; 3] = ["distance", "rate", "time"];
const DYNAMICS_SHAPE: [&str; 4] = ["cubic", "linear", "sinusoidal", "step"];
/// The shapes whose largest acceleration determines their duration.
const WITH_ACCELERATION: [&str; 2] = ["cubic", "sinusoidal"];
const FOLLOWING_MODE: [&str; 2] = ["follow", "position"];
const SPEED_TARGET_VALUE_TYPE: [&str; 2] = ["delta", "factor"];
const LONGITUDINAL_DISPLACEMENT: [&str; 3] = ["any", "trailingReferencedEntity", "leadingReferencedEntity"];
const COORDINATE_SYSTEM: [&str; 5] = ["entity", "lane", "road", "trajectory", "world"];
const REFERENCE_CONTEXT: [&str; 2] = ["absolute", "relative"];
const PRIORITY: [&str; 4] = ["overwrite", "override", "parallel", "skip"];
const CONDITION_EDGE: [&str; 4] = ["falling", "none", "rising", "risingOrFalling"];
const TRIGGERING_ENTITIES_RULE: [&str; 2] = ["all", "any"];
const RELATIVE_DISTANCE_TYPE: [&str; 4] = ["lateral", "longitudinal", "cartesianDistance", "euclidianDistance"];
const ROUTING_ALGORITHM: [&str; 5] = ["assignedRoute", "fastest", "leastIntersections", "shortest", "undefined"];
const DIRECTIONAL_DIMENSION: [&str; 3] = ["longitudinal", "lateral", "vertical"];
const STORYBOARD_ELEMENT_STATE: [&str; 7] = [
    "completeState",
    "endTransition",
    "runningState",
    "skipTransition",
    "standbyState",
    "startTransition",
    "stopTransition",
];
const STORYBOARD_ELEMENT_TYPE: [&str; 6] = ["act", "action", "event", "maneuver", "maneuverGroup", "story"];

/// Largest steering angle of an axle. The standard allows 0 to π rad. Many files state degrees, and
/// the import has no use for it.
const MAX_STEERING: Attribute = at_least_0("maxSteering");

/// The attributes of an axle.
const AXLE: [Attribute; 5] =
    [MAX_STEERING, number("positionX"), number("positionZ"), at_least_0("trackWidth"), at_least_0("wheelDiameter")];

/// The limits of a vehicle, and of an action.
const LIMITS: [Attribute; 5] = [
    at_least_0("maxAcceleration"),
    at_least_0("maxAccelerationRate"),
    at_least_0("maxDeceleration"),
    at_least_0("maxDecelerationRate"),
    at_least_0("maxSpeed"),
];

/// The type `TransitionDynamics` of the standard.
const TRANSITION_DYNAMICS: [Attribute; 4] = [
    word("dynamicsDimension", &DYNAMICS_DIMENSION),
    word("dynamicsShape", &DYNAMICS_SHAPE),
    word("followingMode", &FOLLOWING_MODE),
    number("value"),
];

/// The positions of the standard.
const POSITIONS: [&str; 10] = [
    "WorldPosition",
    "RelativeWorldPosition",
    "RelativeObjectPosition",
    "RoadPosition",
    "RelativeRoadPosition",
    "LanePosition",
    "RelativeLanePosition",
    "RoutePosition",
    "GeoPosition",
    "TrajectoryPosition",
];

static ELEMENTS: [Element; 157] = [
    element(
        "OpenSCENARIO",
        &[],
        &[
            "FileHeader",
            "ParameterDeclarations",
            "VariableDeclarations",
            "MonitorDeclarations",
            "CatalogLocations",
            "RoadNetwork",
            "Entities",
            "Storyboard",
            "ParameterValueDistribution",
        ],
    ),
    element(
        "FileHeader",
        &[plain("author"), plain("date"), plain("description"), count("revMajor"), count("revMinor")],
        &["License", "Properties"],
    ),
    element("ParameterDeclarations", &[], &["ParameterDeclaration*"]),
    element(
        "ParameterDeclaration",
        &[text("name"), word("parameterType", &PARAMETER_TYPE), text("value")],
        &["ConstraintGroup*"],
    ),
    element("ConstraintGroup", &[], &["ValueConstraint*"]),
    element("ValueConstraint", &[word("rule", &RULE), text("value")], &[]),
    element(
        "CatalogLocations",
        &[],
        &[
            "VehicleCatalog",
            "ControllerCatalog",
            "PedestrianCatalog",
            "MiscObjectCatalog",
            "EnvironmentCatalog",
            "ManeuverCatalog",
            "TrajectoryCatalog",
            "RouteCatalog",
        ],
    ),
    element("VehicleCatalog", &[], &["Directory"]),
    element("ControllerCatalog", &[], &["Directory"]),
    element("PedestrianCatalog", &[], &["Directory"]),
    element("MiscObjectCatalog", &[], &["Directory"]),
    element("EnvironmentCatalog", &[], &["Directory"]),
    element("ManeuverCatalog", &[], &["Directory"]),
    element("TrajectoryCatalog", &[], &["Directory"]),
    element("RouteCatalog", &[], &["Directory"]),
    element("Directory", &[text("path")], &[]),
    element("RoadNetwork", &[], &["LogicFile", "SceneGraphFile", "TrafficSignals", "UsedArea"]),
    element("LogicFile", &[text("filepath")], &[]),
    element("Entities", &[], &["ScenarioObject*", "EntitySelection*"]),
    element(
        "ScenarioObject",
        &[text("name")],
        &["CatalogReference", "Vehicle", "Pedestrian", "MiscObject", "ExternalObjectReference", "ObjectController*"],
    ),
    element(
        "Vehicle",
        &[
            text("name"),
            word("vehicleCategory", &VEHICLE_CATEGORY),
            word("role", &ROLE),
            at_least_0("mass"),
            text("model3d"),
        ],
        &[
            "ParameterDeclarations",
            "BoundingBox",
            "Performance",
            "Axles",
            "Properties",
            "TrailerHitch",
            "TrailerCoupler",
            "Trailer",
        ],
    ),
    element("BoundingBox", &[], &["Center", "Dimensions"]),
    element("Center", &[number("x"), number("y"), number("z")], &[]),
    element("Dimensions", &[number("height"), number("length"), number("width")], &[]),
    element("Performance", &LIMITS, &[]),
    element("Axles", &[], &["FrontAxle", "RearAxle", "AdditionalAxle*"]),
    element("FrontAxle", &AXLE, &[]),
    element("RearAxle", &AXLE, &[]),
    element("AdditionalAxle", &AXLE, &[]),
    element("CatalogReference", &[text("catalogName"), text("entryName")], &["ParameterAssignments"]),
    element("ParameterAssignments", &[], &["ParameterAssignment*"]),
    element("ParameterAssignment", &[text("parameterRef"), text("value")], &[]),
    element("Storyboard", &[], &["Init", "Story*", "StopTrigger"]),
    element("Init", &[], &["Actions"]),
    element("Actions", &[], &["GlobalAction*", "UserDefinedAction*", "Private*"]),
    element("Private", &[text("entityRef")], &["PrivateAction*"]),
    element(
        "PrivateAction",
        &[],
        &[
            "LongitudinalAction",
            "LateralAction",
            "VisibilityAction",
            "SynchronizeAction",
            "ActivateControllerAction",
            "ControllerAction",
            "TeleportAction",
            "RoutingAction",
            "AppearanceAction",
            "TrailerAction",
        ],
    ),
    element(
        "GlobalAction",
        &[],
        &[
            "EnvironmentAction",
            "EntityAction",
            "InfrastructureAction",
            "SetMonitorAction",
            "ParameterAction",
            "TrafficAction",
            "VariableAction",
        ],
    ),
    element("EnvironmentAction", &[], &["Environment", "CatalogReference"]),
    element("Environment", &[text("name")], &["ParameterDeclarations", "TimeOfDay", "Weather", "RoadCondition"]),
    element("TimeOfDay", &[boolean("animation"), text("dateTime")], &[]),
    element(
        "Weather",
        &[
            word("cloudState", &CLOUD_STATE),
            within("atmosphericPressure", 80_000.0, 120_000.0, "Pa"),
            within("temperature", 170.0, 340.0, "K"),
            word("fractionalCloudCover", &FRACTIONAL_CLOUD_COVER),
        ],
        &["Sun", "Fog", "Precipitation", "Wind", "DomeImage"],
    ),
    element(
        "Sun",
        &[
            within("azimuth", 0.0, 2.0 * PI, "rad"),
            within("elevation", -PI, PI, "rad"),
            at_least_0("intensity"),
            at_least_0("illuminance"),
        ],
        &[],
    ),
    element("Fog", &[at_least_0("visualRange")], &["BoundingBox"]),
    element(
        "Precipitation",
        &[
            at_least_0("intensity"),
            word("precipitationType", &PRECIPITATION_TYPE),
            at_least_0("precipitationIntensity"),
        ],
        &[],
    ),
    element("Wind", &[within("direction", 0.0, 2.0 * PI, "rad"), at_least_0("speed")], &[]),
    element("RoadCondition", &[at_least_0("frictionScaleFactor"), word("wetness", &WETNESS)], &["Properties"]),
    element("LongitudinalAction", &[], &["SpeedAction", "LongitudinalDistanceAction", "SpeedProfileAction"]),
    element("SpeedAction", &[], &["SpeedActionDynamics", "SpeedActionTarget"]),
    element("SpeedActionDynamics", &TRANSITION_DYNAMICS, &[]),
    element("SpeedActionTarget", &[], &["RelativeTargetSpeed", "AbsoluteTargetSpeed"]),
    element("AbsoluteTargetSpeed", &[number("value")], &[]),
    element(
        "RelativeTargetSpeed",
        &[
            text("entityRef"),
            boolean("continuous"),
            word("speedTargetValueType", &SPEED_TARGET_VALUE_TYPE),
            number("value"),
        ],
        &[],
    ),
    element(
        "SpeedProfileAction",
        &[text("entityRef"), word("followingMode", &FOLLOWING_MODE)],
        &["DynamicConstraints", "SpeedProfileEntry*"],
    ),
    element("SpeedProfileEntry", &[number("speed"), at_least_0("time")], &[]),
    element(
        "LongitudinalDistanceAction",
        &[
            text("entityRef"),
            boolean("continuous"),
            at_least_0("distance"),
            boolean("freespace"),
            at_least_0("timeGap"),
            word("displacement", &LONGITUDINAL_DISPLACEMENT),
            some("coordinateSystem", &COORDINATE_SYSTEM, &ALONG_THE_ROAD),
        ],
        &["DynamicConstraints"],
    ),
    element("DynamicConstraints", &LIMITS, &[]),
    element("LateralAction", &[], &["LaneChangeAction", "LaneOffsetAction", "LateralDistanceAction"]),
    element("LaneChangeAction", &[number("targetLaneOffset")], &["LaneChangeActionDynamics", "LaneChangeTarget"]),
    element("LaneChangeActionDynamics", &TRANSITION_DYNAMICS, &[]),
    element("LaneOffsetAction", &[boolean("continuous")], &["LaneOffsetActionDynamics", "LaneOffsetTarget"]),
    element(
        "LaneOffsetActionDynamics",
        &[some("dynamicsShape", &DYNAMICS_SHAPE, &WITH_ACCELERATION), at_least_0("maxLateralAcc")],
        &[],
    ),
    element("LaneOffsetTarget", &[], &["RelativeTargetLaneOffset", "AbsoluteTargetLaneOffset"]),
    element("AbsoluteTargetLaneOffset", &[number("value")], &[]),
    element("RelativeTargetLaneOffset", &[text("entityRef"), number("value")], &[]),
    element("LaneChangeTarget", &[], &["RelativeTargetLane", "AbsoluteTargetLane"]),
    element("AbsoluteTargetLane", &[integer("value")], &[]),
    element("RelativeTargetLane", &[text("entityRef"), integer("value")], &[]),
    element("TeleportAction", &[], &["Position"]),
    element(
        "SynchronizeAction",
        &[text("masterEntityRef"), at_least_0("targetTolerance"), at_least_0("targetToleranceMaster")],
        &["TargetPositionMaster", "TargetPosition", "FinalSpeed"],
    ),
    element("TargetPositionMaster", &[], &POSITIONS),
    element("TargetPosition", &[], &POSITIONS),
    element("FinalSpeed", &[], &["AbsoluteSpeed", "RelativeSpeedToMaster"]),
    element("AbsoluteSpeed", &[number("value")], &["TargetDistanceSteadyState", "TargetTimeSteadyState"]),
    element(
        "RelativeSpeedToMaster",
        &[word("speedTargetValueType", &SPEED_TARGET_VALUE_TYPE), number("value")],
        &["TargetDistanceSteadyState", "TargetTimeSteadyState"],
    ),
    element("TargetDistanceSteadyState", &[at_least_0("distance")], &[]),
    element("TargetTimeSteadyState", &[at_least_0("time")], &[]),
    element("Position", &[], &POSITIONS),
    element("LanePosition", &[integer("laneId"), number("offset"), text("roadId"), number("s")], &["Orientation"]),
    element(
        "RelativeLanePosition",
        &[text("entityRef"), integer("dLane"), number("ds"), number("offset"), number("dsLane")],
        &["Orientation"],
    ),
    element("RelativeRoadPosition", &[text("entityRef"), number("ds"), number("dt")], &["Orientation"]),
    element("Orientation", &[number("h"), number("p"), number("r"), word("type", &REFERENCE_CONTEXT)], &[]),
    element(
        "RoutingAction",
        &[],
        &["AssignRouteAction", "FollowTrajectoryAction", "AcquirePositionAction", "RandomRouteAction"],
    ),
    element(
        "FollowTrajectoryAction",
        &[at_least_0("initialDistanceOffset")],
        &["Trajectory", "CatalogReference", "TimeReference", "TrajectoryFollowingMode", "TrajectoryRef"],
    ),
    element("TrajectoryRef", &[], &["Trajectory", "CatalogReference"]),
    element("Trajectory", &[boolean("closed"), text("name")], &["ParameterDeclarations", "Shape"]),
    element("Shape", &[], &["Polyline", "Clothoid", "ClothoidSpline", "Nurbs"]),
    element("Polyline", &[], &["Vertex*"]),
    element("Vertex", &[number("time")], &["Position"]),
    element("TimeReference", &[], &["None", "Timing"]),
    element("None", &[], &[]),
    element("Timing", &[word("domainAbsoluteRelative", &REFERENCE_CONTEXT), number("offset"), number("scale")], &[]),
    element("TrajectoryFollowingMode", &[word("followingMode", &FOLLOWING_MODE)], &[]),
    element("WorldPosition", &[number("h"), number("p"), number("r"), number("x"), number("y"), number("z")], &[]),
    element("Story", &[text("name")], &["ParameterDeclarations", "Act*"]),
    element("Act", &[text("name")], &["ManeuverGroup*", "StartTrigger", "StopTrigger"]),
    element(
        "ManeuverGroup",
        &[once("maximumExecutionCount"), text("name")],
        &["Actors", "CatalogReference*", "Maneuver*"],
    ),
    element("Actors", &[some("selectTriggeringEntities", &BOOLEAN, &FALSE)], &["EntityRef*"]),
    element("EntityRef", &[text("entityRef")], &[]),
    element("Maneuver", &[text("name")], &["ParameterDeclarations", "Event*"]),
    element(
        "Event",
        &[once("maximumExecutionCount"), text("name"), word("priority", &PRIORITY)],
        &["Action*", "StartTrigger"],
    ),
    element("Action", &[text("name")], &["GlobalAction", "UserDefinedAction", "PrivateAction"]),
    element("StartTrigger", &[], &["ConditionGroup*"]),
    element("StopTrigger", &[], &["ConditionGroup*"]),
    element("ConditionGroup", &[], &["Condition*"]),
    element(
        "Condition",
        &[word("conditionEdge", &CONDITION_EDGE), at_least_0("delay"), text("name")],
        &["ByEntityCondition", "ByValueCondition"],
    ),
    element("ByEntityCondition", &[], &["TriggeringEntities", "EntityCondition"]),
    element("TriggeringEntities", &[word("triggeringEntitiesRule", &TRIGGERING_ENTITIES_RULE)], &["EntityRef*"]),
    element(
        "EntityCondition",
        &[],
        &[
            "EndOfRoadCondition",
            "CollisionCondition",
            "OffroadCondition",
            "TimeHeadwayCondition",
            "TimeToCollisionCondition",
            "AccelerationCondition",
            "StandStillCondition",
            "SpeedCondition",
            "RelativeSpeedCondition",
            "TraveledDistanceCondition",
            "ReachPositionCondition",
            "DistanceCondition",
            "RelativeDistanceCondition",
            "RelativeClearanceCondition",
            "AngleCondition",
            "RelativeAngleCondition",
        ],
    ),
    element(
        "ByValueCondition",
        &[],
        &[
            "ParameterCondition",
            "TimeOfDayCondition",
            "SimulationTimeCondition",
            "StoryboardElementStateCondition",
            "UserDefinedValueCondition",
            "TrafficSignalCondition",
            "TrafficSignalControllerCondition",
            "VariableCondition",
        ],
    ),
    element(
        "TimeHeadwayCondition",
        &[
            text("entityRef"),
            boolean("alongRoute"),
            boolean("freespace"),
            word("rule", &RULE),
            at_least_0("value"),
            some("coordinateSystem", &COORDINATE_SYSTEM, &ALONG_THE_ROAD),
            some("relativeDistanceType", &RELATIVE_DISTANCE_TYPE, &LONGITUDINAL),
            word("routingAlgorithm", &ROUTING_ALGORITHM),
        ],
        &[],
    ),
    element(
        "TimeToCollisionCondition",
        &[
            boolean("alongRoute"),
            boolean("freespace"),
            word("rule", &RULE),
            at_least_0("value"),
            some("relativeDistanceType", &RELATIVE_DISTANCE_TYPE, &LONGITUDINAL),
            some("coordinateSystem", &COORDINATE_SYSTEM, &ALONG_THE_ROAD),
            word("routingAlgorithm", &ROUTING_ALGORITHM),
        ],
        &["TimeToCollisionConditionTarget"],
    ),
    element("TimeToCollisionConditionTarget", &[], &["Position", "EntityRef"]),
    element(
        "DistanceCondition",
        &[
            boolean("alongRoute"),
            boolean("freespace"),
            some("relativeDistanceType", &RELATIVE_DISTANCE_TYPE, &LONGITUDINAL),
            word("rule", &RULE),
            at_least_0("value"),
            some("coordinateSystem", &COORDINATE_SYSTEM, &ALONG_THE_ROAD),
            word("routingAlgorithm", &ROUTING_ALGORITHM),
        ],
        &["Position"],
    ),
    element("ReachPositionCondition", &[at_least_0("tolerance")], &["Position"]),
    element(
        "RelativeDistanceCondition",
        &[
            text("entityRef"),
            boolean("freespace"),
            some("relativeDistanceType", &RELATIVE_DISTANCE_TYPE, &LONGITUDINAL),
            word("rule", &RULE),
            at_least_0("value"),
            some("coordinateSystem", &COORDINATE_SYSTEM, &ALONG_THE_ROAD),
            word("routingAlgorithm", &ROUTING_ALGORITHM),
        ],
        &[],
    ),
    element(
        "SpeedCondition",
        &[word("rule", &RULE), number("value"), some("direction", &DIRECTIONAL_DIMENSION, &LONGITUDINAL)],
        &[],
    ),
    element(
        "AccelerationCondition",
        &[word("rule", &RULE), number("value"), some("direction", &DIRECTIONAL_DIMENSION, &LONGITUDINAL)],
        &[],
    ),
    element(
        "RelativeSpeedCondition",
        &[
            text("entityRef"),
            word("rule", &RULE),
            number("value"),
            some("direction", &DIRECTIONAL_DIMENSION, &LONGITUDINAL),
        ],
        &[],
    ),
    element("TraveledDistanceCondition", &[at_least_0("value")], &[]),
    element("SimulationTimeCondition", &[word("rule", &RULE), number("value")], &[]),
    element("ParameterCondition", &[parameter("parameterRef"), word("rule", &RULE), text("value")], &[]),
    element(
        "StoryboardElementStateCondition",
        &[
            text("storyboardElementRef"),
            word("state", &STORYBOARD_ELEMENT_STATE),
            word("storyboardElementType", &STORYBOARD_ELEMENT_TYPE),
        ],
        &[],
    ),
    element("ParameterValueDistribution", &[], &["ScenarioFile", "Deterministic", "Stochastic"]),
    element("ScenarioFile", &[text("filepath")], &[]),
    element(
        "Deterministic",
        &[],
        &["DeterministicMultiParameterDistribution*", "DeterministicSingleParameterDistribution*"],
    ),
    element("DeterministicMultiParameterDistribution", &[], &["ValueSetDistribution"]),
    element("ValueSetDistribution", &[], &["ParameterValueSet*"]),
    element("ParameterValueSet", &[], &["ParameterAssignment*"]),
    element(
        "DeterministicSingleParameterDistribution",
        &[text("parameterName")],
        &["DistributionSet", "DistributionRange", "UserDefinedDistribution"],
    ),
    element("DistributionSet", &[], &["Element*"]),
    element("Element", &[text("value"), at_least_0("weight")], &[]),
    element("DistributionRange", &[number("stepWidth")], &["Range"]),
    element("Range", &[number("lowerLimit"), number("upperLimit")], &[]),
    element("Stochastic", &[count("numberOfTestRuns"), number("randomSeed")], &["StochasticDistribution*"]),
    element(
        "StochasticDistribution",
        &[text("parameterName")],
        &[
            "ProbabilityDistributionSet",
            "NormalDistribution",
            "LogNormalDistribution",
            "UniformDistribution",
            "PoissonDistribution",
            "Histogram",
            "UserDefinedDistribution",
        ],
    ),
    element("ProbabilityDistributionSet", &[], &["Element*"]),
    element("NormalDistribution", &[number("expectedValue"), at_least_0("variance")], &["Range"]),
    element("LogNormalDistribution", &[number("expectedValue"), at_least_0("variance")], &["Range"]),
    element("UniformDistribution", &[], &["Range"]),
    element("PoissonDistribution", &[number("expectedValue")], &["Range"]),
    element("Histogram", &[], &["Bin*"]),
    element("Bin", &[at_least_0("weight")], &["Range"]),
    ignored("License"),
    ignored("Properties"),
    noted("VariableDeclarations", "a scenario has no variables"),
    noted("MonitorDeclarations", "a scenario has no monitors"),
    ignored("SceneGraphFile"),
    noted("TrafficSignals", "a scenario has no traffic signals"),
    noted("UsedArea", "the road is as long as its vehicles need"),
    ignored("ObjectController"),
    noted("Trailer", "a vehicle has no trailer"),
    ignored("TrailerHitch"),
    ignored("TrailerCoupler"),
    ignored("DomeImage"),
    ignored("ControllerAction"),
    ignored("ActivateControllerAction"),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_element_has_one_row() {
        for (index, element) in ELEMENTS.iter().enumerate() {
            assert!(ELEMENTS[..index].iter().all(|other| other.name != element.name), "{}", element.name);
        }
    }

    #[test]
    fn a_value_outside_its_enumeration_or_its_range_is_refused_with_what_is_allowed() {
        let mut values = Values::default();
        values.insert("edge".to_owned(), "sharp".to_owned());
        values.insert("late".to_owned(), "-1".to_owned());
        let checked = |element: &str, attribute: &str, text: &str| {
            let attributes = element_of(element).unwrap().attributes;
            attributes.iter().find(|candidate| candidate.name == attribute).unwrap().checked(text, &values)
        };
        assert_eq!(checked("Condition", "conditionEdge", "rising").unwrap(), "rising");
        assert_eq!(checked("Condition", "delay", "${1 + 1}").unwrap(), "2");
        assert_eq!(checked("LanePosition", "laneId", "-1").unwrap(), "-1");
        assert_eq!(checked("Sun", "elevation", "1.31").unwrap(), "1.31");
        assert_eq!(checked("FrontAxle", "maxSteering", "30").unwrap(), "30", "degrees, as many files state them");
        assert_eq!(checked("ParameterCondition", "parameterRef", "late").unwrap(), "-1");
        let edge = checked("Condition", "conditionEdge", "$edge").unwrap_err();
        assert!(edge.contains("`conditionEdge` is `sharp`; one of falling, none"), "{edge}");
        for (element, attribute, text, word) in [
            ("Condition", "delay", "-5", "at least 0"),
            ("Condition", "delay", "$late", "at least 0"),
            ("Condition", "delay", "NaN", "a number is needed"),
            ("LanePosition", "laneId", "-1.5", "whole number"),
            // Degrees Celsius, degrees and hectopascals, where the standard has other units.
            ("Weather", "temperature", "20", "170 to 340 K are needed, in each version"),
            ("Sun", "elevation", "-4", "-3.14159 to 3.14159 rad"),
            ("Sun", "azimuth", "180", "0 to 6.28319 rad"),
            ("Weather", "atmosphericPressure", "1013", "80000 to 120000 Pa"),
            ("Sun", "azimuth", "NaN", "a number is needed"),
            ("FrontAxle", "maxSteering", "-0.5", "at least 0"),
            ("Event", "maximumExecutionCount", "2", "must be 1"),
            ("Event", "maximumExecutionCount", "-1", "at least 0"),
            ("Event", "priority", "foo", "overwrite, override, parallel, skip"),
            ("TimeHeadwayCondition", "freespace", "maybe", "true, false"),
            ("TimeHeadwayCondition", "coordinateSystem", "moon", "entity, lane, road, trajectory, world"),
            ("TimeHeadwayCondition", "coordinateSystem", "world", "not read, only entity, lane, road"),
            ("TimeHeadwayCondition", "routingAlgorithm", "widest", "fastest"),
            ("RelativeDistanceCondition", "relativeDistanceType", "lateral", "only longitudinal"),
            ("ParameterCondition", "parameterRef", "early", "no parameter `early`"),
        ] {
            let message = checked(element, attribute, text).unwrap_err();
            assert!(message.contains(word) && message.contains(attribute), "{text}: {message}");
        }
    }

    #[test]
    fn a_parameter_has_its_type() {
        let right = [("1.5", "double"), ("-2", "int"), ("2", "unsignedInt"), ("true", "boolean"), ("x", "string")];
        for (value, kind) in right {
            assert_eq!(check_type(value, kind), Ok(()), "{value}");
        }
        for (value, kind) in [("x", "double"), ("1.5", "integer"), ("-2", "unsignedShort"), ("maybe", "boolean")] {
            assert!(check_type(value, kind).is_err(), "{value}");
        }
    }
}
