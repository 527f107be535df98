//! The pipeline `mask-rcnn` in the simulation loop: it renders the pixels of the whole image that
//! the network reads, and returns the instances.

use crate::tracking::Detection;
use closecall_traffic::{Check, Parameters, Scene, SceneVehicle, maths};

use super::classifier::{Backend, ClassifierError, read_network};
use super::detector::{InstanceDetector, SHIPPED_MASK_RCNN};
use super::fault::CameraFault;
use super::instance::Instance;
use super::labels::LabelMap;
use super::mask_rcnn_config::{MaskRcnn, MaskRcnnConfig};
use super::picture::Resolution;
use super::pinhole::Lens;
use super::pipeline::ground_box;
use super::{Camera, CameraConfig, ExposureKey, Frame, FrameBuffers, RearCamera};

/// The camera and the instance detector of one worker thread.
#[derive(Debug)]
pub struct WholeImageDetector {
    camera: RearCamera,
    detector: InstanceDetector,
    lists: FrameBuffers,
}

impl CameraConfig {
    /// Loads the Mask R-CNN that this configuration names. A missing or wrong file is then reported
    /// before any work begins.
    ///
    /// # Errors
    /// As [`MaskRcnn::detector`]; a configuration that cannot be checked is no error here.
    pub fn check_network(&self, backend: &Backend) -> Result<(), ClassifierError> {
        // Only the keys that name the network: a number may be a parameter, and its value is not
        // known yet.
        let MaskRcnnConfig { model, labels, input, .. } = self.mask_rcnn.clone();
        let config = MaskRcnnConfig { model, labels, input, ..MaskRcnnConfig::default() };
        config.check(&Parameters::default()).map_or(Ok(()), |checked| checked.detector(backend).map(|_| ()))
    }
}

impl MaskRcnn {
    /// Loads the network.
    ///
    /// # Errors
    /// [`ClassifierError`] if the model's file cannot be read, and as [`InstanceDetector::new`].
    pub fn detector(&self, backend: &Backend) -> Result<InstanceDetector, ClassifierError> {
        let labels = self.labels.and_then(|text| LabelMap::parse(text).ok());
        let Some(path) = self.model else {
            return Ok(InstanceDetector::new(SHIPPED_MASK_RCNN, labels.as_ref(), backend)?.with_input(self.input));
        };
        let at = |reason: String| ClassifierError::Model { reason: format!("{path}: {reason}") };
        let bytes = read_network(path)?;
        let detector = InstanceDetector::new(&bytes, labels.as_ref(), backend).map_err(|error| match error {
            ClassifierError::Model { reason } => at(reason),
            ClassifierError::Layout { actual, wanted } => {
                ClassifierError::Layout { actual: format!("{path}: {actual}"), wanted }
            }
            other => other,
        });
        Ok(detector?.with_input(self.input).with_name(path))
    }
}

impl WholeImageDetector {
    /// Creates a camera with the network that its configuration names.
    ///
    /// # Errors
    /// As [`MaskRcnn::detector`].
    pub fn new(camera: Camera, backend: &Backend) -> Result<Self, ClassifierError> {
        let detector = camera.mask_rcnn.detector(backend)?;
        Ok(Self { camera: RearCamera::new(camera), detector, lists: FrameBuffers::default() })
    }

    /// Returns the camera.
    pub fn camera(&self) -> &RearCamera {
        &self.camera
    }

    /// Returns the instances in the image of a scene. `key` is the key of the exposure's noise.
    ///
    /// # Errors
    /// [`ClassifierError`] if the network fails.
    pub fn detect(
        &mut self,
        imaged: &Scene<'_>,
        key: ExposureKey,
        fault: Option<&CameraFault>,
    ) -> Result<Vec<Instance>, ClassifierError> {
        let lists = std::mem::take(&mut self.lists);
        let camera = self.camera.camera();
        let mut frame = Frame::with_buffers(lists, camera, imaged, key, &[camera.resolution.image()]);
        if let Some(fault) = fault {
            frame.add_glare(fault, imaged);
        }
        let sampling = self.detector.sampling();
        let mut picture = frame.sampled(sampling.columns(), sampling.rows()).image;
        self.lists = frame.into_buffers();
        if let Some(fault) = fault {
            fault.apply_to_picture(&mut picture, sampling, self.camera.camera().resolution);
        }
        self.detector.detect(&picture)
    }
}

impl RearCamera {
    /// Returns the box in the image around a detection: left, top, right, bottom (px). Returns
    /// `None` if no part of it is in the image.
    pub fn detection_bounds(&self, ego: &SceneVehicle, detection: &Detection) -> Option<[f64; 4]> {
        let lens = Lens::new(self.camera(), ego);
        let mut object = ground_box(detection);
        object.x_m -= lens.ahead_m;
        object.y_m -= lens.left_m;
        let [left, top, right, bottom] = lens.bounds(&object.corners().map(|corner| lens.in_camera(corner)))?;
        let Resolution { width_px, height_px } = self.camera().resolution;
        let [width, height] = [width_px, height_px].map(f64::from);
        let inside = [left.max(0.0), top.max(0.0), right.min(width), bottom.min(height)];
        (inside[0] < inside[2] && inside[1] < inside[3]).then_some(inside)
    }

    /// Returns the distance from the lens back to a position along the axis of `ego` (m), or `None`
    /// ahead of the lens.
    pub fn depth_m(&self, ego: &SceneVehicle, x_m: f64) -> Option<f64> {
        let depth_m = Lens::new(self.camera(), ego).ahead_m - x_m;
        (depth_m > 0.0).then_some(depth_m)
    }

    /// Returns the distance to the left of the lens of the ray through a column of the image (px), per
    /// distance behind the lens. The pitch is neglected.
    pub fn slope(&self, u: f64) -> f64 {
        let (slope, turn) = (self.slope_to_axis(u), maths::tan(self.camera().yaw_rad));
        (slope + turn) / (1.0 - slope * turn)
    }

    /// Returns the distance across the optical axis of the ray through a column, per distance along
    /// the axis.
    fn slope_to_axis(&self, u: f64) -> f64 {
        (u - self.camera().resolution.middle_px()[0]) / self.camera().focal_px
    }

    /// Returns the distance between the slopes of two columns, divided by the distance of the
    /// columns in units of the focal length: 1 if the camera looks straight back.
    pub fn widening(&self, columns: [f64; 2]) -> f64 {
        let turn = maths::tan(self.camera().yaw_rad);
        let [left, right] = columns.map(|u| 1.0 - self.slope_to_axis(u) * turn);
        (1.0 + turn * turn) / (left * right)
    }

    /// Returns the position (x, y) in the frame of `ego` (m) at which the ray through a position in
    /// the image (px) meets a flat road, and the tangent of its angle below the horizon. Returns
    /// `None` above the horizon.
    pub fn on_ground(&self, ego: &SceneVehicle, [u, v]: [f64; 2]) -> Option<([f64; 2], f64)> {
        let lens = Lens::new(self.camera(), ego);
        let focal_px = self.camera().focal_px;
        let middle = self.camera().resolution.middle_px();
        let mut at = [(u - middle[0]) / focal_px, (v - middle[1]) / focal_px];
        if !lens.optics.is_straight() {
            at = lens.optics.undistorted(at);
        }
        let [x, y, z] = lens.ray_in_ground(at.map(|part| part as f32)).map(f64::from);
        let below = -z / maths::hypot(x, y);
        (below > 1e-4).then(|| {
            let along = lens.height_m / -z;
            ([lens.ahead_m + along * x, lens.left_m + along * y], below)
        })
    }
}
