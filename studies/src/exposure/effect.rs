//! The net effect of a system per 10⁶ km.

use std::fmt;

use closecall_campaign::belief::Belief;
use closecall_campaign::gate::MAX_FLIP_RATE;
use closecall_campaign::ledger::Pairs;
use closecall_campaign::saved::SavedCampaign;
use closecall_campaign::summary::Summary;
use closecall_scenarios::outcome::Moment;
use serde::Serialize;

use super::interval::{extremes, product, rate_interval, share_difference};
use super::{EventRule, Observed};
use crate::case::CausesError;

/// Share of the samples in which the lead vehicle must brake if the scenario is the counted
/// encounter: an assumption. Runs that end by a collision before the lead vehicle brakes are part
/// of the encounter.
const LEAD_BRAKES_SHARE: f64 = 0.95;
/// The distance that the effect refers to (km).
const PER_KM: f64 = 1e6;

/// How often the encounter happens.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case", tag = "source")]
pub enum Rate {
    /// Counted.
    Counted {
        /// Number of events.
        events: u64,
        /// Distance (km).
        distance_km: f64,
    },
    /// Stated, as a range (events per 10⁶ km).
    Prior {
        /// Lower end.
        low: f64,
        /// Upper end.
        high: f64,
    },
}

impl Rate {
    /// Returns the rate with its interval at 95 %, or with its stated range (events per 10⁶ km).
    /// The value of a range is its geometric mean.
    pub fn per_million_km(&self) -> (f64, [f64; 2]) {
        match *self {
            Self::Counted { events, distance_km } => {
                let interval = rate_interval(events, distance_km).map(|rate| rate * PER_KM);
                (events as f64 / distance_km * PER_KM, interval)
            }
            Self::Prior { low, high } => ((low * high).sqrt(), [low, high]),
        }
    }
}

/// The shares of a paired campaign, given an encounter.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CampaignShares {
    /// The scenario.
    pub scenario: String,
    /// Share of its samples in which the lead vehicle brakes without the system.
    pub lead_braked_share: f64,
    /// Samples with both outcomes.
    pub samples: u64,
    /// Samples in which the system prevents the collision of the ego.
    pub prevented: u64,
    /// Samples in which the system induces a collision.
    pub induced: u64,
}

/// A missing input of the net effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Missing {
    /// The rate of encounters.
    Rate,
    /// A paired campaign.
    Campaign,
}

impl fmt::Display for Missing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Rate => {
                "how often the lead vehicle brakes while a rear vehicle is near: trajectory files, or a stated range of the rate"
            }
            Self::Campaign => "what the system prevents and induces, given such an encounter: a paired campaign",
        })
    }
}

/// The net effect of the system: prevented collisions less induced collisions, per 10⁶ km.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NetEffect {
    /// Encounters per 10⁶ km.
    pub rate: f64,
    /// Interval of the rate at 95 %, or its stated range.
    pub rate_95: [f64; 2],
    /// Share prevented less share induced, given an encounter.
    pub difference: f64,
    /// Interval of the difference at 95 %.
    pub difference_95: [f64; 2],
    /// The net effect.
    pub net: f64,
    /// Interval of the net effect at 95 %; with a stated range of the rate its extremes over the
    /// range, each with the interval of the difference.
    pub net_95: [f64; 2],
}

/// The exposure, and the net effect if the inputs suffice.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Exposure {
    /// The rule for events.
    pub rule: EventRule,
    /// The observation in trajectory files; `None` without files.
    pub observed: Option<Observed>,
    /// The largest rate at 95 % if no event was seen (events per 10⁶ km); `None` if one was, or no
    /// distance is known.
    pub at_most_per_million_km: Option<f64>,
    /// The rate; `None` if it is not known.
    pub rate: Option<Rate>,
    /// The campaign; `None` if there is none.
    pub campaign: Option<CampaignShares>,
    /// The net effect; `None` if it cannot be said.
    pub effect: Option<NetEffect>,
    /// The missing inputs.
    pub missing: Vec<Missing>,
}

/// Returns the exposure. A counted rate takes precedence over a stated range.
pub fn exposure(
    rule: EventRule,
    observed: Option<Observed>,
    prior: Option<[f64; 2]>,
    campaign: Option<CampaignShares>,
) -> Exposure {
    let counted = observed
        .as_ref()
        .filter(|observed| observed.distance_km > 0.0 && observed.events > 0)
        .map(|observed| Rate::Counted { events: observed.events, distance_km: observed.distance_km });
    let without_event = observed.as_ref().filter(|observed| observed.distance_km > 0.0 && observed.events == 0);
    let at_most_per_million_km = without_event.map(|observed| rate_interval(0, observed.distance_km)[1] * PER_KM);
    let rate = counted.or(prior.map(|[low, high]| Rate::Prior { low, high }));
    let usable = campaign.as_ref().filter(|campaign| campaign.samples > 0);
    let effect = rate.as_ref().zip(usable).map(|(source, campaign)| {
        let (rate, rate_95) = source.per_million_km();
        let (difference, difference_95) = share_difference(campaign.prevented, campaign.induced, campaign.samples);
        let (net, counted_95) = product((rate, rate_95), (difference, difference_95));
        let net_95 = match source {
            Rate::Counted { .. } => counted_95,
            Rate::Prior { low, high } => extremes([*low, *high], difference_95),
        };
        NetEffect { rate, rate_95, difference, difference_95, net, net_95 }
    });
    let lacks = [(rate.is_none(), Missing::Rate), (usable.is_none(), Missing::Campaign)];
    let missing = lacks.into_iter().filter(|(lacks, _)| *lacks).map(|(_, missing)| missing).collect();
    Exposure { rule, observed, at_most_per_million_km, rate, campaign, effect, missing }
}

/// Returns the shares of a scenario of a saved campaign, given an encounter. `scenario` may be left
/// out if the campaign has only one. An unpaired campaign has no samples.
///
/// # Errors
/// [`CausesError`] if the folder cannot be read or its results cannot be believed, there is no such
/// scenario, or the lead vehicle does not brake in it.
pub fn shares_of(saved: &SavedCampaign, scenario: Option<&str>) -> Result<CampaignShares, CausesError> {
    let name = saved.file(scenario)?.config().name.clone();
    let mut summary = Summary::of(&saved.works()?);
    let mut belief = Belief::of(saved.folder(), MAX_FLIP_RATE)?;
    let (mut runs, mut braked) = (0_u64, 0_u64);
    for record in saved.folder().complete_records()? {
        let record = record?;
        if record.scenario == name
            && let Some(Ok(baseline)) = record.arms.first().map(|arm| arm.result.as_ref())
        {
            runs += 1;
            braked += u64::from(baseline.moment(Moment::FrontBrakes).is_some());
        }
        summary.push(&record);
        belief.push(&record);
    }
    belief.check()?;
    let lead_braked_share = braked as f64 / runs.max(1) as f64;
    if runs > 0 && lead_braked_share < LEAD_BRAKES_SHARE {
        return Err(CausesError::OtherEncounter { scenario: name, braked, runs });
    }
    let pairs = summary.scenarios.iter().find(|(scenario, _)| *scenario == name).map(|(_, counts)| counts.pairs);
    let Pairs { prevented, induced, both, neither, .. } = pairs.unwrap_or_default();
    let samples = prevented + induced + both + neither;
    Ok(CampaignShares { scenario: name, lead_braked_share, samples, prevented, induced })
}

#[cfg(test)]
mod tests {
    use super::*;

    const RULE: EventRule = EventRule { braking_mps2: 4.0 };

    fn campaign(prevented: u64, induced: u64) -> Option<CampaignShares> {
        Some(CampaignShares { scenario: "a".to_owned(), lead_braked_share: 1.0, samples: 1_000, prevented, induced })
    }

    #[test]
    fn the_net_effect_follows_from_the_printed_inputs() {
        let observed = Observed { events: 20, distance_km: 5_000.0, ..Observed::default() };
        let effect = exposure(RULE, Some(observed), None, campaign(150, 10)).effect.unwrap();
        // 20 / 5000 km · 10⁶ km · (150 − 10) / 1000
        assert!((effect.net - 560.0).abs() < 1e-9 && (effect.rate - 4_000.0).abs() < 1e-9, "{effect:?}");
        assert!(effect.net_95[0] > 0.0 && effect.net_95[0] < 400.0 && effect.net_95[1] > 750.0, "{effect:?}");
    }

    #[test]
    fn what_is_missing_is_named() {
        let none = exposure(RULE, None, None, None);
        assert_eq!((none.missing, none.effect), (vec![Missing::Rate, Missing::Campaign], None));
        let observed = Observed { events: 0, distance_km: 12.0, ..Observed::default() };
        assert_eq!(
            exposure(RULE, Some(observed.clone()), None, campaign(5, 1)).missing,
            [Missing::Rate],
            "no event was seen"
        );
        let with_prior = exposure(RULE, Some(observed), Some([100.0, 10_000.0]), campaign(50, 10)).effect.unwrap();
        assert!((with_prior.net - 40.0).abs() < 1e-9, "geometric mean 1000 · 0.04");
        let [low, high] = with_prior.difference_95;
        assert_eq!(with_prior.net_95, [100.0 * low, 10_000.0 * high], "{with_prior:?}");
    }

    #[test]
    fn no_event_in_a_distance_bounds_the_rate() {
        let observed = Observed { events: 0, distance_km: 5_000.0, ..Observed::default() };
        let exposure = exposure(RULE, Some(observed), None, None);
        // The 97.5 % quantile of chi-squared with one degree of freedom is 5.0239: half of it in
        // 5,000 km.
        assert!((exposure.at_most_per_million_km.unwrap() - 502.39).abs() < 0.01, "{exposure:?}");
        let text = super::super::ExposureText(&exposure).to_string();
        assert!(text.contains("0 events in 5000 km: at most 502 per 10^6 km (95 %)"), "{text}");
    }
}
