//! The text log: every event at the time at which it happened. Its lines have the colour of the
//! viewer's theme.

use std::collections::BTreeMap;

use closecall_traffic::Time;
use rerun::{TextLog, TextLogLevel};

use super::RecordingError;
use super::plots::phase_name;
use super::stream::Writer;
use crate::run::film::{Film, KnownSpan, driver_note_text, ego_state_name};
use crate::run::text::touch_text;
use closecall_scenarios::causal::unlettered;
use closecall_simulation::RunEvent;

/// One line of the log.
struct Line {
    time: Time,
    entity: &'static str,
    level: &'static str,
    text: String,
}

/// Writes the log of a film. Unless the film is the only one of the recording, each line begins
/// with the name of its arm.
pub(super) fn write(writer: &Writer<'_>, film: &Film, is_alone: bool) -> Result<(), RecordingError> {
    let start = film.frames.first().map_or(Time::ZERO, |frame| frame.time);
    let plain = |entity, time, text| Line { time, entity, level: TextLogLevel::INFO, text };
    let mut lines = vec![plain("log/run", start, film.title.clone())];
    lines.extend(film.happenings.iter().map(|(time, event)| line(film, *time, event)));
    lines.extend(film.moments().iter().map(|noted| {
        let text = film.letters.moment_label(noted);
        plain("log/moment", noted.time, text)
    }));
    lines.extend(sight_lines(film));
    lines.extend(reasons(film));
    lines.extend(film.notes.iter().map(|(time, text)| plain("log/note", *time, text.clone())));
    lines.push(plain("log/critical", film.critical_frame_time(), "the critical moment".to_owned()));
    let end = if film.outcome().is_some() { "the run ends here" } else { "the recorded stretch ends here" };
    lines.push(plain("log/run", film.end(), end.to_owned()));
    // The lines of an entity make up one chunk.
    let mut of_entity: BTreeMap<&str, Vec<Line>> = BTreeMap::new();
    for line in lines {
        of_entity.entry(line.entity).or_default().push(line);
    }
    let arm = if is_alone { String::new() } else { format!("[{}] ", film.arm_label()) };
    for (entity, lines) in of_entity {
        let times: Vec<Time> = lines.iter().map(|line| line.time).collect();
        writer.write_curve(entity, &times, |_| {
            TextLog::update_fields()
                .with_many_text(lines.iter().map(|line| format!("{arm}{}", line.text)))
                .with_many_level(lines.iter().map(|line| line.level))
                .columns_of_unit_batches()
        })?;
    }
    Ok(())
}

/// Returns a line for each time at which a vehicle behind the ego came into sight or was lost.
fn sight_lines(film: &Film) -> Vec<Line> {
    let line = |span: KnownSpan| Line {
        time: span.time,
        entity: "log/sight",
        level: TextLogLevel::INFO,
        text: format!("vehicle behind the ego: {}", span.words()),
    };
    film.known_spans().into_iter().map(line).collect()
}

/// Returns a line for each change of the reason that the ego's controller gives without changing
/// its state.
fn reasons(film: &Film) -> Vec<Line> {
    let mut lines = Vec::new();
    for pair in film.frames.windows(2) {
        let (Some(before), Some(now)) = (pair[0].command, pair[1].command) else { continue };
        if before.reason == now.reason || before.state != now.state {
            continue;
        }
        lines.push(Line {
            time: pair[1].time,
            entity: "log/reason",
            level: TextLogLevel::INFO,
            text: format!("ego: {}, since {}", ego_state_name(now.state), now.reason),
        });
    }
    lines
}

/// Returns the log line of an event.
fn line(film: &Film, time: Time, event: &RunEvent) -> Line {
    let info = |entity, text| Line { time, entity, level: TextLogLevel::INFO, text };
    let warn = |entity, text| Line { time, entity, level: TextLogLevel::WARN, text };
    match event {
        RunEvent::EventTriggered { event } => warn("log/event", format!("event `{event}` sets in")),
        RunEvent::DriverNote { actor, note } => {
            let name = film.actors.get(*actor).map_or("?", |actor| unlettered(&actor.name));
            info("log/driver", format!("{name} {}", driver_note_text(*note)))
        }
        RunEvent::EgoStateChanged { from, to, reason } => {
            let text = format!("ego: {} -> {} ({reason})", ego_state_name(*from), ego_state_name(*to));
            info("log/ego", text)
        }
        RunEvent::PhaseChanged { to } => info("log/phase", format!("phase: {}", phase_name(*to))),
        RunEvent::Touch(touch) => warn("log/touch", touch_text(touch)),
        RunEvent::Collision(reported) => {
            let text = format!("COLLISION: {}", film.collision_text(film.collision_in_outcome(reported)));
            Line { time, entity: "log/collision", level: TextLogLevel::ERROR, text }
        }
    }
}
