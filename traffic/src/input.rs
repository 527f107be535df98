//! Opens files safely: no file hangs the program, fills its memory, or leads to another file.
//!
//! | at the path is | an input | a file of a campaign's folder |
//! |---|---|---|
//! | a file | opened | opened |
//! | a folder | refused: a file is needed | refused |
//! | a symbolic link | followed | refused: it may lead to a file that the campaign would overwrite |
//! | a named pipe, a socket, a device | refused: it may never end, or never begin | refused |
//! | `/dev/stdin`, `/dev/fd/N`, `/dev/null` | opened | refused |
//!
//! The path `-` is the name of a file here. If there is no such file, the error says so (see
//! [`named`]): other programs and some commands read standard input there.

use std::fs::{File, OpenOptions};
use std::io::{self, ErrorKind, Read};
use std::path::Path;

/// Largest text that is read as a whole (bytes). An assumption: 100 times the largest file that a
/// command writes as one text.
const MOST_TEXT_BYTES: u64 = 256 << 20;

/// The mark by which some editors begin a file: U+FEFF in UTF-8.
const BYTE_ORDER_MARK: char = '\u{feff}';

/// Opens an input for reading.
///
/// # Errors
/// The error of the system, [`ErrorKind::IsADirectory`] for a folder, or
/// [`ErrorKind::InvalidInput`] if the path leads to something else that is no file.
pub fn open(path: &Path) -> io::Result<File> {
    let is_stream = cfg!(unix) && ["/dev/stdin", "/dev/fd", "/dev/null", "/proc"].iter().any(|at| path.starts_with(at));
    let opened = if is_stream { File::open(path) } else { checked(path, OpenOptions::new().read(true), false) };
    opened.map_err(|error| named(path, error))
}

/// Returns the error of an input that cannot be read. If the path is `-` and there is no such file,
/// the error says that standard input is not read. The kind of the error stays the same.
pub fn named(path: &Path, error: io::Error) -> io::Error {
    if path.as_os_str() == "-" && error.kind() == ErrorKind::NotFound {
        let message = "there is no file of this name, and standard input is not read here: name a file";
        return io::Error::new(ErrorKind::NotFound, message);
    }
    error
}

/// Opens a file that another program has named, to write at its end.
///
/// # Errors
/// The errors of [`open`].
pub fn append(path: &Path) -> io::Result<File> {
    let mut options = OpenOptions::new();
    options.create(true).append(true);
    let is_stream = ["/dev/stdout", "/dev/stderr", "/dev/fd", "/dev/null"].iter().any(|at| path.starts_with(at));
    if is_stream { options.open(path) } else { checked(path, &mut options, false) }
}

/// Opens a file of a campaign's folder with these options.
///
/// # Errors
/// The error of the system, or [`ErrorKind::InvalidInput`] if the path leads to
/// anything but a file, such as a link.
pub fn open_in_folder(path: &Path, options: &mut OpenOptions) -> io::Result<File> {
    checked(path, options, true)
}

/// Reads an input of at most `max_bytes` bytes.
///
/// # Errors
/// The errors of [`open`], and [`ErrorKind::InvalidData`] if the input is larger.
pub fn read(path: &Path, max_bytes: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    open(path)?.take(max_bytes.saturating_add(1)).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > max_bytes {
        return Err(io::Error::new(ErrorKind::InvalidData, format!("it is larger than {} MiB", max_bytes >> 20)));
    }
    Ok(bytes)
}

/// Reads an input as text, without a byte order mark.
///
/// # Errors
/// The errors of [`read`], and [`ErrorKind::InvalidData`] if the input is not UTF-8.
pub fn read_text(path: &Path) -> io::Result<String> {
    let text = String::from_utf8(read(path, MOST_TEXT_BYTES)?)
        .map_err(|_| io::Error::new(ErrorKind::InvalidData, "it is not text (UTF-8)"))?;
    Ok(without_mark(&text).map(str::to_owned).unwrap_or(text))
}

/// Returns true if a file was read, and its content is the fault: it is no text, or too large.
/// Another error is one of the system.
pub fn is_of_content(error: &io::Error) -> bool {
    error.kind() == ErrorKind::InvalidData
}

/// Returns a text whose lines end as on Unix. The reader of CSV tables counts lines that end with a
/// carriage return and a line feed from the wrong one of them.
pub fn with_line_feeds(text: &[u8]) -> Vec<u8> {
    let is_kept = |(at, byte): &(usize, &u8)| **byte != b'\r' || text.get(at + 1) != Some(&b'\n');
    text.iter().enumerate().filter(is_kept).map(|(_, byte)| *byte).collect()
}

/// Returns the text after its byte order mark, or `None` if it has none.
fn without_mark(text: &str) -> Option<&str> {
    text.strip_prefix(BYTE_ORDER_MARK)
}

#[cfg(unix)]
fn checked(path: &Path, options: &mut OpenOptions, is_in_folder: bool) -> io::Result<File> {
    use std::os::unix::fs::{FileTypeExt as _, OpenOptionsExt as _};

    use rustix::fs::OFlags;

    // Opening a named pipe waits for another program, unless the system is told not to. A file is
    // not affected.
    let flags = if is_in_folder { OFlags::NONBLOCK | OFlags::NOFOLLOW } else { OFlags::NONBLOCK };
    let flags = i32::try_from(flags.bits()).map_err(io::Error::other)?;
    let refused = |kind: &str| io::Error::new(ErrorKind::InvalidInput, format!("it is {kind}, not a file"));
    let file = match options.custom_flags(flags).open(path) {
        Ok(file) => file,
        Err(_) if is_in_folder && path.is_symlink() => return Err(refused("a symbolic link")),
        Err(error) if error.kind() == ErrorKind::IsADirectory => return Err(folder()),
        // A named pipe that is opened for writing, or a socket.
        Err(error) => return Err(special_kind(path).map_or(error, refused)),
    };
    let kind = file.metadata()?.file_type();
    if kind.is_dir() {
        Err(folder())
    } else if kind.is_fifo() {
        Err(refused("a named pipe"))
    } else if kind.is_char_device() || kind.is_block_device() {
        Err(refused("a device"))
    } else {
        Ok(file)
    }
}

/// Returns the error of a path that leads to a folder.
fn folder() -> io::Error {
    io::Error::new(ErrorKind::IsADirectory, "it is a folder, and a file is needed")
}

/// Returns the kind of thing at a path that cannot be opened, if it is neither a file nor a folder.
#[cfg(unix)]
fn special_kind(path: &Path) -> Option<&'static str> {
    use std::os::unix::fs::FileTypeExt as _;
    let kind = path.metadata().ok()?.file_type();
    let kinds = [(kind.is_fifo(), "a named pipe"), (kind.is_socket(), "a socket")];
    kinds.into_iter().find_map(|(is_kind, kind)| is_kind.then_some(kind))
}

#[cfg(not(unix))]
fn checked(path: &Path, options: &mut OpenOptions, is_in_folder: bool) -> io::Result<File> {
    if is_in_folder && path.is_symlink() {
        return Err(io::Error::new(ErrorKind::InvalidInput, "it is a symbolic link, not a file"));
    }
    if path.is_dir() { Err(folder()) } else { options.open(path) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_carriage_return_before_a_line_feed_is_left_out() {
        assert_eq!(with_line_feeds(b"\ra\r\n\r\r\nb\n\r"), b"\ra\n\r\nb\n\r");
    }

    #[test]
    fn a_text_is_read_without_its_mark_and_a_large_file_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        std::fs::write(&path, "\u{feff}text\u{feff}").unwrap();
        assert_eq!(read_text(&path).unwrap(), "text\u{feff}");
        assert!(read(&path, 5).unwrap_err().to_string().contains("larger than"));
        assert_eq!(read(&path, 10).unwrap().len(), 10);
        std::fs::write(&path, [0xff]).unwrap();
        assert!(read_text(&path).unwrap_err().to_string().contains("UTF-8"));
    }

    #[test]
    fn the_error_of_a_missing_file_named_dash_says_that_standard_input_is_not_read() {
        let missing = || io::Error::from(ErrorKind::NotFound);
        let error = named(Path::new("-"), missing());
        assert!(error.to_string().contains("standard input is not read here"), "{error}");
        assert_eq!(error.kind(), ErrorKind::NotFound);
        // Any other path, and any other error, says what the system says.
        for other in ["./-", "-.csv", "a.csv"] {
            assert_eq!(named(Path::new(other), missing()).to_string(), missing().to_string(), "{other}");
        }
        let denied = io::Error::from(ErrorKind::PermissionDenied);
        assert_eq!(named(Path::new("-"), denied).kind(), ErrorKind::PermissionDenied);
    }

    #[cfg(unix)]
    #[test]
    fn a_folder_a_pipe_a_socket_and_a_device_are_refused_and_a_link_in_a_folder_too() {
        let folder = tempfile::tempdir().unwrap();
        let [pipe, socket, link, victim] = ["pipe", "socket", "link", "victim"].map(|name| folder.path().join(name));
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        let _listener = std::os::unix::net::UnixListener::bind(&socket).unwrap();
        std::fs::write(&victim, "kept").unwrap();
        std::os::unix::fs::symlink(&victim, &link).unwrap();
        let in_folder = |path: &Path| open_in_folder(path, OpenOptions::new().create(true).write(true).truncate(true));
        for path in [pipe.as_path(), &socket, Path::new("/dev/zero")] {
            assert_eq!(open(path).unwrap_err().kind(), ErrorKind::InvalidInput, "{}", path.display());
            assert_eq!(in_folder(path).unwrap_err().kind(), ErrorKind::InvalidInput, "{}", path.display());
        }
        for error in [open(folder.path()).unwrap_err(), in_folder(folder.path()).unwrap_err()] {
            assert_eq!(error.kind(), ErrorKind::IsADirectory);
            assert_eq!(error.to_string(), "it is a folder, and a file is needed");
        }
        assert!(in_folder(&link).unwrap_err().to_string().contains("symbolic link"));
        assert_eq!(read_text(&link).unwrap(), "kept");
        assert_eq!(read(Path::new("/dev/null"), 1).unwrap(), Vec::<u8>::new());
    }
}
