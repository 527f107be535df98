//! Synthetic trajectory data for tests.

use closecall_traffic::{Dimensions, Lane, Time, Trajectory, TrajectoryPoint, VehicleClass};

use super::data::TrajectoryData;

/// Time between two frames of the synthetic data.
pub(crate) const PERIOD: Time = Time::from_ms(100);

/// Lane width of the synthetic road (m).
pub(crate) const LANE_M: f64 = 3.5;

/// Creates trajectory data from `trajectories`.
pub(crate) fn trajectory_data_of(trajectories: Vec<Trajectory>) -> TrajectoryData {
    TrajectoryData::new("made-up", PERIOD, trajectories)
}

/// Creates a car that drives at constant speed at the lateral position `d_m`, from `s_m` at time 0.
pub(crate) fn straight_track(id: u64, s_m: f64, speed_mps: f64, d_m: f64, frames: i64) -> Trajectory {
    track_along(id, s_m, speed_mps, frames, |_| (d_m, 0.0))
}

/// Creates a car that drives at constant speed and changes lanes from `from_d_m` to `to_d_m` on a
/// quintic path. The change begins at `start_s` and takes `duration_s`.
pub(crate) fn changing_track(
    id: u64,
    (s_m, speed_mps): (f64, f64),
    (from_d_m, to_d_m): (f64, f64),
    (start_s, duration_s): (f64, f64),
    frames: i64,
) -> Trajectory {
    track_along(id, s_m, speed_mps, frames, |time_s| {
        let tau = ((time_s - start_s) / duration_s).clamp(0.0, 1.0);
        let shape = tau.powi(3) * (10.0 - 15.0 * tau + 6.0 * tau * tau);
        let rate = 30.0 * tau * tau * (1.0 - tau) * (1.0 - tau) / duration_s;
        (from_d_m + (to_d_m - from_d_m) * shape, (to_d_m - from_d_m) * rate)
    })
}

/// Creates a car at constant speed. `lateral` gives lateral position and lateral speed at a time.
fn track_along(id: u64, s_m: f64, speed_mps: f64, frames: i64, lateral: impl Fn(f64) -> (f64, f64)) -> Trajectory {
    let point = |frame| {
        let time = PERIOD * frame;
        let (d_m, lateral_speed_mps) = lateral(time.s());
        TrajectoryPoint {
            time,
            s_m: s_m + speed_mps * time.s(),
            d_m,
            speed_mps,
            acceleration_mps2: 0.0,
            lateral_speed_mps,
            lateral_acceleration_mps2: 0.0,
            lane: Lane((-d_m / LANE_M).floor() as u8 + 1),
        }
    };
    Trajectory {
        track_id: id,
        vehicle_id: id,
        class: VehicleClass::Car,
        dimensions: Dimensions { length_m: 4.5, width_m: 1.8, height_m: 1.5 },
        points: (0..frames).map(point).collect(),
    }
}
