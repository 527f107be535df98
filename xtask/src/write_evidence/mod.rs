//! Writes the tables of `docs/evidence` that depend on outcomes of runs.
//!
//! ```sh
//! cargo run --release -p closecall-xtask -- write-evidence
//! cargo run --release -p closecall-xtask -- write-evidence twins --samples 10000
//! cargo run --release -p closecall-xtask -- write-evidence scenarios --scenario low-thw-overtake
//! ```
//!
//! Each section of a page lies between two markers, and everything else on the page stays as it is.
//! A section names the commit, the date, the machine, the command, and the outcomes that it depends
//! on: a test fails when the outcomes change.

pub(crate) mod page;
mod perception;
mod printed;
mod rows;
pub(crate) mod scenarios;

use std::error::Error;
use std::time::Instant;

use page::{Section, Size};

/// The command line.
#[derive(clap::Parser)]
pub(crate) struct Args {
    /// The sections to write [default: all]
    #[arg(value_enum)]
    sections: Vec<Section>,
    /// Number of samples of each campaign
    #[arg(short = 'n', long, default_value_t = 2000, value_parser = clap::value_parser!(u64).range(1..))]
    samples: u64,
    /// Number of samples of each member of the driver ensemble, of each scenario with surrounding
    /// traffic, of each fault and with two LiDARs
    #[arg(long, default_value_t = 400, value_parser = clap::value_parser!(u64).range(1..))]
    member_samples: u64,
    /// Seed of the random numbers
    #[arg(long, default_value_t = 1001)]
    seed: u64,
    /// Write the rows of these scenarios alone, and keep the others of the section. The section must
    /// have a row for each scenario, of the outcomes of this version
    #[arg(long, value_name = "NAME")]
    scenario: Vec<String>,
}

/// Returns the text of a section between its markers. `only` names the scenarios of its rows; it is
/// empty for all.
pub(crate) fn written(section: Section, size: Size, only: &[String]) -> Result<String, Box<dyn Error>> {
    let table = match section {
        Section::Scenarios => scenarios::library(size, only),
        Section::Traffic => scenarios::traffic(size, only),
        Section::OtherFunctions => scenarios::other_functions(size, only),
        Section::Agreement => scenarios::agreement(size, only),
        _ if !only.is_empty() => Err(format!("{}: it has no row for each scenario", section.name()).into()),
        Section::Ensemble => scenarios::ensemble(size),
        Section::Arms => rows::arms(size),
        Section::Promise => rows::promise(size),
        Section::Twins => rows::twins(size),
        Section::EventFree => rows::event_free(size),
        Section::Distributions => rows::distributions(size),
        Section::Slowing => rows::slowing(size),
        Section::Faults => rows::faults(size),
        Section::Sensitivity => printed::sensitivity(size),
        Section::Frontier => printed::frontier(size),
        Section::Anchor => printed::anchor(size),
        Section::Conditions => perception::conditions(size),
        Section::Lidars => perception::lidars(size),
        Section::TwoLidars => perception::two_lidars(size),
    }?;
    Ok(format!("{}\n{table}", page::provenance(section, size)?))
}

#[expect(clippy::print_stdout, reason = "a program on the command line")]
pub(crate) fn main(args: Args) -> Result<(), Box<dyn Error>> {
    let size = Size { samples: args.samples, member_samples: args.member_samples, seed: args.seed };
    let sections = if args.sections.is_empty() { Section::ALL.to_vec() } else { args.sections };
    for section in sections {
        let started = Instant::now();
        let mut written = written(section, size, &args.scenario)?;
        let path = page::root().join(section.page());
        let page = std::fs::read_to_string(&path)?;
        if let Some(name) = args.scenario.iter().find(|name| !written.contains(&format!("| `{name}` |"))) {
            return Err(format!("{}: the section has no scenario `{name}`", section.name()).into());
        }
        if !args.scenario.is_empty() {
            written = page::with_other_rows(&written, page::between_markers(&page, section)?)?;
        }
        std::fs::write(&path, page::with_section(&page, section, &written)?)?;
        println!("{}: {} after {:.0} s", section.page(), section.name(), started.elapsed().as_secs_f64());
    }
    Ok(())
}
