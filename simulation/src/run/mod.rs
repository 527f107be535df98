//! The closed loop of one run.
//!
//! ```text
//!        ┌────────────────────────────── 100 Hz ──────────────────────────────┐
//!        ▼                                                                    │
//!  state at t ─▶ human drivers ──────────────────────────────▶ actions ─▶ world ─▶ state at t + dt
//!        └─(25 Hz)─▶ sensors ─▶ tracks ─▶ ego controller ─▶ command ┘
//! ```
//!
//! Drivers, sensors and the ego controller read the state at t; then all vehicles move to t + dt.

mod arm;
mod auditor;
mod closed_loop;
mod computing_time;
mod cost;
mod delayed_truth;
mod ego_input;
mod equipment;
mod error;
mod events;
mod humans;
mod margins;
mod mis_log;
mod moments;
mod observer;
mod phase;
mod promise;
mod settling;
mod start;
mod state;
mod stepper;
mod suppressed;

pub use arm::{Arm, ControllerFactory};
pub use auditor::TrackAuditor;
pub use closecall_scenarios::RunKey;
pub use closed_loop::simulate;
pub(crate) use computing_time::ComputingTime;
pub use error::SampleError;
pub use observer::{CurrentMargins, Lead, NoObserver, Observer, RunEvent, SettlingView, StepView};
pub use stepper::Stepper;
