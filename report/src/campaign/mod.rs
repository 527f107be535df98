//! Many runs.
//!
//! ```text
//!  journal ─▶ Tally ─▶ Summary ─▶ verdict ─┐
//!                └───▶ Overview ───────────┴▶ Findings ─▶ report.html │ summary.md │ junit.xml
//!          └▶ rows ─▶ outcomes.parquet        chosen samples ─▶ recordings/*.rrd
//! ```

mod arm_pairs;
mod causes;
mod comparison;
pub(crate) mod coverage;
mod ensemble;
pub mod explorer;
mod fidelity;
mod files;
pub mod findings;
pub(crate) mod html;
pub mod junit;
pub mod markdown;
pub mod origins;
pub mod outcomes;
pub mod overview;
mod pareto;
mod recordings;
mod report_error;
pub mod samples_xml;
mod tally;
mod text;
pub mod timings;
pub(crate) mod words;
#[cfg(test)]
mod xunit_schema;

pub use causes::write_causes;
pub use comparison::{BaselineText, ComparisonText};
pub use coverage::CoverageText;
pub use ensemble::{ensemble_json, ensemble_text};
pub use fidelity::{FidelityText, fidelity_text};
pub use files::{ArtifactError, CampaignReport, Written, check_folder};
pub use recordings::{RecordedSample, Still};
pub use report_error::ReportError;
pub use tally::Tally;
pub use text::{CountsText, FlakyText, VerdictText};
