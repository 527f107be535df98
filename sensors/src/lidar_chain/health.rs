//! The health of several LiDARs together.

use crate::tracking::RearView;

use super::ChainSensor;
use crate::Health;

/// Places behind the ego that the rear sensors must see for the margin increase system (m): in its
/// lane and in both neighbouring lanes, near and far. Far is where a vehicle that closes in at 50
/// km/h is some 4 s away.
const REQUIRED_M: [[f64; 2]; 6] = [[5.0, 0.0], [5.0, 3.75], [5.0, -3.75], [60.0, 0.0], [60.0, 3.75], [60.0, -3.75]];

/// Returns the health of all sensors together: failed if the working sensors no longer see all of
/// the required places that all sensors see, and degraded if any sensor is not healthy.
pub(super) fn of_all(sensors: &[ChainSensor]) -> Health {
    if let [only] = sensors {
        return only.health;
    }
    let sees = |sensor: &ChainSensor, [back_m, left_m]: [f64; 2]| {
        let view: RearView = sensor.view(0.0);
        view.contains(-back_m, left_m)
    };
    let is_lost = |place: &[f64; 2]| {
        let mut seeing = sensors.iter().filter(|sensor| sees(sensor, *place)).peekable();
        seeing.peek().is_some() && seeing.all(|sensor| sensor.health == Health::Failed)
    };
    if sensors.iter().all(|sensor| sensor.health == Health::Failed) || REQUIRED_M.iter().any(is_lost) {
        Health::Failed
    } else if sensors.iter().any(|sensor| sensor.health != Health::Ok) {
        Health::Degraded
    } else {
        Health::Ok
    }
}
