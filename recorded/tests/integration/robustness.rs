//! Robustness of each lane-change criterion: on synthetic in-car logs with known ground truth, and
//! on US-101.

use closecall_recorded::lane_change::{Criterion, LaneChangeDetector, LaneReliability};
use closecall_recorded::robustness::{CriterionCounts, Measured, ReferenceKind, Robustness, Setup, Study};
use closecall_recorded::trajectory_data::{LaneMarkings, MarkingDistances, open};
use closecall_traffic::{Lane, Time};

use crate::support::{LANE_M, SyntheticLaneChange, data_folder, track};

/// Time between two frames of the synthetic logs: 100 Hz. The camera measures the markings in every
/// fourth frame.
const PERIOD: Time = Time::from_ms(10);
const FRAMES_PER_VIEW: usize = 4;

/// Creates twenty drives of 20 s, each with one lane change of 3 to 8.7 s, and the distances to the
/// markings.
fn logs() -> Vec<(SyntheticLaneChange, Measured)> {
    let log = |k: u32| {
        let change = SyntheticLaneChange {
            track_id: u64::from(k) + 1,
            speed_mps: 25.0 + f64::from(k % 5),
            start_s: 4.0 + 0.2 * f64::from(k % 3),
            duration_s: 3.0 + 0.3 * f64::from(k),
            to_the_left: k.is_multiple_of(2),
        };
        let mut trajectory = track(change, PERIOD);
        // No vehicle drives exactly in the middle of its lane.
        let aside_m = 0.1 * f64::from(k % 4) - 0.15;
        trajectory.points.iter_mut().for_each(|point| point.d_m += aside_m);
        let seen = trajectory.points.iter().enumerate().map(|(frame, point)| {
            if frame % FRAMES_PER_VIEW != 0 {
                return MarkingDistances::default();
            }
            let left_edge_m = (point.d_m / LANE_M).ceil() * LANE_M;
            MarkingDistances { left_m: Some(left_edge_m - point.d_m), right_m: Some(point.d_m - left_edge_m + LANE_M) }
        });
        let seen: Vec<_> = seen.collect();
        // An in-car log has no map, so the position of the left marking determines the lane.
        let mut lane = Lane(1);
        for (point, seen) in trajectory.points.iter_mut().zip(&seen) {
            if let Some(left_m) = seen.left_m {
                lane = Lane(1 + (-(point.d_m + left_m) / LANE_M).round() as u8);
            }
            point.lane = lane;
        }
        (change, (trajectory, seen))
    };
    (0..20).map(log).collect()
}

fn studied(study: &Study, setup: &Setup) -> Robustness {
    let experiments = Study::experiments(setup);
    let results: Vec<Vec<CriterionCounts>> = experiments.iter().map(|experiment| study.run(experiment)).collect();
    study.robustness(setup, &results)
}

fn short_setup() -> Setup {
    Setup { noise_m_per_sqrt_s: vec![0.0, 0.1, 0.3, 0.6, 1.0], offset_m: vec![-1.0, 0.0, 1.0], repetitions: 2, seed: 3 }
}

#[test]
fn the_gradient_criterion_finds_the_true_lane_changes() {
    let detector = LaneChangeDetector::new(LaneReliability::Reliable, &LaneMarkings::default());
    for (truth, (trajectory, seen)) in logs() {
        let changes = detector.detect(Criterion::Gradient, &trajectory, &seen);
        let [change] = &changes[..] else { panic!("{} instead of 1", changes.len()) };
        assert_eq!(change.direction == closecall_traffic::Side::Left, truth.to_the_left);
        let crossed = |pair: &[closecall_traffic::TrajectoryPoint]| (pair[0].d_m > -LANE_M) != (pair[1].d_m > -LANE_M);
        let index = trajectory.points.windows(2).position(crossed).unwrap();
        // The camera measures the markings in every fourth frame only.
        assert!((change.crossing_s - trajectory.points[index].time.s()).abs() <= 0.05, "{}", change.crossing_s);
        assert!(change.complete && (change.duration_s - truth.duration_s).abs() < 0.05 * truth.duration_s);
    }
}

#[test]
fn an_offset_makes_only_the_distance_criterion_miss_lane_changes() {
    let study = Study::new(logs().into_iter().map(|(_, log)| log).collect(), &LaneMarkings::default());
    let result = studied(&study, &short_setup());
    assert_eq!((result.reference_kind, result.reference), (ReferenceKind::Gradient, 20));
    assert_eq!(result.undisturbed, [20, 20, 20]);
    assert_eq!(result.criteria, [Criterion::Peak, Criterion::Distance, Criterion::Gradient]);
    let [left, none, right] = &result.offset[..] else { panic!("three offsets") };
    for cell in none {
        assert_eq!((cell.again, cell.detected, cell.invented), (20.0, 20.0, 0.0));
    }
    for cells in [left, right] {
        assert_eq!([cells[0].again, cells[2].again], [20.0, 20.0]);
        assert!(cells[1].again <= 10.0, "{}", cells[1].again);
    }
}

#[test]
fn with_growing_noise_the_peak_criterion_fails_first() {
    let study = Study::new(logs().into_iter().map(|(_, log)| log).collect(), &LaneMarkings::default());
    let result = studied(&study, &short_setup());
    let fails = |column| result.failing_noise_m_per_sqrt_s(column);
    let (Some(peak), gradient) = (fails(0), fails(2)) else {
        panic!("the peak criterion withstands every noise level")
    };
    assert!(peak > 0.0 && gradient.is_none_or(|gradient| peak < gradient), "{peak} {gradient:?}");
    assert_eq!(result, studied(&study, &short_setup()));
    assert_ne!(result.noise, studied(&study, &Setup { seed: 4, ..short_setup() }).noise);
}

#[test]
fn an_offset_on_us101_makes_only_the_distance_criterion_miss_lane_changes() {
    let Some(folder) = data_folder() else { return };
    let setup = Setup { noise_m_per_sqrt_s: vec![0.0], repetitions: 1, ..short_setup() };
    let mut all: Option<Robustness> = None;
    for name in ["a", "b", "f", "g", "h", "i"] {
        let path = folder.join(format!("ngsim_us101/trajectories/us101_{name}.csv"));
        let mut tracks = open(&path, Default::default()).unwrap();
        let measured = tracks.by_ref().map(|track| track.unwrap()).map(|track| (track.trajectory, track.markings));
        let measured: Vec<Measured> = measured.collect();
        let result = studied(&Study::new(measured, tracks.markings()), &setup);
        match &mut all {
            None => all = Some(result),
            Some(all) => assert!(all.add(&result)),
        }
    }
    let all = all.unwrap();
    assert!(all.reference_kind == ReferenceKind::RecordedLanes && all.reference >= 40, "{}", all.reference);
    let [peak, distance] = all.undisturbed[..] else { panic!("two criteria") };
    assert!(peak >= 15 && distance >= 15, "{peak} {distance}");
    for cells in [&all.offset[0], &all.offset[2]] {
        assert!(cells[0].again >= 0.95 * peak as f64, "peak: {} of {peak}", cells[0].again);
        assert!(cells[1].again <= 0.7 * distance as f64, "distance: {} of {distance}", cells[1].again);
    }
}
