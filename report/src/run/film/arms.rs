//! One sample in several arms, a film of each.

use closecall_campaign::runner::run_guarded;
use closecall_simulation::scenario::Scenario;
use closecall_simulation::{Arm, RunKey, SampleError};

use super::{Film, FilmRecorder, Level};

/// Runs a sample in each of the arms, and returns a film of each.
///
/// # Errors
/// [`SampleError`] if one of the runs has no outcome.
pub fn film_arms(scenario: &Scenario, key: RunKey, arms: &[Arm], level: Level) -> Result<Vec<Film>, SampleError> {
    let film = |arm: &Arm| {
        let mut recorder = FilmRecorder::new(scenario, key, arm, level);
        let outcome = run_guarded(scenario, key, arm, &mut recorder)?;
        Ok(recorder.finish(&outcome))
    };
    arms.iter().map(film).collect()
}
