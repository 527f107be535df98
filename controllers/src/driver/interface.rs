//! The boundary between human drivers and the loop.
//!
//! A driver is given the truth about the vehicles around; perceiving it late and imperfectly is the driver's own part.

use closecall_traffic::{Indicator, Lane, Road, Stream, Time, Vehicle, VehicleClass, VehicleState};

/// Another vehicle near a driver.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Neighbour {
    /// Its place in the scenario's list of actors.
    pub actor: usize,
    /// Gap bumper to bumper [m]: ahead of or behind the driver; negative where the two overlap lengthwise.
    pub gap_m: f64,
    /// Its speed along the road [m/s].
    pub speed_mps: f64,
    /// Its acceleration [m/s²].
    pub acceleration_mps2: f64,
    /// True while its brake light is on.
    pub brake_light: bool,
    /// Its direction indicator.
    pub indicator: Indicator,
    /// Its kind.
    pub class: VehicleClass,
    /// Its length [m].
    pub length_m: f64,
    /// Its width [m].
    pub width_m: f64,
    /// Its lateral position minus the driver's, positive to the left [m].
    pub lateral_offset_m: f64,
}

/// The vehicles nearest to a driver within one lane. A vehicle is in every lane that its box overlaps.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LaneNeighbours {
    /// The nearest wholly ahead.
    pub lead: Option<Neighbour>,
    /// The nearest wholly behind.
    pub follower: Option<Neighbour>,
    /// One that overlaps the driver lengthwise.
    pub alongside: Option<Neighbour>,
}

/// The vehicles around a driver.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Neighbours {
    /// In the lane that the driver's centre is in.
    pub own: LaneNeighbours,
    /// In the lane to the left, where there is one.
    pub left: Option<LaneNeighbours>,
    /// In the lane to the right, where there is one.
    pub right: Option<LaneNeighbours>,
    /// The nearest ahead, in any lane, whose box overlaps the driver's own width: what would be hit by driving on.
    pub in_path: Option<Neighbour>,
}

/// What a human driver is given at each physics step.
#[derive(Clone, Copy, Debug)]
pub struct DriverInput<'a> {
    /// The time of this step.
    pub time: Time,
    /// The driver's own vehicle.
    pub vehicle: &'a Vehicle,
    /// Its state.
    pub own: &'a VehicleState,
    /// The vehicles around, as they truly are now.
    pub neighbours: &'a Neighbours,
    /// The road.
    pub road: &'a Road,
    /// The lane change under way, if any: its target.
    pub changing_to: Option<Lane>,
    /// How far weaving has carried the vehicle beside the path that the driver means to take, positive to the left [m].
    pub lateral_deviation_m: f64,
    /// By how much the speed that the driver wants now differs from the one that it wants in the long run [m/s].
    pub desired_speed_offset_mps: f64,
}

impl DriverInput<'_> {
    /// The speed wanted now by a driver who wants `usual_mps` in the long run: never less than half of that [m/s].
    pub(crate) fn desired_now_mps(&self, usual_mps: f64) -> f64 {
        (usual_mps + self.desired_speed_offset_mps).max(0.5 * usual_mps)
    }
}

/// A lane change to begin now. The plant follows a smooth path to the target lane's centre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LaneChange {
    /// The lane to change to.
    pub target: Lane,
    /// Time that the whole path takes at the present speed [s].
    pub duration_s: f64,
}

/// What a human driver does.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DriverAction {
    /// Acceleration asked of the vehicle [m/s²]; must be finite.
    pub acceleration_mps2: f64,
    /// A lane change to begin, or to be directed elsewhere (an abort is a change back).
    pub lane_change: Option<LaneChange>,
    /// The direction indicator.
    pub indicator: Indicator,
    /// Something that an event of the scenario or the log may want to know.
    pub note: Option<DriverNote>,
}

/// A moment in a driver's plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DriverNote {
    /// The driver decided to overtake and begins to change lanes.
    CutOutStarted,
    /// The driver gave up the lane change and steers back.
    CutOutAborted,
    /// The driver has passed the vehicle it overtook.
    Passed,
    /// The driver brakes as hard as possible.
    EmergencyBraking,
}

/// A driver that failed. Its state is undefined afterwards; the run ends as an error.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DriverError {
    /// A number that has to be finite was not.
    #[error("failed to drive: {what} is not finite at {time}")]
    NotFinite {
        /// The quantity.
        what: &'static str,
        /// When.
        time: Time,
    },
}

/// A human driver: called once for each physics step (100 Hz), in order of time.
pub trait Driver: Send {
    /// The action for the time until the next physics step.
    ///
    /// # Errors
    /// [`DriverError`] where no action could be worked out.
    fn step(&mut self, input: &DriverInput<'_>, rng: &mut Stream) -> Result<DriverAction, DriverError>;
}
