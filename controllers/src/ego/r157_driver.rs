//! The competent and careful human driver of UN Regulation 157 (performance model of Annex 4,
//! Appendix 3) as the ego.
//!
//! ```text
//!  risk ─▶ 0.75 s at 0.4 m/s² (accelerator released) ─▶ braking builds up at 12.65 m/s³ ─▶ 0.774 g, until the risk is over
//! ```
//!
//! The regulation describes a reaction ([`CarefulDriver`](crate::reference::CarefulDriver)), not a
//! way to follow. These choices are Closecall's own:
//!
//! - Without a risk, the driver follows by the law of [`Acc`](super::Acc), 2 s behind the lead
//!   vehicle: the gap from which the reference driver starts in JRC-FSM's comparison of following.
//! - There is a risk if the time to collision with the lead vehicle is at most 2 s (the model's
//!   criterion for a cut-in), or if the cruise control could not brake hard enough. The text of the
//!   regulation on decelerating lead vehicles was not at hand.
//! - The risk is over when the ego is no faster than the lead vehicle, and needs no braking.
//!
//! The driver sees the tracks of the ego's sensors, as every controller does. It has no emergency
//! braking system.

use closecall_traffic::Time;

use super::surroundings::LeadVehicleSelector;
use super::{ControllerError, EgoCommand, EgoController, EgoInput, EgoSettings, EgoStack, EgoState, Front, Reason};
use crate::reference::{BrakingReaction, CRITICAL_TTC_S};

/// Time gap at which the driver follows (s) (JRC-FSM).
const TIME_GAP_S: f64 = 2.0;

/// The reference driver as an ego controller.
#[derive(Clone, Debug)]
pub struct R157Driver {
    settings: EgoSettings,
    following: EgoStack,
    lead: LeadVehicleSelector,
    reaction: Option<BrakingReaction>,
    last_step: Option<Time>,
}

impl R157Driver {
    /// Returns the settings with which the driver follows, derived from the settings of a scenario.
    #[must_use]
    pub fn settings(settings: EgoSettings) -> EgoSettings {
        EgoSettings { aeb: None, ..settings.with_time_gap(TIME_GAP_S) }
    }

    /// Creates a driver for one run, with the settings of [`Self::settings`].
    pub fn new(settings: EgoSettings) -> Self {
        let following = EgoStack::new(settings);
        Self { settings, following, lead: LeadVehicleSelector::default(), reaction: None, last_step: None }
    }

    /// Returns true if there is a risk, as the documentation of the module defines it.
    fn is_at_risk(&self, speed_mps: f64, lead: &Front) -> bool {
        let closing_mps = speed_mps - lead.speed_mps;
        let required_mps2 = lead.required_braking_mps2(speed_mps, self.settings.acc.standstill_gap_m);
        match self.reaction {
            Some(_) => closing_mps > 0.0 || required_mps2 > 0.0,
            None => {
                lead.gap_m <= CRITICAL_TTC_S * closing_mps
                    || required_mps2 > self.settings.acc.max_braking_mps2(speed_mps)
            }
        }
    }
}

impl EgoController for R157Driver {
    fn step(&mut self, input: &EgoInput<'_>) -> Result<EgoCommand, ControllerError> {
        let mut command = self.following.step(input)?;
        let lead = self.lead.update(input);
        let step_s = self.last_step.map_or(0.0, |last| (input.time - last).s());
        self.last_step = Some(input.time);
        let speed_mps = input.odometry.speed_mps;
        if lead.is_some_and(|lead| self.is_at_risk(speed_mps, &lead)) {
            let braking_mps2 = self.reaction.get_or_insert_default().advance(step_s);
            command.acceleration_mps2 = command.acceleration_mps2.min(-braking_mps2);
            command.state = EgoState::EmergencyBraking;
            command.reason = Reason::BrakingRequired;
        } else if self.reaction.take().is_some() {
            command.reason = Reason::BrakingDone;
        }
        Ok(command)
    }
}
