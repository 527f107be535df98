//! The smallest failing case near a failing sample, and the nearest case that passes.
//!
//! ```text
//!  sample ─▶ fewest parameters off nominal that still fail ─▶ each as near to nominal as it still fails ─▶ concrete scenario
//!                                                                              └─▶ nearest value that passes ─▶ its twin
//! ```
//!
//! First every set of one, two and three parameters is tried, all others at their nominal values.
//! If none fails, delta debugging (Zeller and Hildebrandt, *Simplifying and isolating
//! failure-inducing input*, IEEE Transactions on Software Engineering 28 (2002) 183–200) removes
//! parameters from the sample until no single one can be removed. Then each remaining number moves
//! towards its nominal value by bisection, on a grid of readable values. The random numbers of the
//! sample stay: the files name them, and a plain `closecall run FILE` repeats the case.
//!
//! The smallest case has the fewest parameters off nominal. The failing case *nearest* to the
//! nominal one ([`NearestSearch`]) has the smallest distance in standard normal space, with as many
//! parameters off nominal as that takes.

mod design_point;
mod grid;
mod nearest;
mod run;
mod subset;
mod text;
mod trial;
mod twin;
mod words;
mod write;

pub use nearest::{NearestFailure, NearestSearch};
pub use run::{Minimized, Offset, minimize, minimize_sample, with_choice};
pub use text::MinimizedText;
pub use trial::WithoutOutcome;
pub use twin::Twin;
pub use write::{MinimizedFiles, output_files, write_files};
