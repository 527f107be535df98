//! The McNemar test: whether two arms differ on the same samples.
//!
//! Q. McNemar, *Note on the sampling error of the difference between correlated proportions or
//! percentages*, Psychometrika 12 (1947) 153–157. If the arms do not differ, each discordant pair
//! favours either arm with a probability of ½. The exact test computes how improbable the observed
//! split is under this binomial distribution. It is valid for a number of pairs that is fixed in
//! advance.
//!
//! The ½ holds only for an event with the same definition in both arms, such as *some vehicle
//! collides*. The exact test rejects less often than its level says. The mid-p test counts half of
//! the probability of the observed split, and its level is near the stated one: M. W. Fagerland, S.
//! Lydersen and P. Laake, *The McNemar test for binary matched-pairs data: mid-p and asymptotic are
//! better than exact conditional*, BMC Medical Research Methodology 13 (2013) 91.

use super::binomial::at_most;

/// Returns the two-sided p-value: the probability of a split of the discordant pairs at least as
/// uneven as the observed one, if the arms do not differ. `prevented` and `induced` are the numbers
/// of discordant pairs in favour of either arm.
pub fn two_sided_p(prevented: u64, induced: u64) -> f64 {
    (2.0 * at_most(prevented.min(induced), prevented + induced, 0.5)).min(1.0)
}

/// Returns the two-sided mid-p value: the value of [`two_sided_p`] minus half of the probability of
/// the observed split and of its mirror image. `first_alone` and `second_alone` are the numbers of
/// pairs in which the event happens in one arm alone.
pub fn mid_p(first_alone: u64, second_alone: u64) -> f64 {
    let (least, pairs) = (first_alone.min(second_alone), first_alone + second_alone);
    if pairs == 0 || first_alone == second_alone {
        return two_sided_p(first_alone, second_alone);
    }
    let up_to = at_most(least, pairs, 0.5);
    let below = least.checked_sub(1).map_or(0.0, |fewer| at_most(fewer, pairs, 0.5));
    up_to + below
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mid_p_value_lacks_the_probability_of_the_split_once() {
        // Of 4 pairs, 0 : 4 has a probability of 1/16 either way: 2/16 exact, 1/16 mid-p.
        assert!((two_sided_p(0, 4) - 0.125).abs() < 1e-12 && (mid_p(0, 4) - 0.0625).abs() < 1e-12);
        assert!((mid_p(1, 3) - (5.0 + 1.0) / 16.0).abs() < 1e-12);
        assert_eq!((mid_p(0, 0), mid_p(3, 3)), (1.0, 1.0));
        assert_eq!(mid_p(75, 51), mid_p(51, 75));
    }

    /// Returns the probability that the test rejects at 5 % if either arm is as likely, over the
    /// number of discordant pairs, which is binomial.
    fn size(samples: u64, discordant: f64) -> f64 {
        let exactly = |count: u64, trials: u64, p: f64| {
            at_most(count, trials, p) - count.checked_sub(1).map_or(0.0, |fewer| at_most(fewer, trials, p))
        };
        (0..=samples)
            .map(|pairs| {
                let weight = exactly(pairs, samples, discordant);
                if weight < 1e-9 {
                    return 0.0;
                }
                let rejected = (0..=pairs).filter(|&first| mid_p(first, pairs - first) <= 0.05);
                weight * rejected.map(|first| exactly(first, pairs, 0.5)).sum::<f64>()
            })
            .sum()
    }

    #[test]
    fn the_test_rejects_equal_arms_at_its_stated_level() {
        for (samples, discordant) in [(600, 0.05), (600, 0.1), (1_000, 0.05), (1_000, 0.1), (1_000, 0.2)] {
            let size = size(samples, discordant);
            assert!((0.04..=0.06).contains(&size), "{samples} samples, {discordant} discordant: {size}");
        }
    }
}
