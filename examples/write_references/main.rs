//! Writes `docs/scenario.md`, the reference of the scenario file.
//!
//! ```sh
//! cargo run --release --example write_references
//! ```
//!
//! The tables, keys, types and descriptions come from the JSON Schema of the scenario file, and so from the doc comments
//! of the configuration structs. The allowed ranges come from the checks themselves: `probe` sets each key of
//! `docs/scenario/every-key.toml` to a value that cannot be right and reads what the check says is needed. The examples
//! are the values of that file. A test fails if the committed page is not the one that this program writes.

mod page;
mod probe;
mod schema;
mod text;

use std::error::Error;
use std::path::{Path, PathBuf};

#[allow(unused_imports, reason = "the tests use the parts")]
pub(crate) use {
    page::{SENSOR_DEFAULTS, SENSORS, scenario_page, title},
    probe::Probe,
    schema::{Kind, Step, tables},
    text::default_in,
};

/// The page that is written.
pub(crate) const PAGE: &str = "docs/scenario.md";
/// The example at the top of the page.
pub(crate) const ANNOTATED: &str = "docs/scenario/annotated.toml";
/// The scenario that uses every key.
pub(crate) const EVERY_KEY: &str = "docs/scenario/every-key.toml";

/// Returns the path of a file of this repository.
pub(crate) fn at_root(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

#[expect(clippy::print_stdout, reason = "a program on the command line")]
#[allow(dead_code, reason = "the tests use the parts")]
fn main() -> Result<(), Box<dyn Error>> {
    std::fs::write(at_root(PAGE), scenario_page()?)?;
    println!("written: {PAGE}");
    Ok(())
}
