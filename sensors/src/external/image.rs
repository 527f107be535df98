//! The images of the rear cameras that a program gets.

use closecall_traffic::Time;

use super::settings::ImageSettings;
use crate::camera::{Camera, CameraFault, Frame, FrameBuffers, Image, Sampling};
use crate::exposures::Exposures;
use crate::faults::FaultList;
use crate::{NoiseKey, Scene};

/// An image as a program gets it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OutsideImage {
    /// Name of the camera.
    pub camera: &'static str,
    /// Time of the exposure.
    pub time: Time,
    /// Number of columns.
    pub width: u32,
    /// Number of rows.
    pub height: u32,
    /// Red, green and blue of each pixel, row by row from the top left.
    pub rgb: Vec<u8>,
}

/// A rear camera as a program is told of it, in the frame of the ego.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraMount {
    /// Name of the camera.
    pub name: &'static str,
    /// Position of the lens ahead of the ego's centre (m).
    pub x_m: f64,
    /// Position to the left of it (m).
    pub y_m: f64,
    /// Height of the lens above the road (m).
    pub z_m: f64,
    /// Pitch, positive if it looks down (rad).
    pub pitch_rad: f64,
    /// Yaw of the optical axis from straight behind, positive if it looks to the ego's left (rad).
    pub yaw_rad: f64,
    /// Focal length (px of the image that the program gets).
    pub focal_px: f64,
    /// Coefficients k1 and k2 of the radial distortion (-).
    pub distortion: [f64; 2],
    /// Number of columns and rows of the image.
    pub size_px: [usize; 2],
    /// Time from an image to the next (s).
    pub period_s: f64,
}

impl CameraMount {
    /// Returns the mounting of a camera on an ego of this length (m).
    pub fn of(camera: &Camera, settings: ImageSettings, ego_length_m: f64) -> Self {
        let sampling = Sampling::every(settings.step, camera.resolution);
        Self {
            name: camera.name,
            x_m: -0.5 * ego_length_m + camera.mount_from_rear_m,
            y_m: camera.left_m,
            z_m: camera.mount_height_m,
            pitch_rad: camera.pitch_rad,
            yaw_rad: camera.yaw_rad,
            focal_px: camera.focal_px / f64::from(settings.step),
            distortion: camera.optics.distortion,
            size_px: [sampling.columns().len(), sampling.rows().len()],
            period_s: settings.period.s(),
        }
    }
}

/// A rear camera of a run whose images a program gets.
pub(crate) struct OutsideCamera {
    camera: Camera,
    settings: ImageSettings,
    sampling: Sampling,
    exposures: Exposures,
    next: Option<Time>,
    lists: FrameBuffers,
}

impl OutsideCamera {
    /// Creates the camera of one run with its number in the scenario. `key` is the key of its noise.
    pub(crate) fn new(
        (number, camera): (usize, &Camera),
        settings: ImageSettings,
        key: &NoiseKey,
        faults: FaultList<CameraFault>,
    ) -> Self {
        Self {
            camera: *camera,
            settings,
            sampling: Sampling::every(settings.step, camera.resolution),
            exposures: Exposures::new((number, camera), key, faults),
            next: None,
            lists: FrameBuffers::default(),
        }
    }

    /// Returns the mounting on an ego of this length (m).
    pub(crate) fn mount(&self, ego_length_m: f64) -> CameraMount {
        CameraMount::of(&self.camera, self.settings, ego_length_m)
    }

    /// Returns the image of a scene if one is due, and the camera is not dead.
    pub(crate) fn image(&mut self, scene: &Scene<'_>) -> Option<OutsideImage> {
        let exposure = self.exposures.next_exposure(scene);
        let due = *self.next.get_or_insert(scene.time);
        if scene.time < due {
            return None;
        }
        self.next = Some(due + self.settings.period);
        if exposure.is_dead() {
            return None;
        }
        let imaged = self.exposures.imaged(scene);
        let lists = std::mem::take(&mut self.lists);
        let mut frame =
            Frame::with_buffers(lists, &self.camera, &imaged, exposure.key, &[self.camera.resolution.image()]);
        if let Some(fault) = &exposure.fault {
            frame.add_glare(fault, &imaged);
        }
        let mut picture = frame.sampled(self.sampling.columns(), self.sampling.rows()).image;
        self.lists = frame.into_buffers();
        if let Some(fault) = &exposure.fault {
            fault.apply_to_picture(&mut picture, &self.sampling, self.camera.resolution);
        }
        let Image { width, height, rgb } = picture;
        Some(OutsideImage { camera: self.camera.name, time: scene.time, width, height, rgb })
    }
}

#[cfg(test)]
mod tests {
    use closecall_traffic::{Check, Parameters};

    use super::*;
    use crate::camera::CameraConfig;

    #[test]
    fn a_program_is_told_the_size_and_the_yaw_of_the_camera() {
        let mount = |text: &str| {
            let config: CameraConfig = toml::from_str(text).unwrap();
            let settings = ImageSettings { period: Time::from_ms(200), step: 2 };
            CameraMount::of(&config.check(&Parameters::default()).unwrap(), settings, 4.6)
        };
        let usual = mount("");
        assert_eq!((usual.size_px, usual.yaw_rad), ([640, 400], 0.0));
        assert_eq!((usual.name, usual.y_m, mount("left-m = 0.5").y_m), ("rear-camera", 0.0, 0.5));
        let other = mount("resolution = { width-px = 1921, height-px = 1208 }\nyaw-deg = -30");
        assert_eq!(other.size_px, [961, 604]);
        assert!((other.yaw_rad + std::f64::consts::FRAC_PI_6).abs() < 1e-12);
        assert!((other.focal_px / usual.focal_px - 1_921.0 / 1_280.0).abs() < 1e-12);
    }
}
