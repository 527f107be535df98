//! The archive of an FMU: a zip file with a model description and a binary for each platform.

use std::collections::BTreeMap;
use std::env::consts::{ARCH, DLL_SUFFIX, OS};
use std::fs::File;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, OnceLock, PoisonError, TryLockError};
use std::time::{Duration, Instant, SystemTime};

use closecall_traffic::input;
use tempfile::NamedTempFile;
use zip::ZipArchive;
use zip::result::ZipError;

use super::description::{Description, Version};
use crate::external::error::LoadError;

/// The name of the description in the archive.
const DESCRIPTION: &str = "modelDescription.xml";

/// An FMU that is unpacked into a folder, which is removed with this value.
#[derive(Debug)]
pub(super) struct Unpacked {
    pub(super) description: Description,
    pub(super) binary: PathBuf,
    /// Where it is.
    place: PathBuf,
    /// The folder, if this process has unpacked it.
    folder: Option<Folder>,
}

impl Unpacked {
    /// Returns the name of the binary in the archive.
    pub(super) fn binary_name(&self) -> String {
        self.binary.strip_prefix(&self.place).unwrap_or(&self.binary).display().to_string()
    }

    /// Returns the folder of the FMU's resources.
    pub(super) fn resources(&self) -> PathBuf {
        self.place.join("resources")
    }
}

/// The beginning of the names of the folders, and the ends of the names of a folder and of its
/// lock.
const PREFIX: &str = "closecall-fmu-";
const FOLDER_END: &str = "unpacked";
const LOCK_END: &str = "lock";

/// A temporary folder. A process that crashes leaves its folder behind, without the lock beside it:
/// the next process removes it.
#[derive(Debug)]
struct Folder {
    path: PathBuf,
    /// Locked for as long as the process lives.
    _lock: NamedTempFile,
}

impl Folder {
    fn new(place: &Path) -> io::Result<Self> {
        remove_abandoned(place);
        let lock = Self::lock(place)?;
        let path = lock.path().with_extension(FOLDER_END);
        std::fs::create_dir(&path)?;
        Ok(Self { path, _lock: lock })
    }

    /// Creates a file and locks it.
    fn lock(folder: &Path) -> io::Result<NamedTempFile> {
        loop {
            let lock = tempfile::Builder::new().prefix(PREFIX).suffix(&format!(".{LOCK_END}")).tempfile_in(folder)?;
            lock.as_file().lock()?;
            // Before it was locked, another process may have taken it for an abandoned one, and
            // removed it.
            if lock.path().exists() {
                return Ok(lock);
            }
        }
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        // What cannot be removed stays.
        std::fs::remove_dir_all(&self.path).ok();
    }
}

/// Removes the folders of processes that have crashed.
fn remove_abandoned(folder: &Path) {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let is_lock = |path: &PathBuf| {
        let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        name.starts_with(PREFIX) && path.extension().is_some_and(|end| end == LOCK_END)
    };
    for path in entries.filter(is_lock) {
        // A lock of another user cannot be opened.
        let Ok(lock) = File::open(&path) else { continue };
        // The lock is held until both are removed.
        if lock.try_lock().is_ok() {
            std::fs::remove_dir_all(path.with_extension(FOLDER_END)).ok();
            std::fs::remove_file(&path).ok();
        }
        drop(lock);
    }
}

/// Largest size of an FMU that is unpacked (bytes), its largest number of files, and the longest
/// time that unpacking takes: limits of this program, 20 times the largest FMU of the FMI
/// cross-check repository.
const MOST_BYTES: u64 = 2 << 30;
const MOST_FILES: usize = 100_000;
const LONGEST: Duration = Duration::from_secs(60);
/// Largest description that is read (bytes): a limit of this program, 100 times a description with
/// 10,000 variables.
const MOST_DESCRIPTION_BYTES: u64 = 256 << 20;

/// The folder into which the parent process has unpacked its FMU.
static BY_PARENT: OnceLock<PathBuf> = OnceLock::new();

/// The folders that this process has unpacked for its child processes, by the path of the FMU, with
/// the time and size of the file.
static UNPACKED: Mutex<BTreeMap<PathBuf, (Seen, Folder)>> = Mutex::new(BTreeMap::new());

/// The time of change and the length of a file.
type Seen = (SystemTime, u64);

/// Uses the folder into which the parent process has unpacked the FMU.
pub(crate) fn use_unpacked(folder: PathBuf) {
    BY_PARENT.get_or_init(|| folder);
}

/// Unpacks an FMU once for all processes that this process starts, and returns the folder. No code
/// of the FMU runs.
///
/// # Errors
/// [`LoadError`] if it cannot be unpacked.
pub(crate) fn unpacked_for_children(path: &Path) -> Result<PathBuf, LoadError> {
    let read = |source| LoadError::Read { path: path.display().to_string(), source };
    let metadata = path.metadata().map_err(read)?;
    let seen = (metadata.modified().map_err(read)?, metadata.len());
    let mut unpacked = UNPACKED.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((_, folder)) = unpacked.get(path).filter(|(unpacked_as, _)| *unpacked_as == seen) {
        return Ok(folder.path.clone());
    }
    let Unpacked { folder, place, .. } = unpack_into_new(path)?;
    if let Some(folder) = folder {
        unpacked.insert(path.to_owned(), (seen, folder));
    }
    Ok(place)
}

/// Time that the end of the program waits for an FMU that is being unpacked, and the interval at
/// which it looks.
const END_WAIT: Duration = Duration::from_millis(500);
const END_POLL: Duration = Duration::from_millis(10);

/// Removes what this process has unpacked for others. An FMU that is being unpacked keeps neither
/// Ctrl-C nor SIGTERM waiting: the next process removes its folder as an abandoned one, see
/// [`remove_abandoned`].
pub(crate) fn remove_unpacked() {
    let begun = Instant::now();
    let mut unpacked = loop {
        match UNPACKED.try_lock() {
            Ok(unpacked) => break unpacked,
            Err(TryLockError::Poisoned(poisoned)) => break poisoned.into_inner(),
            Err(TryLockError::WouldBlock) if begun.elapsed() > END_WAIT => return,
            Err(TryLockError::WouldBlock) => std::thread::sleep(END_POLL),
        }
    };
    drop(std::mem::take(&mut *unpacked));
}

/// Returns the unpacked FMU: the folder that the parent process has unpacked, or a new folder.
pub(super) fn unpack(path: &Path) -> Result<Unpacked, LoadError> {
    let Some(place) = BY_PARENT.get() else { return unpack_into_new(path) };
    let shown = path.display().to_string();
    let refuse = |reason: String| LoadError::Fmu { path: shown.clone(), reason };
    let read = |source| LoadError::Read { path: shown.clone(), source };
    let bytes = input::read(&place.join(DESCRIPTION), MOST_DESCRIPTION_BYTES).map_err(read)?;
    let description = decoded(bytes).and_then(|text| Description::parse(&text)).map_err(&refuse)?;
    let names = files_below(place, &place.join("binaries"));
    let binary = binary(&names, &description).map_err(&refuse)?;
    Ok(Unpacked { description, binary: place.join(binary), place: place.clone(), folder: None })
}

/// Returns the names of the files in a folder and below it, relative to `place`.
fn files_below(place: &Path, folder: &Path) -> Vec<String> {
    let mut names = Vec::new();
    for path in std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path()) {
        if path.is_dir() {
            names.extend(files_below(place, &path));
        } else if let Ok(name) = path.strip_prefix(place) {
            names.push(name.to_string_lossy().replace('\\', "/"));
        }
    }
    names
}

/// Unpacks an FMU. Its description and its binary for this platform are looked for first.
fn unpack_into_new(path: &Path) -> Result<Unpacked, LoadError> {
    let shown = path.display().to_string();
    let read = |source| LoadError::Read { path: shown.clone(), source };
    let refuse = |reason: String| LoadError::Fmu { path: shown.clone(), reason };
    let file = input::open(path).map_err(read)?;
    let broken = |error: ZipError| match error {
        ZipError::Io(source) if source.kind() != io::ErrorKind::UnexpectedEof => read(source),
        error => refuse(format!("it is not an FMU, which is a zip archive ({error})")),
    };
    let mut archive = ZipArchive::new(file).map_err(broken)?;
    if archive.len() > MOST_FILES {
        return Err(refuse(format!("it has {} files, and may have {MOST_FILES}", archive.len())));
    }
    let mut entries: BTreeMap<String, usize> = BTreeMap::new();
    for index in 0..archive.len() {
        let entry = archive.by_index_raw(index).map_err(broken)?;
        let raw = String::from_utf8_lossy(entry.name_raw()).into_owned();
        let Some(name) = normal_name(&raw).map_err(&refuse)? else { continue };
        if entry.is_symlink() {
            return Err(refuse(format!("its archive has the symbolic link `{raw}`; expected files")));
        }
        if entries.insert(name, index).is_some() {
            return Err(refuse(format!("its archive has `{raw}` twice")));
        }
    }
    let text = {
        let index = *entries
            .get(DESCRIPTION)
            .ok_or_else(|| refuse(format!("it is not an FMU: its archive has no {DESCRIPTION}")))?;
        let mut bytes = Vec::new();
        let entry = archive.by_index(index).map_err(broken)?;
        let wrong = |error: io::Error| refuse(format!("its {DESCRIPTION} cannot be read: {error}"));
        entry.take(MOST_DESCRIPTION_BYTES + 1).read_to_end(&mut bytes).map_err(wrong)?;
        if bytes.len() as u64 > MOST_DESCRIPTION_BYTES {
            return Err(refuse(format!("its {DESCRIPTION} is larger than {} MiB", MOST_DESCRIPTION_BYTES >> 20)));
        }
        decoded(bytes).map_err(&refuse)?
    };
    let description = Description::parse(&text).map_err(&refuse)?;
    let names: Vec<String> = entries.keys().cloned().collect();
    let binary = binary(&names, &description).map_err(&refuse)?;
    let folder = Folder::new(&std::env::temp_dir()).map_err(read)?;
    let (mut left, started) = (MOST_BYTES, Instant::now());
    for (name, index) in &entries {
        let mut entry = archive.by_index(*index).map_err(broken)?;
        let target = folder.path.join(name);
        let file = write_file(&mut entry, &target, &mut left, started).map_err(|error| match error.kind() {
            // The content is compressed in another way than its header says.
            io::ErrorKind::InvalidData | io::ErrorKind::InvalidInput | io::ErrorKind::UnexpectedEof => {
                refuse(format!("its archive is damaged in `{name}`: {error}"))
            }
            io::ErrorKind::FileTooLarge | io::ErrorKind::TimedOut => refuse(error.to_string()),
            _ => read(error),
        })?;
        #[cfg(unix)]
        if let Some(mode) = entry.unix_mode() {
            use std::os::unix::fs::PermissionsExt as _;
            const OWNER_READS_AND_WRITES: u32 = 0o600;
            let mode = std::fs::Permissions::from_mode((mode & 0o777) | OWNER_READS_AND_WRITES);
            file.set_permissions(mode).map_err(read)?;
        }
    }
    std::fs::create_dir_all(folder.path.join("resources")).map_err(read)?;
    let place = folder.path.clone();
    Ok(Unpacked { description, binary: place.join(binary), place, folder: Some(folder) })
}

/// Writes a file of an archive, and the folders above it. `left` is the number of bytes that may
/// still be written.
fn write_file(from: &mut impl Read, target: &Path, left: &mut u64, started: Instant) -> io::Result<File> {
    // Empty files and folders take time, too.
    check_time(started)?;
    if let Some(parent) = target.parent() {
        std::fs::create_dir_all(parent)?;
    }
    let mut file = File::create(target)?;
    copy_bounded(from, &mut file, left, started)?;
    Ok(file)
}

/// Copies a file of an archive. `left` is the number of bytes that may still be written.
fn copy_bounded(from: &mut impl Read, to: &mut impl Write, left: &mut u64, started: Instant) -> io::Result<()> {
    const CHUNK_BYTES: usize = 1 << 16;
    let mut chunk = vec![0; CHUNK_BYTES];
    loop {
        let read = from.read(&mut chunk)?;
        if read == 0 {
            return Ok(());
        }
        *left = left.checked_sub(read as u64).ok_or_else(|| {
            let message = format!("it holds more than the {} MiB that are unpacked", MOST_BYTES >> 20);
            io::Error::new(io::ErrorKind::FileTooLarge, message)
        })?;
        check_time(started)?;
        to.write_all(&chunk[..read])?;
    }
}

/// Returns an error if unpacking takes too long. It began at `started`.
fn check_time(started: Instant) -> io::Result<()> {
    if started.elapsed() <= LONGEST {
        return Ok(());
    }
    let message = format!("it takes longer to unpack than the {} s allowed", LONGEST.as_secs());
    Err(io::Error::new(io::ErrorKind::TimedOut, message))
}

/// Returns the name of a file in the notation of the standard: with slashes, and without `./`. Some
/// tools write backslashes. Returns `None` for a folder.
fn normal_name(raw: &str) -> Result<Option<String>, String> {
    let slashed = raw.replace('\\', "/");
    let parts: Vec<&str> = slashed.split('/').filter(|part| !part.is_empty() && *part != ".").collect();
    if slashed.starts_with('/') || parts.contains(&"..") || slashed.contains('\0') {
        return Err(format!("its archive has the name `{raw}`, which leads out of the archive"));
    }
    Ok((!slashed.ends_with('/') && !parts.is_empty()).then(|| parts.join("/")))
}

/// Returns the text of a description in the encoding that it declares: UTF-8, which the standard
/// prescribes, or ISO-8859-1.
fn decoded(bytes: Vec<u8>) -> Result<String, String> {
    let is_utf_16 = bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]);
    let head = String::from_utf8_lossy(&bytes[..bytes.len().min(200)]).into_owned();
    let declaration = head.trim_start_matches('\u{feff}').split("?>").next().filter(|text| text.starts_with("<?xml"));
    let declared = declaration.and_then(|text| text.split_once("encoding")).and_then(|(_, rest)| {
        let rest = rest.trim_start().strip_prefix('=')?.trim_start();
        let quote = rest.chars().next().filter(|c| matches!(c, '"' | '\''))?;
        rest[1..].split(quote).next()
    });
    let declared = if is_utf_16 { "UTF-16" } else { declared.unwrap_or("UTF-8") };
    match declared.to_ascii_lowercase().as_str() {
        "utf-8" | "utf8" | "us-ascii" | "ascii" => {
            String::from_utf8(bytes).map_err(|error| format!("its {DESCRIPTION} is not UTF-8: {error}"))
        }
        "iso-8859-1" | "latin1" | "latin-1" => Ok(bytes.into_iter().map(char::from).collect()),
        _ => Err(format!(
            "its {DESCRIPTION} has the encoding {declared}; expected UTF-8, which the standard prescribes, or ISO-8859-1"
        )),
    }
}

/// Returns the name of the archive's binary for this platform, or the reason why there is none.
fn binary(names: &[String], description: &Description) -> Result<String, String> {
    let expected = own_platforms(description.version);
    let name = |platform: &str| format!("binaries/{platform}/{}{DLL_SUFFIX}", description.identifier);
    if let Some(file) = expected.iter().map(|platform| name(platform)).find(|name| names.contains(name)) {
        return Ok(file);
    }
    let mut platforms: Vec<&str> =
        names.iter().filter_map(|name| Some(name.strip_prefix("binaries/")?.split_once('/')?.0)).collect();
    platforms.sort_unstable();
    platforms.dedup();
    let problem = match platforms.iter().any(|platform| expected.contains(&(*platform).to_owned())) {
        true => format!("its binaries lack {}", name(&expected[0])),
        false if platforms.is_empty() => "it has no binaries".to_owned(),
        false => format!("it has binaries for {}", platforms.join(", ")),
    };
    Err(format!("{problem}; expected one for {}", expected.join(" or ")))
}

/// Returns the names of this platform in the folder `binaries`.
fn own_platforms(version: Version) -> Vec<String> {
    let system = if OS == "macos" { "darwin" } else { OS };
    let tuple = format!("{ARCH}-{system}");
    let short = match (version, ARCH, OS) {
        (Version::Fmi2, "x86_64", "linux") => "linux64",
        (Version::Fmi2, "x86_64", "macos") => "darwin64",
        (Version::Fmi2, "x86_64", "windows") => "win64",
        _ => return vec![tuple],
    };
    vec![short.to_owned(), tuple]
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicBool, Ordering};

    use super::*;

    #[test]
    fn names_and_encodings_of_other_tools_are_read() {
        let normal = |raw: &str| normal_name(raw).unwrap();
        assert_eq!(normal("binaries\\linux64\\a.so").as_deref(), Some("binaries/linux64/a.so"));
        assert_eq!(normal("./././a//b.xml").as_deref(), Some("a/b.xml"));
        assert_eq!((normal("resources/"), normal("resources\\"), normal("./")), (None, None, None));
        for raw in ["../a", "a/..\\..\\b", "/etc/passwd", "\\a"] {
            assert!(normal_name(raw).unwrap_err().contains("leads out of the archive"), "{raw}");
        }
        let latin = b"<?xml version='1.0' encoding = 'ISO-8859-1'?><a n=\"M\xfcller\"/>".to_vec();
        assert!(decoded(latin).unwrap().contains("Müller"));
        assert!(decoded(b"<?xml version=\"1.0\"?><a n=\"M\xfcller\"/>".to_vec()).unwrap_err().contains("is not UTF-8"));
        let other = b"<?xml version=\"1.0\" encoding=\"Shift_JIS\"?><a/>".to_vec();
        assert!(decoded(other).unwrap_err().contains("has the encoding Shift_JIS; expected UTF-8"));
        assert!(decoded(vec![0xff, 0xfe, b'<', 0]).unwrap_err().contains("UTF-16"));
    }

    #[test]
    fn the_unpacked_size_is_bounded() {
        let (mut left, mut written) = (10, Vec::new());
        let error = copy_bounded(&mut [0; 11].as_slice(), &mut written, &mut left, Instant::now()).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::FileTooLarge);
        copy_bounded(&mut [0; 10].as_slice(), &mut written, &mut left, Instant::now()).unwrap();
        assert_eq!((left, written.len()), (0, 10));
    }

    #[test]
    fn the_time_of_empty_files_is_bounded_too() {
        let place = tempfile::tempdir().unwrap();
        let target = place.path().join("resources/deep/empty");
        let (mut left, long_ago) = (10, Instant::now().checked_sub(LONGEST + Duration::from_secs(1)).unwrap());
        let error = write_file(&mut io::empty(), &target, &mut left, long_ago).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::TimedOut);
        assert!(error.to_string().contains("longer to unpack than the 60 s allowed"), "{error}");
        assert!(!place.path().join("resources").exists());
        write_file(&mut io::empty(), &target, &mut left, Instant::now()).unwrap();
        assert!(target.is_file());
    }

    #[test]
    fn the_end_of_the_program_does_not_wait_for_an_fmu_that_is_being_unpacked() {
        let unpacking = UNPACKED.lock().unwrap_or_else(PoisonError::into_inner);
        // Another thread holds the lock, as it is held when a signal arrives.
        std::thread::scope(|scope| {
            scope.spawn(remove_unpacked).join().unwrap();
        });
        drop(unpacking);
        remove_unpacked();
        assert!(UNPACKED.lock().unwrap_or_else(PoisonError::into_inner).is_empty());
    }

    #[test]
    fn a_live_folder_does_not_count_as_abandoned() {
        let place = tempfile::tempdir().unwrap();
        let is_over = AtomicBool::new(false);
        std::thread::scope(|scope| {
            scope.spawn(|| {
                while !is_over.load(Ordering::Relaxed) {
                    remove_abandoned(place.path());
                }
            });
            for _ in 0..2_000 {
                let folder = Folder::new(place.path()).unwrap();
                std::fs::write(folder.path.join("resource"), "text").unwrap();
                assert!(folder.path.join("resource").exists());
            }
            is_over.store(true, Ordering::Relaxed);
        });
    }

    #[test]
    fn an_abandoned_folder_is_removed() {
        let place = tempfile::tempdir().unwrap();
        let names = ["closecall-fmu-x.unpacked", "closecall-fmu-x.lock"].map(|name| place.path().join(name));
        std::fs::create_dir(&names[0]).unwrap();
        std::fs::write(&names[1], "").unwrap();
        remove_abandoned(place.path());
        assert!(names.iter().all(|path| !path.exists()));
    }
}
