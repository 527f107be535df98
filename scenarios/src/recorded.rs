//! Drivers that follow a vehicle of recorded traffic. The vehicle's track is read together with the
//! scenario file.
//!
//! The times and speeds of the track replace `recorded` in the text of the scenario. All later
//! steps (checking, hashing, a campaign's manifest, replay) work on an ordinary speed profile and
//! do not need the trajectory file.

use std::path::{Path, PathBuf};

use closecall_controllers::{DriverConfig, RecordedConfig};
use closecall_recorded::trajectory_data::{ReadOptions, open};
use closecall_traffic::{Num, Trajectory, TrajectoryPoint};
use toml_edit::{Array, DocumentMut, Item, TableLike, Value};

use super::ScenarioConfig;

/// The reason for which a recorded speed profile cannot be used.
#[derive(Debug, thiserror::Error)]
pub(super) enum RecordedError {
    /// The trajectory file cannot be read.
    #[error("`{actor}` follows a trajectory file: {message}")]
    TrajectoryData {
        /// The actor.
        actor: String,
        /// The fault of the trajectory file.
        message: String,
    },
    /// The trajectory file has no such track.
    #[error("`{actor}` follows track {track_id} of {file}, which has {tracks}")]
    NoSuchTrack {
        /// The actor.
        actor: String,
        /// The track asked for.
        track_id: u64,
        /// The trajectory file.
        file: String,
        /// The tracks that the file has.
        tracks: String,
    },
    /// The actor is written in a form in which the text cannot be changed.
    #[error("`{actor}` follows a trajectory file, which needs actors written as [[actor]] and `driver` as a table")]
    Form {
        /// The actor.
        actor: String,
    },
}

impl RecordedError {
    /// Returns the name of the actor.
    pub(super) fn actor(&self) -> &str {
        match self {
            Self::TrajectoryData { actor, .. } | Self::NoSuchTrack { actor, .. } | Self::Form { actor } => actor,
        }
    }
}

/// Replaces every `recorded` by its speed profile, in the contents of a file and in its text.
/// Returns the text, or `None` if there is no `recorded`. `path` is the path of the scenario file.
pub(super) fn inline(path: &Path, text: &str, config: &mut ScenarioConfig) -> Result<Option<String>, RecordedError> {
    let mut document: Option<DocumentMut> = None;
    for (index, actor) in config.actors.iter_mut().enumerate() {
        let DriverConfig::Prescribed(prescribed) = &mut actor.driver else { continue };
        let Some(recorded) = &prescribed.recorded else { continue };
        let profile = speed_profile(path, actor.id.as_str(), recorded)?;
        let form = || RecordedError::Form { actor: actor.id.to_string() };
        if document.is_none() {
            document = Some(text.parse().map_err(|_| form())?);
        }
        let table = document.as_mut().and_then(|document| prescribed_table(document, index)).ok_or_else(form)?;
        table.remove("recorded");
        table.insert("profile", Item::Value(Value::Array(profile.iter().copied().map(Array::from_iter).collect())));
        prescribed.profile = Some(profile.iter().map(|pair| pair.map(Num::Fixed)).collect());
        prescribed.recorded = None;
    }
    Ok(document.map(|document| document.to_string()))
}

/// Returns the trajectory files that a scenario names.
pub(super) fn files(path: &Path, config: &ScenarioConfig) -> Vec<PathBuf> {
    let recorded = config.actors.iter().filter_map(|actor| match &actor.driver {
        DriverConfig::Prescribed(prescribed) => prescribed.recorded.as_ref(),
        _ => None,
    });
    recorded.map(|recorded| path.parent().unwrap_or(Path::new("")).join(&recorded.file)).collect()
}

fn prescribed_table(document: &mut DocumentMut, index: usize) -> Option<&mut dyn TableLike> {
    let actor = document.get_mut("actor")?.as_array_of_tables_mut()?.get_mut(index)?;
    actor.get_mut("driver")?.as_table_like_mut()?.get_mut("prescribed")?.as_table_like_mut()
}

/// Returns pairs of a time of the run (s) and the recorded speed (m/s).
fn speed_profile(scenario: &Path, actor: &str, recorded: &RecordedConfig) -> Result<Vec<[f64; 2]>, RecordedError> {
    let trajectory = read_track(scenario, actor, recorded)?;
    let begin = trajectory.points.first().map(|point| point.time).unwrap_or_default();
    let from_s = recorded.from_s.unwrap_or(0.0);
    let pair = |point: &TrajectoryPoint| [from_s + (point.time - begin).s(), point.speed_mps.max(0.0)];
    Ok(trajectory.points.iter().map(pair).collect())
}

/// Reads the track that `recorded` names.
fn read_track(scenario: &Path, actor: &str, recorded: &RecordedConfig) -> Result<Trajectory, RecordedError> {
    let path = scenario.parent().unwrap_or(Path::new("")).join(&recorded.file);
    let read_error = |message: String| RecordedError::TrajectoryData { actor: actor.to_owned(), message };
    let mut first_and_last_id: Option<(u64, u64)> = None;
    let mut tracks = 0_u64;
    for track in open(&path, ReadOptions::default()).map_err(|error| read_error(error.to_string()))? {
        let trajectory = track.map_err(|error| read_error(error.to_string()))?.trajectory;
        if trajectory.track_id == recorded.track_id {
            return Ok(trajectory);
        }
        tracks += 1;
        let (first, last) = first_and_last_id.unwrap_or((trajectory.track_id, trajectory.track_id));
        first_and_last_id = Some((first.min(trajectory.track_id), last.max(trajectory.track_id)));
    }
    let tracks = first_and_last_id
        .map_or_else(|| "no tracks".to_owned(), |(first, last)| format!("{tracks} tracks from {first} to {last}"));
    let (track_id, file) = (recorded.track_id, recorded.file.clone());
    Err(RecordedError::NoSuchTrack { actor: actor.to_owned(), track_id, file, tracks })
}
