//! The cause of a run's end: the sentence about it, and the letters of its vehicles.

use closecall_scenarios::causal::{CausalSentence, unlettered};
use closecall_scenarios::outcome::Collision;
use closecall_studies::attribution::Avoidable;

use super::{Film, Part};

impl Film {
    /// Returns the sentence about the run: who struck whom, after what, what the system did and
    /// why, which faults held. `None` for recorded traffic.
    pub(in crate::run) fn sentence(&self) -> Option<CausalSentence<'_>> {
        let outcome = self.outcome.as_ref()?;
        let (engaged_for, goal_s) = (self.engaged_for(), self.goal_s);
        Some(CausalSentence { outcome, letters: &self.letters, faults: &self.faults, engaged_for, goal_s })
    }

    /// Returns the sentence about the run as text.
    pub(crate) fn sentence_text(&self) -> Option<String> {
        self.sentence().map(|sentence| sentence.to_string())
    }

    /// Returns who struck whom, and how fast.
    pub(in crate::run) fn struck_text(&self, collision: &Collision) -> String {
        self.sentence().map_or_else(String::new, |sentence| sentence.struck(collision))
    }

    /// Returns who struck whom, in a few letters, with the relative speed.
    pub(in crate::run) fn mark_text(&self, collision: &Collision) -> String {
        let who = self.sentence().map_or_else(String::new, |sentence| sentence.who(collision));
        format!("{who}, {:.1} m/s", collision.relative_speed_mps)
    }

    /// Returns who struck whom, how fast, and the change of velocity of each.
    pub(in crate::run) fn collision_text(&self, collision: &Collision) -> String {
        let sentence = self.sentence();
        sentence.map_or_else(String::new, |told| format!("{} ({})", told.struck(collision), told.delta_v(collision)))
    }

    /// Returns who struck whom in each collision, and by whom it was avoidable.
    pub(in crate::run) fn avoidable_texts(&self) -> Vec<String> {
        let Some(sentence) = self.sentence() else { return Vec::new() };
        let text = |(collision, avoidable): (&Collision, Option<Avoidable>)| {
            avoidable.map(|avoidable| format!("{}; avoidable by: {}", sentence.who(collision), avoidable.words()))
        };
        self.collisions().iter().zip(self.avoidable.iter().copied()).filter_map(text).collect()
    }

    /// Returns the letter of a vehicle, or its name if it has none.
    pub(in crate::run) fn vehicle_letter(&self, actor: usize) -> &str {
        match self.actors[actor].part {
            Part::Ego => "E",
            Part::Lead => "F",
            Part::Rear => "R",
            Part::Other(_) | Part::Background => unlettered(&self.actors[actor].name),
        }
    }

    /// Returns the name of a vehicle after its letter: E is the ego, F the lead vehicle, R the rear
    /// vehicle of an encounter.
    pub(in crate::run) fn vehicle_label(&self, actor: usize) -> String {
        let name = &self.actors[actor].name;
        let letter = match self.actors[actor].part {
            // In the film of a lane change, a reader looks up the numbers of the tracks.
            _ if name.starts_with("track-") => return name.clone(),
            Part::Ego => "E",
            Part::Lead => "F",
            Part::Rear => "R",
            Part::Other(_) | Part::Background => return unlettered(name).to_owned(),
        };
        format!("{letter} {name}")
    }
}
