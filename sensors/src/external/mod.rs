//! A perception of the user's own in place of the built-in chain behind the rear LiDARs.
//!
//! ```text
//!                     ┌ detections ─▶ camera's classes ─▶ built-in tracker ─┐
//!  scans ─▶ program ──┤                                                     ├─▶ latency ─▶ tracks
//!                     └ tracks ─────────────────────────────────────────────┘
//! ```
//!
//! This crate asks the questions, and puts the answers in the place of boxes or tracks. How a
//! program is started and spoken to is behind [`PerceptionProgram`], which the simulation
//! implements.

mod answered;
mod image;
mod mount;
mod outside;
mod pose;
mod settings;

pub(crate) use image::OutsideCamera;
pub use image::{CameraMount, OutsideImage};
pub use mount::{LidarMount, RadarMount};
pub(crate) use outside::Outside;
pub use pose::Pose;
pub use settings::{
    BUILT_IN, DEFAULT_IMAGE_STEP, DEFAULT_PROGRAM_MEMORY_MIB, DEFAULT_PROGRAM_TIMEOUT_MS, ImageSettings, ProgramKind,
    ProgramSettings,
};
pub(crate) use settings::{ProgramChecks, check_program};

use closecall_traffic::{Dimensions, Road, Side, Time, Track, VehicleState};

use crate::lidar::LidarScan;
use crate::tracking::RadarDetection;
use crate::{Detection, SensorError};

/// A scan as a program gets it.
#[derive(Clone, Debug)]
pub struct OutsideScan {
    /// Name of the sensor.
    pub sensor: &'static str,
    /// Whether the sensor has a mirror with two sides, which deflect the scans in turn.
    pub has_mirror_sides: bool,
    /// The complete scan, with the points of the bare road.
    pub scan: LidarScan,
}

/// A scan of a rear radar as a program gets it.
#[derive(Clone, Debug, PartialEq)]
pub struct OutsideRadarScan {
    /// Side of the ego on which the radar is.
    pub side: Side,
    /// Time of the scan. A late scan is older than the question.
    pub time: Time,
    /// The detections, ghosts included: nothing tells them apart.
    pub detections: Vec<RadarDetection>,
}

/// What a program is asked in one control step.
#[derive(Clone, Copy, Debug)]
pub struct PerceptionQuestion<'a> {
    /// Time of the step: the end of its scans.
    pub time: Time,
    /// The scans that have arrived. None if all sensors whose scans were due are silent.
    pub scans: &'a [OutsideScan],
    /// The scans of the rear radars that have arrived since the last question, in the order of
    /// their times for each radar.
    pub radar_scans: &'a [OutsideRadarScan],
    /// The image of the first rear camera, if one is due and the program gets images.
    pub image: Option<&'a OutsideImage>,
    /// The images of the further rear cameras that are due.
    pub additional_images: &'a [OutsideImage],
    /// The first rear camera, if the program gets images.
    pub camera: Option<CameraMount>,
    /// The further rear cameras, if the program gets images.
    pub additional_cameras: &'a [CameraMount],
    /// The LiDARs that look back, in the order of the scenario.
    pub lidars: &'a [LidarMount],
    /// The rear radars: the left and the right one, or none.
    pub radars: &'a [RadarMount],
    /// The ego's motion and place on the road, as its odometry and its map give them.
    pub ego: VehicleState,
    /// The ego's place in a frame that does not move.
    pub pose: Pose,
    /// Size of the ego.
    pub size: Dimensions,
    /// The road, as the map shows it.
    pub road: &'a Road,
    /// Time from a scan to the tracks that a controller gets of it (s).
    pub latency_s: f64,
}

/// The answer of a program.
#[derive(Clone, Debug, PartialEq)]
pub enum PerceptionAnswer {
    /// Boxes for the built-in tracker.
    Detections(Vec<Detection>),
    /// Tracks at the time of the question, in the ego's frame at that time. Closecall gives them
    /// numbers of its own, and their probabilities of lanes.
    Tracks(Vec<Track>),
}

/// A program that perceives in place of the built-in chain. A run has one of its own.
pub trait PerceptionProgram: Send {
    /// Answers the question of one control step.
    ///
    /// # Errors
    /// [`SensorError::Program`] if there is no valid answer. The run then ends without an outcome.
    fn perceive(&mut self, question: &PerceptionQuestion<'_>) -> Result<PerceptionAnswer, SensorError>;

    /// Ends the program, and checks that it has left nothing over.
    ///
    /// # Errors
    /// [`SensorError::Program`] if it has written more than its answers.
    fn finish(&mut self, time: Time) -> Result<(), SensorError>;
}
