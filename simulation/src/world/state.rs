//! The state of all vehicles, moved by one step at a time.

use closecall_controllers::{LaneChange, Looks, Neighbours, Weave};
use closecall_traffic::geometry::{BoxSide, OrientedBox};
use closecall_traffic::metrics::bumper_gap_m;
use closecall_traffic::{ActorId, Indicator, Lane, LateralPath, Road, Time, Vehicle, VehicleClass, VehicleState};
use nalgebra::Vector2;

use super::contact::{self, ContactSearch, StepBoxes, StruckVehicle, Touch};
use super::impact::{BodyId, BodySpec, IMPACT_DURATION_S, Motion, Wreckage};
use super::neighbours::{self, Around, Extent};
use super::plant::Plant;
use super::search::NeighbourSearch;
use closecall_scenarios::outcome::{Collision, Phase, TOUCH_MPS};

/// Gap at which two bumpers that touch are held apart (m): numerical. Neighbours with a gap below
/// zero would count as side by side.
const HELD_APART_M: f64 = 1e-3;

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
    /// The name.
    pub(crate) id: ActorId,
    /// The class, size and mass.
    pub(crate) vehicle: Vehicle,
    /// The state at time zero.
    pub(crate) state: VehicleState,
    /// The lateral path, or `None` if it keeps the centre of its lane.
    pub(crate) path: Option<LateralPath>,
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

/// An impact in progress: its change of velocity is not final.
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
    /// Indices of the actors in the order of their names. Pairs are processed in this order: the
    /// result does not depend on the order of the list of actors.
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
    /// The first touch of each pair whose bumpers have met.
    bumper_touches: Vec<Collision>,
}

impl World {
    /// Creates the world at time zero. The vehicles must not overlap; the check of the scenario
    /// ensures this.
    pub(crate) fn new(road: Road, friction: f64, step: Time, vehicles: Vec<InitialVehicle>) -> Self {
        let actors: Vec<Actor> = vehicles
            .into_iter()
            .map(|InitialVehicle { id, vehicle, state, path, weave, has_ideal_actuators }| {
                let plant = Plant::new(&vehicle, state, weave, friction, step.s());
                let plant = plant.with_path(path).in_lane_of(&road);
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
            bumper_touches: Vec::new(),
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

    /// Returns a vehicle's lateral deviation from the path that its driver intends, positive to the
    /// left (m).
    pub(crate) fn lateral_deviation_m(&self, actor: usize) -> f64 {
        match &self.actors[actor].body {
            Body::Driven(plant) => plant.lateral_deviation_m(),
            Body::Wrecked { .. } => 0.0,
        }
    }

    /// Returns whether a vehicle has touched another one. Its driver has then lost control.
    pub(crate) fn is_wrecked(&self, actor: usize) -> bool {
        matches!(self.actors[actor].body, Body::Wrecked { .. })
    }

    /// Returns the vehicles around a vehicle.
    pub(crate) fn neighbours(&self, actor: usize) -> Neighbours {
        let extents: Vec<Extent> = (0..self.len()).map(|actor| Extent::of(self, actor)).collect();
        let mut neighbours = Neighbours::default();
        let mut around = Around::default();
        neighbours::find(&extents, actor, &self.road, Looks::AROUND, &mut around);
        around.describe(self, &mut neighbours);
        neighbours
    }

    /// Replaces `neighbours` by the vehicles around each vehicle, within the sight of each driver.
    /// Both lists are in the order of the actors.
    pub(crate) fn find_neighbours(&mut self, looks: &[Looks], neighbours: &mut [Neighbours]) {
        let mut search = std::mem::take(&mut self.search);
        search.find_all(self, &self.road, looks, neighbours);
        self.search = search;
    }

    /// Returns the collisions so far, in order of time.
    pub(crate) fn collisions(&self) -> &[Collision] {
        &self.collisions
    }

    /// Returns the first touch of each pair whose bumpers have met so far, in order of time.
    pub(crate) fn touches(&self) -> &[Collision] {
        &self.bumper_touches
    }

    /// Moves all vehicles by one step. `actions` is in the order of the actors; `phase` is noted in
    /// collisions of this step.
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

    /// Finds the pairs that have touched for the first time within the last step, and starts their
    /// collisions.
    fn collide(&mut self, phase: Phase) {
        let mut touches = std::mem::take(&mut self.touches);
        let boxes = StepBoxes { before: &self.shapes_before, after: &self.shapes };
        self.contacts.find(boxes, &self.by_name, &self.touched_pairs, &mut touches);
        let mut are_apart = false;
        for touch in &touches {
            match self.bumpers(touch) {
                Some(bumpers) => {
                    self.hold_apart(touch, bumpers, phase);
                    are_apart = true;
                }
                None => self.start_collision(touch, phase),
            }
        }
        self.touches = touches;
        if are_apart {
            self.refresh_shapes();
        }
    }

    /// Returns the two vehicles of a contact, the one behind first, if it is a touch: the front
    /// bumper of a car or truck meets the rear bumper of another one, slowly, and both drive. A
    /// motorcycle has no bumper, and its rider may fall.
    fn bumpers(&self, touch: &Touch) -> Option<[usize; 2]> {
        let [behind, ahead] = match touch.struck_side {
            [BoxSide::Front, BoxSide::Rear] => touch.pair,
            [BoxSide::Rear, BoxSide::Front] => [touch.pair[1], touch.pair[0]],
            _ => return None,
        };
        let has_bumper =
            |actor: usize| !self.is_wrecked(actor) && self.vehicle(actor).class != VehicleClass::Motorcycle;
        let is_slow = (self.velocity_mps(behind) - self.velocity_mps(ahead)).norm() < TOUCH_MPS;
        (is_slow && has_bumper(behind) && has_bumper(ahead)).then_some([behind, ahead])
    }

    /// Notes a touch, unless its pair has touched before. The vehicle behind pushes the one ahead:
    /// from then on both have the speed that conserves their momentum, until one of them brakes or
    /// accelerates away.
    fn hold_apart(&mut self, touch: &Touch, [behind, ahead]: [usize; 2], phase: Phase) {
        let [follower_mps, lead_mps] = [behind, ahead].map(|actor| self.state(actor).speed_mps);
        let [follower_kg, lead_kg] = [behind, ahead].map(|actor| self.vehicle(actor).mass_kg);
        let common_mps = (follower_kg * follower_mps + lead_kg * lead_mps) / (follower_kg + lead_kg);
        let between = touch.pair.map(|actor| self.actors[actor].id.clone());
        if !self.bumper_touches.iter().any(|touch| touch.between == between) {
            let mut collision = self.contact(touch, phase);
            let changes_mps = |actor: usize| (common_mps - if actor == behind { follower_mps } else { lead_mps }).abs();
            collision.delta_v_mps = touch.pair.map(changes_mps);
            self.bumper_touches.push(collision);
        }
        let distance_m = self.state(ahead).s_m - self.state(behind).s_m;
        let [follower_m, lead_m] = [behind, ahead].map(|actor| self.vehicle(actor).dimensions.length_m);
        let overlap_m = HELD_APART_M - bumper_gap_m(distance_m, follower_m, lead_m);
        if follower_mps > lead_mps {
            self.meet(ahead, common_mps, 0.0);
            self.meet(behind, common_mps, -overlap_m.max(0.0));
        } else {
            self.meet(behind, follower_mps, -overlap_m.max(0.0));
        }
    }

    fn meet(&mut self, actor: usize, speed_mps: f64, shift_m: f64) {
        if let Body::Driven(plant) = &mut self.actors[actor].body {
            plant.meet(speed_mps, shift_m);
        }
    }

    /// Returns a contact of two vehicles, before any change of velocity.
    fn contact(&self, touch: &Touch, phase: Phase) -> Collision {
        let velocities_mps = touch.pair.map(|actor| self.velocity_mps(actor));
        let struck = |index: usize| StruckVehicle {
            shape: &self.shapes[touch.pair[index]],
            side: touch.struck_side[index],
            velocity_mps: velocities_mps[index],
        };
        let closed_by = contact::closed_by(struck(0), struck(1));
        let since_start = Time::from_s(touch.fraction * self.step.s());
        Collision {
            time: self.time + since_start,
            between: touch.pair.map(|actor| self.actors[actor].id.clone()),
            struck_side: touch.struck_side,
            closed_by,
            phase,
            relative_speed_mps: (velocities_mps[0] - velocities_mps[1]).norm(),
            delta_v_mps: [0.0; 2],
        }
    }

    /// Adds a collision to the list and hands its two vehicles to the solver.
    fn start_collision(&mut self, touch: &Touch, phase: Phase) {
        let velocities_mps = touch.pair.map(|actor| self.velocity_mps(actor));
        self.collisions.push(self.contact(touch, phase));
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
                // The direction of motion is the direction of the box's centre in this step.
                let (from, to) = (&self.shapes_before[actor], &self.shapes[actor]);
                let moved_m = Vector2::new(to.x_m - from.x_m, to.y_m - from.y_m);
                moved_m.try_normalize(1e-9).map_or_else(Vector2::zeros, |course| course * plant.state().speed_mps)
            }
        }
    }

    /// Hands a driven vehicle to the solver, at the position that it had after `fraction` of the
    /// step.
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

    /// Updates the changes of velocity of all impacts in progress, and removes those that have
    /// ended.
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

/// Returns the state of a wreck in the road frame. Its acceleration is the change of speed since
/// the state `before`.
fn road_state(motion: &Motion, road: &Road, before: &VehicleState, step_s: f64) -> VehicleState {
    let (s_m, d_m) = road.road_position_m(motion.position_m.x, motion.position_m.y, before.s_m);
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

#[cfg(test)]
mod tests {
    use closecall_traffic::PHYSICS_STEP;

    use super::*;

    /// Vehicles in one lane, each with its class, the position of its centre (m) and its speed
    /// (m/s).
    fn world(vehicles: &[(VehicleClass, f64, f64)]) -> World {
        let initial = |(index, &(class, s_m, speed_mps)): (usize, &(VehicleClass, f64, f64))| InitialVehicle {
            id: ActorId::new(&format!("v{index}")).unwrap(),
            vehicle: Vehicle::typical(class),
            state: VehicleState { s_m, d_m: -1.875, speed_mps, ..VehicleState::default() },
            path: None,
            weave: None,
            has_ideal_actuators: true,
        };
        World::new(Road::straight(3), 0.9, PHYSICS_STEP, vehicles.iter().enumerate().map(initial).collect())
    }

    /// Runs the world for some seconds with a constant acceleration of each vehicle (m/s²), and
    /// returns the smallest gap between the first two (m).
    fn drive(world: &mut World, duration_s: f64, accelerations_mps2: &[f64]) -> f64 {
        let command = |mps2: &f64| Action { acceleration_mps2: *mps2, ..Action::default() };
        let actions: Vec<Action> = accelerations_mps2.iter().map(command).collect();
        let until = world.time() + Time::from_s(duration_s);
        let mut least_m = f64::INFINITY;
        while world.time() < until {
            world.step(&actions, Phase::Approach);
            let distance_m = world.state(0).s_m - world.state(1).s_m;
            let [ahead_m, behind_m] = [0, 1].map(|actor| world.vehicle(actor).dimensions.length_m);
            least_m = least_m.min(bumper_gap_m(distance_m, ahead_m, behind_m));
        }
        least_m
    }

    fn length_m(class: VehicleClass) -> f64 {
        Vehicle::typical(class).dimensions.length_m
    }

    /// A car, and one 5 cm behind it that is faster by `closing_mps`.
    fn close(closing_mps: f64) -> World {
        let behind_m = 100.0 - length_m(VehicleClass::Car) - 0.05;
        world(&[(VehicleClass::Car, 100.0, 20.0), (VehicleClass::Car, behind_m, 20.0 + closing_mps)])
    }

    #[test]
    fn bumpers_that_meet_slowly_touch_and_both_drive_on() {
        let mut world = close(0.3);
        let least_m = drive(&mut world, 2.0, &[0.0, 0.0]);
        assert!(world.collisions().is_empty() && world.touches().len() == 1, "{:?}", world.touches());
        let touch = &world.touches()[0];
        assert!((touch.relative_speed_mps - 0.3).abs() < 1e-9, "{touch:?}");
        assert!(touch.delta_v_mps.iter().all(|delta_v_mps| (delta_v_mps - 0.15).abs() < 1e-9), "{touch:?}");
        assert!(!world.is_wrecked(0) && !world.is_wrecked(1));
        assert!([0, 1].map(|actor| world.state(actor).speed_mps).iter().all(|mps| (mps - 20.15).abs() < 1e-9));
        assert!(least_m >= 0.0, "the boxes overlap by {least_m} m");
    }

    #[test]
    fn a_vehicle_that_pushes_touches_once_and_does_not_overlap() {
        let mut world = close(0.3);
        drive(&mut world, 1.0, &[0.0, 0.0]);
        let least_m = drive(&mut world, 3.0, &[-6.0, 1.0]);
        assert!(world.collisions().is_empty() && world.touches().len() == 1, "{:?}", world.collisions());
        assert!(least_m >= 0.0, "the boxes overlap by {least_m} m");
    }

    #[test]
    fn a_touch_does_not_hide_a_later_hard_contact_of_the_same_pair() {
        let mut world = close(0.3);
        drive(&mut world, 1.0, &[0.0, 0.0]);
        drive(&mut world, 1.0, &[0.0, -3.0]);
        drive(&mut world, 3.0, &[-6.0, 1.0]);
        assert_eq!((world.touches().len(), world.collisions().len()), (1, 1));
        assert!(world.collisions()[0].relative_speed_mps > 2.0, "{:?}", world.collisions());
    }

    #[test]
    fn a_touch_does_not_hide_a_later_hard_contact_with_a_third_vehicle() {
        let behind_m = 100.0 - length_m(VehicleClass::Car) - 0.05;
        let third = (VehicleClass::Car, behind_m - 30.0, 30.0);
        let mut world = world(&[(VehicleClass::Car, 100.0, 20.0), (VehicleClass::Car, behind_m, 20.3), third]);
        drive(&mut world, 4.0, &[0.0; 3]);
        assert_eq!(world.touches().len(), 1);
        assert!(world.collisions().iter().any(|hit| hit.relative_speed_mps > 9.0), "{:?}", world.collisions());
    }

    #[test]
    fn a_fast_contact_a_motorcycle_and_a_wreck_collide_however_slowly() {
        let mut fast = close(0.7);
        drive(&mut fast, 1.0, &[0.0; 2]);
        assert_eq!((fast.touches().len(), fast.collisions().len()), (0, 1));
        let behind_m = 100.0 - 0.5 * (length_m(VehicleClass::Car) + length_m(VehicleClass::Motorcycle)) - 0.05;
        let mut motorcycle = world(&[(VehicleClass::Car, 100.0, 20.0), (VehicleClass::Motorcycle, behind_m, 20.3)]);
        drive(&mut motorcycle, 1.0, &[0.0; 2]);
        assert_eq!((motorcycle.touches().len(), motorcycle.collisions().len()), (0, 1));
    }
}
