//! What the monitors notice of each fault, when, and for which reason.

use closecall_sensors::Health;
use closecall_sensors::faults::Faults;
use closecall_sensors::monitors::Alarm;
use closecall_traffic::CONTROL_STEP;

use crate::watch::{Car, Of, drive, load};

/// The prefixes of the names: the sensors.
const SENSORS: [&str; 8] =
    ["camera-", "front-lidar-", "front-radar-", "lidar-", "map-", "object-", "odometry-", "surround-"];
/// Number of steps of a drive: 12 s.
const STEPS: i64 = 300;
/// A sensor that loses four of five measurements may by chance lose all of a second.
const SOMETIMES: [&str; 1] = ["object-dropout"];

/// Returns the kind of the fault: the name without the sensor.
pub(crate) fn kind(name: &str) -> &str {
    SENSORS.iter().find_map(|sensor| name.strip_prefix(sensor)).unwrap_or(name)
}

/// Returns the reason for which a fault is noticed, and the time within which it is (s); `None` if no
/// monitor notices it.
fn expected(name: &str, sensor: Of) -> Option<(Alarm, f64)> {
    let is_lidar = matches!(sensor, Of::RearLidar | Of::FrontLidar);
    match kind(name) {
        "dead" | "frozen" => Some((Alarm::NothingNew, 1.2)),
        "lost-frames" => Some((Alarm::LostScans, 2.0)),
        "late" | "jitter" | "clock-offset" => Some((Alarm::LateScans, 2.0)),
        "dropout" | "dirty" if is_lidar => Some((Alarm::MissingReturns, 2.0)),
        "height" | "pitch" | "misaligned" => Some((Alarm::WrongHeight, 4.0)),
        "noisy" if is_lidar => Some((Alarm::NoisyRanges, 4.0)),
        "blocked" if is_lidar => Some((Alarm::BlockedSector, 4.0)),
        _ => None,
    }
}

/// Checks that a fault of the library, from the start on, is noticed in time for its reason, or not at
/// all. Returns whether it is noticed.
///
/// # Errors
/// What differs.
pub(crate) fn check(name: &str, sensor: Of) -> Result<bool, String> {
    let settings: &[&str] = if sensor == Of::RearCamera { &[] } else { &["sensors.rear-camera.pipeline=\"off\""] };
    let scenario = load(name, settings);
    let car = match sensor {
        Of::Surround => Car { gap_m: 6.0, left_m: 0.0, closing_mps: 0.0 },
        _ => Car { gap_m: 40.0, left_m: 0.0, closing_mps: 0.0 },
    };
    let sensors = scenario.sensors;
    let faults = sensors.faults().throughout();
    let drive = |faults: Faults| drive(sensor, &sensors.with_faults(faults), &scenario, (Some(car), STEPS));
    if drive(Faults::default()).iter().any(|step| !step.alarms.is_empty() || step.health != Health::Ok) {
        return Err("a false alarm without the fault".to_owned());
    }
    let steps = drive(faults);
    if let Some(step) = steps.iter().find(|step| step.alarms.is_empty() != (step.health == Health::Ok)) {
        return Err(format!("{:?} with {:?}", step.health, step.alarms));
    }
    match expected(name, sensor) {
        None => match steps.iter().find(|step| !step.alarms.is_empty()) {
            Some(step) if !SOMETIMES.contains(&name) => Err(format!("noticed, as {}", step.alarms)),
            _ => Ok(false),
        },
        Some((alarm, within_s)) => {
            let first = steps.iter().position(|step| step.alarms.contains(alarm));
            let time_s = first.map_or(f64::INFINITY, |step| (step + 1) as f64 * CONTROL_STEP.s());
            if time_s <= within_s { Ok(true) } else { Err(format!("{alarm:?} after {time_s} s")) }
        }
    }
}
