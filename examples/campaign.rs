//! Runs a campaign from Rust, without the command line.
//!
//! ```sh
//! cargo run --release --example campaign
//! ```

use std::error::Error;
use std::path::Path;

use closecall::campaign::gate::GateSet;
use closecall::campaign::plan::Plan;
use closecall::campaign::runner::Sampling;
use closecall::scenarios::ScenarioFile;
use closecall::scenarios::sampling::Design;
use closecall::simulation::controller::ControllerChoice;

/// Runs 20 samples with and without the margin increase system, and applies a gate to the result.
#[expect(clippy::print_stdout, reason = "an example prints its result")]
pub(crate) fn main() -> Result<(), Box<dyn Error>> {
    let library = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/library");
    let scenario = ScenarioFile::load(&library.join("low-thw-overtake.toml"), &[])?;
    let sampling = Sampling { seed: 1, design: Design::Random, samples: 20 };
    let plan = Plan::new(vec![scenario], sampling, vec![ControllerChoice::ACC, ControllerChoice::MIS])?;
    let gates = GateSet::of(["count(induced) <= 1".parse()?]);
    let (summary, judged) = plan.campaign().judge(&gates)?;
    let pairs = summary.total().pairs;
    println!("{} prevented, {} induced: {}", pairs.prevented, pairs.induced, judged.word());
    Ok(())
}
