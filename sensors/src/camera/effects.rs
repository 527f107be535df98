//! Effects that touch the rendered pixels.

use super::bounds::{Bounds, touches};
use super::glow::Glow;
use super::ground::Patch;
use super::spray::Cloud;

/// The shadows, beams, spray clouds and glows that can affect the pixels that are being rendered,
/// with their bounds in the image.
#[derive(Default)]
pub(super) struct Effects {
    pub(super) patches: Vec<(Bounds, Patch)>,
    pub(super) clouds: Vec<(Bounds, Cloud)>,
    pub(super) glows: Vec<(Bounds, Glow)>,
}

impl Effects {
    /// Keeps the effects of `all` that touch these pixels.
    pub(super) fn select(&mut self, all: &Self, pixels: &Bounds) {
        keep(&mut self.patches, &all.patches, pixels);
        keep(&mut self.clouds, &all.clouds, pixels);
        keep(&mut self.glows, &all.glows, pixels);
    }
}

/// Replaces `kept` by the effects of `all` that touch these pixels.
pub(super) fn keep<T: Copy>(kept: &mut Vec<(Bounds, T)>, all: &[(Bounds, T)], pixels: &Bounds) {
    kept.clear();
    kept.extend(all.iter().filter(|(bounds_px, _)| touches(bounds_px, pixels)));
}
