//! Monitors: how the ego notices faults of its sensors.
//!
//! ```text
//!  times of arrival, time stamps ─▶ transport ─┐
//!  returns of the road           ─▶ road      ─┼─▶ alarms ─▶ health, and its reason
//!  nothing new, range left       ─────────────┘
//! ```
//!
//! A monitor reads what a sensor delivers, and nothing else: neither the fault nor the true scene.
//! The road monitor compares the returns of single beams with the returns of a faultless sensor
//! above a level, dry road. Its bounds follow from a false-alarm probability of 10⁻⁹ per decision,
//! so that ten hours of driving have 0.002 false alarms.

mod alarms;
mod road;
mod transport;

pub use alarms::{Alarm, Alarms};
pub(crate) use road::{RoadBeam, RoadHeight, RoadMonitor};
pub(crate) use transport::{Arrival, TransportMonitor};
