//! The road from above around the ego, as pages draw it, with room for moving vehicles.

use maud::{Markup, html};

use crate::run::film::Film;

/// Rear and front end of the visible road, relative to the ego (m).
pub(super) const REACH_M: [f64; 2] = [-50.0, 70.0];
/// The road is drawn wider than it is by this factor.
pub(super) const STRETCH: f64 = 2.0;
/// Room above and below the road, for the name of a truck in the left lane (m in the picture).
const ROOM_M: f64 = 2.5;

/// Returns the road of a film with these vehicles on it. Lengths are in metres, widths are
/// stretched by [`STRETCH`].
pub(super) fn road(film: &Film, vehicles: &Markup) -> Markup {
    let right_m = -film.road.right_edge_m() * STRETCH;
    let [rear_m, front_m] = REACH_M;
    let view = format!("{rear_m} {:.1} {} {:.1}", -ROOM_M, front_m - rear_m, right_m + 2.0 * ROOM_M);
    // The picture moves with the ego: lanes whose widths change have no place in it.
    let count = if film.road.has_changing_lanes() { 1 } else { film.road.lanes() };
    let lines = (1..count).map(|line| -film.road.full_boundary_m(line, 0.0) * STRETCH);
    html! {
        svg viewBox=(view) role="img" aria-label={ "The road from above, " (film.arm_label()) } {
            rect x=(rear_m) y="0" width=(front_m - rear_m) height=(format!("{right_m:.1}")) fill="#e9eaec" {}
            @for y_m in lines {
                line x1=(rear_m) x2=(front_m) y1=(format!("{y_m:.1}")) y2=(format!("{y_m:.1}")) stroke="#9aa0a6" stroke-width="0.2" {}
            }
            (vehicles)
        }
    }
}
