//! Calibration of the driver who replaces a recorded one: Wiedemann 99 behind the vehicles that are
//! recorded ahead.
//!
//! The driver of a lane change follows one vehicle before the crossing and another one after it. At
//! each instant the leader is the nearest vehicle ahead in the lane or in the path, as in a run.
//! Where nobody is ahead, the driver is free.

use closecall_controllers::Wiedemann99Config;
use closecall_recorded::encounter::RecordedEncounter;
use closecall_recorded::following::{FollowingInstant, FollowingPair};
use closecall_traffic::metrics::touching_distance_m;
use closecall_traffic::{CONTROL_STEP, Num, Time, TrajectoryPoint};

use super::follower::{FollowingModel, squared_error, wiedemann99_config};
use super::optimise::minimise;

/// Distance of the leader of a free driver (m): numerical, beyond the reach of the model.
const NOBODY_M: f64 = 10_000.0;
/// Number of digits behind the point of a calibrated value, as in a scenario file.
const STEPS_PER_UNIT: f64 = 1_000.0;

/// Range of the desired speed (m/s): below the slowest one of the general calibration, because a
/// recording may show nothing but slow traffic.
const DESIRED_MPS: [f64; 2] = [1.0, 45.0];
/// The published values of the parameters, in the order of [`FollowingModel::parameters`]. The
/// first one, the desired speed, has none.
const PUBLISHED: [f64; 11] = [0.0, 1.5, 0.9, 4.0, -8.0, -0.35, 0.35, 11.44, 0.25, 3.5, 1.5];
/// Indices of the desired speed and of cc1.
const SPEED_AND_HEADWAY: [usize; 2] = [0, 2];
/// Indices of all parameters but cc0, the gap at standstill, and cc6, which changes cc4 and cc5
/// with the gap: a short recording on a motorway shows neither.
const ALL: [usize; 9] = [0, 2, 3, 4, 5, 6, 8, 9, 10];

/// How many parameters of a driver are calibrated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Calibrated {
    /// The desired speed and cc1; the others have their published values.
    SpeedAndHeadway,
    /// All but cc0 and cc6.
    All,
}

/// Returns the instants of the vehicle that changes lanes, from the start to `until`, with the
/// vehicle ahead of it among `others`: indices into the vehicles of the encounter. Returns `None`
/// where nobody is ahead.
pub fn ahead_of(encounter: &RecordedEncounter, others: &[usize], until: Time) -> Vec<(Time, Option<FollowingInstant>)> {
    let own = &encounter.rear().trajectory;
    let within = own.points.iter().take_while(|point| point.time <= until);
    within.map(|point| (point.time, leader_at(encounter, others, point))).collect()
}

/// Returns both vehicles at one instant, if one is ahead.
fn leader_at(encounter: &RecordedEncounter, others: &[usize], point: &TrajectoryPoint) -> Option<FollowingInstant> {
    let size = encounter.rear().trajectory.dimensions;
    let lane_of = |d_m: f64| (-d_m / encounter.lane_width_m).floor();
    let ahead = others.iter().filter_map(|&index| {
        let other = &encounter.vehicles[index].trajectory;
        let at = other.at(point.time)?;
        let beside_m = touching_distance_m(size.width_m, other.dimensions.width_m);
        let is_in_the_way = lane_of(at.d_m) == lane_of(point.d_m) || (at.d_m - point.d_m).abs() < beside_m;
        (is_in_the_way && at.s_m > point.s_m).then_some((at, other.dimensions.length_m))
    });
    let (leader, length_m) = ahead.min_by(|a, b| (a.0.s_m - 0.5 * a.1).total_cmp(&(b.0.s_m - 0.5 * b.1)))?;
    Some(FollowingInstant {
        time_s: point.time.s(),
        leader_rear_m: leader.s_m - 0.5 * length_m,
        leader_mps: leader.speed_mps,
        leader_mps2: leader.acceleration_mps2,
        follower_front_m: point.s_m + 0.5 * size.length_m,
        follower_mps: point.speed_mps,
    })
}

/// Returns the driver with the smallest error along the road behind the vehicles in `ahead`, see
/// [`ahead_of`].
pub fn calibrate_replaced(
    encounter: &RecordedEncounter,
    ahead: &[(Time, Option<FollowingInstant>)],
    calibrated: Calibrated,
) -> Wiedemann99Config {
    let own = &encounter.rear().trajectory;
    let half_m = 0.5 * own.dimensions.length_m;
    let instants = own.points.iter().zip(ahead).map(|(point, (time, instant))| {
        instant.unwrap_or(FollowingInstant {
            time_s: time.s(),
            leader_rear_m: point.s_m + half_m + NOBODY_M,
            leader_mps: point.speed_mps,
            leader_mps2: 0.0,
            follower_front_m: point.s_m + half_m,
            follower_mps: point.speed_mps,
        })
    });
    let pair = FollowingPair { name: String::new(), step_s: CONTROL_STEP.s(), instants: instants.collect() };
    let free: &[usize] = match calibrated {
        Calibrated::SpeedAndHeadway => &SPEED_AND_HEADWAY,
        Calibrated::All => &ALL,
    };
    let model = FollowingModel::Wiedemann99;
    let values = |point: &[f64]| {
        let mut values = PUBLISHED.to_vec();
        for (&index, u) in free.iter().zip(point) {
            let spec = &model.parameters()[index];
            let [min, max] = if index == 0 { DESIRED_MPS } else { [spec.min, spec.max] };
            values[index] = ((min + u.clamp(0.0, 1.0) * (max - min)) * STEPS_PER_UNIT).round() / STEPS_PER_UNIT;
        }
        values
    };
    let rmse_m = |point: &[f64]| {
        let (sum, count) = squared_error(model, &values(point), &pair);
        (sum / count.max(1) as f64).sqrt()
    };
    let (point, _) = minimise(free.len(), rmse_m);
    wiedemann99_config(&values(&point))
}

/// Returns the value of a parameter of a driver by its key in a scenario file, if it is a number.
pub fn value_of(driver: &Wiedemann99Config, key: &str) -> Option<f64> {
    let value = match key {
        "cc0-m" => &driver.cc0_m,
        "cc1-s" => &driver.cc1_s,
        "cc2-m" => &driver.cc2_m,
        "cc3-s" => &driver.cc3_s,
        "cc4-mps" => &driver.cc4_mps,
        "cc5-mps" => &driver.cc5_mps,
        "cc6" => &driver.cc6,
        "cc7-mps2" => &driver.cc7_mps2,
        "cc8-mps2" => &driver.cc8_mps2,
        "cc9-mps2" => &driver.cc9_mps2,
        "desired-speed-mps" => &driver.desired_speed_mps,
        _ => return None,
    };
    match value {
        Some(Num::Fixed(value)) => Some(*value),
        _ => None,
    }
}
