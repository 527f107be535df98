//! Inputs for the tests of the drivers.

use closecall_traffic::{Indicator, Road, Time, Vehicle, VehicleClass, VehicleState};

use super::reaction::ReactionConfig;
use super::{DriverInput, FollowConfig, Lead, Neighbour, Neighbours, OvertakerConfig, Wiedemann99Config};

/// Returns a driver who pulls out at a time headway of `cut_out_thw_s` and follows with this cc1
/// (s).
pub(super) fn overtaker_config(cut_out_thw_s: f64, cc1_s: f64) -> OvertakerConfig {
    OvertakerConfig {
        cut_out_thw_s: cut_out_thw_s.into(),
        follow: FollowConfig::Wiedemann99(Wiedemann99Config { cc1_s: Some(cc1_s.into()), ..Default::default() }),
        reaction_s: ReactionConfig::Value(0.9.into()),
        lane_change_duration_s: None,
        evasive_lateral_mps2: None,
        lapse: None,
        perception: None,
        brake_build_up_mps3: None,
        returns: None,
    }
}

/// Returns a car with this gap and motion, straight ahead of a driver.
pub(super) fn car_ahead(lead: Lead, brake_light: bool) -> Neighbour {
    Neighbour {
        actor: 1,
        gap_m: lead.gap_m,
        speed_mps: lead.speed_mps,
        acceleration_mps2: lead.acceleration_mps2,
        brake_light,
        indicator: Indicator::Off,
        class: VehicleClass::Car,
        length_m: 4.6,
        width_m: 1.85,
        lateral_offset_m: 0.0,
    }
}

/// Passes `check` the input of a car that drives at 30 m/s in the middle of three lanes and keeps
/// its lane.
pub(super) fn with_input<T>(time: Time, neighbours: &Neighbours, check: impl FnOnce(&DriverInput<'_>) -> T) -> T {
    check(&DriverInput {
        time,
        vehicle: &Vehicle::typical(VehicleClass::Car),
        own: &VehicleState { s_m: 30.0 * time.s(), d_m: -5.625, speed_mps: 30.0, ..VehicleState::default() },
        neighbours,
        road: &Road::straight(3),
        lane_change_target: None,
        lateral_deviation_m: 0.0,
        desired_speed_offset_mps: 0.0,
    })
}
