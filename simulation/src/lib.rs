//! One run: a scenario, a seed and an arm go in, an outcome comes out.
//!
//! ```text
//!  scenario file ─▶ checked scenario ─▶ [ world ─▶ sensors ─▶ tracks ─▶ command ─▶ world ]* ─▶ outcome
//! ```
//!
//! * [`scenario`]: scenario files, checked into concrete scenarios
//! * [`controller`]: the controllers that can stand in the ego vehicle, built in or as a process of their own
//! * [`run`](mod@run): the closed loop, and those who watch it
//! * [`outcome`]: what a run ends in
//!
//! The outcome follows from the scenario, the seed, the sample and the arm alone, to the last bit. This crate is the only
//! one that names rapier, inside `world`.

pub mod controller;
pub mod criteria;
pub mod harm;
pub mod outcome;
pub mod run;
pub mod scenario;
mod world;

pub use run::{
    Arm, CONTROL_STEP, ControllerFactory, Happening, Lead, MarginsNow, NoObserver, Observer, PHYSICS_STEP, RunKey,
    SampleError, StepView, TrackAuditor, simulate,
};
