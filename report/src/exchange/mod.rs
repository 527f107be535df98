//! Runs and scenarios in the formats of other tools.
//!
//! ```text
//!  one sample ─▶ run ─▶ Motion ─▶ open-loop.xosc    every vehicle exactly as it drove
//!            └─▶ values ────────▶ closed-loop.xosc  starts, manoeuvres with triggers, the ego left to a controller
//!  scenario ─▶ parameters ──────▶ logical.xosc      the same with parameters, beside value sets and distributions
//!            └─▶ Motion ────────▶ commonroad.xml    lanes, other vehicles, a planning problem for the ego
//!                                 road.xodr, catalogs/vehicles/VehicleCatalog.xosc
//! ```
//!
//! `osi` writes the run itself as ASAM Open Simulation Interface 3.8.
//!
//! The files follow ASAM OpenSCENARIO XML 1.3 and ASAM OpenDRIVE 1.8. The reference point of a
//! vehicle is the middle of its rear axle in OpenSCENARIO, and the centre of its box in Closecall.

mod case;
mod closed_loop;
mod commonroad;
mod distribution;
mod element;
mod environment;
mod expression;
mod motion;
mod open_loop;
mod osi;
mod road;
mod scenario;
mod trigger;
mod vehicles;

pub use case::{Case, CaseFiles, Form, write_case};
pub use motion::Motion;
pub use osi::OsiRecorder;
