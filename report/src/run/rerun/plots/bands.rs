//! Bands of states over time: the ego stack, what the ego knew, the phase, the moments, the brake lights.

use closecall_controllers::EgoState;
use closecall_simulation::outcome::{Phase, ReachedMoment};
use closecall_traffic::Time;
use rerun::{StateChange, StateConfiguration};

use super::super::RecordingError;
use super::super::palette::{self, Rgba};
use super::super::stream::changes;
use super::Plots;
use crate::run::film::{Frame, KnownSpan, ego_state_name};

const BEFORE: &str = "-";
const NO_REAR: &str = "no vehicle behind";
const BRAKES: &str = "on";
const DRIVES: &str = "off";
const BRAKE_COLOURS: [(&str, Rgba); 2] = [(BRAKES, palette::BRAKE_LIGHT), (DRIVES, palette::QUIET)];

const STATE_COLOURS: [(&str, Rgba); 5] = [
    (ego_state_name(EgoState::Following), palette::QUIET),
    (ego_state_name(EgoState::Increasing), palette::EGO),
    (ego_state_name(EgoState::Holding), palette::SAFE),
    (ego_state_name(EgoState::Releasing), palette::NEUTRAL),
    (ego_state_name(EgoState::EmergencyBraking), palette::CRITICAL),
];

const PHASE_COLOURS: [(&str, Rgba); 5] = [
    (NO_REAR, palette::QUIET),
    (phase_name(Phase::Approach), palette::QUIET),
    (phase_name(Phase::Critical), palette::CRITICAL),
    (phase_name(Phase::Overtaking), palette::WARNING),
    (phase_name(Phase::After), palette::NEUTRAL),
];

/// Returns the name of a phase of the encounter.
pub(in super::super) const fn phase_name(phase: Phase) -> &'static str {
    match phase {
        Phase::Approach => "approach",
        Phase::Critical => "critical",
        Phase::Overtaking => "overtaking",
        Phase::After => "after",
    }
}

impl Plots<'_> {
    /// Writes the bands: the state of the ego stack, what the ego knew of the vehicle behind, the phase, the moments, and
    /// the brake lights. A band ends with the run.
    pub(super) fn bands(&self) -> Result<(), RecordingError> {
        let frames = &self.film.frames;
        if frames.iter().all(|frame| frame.command.is_some()) {
            let state = |frame: &Frame| frame.command.map_or("", |command| ego_state_name(command.state));
            self.band("states/1_ego", &frames.iter().map(state).collect::<Vec<_>>(), &STATE_COLOURS)?;
            self.sight()?;
            // Without a vehicle behind there is no encounter that could have a phase.
            let phase = |frame: &Frame| match frame.phase {
                Some(Phase::Approach) if frame.margins.follower.is_none() => NO_REAR,
                phase => phase.map_or("", phase_name),
            };
            self.band("states/4_encounter", &frames.iter().map(phase).collect::<Vec<_>>(), &PHASE_COLOURS)?;
        }
        self.moments()?;
        for (index, actor) in self.film.actors.iter().enumerate().filter(|(_, actor)| actor.is_plotted) {
            let braking = frames.iter().map(|frame| frame.states[index].brake_light);
            let words: Vec<&str> = braking.map(|lit| if lit { BRAKES } else { DRIVES }).collect();
            if words.contains(&BRAKES) {
                self.band(&format!("states/5_brake_light_{}", actor.name), &words, &BRAKE_COLOURS)?;
            }
        }
        Ok(())
    }

    /// Writes a band that shows what the ego knew of the vehicle behind it.
    fn sight(&self) -> Result<(), RecordingError> {
        let spans = self.film.known_spans();
        let texts: Vec<String> = spans.iter().map(KnownSpan::words).collect();
        let span_at = |row: usize| spans.iter().rposition(|span| span.first_frame <= row);
        let words: Vec<&str> =
            (0..self.times.len()).map(|row| span_at(row).map_or("", |index| texts[index].as_str())).collect();
        let colour = |span: &KnownSpan| if span.from_m.is_some() { palette::SAFE } else { palette::QUIET };
        let colours: Vec<(&str, Rgba)> =
            texts.iter().zip(&spans).map(|(text, span)| (text.as_str(), colour(span))).collect();
        self.band("states/2_rear_seen", &words, &colours)
    }

    /// Writes a band that shows the latest of the moments of the encounter at each time, by its letter.
    fn moments(&self) -> Result<(), RecordingError> {
        let moments = self.film.moments();
        if moments.is_empty() {
            return Ok(());
        }
        let texts: Vec<String> = moments.iter().map(|noted| noted.moment.label()).collect();
        let short =
            |noted: &ReachedMoment| noted.moment.letter().map_or("·".to_owned(), |letter| format!("({letter})"));
        let short: Vec<String> = moments.iter().map(short).collect();
        let latest = |time: Time| moments.iter().rposition(|noted| noted.time <= time);
        let words: Vec<&str> =
            self.times.iter().map(|&time| latest(time).map_or(BEFORE, |index| texts[index].as_str())).collect();
        let entity = "states/3_moments";
        let colours = moments.iter().map(|noted| palette::moment(noted.moment));
        let configuration = StateConfiguration::new()
            .with_values(std::iter::once(BEFORE).chain(texts.iter().map(String::as_str)))
            .with_labels(std::iter::once(BEFORE).chain(short.iter().map(String::as_str)))
            .with_colors(std::iter::once(palette::QUIET).chain(colours));
        self.writer.write_static(entity, &configuration)?;
        self.write_changes(entity, &words)
    }

    /// Writes a band with one state name per frame.
    fn band(&self, entity: &str, words: &[&str], colours: &[(&str, Rgba)]) -> Result<(), RecordingError> {
        let configuration = StateConfiguration::new()
            .with_values(colours.iter().map(|(word, _)| *word))
            .with_labels(colours.iter().map(|(word, _)| *word))
            .with_colors(colours.iter().map(|(_, colour)| *colour));
        self.writer.write_static(entity, &configuration)?;
        self.write_changes(entity, words)
    }

    /// Writes the changes of a state, and its end after the last frame.
    fn write_changes(&self, entity: &str, words: &[&str]) -> Result<(), RecordingError> {
        let rows = changes(words);
        let end = self.film.end() + self.film.period;
        let times: Vec<Time> = rows.iter().map(|&row| self.times[row]).chain([end]).collect();
        let states: Vec<&str> = rows.iter().map(|&row| words[row]).chain([""]).collect();
        self.writer.write_curve(entity, &times, |range| {
            StateChange::new().with_state(states[range].iter().copied()).columns_of_unit_batches()
        })
    }
}
