//! Two fidelities: rates of expensive runs, sharpened by cheap ones.
//!
//! ```text
//!  campaign with the full chain,  samples 0 … n ─┐
//!  the same with fast sensors, samples 0 … N ────┴▶ estimate with a control variate
//! ```
//!
//! Both campaigns have the same samples: the same parameters and random numbers. On the first n
//! both modes are known, and their difference is averaged there. The other N − n samples of the
//! fast mode say what its rate is. With the rate Y of the full chain and the rate X of the fast
//! mode,
//!
//! ```text
//!  estimate = Ȳₙ − β·(X̄ₙ − X̄ₘ),   β = cov(X, Y)/var(X) · m/(n + m),   m = N − n
//! ```
//!
//! has the least variance of all β. Covariance and variances are estimated from the samples;
//! nothing is assumed of how well the modes agree. If they do not agree at all, β is about 0 and
//! the estimate is the estimate of the full chain. (Control variates: Lemieux, *Monte Carlo and
//! Quasi-Monte Carlo Sampling*, 2009, section 4.1; with a mean that is estimated itself: Schmeiser,
//! Taaffe and Wang, *Biased control-variate estimation*, 2001.)
//!
//! The fast campaign is one of its own, or lies in the folder of the first one ([`FAST_SAMPLES`]):
//! then the folder also has the [`Fidelity`] of both.
//!
//! [`FAST_SAMPLES`]: closecall_campaign::folder::FAST_SAMPLES

use std::collections::BTreeMap;

use closecall_campaign::folder::{FIDELITY_FILE, Folder, FolderError, listed};
use closecall_campaign::ledger::{Inference, PairFate};
use closecall_campaign::manifest::Manifest;
use closecall_campaign::record::Record;
use closecall_campaign::runner::Sampling;
use closecall_campaign::saved::SavedCampaign;
use closecall_scenarios::sampling::Design;
use closecall_sensors::SensorMode;
use closecall_traffic::atomic::{WriteError, write_file};
use closecall_traffic::input;
use closecall_traffic::statistics::interval::clopper_pearson;
use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF, StudentsT};

/// Coverage of the intervals.
const COVERAGE: f64 = 0.95;
/// Fewest samples of the full chain with an event, and without it, for an interval that rests on a
/// nearly normal mean: an assumption; 5 to 30 are plausible. The exact interval of the full chain
/// needs none.
const FEWEST_EVENTS: u64 = 10;
/// Samples in which the modes disagree that the variance counts beyond the samples that show it: half
/// a sample in each direction (A. Agresti and Y. Min, *Simple improved confidence intervals for
/// comparing matched proportions*, Statistics in Medicine 24 (2005) 729–740). Modes that agree in
/// every sample still disagree in some samples that nobody ran.
const UNSEEN_DISAGREEMENTS: f64 = 1.0;

/// A rate of the full chain, from its own runs and with the fast ones.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FidelityRate {
    /// What is counted: `ego_collided` of an arm, `prevented`, `induced`.
    pub of: String,
    /// The samples of the full chain with the event.
    pub events: u64,
    /// The rate by the runs of the full chain.
    pub plain: f64,
    /// The exact 95 % interval of that rate.
    pub plain_interval_95: [f64; 2],
    /// The rate of the fast mode, by all of its samples.
    pub fast: f64,
    /// The correlation of both modes; `None` if one of them does not vary.
    pub correlation: Option<f64>,
    /// The rate of the full chain with the fast runs, and its 95 % interval; `None` of too few
    /// events.
    pub estimate: Option<FidelityEstimate>,
}

/// A rate with its interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FidelityEstimate {
    /// The rate.
    pub value: f64,
    /// Its 95 % interval.
    pub interval_95: [f64; 2],
    /// The number of runs of the full chain alone that would have the same variance.
    pub worth_samples: f64,
    /// The standard error, relative to the one of the runs of the full chain alone.
    pub standard_error_ratio: f64,
}

/// The rates of one scenario.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FidelityReport {
    /// The scenario.
    pub scenario: String,
    /// Samples in both modes.
    pub samples: u64,
    /// Samples of the fast mode alone.
    pub more_samples: u64,
    /// Samples that are left out, because a run ended in an error.
    pub left_out: u64,
    /// The rates.
    pub rates: Vec<FidelityRate>,
}

/// The rates of a campaign that has run more of its samples with fast sensors.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fidelity {
    /// The sensors of the fast samples.
    pub mode: String,
    /// Number of fast samples, relative to the samples of the campaign.
    pub factor: u64,
    /// Number of samples of each scenario of the campaign.
    pub samples: u64,
    /// The rates of each scenario.
    pub scenarios: Vec<FidelityReport>,
}

impl Fidelity {
    /// Returns the rates of a campaign, `full`, and of its fast samples.
    ///
    /// # Errors
    /// As [`fidelity`].
    pub fn of(full: &SavedCampaign, fast: &SavedCampaign) -> Result<Self, FidelityError> {
        let scenarios = fidelity(full, fast)?;
        let (samples, fast_samples) = (full.manifest().sampling.samples, fast.manifest().sampling.samples);
        Ok(Self {
            mode: fast.manifest().sensors.map_or("as in the scenario", SensorMode::name).to_owned(),
            factor: fast_samples / samples.max(1),
            samples,
            scenarios,
        })
    }

    /// Reads the rates from the folder of a campaign. Returns `None` if it has none, or if the
    /// campaign has other samples by now.
    pub fn read(folder: &Folder) -> Option<Self> {
        let text = input::read_text(&folder.file(FIDELITY_FILE)).ok()?;
        let fidelity: Self = serde_json::from_str(&text).ok()?;
        let samples = folder.manifest().ok()?.sampling.samples;
        (fidelity.samples == samples).then_some(fidelity)
    }

    /// Removes the rates from the folder of a campaign whose samples are others by now. A folder
    /// without rates stays as it is.
    ///
    /// # Errors
    /// [`WriteError`] if the file cannot be removed.
    pub fn remove(folder: &Folder) -> Result<(), WriteError> {
        let path = folder.file(FIDELITY_FILE);
        match std::fs::remove_file(&path) {
            Err(source) if source.kind() != std::io::ErrorKind::NotFound => Err(WriteError::new(&path, source)),
            _ => Ok(()),
        }
    }

    /// Writes the rates into the folder of the campaign.
    ///
    /// # Errors
    /// [`WriteError`] if the file cannot be written.
    pub fn write(&self, folder: &Folder) -> Result<(), WriteError> {
        write_file(&folder.file(FIDELITY_FILE), |file| {
            serde_json::to_writer_pretty(&mut *file, self)?;
            file.write_all(b"\n")
        })
    }
}

/// Returns the mean wall time of a fast sample of each scenario, relative to a sample of the full
/// chain. A scenario without wall times has none.
///
/// # Errors
/// [`FolderError`] if a folder has no wall times.
pub fn time_ratios(full: &Folder, fast: &Folder) -> Result<BTreeMap<String, f64>, FolderError> {
    let (full_s, fast_s) = (mean_times_s(full)?, mean_times_s(fast)?);
    let ratio = |(scenario, fast_s): (String, f64)| {
        let full_s = *full_s.get(&scenario)?;
        (full_s > 0.0).then(|| (scenario, fast_s / full_s))
    };
    Ok(fast_s.into_iter().filter_map(ratio).collect())
}

/// Returns the mean wall time of a sample of each scenario in all arms (s).
fn mean_times_s(folder: &Folder) -> Result<BTreeMap<String, f64>, FolderError> {
    let mut sums: BTreeMap<String, (f64, u64)> = BTreeMap::new();
    for time in folder.wall_times()? {
        let (sum_s, samples) = sums.entry(time.scenario).or_default();
        *sum_s += time.wall_s.iter().sum::<f64>();
        *samples += 1;
    }
    Ok(sums.into_iter().map(|(scenario, (sum_s, samples))| (scenario, sum_s / samples as f64)).collect())
}

/// Why two campaigns are not two fidelities of the same samples.
#[derive(Debug, thiserror::Error)]
pub enum FidelityError {
    /// A folder cannot be read.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// The campaigns differ in more than sensors and number of samples.
    #[error("{fast} is not the campaign of {full} with other sensors and more samples:\n  {}", listed(differences))]
    Other {
        /// The folder of the full chain.
        full: String,
        /// The folder of the fast mode.
        fast: String,
        /// What differs.
        differences: Vec<String>,
    },
    /// The samples are not independent, or their number depends on the outcomes.
    #[error("{folder}: independent samples of a fixed number are needed: the design `random`, without a stop rule")]
    Dependent {
        /// The folder.
        folder: String,
    },
    /// The fast campaign has no sample of its own.
    #[error("{fast} has {fast_samples} samples and {full} has {full_samples}: the fast campaign needs more of them")]
    TooFew {
        /// The folder of the full chain.
        full: String,
        /// The folder of the fast mode.
        fast: String,
        /// Samples of the full chain.
        full_samples: u64,
        /// Samples of the fast mode.
        fast_samples: u64,
    },
}

/// Returns the rates of every scenario of two campaigns.
///
/// # Errors
/// [`FidelityError`] if a folder cannot be read, or the campaigns are not two fidelities of the
/// same samples.
pub fn fidelity(full: &SavedCampaign, fast: &SavedCampaign) -> Result<Vec<FidelityReport>, FidelityError> {
    check(full, fast)?;
    let (of_full, of_fast) = (events(full)?, events(fast)?);
    let arms = full.manifest().arm_names();
    let names: Vec<String> = match &arms[..] {
        [_] => vec!["ego_collided".to_owned()],
        arms => {
            let collided = arms.iter().map(|arm| format!("ego_collided: {arm}"));
            collided.chain(["prevented", "induced"].map(str::to_owned)).collect()
        }
    };
    let report = |scenario: &String| {
        let empty = Events::new();
        let (full, fast) = (of_full.get(scenario).unwrap_or(&empty), of_fast.get(scenario).unwrap_or(&empty));
        let is_known = |sample: &u64| full.get(sample).is_some_and(Option::is_some);
        let both: Vec<(&[bool], &[bool])> = full
            .iter()
            .filter_map(|(sample, events)| Some((events.as_deref()?, fast.get(sample)?.as_deref()?)))
            .collect();
        let more: Vec<&[bool]> = fast
            .iter()
            .filter(|(sample, _)| !is_known(sample) && !full.contains_key(sample))
            .filter_map(|(_, events)| events.as_deref())
            .collect();
        let left_out = (fast.len() - both.len() - more.len()) as u64;
        let rate = |(index, name): (usize, &String)| {
            let pairs: Vec<[f64; 2]> = both.iter().map(|(y, x)| [number(y[index]), number(x[index])]).collect();
            let others: Vec<f64> = more.iter().map(|x| number(x[index])).collect();
            rate(name, &pairs, &others)
        };
        FidelityReport {
            scenario: scenario.clone(),
            samples: both.len() as u64,
            more_samples: more.len() as u64,
            left_out,
            rates: names.iter().enumerate().filter_map(rate).collect(),
        }
    };
    Ok(full.manifest().scenarios.iter().map(|scenario| report(&scenario.name)).collect())
}

fn number(holds: bool) -> f64 {
    f64::from(u8::from(holds))
}

/// For each sample whether each event happened; `None` if a run ended in an error.
type Events = BTreeMap<u64, Option<Vec<bool>>>;

fn check(full: &SavedCampaign, fast: &SavedCampaign) -> Result<(), FidelityError> {
    let name = |saved: &SavedCampaign| saved.folder().path().display().to_string();
    for saved in [full, fast] {
        let manifest = saved.manifest();
        if manifest.sampling.design != Design::Random || manifest.inference != Inference::FixedSamples {
            return Err(FidelityError::Dependent { folder: name(saved) });
        }
    }
    let (there, here) = (full.manifest(), fast.manifest());
    let as_fast = Manifest {
        sensors: here.sensors,
        sampling: Sampling { samples: here.sampling.samples, ..there.sampling },
        models: here.models.clone(),
        checks: here.checks,
        retry_crashed: here.retry_crashed,
        ..there.clone()
    };
    let mut differences = as_fast.differences(here);
    if there.sensors == here.sensors {
        differences.push("sensors: the same there and here".to_owned());
    }
    if !differences.is_empty() {
        return Err(FidelityError::Other { full: name(full), fast: name(fast), differences });
    }
    let (full_samples, fast_samples) = (there.sampling.samples, here.sampling.samples);
    if fast_samples <= full_samples {
        return Err(FidelityError::TooFew { full: name(full), fast: name(fast), full_samples, fast_samples });
    }
    Ok(())
}

/// Returns what happened in each sample of each scenario. The journal must be complete.
fn events(saved: &SavedCampaign) -> Result<BTreeMap<String, Events>, FolderError> {
    let mut events: BTreeMap<String, Events> = BTreeMap::new();
    for record in saved.folder().complete_records()? {
        let record = record?;
        events.entry(record.scenario.clone()).or_default().insert(record.sample, events_of_record(&record));
    }
    Ok(events)
}

fn events_of_record(record: &Record) -> Option<Vec<bool>> {
    let tallies = record.tallies();
    let mut events: Vec<bool> = tallies.iter().map(|tally| tally.collided).collect::<Option<_>>()?;
    if let [baseline, .., tested] = &tallies[..] {
        let fate = PairFate::of(baseline, tested)?;
        events.extend([fate == PairFate::Prevented, fate == PairFate::Induced]);
    }
    Some(events)
}

/// Returns the rate of pairs of values of the full chain and of the fast mode, and more of the fast
/// mode; `None` without a pair.
fn rate(name: &str, pairs: &[[f64; 2]], more: &[f64]) -> Option<FidelityRate> {
    let (n, m) = (pairs.len() as f64, more.len() as f64);
    if pairs.len() < 3 || more.is_empty() {
        return None;
    }
    let mean = |index: usize| pairs.iter().map(|pair| pair[index]).sum::<f64>() / n;
    let [full, fast] = [mean(0), mean(1)];
    let moment = |one: usize, other: usize| {
        let means = [full, fast];
        pairs.iter().map(|pair| (pair[one] - means[one]) * (pair[other] - means[other])).sum::<f64>() / (n - 1.0)
    };
    let (of_full, of_fast, both) = (moment(0, 0), moment(1, 1), moment(0, 1));
    let others = more.iter().sum::<f64>() / m;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a number of samples")]
    let events = (full * n).round() as u64;
    let samples = pairs.len() as u64;
    let beta = if of_fast > 0.0 { both / of_fast * m / (n + m) } else { 0.0 };
    let value = full - beta * (fast - others);
    let unseen = UNSEEN_DISAGREEMENTS * (beta / n).powi(2);
    let variance = (of_full - 2.0 * beta * both) / n + beta * beta * of_fast * (1.0 / n + 1.0 / m) + unseen;
    let enough = events >= FEWEST_EVENTS && samples - events >= FEWEST_EVENTS;
    // Two degrees of freedom are spent: on the mean and on β.
    let factor = StudentsT::new(0.0, 1.0, n - 2.0).map_or(f64::INFINITY, |t| t.inverse_cdf(0.5 * (1.0 + COVERAGE)));
    let half = factor * (variance * (n - 1.0) / (n - 2.0)).sqrt();
    Some(FidelityRate {
        of: name.to_owned(),
        events,
        plain: full,
        plain_interval_95: clopper_pearson(events, samples, COVERAGE),
        fast: (fast * n + others * m) / (n + m),
        correlation: (of_full > 0.0 && of_fast > 0.0).then(|| both / (of_full * of_fast).sqrt()),
        estimate: (enough && variance > 0.0).then(|| FidelityEstimate {
            value: value.clamp(0.0, 1.0),
            interval_95: [value - half, value + half].map(|end| end.clamp(0.0, 1.0)),
            worth_samples: of_full / variance,
            standard_error_ratio: (variance * n / of_full).sqrt(),
        }),
    })
}

#[cfg(test)]
mod tests {
    use closecall_traffic::{ActorId, stream};
    use rand::RngExt;

    use super::*;

    /// Draws a rate of the full chain of 0.08 and a fast mode that tells the same in a share
    /// `agree` of the samples, else something of its own.
    fn repetition(number: u64, agree: f64) -> FidelityRate {
        const N: usize = 600;
        let mut rng = stream(7, number, &ActorId::new("test").unwrap(), "fidelity");
        let mut draw = || {
            let full = rng.random::<f64>() < 0.08;
            let own = rng.random::<f64>() < 0.12;
            let fast = if rng.random::<f64>() < agree { full } else { own };
            [full, fast].map(super::number)
        };
        let pairs: Vec<[f64; 2]> = (0..N).map(|_| draw()).collect();
        let more: Vec<f64> = (0..19 * N).map(|_| draw()[1]).collect();
        rate("x", &pairs, &more).unwrap()
    }

    #[test]
    fn the_interval_covers_and_narrows_with_the_correlation() {
        for (agree, least, most) in [(0.97, 3.0, 12.0), (0.5, 1.1, 1.8), (0.0, 0.9, 1.05)] {
            let (mut covered, mut worth) = (0_u32, 0.0);
            const REPETITIONS: u64 = 1_000;
            for number in 0..REPETITIONS {
                let estimate = repetition(number, agree).estimate.unwrap();
                covered += u32::from(estimate.interval_95[0] <= 0.08 && 0.08 <= estimate.interval_95[1]);
                worth += estimate.worth_samples / 600.0 / REPETITIONS as f64;
            }
            // 95 % within three standard errors of 1,000 repetitions, 0.7 % each.
            assert!((925..=975).contains(&covered), "{agree}: {covered}");
            assert!((least..most).contains(&worth), "{agree}: worth {worth} times the samples");
        }
    }

    #[test]
    fn the_interval_covers_where_modes_disagree_in_samples_that_nobody_ran() {
        const N: usize = 200;
        const REPETITIONS: u64 = 300;
        let covers = |number: u64| {
            let mut rng = stream(7, number, &ActorId::new("test").unwrap(), "agreement");
            // The fast mode misses one event of 34: half of the repetitions see no such sample.
            let mut draw = || {
                let full = rng.random::<f64>() < 0.17;
                [full, full && rng.random::<f64>() < 33.0 / 34.0].map(super::number)
            };
            let pairs: Vec<[f64; 2]> = (0..N).map(|_| draw()).collect();
            let more: Vec<f64> = (0..99 * N).map(|_| draw()[1]).collect();
            let [low, high] = rate("x", &pairs, &more).unwrap().estimate.unwrap().interval_95;
            low <= 0.17 && 0.17 <= high
        };
        let covered = (0..REPETITIONS).filter(|number| covers(*number)).count();
        // Three standard errors of 1.3 % below 95 %.
        assert!(covered >= 274, "{covered} of {REPETITIONS}");
    }

    #[test]
    fn few_events_have_no_interval_but_the_exact_one() {
        let pairs: Vec<[f64; 2]> = (0..100).map(|index| [number(index < 4), number(index < 5)]).collect();
        let rate = rate("x", &pairs, &[0.0; 900]).unwrap();
        assert_eq!((rate.events, rate.estimate), (4, None));
        assert!(rate.plain_interval_95[0] < 0.04 && 0.04 < rate.plain_interval_95[1]);
        // A mode that never sees the event tells nothing of it.
        let blind: Vec<[f64; 2]> = (0..100).map(|index| [number(index < 40), 0.0]).collect();
        let estimate = super::rate("x", &blind, &[0.0; 900]).unwrap();
        assert_eq!(estimate.correlation, None);
        let estimate = estimate.estimate.unwrap();
        assert!((estimate.worth_samples - 100.0).abs() < 1e-9 && (estimate.standard_error_ratio - 1.0).abs() < 1e-9);
    }
}
