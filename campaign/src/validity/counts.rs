//! The findings of the validity checks.

use serde::{Deserialize, Serialize};

/// A change under which the result must stay the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Invariance {
    /// The same run is repeated.
    Repetition,
    /// The actors are in another order.
    ActorOrder,
    /// The number of threads differs.
    Threads,
    /// Left and right are exchanged.
    Mirror,
    /// The points of the LiDARs are clustered a second time, by another DBSCAN.
    Clustering,
    /// The time step is halved; broken if that run ends in an error.
    HalfStep,
}

impl Invariance {
    /// Every check.
    pub const ALL: [Self; 6] =
        [Self::Repetition, Self::ActorOrder, Self::Threads, Self::Mirror, Self::Clustering, Self::HalfStep];

    /// Returns the name in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Repetition => "repetition",
            Self::ActorOrder => "actor-order",
            Self::Threads => "threads",
            Self::Mirror => "mirror",
            Self::Clustering => "clustering",
            Self::HalfStep => "half-step",
        }
    }

    /// Returns true if a controller that answers the same inputs in different ways breaks the
    /// check.
    pub const fn is_of_repeatability(self) -> bool {
        matches!(self, Self::Repetition | Self::Threads)
    }

    /// Returns the meaning of a failure of the check, as a sentence.
    pub const fn finding(self) -> &'static str {
        match self {
            Self::Repetition => "the same run gave another outcome when repeated",
            Self::ActorOrder => "another order of the actors gave another outcome",
            Self::Threads => "another number of threads gave another outcome",
            Self::Mirror => "the mirrored world gave an outcome that is not the mirror image",
            Self::Clustering => "another DBSCAN gave other clusters of the LiDAR's points",
            Self::HalfStep => "half the time step ended in an error",
        }
    }
}

/// The findings of the checks of one sample in one arm.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ArmChecks {
    /// Whether the ego collided at half the time step; `None` if that run has no outcome.
    pub collided_at_half_step: Option<bool>,
    /// The checks that failed.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub broken: Vec<Invariance>,
    /// Why a check has no result: its run took too long, or a process failed. Neither says anything
    /// about the simulator.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub not_checked: Option<String>,
}

/// One run of a scenario.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RunOfScenario {
    /// The sample.
    pub sample: u64,
    /// Index of the arm.
    pub arm: usize,
}

/// The findings of the checks of a campaign.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CheckCounts {
    /// Number of runs that were checked: samples times arms.
    pub runs: u64,
    /// Number of runs with at least one check without a result, because it took too long.
    pub not_checked: u64,
    /// Number of runs whose verdict (collision or none) flipped at half the time step.
    pub flips: u64,
    /// Number of failures of each check, in the order of [`Invariance::ALL`].
    pub counts: [u64; Invariance::ALL.len()],
    /// The first run that each check refutes, in the same order. The total of all scenarios has
    /// none: a run is one of a scenario.
    pub firsts: [Option<RunOfScenario>; Invariance::ALL.len()],
}

impl CheckCounts {
    /// Adds the findings about one run. `collided` says whether the ego collided in that run.
    pub fn push(&mut self, run: RunOfScenario, checks: &ArmChecks, collided: bool) {
        match checks.not_checked {
            Some(_) => self.not_checked += 1,
            None => self.runs += 1,
        }
        self.flips += u64::from(checks.collided_at_half_step.is_some_and(|halved| halved != collided));
        for ((count, first), kind) in self.counts.iter_mut().zip(&mut self.firsts).zip(Invariance::ALL) {
            if checks.broken.contains(&kind) {
                *count += 1;
                *first = first.or(Some(run));
            }
        }
    }

    /// Returns the first run that a check refutes; `None` if there is none.
    pub fn first(&self, check: Invariance) -> Option<RunOfScenario> {
        Invariance::ALL.into_iter().zip(self.firsts).find(|(kind, _)| *kind == check)?.1
    }

    /// Returns the checks that failed, each with the number of its failures.
    pub fn broken(&self) -> impl Iterator<Item = (Invariance, u64)> {
        Invariance::ALL.into_iter().zip(self.counts).filter(|(_, count)| *count > 0)
    }

    /// Returns the share of the checked verdicts that flipped; `None` if none was checked.
    pub fn flip_rate(&self) -> Option<f64> {
        (self.runs > 0).then(|| self.flips as f64 / self.runs as f64)
    }

    /// Adds the findings of another campaign or scenario.
    pub fn add(&mut self, other: &Self) {
        self.runs += other.runs;
        self.not_checked += other.not_checked;
        self.flips += other.flips;
        for (count, more) in self.counts.iter_mut().zip(other.counts) {
            *count += more;
        }
    }
}
