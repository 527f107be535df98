//! A recording that plays in a viewer in a loop: the seconds around its critical moments, over and
//! over, with a cursor in every plot.
//!
//! ```text
//!  file ─▶ messages ─▶ layout, time panel with the loop, activation of the layout ─▶ rest ─▶ viewer that runs
//! ```
//!
//! The viewer ignores a selection of time in a file, and keeps a selection that it is sent. So the
//! messages of the file are sent to the viewer, and the loop with them. The time panel must precede
//! the message that makes the layout the active one: the viewer copies the layout then.

use std::io::BufReader;
use std::path::Path;
use std::time::Duration;

use arrow::array::{Array, AsArray, Float64Array, ListArray};
use arrow::datatypes::Float64Type;
use closecall_traffic::{Time, input};
use rerun::blueprint::components::{LoopMode, PanelState, PlayState, TimelineName};
use rerun::log::LogMsg;
use rerun::sink::{GrpcSink, LogSink as _};
use rerun::{EntityPath, StoreKind, TimeColumn};

use super::RecordingError;
use super::blueprint::BLUEPRINT_TIMELINE;
use super::parts::{AbsoluteTimeRange, Decoder, ProxyUri, TimePanelBlueprint};
use super::properties::CRITICAL_MOMENT;
use super::recording::Stream;
use super::stream::TIME_TIMELINE;

/// Time before and after the critical moments that is played.
const BEFORE: Time = Time::from_ms(5_000);
const AFTER: Time = Time::from_ms(3_000);
/// Time within which the viewer takes the recording.
const SEND_TIME: Duration = Duration::from_secs(20);

/// A recording with its loop.
#[derive(Debug)]
pub struct LoopedRecording {
    messages: Vec<LogMsg>,
    span: [Time; 2],
}

impl LoopedRecording {
    /// Reads a recording. `None` if it cannot be read, or has no critical moment.
    pub fn read(path: &Path) -> Option<Self> {
        let messages = Decoder::decode_lazy(BufReader::new(input::open(path).ok()?));
        let messages = messages.collect::<Result<Vec<LogMsg>, _>>().ok()?;
        let critical: Vec<Time> = messages.iter().flat_map(critical_moments).map(Time::from_s).collect();
        let span = [*critical.iter().min()? - BEFORE, *critical.iter().max()? + AFTER];
        Some(Self { messages, span: span.map(|time| time.max(Time::ZERO)) })
    }

    /// Sends the recording to the viewer that listens on this port of the machine.
    ///
    /// # Errors
    /// [`RecordingError`] if the viewer does not take it.
    pub fn send(self, port: u16) -> Result<(), RecordingError> {
        let uri: ProxyUri = format!("rerun+http://127.0.0.1:{port}/proxy").parse().map_err(RecordingError::send)?;
        let sink = GrpcSink::new(uri);
        for message in self.with_loop()? {
            sink.send(message);
        }
        sink.flush_blocking(SEND_TIME).map_err(RecordingError::send)
    }

    /// Returns the messages with the message of the loop.
    pub(super) fn with_loop(self) -> Result<Vec<LogMsg>, RecordingError> {
        let mut messages = Vec::with_capacity(self.messages.len() + 1);
        for message in self.messages {
            if let LogMsg::BlueprintActivationCommand(command) = &message {
                let stream = Stream::new(&command.blueprint_id)?;
                let time = TimeColumn::new_sequence(BLUEPRINT_TIMELINE, [1]);
                stream.send(EntityPath::from("time_panel"), time, &panel(self.span))?;
                messages.extend(stream.taken()?.into_iter().filter(|message| matches!(message, LogMsg::ArrowMsg(..))));
            }
            messages.push(message);
        }
        Ok(messages)
    }
}

fn panel([from, until]: [Time; 2]) -> TimePanelBlueprint {
    let range = AbsoluteTimeRange { min: from.ns().into(), max: until.ns().into() };
    TimePanelBlueprint::new()
        .with_state(PanelState::Collapsed)
        .with_timeline(TimelineName(TIME_TIMELINE.into()))
        .with_play_state(PlayState::Playing)
        .with_loop_mode(LoopMode::Selection)
        .with_time_selection(range)
}

/// Returns the critical moments that a message states (s): the properties of each arm have one.
fn critical_moments(message: &LogMsg) -> Vec<f64> {
    let LogMsg::ArrowMsg(id, rows) = message else { return Vec::new() };
    if id.kind() != StoreKind::Recording {
        return Vec::new();
    }
    let schema = rows.batch.schema();
    let is_meant = |name: &str| name.rsplit([':', '/']).next() == Some(CRITICAL_MOMENT);
    let columns = schema.fields().iter().zip(rows.batch.columns()).filter(|(field, _)| is_meant(field.name()));
    columns.flat_map(|(_, column)| numbers(column.as_ref())).collect()
}

/// Returns the numbers of a column, or of the lists in it.
fn numbers(column: &dyn Array) -> Vec<f64> {
    let flattened = |values: &Float64Array| values.iter().flatten().collect();
    match column.as_any().downcast_ref::<ListArray>() {
        Some(lists) => lists.values().as_primitive_opt::<Float64Type>().map_or_else(Vec::new, flattened),
        None => column.as_primitive_opt::<Float64Type>().map_or_else(Vec::new, flattened),
    }
}
