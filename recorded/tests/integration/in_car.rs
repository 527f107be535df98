//! In-car logs: two rates in one file, distances to the visible markings, and lanes counted by the
//! jumps of the markings.

use std::path::Path;

use closecall_recorded::trajectory_data::{
    BusFrame, InCarFrame, InCarLog, Layout, MarkingDistances, ReadOptions, RecordedTrack, open, write_in_car,
};
use closecall_traffic::{Time, VehicleClass};

use crate::support::{LANE_M, SyntheticLaneChange, track};

/// Creates the log of a synthetic vehicle that changes lanes once between lanes 1 and 2.
fn log(to_the_left: bool) -> InCarLog {
    let change = SyntheticLaneChange { track_id: 1, speed_mps: 30.0, start_s: 5.0, duration_s: 6.0, to_the_left };
    let track = track(change, Time::from_ms(10));
    let frame = |(k, point): (usize, &closecall_traffic::TrajectoryPoint)| {
        let left_m = -LANE_M * f64::from(point.lane.0 - 1) - point.d_m;
        let markings = MarkingDistances { left_m: Some(left_m), right_m: Some(LANE_M - left_m) };
        InCarFrame {
            time: point.time,
            s_m: point.s_m,
            d_m: point.d_m,
            heading_rad: 0.0,
            acceleration_mps2: 0.0,
            yaw_rate_radps: 0.0,
            bus: (k % 4 == 0).then_some(BusFrame { speed_mps: point.speed_mps, markings }),
        }
    };
    let class = VehicleClass::Car;
    InCarLog {
        class,
        dimensions: class.typical_dimensions(),
        frames: track.points.iter().enumerate().map(frame).collect(),
    }
}

/// Writes `log` to a file and reads the file.
fn read_back(log: &InCarLog) -> Vec<RecordedTrack> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("drive.csv");
    write_in_car(log, &path).unwrap();
    tracks(&path)
}

fn tracks(path: &Path) -> Vec<RecordedTrack> {
    let tracks = open(path, ReadOptions::default()).unwrap();
    assert_eq!((tracks.layout(), tracks.period()), (Layout::InCar, Time::from_ms(10)));
    tracks.collect::<Result<_, _>>().unwrap()
}

#[test]
fn a_written_log_reads_back_unchanged() {
    let log = log(true);
    let [track] = <[RecordedTrack; 1]>::try_from(read_back(&log)).unwrap();
    assert_eq!((track.trajectory.points.len(), track.markings.len()), (2_000, 2_000));
    for ((point, seen), frame) in track.trajectory.points.iter().zip(&track.markings).zip(&log.frames) {
        assert_eq!(point.time, frame.time);
        assert!((point.d_m - frame.d_m).abs() < 1e-3 && (point.s_m - frame.s_m).abs() < 1e-3);
        assert_eq!(seen.is_seen(), frame.bus.is_some(), "a row has marking distances only if it has a bus frame");
    }
}

#[test]
fn lanes_are_counted_by_the_jumps_of_the_markings() {
    for to_the_left in [true, false] {
        let [track] = <[RecordedTrack; 1]>::try_from(read_back(&log(to_the_left))).unwrap();
        let lanes: Vec<u8> = track.trajectory.points.iter().map(|point| point.lane.0).collect();
        let (before, after) = if to_the_left { (2, 1) } else { (1, 2) };
        let crossing = lanes.iter().position(|lane| *lane == after).unwrap();
        assert!(
            crossing.abs_diff(800) <= 4,
            "the lane changes within one bus frame of the middle of the lane change: {crossing}"
        );
        assert!(lanes[..crossing].iter().all(|lane| *lane == before));
        assert!(lanes[crossing..].iter().all(|lane| *lane == after));
    }
}

#[test]
fn a_gap_splits_the_log() {
    let mut log = log(true);
    log.frames.drain(400..600);
    let tracks = read_back(&log);
    assert_eq!(tracks.iter().map(|track| track.trajectory.points.len()).collect::<Vec<_>>(), [400, 1_400]);
    assert!(tracks.iter().all(|track| track.trajectory.vehicle_id == 1));
}
