//! Serves a library or an FMU as a process that speaks the protocol of external processes: one line
//! of JSON for each control step. `docs/reference/controllers.md` documents the protocol.

use std::io::{BufRead, Write};

use closecall_traffic::Time;
use serde::Deserialize;
use serde_json::{Value, json};

use crate::EgoState;
use crate::external::abi::Track;
use crate::external::controller::Session;
use crate::external::exchange::{Answer, Input, Setup, step_values};
use crate::external::fmu::VariableTable;
use crate::external::loaded::Loaded;
use crate::external::message::{RoadMessage, StepMessage};

/// The key under which an answer says why there is none.
pub const ERROR_KEY: &str = "error";

#[derive(Deserialize)]
#[serde(tag = "type", rename_all = "kebab-case")]
enum Message {
    Hello {
        settings: Value,
        road: RoadMessage,
    },
    Step(Box<StepMessage>),
    /// The run has ended: its controller is freed.
    End,
}

/// Answers every message of `requests` with a line to `answers`, until there are no more. The table
/// names the variables of an FMU.
///
/// # Errors
/// The message of the failure, after which the process is to end.
pub fn serve(
    loaded: &Loaded,
    table: &VariableTable,
    requests: impl BufRead,
    mut answers: impl Write,
) -> Result<(), String> {
    let mut setup = Setup::of_settings(&Value::Null);
    let mut session = Session::default();
    for line in requests.lines() {
        let line = line.map_err(|error| format!("failed to read a message: {error}"))?;
        let message: Message =
            serde_json::from_str(&line).map_err(|error| format!("failed to read `{line}`: {error}"))?;
        let answer = match message {
            Message::Hello { settings, road } => {
                setup = Setup::on_road(&settings, road);
                let identity = loaded.identity();
                json!({ "type": "hello", "protocol": 1, "name": identity.name, "version": identity.version })
                    .to_string()
            }
            Message::Step(step) => {
                let StepMessage { time_ns, odometry, front, tracks, sensors, .. } = *step;
                let values = step_values(Time::from_ns(time_ns), &odometry, front.as_ref(), sensors);
                let input = Input::with(values, tracks.iter().map(Track::from).collect());
                match session.step((loaded, table), || setup.clone(), &input) {
                    Ok(answer) => text(answer, time_ns),
                    Err(reason) => json!({ "time_ns": time_ns, ERROR_KEY: reason }).to_string(),
                }
            }
            Message::End => {
                let finished = session.finish(Time::ZERO);
                session = Session::default();
                match finished {
                    Ok(()) => json!({ "type": "end" }).to_string(),
                    Err(reason) => json!({ ERROR_KEY: reason }).to_string(),
                }
            }
        };
        let written = writeln!(answers, "{answer}").and_then(|()| answers.flush());
        written.map_err(|error| format!("failed to answer: {error}"))?;
    }
    Ok(())
}

/// Returns an answer as a line, which repeats the time of its control step (ns). JSON has no number
/// that is not finite: it is written as a word, which the reader refuses by name.
fn text(Answer { acceleration_mps2, state }: Answer, time_ns: i64) -> String {
    let number = match acceleration_mps2.is_finite() {
        true => json!(acceleration_mps2).to_string(),
        false => acceleration_mps2.to_string(),
    };
    let state = serde_json::to_value::<EgoState>(state).unwrap_or_default();
    format!("{{\"acceleration_mps2\":{number},\"state\":{state},\"time_ns\":{time_ns}}}")
}
