//! The files of the reference.

use std::path::{Path, PathBuf};

/// The page that is written.
pub(crate) const PAGE: &str = "docs/reference/scenario.md";
/// The scenario that uses every key.
pub(crate) const EVERY_KEY: &str = "docs/reference/scenario/every-key.toml";

/// Returns the path of a file of this repository.
pub(crate) fn at_root(path: &str) -> PathBuf {
    Path::new(crate::ROOT).join(path)
}
