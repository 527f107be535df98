//! Configuration of an overtaking driver.

use closecall_traffic::{Check, ConfigError, Num, Parameters, Problem, Range};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::driver::OvertakerDriver;
use super::returning::{Return, ReturnConfig};
use crate::driver::attention::{Lapse, LapseConfig, check_lapse};
use crate::driver::reaction::{Reaction, ReactionConfig};
use crate::driver::{Wiedemann99, Wiedemann99Config};

/// Default duration of a whole lane change (s): the mean in recorded traffic.
const DEFAULT_DURATION_S: f64 = 6.8;

/// Default lateral acceleration that a driver accepts in evasive steering, to be clear earlier (m/s²).
///
/// In an emergency, drivers brake far more than they steer, and use little of the lateral grip (Adams, *Review of the
/// literature on obstacle avoidance maneuvers: braking versus steering*, UMTRI-94-19, 1994). The value decides how many
/// encounters end in a collision. Without a margin increase system, these are 31 % of the samples with 0, 20 % with 1,
/// and 11 % with 2 (`examples/validate_margin_increase.rs`, 1000 samples, seed 1).
const DEFAULT_EVASIVE_LATERAL_MPS2: f64 = 1.0;

/// Car-following model of an overtaking driver.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum FollowConfig {
    /// The Wiedemann 99 model.
    Wiedemann99(Wiedemann99Config),
}

/// An overtaking driver as a scenario file describes it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct OvertakerConfig {
    /// Time headway to the vehicle ahead when the centre of the driver's vehicle crosses the lane marking (s).
    pub cut_out_thw_s: Num,
    /// Car-following model while the driver cannot overtake. Its safe gap is also the smallest gap that the driver
    /// accepts while pulling out.
    pub follow: FollowConfig,
    /// Reaction time (s).
    pub reaction_s: ReactionConfig,
    /// Duration of the whole lane change (s). Default: 6.8.
    pub lane_change_duration_s: Option<Num>,
    /// Lateral acceleration accepted in evasive steering, to be clear earlier than planned (m/s²). Default: 1. With 0,
    /// the driver only brakes.
    pub evasive_lateral_mps2: Option<Num>,
    /// Lapses of attention. Default: none.
    pub lapse: Option<LapseConfig>,
    /// Return to the original lane after passing. Without it, the driver stays in the passing lane.
    pub returns: Option<ReturnConfig>,
}

/// A checked overtaking driver.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Overtaker {
    pub(crate) cut_out_thw_s: f64,
    pub(crate) follow: Wiedemann99,
    pub(crate) reaction: Reaction,
    pub(crate) duration_s: f64,
    pub(crate) evasive_lateral_mps2: f64,
    pub(crate) lapse: Option<Lapse>,
    pub(crate) returns: Option<Return>,
}

impl Overtaker {
    /// Checks that a driver who follows a vehicle at `speed_mps` comes close enough to reach the cut-out time headway.
    ///
    /// # Errors
    /// Returns a [`ConfigError`] that names the key if the safe gap cc0 + cc1·v exceeds the gap of the cut-out time
    /// headway at this speed.
    pub fn check_reach(&self, speed_mps: f64) -> Result<(), ConfigError> {
        let following_m = self.follow.safe_gap_m(speed_mps);
        let wanted_m = self.cut_out_thw_s * speed_mps;
        // Written so that NaN is an error.
        if following_m <= wanted_m {
            return Ok(());
        }
        let rule = format!(
            "at {speed_mps:.1} m/s the driver follows at {following_m:.1} m or more (cc0 + cc1·v), and so never comes to \
             the {wanted_m:.1} m at which it would cut out"
        );
        Err(ConfigError::new("cut-out-thw-s", Problem::Contradiction { other: "follow", rule }))
    }

    /// Creates a driver for one run.
    pub(crate) fn driver(&self) -> OvertakerDriver {
        OvertakerDriver::new(*self)
    }
}

impl Check for OvertakerConfig {
    type Checked = Overtaker;

    /// Checks what does not depend on speeds. [`Overtaker::check_reach`] checks the rest once the speeds are known.
    fn check(&self, parameters: &Parameters) -> Result<Overtaker, ConfigError> {
        let cut_out_thw_s = parameters.number(&self.cut_out_thw_s, "cut-out-thw-s", Range::above(0.0, 5.0))?;
        let FollowConfig::Wiedemann99(config) = &self.follow;
        let locate = |error: ConfigError| error.within("wiedemann99").within("follow");
        let follow = config.check(parameters).map_err(locate)?;
        if follow.reaction.is_some() {
            let rule = "the overtaking driver has one reaction time, which stands beside `follow`".to_owned();
            let problem = Problem::Contradiction { other: "overtaker.reaction-s", rule };
            return Err(locate(ConfigError::new("reaction-s", problem)));
        }
        if follow.parameters.cc1_s >= cut_out_thw_s {
            let rule =
                "cc1 is no less than the cut-out headway, so that the driver never comes close enough".to_owned();
            return Err(ConfigError::new("cut-out-thw-s", Problem::Contradiction { other: "follow", rule }));
        }
        let evasive_lateral_mps2 = match &self.evasive_lateral_mps2 {
            Some(num) => parameters.number(num, "evasive-lateral-mps2", Range::closed(0.0, 8.0))?,
            None => DEFAULT_EVASIVE_LATERAL_MPS2,
        };
        let duration_s = match &self.lane_change_duration_s {
            Some(num) => parameters.number(num, "lane-change-duration-s", Range::closed(1.5, 20.0))?,
            None => DEFAULT_DURATION_S,
        };
        Ok(Overtaker {
            cut_out_thw_s,
            follow,
            reaction: self.reaction_s.check(parameters)?,
            duration_s,
            evasive_lateral_mps2,
            lapse: check_lapse(self.lapse.as_ref(), true, parameters)?,
            returns: self.returns.as_ref().map(|config| config.check(parameters)).transpose()?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn config(cut_out_thw_s: f64, cc1_s: f64) -> OvertakerConfig {
        OvertakerConfig {
            cut_out_thw_s: cut_out_thw_s.into(),
            follow: FollowConfig::Wiedemann99(Wiedemann99Config { cc1_s: Some(cc1_s.into()), ..Default::default() }),
            reaction_s: ReactionConfig::Value(0.9.into()),
            lane_change_duration_s: None,
            evasive_lateral_mps2: None,
            lapse: None,
            returns: None,
        }
    }

    #[test]
    fn a_safe_gap_above_the_cut_out_gap_is_refused() {
        let none = Parameters::default();
        let error = config(0.3, 0.9).check(&none).unwrap_err();
        assert_eq!(error.path.to_string(), "cut-out-thw-s");
        // At 30 m/s the safe gap is 1.5 m + 0.05 s · 30 m/s = 3 m, and 0.15 s are 4.5 m. At 15 m/s both are 2.25 m.
        let driver = config(0.15, 0.05).check(&none).unwrap();
        assert_eq!(driver.check_reach(30.0), Ok(()));
        assert!(driver.check_reach(10.0).is_err());
        assert!(driver.check_reach(f64::NAN).is_err());
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
