//! Reads which functions a profile of Callgrind names.
//!
//! The file names each function once as `(NUMBER) NAME`, in a line that begins with `fn=` (what it costs) or `cfn=` (a call
//! of it), see the manual of Valgrind, "Callgrind Format Specification".

use std::collections::BTreeSet;

/// Beginnings of the names that the Rust compiler gives to functions, in its older and its newer scheme. What has no such name is the
/// C library's, or one of a few functions in assembly.
const RUST: [&str; 2] = ["_ZN", "_R"];

/// Returns the names of all functions of Rust in a profile.
pub(crate) fn functions(profile: &str) -> BTreeSet<String> {
    let name = |line: &str| {
        let (_, name) = line.strip_prefix("fn=(").or_else(|| line.strip_prefix("cfn=("))?.split_once(") ")?;
        // In a recursion, a number follows.
        let name = name.split_once('\'').map_or(name, |(name, _)| name);
        RUST.iter().any(|beginning| name.starts_with(beginning)).then(|| name.to_owned())
    };
    profile.lines().filter_map(name).collect()
}
