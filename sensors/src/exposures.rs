//! The exposures of the rear camera in one run: the keys of their noise, and the faults of the
//! camera.

use closecall_traffic::{Environment, Road, Stream, Time};

use crate::camera::{Camera, CameraFault, ExposureKey};
use crate::faults::{FaultList, NOTICED_AFTER_SCANS};
use crate::{Health, NoiseKey, Scene, SceneVehicle};

/// Name of the random stream of the first camera.
const CHANNEL: &str = "rear-camera";

/// Returns the random stream of the camera with this number in the scenario.
fn stream_of(key: &NoiseKey, (number, camera): (usize, &Camera)) -> Stream {
    match number {
        0 => key.stream(CHANNEL),
        _ => key.stream(&format!("{CHANNEL}/{}", camera.name)),
    }
}

/// Returns the noise keys of the exposures in one run, scan by scan, of the rear camera with this
/// number in the scenario.
///
/// With the key of an exposure, its image can be rendered again.
pub fn rear_exposures(key: &NoiseKey, camera: (usize, &Camera)) -> impl Iterator<Item = ExposureKey> + use<> {
    let mut exposures = stream_of(key, camera);
    std::iter::repeat_with(move || ExposureKey::draw(&mut exposures))
}

/// The exposures of one run.
pub(crate) struct Exposures {
    keys: Stream,
    faults: FaultList<CameraFault>,
    /// The latest image before the camera froze.
    held: Option<HeldImage>,
    /// Number of latest successive scans in which the camera delivered no image, or the same one
    /// again.
    failed_scans: u32,
}

/// The exposure of one scan.
#[derive(Clone, Copy)]
pub(crate) struct Exposure {
    /// The key of the noise in the image. A frozen camera repeats the key of the image that it
    /// holds.
    pub(crate) key: ExposureKey,
    /// The fault of the camera.
    pub(crate) fault: Option<CameraFault>,
}

impl Exposure {
    /// Returns true if the camera delivers no image.
    pub(crate) fn is_dead(&self) -> bool {
        self.fault.is_some_and(|fault| fault.is_dead)
    }
}

impl Exposures {
    /// Creates the exposures of the camera with this number, which has these faults. `key` is the key
    /// of its noise.
    pub(crate) fn new(camera: (usize, &Camera), key: &NoiseKey, faults: FaultList<CameraFault>) -> Self {
        Self { keys: stream_of(key, camera), faults, held: None, failed_scans: 0 }
    }

    /// Returns the exposure of a scan. Each scan draws a key, even if it needs no image: both arms
    /// of a pair then get the same exposures.
    pub(crate) fn next_exposure(&mut self, scene: &Scene<'_>) -> Exposure {
        let key = ExposureKey::draw(&mut self.keys);
        let fault = self.faults.at(scene.time);
        let (is_dead, is_frozen) = fault.map_or((false, false), |fault| (fault.is_dead, fault.is_frozen));
        self.failed_scans = if is_dead || is_frozen { self.failed_scans.saturating_add(1) } else { 0 };
        self.held = is_frozen.then(|| self.held.take().unwrap_or_else(|| HeldImage::of(scene, key)));
        Exposure { key: self.held.as_ref().map_or(key, |held| held.key), fault }
    }

    /// Returns the scene that the image of a scan shows: an earlier one if the camera is frozen.
    pub(crate) fn imaged<'a>(&'a self, scene: &Scene<'a>) -> Scene<'a> {
        self.held.as_ref().map_or(*scene, HeldImage::scene)
    }

    /// Returns whether the camera works, as the ego notices it.
    pub(crate) fn health(&self) -> Health {
        if self.failed_scans >= NOTICED_AFTER_SCANS { Health::Failed } else { Health::Ok }
    }
}

/// The scene of an image, and the key of its noise.
struct HeldImage {
    time: Time,
    environment: Environment,
    road: Road,
    ego: SceneVehicle,
    others: Vec<SceneVehicle>,
    key: ExposureKey,
}

impl HeldImage {
    fn of(scene: &Scene<'_>, key: ExposureKey) -> Self {
        let Scene { time, ego, .. } = *scene;
        Self {
            time,
            environment: *scene.environment,
            road: scene.road.clone(),
            ego,
            others: scene.others.to_vec(),
            key,
        }
    }

    fn scene(&self) -> Scene<'_> {
        Scene { time: self.time, road: &self.road, environment: &self.environment, ego: self.ego, others: &self.others }
    }
}
