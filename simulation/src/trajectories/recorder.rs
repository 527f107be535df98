//! Simulated traffic as trajectory data, in the layout in which recorded traffic is read.

use closecall_recorded::trajectory_data::TrajectoryData;
use closecall_traffic::{Lane, Time, Trajectory, TrajectoryPoint, maths};

use crate::{CONTROL_STEP, Observer, RunEvent, StepView};
use closecall_scenarios::Scenario;

/// Time between two runs, so that vehicles of different runs never meet.
const PAUSE: Time = Time::from_ms(10_000);

/// Collects the trajectories of several runs into one trajectory data set, one run after the other.
#[derive(Debug, Default)]
pub struct TrafficRecorder {
    trajectories: Vec<Trajectory>,
    /// Index of the first trajectory of the current run.
    first_index: usize,
    /// Start of the current run on the clock of the data set.
    start: Time,
    /// Latest instant recorded so far.
    end: Time,
}

impl TrafficRecorder {
    /// Begins the next run, a run of `scenario`.
    pub fn begin(&mut self, scenario: &Scenario) {
        self.first_index = self.trajectories.len();
        self.start = if self.first_index == 0 { Time::ZERO } else { self.end + PAUSE };
        for actor in &scenario.actors {
            let id = self.trajectories.len() as u64 + 1;
            self.trajectories.push(Trajectory {
                track_id: id,
                vehicle_id: id,
                class: actor.vehicle.class,
                dimensions: actor.vehicle.dimensions,
                points: Vec::new(),
            });
        }
    }

    /// Returns the trajectories of all runs as one data set of this name.
    pub fn finish(self, name: &str) -> TrajectoryData {
        TrajectoryData::new(name, CONTROL_STEP, self.trajectories)
    }
}

impl Observer for TrafficRecorder {
    fn step(&mut self, view: &StepView<'_>) {
        let time = self.start + view.time;
        self.end = time;
        for (vehicle, trajectory) in view.vehicles.iter().zip(&mut self.trajectories[self.first_index..]) {
            let state = &vehicle.state;
            let (sin, cos) = maths::sin_cos(state.heading_rad);
            let Lane(lane) = view.scenario.road.lane_at(state.d_m);
            trajectory.points.push(TrajectoryPoint {
                time,
                s_m: state.s_m,
                d_m: state.d_m,
                speed_mps: state.speed_mps * cos,
                acceleration_mps2: state.acceleration_mps2 * cos,
                lateral_speed_mps: state.speed_mps * sin,
                lateral_acceleration_mps2: state.speed_mps * state.yaw_rate_radps,
                lane: Lane(lane),
            });
        }
    }

    fn event(&mut self, _: Time, _: &RunEvent) {}
}
