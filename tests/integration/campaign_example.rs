//! The example `campaign` runs a campaign from Rust, without the command line.

#[path = "../../examples/campaign.rs"]
mod example;

#[test]
fn the_example_runs_a_campaign() {
    example::main().unwrap();
}
