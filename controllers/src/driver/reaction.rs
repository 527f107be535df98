//! Reaction time of a driver: a fixed value, a parameter, or drawn once per run from the driver's
//! own random stream.
//!
//! Green (*How long does it take to stop?*, Transportation Human Factors 2 (2000) 195–216) gives
//! these brake reaction times:
//!
//! | situation | mean |
//! |---|---|
//! | expected, the driver is fully aware | 0.70 to 0.75 s |
//! | unexpected but common, such as the brake lights of the vehicle ahead | about 1.25 s |
//! | surprise, such as an object that moves into the path | about 1.5 s |
//!
//! Urgency shortens them: at a short time to the stop line the median is *rather below* 1.0 s
//! instead of 1.25 s, and at a time to collision of about 4 s the mean is 1.0 to 1.3 s instead of
//! 1.5 s (Summala, *Brake reaction times and driver behavior analysis*, ibid. 217–226, abstract).
//! [`shortened_by_urgency`] defines the reaction time in between. Green gives no distribution. The
//! log-normal form is an assumption, and so is a σ of 0.3 to 0.4.

use std::fmt;

use closecall_traffic::{Check, ConfigError, Num, Parameters, Range, StandardNormal, Stream, maths};
use rand::distr::Distribution;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::value::MapAccessDeserializer;
use serde::de::{self, IntoDeserializer, MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

/// Longest reaction time (s): an assumption. The memory of the perception has this length.
pub(crate) const MAX_REACTION_S: f64 = 3.0;

/// Share of the reaction time that is left in an urgent situation (-): 1.0 s of 1.25 s, and in the
/// mean of its range 1.15 s of 1.5 s (Summala 2000). Range: 0.67 to 0.87.
const URGENT_SHARE: f64 = 0.8;

/// 1/TTC of an urgent situation (1/s): a time to collision of 4 s (Summala 2000).
const URGENT_PER_S: f64 = 0.25;

/// 1/TTC up to which a situation is not urgent (1/s): at this value, drivers begin ordinary braking
/// (Kiefer et al. 2003).
const ORDINARY_PER_S: f64 = 0.10;

/// Returns the reaction time (s) of a driver at this 1/TTC to the vehicle ahead: `reaction_s` up to
/// the value at which drivers brake in ordinary driving, [`URGENT_SHARE`] of it in an urgent
/// situation, and linear in between.
pub(crate) fn shortened_by_urgency(reaction_s: f64, inverse_ttc_per_s: f64) -> f64 {
    let urgency = ((inverse_ttc_per_s - ORDINARY_PER_S) / (URGENT_PER_S - ORDINARY_PER_S)).clamp(0.0, 1.0);
    reaction_s * (1.0 - urgency * (1.0 - URGENT_SHARE))
}

/// A log-normal distribution, given by its median and the standard deviation of its logarithm.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct LogNormalConfig {
    /// Median (s): above 0, at most 3.
    pub median: Num,
    /// Standard deviation of the logarithm: 0 to 1.
    pub sigma: Num,
}

/// A reaction time as a scenario file describes it: a number, `"$parameter"`, or
/// `{ log-normal = { median, sigma } }`.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum ReactionConfig {
    /// A distribution from which the reaction time is drawn once per run.
    LogNormal(LogNormalConfig),
    /// The value itself, or a parameter that gives it (s).
    #[serde(untagged)]
    Value(Num),
}

struct ReactionVisitor;

/// The variants of [`ReactionConfig`] that are written as a table.
#[derive(Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
enum Drawn {
    LogNormal(LogNormalConfig),
}

impl<'de> Visitor<'de> for ReactionVisitor {
    type Value = ReactionConfig;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a number, a parameter such as \"$name\", or { log-normal = { median, sigma } }")
    }

    fn visit_f64<E: de::Error>(self, value: f64) -> Result<ReactionConfig, E> {
        Num::deserialize(value.into_deserializer()).map(ReactionConfig::Value)
    }

    fn visit_i64<E: de::Error>(self, value: i64) -> Result<ReactionConfig, E> {
        Num::deserialize(value.into_deserializer()).map(ReactionConfig::Value)
    }

    fn visit_u64<E: de::Error>(self, value: u64) -> Result<ReactionConfig, E> {
        Num::deserialize(value.into_deserializer()).map(ReactionConfig::Value)
    }

    fn visit_str<E: de::Error>(self, text: &str) -> Result<ReactionConfig, E> {
        Num::deserialize(text.into_deserializer()).map(ReactionConfig::Value)
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<ReactionConfig, A::Error> {
        let Drawn::LogNormal(config) = Drawn::deserialize(MapAccessDeserializer::new(map))?;
        Ok(ReactionConfig::LogNormal(config))
    }
}

impl<'de> Deserialize<'de> for ReactionConfig {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(ReactionVisitor)
    }
}

impl JsonSchema for ReactionConfig {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Reaction".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let value = generator.subschema_for::<Num>();
        let drawn = generator.subschema_for::<Drawn>();
        json_schema!({ "anyOf": [value, drawn] })
    }
}

/// A checked reaction time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reaction {
    /// The same value in every run (s): 0 to 3.
    Fixed(f64),
    /// Drawn once per run.
    LogNormal {
        /// Median (s), above 0.
        median_s: f64,
        /// Standard deviation of the logarithm, at least 0.
        sigma: f64,
        /// Time by which the driver reacts later than drawn (s).
        later_s: f64,
    },
}

/// A change of the reaction of a driver.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ReactionChange {
    /// The driver reacts at once to what it sees, and never looks away.
    AtOnce,
    /// The driver reacts this much later (s), but at most 3 s after the event.
    Later(f64),
}

impl Reaction {
    /// Returns the value, or the median of the drawn values (s).
    pub(crate) fn typical_s(self) -> f64 {
        match self {
            Self::Fixed(value) => value,
            Self::LogNormal { median_s, later_s, .. } => median_s + later_s,
        }
    }

    /// Returns the changed reaction time.
    #[must_use]
    pub(crate) fn changed(self, change: ReactionChange) -> Self {
        match (self, change) {
            (_, ReactionChange::AtOnce) => Self::Fixed(0.0),
            (Self::Fixed(value), ReactionChange::Later(later_s)) => Self::Fixed((value + later_s).min(MAX_REACTION_S)),
            (Self::LogNormal { median_s, sigma, .. }, ReactionChange::Later(later_s)) => {
                Self::LogNormal { median_s, sigma, later_s }
            }
        }
    }

    /// Returns the reaction time of one driver in one run (s), at most 3 s.
    pub fn draw_s(self, rng: &mut Stream) -> f64 {
        match self {
            Self::Fixed(value) => value,
            Self::LogNormal { median_s, sigma, later_s } => {
                let normal: f64 = StandardNormal.sample(rng);
                (median_s * maths::exp(sigma * normal) + later_s).min(MAX_REACTION_S)
            }
        }
    }
}

impl Check for ReactionConfig {
    type Checked = Reaction;

    fn check(&self, parameters: &Parameters) -> Result<Reaction, ConfigError> {
        match self {
            Self::Value(num) => {
                let value = parameters.number(num, "reaction-s", Range::closed(0.0, MAX_REACTION_S))?;
                Ok(Reaction::Fixed(value))
            }
            Self::LogNormal(config) => {
                let locate = |error: ConfigError| error.within("log-normal").within("reaction-s");
                let range = Range::above(0.0, MAX_REACTION_S);
                let median_s = parameters.number(&config.median, "median", range).map_err(locate)?;
                let sigma = parameters.number(&config.sigma, "sigma", Range::UNIT).map_err(locate)?;
                Ok(Reaction::LogNormal { median_s, sigma, later_s: 0.0 })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use closecall_traffic::{ActorId, stream};

    use super::*;

    #[test]
    fn a_drawn_reaction_time_has_the_given_median() {
        let mut rng = stream(0, 0, &ActorId::new("rear").unwrap(), "driver");
        let reaction = Reaction::LogNormal { median_s: 0.9, sigma: 0.3, later_s: 0.0 };
        let mut drawn: Vec<f64> = (0..4001).map(|_| reaction.draw_s(&mut rng)).collect();
        drawn.sort_by(f64::total_cmp);
        assert!((drawn[2000] - 0.9).abs() < 0.02, "{}", drawn[2000]);
        // The 84th percentile of a log-normal lies one sigma above the median in the logarithm.
        assert!((drawn[3366] / drawn[2000] - maths::exp(0.3)).abs() < 0.03);
    }

    #[test]
    fn a_short_time_to_collision_shortens_the_reaction_time() {
        assert_eq!(shortened_by_urgency(1.25, 0.0), 1.25);
        assert_eq!(shortened_by_urgency(1.25, -1.0), 1.25);
        assert_eq!(shortened_by_urgency(1.25, 0.25), 1.0);
        assert_eq!(shortened_by_urgency(1.25, f64::INFINITY), 1.0);
        assert!((shortened_by_urgency(1.25, 0.175) - 1.125).abs() < 1e-12);
    }

    #[test]
    fn an_error_names_the_key_that_is_out_of_range() {
        let none = Parameters::default();
        let error = ReactionConfig::Value(Num::Fixed(-0.1)).check(&none).unwrap_err();
        assert_eq!(error.path.to_string(), "reaction-s");
        let config = LogNormalConfig { median: Num::Fixed(0.0), sigma: Num::Fixed(0.3) };
        let error = ReactionConfig::LogNormal(config).check(&none).unwrap_err();
        assert_eq!(error.path.to_string(), "reaction-s.log-normal.median");
    }
}
