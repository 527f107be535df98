//! Runs that Python steps: one, or several at once.

use std::mem;
use std::process;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use closecall_controllers::{EgoCommand, EgoState, LeadVehicleSelector, Reason};
use closecall_report::json;
use closecall_scenarios::outcome::EndReason;
use closecall_sensors::SensorMode;
use closecall_simulation::{NoObserver, RunKey, SampleError, Stepper};
use closecall_traffic::Measured;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};

use crate::error::{sample_exception, usage_exception};
use crate::observation::{bytes, len, write};
use crate::run::sensor_mode;
use crate::scenario::Scenario;

/// The threads that step several runs, and the process that has started them.
static POOL: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);

/// Returns the threads of this process. A process that was forked has none of the threads of its parent.
fn pool() -> Result<Arc<ThreadPool>, ThreadPoolBuildError> {
    let mut kept = POOL.lock().unwrap_or_else(PoisonError::into_inner);
    match &*kept {
        Some((owner, pool)) if *owner == process::id() => Ok(pool.clone()),
        _ => {
            let pool = Arc::new(ThreadPoolBuilder::new().build()?);
            // The pool of the parent is not dropped: that would tell its threads, which are not here, to end.
            mem::forget(kept.replace((process::id(), pool.clone())));
            Ok(pool)
        }
    }
}

/// Why several runs have not been stepped.
enum StepError {
    /// The run with this index has ended or not begun.
    NotRunning(usize),
    /// A run has ended without an outcome.
    Sample(u64, SampleError),
}

/// One run and what is observed of it. A run that has ended in an error has no stepper.
#[derive(Default)]
struct State {
    stepper: Option<Stepper>,
    lead: LeadVehicleSelector,
    sample: u64,
    /// The latest observation.
    values: Vec<f64>,
    /// Whether the last step has ended the run: it starts anew at the next one.
    has_ended: bool,
}

impl State {
    fn reset(
        &mut self,
        scenario: &Scenario,
        key: RunKey,
        sensors: Option<SensorMode>,
        max_tracks: usize,
    ) -> Result<(), SampleError> {
        (self.lead, self.sample, self.has_ended) = (LeadVehicleSelector::default(), key.sample, false);
        self.stepper = None;
        let concrete = scenario.concrete(key.seed, key.sample)?;
        self.stepper = Some(Stepper::new(concrete, key, sensors, &mut NoObserver)?);
        self.observe(max_tracks);
        Ok(())
    }

    /// Commands an acceleration (m/s²), and observes the next control step. The observation stays if the run has ended.
    fn step(&mut self, acceleration_mps2: f64, max_tracks: usize) -> Result<(), SampleError> {
        let Some(stepper) = &mut self.stepper else { return Ok(()) };
        let command =
            EgoCommand { acceleration_mps2, state: EgoState::Following, reason: Reason::External, plan: None };
        if let Err(error) = stepper.step(command, &mut NoObserver) {
            self.stepper = None;
            return Err(error);
        }
        self.has_ended = stepper.outcome().is_some();
        self.observe(max_tracks);
        Ok(())
    }

    fn observe(&mut self, max_tracks: usize) {
        if let Some(input) = self.stepper.as_ref().and_then(Stepper::input) {
            let front = self.lead.update(&input);
            write(&input, front, max_tracks, &mut self.values);
        }
    }

    /// Returns 0 as long as the run goes on, then 1 (the time is over), 2 (standstill), 3 (a collision of the ego) or 4 (of
    /// others).
    fn end(&self) -> u8 {
        let Some(outcome) = self.stepper.as_ref().and_then(Stepper::outcome) else { return 0 };
        match outcome.end {
            EndReason::Duration => 1,
            EndReason::Standstill => 2,
            EndReason::Collision if outcome.ego_collided() => 3,
            EndReason::Collision => 4,
        }
    }

    /// Returns the true margins of the ego, the absent ones as `None`; empty if the run has ended.
    fn truth<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let truth = PyDict::new(py);
        let Some(margins) = self.stepper.as_ref().and_then(Stepper::margins) else { return Ok(truth) };
        let set = |key: &str, value: Measured| truth.set_item(key, value.ok());
        set("gap_front_m", margins.gap_front_m)?;
        set("thw_front_s", margins.thw_front_s)?;
        set("gap_rear_m", margins.gap_rear_m)?;
        set("thw_rear_s", margins.thw_rear_s)?;
        set("ttc_rear_s", margins.ttc_rear_s)?;
        Ok(truth)
    }

    fn outcome(&self) -> Option<String> {
        let outcome = self.stepper.as_ref().and_then(Stepper::outcome)?;
        Some(json::outcome(outcome).to_string())
    }
}

/// A run that Python steps.
#[pyclass(frozen, module = "closecall._native")]
pub(crate) struct Episode {
    scenario: Scenario,
    sensors: Option<SensorMode>,
    max_tracks: usize,
    state: Mutex<State>,
}

impl Episode {
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[pymethods]
impl Episode {
    #[new]
    #[pyo3(signature = (scenario, sensors, max_tracks))]
    fn new(py: Python<'_>, scenario: &Bound<'_, Scenario>, sensors: Option<&str>, max_tracks: usize) -> PyResult<Self> {
        let sensors = sensor_mode(py, sensors)?;
        Ok(Self { scenario: scenario.get().clone(), sensors, max_tracks, state: Mutex::default() })
    }

    /// Starts a run, and returns the first observation.
    fn reset<'py>(&self, py: Python<'py>, seed: u64, sample: u64) -> PyResult<Bound<'py, PyBytes>> {
        let observed = py.detach(|| {
            // The lock is taken without the interpreter's, so that no two threads wait for each other.
            let mut state = self.state();
            state.reset(&self.scenario, RunKey { seed, sample }, self.sensors, self.max_tracks)?;
            Ok(bytes(&state.values))
        });
        Ok(PyBytes::new(py, &observed.map_err(|error| sample_exception(py, sample, &error))?))
    }

    /// Commands an acceleration (m/s²). Returns the next observation, and why the run has ended (0: it goes on).
    fn step<'py>(&self, py: Python<'py>, acceleration_mps2: f64) -> PyResult<(Bound<'py, PyBytes>, u8)> {
        let stepped = py.detach(|| {
            let mut state = self.state();
            if state.stepper.is_none() || state.has_ended {
                return Ok(None);
            }
            state.step(acceleration_mps2, self.max_tracks).map_err(|error| (state.sample, error))?;
            Ok(Some((bytes(&state.values), state.end())))
        });
        match stepped.map_err(|(sample, error)| sample_exception(py, sample, &error))? {
            Some((observed, end)) => Ok((PyBytes::new(py, &observed), end)),
            None => Err(usage_exception(py, "the run has ended or not begun: call `reset` before `step`")),
        }
    }

    /// Returns the true margins of the ego.
    fn truth<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        self.state().truth(py)
    }

    /// Returns the outcome as JSON; `None` as long as the run goes on.
    fn outcome(&self) -> Option<String> {
        self.state().outcome()
    }
}

/// Several runs that Python steps at once, on all cores.
#[pyclass(frozen, module = "closecall._native")]
pub(crate) struct Episodes {
    scenario: Scenario,
    sensors: Option<SensorMode>,
    max_tracks: usize,
    count: usize,
    states: Mutex<Vec<State>>,
}

impl Episodes {
    fn states(&self) -> MutexGuard<'_, Vec<State>> {
        self.states.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[pymethods]
impl Episodes {
    #[new]
    #[pyo3(signature = (scenario, sensors, max_tracks, count))]
    fn new(
        py: Python<'_>,
        scenario: &Bound<'_, Scenario>,
        sensors: Option<&str>,
        max_tracks: usize,
        count: usize,
    ) -> PyResult<Self> {
        let mut states = Vec::new();
        states.resize_with(count, State::default);
        let (scenario, sensors) = (scenario.get().clone(), sensor_mode(py, sensors)?);
        Ok(Self { scenario, sensors, max_tracks, count, states: Mutex::new(states) })
    }

    /// Starts the runs whose key `(seed, sample)` is given, and goes a step on with the others. Returns the observations, one
    /// behind the other, and for each run why it has ended (0: it goes on).
    fn step<'py>(
        &self,
        py: Python<'py>,
        accelerations_mps2: Vec<f64>,
        starts: Vec<Option<(u64, u64)>>,
    ) -> PyResult<(Bound<'py, PyBytes>, Vec<u8>)> {
        if [accelerations_mps2.len(), starts.len()] != [self.count; 2] {
            let (count, given) = (self.count, accelerations_mps2.len());
            return Err(usage_exception(py, &format!("there are {count} runs, and {given} actions")));
        }
        let keys = starts.into_iter().map(|start| start.map(|(seed, sample)| RunKey { seed, sample }));
        let inputs: Vec<(f64, Option<RunKey>)> = accelerations_mps2.into_iter().zip(keys).collect();
        let step = |state: &mut State, (acceleration_mps2, start): (f64, Option<RunKey>)| {
            let result = match start {
                Some(key) => state.reset(&self.scenario, key, self.sensors, self.max_tracks),
                None => state.step(acceleration_mps2, self.max_tracks),
            };
            result.map_err(|error| StepError::Sample(state.sample, error))
        };
        // Handing a single run to a thread takes longer than stepping it.
        let pool = (self.count > 1).then(pool).transpose();
        let pool = pool.map_err(|error| PyRuntimeError::new_err(format!("failed to start threads: {error}")))?;
        let pool = pool.filter(|pool| pool.current_num_threads() > 1);
        let stepped = py.detach(|| {
            let mut states = self.states();
            let pairs = || states.iter().zip(&inputs);
            if let Some(index) = pairs().position(|(state, (_, start))| state.stepper.is_none() && start.is_none()) {
                return Err(StepError::NotRunning(index));
            }
            // All runs are stepped, also if one of them fails.
            let runs = &mut *states;
            let stepped: Vec<Result<(), StepError>> = match &pool {
                Some(pool) => pool.install(|| {
                    let pairs = runs.par_iter_mut().zip(inputs);
                    pairs.map(|(state, input)| step(state, input)).collect()
                }),
                None => runs.iter_mut().zip(inputs).map(|(state, input)| step(state, input)).collect(),
            };
            stepped.into_iter().collect::<Result<(), _>>()?;
            let mut observed = Vec::with_capacity(self.count * len(self.max_tracks) * size_of::<f64>());
            states.iter().for_each(|state| observed.extend(bytes(&state.values)));
            Ok((observed, states.iter().map(State::end).collect::<Vec<u8>>()))
        });
        let (observed, ends) = stepped.map_err(|error| match error {
            StepError::NotRunning(index) => {
                usage_exception(py, &format!("run {index} has ended or not begun: call `reset` before `step`"))
            }
            StepError::Sample(sample, error) => sample_exception(py, sample, &error),
        })?;
        Ok((PyBytes::new(py, &observed), ends))
    }

    /// Returns the true margins of the ego of a run.
    fn truth<'py>(&self, py: Python<'py>, index: usize) -> PyResult<Bound<'py, PyDict>> {
        let states = self.states();
        states.get(index).map_or_else(|| Ok(PyDict::new(py)), |state| state.truth(py))
    }

    /// Returns the outcome of a run as JSON; `None` as long as it goes on.
    fn outcome(&self, index: usize) -> Option<String> {
        let states = self.states();
        states.get(index).and_then(State::outcome)
    }
}
