//! The human drivers.
//!
//! Each has the same three layers: *perception* (the truth, late and coarse), a *model* of following, which is pure and
//! can be tested alone, and a *driver* that adapts the two to the loop.

mod attention;
mod drift;
mod idm;
mod interface;
mod lane_keeping;
mod overtaker;
mod perception;
mod prescribed;
mod reaction;
mod speed_keeping;
mod wiedemann99;

pub use attention::{Lapse, LapseConfig};
pub use idm::{Idm, IdmConfig};
pub use interface::{
    Driver, DriverAction, DriverError, DriverInput, DriverNote, LaneChange, LaneNeighbours, Neighbour, Neighbours,
};
pub use lane_keeping::{Deviation, LaneKeeping, LaneKeepingConfig, Weave};
pub use overtaker::{FollowConfig, Overtaker, OvertakerConfig, Return, ReturnConfig};
pub use prescribed::{Prescribed, PrescribedConfig, PrescribedLaneChangeConfig, RecordedConfig};
pub use reaction::{LogNormalConfig, Reaction, ReactionConfig};
pub use speed_keeping::{SpeedKeeping, SpeedKeepingConfig, Wander};
pub use wiedemann99::{Regime, Thresholds, Wiedemann99, Wiedemann99Config, Wiedemann99Driver, Wiedemann99Model};

use closecall_traffic::Time;

/// Hardest braking a human asks for [m/s²]: the mean of emergency braking on dry roads (Burg and Moser, Handbuch
/// Verkehrsunfallrekonstruktion, 2017: 7.5 to 8.5 m/s²).
pub(crate) const HARDEST_BRAKING_MPS2: f64 = 8.0;

/// Deceleration with the foot off the accelerator at highway speed [m/s²] (engine drag and air: 0.5 to 1 m/s²).
pub(crate) const LIFT_OFF_MPS2: f64 = 0.7;

/// `value`, where it is finite.
pub(crate) fn finite(value: f64, what: &'static str, time: Time) -> Result<f64, DriverError> {
    if value.is_finite() { Ok(value) } else { Err(DriverError::NotFinite { what, time }) }
}

/// Refuses input that is not finite: comparisons and `min` would let it pass for something safe.
pub(crate) fn check_finite(input: &DriverInput<'_>) -> Result<(), DriverError> {
    let (own, near) = (input.own, input.neighbours);
    for value in [own.s_m, own.d_m, own.speed_mps, input.lateral_deviation_m] {
        finite(value, "own state", input.time)?;
    }
    finite(input.desired_speed_offset_mps, "wanted speed", input.time)?;
    let lanes = [Some(&near.own), near.left.as_ref(), near.right.as_ref()];
    let beside = lanes.iter().flatten().flat_map(|lane| [&lane.lead, &lane.follower, &lane.alongside]);
    for other in beside.chain([&near.in_path]).flatten() {
        for value in [other.gap_m, other.speed_mps, other.acceleration_mps2, other.width_m, other.lateral_offset_m] {
            finite(value, "state of a neighbour", input.time)?;
        }
    }
    Ok(())
}

/// The vehicle ahead as the following models see it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lead {
    /// Gap bumper to bumper [m].
    pub gap_m: f64,
    /// Its speed [m/s].
    pub speed_mps: f64,
    /// Its acceleration [m/s²].
    pub acceleration_mps2: f64,
}

#[cfg(test)]
mod tests {
    use closecall_traffic::{ActorId, Check, Indicator, Parameters, Road, Vehicle, VehicleClass, VehicleState, stream};

    use super::*;

    #[test]
    fn a_neighbour_that_is_not_finite_is_an_error_for_every_follower() {
        let lead = Neighbour {
            actor: 1,
            gap_m: f64::NAN,
            speed_mps: 30.0,
            acceleration_mps2: 0.0,
            brake_light: false,
            indicator: Indicator::Off,
            class: VehicleClass::Car,
            length_m: 4.6,
            width_m: 1.85,
            lateral_offset_m: 0.0,
        };
        let neighbours = Neighbours { in_path: Some(lead), ..Neighbours::default() };
        let (road, vehicle) = (Road::straight(3), Vehicle::typical(VehicleClass::Car));
        let own = VehicleState { d_m: -5.625, speed_mps: 30.0, ..VehicleState::default() };
        let input = DriverInput {
            time: Time::ZERO,
            vehicle: &vehicle,
            own: &own,
            neighbours: &neighbours,
            road: &road,
            changing_to: None,
            lateral_deviation_m: 0.0,
            desired_speed_offset_mps: 0.0,
        };
        let mut rng = stream(0, 0, &ActorId::new("rear").unwrap(), "driver");
        let none = Parameters::default();
        let wiedemann = Wiedemann99Config::default().check(&none).unwrap();
        assert!(Wiedemann99Driver::new(wiedemann).step(&input, &mut rng).is_err());
        assert!(IdmConfig::default().check(&none).unwrap().driver().step(&input, &mut rng).is_err());
        let overtaker = OvertakerConfig {
            cut_out_thw_s: 1.5.into(),
            follow: FollowConfig::Wiedemann99(Wiedemann99Config::default()),
            reaction_s: ReactionConfig::Value(0.9.into()),
            lane_change_duration_s: None,
            evasive_lateral_mps2: None,
            lapse: None,
            returns: None,
        };
        assert!(overtaker.check(&none).unwrap().driver().step(&input, &mut rng).is_err());
    }
}
