//! The command line: arguments, calls, printed results, and exit codes.

mod args;
mod backend;
mod campaign;
mod check;
mod command;
mod compare;
mod ending;
mod error;
mod gates;
mod inspect;
mod interrupt;
mod json;
mod merge;
mod output;
mod plan;
mod plot;
mod protect;
mod record;
mod reenact;
mod render;
mod replay;
mod robustness;
mod run;
mod statistics;
mod summary;
mod trajectories;
mod watch;

pub use command::main;
pub use error::CliError;
