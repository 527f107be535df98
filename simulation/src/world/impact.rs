//! What happens to vehicles after they have touched: rigid bodies that hit, turn and slide.
//!
//! The moment of contact is found by a swept test in `f64` (see [`super::contact`]); this module is given the vehicles
//! as they touch, and lets rapier2d's solver work out the impact. Rapier computes in `f32`: positions are therefore
//! relative to the place of the first contact.
//!
//! During an impact no other force acts, so that momentum is conserved; afterwards the tyres slide. The speeds after
//! an impact are read when it is over, as an accident reconstruction does.

use closecall_traffic::GRAVITY_MPS2;
use nalgebra::Vector2;
use rapier2d::prelude::*;

/// Restitution of car bodies at the speeds of severe impacts (Brach and Brach, *Vehicle Accident Analysis*, 2011).
const RESTITUTION: f32 = 0.1;
/// Friction between car bodies (ibid.).
const BODY_FRICTION: f32 = 0.5;
/// Share of the road's friction that locked, partly sideways sliding tyres give.
const SLIDING_SHARE: f64 = 0.8;
/// How long an impact lasts: no tyre force acts, and the change of velocity is read at its end [s].
pub(super) const IMPACT_DURATION_S: f64 = 0.1;
/// Radius of gyration of a vehicle as a share of its diagonal, for the friction that brakes its turning.
const GYRATION_SHARE: f64 = 0.29;

/// A vehicle's motion in the plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Motion {
    /// Position of the centre [m].
    pub(super) position_m: Vector2<f64>,
    /// Heading [rad].
    pub(super) yaw_rad: f64,
    /// Velocity [m/s].
    pub(super) velocity_mps: Vector2<f64>,
    /// Yaw rate [rad/s].
    pub(super) yaw_rate_radps: f64,
}

/// What a body is made of.
#[derive(Clone, Copy, Debug)]
pub(super) struct BodySpec {
    /// Length of the box [m].
    pub(super) length_m: f64,
    /// Width of the box [m].
    pub(super) width_m: f64,
    /// Mass [kg].
    pub(super) mass_kg: f64,
}

/// Name of a body in the wreckage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct BodyId(RigidBodyHandle);

/// The bodies that have touched, and rapier's solver that moves them.
pub(super) struct Wreckage {
    origin_m: Vector2<f64>,
    friction: f64,
    bodies: RigidBodySet,
    colliders: ColliderSet,
    specs: Vec<(RigidBodyHandle, BodySpec)>,
    free_of_tyres_s: f64,
    parameters: IntegrationParameters,
    pipeline: PhysicsPipeline,
    islands: IslandManager,
    broad_phase: BroadPhaseBvh,
    narrow_phase: NarrowPhase,
    impulse_joints: ImpulseJointSet,
    multibody_joints: MultibodyJointSet,
    soft_bodies: SoftBodySet,
    ccd: CCDSolver,
}

#[expect(clippy::cast_possible_truncation, reason = "rapier computes in f32; values are relative to the impact")]
fn vector(v: Vector2<f64>) -> Vector {
    Vector::new(v.x as f32, v.y as f32)
}

impl Wreckage {
    /// Nothing yet, around `origin_m`, on a road of this friction.
    pub(super) fn new(origin_m: Vector2<f64>, friction: f64) -> Self {
        let parameters = IntegrationParameters { max_ccd_substeps: 4, ..IntegrationParameters::default() };
        Self {
            origin_m,
            friction,
            bodies: RigidBodySet::new(),
            colliders: ColliderSet::new(),
            specs: Vec::new(),
            free_of_tyres_s: IMPACT_DURATION_S,
            parameters,
            pipeline: PhysicsPipeline::new(),
            islands: IslandManager::new(),
            broad_phase: BroadPhaseBvh::new(),
            narrow_phase: NarrowPhase::new(),
            impulse_joints: ImpulseJointSet::new(),
            multibody_joints: MultibodyJointSet::new(),
            soft_bodies: SoftBodySet::new(),
            ccd: CCDSolver::new(),
        }
    }

    /// Adds a vehicle that has just touched another.
    #[expect(clippy::cast_possible_truncation, reason = "rapier computes in f32")]
    pub(super) fn add(&mut self, spec: BodySpec, motion: &Motion) -> BodyId {
        let body = RigidBodyBuilder::dynamic()
            .translation(vector(motion.position_m - self.origin_m))
            .rotation(motion.yaw_rad as f32)
            .linvel(vector(motion.velocity_mps))
            .angvel(motion.yaw_rate_radps as f32)
            .ccd_enabled(true)
            .can_sleep(false);
        let handle = self.bodies.insert(body);
        let collider = ColliderBuilder::cuboid(0.5 * spec.length_m as f32, 0.5 * spec.width_m as f32)
            .mass(spec.mass_kg as f32)
            .restitution(RESTITUTION)
            .friction(BODY_FRICTION);
        self.colliders.insert_with_parent(collider, handle, &mut self.bodies);
        self.specs.push((handle, spec));
        self.free_of_tyres_s = IMPACT_DURATION_S;
        BodyId(handle)
    }

    /// Moves all bodies on by `step_s`.
    #[expect(clippy::cast_possible_truncation, reason = "rapier computes in f32")]
    pub(super) fn step(&mut self, step_s: f64) {
        if self.free_of_tyres_s > 0.0 {
            self.free_of_tyres_s -= step_s;
        } else {
            self.slide(step_s);
        }
        self.parameters.dt = step_s as f32;
        self.pipeline.step(
            Vector::new(0.0, 0.0),
            &self.parameters,
            &mut self.islands,
            &mut self.broad_phase,
            &mut self.narrow_phase,
            &mut self.bodies,
            &mut self.colliders,
            &mut self.impulse_joints,
            &mut self.multibody_joints,
            &mut self.soft_bodies,
            &mut self.ccd,
            &(),
            &(),
        );
    }

    /// Takes from every body what sliding tyres take in one step.
    #[expect(clippy::cast_possible_truncation, reason = "rapier computes in f32")]
    fn slide(&mut self, step_s: f64) {
        let slowing_mps = (SLIDING_SHARE * self.friction * GRAVITY_MPS2 * step_s) as f32;
        for &(handle, spec) in &self.specs {
            let Some(body) = self.bodies.get_mut(handle) else { continue };
            let speed = body.linvel().length();
            let left = if speed > slowing_mps { (speed - slowing_mps) / speed } else { 0.0 };
            body.set_linvel(body.linvel() * left, true);
            let radius_m = GYRATION_SHARE * spec.length_m.hypot(spec.width_m);
            let slowing_radps = slowing_mps / radius_m as f32;
            let turning = body.angvel();
            let left = if turning.abs() > slowing_radps { turning - slowing_radps * turning.signum() } else { 0.0 };
            body.set_angvel(left, true);
        }
    }

    /// How a body moves now.
    pub(super) fn motion(&self, id: BodyId) -> Motion {
        let body = &self.bodies[id.0];
        let (position, velocity) = (body.translation(), body.linvel());
        Motion {
            position_m: self.origin_m + Vector2::new(position.x.into(), position.y.into()),
            yaw_rad: body.rotation().angle().into(),
            velocity_mps: Vector2::new(velocity.x.into(), velocity.y.into()),
            yaw_rate_radps: body.angvel().into(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CAR: BodySpec = BodySpec { length_m: 4.6, width_m: 1.85, mass_kg: 1_600.0 };
    const TRUCK: BodySpec = BodySpec { length_m: 16.5, width_m: 2.55, mass_kg: 30_000.0 };

    fn moving(x_m: f64, y_m: f64, speed_mps: f64) -> Motion {
        Motion {
            position_m: Vector2::new(x_m, y_m),
            yaw_rad: 0.0,
            velocity_mps: Vector2::new(speed_mps, 0.0),
            yaw_rate_radps: 0.0,
        }
    }

    /// Momentum before and after an impact of `first` from behind into `second`, with a lateral offset.
    fn momenta(first: (BodySpec, f64), second: (BodySpec, f64), offset_m: f64) -> (Vector2<f64>, Vector2<f64>, f64) {
        let gap_m = 0.5 * (first.0.length_m + second.0.length_m);
        let motions = [moving(1_000.0, 0.0, first.1), moving(1_000.0 + gap_m, offset_m, second.1)];
        let mut wreckage = Wreckage::new(motions[0].position_m, 0.9);
        let ids = [wreckage.add(first.0, &motions[0]), wreckage.add(second.0, &motions[1])];
        for _ in 0..10 {
            wreckage.step(0.01);
        }
        let masses = [first.0.mass_kg, second.0.mass_kg];
        let sum = |velocities: [Vector2<f64>; 2]| velocities[0] * masses[0] + velocities[1] * masses[1];
        let before = sum([motions[0].velocity_mps, motions[1].velocity_mps]);
        let after = ids.map(|id| wreckage.motion(id).velocity_mps);
        (before, sum(after), after[1].x - after[0].x)
    }

    #[test]
    fn momentum_is_conserved_through_the_impact() {
        for (first, second, offset_m) in [
            ((CAR, 33.0), (CAR, 20.0), 0.0),
            ((CAR, 33.0), (CAR, 20.0), 1.2),
            ((CAR, 33.0), (TRUCK, 22.0), 0.5),
            ((TRUCK, 25.0), (CAR, 5.0), -0.7),
        ] {
            let (before, after, separation_mps) = momenta(first, second, offset_m);
            assert!((after - before).norm() < 0.01 * before.norm(), "{before} {after}");
            assert!(separation_mps > -0.2, "they still run into each other at {separation_mps} m/s");
        }
    }

    #[test]
    fn a_central_impact_of_equal_cars_shares_the_speed() {
        let (_, _, separation_mps) = momenta((CAR, 30.0), (CAR, 20.0), 0.0);
        // 10 m/s closing with a restitution of 0.1.
        assert!((separation_mps - 1.0).abs() < 0.5, "{separation_mps}");
    }

    #[test]
    fn a_wreck_slides_to_a_stop() {
        let mut wreckage = Wreckage::new(Vector2::zeros(), 0.9);
        let id = wreckage.add(CAR, &moving(0.0, 0.0, 14.0));
        for _ in 0..300 {
            wreckage.step(0.01);
        }
        assert_eq!(wreckage.motion(id).velocity_mps.norm(), 0.0);
    }
}
