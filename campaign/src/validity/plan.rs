//! Which samples of a campaign are checked.
//!
//! The first few of each scenario, so that even a small campaign is; then one in each block of so many, at a place drawn
//! from the seed, so that no regular design is met at the same place again and again. Which samples those are follows from
//! the seed and the plan alone: not from how many samples there are, on how many machines, or how far one got.

use closecall_traffic::{ActorId, stream};
use rand::RngExt;
use serde::{Deserialize, Serialize};

use closecall_simulation::RunKey;

/// The first samples of each scenario, which are always checked.
const FIRST: u64 = 4;

/// Keys the stream that the checked samples are drawn from, which belongs to no actor.
const OWNER: &str = "validity";

/// A plan that makes no sense.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("{share} is no share of the samples to be checked: a number above 0 and up to 1 is needed")]
pub struct NotAPlan {
    share: f64,
}

/// Which samples are checked: the first, one in so many, and no more than so many beside the first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct CheckPlan {
    /// One in so many.
    one_in: u64,
    /// Most of each scenario, beside the first.
    at_most: u64,
}

impl CheckPlan {
    /// A share of the samples that costs little: each check is a handful of runs.
    pub const SHARE: f64 = 0.01;
    /// Most samples of each scenario, where nobody says otherwise.
    pub const AT_MOST: u64 = 1_000;

    /// Checks the first samples of each scenario, then about `share` of them, and no more than `at_most` beside the first.
    ///
    /// # Errors
    /// [`NotAPlan`] where `share` is not above 0 and up to 1.
    pub fn new(share: f64, at_most: u64) -> Result<Self, NotAPlan> {
        if !(share > 0.0 && share <= 1.0) {
            return Err(NotAPlan { share });
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "1 or more; a cast saturates")]
        let one_in = (1.0 / share).round() as u64;
        Ok(Self { one_in, at_most })
    }

    /// True where this sample is checked.
    pub fn has(self, key: RunKey) -> bool {
        let block = key.sample / self.one_in;
        if key.sample < FIRST {
            return true;
        }
        // One in each block: the number of the block counts them, without a look at the others.
        if block >= self.at_most {
            return false;
        }
        #[expect(clippy::expect_used, reason = "a constant, and a test draws from it")]
        let owner = ActorId::new(OWNER).expect("a legal name");
        let place = stream(key.seed, block, &owner, "checked/place").random_range(0..self.one_in);
        key.sample % self.one_in == place
    }
}

impl Default for CheckPlan {
    fn default() -> Self {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a constant of 100")]
        let one_in = (1.0 / Self::SHARE) as u64;
        Self { one_in, at_most: Self::AT_MOST }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn checked(plan: CheckPlan, samples: u64) -> Vec<u64> {
        (0..samples).filter(|&sample| plan.has(RunKey { seed: 3, sample })).collect()
    }

    #[test]
    fn the_share_is_kept_from_the_first_sample_on() {
        assert_eq!(checked(CheckPlan::default(), 3), [0, 1, 2]);
        let many = checked(CheckPlan::default(), 50_000);
        assert!((500..=504).contains(&many.len()), "{}", many.len());
        // One in each block, not always at the same place.
        assert!(many.iter().skip(5).map(|sample| sample % 100).collect::<std::collections::BTreeSet<_>>().len() > 50);
    }

    #[test]
    fn the_number_is_bounded() {
        assert!(checked(CheckPlan::default(), 1_000_000).len() <= 1_004);
        assert_eq!(checked(CheckPlan::new(1.0, 7).unwrap(), 100).len(), 7);
        assert_eq!(checked(CheckPlan::new(0.5, 0).unwrap(), 100), [0, 1, 2, 3]);
    }

    #[test]
    fn nonsense_is_refused() {
        for share in [0.0, -0.1, 1.1, f64::NAN] {
            assert!(CheckPlan::new(share, 10).is_err(), "{share}");
        }
    }
}
