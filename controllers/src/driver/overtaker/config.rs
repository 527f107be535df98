//! Configuration of an overtaking driver.

use closecall_traffic::metrics::CRITICAL_THW_S;
use closecall_traffic::{Check, ConfigError, Num, Parameters, Problem, Range};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::driver::OvertakerDriver;
use super::follow::{Follow, FollowConfig};
use super::returning::{Return, ReturnConfig};
use crate::driver::attention::{Lapse, LapseConfig, check_lapse};
use crate::driver::pedals::check_brake_build_up;
use crate::driver::perception::{PerceptionConfig, PerceptionSettings, check_perception};
use crate::driver::reaction::{Reaction, ReactionChange, ReactionConfig};

/// Default duration of a whole lane change (s): the mean of 7,192 single lane changes of commuters,
/// with a standard deviation of 2.0 s (Lee, Olsen and Wierwille, *A Comprehensive Examination of
/// Naturalistic Lane-Changes*, DOT HS 809 702, 2004). Range for an ensemble: 3 to 10.
const DEFAULT_DURATION_S: f64 = 6.3;

/// Default lateral acceleration that a driver accepts in evasive steering, to be clear earlier
/// (m/s²).
///
/// The mean of 61 drivers who steered around an obstacle that appeared without warning at 80 km/h,
/// with a standard deviation of 1.4 m/s² (Weir and McRuer 1976, SAE 766060, as quoted at
/// mfes.com/avoidance.html). Range for an ensemble: 1 to 4.5, and 0 for drivers who only brake. In
/// an emergency, drivers brake more often than they steer (Adams, *Review of the literature on
/// obstacle avoidance maneuvers: braking versus steering*, UMTRI-94-19, 1994); no source for the
/// share was found. The plant limits the steering to half of the friction, 4.4 m/s² on a dry road.
const DEFAULT_EVASIVE_LATERAL_MPS2: f64 = 4.3;

/// An overtaking driver as a scenario file describes it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct OvertakerConfig {
    /// Time headway to the vehicle ahead when the centre of the driver's vehicle crosses the lane
    /// marking (s): 0 to 5. A driver whose safe gap cc0 + cc1·v is larger pulls out earlier, so as
    /// to keep that gap. With 0, the safe gap alone decides.
    pub cut_out_thw_s: Num,
    /// Car-following model while the driver cannot overtake. Its safe gap is also the smallest gap
    /// that the driver accepts while pulling out.
    pub follow: FollowConfig,
    /// Reaction time (s).
    pub reaction_s: ReactionConfig,
    /// Duration of the whole lane change (s). Default: 6.3.
    pub lane_change_duration_s: Option<Num>,
    /// Lateral acceleration accepted in evasive steering, to be clear earlier than planned (m/s²):
    /// 0 to 8. Default: 4.3. With 0, the driver only brakes.
    pub evasive_lateral_mps2: Option<Num>,
    /// Lapses of attention. Default: none.
    pub lapse: Option<LapseConfig>,
    /// How the driver perceives the vehicles ahead.
    pub perception: Option<PerceptionConfig>,
    /// Rate at which the driver builds up braking (m/s³): 1 to 100. Default: 12.65.
    pub brake_build_up_mps3: Option<Num>,
    /// Return to the original lane after passing. Without it, the driver stays in the passing lane.
    pub returns: Option<ReturnConfig>,
}

/// A checked overtaking driver.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Overtaker {
    pub(crate) cut_out_thw_s: f64,
    pub(crate) follow: Follow,
    pub(crate) reaction: Reaction,
    pub(crate) duration_s: f64,
    pub(crate) evasive_lateral_mps2: f64,
    pub(crate) lapse: Option<Lapse>,
    pub(crate) perception: PerceptionSettings,
    pub(crate) brake_build_up_mps3: f64,
    pub(crate) returns: Option<Return>,
}

impl Overtaker {
    /// Returns the same driver with another reaction.
    #[must_use]
    pub(crate) fn reacting(self, change: ReactionChange) -> Self {
        let lapse = self.lapse.filter(|_| change != ReactionChange::AtOnce);
        let reaction = self.reaction.changed(change);
        Self { reaction, perception: self.perception.changed(change), lapse, ..self }
    }

    /// Creates a driver for one run.
    pub(crate) fn driver(&self) -> OvertakerDriver {
        OvertakerDriver::new(*self)
    }
}

impl Check for OvertakerConfig {
    type Checked = Overtaker;

    fn check(&self, parameters: &Parameters) -> Result<Overtaker, ConfigError> {
        let cut_out_thw_s = parameters.number(&self.cut_out_thw_s, "cut-out-thw-s", Range::closed(0.0, 5.0))?;
        let follow = self.follow.check(parameters)?;
        let headway_s = follow.headway_s();
        if headway_s >= CRITICAL_THW_S && headway_s >= cut_out_thw_s {
            let rule = format!(
                "cc1 (the time gap of `idm`) is no less than the cut-out headway, and not below the critical {CRITICAL_THW_S} s: the driver never \
                 comes close"
            );
            return Err(ConfigError::new("cut-out-thw-s", Problem::Contradiction { other: "follow", rule }));
        }
        let number_or =
            |num: &Option<Num>, key, range, default| parameters.number_or(num.as_ref(), key, range, default);
        let evasive_lateral_mps2 = number_or(
            &self.evasive_lateral_mps2,
            "evasive-lateral-mps2",
            Range::closed(0.0, 8.0),
            DEFAULT_EVASIVE_LATERAL_MPS2,
        )?;
        let duration = &self.lane_change_duration_s;
        let duration_s = number_or(duration, "lane-change-duration-s", Range::closed(1.5, 20.0), DEFAULT_DURATION_S)?;
        Ok(Overtaker {
            cut_out_thw_s,
            follow,
            reaction: self.reaction_s.check(parameters)?,
            duration_s,
            evasive_lateral_mps2,
            lapse: check_lapse(self.lapse.as_ref(), true, parameters)?,
            perception: check_perception(self.perception.as_ref(), true, parameters)?,
            brake_build_up_mps3: check_brake_build_up(self.brake_build_up_mps3.as_ref(), true, parameters)?,
            returns: self.returns.as_ref().map(|config| config.check(parameters)).transpose()?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::driver::testing::overtaker_config as config;
    use crate::driver::{IdmConfig, Wiedemann99Config};

    #[test]
    fn a_safe_gap_above_the_cut_out_gap_is_allowed() {
        let none = Parameters::default();
        assert_eq!(config(0.15, 0.2).check(&none).unwrap().follow.headway_s(), 0.2);
        assert_eq!(config(0.0, 0.2).check(&none).unwrap().cut_out_thw_s, 0.0);
        assert!(config(-0.1, 0.2).check(&none).is_err());
        let error = config(0.3, 0.9).check(&none).unwrap_err();
        assert_eq!(error.path.to_string(), "cut-out-thw-s");
    }

    #[test]
    fn the_intelligent_driver_model_gives_the_safe_gap_and_the_braking_of_an_overtaking_driver() {
        let idm = IdmConfig {
            time_gap_s: Some(0.2.into()),
            standstill_gap_m: Some(1.0.into()),
            hardest_braking_mps2: Some(5.0.into()),
            ..IdmConfig::default()
        };
        let config = OvertakerConfig { follow: FollowConfig::Idm(idm), ..config(0.3, 0.05) };
        let follow = config.check(&Parameters::default()).unwrap().follow;
        assert_eq!((follow.safe_gap_m(30.0), follow.hardest_braking_mps2()), (7.0, 5.0));
        // Braking is limited to the hardest of the driver, however small the gap is.
        let lead = crate::driver::Lead { gap_m: 0.5, speed_mps: 20.0, acceleration_mps2: 0.0 };
        assert_eq!(follow.model().acceleration_mps2(30.0, 35.0, Some(&lead)), -5.0);
    }

    #[test]
    fn a_second_reaction_time_is_refused() {
        let follow = Wiedemann99Config {
            cc1_s: Some(0.05.into()),
            reaction_s: Some(ReactionConfig::Value(0.9.into())),
            ..Default::default()
        };
        let config = OvertakerConfig { follow: FollowConfig::Wiedemann99(follow), ..config(0.3, 0.05) };
        let error = config.check(&Parameters::default()).unwrap_err();
        assert_eq!(error.path.to_string(), "follow.wiedemann99.reaction-s");
    }
}
