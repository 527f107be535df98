//! Whether the ego slows down because of the vehicles behind it.
//!
//! An ego that is always slower has a longer gap ahead, and prevents collisions without looking
//! back. Such an ego also slows down if nobody is behind, or if the vehicles behind it do not
//! approach. In scenarios with the requirement `MIS-9`, some samples therefore run twice more,
//! while nothing happens ahead: without the vehicles that start behind the ego, and with these
//! vehicles so little faster than the ego that it is no approach. If the ego slows down in such a run by more than
//! the baseline does, it misses the requirement. The time at which it begins to slow down does not
//! matter.

use closecall_simulation::RunKey;
use closecall_traffic::statistics::format::percent;
use closecall_traffic::statistics::interval::lower_bound;

use crate::record::NobodyComing;
use crate::validity::CheckPlan;

/// The requirement that the system does not slow the ego unless a vehicle behind is the reason.
pub(crate) const REQUIREMENT: &str = "MIS-9";

/// Share of the samples that run again, besides the first two: a choice. Five hundred samples have
/// twelve such runs.
const SHARE: f64 = 0.02;

/// Largest share of these runs in which the ego may slow down. The library allows the same share
/// for `slowed_unprompted`.
pub(crate) const MOST: f64 = 0.05;

/// Confidence of the bound on that share.
pub(crate) const CONFIDENCE: f64 = 0.95;

/// Returns true if a sample of a scenario with these requirements runs again with nobody coming
/// from behind.
pub(crate) fn includes(requirements: &[String], key: RunKey) -> bool {
    CheckPlan::new(SHARE, CheckPlan::AT_MOST).is_ok_and(|plan| plan.includes(key))
        && requirements.iter().any(|mark| mark == REQUIREMENT)
}

/// The runs in which nobody comes from behind, of the arm under test.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Attribution {
    /// Number of samples that ran again and have a result.
    pub runs: u64,
    /// Number of samples in which such a run took too long, or its process failed.
    pub not_checked: u64,
    /// Number of them in which the ego slowed down, or its controller failed.
    pub slowed: u64,
    /// The largest amount by which the ego was slower than its lead vehicle (m/s).
    pub most_mps: f64,
}

impl Attribution {
    /// Adds a sample, beside the sample of the baseline if there is a baseline.
    pub fn push(&mut self, run: NobodyComing, baseline: Option<NobodyComing>) {
        let is_slowed = run.is_slowed(baseline);
        let has_result = is_slowed || !run.is_late;
        self.runs += u64::from(has_result);
        self.not_checked += u64::from(!has_result);
        self.slowed += u64::from(is_slowed);
        self.most_mps = self.most_mps.max(run.deficit_mps.unwrap_or(0.0));
    }

    /// Adds the samples of another scenario.
    pub fn add(&mut self, other: &Self) {
        self.runs += other.runs;
        self.not_checked += other.not_checked;
        self.slowed += other.slowed;
        self.most_mps = self.most_mps.max(other.most_mps);
    }

    /// Returns true if the ego slows down with nobody coming in too many samples: the one-sided
    /// lower bound of their share is above the allowed share.
    pub fn is_missed(&self) -> bool {
        lower_bound(self.slowed, self.runs, CONFIDENCE) > MOST
    }

    /// Returns true if the samples without a result decide whether the ego slows down in too many.
    pub fn is_undecided(&self) -> bool {
        let [slowed, runs] = [self.slowed, self.runs].map(|samples| samples + self.not_checked);
        !self.is_missed() && lower_bound(slowed, runs, CONFIDENCE) > MOST
    }

    /// Returns how many samples have no result, as a sentence.
    pub fn not_checked_sentence(&self) -> String {
        format!(
            "not checked in {} of {} samples: whether the ego slows down if no vehicle behind it approaches, because such a run took \
             too long, or its process failed",
            self.not_checked,
            self.runs + self.not_checked
        )
    }

    /// Returns what the runs say, as a sentence.
    pub fn sentence(&self) -> String {
        let Self { runs, slowed, most_mps, .. } = self;
        format!(
            "if no vehicle behind it approaches, the ego still slows down by up to {most_mps:.1} m/s, or its controller fails, in {slowed} of \
             {runs} checked samples (allowed: at most {}): the vehicles behind are not the reason",
            percent(MOST)
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn after(slowed: u64, runs: u64) -> Attribution {
        let mut attribution = Attribution::default();
        for run in 0..runs {
            attribution.push(NobodyComing::of(Some(if run < slowed { 8.0 } else { 0.1 })), None);
        }
        attribution
    }

    #[test]
    fn two_runs_decide_and_a_single_false_alarm_of_many_does_not() {
        assert!(after(2, 2).is_missed());
        assert!(!after(1, 12).is_missed());
        assert!(!after(0, 100).is_missed());
        assert!(!after(0, 0).is_missed());
        assert!(after(12, 100).is_missed());
    }

    #[test]
    fn a_controller_that_fails_without_a_vehicle_behind_is_no_better() {
        let mut attribution = Attribution::default();
        let failed = NobodyComing::of(None);
        (0..2).for_each(|_| attribution.push(failed, Some(failed)));
        assert!(attribution.is_missed());
    }

    #[test]
    fn runs_that_took_too_long_leave_open_what_they_could_decide() {
        let late = |late: u64, runs: u64| {
            let mut attribution = after(0, runs);
            (0..late).for_each(|_| attribution.push(NobodyComing::LATE, None));
            attribution
        };
        assert!(late(2, 0).is_undecided() && !late(2, 0).is_missed());
        assert!(!late(1, 12).is_undecided() && !late(0, 12).is_undecided());
        assert!(late(12, 88).is_undecided());
        // What one of the two runs shows, it shows.
        let slowed = NobodyComing::of(Some(8.0));
        assert!(slowed.worse(NobodyComing::LATE).is_slowed(None));
        let unslowed = NobodyComing::of(Some(0.1)).worse(NobodyComing::LATE);
        assert!(unslowed.is_late && !unslowed.is_slowed(None));
    }

    #[test]
    fn what_the_baseline_does_as_well_is_not_held_against_the_system() {
        let [as_baseline, more] = [3.2, 3.6].map(|deficit_mps| NobodyComing::of(Some(deficit_mps)));
        let baseline = Some(NobodyComing::of(Some(3.0)));
        assert!(!as_baseline.is_slowed(baseline) && as_baseline.is_slowed(None));
        assert!(more.is_slowed(baseline));
    }
}
