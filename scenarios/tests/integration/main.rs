//! The chain from files to distributions, through the crate's public interface.

mod golden;
mod malformed;
mod ngsim_us101;
mod own_recordings;
mod support;
