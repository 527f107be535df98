//! Injected faults that cannot act in a scenario: they would pass for faults that do no harm.

use closecall_sensors::camera::{Camera, Pipeline};
use closecall_sensors::faults::{CameraFaultConfig, LidarFaultConfig};
use closecall_sensors::lidar::Lidar;
use closecall_sensors::{SensorMode, Sensors};
use closecall_traffic::suggest::hint;
use closecall_traffic::{ConfigError, Environment, Light, Num, Parameters, Problem, Range, Road};

use super::inert_object_fault::{refuse_of_map, refuse_of_map_in, refuse_of_objects, refuse_of_radars};
use super::intervention::FaultConfig;

/// Why a fault of a camera whose images nothing gets is refused.
const NOT_USED: &str = "a camera whose pipeline is off is not used";

/// Refuses faults that cannot act: faults of sensors that do not exist in the mode of the scenario,
/// of a front radar that a LiDAR replaces, and of a LiDAR or a camera that does not exist, blocked
/// sectors outside of the field of view, mirror images without guard rails, glare of a source that
/// does not shine into the camera, and entries that begin after the end of the run.
///
/// A scenario with faults both of LiDAR or camera and of the object-level sensor behind is meant
/// for both modes, and so is one with faults both of the LiDAR and of the radar that look ahead. A
/// mode that the command line gives is checked by
/// [`ScenarioFile::check_faults_in`](crate::ScenarioFile::check_faults_in).
pub(super) fn refuse(
    fault: &FaultConfig,
    sensors: &Sensors,
    road: &Road,
    environment: &Environment,
    duration_s: f64,
    parameters: &Parameters,
) -> Result<(), ConfigError> {
    refuse_absent(fault, sensors)?;
    refuse_of_cameras(fault, sensors)?;
    refuse_glare(fault, sensors, road, environment)?;
    let model = sensors.full_model();
    let rear_lidars: Vec<Lidar> = model.rear_lidars().collect();
    refuse_of_lidars("rear-lidar", &fault.rear_lidar, &rear_lidars, road, parameters)?;
    if let Some(front_lidar) = model.front_lidar {
        refuse_of_lidars("front-lidar", &fault.front_lidar, &[front_lidar], road, parameters)?;
    }
    let refuse_late = |key, starts: &mut dyn Iterator<Item = &Option<Num>>| {
        for (index, from) in starts.enumerate() {
            let from_s = parameters.number_or(from.as_ref(), "from-s", Range::closed(0.0, f64::MAX), 0.0);
            if from_s.map_err(|error| at(key, index, error))? >= duration_s {
                let rule = "a fault begins before the run ends";
                return Err(at(key, index, contradiction("from-s", "duration-s", rule)));
            }
        }
        Ok(())
    };
    refuse_late("rear-lidar", &mut fault.rear_lidar.iter().map(|entry| &entry.from_s))?;
    refuse_late("front-lidar", &mut fault.front_lidar.iter().map(|entry| &entry.from_s))?;
    refuse_late("rear-camera", &mut fault.rear_camera.iter().map(|entry| &entry.from_s))?;
    refuse_late("front-radar", &mut fault.front_radar.iter().map(|entry| &entry.from_s))?;
    refuse_late("surround", &mut fault.surround.iter().map(|entry| &entry.from_s))?;
    refuse_late("rear-object", &mut fault.rear_object.iter().map(|entry| &entry.from_s))?;
    refuse_late("rear-radar", &mut fault.rear_radar.iter().map(|entry| &entry.from_s))?;
    refuse_of_objects(fault, sensors, parameters)?;
    refuse_of_radars(fault, sensors, parameters)?;
    match &fault.odometry {
        Some(odometry) => refuse_of_map(odometry, road, duration_s, parameters),
        None => Ok(()),
    }
}

/// Refuses names that no LiDAR has, blocked sectors outside of the field of view of a LiDAR, and
/// mirror images without guard rails.
fn refuse_of_lidars(
    sensor: &str,
    entries: &[LidarFaultConfig],
    lidars: &[Lidar],
    road: &Road,
    parameters: &Parameters,
) -> Result<(), ConfigError> {
    for (index, entry) in entries.iter().enumerate() {
        let is_meant = |lidar: &&Lidar| entry.sensor.as_deref().is_none_or(|name| name == lidar.name());
        let half_deg = lidars.iter().filter(is_meant).map(Lidar::half_field_deg).fold(f64::INFINITY, f64::min);
        if !half_deg.is_finite() {
            let names: Vec<&str> = lidars.iter().map(Lidar::name).collect();
            return Err(at(
                sensor,
                index,
                without_sensor("LiDAR", entry.sensor.as_deref().unwrap_or_default(), &names),
            ));
        }
        for (end, key) in [(&entry.blocked_from_deg, "blocked-from-deg"), (&entry.blocked_to_deg, "blocked-to-deg")] {
            let within = Range::closed(-half_deg, half_deg);
            parameters.number_or(end.as_ref(), key, within, 0.0).map_err(|error| at(sensor, index, error))?;
        }
        let share = parameters.number_or(entry.rail_ghosts.as_ref(), "rail-ghosts", Range::closed(0.0, 1.0), 0.0);
        if share.map_err(|error| at(sensor, index, error))? > 0.0 && !road.has_guard_rails() {
            let error = contradiction("rail-ghosts", "road.guard-rails", "only guard rails mirror vehicles");
            return Err(at(sensor, index, error));
        }
    }
    Ok(())
}

/// Returns the error of an entry that names no sensor of this kind.
fn without_sensor(kind: &str, name: &str, names: &[&str]) -> ConfigError {
    let others = names.join("`, `");
    let rule = format!("no {kind} is called `{name}`, only `{others}`{}", hint(name, &format!("`{others}`")));
    ConfigError::new("sensor", Problem::Contradiction { other: "sensors", rule })
}

/// Returns whether a network of Closecall or a perception program gets the images of a camera.
fn is_used(camera: &Camera, sensors: &Sensors) -> bool {
    camera.pipeline != Pipeline::Off || sensors.program().is_some_and(|program| program.images.is_some())
}

/// Refuses names that no camera has, and names of cameras that are not used.
fn refuse_of_cameras(fault: &FaultConfig, sensors: &Sensors) -> Result<(), ConfigError> {
    let cameras: Vec<&Camera> = sensors.rear_cameras().collect();
    for (index, entry) in fault.rear_camera.iter().enumerate() {
        let Some(name) = &entry.sensor else { continue };
        let error = match cameras.iter().find(|camera| camera.name == name) {
            None => without_sensor("rear camera", name, &cameras.iter().map(|camera| camera.name).collect::<Vec<_>>()),
            Some(camera) if !is_used(camera, sensors) => contradiction("sensor", "sensors", NOT_USED),
            Some(_) => continue,
        };
        return Err(at("rear-camera", index, error));
    }
    Ok(())
}

/// Refuses an entry whose only effect is glare of a source that does not shine into the camera.
fn refuse_glare(
    fault: &FaultConfig,
    sensors: &Sensors,
    road: &Road,
    environment: &Environment,
) -> Result<(), ConfigError> {
    let is_day = environment.light == Light::Day;
    for (index, entry) in fault.rear_camera.iter().enumerate() {
        let CameraFaultConfig { sun_glare, main_beam_glare, from_s, until_s, sensor, .. } = entry.clone();
        let of_sun = CameraFaultConfig { sun_glare, from_s, until_s, sensor, ..CameraFaultConfig::default() };
        let of_beam = CameraFaultConfig { main_beam_glare, sun_glare: None, ..of_sun.clone() };
        let has_fault = |camera: &&Camera| entry.sensor.as_ref().is_none_or(|sensor| camera.name == sensor);
        let mut cameras = sensors.rear_cameras().filter(has_fault).filter(|camera| is_used(camera, sensors));
        // On a curved road, the sun is in front of the lens sooner or later.
        let is_averted = road.is_straight() && !cameras.any(Camera::faces_sun);
        let inert = [
            (*entry == of_sun && !is_day, "sun-glare", "environment.light", "the sun shines by day only"),
            (
                *entry == of_sun && is_averted,
                "sun-glare",
                "sensors.rear-camera.sun",
                "the sun does not shine into a camera that faces away from it: for a camera that looks straight back, its azimuth is beyond 1.58 rad to either side",
            ),
            (
                *entry == of_beam && is_day,
                "main-beam-glare",
                "environment.light",
                "a main beam blinds at dusk and at night only",
            ),
        ];
        if let Some((_, key, other, rule)) = inert.into_iter().find(|(is_inert, ..)| *is_inert) {
            return Err(at("rear-camera", index, contradiction(key, other, rule)));
        }
    }
    Ok(())
}

/// Refuses faults of sensors that do not exist.
pub(super) fn refuse_absent(fault: &FaultConfig, sensors: &Sensors) -> Result<(), ConfigError> {
    const MODE: &str = "sensors.mode";
    let mode = sensors.mode();
    let (has_lidar, has_camera) = (!fault.rear_lidar.is_empty(), !fault.rear_camera.is_empty());
    let has_object = !fault.rear_object.is_empty();
    let has_radar = !fault.rear_radar.is_empty();
    let is_for_both = has_object && (has_lidar || has_camera || has_radar) && mode != SensorMode::GroundTruth;
    let (has_front_lidar, has_front_radar) = (!fault.front_lidar.is_empty(), !fault.front_radar.is_empty());
    let is_front_for_both = has_front_lidar && has_front_radar && mode != SensorMode::GroundTruth;
    let full_only = "LiDAR and camera exist in mode `full` only";
    let radar_only = "the rear radars exist in mode `full` only";
    let object_only = "the object-level sensor behind exists in mode `object` only";
    let no_sensor = "mode `ground-truth` has no sensor that can fail";
    let cameras_are_off = mode == SensorMode::Full && !sensors.rear_cameras().any(|camera| is_used(camera, sensors));
    let is_truth = mode == SensorMode::GroundTruth;
    let absent = [
        (has_lidar && mode != SensorMode::Full && !is_for_both, "rear-lidar", MODE, full_only),
        (has_camera && mode != SensorMode::Full && !is_for_both, "rear-camera", MODE, full_only),
        (has_radar && mode != SensorMode::Full && !is_for_both, "rear-radar", MODE, radar_only),
        (
            has_radar && sensors.full_model().rear_radar.is_none(),
            "rear-radar",
            "sensors.rear-radar",
            "there are no rear radars that can fail",
        ),
        (has_object && mode != SensorMode::Object && !is_for_both, "rear-object", MODE, object_only),
        (is_truth && has_front_radar, "front-radar", MODE, no_sensor),
        (is_truth && !fault.surround.is_empty(), "surround", MODE, no_sensor),
        (
            has_front_lidar && sensors.full_model().front_lidar.is_none(),
            "front-lidar",
            "sensors.front-lidar",
            "no LiDAR looks ahead: the radar's faults belong to `fault.front-radar`",
        ),
        (has_front_lidar && mode != SensorMode::Full && !is_front_for_both, "front-lidar", MODE, full_only),
        (
            has_front_radar && sensors.full_model().front_lidar.is_some() && !is_front_for_both,
            "front-radar",
            "sensors.front-lidar",
            "in mode `full`, a LiDAR looks ahead in place of the radar: its faults belong to `fault.front-lidar`",
        ),
        (has_camera && cameras_are_off, "rear-camera", "sensors.rear-camera.pipeline", NOT_USED),
    ];
    match absent.into_iter().find(|(is_absent, ..)| *is_absent) {
        Some((_, key, other, rule)) => Err(contradiction(key, other, rule).within("fault")),
        None => fault.odometry.as_ref().map_or(Ok(()), |odometry| refuse_of_map_in(mode, odometry)),
    }
}

pub(super) fn contradiction(key: &str, other: &'static str, rule: &str) -> ConfigError {
    ConfigError::new(key, Problem::Contradiction { other, rule: rule.to_owned() })
}

/// Returns an error of an entry with its place in the file.
pub(super) fn at(key: &str, index: usize, error: ConfigError) -> ConfigError {
    error.within_index(index).within(key).within("fault")
}

#[cfg(test)]
mod tests {
    use closecall_sensors::SensorMode;

    use crate::{ScenarioFile, library};

    /// Returns the answer of the check to the shipped scenario with these keys added.
    fn check(keys: &str) -> Result<(), String> {
        let text = format!("base = \"low-thw-overtake\"\nname = \"own\"\n{keys}");
        let file = ScenarioFile::parse(&library::path("own"), &text, &[]).map_err(|error| error.to_string())?;
        file.concrete(&file.space().nominal()).map(|_| ()).map_err(|error| error.to_string())
    }

    #[test]
    fn a_mode_in_which_a_fault_cannot_act_is_refused() {
        let in_mode = |name: &str, mode| {
            let file = ScenarioFile::parse(&library::path(name), library::text(name).unwrap(), &[]).unwrap();
            file.check_faults_in(mode).map_err(|error| error.to_string())
        };
        for (name, mode, key) in [
            ("lidar-dirty", SensorMode::Object, "fault.rear-lidar"),
            ("camera-dead", SensorMode::Object, "fault.rear-camera"),
            ("object-late", SensorMode::Full, "fault.rear-object"),
            ("front-radar-dead", SensorMode::GroundTruth, "fault.front-radar"),
            ("odometry-heading", SensorMode::GroundTruth, "fault.odometry.heading-deg"),
        ] {
            let message = in_mode(name, mode).unwrap_err();
            assert!(message.contains(&format!("`{key}` contradicts `sensors.mode`")), "{message}");
            assert!(message.contains(&format!("the mode `{}`, which is given", mode.name())), "{message}");
        }
        in_mode("lidar-dirty", SensorMode::Full).unwrap();
        in_mode("front-radar-dead", SensorMode::Full).unwrap();
        in_mode("odometry-wrong", SensorMode::Full).unwrap();
        in_mode("odometry-speed", SensorMode::GroundTruth).unwrap();
        in_mode("low-thw-overtake", SensorMode::GroundTruth).unwrap();
    }

    #[test]
    fn faults_that_cannot_act_are_refused_by_their_keys() {
        let (full, object) = ("sensors.mode = \"full\"\n", "sensors.mode = \"object\"\n");
        let truth = "sensors.mode = \"ground-truth\"\n";
        let lidar = "[[fault.rear-lidar]]\ndead = true\n";
        let further = "sensors.additional-rear-lidars = [{ name = \"left\", mount-height-m = 0.25 }]\n";
        let camera = "[[fault.rear-camera]]\ndead = true\n";
        let second = "sensors.additional-rear-cameras = [{ name = \"left\" }]\n";
        let behind = "[[fault.rear-object]]\ndead = true\n";
        let radar = "[[fault.front-radar]]\ndead = true\n";
        let (front, ahead) = ("sensors.front-lidar = {}\n", "[[fault.front-lidar]]\ndead = true\n");
        let (sun, beam) =
            ("[[fault.rear-camera]]\nsun-glare = 1.0\n", "[[fault.rear-camera]]\nmain-beam-glare = 1.0\n");
        let (low_sun, night) = ("sensors.rear-camera.sun.azimuth-rad = 3.1\n", "environment.light = \"night\"\n");
        // The sun stands 85° to the left, and 100° to the right.
        let (left_sun, right_sun) =
            ("sensors.rear-camera.sun.azimuth-rad = 1.48\n", "sensors.rear-camera.sun.azimuth-rad = -1.75\n");
        let to_left = "sensors.additional-rear-cameras = [{ name = \"left\", yaw-deg = 50 }]\n";
        let images = "sensors.perception = \"exec:x\"\nsensors.perception-image-hz = 5\n";
        let is_off = "sensors.rear-camera.pipeline = \"off\"\n";
        let mirrors = "[[fault.rear-lidar]]\nrail-ghosts = 0.5\n";
        for (keys, key, why) in [
            (format!("{object}{lidar}"), "fault.rear-lidar", "in mode `full` only"),
            (format!("{object}{camera}"), "fault.rear-camera", "in mode `full` only"),
            (format!("{full}{behind}"), "fault.rear-object", "in mode `object` only"),
            (format!("{truth}{radar}"), "fault.front-radar", "no sensor that can fail"),
            (format!("{truth}{lidar}{behind}"), "fault.rear-lidar", "in mode `full` only"),
            (format!("{full}sensors.front-lidar = {{}}\n{radar}"), "fault.front-radar", "`sensors.front-lidar`"),
            (format!("{object}sensors.front-lidar = {{}}\n{radar}"), "fault.front-radar", "`sensors.front-lidar`"),
            (
                format!("{full}[[fault.rear-lidar]]\nblocked-from-deg = 60.0\nblocked-to-deg = 70.0\n"),
                "fault.rear-lidar[0].blocked-to-deg",
                "from -66.5 to 66.5",
            ),
            (
                format!("{full}sensors.front-lidar = {{}}\n{behind}{lidar}{radar}"),
                "fault.front-radar",
                "`fault.front-lidar`",
            ),
            (format!("{full}{ahead}"), "fault.front-lidar", "no LiDAR looks ahead"),
            (format!("{full}[[fault.rear-radar]]\ndead = true\n"), "fault.rear-radar", "no rear radars"),
            (
                format!(
                    "{full}sensors.rear-radar = {{}}\n[[fault.rear-radar]]\nblocked-from-deg = 0.0\nblocked-to-deg = 120.0\n"
                ),
                "fault.rear-radar[0].blocked-to-deg",
                "from -105 to 105",
            ),
            (format!("{object}{front}{ahead}"), "fault.front-lidar", "in mode `full` only"),
            (format!("{truth}{front}{ahead}{radar}"), "fault.front-radar", "no sensor that can fail"),
            (
                format!("{full}{front}[[fault.front-lidar]]\nblocked-from-deg = -70.0\nblocked-to-deg = 0.0\n"),
                "fault.front-lidar[0].blocked-from-deg",
                "from -66.5 to 66.5",
            ),
            (
                format!("{full}{front}[[fault.front-lidar]]\nrail-ghosts = 0.5\n"),
                "fault.front-lidar[0].rail-ghosts",
                "`road.guard-rails`",
            ),
            (
                format!("{full}sensors.front-lidar.mount-height-m = 0.25\n[[fault.front-lidar]]\nheight-m = -0.2\n"),
                "sensors.front-lidar.mount-height-m",
                "`fault.front-lidar`",
            ),
            (format!("{full}{front}{ahead}from-s = 3000.0\n"), "fault.front-lidar[0].from-s", "`duration-s`"),
            (
                format!("{full}{further}[[fault.rear-lidar]]\ndead = true\nsensor = \"right\"\n"),
                "fault.rear-lidar[0].sensor",
                "`rear-lidar`, `left`",
            ),
            (
                format!("{full}{further}[[fault.rear-lidar]]\nheight-m = -0.2\nsensor = \"left\"\n"),
                "sensors.additional-rear-lidars[0].mount-height-m",
                "at least 0.1 m above the road",
            ),
            (format!("{full}{front}{ahead}sensor = \"rear-lidar\"\n"), "fault.front-lidar[0].sensor", "`front-lidar`"),
            (format!("{full}{sun}"), "fault.rear-camera[0].sun-glare", "`sensors.rear-camera.sun`"),
            (format!("{full}{low_sun}{night}{sun}"), "fault.rear-camera[0].sun-glare", "by day only"),
            (format!("{full}{beam}"), "fault.rear-camera[0].main-beam-glare", "`environment.light`"),
            (
                format!("{full}{second}{camera}sensor = \"right\"\n"),
                "fault.rear-camera[0].sensor",
                "`rear-camera`, `left`",
            ),
            (
                format!("{full}{is_off}{second}{camera}sensor = \"rear-camera\"\n"),
                "fault.rear-camera[0].sensor",
                "pipeline is off",
            ),
            (
                format!("{full}{second}{sun}sensor = \"left\"\n"),
                "fault.rear-camera[0].sun-glare",
                "`sensors.rear-camera.sun`",
            ),
            (
                format!("{full}{to_left}{right_sun}{sun}sensor = \"left\"\n"),
                "fault.rear-camera[0].sun-glare",
                "`sensors.rear-camera.sun`",
            ),
            (format!("{full}{is_off}{camera}"), "fault.rear-camera", "`sensors.rear-camera.pipeline`"),
            (format!("{full}{mirrors}"), "fault.rear-lidar[0].rail-ghosts", "`road.guard-rails`"),
            (format!("{object}{behind}from-s = 3000.0\n"), "fault.rear-object[0].from-s", "`duration-s`"),
            (
                format!("{full}sensors.rear-lidar.mount-height-m = 0.25\n[[fault.rear-lidar]]\nheight-m = -0.2\n"),
                "sensors.rear-lidar.mount-height-m",
                "at least 0.1 m above the road",
            ),
            (format!("{full}{lidar}{lidar}from-s = 3000.0\n"), "fault.rear-lidar[1].from-s", "`duration-s`"),
        ] {
            let message = check(&keys).unwrap_err();
            assert!(message.contains(key) && message.contains(why), "{keys}: {message}");
        }
        for keys in [
            format!("{full}{lidar}{camera}{radar}"),
            format!("{full}{is_off}{second}{camera}sensor = \"left\"\n"),
            format!("{full}{is_off}{images}{camera}"),
            format!("{full}{is_off}{images}{second}{camera}sensor = \"rear-camera\"\n"),
            format!("{full}{low_sun}{sun}"),
            format!("{full}{to_left}{left_sun}{sun}sensor = \"left\"\n"),
            format!("{full}{to_left}{right_sun}{sun}"),
            format!("{full}{night}{beam}"),
            format!("{full}{sun}dirt = 0.1\n"),
            format!("{full}{further}{lidar}sensor = \"left\"\n"),
            format!("{full}{further}[[fault.rear-lidar]]\nheight-m = -0.2\nsensor = \"rear-lidar\"\n"),
            format!("{object}{behind}{radar}"),
            format!("{full}road.guard-rails = true\n{mirrors}"),
            format!("{object}{behind}{lidar}"),
            format!("{full}{behind}{lidar}"),
            format!("{full}{front}{ahead}"),
            format!("{full}{front}{ahead}{radar}"),
            format!("{object}{front}{ahead}{radar}"),
        ] {
            check(&keys).unwrap();
        }
    }
}
