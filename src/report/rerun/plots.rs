//! Curves and bands over time: margins, speeds, accelerations, states.

use closecall_controllers::{EgoState, MisPlan};
use closecall_traffic::Time;
use rerun::{SeriesLines, StateChange, StateConfiguration};

use super::RecordError;
use super::film::{Film, Frame};
use super::palette::{self, Rgba};
use super::stream::{Writer, changes};
use crate::outcome::{CRITICAL_THW_S, Phase};

/// TTCE below which a situation is critical [s] (the paper's threshold).
const CRITICAL_TTCE_S: f64 = 2.6;

const LINE: f32 = 2.0;
const THIN_LINE: f32 = 1.0;

/// Writes every curve; true where the margin increase system ever engaged, so that there is a margin to plot.
pub(super) fn write(writer: &Writer<'_>, film: &Film<'_>) -> Result<bool, RecordError> {
    let plots = Plots { writer, film, times: film.times() };
    plots.headways()?;
    plots.gaps()?;
    plots.encounter()?;
    plots.motion()?;
    plots.states()?;
    plots.margin()
}

struct Plots<'a> {
    writer: &'a Writer<'a>,
    film: &'a Film<'a>,
    times: Vec<Time>,
}

/// What a curve looks like.
struct Pen<'a> {
    name: &'a str,
    colour: Rgba,
    width: f32,
}

impl Plots<'_> {
    fn curve(&self, entity: &str, pen: &Pen<'_>, of: impl Fn(&Frame) -> Option<f64>) -> Result<(), RecordError> {
        let values: Vec<Option<f64>> = self.film.frames.iter().map(of).collect();
        if values.iter().all(Option::is_none) {
            return Ok(());
        }
        self.pen(entity, pen)?;
        self.writer.series(entity, &self.times, &values)
    }

    fn pen(&self, entity: &str, pen: &Pen<'_>) -> Result<(), RecordError> {
        let style = SeriesLines::new().with_names([pen.name]).with_colors([pen.colour]).with_widths([pen.width]);
        self.writer.fixed(entity, &style)
    }

    /// A level that values are compared with, from the first to the last frame.
    fn level(&self, entity: &str, name: &str, level: f64) -> Result<(), RecordError> {
        self.pen(entity, &Pen { name, colour: palette::CRITICAL, width: THIN_LINE })?;
        self.writer.series(entity, &self.times, &vec![Some(level); self.times.len()])
    }

    fn headways(&self) -> Result<(), RecordError> {
        let front = Pen { name: "front", colour: palette::FRONT, width: LINE };
        self.curve("plots/headway/front", &front, |frame| frame.margins.thw_front_s.ok())?;
        let rear = Pen { name: "rear", colour: palette::REAR, width: LINE };
        self.curve("plots/headway/rear", &rear, |frame| frame.margins.thw_rear_s.ok())?;
        self.level("plots/headway/critical", "critical", CRITICAL_THW_S)
    }

    fn gaps(&self) -> Result<(), RecordError> {
        let front = Pen { name: "front", colour: palette::FRONT, width: LINE };
        self.curve("plots/gap/front", &front, |frame| frame.margins.gap_front_m.ok())?;
        let rear = Pen { name: "rear", colour: palette::REAR, width: LINE };
        self.curve("plots/gap/rear", &rear, |frame| frame.margins.gap_rear_m.ok())?;
        let seen = Pen { name: "rear, as the MIS sees it", colour: palette::NEUTRAL, width: THIN_LINE };
        self.curve("plots/gap/rear_seen", &seen, |frame| frame.command.plan.map(|plan| plan.rear_gap_m))
    }

    fn encounter(&self) -> Result<(), RecordError> {
        let plan = |of: fn(&MisPlan) -> Option<f64>| move |frame: &Frame| frame.command.plan.as_ref().and_then(of);
        let ttc = Pen { name: "TTC rear", colour: palette::REAR, width: LINE };
        self.curve("plots/encounter/ttc_rear", &ttc, |frame| frame.margins.ttc_rear_s.ok())?;
        let ttce = Pen { name: "TTCE, as the MIS sees it", colour: palette::NEUTRAL, width: LINE };
        self.curve("plots/encounter/ttce", &ttce, plan(|plan| plan.ttce_s.ok()))?;
        let planned = Pen { name: "planned t_c", colour: palette::EGO, width: LINE };
        self.curve("plots/encounter/planned", &planned, plan(|plan| plan.time_to_critical_s.ok()))?;
        self.level("plots/encounter/critical", "critical", CRITICAL_TTCE_S)
    }

    fn motion(&self) -> Result<(), RecordError> {
        for (place, actor) in self.film.scenario.actors.iter().enumerate() {
            let colour = palette::actor(place, self.film.scenario.ego);
            let pen = Pen { name: actor.id.as_str(), colour, width: LINE };
            self.curve(&format!("plots/speed/{}", actor.id), &pen, |frame| Some(frame.states[place].speed_mps))?;
            self.curve(&format!("plots/acceleration/{}", actor.id), &pen, |frame| {
                Some(frame.states[place].acceleration_mps2)
            })?;
        }
        let commanded = Pen { name: "ego, commanded", colour: palette::NEUTRAL, width: THIN_LINE };
        self.curve("plots/acceleration/commanded", &commanded, |frame| Some(frame.command.acceleration_mps2))
    }

    /// The front time headway gained since the system first engaged, beside its goal.
    fn margin(&self) -> Result<bool, RecordError> {
        let first = self.film.frames.iter().find(|frame| frame.command.state == EgoState::Increasing);
        let start = first.and_then(|frame| Some((frame.time, frame.margins.thw_front_s.ok()?, frame.command.plan)));
        let Some((since, thw_s, plan)) = start else { return Ok(false) };
        let gained = |frame: &Frame, thw: Option<f64>| thw.filter(|_| frame.time >= since).map(|now_s| now_s - thw_s);
        let pen = Pen { name: "gained", colour: palette::EGO, width: LINE };
        self.curve("plots/margin/gained", &pen, |frame| gained(frame, frame.margins.thw_front_s.ok()))?;
        let pen = Pen { name: "foreseen at the critical distance", colour: palette::NEUTRAL, width: THIN_LINE };
        self.curve("plots/margin/foreseen", &pen, |frame| {
            gained(frame, frame.command.plan.and_then(|plan| plan.thw_at_critical_s.ok()))
        })?;
        let goal_s = plan.map(|plan| plan.goal_thw_s - thw_s);
        let pen = Pen { name: "goal", colour: palette::SAFE, width: THIN_LINE };
        self.curve("plots/margin/goal", &pen, |frame| goal_s.filter(|_| frame.time >= since))?;
        Ok(true)
    }

    fn states(&self) -> Result<(), RecordError> {
        let states: Vec<&str> = self.film.frames.iter().map(|frame| state_word(frame.command.state)).collect();
        self.band("states/ego_stack", &states, &STATE_COLOURS)?;
        let phases: Vec<&str> = self.film.frames.iter().map(|frame| phase_word(frame.phase)).collect();
        self.band("states/encounter", &phases, &PHASE_COLOURS)?;
        for (place, actor) in self.film.scenario.actors.iter().enumerate() {
            let braking = self.film.frames.iter().map(|frame| frame.states[place].brake_light);
            let words: Vec<&str> = braking.map(|lit| if lit { BRAKES } else { DRIVES }).collect();
            if words.contains(&BRAKES) {
                self.band(&format!("states/{}_brake_light", actor.id), &words, &BRAKE_COLOURS)?;
            }
        }
        Ok(())
    }

    fn band(&self, entity: &str, words: &[&str], colours: &[(&str, Rgba)]) -> Result<(), RecordError> {
        let configuration = StateConfiguration::new()
            .with_values(colours.iter().map(|(word, _)| *word))
            .with_labels(colours.iter().map(|(word, _)| *word))
            .with_colors(colours.iter().map(|(_, colour)| *colour));
        self.writer.fixed(entity, &configuration)?;
        let rows = changes(words);
        let times: Vec<Time> = rows.iter().map(|&row| self.times[row]).collect();
        self.writer.rows(entity, &times, |range| {
            StateChange::new().with_state(rows[range].iter().map(|&row| words[row])).columns_of_unit_batches()
        })
    }
}

const BRAKES: &str = "on";
const DRIVES: &str = "off";
const BRAKE_COLOURS: [(&str, Rgba); 2] = [(BRAKES, palette::BRAKE_LIGHT), (DRIVES, palette::QUIET)];

const STATE_COLOURS: [(&str, Rgba); 5] = [
    (state_word(EgoState::Following), palette::QUIET),
    (state_word(EgoState::Increasing), palette::EGO),
    (state_word(EgoState::Holding), palette::SAFE),
    (state_word(EgoState::Releasing), palette::NEUTRAL),
    (state_word(EgoState::EmergencyBraking), palette::CRITICAL),
];

const PHASE_COLOURS: [(&str, Rgba); 4] = [
    (phase_word(Phase::Approach), palette::QUIET),
    (phase_word(Phase::Critical), palette::CRITICAL),
    (phase_word(Phase::Overtaking), palette::WARNING),
    (phase_word(Phase::After), palette::NEUTRAL),
];

/// What a state of the ego stack is called.
pub(super) const fn state_word(state: EgoState) -> &'static str {
    match state {
        EgoState::Following => "following",
        EgoState::Increasing => "increasing the margin",
        EgoState::Holding => "holding",
        EgoState::Releasing => "releasing",
        EgoState::EmergencyBraking => "emergency braking",
    }
}

/// What a phase of the encounter is called.
pub(super) const fn phase_word(phase: Phase) -> &'static str {
    match phase {
        Phase::Approach => "approach",
        Phase::Critical => "critical",
        Phase::Overtaking => "overtaking",
        Phase::After => "after",
    }
}
