//! The ego's sensors before the start of a run.

use closecall_sensors::{Perception, Scene, SceneVehicle, SensorError};
use closecall_traffic::CONTROL_STEP;

use closecall_scenarios::Scenario;

use super::{Observer, SettlingView};

/// Number of scans before the start: one second, in which tracks are confirmed and settle. Without
/// it, the ego would start without a lead vehicle and accelerate.
const SCANS_BEFORE_START: i64 = 25;

/// Runs the sensors over the time before the start, in which all vehicles keep the speed at which
/// they start.
pub(super) fn settle_sensors(
    perception: &mut dyn Perception,
    scenario: &Scenario,
    ego: SceneVehicle,
    others: &[SceneVehicle],
    observer: &mut dyn Observer,
) -> Result<(), SensorError> {
    let mut others_before = others.to_vec();
    for scan in (1..=SCANS_BEFORE_START).rev() {
        let time = CONTROL_STEP * -scan;
        let before = |vehicle: &SceneVehicle| {
            let mut vehicle = *vehicle;
            vehicle.state.s_m += vehicle.state.speed_mps * time.s();
            vehicle
        };
        for (then, now) in others_before.iter_mut().zip(others) {
            *then = before(now);
        }
        let (road, environment) = (&scenario.road, &scenario.environment);
        let ego = before(&ego);
        perception.step(&Scene { time, road, environment, ego, others: &others_before })?;
        observer.settling(&SettlingView { time, scenario, ego, perception: &*perception });
    }
    Ok(())
}
