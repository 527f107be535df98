//! The colours of a figure.

// Each actor has its hue of the Rerun recordings, in a darker shade for white paper.

/// Colour of the ego.
pub(super) const EGO: &str = "#1f6fd1";
/// Colour of the first of the other actors, by convention the lead vehicle.
pub(super) const FRONT: &str = "#d98200";
/// Colour of the second of the other actors, by convention the rear vehicle.
pub(super) const REAR: &str = "#d4307c";
/// Colours of the other actors, in their order.
const OTHERS: [&str; 6] = [FRONT, REAR, "#4f9a1f", "#7b4fd0", "#149a94", "#8f7f3f"];

/// Returns the colour of the actor of this index.
pub(super) fn colour(index: usize, ego: usize) -> &'static str {
    if index == ego {
        return EGO;
    }
    let others_before = if index > ego { index - 1 } else { index };
    OTHERS[others_before % OTHERS.len()]
}
