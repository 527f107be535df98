//! Fits the rear object-level sensor to the full chain, and writes the file that ships.
//!
//!     cargo run --release --example fit_object_sensors                  # sensors/data/rear-object.toml
//!     cargo run --release --example fit_object_sensors -- -n 2 -o own.toml
//!
//! It takes some minutes. The result depends on the seed and on the number of approaches, and not on the number of threads.

#![expect(clippy::print_stdout, reason = "a command prints its result")]

use std::path::{Path, PathBuf};

use clap::Parser;
use closecall::simulation::scenario::source;
use closecall_perception::fit::{FitPlan, fit};

/// Fits the rear object-level sensor to the full chain.
#[derive(Parser)]
struct Args {
    /// Number of approaches of each point of the grid
    #[arg(short = 'n', long, default_value_t = 6)]
    approaches: u64,
    /// The seed
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// The file to write
    #[arg(short, long, default_value = "sensors/data/rear-object.toml")]
    output: PathBuf,
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let args = Args::parse();
    let file = source::load(Path::new("low-thw-overtake"), &[])?;
    let found = fit(&FitPlan {
        file: &file,
        seed: args.seed,
        approaches: args.approaches,
        command: format!(
            "cargo run --release --example fit_object_sensors -- -n {} --seed {}",
            args.approaches, args.seed
        ),
        version: env!("CARGO_PKG_VERSION").to_owned(),
    })?;
    let head = "# The rear object-level sensor, fitted to the full chain by examples/fit_object_sensors. Not edited by hand.\n\n";
    std::fs::write(&args.output, format!("{head}{}", toml::to_string(&found)?))?;
    println!("written: {}", args.output.display());
    Ok(())
}
