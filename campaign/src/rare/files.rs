//! The files in the folder of a campaign that samples a rare event.
//!
//! They have names of their own, so that no command takes the weighted runs for the independent
//! samples of a plain campaign.

/// How the campaign was made.
pub(crate) const MANIFEST: &str = "rare-manifest.json";
/// One line per run, in the order in which the method asked for it; each with a checksum.
pub(crate) const JOURNAL: &str = "rare-journal.jsonl";
/// The result, as it is printed for programs.
pub(crate) const RESULT: &str = "rare.json";
