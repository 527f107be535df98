//! Writes the messages to a perception process.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use closecall_controllers::external::RoadMessage;
use closecall_sensors::external::{
    CameraMount, LidarMount, OutsideImage, OutsideRadarScan, OutsideScan, PerceptionQuestion, RadarMount,
};
use closecall_sensors::tracking;
use closecall_traffic::{CONTROL_STEP, Dimensions, Lane, Road};

use super::message::{Camera, Ego, Hello, Image, Lidar, Message, Odometry, RadarDetection, RadarScan, Scan, Scans};
use crate::controller::exec::{PROTOCOL, to_line};

/// The content of the first message to a process.
pub(super) struct Setup<'a> {
    pub(super) size: Dimensions,
    pub(super) road: &'a Road,
    /// The lane of the ego.
    pub(super) lane: Lane,
    pub(super) lidars: &'a [LidarMount],
    pub(super) radars: &'a [RadarMount],
    pub(super) camera: Option<CameraMount>,
    pub(super) additional_cameras: &'a [CameraMount],
    pub(super) latency_s: f64,
}

impl<'a> Setup<'a> {
    /// Takes the content of the first message from a question.
    pub(super) fn of(question: &PerceptionQuestion<'a>) -> Self {
        let PerceptionQuestion { size, road, lidars, radars, camera, additional_cameras, latency_s, .. } = *question;
        let lane = road.lane_of(&question.ego);
        Self { size, road, lane, lidars, radars, camera, additional_cameras, latency_s }
    }

    /// Returns the first message.
    pub(super) fn hello(&self) -> Vec<u8> {
        to_line(&Message::Hello(Box::new(Hello {
            kind: "perception".to_owned(),
            protocol: PROTOCOL,
            control_step_s: CONTROL_STEP.s(),
            latency_s: self.latency_s,
            ego: Ego { length_m: self.size.length_m, width_m: self.size.width_m },
            road: RoadMessage::of(self.road, self.lane),
            lidars: self.lidars.iter().map(lidar_message).collect(),
            radars: (!self.radars.is_empty()).then(|| self.radars.to_vec()),
            camera: self.camera.as_ref().map(camera_message),
            additional_cameras: several(self.additional_cameras, self.additional_cameras, camera_message),
        })))
    }
}

/// Returns the message of a control step.
pub(super) fn scans(question: &PerceptionQuestion<'_>) -> Vec<u8> {
    let PerceptionQuestion { time, ego, road, pose, .. } = *question;
    let lane = road.lane_of(&ego);
    to_line(&Message::Scans(Box::new(Scans {
        time_s: time.s(),
        time_ns: time.ns(),
        odometry: Odometry {
            speed_mps: ego.speed_mps,
            acceleration_mps2: ego.acceleration_mps2,
            yaw_rate_radps: ego.yaw_rate_radps,
            lane: lane.0,
            lane_offset_m: ego.d_m - road.lane_centre_m(lane, ego.s_m),
        },
        pose,
        scans: question.scans.iter().map(scan_message).collect(),
        radar_scans: (!question.radars.is_empty())
            .then(|| question.radar_scans.iter().map(radar_scan_message).collect()),
        image: question.image.map(image_message),
        additional_images: several(question.additional_cameras, question.additional_images, image_message),
    })))
}

fn lidar_message(lidar: &LidarMount) -> Lidar {
    let LidarMount { name, x_m, y_m, z_m, azimuth_rad, half_field_rad, range_m, layers, columns, period_s } = *lidar;
    let name = name.to_owned();
    Lidar { name, x_m, y_m, z_m, azimuth_rad, half_field_rad, range_m, layers, columns, period_s }
}

fn radar_scan_message(scan: &OutsideRadarScan) -> RadarScan {
    let message = |detection: &tracking::RadarDetection| {
        let tracking::RadarDetection { range_m, azimuth_rad, radial_mps, .. } = *detection;
        RadarDetection { range_m, azimuth_rad, radial_mps }
    };
    RadarScan { side: scan.side, time_ns: scan.time.ns(), detections: scan.detections.iter().map(message).collect() }
}

/// Returns the messages of what concerns further cameras; `None` without such cameras.
fn several<T, M>(cameras: &[CameraMount], all: &[T], message: impl Fn(&T) -> M) -> Option<Vec<M>> {
    (!cameras.is_empty()).then(|| all.iter().map(message).collect())
}

fn camera_message(camera: &CameraMount) -> Camera {
    let CameraMount { name, x_m, y_m, z_m, pitch_rad, yaw_rad, focal_px, distortion, size_px, period_s } = *camera;
    let ([distortion_k1, distortion_k2], [width, height], name) = (distortion, size_px, name.to_owned());
    Camera { name, x_m, y_m, z_m, pitch_rad, yaw_rad, focal_px, distortion_k1, distortion_k2, width, height, period_s }
}

fn image_message(image: &OutsideImage) -> Image {
    let OutsideImage { camera, time, width, height, ref rgb } = *image;
    Image { camera: camera.to_owned(), time_ns: time.ns(), width, height, rgb: STANDARD.encode(rgb) }
}

fn scan_message(outside: &OutsideScan) -> Scan {
    let scan = &outside.scan;
    let single = |values: &[f32]| encoded(values.iter().flat_map(|value| value.to_le_bytes()));
    Scan {
        sensor: outside.sensor.to_owned(),
        start_ns: scan.start.ns(),
        end_ns: scan.end.ns(),
        mirror_side: outside.has_mirror_sides.then_some(scan.mirror_side),
        points: scan.len(),
        x_m: single(&scan.x_m),
        y_m: single(&scan.y_m),
        z_m: single(&scan.z_m),
        intensity: single(&scan.echoes.intensity),
        echo_pulse_width_ns: single(&scan.echoes.pulse_width_ns),
        beam: encoded(scan.beam.iter().flat_map(|beam| beam.to_le_bytes())),
        offset_ns: encoded(scan.offset_ns.iter().flat_map(|offset_ns| offset_ns.to_le_bytes())),
    }
}

/// Returns bytes as base64.
fn encoded(bytes: impl Iterator<Item = u8>) -> String {
    STANDARD.encode(bytes.collect::<Vec<u8>>())
}
