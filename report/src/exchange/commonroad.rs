//! A sample as CommonRoad XML 2020a: the lanes, the other vehicles as they drove, and a planning
//! problem for the ego.
//!
//! (M. Althoff, M. Koschi, S. Manzinger, "CommonRoad: Composable benchmarks for motion planning on
//! roads", IV 2017.)

use closecall_scenarios::Scenario;
use closecall_simulation::CONTROL_STEP;
use closecall_traffic::{Lane, Side, VehicleClass, VehicleState};

use super::element::Element;
use super::motion::Motion;
use super::road::UsedRoad;
use crate::date::today;

/// Distance between the points of a bound (m). In the tightest curve, with a radius of 250 m, it
/// deviates by 5 cm.
const POINT_SPACING_M: f64 = 10.0;
/// Number of the first dynamic obstacle. Lanelets have lower numbers, and each number is used once.
const FIRST_OBSTACLE: usize = 1_000;
/// Number of the planning problem.
const PLANNING_PROBLEM: usize = 100_000;

/// Returns the document.
pub(super) fn document(scenario: &Scenario, motion: &Motion, road: UsedRoad<'_>) -> String {
    // The country code of places that do not exist is ZAM; a name has letters and digits alone.
    let name: String = scenario.name.split(['-', '/', '@']).map(capitalised).collect();
    let location = Element::new("location")
        .child(text("geoNameId", -999))
        .child(text("gpsLatitude", 999))
        .child(text("gpsLongitude", 999));
    let tags = Element::new("scenarioTags").child(Element::new("highway")).child(Element::new("multi_lane"));
    let others = (0..scenario.actors.len()).filter(|index| *index != scenario.ego);
    Element::new("commonRoad")
        .with("timeStepSize", CONTROL_STEP.s())
        .with("commonRoadVersion", "2020a")
        .with("author", "Closecall")
        .with("affiliation", "none")
        .with("source", "simulation")
        .with("benchmarkID", format!("ZAM_{name}-1_1_T-1"))
        .with("date", today())
        .child(location)
        .child(tags)
        .children((1..=scenario.road.lanes()).filter_map(|lane| lanelet(scenario, Lane(lane), road)))
        .children(others.filter_map(|index| obstacle(scenario, motion, index)))
        .children(planning_problem(scenario, motion))
        .document()
}

fn capitalised(word: &str) -> String {
    let mut letters = word.chars().filter(char::is_ascii_alphanumeric);
    letters.next().into_iter().map(|first| first.to_ascii_uppercase()).chain(letters).collect()
}

fn text(name: &'static str, value: impl std::fmt::Display) -> Element {
    Element::new(name).containing(&value.to_string())
}

fn exact(name: &'static str, value: impl std::fmt::Display) -> Element {
    text("exact", value).within(name)
}

fn point(x_m: f64, y_m: f64) -> Element {
    Element::new("point").child(text("x", x_m)).child(text("y", y_m))
}

/// Returns the positions between which a lane has a width (m).
fn ends_m(scenario: &Scenario, lane: Lane, range_m: [f64; 2]) -> [f64; 2] {
    let road = &scenario.road;
    let has_width = |[from_m, to_m]: &&[f64; 2]| road.lane_width_m(lane, 0.5 * (from_m + to_m)) > 0.0;
    let stretches_m = road.stretches_m(range_m);
    let mut with_width = stretches_m.iter().filter(has_width);
    let (first, last) = (with_width.next(), with_width.next_back());
    let start_m = first.map_or(range_m[1], |first| first[0]);
    let mut end_m = last.or(first).map_or(range_m[1], |last| last[1]);
    if let Some(acceleration_lane) = road.acceleration_lane().filter(|_| road.entry_lane() == Some(lane)) {
        end_m = end_m.min(acceleration_lane.taper_end_m);
    }
    [start_m, end_m]
}

/// Returns a lane, or `None` if it has no width on the part of the road that is used. Lanelets beside
/// each other have the same ends: a lane that begins or ends, as the acceleration lane does, is beside
/// none.
fn lanelet(scenario: &Scenario, lane: Lane, road: UsedRoad<'_>) -> Option<Element> {
    let lane_ends_m = |lane| ends_m(scenario, lane, road.range_m());
    let [start_m, end_m] = lane_ends_m(lane);
    if !(start_m < end_m) {
        return None;
    }
    let count = ((end_m - start_m) / POINT_SPACING_M).ceil().max(1.0);
    let entry = scenario.road.entry_lane();
    let bound = |name, number: u8| {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a road has some thousand points")]
        let points = (0..=count as u32).map(|index| {
            let s_m = start_m + (end_m - start_m) * f64::from(index) / count;
            let pose = scenario.road.plane_pose(s_m, scenario.road.boundary_at_m(number, s_m), 0.0);
            point(pose.x_m, pose.y_m)
        });
        let is_edge = number == 0 || number == scenario.road.lanes();
        Element::new(name).children(points).child(text("lineMarking", if is_edge { "solid" } else { "dashed" }))
    };
    let beside = |name, side| {
        let ends_differ =
            |other: &Lane| lane_ends_m(*other) != [start_m, end_m] || [lane, *other].map(Some).contains(&entry);
        let other = scenario.road.beside(lane, side).filter(|other| !ends_differ(other));
        other.map(|other| Element::new(name).with("ref", other).with("drivingDir", "same"))
    };
    let lanelet = Element::new("lanelet")
        .with("id", lane)
        .child(bound("leftBound", lane.0 - 1))
        .child(bound("rightBound", lane.0))
        .children(beside("adjacentLeft", Side::Left))
        .children(beside("adjacentRight", Side::Right))
        .child(text("laneletType", "highway"));
    Some(lanelet)
}

/// Returns the elements of a state that all kinds of states have.
fn state(scenario: &Scenario, name: &'static str, step: usize, state: &VehicleState) -> Element {
    let pose = scenario.road.plane_pose(state.s_m, state.d_m, state.heading_rad);
    Element::new(name)
        .child(point(pose.x_m, pose.y_m).within("position"))
        .child(exact("orientation", pose.yaw_rad))
        .child(exact("time", step))
        .child(exact("velocity", state.speed_mps))
}

fn obstacle(scenario: &Scenario, motion: &Motion, index: usize) -> Option<Element> {
    let vehicle = &scenario.actors[index].vehicle;
    let kind = match vehicle.class {
        VehicleClass::Car => "car",
        VehicleClass::Truck => "truck",
        VehicleClass::Motorcycle => "motorcycle",
    };
    let mut states = motion.steps.iter().enumerate().filter_map(|(step, (_, states))| Some((step, states.get(index)?)));
    let with_acceleration = |name, (step, vehicle): (usize, &VehicleState)| {
        state(scenario, name, step, vehicle).child(exact("acceleration", vehicle.acceleration_mps2))
    };
    let initial = with_acceleration("initialState", states.next()?);
    let rectangle = Element::new("rectangle")
        .child(text("length", vehicle.dimensions.length_m))
        .child(text("width", vehicle.dimensions.width_m));
    let later: Vec<_> = states.map(|numbered_state| with_acceleration("state", numbered_state)).collect();
    let trajectory = (!later.is_empty()).then(|| Element::new("trajectory").children(later));
    Some(
        Element::new("dynamicObstacle")
            .with("id", FIRST_OBSTACLE + index)
            .child(text("type", kind))
            .child(rectangle.within("shape"))
            .child(initial)
            .children(trajectory),
    )
}

/// Returns the problem: the ego's start, and the time at which the run ends. The ego's motion is no
/// part of it.
fn planning_problem(scenario: &Scenario, motion: &Motion) -> Option<Element> {
    let (_, states) = motion.steps.first()?;
    let start = states.get(scenario.ego)?;
    let initial = state(scenario, "initialState", 0, start)
        .child(exact("yawRate", start.yaw_rate_radps))
        .child(exact("slipAngle", 0));
    let end = motion.steps.len() - 1;
    let time = Element::new("time").child(text("intervalStart", end)).child(text("intervalEnd", end));
    Some(Element::new("planningProblem").with("id", PLANNING_PROBLEM).child(initial).child(time.within("goalState")))
}
