//! Simulated traffic as trajectory data: all vehicles seen from the road, or one vehicle's own log.

mod in_car;
mod recorder;
mod trace;

pub use in_car::{InCarRecorder, recorded_actor};
pub use recorder::{EndedAtCollisions, TrafficRecorder};
pub use trace::{TraceRecorder, TraceRow};
