//! Controllers that are Python objects: what they are given, and how their answers and exceptions are taken.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use closecall_controllers::external::RoadMessage;
use closecall_controllers::external::watch::Call;
use closecall_controllers::{
    ControllerError, EgoCommand, EgoController, EgoInput, EgoSettings, EgoState, LeadVehicleSelector, Reason,
};
use closecall_simulation::ControllerFactory;
use closecall_simulation::controller::hosted::{self, HostedProcess, Registration, register};
use closecall_simulation::controller::isolated::Isolated;
use closecall_traffic::{CONTROL_STEP, Lane, Road};
use pyo3::exceptions::{PyKeyboardInterrupt, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use serde_json::json;

mod input;

pub(crate) use input::{ControllerInput, LeadVehicle, Odometry, Sensors, Setup, Track};

/// What a controller may answer, for messages.
const ANSWERS: &str = "a number (m/s²), or a pair of a number and a state";
/// The states, for messages.
const STATES: &str = "following, increasing, holding, releasing, emergency-braking";

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// What all controllers of a campaign share.
#[derive(Debug, Default)]
struct Shared {
    /// True if no controller is to make another step.
    is_cancelled: AtomicBool,
    /// The exception of the latest failure.
    failure: Mutex<Option<PyErr>>,
    /// The threads that are in a step, by Python's identifiers, with the time at which the step began.
    threads: Mutex<BTreeMap<u64, Instant>>,
    /// Number of threads that are in a step, or about to begin one.
    active: AtomicUsize,
}

/// A thread that is in a step, until this value is dropped.
struct Active<'a>(&'a Shared);

impl<'a> Active<'a> {
    fn new(shared: &'a Shared) -> Self {
        shared.active.fetch_add(1, Ordering::SeqCst);
        Self(shared)
    }
}

impl Drop for Active<'_> {
    fn drop(&mut self) {
        self.0.active.fetch_sub(1, Ordering::SeqCst);
    }
}

/// A controller that is a Python object: a callable that creates it for each sample.
#[pyclass(frozen, module = "closecall._native")]
pub(crate) struct PythonController {
    /// `python:NAME@VERSION`.
    #[pyo3(get)]
    name: String,
    create: Arc<Py<PyAny>>,
    shared: Arc<Shared>,
    process: Option<HostedProcess>,
    registration: Mutex<Option<Registration>>,
}

impl PythonController {
    /// Returns a factory of the controller.
    pub(crate) fn factory(&self, _: Python<'_>) -> Arc<dyn ControllerFactory> {
        let (name, process) = (reported(&self.name).to_owned(), self.process.clone());
        Arc::new(Factory { name, create: self.create.clone(), shared: self.shared.clone(), process })
    }

    /// Returns the exception of the latest failure.
    pub(crate) fn take_failure(&self) -> Option<PyErr> {
        lock(&self.shared.failure).take()
    }

    /// Lets every controller fail at its next step.
    pub(crate) fn cancel(&self) {
        self.shared.is_cancelled.store(true, Ordering::SeqCst);
    }
}

#[pymethods]
impl PythonController {
    /// Creates a controller. `name` is `python:NAME@VERSION`; `create` is called without arguments for each sample. `process` has the
    /// words that start a worker process, and its limits: the time of an answer (ms), and the memory (MiB). Campaigns then run its
    /// samples in such processes.
    #[new]
    #[pyo3(signature = (name, create, process=None))]
    fn new(name: String, create: Py<PyAny>, process: Option<(Vec<String>, u64, u64)>) -> Self {
        let process = process.map(|(words, timeout_ms, memory_mib)| {
            let (id, name) = (name.clone(), reported(&name).to_owned());
            HostedProcess { id, name, words, timeout_ms, memory_mib }
        });
        Self { name, create: Arc::new(create), shared: Arc::default(), process, registration: Mutex::default() }
    }

    /// Lets the commands of the program use the controller by its name.
    fn register(&self, py: Python<'_>) {
        let earlier = lock(&self.registration).replace(register(&self.name, self.factory(py)));
        drop(earlier);
    }

    /// Undoes `register`, lets every controller fail at its next step, and returns Python's identifiers of the threads that are
    /// still in a step.
    fn unregister(&self) -> Vec<u64> {
        let registration = lock(&self.registration).take();
        drop(registration);
        self.cancel();
        lock(&self.shared.threads).keys().copied().collect()
    }

    /// Python's identifiers of the threads that have been in the same step for longer than `limit_s`.
    fn late(&self, limit_s: f64) -> Vec<u64> {
        let threads = lock(&self.shared.threads);
        let late = threads.iter().filter(|(_, began)| began.elapsed().as_secs_f64() > limit_s);
        late.map(|(thread, _)| *thread).collect()
    }

    /// Whether any thread is in a step.
    #[getter]
    fn is_busy(&self) -> bool {
        self.shared.active.load(Ordering::SeqCst) > 0
    }
}

/// Lets this process, which is a worker process, refuse the samples of a controller that it cannot load.
#[pyfunction]
pub(crate) fn refuse(name: &str, reason: String) {
    hosted::refuse(name, reason);
}

/// Returns the name in reports, which lacks the version.
fn reported(name: &str) -> &str {
    name.split_once('@').map_or(name, |(name, _)| name)
}

struct Factory {
    name: String,
    create: Arc<Py<PyAny>>,
    shared: Arc<Shared>,
    process: Option<HostedProcess>,
}

impl ControllerFactory for Factory {
    fn name(&self) -> &str {
        &self.name
    }

    /// The outcome summarises the states that the controller answers if the scenario has a margin increase system.
    fn has_mis(&self, settings: &EgoSettings) -> bool {
        settings.mis().is_some()
    }

    fn isolated(&self) -> Option<Isolated> {
        self.process.clone().map(Isolated::Hosted)
    }

    /// The thread keeps its state of the interpreter during the run. Otherwise each step would create one, which takes longer than the call.
    fn in_thread(&self, run: &mut (dyn FnMut() + Send)) {
        // The interpreter must not end while a thread is about to enter it, in it, or about to leave it.
        let _active = Active::new(&self.shared);
        if self.shared.is_cancelled.load(Ordering::SeqCst) {
            run();
        } else {
            Python::attach(|py| py.detach(run));
        }
    }

    fn build(&self, settings: &EgoSettings) -> Box<dyn EgoController> {
        Box::new(Controller {
            settings: *settings,
            create: self.create.clone(),
            shared: self.shared.clone(),
            lead: LeadVehicleSelector::default(),
            step: None,
            thread: 0,
        })
    }
}

/// A Python object that drives one run. It is created at the first step.
struct Controller {
    settings: EgoSettings,
    create: Arc<Py<PyAny>>,
    shared: Arc<Shared>,
    lead: LeadVehicleSelector,
    /// The object's method `step`.
    step: Option<Py<PyAny>>,
    /// Python's identifier of the thread of the run.
    thread: u64,
}

impl Controller {
    fn call(&mut self, py: Python<'_>, input: &EgoInput<'_>) -> PyResult<(f64, EgoState)> {
        let given = ControllerInput::new(input, self.lead.update(input));
        let step = match &self.step {
            Some(step) => step.bind(py),
            None => {
                let step = self.start(py, (input.road, input.odometry.lane))?;
                self.step.insert(step).bind(py)
            }
        };
        lock(&self.shared.threads).insert(self.thread, Instant::now());
        let answer = step.call1((Bound::new(py, given)?,));
        lock(&self.shared.threads).remove(&self.thread);
        parse(&answer?)
    }

    /// Creates the object, calls its method `start` if it has one, and returns its method `step`.
    fn start(&mut self, py: Python<'_>, road: (&Road, Lane)) -> PyResult<Py<PyAny>> {
        self.thread = py.import("threading")?.call_method0("get_ident")?.extract()?;
        lock(&self.shared.threads).insert(self.thread, Instant::now());
        let started = self.create(py, road);
        lock(&self.shared.threads).remove(&self.thread);
        started
    }

    fn create(&self, py: Python<'_>, (road, lane): (&Road, Lane)) -> PyResult<Py<PyAny>> {
        let object = self.create.bind(py).call0()?;
        if let Ok(start) = object.getattr("start") {
            start.call1((Setup::new(&self.settings, road, lane),))?;
        }
        Ok(object.getattr("step")?.unbind())
    }
}

impl EgoController for Controller {
    fn step(&mut self, input: &EgoInput<'_>) -> Result<EgoCommand, ControllerError> {
        input.check_finite()?;
        let shared = self.shared.clone();
        // The interpreter must not end while a thread is about to enter it, in it, or about to leave it.
        let _active = Active::new(&shared);
        let called = if shared.is_cancelled.load(Ordering::SeqCst) {
            Err("the Python program has ended the run".to_owned())
        } else {
            // A worker process ends if a call takes too long, also if it keeps the interpreter to itself.
            let begin = if self.step.is_none() { Call::begin_start } else { Call::begin };
            let _call = begin(input.time);
            Python::attach(|py| {
                self.call(py, input).map_err(|error| {
                    let text = described(py, &error);
                    // The earlier exception is dropped without the lock: its objects may run code, during which another thread
                    // takes the interpreter and waits for the lock.
                    let earlier = lock(&shared.failure).replace(error);
                    drop(earlier);
                    text
                })
            })
        };
        let (acceleration_mps2, state) = called.map_err(|reason| ControllerError::Own { reason, time: input.time })?;
        Ok(EgoCommand { acceleration_mps2, state, reason: Reason::External, plan: None })
    }
}

/// Returns the acceleration and the state of an answer.
fn parse(answer: &Bound<'_, PyAny>) -> PyResult<(f64, EgoState)> {
    if let Ok(acceleration_mps2) = answer.extract::<f64>() {
        return Ok((acceleration_mps2, EgoState::Following));
    }
    if let Ok(pair) = answer.cast::<PyTuple>()
        && let Ok((acceleration_mps2, state)) = pair.extract::<(f64, String)>()
    {
        let parsed = serde_json::from_value(json!(state));
        let refused = |_| PyValueError::new_err(format!("`step` answered the state `{state}`: it is one of {STATES}"));
        return Ok((acceleration_mps2, parsed.map_err(refused)?));
    }
    let type_name = answer.get_type().name()?;
    Err(PyTypeError::new_err(format!("`step` answered {}, a `{type_name}`: it must be {ANSWERS}", answer.repr()?)))
}

/// Describes an exception: its type and message, then the traceback without them. An exception that no code of the controller has
/// raised has no traceback.
fn described(py: Python<'_>, error: &PyErr) -> String {
    if error.is_instance_of::<PyKeyboardInterrupt>(py) {
        return "the Python program has ended the run".to_owned();
    }
    let traceback = || -> PyResult<String> {
        let parts = (error.get_type(py), error.value(py), error.traceback(py));
        let lines = py.import("traceback")?.call_method1("format_exception", parts)?;
        Ok(lines.extract::<Vec<String>>()?.concat())
    };
    match traceback() {
        Ok(text) => with_traceback(&error.to_string(), text.trim_end()),
        Err(_) => error.to_string(),
    }
}

/// Returns the message of an exception, and below it its traceback. The last lines of a traceback are the message: they are left out.
fn with_traceback(message: &str, traceback: &str) -> String {
    let frames = traceback.strip_suffix(message).filter(|frames| frames.is_empty() || frames.ends_with('\n'));
    match frames.unwrap_or(traceback).trim_end() {
        "" => message.to_owned(),
        frames => format!("{message}\n{frames}"),
    }
}

/// Returns the settings of the ego stack and the road as JSON, with the keys of the protocol of external processes.
fn setup_json(settings: &EgoSettings, road: &Road, lane: Lane) -> String {
    json!({
        "control_step_s": CONTROL_STEP.s(),
        "settings": settings,
        "road": RoadMessage::of(road, lane),
    })
    .to_string()
}
