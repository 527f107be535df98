//! The file of names: sorted, each line with the number of bytes that it shares with the name before, and the rest. Neighbours share
//! most of their paths, so that this takes 0.9 instead of 2 MB. `build.rs` reads it.

use std::collections::BTreeSet;
use std::fmt::Write;

/// Returns the content of the file.
pub(crate) fn written(names: &BTreeSet<String>) -> String {
    let (mut text, mut before) = (String::new(), "");
    for name in names {
        let shared = before.bytes().zip(name.bytes()).take_while(|(one, other)| one == other).count();
        // The names are ASCII.
        let _ = writeln!(text, "{shared} {}", &name[shared..]);
        before = name;
    }
    text
}
