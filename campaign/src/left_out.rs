//! Scenarios that a campaign leaves out, because a fault or a perception program of them cannot act
//! with its sensors. The others run, and the campaign does not pass without them.

use closecall_scenarios::{ScenarioError, ScenarioFile};
use closecall_sensors::SensorMode;
use serde::{Deserialize, Serialize};

/// A scenario that a campaign leaves out.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LeftOut {
    /// The name.
    pub scenario: String,
    /// The key that cannot act, and why.
    pub reason: String,
}

/// Returns the scenarios that can run with these sensors, if any are given, and the others.
///
/// # Errors
/// The [`ScenarioError`] of the first scenario, if none can run.
pub fn leave_out(
    files: Vec<ScenarioFile>,
    sensors: Option<SensorMode>,
) -> Result<(Vec<ScenarioFile>, Vec<LeftOut>), ScenarioError> {
    let Some(mode) = sensors else { return Ok((files, Vec::new())) };
    let (mut kept, mut left_out, mut first) = (Vec::new(), Vec::new(), None);
    for file in files {
        let Err(error) = file.check_faults_in(mode) else {
            kept.push(file);
            continue;
        };
        let reason = match &error {
            ScenarioError::Value { source, at, .. } => format!("{source}{at}"),
            other => other.to_string(),
        };
        left_out.push(LeftOut { scenario: file.config().name.clone(), reason });
        first.get_or_insert(error);
    }
    match first {
        Some(error) if kept.is_empty() => Err(error),
        _ => Ok((kept, left_out)),
    }
}

/// Returns a sentence for each reason, with the scenarios that it keeps from running.
pub fn sentences(left_out: &[LeftOut]) -> Vec<String> {
    let mut by_reason: Vec<(&str, Vec<&str>)> = Vec::new();
    for LeftOut { scenario, reason } in left_out {
        match by_reason.iter_mut().find(|(known, _)| known == reason) {
            Some((_, names)) => names.push(scenario.as_str()),
            None => by_reason.push((reason.as_str(), vec![scenario.as_str()])),
        }
    }
    by_reason.iter().map(|(reason, names)| format!("not run: {}: {reason}", names.join(", "))).collect()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use closecall_scenarios::source;

    use super::*;

    fn files(names: &[&str]) -> Vec<ScenarioFile> {
        names.iter().map(|name| source::load(Path::new(name), &[]).unwrap()).collect()
    }

    #[test]
    fn scenarios_whose_faults_cannot_act_are_left_out_by_reason() {
        let names =
            ["low-thw-overtake", "camera-dead", "camera-dirty", "lidar-dead", "object-dead", "odometry-heading"];
        for (mode, left, parts) in [
            (SensorMode::Object, 3, &["camera-dead, camera-dirty: `fault.rear-camera`", "lidar-dead"][..]),
            (SensorMode::Full, 1, &["not run: object-dead: `fault.rear-object`"]),
            (SensorMode::GroundTruth, 5, &["not run: odometry-heading: `fault.odometry.heading-deg`"]),
        ] {
            let (kept, left_out) = leave_out(files(&names), Some(mode)).unwrap();
            assert_eq!((kept.len(), left_out.len()), (names.len() - left, left), "{left_out:?}");
            let told = sentences(&left_out).join("\n");
            assert!(parts.iter().all(|part| told.contains(part)) && !told.contains(".toml"), "{told}");
        }
        assert_eq!(leave_out(files(&names), None).unwrap().1, []);
        let error = leave_out(files(&names[1..4]), Some(SensorMode::Object)).unwrap_err().to_string();
        assert!(error.contains("camera-dead.toml"), "{error}");
    }
}
