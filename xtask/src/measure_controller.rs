//! Measures the wall time of a control step of a shared library or an FMU, without the loop around
//! it.
//!
//! ```sh
//! cargo run --release -p closecall-xtask -- measure-controller lib:./acc_controller.so
//! ```

#![expect(clippy::print_stdout, reason = "a measurement prints its result")]

use std::error::Error;
use std::path::Path;

use closecall_controllers::external::{Kind, Loaded, cost, unload_all};

/// Number of tracks that the controller gets: dense traffic.
const TRACKS: usize = 12;
const STEPS: u32 = 200_000;

#[derive(clap::Args)]
pub(crate) struct Args {
    /// The controller: `lib:PATH` or `fmu:PATH`
    controller: String,
}

pub(crate) fn main(args: &Args) -> Result<(), Box<dyn Error>> {
    let (word, path) = args.controller.split_once(':').ok_or("the controller is `lib:PATH` or `fmu:PATH`")?;
    let kind = Kind::ALL.into_iter().find(|kind| kind.prefix() == word).ok_or("the kind is `lib` or `fmu`")?;
    let loaded = Loaded::open(kind, Path::new(path))?;
    let step_s = cost::step_s(&loaded, TRACKS, STEPS)?;
    println!("{}: {:.3} µs per control step", args.controller, 1e6 * step_s);
    drop(loaded);
    unload_all();
    Ok(())
}
