//! The colours of a figure, and its legend.

use crate::run::film::{Film, Part};

// Each actor has its hue of the Rerun recordings, in a darker shade: names in these colours have a
// contrast of 4.5 : 1 or more on white paper and on asphalt (WCAG 2.2, 1.4.3).

/// Colour of the ego.
pub(super) const EGO: &str = "#1a62bb";
/// Colour of the lead vehicle.
pub(super) const FRONT: &str = "#9c5700";
/// Colour of the rear vehicle.
pub(super) const REAR: &str = "#c2246c";
/// Colour of all other vehicles.
const OTHERS: &str = "#5f6772";

/// Returns the colour of the actor of this index.
pub(super) fn colour(film: &Film, actor: usize) -> &'static str {
    match film.actors[actor].part {
        Part::Ego => EGO,
        Part::Lead => FRONT,
        Part::Rear => REAR,
        Part::Other(_) | Part::Background => OTHERS,
    }
}

/// Returns the name of an actor in a legend, in which all vehicles but ego, lead vehicle and rear
/// vehicle share one entry.
pub(super) fn legend_name(film: &Film, actor: usize) -> String {
    let is_other = |actor: usize| matches!(film.actors[actor].part, Part::Other(_) | Part::Background);
    match is_other(actor) {
        false => film.vehicle_label(actor),
        true if (0..actor).any(is_other) => String::new(),
        true => "other traffic".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use closecall_traffic::maths;

    use super::super::strip::{ASPHALT, CRITICAL, SAFE};
    use super::*;

    /// The relative luminance of a colour (WCAG 2.2).
    fn luminance(colour: &str) -> f64 {
        let channel = |from: usize| match f64::from(u8::from_str_radix(&colour[from..from + 2], 16).unwrap()) / 255.0 {
            dark if dark <= 0.04045 => dark / 12.92,
            light => maths::powf((light + 0.055) / 1.055, 2.4),
        };
        0.2126 * channel(1) + 0.7152 * channel(3) + 0.0722 * channel(5)
    }

    #[test]
    fn names_and_headways_stand_out_from_paper_and_from_asphalt() {
        for colour in [EGO, FRONT, REAR, OTHERS, CRITICAL, SAFE] {
            for ground in ["#ffffff", ASPHALT] {
                let contrast = (luminance(ground) + 0.05) / (luminance(colour) + 0.05);
                assert!(contrast >= 4.5, "{colour} on {ground}: {contrast:.2}");
            }
        }
        // A lighter orange would not.
        assert!((luminance("#ffffff") + 0.05) / (luminance("#d98200") + 0.05) < 3.0);
    }
}
