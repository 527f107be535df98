//! The lines that go out, and what the answers must be.

use closecall_controllers::{EgoInput, EgoSettings, EgoState, Front, Odometry, SensorAvailability};
use closecall_traffic::{CONTROL_STEP, Road, Side, Source, Track, TrackId, TrackStatus};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use super::error::ExecError;
use super::lines::excerpt;

/// Version of the protocol.
pub(super) const PROTOCOL: u32 = 1;

const ACCELERATION: &str = "acceleration_mps2";
const STATE: &str = "state";

#[derive(Serialize)]
#[serde(tag = "type", rename_all = "kebab-case")]
enum Message<'a> {
    Hello { protocol: u32, control_step_s: f64, settings: &'a EgoSettings, road: RoadLine },
    Step(StepLine<'a>),
}

#[derive(Serialize)]
struct RoadLine {
    lanes: u8,
    lane_width_m: f64,
    curvature_per_m: f64,
    speed_limit_mps: f64,
    overtaking_side: Side,
}

#[derive(Serialize)]
struct StepLine<'a> {
    time_s: f64,
    time_ns: i64,
    odometry: &'a Odometry,
    front: Option<Front>,
    tracks: Vec<TrackLine>,
    sensors: SensorAvailability,
}

#[derive(Serialize)]
struct TrackLine {
    id: TrackId,
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
    class: ClassLine,
    existence: f64,
    lane: LaneLine,
}

#[derive(Serialize)]
struct ClassLine {
    car: f64,
    truck: f64,
    motorcycle: f64,
    background: f64,
}

#[derive(Serialize)]
struct LaneLine {
    left: f64,
    own: f64,
    right: f64,
}

impl From<&Track> for TrackLine {
    fn from(track: &Track) -> Self {
        let [car, truck, motorcycle, background] = track.class.0;
        let [left, own, right] = track.lane;
        Self {
            id: track.id,
            source: track.source,
            status: track.status,
            time_s: track.time.s(),
            x_m: track.x_m(),
            y_m: track.y_m(),
            vx_mps: track.vx_mps(),
            vy_mps: track.vy_mps(),
            covariance: std::array::from_fn(|row| std::array::from_fn(|column| track.covariance[(row, column)])),
            heading_rad: track.heading_rad,
            length_m: track.length_m,
            width_m: track.width_m,
            class: ClassLine { car, truck, motorcycle, background },
            existence: track.existence,
            lane: LaneLine { left, own, right },
        }
    }
}

/// The first line.
pub(super) fn hello(settings: &EgoSettings, road: &Road) -> Vec<u8> {
    let road = RoadLine {
        lanes: road.lanes(),
        lane_width_m: road.lane_width_m(),
        curvature_per_m: road.curvature_per_m(),
        speed_limit_mps: road.speed_limit_mps(),
        overtaking_side: road.overtaking_side(),
    };
    line(&Message::Hello { protocol: PROTOCOL, control_step_s: CONTROL_STEP.s(), settings, road })
}

/// The line of a control step.
pub(super) fn step(input: &EgoInput<'_>, front: Option<Front>) -> Vec<u8> {
    line(&Message::Step(StepLine {
        time_s: input.time.s(),
        time_ns: input.time.ns(),
        odometry: &input.odometry,
        front,
        tracks: input.tracks.iter().map(TrackLine::from).collect(),
        sensors: input.sensors,
    }))
}

fn line(message: &Message<'_>) -> Vec<u8> {
    // Structs of numbers and names cannot fail to be written.
    let mut line = serde_json::to_vec(message).unwrap_or_default();
    line.push(b'\n');
    line
}

/// A proper answer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Answer {
    pub(super) acceleration_mps2: f64,
    pub(super) state: EgoState,
}

/// Checks the answer to the first line.
pub(super) fn check_hello(line: &[u8]) -> Result<(), ExecError> {
    let object = object(line)?;
    if object.get("type").and_then(Value::as_str) != Some("hello") {
        return Err(key(line, &object, "type", "\"hello\" in the first answer"));
    }
    let found = object.get("protocol").ok_or_else(|| key(line, &object, "protocol", "the version of the protocol"))?;
    if found.as_u64() == Some(PROTOCOL.into()) {
        Ok(())
    } else {
        Err(ExecError::Version { found: found.to_string(), own: PROTOCOL })
    }
}

/// Reads the answer to a control step.
pub(super) fn answer(line: &[u8]) -> Result<Answer, ExecError> {
    let object = object(line)?;
    let acceleration_mps2 =
        object.get(ACCELERATION).and_then(Value::as_f64).ok_or_else(|| key(line, &object, ACCELERATION, "a number"))?;
    let state = object.get(STATE).and_then(|state| EgoState::deserialize(state).ok()).ok_or_else(|| {
        let states = "one of following, increasing, holding, releasing, emergency-braking";
        key(line, &object, STATE, states)
    })?;
    Ok(Answer { acceleration_mps2, state })
}

fn object(line: &[u8]) -> Result<Map<String, Value>, ExecError> {
    match serde_json::from_slice(line) {
        Ok(Value::Object(object)) => Ok(object),
        Ok(_) => Err(ExecError::NotJson { line: excerpt(line), reason: "it must be an object".to_owned() }),
        // JSON knows neither NaN nor infinity, but the writers of many languages do.
        Err(error) => Err(match not_finite(line) {
            Some(value) => ExecError::NotFinite { value },
            None => ExecError::NotJson { line: excerpt(line), reason: error.to_string() },
        }),
    }
}

/// The acceleration as it is written, where that is a number but not a finite one.
fn not_finite(line: &[u8]) -> Option<String> {
    let text = std::str::from_utf8(line).ok()?;
    let (_, after) = text.split_once(&format!("\"{ACCELERATION}\""))?;
    let value = after.trim_start().strip_prefix(':')?.split([',', '}']).next()?.trim();
    // Rust reads nan, inf and infinity in any case, with a sign.
    value.parse::<f64>().ok().filter(|number| !number.is_finite()).map(|_| excerpt(value.as_bytes()))
}

fn key(line: &[u8], object: &Map<String, Value>, key: &'static str, expected: &'static str) -> ExecError {
    let found = object.get(key).map_or_else(|| "absent".to_owned(), |value| excerpt(value.to_string().as_bytes()));
    ExecError::Key { line: excerpt(line), key, expected, found }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_proper_answer_is_read_to_the_last_bit() {
        let read =
            answer(br#"{"acceleration_mps2": -0.1234567890123456, "state": "increasing", "more": [1]}"#).unwrap();
        assert_eq!(read, Answer { acceleration_mps2: -0.123_456_789_012_345_6, state: EgoState::Increasing });
        assert_eq!(answer(br#"{"acceleration_mps2": 1, "state": "following"}"#).unwrap().acceleration_mps2, 1.0);
    }

    #[test]
    fn what_is_not_finite_is_named() {
        for value in ["NaN", "nan", "-nan", "Infinity", "-Infinity", "inf", "1e999"] {
            let line = format!("{{\"acceleration_mps2\": {value}, \"state\": \"following\"}}");
            let error = answer(line.as_bytes()).unwrap_err();
            assert!(matches!(&error, ExecError::NotFinite { value: named } if named == value), "{value}: {error}");
        }
    }

    #[test]
    fn whatever_else_is_wrong_is_said() {
        for (line, said) in [
            ("", "not JSON"),
            ("hello", "not JSON"),
            ("[1, 2]", "must be an object"),
            ("{}", "`acceleration_mps2` must be a number, it is absent"),
            (r#"{"acceleration_mps2": null, "state": "following"}"#, "it is null"),
            (r#"{"acceleration_mps2": "-1", "state": "following"}"#, "it is \"-1\""),
            (r#"{"acceleration_mps2": -1}"#, "`state` must be one of following"),
            (r#"{"acceleration_mps2": -1, "state": "driving"}"#, "it is \"driving\""),
        ] {
            let error = answer(line.as_bytes()).unwrap_err().to_string();
            assert!(error.contains(said), "{line}: {error}");
        }
        assert!(answer(&[0xff, 0xfe]).is_err());
    }

    #[test]
    fn the_version_must_be_the_same() {
        assert!(check_hello(br#"{"type":"hello","protocol":1}"#).is_ok());
        let error = check_hello(br#"{"type":"hello","protocol":2}"#).unwrap_err().to_string();
        assert_eq!(error, "the process speaks version 2 of the protocol, this is version 1");
        assert!(check_hello(br#"{"type":"hello"}"#).unwrap_err().to_string().contains("absent"));
        assert!(check_hello(br#"{"acceleration_mps2":0,"state":"following"}"#).is_err());
    }
}
