//! What a perception receives, in the form of the interface.

use std::ffi::CString;

use closecall_sensors::external::RadarMount;
use closecall_sensors::lidar::MirrorSide;
use closecall_traffic::Side;

use super::abi;
use crate::perception::message::{Camera, Hello, Image, Lidar, Points, Scans};

/// The data that a perception receives when it is created.
pub(super) struct Setup {
    hello: Hello,
    names: Vec<CString>,
    /// The names of the first rear camera and of the further ones.
    camera_names: Vec<CString>,
}

impl Setup {
    /// Returns the setup that a greeting states.
    pub(super) fn new(hello: Hello) -> Self {
        // A name of the scenario has no NUL character.
        let text = |name: &str| CString::new(name).unwrap_or_default();
        let names = hello.lidars.iter().map(|lidar| text(&lidar.name)).collect();
        let cameras = hello.camera.iter().chain(hello.additional_cameras.iter().flatten());
        let camera_names = cameras.map(|camera| text(&camera.name)).collect();
        Self { hello, names, camera_names }
    }

    /// Calls `f` with the setup in the form of the interface.
    pub(super) fn with_view<T>(&self, f: impl FnOnce(&abi::SetupView) -> T) -> T {
        let Hello { control_step_s, latency_s, ego, road, lidars, radars, camera, additional_cameras, .. } =
            &self.hello;
        let lidar = |(lidar, name): (&Lidar, &CString)| abi::Lidar {
            name: name.as_ptr(),
            x_m: lidar.x_m,
            y_m: lidar.y_m,
            z_m: lidar.z_m,
            azimuth_rad: lidar.azimuth_rad,
            half_field_rad: lidar.half_field_rad,
            range_m: lidar.range_m,
            period_s: lidar.period_s,
            layers: whole(lidar.layers),
            columns: whole(lidar.columns),
        };
        let radar = |radar: &RadarMount| abi::Radar {
            side: number_of(radar.side),
            reserved: 0,
            x_m: radar.x_m,
            y_m: radar.y_m,
            azimuth_rad: radar.azimuth_rad,
            half_field_rad: radar.half_field_rad,
            range_m: radar.range_m,
            period_s: radar.period_s,
            range_sd_m: radar.range_sd_m,
            azimuth_sd_rad: radar.azimuth_sd_rad,
            radial_sd_mps: radar.radial_sd_mps,
        };
        let lidar_list: Vec<abi::Lidar> = lidars.iter().zip(&self.names).map(lidar).collect();
        let radar_list: Vec<abi::Radar> = radars.iter().flatten().map(radar).collect();
        let camera_view = |(camera, name): (&Camera, &CString)| abi::Camera {
            x_m: camera.x_m,
            z_m: camera.z_m,
            pitch_rad: camera.pitch_rad,
            yaw_rad: camera.yaw_rad,
            focal_px: camera.focal_px,
            distortion_k1: camera.distortion_k1,
            distortion_k2: camera.distortion_k2,
            period_s: camera.period_s,
            width: whole(camera.width),
            height: whole(camera.height),
            y_m: camera.y_m,
            name: name.as_ptr(),
        };
        let all = camera.iter().chain(additional_cameras.iter().flatten()).zip(&self.camera_names);
        let cameras: Vec<abi::Camera> = all.map(camera_view).collect();
        let additional = cameras.get(1..).unwrap_or_default();
        f(&abi::SetupView {
            control_step_s: *control_step_s,
            latency_s: *latency_s,
            ego_length_m: ego.length_m,
            ego_width_m: ego.width_m,
            lane_width_m: road.lane_width_m,
            curvature_per_m: road.curvature_per_m.unwrap_or(f64::NAN),
            speed_limit_mps: road.speed_limit_mps,
            lanes: whole(road.lane_widths_m.len()),
            overtaking_side: number_of(road.overtaking_side),
            lidars: lidar_list.as_ptr(),
            lidar_count: lidar_list.len() as u64,
            radars: radar_list.as_ptr(),
            radar_count: radar_list.len() as u64,
            camera: cameras.first().map_or(std::ptr::null(), std::ptr::from_ref),
            additional_cameras: additional.as_ptr(),
            additional_camera_count: additional.len() as u64,
            lane_widths_m: road.lane_widths_m.as_ptr(),
        })
    }

    /// Returns the index of the LiDAR of this name, or why there is none.
    fn lidar(&self, name: &str) -> Result<u32, String> {
        let index = self.hello.lidars.iter().position(|lidar| lidar.name == name);
        let index = index.and_then(|index| u32::try_from(index).ok());
        index.ok_or_else(|| format!("failed to read a scan: the greeting has no LiDAR `{name}`"))
    }
}

/// Calls `f` with a question in the form of the interface, or returns what is wrong with the
/// question.
pub(super) fn with_input<T>(
    setup: &Setup,
    question: &Scans,
    f: impl FnOnce(&abi::InputView) -> T,
) -> Result<T, String> {
    let points: Vec<Points> = question.scans.iter().map(|scan| scan.decode()).collect::<Result<_, _>>()?;
    let mut scans = Vec::with_capacity(points.len());
    for (scan, points) in question.scans.iter().zip(&points) {
        scans.push(abi::Scan {
            lidar: setup.lidar(&scan.sensor)?,
            mirror_side: match scan.mirror_side {
                None => 0,
                Some(MirrorSide::Plus) => 1,
                Some(MirrorSide::Minus) => -1,
            },
            start_ns: scan.start_ns,
            end_ns: scan.end_ns,
            point_count: points.x_m.len() as u64,
            x_m: points.x_m.as_ptr(),
            y_m: points.y_m.as_ptr(),
            z_m: points.z_m.as_ptr(),
            intensity: points.intensity.as_ptr(),
            beam: points.beam.as_ptr(),
            offset_ns: points.offset_ns.as_ptr(),
        });
    }
    let radar_scans: Vec<abi::RadarScan> = question
        .radar_scans
        .iter()
        .flatten()
        .map(|scan| abi::RadarScan {
            side: number_of(scan.side),
            reserved: 0,
            time_ns: scan.time_ns,
            detection_count: scan.detections.len() as u64,
            detections: scan.detections.as_ptr(),
        })
        .collect();
    let additional_cameras = setup.hello.additional_cameras.as_deref().unwrap_or_default();
    let view_of = |image: &Image, rgb: &[u8]| abi::Image {
        time_ns: image.time_ns,
        width: image.width,
        height: image.height,
        rgb: rgb.as_ptr(),
        additional_camera: whole(additional_cameras.iter().position(|one| one.name == image.camera).unwrap_or(0)),
        reserved: 0,
    };
    let rgb = question.image.as_ref().map(Image::decode).transpose()?;
    let image = question.image.as_ref().zip(rgb.as_ref()).map(|(image, rgb)| view_of(image, rgb));
    let additional = question.additional_images.as_deref().unwrap_or_default();
    let additional_rgb: Vec<Vec<u8>> = additional.iter().map(Image::decode).collect::<Result<_, _>>()?;
    let additional_images: Vec<abi::Image> =
        additional.iter().zip(&additional_rgb).map(|(image, rgb)| view_of(image, rgb)).collect();
    let (odometry, pose) = (&question.odometry, &question.pose);
    Ok(f(&abi::InputView {
        time_ns: question.time_ns,
        time_s: question.time_s,
        speed_mps: odometry.speed_mps,
        acceleration_mps2: odometry.acceleration_mps2,
        yaw_rate_radps: odometry.yaw_rate_radps,
        lane_offset_m: odometry.lane_offset_m,
        pose_x_m: pose.x_m,
        pose_y_m: pose.y_m,
        pose_yaw_rad: pose.yaw_rad,
        lane: odometry.lane.into(),
        reserved: 0,
        scans: scans.as_ptr(),
        scan_count: scans.len() as u64,
        radar_scans: radar_scans.as_ptr(),
        radar_scan_count: radar_scans.len() as u64,
        image: image.as_ref().map_or(std::ptr::null(), std::ptr::from_ref),
        additional_images: additional_images.as_ptr(),
        additional_image_count: additional_images.len() as u64,
    }))
}

/// Returns a number of the greeting as the interface has it.
fn whole(number: usize) -> u32 {
    u32::try_from(number).unwrap_or(u32::MAX)
}

/// Returns the number of a side in the interface.
const fn number_of(side: Side) -> i32 {
    match side {
        Side::Left => 0,
        Side::Right => 1,
    }
}
