//! Exposures of the camera.

use rand::RngExt;

/// The key of the noise of one exposure: the same scene and key give the same pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ExposureKey(pub u64);

impl ExposureKey {
    /// Draws the key of the next exposure.
    pub fn draw(rng: &mut impl rand::Rng) -> Self {
        Self(rng.random())
    }
}
