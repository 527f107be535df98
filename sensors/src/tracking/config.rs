//! Parameters of the tracker: confirmation, coasting and latency.

use closecall_traffic::{CONTROL_STEP, Check, ConfigError, Num, Parameters, Problem, Range};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::lifecycle::{LifecycleRules, MAX_WINDOW};

/// The tracker as a scenario file describes it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, default)]
pub struct TrackerConfig {
    /// Number of detections in the latest `confirm-window` scans that confirm a track.
    pub confirm_hits: u8,
    /// Number of latest scans in which `confirm-hits` are counted: 1 to 16. The default of 3 hits
    /// in 6 scans confirms a distant low car even if it is detected with one side of the mirror
    /// only.
    pub confirm_window: u8,
    /// Time for which a confirmed track is kept without further detections (s).
    pub coast_s: Num,
    /// Time from the end of a scan to its tracks (s), rounded to whole control steps of 40 ms.
    pub latency_s: Num,
    /// Standard deviation of a track's speed along the road above which the track is not confirmed
    /// (m/s).
    pub settled_speed_sd_mps: Num,
}

impl Default for TrackerConfig {
    fn default() -> Self {
        Self {
            confirm_hits: 3,
            confirm_window: 6,
            coast_s: Num::Fixed(1.0),
            latency_s: Num::Fixed(0.04),
            settled_speed_sd_mps: Num::Fixed(1.5),
        }
    }
}

/// A checked tracker configuration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackerModel {
    pub(crate) rules: LifecycleRules,
    latency_steps: u32,
    pub(crate) settled_speed_sd_mps: f64,
}

impl TrackerModel {
    /// Returns the number of whole control steps from the end of a scan to its tracks.
    pub fn latency_steps(&self) -> usize {
        self.latency_steps as usize
    }

    /// Returns the same tracker for a sensor that scans once in `period_s`, in place of once in a
    /// control step: it coasts for the same time.
    #[must_use]
    pub fn with_scan_period_s(self, period_s: f64) -> Self {
        let coast_s = f64::from(self.rules.delete_after_misses - 1) * CONTROL_STEP.s();
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "0 to 10 s, at most 25 scans per second"
        )]
        let delete_after_misses = (coast_s / period_s).round() as u32 + 1;
        Self { rules: LifecycleRules { delete_after_misses, ..self.rules }, ..self }
    }

    /// Returns the same tracker with a latency of `steps` control steps, at most
    /// [`MAX_LATENCY_STEPS`].
    #[must_use]
    pub fn with_latency_steps(self, steps: usize) -> Self {
        let steps = steps.min(MAX_LATENCY_STEPS);
        Self { latency_steps: u32::try_from(steps).unwrap_or(self.latency_steps), ..self }
    }
}

/// Returns the number of whole scans nearest to `time_s`, which is from 0 to 10 s.
fn steps(time_s: f64) -> u32 {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked to be 0 to 10 s")]
    let steps = (time_s / CONTROL_STEP.s()).round() as u32;
    steps
}

/// Maximum latency in control steps: 0.4 s.
pub const MAX_LATENCY_STEPS: usize = 10;

/// Maximum latency (s).
const MAX_LATENCY_S: f64 = 0.4;
/// Probability that a scan detects a vehicle in view: between one in two scans (distant low
/// vehicle) and every scan (near).
pub const DETECTION_PROBABILITY: f64 = 0.75;
/// Probability that clutter gives a detection inside the gate of a false track in one scan.
const CLUTTER_PROBABILITY: f64 = 0.1;

impl Check for TrackerConfig {
    type Checked = TrackerModel;

    fn check(&self, parameters: &Parameters) -> Result<TrackerModel, ConfigError> {
        if !(1..=MAX_WINDOW).contains(&self.confirm_window) {
            let value = self.confirm_window.into();
            let problem = Problem::WrongCount { value, allowed: "a number of scans from 1 to 16" };
            return Err(ConfigError::new("confirm-window", problem));
        }
        if !(1..=self.confirm_window).contains(&self.confirm_hits) {
            let value = self.confirm_hits.into();
            let problem = Problem::WrongCount { value, allowed: "a number from 1 to `confirm-window`" };
            return Err(ConfigError::new("confirm-hits", problem));
        }
        let latency_s = parameters.number(&self.latency_s, "latency-s", Range::closed(0.0, MAX_LATENCY_S))?;
        let coast_s = parameters.number(&self.coast_s, "coast-s", Range::closed(0.0, 10.0))?;
        let settled = &self.settled_speed_sd_mps;
        Ok(TrackerModel {
            rules: LifecycleRules {
                confirm_hits: self.confirm_hits.into(),
                confirm_window: self.confirm_window.into(),
                delete_after_misses: steps(coast_s) + 1,
                detection_probability: DETECTION_PROBABILITY,
                clutter_probability: CLUTTER_PROBABILITY,
            },
            latency_steps: steps(latency_s),
            settled_speed_sd_mps: parameters.number(settled, "settled-speed-sd-mps", Range::above(0.0, 20.0))?,
        })
    }
}
