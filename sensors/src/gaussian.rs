//! A mean with its standard deviation.

/// A normal distribution, in the unit that the name of the field or argument states.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Gaussian {
    pub(crate) mean: f64,
    /// Standard deviation.
    pub(crate) sd: f64,
}

impl Gaussian {
    /// Creates a normal distribution.
    pub(crate) const fn new(mean: f64, sd: f64) -> Self {
        Self { mean, sd }
    }
}
