//! The net effect of a system per 10⁶ km.

use std::fmt;

use closecall_campaign::ledger::Pairs;
use closecall_campaign::saved::SavedCampaign;
use closecall_campaign::summary::Summary;
use serde::Serialize;

use super::interval::{product, rate_interval, share_difference};
use super::{EventRule, Observed};
use crate::case::CausesError;

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
    /// Returns the rate with its interval at 95 %, or with its stated range (events per 10⁶ km). The value of a range is its
    /// geometric mean.
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

/// What a paired campaign says about the system, given an encounter.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CampaignShares {
    /// The scenarios.
    pub scenarios: Vec<String>,
    /// Samples with both outcomes.
    pub samples: u64,
    /// Samples in which the system prevents the collision of the ego.
    pub prevented: u64,
    /// Samples in which the system induces a collision.
    pub induced: u64,
}

/// What is missing for the net effect.
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
                "how often the lead vehicle brakes while a rear vehicle is near: trajectory files, or a range by --per-million-km"
            }
            Self::Campaign => "what the system prevents and induces, given such an encounter: a paired campaign by --campaign",
        })
    }
}

/// The net effect of the system: collisions that it prevents less those that it induces, per 10⁶ km.
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
    /// Interval of the net effect at 95 %.
    pub net_95: [f64; 2],
}

/// The exposure, and the net effect as far as it can be said.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Exposure {
    /// What counts as an event.
    pub rule: EventRule,
    /// What trajectory files show; `None` without files.
    pub observed: Option<Observed>,
    /// The rate; `None` if it is not known.
    pub rate: Option<Rate>,
    /// The campaign; `None` if there is none.
    pub campaign: Option<CampaignShares>,
    /// The net effect; `None` if it cannot be said.
    pub effect: Option<NetEffect>,
    /// What would have to be known.
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
        .filter(|seen| seen.distance_km > 0.0 && seen.events > 0)
        .map(|seen| Rate::Counted { events: seen.events, distance_km: seen.distance_km });
    let rate = counted.or(prior.map(|[low, high]| Rate::Prior { low, high }));
    let usable = campaign.as_ref().filter(|campaign| campaign.samples > 0);
    let effect = rate.as_ref().zip(usable).map(|(rate, campaign)| {
        let (rate, rate_95) = rate.per_million_km();
        let (difference, difference_95) = share_difference(campaign.prevented, campaign.induced, campaign.samples);
        let (net, net_95) = product((rate, rate_95), (difference, difference_95));
        NetEffect { rate, rate_95, difference, difference_95, net, net_95 }
    });
    let lacks = [(rate.is_none(), Missing::Rate), (usable.is_none(), Missing::Campaign)];
    let missing = lacks.into_iter().filter(|(lacks, _)| *lacks).map(|(_, missing)| missing).collect();
    Exposure { rule, observed, rate, campaign, effect, missing }
}

/// Returns what a saved campaign says, given an encounter: over all of its scenarios. An unpaired campaign has no samples.
///
/// # Errors
/// [`CausesError`] if the folder cannot be read.
pub fn shares_of(saved: &SavedCampaign) -> Result<CampaignShares, CausesError> {
    let mut summary = Summary::of(&saved.works()?);
    for record in saved.folder().records()? {
        summary.push(&record?);
    }
    let Pairs { prevented, induced, both, neither, .. } = summary.total().pairs;
    let scenarios = summary.scenarios.iter().map(|(name, _)| name.clone()).collect();
    Ok(CampaignShares { scenarios, samples: prevented + induced + both + neither, prevented, induced })
}

#[cfg(test)]
mod tests {
    use super::*;

    const RULE: EventRule = EventRule { braking_mps2: 4.0 };

    fn campaign(prevented: u64, induced: u64) -> Option<CampaignShares> {
        Some(CampaignShares { scenarios: vec!["a".to_owned()], samples: 1_000, prevented, induced })
    }

    #[test]
    fn the_net_effect_follows_from_the_printed_inputs() {
        let observed = Observed { events: 20, distance_km: 5_000.0, ..Observed::default() };
        let found = exposure(RULE, Some(observed), None, campaign(150, 10)).effect.unwrap();
        // 20 / 5000 km · 10⁶ km · (150 − 10) / 1000
        assert!((found.net - 560.0).abs() < 1e-9 && (found.rate - 4_000.0).abs() < 1e-9, "{found:?}");
        assert!(found.net_95[0] > 0.0 && found.net_95[0] < 400.0 && found.net_95[1] > 750.0, "{found:?}");
    }

    #[test]
    fn what_is_missing_is_named() {
        let none = exposure(RULE, None, None, None);
        assert_eq!((none.missing, none.effect), (vec![Missing::Rate, Missing::Campaign], None));
        let seen = Observed { events: 0, distance_km: 12.0, ..Observed::default() };
        assert_eq!(
            exposure(RULE, Some(seen.clone()), None, campaign(5, 1)).missing,
            [Missing::Rate],
            "no event was seen"
        );
        let with_prior = exposure(RULE, Some(seen), Some([100.0, 10_000.0]), campaign(50, 10));
        assert!((with_prior.effect.unwrap().net - 40.0).abs() < 1e-9, "geometric mean 1000 · 0.04");
    }
}
