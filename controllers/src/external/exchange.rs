//! The data that a controller receives, and its answers.

use std::ffi::{CStr, CString};

use closecall_traffic::{CONTROL_STEP, Lane, Road, Side, Time};
use serde_json::Value;

use crate::external::abi::{InputView, Setting, SetupView, Track};
use crate::external::message::{RoadMessage, TrackMessage};
use crate::{EgoInput, EgoSettings, EgoState, Front, Odometry, SensorAvailability};

/// The data that a controller receives before its first step.
#[derive(Clone, Debug)]
pub struct Setup {
    /// Time between two control steps (s).
    pub control_step_s: f64,
    /// Width of the ego's lane (m).
    pub lane_width_m: f64,
    /// Width of each lane (m), from lane 1 on.
    pub lane_widths_m: Vec<f64>,
    /// Curvature of the road (1/m), positive to the left; NaN if it changes along the road.
    pub curvature_per_m: f64,
    /// Speed limit (m/s).
    pub speed_limit_mps: f64,
    /// The side on which others are overtaken.
    pub overtaking_side: Side,
    pub(crate) settings: Vec<(CString, f64)>,
    pub(crate) json: CString,
}

impl Setup {
    /// Returns the setup of a controller in this process, whose ego is in a lane.
    pub fn new(settings: &EgoSettings, road: &Road, lane: Lane) -> Self {
        // Serialising structs of numbers and names cannot fail.
        Self::on_road(&serde_json::to_value(settings).unwrap_or_default(), RoadMessage::of(road, lane))
    }

    /// Returns a setup with these settings on this road.
    pub(crate) fn on_road(settings: &Value, road: RoadMessage) -> Self {
        Self {
            lane_width_m: road.lane_width_m,
            curvature_per_m: road.curvature_per_m.unwrap_or(f64::NAN),
            speed_limit_mps: road.speed_limit_mps,
            lane_widths_m: road.lane_widths_m,
            overtaking_side: road.overtaking_side,
            ..Self::of_settings(settings)
        }
    }

    /// Returns a setup with these settings, on a road that has no values yet.
    pub(crate) fn of_settings(settings: &Value) -> Self {
        let mut numbers = Vec::new();
        flatten("", settings, &mut numbers);
        let text = |text: String| CString::new(text).unwrap_or_default();
        Self {
            control_step_s: CONTROL_STEP.s(),
            lane_width_m: 0.0,
            lane_widths_m: Vec::new(),
            curvature_per_m: 0.0,
            speed_limit_mps: 0.0,
            overtaking_side: Side::Left,
            settings: numbers.into_iter().map(|(name, value)| (text(name), value)).collect(),
            json: text(settings.to_string()),
        }
    }

    /// Returns the number of lanes.
    pub fn lanes(&self) -> u32 {
        u32::try_from(self.lane_widths_m.len()).unwrap_or(u32::MAX)
    }

    /// Returns the numbers of the scenario's ego stack with their names, such as `acc.time_gap_s`.
    pub fn settings(&self) -> impl Iterator<Item = (&str, f64)> {
        self.settings.iter().filter_map(|(name, value)| Some((name.to_str().ok()?, *value)))
    }

    /// Calls `f` with the setup in the form of the interface.
    pub(crate) fn with_view<T>(&self, f: impl FnOnce(&SetupView) -> T) -> T {
        let settings: Vec<Setting> =
            self.settings.iter().map(|(name, value)| Setting { name: name.as_ptr(), value: *value }).collect();
        f(&SetupView {
            control_step_s: self.control_step_s,
            lane_width_m: self.lane_width_m,
            curvature_per_m: self.curvature_per_m,
            speed_limit_mps: self.speed_limit_mps,
            lanes: self.lanes(),
            overtaking_side: i32::from(self.overtaking_side == Side::Right),
            settings: settings.as_ptr(),
            setting_count: settings.len() as u64,
            settings_json: CStr::as_ptr(&self.json),
            lane_widths_m: self.lane_widths_m.as_ptr(),
        })
    }
}

/// Lists the numbers and truth values of a JSON value, each with its path.
fn flatten(path: &str, value: &Value, numbers: &mut Vec<(String, f64)>) {
    match value {
        Value::Object(object) => {
            for (key, value) in object {
                let within = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
                flatten(&within, value, numbers);
            }
        }
        Value::Bool(is_so) => numbers.push((path.to_owned(), f64::from(u8::from(*is_so)))),
        Value::Number(number) => numbers.extend(number.as_f64().map(|value| (path.to_owned(), value))),
        Value::Null | Value::String(_) | Value::Array(_) => {}
    }
}

/// The input of one control step, in the form of the interface. One value serves all steps of a
/// run, so that its memory is used again.
#[derive(Debug)]
pub struct Input {
    view: InputView,
    tracks: Vec<Track>,
}

// The pointer in the view is set and used in `view` alone, and points into the same value.
#[expect(unsafe_code, reason = "the pointer is null between the calls of `view`")]
unsafe impl Send for Input {}

impl Default for Input {
    fn default() -> Self {
        let view = InputView {
            time_ns: 0,
            time_s: 0.0,
            speed_mps: 0.0,
            acceleration_mps2: 0.0,
            yaw_rate_radps: 0.0,
            lane_offset_m: 0.0,
            length_m: 0.0,
            width_m: 0.0,
            front_gap_m: 0.0,
            front_speed_mps: 0.0,
            front_acceleration_mps2: 0.0,
            lane: 0,
            has_front: 0,
            front_track: 0,
            front_works: 0,
            surround_works: 0,
            rear_works: 0,
            track_count: 0,
            tracks: std::ptr::null(),
        };
        Self { view, tracks: Vec::new() }
    }
}

impl Input {
    /// Returns an input with these values and tracks.
    pub(crate) fn with(view: InputView, tracks: Vec<Track>) -> Self {
        Self { view, tracks }
    }

    /// Sets the values of a control step. `front` is the lead vehicle.
    pub(crate) fn set(&mut self, input: &EgoInput<'_>, front: Option<Front>) {
        self.view = step_values(input.time, &input.odometry, front.as_ref(), input.sensors);
        self.tracks.clear();
        self.tracks.extend(input.tracks.iter().map(|track| Track::from(&TrackMessage::from(track))));
    }

    /// Returns the tracks, whose memory can be used again.
    pub(crate) fn into_tracks(self) -> Vec<Track> {
        self.tracks
    }

    /// Returns the tracks.
    pub fn tracks(&self) -> &[Track] {
        &self.tracks
    }

    /// Returns the values other than the tracks.
    pub const fn values(&self) -> &InputView {
        &self.view
    }

    /// Returns the input in the form of the interface. Its pointer is valid as long as this value
    /// is borrowed.
    pub(crate) fn view(&self) -> InputView {
        InputView { track_count: self.tracks.len() as u64, tracks: self.tracks.as_ptr(), ..self.view }
    }
}

/// Returns the values of a control step, without its tracks. `lead` is the lead vehicle.
pub(crate) fn step_values(
    time: Time,
    odometry: &Odometry,
    lead: Option<&Front>,
    sensors: SensorAvailability,
) -> InputView {
    InputView {
        time_ns: time.ns(),
        time_s: time.s(),
        speed_mps: odometry.speed_mps,
        acceleration_mps2: odometry.acceleration_mps2,
        yaw_rate_radps: odometry.yaw_rate_radps,
        lane_offset_m: odometry.lane_offset_m,
        length_m: odometry.length_m,
        width_m: odometry.width_m,
        front_gap_m: lead.map_or(0.0, |lead| lead.gap_m),
        front_speed_mps: lead.map_or(0.0, |lead| lead.speed_mps),
        front_acceleration_mps2: lead.map_or(0.0, |lead| lead.acceleration_mps2),
        lane: odometry.lane.0.into(),
        has_front: lead.is_some().into(),
        front_track: lead.map_or(0, |lead| lead.track.0),
        front_works: sensors.front.into(),
        surround_works: sensors.surround.into(),
        rear_works: sensors.rear.into(),
        track_count: 0,
        tracks: std::ptr::null(),
    }
}

/// The states in the order of their numbers in the interface.
const STATES: [EgoState; 5] =
    [EgoState::Following, EgoState::Increasing, EgoState::Holding, EgoState::Releasing, EgoState::EmergencyBraking];

/// The answer of a controller.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Answer {
    /// The commanded acceleration (m/s²). It may be any number: the closed loop refuses one that no
    /// vehicle could follow.
    pub acceleration_mps2: f64,
    /// The state.
    pub state: EgoState,
}

impl Answer {
    /// Returns the answer with a state as the interface numbers it.
    ///
    /// # Errors
    /// The message if there is no such state.
    pub(crate) fn new(acceleration_mps2: f64, state: i64) -> Result<Self, String> {
        let state = usize::try_from(state).ok().and_then(|index| STATES.get(index)).copied();
        let state = state.ok_or_else(|| {
            "the state must be 0 (following), 1 (increasing), 2 (holding), 3 (releasing) or 4 (emergency braking)"
                .to_owned()
        })?;
        Ok(Self { acceleration_mps2, state })
    }
}
