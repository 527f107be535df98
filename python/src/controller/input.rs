//! What a controller is given. Its classes are documented in `closecall/_native.pyi`.

use closecall_controllers::{EgoInput, EgoSettings, Front, SensorAvailability};
use closecall_traffic::{Lane, Road, Source, Time, TrackStatus};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyBytes, PyTuple};

use super::setup_json;
use crate::observation::{bytes, len, write};

/// What a controller is told before its first step.
#[pyclass(frozen, module = "closecall")]
pub(crate) struct Setup {
    json: String,
}

impl Setup {
    pub(super) fn new(settings: &EgoSettings, road: &Road, lane: Lane) -> Self {
        Self { json: setup_json(settings, road, lane) }
    }

    fn part<'py>(&self, py: Python<'py>, key: &str) -> PyResult<Bound<'py, PyAny>> {
        py.import("json")?.call_method1("loads", (&self.json,))?.get_item(key)
    }
}

#[pymethods]
impl Setup {
    #[getter]
    fn control_step_s<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.part(py, "control_step_s")
    }

    #[getter]
    fn settings<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.part(py, "settings")
    }

    #[getter]
    fn road<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.part(py, "road")
    }
}

/// The ego's measurement of its own motion.
#[pyclass(frozen, get_all, module = "closecall")]
#[derive(Clone, Copy)]
pub(crate) struct Odometry {
    speed_mps: f64,
    acceleration_mps2: f64,
    yaw_rate_radps: f64,
    lane: u8,
    lane_offset_m: f64,
    length_m: f64,
    width_m: f64,
}

/// The lead vehicle.
#[pyclass(frozen, get_all, module = "closecall")]
#[derive(Clone, Copy)]
pub(crate) struct LeadVehicle {
    track: u32,
    gap_m: f64,
    speed_mps: f64,
    acceleration_mps2: f64,
}

/// The groups of sensors that work.
#[pyclass(frozen, get_all, module = "closecall")]
#[derive(Clone, Copy)]
pub(crate) struct Sensors {
    front: bool,
    surround: bool,
    rear: bool,
}

/// The perceived state of another vehicle.
#[pyclass(frozen, module = "closecall")]
#[derive(Clone)]
pub(crate) struct Track(closecall_traffic::Track);

#[pymethods]
impl Track {
    #[getter]
    fn id(&self) -> u32 {
        self.0.id.0
    }

    #[getter]
    fn source(&self) -> &'static str {
        match self.0.source {
            Source::Front => "front",
            Source::Surround => "surround",
            Source::Rear => "rear",
        }
    }

    #[getter]
    fn status(&self) -> &'static str {
        match self.0.status {
            TrackStatus::Tentative => "tentative",
            TrackStatus::Confirmed => "confirmed",
            TrackStatus::Coasting => "coasting",
        }
    }

    #[getter]
    fn time_s(&self) -> f64 {
        self.0.time.s()
    }

    #[getter]
    fn x_m(&self) -> f64 {
        self.0.x_m()
    }

    #[getter]
    fn y_m(&self) -> f64 {
        self.0.y_m()
    }

    #[getter]
    fn vx_mps(&self) -> f64 {
        self.0.vx_mps()
    }

    #[getter]
    fn vy_mps(&self) -> f64 {
        self.0.vy_mps()
    }

    #[getter]
    fn covariance(&self) -> [[f64; 4]; 4] {
        std::array::from_fn(|row| std::array::from_fn(|column| self.0.covariance[(row, column)]))
    }

    #[getter]
    fn heading_rad(&self) -> f64 {
        self.0.heading_rad
    }

    #[getter]
    fn length_m(&self) -> f64 {
        self.0.length_m
    }

    #[getter]
    fn width_m(&self) -> f64 {
        self.0.width_m
    }

    #[getter]
    fn class_probabilities(&self) -> (f64, f64, f64, f64) {
        self.0.class.0.into()
    }

    #[getter]
    fn existence(&self) -> f64 {
        self.0.existence
    }

    #[getter]
    fn lane(&self) -> (f64, f64, f64) {
        self.0.lane.into()
    }
}

/// The input of a control step.
#[pyclass(frozen, module = "closecall")]
pub(crate) struct ControllerInput {
    #[pyo3(get)]
    time_s: f64,
    #[pyo3(get)]
    time_ns: i64,
    #[pyo3(get)]
    odometry: Odometry,
    front: Option<Front>,
    sensors: SensorAvailability,
    road: Road,
    curvature_per_m: f64,
    measured: closecall_controllers::Odometry,
    tracks: Vec<closecall_traffic::Track>,
    /// The tracks as Python objects, as soon as they are asked for.
    objects: PyOnceLock<Py<PyTuple>>,
}

impl ControllerInput {
    pub(super) fn new(input: &EgoInput<'_>, front: Option<Front>) -> Self {
        let own = &input.odometry;
        Self {
            time_s: input.time.s(),
            time_ns: input.time.ns(),
            odometry: Odometry {
                speed_mps: own.speed_mps,
                acceleration_mps2: own.acceleration_mps2,
                yaw_rate_radps: own.yaw_rate_radps,
                lane: own.lane.0,
                lane_offset_m: own.lane_offset_m,
                length_m: own.length_m,
                width_m: own.width_m,
            },
            front,
            sensors: input.sensors,
            road: input.road.clone(),
            curvature_per_m: input.curvature_per_m,
            measured: *own,
            tracks: input.tracks.to_vec(),
            objects: PyOnceLock::new(),
        }
    }
}

#[pymethods]
impl ControllerInput {
    #[getter]
    fn front(&self) -> Option<LeadVehicle> {
        self.front.map(|front| LeadVehicle {
            track: front.track.0,
            gap_m: front.gap_m,
            speed_mps: front.speed_mps,
            acceleration_mps2: front.acceleration_mps2,
        })
    }

    #[getter]
    fn sensors(&self) -> Sensors {
        let works = self.sensors;
        Sensors { front: works.front, surround: works.surround, rear: works.rear }
    }

    /// Returns what the stepping interface observes, as bytes of 64-bit floats.
    fn observation<'py>(&self, py: Python<'py>, max_tracks: usize) -> Bound<'py, PyBytes> {
        let input = EgoInput {
            time: Time::from_ns(self.time_ns),
            odometry: self.measured,
            road: &self.road,
            curvature_per_m: self.curvature_per_m,
            tracks: &self.tracks,
            sensors: self.sensors,
        };
        let mut values = Vec::with_capacity(len(max_tracks));
        write(&input, self.front, max_tracks, &mut values);
        PyBytes::new(py, &bytes(&values))
    }

    #[getter]
    fn tracks<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        let objects = self.objects.get_or_try_init(py, || {
            let tracks = self.tracks.iter().map(|track| Track(track.clone()));
            PyTuple::new(py, tracks.map(|track| Bound::new(py, track)).collect::<PyResult<Vec<_>>>()?)
                .map(Bound::unbind)
        })?;
        Ok(objects.bind(py).clone())
    }
}
