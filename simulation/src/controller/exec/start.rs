//! Why a program that is there cannot be started. The system answers "No such file or directory" if
//! the *interpreter* of a script is absent, "Exec format error" if a script names none, and
//! "Permission denied" of a file without the right to run. A bare name is looked for in `PATH`
//! alone.

use std::io::{self, ErrorKind, Read};
use std::os::unix::fs::PermissionsExt;
use std::path::Path;

use closecall_traffic::input;
use rustix::io::Errno;

/// Longest beginning of a program that is read: the system reads no more of the first line of a
/// script (bytes; `BINPRM_BUF_SIZE` of Linux).
const MOST_BYTES: u64 = 256;

/// Commands that a shell itself carries out.
const SHELL_COMMANDS: [&str; 6] = ["cd", "export", "exec", "set", "source", "ulimit"];

/// Returns why a program cannot be started, in words, or `None` if the error of the system says it.
/// `path` is the file of its name.
pub(super) fn reason(program: &str, path: &Path, error: &io::Error) -> Option<String> {
    let is_absent = error.kind() == ErrorKind::NotFound;
    let has_other_format = error.raw_os_error() == Some(Errno::NOEXEC.raw_os_error());
    if error.kind() == ErrorKind::PermissionDenied {
        return denied(path);
    }
    if is_absent && !path.is_file() && is_of_a_shell(program) {
        return Some("no shell reads the command; `sh -c '…'` starts one that does".to_owned());
    }
    if !(is_absent || has_other_format) || !path.is_file() {
        return None;
    }
    if !program.contains('/') {
        return is_absent.then(|| not_in_path(program));
    }
    let mut beginning = Vec::new();
    input::open(path).ok()?.take(MOST_BYTES).read_to_end(&mut beginning).ok()?;
    let line = beginning.split(|byte| *byte == b'\n').next().unwrap_or_default();
    match line.strip_prefix(b"#!") {
        Some(rest) if is_absent => absent_interpreter(&String::from_utf8_lossy(rest)),
        Some(_) => None,
        None if is_absent => Some("it is there, but the loader that it names is not: is it built for another system?".to_owned()),
        None => Some(
            "it is neither a program for this machine nor a script whose first line names its interpreter, such as `#!/bin/sh`"
                .to_owned(),
        ),
    }
}

/// Returns true if the first word of a command has a meaning for a shell alone: `~/mine`,
/// `$HOME/mine`, `NAME=value`, `cd`.
fn is_of_a_shell(word: &str) -> bool {
    word.starts_with('~') || word.contains(['$', '=']) || SHELL_COMMANDS.contains(&word)
}

/// Returns why a program without a folder is not found, although a file of its name is there.
fn not_in_path(program: &str) -> String {
    format!(
        "no folder in PATH has it; for the file here, write `./{program}`, or name its interpreter, such as `python3`"
    )
}

/// Returns why the system denies to start the program at a path, if that can be told.
fn denied(path: &Path) -> Option<String> {
    const MAY_RUN: u32 = 0o111;
    let file = path.metadata().ok()?;
    if file.is_dir() {
        return Some("it is a folder".to_owned());
    }
    let cannot_run = file.permissions().mode() & MAY_RUN == 0;
    cannot_run.then(|| {
        "nobody has the right to run it: `chmod +x` gives it, or name its interpreter, such as `python3`".to_owned()
    })
}

/// Returns what is wrong with the interpreter that the first line of a script names after `#!`, or
/// `None` if it is there.
fn absent_interpreter(line: &str) -> Option<String> {
    let interpreter = line.trim_matches([' ', '\t']).split([' ', '\t']).next().unwrap_or_default();
    if Path::new(interpreter).exists() {
        return None;
    }
    let lines = if interpreter.ends_with('\r') { ": its lines end with CR LF, and LF is needed" } else { "" };
    Some(format!("its line 1 names the interpreter `{}`, which is not there{lines}", interpreter.escape_debug()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_here_needs_its_folder_or_its_interpreter() {
        let absent = io::Error::from(ErrorKind::NotFound);
        let told = |name: &str| reason(name, Path::new(name), &absent);
        assert!(told("Cargo.toml").is_some_and(|why| why.contains("write `./Cargo.toml`")));
        assert_eq!(told("no-such-file"), None, "the system's words are enough");
        for word in ["cd", "~/mine.py", "$HOME/mine.py", "PYTHONPATH=."] {
            assert!(told(word).is_some_and(|why| why.contains("`sh -c '…'` starts one")), "{word}");
        }
    }
}
