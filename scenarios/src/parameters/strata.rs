//! Parts of the unit cube that the sampling design `coverage` visits in turn.
//!
//! A bin of a coverage item or cross is a part of the cube: an interval of the number u of each of
//! its parameters. Its weight is its volume, which is its probability. A bin without a volume
//! cannot be hit.

/// An interval of the number u of one parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Part {
    /// The index of the parameter in the order of the names.
    pub(crate) parameter: usize,
    /// The interval in [0, 1].
    pub(crate) interval: [f64; 2],
}

/// The bins that are visited.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Strata {
    bins: Vec<Vec<Part>>,
}

impl Strata {
    /// Returns the strata of bins. Those that cannot be hit are left out.
    pub(crate) fn new(bins: Vec<Vec<Part>>) -> Self {
        Self { bins: bins.into_iter().filter(|parts| volume(parts) > 0.0).collect() }
    }

    /// Returns true if there are none.
    pub(crate) const fn is_empty(&self) -> bool {
        self.bins.is_empty()
    }

    /// Returns the parts of the bin that sample `index` visits; nothing if there are no bins.
    pub(crate) fn of_sample(&self, index: u64) -> &[Part] {
        match self.bins.len() as u64 {
            0 => &[],
            bins => &self.bins[(index % bins) as usize],
        }
    }
}

/// Returns the probability of a bin.
pub(crate) fn volume(parts: &[Part]) -> f64 {
    parts.iter().map(|part| part.interval[1] - part.interval[0]).product()
}
