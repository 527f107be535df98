//! The faults of the object-level sensors as a scenario file describes them.

use closecall_traffic::{CONTROL_STEP, ConfigError, Num, Parameters, Problem, Range};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::config::{MAX_DELAY_S, SHARE, either, without_effect};
use super::list::{Combine, FaultList, check_span};

/// A fault of an object-level sensor. It holds from `from-s` to `until-s`, with all effects that it names.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, default)]
pub struct ObjectFaultConfig {
    /// Time at which the fault begins (s). Default: before the start of the run.
    pub from_s: Option<Num>,
    /// Time at which the fault ends (s). Default: the end of the run.
    pub until_s: Option<Num>,
    /// The sensor delivers nothing.
    pub dead: bool,
    /// The sensor delivers its latest tracks again and again, with new time stamps.
    pub frozen: bool,
    /// Share of the measurements of visible vehicles that are lost (-), in addition to the sensor's own `dropout`. Default: 0.
    pub dropout: Option<Num>,
    /// Additional latency (s). No sensor is later than 0.4 s.
    pub delay_s: Option<Num>,
    /// Distance of a track without a vehicle, in the ego's lane, when the fault begins (m): ahead of the ego for the front
    /// radar, behind it for the other sensors.
    pub ghost_gap_m: Option<Num>,
    /// Speed at which that track approaches the ego (m/s). Default: 0.
    pub ghost_closing_mps: Option<Num>,
}

/// The effects of faults of an object-level sensor at one instant.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct ObjectFault {
    pub(crate) is_dead: bool,
    pub(crate) is_frozen: bool,
    pub(crate) dropout: f64,
    pub(crate) delay_s: f64,
    /// Gap of the ghost when its fault begins (m), and the speed at which the gap closes (m/s).
    pub(crate) ghost: Option<[f64; 2]>,
}

impl Combine for ObjectFault {
    fn and(self, other: Self) -> Self {
        Self {
            is_dead: self.is_dead || other.is_dead,
            is_frozen: self.is_frozen || other.is_frozen,
            dropout: either(self.dropout, other.dropout),
            delay_s: self.delay_s + other.delay_s,
            ghost: other.ghost.or(self.ghost),
        }
    }
}

impl ObjectFault {
    /// Returns the additional latency in control steps.
    pub(crate) fn delay_steps(&self) -> usize {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "checked to be at most some seconds"
        )]
        let steps = (self.delay_s / CONTROL_STEP.s()).round() as usize;
        steps
    }
}

impl ObjectFaultConfig {
    /// Checks the entries of one object-level sensor.
    pub(crate) fn check_all(
        key: &str,
        entries: &[Self],
        parameters: &Parameters,
    ) -> Result<FaultList<ObjectFault>, ConfigError> {
        FaultList::check(key, entries, |entry| entry.check(parameters))
    }

    fn check(&self, parameters: &Parameters) -> Result<(ObjectFault, [f64; 2]), ConfigError> {
        let number = |num: &Option<Num>, key, range| parameters.number_or(num.as_ref(), key, range, 0.0);
        let closing_mps = number(&self.ghost_closing_mps, "ghost-closing-mps", Range::closed(-30.0, 30.0))?;
        let ghost = match &self.ghost_gap_m {
            Some(gap) => Some([parameters.number(gap, "ghost-gap-m", Range::closed(0.0, 200.0))?, closing_mps]),
            None if self.ghost_closing_mps.is_some() => {
                let problem = Problem::Missing { needed: "the gap of the track that approaches" };
                return Err(ConfigError::new("ghost-gap-m", problem));
            }
            None => None,
        };
        let fault = ObjectFault {
            is_dead: self.dead,
            is_frozen: self.frozen,
            dropout: number(&self.dropout, "dropout", SHARE)?,
            delay_s: number(&self.delay_s, "delay-s", Range::closed(0.0, MAX_DELAY_S))?,
            ghost,
        };
        let named = [&self.dropout, &self.delay_s];
        if fault == ObjectFault::default() && named.into_iter().all(Option::is_none) {
            return Err(without_effect());
        }
        Ok((fault, check_span([&self.from_s, &self.until_s], parameters)?))
    }
}
