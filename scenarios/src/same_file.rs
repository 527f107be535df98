//! Whether two paths lead to the same file.

use std::path::{Path, PathBuf};

/// Returns true if two paths lead to the same file, be it by a link or another folder. The file need not exist if its
/// folder does.
pub fn is_same_file(one: &Path, other: &Path) -> bool {
    #[cfg(unix)]
    if let (Ok(one), Ok(other)) = (one.metadata(), other.metadata()) {
        use std::os::unix::fs::MetadataExt as _;
        // Two names of one file, by a hard link.
        return (one.dev(), one.ino()) == (other.dev(), other.ino());
    }
    one == other || matches!((canonical(one), canonical(other)), (Some(one), Some(other)) if one == other)
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
