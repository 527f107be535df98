//! The step sizes of a run. The control step is an exact multiple of the physics step.

use closecall_traffic::Time;

/// Step of the vehicle dynamics and of the human drivers: 100 Hz.
pub const PHYSICS_STEP: Time = Time::from_ms(10);
/// Step of the sensors and of the ego controller: 25 Hz.
pub const CONTROL_STEP: Time = Time::from_ms(40);
