//! Which samples of a campaign are recorded to be looked at.
//!
//! ```text
//!  worst:5,failures:20,random:3
//! ```
//!
//! *Worst* are the samples of the arm under test with the hardest collisions of E, then those with the smallest time
//! headways; *failures* the first ones in which E collided; *random* ones show what is usual. All counts are for each
//! scenario; a count alone is that of failures. A sample that is chosen for several reasons is recorded once.

use std::str::FromStr;

use closecall_traffic::{ActorId, Measured, stream};
use rand::RngExt;

use super::record::{ArmRecord, Record};
use closecall_simulation::outcome::Outcome;

/// The channel of the random choice.
const CHANNEL: &str = "recordings";

/// How many samples of each kind are recorded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Selection {
    /// The most critical ones.
    pub worst: u64,
    /// The first in which E collided.
    pub failures: u64,
    /// Any.
    pub random: u64,
}

impl FromStr for Selection {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if let Ok(failures) = text.parse() {
            return Ok(Self { failures, ..Self::default() });
        }
        let mut selection = Self::default();
        let mut named: Vec<&str> = Vec::new();
        for part in text.split(',').map(str::trim) {
            let wrong = || format!("`{part}` is not `worst:N`, `failures:N` or `random:N`");
            let (kind, count) = part.split_once(':').ok_or_else(wrong)?;
            let count = count.parse().map_err(|_| wrong())?;
            if named.contains(&kind) {
                return Err(format!("`{kind}` is named twice"));
            }
            named.push(kind);
            match kind {
                "worst" => selection.worst = count,
                "failures" => selection.failures = count,
                "random" => selection.random = count,
                _ => return Err(wrong()),
            }
        }
        Ok(selection)
    }
}

impl std::fmt::Display for Selection {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "worst:{},failures:{},random:{}", self.worst, self.failures, self.random)
    }
}

/// One sample that is recorded, and why.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Chosen {
    /// The sample's number.
    pub sample: u64,
    /// The kinds that it was chosen for, in words.
    pub reasons: Vec<&'static str>,
}

/// How bad a sample was; the greatest is the worst.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Severity {
    sample: u64,
    /// Change of E's velocity in its hardest collision [m/s]; nothing where it did not collide.
    delta_v_mps: Option<f64>,
    /// Smallest time headway before and behind E [s].
    thw_s: f64,
}

/// Collects what is needed to choose among the samples of one scenario, record by record.
#[derive(Debug)]
pub struct Chooser {
    selection: Selection,
    samples: Vec<Severity>,
}

impl Chooser {
    /// Returns a chooser without samples.
    pub fn new(selection: Selection) -> Self {
        Self { selection, samples: Vec::new() }
    }

    /// Adds one sample of the scenario; one that ended in an error cannot be recorded, and is left out.
    pub fn push(&mut self, record: &Record) {
        if let Some(ArmRecord { result: Ok(outcome), .. }) = record.arms.last() {
            self.samples.push(severity(record.sample, outcome));
        }
    }

    /// Returns the samples to record, the worst first, then in the order of their numbers. `seed` and `ego` key the random
    /// choice.
    pub fn choose(&self, seed: u64, ego: &ActorId) -> Vec<Chosen> {
        let mut chosen: Vec<Chosen> = Vec::new();
        let mut add = |sample: u64, reason: &'static str| match chosen.iter_mut().find(|it| it.sample == sample) {
            Some(known) => known.reasons.push(reason),
            None => chosen.push(Chosen { sample, reasons: vec![reason] }),
        };
        let count = |count: u64| usize::try_from(count).unwrap_or(usize::MAX);
        let mut worst: Vec<&Severity> = self.samples.iter().collect();
        worst.sort_by(|a, b| order(b, a));
        worst.iter().take(count(self.selection.worst)).for_each(|severity| add(severity.sample, "worst"));
        let failures = self.samples.iter().filter(|severity| severity.delta_v_mps.is_some());
        failures.take(count(self.selection.failures)).for_each(|severity| add(severity.sample, "failure"));
        let mut left: Vec<u64> = self.samples.iter().map(|severity| severity.sample).collect();
        let mut rng = stream(seed, 0, ego, CHANNEL);
        let mut drawn = Vec::new();
        while drawn.len() < count(self.selection.random) && !left.is_empty() {
            drawn.push(left.swap_remove(rng.random_range(0..left.len())));
        }
        drawn.sort_unstable();
        drawn.into_iter().for_each(|sample| add(sample, "random"));
        chosen
    }
}

fn severity(sample: u64, outcome: &Outcome) -> Severity {
    let finite = |value: Measured| value.ok().filter(|value| value.is_finite());
    let margins = [outcome.margins.min_thw_front_s, outcome.margins.min_thw_rear_s];
    let thw_s = margins.into_iter().filter_map(finite).fold(f64::INFINITY, f64::min);
    Severity { sample, delta_v_mps: outcome.ego_delta_v_mps(), thw_s }
}

/// By collision, then by headway; of two alike the later one is the lesser.
fn order(a: &Severity, b: &Severity) -> std::cmp::Ordering {
    let collided = |severity: &Severity| severity.delta_v_mps.unwrap_or(f64::NEG_INFINITY);
    collided(a).total_cmp(&collided(b)).then(b.thw_s.total_cmp(&a.thw_s)).then(b.sample.cmp(&a.sample))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_selection_is_read_and_written() {
        let read = |text: &str| text.parse::<Selection>();
        assert_eq!(read("worst:5,failures:20,random:3"), Ok(Selection { worst: 5, failures: 20, random: 3 }));
        assert_eq!(read("failures:0"), Ok(Selection::default()));
        assert_eq!(read("4"), read("failures:4"));
        let selection = Selection { worst: 1, failures: 0, random: 2 };
        assert_eq!(selection.to_string().parse(), Ok(selection));
        for wrong in ["", "worst", "worst:-1", "best:3", "worst:1,worst:2", "random:1;worst:1"] {
            assert!(read(wrong).is_err(), "{wrong}");
        }
    }

    fn chooser(selection: Selection, samples: &[(Option<f64>, f64)]) -> Chooser {
        let samples = samples.iter().zip(0..);
        let samples = samples.map(|(&(delta_v_mps, thw_s), sample)| Severity { sample, delta_v_mps, thw_s }).collect();
        Chooser { selection, samples }
    }

    #[test]
    fn collisions_are_worse_than_near_misses_and_each_sample_comes_once() {
        let samples = [(None, 0.4), (Some(2.0), 0.1), (None, 0.1), (Some(9.0), 0.3)];
        let chosen =
            chooser(Selection { worst: 3, failures: 1, random: 0 }, &samples).choose(0, &ActorId::new("ego").unwrap());
        let numbers: Vec<u64> = chosen.iter().map(|chosen| chosen.sample).collect();
        assert_eq!(numbers, [3, 1, 2]);
        assert_eq!(chosen[1].reasons, ["worst", "failure"]);
    }

    #[test]
    fn a_random_choice_follows_from_the_seed_and_never_repeats() {
        let samples = [(None, 1.0); 20];
        let choose = |random, seed| {
            chooser(Selection { worst: 0, failures: 0, random }, &samples).choose(seed, &ActorId::new("ego").unwrap())
        };
        assert_eq!(choose(5, 1), choose(5, 1));
        assert_ne!(choose(5, 1), choose(5, 2));
        assert_eq!(choose(100, 1).len(), 20);
    }
}
