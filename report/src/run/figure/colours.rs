//! The colours of a figure.

/// Colours: one for each actor, as in the recordings, darker for white paper.
pub(super) const EGO: &str = "#1f6fd1";
pub(super) const FRONT: &str = "#d98200";
pub(super) const REAR: &str = "#d4307c";
const OTHERS: [&str; 6] = [FRONT, REAR, "#4f9a1f", "#7b4fd0", "#149a94", "#8f7f3f"];

/// The colour of an actor by its place in the cast.
pub(super) fn colour(place: usize, ego: usize) -> &'static str {
    if place == ego {
        return EGO;
    }
    let others_before = if place > ego { place - 1 } else { place };
    OTHERS[others_before % OTHERS.len()]
}
