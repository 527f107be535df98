//! Drivers that follow a recorded vehicle: the track is read together with the scenario file.
//!
//! The track's times and speeds take the place of `recorded` in the scenario's text. Everything behind it (checking,
//! hashing, a campaign's manifest, replay) sees a profile like any other, and needs the recording no more.

use std::path::Path;

use closecall_controllers::{DriverConfig, RecordedConfig};
use closecall_scenarios::recordings::{ReadOptions, open};
use closecall_traffic::Trajectory;
use toml_edit::{Array, DocumentMut, Item, TableLike, Value};

use super::ScenarioConfig;

/// Why a recorded profile cannot be used.
#[derive(Debug, thiserror::Error)]
pub(super) enum RecordedError {
    /// The recording cannot be read.
    #[error("`{actor}` follows a recording: {message}")]
    Recording {
        /// The actor.
        actor: String,
        /// What is wrong with the recording.
        message: String,
    },
    /// It has no such track.
    #[error("`{actor}` follows track {track_id} of {file}, which has {known}")]
    NoSuchTrack {
        /// The actor.
        actor: String,
        /// The track asked for.
        track_id: u64,
        /// The recording.
        file: String,
        /// What the recording has.
        known: String,
    },
    /// The place in the text cannot be changed.
    #[error("`{actor}` follows a recording, which needs actors written as [[actor]] and `driver` as a table")]
    Form {
        /// The actor.
        actor: String,
    },
}

/// The text with every `recorded` replaced by its profile, or nothing where there is none.
pub(super) fn inline(path: &Path, text: &str, config: &ScenarioConfig) -> Result<Option<String>, RecordedError> {
    let mut document: Option<DocumentMut> = None;
    for (index, actor) in config.actors.iter().enumerate() {
        let DriverConfig::Prescribed(prescribed) = &actor.driver else { continue };
        let Some(recorded) = &prescribed.recorded else { continue };
        let profile = profile(path, actor.id.as_str(), recorded)?;
        let form = || RecordedError::Form { actor: actor.id.to_string() };
        if document.is_none() {
            document = Some(text.parse().map_err(|_| form())?);
        }
        let table = document.as_mut().and_then(|document| prescribed_table(document, index)).ok_or_else(form)?;
        table.remove("recorded");
        table.insert("profile", Item::Value(Value::Array(profile)));
    }
    Ok(document.map(|document| document.to_string()))
}

fn prescribed_table(document: &mut DocumentMut, index: usize) -> Option<&mut dyn TableLike> {
    let actor = document.get_mut("actor")?.as_array_of_tables_mut()?.get_mut(index)?;
    actor.get_mut("driver")?.as_table_like_mut()?.get_mut("prescribed")?.as_table_like_mut()
}

/// Pairs of the run's time and the recorded speed.
fn profile(scenario: &Path, actor: &str, recorded: &RecordedConfig) -> Result<Array, RecordedError> {
    let trajectory = track(scenario, actor, recorded)?;
    let begin = trajectory.points.first().map(|point| point.time).unwrap_or_default();
    let from_s = recorded.from_s.unwrap_or(0.0);
    let mut profile = Array::new();
    for point in &trajectory.points {
        let pair = [from_s + (point.time - begin).s(), point.speed_mps.max(0.0)];
        profile.push(Array::from_iter(pair));
    }
    Ok(profile)
}

fn track(scenario: &Path, actor: &str, recorded: &RecordedConfig) -> Result<Trajectory, RecordedError> {
    let path = scenario.parent().unwrap_or(Path::new("")).join(&recorded.file);
    let broken = |message: String| RecordedError::Recording { actor: actor.to_owned(), message };
    let mut known: Option<(u64, u64)> = None;
    let mut tracks = 0_u64;
    for track in open(&path, ReadOptions::default()).map_err(|error| broken(error.to_string()))? {
        let trajectory = track.map_err(|error| broken(error.to_string()))?.trajectory;
        if trajectory.track_id == recorded.track_id {
            return Ok(trajectory);
        }
        tracks += 1;
        let (least, most) = known.unwrap_or((trajectory.track_id, trajectory.track_id));
        known = Some((least.min(trajectory.track_id), most.max(trajectory.track_id)));
    }
    let known =
        known.map_or_else(|| "no tracks".to_owned(), |(least, most)| format!("{tracks} tracks from {least} to {most}"));
    let (track_id, file) = (recorded.track_id, recorded.file.clone());
    Err(RecordedError::NoSuchTrack { actor: actor.to_owned(), track_id, file, known })
}
