//! The behaviour of a vehicle's tracks: their errors, their delays, and their gaps.
//!
//! ```text
//!  full chain ───────────┬▶ approaches, appearances, manoeuvres ─▶ Behaviour ─▶ validation of the object-level sensor
//!  object-level sensor ──┘
//! ```
//!
//! Both sensors are measured by the same code on the same drives.

use closecall_sensors::Sensors;
use closecall_traffic::{CONTROL_STEP, Road, maths};
use rayon::prelude::*;

use crate::perception::approach::Address;
use crate::perception::approach::watching::{Delays, Seen, Step, delays, lags_s, steps};
use crate::perception::cases::Case;
use crate::perception::study::StudyError;

/// Gaps between which errors are measured, and the gap that divides near from far (m).
pub(crate) const GAPS_M: [f64; 3] = [20.0, 50.0, 80.0];
/// Lag at which the correlation of errors is taken (control steps): 1 s.
const LAG_STEPS: usize = 25;
/// Bounds of a correlation (-), which leave its time finite.
const CORRELATION_BOUNDS: [f64; 2] = [1e-3, 0.999];

/// The behaviour of a vehicle's tracks. Arrays have the values along the road (m), across it (m),
/// and of the speed (m/s).
#[derive(Clone, Debug, PartialEq)]
pub struct Behaviour {
    /// Root mean square errors at gaps from 20 to 80 m.
    pub sd: [f64; 3],
    /// Root mean square errors up to 50 m, and beyond.
    pub near_far_sd: [[f64; 3]; 2],
    /// Correlation times of the errors (s).
    pub time_s: [f64; 3],
    /// Mean times until a vehicle that appears is confirmed, and classified (s); infinite if most
    /// are not within 4 s.
    pub after_s: [f64; 2],
    /// Share of the steps after the first confirmation in which no track is reported (-).
    pub missed: f64,
    /// Longest time without a track after the first confirmation (s).
    pub longest_gap_s: f64,
    /// Share of the steps with a track in which the latest scan has not detected the vehicle (-).
    pub coasting: f64,
    /// Mean times by which tracks slow down, and move across the road, later than the vehicle (s);
    /// infinite if most are lost.
    pub lag_s: [f64; 2],
}

/// The sensors' view of one approach and its manoeuvres.
#[derive(Clone, Debug)]
pub(crate) struct Shown {
    pub(crate) steps: Vec<Step>,
    pub(crate) delays: Delays,
    pub(crate) lags_s: Option<[f64; 2]>,
}

impl Behaviour {
    /// Measures the behaviour of the tracks of a case in `approaches` approaches. It does not
    /// depend on the number of threads.
    ///
    /// # Errors
    /// [`StudyError`] if a sensor model fails.
    pub(crate) fn measure(
        case: &Case,
        sensors: &Sensors,
        road: &Road,
        [seed, approaches]: [u64; 2],
    ) -> Result<Self, StudyError> {
        let watched = |run| {
            let at = Address { seed, run };
            let shown = || {
                Ok(Shown {
                    steps: steps(case, sensors, road, at, GAPS_M[0])?,
                    delays: delays(case, sensors, road, at)?,
                    lags_s: lags_s(case, sensors, road, at)?,
                })
            };
            shown().map_err(|source| StudyError::Sensor { case: case.name.clone(), run, source })
        };
        Ok(Self::of(&(0..approaches).into_par_iter().map(watched).collect::<Result<Vec<Shown>, StudyError>>()?))
    }

    /// Returns the behaviour over all approaches of a case.
    pub(crate) fn of(shown: &[Shown]) -> Self {
        let series: Vec<Vec<Step>> = shown.iter().map(|vehicle| vehicle.steps.clone()).collect();
        let [near_m, middle_m, far_m] = GAPS_M;
        let rms = |from_m: f64, to_m: f64| root_mean_squares(&errors_between(&series, [from_m, to_m]));
        let [missed, longest_gap_s, coasting] = misses(&series);
        let most = |values: Vec<Option<f64>>| mean_of_most(&values);
        Self {
            sd: rms(near_m, far_m),
            near_far_sd: [rms(near_m, middle_m), rms(middle_m, far_m)],
            time_s: correlation_times_s(&series),
            after_s: [
                most(shown.iter().map(|vehicle| vehicle.delays.confirmed_s).collect()),
                most(shown.iter().map(|vehicle| vehicle.delays.classified_s).collect()),
            ],
            missed,
            longest_gap_s,
            coasting,
            lag_s: [0, 1]
                .map(|axis| most(shown.iter().map(|vehicle| vehicle.lags_s.map(|lags_s| lags_s[axis])).collect())),
        }
    }
}

/// Returns the errors of all steps with a track at these gaps (m).
fn errors_between(series: &[Vec<Step>], [near_m, far_m]: [f64; 2]) -> Vec<[f64; 4]> {
    let within = series.iter().flatten().filter(|step| step.gap_m >= near_m && step.gap_m <= far_m);
    within.filter_map(|step| step.seen.map(|seen| seen.errors)).collect()
}

fn root_mean_squares(errors: &[[f64; 4]]) -> [f64; 3] {
    [0, 1, 2].map(|axis| {
        let sum: f64 = errors.iter().map(|error| error[axis] * error[axis]).sum();
        (sum / errors.len().max(1) as f64).sqrt()
    })
}

/// Returns the correlation times of the errors at the gaps where errors are measured (s), from
/// their correlation with the errors a second later.
fn correlation_times_s(series: &[Vec<Step>]) -> [f64; 3] {
    let is_within = |step: &Step| step.gap_m >= GAPS_M[0] && step.gap_m <= GAPS_M[2];
    [0, 1, 2].map(|axis| {
        let (mut product, mut square) = (0.0, 0.0);
        for window in series.iter().flat_map(|steps| steps.windows(LAG_STEPS + 1)) {
            let [first, last] = [&window[0], &window[LAG_STEPS]];
            let (true, true) = (is_within(first), is_within(last)) else { continue };
            let (Some(first), Some(last)) = (first.seen, last.seen) else { continue };
            product += first.errors[axis] * last.errors[axis];
            square += 0.5 * (first.errors[axis].powi(2) + last.errors[axis].powi(2));
        }
        let [low, high] = CORRELATION_BOUNDS;
        let correlation = if square > 0.0 { (product / square).clamp(low, high) } else { low };
        -(LAG_STEPS as f64) * CONTROL_STEP.s() / maths::ln(correlation)
    })
}

/// Returns the share of the steps after the first confirmation without a track (-), the longest
/// time without one (s), and the share of the coasting steps among the steps with one (-).
fn misses(series: &[Vec<Step>]) -> [f64; 3] {
    let [mut steps, mut missed, mut coasting, mut longest] = [0_u64; 4];
    for approach in series {
        let mut gap = 0;
        for step in approach.iter().skip_while(|step| step.seen.is_none()) {
            steps += 1;
            gap = if step.seen.is_none() { gap + 1 } else { 0 };
            missed += u64::from(step.seen.is_none());
            coasting += u64::from(step.seen.is_some_and(|Seen { is_coasting, .. }| is_coasting));
            longest = longest.max(gap);
        }
    }
    let tracked = steps - missed;
    [missed as f64 / steps.max(1) as f64, longest as f64 * CONTROL_STEP.s(), coasting as f64 / tracked.max(1) as f64]
}

/// Returns the mean of the values that exist; infinity if less than half of them exist.
fn mean_of_most(values: &[Option<f64>]) -> f64 {
    let existing: Vec<f64> = values.iter().copied().flatten().collect();
    if existing.is_empty() || 2 * existing.len() < values.len() {
        return f64::INFINITY;
    }
    existing.iter().sum::<f64>() / existing.len() as f64
}

#[cfg(test)]
mod tests;
