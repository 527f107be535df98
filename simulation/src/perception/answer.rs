//! Parses the answers of a perception process. Each error names the field, what is needed there,
//! and what was found.

use std::collections::BTreeSet;

use closecall_sensors::external::PerceptionAnswer;
use closecall_sensors::{Detection, Extent, SeenBy, SeenPart};
use closecall_traffic::{
    ClassScores, KeyPath, Range, Segment, Source, Time, Track, TrackId, TrackStatus, VehicleClass, maths,
};
use nalgebra::{Matrix4, Vector4};
use serde_json::{Map, Value};

use crate::controller::exec::{ExecError, excerpt, unique};

/// Largest number of detections or tracks in an answer. An assumption: a motorway has some tens of
/// vehicles in view.
pub(super) const MOST_OBJECTS: usize = 256;
/// Largest coordinate (m), as in the LiDARs' region of interest.
const POSITION: Range = Range::closed(-500.0, 500.0);
/// Largest speed (m/s). An assumption: twice as fast as the fastest vehicle of a motorway.
const SPEED: Range = Range::closed(-150.0, 150.0);
/// Lengths of vehicles (m): up to the European modular system, with a margin for errors.
const LENGTH: Range = Range::closed(0.1, 40.0);
/// Widths of vehicles (m).
const WIDTH: Range = Range::closed(0.1, 5.0);
/// Variances: no perception is exact, and none is of use beyond.
const VARIANCE: Range = Range::above(0.0, 1e6);
/// Difference of two elements of a covariance that mirror each other, relative to the largest
/// element, up to which they are equal.
const ASYMMETRY: f64 = 1e-9;
/// Difference of the sum of probabilities from 1 up to which they add up to 1.
const SUM_TOLERANCE: f64 = 1e-3;
/// Longest time by which a detection may be older than its scan (ns).
const OLDEST_NS: i64 = 200_000_000;
/// Height of the highest point of a detection that states none (m): the height of a car.
pub(super) const USUAL_TOP_M: f64 = 1.5;

/// The key under which the process of a library or of an object says why it has no answer.
pub(super) const ERROR_KEY: &str = "error";

/// What a process answers with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Detections,
    Tracks,
}

impl Kind {
    /// Returns the key of the list in an answer.
    pub(super) const fn key(self) -> &'static str {
        match self {
            Self::Detections => "detections",
            Self::Tracks => "tracks",
        }
    }
}

/// Why a line is no valid answer.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub(super) enum AnswerError {
    /// The line is JSON, and no object.
    #[error("the process answered {line:?}: it must be an object of JSON")]
    NotObject { line: String },
    /// The line is no JSON.
    #[error("the process answered {line:?}, which is not JSON: {reason}")]
    NotJson { line: String, reason: String },
    /// A field is not what it must be.
    #[error("the process answered {line:?}: `{field}` must be {needed}, it is {actual}")]
    Field { line: String, field: String, needed: String, actual: String },
}

impl AnswerError {
    /// Returns the message about a library or an object. Its line comes from the process around it.
    pub(super) fn without_line(&self, who: &str) -> String {
        match self {
            // A number that is not finite is written as a word.
            Self::Field { field, needed, actual, .. } => {
                format!("{who} answered: `{field}` must be {needed}, it is {}", actual.trim_matches('"'))
            }
            Self::NotObject { .. } | Self::NotJson { .. } => self.to_string(),
        }
    }
}

/// A field that is not what it must be, without the line that it stands in.
struct Wrong {
    field: String,
    needed: String,
    actual: String,
}

impl Wrong {
    fn new(field: String, needed: impl Into<String>, actual: Option<&Value>) -> Self {
        let actual = actual.map_or_else(|| "absent".to_owned(), |value| excerpt(value.to_string().as_bytes()));
        Self { field, needed: needed.into(), actual }
    }

    fn in_line(self, line: &[u8]) -> AnswerError {
        let Self { field, needed, actual } = self;
        AnswerError::Field { line: excerpt(line), field, needed, actual }
    }
}

/// Returns what a process answers with, as its first answer says.
pub(super) fn kind(line: &[u8]) -> Result<Kind, AnswerError> {
    const KEY: &str = "answers";
    let object = object(line)?;
    match object.get(KEY).and_then(Value::as_str) {
        Some("detections") => Ok(Kind::Detections),
        Some("tracks") => Ok(Kind::Tracks),
        _ => Err(Wrong::new(KEY.to_owned(), "\"detections\" or \"tracks\"", object.get(KEY)).in_line(line)),
    }
}

/// Returns why the process of a library or of an object has no answer, if it says so.
pub(super) fn stated_error(line: &[u8]) -> Option<String> {
    object(line).ok()?.get(ERROR_KEY)?.as_str().map(str::to_owned)
}

/// Parses the answer to the question at `time`. `answered` is the number of answers before,
/// including the greeting.
///
/// # Errors
/// [`ExecError::OtherStep`] if it is the answer to another question, or [`AnswerError`] with the
/// field that is wrong.
pub(super) fn parse(
    line: &[u8],
    (kind, time): (Kind, Time),
    answered: u64,
) -> Result<Result<PerceptionAnswer, AnswerError>, ExecError> {
    let object = match object(line) {
        Ok(object) => object,
        Err(error) => return Ok(Err(error)),
    };
    match object.get("time_ns").and_then(Value::as_i64) {
        Some(time_ns) if time_ns == time.ns() => Ok(parsed(&object, kind, time).map_err(|wrong| wrong.in_line(line))),
        Some(time_ns) => Err(ExecError::OtherStep {
            line: excerpt(line),
            expected: time.ns(),
            actual: time_ns.to_string(),
            answered,
        }),
        None => {
            let needed = format!("{}, the `time_ns` of the question", time.ns());
            Ok(Err(Wrong::new("time_ns".to_owned(), needed, object.get("time_ns")).in_line(line)))
        }
    }
}

fn parsed(object: &Map<String, Value>, kind: Kind, time: Time) -> Result<PerceptionAnswer, Wrong> {
    let key = kind.key();
    let list = object.get(key);
    let elements = list.and_then(Value::as_array).filter(|list| list.len() <= MOST_OBJECTS);
    let elements = elements.ok_or_else(|| {
        let wrong = Wrong::new(key.to_owned(), format!("a list of at most {MOST_OBJECTS}"), list);
        let other = [Kind::Detections, Kind::Tracks].into_iter().find(|other| *other != kind).map(Kind::key);
        let actual = match (list, other.filter(|other| object.contains_key(*other))) {
            (Some(Value::Array(list)), _) => format!("a list of {}", list.len()),
            (None, Some(other)) => format!("absent, and `{other}` is there: the greeting says `\"answers\":\"{key}\"`"),
            _ => return wrong,
        };
        Wrong { actual, ..wrong }
    })?;
    let object_at = |(index, value): (usize, &Value)| match value {
        Value::Object(object) => Ok(Object { path: format!("{key}[{index}]"), object: object.clone() }),
        other => Err(Wrong::new(format!("{key}[{index}]"), "an object", Some(other))),
    };
    let objects = elements.iter().enumerate().map(object_at);
    match kind {
        Kind::Detections => {
            let all: Result<_, _> = objects.map(|object| detection(&object?, time)).collect();
            all.map(PerceptionAnswer::Detections)
        }
        Kind::Tracks => {
            let mut ids = BTreeSet::new();
            let all: Result<_, _> = objects.map(|object| track(&object?, time, &mut ids)).collect();
            all.map(PerceptionAnswer::Tracks)
        }
    }
}

/// An object of an answer, with its path.
struct Object {
    path: String,
    object: Map<String, Value>,
}

impl Object {
    fn wrong(&self, key: &str, needed: impl Into<String>) -> Wrong {
        Wrong::new(format!("{}.{key}", self.path), needed, self.object.get(key))
    }

    /// Returns a number within a range.
    fn number(&self, key: &str, range: Range) -> Result<f64, Wrong> {
        let value = self.object.get(key).and_then(Value::as_f64).filter(|value| range.contains(*value));
        value.ok_or_else(|| self.wrong(key, range.to_string()))
    }

    /// Returns a number within a range, or `default` if the key is absent.
    fn number_or(&self, key: &str, range: Range, default: f64) -> Result<f64, Wrong> {
        if self.object.contains_key(key) { self.number(key, range) } else { Ok(default) }
    }

    /// Returns a whole number from `least` on.
    fn whole(&self, key: &str, least: u32) -> Result<u32, Wrong> {
        let value = self.object.get(key).and_then(Value::as_u64).and_then(|value| u32::try_from(value).ok());
        value
            .filter(|value| *value >= least)
            .ok_or_else(|| self.wrong(key, format!("a whole number from {least} to {}", u32::MAX)))
    }

    /// Returns whether an extent is measured.
    fn extent(&self, key: &str) -> Result<Extent, Wrong> {
        match self.object.get(key) {
            None | Some(Value::Bool(false)) => Ok(Extent::Assumed),
            Some(Value::Bool(true)) => Ok(Extent::Seen),
            Some(_) => Err(self.wrong(key, "true or false")),
        }
    }

    /// Returns a covariance: symmetric and positive definite.
    fn covariance<const N: usize>(&self) -> Result<[[f64; N]; N], Wrong> {
        const KEY: &str = "covariance";
        let size = format!("a list of {N} lists of {N} numbers");
        let rows = self.object.get(KEY).and_then(Value::as_array).filter(|rows| rows.len() == N);
        let rows = rows.ok_or_else(|| self.wrong(KEY, &*size))?;
        let mut covariance = [[0.0; N]; N];
        for (index, (row, values)) in covariance.iter_mut().zip(rows).enumerate() {
            let at = |column: Option<usize>| match column {
                None => format!("{}.{KEY}[{index}]", self.path),
                Some(column) => format!("{}.{KEY}[{index}][{column}]", self.path),
            };
            let numbers = values.as_array().filter(|numbers| numbers.len() == N);
            let numbers =
                numbers.ok_or_else(|| Wrong::new(at(None), format!("a list of {N} numbers"), Some(values)))?;
            for (column, (element, number)) in row.iter_mut().zip(numbers).enumerate() {
                let value = number.as_f64().filter(|value| index != column || VARIANCE.contains(*value));
                let needed = if index == column { format!("a variance: {VARIANCE}") } else { "a number".to_owned() };
                *element = value.ok_or_else(|| Wrong::new(at(Some(column)), needed, Some(number)))?;
            }
        }
        let largest = covariance.iter().flatten().fold(0.0, |largest: f64, element| largest.max(element.abs()));
        let is_symmetric = (0..N).all(|row| {
            (0..row).all(|column| (covariance[row][column] - covariance[column][row]).abs() <= ASYMMETRY * largest)
        });
        if !is_symmetric {
            return Err(self.wrong(KEY, "symmetric"));
        }
        if !is_positive_definite(covariance) {
            return Err(self.wrong(KEY, "positive definite"));
        }
        Ok(covariance)
    }

    /// Returns the probabilities of the classes. Those that are absent are 0; without any, nothing
    /// is known.
    fn class(&self) -> Result<ClassScores, Wrong> {
        const KEY: &str = "class";
        let classes = match self.object.get(KEY) {
            None => return Ok(ClassScores::UNKNOWN),
            Some(Value::Object(classes)) => classes,
            Some(_) => return Err(self.wrong(KEY, "an object of probabilities")),
        };
        let mut scores = [0.0; 4];
        for (name, value) in classes {
            let index = VehicleClass::ALL.iter().position(|class| class.name() == name);
            let index = index.or((name == "background").then_some(ClassScores::BACKGROUND));
            let field = format!("{}.{KEY}.{name}", self.path);
            let needed = "a class: car, truck, motorcycle or background";
            let index = index.ok_or_else(|| Wrong::new(field.clone(), needed, Some(value)))?;
            let score = value.as_f64().filter(|score| Range::UNIT.contains(*score));
            scores[index] = score.ok_or_else(|| Wrong::new(field, Range::UNIT.to_string(), Some(value)))?;
        }
        let sum: f64 = scores.iter().sum();
        if !((sum - 1.0).abs() <= SUM_TOLERANCE) {
            return Err(self.wrong(KEY, "probabilities that add up to 1"));
        }
        Ok(ClassScores(scores.map(|score| score / sum)))
    }
}

fn detection(object: &Object, time: Time) -> Result<Detection, Wrong> {
    let [x_m, y_m] = [object.number("x_m", POSITION)?, object.number("y_m", POSITION)?];
    let [[along_m2, mixed_m2], [_, across_m2]] = object.covariance::<2>()?;
    // Along and across the line of sight.
    let distance_m = maths::hypot(x_m, y_m);
    let [cos, sin] = if distance_m > 0.0 { [x_m / distance_m, y_m / distance_m] } else { [1.0, 0.0] };
    let range_m2 = cos * cos * along_m2 + 2.0 * sin * cos * mixed_m2 + sin * sin * across_m2;
    let lateral_m2 = sin * sin * along_m2 - 2.0 * sin * cos * mixed_m2 + cos * cos * across_m2;
    let measured_at = match object.object.get("time_ns") {
        None => time,
        Some(value) => {
            let allowed = time.ns() - OLDEST_NS..=time.ns();
            let time_ns = value.as_i64().filter(|time_ns| allowed.contains(time_ns));
            let needed = || format!("a whole number from {} to {}", allowed.start(), allowed.end());
            Time::from_ns(time_ns.ok_or_else(|| object.wrong("time_ns", needed()))?)
        }
    };
    let quarter_turn = std::f64::consts::FRAC_PI_2;
    Ok(Detection {
        time: measured_at,
        face_x_m: x_m,
        face_y_m: y_m,
        range_sd_m: range_m2.max(0.0).sqrt(),
        lateral_sd_m: lateral_m2.max(0.0).sqrt(),
        heading_rad: object.number_or("heading_rad", Range::closed(-quarter_turn, quarter_turn), 0.0)?,
        length_m: object.number("length_m", LENGTH)?,
        length: object.extent("length_is_seen")?,
        width_m: object.number("width_m", WIDTH)?,
        width: object.extent("width_is_seen")?,
        top_m: object.number_or("top_m", Range::closed(0.0, 10.0), USUAL_TOP_M)?,
        seen_by: SeenBy::Lidar,
        points: object.whole("points", 1)? as usize,
        // The covariance says how well the middle is known.
        is_centred: true,
        seen: SeenPart::FACE,
        class: object.class()?,
    })
}

fn track(object: &Object, time: Time, ids: &mut BTreeSet<u32>) -> Result<Track, Wrong> {
    let id = object.whole("id", 0)?;
    if !ids.insert(id) {
        return Err(object.wrong("id", "a number that no other track of the answer has"));
    }
    let status = match object.object.get("status").and_then(Value::as_str) {
        Some("tentative") => TrackStatus::Tentative,
        Some("confirmed") => TrackStatus::Confirmed,
        Some("coasting") => TrackStatus::Coasting,
        _ => return Err(object.wrong("status", "\"tentative\", \"confirmed\" or \"coasting\"")),
    };
    let covariance = object.covariance::<4>()?;
    let half_turn = std::f64::consts::PI;
    Ok(Track {
        id: TrackId(id),
        source: Source::Rear,
        status,
        time,
        state: Vector4::new(
            object.number("x_m", POSITION)?,
            object.number("y_m", POSITION)?,
            object.number("vx_mps", SPEED)?,
            object.number("vy_mps", SPEED)?,
        ),
        covariance: Matrix4::from_fn(|row, column| covariance[row][column]),
        heading_rad: object.number_or("heading_rad", Range::closed(-half_turn, half_turn), 0.0)?,
        length_m: object.number("length_m", LENGTH)?,
        width_m: object.number("width_m", WIDTH)?,
        class: object.class()?,
        existence: object.number("existence", Range::UNIT)?,
        // Closecall knows the lanes from its map.
        lane: [0.0; 3],
    })
}

/// Returns whether a symmetric matrix is positive definite: its Cholesky factor exists.
fn is_positive_definite<const N: usize>(matrix: [[f64; N]; N]) -> bool {
    let mut factor = [[0.0; N]; N];
    for row in 0..N {
        for column in 0..=row {
            let sum: f64 = (0..column).map(|index| factor[row][index] * factor[column][index]).sum();
            let rest = matrix[row][column] - sum;
            if row == column {
                if !(rest > 0.0) {
                    return false;
                }
                factor[row][row] = rest.sqrt();
            } else {
                factor[row][column] = rest / factor[column][column];
            }
        }
    }
    true
}

fn object(line: &[u8]) -> Result<Map<String, Value>, AnswerError> {
    let not_json = |reason: String| AnswerError::NotJson { line: excerpt(line), reason };
    match unique::parse(line) {
        Ok(Value::Object(object)) => Ok(object),
        Ok(_) => Err(AnswerError::NotObject { line: excerpt(line) }),
        // JSON has neither NaN nor infinity, but the JSON writers of many languages write them.
        Err(unique::Refused::Repeated(field)) => {
            let (needed, actual) = ("there once".to_owned(), "there twice".to_owned());
            Err(AnswerError::Field { line: excerpt(line), field, needed, actual })
        }
        Err(unique::Refused::NotJson(error)) => Err(match not_finite(line) {
            Some((field, actual)) => {
                AnswerError::Field { line: excerpt(line), field, needed: "a finite number".to_owned(), actual }
            }
            None => not_json(error.to_string()),
        }),
    }
}

/// Returns the first word of a line that is NaN or infinite, behind the path of its field; `None` if
/// there is none.
fn not_finite(line: &[u8]) -> Option<(String, String)> {
    let text = std::str::from_utf8(line).ok()?;
    let (mut path, mut word_start, mut in_string) = (Vec::new(), None, None);
    for (at, character) in text.char_indices() {
        match (in_string, character) {
            (Some(start), '"') => {
                // A text behind which a colon stands is a key.
                let after = text.get(at + 1..)?.trim_start();
                if let Some(Segment::Key(key)) = path.last_mut()
                    && after.starts_with(':')
                {
                    text.get(start..at)?.clone_into(key);
                }
                in_string = None;
            }
            (Some(_), _) => {}
            (None, '"') => in_string = Some(at + 1),
            (None, ',' | ']' | '}' | '[' | '{' | ':' | ' ') => {
                if let Some(word) = word_start.take().and_then(|start| text.get(start..at))
                    && word.parse::<f64>().is_ok_and(|number| !number.is_finite())
                {
                    return Some((KeyPath(path).to_string(), word.to_owned()));
                }
                match (character, path.last_mut()) {
                    ('{', _) => path.push(Segment::Key(String::new())),
                    ('[', _) => path.push(Segment::Index(0)),
                    (',', Some(Segment::Index(index))) => *index += 1,
                    (']' | '}', _) => drop(path.pop()),
                    _ => {}
                }
            }
            (None, _) => {
                word_start.get_or_insert(at);
            }
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    const TIME: Time = Time::from_ms(80);

    const TRACK: &str = r#"{"id":3,"status":"confirmed","x_m":-40.5,"y_m":0.25,"vx_mps":36,"vy_mps":0,"length_m":4.6,
        "width_m":1.8,"existence":0.9,"class":{"car":0.75,"truck":0.25},
        "covariance":[[0.04,0,0.01,0],[0,0.01,0,0],[0.01,0,0.25,0],[0,0,0,0.09]]}"#;
    const DETECTION: &str =
        r#"{"x_m":-30,"y_m":40,"covariance":[[0.04,0],[0,0.04]],"length_m":4.6,"width_m":1.8,"points":12}"#;

    fn answer(kind: Kind, elements: &str) -> Result<PerceptionAnswer, String> {
        let line = format!("{{\"time_ns\":80000000,\"{}\":[{elements}]}}", kind.key()).replace('\n', "");
        let parsed = parse(line.as_bytes(), (kind, TIME), 3).map_err(|error| error.to_string())?;
        parsed.map_err(|error| error.to_string())
    }

    /// Checks that the element is refused with a message that names the field.
    fn refused(kind: Kind, [from, to]: [&str; 2], stated: &str) {
        let element = if kind == Kind::Tracks { TRACK } else { DETECTION };
        let changed = element.replacen(from, to, 1);
        assert_ne!(changed, element, "{from}");
        let error = answer(kind, &changed).unwrap_err();
        assert!(error.contains(stated), "{to}: {error}");
    }

    #[test]
    fn a_valid_track_is_read_to_the_last_bit() {
        let Ok(PerceptionAnswer::Tracks(tracks)) = answer(Kind::Tracks, TRACK) else { panic!("tracks") };
        let [track] = &tracks[..] else { panic!("one track") };
        assert_eq!((track.id, track.status, track.time), (TrackId(3), TrackStatus::Confirmed, TIME));
        assert_eq!(track.state, Vector4::new(-40.5, 0.25, 36.0, 0.0));
        assert_eq!((track.covariance[(0, 2)], track.class.0), (0.01, [0.75, 0.25, 0.0, 0.0]));
        assert_eq!(answer(Kind::Tracks, ""), Ok(PerceptionAnswer::Tracks(Vec::new())));
    }

    #[test]
    fn a_message_about_a_library_has_the_field_and_the_number_without_the_line() {
        let changed = TRACK.replacen("[0,0.01,0,0]", "[0,\"NaN\",0,0]", 1).replace('\n', "");
        let line = format!("{{\"time_ns\":80000000,\"tracks\":[{changed}]}}");
        let error = parse(line.as_bytes(), (Kind::Tracks, TIME), 3).unwrap().unwrap_err().without_line("the library");
        assert!(
            error.starts_with("the library answered: `tracks[0].covariance[1][1]` must be a variance: "),
            "{error}"
        );
        assert!(error.ends_with(", it is NaN"), "{error}");
        let failed = br#"{"time_ns":80000000,"error":"no map"}"#;
        assert_eq!(stated_error(failed), Some("no map".to_owned()));
        assert_eq!(stated_error(line.as_bytes()), None);
    }

    #[test]
    fn the_covariance_of_a_detection_is_turned_to_the_line_of_sight() {
        let element = DETECTION.replace("[[0.04,0],[0,0.04]]", "[[0.04,0.03],[0.03,0.09]]");
        let Ok(PerceptionAnswer::Detections(detections)) = answer(Kind::Detections, &element) else {
            panic!("detections")
        };
        // The line of sight has the direction (−0.6, 0.8).
        let range_m2 = 0.36 * 0.04 - 2.0 * 0.48 * 0.03 + 0.64 * 0.09;
        let lateral_m2 = 0.64 * 0.04 + 2.0 * 0.48 * 0.03 + 0.36 * 0.09;
        assert!((detections[0].range_sd_m.powi(2) - range_m2).abs() < 1e-12);
        assert!((detections[0].lateral_sd_m.powi(2) - lateral_m2).abs() < 1e-12);
        assert_eq!((detections[0].length, detections[0].class), (Extent::Assumed, ClassScores::UNKNOWN));
    }

    #[test]
    fn a_wrong_field_of_a_track_is_named_with_what_is_needed() {
        for (change, stated) in [
            (["-40.5", "NaN"], "`tracks[0].x_m` must be a finite number, it is NaN"),
            (["-40.5", "-Infinity"], "`tracks[0].x_m` must be a finite number, it is -Infinity"),
            (["[0,0.01,0,0]", "[0, NaN,0,0]"], "`tracks[0].covariance[1][1]` must be a finite number, it is NaN"),
            (["0.75", "NaN"], "`tracks[0].class.car` must be a finite number, it is NaN"),
            (["-40.5", "null"], "`tracks[0].x_m` must be a number from -500 to 500, it is null"),
            (["-40.5", "-4000"], "`tracks[0].x_m` must be a number from -500 to 500, it is -4000"),
            (["\"vx_mps\":36,", ""], "`tracks[0].vx_mps` must be a number from -150 to 150, it is absent"),
            (["[0,0.01,0,0]", "[0,-0.01,0,0]"], "`tracks[0].covariance[1][1]` must be a variance"),
            (["[0,0.01,0,0]", "[0,0.01,0]"], "`tracks[0].covariance[1]` must be a list of 4 numbers"),
            ([",[0,0,0,0.09]", ""], "`tracks[0].covariance` must be a list of 4 lists of 4 numbers"),
            (["[0.01,0,0.25", "[0.02,0,0.25"], "`tracks[0].covariance` must be symmetric"),
            (
                ["0.01,0],[0,0.01,0,0],[0.01", "5,0],[0,0.01,0,0],[5"],
                "`tracks[0].covariance` must be positive definite",
            ),
            (["\"truck\"", "\"bus\""], "`tracks[0].class.bus` must be a class: car, truck, motorcycle or background"),
            (["0.75", "0.85"], "`tracks[0].class` must be probabilities that add up to 1"),
            (["0.75", "1.75"], "`tracks[0].class.car` must be a number from 0 to 1, it is 1.75"),
            (["confirmed", "sure"], "`tracks[0].status` must be \"tentative\""),
            (["\"id\":3", "\"id\":-3"], "`tracks[0].id` must be a whole number"),
            (["0.9", "1.1"], "`tracks[0].existence` must be a number from 0 to 1"),
        ] {
            refused(Kind::Tracks, change, stated);
        }
        let twice = answer(Kind::Tracks, &format!("{TRACK},{TRACK}")).unwrap_err();
        assert!(twice.contains("`tracks[1].id` must be a number that no other track of the answer has"), "{twice}");
    }

    #[test]
    fn a_wrong_field_of_a_detection_is_named_with_what_is_needed() {
        for (change, stated) in [
            (["\"points\":12", "\"points\":0"], "`detections[0].points` must be a whole number from 1"),
            (["[0,0.04]", "[0,0]"], "`detections[0].covariance[1][1]` must be a variance"),
            (["4.6", "460"], "`detections[0].length_m` must be a number from 0.1 to 40, it is 460"),
            (["\"points\":12", "\"points\":12,\"time_ns\":90000000"], "`detections[0].time_ns` must be"),
            (
                ["\"points\":12", "\"points\":12,\"width_is_seen\":1"],
                "`detections[0].width_is_seen` must be true or false",
            ),
        ] {
            refused(Kind::Detections, change, stated);
        }
    }

    #[test]
    fn an_answer_to_another_question_and_other_lines_are_refused() {
        let parse = |line: &str| parse(line.as_bytes(), (Kind::Tracks, TIME), 3);
        let other = parse(r#"{"time_ns":40000000,"tracks":[]}"#).unwrap_err();
        assert!(matches!(other, ExecError::OtherStep { expected: 80_000_000, .. }), "{other}");
        for (line, stated) in [
            (r#"{"tracks":[]}"#, "`time_ns` must be 80000000, the `time_ns` of the question, it is absent"),
            (r#"{"time_ns":80000000}"#, "`tracks` must be a list of at most 256, it is absent"),
            (
                r#"{"time_ns":80000000,"detections":[]}"#,
                "`tracks` must be a list of at most 256, it is absent, and `detections` is there: the greeting says",
            ),
            (r#"{"time_ns":80000000,"tracks":[1]}"#, "`tracks[0]` must be an object, it is 1"),
            ("[]", "answered \"[]\": it must be an object of JSON"),
            ("null", "answered \"null\": it must be an object of JSON"),
            (r#"{"time_ns":80000000,"tracks":[{"id":3,"id":4}]}"#, "`id` must be there once, it is there twice"),
            ("tracks", "not JSON"),
        ] {
            let error = parse(line).unwrap().unwrap_err().to_string();
            assert!(error.contains(stated), "{line}: {error}");
        }
        let many = vec![TRACK; 257].join(",");
        assert!(answer(Kind::Tracks, &many).unwrap_err().contains("a list of at most 256, it is a list of 257"));
        assert_eq!(kind(br#"{"answers":"tracks"}"#), Ok(Kind::Tracks));
        assert!(
            kind(br#"{"answers":"boxes"}"#).unwrap_err().to_string().contains("`answers` must be \"detections\" or")
        );
    }
}
