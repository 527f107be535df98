//! The command line: arguments, calls, printed results, and exit codes.

mod args;
mod backend;
mod baseline;
mod campaign;
mod check;
mod command;
mod compare;
mod ending;
mod error;
mod gates;
mod generate;
mod heartbeat;
mod inspect;
mod interrupt;
mod library;
mod merge;
mod new;
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
mod schema;
mod statistics;
mod summary;
mod trajectories;
mod view;
mod watch;
mod watching;

pub use command::main;
pub use error::CliError;
