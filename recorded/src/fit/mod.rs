//! Fits the parameter distributions of a logical scenario to trajectory data.
//!
//! ```text
//!   trajectory data ─▶ lane changes, car following ─▶ values of nine quantities ─▶ quantiles, forms, intervals ─▶ TOML
//! ```
//!
//! # The quantities
//!
//! | name                     | one value for each                              | meaning                                  |
//! |--------------------------|-------------------------------------------------|------------------------------------------|
//! | `cut-out-thw-s`          | lane change to the left behind a lead vehicle   | headway to the lead vehicle of the old lane when the centre crosses the marking |
//! | `critical-cut-out-thw-s` | the same                                        | the same, only values below the critical 0.9 s |
//! | `lane-change-duration-s` | complete lane change                            | duration of the whole manoeuvre          |
//! | `lane-change-width-s`    | complete lane change                            | width of its peak of lateral speed, as published |
//! | `closing-mps`            | lane change to the left, approaching that lead vehicle | closing speed to it when the manoeuvre starts |
//! | `crossing-mps`           | lane change                                     | speed when the centre crosses the marking |
//! | `front-thw-s`            | pair of following and lead vehicle              | median headway while following           |
//! | `short-front-thw-s`      | the same                                        | the same, only values from 0.5 s to the critical 0.9 s |
//! | `following-mps`          | pair of following and lead vehicle              | median speed of the following vehicle    |
//!
//! Only lane changes to the left count for the headway and the closing speed, because vehicles
//! overtake on the left. A vehicle counts as following, or as cutting out from behind a lead
//! vehicle, if its headway is at most 3 s: beyond that, drivers choose their speed freely (Highway
//! Capacity Manual, criterion for percent followers). A pair needs 2 s of following. Each pair
//! gives one value, because the instants of one pair are not independent. If short trajectory data
//! does not contain the true lead vehicle, the headways are upper bounds.
//!
//! # Output for each quantity
//!
//! Each result states the number of values, the trajectory data, and the 95 % percentile bootstrap
//! interval of the median (2,000 resamples, from a stated seed). Besides the empirical quantiles
//! there is a parametric form: log-normal for headways, durations and closing speeds, normal
//! truncated at ±3 standard deviations for speeds. It comes with its Kolmogorov–Smirnov distance
//! and the probability of a larger distance if the form were true. That probability comes from a
//! parametric bootstrap (1,000 samples, with the form refitted to each), because the parameters are
//! fitted to the same values. With fewer than 5 values nothing is fitted.
//!
//! [`correlated`] adds Spearman's rank correlations, which scenarios sample by a Gaussian copula
//! (`closecall_scenarios::parameters`).

mod correlation;
mod distribution;
mod fitted;
mod observe;
mod toml_text;

pub use correlation::RankCorrelation;
pub use distribution::{FittedQuantity, Form, GoodnessOfFit, MIN_VALUES};
pub use fitted::{FittedDistributions, correlated, correlated_in_files, fit};
pub use observe::{Quantity, Samples, observe};
pub use toml_text::{DECIMALS, Heading, to_toml, write_toml};
