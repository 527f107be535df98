//! Plots over time: curves of margins, speeds and accelerations, and bands of states.

use closecall_controllers::{EgoState, MisPlan};
use closecall_scenarios::criticality::{CRITICAL_DCE_M, CRITICAL_TTCE_S};
use closecall_traffic::Time;
use closecall_traffic::metrics::Encounter;
use rerun::{SeriesLines, StateChange, StateConfiguration};

use super::RecordingError;
use super::palette::{self, Rgba};
use super::stream::{Writer, changes};
use crate::run::film::{Film, Frame, ego_state_name};
use closecall_simulation::outcome::{CRITICAL_THW_S, Phase};

/// Width of a curve (UI points).
const LINE_WIDTH: f32 = 2.0;
/// Width of a curve that is less important (UI points).
const THIN_LINE_WIDTH: f32 = 1.0;

/// The role of a film among the films of a recording, which share the plots.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Role {
    /// The only film.
    Alone,
    /// The film to compare with. Its curves are darker.
    Baseline,
    /// The film that is compared with the baseline.
    Tested,
}

/// The names of the plots that have a curve.
pub(super) type PlotNames = Vec<&'static str>;

/// Writes all curves and bands of a film, and returns the names of the plots that have a curve.
pub(super) fn write(writer: &Writer<'_>, film: &Film, role: Role) -> Result<PlotNames, RecordingError> {
    let plots = Plots { writer, film, role, times: film.times() };
    let mut names = PlotNames::new();
    let mut note = |name: &'static str, has_curve: bool| names.extend(has_curve.then_some(name));
    note("headway", plots.headways()?);
    note("gap", plots.gaps()?);
    note("encounter", plots.encounter()?);
    plots.motion()?;
    note("speed", true);
    note("acceleration", true);
    note("margin", plots.margin()?);
    plots.states()?;
    Ok(names)
}

/// The writer of the plots of one film.
struct Plots<'a> {
    writer: &'a Writer<'a>,
    film: &'a Film,
    role: Role,
    times: Vec<Time>,
}

/// Name and style of a curve.
struct CurveStyle<'a> {
    name: &'a str,
    colour: Rgba,
    width: f32,
}

impl Plots<'_> {
    /// Writes a curve whose values `of` reads from the frames. Returns true if it has any value.
    fn curve(
        &self,
        entity: &str,
        style: &CurveStyle<'_>,
        of: impl Fn(&Frame) -> Option<f64>,
    ) -> Result<bool, RecordingError> {
        self.series(entity, style, &self.film.frames.iter().map(of).collect::<Vec<_>>())
    }

    /// Writes a curve of `values`, one per frame. Returns true if it has any value.
    fn series(&self, entity: &str, style: &CurveStyle<'_>, values: &[Option<f64>]) -> Result<bool, RecordingError> {
        if values.iter().all(Option::is_none) {
            return Ok(false);
        }
        self.write_style(entity, style)?;
        self.writer.write_series(entity, &self.times, values)?;
        Ok(true)
    }

    /// Writes name and style of a curve.
    fn write_style(&self, entity: &str, curve: &CurveStyle<'_>) -> Result<(), RecordingError> {
        let name = match self.role {
            Role::Alone => curve.name.to_owned(),
            Role::Baseline | Role::Tested => format!("{} ({})", curve.name, self.film.arm),
        };
        let (colour, width) = match self.role {
            Role::Baseline => (palette::darker(curve.colour), THIN_LINE_WIDTH),
            Role::Alone | Role::Tested => (curve.colour, curve.width),
        };
        let style = SeriesLines::new().with_names([name]).with_colors([colour]).with_widths([width]);
        self.writer.write_static(entity, &style)
    }

    /// Writes a reference level from the first to the last frame. The baseline writes none, since the tested film has
    /// the same.
    fn level(&self, entity: &str, name: &str, level: f64) -> Result<(), RecordingError> {
        if self.role == Role::Baseline {
            return Ok(());
        }
        let style =
            SeriesLines::new().with_names([name]).with_colors([palette::CRITICAL]).with_widths([THIN_LINE_WIDTH]);
        self.writer.write_static(entity, &style)?;
        self.writer.write_series(entity, &self.times, &vec![Some(level); self.times.len()])
    }

    /// Writes the time headways in front of and behind the ego.
    fn headways(&self) -> Result<bool, RecordingError> {
        let front = CurveStyle { name: "front", colour: palette::FRONT, width: LINE_WIDTH };
        let front = self.curve("plots/headway/front", &front, |frame| frame.margins.thw_front_s.ok())?;
        let rear = CurveStyle { name: "rear", colour: palette::REAR, width: LINE_WIDTH };
        let rear = self.curve("plots/headway/rear", &rear, |frame| frame.margins.thw_rear_s.ok())?;
        if front || rear {
            self.level("plots/headway/critical", "0.9 s", CRITICAL_THW_S)?;
        }
        Ok(front || rear)
    }

    /// Writes the gaps in front of and behind the ego, and the rear gap as the MIS estimates it.
    fn gaps(&self) -> Result<bool, RecordingError> {
        let front = CurveStyle { name: "front", colour: palette::FRONT, width: LINE_WIDTH };
        let front = self.curve("plots/gap/front", &front, |frame| frame.margins.gap_front_m.ok())?;
        let rear = CurveStyle { name: "rear", colour: palette::REAR, width: LINE_WIDTH };
        let rear = self.curve("plots/gap/rear", &rear, |frame| frame.margins.gap_rear_m.ok())?;
        let seen = CurveStyle { name: "rear, MIS", colour: palette::NEUTRAL, width: THIN_LINE_WIDTH };
        let seen = self.curve("plots/gap/rear_seen", &seen, |frame| Some(plan(frame)?.rear_gap_m))?;
        Ok(front || rear || seen)
    }

    /// Writes the next closest encounter at the present velocities, in the ground truth and as the MIS estimates it.
    fn encounter(&self) -> Result<bool, RecordingError> {
        let encounters: Vec<Option<Encounter>> =
            (0..self.times.len()).map(|row| self.film.soonest_encounter(row)).collect();
        let of = |of: fn(&Encounter) -> f64| encounters.iter().map(|at| at.as_ref().map(of)).collect::<Vec<_>>();
        let ttce = CurveStyle { name: "TTCE", colour: palette::REAR, width: LINE_WIDTH };
        let has_ttce = self.series("plots/encounter/ttce", &ttce, &of(|encounter| encounter.ttce_s))?;
        // The distance of an encounter that is far ahead says little, so that only near encounters are shown.
        let near = |encounter: &Encounter| (encounter.ttce_s < CRITICAL_TTCE_S).then_some(encounter.dce_m);
        let distances: Vec<_> = encounters.iter().map(|at| at.as_ref().and_then(near)).collect();
        let dce = CurveStyle { name: "DCE if near", colour: palette::WARNING, width: LINE_WIDTH };
        self.series("plots/encounter/dce", &dce, &distances)?;
        let seen = CurveStyle { name: "TTCE, MIS", colour: palette::NEUTRAL, width: THIN_LINE_WIDTH };
        let seen = self.curve("plots/encounter/ttce_seen", &seen, |frame| plan(frame)?.ttce_s.ok())?;
        let planned = CurveStyle { name: "t_c, MIS", colour: palette::EGO, width: THIN_LINE_WIDTH };
        self.curve("plots/encounter/planned", &planned, |frame| plan(frame)?.time_to_critical_s.ok())?;
        if has_ttce || seen {
            self.level("plots/encounter/critical_ttce", "2.6 s", CRITICAL_TTCE_S)?;
            self.level("plots/encounter/critical_dce", "1.0 m", CRITICAL_DCE_M)?;
        }
        Ok(has_ttce || seen)
    }

    /// Writes speeds and accelerations of the vehicles, the commanded acceleration of the ego, and its limits.
    fn motion(&self) -> Result<(), RecordingError> {
        for (index, actor) in self.film.actors.iter().enumerate().filter(|(_, actor)| actor.is_plotted) {
            let colour = palette::actor(index, self.film.ego);
            let style = CurveStyle { name: &actor.name, colour, width: LINE_WIDTH };
            let of = |of: fn(&closecall_traffic::VehicleState) -> f64| {
                let rows = self.film.frames.iter().enumerate();
                rows.map(|(row, frame)| actor.present_frames.contains(&row).then(|| of(&frame.states[index])))
                    .collect::<Vec<_>>()
            };
            self.series(&format!("plots/speed/{}", actor.name), &style, &of(|state| state.speed_mps))?;
            self.series(&format!("plots/acceleration/{}", actor.name), &style, &of(|state| state.acceleration_mps2))?;
        }
        let commanded = CurveStyle { name: "ego, commanded", colour: palette::NEUTRAL, width: THIN_LINE_WIDTH };
        self.curve("plots/acceleration/commanded", &commanded, |frame| Some(frame.command?.acceleration_mps2))?;
        for (number, limit) in self.film.acceleration_limits.iter().enumerate() {
            self.level(&format!("plots/acceleration/limit_{number}"), &limit.name, limit.value)?;
        }
        Ok(())
    }

    /// Writes the front time headway gained since the MIS first engaged, with its goal.
    fn margin(&self) -> Result<bool, RecordingError> {
        let is_increasing = |frame: &&Frame| frame.command.is_some_and(|command| command.state == EgoState::Increasing);
        let first = self.film.frames.iter().find(is_increasing);
        let start = first.and_then(|frame| Some((frame.time, frame.margins.thw_front_s.ok()?, plan(frame))));
        let Some((since, thw_s, planned)) = start else { return Ok(false) };
        let gained = |frame: &Frame, thw: Option<f64>| thw.filter(|_| frame.time >= since).map(|now_s| now_s - thw_s);
        let style = CurveStyle { name: "gained", colour: palette::EGO, width: LINE_WIDTH };
        self.curve("plots/margin/gained", &style, |frame| gained(frame, frame.margins.thw_front_s.ok()))?;
        let style = CurveStyle { name: "foreseen", colour: palette::NEUTRAL, width: THIN_LINE_WIDTH };
        self.curve("plots/margin/foreseen", &style, |frame| gained(frame, plan(frame)?.thw_at_critical_s.ok()))?;
        let goal_s = planned.map(|plan| plan.goal_thw_s - thw_s);
        let style = CurveStyle { name: "goal +2 s", colour: palette::SAFE, width: THIN_LINE_WIDTH };
        self.curve("plots/margin/goal", &style, |frame| goal_s.filter(|_| frame.time >= since))?;
        Ok(true)
    }

    /// Writes the bands: the state of the MIS, the phase, the moments, and the brake lights.
    fn states(&self) -> Result<(), RecordingError> {
        let frames = &self.film.frames;
        if frames.iter().all(|frame| frame.command.is_some()) {
            let state = |frame: &Frame| frame.command.map_or("", |command| ego_state_name(command.state));
            self.band("states/1_mis", &frames.iter().map(state).collect::<Vec<_>>(), &STATE_COLOURS)?;
            let phase = |frame: &Frame| frame.phase.map_or("", phase_name);
            self.band("states/2_encounter", &frames.iter().map(phase).collect::<Vec<_>>(), &PHASE_COLOURS)?;
        }
        self.moments()?;
        for (index, actor) in self.film.actors.iter().enumerate() {
            let braking = frames.iter().map(|frame| frame.states[index].brake_light);
            let words: Vec<&str> = braking.map(|lit| if lit { BRAKES } else { DRIVES }).collect();
            if words.contains(&BRAKES) {
                self.band(&format!("states/4_{}_brake_light", actor.name), &words, &BRAKE_COLOURS)?;
            }
        }
        Ok(())
    }

    /// Writes a band that shows the latest of the moments of the encounter at each time.
    fn moments(&self) -> Result<(), RecordingError> {
        let moments = self.film.moments();
        if moments.is_empty() {
            return Ok(());
        }
        let texts: Vec<String> = moments.iter().map(|noted| noted.moment.label()).collect();
        let latest = |time: Time| moments.iter().rposition(|noted| noted.time <= time);
        let words: Vec<&str> =
            self.times.iter().map(|&time| latest(time).map_or(BEFORE, |index| texts[index].as_str())).collect();
        let colours = texts.iter().enumerate().map(|(index, text)| (text.as_str(), palette::moment(index)));
        self.band(
            "states/3_moments",
            &words,
            &std::iter::once((BEFORE, palette::QUIET)).chain(colours).collect::<Vec<_>>(),
        )
    }

    /// Writes a band with one state name per frame.
    fn band(&self, entity: &str, words: &[&str], colours: &[(&str, Rgba)]) -> Result<(), RecordingError> {
        let configuration = StateConfiguration::new()
            .with_values(colours.iter().map(|(word, _)| *word))
            .with_labels(colours.iter().map(|(word, _)| *word))
            .with_colors(colours.iter().map(|(_, colour)| *colour));
        self.writer.write_static(entity, &configuration)?;
        let rows = changes(words);
        let times: Vec<Time> = rows.iter().map(|&row| self.times[row]).collect();
        self.writer.write_rows(entity, &times, |range| {
            StateChange::new().with_state(rows[range].iter().map(|&row| words[row])).columns_of_unit_batches()
        })
    }
}

/// Returns the plan of the MIS in a frame, if there is one.
fn plan(frame: &Frame) -> Option<MisPlan> {
    frame.command?.plan
}

const BEFORE: &str = "-";
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

const PHASE_COLOURS: [(&str, Rgba); 4] = [
    (phase_name(Phase::Approach), palette::QUIET),
    (phase_name(Phase::Critical), palette::CRITICAL),
    (phase_name(Phase::Overtaking), palette::WARNING),
    (phase_name(Phase::After), palette::NEUTRAL),
];

/// Returns the name of a phase of the encounter.
pub(super) const fn phase_name(phase: Phase) -> &'static str {
    match phase {
        Phase::Approach => "approach",
        Phase::Critical => "critical",
        Phase::Overtaking => "overtaking",
        Phase::After => "after",
    }
}
