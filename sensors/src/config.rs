//! The `[sensors]` table of a scenario file: the perception mode and the parameters of each sensor
//! model.

use crate::tracking::MAX_LATENCY_STEPS as MAX_TRACKER_LATENCY_STEPS;
use closecall_traffic::{Check, Choice, ConfigError, Num, Parameters, Problem, Range};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::camera::{Camera, CameraConfig, Pipeline, RearCamera, Sun};
use crate::detection_classifier::DetectionClassifier;
use crate::external::{
    BUILT_IN, DEFAULT_IMAGE_STEP, DEFAULT_PROGRAM_MEMORY_MIB, DEFAULT_PROGRAM_TIMEOUT_MS, OutsideCamera,
    PerceptionProgram, ProgramChecks, ProgramSettings, check_program,
};
use crate::faults::{ActingSensors, Faults, OdometryErrors, StatedFault};
use crate::image_detector::ImageDetector;
use crate::lidar::{ClusteringCheck, ClusteringMethod, ClusteringModel, FRONT_NAME, Lidar, LidarConfig, REAR_NAME};
use crate::sensor_name::{check_further, same_name};
use crate::several_cameras::{CameraMember, MAX_ADDITIONAL_CAMERAS, SeveralCameras};
use crate::worker_classifier::WorkerClassifier;
use crate::{
    Alterations, FittedErrors, FullModel, FullPerception, GroundTruth, MAX_ADDITIONAL_LIDARS, NoiseKey,
    ObjectPerception, ObjectSensorConfig, ObjectSensorModel, Perception, RearFit, RearRadarConfig, SensorError,
    TrackerConfig,
};

/// Default number of core points of DBSCAN, as `ClusteredPoints::CORE_POINTS`.
const DEFAULT_CORE_POINTS: u8 = 3;

/// Least height of the LiDAR above the road with the errors of its mounting (m).
const MIN_LIDAR_HEIGHT_M: f64 = 0.1;

/// Level of detail at which the sensors are simulated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SensorMode {
    /// LiDAR point clouds behind the ego, clustered, classified and tracked; object-level sensors
    /// ahead and to the sides. This is the chain that is judged.
    #[default]
    Full,
    /// Object-level sensors in all directions: the fast approximation, for sweeps.
    Object,
    /// Tracks without errors, taken from the true state: the ideal.
    GroundTruth,
}

impl SensorMode {
    /// Returns the name in scenario files, on the command line and in manifests.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Full => "full",
            Self::Object => "object",
            Self::GroundTruth => "ground-truth",
        }
    }
}

/// The sensors as a scenario file describes them. Every key is optional.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, default)]
pub struct SensorsConfig {
    /// Level of detail at which the sensors are simulated; `full` by default.
    pub mode: Choice<SensorMode>,
    /// The implementation of DBSCAN that clusters the points of all LiDARs; `linfa` by default.
    /// The clusters are the same.
    #[serde(skip_serializing_if = "is_default_method")]
    pub clustering: Choice<ClusteringMethod>,
    /// Factor of the radii of DBSCAN, 0.4 to 2.5. With 1 they are 0.8 m along and 0.5 m across the
    /// road at the sensor, and 2.3 m and 1 m at 100 m. Default: 1.
    #[serde(skip_serializing_if = "is_one")]
    pub cluster_radius: Num,
    /// Number of points within the radius, the point itself included, that make a core point of
    /// DBSCAN: 2 to 20. Default: 3.
    #[serde(skip_serializing_if = "is_default_core_points")]
    pub cluster_core_points: u8,
    /// What processes the scans of the rear LiDARs in mode `full`: `built-in` by default, or a program
    /// that answers detections or tracks, `exec:COMMAND` or the shared library `lib:PATH`. The file
    /// then runs a program: read a file of somebody else before you run it.
    #[serde(skip_serializing_if = "is_built_in")]
    pub perception: String,
    /// Time limit of each answer of that program (ms). The first answer may take 10 s. Default: 1000.
    #[serde(skip_serializing_if = "is_default_timeout")]
    pub perception_timeout_ms: u64,
    /// Memory limit of that program and its descendants (MiB). Default: 1024.
    #[serde(skip_serializing_if = "is_default_memory")]
    pub perception_memory_mib: u64,
    /// Images of each rear camera that the program gets per second (Hz): 0 to 25. An image comes with
    /// the first scan that is due. Default: 0, none.
    #[serde(skip_serializing_if = "is_none")]
    pub perception_image_hz: Num,
    /// Distance of the columns and rows of the camera's image that such an image has (px): 1 to 8.
    /// Default: 2, 640 × 400 of 1280 × 800 pixels.
    #[serde(skip_serializing_if = "is_default_step")]
    pub perception_image_step: u8,
    /// The radar that looks ahead.
    pub front_radar: ObjectSensorConfig,
    /// The short-range sensors around the ego.
    pub surround: ObjectSensorConfig,
    /// The object-level sensor that replaces the rear LiDAR and camera in mode `object`.
    pub rear_object: ObjectSensorConfig,
    /// The rear LiDAR.
    pub rear_lidar: LidarConfig,
    /// Further rear LiDARs, at most three, each with a name, a kind and a mounting of its own: mode
    /// `full`. The tracker is corrected with the boxes of all. Default: none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub additional_rear_lidars: Vec<LidarConfig>,
    /// The LiDAR that looks ahead in place of the radar, in mode `full`. `fault.front-lidar` gives
    /// its faults. Default: none; the radar looks ahead.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub front_lidar: Option<LidarConfig>,
    /// The pair of radars in the rear corners, which measures the speeds of the tracks besides the
    /// rear LiDARs, in mode `full`. `fault.rear-radar` gives its faults. Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rear_radar: Option<RearRadarConfig>,
    /// The rear camera, whose network classifies each cluster of the rear LiDAR.
    pub rear_camera: CameraConfig,
    /// Further rear cameras, at most three, each with a name, a mounting, a lens, a size and a
    /// network of its own: mode `full`. The camera that sees a cluster best classifies it. `sun` and
    /// `night-sky` are keys of the first camera only. Default: none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub additional_rear_cameras: Vec<CameraConfig>,
    /// The tracker that processes the boxes of the rear LiDAR.
    pub tracker: TrackerConfig,
}

fn is_none(rate: &Num) -> bool {
    *rate == Num::Fixed(0.0)
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde passes a reference")]
fn is_default_step(step: &u8) -> bool {
    *step == DEFAULT_IMAGE_STEP
}

fn is_one(factor: &Num) -> bool {
    *factor == Num::Fixed(1.0)
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde passes a reference")]
fn is_default_core_points(points: &u8) -> bool {
    *points == DEFAULT_CORE_POINTS
}

fn is_built_in(perception: &str) -> bool {
    perception == BUILT_IN
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde passes a reference")]
fn is_default_timeout(timeout_ms: &u64) -> bool {
    *timeout_ms == DEFAULT_PROGRAM_TIMEOUT_MS
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde passes a reference")]
fn is_default_memory(memory_mib: &u64) -> bool {
    *memory_mib == DEFAULT_PROGRAM_MEMORY_MIB
}

fn is_default_method(method: &Choice<ClusteringMethod>) -> bool {
    *method == Choice::Fixed(ClusteringMethod::default())
}

impl Default for SensorsConfig {
    fn default() -> Self {
        Self {
            mode: Choice::Fixed(SensorMode::default()),
            clustering: Choice::Fixed(ClusteringMethod::default()),
            cluster_radius: Num::Fixed(1.0),
            cluster_core_points: DEFAULT_CORE_POINTS,
            perception: BUILT_IN.to_owned(),
            perception_timeout_ms: DEFAULT_PROGRAM_TIMEOUT_MS,
            perception_memory_mib: DEFAULT_PROGRAM_MEMORY_MIB,
            perception_image_hz: Num::Fixed(0.0),
            perception_image_step: DEFAULT_IMAGE_STEP,
            front_radar: ObjectSensorConfig::default(),
            surround: ObjectSensorConfig::default(),
            rear_object: ObjectSensorConfig::default(),
            rear_lidar: LidarConfig::default(),
            additional_rear_lidars: Vec::new(),
            front_lidar: None,
            rear_radar: None,
            rear_camera: CameraConfig::default(),
            additional_rear_cameras: Vec::new(),
            tracker: TrackerConfig::default(),
        }
    }
}

/// The checked sensor configuration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sensors {
    mode: SensorMode,
    full: FullModel,
    camera: Camera,
    additional_cameras: [Option<Camera>; MAX_ADDITIONAL_CAMERAS],
    rear_object: ObjectSensorModel,
    altered: Alterations,
    has_rear: bool,
    program: Option<ProgramSettings>,
    /// Number of the draw of the noise behind; 0 for the draw of all runs.
    rear_draw: u32,
}

impl Check for SensorsConfig {
    type Checked = Sensors;

    fn check(&self, parameters: &Parameters) -> Result<Sensors, ConfigError> {
        let within = |key: &'static str| move |error: ConfigError| error.within(key);
        let rear_lidar = self.rear_lidar.check_named(Some(REAR_NAME), parameters).map_err(within("rear-lidar"))?;
        let front_lidar = match &self.front_lidar {
            Some(lidar) => Some(lidar.check_named(Some(FRONT_NAME), parameters).map_err(within("front-lidar"))?),
            None => None,
        };
        let additional_rear_lidars = self.check_additional([Some(rear_lidar), front_lidar], parameters)?;
        let camera = self.rear_camera.check(parameters).map_err(within("rear-camera"))?;
        let additional_cameras = check_further(
            ("additional-rear-cameras", "at most 3"),
            &self.additional_rear_cameras,
            vec![camera.name],
            |further| further.check_further(&camera, parameters),
        )?;
        let rear_radar = match &self.rear_radar {
            Some(radar) => Some(radar.check(parameters).map_err(within("rear-radar"))?),
            None => None,
        };
        let core_points = usize::from(self.cluster_core_points);
        if !ClusteringModel::CORE_POINTS.contains(&core_points) {
            let problem = Problem::WrongCount { value: core_points as u64, allowed: "a number from 2 to 20" };
            return Err(ConfigError::new("cluster-core-points", problem));
        }
        let clustering = ClusteringModel {
            method: parameters.word(&self.clustering, "clustering")?,
            radius: parameters.number(&self.cluster_radius, "cluster-radius", ClusteringModel::RADII)?,
            core_points,
        };
        let sensors = Sensors {
            mode: parameters.word(&self.mode, "mode")?,
            full: FullModel {
                front_radar: self.front_radar.check_front_radar(parameters).map_err(within("front-radar"))?,
                surround: self.surround.check_surround(parameters).map_err(within("surround"))?,
                rear_lidar,
                rear_radar,
                additional_rear_lidars,
                front_lidar,
                tracker: self.tracker.check(parameters).map_err(within("tracker"))?,
            },
            camera,
            additional_cameras,
            rear_object: self.rear_object.check_rear_object(parameters).map_err(within("rear-object"))?,
            altered: Alterations::default(),
            has_rear: true,
            program: self.check_program(parameters)?,
            rear_draw: 0,
        };
        sensors.check_program_in_mode()?;
        Ok(sensors.with_lidars(|lidar| Lidar { clustering, ..lidar }))
    }
}

impl SensorsConfig {
    fn check_program(&self, parameters: &Parameters) -> Result<Option<ProgramSettings>, ConfigError> {
        let image_hz = &self.perception_image_hz;
        check_program(&ProgramChecks {
            perception: &self.perception,
            timeout_ms: self.perception_timeout_ms,
            memory_mib: self.perception_memory_mib,
            image_hz: parameters.number(image_hz, "perception-image-hz", Range::closed(0.0, 25.0))?,
            image_step: self.perception_image_step,
        })
    }

    /// Checks the further rear LiDARs, whose names must differ from the names of the `configured`
    /// LiDARs.
    fn check_additional(
        &self,
        configured: [Option<Lidar>; 2],
        parameters: &Parameters,
    ) -> Result<[Option<Lidar>; MAX_ADDITIONAL_LIDARS], ConfigError> {
        let names: Vec<&'static str> = configured.iter().flatten().map(Lidar::name).collect();
        if let [rear, front] = names[..]
            && rear == front
        {
            return Err(same_name::<Lidar>(rear).within("front-lidar"));
        }
        let list = ("additional-rear-lidars", "at most 3");
        check_further(list, &self.additional_rear_lidars, names, |lidar| lidar.check_named(None, parameters))
    }

    /// Returns the rear cameras, the first one first.
    pub fn rear_cameras(&self) -> impl Iterator<Item = &CameraConfig> {
        std::iter::once(&self.rear_camera).chain(&self.additional_rear_cameras)
    }
}

impl Sensors {
    /// Returns the level of detail at which the sensors are simulated.
    pub fn mode(&self) -> SensorMode {
        self.mode
    }

    /// Returns the program that perceives in place of the built-in chain, if there is one.
    pub fn program(&self) -> Option<ProgramSettings> {
        self.program
    }

    /// Returns the program that a run starts: there is none if the sensors that look back are not
    /// simulated, or if an intervention replaces their boxes by the truth.
    pub fn running_program(&self) -> Option<ProgramSettings> {
        let is_asked = self.mode == SensorMode::Full && self.has_rear && !self.altered.has_true_clusters;
        self.program.filter(|_| is_asked)
    }

    /// Returns the same sensors, whose program runs in the folder.
    #[must_use]
    pub fn with_program_in(self, folder: &str) -> Self {
        Self { program: self.program.map(|program| program.in_folder(folder)), ..self }
    }

    /// Refuses a program in a mode in which it is not asked: the runs would pass for runs with it.
    ///
    /// # Errors
    /// [`ConfigError`] at `perception`.
    pub fn check_program_in_mode(&self) -> Result<(), ConfigError> {
        if self.program.is_none() || self.mode == SensorMode::Full {
            return Ok(());
        }
        let rule = "a program perceives in mode `full` only, in which there are scans".to_owned();
        Err(ConfigError::new("perception", Problem::Contradiction { other: "mode", rule }))
    }

    /// Returns the model of the first rear camera, which exists in every mode.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Returns the models of all rear cameras, the first one first.
    pub fn rear_cameras(&self) -> impl Iterator<Item = &Camera> {
        std::iter::once(&self.camera).chain(self.additional_cameras.iter().flatten())
    }

    /// Returns the models of mode [`SensorMode::Full`], which exist in every mode.
    pub fn full_model(&self) -> FullModel {
        self.full
    }

    /// Returns the model of the object-level sensor behind, which exists in every mode.
    pub fn rear_object(&self) -> &ObjectSensorModel {
        &self.rear_object
    }

    /// Returns the same sensors in another mode, such as one given on the command line.
    #[must_use]
    pub fn with_mode(self, mode: SensorMode) -> Self {
        Self { mode, ..self }
    }

    /// Returns the same sensors with other LiDARs.
    fn with_lidars(self, change: impl Fn(Lidar) -> Lidar) -> Self {
        let FullModel { front_lidar, rear_lidar, additional_rear_lidars, .. } = self.full;
        let full = FullModel {
            front_lidar: front_lidar.map(&change),
            rear_lidar: change(rear_lidar),
            additional_rear_lidars: additional_rear_lidars.map(|lidar| lidar.map(&change)),
            ..self.full
        };
        Self { full, ..self }
    }

    /// Returns the same sensors whose LiDARs cluster each scan a second time, by the
    /// other implementation. A run ends with [`SensorError::Clusterings`] if a label differs.
    #[must_use]
    pub fn with_clustering_check(self, check: ClusteringCheck) -> Self {
        self.with_lidars(|lidar| Lidar { clustering_check: Some(check), ..lidar })
    }

    /// Returns the same sensors with stages that are replaced by the truth, or made worse.
    #[must_use]
    pub fn altered(self, altered: Alterations) -> Self {
        let FullModel { front_radar, front_lidar, surround, rear_lidar, additional_rear_lidars, tracker, .. } =
            self.full;
        let exact = |lidar: Lidar| if altered.has_true_points { lidar.exact() } else { lidar };
        let full = FullModel {
            front_radar: front_radar.altered(&altered, false),
            front_lidar,
            surround: surround.altered(&altered, false),
            rear_lidar: exact(rear_lidar),
            additional_rear_lidars: additional_rear_lidars.map(|lidar| lidar.map(exact)),
            tracker: tracker
                .with_latency_steps(altered.latency_steps(tracker.latency_steps(), MAX_TRACKER_LATENCY_STEPS)),
            ..self.full
        };
        Self { full, rear_object: self.rear_object.altered(&altered, true), altered, ..self }
    }

    /// Returns the same sensors without the sensors that look back, in mode [`SensorMode::Full`]:
    /// for a controller that does not use them. In the other modes they cost next to nothing, and
    /// stay.
    #[must_use]
    pub fn without_rear(self) -> Self {
        Self { has_rear: false, ..self }
    }

    /// Returns the injected faults.
    pub fn faults(&self) -> &Faults {
        &self.altered.faults
    }

    /// Returns the injected faults of those sensors that exist in the mode, in words.
    pub fn stated_faults(&self) -> Vec<StatedFault> {
        self.faults().stated(ActingSensors {
            is_full: self.mode == SensorMode::Full,
            has_front_lidar: self.mode == SensorMode::Full && self.full.front_lidar.is_some(),
            has_rear_radar: self.full.rear_radar.is_some(),
            has_models: self.mode != SensorMode::GroundTruth,
        })
    }

    /// Returns the same sensors with these faults in place of their own.
    #[must_use]
    pub fn with_faults(self, faults: Faults) -> Self {
        Self { altered: Alterations { faults, ..self.altered }, ..self }
    }

    /// Returns the same sensors under a sun at another place.
    #[must_use]
    pub fn with_sun(self, sun: Sun) -> Self {
        let under_sun = |camera: Camera| Camera { sun, ..camera };
        let additional_cameras = self.additional_cameras.map(|camera| camera.map(under_sun));
        Self { camera: under_sun(self.camera), additional_cameras, ..self }
    }

    /// Checks that no fault puts a LiDAR lower than the model covers.
    ///
    /// # Errors
    /// [`ConfigError`] at the `mount-height-m` of the LiDAR.
    pub fn check_mounting(&self) -> Result<(), ConfigError> {
        let Faults { rear_lidar, front_lidar, .. } = self.faults();
        let front = self.full.front_lidar.map(|lidar| (lidar, front_lidar, "front-lidar", "fault.front-lidar"));
        let rear = self.full.rear_lidars().map(|lidar| (lidar, rear_lidar, "rear-lidar", "fault.rear-lidar"));
        for (index, (lidar, faults, key, other)) in rear.chain(front).enumerate() {
            let faults = faults.of_sensor(lidar.name());
            let lowest_m = faults.combinations().map(|(_, fault)| fault.height_m).fold(0.0, f64::min);
            if !(lidar.mount_height_m + lowest_m >= MIN_LIDAR_HEIGHT_M) {
                let rule =
                    format!("a fault of the mounting leaves the LiDAR at least {MIN_LIDAR_HEIGHT_M} m above the road");
                let problem = Problem::Contradiction { other, rule };
                let error = ConfigError::new("mount-height-m", problem);
                return Err(match index.checked_sub(1).filter(|_| key == "rear-lidar") {
                    Some(further) => error.within_index(further).within("additional-rear-lidars"),
                    None => error.within(key),
                });
            }
        }
        Ok(())
    }

    /// Returns the same sensors with an object-level sensor behind that has one range for all
    /// vehicles, and knows their classes up to `class_range_m` (m): the fit to the full chain uses
    /// this sensor.
    #[must_use]
    pub fn without_range_fit(self, class_range_m: f64) -> Self {
        Self { rear_object: self.rear_object.without_fit(class_range_m), ..self }
    }

    /// Returns the same sensors with an object-level sensor behind that has these errors for all
    /// vehicles.
    #[must_use]
    pub fn with_rear_errors(self, errors: FittedErrors) -> Self {
        Self { rear_object: self.rear_object.with_errors(errors), ..self }
    }

    /// Returns the same sensors with an object-level sensor behind that has another fit than that
    /// which ships.
    #[must_use]
    pub fn with_rear_fit(self, fit: &'static RearFit) -> Self {
        Self { rear_object: self.rear_object.with_fit(fit), ..self }
    }

    /// Returns the same sensors with another draw of the noise of the sensors behind: the full chain
    /// beside itself shows how well any model of it can agree.
    #[must_use]
    pub fn with_rear_draw(self, number: u32) -> Self {
        Self { rear_draw: number, ..self }
    }

    /// Returns the errors of the ego's odometry and map.
    pub fn odometry_errors(&self) -> OdometryErrors {
        self.altered.faults.odometry
    }

    /// Returns the latencies of the sensors ahead, around and behind, in control steps.
    pub fn latency_steps(&self) -> [usize; 3] {
        let rear = match self.mode {
            SensorMode::Full => self.full.tracker.latency_steps(),
            SensorMode::Object => self.rear_object.latency_steps(),
            SensorMode::GroundTruth => return [0; 3],
        };
        let front = match (self.mode, self.full.front_lidar) {
            (SensorMode::Full, Some(_)) => rear,
            _ => self.full.front_radar.latency_steps(),
        };
        [front, self.full.surround.latency_steps(), rear]
    }

    /// Returns the cameras of one run with their networks, if any has one.
    fn cameras(&self, key: &NoiseKey) -> Option<Box<dyn DetectionClassifier>> {
        let faults = &self.altered.faults.rear_camera;
        let member = |(number, camera): (usize, &Camera)| {
            let faults = faults.of_sensor(camera.name);
            let classifier: Box<dyn DetectionClassifier> = match camera.pipeline {
                Pipeline::Off => return None,
                Pipeline::MaskRcnn => Box::new(ImageDetector::new(number, *camera, key, faults)),
                Pipeline::CropClassifier => Box::new(WorkerClassifier::new(number, *camera, key, faults)),
            };
            Some(CameraMember { camera: RearCamera::new(*camera), faults, classifier })
        };
        let mut members: Vec<CameraMember> = self.rear_cameras().enumerate().filter_map(member).collect();
        match members.len() {
            0 | 1 => members.pop().map(|only| only.classifier),
            _ => Some(Box::new(SeveralCameras::new(members))),
        }
    }

    /// Returns the cameras of one run whose images a program gets.
    fn outside_cameras(&self, key: &NoiseKey) -> Vec<OutsideCamera> {
        let faults = &self.altered.faults.rear_camera;
        let images = self.program.and_then(|program| program.images).into_iter();
        let cameras = images.flat_map(|images| self.rear_cameras().enumerate().map(move |camera| (images, camera)));
        let outside = |(images, camera): (_, (usize, &Camera))| {
            OutsideCamera::new(camera, images, key, faults.of_sensor(camera.1.name))
        };
        cameras.map(outside).collect()
    }

    /// Builds the perception of one run, whose random streams are keyed by `key`.
    ///
    /// # Errors
    /// Returns [`SensorError`] if a model cannot be set up.
    pub fn build(&self, key: &NoiseKey) -> Result<Box<dyn Perception>, SensorError> {
        match self.running_program() {
            None => self.build_with(key, None),
            // The built-in chain would pass for the program.
            Some(program) => Err(SensorError::Program {
                program: program.name(),
                reason: "only a run starts a program".to_owned(),
                is_late: false,
                time: None,
            }),
        }
    }

    /// Does the same as [`Self::build`] with the program that [`Self::running_program`] names.
    ///
    /// # Errors
    /// Returns [`SensorError`] if a model cannot be set up.
    pub fn build_with(
        &self,
        key: &NoiseKey,
        program: Option<Box<dyn PerceptionProgram>>,
    ) -> Result<Box<dyn Perception>, SensorError> {
        Ok(match self.mode {
            SensorMode::GroundTruth => Box::new(GroundTruth::new()),
            SensorMode::Object => {
                let models = [self.full.front_radar, self.full.surround, self.rear_object];
                Box::new(ObjectPerception::new(models, key).with_faults(&self.altered.faults))
            }
            SensorMode::Full => {
                let rear_key = &key.redrawn(self.rear_draw);
                let perception = FullPerception::with_keys(&self.full, [key, rear_key])
                    .altered(self.altered)
                    .with_faults(&self.altered.faults);
                if !self.has_rear {
                    return Ok(Box::new(perception.without_rear()));
                }
                let perception = perception.with_program(program, self.outside_cameras(rear_key));
                match self.altered.classifier().or_else(|| self.cameras(rear_key)) {
                    Some(classifier) => Box::new(perception.with_classifier(classifier)),
                    None => Box::new(perception),
                }
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(text: &str) -> Result<Sensors, ConfigError> {
        toml::from_str::<SensorsConfig>(text).expect("well-formed").check(&Parameters::default())
    }

    #[test]
    fn an_empty_table_gives_the_default() {
        assert_eq!(check("").unwrap(), SensorsConfig::default().check(&Parameters::default()).unwrap());
        assert_eq!(check("mode = \"ground-truth\"").unwrap().mode(), SensorMode::GroundTruth);
    }

    #[test]
    fn errors_name_the_key() {
        let error = check("rear-object = { range-m = -1.0 }").unwrap_err().to_string();
        assert_eq!(error, "`rear-object.range-m` is -1, but a number above 0 and up to 500 is needed");
        let error = check("front-radar = { confirm-hits = 4, confirm-window = 3 }").unwrap_err().to_string();
        assert_eq!(error, "`front-radar.confirm-hits` is 4, but a number from 1 to `confirm-window` is needed");
        let error = check("surround = { half-angle-deg = 30 }").unwrap_err().to_string();
        assert_eq!(error, "`surround.half-angle-deg` contradicts `surround`: the surround sensors look all round");
    }

    #[test]
    fn the_clustering_applies_to_all_lidars() {
        let method = |text: &str| -> Vec<ClusteringMethod> {
            let full = check(text).unwrap().full_model();
            full.rear_lidars().chain(full.front_lidar).map(|lidar| lidar.clustering.method).collect()
        };
        assert_eq!(method(""), [ClusteringMethod::Linfa]);
        let several = "clustering = \"grid\"\nfront-lidar = {}\nadditional-rear-lidars = [{ name = \"left\" }]";
        assert_eq!(method(several), [ClusteringMethod::Grid; 3]);
        assert!(toml::from_str::<SensorsConfig>("clustering = \"k-means\"").is_err());
        let model = |text: &str| check(text).unwrap().full_model().rear_lidar.clustering;
        assert_eq!(model(""), ClusteringModel::default());
        let other = model("cluster-radius = 1.5\ncluster-core-points = 2");
        assert_eq!((other.radius, other.core_points), (1.5, 2));
        let refused = |text: &str| check(text).unwrap_err().to_string();
        assert!(refused("cluster-core-points = 1").starts_with("`cluster-core-points` is 1, but"));
        assert!(refused("cluster-radius = 3").starts_with("`cluster-radius` is 3, but"));
    }

    #[test]
    fn there_is_no_rear_radar_unless_the_scenario_has_one() {
        let radar = |text: &str| check(text).unwrap().full_model().rear_radar;
        assert!(radar("").is_none() && radar("rear-radar = {}").is_some());
        let error = check("rear-radar = { yaw-deg = 90 }").unwrap_err().to_string();
        assert_eq!(error, "`rear-radar.yaw-deg` is 90, but a number from 0 to 80 is needed");
        assert!(!toml::to_string(&SensorsConfig::default()).unwrap().contains("rear-radar"));
    }

    #[test]
    fn unknown_keys_and_nan_are_rejected() {
        assert!(toml::from_str::<SensorsConfig>("rear-object = { rnage-m = 1.0 }").is_err());
        assert!(toml::from_str::<SensorsConfig>("rear-object = { range-m = nan }").is_err());
    }

    #[test]
    fn config_survives_a_round_trip_through_toml() {
        let config: SensorsConfig =
            toml::from_str("mode = \"object\"\nrear-object = { range-m = \"$range-m\" }").unwrap();
        let again: SensorsConfig = toml::from_str(&toml::to_string(&config).unwrap()).unwrap();
        assert_eq!(again, config);
    }

    #[test]
    fn several_rear_lidars_have_names_of_their_own() {
        let sensors = check("additional-rear-lidars = [{ name = \"left\", left-m = 0.8, azimuth-deg = 45 }]").unwrap();
        let names: Vec<&str> = sensors.full_model().rear_lidars().map(|lidar| lidar.name()).collect();
        assert_eq!(names, ["rear-lidar", "left"]);
        let error = |text: &str| check(text).unwrap_err().to_string();
        assert!(error("additional-rear-lidars = [{}]").contains("`additional-rear-lidars[0].name`"));
        for text in [
            "additional-rear-lidars = [{ name = \"rear-lidar\" }]",
            "additional-rear-lidars = [{ name = \"left\" }, { name = \"left\" }]",
            "rear-lidar.name = \"one\"\nfront-lidar.name = \"one\"",
        ] {
            assert!(error(text).contains("another LiDAR is called"), "{text}: {}", error(text));
        }
        assert!(error("rear-lidar.name = \"Left one\"").contains("`Left one` is no name"));
        let five = "{ name = \"a\" }, { name = \"b\" }, { name = \"c\" }, { name = \"d\" }";
        assert!(
            error(&format!("additional-rear-lidars = [{five}]")).contains("has 4 entries, but at most 3 are allowed")
        );
        assert!(error("additional-rear-lidars = [{ name = \"a\", azimuth-deg = 90 }]").contains("[0].azimuth-deg"));
    }

    #[test]
    fn several_rear_cameras_have_names_of_their_own_and_one_sky() {
        let sensors =
            check("rear-camera.sun.azimuth-rad = 3.1\nadditional-rear-cameras = [{ name = \"left\", yaw-deg = 30 }]");
        let cameras: Vec<Camera> = sensors.unwrap().rear_cameras().copied().collect();
        assert_eq!(cameras.iter().map(|camera| camera.name).collect::<Vec<_>>(), ["rear-camera", "left"]);
        assert_eq!((cameras[1].sun, cameras[0].yaw_rad), (cameras[0].sun, 0.0));
        let moved = Sun { azimuth_rad: 0.5, ..cameras[0].sun };
        assert!(
            check("additional-rear-cameras = [{ name = \"left\" }]")
                .unwrap()
                .with_sun(moved)
                .rear_cameras()
                .all(|camera| camera.sun == moved)
        );
        let error = |text: &str| check(text).unwrap_err().to_string();
        for (cameras, key, why) in [
            ("{}", "`additional-rear-cameras[0].name`", "each of several sensors needs a name"),
            (
                "{ name = \"rear-camera\" }",
                "`additional-rear-cameras[0].name`",
                "another camera is called `rear-camera`",
            ),
            ("{ name = \"a\" }, { name = \"a\" }", "`additional-rear-cameras[1].name`", "another camera is called `a`"),
            ("{ name = \"A b\" }", "`additional-rear-cameras[0].name`", "`A b` is no name"),
            (
                "{ name = \"a\" }, { name = \"b\" }, { name = \"c\" }, { name = \"d\" }",
                "`additional-rear-cameras` has 4 entries",
                "at most 3 are allowed",
            ),
            (
                "{ name = \"a\", resolution.width-px = 0 }",
                "`additional-rear-cameras[0].resolution.width-px` is 0",
                "640",
            ),
            ("{ name = \"a\", yaw-deg = 60 }", "`additional-rear-cameras[0].yaw-deg` is 60", "from -55 to 55"),
            ("{ name = \"a\", left-m = 2 }", "`additional-rear-cameras[0].left-m` is 2", "from -1.3 to 1.3"),
            ("{ name = \"a\", night-sky = 0.5 }", "`additional-rear-cameras[0].night-sky`", "the same sky"),
            ("{ name = \"a\", sun.azimuth-rad = 3.0 }", "`additional-rear-cameras[0].sun`", "`rear-camera.sun`"),
        ] {
            let message = error(&format!("additional-rear-cameras = [{cameras}]"));
            assert!(message.contains(key) && message.contains(why), "{cameras}: {message}");
        }
        let misspelt = toml::from_str::<SensorsConfig>("additional-rear-cameras = [{ name = \"a\", yaw-dg = 3 }]");
        assert!(misspelt.unwrap_err().to_string().contains("yaw-dg"));
        assert!(!toml::to_string(&SensorsConfig::default()).unwrap().contains("additional"));
    }

    #[test]
    fn further_cameras_change_nothing_at_object_level() {
        let sensors = |more: &str| check(&format!("mode = \"object\"\n{more}")).unwrap();
        let (usual, with_further) = (sensors(""), sensors("additional-rear-cameras = [{ name = \"left\" }]"));
        assert_eq!(
            (usual.full, usual.rear_object, usual.camera),
            (with_further.full, with_further.rear_object, with_further.camera)
        );
        assert_eq!(usual.latency_steps(), with_further.latency_steps());
    }
}
