//! The cost of each arm of a campaign.

use closecall_campaign::saved::SavedCampaign;
use closecall_scenarios::outcome::{Moment, Outcome};
use closecall_traffic::statistics::log_linear::LogLinearHistogram;
use serde::Serialize;

use super::time_lost::mean_time_lost_s;
use crate::case::{CausesError, fails};

/// Number of samples of a campaign that are run again for the time lost, in equal numbers for each
/// scenario, and at least one each.
pub const TIMED_SAMPLES: usize = 50;
/// Thresholds of the rear time headway (s): 1 s, and the headway below which the paper calls a
/// following critical.
const THW_BELOW_S: [f64; 2] = [1.0, 0.5];
/// Threshold of the rear time to collision (s): the time to closest encounter below which the paper
/// calls an encounter critical.
const TTC_BELOW_S: f64 = 2.6;
const SECONDS_PER_HOUR: f64 = 3_600.0;
/// Number of samples that are kept. The samples to be timed are taken from them.
const MAX_KEPT: usize = 4_096;

/// The cost of one arm.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ArmCost {
    /// The controller.
    pub controller: String,
    /// The 1st, the 5th and the 50th percentile of the smallest rear time headway (s), to a part in
    /// 16,384; `None` if no vehicle is behind.
    pub min_thw_rear_s: Option<[f64; 3]>,
    /// The same percentiles of the smallest rear time to collision (s); `None` if no vehicle
    /// approaches.
    pub min_ttc_rear_s: Option<[f64; 3]>,
    /// Share of the samples whose rear time headway falls below 1 s, and below 0.5 s.
    pub share_thw_below: [f64; 2],
    /// Share of the samples whose rear time to collision falls below 2.6 s.
    pub share_ttc_below: f64,
    /// Mean and 95th percentile of the largest speed deficit to the lead vehicle (m/s).
    pub speed_lost_mps: [f64; 2],
    /// Engagements of the system per hour of simulated encounters.
    pub engagements_per_hour: f64,
    /// Mean time that the ego loses to the baseline (s); `None` for the baseline itself, and if no
    /// sample was run again.
    pub time_lost_s: Option<f64>,
}

/// The cost of the arms of a campaign.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Cost {
    /// The scenarios, in the order of the campaign.
    pub scenarios: Vec<ScenarioCost>,
}

/// The cost of the arms in a scenario.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ScenarioCost {
    /// The scenario.
    pub scenario: String,
    /// Samples in which no vehicle collides in any arm.
    pub samples_without_collision: u64,
    /// Of these, samples in which the lead vehicle does not brake in any arm: the uneventful
    /// samples.
    pub samples: u64,
    /// Number of uneventful samples that were run again for the time lost.
    pub timed_samples: usize,
    /// The arms, the baseline first; empty without such a sample.
    pub arms: Vec<ArmCost>,
}

impl ScenarioCost {
    /// Returns why there is no cost; `None` if there is one.
    pub(super) fn why_none(&self) -> Option<&'static str> {
        match (self.samples, self.samples_without_collision) {
            (0, 0) => Some("no sample without a collision"),
            (0, _) => Some("no sample without braking of the lead vehicle"),
            _ => None,
        }
    }
}

/// The values of one arm over the samples.
#[derive(Default)]
struct Values {
    controller: String,
    thw_s: LogLinearHistogram,
    thw_below: [u64; 2],
    ttc_s: LogLinearHistogram,
    ttc_below: u64,
    deficit_mps: LogLinearHistogram,
    sum_deficit_mps: f64,
    engagements: u64,
    duration_s: f64,
}

/// Returns the cost of the arms of a saved campaign.
///
/// # Errors
/// [`CausesError`] if the folder cannot be read.
pub fn cost(saved: &SavedCampaign) -> Result<Cost, CausesError> {
    let names: Vec<&String> = saved.manifest().scenarios.iter().map(|scenario| &scenario.name).collect();
    let mut uneventful: Vec<Uneventful> = names.iter().map(|_| Uneventful::default()).collect();
    for record in saved.folder().complete_records()? {
        let record = record?;
        let outcomes: Option<Vec<&Outcome>> = record.arms.iter().map(|arm| arm.result.as_ref().ok()).collect();
        let index = names.iter().position(|name| **name == record.scenario);
        if let (Some(outcomes), Some(index)) = (outcomes, index) {
            uneventful[index].push(record.sample, &outcomes);
        }
    }
    let timed = TIMED_SAMPLES.div_ceil(names.len().max(1));
    let of_scenario = |(uneventful, name): (Uneventful, &&String)| uneventful.finish(saved, name, timed);
    Ok(Cost { scenarios: uneventful.into_iter().zip(&names).map(of_scenario).collect() })
}

/// The uneventful samples of a scenario.
struct Uneventful {
    without_collision: u64,
    samples: u64,
    /// Some of the samples: every `spacing`-th one.
    kept: Vec<u64>,
    spacing: u64,
    arms: Vec<Values>,
}

impl Default for Uneventful {
    fn default() -> Self {
        Self { without_collision: 0, samples: 0, kept: Vec::new(), spacing: 1, arms: Vec::new() }
    }
}

impl Uneventful {
    fn push(&mut self, sample: u64, outcomes: &[&Outcome]) {
        if outcomes.iter().any(|outcome| fails(outcome)) {
            return;
        }
        self.without_collision += 1;
        if outcomes.iter().any(|outcome| outcome.moment(Moment::FrontBrakes).is_some()) {
            return;
        }
        self.keep(sample);
        self.arms.resize_with(outcomes.len(), Values::default);
        for (values, outcome) in self.arms.iter_mut().zip(outcomes) {
            values.push(outcome);
        }
    }

    /// Counts a sample, and keeps its number if its turn has come.
    fn keep(&mut self, sample: u64) {
        if self.samples.is_multiple_of(self.spacing) {
            if self.kept.len() == MAX_KEPT {
                let mut index = 0..MAX_KEPT;
                self.kept.retain(|_| index.next().is_some_and(|index| index % 2 == 0));
                self.spacing *= 2;
            }
            if self.samples.is_multiple_of(self.spacing) {
                self.kept.push(sample);
            }
        }
        self.samples += 1;
    }

    fn finish(mut self, saved: &SavedCampaign, name: &str, timed: usize) -> ScenarioCost {
        self.kept.sort_unstable();
        let chosen = evenly(&self.kept, timed);
        let lost = mean_time_lost_s(saved, name, &chosen);
        let samples = self.samples;
        let of_arm = |(index, values): (usize, Values)| {
            let time_lost_s = if index == 0 { None } else { lost.as_ref().and_then(|lost| lost.get(index).copied()) };
            values.finish(samples, time_lost_s)
        };
        ScenarioCost {
            scenario: name.to_owned(),
            samples_without_collision: self.without_collision,
            samples,
            timed_samples: if lost.is_some() { chosen.len() } else { 0 },
            arms: self.arms.into_iter().enumerate().map(of_arm).collect(),
        }
    }
}

/// Returns up to `most` values, evenly over all.
fn evenly(values: &[u64], most: usize) -> Vec<u64> {
    let count = most.min(values.len());
    (0..count).map(|index| values[index * values.len() / count]).collect()
}

impl Values {
    fn push(&mut self, outcome: &Outcome) {
        self.controller.clone_from(&outcome.controller);
        if let Ok(thw_s) = outcome.margins.min_thw_rear_s {
            self.thw_s.push(thw_s);
            for (count, limit_s) in self.thw_below.iter_mut().zip(THW_BELOW_S) {
                *count += u64::from(thw_s < limit_s);
            }
        }
        if let Ok(ttc_s) = outcome.margins.min_ttc_rear_s {
            self.ttc_s.push(ttc_s);
            self.ttc_below += u64::from(ttc_s < TTC_BELOW_S);
        }
        self.deficit_mps.push(outcome.margins.max_speed_deficit_mps);
        self.sum_deficit_mps += outcome.margins.max_speed_deficit_mps;
        self.engagements += u64::from(outcome.mis.as_ref().is_ok_and(|mis| mis.engaged_at_s.is_ok()));
        self.duration_s += outcome.duration.s();
    }

    fn finish(self, samples: u64, time_lost_s: Option<f64>) -> ArmCost {
        let percentiles =
            |values: &LogLinearHistogram| (!values.is_empty()).then(|| [0.01, 0.05, 0.5].map(|u| values.quantile(u)));
        let share = |count: u64| count as f64 / samples as f64;
        ArmCost {
            min_thw_rear_s: percentiles(&self.thw_s),
            min_ttc_rear_s: percentiles(&self.ttc_s),
            share_thw_below: self.thw_below.map(share),
            share_ttc_below: share(self.ttc_below),
            speed_lost_mps: [self.sum_deficit_mps / samples as f64, self.deficit_mps.quantile(0.95)],
            engagements_per_hour: self.engagements as f64 * SECONDS_PER_HOUR / self.duration_s,
            time_lost_s,
            controller: self.controller,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn timed_samples_lie_evenly_over_all() {
        let all: Vec<u64> = (0..10).collect();
        assert_eq!(evenly(&all, 5), [0, 2, 4, 6, 8]);
        assert_eq!(evenly(&all, 3), [0, 3, 6]);
        assert_eq!(evenly(&all[..2], 50), [0, 1]);
        assert_eq!(evenly(&[], 50), [0; 0]);
    }

    #[test]
    fn the_samples_kept_of_many_lie_evenly_over_all() {
        let mut uneventful = Uneventful::default();
        for sample in 0..100_000 {
            uneventful.keep(sample);
        }
        assert_eq!((uneventful.samples, uneventful.spacing), (100_000, 32));
        assert!(uneventful.kept.iter().zip(0..).all(|(sample, index)| *sample == 32 * index));
        assert_eq!(uneventful.kept.len(), 3_125);
    }

    #[test]
    fn a_scenario_without_an_uneventful_sample_says_why() {
        let reason = |samples_without_collision, samples| {
            let scenario = "a".to_owned();
            ScenarioCost { scenario, samples_without_collision, samples, timed_samples: 0, arms: Vec::new() }.why_none()
        };
        assert_eq!(reason(0, 0), Some("no sample without a collision"));
        assert_eq!(reason(4, 0), Some("no sample without braking of the lead vehicle"));
        assert_eq!(reason(4, 1), None);
    }
}
