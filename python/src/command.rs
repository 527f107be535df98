//! The commands of the program, called from Python.

use std::ffi::OsString;
use std::path::PathBuf;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

use arrow::array::RecordBatchReader;
use closecall::cli;
use closecall_campaign::session::Session;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use pyo3::exceptions::{PyOSError, PyRuntimeError};
use pyo3::prelude::*;

use crate::error::{Failure, raise};
use crate::table::Table;

/// Interval at which Python's signals and the progress of a command are looked at.
const POLL_INTERVAL: Duration = Duration::from_millis(50);

/// Sets the file of this module, by which campaigns identify the program, and the words that start the program, which serves
/// libraries and FMUs in processes of its own.
#[pyfunction]
pub(crate) fn set_program(path: PathBuf, words: Vec<String>) {
    closecall::cli::name_commit();
    closecall_campaign::manifest::set_program(path);
    closecall_simulation::controller::native::set_program(words);
}

/// Runs the program `closecall` with these arguments and returns its exit code. The first argument is its name.
#[pyfunction]
pub(crate) fn main(py: Python<'_>, arguments: Vec<OsString>) -> u8 {
    py.detach(|| cli::main(&arguments) as u8)
}

/// Calls a function of the program in a thread of its own, with keywords (JSON). Returns its exit code, its result (JSON) and its
/// warnings. `spelled` is the call as Python spells it. `progress` is called with the number of samples that are done and of all.
///
/// Ctrl-C stops a campaign after the samples that are running, and a second one returns at once. Any other function goes on
/// unseen.
#[pyfunction]
#[pyo3(signature = (function, keywords, spelled, progress=None))]
pub(crate) fn call(
    py: Python<'_>,
    function: String,
    keywords: String,
    spelled: String,
    progress: Option<Bound<'_, PyAny>>,
) -> PyResult<(u8, String, Vec<String>)> {
    let session = Session::default();
    let is_campaign = function == "campaign";
    let (sender, mut receiver) = channel();
    let called = session.clone();
    let body = move || {
        let run = || cli::call(&function, &keywords).map_err(|error| Failure::of(&error));
        // The receiver is gone if Ctrl-C has ended the call.
        sender.send(called.run(&spelled, run)).ok();
    };
    thread::Builder::new().name("command".to_owned()).spawn(body)?;
    let mut reported = [0; 2];
    let mut interrupt: Option<PyErr> = None;
    loop {
        let results = &mut receiver;
        let received = py.detach(move || results.recv_timeout(POLL_INTERVAL));
        let samples = session.samples.each_ref().map(|count| count.load(Ordering::Relaxed));
        if let Some(progress) = progress.as_ref().filter(|_| interrupt.is_none() && samples != reported) {
            reported = samples;
            interrupt = progress.call1((samples[0], samples[1])).err();
        }
        if let Err(signal) = py.check_signals() {
            if interrupt.is_some() {
                // The samples that are ended now must not enter the journal as errors.
                session.stop.abandon();
                return Err(signal);
            }
            interrupt = Some(signal);
        }
        if interrupt.is_some() {
            session.stop.set();
        }
        match (received, interrupt) {
            (Ok(_), Some(interrupt)) => return Err(interrupt),
            (Ok(Ok((code, result))), None) => return Ok((code as u8, result.to_string(), session.warnings())),
            (Ok(Err(failure)), None) => return Err(raise(py, &failure)),
            (Err(RecvTimeoutError::Disconnected), _) => {
                return Err(PyRuntimeError::new_err("the command has panicked: the message is on standard error"));
            }
            (Err(RecvTimeoutError::Timeout), Some(raised)) if !is_campaign => return Err(raised),
            (Err(RecvTimeoutError::Timeout), raised) => interrupt = raised,
        }
    }
}

/// Reads a Parquet file.
#[pyfunction]
pub(crate) fn read_table(path: PathBuf) -> PyResult<Table> {
    let fail =
        |error: &dyn std::fmt::Display| PyOSError::new_err(format!("failed to read {}: {error}", path.display()));
    let file = std::fs::File::open(&path).map_err(|error| fail(&error))?;
    let reader = ParquetRecordBatchReaderBuilder::try_new(file).and_then(|builder| builder.build());
    let reader = reader.map_err(|error| fail(&error))?;
    let schema = reader.schema();
    let batches = reader.collect::<Result<Vec<_>, _>>().map_err(|error| fail(&error))?;
    Ok(Table::new(schema, batches))
}
