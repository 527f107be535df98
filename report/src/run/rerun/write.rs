//! Writing films into a recording file.

use std::path::Path;

use closecall_traffic::Time;
use rerun::sink::MemorySinkStorage;
use rerun::{MediaType, RecordingStream, RecordingStreamBuilder, RecordingStreamError, TextDocument, ViewCoordinates};

use super::blueprint::{FilmContents, Layout};
use super::plots::Role;
use super::stream::Writer;
use super::{bird, camera, ghosts, log, perceived, plots, points, road, summary, truth, vehicles};
use crate::run::film::{Film, Level};
use closecall_scenarios::atomic::{WriteError, check_writable, write_file};

/// The application id, under which the viewer stores its layouts.
pub(super) const APPLICATION: &str = "closecall";

/// Time between the critical moment and the end of the opening timeline, so that an impact and its mark are visible.
const AFTER_CRITICAL: Time = Time::from_ms(200);

/// The reason why a recording cannot be written. A file of that name is then unchanged.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// The environment switches recording off. The library would then write no file and report no error.
    #[error("failed to record: the environment variable RERUN switches recording off; unset it")]
    Disabled,
    /// The library reports an error.
    #[error("failed to record: {0}")]
    Stream(#[from] RecordingStreamError),
    /// The messages cannot be encoded.
    #[error("failed to encode the recording: {reason}")]
    Encode {
        /// The reason that the library gives.
        reason: String,
    },
    /// The file cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
}

/// Checks whether a recording can be written, before the run starts.
///
/// # Errors
/// [`RecordingError`] if recording is switched off, or no file can be created at `path`.
pub fn check_recording_possible(path: &Path) -> Result<(), RecordingError> {
    if !rerun::decide_logging_enabled(true) {
        return Err(RecordingError::Disabled);
    }
    Ok(check_writable(path)?)
}

/// Writes one film, or a baseline and the film compared with it, into a recording file.
///
/// # Errors
/// [`RecordingError`] if the file cannot be written completely.
pub fn write_recording_unchecked(path: &Path, films: &[Film]) -> Result<(), RecordingError> {
    let bytes = encode(films)?;
    write_file(path, |file| file.write_all(&bytes))?;
    Ok(())
}

/// Writes films like [`write_recording_unchecked`], after [`check_recording_possible`].
///
/// # Errors
/// [`RecordingError`] if the file cannot be written completely.
pub fn write_recording(path: &Path, films: &[Film]) -> Result<(), RecordingError> {
    check_recording_possible(path)?;
    write_recording_unchecked(path, films)
}

/// Returns the bytes of the recording file.
fn encode(films: &[Film]) -> Result<Vec<u8>, RecordingError> {
    record(films)?.drain_as_bytes().map_err(|error| RecordingError::Encode { reason: error.to_string() })
}

/// Writes the films and the layout into memory.
fn record(films: &[Film]) -> Result<MemorySinkStorage, RecordingError> {
    let title = films.iter().map(Film::title).collect::<Vec<_>>().join(" and ");
    let (stream, messages) = RecordingStreamBuilder::new(APPLICATION).recording_name(title).memory()?;
    if !stream.is_enabled() {
        return Err(RecordingError::Disabled);
    }
    let opening_end = opening_moment(films) + AFTER_CRITICAL;
    let mut contents = Vec::new();
    for (index, film) in films.iter().enumerate() {
        let role = match (films.len(), index) {
            (1, _) => Role::Alone,
            (_, 0) => Role::Baseline,
            _ => Role::Tested,
        };
        let root = if role == Role::Alone { String::new() } else { format!("{}/", film.arm) };
        let writer = Writer::new(&stream, opening_end, &root, film.period);
        contents.push(write_film(&writer, film, (root, role))?);
        if let Some(ghosts) = ghosts_in(films, index).filter(|_| film.level >= Level::Objects) {
            ghosts::write(&writer, film, ghosts)?;
        }
    }
    write_summary(&stream, films)?;
    Layout::default().send(&stream, &contents)?;
    Ok(messages)
}

/// Returns the film whose vehicles appear as outlines in the film of this index.
///
/// The vehicles of the baseline appear in the tested film, but not the other way round. If one film is recorded traffic
/// and the other its re-enactment, the vehicles of each appear in the other.
fn ghosts_in(films: &[Film], index: usize) -> Option<&Film> {
    match (films, index) {
        (_, 1..) => films.first(),
        ([recorded, simulated], 0) if recorded.outcome.is_none() => Some(simulated),
        _ => None,
    }
}

/// Returns the moment at which the recording opens: the earliest of the films' worst collisions or, if there is none,
/// the critical moment of the last film. If the first film is recorded traffic, it is the later of the two critical
/// moments, so that both encounters are visible.
fn opening_moment(films: &[Film]) -> Time {
    let collisions = films.iter().filter_map(|film| film.worst_collision().map(|collision| collision.time));
    let critical = || match films {
        [recorded, _] if recorded.outcome.is_none() => films.iter().map(Film::critical_moment).max(),
        _ => films.last().map(Film::critical_moment),
    };
    collisions.min().or_else(critical).unwrap_or(Time::ZERO)
}

/// Writes a film and returns what its views can show.
fn write_film(writer: &Writer<'_>, film: &Film, (root, role): (String, Role)) -> Result<FilmContents, RecordingError> {
    let mut contents =
        FilmContents { name: film.arm.clone(), root, edges: bird::edges(film), ..FilmContents::default() };
    if film.level >= Level::Objects && !film.frames.is_empty() {
        writer.write_static("world", &ViewCoordinates::FLU())?;
        road::write(writer, film)?;
        vehicles::write(writer, film)?;
        perceived::write(writer, film)?;
        contents.hidden_layers.extend(truth::write(writer, film)?);
        contents.hidden_layers.extend(points::write(writer, film)?);
        bird::write(writer, film)?;
        contents.has_scene = true;
        contents.has_camera = camera::write(writer, film)?;
    }
    contents.plots = plots::write(writer, film, role)?;
    contents.has_states = film.frames.iter().any(|frame| frame.command.is_some());
    log::write(writer, film, role == Role::Alone)?;
    Ok(contents)
}

/// Writes the summary, which the story view shows.
fn write_summary(stream: &RecordingStream, films: &[Film]) -> Result<(), RecordingError> {
    let summary = TextDocument::new(summary::markdown(films)).with_media_type(MediaType::markdown());
    Ok(stream.log_static("summary", &summary)?)
}

#[cfg(test)]
mod tests;
