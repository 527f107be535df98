//! Faults of object-level sensors, of the odometry and of the map that cannot act in a scenario.

use closecall_sensors::faults::{ObjectFaultConfig, OdometryErrorConfig};
use closecall_sensors::{ObjectSensorModel, SensorMode, Sensors};
use closecall_traffic::{Alignment, ConfigError, Num, Parameters, Range, Road};

use super::inert_fault::{at, contradiction};
use super::intervention::FaultConfig;

/// Refuses blocked sectors outside of the field of view of a sensor, and noise of a speed that the
/// sensor does not measure.
pub(super) fn refuse_of_objects(
    fault: &FaultConfig,
    sensors: &Sensors,
    parameters: &Parameters,
) -> Result<(), ConfigError> {
    let model = sensors.full_model();
    let sensors_with_faults: [(&str, &[ObjectFaultConfig], &ObjectSensorModel, &'static str); 3] = [
        ("front-radar", &fault.front_radar, &model.front_radar, "sensors.front-radar.speed-sd-mps"),
        ("surround", &fault.surround, &model.surround, "sensors.surround.speed-sd-mps"),
        ("rear-object", &fault.rear_object, sensors.rear_object(), "sensors.rear-object.speed-sd-mps"),
    ];
    for (key, entries, model, speed_key) in sensors_with_faults {
        let half_deg = model.half_angle_deg().unwrap_or(180.0);
        let within = Range::closed(-half_deg, half_deg);
        for (index, entry) in entries.iter().enumerate() {
            for (end, name) in
                [(&entry.blocked_from_deg, "blocked-from-deg"), (&entry.blocked_to_deg, "blocked-to-deg")]
            {
                parameters.number_or(end.as_ref(), name, within, 0.0).map_err(|error| at(key, index, error))?;
            }
            if entry.speed_noise_mps.is_some() && !model.measures_speed() {
                let error = contradiction("speed-noise-mps", speed_key, "the sensor does not measure speed");
                return Err(at(key, index, error));
            }
        }
    }
    Ok(())
}

/// Refuses blocked sectors outside of the field of view of the rear radars.
pub(super) fn refuse_of_radars(
    fault: &FaultConfig,
    sensors: &Sensors,
    parameters: &Parameters,
) -> Result<(), ConfigError> {
    let Some(radar) = sensors.full_model().rear_radar else { return Ok(()) };
    for (index, entry) in fault.rear_radar.iter().enumerate() {
        for (end, key) in [(&entry.blocked_from_deg, "blocked-from-deg"), (&entry.blocked_to_deg, "blocked-to-deg")] {
            let checked = parameters.number_or(end.as_ref(), key, radar.azimuths_deg(), 0.0);
            checked.map_err(|error| at("rear-radar", index, error))?;
        }
    }
    Ok(())
}

/// Refuses errors of the map that no sensor could show.
pub(super) fn refuse_of_map_in(mode: SensorMode, odometry: &OdometryErrorConfig) -> Result<(), ConfigError> {
    let key = match (&odometry.heading_deg, &odometry.curvature_per_m, odometry.rails_missing) {
        (Some(_), ..) => "heading-deg",
        (None, Some(_), _) => "curvature-per-m",
        (None, None, true) => "rails-missing",
        (None, None, false) => return Ok(()),
    };
    let rule = "mode `ground-truth` has no sensor whose measurements are put on a map";
    match mode {
        SensorMode::GroundTruth => Err(contradiction(key, "sensors.mode", rule).within("odometry").within("fault")),
        SensorMode::Object | SensorMode::Full => Ok(()),
    }
}

/// Refuses errors of the map that begin after the end of the run, or that make a road which the
/// models do not cover, and missing guard rails on a road without any.
pub(super) fn refuse_of_map(
    odometry: &OdometryErrorConfig,
    road: &Road,
    duration_s: f64,
    parameters: &Parameters,
) -> Result<(), ConfigError> {
    let located = |error: ConfigError| error.within("odometry").within("fault");
    let value =
        |num: &Option<Num>, key| parameters.number_or(num.as_ref(), key, Range::closed(f64::MIN, f64::MAX), 0.0);
    if value(&odometry.from_s, "from-s").map_err(located)? >= duration_s {
        return Err(located(contradiction("from-s", "duration-s", "a fault begins before the run ends")));
    }
    if odometry.rails_missing && !road.has_guard_rails() {
        let error =
            contradiction("rails-missing", "road.guard-rails", "only guard rails that stand there can be missing");
        return Err(located(error));
    }
    let [least_per_m, most_per_m] = road.curvature_range_per_m();
    let [narrowest_m, widest_m] = road.lane_width_range_m();
    let curvatures_per_m = road.alignment().map_or(Road::CURVATURE_PER_M, |_| Alignment::CURVATURE_PER_M);
    let of_map = [
        (&odometry.curvature_per_m, "curvature-per-m", least_per_m, curvatures_per_m),
        (&odometry.curvature_per_m, "curvature-per-m", most_per_m, curvatures_per_m),
        (&odometry.lane_width_m, "lane-width-m", narrowest_m, Road::LANE_WIDTH_M),
        (&odometry.lane_width_m, "lane-width-m", widest_m, Road::LANE_WIDTH_M),
    ];
    for (num, key, actual, range) in of_map {
        range.check(actual + value(num, key).map_err(located)?, key).map_err(located)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use crate::{ScenarioFile, library};

    /// Returns the answer of the check to the shipped scenario with these keys added.
    fn check(keys: &str) -> Result<(), String> {
        let mode = if keys.contains("sensors.mode") { "" } else { "sensors.mode = \"object\"\n" };
        let text = format!("base = \"low-thw-overtake\"\nname = \"own\"\n{mode}{keys}");
        let file = ScenarioFile::parse(&library::path("own"), &text, &[]).map_err(|error| error.to_string())?;
        file.concrete(&file.space().nominal()).map(|_| ()).map_err(|error| error.to_string())
    }

    #[test]
    fn faults_of_objects_and_maps_that_cannot_act_are_refused_by_their_keys() {
        let truth = "sensors.mode = \"ground-truth\"\n";
        let sector = "blocked-from-deg = 0.0\nblocked-to-deg";
        for (keys, key, why) in [
            (
                format!("[[fault.front-radar]]\n{sector} = 46.0"),
                "fault.front-radar[0].blocked-to-deg",
                "from -45 to 45",
            ),
            (
                format!("[[fault.rear-object]]\n{sector} = 67.0"),
                "fault.rear-object[0].blocked-to-deg",
                "from -66.5 to 66.5",
            ),
            (format!("[[fault.surround]]\n{sector} = 181.0"), "fault.surround[0].blocked-to-deg", "from -180 to 180"),
            (
                "[[fault.surround]]\nspeed-noise-mps = 1.0".to_owned(),
                "fault.surround[0].speed-noise-mps",
                "`sensors.surround.speed-sd-mps`",
            ),
            ("[fault.odometry]\nlateral-m = 0.1\nfrom-s = 3000.0".to_owned(), "fault.odometry.from-s", "`duration-s`"),
            (format!("{truth}[fault.odometry]\nheading-deg = 1.0"), "fault.odometry.heading-deg", "`sensors.mode`"),
            (
                format!("{truth}[fault.odometry]\ncurvature-per-m = 0.0005"),
                "fault.odometry.curvature-per-m",
                "`sensors.mode`",
            ),
            ("[fault.odometry]\nrails-missing = true".to_owned(), "fault.odometry.rails-missing", "`road.guard-rails`"),
            (
                "road.lane-width-m = 4.5\n[fault.odometry]\nlane-width-m = 0.6".to_owned(),
                "fault.odometry.lane-width-m",
                "from 2.5 to 5",
            ),
            // Only the widest lane is too wide on the map.
            (
                "road.lane-width-m = [3.5, 3.75, 4.5]\n[fault.odometry]\nlane-width-m = 0.6".to_owned(),
                "fault.odometry.lane-width-m",
                "from 2.5 to 5",
            ),
            (
                "road.curvature-per-m = 0.002\n[fault.odometry]\ncurvature-per-m = 0.0006".to_owned(),
                "fault.odometry.curvature-per-m",
                "from -0.0025 to 0.0025",
            ),
            // The curvature at the other end of the clothoid would stay in the range.
            (
                "road.alignment = [{ s-m = 0.0, curvature-per-m = 0.0 }, { s-m = 500.0, curvature-per-m = -0.0035 }]\n\
                 [fault.odometry]\ncurvature-per-m = -0.0006"
                    .to_owned(),
                "fault.odometry.curvature-per-m",
                "from -0.004 to 0.004",
            ),
        ] {
            let message = check(&keys).unwrap_err();
            assert!(message.contains(key) && message.contains(why), "{keys}: {message}");
        }
        for keys in [
            "[[fault.front-radar]]\nspeed-noise-mps = 1.0",
            "[[fault.surround]]\nblocked-from-deg = 90.0\nblocked-to-deg = 180.0",
            "sensors.surround.speed-sd-mps = 0.5\n[[fault.surround]]\nspeed-noise-mps = 1.0",
            "sensors.mode = \"ground-truth\"\n[fault.odometry]\nlane-width-m = 0.5",
            "road.guard-rails = true\n[fault.odometry]\nrails-missing = true",
        ] {
            check(keys).unwrap();
        }
    }
}
