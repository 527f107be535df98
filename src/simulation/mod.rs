//! The closed loop.
//!
//! ```text
//!        ┌────────────────────────────── 100 Hz ──────────────────────────────┐
//!        ▼                                                                    │
//!  state at t ─▶ human drivers ──────────────────────────────▶ actions ─▶ world ─▶ state at t + dt
//!        └─(25 Hz)─▶ sensors ─▶ tracks ─▶ ego controller ─▶ command ┘
//! ```
//!
//! All read the state at t, then all are moved to t + dt. What a run ends in follows from the scenario, the seed, the
//! sample and the arm alone, to the last bit.

mod auditor;
mod error;
mod events;
mod humans;
mod margins;
mod mis_log;
mod moments;
mod observer;
mod phase;
mod run;

use std::sync::Arc;

use closecall_controllers::{EgoController, EgoSettings};
use closecall_sensors::SensorMode;
use closecall_traffic::Time;

pub use auditor::TrackAuditor;
pub use error::SampleError;
pub use observer::{Happening, Lead, MarginsNow, NoObserver, Observer, StepView};

use crate::outcome::Outcome;
use crate::scenario::Scenario;
use run::Run;

/// Step of vehicles and human drivers: 100 Hz.
pub const PHYSICS_STEP: Time = Time::from_ms(10);
/// Step of sensors and ego controller: 25 Hz.
pub const CONTROL_STEP: Time = Time::from_ms(40);

/// Which of a scenario's samples is run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RunKey {
    /// The campaign's seed.
    pub seed: u64,
    /// The sample's number, from 0.
    pub sample: u64,
}

/// Makes the controller under test, one for each run.
pub trait ControllerFactory: Send + Sync {
    /// The name under which its outcomes are reported.
    fn name(&self) -> &str;
    /// True where the controller has a margin increase system to report on.
    fn has_mis(&self, settings: &EgoSettings) -> bool;
    /// A fresh controller with the scenario's settings.
    fn build(&self, settings: &EgoSettings) -> Box<dyn EgoController>;
}

/// One arm of a campaign: who controls E, and what it perceives with.
#[derive(Clone)]
pub struct Arm {
    /// The controller under test.
    pub controller: Arc<dyn ControllerFactory>,
    /// The sensors; the scenario's own where absent.
    pub sensors: Option<SensorMode>,
}

/// Runs one concrete scenario to its end.
///
/// # Errors
/// [`SampleError`] where a controller, a driver or a sensor failed: there is then no outcome, and no verdict on this
/// sample.
pub fn simulate(
    scenario: &Scenario,
    key: RunKey,
    arm: &Arm,
    observer: &mut dyn Observer,
) -> Result<Outcome, SampleError> {
    let mut run = Run::new(scenario, key, arm)?;
    loop {
        run.show_motion(observer);
        run.look_around(observer);
        if run.is_control_step() {
            run.perceive_and_control(observer)?;
        }
        if let Some(end) = run.end() {
            return Ok(run.finish(end));
        }
        run.drive(observer)?;
        run.advance(observer);
    }
}
