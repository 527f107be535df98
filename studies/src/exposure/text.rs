//! The exposure as text, with the inputs and equations from which it can be recomputed.

use std::fmt;

use closecall_traffic::statistics::format::{DIGITS, significant};
use closecall_traffic::statistics::quantiles::quantile;
use closecall_traffic::words::counted;

use super::{Exposure, Observed, Rate};

/// Returns a measured value with the digits that it deserves.
fn shown(value: f64) -> String {
    significant(value, DIGITS)
}

/// The exposure as text for readers.
#[derive(Clone, Copy, Debug)]
pub struct ExposureText<'a>(pub &'a Exposure);

impl fmt::Display for ExposureText<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Exposure { rule, observed, at_most_per_million_km, rate, campaign, effect, missing } = self.0;
        if let Some(observed) = observed.as_ref().filter(|observed| observed.hours > 0.0) {
            write_observed(f, observed, rule.braking_mps2)?;
        }
        if let (Some(observed), Some(at_most)) = (observed, at_most_per_million_km) {
            let km = (1_000.0 * observed.distance_km).round() / 1_000.0;
            writeln!(f, "0 events in {km} km: at most {} per 10^6 km (95 %)", shown(*at_most))?;
        }
        match rate {
            Some(Rate::Counted { events, distance_km }) => {
                writeln!(f, "rate: N = {} in D = {distance_km} km", counted(*events, "event"))?;
            }
            Some(Rate::Prior { low, high }) => {
                writeln!(f, "rate: stated, from {low} to {high} events per 10^6 km (value: their geometric mean)")?;
            }
            None => {}
        }
        if let Some(campaign) = campaign {
            writeln!(
                f,
                "campaign {}: n = {}, {} prevented, {} induced; the lead vehicle brakes in {:.0} %",
                campaign.scenario,
                counted(campaign.samples, "paired sample"),
                campaign.prevented,
                campaign.induced,
                100.0 * campaign.lead_braked_share,
            )?;
        }
        match effect {
            Some(effect) => {
                let [low, high] = effect.rate_95.map(shown);
                let is_stated = matches!(rate, Some(Rate::Prior { .. }));
                let stated = if is_stated { "as stated" } else { "95 %" };
                writeln!(f, "encounters per 10^6 km: {} ({stated}: {low} to {high})", shown(effect.rate))?;
                let [low, high] = effect.difference_95.map(shown);
                writeln!(
                    f,
                    "prevented less induced, given an encounter: {} (95 %: {low} to {high})",
                    shown(effect.difference)
                )?;
                let [low, high] = effect.net_95;
                let net_of = if is_stated {
                    "over the stated range, each end with the 95 % interval of the shares"
                } else {
                    "95 %"
                };
                writeln!(
                    f,
                    "NET EFFECT: {} fewer collisions per 10^6 km ({net_of}: {} to {})",
                    shown(effect.net),
                    shown(low),
                    shown(high)
                )?;
                if low <= 0.0 && high >= 0.0 {
                    writeln!(
                        f,
                        "its sign cannot be said: the interval contains 0, more events or more samples are needed"
                    )?;
                }
                if is_stated {
                    writeln!(
                        f,
                        "by hand: difference = (prevented - induced) / n, Wilson intervals combined; net = geometric mean of the \
                         stated range x difference; low = lower rate x lower difference, high = higher rate x higher difference \
                         (a negative difference takes the other rate)"
                    )?;
                } else {
                    writeln!(
                        f,
                        "by hand: rate = 10^6 N / D, interval by gamma quantiles of shape N + 1/2 over D; difference = (prevented - \
                     induced) / n, Wilson intervals combined; net = rate x difference, intervals combined as in docs/explanation/causes.md"
                    )?;
                }
                writeln!(
                    f,
                    "assumed: the events are independent of each other, and the sampled encounters are encounters of the road"
                )
            }
            None => {
                writeln!(f, "NET EFFECT: cannot be said. These inputs are missing:")?;
                missing.iter().try_for_each(|missing| writeln!(f, "  {missing}"))
            }
        }
    }
}

fn write_observed(f: &mut fmt::Formatter<'_>, observed: &Observed, braking_mps2: f64) -> fmt::Result {
    writeln!(
        f,
        "{}: {:.3} km, {:.3} h of all vehicles",
        observed.sources.join(", "),
        observed.distance_km,
        observed.hours
    )?;
    writeln!(
        f,
        "  {}: a vehicle comes within 100 m of one that follows at less than 1.5 s, 10 km/h or more faster",
        counted(observed.approaches, "approach")
    )?;
    let events = counted(observed.events, "event");
    writeln!(f, "  {events}: the lead vehicle brakes by {braking_mps2} m/s² or more meanwhile")?;
    for (quantity, values, unit) in [
        ("speed difference at an approach", &observed.closing_mps, "m/s"),
        ("rear time headway at an event", &observed.rear_thw_s, "s"),
    ] {
        let mut sorted = values.clone();
        sorted.sort_by(f64::total_cmp);
        if !sorted.is_empty() {
            let at = |share: f64| quantile(&sorted, share);
            writeln!(
                f,
                "  {quantity}: median {:.2} {unit}, 5 to 95 %: {:.2} to {:.2} {unit}",
                at(0.5),
                at(0.05),
                at(0.95)
            )?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::{CampaignShares, EventRule, NetEffect};
    use super::*;

    #[test]
    fn figures_have_three_significant_digits_and_one_event_is_singular() {
        let exposure = Exposure {
            rule: EventRule { braking_mps2: 2.0 },
            observed: None,
            at_most_per_million_km: None,
            rate: Some(Rate::Counted { events: 1, distance_km: 625.0 }),
            campaign: Some(CampaignShares {
                scenario: "s".to_owned(),
                lead_braked_share: 1.0,
                samples: 10,
                prevented: 5,
                induced: 1,
            }),
            effect: Some(NetEffect {
                rate: 1_600.0,
                rate_95: [172.6, 5_983.1],
                difference: 0.4,
                difference_95: [-0.01234567, 0.70001],
                net: 640.0,
                net_95: [-555.4548, 3_290.624_8],
            }),
            missing: Vec::new(),
        };
        let text = ExposureText(&exposure).to_string();
        for line in [
            "rate: N = 1 event in D = 625 km",
            "campaign s: n = 10 paired samples, 5 prevented, 1 induced; the lead vehicle brakes in 100 %",
            "encounters per 10^6 km: 1600 (95 %: 173 to 5983)",
            "prevented less induced, given an encounter: 0.4 (95 %: -0.0123 to 0.7)",
            "NET EFFECT: 640 fewer collisions per 10^6 km (95 %: -555 to 3291)",
        ] {
            assert!(text.lines().any(|other| other == line), "no `{line}` in: {text}");
        }
    }
}
