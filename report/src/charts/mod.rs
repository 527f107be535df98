//! Charts of a campaign, as SVG that stands inside a page.

mod distribution;
mod map;
mod style;

pub(super) use distribution::{coverage, margin};
pub(super) use map::outcome_map;
