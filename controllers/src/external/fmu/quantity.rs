//! The quantities that an FMU can receive, by their names.

use crate::external::exchange::{Input, Setup};

/// What kind of number a quantity is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Number {
    Real,
    Whole,
    Truth,
}

/// A field of a track.
#[derive(Debug)]
pub(super) struct TrackField {
    name: &'static str,
    unit: &'static str,
    number: Number,
    get: fn(&crate::external::abi::Track) -> f64,
}

/// A quantity of a control step, or of the setup.
#[derive(Clone, Debug)]
pub(super) enum Quantity {
    /// A value of the input.
    Step(&'static StepField),
    /// A value of the track with this index, in the order of the distance.
    Track(usize, &'static TrackField),
    /// A value of the setup, which is the same in all steps.
    Fixed { value: f64, unit: &'static str, number: Number },
}

/// A value of the input.
#[derive(Debug)]
pub(super) struct StepField {
    name: &'static str,
    unit: &'static str,
    number: Number,
    get: fn(&Input) -> f64,
}

macro_rules! step_fields {
    ($($name:literal, $unit:literal, $number:ident, $get:expr;)*) => {
        &[$(StepField { name: $name, unit: $unit, number: Number::$number, get: $get }),*]
    };
}

/// The quantities of the ego, the lead vehicle and the sensors.
const STEP: &[StepField] = step_fields![
    "time", "s", Real, |input| input.values().time_s;
    "ego_speed", "m/s", Real, |input| input.values().speed_mps;
    "ego_acceleration", "m/s2", Real, |input| input.values().acceleration_mps2;
    "ego_yaw_rate", "rad/s", Real, |input| input.values().yaw_rate_radps;
    "ego_lane", "", Whole, |input| input.values().lane.into();
    "ego_lane_offset", "m", Real, |input| input.values().lane_offset_m;
    "ego_length", "m", Real, |input| input.values().length_m;
    "ego_width", "m", Real, |input| input.values().width_m;
    "front_present", "", Truth, |input| input.values().has_front.into();
    "front_gap", "m", Real, |input| input.values().front_gap_m;
    "front_speed", "m/s", Real, |input| input.values().front_speed_mps;
    "front_acceleration", "m/s2", Real, |input| input.values().front_acceleration_mps2;
    "front_sensor_works", "", Truth, |input| input.values().front_works.into();
    "surround_sensor_works", "", Truth, |input| input.values().surround_works.into();
    "rear_sensor_works", "", Truth, |input| input.values().rear_works.into();
    "track_count", "", Whole, |input| input.tracks().len() as f64;
];

macro_rules! track_fields {
    ($($name:literal, $unit:literal, $number:ident, $get:expr;)*) => {
        &[$(TrackField { name: $name, unit: $unit, number: Number::$number, get: $get }),*]
    };
}

/// The quantities of a track.
const TRACK: &[TrackField] = track_fields![
    "id", "", Whole, |track| track.id.into();
    "source", "", Whole, |track| track.source.into();
    "status", "", Whole, |track| track.status.into();
    "x", "m", Real, |track| track.x_m;
    "y", "m", Real, |track| track.y_m;
    "vx", "m/s", Real, |track| track.vx_mps;
    "vy", "m/s", Real, |track| track.vy_mps;
    "heading", "rad", Real, |track| track.heading_rad;
    "length", "m", Real, |track| track.length_m;
    "width", "m", Real, |track| track.width_m;
    "existence", "", Real, |track| track.existence;
    "car", "", Real, |track| track.class[0];
    "truck", "", Real, |track| track.class[1];
    "motorcycle", "", Real, |track| track.class[2];
    "lane_left", "", Real, |track| track.lane[0];
    "lane_own", "", Real, |track| track.lane[1];
    "lane_right", "", Real, |track| track.lane[2];
];

/// Largest number of lanes of a road.
const MOST_LANES: usize = 8;

/// Returns the quantities of the setup: name, unit, number, value.
fn fixed(setup: &Setup) -> Vec<(String, &'static str, Number, f64)> {
    let quantity = |name: &str, unit, number, value| (name.to_owned(), unit, number, value);
    let mut all = vec![
        quantity("control_step", "s", Number::Real, setup.control_step_s),
        quantity("road_lanes", "", Number::Whole, setup.lanes().into()),
        quantity("road_lane_width", "m", Number::Real, setup.lane_width_m),
        quantity("road_curvature", "1/m", Number::Real, setup.curvature_per_m),
        quantity("road_speed_limit", "m/s", Number::Real, setup.speed_limit_mps),
    ];
    // A lane that the road does not have is 0 m wide.
    let width_m = |lane: usize| setup.lane_widths_m.get(lane - 1).copied().unwrap_or_default();
    all.extend(
        (1..=MOST_LANES).map(|lane| quantity(&format!("road_lane_{lane}_width"), "m", Number::Real, width_m(lane))),
    );
    // The unit of a setting is the end of its name.
    all.extend(setup.settings().map(|(name, value)| (name.replace('.', "_"), "", Number::Real, value)));
    all
}

impl Quantity {
    /// Returns the quantity of a name; `None` if there is none. `setup` has the settings.
    pub(super) fn of(name: &str, setup: &Setup) -> Option<Self> {
        if let Some(entry) = STEP.iter().find(|field| field.name == name) {
            return Some(Self::Step(entry));
        }
        if let Some((number, field)) = name.strip_prefix("track_").and_then(|rest| rest.split_once('_')) {
            let entry = TRACK.iter().find(|listed| listed.name == field)?;
            return number.parse::<usize>().ok()?.checked_sub(1).map(|index| Self::Track(index, entry));
        }
        let entry = fixed(setup).into_iter().find(|listed| listed.0 == name);
        entry.map(|(_, unit, number, value)| Self::Fixed { value, unit, number })
    }

    /// Returns the names, for messages.
    pub(super) fn names() -> String {
        let step = STEP.iter().map(|field| field.name.to_owned());
        let track = TRACK.iter().map(|field| format!("track_1_{}", field.name));
        let fixed = [
            "control_step",
            "road_lanes",
            "road_lane_width",
            "road_lane_1_width",
            "road_curvature",
            "road_speed_limit",
        ];
        let all =
            step.chain(track).chain(fixed.map(str::to_owned)).chain(["acc_time_gap_s and other settings".to_owned()]);
        all.collect::<Vec<_>>().join(", ")
    }

    /// Returns the value in a control step. `nearest` are the indices of the tracks, the nearest
    /// first.
    pub(super) fn value(&self, input: &Input, nearest: &[usize]) -> f64 {
        match self {
            Self::Step(field) => (field.get)(input),
            Self::Track(index, field) => {
                nearest.get(*index).and_then(|at| input.tracks().get(*at)).map_or(0.0, |track| (field.get)(track))
            }
            Self::Fixed { value, .. } => *value,
        }
    }

    /// Returns the unit; empty if there is none, or if it is part of the name.
    pub(super) const fn unit(&self) -> &'static str {
        match self {
            Self::Step(field) => field.unit,
            Self::Track(_, field) => field.unit,
            Self::Fixed { unit, .. } => unit,
        }
    }

    pub(super) const fn number(&self) -> Number {
        match self {
            Self::Step(field) => field.number,
            Self::Track(_, field) => field.number,
            Self::Fixed { number, .. } => *number,
        }
    }
}
