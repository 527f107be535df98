//! Sampling designs: the parameter values of sample 0, 1, 2 …
//!
//! For each sample and parameter, a design chooses one number u in [0, 1), and the quantile
//! function of the parameter ([`crate::parameters`]) maps it to a value. Every design is addressed
//! by the sample index, so that each sample can be computed alone, in any order and on any thread,
//! always with the same bits.
//!
//! | design   | number u of sample k                                                     | depends on sample count n |
//! |----------|--------------------------------------------------------------------------|---------------------------|
//! | `random` | independent, from the random stream of (seed, k, parameter name)         | no                        |
//! | `sobol`  | Sobol sequence, Owen-scrambled by the seed, one dimension for each name  | no                        |
//! | `grid`   | midpoints of equally probable parts, in all combinations                 | yes                       |
//! | `coverage` | as `random`, within the part of each bin of a coverage cross, in turn  | no                        |
//!
//! Parameters that state rank correlations ([`crate::parameters`]) are coupled in `random` and
//! `sobol`. A grid covers all combinations of its levels, whatever their correlation.

mod coverage;
mod design;
mod grid;
mod random;
mod sobol;

#[cfg(test)]
mod tests;

pub use design::{Design, UnknownDesign};
pub(crate) use random::scenario_stream;
pub use sobol::unit_point;
