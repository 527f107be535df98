//! Recorded scans of LiDARs, with the poses of the ego and the labels of other vehicles.
//!
//! ```text
//!  folder of *.pcd, scans.csv ─┐
//!  *.parquet ──────────────────┼─▶ scans, one after the other ─┐
//!  *.mcap (PointCloud2) ───────┘                               ├─▶ the processing chain
//!  poses.csv, or Odometry of the MCAP file ─▶ poses ───────────┘
//!  labels.csv ─▶ labels ─▶ errors of its tracks
//! ```
//!
//! `docs/reference/output.md` has the layouts. A run writes them, too, with all that the chain
//! needs to give the same bits again.

mod bag;
mod cdr;
mod cloud;
mod error;
mod labels;
mod lzf;
mod options;
mod pcd;
mod poses;
mod table;
mod text_table;

use std::path::{Path, PathBuf};

use closecall_traffic::{Time, input};

pub use error::{Origin, ScanFileError, ScanFileProblem};
pub use labels::{Label, Labels};
pub use options::{ScanOptions, TakenScan};
pub use pcd::INDEX;
pub use poses::{Pose, Poses};

use bag::BagRecording;
use pcd::PcdRecording;
use table::TableRecording;

enum Source {
    Folder(PcdRecording),
    Table(Box<TableRecording>),
    Bag(Box<BagRecording>),
}

/// A recording that is read scan by scan.
pub struct Recording {
    path: PathBuf,
    options: ScanOptions,
    source: Source,
    /// Time of the latest scan of each LiDAR.
    latest: Vec<Option<Time>>,
}

impl Recording {
    /// Opens a recording.
    ///
    /// # Errors
    /// [`ScanFileError`] if it cannot be read, or is none.
    pub fn open(path: &Path, options: ScanOptions) -> Result<Self, ScanFileError> {
        let origin = Origin::file(path);
        let metadata = std::fs::metadata(path).map_err(|error| origin.error(input::named(path, error)))?;
        let end = path.extension().and_then(|end| end.to_str()).map(str::to_ascii_lowercase);
        let source = match end.as_deref() {
            _ if metadata.is_dir() => Source::Folder(PcdRecording::open(path, &options)?),
            Some("parquet") => Source::Table(Box::new(TableRecording::open(path)?)),
            Some("mcap") => Source::Bag(Box::new(BagRecording::open(path, &options)?)),
            _ => return Err(origin.error(ScanFileProblem::Kind)),
        };
        let latest = vec![None; options.lidars.len()];
        Ok(Self { path: path.to_owned(), options, source, latest })
    }

    /// Returns the error of the whole recording.
    pub fn error(&self, problem: ScanFileProblem) -> ScanFileError {
        Origin::file(&self.path).error(problem)
    }

    /// Returns the path of the file that goes with the recording: `poses` or `labels`.
    pub fn companion(&self, name: &str) -> PathBuf {
        companion(&self.path, name)
    }

    /// Returns the poses of the recording: from the file `poses` if it is given, else from the
    /// MCAP file, else of the file that goes with the recording.
    ///
    /// # Errors
    /// [`ScanFileError`] if there are none.
    pub fn poses(&mut self, file: Option<&Path>) -> Result<Poses, ScanFileError> {
        match (file, &mut self.source) {
            (Some(file), _) => Poses::read(file),
            (None, Source::Bag(bag)) => match bag.take_poses() {
                Some(poses) => Ok(poses),
                None => Poses::read(&self.companion("poses")),
            },
            (None, _) => Poses::read(&self.companion("poses")),
        }
    }

    /// Returns the next scan of a LiDAR that looks back; `None` behind the last.
    ///
    /// # Errors
    /// [`ScanFileError`] if it cannot be read, or does not end after the previous scan of its
    /// LiDAR.
    pub fn next_scan(&mut self) -> Result<Option<TakenScan>, ScanFileError> {
        let scan = match &mut self.source {
            Source::Folder(folder) => folder.next_scan(&self.options)?,
            Source::Table(table) => table.next_scan(&self.options)?,
            Source::Bag(bag) => bag.next_scan(&self.options)?,
        };
        let Some(scan) = scan else { return Ok(None) };
        let (name, end) = (self.options.lidars[scan.sensor], scan.points.end);
        if let Some(previous) = self.latest[scan.sensor].replace(end).filter(|previous| *previous >= end) {
            let (time_s, previous_s) = (end.s(), previous.s());
            let of = format!(" of `{name}`");
            return Err(scan.origin.error(ScanFileProblem::TimeGoesBack { time_s, previous_s, of }));
        }
        Ok(Some(scan))
    }
}

/// Returns the path of the file that goes with a recording, such as its poses: in a folder
/// `poses.csv`, beside a file `scans.parquet` `scans.poses.csv`.
pub fn companion(recording: &Path, name: &str) -> PathBuf {
    match recording.extension().and_then(|end| end.to_str()) {
        Some("parquet" | "mcap") => recording.with_extension(format!("{name}.csv")),
        _ => recording.join(format!("{name}.csv")),
    }
}
