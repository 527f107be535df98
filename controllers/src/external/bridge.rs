//! Serves a library or an FMU as a process that speaks the protocol of external processes: one line
//! of JSON for each control step. `docs/reference/controllers.md` documents the protocol.

use std::io::{BufRead, Write};

use crate::EgoState;
use closecall_traffic::{Side, Source, TrackStatus};
use serde::Deserialize;
use serde_json::{Value, json};

use crate::external::abi::{InputView, Track};
use crate::external::controller::Session;
use crate::external::exchange::{Answer, Input, Setup};
use crate::external::fmu::VariableTable;
use crate::external::loaded::Loaded;

#[derive(Deserialize)]
#[serde(tag = "type", rename_all = "kebab-case")]
enum Message {
    Hello(Box<Hello>),
    Step(Box<Step>),
    /// The run has ended: its controller is freed.
    End,
}

#[derive(Deserialize)]
struct Hello {
    settings: Value,
    road: Road,
}

#[derive(Deserialize)]
struct Road {
    lanes: u32,
    lane_width_m: f64,
    curvature_per_m: f64,
    speed_limit_mps: f64,
    overtaking_side: Side,
}

#[derive(Deserialize)]
struct Step {
    time_s: f64,
    time_ns: i64,
    odometry: Odometry,
    front: Option<Front>,
    tracks: Vec<TrackMessage>,
    sensors: Sensors,
}

#[derive(Deserialize)]
struct Odometry {
    speed_mps: f64,
    acceleration_mps2: f64,
    yaw_rate_radps: f64,
    lane: u32,
    lane_offset_m: f64,
    length_m: f64,
    width_m: f64,
}

#[derive(Deserialize)]
struct Front {
    track: u32,
    gap_m: f64,
    speed_mps: f64,
    acceleration_mps2: f64,
}

#[derive(Deserialize)]
struct Sensors {
    front: bool,
    surround: bool,
    rear: bool,
}

#[derive(Deserialize)]
struct TrackMessage {
    id: u32,
    source: Source,
    status: TrackStatus,
    time_s: f64,
    x_m: f64,
    y_m: f64,
    vx_mps: f64,
    vy_mps: f64,
    covariance: [[f64; 4]; 4],
    heading_rad: f64,
    length_m: f64,
    width_m: f64,
    class: Class,
    existence: f64,
    lane: Lane,
}

#[derive(Deserialize)]
struct Class {
    car: f64,
    truck: f64,
    motorcycle: f64,
    background: f64,
}

#[derive(Deserialize)]
struct Lane {
    left: f64,
    own: f64,
    right: f64,
}

impl From<TrackMessage> for Track {
    fn from(track: TrackMessage) -> Self {
        let mut covariance = [0.0; 16];
        for (value, given) in covariance.iter_mut().zip(track.covariance.as_flattened()) {
            *value = *given;
        }
        Self {
            id: track.id,
            source: track.source as i32,
            status: track.status as i32,
            reserved: 0,
            time_s: track.time_s,
            x_m: track.x_m,
            y_m: track.y_m,
            vx_mps: track.vx_mps,
            vy_mps: track.vy_mps,
            covariance,
            heading_rad: track.heading_rad,
            length_m: track.length_m,
            width_m: track.width_m,
            class: [track.class.car, track.class.truck, track.class.motorcycle, track.class.background],
            existence: track.existence,
            lane: [track.lane.left, track.lane.own, track.lane.right],
        }
    }
}

impl From<Step> for Input {
    fn from(step: Step) -> Self {
        let front = step.front.as_ref();
        let view = InputView {
            time_ns: step.time_ns,
            time_s: step.time_s,
            speed_mps: step.odometry.speed_mps,
            acceleration_mps2: step.odometry.acceleration_mps2,
            yaw_rate_radps: step.odometry.yaw_rate_radps,
            lane_offset_m: step.odometry.lane_offset_m,
            length_m: step.odometry.length_m,
            width_m: step.odometry.width_m,
            front_gap_m: front.map_or(0.0, |front| front.gap_m),
            front_speed_mps: front.map_or(0.0, |front| front.speed_mps),
            front_acceleration_mps2: front.map_or(0.0, |front| front.acceleration_mps2),
            lane: step.odometry.lane,
            has_front: front.is_some().into(),
            front_track: front.map_or(0, |front| front.track),
            front_works: step.sensors.front.into(),
            surround_works: step.sensors.surround.into(),
            rear_works: step.sensors.rear.into(),
            ..*Self::default().values()
        };
        Self::with(view, step.tracks.into_iter().map(Track::from).collect())
    }
}

/// Answers every message of `requests` with a line to `answers`, until there are no more. The table
/// names the variables of an FMU.
///
/// # Errors
/// The message of the failure, after which the process is to end.
pub fn serve(
    (loaded, table): (&Loaded, &VariableTable),
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
            Message::Hello(hello) => {
                setup = Setup {
                    lane_width_m: hello.road.lane_width_m,
                    curvature_per_m: hello.road.curvature_per_m,
                    speed_limit_mps: hello.road.speed_limit_mps,
                    lanes: hello.road.lanes,
                    overtaking_side: hello.road.overtaking_side,
                    ..Setup::of_settings(&hello.settings)
                };
                let identity = loaded.identity();
                json!({ "type": "hello", "protocol": 1, "name": identity.name, "version": identity.version })
                    .to_string()
            }
            Message::Step(step) => {
                let time_ns = step.time_ns;
                text(session.step((loaded, table), || setup.clone(), &Input::from(*step))?, time_ns)
            }
            Message::End => {
                session = Session::default();
                json!({ "type": "end" }).to_string()
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
