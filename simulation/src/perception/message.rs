//! The messages to a perception process: `question.rs` writes them, and the process of a library
//! reads them.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use closecall_controllers::external::RoadMessage;
use closecall_sensors::external::{Pose, RadarMount};
use closecall_sensors::lidar::MirrorSide;
use closecall_traffic::Side;
use serde::{Deserialize, Serialize};

/// A message to the process.
#[derive(Serialize, Deserialize)]
#[serde(tag = "type", rename_all = "kebab-case")]
pub(super) enum Message {
    Hello(Box<Hello>),
    Scans(Box<Scans>),
    /// The run has ended.
    End,
}

#[derive(Serialize, Deserialize)]
pub(super) struct Hello {
    pub(super) kind: String,
    pub(super) protocol: u32,
    pub(super) control_step_s: f64,
    pub(super) latency_s: f64,
    pub(super) ego: Ego,
    pub(super) road: RoadMessage,
    pub(super) lidars: Vec<Lidar>,
    /// Absent without radars, as in each question.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) radars: Option<Vec<RadarMount>>,
    pub(super) camera: Option<Camera>,
    /// Absent without further cameras, as in each question.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) additional_cameras: Option<Vec<Camera>>,
}

#[derive(Serialize, Deserialize)]
pub(super) struct Ego {
    pub(super) length_m: f64,
    pub(super) width_m: f64,
}

#[derive(Serialize, Deserialize)]
pub(super) struct Lidar {
    pub(super) name: String,
    pub(super) x_m: f64,
    pub(super) y_m: f64,
    pub(super) z_m: f64,
    pub(super) azimuth_rad: f64,
    pub(super) half_field_rad: f64,
    pub(super) range_m: f64,
    pub(super) layers: usize,
    pub(super) columns: usize,
    pub(super) period_s: f64,
}

#[derive(Serialize, Deserialize)]
pub(super) struct Camera {
    pub(super) name: String,
    pub(super) x_m: f64,
    pub(super) y_m: f64,
    pub(super) z_m: f64,
    pub(super) pitch_rad: f64,
    pub(super) yaw_rad: f64,
    pub(super) focal_px: f64,
    pub(super) distortion_k1: f64,
    pub(super) distortion_k2: f64,
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) period_s: f64,
}

#[derive(Serialize, Deserialize)]
pub(super) struct Scans {
    pub(super) time_s: f64,
    pub(super) time_ns: i64,
    pub(super) odometry: Odometry,
    pub(super) pose: Pose,
    pub(super) scans: Vec<Scan>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) radar_scans: Option<Vec<RadarScan>>,
    pub(super) image: Option<Image>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) additional_images: Option<Vec<Image>>,
}

#[derive(Serialize, Deserialize)]
pub(super) struct Odometry {
    pub(super) speed_mps: f64,
    pub(super) acceleration_mps2: f64,
    pub(super) yaw_rate_radps: f64,
    pub(super) lane: u8,
    pub(super) lane_offset_m: f64,
}

/// A scan. The arrays are base64 of little-endian numbers.
#[derive(Serialize, Deserialize)]
pub(super) struct Scan {
    pub(super) sensor: String,
    pub(super) start_ns: i64,
    pub(super) end_ns: i64,
    pub(super) mirror_side: Option<MirrorSide>,
    pub(super) points: usize,
    pub(super) x_m: String,
    pub(super) y_m: String,
    pub(super) z_m: String,
    pub(super) intensity: String,
    pub(super) echo_pulse_width_ns: String,
    pub(super) beam: String,
    pub(super) offset_ns: String,
}

#[derive(Serialize, Deserialize)]
pub(super) struct RadarScan {
    pub(super) side: Side,
    pub(super) time_ns: i64,
    pub(super) detections: Vec<RadarDetection>,
}

/// A detection of a radar, also in the form of `controllers/include/closecall_perception.h`.
#[repr(C)]
#[derive(Serialize, Deserialize)]
pub(super) struct RadarDetection {
    pub(super) range_m: f64,
    pub(super) azimuth_rad: f64,
    pub(super) radial_mps: f64,
}

#[derive(Serialize, Deserialize)]
pub(super) struct Image {
    /// Name of the camera.
    pub(super) camera: String,
    pub(super) time_ns: i64,
    pub(super) width: u32,
    pub(super) height: u32,
    /// Base64 of the bytes.
    pub(super) rgb: String,
}

/// The arrays of a scan, all of the same length.
pub(super) struct Points {
    pub(super) x_m: Vec<f32>,
    pub(super) y_m: Vec<f32>,
    pub(super) z_m: Vec<f32>,
    pub(super) intensity: Vec<f32>,
    pub(super) beam: Vec<u16>,
    pub(super) offset_ns: Vec<u32>,
}

impl Scan {
    /// Returns the arrays of the scan, or what is wrong with them.
    pub(super) fn decode(&self) -> Result<Points, String> {
        let single = |text: &str| self.array(text, f32::from_le_bytes);
        Ok(Points {
            x_m: single(&self.x_m)?,
            y_m: single(&self.y_m)?,
            z_m: single(&self.z_m)?,
            intensity: single(&self.intensity)?,
            beam: self.array(&self.beam, u16::from_le_bytes)?,
            offset_ns: self.array(&self.offset_ns, u32::from_le_bytes)?,
        })
    }

    fn array<const N: usize, T>(&self, text: &str, read: impl Fn([u8; N]) -> T) -> Result<Vec<T>, String> {
        let bytes = STANDARD.decode(text).map_err(|error| format!("failed to read a scan: {error}"))?;
        if bytes.len() != N * self.points {
            return Err(format!("failed to read a scan: {} bytes for {} points", bytes.len(), self.points));
        }
        Ok(bytes.chunks_exact(N).map(|chunk| read(std::array::from_fn(|index| chunk[index]))).collect())
    }
}

impl Image {
    /// Returns the bytes of the pixels, or what is wrong with them.
    pub(super) fn decode(&self) -> Result<Vec<u8>, String> {
        let bytes = STANDARD.decode(&self.rgb).map_err(|error| format!("failed to read an image: {error}"))?;
        let needed = 3 * u64::from(self.width) * u64::from(self.height);
        if bytes.len() as u64 != needed {
            return Err(format!("failed to read an image: {} bytes, not {needed}", bytes.len()));
        }
        Ok(bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scan(x_m: &[f32]) -> Scan {
        let bytes: Vec<u8> = x_m.iter().flat_map(|value| value.to_le_bytes()).collect();
        let (numbers, beams) = (STANDARD.encode(bytes), STANDARD.encode([1, 2, 3, 4]));
        Scan {
            sensor: "rear-lidar".to_owned(),
            start_ns: 0,
            end_ns: 1,
            mirror_side: None,
            points: 2,
            x_m: numbers.clone(),
            y_m: numbers.clone(),
            z_m: numbers.clone(),
            intensity: numbers.clone(),
            echo_pulse_width_ns: numbers.clone(),
            beam: beams,
            offset_ns: numbers,
        }
    }

    #[test]
    fn arrays_are_read_to_the_last_bit_and_another_length_is_refused() {
        let points = scan(&[-41.3, 0.1]).decode().unwrap();
        assert_eq!((points.x_m, points.beam), (vec![-41.3, 0.1], vec![0x0201, 0x0403]));
        assert_eq!(points.offset_ns, [-41.3_f32, 0.1].map(f32::to_bits));
        let error = scan(&[-41.3]).decode().err().unwrap();
        assert_eq!(error, "failed to read a scan: 4 bytes for 2 points");
    }
}
