//! The choice of the samples that are checked for validity.
//!
//! The first samples of each scenario are checked, so that a small campaign is checked, too. They
//! are few, so that their checks do not dominate its time. After that, one sample in each block of
//! equal length is checked. The seed determines its index in the block; a constant index could
//! coincide with the period of a regular design. The seed and the plan alone determine the checked
//! samples. The number of samples, the number of machines, and the progress of the campaign do not
//! matter.

use closecall_simulation::RunKey;
use closecall_traffic::{ActorId, stream};
use rand::RngExt;
use serde::{Deserialize, Serialize};

/// Number of samples at the beginning of each scenario that are always checked.
pub(crate) const ALWAYS_CHECKED: u64 = 2;

/// Owner of the random stream that the checked samples are drawn from. It is not an actor of any
/// scenario.
const OWNER: &str = "validity";

/// A share of samples that is out of range.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("{share} is not a share of the samples to be checked: expected a number above 0 and up to 1")]
pub struct CheckPlanError {
    share: f64,
}

/// The samples of a campaign that are checked.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct CheckPlan {
    /// Length of a block: one sample in each block is checked.
    one_in: u64,
    /// Largest number of samples of each scenario that are checked, besides the first.
    at_most: u64,
    /// True if no sample is checked.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    off: bool,
}

impl CheckPlan {
    /// Default share of the samples. It costs little, although each check takes several runs.
    pub const SHARE: f64 = 0.01;
    /// Default of the largest number of checked samples of each scenario, besides the first.
    pub const AT_MOST: u64 = 1_000;

    /// Returns a plan that checks the first samples of each scenario, then about `share` of the
    /// samples, but not more than `at_most` besides the first.
    ///
    /// # Errors
    /// [`CheckPlanError`] if `share` is not above 0 and up to 1.
    pub fn new(share: f64, at_most: u64) -> Result<Self, CheckPlanError> {
        if !(share > 0.0 && share <= 1.0) {
            return Err(CheckPlanError { share });
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "1 or more; a cast saturates")]
        let one_in = (1.0 / share).round() as u64;
        Ok(Self { one_in, at_most, off: false })
    }

    /// Returns a plan that checks no sample, for measurements of speed. Every report says so.
    pub const fn off() -> Self {
        Self { one_in: 1, at_most: 0, off: true }
    }

    /// Returns true if no sample is checked.
    pub const fn is_off(self) -> bool {
        self.off
    }

    /// Returns true if this sample is checked.
    pub fn includes(self, key: RunKey) -> bool {
        if self.off {
            return false;
        }
        let block = key.sample / self.one_in;
        if key.sample < ALWAYS_CHECKED {
            return true;
        }
        // Each block has one checked sample, so that the block's number is the number of checked
        // samples before it.
        if block >= self.at_most {
            return false;
        }
        #[expect(clippy::expect_used, reason = "a constant, and a test draws from it")]
        let owner = ActorId::new(OWNER).expect("a legal name");
        let index = stream(key.seed, block, &owner, "checked/place").random_range(0..self.one_in);
        key.sample % self.one_in == index
    }
}

impl Default for CheckPlan {
    fn default() -> Self {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a constant of 100")]
        let one_in = (1.0 / Self::SHARE) as u64;
        Self { one_in, at_most: Self::AT_MOST, off: false }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn checked(plan: CheckPlan, samples: u64) -> Vec<u64> {
        (0..samples).filter(|&sample| plan.includes(RunKey { seed: 3, sample })).collect()
    }

    #[test]
    fn the_first_samples_and_the_share_of_the_rest_are_checked() {
        assert_eq!(checked(CheckPlan::default(), 3), [0, 1]);
        let many = checked(CheckPlan::default(), 50_000);
        assert!((500..=502).contains(&many.len()), "{}", many.len());
        // The index in the block varies.
        assert!(many.iter().skip(3).map(|sample| sample % 100).collect::<std::collections::BTreeSet<_>>().len() > 50);
    }

    #[test]
    fn the_number_of_checked_samples_is_bounded() {
        assert!(checked(CheckPlan::default(), 1_000_000).len() <= 1_002);
        assert_eq!(checked(CheckPlan::new(1.0, 7).unwrap(), 100).len(), 7);
        assert_eq!(checked(CheckPlan::new(0.5, 0).unwrap(), 100), [0, 1]);
    }

    #[test]
    fn a_plan_without_checks_checks_no_sample() {
        assert!(checked(CheckPlan::off(), 1_000).is_empty());
    }

    #[test]
    fn a_share_out_of_range_is_refused() {
        for share in [0.0, -0.1, 1.1, f64::NAN] {
            assert!(CheckPlan::new(share, 10).is_err(), "{share}");
        }
    }
}
