//! Writes the messages to a perception process.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use closecall_sensors::external::{
    CameraMount, LidarMount, OutsideImage, OutsideRadarScan, OutsideScan, PerceptionQuestion, Pose, RadarMount,
};
use closecall_sensors::lidar::MirrorSide;
use closecall_sensors::tracking::RadarDetection;
use closecall_traffic::{CONTROL_STEP, Dimensions, Road, Side};
use serde::Serialize;

use crate::controller::exec::{PROTOCOL, RoadMessage, to_line};

#[derive(Serialize)]
#[serde(tag = "type", rename_all = "kebab-case")]
enum Message<'a> {
    Hello {
        kind: &'static str,
        protocol: u32,
        control_step_s: f64,
        latency_s: f64,
        ego: EgoMessage,
        road: RoadMessage,
        lidars: Vec<LidarMessage>,
        /// Absent without radars, as in each question.
        #[serde(skip_serializing_if = "Option::is_none")]
        radars: Option<Vec<RadarMessage>>,
        camera: Option<CameraMessage>,
    },
    Scans {
        time_s: f64,
        time_ns: i64,
        odometry: OdometryMessage,
        pose: PoseMessage,
        scans: Vec<ScanMessage<'a>>,
        #[serde(skip_serializing_if = "Option::is_none")]
        radar_scans: Option<Vec<RadarScanMessage>>,
        image: Option<ImageMessage>,
    },
}

#[derive(Serialize)]
struct EgoMessage {
    length_m: f64,
    width_m: f64,
}

#[derive(Serialize)]
struct LidarMessage {
    name: &'static str,
    x_m: f64,
    y_m: f64,
    z_m: f64,
    azimuth_rad: f64,
    half_field_rad: f64,
    range_m: f64,
    layers: usize,
    columns: usize,
    period_s: f64,
}

#[derive(Serialize)]
struct RadarMessage {
    side: &'static str,
    x_m: f64,
    y_m: f64,
    azimuth_rad: f64,
    half_field_rad: f64,
    range_m: f64,
    period_s: f64,
    range_sd_m: f64,
    azimuth_sd_rad: f64,
    radial_sd_mps: f64,
}

#[derive(Serialize)]
struct RadarScanMessage {
    side: &'static str,
    time_ns: i64,
    detections: Vec<RadarDetectionMessage>,
}

#[derive(Serialize)]
struct RadarDetectionMessage {
    range_m: f64,
    azimuth_rad: f64,
    radial_mps: f64,
}

#[derive(Serialize)]
struct CameraMessage {
    x_m: f64,
    z_m: f64,
    pitch_rad: f64,
    yaw_rad: f64,
    focal_px: f64,
    distortion_k1: f64,
    distortion_k2: f64,
    width: usize,
    height: usize,
    period_s: f64,
}

#[derive(Serialize)]
struct ImageMessage {
    time_ns: i64,
    width: u32,
    height: u32,
    rgb: String,
}

#[derive(Serialize)]
struct OdometryMessage {
    speed_mps: f64,
    acceleration_mps2: f64,
    yaw_rate_radps: f64,
    lane: u8,
    lane_offset_m: f64,
}

#[derive(Serialize)]
struct PoseMessage {
    x_m: f64,
    y_m: f64,
    yaw_rad: f64,
}

#[derive(Serialize)]
struct ScanMessage<'a> {
    sensor: &'a str,
    start_ns: i64,
    end_ns: i64,
    mirror_side: Option<&'static str>,
    points: usize,
    x_m: String,
    y_m: String,
    z_m: String,
    intensity: String,
    echo_pulse_width_ns: String,
    beam: String,
    offset_ns: String,
}

/// What a process is told once.
pub(super) struct Setup<'a> {
    pub(super) size: Dimensions,
    pub(super) road: &'a Road,
    pub(super) lidars: &'a [LidarMount],
    pub(super) radars: &'a [RadarMount],
    pub(super) camera: Option<CameraMount>,
    pub(super) latency_s: f64,
}

impl<'a> Setup<'a> {
    /// Returns what is told before a question.
    pub(super) fn of(question: &PerceptionQuestion<'a>) -> Self {
        let PerceptionQuestion { size, road, lidars, radars, camera, latency_s, .. } = *question;
        Self { size, road, lidars, radars, camera, latency_s }
    }

    /// Returns the first message.
    pub(super) fn hello(&self) -> Vec<u8> {
        to_line(&Message::Hello {
            kind: "perception",
            protocol: PROTOCOL,
            control_step_s: CONTROL_STEP.s(),
            latency_s: self.latency_s,
            ego: EgoMessage { length_m: self.size.length_m, width_m: self.size.width_m },
            road: RoadMessage::of(self.road),
            lidars: self.lidars.iter().map(lidar_message).collect(),
            radars: (!self.radars.is_empty()).then(|| self.radars.iter().map(radar_message).collect()),
            camera: self.camera.map(camera_message),
        })
    }
}

/// Returns the message of a control step.
pub(super) fn scans(question: &PerceptionQuestion<'_>) -> Vec<u8> {
    let PerceptionQuestion { time, ego, road, pose: Pose { x_m, y_m, yaw_rad }, .. } = *question;
    let lane = road.lane_at(ego.d_m);
    to_line(&Message::Scans {
        time_s: time.s(),
        time_ns: time.ns(),
        odometry: OdometryMessage {
            speed_mps: ego.speed_mps,
            acceleration_mps2: ego.acceleration_mps2,
            yaw_rate_radps: ego.yaw_rate_radps,
            lane: lane.0,
            lane_offset_m: ego.d_m - road.lane_centre_m(lane),
        },
        pose: PoseMessage { x_m, y_m, yaw_rad },
        scans: question.scans.iter().map(scan_message).collect(),
        radar_scans: (!question.radars.is_empty())
            .then(|| question.radar_scans.iter().map(radar_scan_message).collect()),
        image: question.image.map(image_message),
    })
}

fn lidar_message(lidar: &LidarMount) -> LidarMessage {
    let LidarMount { name, x_m, y_m, z_m, azimuth_rad, half_field_rad, range_m, layers, columns, period_s } = *lidar;
    LidarMessage { name, x_m, y_m, z_m, azimuth_rad, half_field_rad, range_m, layers, columns, period_s }
}

fn radar_message(radar: &RadarMount) -> RadarMessage {
    let RadarMount { side, x_m, y_m, azimuth_rad, half_field_rad, range_m, period_s, .. } = *radar;
    let RadarMount { range_sd_m, azimuth_sd_rad, radial_sd_mps, .. } = *radar;
    RadarMessage {
        side: side_word(side),
        x_m,
        y_m,
        azimuth_rad,
        half_field_rad,
        range_m,
        period_s,
        range_sd_m,
        azimuth_sd_rad,
        radial_sd_mps,
    }
}

fn radar_scan_message(scan: &OutsideRadarScan) -> RadarScanMessage {
    let message = |detection: &RadarDetection| {
        let RadarDetection { range_m, azimuth_rad, radial_mps, .. } = *detection;
        RadarDetectionMessage { range_m, azimuth_rad, radial_mps }
    };
    RadarScanMessage {
        side: side_word(scan.side),
        time_ns: scan.time.ns(),
        detections: scan.detections.iter().map(message).collect(),
    }
}

const fn side_word(side: Side) -> &'static str {
    match side {
        Side::Left => "left",
        Side::Right => "right",
    }
}

fn camera_message(camera: CameraMount) -> CameraMessage {
    let CameraMount { x_m, z_m, pitch_rad, yaw_rad, focal_px, distortion, size_px: [width, height], period_s } = camera;
    let [distortion_k1, distortion_k2] = distortion;
    CameraMessage { x_m, z_m, pitch_rad, yaw_rad, focal_px, distortion_k1, distortion_k2, width, height, period_s }
}

fn image_message(image: &OutsideImage) -> ImageMessage {
    let OutsideImage { time, width, height, ref rgb } = *image;
    ImageMessage { time_ns: time.ns(), width, height, rgb: STANDARD.encode(rgb) }
}

fn scan_message(outside: &OutsideScan) -> ScanMessage<'_> {
    let scan = &outside.scan;
    let single = |values: &[f32]| encoded(values.iter().flat_map(|value| value.to_le_bytes()));
    let side = match scan.mirror_side {
        MirrorSide::Plus => "plus",
        MirrorSide::Minus => "minus",
    };
    ScanMessage {
        sensor: outside.sensor,
        start_ns: scan.start.ns(),
        end_ns: scan.end.ns(),
        mirror_side: outside.has_mirror_sides.then_some(side),
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
