//! The camera in the loop: each detection of the LiDAR gets the class that its place in the image suggests.

use closecall_traffic::ClassScores;

use super::classifier::{Backend, Classifier, ClassifierError};
use super::{Camera, Crop, ExposureKey, Frame, GroundBox, Lists, PixelRect, RearCamera};
use crate::{Detection, Scene, SceneVehicle, SensorError};

/// A window of which less than this share lies in the image says nothing [1].
const LEAST_IN_IMAGE: f64 = 0.6;
/// Neither the shape nor the image ever rules a class out: no score is taken for less than this [1].
const NEVER_BELOW: f64 = 0.02;
/// A cluster is at least this high for the camera [m]: the LiDAR's beams may have met its foot alone.
const LEAST_HEIGHT_M: f64 = 0.8;

/// Camera and network of one worker.
#[derive(Debug)]
pub struct CropClassifier {
    camera: RearCamera,
    classifier: Classifier,
    crop: Crop,
    lists: Lists,
}

impl CropClassifier {
    /// A camera with the network that ships.
    ///
    /// # Errors
    /// [`ClassifierError`] where the backend cannot be set up.
    pub fn new(camera: Camera, backend: &Backend) -> Result<Self, ClassifierError> {
        let classifier = Classifier::shipped(backend)?;
        Ok(Self { camera: RearCamera::new(camera), classifier, crop: Crop::default(), lists: Lists::default() })
    }

    /// Looks at every detection that lies in the image, and fuses what the network says with the class scores that
    /// the detection has from its shape. Detections out of view keep theirs. Returns how many were looked at.
    ///
    /// `scene` is the instant of the scan, `key` that of the exposure's noise.
    ///
    /// # Errors
    /// [`SensorError::Classifier`] where the network stopped; detections before that one have been changed.
    pub fn classify_detections(
        &mut self,
        scene: &Scene<'_>,
        key: ExposureKey,
        detections: &mut [Detection],
    ) -> Result<usize, SensorError> {
        let seen: Vec<(usize, PixelRect)> = detections
            .iter()
            .enumerate()
            .filter_map(|(place, detection)| Some((place, self.camera.window_of(&scene.ego, detection)?)))
            .collect();
        if seen.is_empty() {
            return Ok(0);
        }
        let windows: Vec<PixelRect> = seen.iter().map(|(_, window)| *window).collect();
        let mut frame = Frame::reusing(std::mem::take(&mut self.lists), self.camera.camera(), scene, key, &windows);
        for (place, window) in &seen {
            frame.crop(*window, &mut self.crop);
            let looked = self
                .classifier
                .classify(&self.crop)
                .map_err(|error| SensorError::Classifier { reason: error.to_string() })?;
            detections[*place].class = fused(&detections[*place].class, &looked);
        }
        self.lists = frame.into_lists();
        Ok(seen.len())
    }
}

impl RearCamera {
    /// The window that the network is shown of a detection; nothing where too little of it lies in the image.
    pub fn window_of(&self, ego: &SceneVehicle, detection: &Detection) -> Option<PixelRect> {
        let (x_m, y_m) = detection.centre_m();
        let object = GroundBox {
            x_m,
            y_m,
            heading_rad: detection.heading_rad,
            length_m: detection.length_m,
            width_m: detection.width_m,
            height_m: detection.top_m.max(LEAST_HEIGHT_M),
        };
        self.project(ego, &object).filter(|window| window.share_in_image() >= LEAST_IN_IMAGE)
    }
}

/// Scores after two witnesses that err independently, all classes being as likely beforehand: the normalised product.
fn fused(shape: &ClassScores, image: &ClassScores) -> ClassScores {
    let product = [0, 1, 2, 3].map(|class| shape.0[class].max(NEVER_BELOW) * image.0[class].max(NEVER_BELOW));
    let sum: f64 = product.iter().sum();
    ClassScores(product.map(|score| score / sum))
}

#[cfg(test)]
mod tests {
    use closecall_traffic::{Check, Environment, Parameters, Road, Time, Vehicle, VehicleClass, VehicleState};

    use super::*;
    use crate::Extent;
    use crate::camera::CameraConfig;

    fn vehicle(class: VehicleClass, s_m: f64) -> SceneVehicle {
        let state = VehicleState { s_m, d_m: -5.6, speed_mps: 30.0, ..VehicleState::default() };
        SceneVehicle { actor: 1, vehicle: Vehicle::typical(class), state, pitch_rad: 0.0 }
    }

    fn detection(face_x_m: f64, width_m: f64, top_m: f64) -> Detection {
        Detection {
            time: Time::ZERO,
            face_x_m,
            face_y_m: 0.0,
            range_sd_m: 0.1,
            lateral_sd_m: 0.1,
            heading_rad: 0.0,
            length_m: 4.5,
            length: Extent::Assumed,
            width_m,
            width: Extent::Seen,
            top_m,
            points: 50,
            class: ClassScores::UNKNOWN,
        }
    }

    fn classified(others: &[SceneVehicle], detections: &mut [Detection]) -> usize {
        let camera = CameraConfig::default().check(&Parameters::default()).unwrap();
        let (road, environment, ego) = (Road::straight(3), Environment::CLEAR_DAY, vehicle(VehicleClass::Car, 500.0));
        let scene = Scene { time: Time::ZERO, road: &road, environment: &environment, ego, others };
        let mut pipeline = CropClassifier::new(camera, &Backend::Tract).unwrap();
        pipeline.classify_detections(&scene, ExposureKey(1), detections).unwrap()
    }

    #[test]
    fn each_class_is_told_and_an_empty_road_is_background() {
        for class in VehicleClass::ALL {
            let other = vehicle(class, 460.0);
            let size = other.vehicle.dimensions;
            let mut detections = [detection(-40.0 + size.length_m / 2.0, size.width_m, size.height_m)];
            assert_eq!(classified(&[other], &mut detections), 1);
            assert!(detections[0].class.0[class as usize] > 0.8, "{class:?}: {:?}", detections[0].class);
        }
        let mut nothing = [detection(-12.0, 1.0, 0.8)];
        classified(&[], &mut nothing);
        assert!(nothing[0].class.vehicle() < 0.2, "{:?}", nothing[0].class);
    }

    #[test]
    fn what_lies_out_of_view_keeps_its_scores() {
        let mut detections = [detection(30.0, 1.8, 1.5)];
        assert_eq!(classified(&[], &mut detections), 0);
        assert_eq!(detections[0].class, ClassScores::UNKNOWN);
    }

    #[test]
    fn no_witness_rules_a_class_out_alone() {
        let car = ClassScores::certain(VehicleClass::Car);
        let truck = ClassScores::certain(VehicleClass::Truck);
        let scores = fused(&car, &truck).0;
        assert!((scores[0] - scores[1]).abs() < 1e-12 && scores[0] > 0.4);
        assert!((scores.iter().sum::<f64>() - 1.0).abs() < 1e-12);
    }
}
