//! Sensitivity analysis: which input of a function moves its output most.
//!
//! All inputs, here called *factors*, are coordinates of the unit cube. The caller maps each to a
//! value, as a rule through the inverse of its distribution function.
//!
//! ```text
//!   few runs      ─▶ morris      elementary effects: which factors matter at all (screening)
//!   many runs     ─▶ saltelli    Sobol' indices: the share of the output's variance that a factor explains
//!   runs at hand  ─▶ given_data  the first-order share, from samples that were drawn for another purpose
//! ```
//!
//! * [`morris`]: M. D. Morris, *Factorial sampling plans for preliminary computational
//!   experiments*, Technometrics 33 (1991) 161–174, with μ* of F. Campolongo, J. Cariboni and A.
//!   Saltelli, Environmental Modelling & Software 22 (2007) 1509–1518
//! * [`saltelli`]: A. Saltelli et al., *Variance based sensitivity analysis of model output*,
//!   Computer Physics Communications 181 (2010) 259–270, with the total index of M. J. W. Jansen,
//!   Computer Physics Communications 117 (1999) 35–43
//! * [`given_data`]: E. Plischke, E. Borgonovo and C. L. Smith, *Global sensitivity measures from
//!   given data*, European Journal of Operational Research 226 (2013) 536–550
//! * [`jackknife`]: the intervals of all of them

pub mod given_data;
pub mod jackknife;
pub mod morris;
pub mod saltelli;

#[cfg(test)]
mod functions;
#[cfg(test)]
mod tests;
