//! Several rear cameras, each with a picture and a network of its own.
//!
//! ```text
//!   detections ─▶ the camera that sees each best ─▶ its network ─▶ class scores of that detection
//! ```
//!
//! One camera classifies a detection, even if several see it: scores of two pictures of the same
//! moment would count as independent, and the shape, the light and the background are the same. A
//! camera that delivers no image, or is known to have failed, leaves its detections to the others.
//! A vehicle that no detection belongs to counts once, too, as the camera that sees it best finds it.

use crate::camera::{CameraFault, Pipeline, RearCamera, best_camera, overlap};
use crate::detection_classifier::DetectionClassifier;
use crate::faults::FaultList;
use crate::image_evidence::MIN_OVERLAP;
use crate::tracking::RearView;
use crate::{Detection, Health, RearImage, Scene, SceneVehicle, SensorError, joint_health};

/// Maximum number of rear cameras besides the first.
pub const MAX_ADDITIONAL_CAMERAS: usize = 3;
/// Maximum number of rear cameras.
pub(crate) const MAX_CAMERAS: usize = 1 + MAX_ADDITIONAL_CAMERAS;

/// One of the cameras with its network.
pub(crate) struct CameraMember {
    pub(crate) camera: RearCamera,
    pub(crate) faults: FaultList<CameraFault>,
    pub(crate) classifier: Box<dyn DetectionClassifier>,
}

impl CameraMember {
    fn is_whole_image(&self) -> bool {
        self.camera.camera().pipeline == Pipeline::MaskRcnn
    }

    /// Returns whether the camera delivers an image, and is not known to have failed.
    fn works(&self, scene: &Scene<'_>) -> bool {
        let is_dead = self.faults.at(scene.time).is_some_and(|fault| fault.is_dead);
        !is_dead && self.classifier.health() != Health::Failed
    }

    /// Returns whether two detections may be the same vehicle: the camera sees them in one place.
    fn sees_as_one(&self, ego: &SceneVehicle, detections: [&Detection; 2]) -> bool {
        let [one, other] = detections.map(|detection| self.camera.detection_bounds(ego, detection));
        one.zip(other).is_some_and(|(one, other)| overlap(&one, &other) >= MIN_OVERLAP)
    }
}

/// The cameras of one run.
pub(crate) struct SeveralCameras {
    members: Vec<CameraMember>,
    /// For each detection of the latest scan, the camera that classifies it.
    owners: Vec<Option<usize>>,
    /// The names of the cameras that did not work when the latest scan was classified.
    failed: Vec<&'static str>,
    /// The detections that a camera's network gets.
    given: Vec<Detection>,
    /// Vehicles that only cameras see.
    alone: Vec<Detection>,
}

impl SeveralCameras {
    /// Creates the cameras of one run.
    pub(crate) fn new(members: Vec<CameraMember>) -> Self {
        Self { members, owners: Vec::new(), failed: Vec::new(), given: Vec::new(), alone: Vec::new() }
    }

    /// Returns the number of the camera that sees a detection best: a working one if there is one.
    fn owner(&self, scene: &Scene<'_>, detection: &Detection) -> Option<usize> {
        let best = |is_asked: &dyn Fn(&CameraMember) -> bool| {
            let asked = self.members.iter().enumerate().filter(|(_, member)| is_asked(member));
            best_camera(asked.map(|(number, member)| (number, &member.camera)), &scene.ego, detection)
        };
        best(&|member| member.works(scene)).or_else(|| best(&|_| true))
    }

    /// Returns the vehicles that only cameras see. Of several working cameras that find the same
    /// vehicle at the same time, the camera that sees it best counts.
    fn find_alone(&self, scene: &Scene<'_>) -> Vec<Detection> {
        let mut found: Vec<(usize, &Detection)> = Vec::new();
        for (number, member) in self.members.iter().enumerate().filter(|(_, member)| member.works(scene)) {
            for seen in member.classifier.seen_alone() {
                let is_same = |(other, earlier): &&mut (usize, &Detection)| {
                    *other != number && member.sees_as_one(&scene.ego, [seen, earlier])
                };
                match found.iter_mut().find(is_same) {
                    None => found.push((number, seen)),
                    Some(earlier) => {
                        let cameras = [earlier.0, number].map(|number| (number, &self.members[number].camera));
                        if best_camera(cameras, &scene.ego, seen) == Some(number) {
                            *earlier = (number, seen);
                        }
                    }
                }
            }
        }
        found.into_iter().map(|(_, seen)| seen.clone()).collect()
    }
}

impl DetectionClassifier for SeveralCameras {
    fn classify(&mut self, scene: &Scene<'_>, detections: &mut [Detection]) -> Result<(), SensorError> {
        let failed = self.members.iter().filter(|member| !member.works(scene));
        self.failed = failed.map(|member| member.camera.camera().name).collect();
        self.owners = detections.iter().map(|detection| self.owner(scene, detection)).collect();
        for (number, member) in self.members.iter_mut().enumerate() {
            // A network that reads the whole image has to know what other detections hide.
            let (is_all, owners) = (member.is_whole_image(), &self.owners);
            let is_given = |at: usize| is_all || owners[at] == Some(number);
            self.given.clear();
            self.given
                .extend(detections.iter().enumerate().filter(|(at, _)| is_given(*at)).map(|(_, seen)| seen.clone()));
            member.classifier.classify(scene, &mut self.given)?;
            let slots = detections.iter_mut().enumerate().filter(|(at, _)| is_given(*at));
            for ((at, slot), classified) in slots.zip(&self.given) {
                if owners[at] == Some(number) {
                    slot.clone_from(classified);
                }
            }
        }
        self.alone = self.find_alone(scene);
        Ok(())
    }

    fn seen_alone(&self) -> &[Detection] {
        &self.alone
    }

    fn rear_images(&self) -> Vec<&RearImage> {
        self.members.iter().flat_map(|member| member.classifier.rear_images()).collect()
    }

    fn failed_cameras(&self) -> &[&'static str] {
        &self.failed
    }

    fn health(&self) -> Health {
        let view = |member: &CameraMember| {
            let camera = member.camera.camera();
            RearView {
                half_angle_tan: closecall_traffic::maths::tan(0.5 * camera.field_of_view_rad),
                range_m: f64::INFINITY,
                sensor_x_m: camera.mount_from_rear_m,
                sensor_y_m: camera.left_m,
                axis_azimuth_rad: camera.yaw_rad,
            }
        };
        joint_health::combined(&self.members, |member| member.classifier.health(), view)
    }
}
