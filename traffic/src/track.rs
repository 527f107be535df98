//! Tracks: the perceived states of other vehicles.

use nalgebra::{Matrix4, Vector4};
use serde::{Deserialize, Serialize};

use crate::{Time, VehicleClass};

/// The number of a track, unique within a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct TrackId(pub u32);

/// The sensor, or the group of sensors, that reports a track.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Source {
    /// The front radar.
    Front,
    /// The short-range sensors on both sides.
    Surround,
    /// The rear sensors: LiDAR and camera.
    Rear,
}

/// The maturity of a track.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TrackStatus {
    /// Detected too seldom to act on.
    Tentative,
    /// Confirmed, and detected in the latest scan.
    Confirmed,
    /// Confirmed, but not detected in the latest scan; the state is predicted.
    Coasting,
}

/// Probabilities of car, truck, motorcycle and background, in this order; they add up to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClassScores(pub [f64; 4]);

impl ClassScores {
    /// Index of the background's score; the scores of the vehicle classes have the numbers of
    /// [`VehicleClass`] as indices.
    pub const BACKGROUND: usize = VehicleClass::ALL.len();
    /// The scores if nothing is known: all equal.
    pub const UNKNOWN: Self = Self([0.25; 4]);

    /// Creates the scores of a class that is known for certain.
    pub fn certain(class: VehicleClass) -> Self {
        let mut scores = [0.0; 4];
        scores[class as usize] = 1.0;
        Self(scores)
    }

    /// Returns the probability that the object is a vehicle of any class.
    pub fn vehicle(&self) -> f64 {
        1.0 - self.0[Self::BACKGROUND]
    }

    /// Returns the most probable vehicle class, whatever the score of the background.
    pub fn best_vehicle_class(&self) -> VehicleClass {
        let mut best = VehicleClass::Car;
        for class in VehicleClass::ALL {
            if self.0[class as usize] > self.0[best as usize] {
                best = class;
            }
        }
        best
    }

    /// Returns whether the object is at least as likely a vehicle as not, and one vehicle class is
    /// more probable than the background. Equal scores carry no information, and do not count as a
    /// vehicle.
    pub fn is_vehicle(&self) -> bool {
        self.vehicle() >= 0.5 && self.0[self.best_vehicle_class() as usize] > self.0[Self::BACKGROUND]
    }
}

/// The perceived state of another vehicle, in the vehicle frame of the ego at `time`.
#[derive(Clone, Debug, PartialEq)]
pub struct Track {
    /// The number of the track, constant over its life.
    pub id: TrackId,
    /// The sensor, or group of sensors, that reports the track.
    pub source: Source,
    /// The maturity of the track.
    pub status: TrackStatus,
    /// The time at which the state holds.
    pub time: Time,
    /// `[x, y, vx, vy]` of the centre of the box (m, m, m/s, m/s); velocity over ground along the
    /// axes of the ego.
    pub state: Vector4<f64>,
    /// Covariance matrix of `state`.
    pub covariance: Matrix4<f64>,
    /// Heading relative to the ego's heading (rad).
    pub heading_rad: f64,
    /// Length of the box (m).
    pub length_m: f64,
    /// Width of the box (m).
    pub width_m: f64,
    /// Class probabilities.
    pub class: ClassScores,
    /// Probability that the track belongs to a real object.
    pub existence: f64,
    /// Probabilities of being in the lane left of the ego, in the lane of the ego, and in the lane
    /// right of it.
    pub lane: [f64; 3],
}

impl Track {
    /// Returns the longitudinal position relative to the ego (m): positive ahead, negative behind.
    pub fn x_m(&self) -> f64 {
        self.state[0]
    }

    /// Returns the lateral position relative to the ego (m), positive to the left.
    pub fn y_m(&self) -> f64 {
        self.state[1]
    }

    /// Returns the speed over ground along the longitudinal axis of the ego (m/s).
    pub fn vx_mps(&self) -> f64 {
        self.state[2]
    }

    /// Returns the speed over ground to the left of the ego (m/s).
    pub fn vy_mps(&self) -> f64 {
        self.state[3]
    }
}
