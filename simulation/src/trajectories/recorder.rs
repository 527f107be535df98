//! Simulated traffic as trajectory data, in the layout in which recorded traffic is read.
//!
//! A vehicle that collides is a wreck from then on: its speed changes within one physics step, by a
//! thousand m/s² and more, and it may slide backwards. No recorded traffic has such rows, and a
//! reader refuses them. [`TrafficRecorder::finish_at_collisions`] ends its trajectory before.

use closecall_recorded::trajectory_data::TrajectoryData;
use closecall_traffic::{ActorId, Lane, Time, Trajectory, TrajectoryPoint, maths};

use crate::{CONTROL_STEP, Observer, RunEvent, StepView};
use closecall_scenarios::Scenario;

/// Time between two runs, so that vehicles of different runs never meet.
const PAUSE: Time = Time::from_ms(10_000);

/// Collects the trajectories of several runs into one trajectory data set, one run after the other.
#[derive(Debug, Default)]
pub struct TrafficRecorder {
    trajectories: Vec<Trajectory>,
    /// For each trajectory the number of points before the first collision of its vehicle; `None`
    /// without a collision.
    points_before_collision: Vec<Option<usize>>,
    /// The actors of the current run.
    actors: Vec<ActorId>,
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
        self.actors = scenario.actors.iter().map(|actor| actor.id.clone()).collect();
        for actor in &scenario.actors {
            let id = self.trajectories.len() as u64 + 1;
            self.trajectories.push(Trajectory {
                track_id: id,
                vehicle_id: id,
                class: actor.vehicle.class,
                dimensions: actor.vehicle.dimensions,
                points: Vec::new(),
            });
            self.points_before_collision.push(None);
        }
    }

    /// Returns the trajectories of all runs as one data set of this name.
    pub fn finish(self, name: &str) -> TrajectoryData {
        TrajectoryData::new(name, CONTROL_STEP, self.trajectories)
    }

    /// Returns the same data set, in which the trajectory of a vehicle that collides ends before
    /// its first collision.
    pub fn finish_at_collisions(mut self, name: &str) -> EndedAtCollisions {
        let mut collided = 0;
        for (trajectory, before) in self.trajectories.iter_mut().zip(&self.points_before_collision) {
            if let Some(points) = *before {
                trajectory.points.truncate(points);
                collided += 1;
            }
        }
        EndedAtCollisions { data: self.finish(name), collided }
    }
}

/// A data set in which the trajectory of a vehicle that collides ends before its first collision.
#[derive(Clone, Debug)]
pub struct EndedAtCollisions {
    /// The trajectories.
    pub data: TrajectoryData,
    /// Number of the vehicles that collide.
    pub collided: usize,
}

impl Observer for TrafficRecorder {
    fn step(&mut self, view: &StepView<'_>) {
        let time = self.start + view.time;
        self.end = time;
        for (vehicle, trajectory) in view.vehicles.iter().zip(&mut self.trajectories[self.first_index..]) {
            let state = &vehicle.state;
            let (sin, cos) = maths::sin_cos(state.heading_rad);
            let Lane(lane) = view.scenario.road.lane_of(state);
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

    fn event(&mut self, _: Time, event: &RunEvent) {
        let RunEvent::Collision(collision) = event else { return };
        let has_collided = |actor: &&ActorId| collision.between.contains(actor);
        for (index, _) in self.actors.iter().enumerate().filter(|(_, actor)| has_collided(actor)) {
            let index = self.first_index + index;
            self.points_before_collision[index].get_or_insert(self.trajectories[index].points.len());
        }
    }
}
