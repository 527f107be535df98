//! Simulates one closed-loop run: a scenario, a seed and an arm (controller and sensors) go in, an
//! outcome comes out.
//!
//! ```text
//!  concrete scenario ─▶ [ world ─▶ sensors ─▶ tracks ─▶ command ─▶ world ]* ─▶ outcome
//! ```
//!
//! * [`controller`]: the controllers that can drive the ego vehicle, built in or as a separate
//!   process
//! * [`perception`]: a perception of the user's own, as a separate process
//! * [`run`](mod@run): the closed loop, and the observers of a run
//! * [`calibration`]: car-following models fitted to recorded pairs
//! * [`trajectories`]: simulated traffic as trajectory data
//!
//! The outcome depends on the scenario, the seed, the sample number and the arm only, down to the
//! last bit. This crate is the only user of rapier, in its module `world`.

pub mod calibration;
pub mod controller;
pub mod perception;
pub mod run;
pub mod trajectories;
mod world;

pub use closecall_traffic::CONTROL_STEP;
pub use run::{
    Arm, ControllerFactory, CurrentMargins, Lead, NoObserver, Observer, RunEvent, RunKey, SampleError, SettlingView,
    StepView, Stepper, TrackAuditor, simulate,
};
pub use world::Performance;
