//! What a campaign comes to: the counts of each scenario and of all.

use closecall_traffic::ActorId;

use super::ledger::{ArmCounts, Pairs};
use super::record::Record;
use super::verdict::{Evidence, Gates, Judgement};

/// The counts of one scenario, or of all.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Counts {
    /// The counts of each arm, the baseline first where the campaign is paired.
    pub arms: Vec<ArmCounts>,
    /// Pairs of baseline and tested arm.
    pub pairs: Pairs,
    /// Samples that were run.
    pub samples: u64,
    /// Samples whose repetition came out differently.
    pub invalid: u64,
    /// Simulated time of all runs [s].
    pub simulated_s: f64,
}

impl Counts {
    fn new(arms: usize) -> Self {
        Self { arms: vec![ArmCounts::default(); arms], ..Self::default() }
    }

    fn take(&mut self, record: &Record, ego: &ActorId) {
        let mut collided = Vec::with_capacity(self.arms.len());
        for (counts, arm) in self.arms.iter_mut().zip(&record.arms) {
            let tally = arm.tally(ego);
            counts.take(tally);
            collided.push(tally.collided);
            self.simulated_s += arm.result.as_ref().map_or(0.0, |outcome| outcome.duration.s());
        }
        if let [Some(baseline), Some(tested)] = collided[..] {
            self.pairs.take(baseline, tested);
        }
        self.samples += 1;
        self.invalid += u64::from(record.repeat_differs);
    }

    fn add(&mut self, other: &Self) {
        for (sum, counts) in self.arms.iter_mut().zip(&other.arms) {
            sum.add(counts);
        }
        self.pairs.add(&other.pairs);
        self.samples += other.samples;
        self.invalid += other.invalid;
        self.simulated_s += other.simulated_s;
    }

    /// Errors in any arm.
    pub fn errors(&self) -> u64 {
        self.arms.iter().map(|arm| arm.errors).sum()
    }
}

/// What a campaign comes to.
#[derive(Clone, Debug, PartialEq)]
pub struct Summary {
    /// The controllers, in the order of the arms.
    pub controllers: Vec<String>,
    /// The counts of each scenario, by name.
    pub scenarios: Vec<(String, Counts)>,
}

impl Summary {
    /// Nothing yet.
    pub fn new(controllers: Vec<String>) -> Self {
        Self { controllers, scenarios: Vec::new() }
    }

    /// Begins the counts of the next scenario.
    pub fn begin(&mut self, scenario: &str) {
        self.scenarios.push((scenario.to_owned(), Counts::new(self.controllers.len())));
    }

    /// Takes in a sample of the scenario begun last.
    pub fn take(&mut self, record: &Record, ego: &ActorId) {
        if let Some((_, counts)) = self.scenarios.last_mut() {
            counts.take(record, ego);
        }
    }

    /// The counts of all scenarios together.
    pub fn total(&self) -> Counts {
        let mut total = Counts::new(self.controllers.len());
        for (_, counts) in &self.scenarios {
            total.add(counts);
        }
        total
    }

    /// True where a baseline stands beside the arm under test.
    pub fn is_paired(&self) -> bool {
        self.controllers.len() == 2
    }

    /// Judges the arm under test, the last one.
    pub fn judge(&self, gates: Gates) -> Judgement {
        let total = self.total();
        let tested = total.arms.last().copied().unwrap_or_default();
        gates.judge(&Evidence {
            tested: &tested,
            errors: total.errors(),
            invalid: total.invalid,
            pairs: self.is_paired().then_some(&total.pairs),
        })
    }
}
