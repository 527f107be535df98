//! The references agree with the program: `docs/reference/scenario.md` equals the output of its
//! generator, and `docs/reference/output.md` lists exactly the files, columns and keys that the
//! program writes.

mod documented;
mod output;
mod scenario;
