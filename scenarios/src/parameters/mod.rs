//! The `[parameters]` of a scenario file: the only values that are sampled.
//!
//! Each parameter has one distribution and may state its provenance (`fitted` or `assumed`):
//!
//! ```toml
//! [parameters]
//! cruise-mps    = { uniform = { min = 30.0, max = 33.2 }, assumed = "speeds of German motorways" }
//! front-thw-s   = { truncated-normal = { mean = 0.7, sd = 0.15, min = 0.5, max = 0.9 } }
//! reaction-s    = { log-normal = { median = 1.25, sigma = 0.3, max = 2.5 } }
//! cut-out-thw-s = { empirical = { quantiles = [0.15, 0.19, 0.24, 0.31, 0.4] }, fitted = { n = 214, source = "US-101" } }
//! rear-class    = { choice = { car = 0.8, truck = 0.1, motorcycle = 0.1 } }
//! brake-mps2    = { fixed = 6.0 }
//! ```
//!
//! Every distribution is sampled through its quantile function. A sampling design
//! ([`crate::sampling`]) therefore only chooses one number in [0, 1) for each parameter.

mod config;
mod copula;
#[cfg(test)]
mod copula_tests;
mod distribution;
mod finite;
mod space;
mod strata;
#[cfg(test)]
mod tests;

pub use config::{
    EmpiricalConfig, FittedConfig, LogNormalConfig, ObservedConfig, ParameterConfig, ParametersConfig,
    TruncatedNormalConfig, UniformConfig,
};
pub use distribution::Distribution;
pub(crate) use strata::{Part, Strata, volume};

pub use space::{NormalPoint, ParameterSpace, Provenance, SpaceEntry, Variation};
