//! The colours of a figure, and its legend.

use crate::run::film::{Film, Part};

// Each actor has its hue of the Rerun recordings, in a darker shade for white paper.

/// Colour of the ego.
pub(super) const EGO: &str = "#1f6fd1";
/// Colour of the first of the other actors, by convention the lead vehicle.
pub(super) const FRONT: &str = "#d98200";
/// Colour of the second of the other actors, by convention the rear vehicle.
pub(super) const REAR: &str = "#d4307c";
/// Colour of all other vehicles.
const OTHERS: &str = "#8a9099";

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
