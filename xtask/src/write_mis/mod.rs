//! Writes the tables of `docs/evidence/mis.md`: what the margin increase systems and a longer gap change in every scenario of the library.
//!
//! ```sh
//! cargo run --release -p closecall-xtask -- write-mis -n 2000 --member-samples 400 --seed 1001
//! ```
//!
//! Each part of the page stands between two markers, and everything else on the page stays as it is. Each scenario runs with its own
//! drivers and full sensors, and with each member of the driver ensemble and object-level sensors, on the same samples in every arm.

mod tables;

use std::error::Error;
use std::path::Path;
use std::time::Instant;

use clap::ValueEnum;
use tables::{Part, Study, page_with};

/// The page, below the folder of the repository.
const PAGE: &str = "docs/evidence/mis.md";

/// The command line.
/// What the command line says.
#[derive(clap::Parser)]
pub(crate) struct Args {
    /// Number of samples of each scenario
    #[arg(short = 'n', long, default_value_t = 2000, value_parser = clap::value_parser!(u64).range(1..))]
    samples: u64,
    /// Number of samples of each scenario with each member of the driver ensemble
    #[arg(long, default_value_t = 400, value_parser = clap::value_parser!(u64).range(1..))]
    member_samples: u64,
    /// Seed of the random numbers
    #[arg(long, default_value_t = 1001)]
    seed: u64,
    /// The part of the page that is written [default: every part]
    #[arg(long, value_enum)]
    part: Option<Part>,
}

#[expect(clippy::print_stdout, reason = "a program on the command line")]
pub(crate) fn main(args: Args) -> Result<(), Box<dyn Error>> {
    let started = Instant::now();
    let study = Study { samples: args.samples, member_samples: args.member_samples, seed: args.seed };
    let path = Path::new(crate::ROOT).join(PAGE);
    for part in Part::value_variants().iter().filter(|part| args.part.is_none_or(|wanted| wanted == **part)) {
        let tables = study.tables(*part)?;
        std::fs::write(&path, page_with(&std::fs::read_to_string(&path)?, *part, &tables)?)?;
    }
    println!("written: {PAGE}, after {:.0} s", started.elapsed().as_secs_f64());
    Ok(())
}
