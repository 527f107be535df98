//! What a run looked like: kept in memory until its outcome is known, since only then is it known what mattered.

use closecall_controllers::EgoCommand;
use closecall_sensors::FieldOfView;
use closecall_traffic::{Time, Track, VehicleState};

use crate::outcome::{Outcome, Phase};
use crate::scenario::Scenario;
use crate::simulation::{Happening, MarginsNow, StepView};

/// One control step.
#[derive(Clone, Debug)]
pub(super) struct Frame {
    pub(super) time: Time,
    /// In the order of the scenario's actors.
    pub(super) states: Vec<VehicleState>,
    pub(super) tracks: Vec<Track>,
    pub(super) command: EgoCommand,
    pub(super) margins: MarginsNow,
    pub(super) phase: Phase,
    pub(super) rear_field: Option<FieldOfView>,
}

impl Frame {
    pub(super) fn new(view: &StepView<'_>) -> Self {
        Self {
            time: view.time,
            states: view.vehicles.iter().map(|vehicle| vehicle.state).collect(),
            tracks: view.tracks.to_vec(),
            command: *view.command,
            margins: *view.margins,
            phase: view.phase,
            rear_field: view.perception.rear_field(),
        }
    }
}

/// A whole run, from the first frame to the outcome.
pub(super) struct Film<'a> {
    pub(super) scenario: &'a Scenario,
    pub(super) title: &'a str,
    pub(super) frames: &'a [Frame],
    pub(super) happenings: &'a [(Time, Happening)],
    pub(super) outcome: &'a Outcome,
}

impl Film<'_> {
    /// The moment to look at first: when E collided, else anyone; where nobody did, when the vehicle behind was at its
    /// smallest time headway; where there was none, the end, with the whole run before it.
    pub(super) fn critical_moment(&self) -> Time {
        let ego = self.scenario.ego_id();
        let collisions = &self.outcome.collisions;
        let collision = collisions.iter().find(|collision| collision.involves(ego)).or(collisions.first());
        if let Some(collision) = collision {
            return collision.time;
        }
        let headways = self.frames.iter().filter_map(|frame| Some((frame.time, frame.margins.thw_rear_s.ok()?)));
        let closest = headways.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(time, _)| time);
        closest.or_else(|| self.frames.last().map(|frame| frame.time)).unwrap_or(Time::ZERO)
    }

    /// The times of all frames.
    pub(super) fn times(&self) -> Vec<Time> {
        self.frames.iter().map(|frame| frame.time).collect()
    }

    /// The places of all vehicles along the road, from the last to the first [m].
    pub(super) fn reach_m(&self) -> (f64, f64) {
        let places = self.frames.iter().flat_map(|frame| frame.states.iter().map(|state| state.s_m));
        places.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), s_m| (low.min(s_m), high.max(s_m)))
    }
}
