//! The colours of a recording. Each actor has the same colour in all views, so a vehicle in the
//! scene can be matched with its curves in the plots. Curves are legible on the viewer's dark and
//! on its light background.

use closecall_scenarios::outcome::Moment;
use closecall_traffic::Light;

use crate::run::film::Part;

/// An sRGB colour with its opacity.
pub(super) type Rgba = [u8; 4];

/// The ego.
pub(super) const EGO: Rgba = [38, 116, 222, 255];
/// The lead vehicle.
pub(super) const FRONT: Rgba = [190, 98, 0, 255];
/// The rear vehicle.
pub(super) const REAR: Rgba = [214, 40, 118, 255];
/// A further relevant vehicle, which has a name: a paler grey than background traffic.
const OTHER: Rgba = [176, 180, 186, 255];
/// A vehicle of the background traffic.
const BACKGROUND: Rgba = [118, 122, 128, 255];
/// Colours of the moments of the encounter, in the order of [`Moment::ALL`].
const MOMENTS: [Rgba; 7] = [
    [214, 69, 65, 255],
    [98, 124, 186, 255],
    [150, 100, 230, 255],
    [190, 110, 10, 255],
    [20, 140, 130, 255],
    [104, 142, 72, 255],
    [130, 130, 140, 255],
];
/// The ground in the view from above, and around the image of a camera. The viewer draws a label on
/// a translucent box. In the light theme the box is bright, so a white label has enough contrast
/// only if the ground below the box is black.
pub(super) const GROUND: Rgba = [0, 0, 0, 255];
/// Fog in the scene.
const FOG: Rgba = [118, 122, 128, 255];
/// Labels, on [`GROUND`].
pub(super) const LABEL: Rgba = WHITE;

pub(super) const GLASS: Rgba = [30, 36, 44, 255];
pub(super) const TYRE: Rgba = [22, 22, 24, 255];
pub(super) const TRAILER: Rgba = [214, 216, 220, 255];
pub(super) const ROAD: Rgba = [62, 64, 68, 255];
pub(super) const VERGE: Rgba = [52, 70, 48, 255];
pub(super) const MARKING: Rgba = [226, 226, 222, 255];
pub(super) const RAIL: Rgba = [150, 156, 162, 255];
pub(super) const BRAKE_LIGHT: Rgba = [255, 32, 24, 255];
pub(super) const INDICATOR: Rgba = [255, 170, 0, 255];
/// The sky by day, at dusk and at night.
const SKY: [Rgba; 3] = [[112, 130, 150, 255], [62, 58, 84, 255], [9, 12, 22, 255]];
/// Brightness of the ground by day, at dusk and at night, as a share of the brightness by day.
/// Vehicles stay legible.
const GROUND_LIGHT: [f64; 3] = [1.0, 0.7, 0.45];
pub(super) const BOX_FIT: Rgba = [255, 255, 255, 255];
pub(super) const TRUTH: Rgba = [110, 214, 120, 255];
pub(super) const MISSED: Rgba = [255, 120, 0, 255];
pub(super) const FALSE_TRACK: Rgba = [255, 0, 200, 255];
pub(super) const FIELD_OF_VIEW: Rgba = [150, 220, 255, 255];
pub(super) const RADAR: Rgba = [120, 170, 255, 255];
pub(super) const TRACK: Rgba = [96, 230, 255, 255];
pub(super) const SAFE: Rgba = [26, 134, 70, 255];
pub(super) const CRITICAL: Rgba = [220, 38, 38, 255];
pub(super) const WARNING: Rgba = [166, 110, 0, 255];
pub(super) const NEUTRAL: Rgba = [118, 122, 128, 255];
pub(super) const QUIET: Rgba = [96, 100, 108, 255];

/// Returns the colour of a part.
pub(super) fn part(part: Part) -> Rgba {
    match part {
        Part::Ego => EGO,
        Part::Lead => FRONT,
        Part::Rear => REAR,
        Part::Other(_) => OTHER,
        Part::Background => BACKGROUND,
    }
}

/// Returns the colour of the sky.
pub(super) const fn sky(light: Light) -> Rgba {
    SKY[light_index(light)]
}

/// Returns the colour of something on the ground in this light.
pub(super) fn lit(colour: Rgba, light: Light) -> Rgba {
    scaled(colour, GROUND_LIGHT[light_index(light)])
}

const fn light_index(light: Light) -> usize {
    match light {
        Light::Day => 0,
        Light::Dusk => 1,
        Light::Night => 2,
    }
}

/// Returns a colour as it looks through fog that lets this share of the light pass.
pub(super) fn through_fog(colour: Rgba, share: f64, light: Light) -> Rgba {
    let fog = lit(FOG, light);
    std::array::from_fn(|channel| {
        (f64::from(colour[channel]) * share + f64::from(fog[channel]) * (1.0 - share)).round() as u8
    })
}

/// Returns the colour with another opacity.
pub(super) fn with_opacity([red, green, blue, _]: Rgba, opacity: u8) -> Rgba {
    [red, green, blue, opacity]
}

/// Share of white in a curve of the baseline.
const BASELINE_WHITE: f64 = 0.20;

/// Returns a lighter shade of a colour, for the curves of the baseline.
pub(super) fn lighter([red, green, blue, opacity]: Rgba) -> Rgba {
    let mixed = |channel: u8| (f64::from(channel) * (1.0 - BASELINE_WHITE) + 255.0 * BASELINE_WHITE).round() as u8;
    [mixed(red), mixed(green), mixed(blue), opacity]
}

/// Returns the colour of a moment of the encounter.
pub(super) fn moment(moment: Moment) -> Rgba {
    let index = Moment::ALL.iter().position(|other| *other == moment).unwrap_or(0);
    MOMENTS[index % MOMENTS.len()]
}

/// The time after an action of the ego stack, in a bar of states. It differs from the grey of the
/// time in which the stack does nothing.
pub(super) const AFTERWARDS: Rgba = [64, 80, 124, 255];

/// White, in which the viewer writes on bars of states in both themes.
const WHITE: Rgba = [255, 255, 255, 255];
/// Opacity with which the viewer draws a bar of states (Rerun 0.36). The rest of the light is the
/// background of its theme.
const BAR_OPACITY: f64 = 0.784;
/// Least contrast of text (WCAG 2.2, 1.4.3).
const LEAST_OF_TEXT: f64 = 4.5;
/// Share by which a bar becomes darker in one step.
const DARKER_STEP: f64 = 0.02;

/// Returns a shade of a colour for a bar of states: dark enough for white text in the light theme,
/// and no darker.
pub(super) fn bar(colour: Rgba) -> Rgba {
    let mut share = 1.0;
    loop {
        let shade = scaled(colour, share);
        if share <= 0.0 || contrast(shown_bar(shade, WHITE), WHITE) >= LEAST_OF_TEXT {
            return shade;
        }
        share -= DARKER_STEP;
    }
}

/// Returns a colour with each channel multiplied by `share`.
fn scaled([red, green, blue, opacity]: Rgba, share: f64) -> Rgba {
    let darker = |channel: u8| (f64::from(channel) * share).round() as u8;
    [darker(red), darker(green), darker(blue), opacity]
}

/// Returns the colour in which the viewer shows a translucent bar in a theme with this background.
fn shown_bar(bar: Rgba, background: Rgba) -> Rgba {
    std::array::from_fn(|channel| {
        let [bar, background] = [bar, background].map(|colour| f64::from(colour[channel]));
        (BAR_OPACITY * bar + (1.0 - BAR_OPACITY) * background).round() as u8
    })
}

/// Returns the relative luminance of a colour after WCAG 2.2.
fn luminance([red, green, blue, _]: Rgba) -> f64 {
    let linear = |channel: u8| match f64::from(channel) / 255.0 {
        low if low <= 0.040_45 => low / 12.92,
        high => closecall_traffic::maths::powf((high + 0.055) / 1.055, 2.4),
    };
    0.2126 * linear(red) + 0.7152 * linear(green) + 0.0722 * linear(blue)
}

/// Returns the contrast of two colours after WCAG 2.2, 1 to 21.
fn contrast(first: Rgba, second: Rgba) -> f64 {
    let [first, second] = [first, second].map(luminance);
    (first.max(second) + 0.05) / (first.min(second) + 0.05)
}

/// Returns the colour of a cluster of a scan.
pub(super) fn cluster(number: u8) -> Rgba {
    // Hues that no vehicle, track or mark has.
    const CLUSTERS: [Rgba; 5] =
        [[255, 240, 120, 255], [168, 255, 96, 255], [200, 160, 255, 255], [120, 255, 200, 255], [255, 214, 190, 255]];
    CLUSTERS[usize::from(number) % CLUSTERS.len()]
}

/// Returns the colour of an intensity, from dark blue over green to yellow. Eight shades compress
/// well.
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
    // Most returns are weak, so the scale follows the square root.
    let root = f32::from(intensity).sqrt() / f32::from(u8::MAX).sqrt();
    SHADES[((root * 8.0) as usize).min(7)]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Backgrounds of the plots in the viewer's dark theme and in its light theme (Rerun 0.36).
    const DARK: Rgba = [13, 16, 17, 255];
    const LIGHT: Rgba = [255, 255, 255, 255];
    /// Least contrast of a graphical object (WCAG 2.2, 1.4.11).
    const LEAST_OF_CURVES: f64 = 3.0;

    #[test]
    fn curves_are_legible_in_both_themes_and_those_of_the_baseline_are_lighter() {
        let curves = [EGO, FRONT, REAR, CRITICAL, SAFE, WARNING, NEUTRAL];
        for colour in curves.into_iter().chain(curves.map(lighter)).chain(MOMENTS) {
            for background in [DARK, LIGHT] {
                let contrast = contrast(colour, background);
                assert!(contrast >= LEAST_OF_CURVES, "{colour:?} on {background:?}: {contrast:.2}");
            }
        }
        assert!(curves.iter().all(|&colour| luminance(lighter(colour)) > luminance(colour)));
        // The colours of other traffic are greys.
        let greys = [OTHER, BACKGROUND].map(|[red, green, blue, _]| [red, green, blue]);
        assert!(greys.iter().all(|grey| grey.iter().max().unwrap() - grey.iter().min().unwrap() <= 12));
        assert!(contrast([255, 176, 59, 255], LIGHT) < LEAST_OF_CURVES, "a curve that does not pass");
    }

    #[test]
    fn the_text_on_a_bar_of_states_is_legible_in_both_themes() {
        let bars = [EGO, FRONT, REAR, CRITICAL, SAFE, WARNING, NEUTRAL, QUIET, AFTERWARDS];
        for colour in bars.into_iter().chain(MOMENTS) {
            for background in [DARK, LIGHT] {
                let contrast = contrast(shown_bar(bar(colour), background), WHITE);
                assert!(contrast >= LEAST_OF_TEXT, "{colour:?} on {background:?}: {contrast:.2}");
            }
        }
        assert!(contrast(shown_bar(EGO, LIGHT), WHITE) < LEAST_OF_TEXT, "a bar that does not pass");
        assert_eq!(bar(WHITE)[3], 255, "a bar stays opaque");
        assert_ne!(bar(AFTERWARDS), bar(QUIET));
    }

    /// Fill of the box of a label in the viewer's dark and in its light theme, and its opacity
    /// (Rerun 0.36).
    const LABEL_BOXES: [Rgba; 2] = [[44, 44, 44, 255], [224, 223, 223, 255]];
    const LABEL_BOX_OPACITY: f64 = 0.5;

    #[test]
    fn labels_are_legible_on_their_ground_in_both_themes() {
        let on = |ground: Rgba, fill: Rgba| -> Rgba {
            std::array::from_fn(|channel| {
                let [fill, ground] = [fill, ground].map(|colour| f64::from(colour[channel]));
                (LABEL_BOX_OPACITY * fill + (1.0 - LABEL_BOX_OPACITY) * ground).round() as u8
            })
        };
        for fill in LABEL_BOXES {
            let contrast = contrast(LABEL, on(GROUND, fill));
            assert!(contrast >= LEAST_OF_TEXT, "{fill:?}: {contrast:.2}");
        }
        assert!(contrast(LABEL, on([24, 27, 31, 255], LABEL_BOXES[1])) < LEAST_OF_TEXT, "a ground that does not pass");
    }
}
