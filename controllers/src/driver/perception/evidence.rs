//! Accumulation of looming evidence: a driver notices a change once the looming has differed from
//! the expected looming for long enough.
//!
//! ```text
//!  1/τ ▲        ╱ observed        A ▲      threshold
//!      │      ╱                     │- - - - -┌─ noticed: the driver adopts the observed motion
//!      │____╱_____ expected         │       ╱ │╱
//!      └───────────▶ time           └─────╱───┴──▶ time
//! ```
//!
//! Markkula, *Modeling driver control behavior in both routine and near-accident driving*,
//! Proceedings of the Human Factors and Ergonomics Society 58 (2014) 879–883, with the author's
//! code (`gmarkkula/HFES2014ModelsAndFigs`): the activation A of an accumulator grows with the
//! deviation of 1/τ = θ̇/θ from the predicted value, minus a gating, and is never negative. At a
//! threshold the driver reacts, and A falls to 0.6 of the threshold. Gating and threshold come from
//! the fit in that paper to the brake onsets that Kiefer et al. (2003) measured on a test track.
//!
//! This model deviates in its prediction: it is the motion of the vehicle ahead that the driver
//! noticed last (its speed, and the deceleration perceived from the change of speed), not the fixed
//! decay over 9 s of the author's braking model. The car-following model thus still decides how
//! hard the driver brakes. A second accumulator notices in the same way that the vehicle ahead is
//! faster than expected; the source has only the accumulator for closing. No noise is added:
//! drivers differ by their thresholds.

use closecall_traffic::{Check, ConfigError, Num, Parameters, Range};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::MIN_GAP_M;

/// Activation at which the driver notices a change (-) (Markkula 2014).
const DEFAULT_THRESHOLD: f64 = 0.0888;

/// Deviation of 1/τ below which no evidence accumulates (1/s) (Markkula 2014).
const DEFAULT_GATING_PER_S: f64 = 0.0155;

/// Share of the threshold to which the activation falls when the driver notices a change (-)
/// (Markkula 2014).
const RESET_SHARE: f64 = 0.6;

/// Accumulation of looming evidence as a scenario file describes it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, default)]
pub struct EvidenceConfig {
    /// Accumulated deviation of 1/τ at which the driver notices a change (-): above 0, at most 2.
    /// Default: 0.0888.
    pub threshold: Option<Num>,
    /// Deviation of 1/τ below which no evidence accumulates (1/s): 0 to 0.5. Default: 0.0155.
    pub gating_per_s: Option<Num>,
}

/// Checked accumulation of looming evidence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Evidence {
    threshold: f64,
    gating_per_s: f64,
}

impl Check for EvidenceConfig {
    type Checked = Evidence;

    fn check(&self, parameters: &Parameters) -> Result<Evidence, ConfigError> {
        let number_or =
            |num: &Option<Num>, key, range, default| parameters.number_or(num.as_ref(), key, range, default);
        Ok(Evidence {
            threshold: number_or(&self.threshold, "threshold", Range::above(0.0, 2.0), DEFAULT_THRESHOLD)?,
            gating_per_s: number_or(&self.gating_per_s, "gating-per-s", Range::closed(0.0, 0.5), DEFAULT_GATING_PER_S)?,
        })
    }
}

/// The true motion of the vehicle ahead at one observation.
#[derive(Clone, Copy, Debug)]
pub(super) struct Looming {
    /// Index of the vehicle.
    pub(super) actor: u32,
    /// Gap (m).
    pub(super) gap_m: f64,
    /// Speed (m/s).
    pub(super) speed_mps: f64,
    /// Acceleration as perceived from the change of speed (m/s²).
    pub(super) acceleration_mps2: f64,
    /// Time since the last observation (s).
    pub(super) step_s: f64,
}

/// The driver's expectation about the vehicle ahead, and the evidence against it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Belief {
    actor: u32,
    /// Expected speed (m/s).
    pub(super) speed_mps: f64,
    /// Expected acceleration (m/s²).
    pub(super) acceleration_mps2: f64,
    /// Activation of the accumulators for closing and for opening (-).
    activation: [f64; 2],
}

impl Belief {
    /// Returns the belief after an observation. A vehicle seen for the first time is believed to
    /// drive at the own speed.
    pub(super) fn updated(belief: Option<Self>, evidence: Evidence, seen: Looming, own_mps: f64) -> Self {
        let same = belief.filter(|belief| belief.actor == seen.actor);
        let mut belief = same.unwrap_or(Self {
            actor: seen.actor,
            speed_mps: own_mps,
            acceleration_mps2: 0.0,
            activation: [0.0; 2],
        });
        belief.speed_mps = (belief.speed_mps + belief.acceleration_mps2 * seen.step_s).max(0.0);
        let closing_faster_per_s = (belief.speed_mps - seen.speed_mps) / seen.gap_m.max(MIN_GAP_M);
        let mut notices = false;
        for (activation, deviation_per_s) in
            belief.activation.iter_mut().zip([closing_faster_per_s, -closing_faster_per_s])
        {
            *activation = (*activation + (deviation_per_s - evidence.gating_per_s) * seen.step_s).max(0.0);
            if *activation > evidence.threshold {
                *activation = RESET_SHARE * evidence.threshold;
                notices = true;
            }
        }
        if notices {
            belief.speed_mps = seen.speed_mps;
            belief.acceleration_mps2 = seen.acceleration_mps2;
        }
        belief
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the time after which a driver notices that a vehicle ahead, at a gap that stays at
    /// 20 m, is slower by `closing_mps` (s), or `None` if it does not within 20 s.
    fn noticed_after_s(closing_mps: f64, config: &EvidenceConfig) -> Option<f64> {
        let evidence = config.check(&Parameters::default()).unwrap();
        let seen =
            Looming { actor: 1, gap_m: 20.0, speed_mps: 30.0 - closing_mps, acceleration_mps2: 0.0, step_s: 0.01 };
        let mut belief = None;
        (1..=2_000).map(f64::from).find_map(|step| {
            let now = Belief::updated(belief, evidence, seen, 30.0);
            belief = Some(now);
            (now.speed_mps < 30.0).then_some(0.01 * step)
        })
    }

    #[test]
    fn slow_looming_is_noticed_later_than_fast_looming() {
        let default = EvidenceConfig::default();
        // A constant deviation of ε is noticed after 0.0888/(ε − 0.0155): 0.19 s at 10 m/s, 1.05 s
        // at 2 m/s.
        let [fast_s, slow_s] = [10.0, 2.0].map(|closing_mps| noticed_after_s(closing_mps, &default).unwrap());
        assert!((fast_s - 0.0888 / (0.5 - 0.0155)).abs() < 0.011, "{fast_s}");
        assert!((slow_s - 0.0888 / (0.1 - 0.0155)).abs() < 0.011, "{slow_s}");
        // Below the gating, nothing is ever noticed.
        assert_eq!(noticed_after_s(0.3, &default), None);
    }

    #[test]
    fn a_higher_threshold_is_reached_later() {
        let with = |threshold: f64| EvidenceConfig { threshold: Some(threshold.into()), gating_per_s: None };
        assert!(noticed_after_s(5.0, &with(0.3)).unwrap() > 2.0 * noticed_after_s(5.0, &with(0.1)).unwrap());
        let error = with(0.0).check(&Parameters::default()).unwrap_err();
        assert_eq!(error.path.to_string(), "threshold");
    }

    #[test]
    fn a_vehicle_that_is_faster_than_expected_is_noticed_too() {
        assert!(noticed_after_s(-5.0, &EvidenceConfig::default()).is_none(), "the belief rises instead");
        let evidence = EvidenceConfig::default().check(&Parameters::default()).unwrap();
        let seen = Looming { actor: 1, gap_m: 20.0, speed_mps: 35.0, acceleration_mps2: 0.0, step_s: 0.01 };
        let mut belief = Belief::updated(None, evidence, seen, 30.0);
        for _ in 0..100 {
            belief = Belief::updated(Some(belief), evidence, seen, 30.0);
        }
        assert_eq!(belief.speed_mps, 35.0);
    }
}
