//! A mean with its standard deviation.

/// A normal distribution, in the unit that the name of the field or argument states.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gaussian {
    /// Mean.
    pub mean: f64,
    /// Standard deviation.
    pub sd: f64,
}

impl Gaussian {
    /// Creates a normal distribution.
    #[inline]
    pub const fn new(mean: f64, sd: f64) -> Self {
        Self { mean, sd }
    }
}
