//! Perception with single stages replaced by the truth, and with injected faults. It serves to find
//! the stage that causes a failure.

use closecall_traffic::{CONTROL_STEP, ClassScores};

use crate::detection_classifier::DetectionClassifier;
use crate::faults::Faults;
use crate::surroundings::{OtherVehicle, transform_scene};
use crate::{Detection, Extent, Scene, SeenPart, SensorError};

/// Distance by which a detection may lie outside of the box of its vehicle (m): an assumption, more
/// than the error of any box and less than the distance of two vehicles.
const MATCH_MARGIN_M: f64 = 1.0;

/// The scores of a detection that is certainly no vehicle.
pub(crate) const BACKGROUND: ClassScores = ClassScores([0.0, 0.0, 0.0, 1.0]);

/// What of the perception is replaced by the truth, or made worse. Nothing by default.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Alterations {
    /// The rear LiDAR measures every vehicle in its line of sight, without noise, losses or
    /// weather. Mode `full` only.
    pub has_true_points: bool,
    /// The points of each vehicle form one cluster. Its box is the vehicle's true box. Mode `full`
    /// only.
    pub has_true_clusters: bool,
    /// The class of each vehicle behind the ego is known.
    pub has_true_class: bool,
    /// No sensor and no tracker needs time.
    pub has_no_latency: bool,
    /// Additional latency of all sensors (s), an injected fault: it is rounded to the nearest
    /// control step of 0.04 s.
    pub extra_latency_s: f64,
    /// Every vehicle behind the ego is classified as background, an injected fault.
    pub is_class_background: bool,
    /// Injected faults of single sensors.
    pub faults: Faults,
}

impl Alterations {
    /// Returns the latency in control steps that becomes of `steps`, at most `max`.
    pub(crate) fn latency_steps(&self, steps: usize, max: usize) -> usize {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked to be 0 to 0.4 s")]
        let extra = (self.extra_latency_s / CONTROL_STEP.s()).round() as usize;
        if self.has_no_latency { 0 } else { (steps + extra).min(max) }
    }

    /// Returns a classifier in place of the camera's; `None` if the class is not altered.
    pub(crate) fn classifier(&self) -> Option<Box<dyn DetectionClassifier>> {
        let is_altered = self.has_true_class || self.is_class_background;
        is_altered.then(|| Box::new(GivenClass { is_true: self.has_true_class, others: Vec::new() }) as _)
    }
}

/// A classifier that gives every detection its true class, or the class background.
struct GivenClass {
    is_true: bool,
    others: Vec<OtherVehicle>,
}

impl DetectionClassifier for GivenClass {
    fn classify(&mut self, scene: &Scene<'_>, detections: &mut [Detection]) -> Result<(), SensorError> {
        transform_scene(scene, &mut self.others)?;
        for detection in detections {
            let vehicle = vehicle_of(detection, &self.others).filter(|_| self.is_true);
            detection.class = vehicle.map_or(BACKGROUND, |vehicle| ClassScores::certain(vehicle.class));
        }
        Ok(())
    }
}

/// Gives each detection of a vehicle the true box of that vehicle.
pub(crate) fn give_true_boxes(detections: &mut [Detection], others: &[OtherVehicle], scene: &Scene<'_>) {
    for detection in detections {
        let Some(other) = vehicle_of(detection, others) else { continue };
        let half_m = if other.x_m < 0.0 { 0.5 } else { -0.5 } * other.length_m;
        detection.time = scene.time;
        (detection.face_x_m, detection.face_y_m) = (other.x_m + half_m * other.cos, other.y_m + half_m * other.sin);
        (detection.heading_rad, detection.length_m, detection.width_m) =
            (other.heading_rad, other.length_m, other.width_m);
        (detection.length, detection.width) = (Extent::Seen, Extent::Seen);
        detection.seen = SeenPart::FACE;
    }
}

/// Returns the vehicle that the middle of the detection's face belongs to.
fn vehicle_of<'a>(detection: &Detection, others: &'a [OtherVehicle]) -> Option<&'a OtherVehicle> {
    others.iter().find(|other| {
        let (x_m, y_m) = (detection.face_x_m - other.x_m, detection.face_y_m - other.y_m);
        let (along_m, across_m) = (x_m * other.cos + y_m * other.sin, y_m * other.cos - x_m * other.sin);
        along_m.abs() <= 0.5 * other.length_m + MATCH_MARGIN_M && across_m.abs() <= 0.5 * other.width_m + MATCH_MARGIN_M
    })
}
