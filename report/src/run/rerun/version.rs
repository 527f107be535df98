//! The version of Rerun that a recording was written by, and the version of the viewer that shows
//! it.

use std::fmt;
use std::io::{self, Read};
use std::path::Path;

use closecall_traffic::input;

use super::parts::{Decodable, StreamHeader};

/// A version of Rerun.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RerunVersion {
    /// The major number.
    pub major: u8,
    /// The minor number. While the major number is 0, the format of recordings may change with it.
    pub minor: u8,
    /// The number of the patch.
    pub patch: u8,
}

/// The reason why a file has no version.
#[derive(Debug, thiserror::Error)]
pub enum VersionError {
    /// The file cannot be read.
    #[error(transparent)]
    Read(#[from] io::Error),
    /// The file is no recording, or its Rerun is too old.
    #[error("{reason}")]
    Foreign {
        /// The reason that the library gives.
        reason: String,
    },
}

impl RerunVersion {
    /// Returns the first version in a text, such as 0.36.3 in `rerun-cli 0.36.3 (…)`.
    pub fn first_in(text: &str) -> Option<Self> {
        text.split_whitespace().find_map(|word| {
            let mut parts = word.splitn(3, '.');
            let [major, minor] = [parts.next()?.parse().ok()?, parts.next()?.parse().ok()?];
            // What follows the digits names a pre-release.
            let patch = parts.next()?.split(|letter: char| !letter.is_ascii_digit()).next()?.parse().ok()?;
            Some(Self { major, minor, patch })
        })
    }

    /// Reads the version of a recording (.rrd).
    ///
    /// # Errors
    /// [`VersionError`] if the file cannot be read, or is no recording.
    pub fn of_recording(path: &Path) -> Result<Self, VersionError> {
        let mut start = Vec::new();
        input::open(path)?.take(StreamHeader::ENCODED_SIZE_BYTES as u64).read_to_end(&mut start)?;
        let header = StreamHeader::from_rrd_bytes(&start)
            .map_err(|error| VersionError::Foreign { reason: error.to_string() })?;
        let [major, minor, patch, _] = header.version;
        Ok(Self { major, minor, patch })
    }

    /// Returns true if a viewer of the version `viewer` is made for recordings of this version.
    pub fn fits(self, viewer: Self) -> bool {
        (self.major, self.minor) == (viewer.major, viewer.minor)
    }
}

impl fmt::Display for RerunVersion {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}.{}.{}", self.major, self.minor, self.patch)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_version_of_a_viewer_is_the_first_in_its_text() {
        let version = |text| RerunVersion::first_in(text).map(|version| version.to_string());
        assert_eq!(version("rerun-cli 0.36.3 (base lance) [rustc 1.95.0 (59807616e 2026-04-14)]").unwrap(), "0.36.3");
        assert_eq!(version("rerun-cli 0.37.0-alpha.1+dev (native_viewer)").unwrap(), "0.37.0");
        for none in ["", "rerun", "1.2", "v0.36.3", "0.36.x", "-1.2.3", "0.999.0"] {
            assert_eq!(version(none), None, "{none}");
        }
    }

    #[test]
    fn versions_fit_if_only_the_patch_differs() {
        let recording = RerunVersion { major: 0, minor: 36, patch: 3 };
        assert!(recording.fits(RerunVersion { patch: 0, ..recording }));
        assert!(!recording.fits(RerunVersion { minor: 35, ..recording }));
        assert!(!recording.fits(RerunVersion { major: 1, ..recording }));
    }

    #[test]
    fn a_file_with_another_start_is_no_recording() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a.rrd");
        assert!(matches!(RerunVersion::of_recording(&file), Err(VersionError::Read(_))));
        for text in [&b""[..], b"RRF2", b"RRF1\0\x24\x03\0\x01\x02\0\0", b"version https://git-lfs"] {
            std::fs::write(&file, text).unwrap();
            assert!(matches!(RerunVersion::of_recording(&file), Err(VersionError::Foreign { .. })), "{text:?}");
        }
        std::fs::write(&file, b"RRF2\0\x24\x03\0\x01\x02\0\0").unwrap();
        assert_eq!(RerunVersion::of_recording(&file).unwrap().to_string(), "0.36.3");
    }
}
