//! Collects the data for the messages of a run.

use closecall_scenarios::Scenario;
use closecall_simulation::{Observer, RunEvent, StepView};
use closecall_traffic::{Time, Track, VehicleState};

/// One control step.
#[derive(Clone, Debug)]
pub(super) struct Step {
    pub(super) time: Time,
    /// The states of all vehicles, in the order of the scenario's actors.
    pub(super) states: Vec<VehicleState>,
    /// Pitch of each vehicle (rad), positive nose down.
    pub(super) pitches_rad: Vec<f64>,
    pub(super) tracks: Vec<Track>,
}

/// Observes a run, and writes its messages afterwards.
#[derive(Clone, Debug)]
pub struct OsiRecorder {
    pub(super) scenario: Scenario,
    /// Whether each message has the lanes, instead of the first one alone.
    pub(super) has_lanes_in_each: bool,
    pub(super) steps: Vec<Step>,
}

impl OsiRecorder {
    /// Creates a recorder for a run of `scenario`.
    pub fn new(scenario: &Scenario, has_lanes_in_each: bool) -> Self {
        Self { scenario: scenario.clone(), has_lanes_in_each, steps: Vec::new() }
    }
}

impl Observer for OsiRecorder {
    fn step(&mut self, view: &StepView<'_>) {
        self.steps.push(Step {
            time: view.time,
            states: view.vehicles.iter().map(|vehicle| vehicle.state).collect(),
            pitches_rad: view.vehicles.iter().map(|vehicle| vehicle.pitch_rad).collect(),
            tracks: view.tracks.to_vec(),
        });
    }

    fn event(&mut self, _: Time, _: &RunEvent) {}
}
