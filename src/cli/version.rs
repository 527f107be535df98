//! The sources of this program.

use closecall_campaign::manifest;

/// The release, the commit with its date, the platform, and the backends of the network, in lines.
pub(super) const BUILD: &str = concat!(
    env!("CARGO_PKG_VERSION"),
    "\ncommit:   ",
    env!("CLOSECALL_SOURCES"),
    "\nplatform: ",
    env!("CLOSECALL_TARGET"),
    "\nnetwork:  tract (built in), ONNX Runtime (a library that is named)",
);

/// Returns the commit, if the sources do not differ from it.
pub(super) fn commit() -> Option<&'static str> {
    Some(env!("CLOSECALL_COMMIT")).filter(|commit| !commit.is_empty())
}

/// Lets results name the commit.
pub fn name_commit() {
    if let Some(commit) = commit() {
        manifest::set_commit(commit);
    }
}
