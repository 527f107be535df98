//! The camera in the simulation loop: it adds the evidence of the image to the class scores of each
//! LiDAR detection.

use crate::tracking::{Detection, LaneGeometry};
use closecall_traffic::{ClassScores, Scene, SceneVehicle};

use super::classifier::{Backend, Classifier, ClassifierError};
use super::fault::CameraFault;
use super::image_memory::ImageMemory;
use super::{Camera, Crop, ExposureKey, Frame, FrameBuffers, GroundBox, PixelRect, RearCamera};

/// Minimum share of a window that must lie in the image for it to be classified (0 to 1).
pub const MIN_SHARE_IN_IMAGE: f64 = 0.6;
/// Lower bound that the fusion applies to each score (0 to 1), so that neither the shape nor the
/// image alone can rule out a class.
const MIN_SCORE: f64 = 0.02;
/// Minimum height assumed for a cluster (m), because the LiDAR's beams may have hit only the lower
/// part of the object.
const MIN_HEIGHT_M: f64 = 0.8;

/// The scene in which detections are classified, and the scene that the image shows. The second is
/// older if the camera is frozen.
#[derive(Clone, Copy)]
pub struct ImagedScene<'a> {
    /// The scene of the detections.
    pub now: &'a Scene<'a>,
    /// The scene that the image shows.
    pub imaged: &'a Scene<'a>,
    /// The fault of the camera.
    pub fault: Option<&'a CameraFault>,
}

/// The camera and the neural network of one worker thread.
#[derive(Debug)]
pub struct CropClassifier {
    camera: RearCamera,
    classifier: Classifier,
    crop: Crop,
    lists: FrameBuffers,
    /// The detections that are due, by their index, and the index of their window.
    due: Vec<(usize, usize)>,
    /// The windows of these detections, each once.
    windows: Vec<PixelRect>,
    /// The network's scores of the windows.
    scores: Vec<ClassScores>,
}

impl CropClassifier {
    /// Creates a camera with the network that its configuration names.
    ///
    /// # Errors
    /// Returns the errors of [`Classifier::of`].
    pub fn new(camera: Camera, backend: &Backend) -> Result<Self, ClassifierError> {
        let classifier = Classifier::of(camera.model, backend)?;
        Ok(Self {
            camera: RearCamera::new(camera),
            classifier,
            crop: Crop::default(),
            lists: FrameBuffers::default(),
            due: Vec::new(),
            windows: Vec::new(),
            scores: Vec::new(),
        })
    }

    /// Classifies the detections that lie in the image and on the road, and fuses the network's
    /// scores with the class scores that a detection has from its shape. Returns the number of
    /// crops that the network has classified.
    ///
    /// If `memory` knows a detection, its scores are the scores of its latest crop. Detections with
    /// the same window, such as equal ones of a program, share a crop. Detections out of view, and detections entirely beside the road, keep their scores. `key` is the key of the
    /// exposure's noise.
    ///
    /// # Errors
    /// Returns a [`ClassifierError`] if the network fails. Only the detections that `memory` knows
    /// then have new scores.
    pub fn classify_with(
        &mut self,
        ImagedScene { now: scene, imaged, fault }: ImagedScene<'_>,
        key: ExposureKey,
        memory: &mut ImageMemory,
        detections: &mut [Detection],
    ) -> Result<usize, ClassifierError> {
        let lane = LaneGeometry::from_scene(scene);
        memory.begin(scene.time);
        self.due.clear();
        self.windows.clear();
        for (index, detection) in detections.iter_mut().enumerate().filter(|(_, at)| !is_beside_road(at, &lane)) {
            let Some(window) = self.camera.detection_window(&scene.ego, detection) else { continue };
            match memory.recall(detection) {
                Some(scores) => detection.class = fuse(&detection.class, &scores),
                None => {
                    let earlier = self.windows.iter().position(|earlier| *earlier == window);
                    self.due.push((index, earlier.unwrap_or(self.windows.len())));
                    if earlier.is_none() {
                        self.windows.push(window);
                    }
                }
            }
        }
        if self.due.is_empty() {
            return Ok(0);
        }
        let mut frame =
            Frame::with_buffers(std::mem::take(&mut self.lists), self.camera.camera(), imaged, key, &self.windows);
        if let Some(fault) = fault {
            frame.add_glare(fault, imaged);
        }
        self.scores.clear();
        for window in &self.windows {
            frame.crop(*window, &mut self.crop);
            if let Some(fault) = fault {
                fault.apply(&mut self.crop, self.camera.camera().resolution);
            }
            self.scores.push(self.classifier.classify(&self.crop)?);
        }
        self.lists = frame.into_buffers();
        for (index, window) in &self.due {
            let image_scores = self.scores[*window];
            memory.store(&detections[*index], image_scores);
            detections[*index].class = fuse(&detections[*index].class, &image_scores);
        }
        Ok(self.windows.len())
    }
}

impl RearCamera {
    /// Returns the window of the image that the network classifies for a detection. Returns `None`
    /// if too little of the window lies in the image.
    pub fn detection_window(&self, ego: &SceneVehicle, detection: &Detection) -> Option<PixelRect> {
        let image = self.camera().resolution;
        self.project(ego, &ground_box(detection)).filter(|window| window.share_in_image(image) >= MIN_SHARE_IN_IMAGE)
    }
}

/// How well a camera sees an object. The greater of two views is the better one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct View {
    /// Whether the whole window is in the image.
    is_whole: bool,
    /// Number of pixels of the window in the image.
    pixels: u64,
}

/// Returns the number of that camera which sees a detection best: it shows the whole window, or no
/// camera does, and its window has the most pixels. A part of a vehicle can look like a vehicle of
/// another class, and more pixels show more of the vehicle. Of equal cameras it is the first.
/// Returns `None` if no camera shows enough of the window to classify it.
pub fn best_camera<'a>(
    cameras: impl IntoIterator<Item = (usize, &'a RearCamera)>,
    ego: &SceneVehicle,
    detection: &Detection,
) -> Option<usize> {
    let mut best: Option<(usize, View)> = None;
    for (number, camera) in cameras {
        let view = camera.detection_window(ego, detection).map(|window| View::of(window, camera));
        if let Some(view) = view.filter(|view| best.is_none_or(|(_, other)| *view > other)) {
            best = Some((number, view));
        }
    }
    best.map(|(number, _)| number)
}

impl View {
    fn of(window: PixelRect, camera: &RearCamera) -> Self {
        let share = window.share_in_image(camera.camera().resolution);
        let area = f64::from(window.width) * f64::from(window.height);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of some million pixels")]
        let pixels = (share * area).round() as u64;
        Self { is_whole: share >= 1.0, pixels }
    }
}

/// Returns the box of a detection, which stands on the ground.
pub(super) fn ground_box(detection: &Detection) -> GroundBox {
    let (x_m, y_m) = detection.centre_m();
    GroundBox {
        x_m,
        y_m,
        heading_rad: detection.heading_rad,
        length_m: detection.length_m,
        width_m: detection.width_m,
        height_m: detection.top_m.max(MIN_HEIGHT_M),
    }
}

/// Returns true if a detection lies entirely beside the road.
pub fn is_beside_road(detection: &Detection, lane: &LaneGeometry) -> bool {
    let left_m = detection.face_y_m - lane.path_y_m(detection.face_x_m);
    let half_m = 0.5 * detection.width_m;
    left_m - half_m > lane.edges_m[0] || left_m + half_m < lane.edges_m[1]
}

/// Fuses the scores from shape and image by their normalised product, which assumes that their
/// errors are independent and that all classes are equally likely a priori.
pub fn fuse(shape: &ClassScores, image: &ClassScores) -> ClassScores {
    let product = [0, 1, 2, 3].map(|class| shape.0[class].max(MIN_SCORE) * image.0[class].max(MIN_SCORE));
    let sum: f64 = product.iter().sum();
    ClassScores(product.map(|score| score / sum))
}

#[cfg(test)]
mod tests {
    use closecall_traffic::{Check, Environment, Num, Parameters, Road, Time, Vehicle, VehicleClass, VehicleState};

    use super::*;
    use crate::camera::{CameraConfig, ResolutionConfig};
    use crate::tracking::{Extent, SeenBy, SeenPart};

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
            seen_by: SeenBy::Lidar,
            points: 50,
            is_centred: false,
            seen: SeenPart::FACE,
            class: ClassScores::UNKNOWN,
        }
    }

    fn classify(others: &[SceneVehicle], detections: &mut [Detection]) -> usize {
        classify_by(&CameraConfig::default(), others, detections)
    }

    fn classify_by(config: &CameraConfig, others: &[SceneVehicle], detections: &mut [Detection]) -> usize {
        let camera = config.check(&Parameters::default()).unwrap();
        let (road, environment, ego) = (Road::straight(3), Environment::CLEAR_DAY, vehicle(VehicleClass::Car, 500.0));
        let scene = Scene { time: Time::ZERO, road: &road, environment: &environment, ego, others };
        let mut pipeline = CropClassifier::new(camera, &Backend::Tract).unwrap();
        let seen = ImagedScene { now: &scene, imaged: &scene, fault: None };
        pipeline.classify_with(seen, ExposureKey(1), &mut ImageMemory::default(), detections).unwrap()
    }

    #[test]
    fn a_detection_beside_the_road_keeps_its_scores() {
        let mut detections = [detection(-40.0, 1.0, 0.8)];
        // The ego is 5.6 m to the right of the road's left edge.
        detections[0].face_y_m = 6.5;
        assert_eq!(classify(&[], &mut detections), 0);
        assert_eq!(detections[0].class, ClassScores::UNKNOWN);
        detections[0].face_y_m = 6.0;
        assert_eq!(classify(&[], &mut detections), 1);
    }

    #[test]
    fn each_vehicle_class_is_recognised_and_an_empty_road_is_background() {
        for class in VehicleClass::ALL {
            let other = vehicle(class, 460.0);
            let size = other.vehicle.dimensions;
            let mut detections = [detection(-40.0 + size.length_m / 2.0, size.width_m, size.height_m)];
            assert_eq!(classify(&[other], &mut detections), 1);
            assert!(detections[0].class.0[class as usize] > 0.8, "{class:?}: {:?}", detections[0].class);
        }
        let mut empty_road = [detection(-12.0, 1.0, 0.8)];
        classify(&[], &mut empty_road);
        assert!(empty_road[0].class.vehicle() < 0.2, "{:?}", empty_road[0].class);
    }

    #[test]
    fn equal_detections_of_a_scan_share_one_crop() {
        let other = vehicle(VehicleClass::Truck, 460.0);
        let at = |face_x_m: f64| detection(face_x_m, other.vehicle.dimensions.width_m, 3.0);
        let (mut alone, mut many) = ([at(-36.0)], vec![at(-36.0); 256]);
        many.insert(100, at(-20.0));
        assert_eq!(classify(&[other], &mut alone), 1);
        assert_eq!(classify(&[other], &mut many), 2, "each crop costs a run of the network");
        assert!(many.iter().all(|seen| seen.class == alone[0].class || seen.face_x_m == -20.0));
        assert_ne!(many[100].class, alone[0].class);
    }

    #[test]
    fn a_detection_out_of_view_keeps_its_scores() {
        let mut detections = [detection(30.0, 1.8, 1.5)];
        assert_eq!(classify(&[], &mut detections), 0);
        assert_eq!(detections[0].class, ClassScores::UNKNOWN);
    }

    #[test]
    fn a_vehicle_that_leaves_the_image_of_a_turned_camera_is_not_classified() {
        // The ego's left is at positive y. The image ends 30° from the axis.
        let (behind, on_the_left) = ((-41.0, 0.0), (-9.0, 3.7));
        let count = |yaw_deg: f64, (face_x_m, face_y_m): (f64, f64)| {
            let config = CameraConfig { yaw_deg: Num::Fixed(yaw_deg), ..CameraConfig::default() };
            let mut detections = [Detection { face_y_m, ..detection(face_x_m, 1.8, 1.5) }];
            let count = classify_by(&config, &[], &mut detections);
            assert_eq!(detections[0].class == ClassScores::UNKNOWN, count == 0);
            count
        };
        assert_eq!([-40.0, -20.0, 0.0, 20.0, 40.0].map(|yaw_deg| count(yaw_deg, behind)), [0, 1, 1, 1, 0]);
        assert_eq!([-30.0, 30.0, 45.0].map(|yaw_deg| count(yaw_deg, on_the_left)), [0, 1, 1]);
    }

    #[test]
    fn an_image_with_few_rows_ends_above_a_near_vehicle() {
        // The road 2.3 m behind the lens lies 580 px below the middle of the image.
        let count = |height_px: u64| {
            let resolution = ResolutionConfig { height_px, ..ResolutionConfig::default() };
            let config = CameraConfig { resolution, ..CameraConfig::default() };
            classify_by(&config, &[], &mut [detection(-4.0, 1.8, 1.0)])
        };
        assert_eq!([count(1_600), count(480)], [1, 0]);
    }

    #[test]
    fn neither_shape_nor_image_alone_rules_out_a_class() {
        let car = ClassScores::certain(VehicleClass::Car);
        let truck = ClassScores::certain(VehicleClass::Truck);
        let scores = fuse(&car, &truck).0;
        assert!((scores[0] - scores[1]).abs() < 1e-12 && scores[0] > 0.4);
        assert!((scores.iter().sum::<f64>() - 1.0).abs() < 1e-12);
    }
}
