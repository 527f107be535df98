//! Writing films into a recording file.

use std::path::Path;

use closecall_traffic::Time;
use rerun::{MediaType, TextDocument, ViewCoordinates};

use super::blueprint::{self, FilmContents};
use super::error::RecordingError;
use super::parts::EncodeError;
use super::plots::Role;
use super::recording::{self, Recording};
use super::stream::Writer;
use super::{
    bird, camera, collisions, fog, ghosts, log, palette, perceived, plots, points, properties, radars, road, summary,
    truth, vehicles,
};
use crate::run::film::{Film, Level};
use closecall_traffic::atomic::{WriteError, check_writable, write_atomically};

/// Returns false if the environment (`RERUN=off`) switches recordings off.
pub fn is_recording_enabled() -> bool {
    rerun::decide_logging_enabled(true)
}

/// Checks whether a recording can be written, before the run starts.
///
/// # Errors
/// [`RecordingError`] if recording is switched off, or no file can be created at `path`.
pub fn check_recording_possible(path: &Path) -> Result<(), RecordingError> {
    if !is_recording_enabled() {
        return Err(RecordingError::Disabled);
    }
    Ok(check_writable(path)?)
}

/// Writes one film, or a baseline and the film compared with it, into a recording file.
///
/// # Errors
/// [`RecordingError`] if the file cannot be written completely.
pub fn write_recording_unchecked(path: &Path, films: &[Film]) -> Result<(), RecordingError> {
    write(path, record(films)?)
}

/// Writes films like [`write_recording`], and drops them before the recording is encoded. Films and
/// encoded recording are never in memory together.
///
/// # Errors
/// [`RecordingError`] if the file cannot be written completely.
pub(crate) fn write_recording_of(path: &Path, films: Vec<Film>) -> Result<(), RecordingError> {
    check_recording_possible(path)?;
    let recording = record(&films)?;
    drop(films);
    write(path, recording)
}

fn write(path: &Path, recording: Recording) -> Result<(), RecordingError> {
    recording.complete()?;
    write_atomically(path, |file| recording.encode(file)).map_err(|error| match error {
        EncodeError::Write(source) => WriteError::new(path, source).into(),
        other => RecordingError::encode(other),
    })
}

/// Writes films like [`write_recording_unchecked`], after [`check_recording_possible`].
///
/// # Errors
/// [`RecordingError`] if the file cannot be written completely.
pub fn write_recording(path: &Path, films: &[Film]) -> Result<(), RecordingError> {
    check_recording_possible(path)?;
    write_recording_unchecked(path, films)
}

/// Returns the recording of the films, with its layout.
fn record(films: &[Film]) -> Result<Recording, RecordingError> {
    let level = films.iter().map(|film| format!("{:?} {}", film.level, film.frames.len())).collect();
    let version = env!("CARGO_PKG_VERSION").to_owned();
    let (verdict, story) = (summary::verdict(films), summary::story(films));
    let name = recording::name(&[version, level, verdict.clone(), story.clone()]);
    let recording = Recording::new(application(films), &name)?;
    let span = Film::span(films);
    let canvases = bird::Canvas::of_films(films);
    let shown = Film::shown_moment(films);
    let mut contents = Vec::new();
    for (index, film) in films.iter().enumerate() {
        let role = match (films.len(), index) {
            (1, _) => Role::Alone,
            (_, 0) => Role::Baseline,
            _ => Role::Tested,
        };
        let root = format!("{}/", film.arm);
        let writer = Writer::new(&recording, film, &root, films.len() == 1, span, shown);
        contents.push(write_film(&writer, &canvases[index], root, role)?);
        if let Some(ghosts) = ghosts_in(films, index).filter(|_| film.level >= Level::Objects) {
            ghosts::write(&writer, &canvases[index], ghosts)?;
        }
    }
    write_texts(&recording, [("verdict", &verdict), ("summary", &story)])?;
    properties::write(&recording, films)?;
    blueprint::write(&recording, &contents, &verdict)?;
    Ok(recording)
}

/// Returns the application id. The viewer keeps one layout per application, so each kind of
/// recording has its own id.
fn application(films: &[Film]) -> &'static str {
    match films {
        [film] if film.outcome.is_none() => "closecall-traffic",
        [_] => "closecall-run",
        [recorded, ..] if recorded.outcome.is_none() => "closecall-reenactment",
        _ => "closecall-pair",
    }
}

/// Returns the film whose vehicles appear as outlines in the film of this index.
///
/// The vehicles of the baseline appear in the tested film, but not the other way round. If one film
/// is recorded traffic and the other its re-enactment, the vehicles of each appear in the other.
fn ghosts_in(films: &[Film], index: usize) -> Option<&Film> {
    match (films, index) {
        (_, 1..) => films.first(),
        ([recorded, simulated], 0) if recorded.outcome.is_none() => Some(simulated),
        _ => None,
    }
}

/// Writes a film and returns the possible contents of its views.
fn write_film(
    writer: &Writer<'_>,
    canvas: &bird::Canvas<'_>,
    root: String,
    role: Role,
) -> Result<FilmContents, RecordingError> {
    let film = canvas.film;
    let light = film.environment.light;
    let mut contents = FilmContents {
        name: film.arm_label().to_owned(),
        root,
        bird_range: canvas.range_m(),
        sky: palette::through_fog(palette::sky(light), fog::clear_share(film), light),
        span: [film.frames.first().map_or(Time::ZERO, |frame| frame.time), film.end()],
        ..FilmContents::default()
    };
    if film.level >= Level::Objects && !film.frames.is_empty() {
        writer.write_static("world", &ViewCoordinates::FLU())?;
        road::write(writer, film)?;
        fog::write(writer, film)?;
        vehicles::write(writer, film)?;
        perceived::write(writer, film)?;
        contents.hidden_layers.extend(truth::write(writer, film)?);
        contents.hidden_layers.extend(points::write(writer, film)?);
        radars::write(writer, film)?;
        bird::write(writer, canvas)?;
        contents.has_scene = true;
        contents.cameras = camera::write(writer, film)?;
    }
    contents.plots = plots::write(writer, film, role)?;
    contents.has_states = film.frames.iter().any(|frame| frame.command.is_some());
    collisions::write(writer, film)?;
    log::write(writer, film, role == Role::Alone)?;
    Ok(contents)
}

/// Writes the verdict and the story. Each has a view.
fn write_texts(recording: &Recording, texts: [(&str, &String); 2]) -> Result<(), RecordingError> {
    for (entity, text) in texts {
        let document = TextDocument::new(text.as_str()).with_media_type(MediaType::markdown());
        recording.log_static(entity.into(), &document)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests;
