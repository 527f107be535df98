//! Helpers shared by several tests.

use std::path::Path;

use closecall_recorded::trajectory_data::{TrajectoryData, TrajectoryFileError, read_from};
pub(crate) use closecall_testing::data as data_folder;
use closecall_traffic::{Lane, Time, Trajectory, TrajectoryPoint, VehicleClass};

/// Reads trajectory data from text.
pub(crate) fn read_text(text: &[u8]) -> Result<TrajectoryData, TrajectoryFileError> {
    read_from(text, Path::new("made-up.csv"))
}

/// The header of the plain layout.
pub(crate) const PLAIN_HEADER: &str = "recording_id,track_id,vehicle_id,frame,time_s,s_m,d_m,lane_id,speed_mps,\
     accel_mps2,heading_rel_rad,x_m,y_m,length_m,width_m,vehicle_class,source_scenario";

/// One lane change of a synthetic vehicle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SyntheticLaneChange {
    pub(crate) track_id: u64,
    pub(crate) speed_mps: f64,
    pub(crate) start_s: f64,
    pub(crate) duration_s: f64,
    pub(crate) to_the_left: bool,
}

/// Lane width of synthetic roads (m).
pub(crate) const LANE_M: f64 = 3.75;

/// Creates the track of a vehicle that changes lanes once between lanes 1 and 2 on a quintic path.
/// The track lasts 20 s.
pub(crate) fn track(change: SyntheticLaneChange, period: Time) -> Trajectory {
    const RECORDED_S: f64 = 20.0;
    let (from, to) = if change.to_the_left { (-1.5 * LANE_M, -0.5 * LANE_M) } else { (-0.5 * LANE_M, -1.5 * LANE_M) };
    let point = |frame: i64| {
        let time = period * frame;
        let tau = ((time.s() - change.start_s) / change.duration_s).clamp(0.0, 1.0);
        let d_m = from + (to - from) * tau.powi(3) * (10.0 - 15.0 * tau + 6.0 * tau * tau);
        let rate = 30.0 * tau * tau * (1.0 - tau).powi(2) / change.duration_s;
        TrajectoryPoint {
            time,
            s_m: change.speed_mps * time.s(),
            d_m,
            speed_mps: change.speed_mps,
            acceleration_mps2: 0.0,
            lateral_speed_mps: (to - from) * rate,
            lateral_acceleration_mps2: 0.0,
            lane: Lane(if d_m > -LANE_M { 1 } else { 2 }),
        }
    };
    let class = VehicleClass::Car;
    let frames = (RECORDED_S / period.s()).round() as i64;
    Trajectory {
        track_id: change.track_id,
        vehicle_id: change.track_id,
        class,
        dimensions: class.typical_dimensions(),
        points: (0..frames).map(point).collect(),
    }
}
/// Asserts that the error message contains all of `needed`.
pub(crate) fn assert_mentions(error: &TrajectoryFileError, needed: &[&str], case: &str) {
    let message = error.to_string();
    for part in needed {
        assert!(message.contains(part), "{case}: `{message}` does not say `{part}`");
    }
}
