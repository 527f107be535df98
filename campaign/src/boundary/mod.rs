//! The boundary between failing and passing along two parameters, with its uncertainty.
//!
//! ```text
//!  20 points that fill the rectangle ─▶ runs ─▶ margins ─▶ Gaussian process ─▶ boundary, 95 % band, shares
//!                                        ▲                       │
//!                                        └── points whose sign ◀─┘
//!                                            is most uncertain
//! ```
//!
//! The *margin* is how far a number of the sample is from a bound: positive if the event does not
//! happen. A Gaussian process interpolates it over the rectangle of the two parameters, and its
//! zero line is the boundary. All other parameters keep their nominal values, and all runs share
//! their random numbers, so that the margin is a function of the two parameters alone.
//!
//! Sources:
//! - design of the runs: B. Bryan, J. Schneider, R. C. Nichol, C. J. Miller, C. R. Genovese and L.
//!   Wasserman, *Active learning for identifying function threshold boundaries*, NIPS 18 (2005):
//!   the straddle heuristic. Several points at once: D. Ginsbourger, R. Le Riche and L.
//!   Carraro, *Kriging is well-suited to parallelize optimization* (2010): the kriging believer
//! - number of first runs: J. L. Loeppky, J. Sacks and W. J. Welch, *Choosing the sample size of a
//!   computer experiment*, Technometrics 51 (2009): ten for each parameter
//! - choice by left-out runs: S. Sundararajan and S. S. Keerthi, *Predictive approaches for
//!   choosing hyperparameters in Gaussian processes*, NIPS 12 (1999)
//!
//! The seed determines every run and every figure, on any number of threads. `friedrich` takes
//! exponentials from the C library: on another processor the last digits may differ, and then also
//! the points that are run.

mod axis;
mod check;
mod plan;
mod result;
mod search;
mod slices;
mod surface;

pub use axis::{Axis, AxisError};
pub use check::{Doubt, LeaveOneOut};
pub use plan::{BoundaryError, BoundaryPlan};
pub use result::{Boundary, Ran, Surveyed};
pub use search::{LARGEST_BUDGET, SMALLEST_BUDGET, START_RUNS};
pub use slices::{Area, Crossing, Map, Slice};
