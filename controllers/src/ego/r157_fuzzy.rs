//! The fuzzy safety model of UN Regulation 157 as the ego.
//!
//! The ego follows by the law of [`Acc`](super::Acc) at the gap at which the model sees no risk,
//! and brakes when and as strongly as [`FuzzySafetyModel`] says. The delay of the model begins anew
//! with each risk. It has no emergency braking system, and sees the tracks of the ego's sensors, as
//! every controller does.

use closecall_traffic::Time;

use super::surroundings::LeadVehicleSelector;
use super::{ControllerError, EgoCommand, EgoController, EgoInput, EgoSettings, EgoStack, EgoState, Front, Reason};
use crate::reference::{Assessment, Conflict, FuzzySafetyModel, ReferenceModel};

/// The fuzzy safety model as an ego controller.
#[derive(Clone, Debug)]
pub struct R157Fuzzy {
    following: EgoStack,
    lead: LeadVehicleSelector,
    model: FuzzySafetyModel,
    was_at_risk: bool,
    last_step: Option<Time>,
}

impl R157Fuzzy {
    /// Creates the model for one run, with the settings of [`EgoSettings::with_fuzzy_safety`].
    pub fn new(settings: EgoSettings) -> Self {
        Self {
            following: EgoStack::new(settings),
            lead: LeadVehicleSelector::default(),
            model: FuzzySafetyModel::default(),
            was_at_risk: false,
            last_step: None,
        }
    }
}

/// Returns the lead vehicle as a conflict in the own lane.
fn conflict(input: &EgoInput<'_>, lead: &Front) -> Conflict {
    Conflict {
        gap_m: lead.gap_m,
        lateral_gap_m: -input.odometry.width_m,
        half_lengths_m: input.odometry.length_m,
        lateral_closing_mps: 0.0,
        speed_mps: input.odometry.speed_mps,
        other_speed_mps: lead.speed_mps,
        acceleration_mps2: input.odometry.acceleration_mps2,
    }
}

impl EgoController for R157Fuzzy {
    fn step(&mut self, input: &EgoInput<'_>) -> Result<EgoCommand, ControllerError> {
        let mut command = self.following.step(input)?;
        let lead = self.lead.update(input);
        let step_s = self.last_step.map_or(0.0, |last| (input.time - last).s());
        self.last_step = Some(input.time);
        let assessment = lead.map_or(Assessment::Clear, |lead| self.model.assess(&conflict(input, &lead), step_s));
        if let Assessment::Risk(braking_mps2) = assessment {
            if braking_mps2 > 0.0 {
                command.acceleration_mps2 = command.acceleration_mps2.min(-braking_mps2);
                command.state = EgoState::EmergencyBraking;
                command.reason = Reason::BrakingRequired;
            }
            self.was_at_risk = true;
        } else if self.was_at_risk {
            self.model = FuzzySafetyModel::default();
            self.was_at_risk = false;
            command.reason = Reason::BrakingDone;
        }
        Ok(command)
    }
}
