//! An explanation in words.

use std::fmt;
use std::path::Path;

use closecall_campaign::action::{Action, CommandFor, Replay, SavedSample};
use closecall_scenarios::MisState;

use super::{Cause, Explanation, MisEffect, Stage, StageRun};

/// An explanation as text for readers.
#[derive(Clone, Copy, Debug)]
pub struct ExplanationText<'a> {
    /// The explanation.
    pub explanation: &'a Explanation,
    /// The folder of the campaign, for the commands that confirm the explanation.
    pub folder: &'a Path,
    /// These commands.
    pub command_for: CommandFor,
}

impl Explanation {
    /// Returns the cause in one sentence.
    pub fn sentence(&self) -> String {
        let due = match &self.cause {
            Cause::Stage { stage } => due_to(*stage, self.confirmation()),
            Cause::Pair { stages: [first, second] } => format!(
                "No stage alone is to blame. With {} and {} together, no vehicle collides.",
                first.replacement(),
                second.replacement()
            ),
            Cause::None => "No stage of the chain, and no pair of stages, prevents it if perfect.".to_owned(),
        };
        match self.mis.as_ref().filter(|mis| mis.is_induced) {
            Some(mis) => format!("{due} {}", induced_words(mis)),
            None => due,
        }
    }
}

/// Returns the sentence about a stage that is the cause, with the run that confirms it.
fn due_to(stage: Stage, confirmation: Option<&StageRun>) -> String {
    let unusual = confirmation.and_then(|run| run.unusual.as_ref());
    let unusual = unusual.map_or_else(String::new, |how| format!(" ({how})"));
    let narrowly = confirmation.and_then(narrowly).unwrap_or_default();
    let is_usual = confirmation.is_some_and(|run| run.is_usual);
    let with = if is_usual { "it as usual, though not with it perfect" } else { stage.replacement() };
    // A run that nearly collides shows less: a small change of anything may have the same effect.
    let is_due = if narrowly.is_empty() { "It is due to" } else { "It may be due to" };
    format!("{is_due} {}{unusual}: with {with}, no vehicle collides{narrowly}.", stage.name())
}

/// Gap below which a run counts as having passed narrowly (m): an assumption, a quarter of a car's
/// width.
const NARROW_GAP_M: f64 = 0.5;

/// Returns the margin by which a run has passed, if it has passed narrowly.
fn narrowly(run: &StageRun) -> Option<String> {
    let least_m = [run.min_gap_rear_m, run.min_gap_front_m].into_iter().flatten().reduce(f64::min)?;
    (least_m < NARROW_GAP_M).then(|| format!(", but narrowly: the least gap is {least_m:.1} m"))
}

/// Returns the action of the margin increase system that induced a failure.
fn induced_words(mis: &MisEffect) -> String {
    let cause = match mis.state {
        Some(MisState::Increasing) => {
            let by =
                mis.mean_deceleration_mps2.map_or_else(String::new, |mps2| format!(" by {mps2:.2} m/s² in the mean"));
            format!("it had slowed the ego down{by}; without this braking, no vehicle collides")
        }
        Some(MisState::Holding) => {
            "it held its speed instead of braking; without holding, no vehicle collides".to_owned()
        }
        Some(MisState::Releasing) => {
            "it returned the margin; if the cruise control drives instead, no vehicle collides".to_owned()
        }
        None if mis.runs.iter().any(|run| run.prevents) => {
            "no state of the system alone is to blame, but all of them together".to_owned()
        }
        None if mis.engaged_at_s.is_none() => {
            "which of its states is to blame is not known, because it reports none (increasing, holding or releasing)"
                .to_owned()
        }
        None => "neither a state that it reports is to blame, nor all of them together".to_owned(),
    };
    format!("The system induces it (without the system, no vehicle collides): {cause}.")
}

impl fmt::Display for ExplanationText<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { explanation, folder, command_for } = self;
        let folder = folder.display().to_string();
        let replay = |settings: &[String]| {
            let saved_sample =
                SavedSample { folder: &folder, sample: explanation.sample, scenario: Some(&explanation.scenario) };
            command_for(&Action::Replay(Replay { settings, ..Replay::new(saved_sample) }))
        };
        let collision = &explanation.collision;
        writeln!(
            f,
            "{} sample {} ({}, {} sensors): {}",
            explanation.scenario, explanation.sample, explanation.controller, explanation.sensors, explanation.happened,
        )?;
        writeln!(f, "  phase {}; avoidable by: {}", collision.phase_words(), collision.avoidable.words())?;
        writeln!(f, "{}", explanation.sentence())?;
        writeln!(f)?;
        for run in &explanation.stages {
            let as_usual = if run.is_usual { "as usual: " } else { "" };
            writeln!(f, "  {:<14} {as_usual}{}", run.stages[0].name(), outcome_words(run))?;
        }
        for (stage, reason) in &explanation.missing {
            writeln!(f, "  {:<14} does not exist: {reason}", stage.name())?;
        }
        for run in explanation.pairs.iter().filter(|run| run.prevents) {
            writeln!(f, "  {} + {}: {}", run.stages[0].name(), run.stages[1].name(), outcome_words(run))?;
        }
        // Without a reported state, switching states off changes nothing.
        let with_states = explanation.mis.iter().filter(|mis| mis.reports_states());
        for run in with_states.flat_map(|mis| &mis.runs) {
            let off: Vec<&str> = run.off.iter().map(|state| state.name()).collect();
            let result = if run.prevents { "no collision" } else { "still collides" };
            writeln!(f, "  without the system while {}: {result}", off.join(", "))?;
        }
        if let Some(run) = explanation.confirmation() {
            writeln!(f, "\nto confirm: {}", replay(&run.settings))?;
        }
        if let Some(run) = explanation.mis.iter().flat_map(|mis| &mis.runs).find(|run| run.prevents) {
            let command = replay(std::slice::from_ref(&run.setting));
            writeln!(f, "to confirm what the system did: {command}")?;
        }
        Ok(())
    }
}

/// Returns the outcome of a run with a replaced stage in words.
fn outcome_words(run: &StageRun) -> String {
    let gap =
        |name: &str, gap_m: Option<f64>| gap_m.map_or_else(String::new, |m| format!(", least {name} gap {m:.1} m"));
    match (&run.error, run.collisions) {
        (Some(error), _) => format!("no outcome: {error}"),
        (None, Some(0)) => {
            format!("no collision{}{}", gap("rear", run.min_gap_rear_m), gap("front", run.min_gap_front_m))
        }
        (None, count) => match count.unwrap_or_default() {
            1 => "still collides".to_owned(),
            count => format!("still collides ({count} collisions)"),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::explain::MisRun;

    /// The effect of a system that engaged or not; switching off all of its states prevents the
    /// failure or not.
    fn effect(engaged_at_s: Option<f64>, all_prevent: bool) -> MisEffect {
        let run = |off: &[MisState], prevents| MisRun { off: off.to_vec(), setting: String::new(), prevents };
        let mut runs: Vec<MisRun> = MisState::ALL.iter().map(|state| run(&[*state], false)).collect();
        runs.push(run(&MisState::ALL, all_prevent));
        MisEffect {
            is_induced: true,
            runs,
            state: None,
            engaged_at_s,
            released_at_s: None,
            mean_deceleration_mps2: None,
        }
    }

    #[test]
    fn all_states_together_are_to_blame_only_if_switching_them_off_prevents_the_failure() {
        let together = "all of them together.";
        let prevented = induced_words(&effect(Some(4.0), true));
        assert!(
            prevented.contains("no state of the system alone is to blame, but all of them together"),
            "{prevented}"
        );
        let reported = induced_words(&effect(Some(4.0), false));
        assert!(reported.contains("neither a state that it reports is to blame") && reported.ends_with(together));
        let silent = effect(None, false);
        let words = induced_words(&silent);
        assert!(words.contains("it reports none") && !words.contains("together"), "{words}");
        assert!(!silent.reports_states() && effect(Some(4.0), false).reports_states());
        assert!(effect(None, true).reports_states(), "it reports another state than increasing");
    }

    #[test]
    fn a_stage_that_prevents_a_failure_narrowly_is_not_said_to_be_its_cause() {
        let run = |gap_m| StageRun {
            stages: vec![Stage::Points],
            is_usual: false,
            settings: Vec::new(),
            unusual: None,
            prevents: true,
            collisions: Some(0),
            min_gap_rear_m: Some(gap_m),
            min_gap_front_m: None,
            error: None,
        };
        let sentence = |gap_m| due_to(Stage::Points, Some(&run(gap_m)));
        let narrow = "It may be due to points: with exact points of the rear LiDAR, no vehicle collides, but narrowly: \
                      the least gap is 0.0 m.";
        assert_eq!(sentence(0.0), narrow);
        assert_eq!(sentence(3.0), "It is due to points: with exact points of the rear LiDAR, no vehicle collides.");
    }
}
