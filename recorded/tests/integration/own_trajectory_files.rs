//! Synthetic trajectory data, written to a file, read back, and passed through the whole chain.

use closecall_recorded::criticality::{Judgement, criticality};
use closecall_recorded::filters::smooth;
use closecall_recorded::fit::{Heading, Quantity, fit, to_toml};
use closecall_recorded::lane_change::detect;
use closecall_recorded::trajectory_data::{Layout, TrajectoryData, WriteError, read, write_trajectories};
use closecall_traffic::{Side, Time};
use proptest::prelude::*;

use crate::support::{SyntheticLaneChange, track};

fn synthetic(period: Time, changes: &[SyntheticLaneChange]) -> TrajectoryData {
    TrajectoryData::new("made-up", period, changes.iter().map(|change| track(*change, period)).collect())
}

fn written_and_read(data: &TrajectoryData) -> TrajectoryData {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("recording.csv");
    write_trajectories(data, &path).unwrap();
    read(&path).unwrap()
}

/// Returns forty lane changes with durations from 3 to 10.8 s.
fn forty() -> Vec<SyntheticLaneChange> {
    let change = |k: u32| SyntheticLaneChange {
        track_id: u64::from(k) + 1,
        speed_mps: 20.0 + 0.3 * f64::from(k),
        start_s: 2.0 + 0.1 * f64::from(k % 7),
        duration_s: 3.0 + 0.2 * f64::from(k),
        to_the_left: k.is_multiple_of(2),
    };
    (0..40).map(change).collect()
}

#[test]
fn detected_durations_are_within_five_percent_of_the_truth() {
    for period_ms in [100, 40, 10] {
        let changes = forty();
        let detected = detect(&smooth(&written_and_read(&synthetic(Time::from_ms(period_ms), &changes))));
        assert_eq!(detected.len(), changes.len());
        for (detected, made) in detected.iter().zip(&changes) {
            let error = (detected.duration_s - made.duration_s).abs() / made.duration_s;
            assert!(error < 0.05, "{} s instead of {} s", detected.duration_s, made.duration_s);
            assert!(detected.complete && (detected.crossing_s - made.start_s - 0.5 * made.duration_s).abs() <= 0.11);
            assert_eq!(detected.direction == Side::Left, made.to_the_left);
            assert!(
                (detected.start_s - made.start_s).abs() < 0.3
                    && (detected.end_s - detected.start_s - detected.duration_s).abs() < 1e-9
            );
        }
    }
}

#[test]
fn the_whole_chain_runs() {
    let data = written_and_read(&synthetic(Time::from_ms(100), &forty()));
    let critical = criticality(&smooth(&data), &Judgement::default());
    assert_eq!(critical.len(), 40);
    let json = serde_json::to_value(&critical[0]).unwrap();
    for key in ["track_id", "vehicle_class", "direction", "start_s", "crossing_s", "end_s", "duration_s", "speed_mps"] {
        assert!(json.get(key).is_some(), "{key}");
    }
    assert_eq!(json["metrics"].as_object().unwrap().len(), 7);
    let fitted = fit(&[data], 0);
    let durations = fitted.fitted.iter().find(|fitted| fitted.quantity == Quantity::LaneChangeDuration).unwrap();
    assert_eq!(durations.n, 40);
    assert!((durations.median - 6.9).abs() < 0.35, "{}", durations.median);
    assert_eq!(
        to_toml(&fitted, &Heading::default()),
        to_toml(&fit(&[written_and_read(&synthetic(Time::from_ms(100), &forty()))], 0), &Heading::default())
    );
}

#[test]
fn data_that_cannot_be_written_leaves_no_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("recording.csv");
    let mut not_finite = synthetic(Time::from_ms(100), &forty());
    not_finite.trajectories[3].points[7].speed_mps = f64::NAN;
    assert!(matches!(write_trajectories(&not_finite, &path), Err(WriteError::NotFinite { track_id: 4, .. })));
    let mut off_clock = synthetic(Time::from_ms(100), &forty());
    off_clock.trajectories[0].points[1].time = Time::from_ms(130);
    assert!(matches!(write_trajectories(&off_clock, &path), Err(WriteError::OffClock { track_id: 1, .. })));
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    let nowhere = write_trajectories(&synthetic(Time::from_ms(100), &forty()), &folder.path().join("no/file.csv"));
    assert!(matches!(nowhere, Err(WriteError::Io { .. })));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn written_data_reads_back_unchanged(
        speed_mps in 0.0_f64..60.0,
        start_s in 0.0_f64..5.0,
        duration_s in 2.0_f64..12.0,
        period_ms in prop::sample::select(vec![10_i64, 33, 40, 100]),
    ) {
        let change = SyntheticLaneChange { track_id: 5, speed_mps, start_s, duration_s, to_the_left: true };
        let written = synthetic(Time::from_ms(period_ms), &[change]);
        let read = written_and_read(&written);
        prop_assert_eq!((read.layout, read.period, read.name.as_str()), (Layout::Plain, written.period, "made-up"));
        let (a, b) = (&written.trajectories[0], &read.trajectories[0]);
        prop_assert_eq!((a.track_id, a.vehicle_id, a.class), (b.track_id, b.vehicle_id, b.class));
        prop_assert_eq!(a.points.len(), b.points.len());
        for (a, b) in a.points.iter().zip(&b.points) {
            prop_assert_eq!((a.time, a.lane), (b.time, b.lane));
            // The file has four decimals.
            prop_assert!((a.s_m - b.s_m).abs() <= 5.1e-5 && (a.d_m - b.d_m).abs() <= 5.1e-5);
            prop_assert!((a.speed_mps - b.speed_mps).abs() <= 5.1e-5);
        }
        // Data that was read from a file does not change when it is written and read again.
        let again = written_and_read(&read);
        prop_assert_eq!(&again.trajectories[0].points, &b.points);
    }
}
