use closecall_recorded::following::{FollowingInstant, read};
use closecall_traffic::maths;

use super::*;

/// Returns a leader that drives in waves, and a follower that drives by the model with these
/// values.
fn synthetic(name: &str, model: FollowingModel, values: &[f64]) -> FollowingPair {
    let phase = f64::from(closecall_recorded::following::name_hash(name));
    let mut leader_rear_m = 25.0;
    let instants = (0..600).map(|index| {
        let time_s = 0.1 * f64::from(index);
        let wave = 0.3 * time_s + phase;
        let (leader_mps, leader_mps2) = (12.0 + 5.0 * maths::sin(wave), 1.5 * maths::cos(wave));
        let instant = FollowingInstant {
            time_s,
            leader_rear_m,
            leader_mps,
            leader_mps2,
            follower_front_m: 0.0,
            follower_mps: 12.0,
        };
        leader_rear_m += 0.1 * leader_mps;
        instant
    });
    let mut pair = FollowingPair { name: name.to_owned(), step_s: 0.1, instants: instants.collect() };
    let mut fronts = Vec::new();
    assert!(simulate(model, values, &pair, |_, simulated| fronts.push(simulated)));
    for (instant, simulated) in pair.instants.iter_mut().zip(fronts) {
        instant.follower_front_m = instant.leader_rear_m - simulated.gap_m;
        instant.follower_mps = simulated.speed_mps;
    }
    pair
}

#[test]
fn the_parameters_of_a_simulated_driver_are_found_again() {
    let truth = [30.0, 1.2, 2.5, 1.1, 1.8];
    let names: Vec<String> = (0..12).map(|index| format!("pair {index}")).collect();
    let pairs = names.iter().map(|name| synthetic(name, FollowingModel::Idm, &truth)).collect();
    let data = FollowingData { pairs, ..FollowingData::default() };
    let calibration = calibrate(FollowingModel::Idm, &data).unwrap();
    assert!(!calibration.held_out.is_empty() && calibration.held_out.len() + calibration.pairs.len() == 12);
    assert!(calibration.errors_of_held_out.unwrap().rmse_m < 0.02, "{calibration:?}");
    for (value, truth) in calibration.pooled.iter().zip(truth) {
        assert!((value / truth - 1.0).abs() < 0.05, "{:?}", calibration.pooled);
    }
    let predictive = calibration.predictive.clone().unwrap();
    for (recorded_s, simulated_s) in predictive.recorded_s.iter().zip(predictive.simulated_s) {
        assert!((recorded_s / simulated_s - 1.0).abs() < 0.05, "{predictive:?}");
    }
    // The same data give the same bits.
    assert_eq!(calibrate(FollowingModel::Idm, &data).unwrap(), calibration);
}

#[test]
fn a_simulated_wiedemann_driver_is_followed_closely() {
    let truth = [30.0, 2.0, 1.0, 6.0, -10.0, -0.5, 0.5, 5.0, 0.3, 2.5, 1.2];
    let pair = synthetic("a", FollowingModel::Wiedemann99, &truth);
    let data = FollowingData { pairs: vec![pair], ..FollowingData::default() };
    // With one pair, the hash decides on which side it falls.
    if let Some(calibration) = calibrate(FollowingModel::Wiedemann99, &data) {
        assert!(calibration.errors_of_single.rmse_m < 1.0, "{:?}", calibration.errors_of_single);
        assert!(calibration.errors_of_held_out.is_none() && calibration.predictive.is_none());
    }
}

#[test]
fn recorded_pairs_are_followed_within_the_errors_of_the_literature() {
    let Some(folder) = closecall_testing::data() else { return };
    let path = folder.join("ngsim_i80_pairs/i80_leader_follower_pairs.csv.gz");
    let mut data = read(&[path]).unwrap();
    assert!(data.pairs.len() > 80, "{:?}", data.left_out);
    data.pairs.truncate(20);
    let calibration = calibrate(FollowingModel::Idm, &data).unwrap();
    assert!((0.05..0.29).contains(&calibration.errors_of_single.relative), "{:?}", calibration.errors_of_single);
    assert!(calibration.errors_of_pooled.rmse_m > calibration.errors_of_single.rmse_m);
    // A default driver is worse than a calibrated one.
    let used: Vec<&FollowingPair> = data.pairs.iter().filter(|pair| !is_held_out(pair)).collect();
    let default = rmse_m(FollowingModel::Idm, &[33.3, 1.5, 2.0, 0.73, 1.67], &used);
    assert!(calibration.errors_of_pooled.rmse_m < default, "{default}");
}
