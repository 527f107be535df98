//! The controllers that can drive the ego: built-in ones, and those from outside.
//!
//! | `--controller` | controller |
//! |---|---|
//! | `acc` | the scenario's ego stack without its margin increase system |
//! | `mis` | the scenario's complete ego stack |
//! | `mis-extended` | the same, with a margin increase system that gains its margin at once and may brake harder |
//! | `acc-aeb`, `acc+aeb`, `cruise+aeb` | stacks whose functions are switched ([`functions`](Functions)) |
//! | `CONTROLLER:KEY=VALUE` | a built-in controller with settings of its own ([`tuned`](Tuned)) |
//! | `gap-SECONDS` | as `acc`, with another constant time gap |
//! | `r157-gap` | as `acc`, with the minimum following distance of UN Regulation 157 |
//! | `r157-driver` | the competent and careful human driver of UN Regulation 157 |
//! | `r157-fsm` | the fuzzy safety model of UN Regulation 157 |
//! | `exec:COMMAND` | an external process, started anew for each sample ([`exec`]) |
//! | `lib:PATH` | a shared library, in a process of its own ([`native`]) |
//! | `fmu:PATH` | a functional mock-up unit, in a process of its own ([`native`]) |
//! | `python:NAME` | a controller of the Python program that runs Closecall ([`hosted`]) |
//!
//! A controller in Rust implements [`EgoController`](closecall_controllers::EgoController). A
//! campaign creates it through a [`ControllerFactory`](crate::run::ControllerFactory).
//! `examples/own_controller.rs` is a complete example.

mod arm_list;
mod built_in;
mod choice;
pub mod exec;
mod functions;
pub mod hosted;
mod hosted_process;
mod in_worker;
pub mod isolated;
pub mod native;
mod time_gap;
mod tuned;

pub use arm_list::{ArmList, ArmsError};
pub use built_in::BuiltIn;
pub use choice::{ControllerChoice, UnknownController};
pub use functions::Functions;
pub use time_gap::TimeGap;
pub use tuned::{Tuned, TunedError};
