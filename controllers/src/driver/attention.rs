//! Lapses of attention: a driver who looks away observes nothing new, and assumes that traffic
//! continues unchanged.
//!
//! Eyes off the road for more than 2 s in total double the risk of a crash or near-crash (Klauer et
//! al., *The Impact of Driver Inattention on Near-Crash/Crash Risk*, DOT HS 810 594, 2006, as later
//! work quotes it). A lapse does not depend on the traffic: it begins at a time that the scenario
//! gives, or at random times with a given mean interval, drawn from the driver's own random stream.

use closecall_traffic::{Check, ConfigError, Num, Parameters, Problem, Range, StandardNormal, Stream, Time, maths};
use rand::{RngExt, distr::Distribution};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Longest duration of a lapse (s): a limit of the configuration.
const MAX_LAPSE_S: f64 = 30.0;

/// Lapses of attention as a scenario file describes them. Exactly one of `at-s` and `every-s` is
/// given.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct LapseConfig {
    /// Time at which the driver looks away, once (s).
    pub at_s: Option<Num>,
    /// Mean time from the end of one random lapse to the start of the next (s).
    pub every_s: Option<Num>,
    /// Duration for which the driver looks away (s): 0 to 30. With `duration-sigma`, the median of
    /// it.
    pub duration_s: Num,
    /// Standard deviation of the logarithm of the duration, which is then drawn anew for each
    /// lapse: 0 to 2. Default: each lapse has the same duration.
    pub duration_sigma: Option<Num>,
}

/// Checked lapses of attention.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lapse {
    timing: LapseTiming,
    duration_s: f64,
    duration_sigma: Option<f64>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum LapseTiming {
    Once { at_s: f64 },
    AtRandom { every_s: f64 },
}

impl Check for LapseConfig {
    type Checked = Lapse;

    fn check(&self, parameters: &Parameters) -> Result<Lapse, ConfigError> {
        let number = |num, key, range| parameters.number(num, key, range).map_err(|error| error.within("lapse"));
        let timing = match (&self.at_s, &self.every_s) {
            (Some(at), None) => LapseTiming::Once { at_s: number(at, "at-s", Range::closed(0.0, 3_600.0))? },
            (None, Some(every)) => {
                LapseTiming::AtRandom { every_s: number(every, "every-s", Range::closed(0.1, 3_600.0))? }
            }
            (Some(_), Some(_)) => {
                let rule = "only one of the two may be given".to_owned();
                let problem = Problem::Contradiction { other: "every-s", rule };
                return Err(ConfigError::new("at-s", problem).within("lapse"));
            }
            (None, None) => {
                let needed = "one of `at-s` and `every-s`";
                return Err(ConfigError::new("at-s", Problem::Missing { needed }).within("lapse"));
            }
        };
        let duration_s = number(&self.duration_s, "duration-s", Range::closed(0.0, MAX_LAPSE_S))?;
        let sigma = self.duration_sigma.as_ref();
        let duration_sigma = sigma.map(|num| number(num, "duration-sigma", Range::closed(0.0, 2.0))).transpose()?;
        Ok(Lapse { timing, duration_s, duration_sigma })
    }
}

/// Checks the lapses of a driver. They need a driver with a reaction time (`perceives`): a driver
/// without one uses the true state of traffic at each step.
pub(crate) fn check_lapse(
    lapse: Option<&LapseConfig>,
    perceives: bool,
    parameters: &Parameters,
) -> Result<Option<Lapse>, ConfigError> {
    match lapse {
        Some(_) if !perceives => {
            let rule = "without a reaction time the driver knows the truth at once, and cannot miss any".to_owned();
            Err(ConfigError::new("lapse", Problem::Contradiction { other: "reaction-s", rule }))
        }
        lapse => lapse.map(|config| config.check(parameters)).transpose(),
    }
}

/// State of one driver's attention during a run.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Attention {
    lapse: Option<Lapse>,
    /// Start and end of the present or next lapse; `None` until it is drawn.
    next: Option<(Time, Time)>,
}

impl Attention {
    pub(crate) fn new(lapse: Option<Lapse>) -> Self {
        Self { lapse, next: None }
    }

    /// Returns true while the driver looks away.
    pub(crate) fn is_looking_away(&mut self, now: Time, rng: &mut Stream) -> bool {
        let Some(lapse) = self.lapse else { return false };
        let (begin, end) = *self.next.get_or_insert_with(|| lapse.after(now, rng));
        if now >= end && matches!(lapse.timing, LapseTiming::AtRandom { .. }) {
            self.next = Some(lapse.after(now, rng));
            return false;
        }
        (begin..end).contains(&now)
    }
}

impl Lapse {
    /// Returns the start and end of the next lapse after `now`.
    fn after(&self, now: Time, rng: &mut Stream) -> (Time, Time) {
        let begin = match self.timing {
            LapseTiming::Once { at_s } => Time::from_s(at_s),
            // The intervals of a Poisson process are exponential. The argument 1 − u is never 0.
            LapseTiming::AtRandom { every_s } => now + Time::from_s(-every_s * maths::ln(1.0 - rng.random::<f64>())),
        };
        (begin, begin + Time::from_s(self.draw_duration_s(rng)))
    }
}

impl Lapse {
    /// Returns the duration of one lapse (s).
    fn draw_duration_s(&self, rng: &mut Stream) -> f64 {
        let Some(sigma) = self.duration_sigma else { return self.duration_s };
        let normal: f64 = StandardNormal.sample(rng);
        (self.duration_s * maths::exp(sigma * normal)).min(MAX_LAPSE_S)
    }
}

#[cfg(test)]
mod tests {
    use closecall_traffic::{ActorId, PHYSICS_STEP, stream};

    use super::*;

    fn away_s(config: &LapseConfig, until_s: f64) -> (f64, Option<Time>) {
        let mut attention = Attention::new(Some(config.check(&Parameters::default()).unwrap()));
        let mut rng = stream(0, 0, &ActorId::new("rear").unwrap(), "driver");
        let (mut now, mut steps, mut first) = (Time::ZERO, 0.0, None);
        while now < Time::from_s(until_s) {
            if attention.is_looking_away(now, &mut rng) {
                steps += 1.0;
                first = first.or(Some(now));
            }
            now += PHYSICS_STEP;
        }
        (PHYSICS_STEP.s() * steps, first)
    }

    #[test]
    fn a_single_lapse_begins_and_ends_at_the_given_times() {
        let config =
            LapseConfig { at_s: Some(3.0.into()), every_s: None, duration_s: 1.5.into(), duration_sigma: None };
        let (away_s, first) = away_s(&config, 60.0);
        assert!((away_s - 1.5).abs() < 1e-9 && first == Some(Time::from_s(3.0)), "{away_s} {first:?}");
    }

    #[test]
    fn random_lapses_take_the_expected_share_of_time() {
        let config =
            LapseConfig { at_s: None, every_s: Some(8.0.into()), duration_s: 2.0.into(), duration_sigma: None };
        let (away_s, _) = away_s(&config, 20_000.0);
        // 2,000 lapses: the share is 2/(8 + 2) within 3 standard deviations of 2 % each.
        assert!((away_s / 20_000.0 - 0.2).abs() < 0.012, "{away_s}");
    }

    #[test]
    fn drawn_durations_have_the_given_median_and_differ() {
        let config = LapseConfig {
            at_s: None,
            every_s: Some(8.0.into()),
            duration_s: 0.9.into(),
            duration_sigma: Some(0.5.into()),
        };
        let lapse = config.check(&Parameters::default()).unwrap();
        let mut rng = stream(0, 0, &ActorId::new("rear").unwrap(), "driver");
        let mut drawn: Vec<f64> = (0..4001).map(|_| lapse.draw_duration_s(&mut rng)).collect();
        drawn.sort_by(f64::total_cmp);
        assert!((drawn[2000] - 0.9).abs() < 0.03, "{}", drawn[2000]);
        assert!((drawn[3366] / drawn[2000] - maths::exp(0.5)).abs() < 0.05);
        let wrong = LapseConfig { duration_sigma: Some(3.0.into()), ..config };
        assert_eq!(wrong.check(&Parameters::default()).unwrap_err().path.to_string(), "lapse.duration-sigma");
    }

    #[test]
    fn lapses_need_exactly_one_timing_and_a_driver_with_a_reaction_time() {
        let none = Parameters::default();
        let config = LapseConfig { at_s: None, every_s: None, duration_s: 2.0.into(), duration_sigma: None };
        assert_eq!(config.check(&none).unwrap_err().path.to_string(), "lapse.at-s");
        let once = LapseConfig { at_s: Some(1.0.into()), ..config };
        assert!(LapseConfig { every_s: Some(1.0.into()), ..once.clone() }.check(&none).is_err());
        assert_eq!(check_lapse(Some(&once), false, &none).unwrap_err().path.to_string(), "lapse");
        assert!(check_lapse(Some(&once), true, &none).unwrap().is_some());
    }
}
