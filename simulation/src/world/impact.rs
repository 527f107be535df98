//! Moves vehicles that have collided: rigid bodies that hit each other, spin and slide.
//!
//! parry finds the moment of contact in `f64` (see [`super::contact`]). This module receives the
//! vehicles at that moment and lets rapier2d's solver compute the impact. Rapier computes in `f32`,
//! so positions are relative to the first vehicle that collided.
//!
//! No other force acts during an impact, so that momentum is conserved; afterwards the tyres slide.
//! The velocities after an impact are read at its end, as in accident reconstruction.

use closecall_traffic::{GRAVITY_MPS2, maths};
use nalgebra::Vector2;
use rapier2d::prelude::*;

/// Coefficient of restitution of the contact points: the value of car bodies at medium and high
/// closing speeds, about 0.1 (Brach and Brach, *Vehicle Accident Analysis*, 2011; SAE
/// 1999-01-0097). At a change of velocity of 1 to 2 m/s, 0.2 to 0.4 are measured (SAE 931842); the
/// model has no such rise, and underestimates the change of velocity there.
///
/// In a central impact of parallel vehicles, the centres separate at 0.11 of the closing speed (600
/// collisions with a rear vehicle that stays in its lane: 0.112 in each without weaving, 0.093 to
/// 0.112 with it). With an offset of 0.8 m and a yaw of up to 0.1 rad at 10 m/s, it is 0.03 to
/// 0.20. In `low-thw-overtake`, where the rear vehicle changes lanes, the centres separate at 0.02
/// of the closing speed (median of 474 collisions); each change of velocity is then about 7 %
/// smaller than with a restitution of 0.1 between the centres.
const RESTITUTION: f32 = 0.1;
/// Friction between car bodies: an assumption; 0.3 to 0.7 are plausible.
const BODY_FRICTION: f32 = 0.5;
/// Fraction of the road's friction that locked tyres sliding partly sideways provide: an
/// assumption; 0.6 to 1 are plausible.
const SLIDING_SHARE: f64 = 0.8;
/// Duration of an impact (s): an assumption, the order of published crash pulses. No tyre force
/// acts during it, and the change of velocity is read at its end.
pub(super) const IMPACT_DURATION_S: f64 = 0.1;
/// Radius of gyration of a vehicle as a fraction of its diagonal, for the friction that slows its
/// spin: 1/√12, the value of a uniform plate.
const GYRATION_SHARE: f64 = 0.29;

/// A vehicle's motion in the plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Motion {
    /// Position of the centre (m).
    pub(super) position_m: Vector2<f64>,
    /// Heading (rad).
    pub(super) yaw_rad: f64,
    /// Velocity (m/s).
    pub(super) velocity_mps: Vector2<f64>,
    /// Yaw rate (rad/s).
    pub(super) yaw_rate_radps: f64,
}

/// Size and mass of a body.
#[derive(Clone, Copy, Debug)]
pub(super) struct BodySpec {
    /// Length of the box (m).
    pub(super) length_m: f64,
    /// Width of the box (m).
    pub(super) width_m: f64,
    /// Mass (kg).
    pub(super) mass_kg: f64,
}

/// Identifies a body in [`Wreckage`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct BodyId(RigidBodyHandle);

/// The vehicles that have collided, and rapier's solver that moves them.
pub(super) struct Wreckage {
    origin_m: Vector2<f64>,
    friction: f64,
    bodies: RigidBodySet,
    colliders: ColliderSet,
    specs: Vec<(RigidBodyHandle, BodySpec)>,
    /// Time until the tyres act again (s).
    impact_left_s: f64,
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
    /// Creates a wreckage without bodies. `origin_m` is the origin of rapier's coordinates,
    /// `friction` the road's.
    pub(super) fn new(origin_m: Vector2<f64>, friction: f64) -> Self {
        let parameters = IntegrationParameters { max_ccd_substeps: 4, ..IntegrationParameters::default() };
        Self {
            origin_m,
            friction,
            bodies: RigidBodySet::new(),
            colliders: ColliderSet::new(),
            specs: Vec::new(),
            impact_left_s: IMPACT_DURATION_S,
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

    /// Adds a vehicle that has just touched another one, and starts a new impact.
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
        self.impact_left_s = IMPACT_DURATION_S;
        BodyId(handle)
    }

    /// Moves all bodies by one step of `step_s`.
    #[expect(clippy::cast_possible_truncation, reason = "rapier computes in f32")]
    pub(super) fn step(&mut self, step_s: f64) {
        if self.impact_left_s > 0.0 {
            self.impact_left_s -= step_s;
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

    /// Reduces the speed and the yaw rate of every body by the dissipation of its sliding tyres in
    /// one step.
    #[expect(clippy::cast_possible_truncation, reason = "rapier computes in f32")]
    fn slide(&mut self, step_s: f64) {
        let slowing_mps = (SLIDING_SHARE * self.friction * GRAVITY_MPS2 * step_s) as f32;
        for &(handle, spec) in &self.specs {
            let Some(body) = self.bodies.get_mut(handle) else { continue };
            let speed = body.linvel().length();
            let left = if speed > slowing_mps { (speed - slowing_mps) / speed } else { 0.0 };
            body.set_linvel(body.linvel() * left, true);
            let radius_m = GYRATION_SHARE * maths::hypot(spec.length_m, spec.width_m);
            let slowing_radps = slowing_mps / radius_m as f32;
            let turning = body.angvel();
            let left = if turning.abs() > slowing_radps { turning - slowing_radps * turning.signum() } else { 0.0 };
            body.set_angvel(left, true);
        }
    }

    /// Returns the current motion of a body.
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

    /// A vehicle before an impact.
    #[derive(Clone, Copy)]
    struct Vehicle {
        spec: BodySpec,
        speed_mps: f64,
    }

    const fn car(speed_mps: f64) -> Vehicle {
        Vehicle { spec: CAR, speed_mps }
    }

    const fn truck(speed_mps: f64) -> Vehicle {
        Vehicle { spec: TRUCK, speed_mps }
    }

    /// Total momentum before and after an impact (kg·m/s), and the speed at which the vehicles
    /// separate (m/s).
    struct Impact {
        before: Vector2<f64>,
        after: Vector2<f64>,
        separation_mps: f64,
    }

    /// Runs `rear` into the rear end of `front`, with a lateral offset.
    fn collide(rear: Vehicle, front: Vehicle, offset_m: f64) -> Impact {
        collide_at(rear, front, offset_m, 0.0)
    }

    /// Does the same with the rear vehicle rotated by `yaw_rad`.
    fn collide_at(rear: Vehicle, front: Vehicle, offset_m: f64, yaw_rad: f64) -> Impact {
        let distance_m = 0.5
            * (rear.spec.length_m * maths::cos(yaw_rad)
                + rear.spec.width_m * maths::sin(yaw_rad)
                + front.spec.length_m);
        let rotated = Motion { yaw_rad, ..moving(1_000.0, 0.0, rear.speed_mps) };
        let motions = [rotated, moving(1_000.0 + distance_m, offset_m, front.speed_mps)];
        let mut wreckage = Wreckage::new(motions[0].position_m, 0.9);
        let ids = [wreckage.add(rear.spec, &motions[0]), wreckage.add(front.spec, &motions[1])];
        for _ in 0..10 {
            wreckage.step(0.01);
        }
        let momentum = |velocities_mps: [Vector2<f64>; 2]| {
            velocities_mps[0] * rear.spec.mass_kg + velocities_mps[1] * front.spec.mass_kg
        };
        let before = momentum(motions.map(|motion| motion.velocity_mps));
        let after_mps = ids.map(|id| wreckage.motion(id).velocity_mps);
        Impact { before, after: momentum(after_mps), separation_mps: after_mps[1].x - after_mps[0].x }
    }

    #[test]
    fn momentum_is_conserved_through_the_impact() {
        for (rear, front, offset_m) in [
            (car(33.0), car(20.0), 0.0),
            (car(33.0), car(20.0), 1.2),
            (car(33.0), truck(22.0), 0.5),
            (truck(25.0), car(5.0), -0.7),
        ] {
            let Impact { before, after, separation_mps } = collide(rear, front, offset_m);
            assert!((after - before).norm() < 0.01 * before.norm(), "{before} {after}");
            assert!(
                separation_mps > -0.2,
                "the vehicles still approach each other: they separate at {separation_mps} m/s"
            );
        }
    }

    #[test]
    fn parallel_vehicles_separate_after_a_central_impact_as_their_restitution_says() {
        for (rear, front) in [(car(30.0), car(20.0)), (car(21.0), car(20.0)), (car(30.0), truck(20.0))] {
            let Impact { separation_mps, .. } = collide(rear, front, 0.0);
            let share = separation_mps / (rear.speed_mps - front.speed_mps);
            assert!((0.10..0.13).contains(&share), "{share}");
        }
    }

    #[test]
    fn the_separation_of_offset_and_rotated_vehicles_scatters_around_the_restitution() {
        let share = |offset_m, yaw_rad| collide_at(car(30.0), car(20.0), offset_m, yaw_rad).separation_mps / 10.0;
        assert!(share(0.8, 0.0) < share(0.0, 0.0));
        for offset_m in [-0.8, 0.0, 0.8] {
            for yaw_rad in [0.0, 0.005, 0.01, 0.02, 0.05, 0.1] {
                let share = share(offset_m, yaw_rad);
                assert!((0.03..0.21).contains(&share), "{offset_m} m, {yaw_rad} rad: {share}");
            }
        }
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
