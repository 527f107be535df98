//! The types of `controllers/include/closecall_controller.h`, which documents their fields and
//! units.

use std::ffi::{c_char, c_void};
use std::mem::size_of;

/// The version of the interface.
pub const ABI: u32 = 1;

/// A number of the scenario's ego stack.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Setting {
    /// Its name, with the unit.
    pub name: *const c_char,
    /// Its value, in the unit of its name.
    pub value: f64,
}

/// The data that a controller receives when it is created.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct SetupView {
    /// Time between two steps (s).
    pub control_step_s: f64,
    /// Width of the ego's lane (m).
    pub lane_width_m: f64,
    /// Curvature of the road (1/m), positive to the left; NaN if it changes along the road.
    pub curvature_per_m: f64,
    /// Speed limit (m/s).
    pub speed_limit_mps: f64,
    /// Number of lanes.
    pub lanes: u32,
    /// 0: others are overtaken on the left, 1: on the right.
    pub overtaking_side: i32,
    /// The settings.
    pub settings: *const Setting,
    /// Their number.
    pub setting_count: u64,
    /// The settings as JSON.
    pub settings_json: *const c_char,
    /// Width of each lane (m), from lane 1 on.
    pub lane_widths_m: *const f64,
}

/// The perceived state of another vehicle.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Track {
    /// Number of the track.
    pub id: u32,
    /// 0: front, 1: surround, 2: rear.
    pub source: i32,
    /// 0: tentative, 1: confirmed, 2: coasting.
    pub status: i32,
    /// 0.
    pub reserved: u32,
    /// Time of the state (s).
    pub time_s: f64,
    /// Position ahead of the ego (m).
    pub x_m: f64,
    /// Position to the left of the ego (m).
    pub y_m: f64,
    /// Speed over ground along x (m/s).
    pub vx_mps: f64,
    /// Speed over ground along y (m/s).
    pub vy_mps: f64,
    /// Covariance of the four, row by row (m², m²/s, m²/s²).
    pub covariance: [f64; 16],
    /// Heading relative to the ego (rad).
    pub heading_rad: f64,
    /// Length (m).
    pub length_m: f64,
    /// Width (m).
    pub width_m: f64,
    /// Probabilities of car, truck, motorcycle and background.
    pub class: [f64; 4],
    /// Probability that there is a vehicle.
    pub existence: f64,
    /// Probabilities of the lane to the left, the ego's own, and the lane to the right.
    pub lane: [f64; 3],
}

/// The input of one control step.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct InputView {
    /// Time of the step (ns).
    pub time_ns: i64,
    /// Time of the step (s).
    pub time_s: f64,
    /// Speed of the ego (m/s).
    pub speed_mps: f64,
    /// Its longitudinal acceleration (m/s²).
    pub acceleration_mps2: f64,
    /// Its yaw rate (rad/s).
    pub yaw_rate_radps: f64,
    /// Its offset from the centre of its lane (m), positive to the left.
    pub lane_offset_m: f64,
    /// Its length (m).
    pub length_m: f64,
    /// Its width (m).
    pub width_m: f64,
    /// Gap to the lead vehicle (m).
    pub front_gap_m: f64,
    /// Speed of the lead vehicle (m/s).
    pub front_speed_mps: f64,
    /// Acceleration of the lead vehicle (m/s²).
    pub front_acceleration_mps2: f64,
    /// Lane of the ego.
    pub lane: u32,
    /// 1 if there is a lead vehicle.
    pub has_front: u32,
    /// Track of the lead vehicle.
    pub front_track: u32,
    /// 1 if the front radar works.
    pub front_works: u32,
    /// 1 if the short-range sensors work.
    pub surround_works: u32,
    /// 1 if the rear sensors work.
    pub rear_works: u32,
    /// Number of tracks.
    pub track_count: u64,
    /// The tracks.
    pub tracks: *const Track,
}

/// The answer to one control step.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Command {
    /// Commanded acceleration (m/s²).
    pub acceleration_mps2: f64,
    /// The state.
    pub state: i32,
    /// 0.
    pub reserved: u32,
}

// An exception of C++ that leaves a function ends the process, which is defined for `C-unwind`
// only.
pub(crate) type AbiFunction = unsafe extern "C-unwind" fn() -> u32;
pub(crate) type CreateFunction = unsafe extern "C-unwind" fn(*const SetupView) -> *mut c_void;
pub(crate) type StepFunction = unsafe extern "C-unwind" fn(*mut c_void, *const InputView, *mut Command) -> i32;
pub(crate) type DestroyFunction = unsafe extern "C-unwind" fn(*mut c_void);
pub(crate) type ErrorFunction = unsafe extern "C-unwind" fn(*mut c_void) -> *const c_char;
pub(crate) type TextFunction = unsafe extern "C-unwind" fn() -> *const c_char;

// The same sizes are asserted in the header.
#[cfg(target_pointer_width = "64")]
const _: () = {
    assert!(size_of::<SetupView>() == 72);
    assert!(size_of::<Track>() == 272);
    assert!(size_of::<InputView>() == 128);
    assert!(size_of::<Command>() == 16);
};
