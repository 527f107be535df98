//! What a run shows to those who watch it: recorders, traces, tests.

use closecall_controllers::DriverNote;
use closecall_controllers::{EgoCommand, EgoState, Reason};
use closecall_sensors::{Perception, SceneVehicle};
use closecall_traffic::{Absent, Measured, Time, Track, VehicleState};

use crate::outcome::{Collision, Phase};
use crate::scenario::Scenario;

/// The vehicle ahead of another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lead {
    /// Its place in the list of actors.
    pub actor: usize,
    /// Its speed [m/s].
    pub speed_mps: f64,
}

/// E's margins at one instant, as they truly are.
#[derive(Clone, Copy, Debug)]
pub struct MarginsNow {
    /// The vehicle ahead, where its centre is in E's lane.
    pub lead: Result<Lead, Absent>,
    /// The vehicle behind, by its place in the list of actors.
    pub follower: Option<usize>,
    /// Gap to the vehicle ahead in E's lane or path [m].
    pub gap_front_m: Measured,
    /// Time headway to it [s].
    pub thw_front_s: Measured,
    /// Gap of the vehicle behind [m].
    pub gap_rear_m: Measured,
    /// Time headway of the vehicle behind to E [s].
    pub thw_rear_s: Measured,
    /// Time to collision of the vehicle behind with E [s].
    pub ttc_rear_s: Measured,
}

/// Everything there is to see at one control step (25 Hz).
pub struct StepView<'a> {
    /// The instant.
    pub time: Time,
    /// What is being run.
    pub scenario: &'a Scenario,
    /// Every vehicle in the order of the scenario's actors, E among them.
    pub vehicles: &'a [SceneVehicle],
    /// Gap to the vehicle ahead of each actor, and its time headway [m, s].
    pub fronts: &'a [(Measured, Measured)],
    /// What E perceives.
    pub tracks: &'a [Track],
    /// The sensors, for what they show beside tracks.
    pub perception: &'a dyn Perception,
    /// What E's controller answered.
    pub command: &'a EgoCommand,
    /// E's margins.
    pub margins: &'a MarginsNow,
    /// The part of the encounter.
    pub phase: Phase,
}

/// Something that happened at an instant.
#[derive(Clone, Debug, PartialEq)]
pub enum Happening {
    /// An event of the scenario set in.
    EventTriggered {
        /// The event's name.
        event: String,
    },
    /// A driver came to a moment of its plan.
    DriverNote {
        /// The driver, by its place in the list of actors.
        actor: usize,
        /// The moment.
        note: DriverNote,
    },
    /// The ego stack changed its state.
    EgoStateChanged {
        /// The state before.
        from: EgoState,
        /// The state now.
        to: EgoState,
        /// Why.
        reason: Reason,
    },
    /// The encounter entered another phase.
    PhaseChanged {
        /// The phase now.
        to: Phase,
    },
    /// Two vehicles touched. Its change of velocity is not known yet.
    Collision(Collision),
}

/// Someone who watches a run.
pub trait Observer {
    /// One control step.
    fn step(&mut self, view: &StepView<'_>);
    /// Something happened at `time`.
    fn happening(&mut self, time: Time, what: &Happening);
    /// One step of the physics (100 Hz): how every vehicle moves at `time`, in the order of the scenario's actors.
    fn moved(&mut self, _time: Time, _vehicles: &mut dyn Iterator<Item = VehicleState>) {}
}

/// Nobody watches.
pub struct NoObserver;

impl Observer for NoObserver {
    fn step(&mut self, _: &StepView<'_>) {}
    fn happening(&mut self, _: Time, _: &Happening) {}
}
