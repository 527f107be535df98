//! The use of the arm under test beyond its references: whether a reference does at least as much
//! at no higher cost.

use std::fmt;

use closecall_campaign::ledger::Cost;
use closecall_campaign::summary::{Counts, Summary};

/// The effects and the cost of an arm.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Standing<'a> {
    arm: &'a str,
    prevented: u64,
    induced: u64,
    /// The mean over the samples.
    cost: Cost,
}

impl Standing<'_> {
    /// Returns true if this arm prevents as much as `other`, induces no more, and costs no more. A
    /// value that is not a number makes the answer false.
    fn is_as_good_as(&self, other: &Self) -> bool {
        let costs_no_more = self.cost.time_lost_s <= other.cost.time_lost_s
            && self.cost.speed_deficit_mps <= other.cost.speed_deficit_mps
            && self.cost.imposed_braking_mps2 <= other.cost.imposed_braking_mps2;
        self.prevented >= other.prevented && self.induced <= other.induced && costs_no_more
    }
}

/// Writes the prevented and induced collisions and the cost of each arm.
impl fmt::Display for Standing<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Cost { time_lost_s, speed_deficit_mps, imposed_braking_mps2 } = self.cost;
        write!(
            f,
            "{}: {} prevented, {} induced, {time_lost_s:.1} s late, {speed_deficit_mps:.1} m/s slower, the vehicle behind brakes by {imposed_braking_mps2:.1} m/s²",
            self.arm, self.prevented, self.induced
        )
    }
}

/// The statement of one scenario.
pub(super) struct ParetoText<'a> {
    tested: Standing<'a>,
    references: Vec<Standing<'a>>,
}

impl<'a> ParetoText<'a> {
    /// Returns the statement; `None` without a reference.
    pub(super) fn of(summary: &'a Summary, counts: &Counts) -> Option<Self> {
        let standing = |pair: &closecall_campaign::arm_pairs::ArmPair| {
            let arm = counts.arms.get(pair.tested)?;
            Some(Standing {
                arm: summary.controllers.get(pair.tested)?,
                prevented: pair.pairs.prevented,
                induced: pair.pairs.induced,
                cost: arm.mean_cost()?,
            })
        };
        let with_baseline = counts.arm_pairs.iter().filter(|pair| pair.baseline == 0);
        let mut references: Vec<Standing<'_>> = with_baseline.filter_map(standing).collect();
        let tested = references.pop()?;
        (!references.is_empty()).then_some(Self { tested, references })
    }
}

impl fmt::Display for ParetoText<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { tested, references } = self;
        let better: Vec<&str> = references
            .iter()
            .filter(|reference| reference.is_as_good_as(tested))
            .map(|reference| reference.arm)
            .collect();
        if better.is_empty() {
            writeln!(
                f,
                "  no reference prevents as much as {} without inducing more or costing more (means over the samples):",
                tested.arm
            )?;
        } else {
            let better = better.join(" and ");
            writeln!(
                f,
                "  {} adds nothing to {better}: as much prevented, no more induced, no higher cost (means over the samples):",
                tested.arm
            )?;
        }
        references.iter().chain([tested]).try_for_each(|standing| writeln!(f, "    {standing}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn standing(arm: &str, prevented: u64, cost: Cost) -> Standing<'_> {
        Standing { arm, prevented, induced: 1, cost }
    }

    #[test]
    fn an_arm_adds_nothing_to_one_that_does_as_much_at_no_higher_cost() {
        let cost = Cost { time_lost_s: 2.0, speed_deficit_mps: 8.0, imposed_braking_mps2: 0.5 };
        let tested = standing("mis", 70, cost);
        let text = |reference| ParetoText { tested, references: vec![reference] }.to_string();
        assert!(text(standing("gap", 70, cost)).contains("mis adds nothing to gap"));
        assert!(text(standing("gap", 69, Cost::default())).contains("no reference"), "it prevents less");
        for higher in [
            Cost { time_lost_s: 3.0, ..cost },
            Cost { speed_deficit_mps: 9.0, ..cost },
            Cost { imposed_braking_mps2: 0.6, ..cost },
        ] {
            assert!(text(standing("blind", 90, higher)).contains("no reference"), "it costs more: {higher:?}");
        }
        let unknown = Cost { time_lost_s: f64::NAN, ..Cost::default() };
        assert!(text(standing("gap", 90, unknown)).contains("no reference"), "nobody knows its cost");
    }
}
