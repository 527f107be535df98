//! True tracks with the delay of the sensors: perception whose only fault is its latency.
//!
//! ```text
//!  state at t − L ─▶ prediction by L at constant speed along the road ─▶ tracks at t
//! ```
//!
//! L is the latency of the sensor that sees the vehicle: ahead, around or behind. The sensors
//! predict in the same way.

use std::collections::VecDeque;

use closecall_sensors::{GroundTruth, Perception, Scene, SceneVehicle, SensorError, SensorHealth};
use closecall_traffic::{CONTROL_STEP, Source, Track, maths};

/// True tracks with the latencies of the sensors.
pub(super) struct DelayedTruth {
    /// The latencies ahead, around and behind, in control steps.
    latency_steps: [usize; 3],
    truth: GroundTruth,
    /// The other vehicles at the latest steps, the newest first.
    history: VecDeque<Vec<SceneVehicle>>,
    tracks: Vec<Track>,
}

impl DelayedTruth {
    /// Creates the perception of one run. `latency_steps` are the latencies of the sensors ahead,
    /// around and behind, in control steps.
    pub(super) fn new(latency_steps: [usize; 3]) -> Self {
        Self { latency_steps, truth: GroundTruth::new(), history: VecDeque::new(), tracks: Vec::new() }
    }
}

impl Perception for DelayedTruth {
    fn step(&mut self, scene: &Scene<'_>) -> Result<&[Track], SensorError> {
        let longest = self.latency_steps.into_iter().max().unwrap_or(0);
        self.history.push_front(scene.others.to_vec());
        self.history.truncate(longest + 1);
        self.tracks.clear();
        for (steps, source) in self.latency_steps.into_iter().zip([Source::Front, Source::Surround, Source::Rear]) {
            // Before the latency has elapsed, there is no track.
            let Some(then) = self.history.get(steps) else { continue };
            let others: Vec<SceneVehicle> = then.iter().map(|vehicle| predicted(vehicle, steps, scene)).collect();
            let now = Scene { others: &others, ..*scene };
            self.tracks.extend(self.truth.step(&now)?.iter().filter(|track| track.source == source).cloned());
        }
        Ok(&self.tracks)
    }

    fn health(&self) -> SensorHealth {
        self.truth.health()
    }
}

/// Returns a vehicle `steps` control steps later, at constant speed along the road.
fn predicted(vehicle: &SceneVehicle, steps: usize, scene: &Scene<'_>) -> SceneVehicle {
    let travelled_m = vehicle.state.speed_mps * steps as f64 * CONTROL_STEP.s();
    let (sin, cos) = maths::sin_cos(vehicle.state.heading_rad);
    let mut later = *vehicle;
    later.state.s_m = scene.road.advanced_m(vehicle.state.s_m, vehicle.state.d_m, travelled_m * cos);
    later.state.d_m += travelled_m * sin;
    later
}

#[cfg(test)]
mod tests {
    use closecall_traffic::{Environment, Road, Vehicle, VehicleClass, VehicleState};

    use super::*;

    fn vehicle(actor: usize, s_m: f64, speed_mps: f64) -> SceneVehicle {
        let state = VehicleState { s_m, d_m: -5.625, speed_mps, ..VehicleState::default() };
        SceneVehicle { actor, vehicle: Vehicle::typical(VehicleClass::Car), state, pitch_rad: 0.0 }
    }

    #[test]
    fn a_speed_change_is_seen_after_the_latency_and_constant_speed_at_once() {
        let road = Road::straight(3);
        let mut perception = DelayedTruth::new([2, 1, 3]);
        let mut positions_m = Vec::new();
        for step in 0..8_i64 {
            let time = CONTROL_STEP * step;
            // The rear vehicle drives at 30 m/s, and stands from step 4 on.
            let (s_m, speed_mps) = if step < 4 { (400.0 + 1.2 * step as f64, 30.0) } else { (404.8, 0.0) };
            let others = [vehicle(1, s_m, speed_mps)];
            let ego = vehicle(0, 500.0, 0.0);
            let scene = Scene { time, road: &road, environment: &Environment::CLEAR_DAY, ego, others: &others };
            let tracks = perception.step(&scene).unwrap();
            assert_eq!(tracks.len(), usize::from(step >= 3), "step {step}");
            positions_m.extend(tracks.iter().map(|track| (track.x_m() * 10.0).round() / 10.0));
        }
        // From step 3 on. The standstill is seen at step 7.
        assert_eq!(positions_m, [-96.4, -95.2, -94.0, -92.8, -95.2]);
    }
}
