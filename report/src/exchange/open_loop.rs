//! The open-loop form: every vehicle follows the trajectory that it drove in the run.

use closecall_scenarios::Scenario;
use closecall_traffic::{VehicleState, maths};

use super::closed_loop::{Role, set_speed};
use super::element::Element;
use super::environment;
use super::expression::Values;
use super::motion::Motion;
use super::scenario::{Document, group, header, private, teleport};
use super::trigger::{at, event};
use super::vehicles::{axle_to_centre_m, entry_name};
use closecall_scenarios::ScenarioConfig;

/// Returns the document. `motion` comes from a run of `scenario`, with the same order of vehicles.
pub(super) fn document(
    (config, scenario): (&ScenarioConfig, &Scenario),
    motion: &Motion,
    (description, unsaid): (&str, &[String]),
) -> String {
    let values = Values { sample: &scenario.parameters, are_named: false };
    let mut init = vec![environment::action(&config.environment, &scenario.environment, values)];
    let mut groups = Vec::new();
    for (index, actor) in scenario.actors.iter().enumerate() {
        let states = motion.steps.iter().filter_map(|(time, states)| Some((time.s(), states.get(index)?)));
        let vertices: Vec<_> = states
            .map(|(time_s, state)| Element::new("Vertex").with("time", time_s).child(position(scenario, index, state)))
            .collect();
        let first = motion.steps.first().and_then(|(_, states)| states.get(index)).unwrap_or(&actor.start);
        let start = world_position(scenario, index, first);
        init.push(private(actor.id.as_str(), [teleport(start), set_speed(first.speed_mps.into())]));
        // A line needs two points: a run of one step has no motion to show.
        if vertices.len() >= 2 {
            let follow = trajectory(actor.id.as_str(), vertices);
            let name = format!("{}-drives", actor.id);
            let when = at(&format!("{name}-from-the-start"), 0.0.into());
            groups.push(group(actor.id.as_str(), vec![event(&name, "override", follow, when)]));
        }
    }
    let entities = scenario.actors.iter().map(|actor| (actor.id.to_string(), entry_name(&actor.id), Role::Human));
    Document {
        header: header(description, unsaid, None),
        parameters: Vec::new(),
        entities: entities.collect(),
        init,
        groups,
        duration_s: motion.steps.last().map_or(0.0, |(time, _)| time.s()),
    }
    .text()
}

fn trajectory(actor: &str, vertices: Vec<Element>) -> Element {
    let line = Element::new("Polyline").children(vertices).within("Shape");
    let trajectory =
        Element::new("Trajectory").with("name", format!("{actor}-trajectory")).with("closed", "false").child(line);
    let timing = Element::new("Timing").with("domainAbsoluteRelative", "absolute").with("scale", 1).with("offset", 0);
    Element::new("FollowTrajectoryAction")
        .child(trajectory.within("TrajectoryRef"))
        .child(timing.within("TimeReference"))
        .child(Element::new("TrajectoryFollowingMode").with("followingMode", "position"))
        .within("RoutingAction")
}

fn position(scenario: &Scenario, index: usize, state: &VehicleState) -> Element {
    world_position(scenario, index, state).within("Position")
}

/// Returns the position of the rear axle in the plane. The centre of the box lies ahead of it.
fn world_position(scenario: &Scenario, index: usize, state: &VehicleState) -> Element {
    let pose = scenario.road.plane_pose(state.s_m, state.d_m, state.heading_rad);
    let (sin, cos) = maths::sin_cos(pose.yaw_rad);
    let ahead_m = axle_to_centre_m(&scenario.actors[index].vehicle.dimensions);
    Element::new("WorldPosition")
        .with("x", pose.x_m - ahead_m * cos)
        .with("y", pose.y_m - ahead_m * sin)
        .with("z", 0)
        .with("h", pose.yaw_rad)
        .with("p", 0)
        .with("r", 0)
}
