//! Collects the data for the messages of a run.
//!
//! OSI defines the acceleration of an object by the velocities of two instants: `velocity(t) =
//! velocity(t - dt) + acceleration * dt`. In the step of a contact, this quotient is the impulse,
//! divided by the time step of the simulation: hundreds of m/s² that no vehicle feels and that
//! change with the time step. The messages have the change of velocity itself, and the
//! acceleration that the tyres give. A vehicle that has collided keeps its last acceleration while
//! an impulse acts on it.

use closecall_scenarios::Scenario;
use closecall_simulation::{Observer, RunEvent, StepView};
use closecall_traffic::{GRAVITY_MPS2, Time, Track, VehicleState};

/// One control step.
#[derive(Clone, Debug)]
pub(super) struct Step {
    pub(super) time: Time,
    /// All vehicles, in the order of the scenario's actors.
    pub(super) vehicles: Vec<Moving>,
    pub(super) tracks: Vec<Track>,
}

/// A vehicle at one instant.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Moving {
    pub(super) state: VehicleState,
    /// Pitch (rad), positive nose down.
    pub(super) pitch_rad: f64,
    /// Acceleration along its heading and to its left (m/s²), without impulses.
    pub(super) acceleration_mps2: [f64; 2],
}

/// Observes a run, and writes its messages afterwards.
#[derive(Clone, Debug)]
pub struct OsiRecorder {
    pub(super) scenario: Scenario,
    /// Whether each message has the lanes, instead of the first one alone.
    pub(super) has_lanes_in_each: bool,
    pub(super) steps: Vec<Step>,
    /// Whether each vehicle has collided.
    has_collided: Vec<bool>,
}

impl OsiRecorder {
    /// Creates a recorder for a run of `scenario`.
    pub fn new(scenario: &Scenario, has_lanes_in_each: bool) -> Self {
        let has_collided = vec![false; scenario.actors.len()];
        Self { scenario: scenario.clone(), has_lanes_in_each, steps: Vec::new(), has_collided }
    }
}

impl Observer for OsiRecorder {
    fn step(&mut self, view: &StepView<'_>) {
        let grip_mps2 = self.scenario.environment.friction * GRAVITY_MPS2;
        let last = self.steps.last();
        let vehicles = view.vehicles.iter().zip(&self.has_collided).enumerate().map(|(index, (vehicle, collided))| {
            let (state, pitch_rad) = (vehicle.state, vehicle.pitch_rad);
            let last_mps2 = last.and_then(|step| step.vehicles.get(index)).map(|moving| moving.acceleration_mps2[0]);
            let acceleration_mps2 = match *collided {
                true => after_collision_mps2(state.acceleration_mps2, grip_mps2, last_mps2),
                false => [state.acceleration_mps2, state.speed_mps * state.yaw_rate_radps],
            };
            Moving { state, pitch_rad, acceleration_mps2 }
        });
        let vehicles = vehicles.collect();
        self.steps.push(Step { time: view.time, vehicles, tracks: view.tracks.to_vec() });
    }

    fn event(&mut self, _: Time, event: &RunEvent) {
        let RunEvent::Collision(collision) = event else { return };
        for (actor, has_collided) in self.scenario.actors.iter().zip(&mut self.has_collided) {
            *has_collided |= collision.involves(&actor.id);
        }
    }
}

/// Returns the acceleration of a vehicle that has collided, along its heading and to its left
/// (m/s²). `change_mps2` is the change of its speed divided by the time step. If the tyres cannot
/// give it, it contains an impulse, and the last acceleration holds. The vehicle slides: it spins,
/// and does not follow a curve, so that its yaw rate gives no acceleration to the left.
fn after_collision_mps2(change_mps2: f64, grip_mps2: f64, last_mps2: Option<f64>) -> [f64; 2] {
    let is_of_tyres = change_mps2.abs() <= grip_mps2;
    [if is_of_tyres { change_mps2 } else { last_mps2.unwrap_or_default() }, 0.0]
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use closecall_campaign::runner::{Sampling, concrete};
    use closecall_recorded::osi::{GroundTruth, Vector3d};
    use closecall_scenarios::ScenarioFile;
    use closecall_scenarios::sampling::Design;
    use closecall_sensors::SensorMode;
    use closecall_simulation::controller::ControllerChoice;
    use closecall_simulation::{Arm, RunKey, simulate};
    use prost::Message;

    use super::*;

    /// More than any vehicle brakes, accelerates and steers at a time (m/s²).
    const MOST_MPS2: f64 = 15.0;

    fn norm(vector: &Vector3d) -> f64 {
        let square = |value: Option<f64>| value.unwrap().powi(2);
        (square(vector.x) + square(vector.y) + square(vector.z)).sqrt()
    }

    #[test]
    fn a_change_of_speed_that_no_tyre_gives_is_no_acceleration() {
        assert_eq!(after_collision_mps2(-7.0, 8.8, Some(-1.0)), [-7.0, 0.0]);
        assert_eq!(after_collision_mps2(-884.0, 8.8, Some(-1.0)), [-1.0, 0.0]);
        assert_eq!(after_collision_mps2(884.0, 8.8, None), [0.0, 0.0]);
        assert_eq!(after_collision_mps2(f64::NAN, 8.8, Some(-1.0)), [-1.0, 0.0]);
    }

    #[test]
    fn the_messages_of_a_collision_have_the_jump_of_the_velocity_and_no_impulse_as_acceleration() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/library/low-thw-overtake.toml");
        let file = ScenarioFile::load(&path, &[]).unwrap();
        let arm = Arm { controller: ControllerChoice::ACC.factory(), sensors: Some(SensorMode::GroundTruth) };
        let (mut collisions, mut impulse_mps2, mut jump_mps) = (0, 0.0_f64, 0.0_f64);
        for sample in 0..4 {
            let scenario = concrete(&file, Sampling { seed: 0, design: Design::Random, samples: 4 }, sample).unwrap();
            let mut recorder = OsiRecorder::new(&scenario, false);
            let outcome = simulate(&scenario, RunKey { seed: 0, sample }, &arm, &mut recorder).unwrap();
            collisions += outcome.collisions.len();
            let states = recorder.steps.iter().flat_map(|step| &step.vehicles).map(|moving| moving.state);
            impulse_mps2 = states.map(|state| state.acceleration_mps2.abs()).fold(impulse_mps2, f64::max);
            let mut speeds_mps: Vec<f64> = Vec::new();
            for bytes in recorder.ground_truths() {
                let truth = GroundTruth::decode(&bytes[..]).unwrap();
                let bases = truth.moving_object.iter().map(|object| object.base.as_ref().unwrap());
                let now_mps: Vec<f64> = bases.clone().map(|base| norm(base.velocity.as_ref().unwrap())).collect();
                for base in bases {
                    let acceleration_mps2 = norm(base.acceleration.as_ref().unwrap());
                    assert!(acceleration_mps2 <= MOST_MPS2, "{sample}: {acceleration_mps2}");
                }
                let jumps = now_mps.iter().zip(&speeds_mps).map(|(now, before)| (now - before).abs());
                jump_mps = jumps.fold(jump_mps, f64::max);
                speeds_mps = now_mps;
            }
        }
        assert!(collisions >= 3, "{collisions}");
        // A step of the simulation contains an impulse at the instant of a message.
        assert!(impulse_mps2 > 100.0, "{impulse_mps2}");
        // Nothing but a collision changes a speed by 5 m/s between two messages.
        assert!(jump_mps > 5.0, "{jump_mps}");
    }
}
