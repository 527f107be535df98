//! The types of `controllers/include/closecall_perception.h`, which documents their fields and
//! units.

use std::ffi::{c_char, c_void};
use std::mem::size_of;

use crate::perception::message::RadarDetection;

/// The version of the interface.
pub(super) const ABI: u32 = 1;

/// A LiDAR that looks back.
#[repr(C)]
pub(super) struct Lidar {
    pub(super) name: *const c_char,
    pub(super) x_m: f64,
    pub(super) y_m: f64,
    pub(super) z_m: f64,
    pub(super) azimuth_rad: f64,
    pub(super) half_field_rad: f64,
    pub(super) range_m: f64,
    pub(super) period_s: f64,
    pub(super) layers: u32,
    pub(super) columns: u32,
}

/// A rear radar.
#[repr(C)]
pub(super) struct Radar {
    pub(super) side: i32,
    pub(super) reserved: u32,
    pub(super) x_m: f64,
    pub(super) y_m: f64,
    pub(super) azimuth_rad: f64,
    pub(super) half_field_rad: f64,
    pub(super) range_m: f64,
    pub(super) period_s: f64,
    pub(super) range_sd_m: f64,
    pub(super) azimuth_sd_rad: f64,
    pub(super) radial_sd_mps: f64,
}

/// A rear camera.
#[repr(C)]
pub(super) struct Camera {
    pub(super) x_m: f64,
    pub(super) z_m: f64,
    pub(super) pitch_rad: f64,
    pub(super) yaw_rad: f64,
    pub(super) focal_px: f64,
    pub(super) distortion_k1: f64,
    pub(super) distortion_k2: f64,
    pub(super) period_s: f64,
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) y_m: f64,
    pub(super) name: *const c_char,
}

/// The data that a perception receives when it is created.
#[repr(C)]
pub(super) struct SetupView {
    pub(super) control_step_s: f64,
    pub(super) latency_s: f64,
    pub(super) ego_length_m: f64,
    pub(super) ego_width_m: f64,
    pub(super) lane_width_m: f64,
    pub(super) curvature_per_m: f64,
    pub(super) speed_limit_mps: f64,
    pub(super) lanes: u32,
    pub(super) overtaking_side: i32,
    pub(super) lidars: *const Lidar,
    pub(super) lidar_count: u64,
    pub(super) radars: *const Radar,
    pub(super) radar_count: u64,
    pub(super) camera: *const Camera,
    pub(super) additional_cameras: *const Camera,
    pub(super) additional_camera_count: u64,
    pub(super) lane_widths_m: *const f64,
}

/// A scan of a LiDAR.
#[repr(C)]
pub(super) struct Scan {
    pub(super) lidar: u32,
    /// 0: the sensor has no mirror with two sides, 1: plus, -1: minus.
    pub(super) mirror_side: i32,
    pub(super) start_ns: i64,
    pub(super) end_ns: i64,
    pub(super) point_count: u64,
    pub(super) x_m: *const f32,
    pub(super) y_m: *const f32,
    pub(super) z_m: *const f32,
    pub(super) intensity: *const f32,
    pub(super) beam: *const u16,
    pub(super) offset_ns: *const u32,
}

/// A scan of a rear radar.
#[repr(C)]
pub(super) struct RadarScan {
    pub(super) side: i32,
    pub(super) reserved: u32,
    pub(super) time_ns: i64,
    pub(super) detection_count: u64,
    pub(super) detections: *const RadarDetection,
}

/// An image of a rear camera.
#[repr(C)]
pub(super) struct Image {
    pub(super) time_ns: i64,
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) rgb: *const u8,
    /// Index in the additional cameras; 0 for the image of the first camera, too.
    pub(super) additional_camera: u32,
    pub(super) reserved: u32,
}

/// The question of one control step.
#[repr(C)]
pub(super) struct InputView {
    pub(super) time_ns: i64,
    pub(super) time_s: f64,
    pub(super) speed_mps: f64,
    pub(super) acceleration_mps2: f64,
    pub(super) yaw_rate_radps: f64,
    pub(super) lane_offset_m: f64,
    pub(super) pose_x_m: f64,
    pub(super) pose_y_m: f64,
    pub(super) pose_yaw_rad: f64,
    pub(super) lane: u32,
    pub(super) reserved: u32,
    pub(super) scans: *const Scan,
    pub(super) scan_count: u64,
    pub(super) radar_scans: *const RadarScan,
    pub(super) radar_scan_count: u64,
    pub(super) image: *const Image,
    pub(super) additional_images: *const Image,
    pub(super) additional_image_count: u64,
}

/// A box for the built-in tracker.
#[repr(C)]
#[derive(Clone, Copy)]
pub(super) struct Detection {
    pub(super) x_m: f64,
    pub(super) y_m: f64,
    pub(super) covariance: [f64; 4],
    pub(super) heading_rad: f64,
    pub(super) length_m: f64,
    pub(super) width_m: f64,
    pub(super) top_m: f64,
    /// Probabilities of car, truck, motorcycle and background.
    pub(super) class: [f64; 4],
    pub(super) time_ns: i64,
    pub(super) points: u32,
    pub(super) length_is_seen: u32,
    pub(super) width_is_seen: u32,
    pub(super) reserved: u32,
}

/// A track at the time of the question.
#[repr(C)]
#[derive(Clone, Copy)]
pub(super) struct Track {
    pub(super) id: u32,
    /// 0: tentative, 1: confirmed, 2: coasting.
    pub(super) status: i32,
    pub(super) x_m: f64,
    pub(super) y_m: f64,
    pub(super) vx_mps: f64,
    pub(super) vy_mps: f64,
    pub(super) covariance: [f64; 16],
    pub(super) heading_rad: f64,
    pub(super) length_m: f64,
    pub(super) width_m: f64,
    /// Probabilities of car, truck, motorcycle and background.
    pub(super) class: [f64; 4],
    pub(super) existence: f64,
}

/// The answer to one control step.
#[repr(C)]
pub(super) struct AnswerView {
    pub(super) detections: *mut Detection,
    pub(super) tracks: *mut Track,
    pub(super) capacity: u64,
    pub(super) count: u64,
}

// An exception of C++ that leaves a function ends the process, which is defined for `C-unwind`
// only.
pub(super) type AbiFunction = unsafe extern "C-unwind" fn() -> u32;
pub(super) type AnswersFunction = unsafe extern "C-unwind" fn() -> i32;
pub(super) type CreateFunction = unsafe extern "C-unwind" fn(*const SetupView) -> *mut c_void;
pub(super) type StepFunction = unsafe extern "C-unwind" fn(*mut c_void, *const InputView, *mut AnswerView) -> i32;
pub(super) type DestroyFunction = unsafe extern "C-unwind" fn(*mut c_void);
pub(super) type ErrorFunction = unsafe extern "C-unwind" fn(*mut c_void) -> *const c_char;
pub(super) type TextFunction = unsafe extern "C-unwind" fn() -> *const c_char;

// The same sizes are asserted in the header.
#[cfg(target_pointer_width = "64")]
const _: () = {
    assert!(size_of::<Lidar>() == 72);
    assert!(size_of::<Radar>() == 80);
    assert!(size_of::<Camera>() == 88);
    assert!(size_of::<SetupView>() == 128);
    assert!(size_of::<Scan>() == 80);
    assert!(size_of::<RadarDetection>() == 24);
    assert!(size_of::<RadarScan>() == 32);
    assert!(size_of::<Image>() == 32);
    assert!(size_of::<InputView>() == 136);
    assert!(size_of::<Detection>() == 136);
    assert!(size_of::<Track>() == 232);
    assert!(size_of::<AnswerView>() == 32);
};
