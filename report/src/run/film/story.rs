//! What happened, told in a few sentences that follow from the film alone.

use closecall_controllers::{DriverNote, EgoState};
use closecall_traffic::Time;

use super::Film;
use closecall_simulation::Happening;
use closecall_simulation::outcome::Collision;

/// One sentence of the story.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Line {
    pub(crate) time: Time,
    pub(crate) text: String,
    /// True where this is what the run will be remembered for.
    pub(crate) is_grave: bool,
}

impl Film {
    /// How it ended, in one sentence.
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
                format!("COLLISION at {:.2} s: {}.{more}", collision.time.s(), collision_text(collision))
            }
            None => {
                let margin = |name: &str, value: closecall_traffic::Measured| match value {
                    Ok(thw_s) => format!(" Smallest {name} headway {thw_s:.2} s."),
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

    /// Why the margin increase system acted, or did not, in one sentence; nothing where the arm has none.
    pub fn verdict_on_mis(&self) -> Option<String> {
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
            Err(_) => format!("The MIS never engaged ({}).", mis.reason),
        })
    }

    /// The course of events, one line for each that matters.
    pub(crate) fn story(&self) -> Vec<Line> {
        let told = self.happenings.iter().filter_map(|(time, what)| self.line(*time, what));
        let moments = self.moments().iter().map(|noted| Line {
            time: noted.time,
            text: format!("({}) {}", noted.moment.letter(), noted.moment.text()),
            is_grave: false,
        });
        let notes = self.notes.iter().map(|(time, text)| Line { time: *time, text: text.clone(), is_grave: false });
        let mut lines: Vec<Line> = told.chain(moments).chain(notes).collect();
        lines.sort_by_key(|line| line.time);
        lines
    }

    fn line(&self, time: Time, what: &Happening) -> Option<Line> {
        let plain = |text: String| Some(Line { time, text, is_grave: false });
        match what {
            Happening::EventTriggered { event } => plain(format!("the scenario's event `{event}` sets in")),
            Happening::DriverNote { actor, note } => plain(format!("{} {}", self.cast[*actor].name, note_words(*note))),
            Happening::EgoStateChanged { to, reason, .. } => {
                let text = format!("E: {} ({reason})", state_word(*to));
                Some(Line { time, text, is_grave: *to == EgoState::EmergencyBraking })
            }
            Happening::PhaseChanged { .. } => None,
            Happening::Collision(touch) => {
                let text = format!("COLLISION: {}", collision_text(self.settled(touch)));
                Some(Line { time, text, is_grave: true })
            }
        }
    }

    /// When a collision is reported, the impact is not over; the outcome has its change of velocity.
    pub(crate) fn settled<'a>(&'a self, touch: &'a Collision) -> &'a Collision {
        let same = |collision: &&Collision| collision.time == touch.time && collision.between == touch.between;
        self.collisions().iter().find(same).unwrap_or(touch)
    }
}

/// What a driver did.
pub(crate) fn note_words(note: DriverNote) -> &'static str {
    match note {
        DriverNote::CutOutStarted => "begins to change lanes to overtake",
        DriverNote::CutOutAborted => "gives up the lane change",
        DriverNote::Passed => "has passed",
        DriverNote::EmergencyBraking => "brakes as hard as possible",
    }
}

/// What a state of the ego stack is called.
pub(crate) const fn state_word(state: EgoState) -> &'static str {
    match state {
        EgoState::Following => "following",
        EgoState::Increasing => "increasing the margin",
        EgoState::Holding => "holding",
        EgoState::Releasing => "releasing",
        EgoState::EmergencyBraking => "emergency braking",
    }
}

/// Who touched whom, how fast, and what it did to each.
pub(crate) fn collision_text(collision: &Collision) -> String {
    let [first, second] = &collision.between;
    format!(
        "{first} and {second} at {:.1} m/s (ΔV {first} {:.1} m/s, {second} {:.1} m/s)",
        collision.relative_speed_mps, collision.delta_v_mps[0], collision.delta_v_mps[1]
    )
}
