//! What the sensor reports of the echoes: their widths, and intensities that contain the window.

use std::collections::BTreeMap;

use closecall_traffic::{Environment, VehicleClass, maths};

use super::super::power::LinkBudget;
use super::super::power::MAX_INTENSITY;
use super::*;
use crate::faults::LidarFault;

/// Standard deviation of the Gaussian pulse of 5 ns at half of its peak (ns).
const PULSE_SD_NS: f64 = 2.123_3;

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Returns the complete scan of a truck 20 m behind, whose front is upright.
fn complete(model: Lidar) -> RearLidar {
    let mut lidar = RearLidar::new(model);
    TestScene::new().with(VehicleClass::Truck, 20.0, 0.0).detect(&mut lidar, 0);
    lidar.completed().unwrap()
}

/// Returns the received power of a point (detection thresholds), from its range and its intensity.
fn power(lidar: &RearLidar, point: usize, model: &Lidar) -> f64 {
    let range_m = f64::from(lidar.point_beam(point).range_m);
    let gain_m2 = f64::from(LinkBudget::new(model, &Environment::CLEAR_DAY).gain_m2);
    f64::from(lidar.latest().intensity[point]) * gain_m2 / (range_m * range_m)
}

/// Returns the variances of the range of the unsaturated points of a source that are nearer than
/// `reach_m` (m²): the part of their widths that the pulse alone does not explain.
fn range_variances_m2(lidar: &RearLidar, source: PointSource, reach_m: f32) -> Vec<f64> {
    let scan = lidar.latest();
    let is_taken = |point: &usize| {
        let truth = lidar.truth().points[*point];
        truth.source == source && truth.range_m < reach_m && scan.intensity[*point] < MAX_INTENSITY
    };
    let variance_m2 = |point: usize| {
        let width_ns = f64::from(scan.echoes.pulse_width_ns[point]);
        let sd_ns = 0.5 * width_ns / (2.0 * maths::ln(power(lidar, point, &Lidar::default()))).sqrt();
        (sd_ns * sd_ns - PULSE_SD_NS * PULSE_SD_NS) / (6.671_282 * 6.671_282)
    };
    (0..scan.len()).filter(is_taken).map(variance_m2).collect()
}

#[test]
fn a_complete_scan_reports_all_echoes_and_any_other_none() {
    let mut scanner = Scanner::new(Lidar::default());
    let setup = TestScene::new().with(VehicleClass::Car, 20.0, 0.0);
    for _ in 0..2 {
        let scan = scanner.scan(&setup.scene(), &mut random(0));
        assert!(scan.len() > 100 && scan.echoes.pulse_width_ns.is_empty() && scan.echoes.intensity.is_empty());
        scanner.complete();
        let scan = scanner.latest();
        assert_eq!([scan.echoes.pulse_width_ns.len(), scan.echoes.intensity.len()], [scan.len(); 2]);
        // Behind a clean window the two intensities are the same, to the bit.
        let bits = |values: &[f32]| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&scan.echoes.intensity), bits(&scan.intensity));
    }
}

#[test]
fn the_width_on_a_front_is_that_of_the_pulse_and_the_road_widens_it() {
    let lidar = complete(Lidar { false_alarm_rate: 0.0, ..Lidar::default() });
    let front = range_variances_m2(&lidar, PointSource::Actor(1), 30.0);
    assert!(front.len() > 100, "{}", front.len());
    assert!(median(front.clone()).abs() < 0.005, "{}", median(front));
    // The layers that meet the road within 9 m have rows of sub-rays some 0.3 m apart.
    let road = range_variances_m2(&lidar, PointSource::Ground, 9.0);
    assert!(road.len() > 100, "{}", road.len());
    // No echo is deeper than the length of a pulse, whose two ends have a variance of 0.375².
    assert!((0.01..0.375 * 0.375).contains(&median(road.clone())), "{}", median(road));
}

#[test]
fn dirt_on_the_window_lowers_the_widths_and_the_reported_intensities() {
    let clean = complete(Lidar { false_alarm_rate: 0.0, ..Lidar::default() });
    let dirty = complete(Lidar { false_alarm_rate: 0.0, window_transmission: 0.6, ..Lidar::default() });
    // Dirt can hide echoes, and adds none: the same return of a beam has the same noise and depth.
    let [clean_ns, dirty_ns] = [&clean, &dirty].map(|lidar| {
        let scan = lidar.latest();
        let mut widths_ns: BTreeMap<u16, Vec<f32>> = BTreeMap::new();
        for (beam, width_ns) in scan.beam.iter().zip(&scan.echoes.pulse_width_ns) {
            widths_ns.entry(*beam).or_default().push(*width_ns);
        }
        widths_ns
    });
    let mut falls = 0;
    for (beam, dirty_ns) in dirty_ns {
        if let (&[dirty_ns], [clean_ns]) = (&dirty_ns[..], &clean_ns[&beam][..]) {
            assert!(dirty_ns < *clean_ns, "beam {beam}: {dirty_ns} behind dirt, {clean_ns} without");
            falls += 1;
        }
    }
    assert!(falls > 100, "{falls}");
    let scan = dirty.latest();
    let mut compared = 0;
    for point in (0..scan.len()).filter(|&point| scan.intensity[point] < MAX_INTENSITY) {
        let share = scan.echoes.intensity[point] / scan.intensity[point];
        assert!((share / 0.36 - 1.0).abs() < 1e-4, "{share}");
        compared += 1;
    }
    assert!(compared > 100, "{compared}");
}

#[test]
fn a_spoilt_scan_reports_one_echo_for_each_point() {
    let fault = LidarFault {
        crosstalk: 5.0,
        blooming_deg: 2.0,
        dropout: 0.3,
        window_transmission: 0.7,
        ..LidarFault::default()
    };
    let mut lidar = RearLidar::new(Lidar::default());
    let setup = TestScene::new().with(VehicleClass::Car, 20.0, 0.0);
    lidar.scan_with([&setup.scene(), &setup.scene()], &mut random(0), Some(&fault));
    let lidar = lidar.completed().unwrap();
    let scan = lidar.latest();
    assert_eq!([scan.echoes.pulse_width_ns.len(), scan.echoes.intensity.len()], [scan.len(); 2]);
    assert!(scan.echoes.pulse_width_ns.iter().all(|width_ns| (0.0..100.0).contains(width_ns)));
    assert!(count(lidar.truth(), PointSource::False) > 20);
    // The loss of points keeps each entry with its point.
    for point in (0..scan.len()).filter(|&point| scan.intensity[point] < MAX_INTENSITY) {
        let share = scan.echoes.intensity[point] / scan.intensity[point];
        assert!((share / 0.49 - 1.0).abs() < 1e-4, "{share}");
    }
}
