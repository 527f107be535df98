//! The colours of a recording. Each actor has the same colour in all views, so that a vehicle in the scene and its
//! curves in the plots can be matched.

use closecall_scenarios::outcome::Moment;

use crate::run::film::Part;

/// An sRGB colour with its opacity.
pub(super) type Rgba = [u8; 4];

/// The ego.
pub(super) const EGO: Rgba = [64, 156, 255, 255];
/// The first of the other actors, by convention the lead vehicle.
pub(super) const FRONT: Rgba = [255, 176, 59, 255];
/// The second of the other actors, by convention the rear vehicle.
pub(super) const REAR: Rgba = [244, 92, 160, 255];
/// Colours of further actors, in their order. They repeat if there are more actors.
const OTHERS: [Rgba; 4] = [[130, 208, 96, 255], [176, 132, 255, 255], [64, 190, 180, 255], [200, 170, 90, 255]];
/// A vehicle of the traffic around.
const BACKGROUND: Rgba = [128, 132, 138, 255];
/// Colours of the moments of the encounter, in the views that mark them.
const MOMENTS: [Rgba; 7] = [
    [214, 69, 65, 255],
    [120, 144, 200, 255],
    [176, 132, 255, 255],
    [214, 140, 40, 255],
    [64, 170, 160, 255],
    [112, 150, 80, 255],
    [140, 140, 150, 255],
];
/// A line of text about a moment.
pub(super) const MOMENT: Rgba = [140, 150, 190, 255];
/// A line of text about what the ego sees.
pub(super) const SIGHT: Rgba = [40, 160, 190, 255];
/// A line of text about an event of the scenario.
pub(super) const EVENT: Rgba = [214, 150, 30, 255];
/// The ground beside the road in the view from above. It is dark in both themes of the viewer, so that labels are legible.
pub(super) const GROUND: Rgba = [24, 27, 31, 255];
/// Fog, as the scene shows it. It is darker than by day, so that labels are legible.
const FOG: Rgba = [118, 122, 128, 255];
/// Text beside the road.
pub(super) const NOTE: Rgba = [222, 226, 230, 255];

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
pub(super) const NEUTRAL: Rgba = [138, 142, 148, 255];
pub(super) const QUIET: Rgba = [96, 100, 108, 255];

/// Returns the colour of a part.
pub(super) fn part(part: Part) -> Rgba {
    match part {
        Part::Ego => EGO,
        Part::Lead => FRONT,
        Part::Rear => REAR,
        Part::Other(number) => OTHERS[number % OTHERS.len()],
        Part::Background => BACKGROUND,
    }
}

/// Returns a colour as it looks through fog that lets this share of the light pass.
pub(super) fn through_fog(colour: Rgba, share: f64) -> Rgba {
    std::array::from_fn(|channel| {
        (f64::from(colour[channel]) * share + f64::from(FOG[channel]) * (1.0 - share)).round() as u8
    })
}

/// Returns the colour with another opacity.
pub(super) fn with_opacity([red, green, blue, _]: Rgba, opacity: u8) -> Rgba {
    [red, green, blue, opacity]
}

/// Returns a paler shade of a colour, for text. The viewer puts text on a box that is dark in its dark theme, and grey in
/// its light theme.
pub(super) fn text([red, green, blue, opacity]: Rgba) -> Rgba {
    let paler = |channel: u8| 255 - (u16::from(255 - channel) * 3 / 10) as u8;
    [paler(red), paler(green), paler(blue), opacity]
}

/// Returns a darker shade of a colour, for the curves of the baseline.
pub(super) fn darker([red, green, blue, opacity]: Rgba) -> Rgba {
    let scaled = |channel: u8| (u16::from(channel) * 11 / 20) as u8;
    [scaled(red), scaled(green), scaled(blue), opacity]
}

/// Returns the colour of a moment of the encounter.
pub(super) fn moment(moment: Moment) -> Rgba {
    let index = Moment::ALL.iter().position(|other| *other == moment).unwrap_or(0);
    MOMENTS[index % MOMENTS.len()]
}

/// Returns the colour of a cluster of a scan.
pub(super) fn cluster(number: u8) -> Rgba {
    // Hues that no vehicle, track or mark has.
    const CLUSTERS: [Rgba; 5] =
        [[255, 240, 120, 255], [168, 255, 96, 255], [200, 160, 255, 255], [120, 255, 200, 255], [255, 214, 190, 255]];
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
