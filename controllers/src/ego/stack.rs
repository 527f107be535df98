//! Arbitration between ACC, MIS and AEB.
//!
//! | request of the MIS | command |
//! |---|---|
//! | follow | ACC, within its jerk limit |
//! | brake by a | the smaller of that and −a, which is approached within the jerk limits of the MIS |
//! | hold at a | −a, whatever the ACC requests; a is 0 from the critical gap on |
//! | release | ACC, its acceleration limited, and raised within the jerk limit for releasing the brake |
//!
//! Behind a braking lead vehicle the extended MIS brakes at once, by the constant braking that just
//! suffices, instead of using up the margin first; only holding has precedence. The braking builds
//! up as a human driver's does in an emergency (12.65 m/s³, UN Regulation 157). A slower build-up
//! must brake harder in the end, in front of a rear vehicle that has come nearer.
//!
//! While the rear vehicle would reach the ego within the holding time and can pull out, the
//! extended MIS defers all braking, as long as the assured braking still stops the ego behind the
//! lead vehicle. Emergency braking waits too. The margin is there for this moment: the rear vehicle
//! needs it to pull out.
//!
//! The result is the *comfort command*. Emergency braking overrides it if it requests more braking.
//! The jerk limits hold for the comfort command alone, and each step starts from the comfort
//! command of the step before: while emergency braking acts, the comfort command goes on beneath
//! it, and once emergency braking ends, the ego follows the comfort command at once. A ramp that
//! started from the command of emergency braking would keep the ego braking for seconds after the
//! lead vehicle has stopped braking. If a human drives, there is no comfort command: emergency
//! braking commands, and the loop lets the driver decide whenever emergency braking does not act.
//! After emergency braking the MIS takes no further speed while the gap to the lead vehicle does
//! not close.

use closecall_traffic::Time;

use super::mis::{BRAKE_RELEASE_JERK_MPS3, Mis, Request, Situation};
use super::surroundings::{Front, LeadVehicleSelector};
use super::{Acc, ControllerError, EgoCommand, EgoController, EgoInput, EgoSettings, EgoState, Reason};
use crate::driver::DEFAULT_BRAKE_BUILD_UP_MPS3;

/// Largest acceleration while the margin is returned (m/s²): an assumption, half of what the ACC
/// may use; plausible are 0.5 to 1.5.
const RELEASE_ACCELERATION_MPS2: f64 = 0.8;

/// Braking of the lead vehicle from which on it counts as braking (m/s²): an assumption, above the
/// ripple of its measured acceleration; 1 to 3 are plausible.
const LEAD_BRAKES_MPS2: f64 = 1.5;

/// Gap that early braking leaves behind a standing lead vehicle (m): an assumption, equal to the
/// gap of the emergency braking; 1 to 5 are plausible.
const STANDSTILL_GAP_M: f64 = 2.0;

/// The built-in ego stack.
#[derive(Clone, Debug)]
pub struct EgoStack {
    settings: EgoSettings,
    lead: LeadVehicleSelector,
    mis: Option<Mis>,
    emergency_braking: bool,
    /// Whether emergency braking has acted.
    has_braked: bool,
    /// Time and value (m/s²) of the last comfort command: the command without emergency braking.
    last_comfort: Option<(Time, f64)>,
}

impl EgoStack {
    /// Creates a stack for one run.
    pub fn new(settings: EgoSettings) -> Self {
        let mis = settings.mis.map(Mis::new);
        Self {
            settings,
            lead: LeadVehicleSelector::default(),
            mis,
            emergency_braking: false,
            has_braked: false,
            last_comfort: None,
        }
    }

    /// Creates a stack without the margin increase system for one run: the controller `acc`.
    pub fn without_mis(settings: EgoSettings) -> Self {
        Self::new(settings.without_mis())
    }

    /// Computes the command of ACC and MIS, with state, reason and plan.
    fn comfort_command(&mut self, input: &EgoInput<'_>, lead: Option<&Front>) -> EgoCommand {
        let speed_mps = input.odometry.speed_mps;
        if self.settings.driver().is_some() {
            // The driver decides between the control steps; the command repeats what the ego does.
            return EgoCommand {
                acceleration_mps2: input.odometry.acceleration_mps2,
                state: EgoState::Following,
                reason: Reason::NoMis,
                plan: None,
            };
        }
        let (last_mps2, step_s) =
            self.last_comfort.map_or((0.0, 0.0), |(time, last_mps2)| (last_mps2, (input.time - time).s()));
        let acc_mps2 = self.settings.acc.acceleration_mps2(speed_mps, input.road.speed_limit_mps(), lead);
        // Emergency braking ends a cruise control that does not look ahead: the driver takes over,
        // and does not accelerate.
        let is_over = self.has_braked && !self.settings.acc.looks_ahead();
        let acc_mps2 = if is_over { acc_mps2.min(0.0) } else { acc_mps2 };
        let acc_mps2 = Acc::limit_jerk_mps2(acc_mps2, last_mps2, speed_mps, step_s);
        let Some(mis) = &mut self.mis else {
            return EgoCommand {
                acceleration_mps2: acc_mps2,
                state: EgoState::Following,
                reason: Reason::NoMis,
                plan: None,
            };
        };
        let situation = Situation {
            input,
            lead,
            commanded_mps2: last_mps2,
            automated: self.settings.automated,
            acc_gap_m: self.settings.acc.desired_gap_m(speed_mps),
            emergency_braking: self.emergency_braking,
        };
        let decision = mis.step(&situation);
        let lowest = last_mps2 - mis.settings().max_jerk_mps3 * step_s;
        let highest = last_mps2 + BRAKE_RELEASE_JERK_MPS3 * step_s;
        let most_mps2 = match lead {
            Some(lead) if mis.settings().is_cautious && lead.acceleration_mps2 < -LEAD_BRAKES_MPS2 => {
                let at_once = last_mps2 - DEFAULT_BRAKE_BUILD_UP_MPS3 * step_s;
                (-lead.required_braking_mps2(speed_mps, STANDSTILL_GAP_M)).max(lowest.min(at_once))
            }
            _ => f64::INFINITY,
        };
        let acceleration_mps2 = match decision.request {
            Request::Follow => acc_mps2.min(most_mps2),
            Request::Brake(braking) => acc_mps2.min((-braking).max(lowest).min(highest)).min(most_mps2),
            Request::Hold => 0.0_f64.max(lowest).min(highest),
            Request::Release => acc_mps2.min(RELEASE_ACCELERATION_MPS2).min(highest).min(most_mps2),
        };
        EgoCommand { acceleration_mps2, state: decision.state, reason: decision.reason, plan: decision.plan }
    }
}

impl EgoController for EgoStack {
    fn step(&mut self, input: &EgoInput<'_>) -> Result<EgoCommand, ControllerError> {
        input.check_finite()?;
        let lead = self.lead.update(input);
        let mut command = self.comfort_command(input, lead.as_ref());
        self.last_comfort = Some((input.time, command.acceleration_mps2));
        let speed_mps = input.odometry.speed_mps;
        let braking =
            self.settings.aeb.and_then(|aeb| aeb.braking_mps2(self.emergency_braking, speed_mps, lead.as_ref()));
        let is_deferred = self.settings.automated
            && self.mis.as_ref().zip(lead.as_ref()).is_some_and(|(mis, lead)| mis.defers_braking(input, lead));
        let braking = braking.filter(|_| !is_deferred);
        if is_deferred {
            command.acceleration_mps2 = command.acceleration_mps2.max(0.0);
        }
        if let Some(braking) = braking {
            command.acceleration_mps2 = command.acceleration_mps2.min(-braking);
            command.state = EgoState::EmergencyBraking;
            command.reason = Reason::BrakingRequired;
        } else if self.emergency_braking {
            command.reason = Reason::BrakingDone;
        }
        self.emergency_braking = braking.is_some();
        self.has_braked |= self.emergency_braking;
        if !command.acceleration_mps2.is_finite() {
            return Err(ControllerError::NotFinite { quantity: "commanded acceleration", time: input.time });
        }
        Ok(command)
    }
}
