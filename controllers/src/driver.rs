//! Human driver models.
//!
//! Each driver except the prescribed one has three layers: *perception* (the true state of traffic,
//! delayed and imprecise), a car-following *model*, which is a pure algorithm that can be tested
//! alone, and a *driver*, which adapts the two to the simulation loop.

mod attention;
mod idm;
mod interface;
mod lane_keeping;
mod merging;
mod overtaker;
mod pedals;
mod perception;
mod prescribed;
mod reaction;
mod smooth_noise;
mod speed_keeping;
#[cfg(test)]
mod testing;
mod wiedemann99;

pub use attention::{Lapse, LapseConfig};
pub use idm::{Idm, IdmConfig};
pub use interface::{
    Driver, DriverAction, DriverError, DriverInput, DriverNote, LaneChange, LaneNeighbours, Looks, Neighbour,
    Neighbours,
};
pub use lane_keeping::{Deviation, LaneKeeping, LaneKeepingConfig, Weave};
pub(crate) use merging::MergingDriver;
pub use merging::{ENTRY_STOP_MPS2, entry_change_duration_s, entry_stop_distance_m};
pub use overtaker::{Follow, FollowConfig, Overtaker, OvertakerConfig, Return, ReturnConfig};
pub(crate) use pedals::DEFAULT_BRAKE_BUILD_UP_MPS3;
pub use perception::{Evidence, EvidenceConfig, PerceptionConfig, PerceptionSettings};
pub use prescribed::{Prescribed, PrescribedConfig, PrescribedLaneChangeConfig, RecordedConfig};
pub use reaction::{LogNormalConfig, Reaction, ReactionChange, ReactionConfig};
pub use speed_keeping::{DesiredSpeedNoise, SpeedKeeping, SpeedKeepingConfig};
pub use wiedemann99::{Regime, Thresholds, Wiedemann99, Wiedemann99Config, Wiedemann99Driver, Wiedemann99Model};

use closecall_traffic::{ConfigError, Num, Parameters, Range, Time};

/// Hardest braking of a human driver if the scenario gives none (m/s²): the mean of car drivers in
/// crashes and near-crashes, whose distribution is normal with a standard deviation of 1.7
/// (Markkula, Engström, Lodin, Bärgman and Victor, *A farewell to brake reaction times?*, Accident
/// Analysis and Prevention 95 (2016) 209–226; parameters in the authors' code,
/// `gmarkkula/RearEndDriverModels`). Range for an ensemble: 4 to 9.
const DEFAULT_HARDEST_BRAKING_MPS2: f64 = 6.7;

/// Range of the hardest braking of a human driver (m/s²).
const HARDEST_BRAKING_RANGE: Range = Range::closed(4.0, 9.0);

/// Deceleration at highway speed with the accelerator released (m/s²): an assumption; 0.4 to 1 are
/// plausible.
pub(crate) const COASTING_DECELERATION_MPS2: f64 = 0.7;

/// Factor by which a driver brakes harder than necessary in order to keep apart: an assumption; 1
/// to 1.5 are plausible.
pub(crate) const BRAKING_MARGIN: f64 = 1.2;

/// Speed below which a vehicle counts as standing (m/s): numerical.
pub(crate) const STANDING_MPS: f64 = 0.1;

/// Returns the hardest braking of a human driver (m/s²), from the configuration or by default.
pub(crate) fn check_hardest_braking(num: Option<&Num>, parameters: &Parameters) -> Result<f64, ConfigError> {
    parameters.number_or(num, "hardest-braking-mps2", HARDEST_BRAKING_RANGE, DEFAULT_HARDEST_BRAKING_MPS2)
}

/// Returns `value`, or an error if it is not finite.
pub(crate) fn finite(value: f64, quantity: &'static str, time: Time) -> Result<f64, DriverError> {
    if value.is_finite() { Ok(value) } else { Err(DriverError::NotFinite { quantity, time }) }
}

/// Returns an error if any input is not finite. Comparisons and `min` would treat NaN as a safe
/// value.
pub(crate) fn check_finite(input: &DriverInput<'_>) -> Result<(), DriverError> {
    let (ego, near, time) = (input.own, input.neighbours, input.time);
    all_finite([ego.s_m, ego.d_m, ego.speed_mps, input.lateral_deviation_m], "own state", time)?;
    finite(input.desired_speed_offset_mps, "wanted speed", time)?;
    check_neighbour(near.in_path.as_ref(), time)?;
    check_neighbour(near.beyond.as_ref(), time)?;
    for lane in [Some(&near.own), near.left.as_ref(), near.right.as_ref()].into_iter().flatten() {
        check_neighbour(lane.lead.as_ref(), time)?;
        check_neighbour(lane.follower.as_ref(), time)?;
        check_neighbour(lane.alongside.as_ref(), time)?;
    }
    Ok(())
}

/// Returns an error if the state of a neighbour is not finite.
fn check_neighbour(neighbour: Option<&Neighbour>, time: Time) -> Result<(), DriverError> {
    neighbour.map_or(Ok(()), |near| {
        let state = [near.gap_m, near.speed_mps, near.acceleration_mps2, near.width_m, near.lateral_offset_m];
        all_finite(state, "state of a neighbour", time)
    })
}

/// Returns an error if any of the values is not finite.
fn all_finite<const N: usize>(values: [f64; N], quantity: &'static str, time: Time) -> Result<(), DriverError> {
    // A finite sum has finite terms. The sum of huge terms may be infinite.
    let is_finite = values.iter().sum::<f64>().is_finite() || values.iter().all(|value| value.is_finite());
    if is_finite { Ok(()) } else { Err(DriverError::NotFinite { quantity, time }) }
}

/// The lead vehicle as the input of a car-following model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lead {
    /// Bumper-to-bumper gap (m).
    pub gap_m: f64,
    /// Speed (m/s).
    pub speed_mps: f64,
    /// Acceleration (m/s²).
    pub acceleration_mps2: f64,
}

#[cfg(test)]
mod tests {
    use closecall_traffic::{ActorId, Check, stream};

    use super::testing::{car_ahead, overtaker_config, with_input};
    use super::*;

    #[test]
    fn every_following_driver_refuses_a_neighbour_that_is_not_finite() {
        let lead = Lead { gap_m: f64::NAN, speed_mps: 30.0, acceleration_mps2: 0.0 };
        let neighbours = Neighbours { in_path: Some(car_ahead(lead, false)), ..Neighbours::default() };
        let mut rng = stream(0, 0, &ActorId::new("rear").unwrap(), "driver");
        let none = Parameters::default();
        let wiedemann = Wiedemann99Config::default().check(&none).unwrap();
        let mut refuses = |driver: &mut dyn Driver| {
            with_input(Time::ZERO, &neighbours, |input| driver.step(input, &mut rng).is_err())
        };
        assert!(refuses(&mut Wiedemann99Driver::new(wiedemann)));
        assert!(refuses(&mut IdmConfig::default().check(&none).unwrap().driver()));
        let overtaker = overtaker_config(1.5, 0.9);
        assert!(refuses(&mut overtaker.check(&none).unwrap().driver()));
    }
}
