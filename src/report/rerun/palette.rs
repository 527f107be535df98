//! Colours: one for each actor in every view, so that a line in a plot and a vehicle on the road can be told together.

/// A colour with its opacity, sRGB.
pub(super) type Rgba = [u8; 4];

/// E.
pub(super) const EGO: Rgba = [64, 156, 255, 255];
/// What is ahead of E: the first of the others, as scenarios name them.
pub(super) const FRONT: Rgba = [255, 176, 59, 255];
/// What is behind E: the second of the others.
pub(super) const REAR: Rgba = [244, 92, 160, 255];
/// All others in turn, in the order of the scenario's actors.
const OTHERS: [Rgba; 6] =
    [FRONT, REAR, [130, 208, 96, 255], [176, 132, 255, 255], [92, 214, 208, 255], [222, 208, 150, 255]];

pub(super) const GLASS: Rgba = [30, 36, 44, 255];
pub(super) const TYRE: Rgba = [22, 22, 24, 255];
pub(super) const TRAILER: Rgba = [214, 216, 220, 255];
pub(super) const ROAD: Rgba = [62, 64, 68, 255];
pub(super) const VERGE: Rgba = [52, 70, 48, 255];
pub(super) const MARKING: Rgba = [226, 226, 222, 255];
pub(super) const RAIL: Rgba = [150, 156, 162, 255];
pub(super) const BRAKE_LIGHT: Rgba = [255, 32, 24, 255];
pub(super) const INDICATOR: Rgba = [255, 170, 0, 255];
pub(super) const SKY: Rgba = [112, 130, 150, 255];
pub(super) const FIELD_OF_VIEW: Rgba = [150, 220, 255, 255];
pub(super) const TRACK: Rgba = [96, 230, 255, 255];
pub(super) const SAFE: Rgba = [110, 214, 120, 255];
pub(super) const CRITICAL: Rgba = [255, 64, 64, 255];
pub(super) const WARNING: Rgba = [255, 196, 64, 255];
pub(super) const NEUTRAL: Rgba = [168, 172, 178, 255];
pub(super) const QUIET: Rgba = [96, 100, 108, 255];

/// The colour of an actor by its place in the scenario.
pub(super) fn actor(place: usize, ego: usize) -> Rgba {
    if place == ego {
        return EGO;
    }
    let others_before = if place > ego { place - 1 } else { place };
    OTHERS[others_before % OTHERS.len()]
}

/// The same colour, see-through.
pub(super) fn faint([red, green, blue, _]: Rgba, opacity: u8) -> Rgba {
    [red, green, blue, opacity]
}
