//! Charts, drawn with plotters: the charts of a campaign's page, and the style of all charts.
//!
//! * `bars`: bars in the cells of a table
//! * `boundary`: the boundary of an event over two parameters
//! * `distribution`: distributions of margins and of sampled values
//! * `map`: the outcome over two parameters
//! * `scatter`: points with intervals; some are marked
//! * `tornado`: which factor moves an output most
//! * [`style`]: sizes, fonts, colours and axes

mod bars;
mod boundary;
mod distribution;
mod map;
mod scatter;
pub(crate) mod style;
mod tornado;

pub(super) use bars::{balance, rate};
pub(crate) use boundary::{BoundaryMap, BoundaryPoint, boundary_map};
pub(super) use distribution::{coverage, margin};
pub(super) use map::{cell_css, outcome_map};
pub(crate) use scatter::{ScatterPoint, scatter};
pub(crate) use tornado::{TornadoBar, TornadoTexts, tornado};
