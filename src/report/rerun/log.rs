//! What happened, in words, at the moment it happened.

use closecall_controllers::DriverNote;
use closecall_traffic::Time;
use rerun::{TextLog, TextLogLevel};

use super::RecordError;
use super::film::Film;
use super::palette::{self, Rgba};
use super::plots::{phase_word, state_word};
use super::stream::Writer;
use crate::outcome::Collision;
use crate::simulation::Happening;

/// One line of the log.
struct Line {
    time: Time,
    entity: &'static str,
    level: &'static str,
    colour: Rgba,
    text: String,
}

pub(super) fn write(writer: &Writer<'_>, film: &Film<'_>) -> Result<(), RecordError> {
    let begin = Line {
        time: Time::ZERO,
        entity: "log/run",
        level: TextLogLevel::INFO,
        colour: palette::NEUTRAL,
        text: film.title.to_owned(),
    };
    let happened = film.happenings.iter().map(|(time, what)| line(film, *time, what));
    for line in std::iter::once(begin).chain(happened) {
        let row = TextLog::new(line.text).with_level(line.level).with_color(line.colour);
        writer.rows(line.entity, &[line.time], |_| row.clone().columns_of_unit_batches())?;
    }
    Ok(())
}

fn line(film: &Film<'_>, time: Time, what: &Happening) -> Line {
    let info = |entity, colour, text| Line { time, entity, level: TextLogLevel::INFO, colour, text };
    let warn = |entity, colour, text| Line { time, entity, level: TextLogLevel::WARN, colour, text };
    match what {
        Happening::EventTriggered { event } => warn("log/event", palette::WARNING, format!("event `{event}` sets in")),
        Happening::DriverNote { actor, note } => {
            let name = film.scenario.actors.get(*actor).map_or("?", |actor| actor.id.as_str());
            let colour = palette::actor(*actor, film.scenario.ego);
            info("log/driver", colour, format!("{name} {}", note_words(*note)))
        }
        Happening::EgoStateChanged { from, to, reason } => {
            let text = format!("ego: {} -> {} ({reason})", state_word(*from), state_word(*to));
            info("log/ego", palette::EGO, text)
        }
        Happening::PhaseChanged { to } => info("log/phase", palette::NEUTRAL, format!("phase: {}", phase_word(*to))),
        Happening::Collision(touch) => {
            // When it was reported, the impact was not over; the outcome has its change of velocity.
            let settled = film
                .outcome
                .collisions
                .iter()
                .find(|collision| collision.time == touch.time && collision.between == touch.between);
            let text = collision_text(settled.unwrap_or(touch));
            Line { time, entity: "log/collision", level: TextLogLevel::ERROR, colour: palette::CRITICAL, text }
        }
    }
}

fn note_words(note: DriverNote) -> &'static str {
    match note {
        DriverNote::CutOutStarted => "begins to change lanes to overtake",
        DriverNote::CutOutAborted => "gives up the lane change",
        DriverNote::Passed => "has passed",
        DriverNote::EmergencyBraking => "brakes as hard as possible",
    }
}

/// Who touched whom, how fast, and what it did to each.
pub(super) fn collision_text(collision: &Collision) -> String {
    let [first, second] = &collision.between;
    format!(
        "collision of {first} and {second} at {:.1} m/s: ΔV {first} {:.1} m/s, {second} {:.1} m/s",
        collision.relative_speed_mps, collision.delta_v_mps[0], collision.delta_v_mps[1]
    )
}
