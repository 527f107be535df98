//! A run as a file of the Rerun viewer, with a layout of its own.
//!
//! ```text
//!  steps, happenings ─▶ Film ─(outcome)─▶ road, vehicles, tracks │ plots │ log │ summary │ blueprint ─▶ F.rrd
//! ```
//!
//! [`RunRecorder`] watches a run and keeps what it sees. Only when the outcome is known is the file written, in one go
//! and in columns: small, fast, never half there, and opening at the moment that turned out to be the critical one.
//!
//! This folder is the only one that names the library.

mod blueprint;
mod bodies;
mod film;
mod log;
mod palette;
mod perceived;
mod plots;
mod road;
mod stream;
mod summary;
mod vehicles;

use std::io::Write as _;
use std::path::{Path, PathBuf};

use closecall_traffic::Time;
use rerun::sink::MemorySinkStorage;
use rerun::{MediaType, RecordingStreamBuilder, RecordingStreamError, TextDocument, ViewCoordinates};

use super::write::{WriteError, check_writable, write_atomically};
use crate::outcome::Outcome;
use crate::scenario::Scenario;
use crate::simulation::{Happening, Observer, StepView};
use film::{Film, Frame};
use stream::Writer;

/// The name under which the viewer keeps its layouts.
const APPLICATION: &str = "closecall";

/// How long after the critical moment the opening timeline ends: an impact and its mark are to be seen.
const AFTER_CRITICAL: Time = Time::from_ms(200);

/// A run that could not be recorded. There is no file, or the one that was there before.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The environment switches recording off, which would leave no file and say nothing.
    #[error("failed to record: the environment variable RERUN switches recording off; unset it")]
    Disabled,
    /// The library refused.
    #[error("failed to record: {0}")]
    Stream(#[from] RecordingStreamError),
    /// The messages could not be encoded.
    #[error("failed to encode the recording: {reason}")]
    Encode {
        /// The library's reason.
        reason: String,
    },
    /// The file could not be written.
    #[error(transparent)]
    Write(#[from] WriteError),
}

/// Watches a run and writes it as a recording.
pub struct RunRecorder {
    path: PathBuf,
    scenario: Scenario,
    title: String,
    frames: Vec<Frame>,
    happenings: Vec<(Time, Happening)>,
}

impl RunRecorder {
    /// A recorder of one run of `scenario` into the file `path`, called `title` in the viewer.
    ///
    /// # Errors
    /// [`RecordError`] where recording is switched off, or no file can be made at that place.
    pub fn new(path: &Path, scenario: &Scenario, title: &str) -> Result<Self, RecordError> {
        if !rerun::decide_logging_enabled(true) {
            return Err(RecordError::Disabled);
        }
        check_writable(path)?;
        Ok(Self {
            path: path.to_owned(),
            scenario: scenario.clone(),
            title: title.to_owned(),
            frames: Vec::new(),
            happenings: Vec::new(),
        })
    }

    /// Writes the file.
    ///
    /// # Errors
    /// [`RecordError`] where it cannot be written whole.
    pub fn finish(self, outcome: &Outcome) -> Result<(), RecordError> {
        let film = Film {
            scenario: &self.scenario,
            title: &self.title,
            frames: &self.frames,
            happenings: &self.happenings,
            outcome,
        };
        let bytes = encode(&film)?;
        write_atomically(&self.path, |file| file.write_all(&bytes))?;
        Ok(())
    }
}

impl Observer for RunRecorder {
    fn step(&mut self, view: &StepView<'_>) {
        self.frames.push(Frame::new(view));
    }

    fn happening(&mut self, time: Time, what: &Happening) {
        self.happenings.push((time, what.clone()));
    }
}

/// The whole recording as the bytes of a file.
fn encode(film: &Film<'_>) -> Result<Vec<u8>, RecordError> {
    record(film)?.drain_as_bytes().map_err(|error| RecordError::Encode { reason: error.to_string() })
}

fn record(film: &Film<'_>) -> Result<MemorySinkStorage, RecordError> {
    let (stream, messages) = RecordingStreamBuilder::new(APPLICATION).recording_name(film.title).memory()?;
    if !stream.is_enabled() {
        return Err(RecordError::Disabled);
    }
    let writer = Writer::new(&stream, film.critical_moment() + AFTER_CRITICAL);
    writer.fixed("world", &ViewCoordinates::FLU())?;
    road::write(&writer, film)?;
    vehicles::write(&writer, film)?;
    perceived::write(&writer, film)?;
    let has_margin = plots::write(&writer, film)?;
    log::write(&writer, film)?;
    let summary = TextDocument::new(summary::markdown(film)).with_media_type(MediaType::markdown());
    writer.fixed("summary", &summary)?;
    blueprint::Layout::default().send(&stream, has_margin)?;
    Ok(messages)
}

#[cfg(test)]
mod tests;
