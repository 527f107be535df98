//! Charts, drawn with plotters: those of a campaign's page, and the style of all.
//!
//! * `bars`: bars in the cells of a table
//! * `distribution`: distributions of margins and of sampled values
//! * `map`: the outcome over two parameters
//! * [`style`]: sizes, fonts, colours and axes

mod bars;
mod distribution;
mod map;
pub(crate) mod style;

pub(super) use bars::{balance, rate};
pub(super) use distribution::{coverage, margin};
pub(super) use map::outcome_map;
