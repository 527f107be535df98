//! The state of all vehicles, moved by one step at a time.

use closecall_controllers::{LaneChange, Looks, Neighbours, Weave};
use closecall_traffic::geometry::OrientedBox;
use closecall_traffic::{ActorId, Indicator, Lane, Road, Time, Vehicle, VehicleState};
use nalgebra::Vector2;

use super::contact::{self, ContactSearch, StepBoxes, StruckVehicle, Touch};
use super::impact::{BodyId, BodySpec, IMPACT_DURATION_S, Motion, Wreckage};
use super::neighbours::{self, Around, Extent};
use super::plant::Plant;
use super::search::NeighbourSearch;
use closecall_scenarios::outcome::{Collision, Phase};

/// The commands to one vehicle for one step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Action {
    /// Commanded acceleration (m/s²).
    pub(crate) acceleration_mps2: f64,
    /// A lane change to start.
    pub(crate) lane_change: Option<LaneChange>,
    /// The direction indicator.
    pub(crate) indicator: Indicator,
}

/// A vehicle as it enters the world.
#[derive(Clone, Debug)]
pub(crate) struct InitialVehicle {
    /// Its name.
    pub(crate) id: ActorId,
    /// Its class, size and mass.
    pub(crate) vehicle: Vehicle,
    /// Its state at time zero.
    pub(crate) state: VehicleState,
    /// The lateral deviation of its driver, or `None` if the driver does not weave.
    pub(crate) weave: Option<Weave>,
    /// Whether its actuators follow the command at once.
    pub(crate) has_ideal_actuators: bool,
}

enum Body {
    /// Under the control of its driver.
    Driven(Box<Plant>),
    /// Moved by rapier's solver after a collision.
    Wrecked { body: BodyId, state: VehicleState },
}

struct Actor {
    id: ActorId,
    vehicle: Vehicle,
    body: Body,
}

/// An impact that is still in progress, so that its change of velocity is not final.
struct OpenImpact {
    /// Index of its collision in the list of collisions.
    collision: usize,
    /// Indices of the two vehicles in the list of actors.
    pair: [usize; 2],
    /// Velocities of the two vehicles before the impact (m/s).
    velocities_mps: [Vector2<f64>; 2],
    /// Time until the impact ends (s).
    left_s: f64,
}

/// All vehicles of a run, and the collisions between them.
pub(crate) struct World {
    road: Road,
    friction: f64,
    step: Time,
    time: Time,
    actors: Vec<Actor>,
    /// Indices of the actors in the order of their names. Pairs are processed in this order, so that the result does not
    /// depend on the order of the list of actors.
    by_name: Vec<usize>,
    shapes: Vec<OrientedBox>,
    shapes_before: Vec<OrientedBox>,
    search: NeighbourSearch,
    contacts: ContactSearch,
    touches: Vec<Touch>,
    touched_pairs: Vec<[usize; 2]>,
    wreckage: Option<Wreckage>,
    open_impacts: Vec<OpenImpact>,
    collisions: Vec<Collision>,
}

impl World {
    /// Creates the world at time zero. The vehicles must not overlap; the check of the scenario ensures this.
    pub(crate) fn new(road: Road, friction: f64, step: Time, vehicles: Vec<InitialVehicle>) -> Self {
        let actors: Vec<Actor> = vehicles
            .into_iter()
            .map(|InitialVehicle { id, vehicle, state, weave, has_ideal_actuators }| {
                let plant = Plant::new(&vehicle, state, weave, friction, step.s());
                let body =
                    Body::Driven(Box::new(if has_ideal_actuators { plant.with_ideal_actuators() } else { plant }));
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
            search: NeighbourSearch::default(),
            contacts: ContactSearch::default(),
            touches: Vec::new(),
            touched_pairs: Vec::new(),
            wreckage: None,
            open_impacts: Vec::new(),
            collisions: Vec::new(),
        };
        world.refresh_shapes();
        world
    }

    /// Returns the time of the current states.
    pub(crate) fn time(&self) -> Time {
        self.time
    }

    /// Returns the number of vehicles.
    pub(crate) fn len(&self) -> usize {
        self.actors.len()
    }

    /// Returns the indices of the vehicles in the order of their names.
    pub(crate) fn by_name(&self) -> &[usize] {
        &self.by_name
    }

    /// Returns the class, size and mass of a vehicle.
    pub(crate) fn vehicle(&self, actor: usize) -> &Vehicle {
        &self.actors[actor].vehicle
    }

    /// Returns the current state of a vehicle.
    pub(crate) fn state(&self, actor: usize) -> &VehicleState {
        match &self.actors[actor].body {
            Body::Driven(plant) => plant.state(),
            Body::Wrecked { state, .. } => state,
        }
    }

    /// Returns the pitch of a vehicle's body, positive nose down (rad).
    pub(crate) fn pitch_rad(&self, actor: usize) -> f64 {
        match &self.actors[actor].body {
            Body::Driven(plant) => plant.pitch_rad(),
            Body::Wrecked { .. } => 0.0,
        }
    }

    /// Returns the target lane of a vehicle's lane change in progress, or `None` if there is none.
    pub(crate) fn lane_change_target(&self, actor: usize) -> Option<Lane> {
        match &self.actors[actor].body {
            Body::Driven(plant) => plant.lane_change_target(),
            Body::Wrecked { .. } => None,
        }
    }

    /// Returns a vehicle's lateral deviation from the path that its driver intends, positive to the left (m).
    pub(crate) fn lateral_deviation_m(&self, actor: usize) -> f64 {
        match &self.actors[actor].body {
            Body::Driven(plant) => plant.lateral_deviation_m(),
            Body::Wrecked { .. } => 0.0,
        }
    }

    /// Returns whether a vehicle has touched another one, so that its driver has lost control.
    pub(crate) fn is_wrecked(&self, actor: usize) -> bool {
        matches!(self.actors[actor].body, Body::Wrecked { .. })
    }

    /// Returns the vehicles around a vehicle.
    pub(crate) fn neighbours(&self, actor: usize) -> Neighbours {
        let extents: Vec<Extent> = (0..self.len()).map(|actor| Extent::of(self, actor)).collect();
        let mut found = Neighbours::default();
        let mut around = Around::default();
        neighbours::find(&extents, actor, &self.road, Looks::AROUND, &mut around);
        around.describe(self, &mut found);
        found
    }

    /// Replaces `found` by the vehicles around each vehicle, as far as each driver looks. Both lists are in the order of the
    /// actors.
    pub(crate) fn find_neighbours(&mut self, looks: &[Looks], found: &mut [Neighbours]) {
        let mut search = std::mem::take(&mut self.search);
        search.find_all(self, &self.road, looks, found);
        self.search = search;
    }

    /// Returns the collisions so far, in order of time.
    pub(crate) fn collisions(&self) -> &[Collision] {
        &self.collisions
    }

    /// Moves all vehicles by one step. `actions` is in the order of the actors; `phase` is noted in collisions of this step.
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
        self.update_impacts(step_s);
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

    /// Finds the pairs that have touched for the first time within the last step, and starts their collisions.
    fn collide(&mut self, phase: Phase) {
        let mut touches = std::mem::take(&mut self.touches);
        let boxes = StepBoxes { before: &self.shapes_before, after: &self.shapes };
        self.contacts.find(boxes, &self.by_name, &self.touched_pairs, &mut touches);
        for touch in &touches {
            self.start_collision(touch, phase);
        }
        self.touches = touches;
    }

    /// Adds a collision to the list and hands its two vehicles to the solver.
    fn start_collision(&mut self, touch: &Touch, phase: Phase) {
        let [first, second] = touch.pair;
        let velocities_mps = [self.velocity_mps(first), self.velocity_mps(second)];
        let struck = |index: usize| StruckVehicle {
            shape: &self.shapes[touch.pair[index]],
            side: touch.struck_side[index],
            velocity_mps: velocities_mps[index],
        };
        let closed_by = contact::closed_by(struck(0), struck(1));
        let since_start = Time::from_s(touch.fraction * self.step.s());
        self.collisions.push(Collision {
            time: self.time + since_start,
            between: [self.actors[first].id.clone(), self.actors[second].id.clone()],
            struck_side: touch.struck_side,
            closed_by,
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

    /// Returns the velocity of a vehicle in the plane (m/s).
    fn velocity_mps(&self, actor: usize) -> Vector2<f64> {
        match &self.actors[actor].body {
            Body::Wrecked { body, .. } => match &self.wreckage {
                Some(wreckage) => wreckage.motion(*body).velocity_mps,
                None => Vector2::zeros(),
            },
            Body::Driven(plant) => {
                // The direction of motion is that of the box's centre in this step.
                let (from, to) = (&self.shapes_before[actor], &self.shapes[actor]);
                let moved_m = Vector2::new(to.x_m - from.x_m, to.y_m - from.y_m);
                moved_m.try_normalize(1e-9).map_or_else(Vector2::zeros, |course| course * plant.state().speed_mps)
            }
        }
    }

    /// Hands a driven vehicle to the solver, at the position that it had after `fraction` of the step.
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

    /// Updates the changes of velocity of all impacts in progress, and removes those that have ended.
    fn update_impacts(&mut self, step_s: f64) {
        let Some(wreckage) = &self.wreckage else { return };
        for impact in &mut self.open_impacts {
            impact.left_s -= step_s;
            for index in 0..2 {
                if let Body::Wrecked { body, .. } = &self.actors[impact.pair[index]].body {
                    let change_mps = wreckage.motion(*body).velocity_mps - impact.velocities_mps[index];
                    self.collisions[impact.collision].delta_v_mps[index] = change_mps.norm();
                }
            }
        }
        self.open_impacts.retain(|impact| impact.left_s > 0.0);
    }
}

/// Returns the state of a wreck in the road frame. Its acceleration is the change of speed since the state `before`.
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
