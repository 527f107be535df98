//! The interface through which recorders, traces and tests observe a run.

use closecall_controllers::DriverNote;
use closecall_controllers::{EgoCommand, EgoState, Reason};
use closecall_sensors::{Perception, SceneVehicle};
use closecall_traffic::{Absent, Measured, Time, Track, VehicleState};

use closecall_scenarios::Scenario;
use closecall_scenarios::outcome::{Collision, Phase};

/// The lead vehicle of a vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lead {
    /// Index of the lead vehicle in the list of actors.
    pub actor: usize,
    /// Speed of the lead vehicle (m/s).
    pub speed_mps: f64,
}

/// The true margins of a vehicle at one instant.
#[derive(Clone, Copy, Debug)]
pub struct CurrentMargins {
    /// The lead vehicle, if its centre is in the lane.
    pub lead: Result<Lead, Absent>,
    /// Index of the vehicle behind in the list of actors, if there is one in the lane.
    pub follower: Option<usize>,
    /// Gap to the vehicle ahead, in the lane or in the path (m).
    pub gap_front_m: Measured,
    /// Time headway to the vehicle ahead (s).
    pub thw_front_s: Measured,
    /// Gap to the vehicle behind (m).
    pub gap_rear_m: Measured,
    /// Time headway of the vehicle behind (s).
    pub thw_rear_s: Measured,
    /// Time to collision of the vehicle behind (s).
    pub ttc_rear_s: Measured,
    /// Time to collision with the vehicle ahead, in the lane or in the path (s).
    pub ttc_front_s: Measured,
}

/// The state of a run at one control step (25 Hz).
pub struct StepView<'a> {
    /// Time of the step.
    pub time: Time,
    /// The scenario of the run.
    pub scenario: &'a Scenario,
    /// All vehicles including the ego, in the order of the scenario's actors.
    pub vehicles: &'a [SceneVehicle],
    /// Front gap (m) and front time headway (s) of each actor.
    pub fronts: &'a [(Measured, Measured)],
    /// The tracks that the ego perceives.
    pub tracks: &'a [Track],
    /// The ego's sensors, for their output other than tracks.
    pub perception: &'a dyn Perception,
    /// The command of the ego controller.
    pub command: &'a EgoCommand,
    /// The ego's true margins.
    pub margins: &'a CurrentMargins,
    /// The phase of the encounter.
    pub phase: Phase,
}

/// The sensors at one control step before the start of a run, in which they settle.
pub struct SettlingView<'a> {
    /// Time of the step, which is negative.
    pub time: Time,
    /// The scenario of the run.
    pub scenario: &'a Scenario,
    /// The ego.
    pub ego: SceneVehicle,
    /// The ego's sensors.
    pub perception: &'a dyn Perception,
}

/// Something that happens at one instant of a run.
#[derive(Clone, Debug, PartialEq)]
pub enum RunEvent {
    /// An event of the scenario was triggered.
    EventTriggered {
        /// The event's name.
        event: String,
    },
    /// A human driver reports an action.
    DriverNote {
        /// Index of the driver's vehicle in the list of actors.
        actor: usize,
        /// The driver's action.
        note: DriverNote,
    },
    /// The ego stack changed its state.
    EgoStateChanged {
        /// The state before.
        from: EgoState,
        /// The state now.
        to: EgoState,
        /// The reason for the change.
        reason: Reason,
    },
    /// The encounter entered another phase.
    PhaseChanged {
        /// The phase now.
        to: Phase,
    },
    /// Two vehicles touched for the first time. The changes of velocity follow later.
    Collision(Collision),
    /// The bumpers of two vehicles met for the first time, too slowly for a collision.
    Touch(Collision),
}

/// Observes a run.
pub trait Observer {
    /// Returns whether [`Observer::step`] is to be called. The view of a step takes time to
    /// compute.
    fn wants_steps(&self) -> bool {
        true
    }
    /// Called at each control step (25 Hz).
    fn step(&mut self, view: &StepView<'_>);
    /// Called at each control step of the second before the start, in which the sensors settle.
    fn settling(&mut self, _view: &SettlingView<'_>) {}
    /// Called when something happens, with its time.
    fn event(&mut self, time: Time, event: &RunEvent);
    /// Called at each physics step (100 Hz) with the states of all vehicles, in the order of the
    /// scenario's actors.
    fn moved(&mut self, _time: Time, _vehicles: &mut dyn Iterator<Item = VehicleState>) {}
}

/// An observer that ignores everything.
pub struct NoObserver;

impl Observer for NoObserver {
    fn wants_steps(&self) -> bool {
        false
    }
    fn step(&mut self, _: &StepView<'_>) {}
    fn event(&mut self, _: Time, _: &RunEvent) {}
}
