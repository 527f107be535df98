//! The built-in controller `acc` (cruise control and emergency braking) as a shared library in
//! Rust, to the last bit.
//!
//! ```sh
//! cargo build --release --example acc_library
//! closecall run low-thw-overtake --controller lib:target/release/examples/libacc_library.so
//! ```
//!
//! A library of your own is a crate with `crate-type = ["cdylib"]` that needs nothing of Closecall:
//! the types below come from `controllers/include/closecall_controller.h`, which documents them.

#![expect(unsafe_code, reason = "the interface passes pointers")]

use std::ffi::{CStr, c_char};

/// A number of the scenario's ego stack.
#[repr(C)]
pub struct Setting {
    name: *const c_char,
    value: f64,
}

/// What a controller is told when it is created.
#[repr(C)]
pub struct Setup {
    control_step_s: f64,
    lane_width_m: f64,
    curvature_per_m: f64,
    speed_limit_mps: f64,
    lanes: u32,
    overtaking_side: i32,
    settings: *const Setting,
    setting_count: u64,
    settings_json: *const c_char,
    lane_widths_m: *const f64,
}

/// The input of one control step. This controller reads no tracks.
#[repr(C)]
pub struct Input {
    time_ns: i64,
    time_s: f64,
    speed_mps: f64,
    acceleration_mps2: f64,
    yaw_rate_radps: f64,
    lane_offset_m: f64,
    length_m: f64,
    width_m: f64,
    front_gap_m: f64,
    front_speed_mps: f64,
    front_acceleration_mps2: f64,
    lane: u32,
    has_front: u32,
    front_track: u32,
    front_works: u32,
    surround_works: u32,
    rear_works: u32,
    track_count: u64,
    tracks: *const u8,
}

/// The answer to one control step.
#[repr(C)]
pub struct Command {
    acceleration_mps2: f64,
    state: i32,
    reserved: u32,
}

/// The version of the interface.
const ABI: u32 = 1;
const FOLLOWING: i32 = 0;
const EMERGENCY_BRAKING: i32 = 4;

/// Settings of the emergency braking.
struct Aeb {
    trigger_mps2: f64,
    max_deceleration_mps2: f64,
    standstill_gap_m: f64,
}

/// The controller of one run.
pub struct Controller {
    /// Speed without a lead vehicle (m/s).
    limit_mps: f64,
    time_gap_s: f64,
    standstill_gap_m: f64,
    aeb: Option<Aeb>,
    /// Deceleration of the emergency braking in the last step (m/s²).
    braked: f64,
    /// Acceleration of the cruise control in the last step (m/s²).
    comfort: f64,
    /// Time of the last step (ns).
    before_ns: Option<i64>,
}

/// The lead vehicle.
#[derive(Clone, Copy)]
struct Front {
    gap_m: f64,
    speed_mps: f64,
    acceleration_mps2: f64,
}

/// Returns the constant deceleration (m/s²) that keeps a distance of `left_m` to the vehicle ahead,
/// if that vehicle keeps its deceleration.
fn required(v: f64, front: Front, left_m: f64) -> f64 {
    let (room, lead, braking) = ((front.gap_m - left_m).max(0.1), front.speed_mps, -front.acceleration_mps2);
    let removing = if v > lead { (v - lead) * (v - lead) / (2.0 * room) } else { 0.0 };
    if braking <= 0.0 || lead <= 0.0 {
        return removing;
    }
    let to_stop = v * v / (2.0 * (room + lead * lead / (2.0 * braking)));
    if v * braking >= lead * to_stop {
        to_stop
    } else if v > lead {
        braking + removing
    } else {
        0.0
    }
}

/// Returns a limit that has the value `slow` up to 5 m/s, the value `fast` from 20 m/s on, and is
/// linear in between.
fn limited(slow: f64, fast: f64, v: f64) -> f64 {
    slow + ((v - 5.0) / 15.0).clamp(0.0, 1.0) * (fast - slow)
}

impl Controller {
    fn new(speed_limit_mps: f64, setting: impl Fn(&str) -> Option<f64>) -> Option<Self> {
        let aeb = setting("aeb.trigger_mps2").map(|trigger_mps2| {
            let of = |name| setting(name).unwrap_or(f64::NAN);
            let (max_deceleration_mps2, standstill_gap_m) =
                (of("aeb.max_deceleration_mps2"), of("aeb.standstill_gap_m"));
            Aeb { trigger_mps2, max_deceleration_mps2, standstill_gap_m }
        });
        Some(Self {
            limit_mps: setting("acc.set_speed_mps").unwrap_or(speed_limit_mps),
            time_gap_s: setting("acc.time_gap_s")?,
            standstill_gap_m: setting("acc.standstill_gap_m")?,
            aeb,
            braked: 0.0,
            comfort: 0.0,
            before_ns: None,
        })
    }

    /// Returns the acceleration (m/s²) of the cruise control, without its jerk limit.
    fn cruise(&self, v: f64, front: Option<Front>) -> f64 {
        let mut a = (self.limit_mps - v) / 2.0;
        if let Some(front) = front {
            let error = front.gap_m - (self.time_gap_s * v).max(self.standstill_gap_m);
            let touch = 1.5 / (0.3 * 0.3);
            let allowed = if error < touch { 0.3 * error } else { (2.0 * 1.5 * (error - 0.5 * touch)).sqrt() };
            let (gain, opening) = (self.time_gap_s.max(0.45), front.speed_mps - v);
            let (slower, faster) = ((allowed + opening) / gain, (allowed.min(4.0) + opening) / gain);
            let needed = required(v, front, self.standstill_gap_m);
            a = a.min(if slower < 0.0 { slower } else { faster.max(0.0) });
            if needed > limited(5.0, 3.5, v) {
                a = a.min(-needed);
            }
        }
        a.max(-limited(5.0, 3.5, v)).min(1.5)
    }

    /// Returns the deceleration (m/s²) of the emergency braking, or 0 if none is needed.
    fn emergency(&self, v: f64, front: Option<Front>) -> f64 {
        let Some(aeb) = &self.aeb else { return 0.0 };
        let has_braked = self.braked > 0.0;
        if has_braked && v < 0.1 {
            return if front.is_some_and(|front| front.speed_mps < 1.0) { 2.0 } else { 0.0 };
        }
        let needed = front.map_or(0.0, |front| required(v, front, aeb.standstill_gap_m));
        let threshold = if has_braked { 1.5 } else { aeb.trigger_mps2 };
        if needed > threshold { (1.15 * needed).min(aeb.max_deceleration_mps2) } else { 0.0 }
    }

    fn step(&mut self, input: &Input) -> Command {
        let v = input.speed_mps;
        let front = (input.has_front == 1).then_some(Front {
            gap_m: input.front_gap_m,
            speed_mps: input.front_speed_mps,
            acceleration_mps2: input.front_acceleration_mps2,
        });
        self.braked = self.emergency(v, front);
        let step_s = self.before_ns.map_or(0.0, |before| 1e-9 * (input.time_ns - before) as f64);
        self.before_ns = Some(input.time_ns);
        let change = limited(5.0, 2.5, v) * step_s;
        self.comfort = self.cruise(v, front).max(self.comfort - change).min(self.comfort + change);
        let (acceleration_mps2, state) = match self.braked > 0.0 {
            true => (self.comfort.min(-self.braked), EMERGENCY_BRAKING),
            false => (self.comfort, FOLLOWING),
        };
        Command { acceleration_mps2, state, reserved: 0 }
    }
}

/// Returns the version of the interface.
#[unsafe(no_mangle)]
pub extern "C" fn closecall_controller_abi() -> u32 {
    ABI
}

/// Creates a controller; null if a setting is missing.
///
/// # Safety
/// `setup` is valid during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn closecall_controller_create(setup: *const Setup) -> *mut Controller {
    // SAFETY: the interface guarantees valid pointers during the call.
    let (setup, settings) = unsafe {
        let setup = &*setup;
        (setup, std::slice::from_raw_parts(setup.settings, usize::try_from(setup.setting_count).unwrap_or(0)))
    };
    let setting = |name: &str| {
        // SAFETY: a name is a text that ends with 0.
        let is_named = |setting: &&Setting| unsafe { CStr::from_ptr(setting.name) }.to_bytes() == name.as_bytes();
        settings.iter().find(is_named).map(|setting| setting.value)
    };
    Controller::new(setup.speed_limit_mps, setting).map_or(std::ptr::null_mut(), |own| Box::into_raw(Box::new(own)))
}

/// Answers a control step.
///
/// # Safety
/// The controller lives, and the other pointers are valid during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn closecall_controller_step(
    controller: *mut Controller,
    input: *const Input,
    command: *mut Command,
) -> i32 {
    // SAFETY: the interface guarantees valid pointers during the call.
    unsafe { *command = (*controller).step(&*input) };
    0
}

/// Frees a controller.
///
/// # Safety
/// `closecall_controller_create` has returned the controller, and nothing uses it any more.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn closecall_controller_destroy(controller: *mut Controller) {
    // SAFETY: the box of `closecall_controller_create` is taken back.
    drop(unsafe { Box::from_raw(controller) });
}
