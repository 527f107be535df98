//! Ego controllers that are shared libraries (`lib:PATH`) or functional mock-up units (`fmu:PATH`).
//!
//! ```text
//!  EgoInput ─▶ Input ─▶ library: closecall_controller_step     ─▶ Answer ─▶ EgoCommand
//!                   └─▶ FMU: set inputs, doStep, get outputs ─┘
//! ```
//!
//! * [`Loaded`] is a library or an FMU that this process has loaded, and creates a controller for
//!   each run.
//! * [`NativeController`] adapts such a controller to the closed loop.
//! * [`bridge`] serves one as a process that speaks the protocol of external processes.
//! * [`watch`] ends a process whose controller does not answer.
//! * [`SharedLibrary`] and [`Arithmetic`] serve other interfaces of libraries, such as
//!   `controllers/include/closecall_perception.h`.
//!
//! The code of a library can do anything to the process that loads it. This module therefore runs
//! in worker processes, and the program that starts them learns of a crash from their end.
//!
//! `controllers/include/closecall_controller.h` is the interface of a library. The interface of an
//! FMU is the Functional Mock-up Interface for co-simulation, versions 2.0 and 3.0
//! (<https://fmi-standard.org>).

pub mod abi;
mod arithmetic;
pub mod bridge;
mod controller;
pub mod cost;
mod error;
mod exchange;
mod fmu;
mod foreign;
mod identity;
mod library;
mod loaded;
mod message;
mod platform;
mod shared;
pub mod watch;

pub use arithmetic::Arithmetic;
pub use controller::NativeController;
pub use error::LoadError;
pub use exchange::{Answer, Input, Setup};
pub use fmu::{Given, VariableTable};
pub use foreign::foreign_call;
pub use identity::Identity;
pub use loaded::{Kind, Loaded, Variables, remove_unpacked, unload_all, unpack_for_children, use_unpacked};
pub use message::{RoadMessage, StepMessage};
pub use shared::{SharedLibrary, text};
