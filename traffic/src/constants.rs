//! Physical constants, the time steps of a run, and the paper's limits of an encounter, for all
//! crates.

use crate::Time;

/// Standard acceleration of gravity (m/s²), rounded from 9.80665 (3rd General Conference on Weights
/// and Measures, 1901).
pub const GRAVITY_MPS2: f64 = 9.81;

/// Time step of the physics and of the human drivers: 100 Hz.
pub const PHYSICS_STEP: Time = Time::from_ms(10);

/// Time step of the sensors and of the ego controller: 25 Hz, the scan rate of the Valeo SCALA Gen
/// 2.
///
/// It is a multiple of [`PHYSICS_STEP`].
pub const CONTROL_STEP: Time = Time::from_ms(40);

/// Largest rear gap at which the margin increase system engages, and at which an encounter begins
/// (m); from the paper.
pub const ENGAGEMENT_GAP_M: f64 = 100.0;

/// Smallest closing speed of a rear vehicle at which the margin increase system engages, and from
/// which it counts as approaching (m/s): 10 km/h; from the paper.
pub const ENGAGEMENT_CLOSING_MPS: f64 = 10.0 / 3.6;

/// Largest jerk that the actuators of any vehicle cause, as a magnitude (m/s³): an assumption for a
/// car; 20 to 60 are plausible.
pub const LARGEST_JERK_MPS3: f64 = 40.0;
