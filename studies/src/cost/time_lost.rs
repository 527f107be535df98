//! The time that the ego loses to the baseline.

use closecall_campaign::saved::SavedCampaign;
use closecall_sensors::SensorMode;
use closecall_simulation::{Observer, RunEvent, StepView};
use closecall_traffic::{Time, VehicleState};
use rayon::prelude::*;

use crate::case::Case;

/// The positions of the ego (m) at every physics step.
struct Positions {
    ego: usize,
    s_m: Vec<f64>,
}

impl Observer for Positions {
    fn step(&mut self, _: &StepView<'_>) {}
    fn event(&mut self, _: Time, _: &RunEvent) {}
    fn moved(&mut self, _: Time, vehicles: &mut dyn Iterator<Item = VehicleState>) {
        self.s_m.extend(vehicles.nth(self.ego).map(|state| state.s_m));
    }
}

/// Returns the mean time that the ego of each arm loses to the ego of the first arm (s), over
/// samples of a scenario that are run again. Returns `None` without samples, if the sensors are
/// simulated in full, or if a controller is a separate process.
///
/// At the end of the shorter run, the ego of the arm is some distance behind the ego of the
/// baseline. The time lost is the time since the ego of the baseline passed this position.
pub(super) fn mean_time_lost_s(saved: &SavedCampaign, scenario: &str, samples: &[u64]) -> Option<Vec<f64>> {
    let manifest = saved.manifest();
    if samples.is_empty() || manifest.arms.iter().any(|arm| arm.built_in().is_none()) {
        return None;
    }
    let names = manifest.arm_names();
    let lost: Option<Vec<Vec<f64>>> = samples
        .par_iter()
        .map(|&sample| {
            let mut runs = Vec::new();
            for name in &names {
                let case = Case::of(saved, Some(scenario), sample, Some(name)).ok()?;
                if case.sensors() == SensorMode::Full {
                    return None;
                }
                let mut positions = Positions { ego: case.concrete(&[]).ok()?.ego, s_m: Vec::new() };
                case.run_as(&[], &case.arm, &mut positions).ok()?;
                runs.push(positions.s_m);
            }
            Some(runs.iter().map(|run| lost_s(&runs[0], run)).collect())
        })
        .collect();
    let lost = lost?;
    let mean = |arm: usize| lost.iter().map(|sample| sample[arm]).sum::<f64>() / lost.len() as f64;
    Some((0..names.len()).map(mean).collect())
}

/// Returns the time that `run` loses to `baseline` (s).
fn lost_s(baseline: &[f64], run: &[f64]) -> f64 {
    let steps = baseline.len().min(run.len());
    let Some(end_m) = steps.checked_sub(1).map(|last| run[last]) else { return 0.0 };
    let passed = baseline.partition_point(|s_m| *s_m < end_m);
    (steps as f64 - 1.0 - passed as f64) * closecall_traffic::PHYSICS_STEP.s()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_lost_is_how_long_before_the_baseline_was_there() {
        let at = |speed_mps: f64| (0..=1_000).map(|step| speed_mps * 0.01 * f64::from(step)).collect::<Vec<_>>();
        // After 10 s, 290 m instead of 300 m: a third of a second at 30 m/s.
        assert!((lost_s(&at(30.0), &at(29.0)) - 10.0 / 30.0).abs() < 0.011);
        assert!(lost_s(&at(30.0), &at(30.0)).abs() < 0.011);
        assert_eq!(lost_s(&[], &[]), 0.0);
    }
}
