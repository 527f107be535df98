//! The parts of the ego controller's input that are not tracks.

use closecall_controllers::{Odometry, SensorAvailability};
use closecall_sensors::{Health, Perception};

use crate::world::World;
use closecall_scenarios::Scenario;

/// Returns the ego's own motion, its position in its lane, and its size, as its odometry and its
/// map give them.
pub(super) fn odometry(scenario: &Scenario, world: &World) -> Odometry {
    let state = world.state(scenario.ego);
    let errors = scenario.sensors.odometry_errors().at(world.time());
    let d_m = errors.own_d_m(&scenario.road, state.s_m, state.d_m);
    let map = errors.map_of(&scenario.road);
    let lane = map.lane_at(state.s_m, d_m);
    let size = world.vehicle(scenario.ego).dimensions;
    Odometry {
        speed_mps: state.speed_mps * (1.0 + errors.speed_scale),
        acceleration_mps2: state.acceleration_mps2,
        yaw_rate_radps: state.yaw_rate_radps,
        lane,
        lane_offset_m: d_m - map.lane_centre_m(lane, state.s_m),
        length_m: size.length_m,
        width_m: size.width_m,
    }
}

/// Returns which of the ego's sensors have not failed.
pub(super) fn sensor_availability(perception: &dyn Perception) -> SensorAvailability {
    let health = perception.health();
    SensorAvailability {
        front: health.front != Health::Failed,
        surround: health.surround != Health::Failed,
        rear: health.rear != Health::Failed,
    }
}
