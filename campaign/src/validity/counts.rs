//! What the validity checks found.

use serde::{Deserialize, Serialize};

/// A check that must not make a difference.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Invariance {
    /// The same run again.
    Repetition,
    /// Another order of the actors.
    ActorOrder,
    /// Another number of threads.
    Threads,
    /// Left and right exchanged.
    Mirror,
    /// Half the time step, where it ends in an error.
    HalfStep,
}

impl Invariance {
    /// Every check.
    pub const ALL: [Self; 5] = [Self::Repetition, Self::ActorOrder, Self::Threads, Self::Mirror, Self::HalfStep];

    /// The name in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Repetition => "repetition",
            Self::ActorOrder => "actor-order",
            Self::Threads => "threads",
            Self::Mirror => "mirror",
            Self::HalfStep => "half-step",
        }
    }

    /// What it means that the check found something.
    pub const fn finding(self) -> &'static str {
        match self {
            Self::Repetition => "the same run gave another outcome when repeated",
            Self::ActorOrder => "another order of the actors gave another outcome",
            Self::Threads => "another number of threads gave another outcome",
            Self::Mirror => "the mirrored world gave an outcome that is not the mirror image",
            Self::HalfStep => "half the time step ended in an error",
        }
    }
}

/// What the checks of one sample found in one arm.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ArmChecks {
    /// Whether E collided at half the time step; nothing where that run has no outcome.
    pub collided_at_half_step: Option<bool>,
    /// The checks that made a difference where none may be.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub broken: Vec<Invariance>,
}

/// What the checks found in a campaign.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CheckCounts {
    /// Runs that were checked: samples times arms.
    pub runs: u64,
    /// Verdicts that flipped at half the time step.
    pub flips: u64,
    /// How often each check made a difference, in the order of [`Invariance::ALL`].
    pub counts: [u64; Invariance::ALL.len()],
}

impl CheckCounts {
    /// Takes in what was found about a run in which E did or did not collide.
    pub fn take(&mut self, found: &ArmChecks, collided: bool) {
        self.runs += 1;
        self.flips += u64::from(found.collided_at_half_step.is_some_and(|halved| halved != collided));
        for &check in &found.broken {
            self.count(check);
        }
    }

    /// Counts a check that made a difference.
    pub fn count(&mut self, check: Invariance) {
        for (count, known) in self.counts.iter_mut().zip(Invariance::ALL) {
            *count += u64::from(known == check);
        }
    }

    /// The checks that made a difference, with how often.
    pub fn broken(&self) -> impl Iterator<Item = (Invariance, u64)> {
        Invariance::ALL.into_iter().zip(self.counts).filter(|(_, count)| *count > 0)
    }

    /// Share of the checked verdicts that flipped; nothing where none was checked.
    pub fn flip_rate(&self) -> Option<f64> {
        (self.runs > 0).then(|| self.flips as f64 / self.runs as f64)
    }

    /// Adds what was found in another campaign.
    pub fn add(&mut self, other: &Self) {
        self.runs += other.runs;
        self.flips += other.flips;
        for (count, more) in self.counts.iter_mut().zip(other.counts) {
            *count += more;
        }
    }
}
