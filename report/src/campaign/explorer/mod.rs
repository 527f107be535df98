//! The explorer: a page on which the samples of a campaign are filtered, brushed and looked at one
//! by one.
//!
//! ```text
//!  journal ─▶ columns of numbers and words ─┐
//!  Plotly's script, from its crate ─────────┴─▶ one page, which loads nothing
//!                                                 ├ as a file: links to the recorded samples
//!                                                 └ served: a sample runs again when it is chosen
//! ```
//!
//! The columns are the columns of `outcomes.parquet`. Plotly draws the charts; the page's own
//! script filters, counts and links them. The drawn data do not grow with the campaign: histograms
//! have bins, planes have cells and an even choice of points.
//!
//! `plotly` is the only crate with the script of an interactive chart library: `charming` links
//! ECharts from a server unless a JavaScript engine is built in.

mod columns;
mod page;
mod plotly;
mod sample;

pub use page::{PagePlace, explorer_page};
pub use sample::{sample_part, twin_part};
