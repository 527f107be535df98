//! Whether a campaign's folder is the user's own, so that the commands and libraries that it names
//! may run unasked.
//!
//! A folder is the user's own if this program wrote its manifest for this user on this machine.
//! `closecall/manifests` below the user's state folder (`XDG_STATE_HOME`, else `~/.local/state`)
//! has the hashes of these manifests, as direnv and Git's `safe.directory` keep a list of trusted
//! folders. A copy of an unchanged manifest can name only commands that this user has run before.

use std::env;
use std::fs::{self, OpenOptions};
use std::io::{self, BufRead, BufReader, Seek, SeekFrom, Write};
use std::path::PathBuf;

use closecall_traffic::input;

/// Length of the file from which on its older half is forgotten (bytes): some 16,000 campaigns. An
/// assumption.
const MOST_BYTES: u64 = 1 << 20;

/// Returns the file of the hashes, or `None` if the user has no state folder.
fn file() -> Option<PathBuf> {
    let folder = |name: &str| env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let state = || Some(folder("HOME")?.join(".local/state"));
    let base = folder("XDG_STATE_HOME").or_else(|| folder("LOCALAPPDATA")).or_else(state)?;
    Some(base.join("closecall").join("manifests"))
}

/// Returns true if this program wrote a manifest with this hash for this user.
pub(crate) fn is_own(hash: &str) -> bool {
    let Some(file) = file().and_then(|path| input::open(&path).ok()) else { return false };
    BufReader::new(file).lines().map_while(Result::ok).any(|line| line == hash)
}

/// Remembers that this program has written a manifest with this hash.
///
/// # Errors
/// The error of the system if the file of the hashes cannot be written.
pub(crate) fn remember(hash: &str) -> io::Result<()> {
    if is_own(hash) {
        return Ok(());
    }
    let path =
        file().ok_or_else(|| io::Error::other("there is no state folder: neither XDG_STATE_HOME nor HOME is set"))?;
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder)?;
    }
    let mut options = OpenOptions::new();
    options.create(true).read(true).append(true);
    let mut file = input::open_in_folder(&path, &mut options)?;
    // Two campaigns may begin at the same time.
    file.lock()?;
    if file.metadata()?.len() > MOST_BYTES {
        file.seek(SeekFrom::Start(MOST_BYTES / 2))?;
        // The first line is cut.
        let kept: Vec<String> = BufReader::new(&file).lines().skip(1).collect::<io::Result<_>>()?;
        file.set_len(0)?;
        file.write_all((kept.join("\n") + "\n").as_bytes())?;
    }
    file.write_all(format!("{hash}\n").as_bytes())
}
