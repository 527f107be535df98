//! A campaign from Rust, from the example's one file.

#[path = "../../examples/campaign.rs"]
mod example;

#[test]
fn the_example_runs_a_campaign_without_the_command_line() {
    example::main().unwrap();
}
