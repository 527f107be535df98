//! The references hold what the program holds: `docs/reference/scenario.md` is what its generator writes, and `docs/reference/output.md` lists
//! exactly the files, columns and keys that the program writes.

mod documented;
mod output;
mod scenario;
