//! The trace of a run: one row per control step and actor.

use closecall_traffic::{ActorId, Lane, Measured, Time};

use crate::{Observer, RunEvent, StepView};

/// One row of a trace: an actor at a control step.
#[derive(Clone, Debug)]
pub struct TraceRow {
    /// Time of the control step.
    pub time: Time,
    /// The actor.
    pub actor: ActorId,
    /// The lane of the actor.
    pub lane: Lane,
    /// Position along the road (m).
    pub s_m: f64,
    /// Position across the road (m), positive to the left.
    pub d_m: f64,
    /// Speed (m/s).
    pub speed_mps: f64,
    /// Longitudinal acceleration (m/s²).
    pub acceleration_mps2: f64,
    /// Gap to the vehicle ahead (m).
    pub gap_front_m: Measured,
    /// Time headway to the vehicle ahead (s).
    pub thw_front_s: Measured,
}

/// Observes a run and collects its trace.
#[derive(Clone, Debug, Default)]
pub struct TraceRecorder {
    /// The rows so far, in the order of time and of the scenario's actors.
    pub rows: Vec<TraceRow>,
}

impl Observer for TraceRecorder {
    fn step(&mut self, view: &StepView<'_>) {
        let actors = view.scenario.actors.iter().zip(view.vehicles).zip(view.fronts);
        self.rows.extend(actors.map(|((actor, vehicle), &(gap_front_m, thw_front_s))| TraceRow {
            time: view.time,
            actor: actor.id.clone(),
            lane: view.scenario.road.lane_of(&vehicle.state),
            s_m: vehicle.state.s_m,
            d_m: vehicle.state.d_m,
            speed_mps: vehicle.state.speed_mps,
            acceleration_mps2: vehicle.state.acceleration_mps2,
            gap_front_m,
            thw_front_s,
        }));
    }

    fn event(&mut self, _: Time, _: &RunEvent) {}
}
