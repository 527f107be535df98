//! The way out of every reader: complete tracks, one after the other.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use closecall_traffic::Time;

use super::builder::Builder;
use super::dropped::Dropped;
use super::open::Digest;
use super::order::{WINDOW_ROWS, order_of};
use super::plausible;
use super::source::{About, Clock, Refusal, Row, RowSource};
use super::{LaneMarkings, Layout, RecordedTrack, Recording, RecordingError, RecordingProblem, ngsim};

/// Times from here on count from 1970, not from the recording's start: one day.
const EPOCH_TIMES_FROM: Time = Time::from_ms(86_400_000);

/// Recordings in one file whose times overlap are laid apart by this, so that their vehicles never meet.
const APART: Time = Time::from_ms(10_000);

/// How a recording is read.
#[derive(Clone, Copy, Debug, Default)]
pub struct ReadOptions {
    /// The layout, or the one that the content tells.
    pub layout: Option<LayoutChoice>,
    /// What happens to rows that cannot be used.
    pub bad_rows: BadRows,
}

/// A layout that is asked for by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LayoutChoice {
    /// NGSIM's columns.
    Ngsim,
    /// highD's or exiD's three files.
    Highd,
    /// CommonRoad XML.
    Commonroad,
    /// The plain layout.
    Csv,
    /// A log of one vehicle that sees the lane markings.
    InCar,
}

impl LayoutChoice {
    /// The name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Ngsim => "ngsim",
            Self::Highd => "highd",
            Self::Commonroad => "commonroad",
            Self::Csv => "csv",
            Self::InCar => "in-car",
        }
    }

    /// True where `layout` is one of those that are meant.
    pub fn includes(self, layout: Layout) -> bool {
        let of = match layout {
            Layout::Plain => Self::Csv,
            Layout::Ngsim18 | Layout::Ngsim25 => Self::Ngsim,
            Layout::Highd | Layout::Exid => Self::Highd,
            Layout::Commonroad => Self::Commonroad,
            Layout::InCar => Self::InCar,
        };
        of == self
    }
}

/// What happens to rows that cannot be used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BadRows {
    /// The first one ends the reading: nothing of such a recording is used.
    #[default]
    Refuse,
    /// They are left out and counted, with the reason and the first place.
    Drop,
}

/// The tracks of a recording, each as soon as it is complete.
pub struct Tracks<'a> {
    path: PathBuf,
    source: Box<dyn RowSource + 'a>,
    digest: Digest,
    bad_rows: BadRows,
    builder: Builder,
    period: Time,
    markings: LaneMarkings,
    dropped: Dropped,
    rows: u64,
    ended: bool,
}

impl<'a> Tracks<'a> {
    /// Reads the first `window` rows; all of them where the file is not longer.
    pub(super) fn new(
        (path, digest): (&Path, Digest),
        source: Box<dyn RowSource + 'a>,
        bad_rows: BadRows,
        window: usize,
    ) -> Result<Self, RecordingError> {
        let builder = Builder::of_sorted(ngsim::PERIOD, Time::ZERO);
        let mut tracks = Self {
            path: path.to_owned(),
            source,
            digest,
            bad_rows,
            builder,
            period: ngsim::PERIOD,
            markings: LaneMarkings::default(),
            dropped: Dropped::default(),
            rows: 0,
            ended: false,
        };
        tracks.begin(window).map_err(|refusal| tracks.with_path(refusal))?;
        Ok(tracks)
    }

    /// The recording's name: as the file states it, or else the file's name without its extension.
    pub fn name(&self) -> String {
        let file_name = self.path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        let stem = || file_name.split('.').next().unwrap_or_default().to_owned();
        self.source.about().name.unwrap_or_else(stem)
    }

    /// The layout.
    pub fn layout(&self) -> Layout {
        self.source.about().layout
    }

    /// Time between two frames.
    pub fn period(&self) -> Time {
        self.period
    }

    /// The lane markings: as the file states them, or else as the tracks among the first [`WINDOW_ROWS`] rows tell them.
    pub fn markings(&self) -> &LaneMarkings {
        &self.markings
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Rows that were read so far.
    pub fn rows(&self) -> u64 {
        self.rows
    }

    /// What was left out so far.
    pub fn dropped(&self) -> &Dropped {
        &self.dropped
    }

    /// The BLAKE3 hash of what was read so far, in hexadecimal digits: of the whole file after the last track.
    pub fn hash(&self) -> String {
        self.digest.hex()
    }

    /// The next complete track. After an error there are no more.
    ///
    /// # Errors
    /// [`RecordingError`] with file, line, column and what is allowed.
    pub fn next_track(&mut self) -> Result<Option<RecordedTrack>, RecordingError> {
        let next = self.advance();
        self.ended |= next.is_err();
        next.map_err(|refusal| self.with_path(refusal))
    }

    /// All tracks as one recording.
    ///
    /// # Errors
    /// As [`Tracks::next_track`].
    pub fn collect_recording(mut self) -> Result<Recording, RecordingError> {
        let mut trajectories = Vec::new();
        while let Some(track) = self.next_track()? {
            trajectories.push(track.trajectory);
        }
        let About { layout, markings, .. } = self.source.about();
        let mut recording = Recording::new(&self.name(), self.period, trajectories);
        if let Some(markings) = markings {
            recording.markings = markings;
        }
        Ok(Recording { layout, hash: self.hash(), ..recording })
    }

    fn advance(&mut self) -> Result<Option<RecordedTrack>, Refusal> {
        loop {
            if let Some(track) = self.builder.pop() {
                return Ok(Some(track));
            }
            if self.ended {
                return Ok(None);
            }
            match self.next_row()? {
                Some(row) => self.push(row)?,
                None => {
                    self.ended = true;
                    self.builder.finish()?;
                }
            }
        }
    }

    /// The next row that can be used.
    fn next_row(&mut self) -> Result<Option<Row>, Refusal> {
        loop {
            match self.source.next_row() {
                Ok(Some(row)) => {
                    self.rows += 1;
                    return Ok(Some(row));
                }
                Ok(None) => return Ok(None),
                Err(refusal) => {
                    self.rows += 1;
                    self.drop_row(refusal)?;
                }
            }
        }
    }

    fn push(&mut self, row: Row) -> Result<(), Refusal> {
        self.builder.push(row).or_else(|refusal| self.drop_row(refusal))
    }

    /// Leaves a row out where that is asked for, and the rest of the file can still be used.
    fn drop_row(&mut self, refusal: Refusal) -> Result<(), Refusal> {
        if self.bad_rows == BadRows::Refuse || !refusal.is_of_row() {
            return Err(refusal);
        }
        self.dropped.add(refusal);
        Ok(())
    }

    fn begin(&mut self, window: usize) -> Result<(), Refusal> {
        let mut rows = Vec::new();
        while rows.len() < window {
            match self.next_row()? {
                Some(row) => rows.push(row),
                None => {
                    self.ended = true;
                    break;
                }
            }
        }
        if rows.is_empty() {
            return Err(self.dropped.take_first().unwrap_or(Refusal::of_file(RecordingProblem::Empty)));
        }
        let beginning = &rows[..rows.len().min(WINDOW_ROWS)];
        self.period = self.source.about().period.unwrap_or_else(|| period(beginning));
        let start = start(beginning);
        plausible::check(beginning, self.source.about().layout)?;
        if self.ended {
            lay_apart(&mut rows);
            rows.sort_by_key(|row| (row.number, row.origin, row.time, row.frame, row.line));
            self.builder = Builder::of_sorted(self.period, start);
        } else {
            self.builder = Builder::of_stream(self.period, start, order_of(&rows, self.period)?);
        }
        rows.into_iter().try_for_each(|row| self.push(row))?;
        if self.ended {
            self.builder.finish()?;
        }
        let told = || LaneMarkings::of_tracks(self.builder.ready().map(|track| &track.trajectory));
        self.markings = self.source.about().markings.unwrap_or_else(told);
        Ok(())
    }

    fn with_path(&self, Refusal { line, column, problem }: Refusal) -> RecordingError {
        RecordingError { path: self.path.clone(), line, column, problem }
    }
}

impl Iterator for Tracks<'_> {
    type Item = Result<RecordedTrack, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        self.next_track().transpose()
    }
}

/// The rows of one vehicle in short.
struct Extent {
    rows: usize,
    first: (Time, i64),
    last: (Time, i64),
}

/// The mean step of the vehicle with the most rows; NGSIM's, where no vehicle has two frames.
fn period(rows: &[Row]) -> Time {
    let mut extents: BTreeMap<(u64, Time), Extent> = BTreeMap::new();
    for row in rows {
        let at = (row.time, row.frame);
        let extent = extents.entry((row.number, row.origin)).or_insert(Extent { rows: 0, first: at, last: at });
        extent.rows += 1;
        extent.first = extent.first.min(at);
        extent.last = extent.last.max(at);
    }
    let longest = extents.values().rev().max_by_key(|extent| extent.rows);
    let Some(Extent { first, last, .. }) = longest else { return ngsim::PERIOD };
    let frames = last.1 - first.1;
    let step_ns = if frames > 0 { (last.0 - first.0).ns() / frames } else { 0 };
    let may_restart = rows.first().is_some_and(|row| row.clock == Clock::MayRestart);
    if may_restart || step_ns <= 0 { ngsim::PERIOD } else { Time::from_ns(step_ns) }
}

/// What is taken off all times.
fn start(rows: &[Row]) -> Time {
    let earliest = rows.iter().map(|row| row.time).min();
    earliest.filter(|time| *time >= EPOCH_TIMES_FROM).unwrap_or(Time::ZERO)
}

/// Shifts recordings of different origin to later times, so that none overlaps the one before.
fn lay_apart(rows: &mut [Row]) {
    let mut spans: BTreeMap<Time, (Time, Time)> = BTreeMap::new();
    for row in &*rows {
        let span = spans.entry(row.origin).or_insert((row.time, row.time));
        *span = (span.0.min(row.time), span.1.max(row.time));
    }
    if spans.len() < 2 {
        return;
    }
    let mut shifts = BTreeMap::new();
    let mut free_from = None;
    for (origin, (first, last)) in spans {
        let shift = free_from.map_or(Time::ZERO, |from: Time| (from - first).max(Time::ZERO));
        free_from = Some(last + shift + APART);
        shifts.insert(origin, shift);
    }
    for row in rows {
        row.time += shifts.get(&row.origin).copied().unwrap_or_default();
    }
}
