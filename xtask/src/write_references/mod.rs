//! Writes `docs/reference/scenario.md`, the reference of the scenario file, and
//! `docs/evidence/determinism.json`, the digests of the library's outcomes.
//!
//! ```sh
//! cargo run --release -p closecall-xtask -- write-references
//! ```
//!
//! The tables, keys, types and descriptions come from the JSON Schema of the scenario file, and so
//! from the doc comments of the configuration structs. The allowed ranges come from the checks
//! themselves: `probe` sets each key of `docs/reference/scenario/every-key.toml` to a wrong value,
//! and reads the allowed values from the message of the check. The examples are the values of that
//! file. Tests fail if the committed files differ from the files that this program writes.

mod digests;
mod files;
mod page;
mod probe;
mod schema;
mod text;

#[expect(clippy::print_stdout, reason = "a program on the command line")]
pub(crate) fn main() -> Result<(), Box<dyn std::error::Error>> {
    std::fs::write(files::at_root(files::PAGE), page::scenario_page()?)?;
    println!("written: {}", files::PAGE);
    let digests = digests::digests()?;
    std::fs::write(files::at_root(digests::DIGESTS), serde_json::to_string_pretty(&digests)? + "\n")?;
    println!("written: {}", digests::DIGESTS);
    Ok(())
}
