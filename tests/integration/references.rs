//! The references hold what the program holds: `docs/scenario.md` is what its generator writes, and `docs/output.md` lists
//! exactly the files, columns and keys that the program writes.

mod documented;
mod output;
mod scenario;
