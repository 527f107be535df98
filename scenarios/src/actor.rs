//! The vehicles of a concrete scenario.

use closecall_controllers::{CheckedDriver, LaneKeeping, SpeedKeeping};
use closecall_traffic::{ActorId, ConfigError, LateralPath, Problem, Vehicle, VehicleState};

use super::events::Event;
use super::fleet::FleetOf;

/// One vehicle of a concrete scenario.
#[derive(Clone, Debug)]
pub struct Actor {
    /// The name.
    pub id: ActorId,
    /// The class, size and mass.
    pub vehicle: Vehicle,
    /// The state at time zero.
    pub start: VehicleState,
    /// The driver: a human driver, or the ego stack.
    pub driver: CheckedDriver,
    /// The lateral path, or `None` if it keeps the centre of its lane.
    pub path: Option<LateralPath>,
    /// How its driver weaves in the lane, or `None` if the driver keeps the lane exactly.
    pub lane_keeping: Option<LaneKeeping>,
    /// How the desired speed of its driver varies, or `None` if it is constant.
    pub speed_keeping: Option<SpeedKeeping>,
    /// The vehicle's events.
    pub events: Vec<Event>,
    /// The fleet that its look is drawn from in each run; see [`Scenario::vehicle`].
    pub(crate) fleet: Option<FleetOf>,
}

/// Returns the index of the actor `id` among all of them. `key` is the key of the scenario file
/// that names it.
pub(super) fn find_actor(ids: &[&ActorId], id: &ActorId, key: &str) -> Result<usize, ConfigError> {
    ids.iter().position(|actor| *actor == id).ok_or_else(|| {
        let names = ids.iter().map(|id| format!("`{id}`")).collect::<Vec<_>>().join(", ");
        ConfigError::new(key, Problem::UnknownActor { value: id.to_string(), allowed: names })
    })
}
