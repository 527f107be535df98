//! The health of several sensors of one kind together.

use crate::Health;
use crate::tracking::RearView;

/// Places behind the ego that the rear sensors must see for the margin increase system (m): in its
/// lane and in both neighbouring lanes, near and far. Far is where a vehicle that closes in at 50
/// km/h is some 4 s away.
const REQUIRED_M: [[f64; 2]; 6] = [[5.0, 0.0], [5.0, 3.75], [5.0, -3.75], [60.0, 0.0], [60.0, 3.75], [60.0, -3.75]];

/// Returns the health of all sensors together: failed if the working sensors no longer see all of
/// the required places that all sensors see, and degraded if any sensor is not healthy. `view`
/// returns the view of a sensor from the rear end.
pub(crate) fn combined<S>(sensors: &[S], health: impl Fn(&S) -> Health, view: impl Fn(&S) -> RearView) -> Health {
    if let [only] = sensors {
        return health(only);
    }
    let is_lost = |[back_m, left_m]: &[f64; 2]| {
        let mut seeing = sensors.iter().filter(|sensor| view(sensor).contains(-back_m, *left_m)).peekable();
        seeing.peek().is_some() && seeing.all(|sensor| health(sensor) == Health::Failed)
    };
    if sensors.iter().all(|sensor| health(sensor) == Health::Failed) || REQUIRED_M.iter().any(is_lost) {
        Health::Failed
    } else if sensors.iter().any(|sensor| health(sensor) != Health::Ok) {
        Health::Degraded
    } else {
        Health::Ok
    }
}
