//! Films of one sample in several arms.

use closecall_campaign::runner::run_guarded;
use closecall_scenarios::Scenario;
use closecall_simulation::{Arm, RunKey, SampleError};

use super::{Film, FilmRecorder, Level};

/// Runs one sample in each of `arms` and returns one film per arm, in the same order.
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
