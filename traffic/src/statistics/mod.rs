//! Statistical inference about probabilities from samples, and about the difference of two arms
//! from paired samples.
//!
//! ```text
//!   number of samples n fixed in advance ─▶ exact intervals (Clopper–Pearson), exact McNemar test
//!   results inspected during sampling   ─▶ confidence sequence: valid at every n at once
//! ```
//!
//! * [`binomial`]: probabilities of the binomial distribution, accurate to the last few bits
//! * [`consistency`]: whether a filter's covariance agrees with its errors
//! * [`format`](mod@format): shares as text
//! * [`interval`]: exact bounds of a probability for a number of samples that is fixed in advance
//! * [`sequence`]: bounds of a probability that hold at every number of samples at once, and may be
//!   inspected at any time
//! * [`needed`]: the number of samples that a bound needs
//! * [`mcnemar`]: whether two arms differ on the same samples
//! * [`holm`]: p-values corrected for the number of tests
//! * [`log_linear`]: quantiles of any number of values in bounded memory
//! * [`quantiles`]: quantiles of sorted values, and the distribution that they define
//! * [`two_sample`]: whether new values come from a fitted distribution
//! * [`normal`]: the truncated normal distribution
//! * [`sensitivity`]: which input of a function moves its output most
//!
//! All methods for probabilities assume independent, identically distributed samples, as in the
//! random sampling design.

pub mod binomial;
mod cholesky;
pub mod consistency;
pub mod format;
pub mod holm;
pub mod interval;
pub mod log_linear;
pub mod mcnemar;
pub mod needed;
pub mod normal;
pub mod quantiles;
pub mod sensitivity;
pub mod sequence;
pub mod two_sample;

pub use cholesky::cholesky;

#[cfg(test)]
mod tests;
