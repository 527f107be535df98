//! The one place where ACC, MIS and AEB are arbitrated.
//!
//! | MIS wishes | command |
//! |---|---|
//! | follow | ACC |
//! | brake by a | the smaller of ACC and −a, which is reached within the jerk limit |
//! | hold | the speed, whatever ACC wants |
//! | release | ACC, its acceleration bounded and raised within the jerk limit |
//!
//! Emergency braking overrides all of them where it asks for more braking.

use closecall_traffic::Time;

use super::mis::{LETTING_GO_MPS3, Mis, Situation, Wish};
use super::surroundings::{Front, FrontFollower};
use super::{ControllerError, EgoCommand, EgoController, EgoInput, EgoSettings, EgoState, Reason};

/// Acceleration with which the margin is given back [m/s²].
const GIVING_BACK_MPS2: f64 = 0.8;

/// The built-in ego stack.
#[derive(Clone, Debug)]
pub struct EgoStack {
    settings: EgoSettings,
    front: FrontFollower,
    mis: Option<Mis>,
    emergency: bool,
    last: Option<(Time, f64)>,
}

impl EgoStack {
    /// A stack for one run.
    pub fn new(settings: EgoSettings) -> Self {
        let mis = settings.mis.map(Mis::new);
        Self { settings, front: FrontFollower::default(), mis, emergency: false, last: None }
    }

    /// The same stack without the margin increase system, for one run: the controller `acc`.
    pub fn without_mis(settings: EgoSettings) -> Self {
        Self::new(settings.without_mis())
    }

    /// The command of ACC and MIS, the state, its reason and the plan.
    fn comfortable(&mut self, input: &EgoInput<'_>, front: Option<&Front>) -> EgoCommand {
        let speed_mps = input.odometry.speed_mps;
        let acc_mps2 = self.settings.acc.acceleration_mps2(speed_mps, input.road.speed_limit_mps(), front);
        let Some(mis) = &mut self.mis else {
            return EgoCommand {
                acceleration_mps2: acc_mps2,
                state: EgoState::Following,
                reason: Reason::NoMis,
                plan: None,
            };
        };
        let (last, step_s) = self.last.map_or((0.0, 0.0), |(time, last)| (last, (input.time - time).s()));
        let situation = Situation {
            input,
            front,
            asked_mps2: last,
            automated: self.settings.automated,
            acc_gap_m: self.settings.acc.wanted_gap_m(speed_mps),
        };
        let decision = mis.step(&situation);
        let lowest = last - mis.settings().max_jerk_mps3 * step_s;
        let highest = last + LETTING_GO_MPS3 * step_s;
        let acceleration_mps2 = match decision.wish {
            Wish::Follow => acc_mps2,
            Wish::Brake(braking) => acc_mps2.min((-braking).max(lowest).min(highest)),
            Wish::Hold => highest.min(0.0).max(lowest),
            Wish::Release => acc_mps2.min(GIVING_BACK_MPS2).min(highest),
        };
        EgoCommand { acceleration_mps2, state: decision.state, reason: decision.reason, plan: decision.plan }
    }
}

impl EgoController for EgoStack {
    fn step(&mut self, input: &EgoInput<'_>) -> Result<EgoCommand, ControllerError> {
        input.check_finite()?;
        let front = self.front.update(input);
        let mut command = self.comfortable(input, front.as_ref());
        let speed_mps = input.odometry.speed_mps;
        let braking = self.settings.aeb.and_then(|aeb| aeb.braking_mps2(self.emergency, speed_mps, front.as_ref()));
        if let Some(braking) = braking {
            command.acceleration_mps2 = command.acceleration_mps2.min(-braking);
            command.state = EgoState::EmergencyBraking;
            command.reason = Reason::BrakingRequired;
        } else if self.emergency {
            command.reason = Reason::BrakingDone;
        }
        self.emergency = braking.is_some();
        if !command.acceleration_mps2.is_finite() {
            return Err(ControllerError::NotFinite { what: "commanded acceleration", time: input.time });
        }
        self.last = Some((input.time, command.acceleration_mps2));
        Ok(command)
    }
}
