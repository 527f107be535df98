//! Writes the messages to a process, and parses its answers.

use closecall_controllers::external::bridge::ERROR_KEY;
use closecall_controllers::external::{Identity, RoadMessage, StepMessage};
use closecall_controllers::{EgoInput, EgoSettings, EgoState, Front};
use closecall_traffic::{CONTROL_STEP, Lane, Road};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use super::error::ExecError;
use super::lines::excerpt;
use super::unique;

/// Version of the protocol.
pub(crate) const PROTOCOL: u32 = 1;

/// The line that asks a process of this program to free what it has run, and the line that answers
/// it. The protocol of other processes does not have it.
pub(super) const END: &str = r#"{"type":"end"}"#;

const ACCELERATION_KEY: &str = "acceleration_mps2";
const STATE_KEY: &str = "state";
/// The key under which an answer repeats the time of its control step.
const TIME_KEY: &str = "time_ns";

#[derive(Serialize)]
#[serde(tag = "type", rename_all = "kebab-case")]
enum Message<'a> {
    Hello { protocol: u32, control_step_s: f64, settings: &'a EgoSettings, road: RoadMessage },
    Step(StepMessage),
}

/// The mark by which some runtimes begin a text: U+FEFF in UTF-8.
const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// Returns the first message to the process of an ego in a lane.
pub(super) fn hello(settings: &EgoSettings, road: &Road, lane: Lane) -> Vec<u8> {
    let road = RoadMessage::of(road, lane);
    to_line(&Message::Hello { protocol: PROTOCOL, control_step_s: CONTROL_STEP.s(), settings, road })
}

/// Returns the message of a control step. `front` is the lead vehicle.
pub(super) fn step(input: &EgoInput<'_>, front: Option<Front>) -> Vec<u8> {
    to_line(&Message::Step(StepMessage::new(input, front)))
}

/// Returns a message as a line of JSON.
pub(crate) fn to_line(message: &impl Serialize) -> Vec<u8> {
    // Serialising structs of numbers and names cannot fail.
    let mut line = serde_json::to_vec(message).unwrap_or_default();
    line.push(b'\n');
    line
}

/// A valid answer to a control step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Answer {
    pub(super) acceleration_mps2: f64,
    pub(super) state: EgoState,
    /// Whether the answer repeats the time of its control step.
    pub(super) repeats_time: bool,
}

/// Checks the answer to the first message, and returns what the process states about itself.
pub(crate) fn check_hello(line: &[u8]) -> Result<Identity, ExecError> {
    let object = object(line)?;
    if object.get("type").and_then(Value::as_str) != Some("hello") {
        return Err(key_error(line, &object, "type", "\"hello\" in the first answer"));
    }
    let version = object.get("protocol").and_then(Value::as_u64).ok_or_else(|| {
        key_error(line, &object, "protocol", "the version of the protocol, a whole number without quotes")
    })?;
    if version == u64::from(PROTOCOL) {
        let stated = |key| match object.get(key) {
            None | Some(Value::Null) => None,
            Some(Value::String(text)) => Some(excerpt(text.as_bytes())),
            Some(other) => Some(excerpt(other.to_string().as_bytes())),
        };
        Ok(Identity { name: stated("name"), version: stated("version") })
    } else {
        Err(ExecError::Version { actual: version.to_string(), supported: PROTOCOL })
    }
}

/// The question to which a line must be the answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Asked {
    /// The time of the control step (ns).
    pub(super) time_ns: i64,
    /// Whether the answer must repeat the time. Else it may.
    pub(super) must_be_repeated: bool,
    /// Whether an earlier answer has repeated its time: then this one must, too.
    pub(super) was_repeated: bool,
    /// Number of answers before, including the greeting.
    pub(super) answered: u64,
}

/// Parses the answer to a control step.
pub(super) fn parse_answer(line: &[u8], asked: Asked) -> Result<Answer, ExecError> {
    let object = object(line)?;
    if asked.must_be_repeated
        && let Some(error) = stated(&object)
    {
        return Err(error);
    }
    let repeated = object.get(TIME_KEY);
    if repeated.is_some_and(|time| time.as_i64().is_none()) {
        return Err(key_error(line, &object, TIME_KEY, "a whole number, the `time_ns` of the step"));
    }
    let must_be_repeated = asked.must_be_repeated || asked.was_repeated;
    let is_own = repeated.map_or(!must_be_repeated, |time| time.as_i64() == Some(asked.time_ns));
    if !is_own {
        let repeated_time = repeated.map_or_else(|| "an unstated number of".to_owned(), ToString::to_string);
        let (line, repeated_time) = (excerpt(line), excerpt(repeated_time.as_bytes()));
        return Err(ExecError::OtherStep {
            line,
            expected: asked.time_ns,
            actual: repeated_time,
            answered: asked.answered,
        });
    }
    let acceleration_mps2 = object
        .get(ACCELERATION_KEY)
        .and_then(Value::as_f64)
        .ok_or_else(|| key_error(line, &object, ACCELERATION_KEY, "a number"))?;
    let state = object.get(STATE_KEY).and_then(|state| EgoState::deserialize(state).ok()).ok_or_else(|| {
        let states = "one of following, increasing, holding, releasing, emergency-braking";
        key_error(line, &object, STATE_KEY, states)
    })?;
    Ok(Answer { acceleration_mps2, state, repeats_time: repeated.is_some() })
}

/// Returns why the process of a library or an FMU has not ended its run as it should, if it says so.
pub(super) fn stated_error(line: &[u8]) -> Option<ExecError> {
    stated(&object(line).ok()?)
}

fn stated(object: &Map<String, Value>) -> Option<ExecError> {
    let reason = object.get(ERROR_KEY)?.as_str()?.to_owned();
    Some(ExecError::Stated { reason })
}

fn object(line: &[u8]) -> Result<Map<String, Value>, ExecError> {
    // Some runtimes begin their output with a byte order mark.
    let line = line.strip_prefix(BYTE_ORDER_MARK).unwrap_or(line);
    match unique::parse(line) {
        Ok(Value::Object(object)) => Ok(object),
        Ok(_) => Err(ExecError::NotObject { line: excerpt(line) }),
        // JSON has neither NaN nor infinity, but the JSON writers of many languages write them.
        Err(unique::Refused::NotJson(error)) => Err(match not_finite(line) {
            Some(value) => ExecError::NotFinite { value },
            None => ExecError::NotJson { line: excerpt(line), reason: not_json(line, &error) },
        }),
        Err(unique::Refused::Repeated(key)) => {
            let (expected, actual) = ("there once", "there twice".to_owned());
            Err(ExecError::Key { line: excerpt(line), key, expected, actual })
        }
    }
}

/// The marks by which a text in UTF-16 begins, in both byte orders.
const UTF16_MARKS: [&[u8]; 2] = [b"\xff\xfe", b"\xfe\xff"];

/// Returns why a line is not JSON.
fn not_json(line: &[u8], error: &serde_json::Error) -> String {
    if UTF16_MARKS.iter().any(|mark| line.starts_with(mark)) {
        return "it is UTF-16, and an answer is UTF-8".to_owned();
    }
    if error.is_eof() && !line.is_empty() { format!("{error}; an answer is one line") } else { error.to_string() }
}

/// Returns the acceleration as it is written if it is NaN or infinite, otherwise `None`.
fn not_finite(line: &[u8]) -> Option<String> {
    let text = std::str::from_utf8(line).ok()?;
    let (_, after) = text.split_once(&format!("\"{ACCELERATION_KEY}\""))?;
    let value = after.trim_start().strip_prefix(':')?.split([',', '}']).next()?.trim();
    // Rust parses nan, inf and infinity in upper and lower case, with or without a sign.
    value.parse::<f64>().ok().filter(|number| !number.is_finite()).map(|_| excerpt(value.as_bytes()))
}

/// Returns the error that `key` does not have the `expected` value.
fn key_error(line: &[u8], object: &Map<String, Value>, key: &str, expected: &'static str) -> ExecError {
    let value = object.get(key).map_or_else(|| "absent".to_owned(), |value| excerpt(value.to_string().as_bytes()));
    ExecError::Key { line: excerpt(line), key: key.to_owned(), expected, actual: value }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(line: &[u8]) -> Result<Answer, ExecError> {
        let asked = Asked { time_ns: 80_000_000, must_be_repeated: false, was_repeated: false, answered: 3 };
        parse_answer(line, asked)
    }

    #[test]
    fn an_answer_that_repeats_another_time_is_that_of_another_step() {
        let line = |time: &str| format!("{{\"acceleration_mps2\":0,\"state\":\"following\"{time}}}");
        for right in ["", ",\"time_ns\":80000000"] {
            parsed(line(right).as_bytes()).unwrap();
        }
        let other = parsed(line(",\"time_ns\":40000000").as_bytes()).unwrap_err();
        assert!(matches!(other, ExecError::OtherStep { expected: 80_000_000, .. }), "{other}");
        for wrong in ["null", "\"80000000\"", "8e7", "80000000.0"] {
            let error = parsed(line(&format!(",\"time_ns\":{wrong}")).as_bytes()).unwrap_err().to_string();
            let expected = "`time_ns` must be a whole number, the `time_ns` of the step, it is ";
            assert!(error.contains(expected), "{wrong}: {error}");
        }
        let asked = Asked { time_ns: 80_000_000, must_be_repeated: true, was_repeated: false, answered: 3 };
        // A process that has repeated the time does so in each answer.
        let later = Asked { must_be_repeated: false, was_repeated: true, ..asked };
        assert!(parse_answer(line(",\"time_ns\":80000000").as_bytes(), later).unwrap().repeats_time);
        assert!(matches!(parse_answer(line("").as_bytes(), later), Err(ExecError::OtherStep { .. })));
        assert!(matches!(parse_answer(line("").as_bytes(), asked), Err(ExecError::OtherStep { .. })));
        let failed = br#"{"time_ns":80000000,"error":"no map"}"#;
        assert!(matches!(parse_answer(failed, asked), Err(ExecError::Stated { reason }) if reason == "no map"));
        // The protocol of other processes does not have the key.
        assert!(matches!(parsed(failed), Err(ExecError::Key { .. })));
    }

    #[test]
    fn a_valid_answer_is_read_to_the_last_bit() {
        let read =
            parsed(br#"{"acceleration_mps2": -0.1234567890123456, "state": "increasing", "more": [1]}"#).unwrap();
        let (acceleration_mps2, state) = (-0.123_456_789_012_345_6, EgoState::Increasing);
        assert_eq!(read, Answer { acceleration_mps2, state, repeats_time: false });
        assert_eq!(parsed(br#"{"acceleration_mps2": 1, "state": "following"}"#).unwrap().acceleration_mps2, 1.0);
    }

    #[test]
    fn an_acceleration_that_is_not_finite_is_quoted() {
        for value in ["NaN", "nan", "-nan", "Infinity", "-Infinity", "inf", "1e999"] {
            let line = format!("{{\"acceleration_mps2\": {value}, \"state\": \"following\"}}");
            let error = parsed(line.as_bytes()).unwrap_err();
            assert!(matches!(&error, ExecError::NotFinite { value: named } if named == value), "{value}: {error}");
        }
    }

    #[test]
    fn the_message_states_what_is_wrong() {
        for (line, stated) in [
            ("", "not JSON"),
            ("hello", "not JSON"),
            ("[1, 2]", "answered \"[1, 2]\": it must be an object of JSON, such as {\"acceleration_mps2\": …}"),
            ("null", "answered \"null\": it must be an object of JSON"),
            ("{}", "`acceleration_mps2` must be a number, it is absent"),
            (r#"{"acceleration_mps2": null, "state": "following"}"#, "it is null"),
            (r#"{"acceleration_mps2": "-1", "state": "following"}"#, "it is \"-1\""),
            (r#"{"acceleration_mps2": -1}"#, "`state` must be one of following"),
            (r#"{"acceleration_mps2": -1, "state": "driving"}"#, "it is \"driving\""),
            (
                r#"{"acceleration_mps2": -1, "acceleration_mps2": -2, "state": "following"}"#,
                "`acceleration_mps2` must be there once, it is there twice",
            ),
        ] {
            let error = parsed(line.as_bytes()).unwrap_err().to_string();
            assert!(error.contains(stated), "{line}: {error}");
        }
        assert!(parsed(&[0xff, 0xfe]).is_err());
        let utf16 = parsed(b"\xff\xfe{\0\"\0").unwrap_err();
        assert!(utf16.to_string().ends_with("which is not JSON: it is UTF-16, and an answer is UTF-8"), "{utf16}");
        assert_eq!(utf16.advice(), None);
        let cut = parsed(b"{").unwrap_err().to_string();
        assert!(cut.ends_with("an answer is one line"), "{cut}");
        for (line, is_advised) in [("gap is 24.2", true), ("", true), (r#"{"acceleration_mps2": 0.0,"#, false)] {
            let advice = parsed(line.as_bytes()).unwrap_err().advice();
            assert_eq!(advice.is_some_and(|advice| advice.contains("standard error")), is_advised, "{line}");
        }
    }

    #[test]
    fn another_version_is_rejected() {
        assert_eq!(check_hello(br#"{"type":"hello","protocol":1}"#).unwrap(), Identity::default());
        let identity = check_hello(br#"{"type":"hello","protocol":1,"name":"mine","version":2.5}"#).unwrap();
        assert_eq!(identity, Identity { name: Some("mine".to_owned()), version: Some("2.5".to_owned()) });
        let error = check_hello(br#"{"type":"hello","protocol":2}"#).unwrap_err().to_string();
        assert_eq!(error, "the process speaks version 2 of the protocol, this is version 1");
        assert!(check_hello(br#"{"type":"hello"}"#).unwrap_err().to_string().contains("absent"));
        let error = check_hello(br#"{"type":"hello","protocol":"1"}"#).unwrap_err().to_string();
        assert!(error.ends_with("a whole number without quotes, it is \"1\""), "{error}");
        assert!(check_hello(br#"{"acceleration_mps2":0,"state":"following"}"#).is_err());
    }
}
