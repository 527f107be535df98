//! Bands of states over time, in one view: the ego stack with its reasons, the moments, the
//! collisions, the ego's knowledge, the health of the sensors, the phase, the brake lights.
//!
//! ```text
//!  states/1_ego_stack/mis   states/2_reason/mis   states/3_moments/mis …
//! ```
//!
//! The viewer shows the path of an entity as the name of its row, and orders the rows by it. The
//! rows of the arms of a pair therefore lie below each other.

use std::collections::BTreeMap;

use closecall_controllers::{EgoState, Reason};
use closecall_scenarios::outcome::{Moment, Phase, ReachedMoment};
use closecall_sensors::Health;
use closecall_sensors::faults::{SensorGroup, StatedFault};
use closecall_sensors::monitors::Alarms;
use closecall_traffic::Time;
use rerun::{StateChange, StateConfiguration};

use super::super::RecordingError;
use super::super::palette::{self, Rgba};
use super::super::stream::changes;
use super::{Plots, Role};
use crate::run::film::{Frame, KnownSpan, ego_state_name};

/// Entity of all bands. It lies beside the entities of the arms.
pub(in super::super) const ENTITY: &str = "states";
const BEFORE: &str = "-";
const NO_REAR: &str = "no vehicle behind";
const BRAKES: &str = "on";
const DRIVES: &str = "off";
/// Number of letters in a bar as long as the time axis, in a window of 1280 px (454 px, 6.7 px a
/// letter), and number of letters that its padding takes.
const AXIS_LETTERS: f64 = 68.0;
const PADDING_LETTERS: f64 = 1.5;

/// A state of a band.
#[derive(Clone, Copy)]
struct Word<'a> {
    text: &'a str,
    /// The texts of a bar that is too short for the whole text, each for a bar too short for the
    /// one before.
    shorts: [&'a str; 3],
    colour: Rgba,
}

impl<'a> Word<'a> {
    const fn new(text: &'a str, short: &'a str, colour: Rgba) -> Self {
        Self { text, shorts: [short; 3], colour }
    }

    /// Returns the state with a text for a bar that has no room for the whole text, and room for
    /// more than the short one.
    const fn with_longer(self, longer: &'a str) -> Self {
        Self { shorts: [longer, self.shorts[1], self.shorts[2]], ..self }
    }

    /// Returns the state with a text for a bar that is too short for its other texts.
    const fn with_shortest(self, shortest: &'a str) -> Self {
        Self { shorts: [self.shorts[0], self.shorts[1], shortest], ..self }
    }

    /// Returns the state and the label of a bar with room for this many letters. A bar too short
    /// for the text has a separate state, since the viewer has one label per state.
    fn fitted(&self, letters: f64) -> (String, &'a str) {
        let fits = |label: &str| label.chars().count() as f64 <= letters;
        let [longer, short, shortest] = self.shorts;
        match [self.text, longer, short, shortest].into_iter().position(fits) {
            Some(0) => (self.text.to_owned(), self.text),
            Some(1) => (format!("{} (briefly)", self.text), longer),
            Some(2) => (format!("{} (quite briefly)", self.text), short),
            Some(_) => (format!("{} (very briefly)", self.text), shortest),
            None => (format!("{} (for a moment)", self.text), NO_LABEL),
        }
    }
}

/// The label of a bar that is too short for any letter. In place of an empty label the viewer shows
/// the state.
const NO_LABEL: &str = " ";

const HEALTHY: &str = "healthy";
const DEGRADED: &str = "degraded";
const FAILED: &str = "failed";

/// A group of sensors.
struct HealthRow {
    /// The name of its row.
    row: &'static str,
    /// The health of the group in a frame.
    health: fn(&Frame) -> Option<Health>,
    /// What its monitors have noticed.
    alarms: fn(&Frame) -> Alarms,
    /// The groups of the faults that concern it.
    groups: &'static [SensorGroup],
}

const HEALTH_ROWS: [HealthRow; 5] = [
    HealthRow {
        row: "rear_radars",
        health: |frame| frame.radar_health,
        alarms: |_| Alarms::NONE,
        groups: &[SensorGroup::RearRadars],
    },
    HealthRow {
        row: "rear_sensors",
        health: |frame| frame.health.map(|health| health.rear),
        alarms: |frame| frame.alarms.rear,
        groups: &[SensorGroup::Rear, SensorGroup::RearRadars],
    },
    HealthRow {
        row: "front_sensor",
        health: |frame| frame.health.map(|health| health.front),
        alarms: |frame| frame.alarms.front,
        groups: &[SensorGroup::Front],
    },
    HealthRow {
        row: "side_sensors",
        health: |frame| frame.health.map(|health| health.surround),
        alarms: |frame| frame.alarms.surround,
        groups: &[SensorGroup::Surround],
    },
    // The ego does not know the health of its odometry and map.
    HealthRow { row: "odometry_and_map", health: |_| None, alarms: |_| Alarms::NONE, groups: &[SensorGroup::Odometry] },
];
/// Numbers of the rows of sensors that have a fault at any time, and of all others. A fault is
/// often the cause of what follows, so its row lies beside the row of the reasons, where every
/// window shows it.
const FAULTY_ROW: u8 = 2;
const HEALTHY_ROW: u8 = 7;

const BRAKING: [Word<'static>; 2] =
    [Word::new(BRAKES, BRAKES, palette::BRAKE_LIGHT), Word::new(DRIVES, DRIVES, palette::QUIET)];

const STATES: [Word<'static>; 5] = [
    Word::new(ego_state_name(EgoState::Following), "follow", palette::QUIET),
    Word::new(ego_state_name(EgoState::Increasing), "MIS", palette::EGO),
    Word::new(ego_state_name(EgoState::Holding), "hold", palette::SAFE),
    Word::new(ego_state_name(EgoState::Releasing), "rel.", palette::AFTERWARDS),
    Word::new(ego_state_name(EgoState::EmergencyBraking), "AEB", palette::CRITICAL),
];

const PHASES: [Word<'static>; 5] = [
    Word::new(NO_REAR, "none", palette::QUIET),
    Word::new(phase_name(Phase::Approach), "app.", palette::QUIET),
    Word::new(phase_name(Phase::Critical), "crit.", palette::CRITICAL),
    Word::new(phase_name(Phase::Overtaking), "overt.", palette::WARNING),
    Word::new(phase_name(Phase::After), "after", palette::AFTERWARDS),
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

/// Returns the text of a short bar of a reason. The first words of several reasons are alike.
const fn short_reason(reason: Reason) -> &'static str {
    match reason {
        Reason::NoMis => "no MIS",
        Reason::NotAutomated => "manual",
        Reason::FrontSensorFailed | Reason::SurroundSensorsFailed | Reason::RearSensorsFailed => "not available",
        Reason::NoFront => "no headway",
        Reason::FrontMarginLong => "long enough",
        Reason::NoRear => "none behind",
        Reason::RearUnconfirmed => "not confirmed",
        Reason::RearUnclassified => "not classified",
        Reason::RearFar => "too far",
        Reason::RearNotApproaching => "too slow",
        Reason::NoPassingLane => "no lane",
        Reason::PassingLaneOccupied => "lane occupied",
        Reason::PassingLaneUnknown => "lane unknown",
        Reason::RearFollowed => "followed",
        Reason::Engaged | Reason::EngagedGoalOutOfReach => "engaged",
        Reason::RearCrosses => "crosses",
        Reason::CriticalDistance => "critical",
        Reason::RearChangedLane => "left early",
        Reason::RearPassed => "past",
        Reason::RearFellBack => "fell back",
        Reason::RearFollows => "follows",
        Reason::RearLost => "track lost",
        Reason::FrontLost => "lead lost",
        Reason::HoldExpired => "time over",
        Reason::NoRoomToHold => "no room",
        Reason::MarginReturned => "given back",
        Reason::BrakingRequired => "AEB",
        Reason::BrakingDone => "AEB done",
        Reason::External => "own reason",
    }
}

/// Returns the text of a very short bar of a reason.
const fn shortest_reason(reason: Reason) -> &'static str {
    match reason {
        Reason::NoMis => "off",
        Reason::NotAutomated => "man.",
        Reason::FrontSensorFailed | Reason::SurroundSensorsFailed | Reason::RearSensorsFailed => "n/a",
        Reason::NoFront | Reason::NoRear => "none",
        Reason::FrontMarginLong => "long",
        Reason::RearUnconfirmed | Reason::RearUnclassified => "new",
        Reason::RearFar => "far",
        Reason::RearNotApproaching => "slow",
        Reason::NoPassingLane | Reason::PassingLaneOccupied | Reason::PassingLaneUnknown => "lane",
        Reason::RearFollowed => "next",
        Reason::Engaged | Reason::EngagedGoalOutOfReach => "MIS",
        Reason::RearCrosses | Reason::RearChangedLane => "left",
        Reason::CriticalDistance => "crit",
        Reason::RearPassed => "past",
        Reason::RearFellBack => "back",
        Reason::RearFollows => "foll",
        Reason::RearLost | Reason::FrontLost => "lost",
        Reason::HoldExpired => "time",
        Reason::NoRoomToHold => "room",
        Reason::MarginReturned => "ret.",
        Reason::BrakingRequired | Reason::BrakingDone => "AEB",
        Reason::External => "own",
    }
}

/// Letters of a word that says little alone, such as *no*.
const SHORT_WORD: usize = 3;

/// Returns the text of a short bar: the first word of a text, and the second word if the first says
/// little.
fn first_word(text: &str) -> &str {
    let ends: Vec<usize> = text.match_indices([' ', ':', ',']).map(|(at, _)| at).collect();
    match ends[..] {
        [first, second, ..] if first <= SHORT_WORD => &text[..second],
        [first, ..] if first > SHORT_WORD => &text[..first],
        _ => text,
    }
}

/// Returns the text of a very short bar of the health of sensors.
fn shortest_health(text: &str) -> &'static str {
    match text {
        HEALTHY => "ok",
        text if text.starts_with(DEGRADED) => "deg",
        text if text.starts_with(FAILED) => "out",
        _ => "!",
    }
}

/// Returns the name of an arm as the last part of the path of a row. The viewer shows the path, and
/// writes a backslash before every other character. A plus becomes a word, as `acc+aeb` and
/// `acc-aeb` can be the two arms of a pair.
fn row_name(arm: &str) -> String {
    let is_plain = |letter: char| letter.is_alphanumeric() || matches!(letter, '-' | '.' | '_');
    arm.replace('+', "_with_").chars().map(|letter| if is_plain(letter) { letter } else { '_' }).collect()
}

impl Plots<'_> {
    /// Writes the bands. A band ends with the run.
    pub(super) fn bands(&self) -> Result<(), RecordingError> {
        let frames = &self.film.frames;
        if frames.iter().all(|frame| frame.command.is_some()) {
            let state = |frame: &Frame| frame.command.map_or("", |command| ego_state_name(command.state));
            self.band("1_ego_stack", &frames.iter().map(state).collect::<Vec<_>>(), &STATES)?;
            self.reasons()?;
            self.sight()?;
            self.health()?;
            // Without a vehicle behind there is no encounter that could have a phase.
            let phase = |frame: &Frame| match frame.phase {
                Some(Phase::Approach) if frame.margins.follower.is_none() => NO_REAR,
                phase => phase.map_or("", phase_name),
            };
            self.band("8_encounter", &frames.iter().map(phase).collect::<Vec<_>>(), &PHASES)?;
        }
        self.moments()?;
        self.collisions()?;
        for (index, actor) in self.film.actors.iter().enumerate().filter(|(_, actor)| actor.is_plotted) {
            let braking = frames.iter().map(|frame| frame.states[index].brake_light);
            let words: Vec<&str> = braking.map(|lit| if lit { BRAKES } else { DRIVES }).collect();
            if words.contains(&BRAKES) {
                self.band(&format!("9_brake_light_{}", row_name(&actor.name)), &words, &BRAKING)?;
            }
        }
        Ok(())
    }

    /// Writes a band that shows the reason for the state of the ego stack. A controller from outside
    /// gives none.
    fn reasons(&self) -> Result<(), RecordingError> {
        let reason = |frame: &Frame| frame.command.map_or("", |command| command.reason.text());
        let words: Vec<&str> = self.film.frames.iter().map(reason).collect();
        let says_nothing = words.iter().all(|&word| word == Reason::External.text());
        if says_nothing || self.film.outcome().is_some_and(|outcome| outcome.mis.is_err()) {
            return Ok(());
        }
        let colour = |frame: &Frame| match frame.command.map(|command| command.state) {
            Some(EgoState::Following) | None => palette::QUIET,
            Some(state) => {
                STATES.iter().find(|word| word.text == ego_state_name(state)).map_or(palette::QUIET, |word| word.colour)
            }
        };
        let short = |frame: &Frame| frame.command.map_or("", |command| short_reason(command.reason));
        let frames = self.film.frames.iter().zip(&words);
        let shortest = |frame: &Frame| frame.command.map_or("", |command| shortest_reason(command.reason));
        let states: Vec<Word<'_>> = frames
            .map(|(frame, text)| Word::new(text, short(frame), colour(frame)).with_shortest(shortest(frame)))
            .collect();
        self.band("2_reason", &words, &states)
    }

    /// Writes a band that shows from when on vehicles have collided, and which. The bars of
    /// collisions that follow each other are short, so the bar before the first one names them all.
    fn collisions(&self) -> Result<(), RecordingError> {
        let collisions = self.film.collisions();
        let Some(sentence) = self.film.sentence().filter(|_| !collisions.is_empty()) else { return Ok(()) };
        let texts: Vec<String> = collisions.iter().map(|collision| self.film.struck_text(collision)).collect();
        let latest = |time: Time| collisions.iter().rposition(|collision| collision.time <= time);
        let arrows: Vec<String> =
            collisions.iter().map(|collision| sentence.who(collision).replace(" struck ", " → ")).collect();
        // The bar from each collision on names the collisions until then.
        let until: Vec<String> = (0..texts.len()).map(|last| texts[..=last].join(", then ")).collect();
        let arrows_until: Vec<String> = (0..texts.len()).map(|last| arrows[..=last].join(", then ")).collect();
        let at = collisions.iter().zip(&arrows).map(|(collision, who)| format!("{who} at {:.1} s", collision.time.s()));
        let before = format!("none until {}", at.collect::<Vec<_>>().join(", then "));
        let words: Vec<&str> = self
            .times
            .iter()
            .map(|&time| latest(time).map_or(before.as_str(), |index| until[index].as_str()))
            .collect();
        let states = (0..texts.len()).map(|index| {
            Word::new(&until[index], &arrows_until[index], palette::CRITICAL).with_shortest(&arrows[index])
        });
        let then = format!("then {}", arrows_until[arrows_until.len() - 1]);
        let none = Word::new(&before, &then, palette::QUIET).with_shortest(BEFORE);
        self.band("4_collisions", &words, &states.chain([none]).collect::<Vec<_>>())
    }

    /// Writes a band for each group of sensors that exists, and for odometry and map if they have a
    /// fault: its health as the ego knows it, with the reasons, and injected faults that the ego
    /// has not noticed. The arms of a pair have the same sensors, so the baseline writes none.
    fn health(&self) -> Result<(), RecordingError> {
        if self.role == Role::Baseline {
            return Ok(());
        }
        for HealthRow { row, health, alarms, groups } in HEALTH_ROWS {
            let has_fault = self.film.faults.iter().any(|fault| groups.contains(&fault.group));
            if !has_fault && self.film.frames.iter().all(|frame| health(frame).is_none()) {
                continue;
            }
            let held = |time: Time| -> Vec<&StatedFault> {
                let concerns = |fault: &&StatedFault| groups.contains(&fault.group) && fault.holds_at(time);
                self.film.faults.iter().filter(concerns).collect()
            };
            let text = |frame: &Frame| {
                let held = held(frame.time).into_iter();
                let effects: Vec<String> = held.map(|fault| format!("{} {}", fault.sensor, fault.effects)).collect();
                let suffix = if effects.is_empty() { String::new() } else { format!(": {}", effects.join("; ")) };
                let alarms = alarms(frame);
                let reasons = if alarms.is_empty() { String::new() } else { format!(", as {alarms}") };
                match health(frame) {
                    Some(Health::Failed) => format!("{FAILED}{reasons}{suffix}"),
                    Some(Health::Degraded) => format!("{DEGRADED}{reasons}{suffix}"),
                    Some(Health::Ok) | None if effects.is_empty() => HEALTHY.to_owned(),
                    Some(Health::Ok) | None => format!("faulty, not noticed{suffix}"),
                }
            };
            let texts: Vec<String> = self.film.frames.iter().map(text).collect();
            let words: Vec<&str> = texts.iter().map(String::as_str).collect();
            let colour = |word: &str| match word {
                HEALTHY => palette::SAFE,
                word if word.starts_with(FAILED) => palette::CRITICAL,
                _ => palette::WARNING,
            };
            let rows = changes(&words);
            // A group has several sensors, so that a bar names the faulty one first.
            let named = |row: &usize| {
                let held = held(self.film.frames[*row].time);
                let mut sensors: Vec<&str> = held.into_iter().map(|fault| fault.sensor.as_str()).collect();
                sensors.dedup();
                let state = first_word(words[*row]);
                if sensors.is_empty() { state.to_owned() } else { format!("{state}: {}", sensors.join(", ")) }
            };
            let named: Vec<String> = rows.iter().map(named).collect();
            let states: Vec<Word<'_>> = rows
                .iter()
                .zip(&named)
                .map(|(&row, named)| {
                    Word::new(words[row], first_word(words[row]), colour(words[row]))
                        .with_longer(named)
                        .with_shortest(shortest_health(words[row]))
                })
                .collect();
            let number = if words.iter().all(|&word| word == HEALTHY) { HEALTHY_ROW } else { FAULTY_ROW };
            self.band(&format!("{number}_{row}"), &words, &states)?;
        }
        Ok(())
    }

    /// Writes a band that shows the ego's knowledge of the vehicle behind it.
    fn sight(&self) -> Result<(), RecordingError> {
        let spans = self.film.known_spans();
        let texts: Vec<String> = spans.iter().map(KnownSpan::words).collect();
        let span_at = |row: usize| spans.iter().rposition(|span| span.first_frame <= row);
        let words: Vec<&str> =
            (0..self.times.len()).map(|row| span_at(row).map_or("", |index| texts[index].as_str())).collect();
        let shorts: Vec<String> = spans.iter().map(KnownSpan::short_words).collect();
        let colour = |span: &KnownSpan| if span.from_m.is_some() { palette::SAFE } else { palette::QUIET };
        let states: Vec<Word<'_>> =
            (0..spans.len()).map(|index| Word::new(&texts[index], &shorts[index], colour(&spans[index]))).collect();
        self.band("6_vehicle_behind", &words, &states)
    }

    /// Writes a band that shows the latest of the moments of the encounter at each time.
    fn moments(&self) -> Result<(), RecordingError> {
        let moments = self.film.moments();
        if moments.is_empty() {
            return Ok(());
        }
        let texts: Vec<String> = moments.iter().map(|noted| self.film.letters.moment_label(noted)).collect();
        let short = |noted: &ReachedMoment| match (noted.moment.letter(), noted.moment) {
            (Some(letter), _) => format!("({letter})"),
            (None, Moment::Concluded) => "past".to_owned(),
            (None, _) => "left".to_owned(),
        };
        let short: Vec<String> = moments.iter().map(short).collect();
        let latest = |time: Time| moments.iter().rposition(|noted| noted.time <= time);
        let words: Vec<&str> =
            self.times.iter().map(|&time| latest(time).map_or(BEFORE, |index| texts[index].as_str())).collect();
        let states = (0..moments.len())
            .map(|index| Word::new(&texts[index], &short[index], palette::moment(moments[index].moment)))
            .chain([Word::new(BEFORE, BEFORE, palette::QUIET)]);
        self.band("3_moments", &words, &states.collect::<Vec<_>>())
    }

    /// Writes a band with one state per frame, and its end after the last frame. A bar shows as
    /// much of the state's name as fits.
    ///
    /// The viewer fits its time axis to the rows that it has loaded when it draws first, so each
    /// row has an empty state at the end of the recording.
    fn band(&self, row: &str, words: &[&str], states: &[Word<'_>]) -> Result<(), RecordingError> {
        let entity = format!("{ENTITY}/{row}/{}", row_name(self.film.arm_label()));
        let rows = changes(words);
        let end = self.film.end() + self.film.period;
        let mut times: Vec<Time> = rows.iter().map(|&row| self.times[row]).chain([end]).collect();
        let (mut shown, mut bars) = (Vec::new(), BTreeMap::new());
        for (&row, span) in rows.iter().zip(times.windows(2)) {
            let word = states.iter().find(|state| state.text == words[row]).copied();
            let word = word.unwrap_or(Word::new(words[row], words[row], palette::QUIET));
            let letters = AXIS_LETTERS * self.writer.share_of_run(span[1] - span[0]) - PADDING_LETTERS;
            let (state, label) = word.fitted(letters);
            bars.insert(state.clone(), (label, word.colour));
            shown.push(state);
        }
        shown.push(String::new());
        if self.writer.end() > end {
            times.push(self.writer.end());
            shown.push(String::new());
        }
        let configuration = StateConfiguration::new()
            .with_values(bars.keys().map(String::as_str))
            .with_labels(bars.values().map(|(label, _)| *label))
            .with_colors(bars.values().map(|(_, colour)| palette::bar(*colour)));
        self.writer.write_static_of_all(&entity, &configuration)?;
        self.writer.write_curve_of_all(&entity, &times, |range| {
            StateChange::new().with_state(shown[range].iter().map(String::as_str)).columns_of_unit_batches()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bar_shows_as_much_of_a_state_as_it_has_room_for() {
        let state = STATES[1];
        assert_eq!(state.fitted(19.0), ("increasing the margin (briefly)".to_owned(), "MIS"));
        assert_eq!(state.fitted(21.0), ("increasing the margin".to_owned(), "increasing the margin"));
        assert_eq!(state.fitted(2.9), ("increasing the margin (for a moment)".to_owned(), NO_LABEL));
        let state = Word::new("degraded, as too few returns", "degraded", palette::WARNING).with_shortest("deg");
        assert_eq!(state.fitted(4.0), ("degraded, as too few returns (very briefly)".to_owned(), "deg"));
        assert_eq!(state.fitted(8.0).1, "degraded");
        let state = state.with_longer("degraded: rear camera");
        assert_eq!(state.fitted(21.0).1, "degraded: rear camera");
        assert_eq!(state.fitted(20.0), ("degraded, as too few returns (quite briefly)".to_owned(), "degraded"));
        assert_eq!(state.fitted(4.0).1, "deg");
    }

    #[test]
    fn a_row_name_has_no_character_that_the_viewer_escapes() {
        assert_eq!(row_name("with MIS"), "with_MIS");
        assert_eq!(row_name("acc+aeb"), "acc_with_aeb");
        assert_eq!(row_name("acc-aeb"), "acc-aeb");
        assert_eq!(row_name("gap-1.6"), "gap-1.6");
        assert_eq!(row_name("lib:own/é.so"), "lib_own_é.so");
    }
}
