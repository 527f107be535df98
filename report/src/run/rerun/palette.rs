//! The colours of a recording. Each actor has the same colour in all views, so that a vehicle in the scene and its
//! curves in the plots can be matched.

/// An sRGB colour with its opacity.
pub(super) type Rgba = [u8; 4];

/// The ego.
pub(super) const EGO: Rgba = [64, 156, 255, 255];
/// The first of the other actors, by convention the lead vehicle.
pub(super) const FRONT: Rgba = [255, 176, 59, 255];
/// The second of the other actors, by convention the rear vehicle.
pub(super) const REAR: Rgba = [244, 92, 160, 255];
/// Colours of the other actors, in their order. They repeat if there are more actors.
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
pub(super) const BOX_FIT: Rgba = [255, 255, 255, 255];
pub(super) const TRUTH: Rgba = [110, 214, 120, 255];
pub(super) const MISSED: Rgba = [255, 120, 0, 255];
pub(super) const FALSE_TRACK: Rgba = [255, 0, 200, 255];
pub(super) const FIELD_OF_VIEW: Rgba = [150, 220, 255, 255];
pub(super) const TRACK: Rgba = [96, 230, 255, 255];
pub(super) const SAFE: Rgba = [110, 214, 120, 255];
pub(super) const CRITICAL: Rgba = [255, 64, 64, 255];
pub(super) const WARNING: Rgba = [255, 196, 64, 255];
pub(super) const NEUTRAL: Rgba = [168, 172, 178, 255];
pub(super) const QUIET: Rgba = [96, 100, 108, 255];

/// Returns the colour of the actor of this index.
pub(super) fn actor(index: usize, ego: usize) -> Rgba {
    if index == ego {
        return EGO;
    }
    let others_before = if index > ego { index - 1 } else { index };
    OTHERS[others_before % OTHERS.len()]
}

/// Returns the colour with another opacity.
pub(super) fn with_opacity([red, green, blue, _]: Rgba, opacity: u8) -> Rgba {
    [red, green, blue, opacity]
}

/// Returns a darker shade of a colour, for the curves of the baseline.
pub(super) fn darker([red, green, blue, opacity]: Rgba) -> Rgba {
    let scaled = |channel: u8| (u16::from(channel) * 11 / 20) as u8;
    [scaled(red), scaled(green), scaled(blue), opacity]
}

/// Returns the colour of the moment of this index.
pub(super) fn moment(index: usize) -> Rgba {
    OTHERS[(index + 2) % OTHERS.len()]
}

/// Returns the colour of a cluster of a scan.
pub(super) fn cluster(number: u8) -> Rgba {
    const CLUSTERS: [Rgba; 7] = [
        [255, 99, 72, 255],
        [46, 213, 115, 255],
        [83, 182, 255, 255],
        [255, 221, 89, 255],
        [214, 120, 255, 255],
        [72, 219, 251, 255],
        [255, 159, 243, 255],
    ];
    CLUSTERS[usize::from(number) % CLUSTERS.len()]
}

/// Returns the colour of an intensity, from dark blue over green to yellow. Eight shades compress well.
pub(super) fn intensity(intensity: u8) -> Rgba {
    const SHADES: [Rgba; 8] = [
        [68, 1, 84, 255],
        [70, 50, 127, 255],
        [54, 92, 141, 255],
        [39, 127, 142, 255],
        [31, 161, 135, 255],
        [74, 194, 109, 255],
        [159, 218, 58, 255],
        [253, 231, 37, 255],
    ];
    // Most returns are weak, so that the scale follows the square root.
    let root = f32::from(intensity).sqrt() / f32::from(u8::MAX).sqrt();
    SHADES[((root * 8.0) as usize).min(7)]
}
