//! The folder of a campaign that samples a rare event: a manifest, a journal of the responses, and
//! the result.
//!
//! ```text
//!  rare-manifest.json   how the campaign was made
//!  rare-journal.jsonl   one line per run, in the order in which the method asked for it; each with a checksum
//!  rare.json            the result, as it is printed for programs
//!  lock                 locked while the campaign runs
//! ```
//!
//! The files have names of their own, so that no command takes the weighted runs for the
//! independent samples of a plain campaign.

use std::fs::{self, OpenOptions};
use std::io::{BufRead, BufReader, Seek as _, SeekFrom, Write as _};
use std::path::{Path, PathBuf};

use closecall_traffic::atomic::{WriteError, create_folder, is_temporary, write_file};
use closecall_traffic::input;
use serde::{Deserialize, Serialize};

use super::error::RareError;
use super::files::{JOURNAL, MANIFEST, RESULT};
use super::method::Method;
use super::problem::{Point, Response};
use crate::folder::FolderError;
use crate::gate::Course;
use crate::journal::{line, parse, read_line};
use crate::lock::Lock;
use crate::manifest::Manifest;
use crate::record::SampleFailure;
use crate::sampling::Sampling;

/// A point in the journal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct KeptPoint {
    normals: Vec<f64>,
    noise: u64,
}

impl From<&Point> for KeptPoint {
    fn from(point: &Point) -> Self {
        Self { normals: point.normals.clone(), noise: point.noise }
    }
}

/// A response in the journal. A score that is not finite is absent.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct KeptResponse {
    score: Option<f64>,
    events: [bool; 2],
}

impl From<Response> for KeptResponse {
    fn from(response: Response) -> Self {
        Self { score: Some(response.score).filter(|score| score.is_finite()), events: response.events }
    }
}

impl From<KeptResponse> for Response {
    fn from(kept: KeptResponse) -> Self {
        Self { score: kept.score.unwrap_or(f64::NEG_INFINITY), events: kept.events }
    }
}

/// One line of the journal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct RareRecord {
    pub(super) scenario: String,
    pub(super) run: u64,
    pub(super) point: KeptPoint,
    pub(super) response: KeptResponse,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) failure: Option<SampleFailure>,
    /// What the run shows of a scenario that states what must happen in it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) course: Option<Course>,
}

/// Everything that determines the result.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RareManifest {
    /// The method.
    pub method: Method,
    /// The event.
    pub event: String,
    /// The number that leads to it, if one was named.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub guide: Option<String>,
    /// Width of the 95 % interval that was asked for, relative to the estimate.
    pub relative_width: f64,
    /// Largest number of runs of each scenario.
    pub budget: u64,
    /// The scenarios, controllers and sensors.
    pub campaign: Manifest,
}

impl RareManifest {
    fn differences(&self, other: &Self) -> Vec<String> {
        // The budget is compared below.
        let sampling = Sampling { samples: other.campaign.sampling.samples, ..self.campaign.sampling };
        let campaign = Manifest { sampling, ..self.campaign.clone() };
        let mut differences = campaign.differences(&other.campaign);
        let mut compare = |name: &str, there: String, here: String| {
            if there != here {
                differences.push(format!("{name}: {there} there, {here} here"));
            }
        };
        let guide = |manifest: &Self| manifest.guide.clone().unwrap_or_else(|| "none".to_owned());
        compare("method", self.method.to_string(), other.method.to_string());
        compare("event", self.event.clone(), other.event.clone());
        compare("guide", guide(self), guide(other));
        compare("relative width", self.relative_width.to_string(), other.relative_width.to_string());
        if other.budget < self.budget {
            compare("budget", self.budget.to_string(), other.budget.to_string());
        }
        differences
    }

    /// Returns the manifest of the whole campaign. This one may describe a part of it.
    pub(super) fn whole(&self) -> Self {
        Self { campaign: self.campaign.whole(), ..self.clone() }
    }

    /// Returns one message for each difference from another manifest, also if its budget is larger.
    pub(super) fn all_differences(&self, other: &Self) -> Vec<String> {
        let mut differences = self.differences(other);
        if other.budget > self.budget {
            differences.push(format!("budget: {} there, {} here", self.budget, other.budget));
        }
        differences
    }

    /// Reads the manifest of a folder; `None` if there is none that can be read.
    pub fn read(folder: &Path) -> Option<Self> {
        serde_json::from_str(&input::read_text(&folder.join(MANIFEST)).ok()?).ok()
    }
}

/// The folder of a campaign that samples a rare event, locked.
#[derive(Debug)]
pub struct RareFolder {
    path: PathBuf,
    /// Whether the journal was written with a smaller budget.
    has_grown: bool,
    _lock: Lock,
}

impl RareFolder {
    /// Locks a folder: a new or empty one, or with `resume` the one of the same campaign, whose
    /// budget may grow.
    ///
    /// # Errors
    /// [`FolderError`] if the folder cannot be used.
    pub fn lock(path: &Path, manifest: &RareManifest, resume: bool) -> Result<Self, FolderError> {
        create_folder(path)?;
        let read = |source| FolderError::Read { path: path.to_owned(), source };
        let mut is_new = true;
        for entry in fs::read_dir(path).map_err(read)? {
            let name = entry.map_err(read)?.file_name();
            is_new &= Lock::is_file_name(&name) || is_temporary(&name);
        }
        let file = path.join(MANIFEST);
        if !is_new && !file.exists() {
            return Err(FolderError::NotACampaign { path: path.to_owned() });
        }
        let lock = Lock::acquire(path)?;
        let (mut has_grown, mut has_drawn_seed) = (false, manifest.campaign.has_drawn_seed);
        if !is_new {
            let fail = |message: String| FolderError::Content { path: file.clone(), line: 1, message };
            let text = input::read_text(&file)
                .map_err(|source| FolderError::Read { path: file.clone(), source: std::io::Error::other(source) })?;
            let there: RareManifest = serde_json::from_str(&text).map_err(|error| fail(error.to_string()))?;
            let differences = there.differences(manifest);
            if !differences.is_empty() {
                return Err(FolderError::OtherCampaign { path: path.to_owned(), differences });
            }
            if !resume {
                return Err(FolderError::AlreadyThere { path: path.to_owned() });
            }
            has_grown = manifest.budget > there.budget;
            // A seed that was known when the campaign began was known to all its runs.
            has_drawn_seed &= there.campaign.has_drawn_seed;
        }
        if is_new || has_grown {
            let campaign = Manifest { has_drawn_seed, ..manifest.campaign.clone() };
            let written = RareManifest { campaign, ..manifest.clone() };
            write_file(&file, |out| {
                serde_json::to_writer_pretty(&mut *out, &written)?;
                out.write_all(b"\n")
            })?;
        }
        Ok(Self { path: path.to_owned(), has_grown, _lock: lock })
    }

    /// Opens the journal: its intact lines are read, and the rest is cut off.
    ///
    /// # Errors
    /// [`FolderError`] if it cannot be read or written.
    pub fn journal(&self) -> Result<RareJournal, FolderError> {
        let path = self.path.join(JOURNAL);
        let fail = |source| FolderError::from(WriteError::new(&path, source));
        let mut options = OpenOptions::new();
        options.create(true).read(true).write(true).truncate(false);
        let file = input::open_in_folder(&path, &mut options).map_err(fail)?;
        let (records, end) = kept_lines(&mut BufReader::new(&file)).map_err(fail)?;
        file.set_len(end).map_err(fail)?;
        let mut file = file;
        file.seek(SeekFrom::Start(end)).map_err(fail)?;
        Ok(RareJournal { path, file: Some(file), kept: records.into_iter(), line: 0, may_differ: self.has_grown })
    }

    /// Writes the whole journal.
    ///
    /// # Errors
    /// [`WriteError`] if it cannot be written.
    pub(super) fn write_journal(&self, records: &[RareRecord]) -> Result<(), WriteError> {
        write_file(&self.path.join(JOURNAL), |out| records.iter().try_for_each(|record| out.write_all(&line(record)?)))
    }

    /// Writes the result.
    ///
    /// # Errors
    /// [`WriteError`] if it cannot be written.
    pub fn write(&self, result: &serde_json::Value) -> Result<PathBuf, WriteError> {
        let path = self.path.join(RESULT);
        write_file(&path, |out| {
            serde_json::to_writer_pretty(&mut *out, result)?;
            out.write_all(b"\n")
        })?;
        Ok(path)
    }
}

/// Reads the intact lines of a journal. Returns their length, too (bytes).
fn kept_lines(reader: &mut impl BufRead) -> std::io::Result<(Vec<KeptLine>, u64)> {
    let (mut lines, mut end, mut buffer) = (Vec::new(), 0, Vec::new());
    loop {
        let read = read_line(reader, &mut buffer)?;
        let Some(record) = Some(read).filter(|read| *read > 0).and_then(|_| parse(&buffer).ok()) else { break };
        lines.push(KeptLine { record, start: end });
        end += read;
    }
    Ok((lines, end))
}

/// Reads the intact lines of the journal in a folder.
///
/// # Errors
/// [`FolderError::Read`] if it cannot be read.
pub(super) fn read_records(folder: &Path) -> Result<Vec<RareRecord>, FolderError> {
    let path = folder.join(JOURNAL);
    let read = || kept_lines(&mut BufReader::new(input::open(&path)?));
    let (lines, _) = read().map_err(|source| FolderError::Read { path: path.clone(), source })?;
    Ok(lines.into_iter().map(|line| line.record).collect())
}

/// A line of the journal.
#[derive(Debug)]
struct KeptLine {
    record: RareRecord,
    /// The offset of the line in the file (bytes).
    start: u64,
}

/// The journal of a campaign: what it holds, then what is appended.
#[derive(Debug)]
pub struct RareJournal {
    path: PathBuf,
    /// The file to which lines are appended; `None` of a closed journal.
    file: Option<fs::File>,
    kept: std::vec::IntoIter<KeptLine>,
    line: usize,
    /// Whether the journal may hold other points, because the budget has grown.
    may_differ: bool,
}

impl RareJournal {
    /// Returns a closed journal, which holds these lines and takes no others. `path` appears in
    /// messages only.
    pub(super) fn closed(path: &Path, records: Vec<RareRecord>) -> Self {
        let kept: Vec<KeptLine> = records.into_iter().map(|record| KeptLine { record, start: 0 }).collect();
        Self { path: path.to_owned(), file: None, kept: kept.into_iter(), line: 0, may_differ: false }
    }

    /// Returns true if the journal takes no further lines.
    pub(super) const fn is_closed(&self) -> bool {
        self.file.is_none()
    }

    /// Returns the next line, if one is left.
    pub(super) fn rest(&self) -> Option<&RareRecord> {
        self.kept.as_slice().first().map(|line| &line.record)
    }

    /// Returns the next line, if there is one.
    ///
    /// # Errors
    /// [`FolderError::Content`] if it is of another point.
    pub(super) fn next(&mut self, scenario: &str, run: u64, point: &Point) -> Result<Option<RareRecord>, RareError> {
        let Some(KeptLine { record, start }) = self.kept.next() else { return Ok(None) };
        self.line += 1;
        let is_same = record.scenario == scenario && record.run == run && record.point == KeptPoint::from(point);
        if is_same {
            return Ok(Some(record));
        }
        if let Some(file) = self.file.as_mut().filter(|_| self.may_differ) {
            // A search that the smaller budget has cut short goes on here.
            self.kept = Vec::new().into_iter();
            let cut = file.set_len(start).and_then(|()| file.seek(SeekFrom::Start(start)));
            cut.map_err(|source| FolderError::from(WriteError::new(&self.path, source)))?;
            return Ok(None);
        }
        let message = format!("run {run} of `{scenario}` is not the point that the seed leads to");
        Err(FolderError::Content { path: self.path.clone(), line: self.line, message }.into())
    }

    /// Appends a line.
    ///
    /// # Errors
    /// [`WriteError`] if it cannot be written completely.
    pub(super) fn append(&mut self, record: &RareRecord) -> Result<(), WriteError> {
        let fail = |source| WriteError::new(&self.path, source);
        let line = line(record).map_err(fail)?;
        match self.file.as_mut() {
            Some(file) => file.write_all(&line).map_err(fail),
            None => Ok(()),
        }
    }

    /// Synchronises the journal to the disk.
    ///
    /// # Errors
    /// [`WriteError`] if the operating system reports a failure.
    pub fn sync(&self) -> Result<(), WriteError> {
        self.file.as_ref().map_or(Ok(()), fs::File::sync_data).map_err(|source| WriteError::new(&self.path, source))
    }
}
