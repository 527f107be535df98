//! The identity of a run: a seed and the number of a sample.

/// Identifies one sample of a scenario.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RunKey {
    /// The campaign's seed.
    pub seed: u64,
    /// The sample's number, from 0.
    pub sample: u64,
}
