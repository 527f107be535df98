//! What a sensor reports of another vehicle.

use nalgebra::{Matrix4, Vector4};
use serde::{Deserialize, Serialize};

use crate::{Time, VehicleClass};

/// The number of a track, unique within a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct TrackId(pub u32);

/// The sensor, or the set of sensors, that a track comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Source {
    /// The radar that looks ahead.
    Front,
    /// The short-range sensors to both sides.
    Surround,
    /// The sensors that look back: LiDAR and camera.
    Rear,
}

/// How well established a track is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TrackStatus {
    /// Seen too seldom to act on.
    Tentative,
    /// Established, and measured in the latest scan.
    Confirmed,
    /// Established, but predicted since it was last measured.
    Coasting,
}

/// Probabilities of [car, truck, motorcycle, background], adding up to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClassScores(pub [f64; 4]);

impl ClassScores {
    /// Nothing known: all equal.
    pub const UNKNOWN: Self = Self([0.25; 4]);

    /// Full certainty of one class.
    pub fn certain(class: VehicleClass) -> Self {
        let mut scores = [0.0; 4];
        scores[class as usize] = 1.0;
        Self(scores)
    }

    /// Probability that this is a vehicle of any class.
    pub fn vehicle(&self) -> f64 {
        1.0 - self.0[3]
    }

    /// The most probable vehicle class, whatever the background's score.
    pub fn best_vehicle_class(&self) -> VehicleClass {
        let mut best = VehicleClass::Car;
        for class in VehicleClass::ALL {
            if self.0[class as usize] > self.0[best as usize] {
                best = class;
            }
        }
        best
    }
}

/// Another vehicle as E perceives it, in E's vehicle frame at `time`.
#[derive(Clone, Debug, PartialEq)]
pub struct Track {
    /// Its number; kept while the track lives.
    pub id: TrackId,
    /// Where it comes from.
    pub source: Source,
    /// How well established it is.
    pub status: TrackStatus,
    /// The time that the state holds for.
    pub time: Time,
    /// [x, y, vx, vy] of the box's centre [m, m, m/s, m/s]; velocity over ground in E's axes.
    pub state: Vector4<f64>,
    /// Covariance of `state`.
    pub covariance: Matrix4<f64>,
    /// Heading relative to E's [rad].
    pub heading_rad: f64,
    /// Length of the box [m].
    pub length_m: f64,
    /// Width of the box [m].
    pub width_m: f64,
    /// What it is.
    pub class: ClassScores,
    /// Probability that there is anything at all [1].
    pub existence: f64,
    /// Probability that it is in the lane left of E's, in E's own, right of E's [1].
    pub lane: [f64; 3],
}

impl Track {
    /// Position ahead of E, negative behind [m].
    pub fn x_m(&self) -> f64 {
        self.state[0]
    }

    /// Position to the left of E [m].
    pub fn y_m(&self) -> f64 {
        self.state[1]
    }

    /// Speed over ground along E's axis [m/s].
    pub fn vx_mps(&self) -> f64 {
        self.state[2]
    }

    /// Speed over ground to E's left [m/s].
    pub fn vy_mps(&self) -> f64 {
        self.state[3]
    }
}
