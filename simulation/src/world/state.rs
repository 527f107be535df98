//! The state of all vehicles, moved by one step at a time.

use closecall_controllers::{LaneChange, Neighbours, Weave};
use closecall_traffic::geometry::OrientedBox;
use closecall_traffic::{ActorId, Indicator, Lane, Road, Time, Vehicle, VehicleState};
use nalgebra::Vector2;

use super::contact::{self, Touch};
use super::impact::{BodyId, BodySpec, IMPACT_DURATION_S, Motion, Wreckage};
use super::neighbours;
use super::plant::Plant;
use crate::outcome::{Collision, Phase};

/// What is asked of one vehicle for one step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Action {
    /// Acceleration [m/s²].
    pub(crate) acceleration_mps2: f64,
    /// A lane change to begin.
    pub(crate) lane_change: Option<LaneChange>,
    /// The direction indicator.
    pub(crate) indicator: Indicator,
}

/// A vehicle to put into the world.
#[derive(Clone, Debug)]
pub(crate) struct Placed {
    /// Its name.
    pub(crate) id: ActorId,
    /// What it is.
    pub(crate) vehicle: Vehicle,
    /// Where it starts.
    pub(crate) state: VehicleState,
    /// How its driver weaves about that.
    pub(crate) weave: Option<Weave>,
}

enum Body {
    Driven(Box<Plant>),
    Wrecked { body: BodyId, state: VehicleState },
}

struct Actor {
    id: ActorId,
    vehicle: Vehicle,
    body: Body,
}

/// An impact whose change of velocity is not settled yet.
struct OpenImpact {
    collision: usize,
    pair: [usize; 2],
    velocities_mps: [Vector2<f64>; 2],
    left_s: f64,
}

/// All vehicles of a run, and the collisions between them.
pub(crate) struct World {
    road: Road,
    friction: f64,
    step: Time,
    time: Time,
    actors: Vec<Actor>,
    /// The places of the actors in the order of their names: what is done to pairs is done in this order, so that the
    /// order of the list does not matter.
    by_name: Vec<usize>,
    shapes: Vec<OrientedBox>,
    shapes_before: Vec<OrientedBox>,
    touches: Vec<Touch>,
    touched_pairs: Vec<[usize; 2]>,
    wreckage: Option<Wreckage>,
    open_impacts: Vec<OpenImpact>,
    collisions: Vec<Collision>,
}

impl World {
    /// The vehicles at time zero. They must not overlap: the scenario's check sees to it.
    pub(crate) fn new(road: Road, friction: f64, step: Time, placed: Vec<Placed>) -> Self {
        let actors: Vec<Actor> = placed
            .into_iter()
            .map(|Placed { id, vehicle, state, weave }| {
                let body = Body::Driven(Box::new(Plant::new(&vehicle, state, weave, friction, step.s())));
                Actor { id, vehicle, body }
            })
            .collect();
        let mut by_name: Vec<usize> = (0..actors.len()).collect();
        by_name.sort_by(|&one, &other| actors[one].id.cmp(&actors[other].id));
        let mut world = Self {
            by_name,
            road,
            friction,
            step,
            time: Time::ZERO,
            shapes: Vec::with_capacity(actors.len()),
            shapes_before: Vec::with_capacity(actors.len()),
            actors,
            touches: Vec::new(),
            touched_pairs: Vec::new(),
            wreckage: None,
            open_impacts: Vec::new(),
            collisions: Vec::new(),
        };
        world.refresh_shapes();
        world
    }

    /// The time that the states hold for.
    pub(crate) fn time(&self) -> Time {
        self.time
    }

    /// Number of vehicles.
    pub(crate) fn len(&self) -> usize {
        self.actors.len()
    }

    /// The places of the vehicles in the order of their names.
    pub(crate) fn by_name(&self) -> &[usize] {
        &self.by_name
    }

    /// What a vehicle is.
    pub(crate) fn vehicle(&self, actor: usize) -> &Vehicle {
        &self.actors[actor].vehicle
    }

    /// Where a vehicle is and how it moves.
    pub(crate) fn state(&self, actor: usize) -> &VehicleState {
        match &self.actors[actor].body {
            Body::Driven(plant) => plant.state(),
            Body::Wrecked { state, .. } => state,
        }
    }

    /// Pitch of a vehicle's body, positive nose down [rad].
    pub(crate) fn pitch_rad(&self, actor: usize) -> f64 {
        match &self.actors[actor].body {
            Body::Driven(plant) => plant.pitch_rad(),
            Body::Wrecked { .. } => 0.0,
        }
    }

    /// The target of a vehicle's lane change under way.
    pub(crate) fn changing_to(&self, actor: usize) -> Option<Lane> {
        match &self.actors[actor].body {
            Body::Driven(plant) => plant.changing_to(),
            Body::Wrecked { .. } => None,
        }
    }

    /// How far a vehicle is beside the path that its driver means to take, positive to the left [m].
    pub(crate) fn lateral_deviation_m(&self, actor: usize) -> f64 {
        match &self.actors[actor].body {
            Body::Driven(plant) => plant.lateral_deviation_m(),
            Body::Wrecked { .. } => 0.0,
        }
    }

    /// True once a vehicle has touched another: its driver has lost control.
    pub(crate) fn is_wrecked(&self, actor: usize) -> bool {
        matches!(self.actors[actor].body, Body::Wrecked { .. })
    }

    /// The vehicles around one.
    pub(crate) fn neighbours(&self, actor: usize) -> Neighbours {
        neighbours::around(self, actor, &self.road)
    }

    /// Every first touch so far, in order of time.
    pub(crate) fn collisions(&self) -> &[Collision] {
        &self.collisions
    }

    /// Moves every vehicle on by one step; `actions` in the order of the actors, `phase` for collisions in this step.
    pub(crate) fn step(&mut self, actions: &[Action], phase: Phase) {
        std::mem::swap(&mut self.shapes, &mut self.shapes_before);
        let step_s = self.step.s();
        if let Some(wreckage) = &mut self.wreckage {
            wreckage.step(step_s);
        }
        for (actor, action) in self.actors.iter_mut().zip(actions) {
            match &mut actor.body {
                Body::Driven(plant) => {
                    if let Some(change) = action.lane_change {
                        plant.change_lane(change, &self.road);
                    }
                    plant.step(action.acceleration_mps2, action.indicator, &self.road);
                }
                Body::Wrecked { body, state } => {
                    if let Some(wreckage) = &self.wreckage {
                        *state = road_state(&wreckage.motion(*body), &self.road, state, step_s);
                    }
                }
            }
        }
        self.refresh_shapes();
        self.settle_impacts(step_s);
        self.collide(phase);
        self.time += self.step;
    }

    fn refresh_shapes(&mut self) {
        self.shapes.clear();
        for actor in &self.actors {
            let state = match &actor.body {
                Body::Driven(plant) => plant.state(),
                Body::Wrecked { state, .. } => state,
            };
            let pose = self.road.plane_pose(state.s_m, state.d_m, state.heading_rad);
            let size = actor.vehicle.dimensions;
            self.shapes.push(OrientedBox {
                x_m: pose.x_m,
                y_m: pose.y_m,
                yaw_rad: pose.yaw_rad,
                length_m: size.length_m,
                width_m: size.width_m,
            });
        }
    }

    /// Finds new touches within the step just taken, records them, and hands the vehicles to the solver.
    fn collide(&mut self, phase: Phase) {
        let mut touches = std::mem::take(&mut self.touches);
        contact::find([&self.shapes_before, &self.shapes], &self.by_name, &self.touched_pairs, &mut touches);
        for touch in &touches {
            self.record(touch, phase);
        }
        self.touches = touches;
    }

    fn record(&mut self, touch: &Touch, phase: Phase) {
        let [first, second] = touch.pair;
        let velocities_mps = [self.velocity_mps(first), self.velocity_mps(second)];
        let shapes = [&self.shapes[first], &self.shapes[second]];
        let since_start = Time::from_s(touch.fraction * self.step.s());
        self.collisions.push(Collision {
            time: self.time + since_start,
            between: [self.actors[first].id.clone(), self.actors[second].id.clone()],
            struck_side: touch.struck_side,
            closed_by: contact::closed_by(shapes, touch.struck_side, velocities_mps),
            phase,
            relative_speed_mps: (velocities_mps[0] - velocities_mps[1]).norm(),
            delta_v_mps: [0.0; 2],
        });
        let collision = self.collisions.len() - 1;
        self.touched_pairs.push(touch.pair);
        self.open_impacts.push(OpenImpact { collision, pair: touch.pair, velocities_mps, left_s: IMPACT_DURATION_S });
        for actor in touch.pair {
            self.wreck(actor, touch.fraction);
        }
    }

    /// Velocity in the plane [m/s].
    fn velocity_mps(&self, actor: usize) -> Vector2<f64> {
        match &self.actors[actor].body {
            Body::Wrecked { body, .. } => match &self.wreckage {
                Some(wreckage) => wreckage.motion(*body).velocity_mps,
                None => Vector2::zeros(),
            },
            Body::Driven(plant) => {
                // The course: where the box's centre has moved in this step.
                let (from, to) = (&self.shapes_before[actor], &self.shapes[actor]);
                let way = Vector2::new(to.x_m - from.x_m, to.y_m - from.y_m);
                way.try_normalize(1e-9).map_or_else(Vector2::zeros, |course| course * plant.state().speed_mps)
            }
        }
    }

    /// Hands a driven vehicle to the solver, at the place where it touched after `fraction` of the step.
    fn wreck(&mut self, actor: usize, fraction: f64) {
        if self.is_wrecked(actor) {
            return;
        }
        let (from, to) = (&self.shapes_before[actor], &self.shapes[actor]);
        let between = |from: f64, to: f64| from + fraction * (to - from);
        let motion = Motion {
            position_m: Vector2::new(between(from.x_m, to.x_m), between(from.y_m, to.y_m)),
            yaw_rad: between(from.yaw_rad, to.yaw_rad),
            velocity_mps: self.velocity_mps(actor),
            yaw_rate_radps: self.state(actor).yaw_rate_radps,
        };
        let friction = self.friction;
        let wreckage = self.wreckage.get_or_insert_with(|| Wreckage::new(motion.position_m, friction));
        let size = self.actors[actor].vehicle.dimensions;
        let mass_kg = self.actors[actor].vehicle.mass_kg;
        let body = wreckage.add(BodySpec { length_m: size.length_m, width_m: size.width_m, mass_kg }, &motion);
        let state = road_state(&motion, &self.road, self.state(actor), self.step.s());
        self.actors[actor].body = Body::Wrecked { body, state };
    }

    /// Reads the change of velocity of every impact that is still going on.
    fn settle_impacts(&mut self, step_s: f64) {
        let Some(wreckage) = &self.wreckage else { return };
        for impact in &mut self.open_impacts {
            impact.left_s -= step_s;
            for place in 0..2 {
                if let Body::Wrecked { body, .. } = &self.actors[impact.pair[place]].body {
                    let change_mps = wreckage.motion(*body).velocity_mps - impact.velocities_mps[place];
                    self.collisions[impact.collision].delta_v_mps[place] = change_mps.norm();
                }
            }
        }
        self.open_impacts.retain(|impact| impact.left_s > 0.0);
    }
}

/// A wreck's state in the road frame; its acceleration follows from its speed before.
fn road_state(motion: &Motion, road: &Road, before: &VehicleState, step_s: f64) -> VehicleState {
    let (s_m, d_m) = road.road_position_m(motion.position_m.x, motion.position_m.y);
    let speed_mps = motion.velocity_mps.norm();
    VehicleState {
        s_m,
        d_m,
        heading_rad: motion.yaw_rad - road.plane_pose(s_m, d_m, 0.0).yaw_rad,
        speed_mps,
        acceleration_mps2: (speed_mps - before.speed_mps) / step_s,
        yaw_rate_radps: motion.yaw_rate_radps,
        brake_light: true,
        indicator: before.indicator,
    }
}
