//! Automatic emergency braking: brakes only if the required deceleration demands it.
//!
//! The required deceleration is the constant deceleration with which the ego just keeps a small gap
//! to the lead vehicle, if that vehicle continues to brake as it does now
//! ([`Front::required_braking_mps2`]).
//!
//! The system starts to brake if the required deceleration exceeds a threshold. It commands the
//! required deceleration plus a margin, until the required deceleration is below a lower threshold.
//! The friction limit is applied by the vehicle model, not here.

use closecall_traffic::{Check, ConfigError, Num, Parameters, Range};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::surroundings::Front;

/// Ratio of commanded to required deceleration: an assumption; 1 to 1.5 are plausible.
const BRAKING_MARGIN: f64 = 1.15;

/// Required deceleration below which emergency braking ends (m/s²): an assumption; 0.5 to 3 are
/// plausible.
const RELEASE_THRESHOLD_MPS2: f64 = 1.5;

/// Speed below which the ego counts as standing (m/s): numerical.
const STANDSTILL_MPS: f64 = 0.1;

/// Braking that holds the ego at standstill (m/s²): an assumption without effect on a level road.
const HOLDING_BRAKE_MPS2: f64 = 2.0;

/// Emergency braking as a scenario file describes it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, default)]
pub struct AebConfig {
    /// Required deceleration above which it brakes (m/s²); 4 if absent: an assumption. Regulation
    /// (EU) 347/2012 demands at least this much in the emergency phase of heavy vehicles.
    pub trigger_mps2: Option<Num>,
    /// Strongest braking (m/s²); 9 if absent: an assumption, the friction of a dry road.
    pub max_deceleration_mps2: Option<Num>,
    /// Gap to be left at standstill (m); 2 if absent: an assumption; 1 to 5 are plausible.
    pub standstill_gap_m: Option<Num>,
}

/// The checked emergency braking.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Aeb {
    trigger_mps2: f64,
    max_deceleration_mps2: f64,
    standstill_gap_m: f64,
}

impl Check for AebConfig {
    type Checked = Aeb;

    fn check(&self, parameters: &Parameters) -> Result<Aeb, ConfigError> {
        self.over(Aeb::DEFAULT, parameters)
    }
}

impl AebConfig {
    /// Returns emergency braking with these settings in place of its own.
    pub(crate) fn over(&self, base: Aeb, parameters: &Parameters) -> Result<Aeb, ConfigError> {
        let or = |num: &Option<Num>, key, range, default| parameters.number_or(num.as_ref(), key, range, default);
        Ok(Aeb {
            trigger_mps2: or(&self.trigger_mps2, "trigger-mps2", Range::closed(2.0, 9.0), base.trigger_mps2)?,
            max_deceleration_mps2: or(
                &self.max_deceleration_mps2,
                "max-deceleration-mps2",
                Range::above(2.0, 12.0),
                base.max_deceleration_mps2,
            )?,
            standstill_gap_m: or(
                &self.standstill_gap_m,
                "standstill-gap-m",
                Range::closed(0.0, 10.0),
                base.standstill_gap_m,
            )?,
        })
    }
}

impl Aeb {
    /// Emergency braking of a scenario that states no values.
    pub(crate) const DEFAULT: Self = Self { trigger_mps2: 4.0, max_deceleration_mps2: 9.0, standstill_gap_m: 2.0 };

    /// Returns the braking that is needed from now on (m/s²); 0 if none is needed.
    pub(crate) fn required_mps2(&self, speed_mps: f64, lead: &Front) -> f64 {
        lead.required_braking_mps2(speed_mps, self.standstill_gap_m)
    }

    /// Returns the braking to apply (m/s²), or `None` if none is due. `was_braking` says whether
    /// the system braked at the previous step.
    pub(crate) fn braking_mps2(&self, was_braking: bool, speed_mps: f64, lead: Option<&Front>) -> Option<f64> {
        let required = lead.map_or(0.0, |lead| self.required_mps2(speed_mps, lead));
        if was_braking && speed_mps < STANDSTILL_MPS {
            let still_near = lead.is_some_and(|lead| lead.speed_mps < 1.0);
            return still_near.then_some(HOLDING_BRAKE_MPS2);
        }
        let threshold = if was_braking { RELEASE_THRESHOLD_MPS2 } else { self.trigger_mps2 };
        (required > threshold).then(|| (BRAKING_MARGIN * required).min(self.max_deceleration_mps2))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const AEB: Aeb = Aeb { trigger_mps2: 4.0, max_deceleration_mps2: 9.0, standstill_gap_m: 2.0 };

    fn lead(gap_m: f64, speed_mps: f64, acceleration_mps2: f64) -> Front {
        Front { acceleration_mps2, ..Front::new(gap_m, speed_mps) }
    }

    #[test]
    fn following_closely_is_no_emergency() {
        assert_eq!(AEB.braking_mps2(false, 33.0, Some(&lead(17.0, 33.0, 0.0))), None);
        assert_eq!(AEB.braking_mps2(false, 33.0, Some(&lead(17.0, 33.0, -2.0))), None);
    }

    #[test]
    fn a_hard_braking_lead_vehicle_triggers_braking_that_latches() {
        let braking = AEB.braking_mps2(false, 33.0, Some(&lead(17.0, 33.0, -8.0))).unwrap();
        assert!(braking > 6.0 && braking <= 9.0, "{braking}");
        assert!(AEB.braking_mps2(true, 30.0, Some(&lead(17.0, 28.0, -3.0))).is_some());
        assert_eq!(AEB.braking_mps2(true, 20.0, Some(&lead(17.0, 25.0, 0.0))), None);
    }

    proptest! {
        /// The required braking leaves exactly the standstill gap; checked by time-stepping both
        /// vehicles.
        #[test]
        fn the_required_braking_just_suffices(
            gap in 6.0..80.0, ego_mps in 5.0..40.0, faster in -5.0..15.0, braking in 0.5..9.0_f64,
        ) {
            let lead_mps = f64::max(ego_mps - faster, 0.5);
            let required = AEB.required_mps2(ego_mps, &lead(gap, lead_mps, -braking));
            prop_assume!(required > 0.0 && required < 20.0);
            let (step, mut e, mut f, mut least) = (1e-3, (0.0, ego_mps), (gap, lead_mps), gap);
            while e.1 > 0.0 {
                e = (e.0 + e.1 * step, (e.1 - required * step).max(0.0));
                f = (f.0 + f.1 * step, (f.1 - braking * step).max(0.0));
                least = f64::min(least, f.0 - e.0);
            }
            prop_assert!((least - 2.0).abs() < 0.2, "{least} with {required}");
        }
    }
}
