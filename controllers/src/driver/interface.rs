//! The interface between human drivers and the simulation loop.
//!
//! The loop gives a driver the true state of the surrounding vehicles. The driver itself models how
//! a human perceives that state: with a delay and imprecisely.

use closecall_traffic::{Indicator, Lane, Road, Stream, Time, Vehicle, VehicleClass, VehicleState};

/// Another vehicle near a driver.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Neighbour {
    /// Index in the scenario's list of actors.
    pub actor: usize,
    /// Bumper-to-bumper gap to the driver's vehicle, ahead or behind (m). Negative if the two
    /// overlap longitudinally.
    pub gap_m: f64,
    /// Speed along the road (m/s).
    pub speed_mps: f64,
    /// Acceleration (m/s²).
    pub acceleration_mps2: f64,
    /// True while the brake light is on.
    pub brake_light: bool,
    /// Direction indicator.
    pub indicator: Indicator,
    /// Vehicle class.
    pub class: VehicleClass,
    /// Length (m).
    pub length_m: f64,
    /// Width (m).
    pub width_m: f64,
    /// Lateral position relative to the driver's vehicle, positive to the left (m).
    pub lateral_offset_m: f64,
}

/// The vehicles nearest to a driver in one lane. A vehicle counts as being in each lane that its
/// box overlaps.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LaneNeighbours {
    /// The nearest vehicle that is entirely ahead.
    pub lead: Option<Neighbour>,
    /// The nearest vehicle that is entirely behind.
    pub follower: Option<Neighbour>,
    /// A vehicle that overlaps the driver's vehicle longitudinally.
    pub alongside: Option<Neighbour>,
}

/// The vehicles that surround a driver.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Neighbours {
    /// In the lane that contains the centre of the driver's vehicle.
    pub own: LaneNeighbours,
    /// In the lane to the left; `None` if there is no such lane, or if the driver does not look
    /// there.
    pub left: Option<LaneNeighbours>,
    /// In the lane to the right; `None` if there is no such lane, or if the driver does not look
    /// there.
    pub right: Option<LaneNeighbours>,
    /// The nearest vehicle ahead in any lane whose box overlaps the driver's vehicle laterally:
    /// driving straight on would hit it.
    pub in_path: Option<Neighbour>,
    /// The second leader: the nearest vehicle in the path beyond the vehicle ahead. The vehicle
    /// ahead is the nearer of the lead vehicle in the own lane and the vehicle in the path. The
    /// driver may see it through the windows between. `None` if there is none, or if the driver
    /// does not look that far.
    pub beyond: Option<Neighbour>,
}

/// The neighbours that a driver takes into account, beside the neighbours in its own lane and in
/// its path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Looks {
    /// Those in the lanes to the left and to the right.
    pub adjacent: bool,
    /// The vehicle beyond the vehicle ahead.
    pub beyond: bool,
}

impl Looks {
    /// All neighbours.
    pub const AROUND: Self = Self { adjacent: true, beyond: true };
    /// Those in the own lane and in the path alone.
    pub const AHEAD: Self = Self { adjacent: false, beyond: false };
}

/// The input of a human driver at one physics step.
#[derive(Clone, Copy, Debug)]
pub struct DriverInput<'a> {
    /// Time of this step.
    pub time: Time,
    /// The driver's own vehicle.
    pub vehicle: &'a Vehicle,
    /// State of that vehicle.
    pub own: &'a VehicleState,
    /// The surrounding vehicles in their true present state.
    pub neighbours: &'a Neighbours,
    /// The road.
    pub road: &'a Road,
    /// Target lane of the lane change in progress; `None` if there is none.
    pub lane_change_target: Option<Lane>,
    /// Lateral deviation from the intended path due to weaving, positive to the left (m).
    pub lateral_deviation_m: f64,
    /// Present desired speed minus the long-term desired speed (m/s).
    pub desired_speed_offset_mps: f64,
}

impl DriverInput<'_> {
    /// Returns the present desired speed of a driver with the long-term desired speed
    /// `long_term_mps` (m/s). It is at least half of the long-term one.
    pub(crate) fn desired_now_mps(&self, long_term_mps: f64) -> f64 {
        (long_term_mps + self.desired_speed_offset_mps).max(0.5 * long_term_mps)
    }
}

/// A command to begin a lane change now. The plant follows a smooth path to the centre of the
/// target lane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LaneChange {
    /// Target lane.
    pub target: Lane,
    /// Duration of the whole lane change at the present speed (s).
    pub duration_s: f64,
}

/// The output of a human driver at one physics step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DriverAction {
    /// Commanded acceleration (m/s²); must be finite.
    pub acceleration_mps2: f64,
    /// A lane change to begin, or a new target for the lane change in progress (an abort is a lane
    /// change back).
    pub lane_change: Option<LaneChange>,
    /// Direction indicator to show.
    pub indicator: Indicator,
    /// A milestone in the driver's manoeuvre, for scenario events and the log.
    pub note: Option<DriverNote>,
}

/// A milestone in a driver's manoeuvre.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DriverNote {
    /// The driver begins a lane change, for example in order to overtake.
    CutOutStarted,
    /// The driver aborts the lane change and steers back.
    CutOutAborted,
    /// The driver has passed the overtaken vehicle.
    Passed,
    /// The driver begins to brake in an emergency.
    EmergencyBraking,
}

/// Error of a driver. The driver's state is undefined afterwards; the run ends as an error.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DriverError {
    /// A quantity is infinite or NaN.
    #[error("failed to drive: {quantity} is not finite at {time}")]
    NotFinite {
        /// Name of the quantity.
        quantity: &'static str,
        /// Time of the step that failed.
        time: Time,
    },
}

/// A human driver. The loop calls it once per physics step (100 Hz), in order of time.
pub trait Driver: Send {
    /// Returns the action that holds until the next physics step.
    ///
    /// # Errors
    /// Returns a [`DriverError`] if the input or the computed action is not finite.
    fn step(&mut self, input: &DriverInput<'_>, rng: &mut Stream) -> Result<DriverAction, DriverError>;

    /// Returns which neighbours the driver takes into account. The input may lack the others.
    fn looks(&self) -> Looks {
        Looks::AROUND
    }
}
