//! The controllers that can drive the ego: built-in ones, and external processes.
//!
//! | `--controller` | controller |
//! |---|---|
//! | `acc` | the scenario's ego stack without its margin increase system |
//! | `mis` | the scenario's complete ego stack |
//! | `exec:COMMAND` | an external process, started anew for each sample ([`exec`]) |
//!
//! A controller in Rust implements [`EgoController`](closecall_controllers::EgoController). A campaign creates it through a
//! [`ControllerFactory`](crate::run::ControllerFactory). `examples/own_controller.rs` is a complete example.

mod built_in;
mod choice;
pub mod exec;

pub use built_in::BuiltIn;
pub use choice::ControllerChoice;
