//! The pair of radars in the rear corners of the ego: range, angle and *radial* speed of each
//! vehicle, with their errors.
//!
//! ```text
//!          ┌───────────┐
//!          │    ego    │                         axis: straight behind, turned outward by the yaw
//!          └▲─────────▲┘
//!     right │         │ left                     azimuth: 0 straight behind, positive to the ego's left
//!           ╲   ╲   ╱   ╱
//!            field of view
//! ```
//!
//! It is a model of a sensor's output, not of its signal:
//! - **Reflection.** A vehicle gives one detection, from the point of its outline that is nearest
//!   to the sensor. A vehicle that another one hides gives none. There is no height: nothing tells
//!   a vehicle from a bridge, and none is modelled.
//! - **Radial speed.** The sensor measures the rate of change of the range, (v − v₀)·e, with the
//!   velocities v of the vehicle and v₀ of the ego, and the direction e from the sensor to the
//!   point. Nothing tells the speed across the line of sight.
//! - **Rain** shortens the range (`rain.rs`). It adds no false alarms.
//! - **Ghosts.** A guard rail is a mirror. The detection of the mirror image has the range, the
//!   angle and the radial speed of an image that moves as the vehicle does, with its lateral speed
//!   reversed (Kraus et al. 2020, *Using machine learning to detect ghost images in automotive
//!   radar*, arXiv 2007.05280: such images are usual at flat surfaces).
//! - **Neglected** are the yaw rate of the ego times the lever arm of the sensor (0.1 m/s in a bend
//!   of 1000 m at 40 m/s), clutter, interference, and weather except rain.
//!
//! The radars start no tracks. They correct the speed of tracks that the LiDARs have
//! ([`crate::tracking::RadarScan`]).

mod config;
mod measure;
mod output;
mod rain;
mod sensor;

pub use config::{RearRadar, RearRadarConfig};
pub use output::{MountedRadars, RadarReturn, RadarSource};
pub(crate) use sensor::RearRadars;
