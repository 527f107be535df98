//! The start of the ego.
//!
//! A sample is the same in every arm: all other vehicles start at the same places with the same
//! speeds, their drivers draw the same random numbers, and events on the clock happen at the same
//! times. The ego starts at the speed of the scenario, in balance: at the position of a vehicle
//! that has always kept the gap of its own controller. If a controller keeps a longer gap than the
//! scenario's cruise control, its ego is further back by the difference, and the rear vehicle
//! closer to it by the same difference.
//!
//! ```text
//!  arm `acc`       R ─────────── gap ───────────▶ E ── 0.7 s ──▶ F
//!  arm `gap-1.6`   R ───── shorter ─────▶ E ─────── 1.6 s ──────▶ F
//! ```
//!
//! From the place of the scenario, the ego would brake for seconds to fall back, and the comparison
//! would be one of this manoeuvre.

use closecall_controllers::EgoSettings;
use closecall_traffic::VehicleState;

use super::{Arm, SampleError};
use crate::world::World;
use closecall_scenarios::Scenario;

/// Smallest gap to the vehicles ahead of and behind the ego at its start (m): numerical, no two
/// vehicles may overlap.
const MIN_GAP_M: f64 = 1.0;

/// Returns the state in which the ego of an arm starts. `world` holds all vehicles as the scenario
/// places them.
///
/// # Errors
/// [`SampleError::Start`] if another vehicle is in the way.
pub(super) fn start_of_ego(
    scenario: &Scenario,
    settings: &EgoSettings,
    arm: &Arm,
    world: &World,
) -> Result<VehicleState, SampleError> {
    let start = *world.state(scenario.ego);
    let gap_m = arm.controller.settings(settings).desired_gap_m(start.speed_mps);
    let back_m = gap_m - settings.desired_gap_m(start.speed_mps);
    let neighbours = world.neighbours(scenario.ego).own;
    let Some(lead) = neighbours.lead.filter(|_| back_m != 0.0) else { return Ok(start) };
    let in_the_way = |neighbour: closecall_controllers::Neighbour, room_m: f64| SampleError::Start {
        controller: arm.controller.name().to_owned(),
        moved_m: back_m.abs(),
        actor: scenario.actors[neighbour.actor].id.clone(),
        room_m,
    };
    if lead.gap_m + back_m < MIN_GAP_M {
        return Err(in_the_way(lead, lead.gap_m));
    }
    if let Some(follower) = neighbours.follower.filter(|follower| follower.gap_m - back_m < MIN_GAP_M) {
        return Err(in_the_way(follower, follower.gap_m));
    }
    Ok(VehicleState { s_m: start.s_m - back_m, ..start })
}
