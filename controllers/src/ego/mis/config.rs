//! The parameters of the margin increase system.

use closecall_traffic::{Check, ConfigError, ENGAGEMENT_CLOSING_MPS, ENGAGEMENT_GAP_M, Num, Parameters, Range};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The margin increase system as a scenario file describes it. Absent keys have the values of
/// the paper.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, default)]
pub struct MisConfig {
    /// Strongest braking (m/s²); 1 if absent.
    pub max_deceleration_mps2: Option<Num>,
    /// Largest rate at which the braking builds up (m/s³); 2 if absent.
    pub max_jerk_mps3: Option<Num>,
    /// Rear gap d_c at which the critical phase begins (m); 5 if absent.
    pub critical_gap_m: Option<Num>,
    /// Front time headway to be gained (s); 2 if absent.
    pub thw_gain_s: Option<Num>,
    /// Front time headway below which the margin counts as short (s); 1.5 if absent.
    pub short_thw_s: Option<Num>,
    /// Largest rear gap at which the system engages (m); 100 if absent.
    pub engage_gap_m: Option<Num>,
    /// Smallest closing speed of the rear vehicle at which the system engages (m/s); 10 km/h if
    /// absent.
    pub engage_closing_mps: Option<Num>,
    /// Longest time for which the ego does not brake for the lead vehicle, from the moment at which
    /// the rear vehicle crosses the marking or is at the critical gap (s): 0 to 10; 2 if absent.
    /// With 0, it always may.
    pub hold_s: Option<Num>,
    /// Worst assumed braking of the lead vehicle, which must leave room while holding (m/s²); 8 if
    /// absent.
    pub worst_front_braking_mps2: Option<Num>,
    /// Smallest time headway from the rear vehicle to a vehicle behind it in the passing lane with
    /// which that lane counts as free (s); 0 if absent. A vehicle within 15 m is in the way in any
    /// case.
    pub follower_headway_s: Option<Num>,
}

/// The time for which the braking is planned.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Horizon {
    /// Until the rear vehicle is at the critical gap while the ego brakes as planned, as in the
    /// paper's figure.
    #[default]
    CriticalGap,
    /// The time to closest encounter at present speeds, as in the paper's text.
    Ttce,
}

/// The checked parameters of the margin increase system.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct MisSettings {
    /// Strongest braking (m/s²).
    pub max_deceleration_mps2: f64,
    /// Largest rate at which the braking builds up (m/s³).
    pub max_jerk_mps3: f64,
    /// Rear gap d_c at which the critical phase begins (m).
    pub critical_gap_m: f64,
    /// Front time headway to be gained (s).
    pub thw_gain_s: f64,
    /// Front time headway below which the margin counts as short (s).
    pub short_thw_s: f64,
    /// Largest rear gap at which the system engages (m).
    pub engage_gap_m: f64,
    /// Smallest closing speed of the rear vehicle at which the system engages (m/s).
    pub engage_closing_mps: f64,
    /// Longest time for which the ego does not brake for the lead vehicle in the critical phase
    /// (s).
    pub hold_s: f64,
    /// Worst assumed braking of the lead vehicle, which must leave room while holding (m/s²).
    pub worst_front_braking_mps2: f64,
    /// Smallest time headway from the rear vehicle to a vehicle behind it in the passing lane with
    /// which that lane counts as free (s).
    pub follower_headway_s: f64,
    /// The time for which the braking is planned.
    #[serde(skip)]
    pub horizon: Horizon,
    /// Whether the ego does not accelerate towards a braking lead vehicle, and the system stays off
    /// if another vehicle follows the rear vehicle closely in the lane of the ego.
    #[serde(skip)]
    pub is_cautious: bool,
    /// Whether the ego brakes by the bound until the goal is in reach without braking, instead of
    /// as gently as the goal allows.
    #[serde(skip)]
    pub is_early: bool,
    /// Speed deficit to the lead vehicle from which on the ego takes no more speed (m/s).
    #[serde(skip)]
    pub max_deficit_mps: f64,
}

impl MisSettings {
    /// The paper's values. Of them, `max_jerk_mps3`, `short_thw_s` and `worst_front_braking_mps2`
    /// are assumptions that the paper does not state; 1 to 5 m/s³, 1 to 2 s and 6 to 9 m/s² are
    /// plausible.
    pub const PAPER: Self = Self {
        max_deceleration_mps2: 1.0,
        max_jerk_mps3: 2.0,
        critical_gap_m: 5.0,
        thw_gain_s: 2.0,
        short_thw_s: 1.5,
        engage_gap_m: ENGAGEMENT_GAP_M,
        engage_closing_mps: ENGAGEMENT_CLOSING_MPS,
        hold_s: 2.0,
        worst_front_braking_mps2: 8.0,
        follower_headway_s: 0.0,
        horizon: Horizon::CriticalGap,
        is_cautious: false,
        is_early: false,
        max_deficit_mps: f64::INFINITY,
    };

    /// Strongest braking of the extended system (m/s²): an assumption. ISO 15622 allows an adaptive
    /// cruise control 3.5 m/s² at highway speeds; the system uses little more than half of it,
    /// since the rear vehicle must follow it; 1 to 3.5 are plausible.
    pub const EXTENDED_MAX_DECELERATION_MPS2: f64 = 2.0;

    /// Largest rate at which the braking of the extended system builds up (m/s³): an assumption,
    /// the jerk that ISO 15622 allows an adaptive cruise control at low speeds; 2.5 (its limit at
    /// highway speeds) to 5 are plausible. At most 2 m/s² are built up, so that the jerk averages
    /// no more than 2 m/s³ over a second.
    pub const EXTENDED_MAX_JERK_MPS3: f64 = 5.0;

    /// Smallest time headway of a vehicle behind the rear vehicle in the passing lane with which
    /// the extended system takes that lane for free (s): an assumption, the distance that automated
    /// lane changes must leave to the vehicle behind in UN Regulation No. 79 (1 s, once speeds are
    /// equal); 0.5 to 2 are plausible. A rear vehicle that cannot pull out stays behind an ego that
    /// has become slower.
    const EXTENDED_FOLLOWER_HEADWAY_S: f64 = 1.0;

    /// Front time headway that the extended system gains (s): an assumption; 2 (the paper's gain) to
    /// 2.5 are plausible. The reserve is for rear vehicles that arrive before the prediction. With
    /// 2.5 s the ego loses 1 s in a mean encounter.
    const EXTENDED_THW_GAIN_S: f64 = 2.25;

    /// Speed deficit to the lead vehicle from which on the extended system takes no more speed (m/s):
    /// an assumption; 7 to 10 are plausible. The gain of 2 s needs about 8 m/s. Requirement MIS-6
    /// allows 10 m/s, to which the release of the brake adds about 1 m/s.
    const EXTENDED_MAX_DEFICIT_MPS: f64 = 8.0;

    /// Returns the settings of the extended system: it gains the margin at once instead of just in
    /// time, may brake harder and builds up the braking faster, does not act if another vehicle
    /// closes the way of the rear vehicle or follows it closely, and brakes for a braking lead
    /// vehicle at once. Every other value stays as it is.
    ///
    /// It engages at the same gap and closing speed. Requirement MIS-9 allows no slowing before: an
    /// ego that slows down earlier gains its margin from vehicles that may never come near.
    ///
    /// The lead vehicle may brake at any time, also before the rear vehicle is at the critical gap.
    /// The gentlest braking that reaches the goal gains most of the margin in the last seconds.
    ///
    /// Braking limit and build-up are the values that determine most how much margin the system
    /// gains until the rear vehicle arrives. A system with larger values already keeps its own.
    #[must_use]
    pub const fn extended(self) -> Self {
        Self {
            max_deceleration_mps2: self.max_deceleration_mps2.max(Self::EXTENDED_MAX_DECELERATION_MPS2),
            max_jerk_mps3: self.max_jerk_mps3.max(Self::EXTENDED_MAX_JERK_MPS3),
            thw_gain_s: self.thw_gain_s.max(Self::EXTENDED_THW_GAIN_S),
            follower_headway_s: self.follower_headway_s.max(Self::EXTENDED_FOLLOWER_HEADWAY_S),
            is_cautious: true,
            is_early: true,
            max_deficit_mps: self.max_deficit_mps.min(Self::EXTENDED_MAX_DEFICIT_MPS),
            ..self
        }
    }
}

impl Check for MisConfig {
    type Checked = MisSettings;

    fn check(&self, parameters: &Parameters) -> Result<MisSettings, ConfigError> {
        self.over(MisSettings::PAPER, parameters)
    }
}

impl MisConfig {
    /// Returns the system with these settings in place of its own.
    pub(crate) fn over(&self, base: MisSettings, parameters: &Parameters) -> Result<MisSettings, ConfigError> {
        let or = |num: &Option<Num>, key, range, default| parameters.number_or(num.as_ref(), key, range, default);
        let braking = Range::above(0.0, 9.0);
        Ok(MisSettings {
            max_deceleration_mps2: or(
                &self.max_deceleration_mps2,
                "max-deceleration-mps2",
                braking,
                base.max_deceleration_mps2,
            )?,
            max_jerk_mps3: or(&self.max_jerk_mps3, "max-jerk-mps3", Range::above(0.0, 50.0), base.max_jerk_mps3)?,
            critical_gap_m: or(&self.critical_gap_m, "critical-gap-m", Range::closed(0.0, 50.0), base.critical_gap_m)?,
            thw_gain_s: or(&self.thw_gain_s, "thw-gain-s", Range::above(0.0, 10.0), base.thw_gain_s)?,
            short_thw_s: or(&self.short_thw_s, "short-thw-s", Range::above(0.0, 10.0), base.short_thw_s)?,
            engage_gap_m: or(&self.engage_gap_m, "engage-gap-m", Range::above(0.0, 300.0), base.engage_gap_m)?,
            engage_closing_mps: or(
                &self.engage_closing_mps,
                "engage-closing-mps",
                Range::above(0.0, 50.0),
                base.engage_closing_mps,
            )?,
            hold_s: or(&self.hold_s, "hold-s", Range::closed(0.0, 10.0), base.hold_s)?,
            worst_front_braking_mps2: or(
                &self.worst_front_braking_mps2,
                "worst-front-braking-mps2",
                braking,
                base.worst_front_braking_mps2,
            )?,
            follower_headway_s: or(
                &self.follower_headway_s,
                "follower-headway-s",
                Range::closed(0.0, 5.0),
                base.follower_headway_s,
            )?,
            ..base
        })
    }
}
