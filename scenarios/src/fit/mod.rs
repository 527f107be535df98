//! From recordings to the distributions of a logical scenario.
//!
//! ```text
//!   recordings ─▶ lane changes, car following ─▶ samples of nine quantities ─▶ quantiles, parametric forms, intervals ─▶ TOML
//! ```
//!
//! # The quantities
//!
//! | name                     | one value for each                     | what                                              |
//! |--------------------------|----------------------------------------|---------------------------------------------------|
//! | `cut-out-thw-s`          | lane change to the left, with a lead   | headway to the vehicle that is pulled out from behind, when the centre crosses the marking |
//! | `critical-cut-out-thw-s` | the same, where it is critical          | the same, below the critical 0.9 s                |
//! | `lane-change-duration-s` | complete lane change                   | duration of the whole manoeuvre                   |
//! | `lane-change-width-s`    | complete lane change                   | width of its peak of lateral speed, as published  |
//! | `closing-mps`            | lane change to the left, approaching   | closing speed to that vehicle when the manoeuvre starts |
//! | `crossing-mps`           | lane change                            | speed when the centre crosses the marking         |
//! | `front-thw-s`            | pair of follower and lead              | median headway while following                    |
//! | `short-front-thw-s`      | the same, where it is short             | the same, from 0.5 s to the critical 0.9 s        |
//! | `following-mps`          | pair of follower and lead              | median speed while following                      |
//!
//! To the left, because that is where one overtakes. A vehicle counts as following, and as pulling out from behind a
//! lead, where its headway is at most 3 s: beyond that drivers choose their speed freely (Highway Capacity Manual,
//! criterion for percent followers). A pair needs 2 s of following; one value for each pair, because the instants of
//! one pair are anything but independent. Short recordings may lack the true lead; headways are upper bounds then.
//!
//! # What is stated with each
//!
//! The number of values, the recordings, and the 95 % percentile bootstrap interval of the median (2,000 resamples, from
//! a stated seed). Beside the empirical quantiles stands a parametric form, log-normal for headways, durations and
//! closing speeds, normal cut at ±3 standard deviations for speeds, with the Kolmogorov–Smirnov distance and the
//! probability of a larger one if the form were true. That probability comes from a parametric bootstrap (1,000
//! samples, each fitted anew), because the parameters are fitted to the same values. With fewer than 5 values nothing
//! is fitted.

mod distribution;
mod observe;
mod toml_text;

pub use distribution::{FittedQuantity, Form, Goodness, MIN_VALUES};
pub use observe::{Quantity, Samples, observe};
pub use toml_text::{Heading, to_toml, write_toml};

use crate::filters::smooth;
use crate::recordings::Recording;

/// The distributions of all quantities, over all recordings.
#[derive(Clone, Debug, PartialEq)]
pub struct FittedDistributions {
    /// Name and hash of each recording.
    pub recordings: Vec<(String, String)>,
    /// Seed of the bootstrap.
    pub seed: u64,
    /// One for each quantity that has enough values.
    pub fitted: Vec<FittedQuantity>,
    /// The quantities with too few values, and how many there are.
    pub too_few: Vec<(Quantity, usize)>,
}

/// Fits the distributions of all quantities to `recordings`; `seed` is the bootstrap's.
pub fn fit(recordings: &[Recording], seed: u64) -> FittedDistributions {
    let mut samples = Samples::default();
    for recording in recordings {
        samples.extend(observe(&smooth(recording)));
    }
    let (mut fitted, mut too_few) = (Vec::new(), Vec::new());
    for quantity in Quantity::ALL {
        let values = samples.values(quantity);
        match FittedQuantity::new(quantity, values, seed) {
            Some(distribution) => fitted.push(distribution),
            None => too_few.push((quantity, values.len())),
        }
    }
    let recordings = recordings.iter().map(|recording| (recording.name.clone(), recording.hash.clone())).collect();
    FittedDistributions { recordings, seed, fitted, too_few }
}
