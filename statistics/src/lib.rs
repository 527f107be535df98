//! How sure one can be of a probability from samples, and of a difference from pairs.
//!
//! ```text
//!   n fixed in advance ─▶ exact intervals (Clopper–Pearson), exact McNemar test
//!   looked at on the way ─▶ confidence sequence: valid at every n at once
//! ```
//!
//! * [`binomial`]: probabilities of the binomial distribution, to the last few bits
//! * [`interval`]: exact bounds of a probability at a number of samples that was fixed in advance
//! * [`sequence`]: bounds that hold at every number of samples at once, and may therefore be looked at all the time
//! * [`needed`]: how many samples a bound still needs
//! * [`mcnemar`]: whether pairs differ
//! * [`quantiles`]: quantiles of sorted values, and the distribution that they define
//! * [`normal`]: the truncated normal distribution
//!
//! Everything about probabilities rests on samples that are independent and equally distributed, as those of the random design are.

pub mod binomial;
pub mod interval;
pub mod mcnemar;
pub mod needed;
pub mod normal;
pub mod quantiles;
pub mod sequence;

#[cfg(test)]
mod tests;
