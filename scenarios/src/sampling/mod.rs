//! Sampling designs: which values the parameters take in sample 0, 1, 2 …
//!
//! A design chooses for each sample and parameter one number u in [0, 1); the parameter's quantile function
//! ([`crate::parameters`]) makes a value of it. Every design is addressed by index, so that a sample can be worked out
//! alone, in any order and on any thread, always with the same bits.
//!
//! | design   | u                                                                  | sample k depends on n |
//! |----------|--------------------------------------------------------------------|-----------------------|
//! | `random` | independent, from the stream of (seed, k, the parameter's name)    | no                    |
//! | `sobol`  | a Sobol sequence, Owen-scrambled by the seed; one dimension a name | no                    |
//! | `grid`   | midpoints of equally probable parts, in all combinations           | yes                   |

mod design;
mod grid;
mod random;
mod sobol;

#[cfg(test)]
mod tests;

pub use design::{Design, UnknownDesign};
