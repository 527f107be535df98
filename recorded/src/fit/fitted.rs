//! The fitted distributions of all quantities.

use super::correlation::{RankCorrelation, correlations};
use super::{FittedQuantity, Quantity, Samples, observe};
use crate::filters::{SmoothedFile, smooth};
use crate::trajectory_data::TrajectoryData;

/// The fitted distributions of all quantities, over all trajectory data sets.
#[derive(Clone, Debug, PartialEq)]
pub struct FittedDistributions {
    /// Name and BLAKE3 hash of each trajectory file.
    pub data_sets: Vec<(String, String)>,
    /// Seed of the bootstrap.
    pub seed: u64,
    /// One entry for each quantity with enough values.
    pub fitted: Vec<FittedQuantity>,
    /// The quantities with too few values, each with the number of its values.
    pub too_few: Vec<(Quantity, usize)>,
    /// Rank correlations between quantities; empty if they were not asked for.
    pub correlations: Vec<RankCorrelation>,
}

/// Fits the distributions of all quantities to `data_sets`; `seed` is the seed of the bootstrap.
pub fn fit(data_sets: &[TrajectoryData], seed: u64) -> FittedDistributions {
    FittedDistributions { correlations: Vec::new(), ..correlated(data_sets, seed) }
}

/// Fits the distributions like [`fit`], and the rank correlations between the quantities.
pub fn correlated(data_sets: &[TrajectoryData], seed: u64) -> FittedDistributions {
    let mut samples = Samples::default();
    for data in data_sets {
        samples.extend(observe(&smooth(data)));
    }
    fit_samples(&samples, data_sets.iter().map(|data| (data.name.clone(), data.hash.clone())).collect(), seed)
}

/// Fits the distributions, and the rank correlations between the quantities, like [`correlated`],
/// to files whose tracks are smoothed already.
pub fn correlated_in_files(files: &[SmoothedFile], seed: u64) -> FittedDistributions {
    let mut samples = Samples::default();
    for file in files {
        samples.extend(observe(&file.data));
    }
    fit_samples(&samples, files.iter().map(|file| (file.data.name.clone(), file.hash.clone())).collect(), seed)
}

/// Fits the distributions of samples of data sets with these names and hashes.
fn fit_samples(samples: &Samples, data_sets: Vec<(String, String)>, seed: u64) -> FittedDistributions {
    let (mut fitted, mut too_few) = (Vec::new(), Vec::new());
    for quantity in Quantity::ALL {
        let values = samples.values(quantity);
        match FittedQuantity::new(quantity, values, seed) {
            Some(distribution) => fitted.push(distribution),
            None => too_few.push((quantity, values.len())),
        }
    }
    let correlations = correlations(samples);
    FittedDistributions { data_sets, seed, fitted, too_few, correlations }
}
