//! Results that are computed from many runs and judged by none: the cause of a collision, and the
//! performance of the sensors.
//!
//! ```text
//!  failing sample ─▶ attribution   which vehicle closed the gap, in which phase, how it was avoidable
//!                 ─▶ explain       the first stage of the chain whose perfection prevents the failure
//!                 ─▶ minimize      the smallest failing case near it, and the nearest case that passes
//!  grid           ─▶ map           the margin that is reached, in theory and in the loop
//!  campaign       ─▶ cost          what the system costs where nothing happens
//!                 ─▶ engagement    why the system does not engage
//!  recordings     ─▶ exposure      how often the encounter happens on a road: the net effect per 10⁶ km
//!  two campaigns  ─▶ fidelity      rates of the full chain, sharpened by runs with fast sensors
//!  crash records  ─▶ anchor        whether emergency braking does in simulation what it does on the road
//!  cases          ─▶ perception    where perception ends, how it errs, and what spoils it
//! ```
//!
//! Stages and minimized cases rest on runs that can be repeated: each is a run of the same sample
//! with settings, as `--set` applies them. Avoidability is computed: from the recorded motion, with
//! another way of braking, and by a run with another driver as the ego.

pub mod anchor;
pub mod attribution;
pub mod case;
pub mod cost;
pub mod engagement;
pub mod explain;
pub mod exposure;
pub mod failures;
pub mod fidelity;
pub mod map;
pub mod minimize;
pub mod perception;

pub use case::CausesError;
