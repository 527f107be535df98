//! A perception that is a shared library with the functions of
//! `controllers/include/closecall_perception.h`: `sensors.perception = "lib:PATH"`.
//!
//! ```text
//!  run ── hello, one line per control step with scans ──▶ process: `closecall host perceive PATH` ─▶ library
//!      ◀── hello, one line of detections or tracks ─────                                          ◀─
//! ```
//!
//! The code of a library can do anything to the process that loads it. Each run therefore starts a
//! process of this program, which speaks the protocol of a perception process, with the same
//! limits. A crash costs one sample.
//!
//! The process writes every number as the library gives it. The run checks them, so that a message
//! has the name of the field. JSON has no number that is not finite: it is written as a word, which
//! is refused. A failure of the library is an answer with the key `error`.

mod abi;
mod loaded;
mod view;

use std::io::{BufRead, Write};
use std::path::Path;

use serde_json::{Value, json};

use self::abi::{Detection, Track};
use self::loaded::{Library, Objects, Run};
use self::view::Setup;
use crate::controller::exec::PROTOCOL;
use crate::controller::native::Probe;
use crate::perception::answer::ERROR_KEY;
use crate::perception::message::Message;

/// Loads a library in this process, and writes a line to `answers` that says what it is. The
/// library is unloaded afterwards.
///
/// # Errors
/// The message of the failure.
pub fn probe(path: &Path, mut answers: impl Write) -> Result<(), String> {
    let loaded = Library::load(path);
    let probe = match &loaded {
        Ok(library) => Probe::Identity(library.identity().clone()),
        Err(error) => Probe::Refused { reason: error.to_string(), is_io: error.is_io() },
    };
    let text = serde_json::to_string(&probe).map_err(|error| error.to_string())?;
    writeln!(answers, "{text}").and_then(|()| answers.flush()).map_err(|error| error.to_string())
}

/// Loads a library in this process, and answers every message of `requests` with a line to
/// `answers`, until there are no more.
///
/// # Errors
/// The message of the failure, after which the process is to end.
pub fn serve(path: &Path, requests: impl BufRead, mut answers: impl Write) -> Result<(), String> {
    let library = Library::load(path).map_err(|error| error.to_string())?;
    let mut setup: Option<Setup> = None;
    let mut run: Option<Run<'_>> = None;
    for line in requests.lines() {
        let line = line.map_err(|error| format!("failed to read a message: {error}"))?;
        let message: Message =
            serde_json::from_str(&line).map_err(|error| format!("failed to read a message: {error}"))?;
        let answer = match message {
            Message::Hello(hello) => {
                setup = Some(Setup::new(*hello));
                let identity = library.identity();
                json!({
                    "type": "hello", "protocol": PROTOCOL, "answers": library.kind().key(),
                    "name": identity.name, "version": identity.version,
                })
            }
            Message::Scans(question) => {
                let setup = setup.as_ref().ok_or("the scans came before the greeting")?;
                let started = match run.take() {
                    Some(run) => Ok(run),
                    None => library.start(setup),
                };
                let answered = started.and_then(|started| run.insert(started).step(setup, &question));
                match answered {
                    Ok(Objects::Detections(detections)) => {
                        let list: Vec<Value> = detections.iter().map(detection).collect();
                        json!({ "time_ns": question.time_ns, "detections": list })
                    }
                    Ok(Objects::Tracks(tracks)) => {
                        let list: Vec<Value> = tracks.iter().map(track).collect();
                        json!({ "time_ns": question.time_ns, "tracks": list })
                    }
                    Err(reason) => json!({ "time_ns": question.time_ns, ERROR_KEY: reason }),
                }
            }
            Message::End => {
                drop(run.take());
                json!({ "type": "end" })
            }
        };
        let written = writeln!(answers, "{answer}").and_then(|()| answers.flush());
        written.map_err(|error| format!("failed to answer: {error}"))?;
    }
    Ok(())
}

/// Returns a detection as an answer has it.
fn detection(one: &Detection) -> Value {
    let mut object = json!({
        "x_m": number(one.x_m),
        "y_m": number(one.y_m),
        "covariance": rows::<2>(&one.covariance),
        "heading_rad": number(one.heading_rad),
        "length_m": number(one.length_m),
        "width_m": number(one.width_m),
        "top_m": number(one.top_m),
        "time_ns": one.time_ns,
        "points": one.points,
        "length_is_seen": truth(one.length_is_seen),
        "width_is_seen": truth(one.width_is_seen),
    });
    add_class(&mut object, one.class);
    object
}

/// Returns a track as an answer has it.
fn track(one: &Track) -> Value {
    let status = match one.status {
        0 => json!("tentative"),
        1 => json!("confirmed"),
        2 => json!("coasting"),
        other => json!(other),
    };
    let mut object = json!({
        "id": one.id,
        "status": status,
        "x_m": number(one.x_m),
        "y_m": number(one.y_m),
        "vx_mps": number(one.vx_mps),
        "vy_mps": number(one.vy_mps),
        "covariance": rows::<4>(&one.covariance),
        "heading_rad": number(one.heading_rad),
        "length_m": number(one.length_m),
        "width_m": number(one.width_m),
        "existence": number(one.existence),
    });
    add_class(&mut object, one.class);
    object
}

/// Returns a number, or the word for a number that is not finite.
fn number(value: f64) -> Value {
    if value.is_finite() { json!(value) } else { json!(value.to_string()) }
}

/// Returns a truth value, or the number that stands for none.
fn truth(value: u32) -> Value {
    match value {
        0 => json!(false),
        1 => json!(true),
        other => json!(other),
    }
}

/// Returns the rows of a matrix with `N` columns.
fn rows<const N: usize>(elements: &[f64]) -> Value {
    elements.chunks_exact(N).map(|row| row.iter().copied().map(number).collect::<Value>()).collect()
}

/// Adds the probabilities of the classes, unless all are 0: then nothing is known.
fn add_class(object: &mut Value, class: [f64; 4]) {
    if class != [0.0; 4] {
        let [car, truck, motorcycle, background] = class.map(number);
        object["class"] = json!({ "car": car, "truck": truck, "motorcycle": motorcycle, "background": background });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_that_are_not_finite_are_words_and_a_class_that_is_unset_is_absent() {
        assert_eq!(number(0.1), json!(0.1));
        assert_eq!([f64::NAN, f64::INFINITY].map(number), [json!("NaN"), json!("inf")]);
        assert_eq!(rows::<2>(&[1.0, f64::NAN, 0.5, 2.0]), json!([[1.0, "NaN"], [0.5, 2.0]]));
        let mut object = json!({});
        add_class(&mut object, [0.0; 4]);
        assert_eq!(object, json!({}));
        add_class(&mut object, [f64::NAN, 0.0, 0.0, 0.0]);
        assert_eq!(object["class"]["car"], json!("NaN"));
    }

    #[test]
    fn a_file_that_is_no_library_is_refused() {
        let refused = |path: &str| {
            let mut line = Vec::new();
            probe(Path::new(path), &mut line).unwrap();
            match serde_json::from_slice(&line).unwrap() {
                Probe::Refused { reason, is_io } => (reason, is_io),
                Probe::Identity(_) => panic!("{path} is refused"),
            }
        };
        let (reason, is_io) = refused("src/perception/library/mod.rs");
        assert!(reason.contains("is not a shared library") && !is_io, "{reason}");
        assert!(refused("no-such.so").1);
    }
}
