//! The pipeline `mask-rcnn` in the simulation loop: images at a fixed rate, whose results arrive
//! later.
//!
//! ```text
//!   scan k:      detections ─▶ linked to the objects of the scan before
//!   image due:   exposure ─▶ instances ─▶ associated with the detections of *this* scan ─┐
//!                                                                                        │ latency
//!   scan k + n:  evidence of each object ◀───────────────────────────────────────────────┘
//! ```
//!
//! The evidence of an object remains until the next image gives new evidence. Each worker thread
//! keeps one network, as for the crop classifier.

use std::cell::RefCell;
use std::collections::VecDeque;

use crate::camera::{Camera, CameraFault, WholeImageDetector, fuse};
use closecall_traffic::Time;

use crate::detection_classifier::DetectionClassifier;
use crate::exposures::{Exposure, Exposures};
use crate::faults::FaultList;
use crate::image_evidence::{Evidence, Exposed, ImageResult, associate, moved};
use crate::several_cameras::MAX_CAMERAS;
use crate::worker_classifier::inference_backend;
use crate::{Detection, Extent, Health, NoiseKey, RearImage, Scene, SensorError};

/// Distance along and across the ego's axis by which an object may move between two scans that
/// detect it (m), as in the memory of the crop classifier: a closing speed of 50 m/s over one
/// control step, and a lane change over two.
const GATE_M: [f64; 2] = [2.0, 1.0];
/// Time after which an object that was not detected is forgotten.
const KEPT_FOR: Time = Time::from_ms(200);

thread_local! {
    /// The thread's networks, in the order of the scenario's cameras, each with the camera that it
    /// was built for.
    static NETWORKS: RefCell<[Option<(Camera, WholeImageDetector)>; MAX_CAMERAS]> =
        const { RefCell::new([const { None }; MAX_CAMERAS]) };
}

/// An object that the LiDAR has detected in successive scans.
#[derive(Clone, Copy, Debug)]
struct KnownObject {
    id: u64,
    face_m: [f64; 2],
    seen_at: Time,
    evidence: Option<Evidence>,
}

/// An image whose result has not arrived.
#[derive(Debug)]
struct Pending {
    due: Time,
    exposed: Exposed,
    /// The objects of the detections with which the instances were associated.
    ids: Vec<u64>,
    result: ImageResult,
}

/// The camera of one run with the Mask R-CNN of its thread.
pub(crate) struct ImageDetector {
    /// Number of the camera in the scenario.
    number: usize,
    camera: Camera,
    exposures: Exposures,
    next_image: Option<Time>,
    next_id: u64,
    objects: Vec<KnownObject>,
    pending: VecDeque<Pending>,
    /// Vehicles that only the camera sees, in the image whose result arrived with the latest scan.
    alone: Vec<Detection>,
    /// The object of each detection of the latest scan.
    ids: Vec<u64>,
    /// Whether a detection of the latest scan has been linked to each object of the earlier scans.
    is_taken: Vec<bool>,
    /// The latest image with its instances.
    latest: Option<RearImage>,
}

impl ImageDetector {
    /// Creates the camera of one run with its number in the scenario. `key` is the key of its noise.
    pub(crate) fn new(number: usize, camera: Camera, key: &NoiseKey, faults: FaultList<CameraFault>) -> Self {
        Self {
            number,
            camera,
            exposures: Exposures::new((number, &camera), key, faults),
            next_image: None,
            next_id: 0,
            objects: Vec::new(),
            pending: VecDeque::new(),
            alone: Vec::new(),
            ids: Vec::new(),
            is_taken: Vec::new(),
            latest: None,
        }
    }

    /// Links the detections of a scan to the known objects. A detection without such an object is a
    /// new object.
    fn link(&mut self, time: Time, detections: &[Detection]) {
        self.objects.retain(|object| time - object.seen_at <= KEPT_FOR);
        let before = self.objects.len();
        self.is_taken.clear();
        self.is_taken.resize(before, false);
        self.ids.clear();
        for detection in detections {
            let face_m = [detection.face_x_m, detection.face_y_m];
            let apart = |object: &KnownObject| [0, 1].map(|axis| (object.face_m[axis] - face_m[axis]).abs());
            let free = self.objects[..before].iter().enumerate().filter(|(index, _)| !self.is_taken[*index]);
            let near = free.filter(|(_, object)| apart(object).iter().zip(GATE_M).all(|(m, gate_m)| *m <= gate_m));
            let sum = |object: &KnownObject| apart(object).iter().sum::<f64>();
            let nearest = near.min_by(|a, b| sum(a.1).total_cmp(&sum(b.1))).map(|(index, _)| index);
            let index = nearest.unwrap_or_else(|| {
                self.objects.push(KnownObject { id: self.next_id, face_m, seen_at: time, evidence: None });
                self.next_id += 1;
                self.objects.len() - 1
            });
            if let Some(taken) = self.is_taken.get_mut(index) {
                *taken = true;
            }
            (self.objects[index].face_m, self.objects[index].seen_at) = (face_m, time);
            self.ids.push(self.objects[index].id);
        }
    }

    /// Takes an image and queues its result.
    fn expose(&mut self, scene: &Scene<'_>, exposure: Exposure, detections: &[Detection]) -> Result<(), SensorError> {
        let imaged = self.exposures.imaged(scene);
        let failed = |error: crate::camera::ClassifierError| SensorError::Classifier { reason: error.to_string() };
        let (result, instances) = NETWORKS.with_borrow_mut(|slots| {
            let slot = &mut slots[self.number];
            if slot.as_ref().is_none_or(|(camera, _)| *camera != self.camera) {
                *slot = Some((self.camera, WholeImageDetector::new(self.camera, inference_backend()).map_err(failed)?));
            }
            let Some((_, network)) = slot else { return Ok((ImageResult::default(), Vec::new())) };
            let instances = network.detect(&imaged, exposure.key, exposure.fault.as_ref()).map_err(failed)?;
            Ok((associate(network.camera(), scene, &instances, detections), instances))
        })?;
        self.latest =
            Some(RearImage { camera: self.camera.name, time: scene.time, shown_time: imaged.time, instances });
        let due = scene.time + seconds(self.camera.mask_rcnn.latency_s);
        let exposed = Exposed { time: scene.time, ego: scene.ego };
        self.pending.push_back(Pending { due, exposed, ids: self.ids.clone(), result });
        Ok(())
    }

    /// Gives the objects the evidence of the images whose results have arrived.
    fn receive(&mut self, scene: &Scene<'_>) {
        self.alone.clear();
        while let Some(pending) = self.pending.pop_front_if(|pending| pending.due <= scene.time) {
            for object in &mut self.objects {
                if let Some(place) = pending.ids.iter().position(|id| *id == object.id) {
                    object.evidence = pending.result.evidence[place];
                }
            }
            self.alone.clear();
            self.alone.extend(pending.result.alone.iter().map(|seen| moved(seen, &pending.exposed, scene)));
        }
    }
}

impl DetectionClassifier for ImageDetector {
    fn classify(&mut self, scene: &Scene<'_>, detections: &mut [Detection]) -> Result<(), SensorError> {
        let exposure = self.exposures.next_exposure(scene);
        self.link(scene.time, detections);
        let due = *self.next_image.get_or_insert(scene.time);
        if scene.time >= due {
            self.next_image = Some(due + seconds(self.camera.mask_rcnn.period_s));
            if !exposure.is_dead() {
                self.expose(scene, exposure, detections)?;
            }
        }
        self.receive(scene);
        for (detection, id) in detections.iter_mut().zip(&self.ids) {
            let object = self.objects.iter().find(|object| object.id == *id);
            let Some(evidence) = object.and_then(|object| object.evidence) else { continue };
            detection.class = fuse(&detection.class, &evidence.scores);
            if let (Extent::Assumed, Some(width_m)) = (detection.width, evidence.width_m) {
                (detection.width_m, detection.width) = (width_m, Extent::Seen);
            }
        }
        Ok(())
    }

    fn seen_alone(&self) -> &[Detection] {
        &self.alone
    }

    fn rear_images(&self) -> Vec<&RearImage> {
        self.latest.iter().collect()
    }

    fn health(&self) -> Health {
        self.exposures.health()
    }
}

/// Returns a time of so many seconds.
fn seconds(seconds: f64) -> Time {
    #[expect(clippy::cast_possible_truncation, reason = "checked to be 0 to 1 s")]
    Time::from_ns((seconds * 1e9).round() as i64)
}
