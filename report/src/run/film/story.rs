//! The story of a film: its events as a few sentences.

use closecall_controllers::{DriverNote, EgoState};
use closecall_traffic::Time;

use super::{Film, headway_text};
use crate::run::text::touch_text;
use closecall_scenarios::causal::unlettered;
use closecall_scenarios::outcome::Collision;
use closecall_simulation::RunEvent;

/// One sentence of the story.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct StoryLine {
    pub(crate) time: Time,
    pub(crate) text: String,
    /// True for the most severe events: a collision, or an emergency braking of the ego.
    pub(crate) is_severe: bool,
}

impl Film {
    /// Returns a summary of how the film ends.
    pub fn headline(&self) -> String {
        let Some(outcome) = &self.outcome else {
            return format!("Recorded traffic: the critical instant is at {:.2} s.", self.critical_moment().s());
        };
        match self.worst_collision() {
            Some(collision) => {
                let more = match outcome.collisions.len() {
                    1 => String::new(),
                    count => format!(" It was one of {count} collisions."),
                };
                format!("COLLISION at {:.2} s: {}.{more}", collision.time.s(), self.collision_text(collision))
            }
            None => {
                let margin = |name: &str, value: closecall_traffic::Measured| match value {
                    Ok(thw_s) => format!(" Smallest {name} headway {}.", headway_text(thw_s)),
                    Err(_) => String::new(),
                };
                let margins = &outcome.margins;
                format!(
                    "No collision.{}{}",
                    margin("front", margins.min_thw_front_s),
                    margin("rear", margins.min_thw_rear_s)
                )
            }
        }
    }

    /// Returns a summary of the actions of the margin increase system and their reasons, or `None`
    /// if the arm has no such system.
    pub fn mis_summary(&self) -> Option<String> {
        let mis = self.outcome.as_ref()?.mis.as_ref().ok()?;
        Some(match mis.engaged_at_s {
            Ok(engaged_at_s) => {
                let gained = match (mis.thw_front_at_engagement_s, mis.thw_front_at_critical_s) {
                    (Ok(before_s), Ok(after_s)) => format!(
                        " It raised the front headway from {before_s:.2} s to {after_s:.2} s by the time the vehicle \
                         behind was at the critical distance."
                    ),
                    _ => String::new(),
                };
                format!("The MIS engaged at {engaged_at_s:.2} s ({}).{gained}", mis.reason)
            }
            Err(_) => format!("The MIS never engaged ({}).", mis.reason_words()),
        })
    }

    /// Returns the events of the film in order of time, one line each.
    pub(crate) fn story(&self) -> Vec<StoryLine> {
        let happenings = self.happenings.iter().filter_map(|(time, event)| self.line(*time, event));
        let moments = self.moments().iter().map(|noted| StoryLine {
            time: noted.time,
            text: self.letters.moment_label(noted),
            is_severe: false,
        });
        let notes =
            self.notes.iter().map(|(time, text)| StoryLine { time: *time, text: text.clone(), is_severe: false });
        let spans = self.known_spans().into_iter().filter(|span| span.time > self.frames[0].time).map(|span| {
            StoryLine { time: span.time, text: format!("vehicle behind the ego: {}", span.words()), is_severe: false }
        });
        let mut lines: Vec<StoryLine> = happenings.chain(moments).chain(notes).chain(spans).collect();
        lines.sort_by_key(|line| line.time);
        lines
    }

    fn line(&self, time: Time, event: &RunEvent) -> Option<StoryLine> {
        let plain = |text: String| Some(StoryLine { time, text, is_severe: false });
        match event {
            RunEvent::EventTriggered { event } => plain(format!("the scenario's event `{event}` sets in")),
            RunEvent::DriverNote { actor, note } => {
                plain(format!("{} {}", unlettered(&self.actors[*actor].name), driver_note_text(*note)))
            }
            RunEvent::EgoStateChanged { to, reason, .. } => {
                let text = format!("ego: {} ({reason})", ego_state_name(*to));
                Some(StoryLine { time, text, is_severe: *to == EgoState::EmergencyBraking })
            }
            RunEvent::PhaseChanged { .. } => None,
            RunEvent::Touch(touch) => plain(touch_text(touch)),
            RunEvent::Collision(reported) => {
                let text = format!("COLLISION: {}", self.collision_text(self.collision_in_outcome(reported)));
                Some(StoryLine { time, text, is_severe: true })
            }
        }
    }

    /// Returns the collision `reported` with the values of the outcome, or `reported` itself if the
    /// outcome lacks it.
    ///
    /// A collision is reported at first contact, before the changes of velocity are known. The
    /// outcome has them.
    pub(crate) fn collision_in_outcome<'a>(&'a self, reported: &'a Collision) -> &'a Collision {
        let same = |collision: &&Collision| collision.time == reported.time && collision.between == reported.between;
        self.collisions().iter().find(same).unwrap_or(reported)
    }
}

/// Returns a driver's action, as a phrase that follows the name of its vehicle.
pub(crate) fn driver_note_text(note: DriverNote) -> &'static str {
    match note {
        DriverNote::CutOutStarted => "begins to change lanes to overtake",
        DriverNote::CutOutAborted => "gives up the lane change",
        DriverNote::Passed => "has passed",
        DriverNote::EmergencyBraking => "brakes as strongly as possible",
    }
}

/// Returns the name of a state of the ego stack.
pub(crate) const fn ego_state_name(state: EgoState) -> &'static str {
    match state {
        EgoState::Following => "following",
        EgoState::Increasing => "increasing the margin",
        EgoState::Holding => "holding",
        EgoState::Releasing => "releasing",
        EgoState::EmergencyBraking => "emergency braking",
    }
}
