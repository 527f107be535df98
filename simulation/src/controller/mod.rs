//! Who controls E: the controllers that ship, and processes that speak a protocol of lines.
//!
//! | `--controller` | who |
//! |---|---|
//! | `acc` | the scenario's ego stack without its margin increase system |
//! | `mis` | the scenario's whole ego stack |
//! | `exec:COMMAND` | a process of your own, started afresh for each sample ([`exec`]) |
//!
//! A controller in Rust implements [`EgoController`](closecall_controllers::EgoController) and is handed to a campaign
//! by a [`ControllerFactory`](crate::run::ControllerFactory): `examples/own_controller.rs` is one in one file.

mod built_in;
mod choice;
pub mod exec;

pub use built_in::BuiltIn;
pub use choice::ControllerChoice;
