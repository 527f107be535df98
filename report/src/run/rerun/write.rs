//! Films written into one file, in one go.

use std::path::Path;

use closecall_traffic::Time;
use rerun::sink::MemorySinkStorage;
use rerun::{MediaType, RecordingStream, RecordingStreamBuilder, RecordingStreamError, TextDocument, ViewCoordinates};

use super::blueprint::{Layout, Shown};
use super::plots::Role;
use super::stream::Writer;
use super::{bird, camera, ghosts, log, perceived, plots, points, road, summary, truth, vehicles};
use crate::run::film::{Film, Level};
use closecall_scenarios::atomic::{WriteError, check_writable, write_file};

/// The name under which the viewer keeps its layouts.
pub(super) const APPLICATION: &str = "closecall";

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

/// Finds out before any work is done whether a recording can be written.
///
/// # Errors
/// [`RecordError`] where recording is switched off, or no file can be made at that place.
pub fn check_recordable(path: &Path) -> Result<(), RecordError> {
    if !rerun::decide_logging_enabled(true) {
        return Err(RecordError::Disabled);
    }
    Ok(check_writable(path)?)
}

/// Writes one film, or a baseline and the film that is compared with it, into a file.
///
/// # Errors
/// [`RecordError`] where it cannot be written whole.
pub fn write_films(path: &Path, films: &[Film]) -> Result<(), RecordError> {
    let bytes = encode(films)?;
    write_file(path, |file| file.write_all(&bytes))?;
    Ok(())
}

/// Writes films into a file, unless recording is switched off.
///
/// # Errors
/// [`RecordError`] where it cannot be written whole.
pub fn record_films(path: &Path, films: &[Film]) -> Result<(), RecordError> {
    check_recordable(path)?;
    write_films(path, films)
}

/// The whole recording as the bytes of a file.
fn encode(films: &[Film]) -> Result<Vec<u8>, RecordError> {
    record(films)?.drain_as_bytes().map_err(|error| RecordError::Encode { reason: error.to_string() })
}

fn record(films: &[Film]) -> Result<MemorySinkStorage, RecordError> {
    let title = films.iter().map(Film::title).collect::<Vec<_>>().join(" and ");
    let (stream, messages) = RecordingStreamBuilder::new(APPLICATION).recording_name(title).memory()?;
    if !stream.is_enabled() {
        return Err(RecordError::Disabled);
    }
    let opening = opening(films) + AFTER_CRITICAL;
    let mut shown = Vec::new();
    for (place, film) in films.iter().enumerate() {
        let role = match (films.len(), place) {
            (1, _) => Role::Alone,
            (_, 0) => Role::Baseline,
            _ => Role::Tested,
        };
        let root = if role == Role::Alone { String::new() } else { format!("{}/", film.arm) };
        let writer = Writer::new(&stream, opening, &root, film.period);
        shown.push(write_film(&writer, film, (root, role))?);
        if let Some(ghosts) = ghosts_in(films, place).filter(|_| film.level >= Level::Objects) {
            ghosts::write(&writer, film, ghosts)?;
        }
    }
    write_summary(&stream, films)?;
    Layout::default().send(&stream, &shown)?;
    Ok(messages)
}

/// The film whose vehicles stand as outlines in another: the baseline's in those that are tested; of recorded traffic and
/// a run, neither of which is the baseline, each one's in the other.
fn ghosts_in(films: &[Film], place: usize) -> Option<&Film> {
    match (films, place) {
        (_, 1..) => films.first(),
        ([recorded, simulated], 0) if recorded.outcome.is_none() => Some(simulated),
        _ => None,
    }
}

/// The moment to open at: the first collision of any film, else what is critical in the last one; beside recorded
/// traffic, the later of the two, when both encounters have been seen.
fn opening(films: &[Film]) -> Time {
    let collisions = films.iter().filter_map(|film| film.worst_collision().map(|collision| collision.time));
    let critical = || match films {
        [recorded, _] if recorded.outcome.is_none() => films.iter().map(Film::critical_moment).max(),
        _ => films.last().map(Film::critical_moment),
    };
    collisions.min().or_else(critical).unwrap_or(Time::ZERO)
}

fn write_film(writer: &Writer<'_>, film: &Film, (root, role): (String, Role)) -> Result<Shown, RecordError> {
    let mut shown = Shown { name: film.arm.clone(), root, edges: bird::edges(film), ..Shown::default() };
    if film.level >= Level::Objects && !film.frames.is_empty() {
        writer.fixed("world", &ViewCoordinates::FLU())?;
        road::write(writer, film)?;
        vehicles::write(writer, film)?;
        perceived::write(writer, film)?;
        shown.hidden.extend(truth::write(writer, film)?);
        shown.hidden.extend(points::write(writer, film)?);
        bird::write(writer, film)?;
        shown.has_scene = true;
        shown.has_camera = camera::write(writer, film)?;
    }
    shown.plots = plots::write(writer, film, role)?;
    shown.has_states = film.frames.iter().any(|frame| frame.command.is_some());
    log::write(writer, film, role == Role::Alone)?;
    Ok(shown)
}

fn write_summary(stream: &RecordingStream, films: &[Film]) -> Result<(), RecordError> {
    let summary = TextDocument::new(summary::markdown(films)).with_media_type(MediaType::markdown());
    Ok(stream.log_static("summary", &summary)?)
}
