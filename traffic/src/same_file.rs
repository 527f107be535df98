//! Tells whether two paths lead to the same file. Commands use it to protect their inputs from
//! being overwritten.

use std::path::{Path, PathBuf};

/// Returns true if two paths lead to the same file, be it by a link or another folder. The file
/// need not exist if its folder does.
fn is_same_file(first: &Path, second: &Path) -> bool {
    #[cfg(unix)]
    if let (Ok(first), Ok(second)) = (first.metadata(), second.metadata()) {
        use std::os::unix::fs::MetadataExt as _;
        // Two names of one file, by a hard link.
        return (first.dev(), first.ino()) == (second.dev(), second.ino());
    }
    first == second || matches!((canonical(first), canonical(second)), (Some(first), Some(second)) if first == second)
}

/// A file that a command writes, with the option that names it.
pub type Output<'a> = (&'static str, Option<&'a Path>);

/// Checks that no output is one of the inputs, under whatever path, and that no two outputs are the
/// same file.
///
/// # Errors
/// The options of the output that would do so.
pub fn check_outputs(inputs: &[PathBuf], outputs: &[Output<'_>]) -> Result<(), String> {
    let named: Vec<(&str, &Path)> = outputs.iter().filter_map(|(option, path)| Some((*option, (*path)?))).collect();
    for (index, (option, output)) in named.iter().enumerate() {
        if let Some(input) = inputs.iter().find(|input| is_same_file(input, output)) {
            return Err(format!("{option} would overwrite the input {}", input.display()));
        }
        if let Some((other, _)) = named[..index].iter().find(|(_, other)| is_same_file(other, output)) {
            return Err(format!("{other} and {option} name the same file"));
        }
    }
    Ok(())
}

/// Returns the canonical path of a file, which need not exist if its folder does.
fn canonical(path: &Path) -> Option<PathBuf> {
    let in_folder = || {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        Some(folder.canonicalize().ok()?.join(path.file_name()?))
    };
    path.canonicalize().ok().or_else(in_folder)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_output_is_neither_an_input_nor_another_output() {
        let [input, new] = ["a.toml", "new.csv"].map(Path::new);
        let inputs = [input.to_owned()];
        assert!(check_outputs(&inputs, &[("--out", Some(input))]).is_err());
        assert!(check_outputs(&inputs, &[("--out", Some(new)), ("--trace", None)]).is_ok());
        assert!(check_outputs(&inputs, &[("--record", Some(new)), ("--trace", Some(new))]).is_err());
    }

    #[test]
    fn a_file_is_recognised_under_any_path() -> std::io::Result<()> {
        let folder = tempfile::tempdir()?;
        let path = |name: &str| folder.path().join(name);
        std::fs::create_dir(path("sub"))?;
        std::fs::write(path("a.toml"), "")?;
        std::fs::hard_link(path("a.toml"), path("hard.toml"))?;
        #[cfg(unix)]
        std::os::unix::fs::symlink(path("a.toml"), path("soft.toml"))?;
        for same in ["a.toml", "sub/../a.toml", "hard.toml", "soft.toml"] {
            assert!(is_same_file(&path("a.toml"), &path(same)), "{same}");
        }
        assert!(!is_same_file(&path("a.toml"), &path("b.toml")));
        assert!(is_same_file(&path("new.csv"), &path("sub/../new.csv")));
        Ok(())
    }
}
