//! Tests of the filter of one track: parts of a face, and several sensors.

use super::*;

const EGO: EgoRear = EgoRear { s_m: 80.0, d_m: 0.0, speed_mps: 30.0, half_lane_m: 1.875 };
const SCAN_S: f64 = 0.04;

/// Returns a measured place across the road: the middle, known to 4 cm, or a part.
fn seen(step: u32, d_m: f64, is_part: bool) -> Measurement {
    let axis = |position_m, sd_m: f64| AxisMeasurement {
        position_m,
        white_sd_m: 0.5 * sd_m,
        slow_sd_m: 0.8 * sd_m,
        time_offset_s: 0.0,
    };
    let s_m = 30.0 * SCAN_S * f64::from(step);
    Measurement {
        along: axis(s_m, 0.04),
        across: axis(d_m, if is_part { 0.46 } else { 0.04 }),
        is_part,
        knows_middle: !is_part,
        seen: Span {
            is_cut: false,
            is_face: true,
            along_m: [s_m; 2],
            across_m: [d_m; 2],
            spacing_m: [f64::INFINITY; 2],
            wheels: WheelFronts::NONE,
            top_m: 1.5,
            points: 40,
        },
    }
}

/// Returns the estimate across the road after these measurements. The first is the one of step 0.
fn across(all: impl IntoIterator<Item = Measurement>) -> AxisEstimate {
    let mut all = all.into_iter();
    let mut filter = RoadFilter::new(&all.next().unwrap(), 30.0, Some(0));
    let mut at_s = 0.0;
    for measurement in all {
        let to_s = measurement.along.position_m / 30.0;
        filter.predict(to_s - at_s, &EGO);
        at_s = to_s;
        filter.correct(&measurement, 2.3, Some(0));
    }
    filter.estimate()[1]
}

#[test]
fn a_lamp_between_plates_does_not_move_the_track() {
    for lamp_m in [-0.7, 0.7] {
        let estimate = across((0..400).map(|step| {
            let is_part = step % 2 == 1;
            seen(step, if is_part { lamp_m } else { 0.0 }, is_part)
        }));
        assert!(estimate.position_m.abs() < 0.01, "{estimate:?}");
        // Nor does one that came first.
        let estimate = across((0..400).map(|step| {
            let is_part = step % 2 == 0;
            seen(step, if is_part { lamp_m } else { 0.0 }, is_part)
        }));
        assert!(estimate.position_m.abs() < 0.02, "{estimate:?}");
        assert!(estimate.position_variance_m2.sqrt() < 0.05, "{estimate:?}");
    }
}

/// Returns the estimate across the road after 16 s. Sensor 0 measures in every `first` scan, except
/// every 25th scan. Sensor 1 measures in every `second` scan, `off_m` to the side.
fn across_of_two([first, second]: [u32; 2], off_m: f64) -> AxisEstimate {
    let mut filter = RoadFilter::new(&seen(0, 0.0, false), 30.0, Some(0));
    for step in 1..400 {
        filter.predict(SCAN_S, &EGO);
        if step % first == 0 && step % 25 != 0 {
            filter.correct(&seen(step, 0.0, false), 2.3, Some(0));
        }
        if step % second == 0 {
            filter.correct(&seen(step, off_m, false), 2.3, Some(1));
        }
    }
    filter.estimate()[1]
}

#[test]
fn a_sensor_that_contradicts_the_followed_sensor_does_not_pull_the_track_apart() {
    for scans in [[1, 1], [3, 1], [1, 3], [2, 3]] {
        for off_m in [0.0, 0.02, 0.3, 0.6, 1.5] {
            let estimate = across_of_two(scans, off_m);
            // Within their errors of 0.04 m, both count.
            let bounds_m = if off_m <= 0.02 { [0.0, off_m] } else { [0.0; 2] };
            assert!(
                (bounds_m[0] - 0.005..bounds_m[1] + 0.005).contains(&estimate.position_m),
                "{scans:?} {off_m}: {estimate:?}"
            );
            assert!(estimate.speed_mps.abs() < 0.05, "{scans:?} {off_m}: {estimate:?}");
        }
    }
}

#[test]
fn a_track_follows_another_sensor_once_its_own_has_not_measured_for_a_while() {
    let mut filter = RoadFilter::new(&seen(0, 0.0, false), 30.0, Some(0));
    for step in 1..100 {
        filter.predict(SCAN_S, &EGO);
        filter.correct(&seen(step, 0.0, false), 2.3, Some(usize::from(step >= 50)));
    }
    // Sensor 0 is back, and off.
    for step in 100..150 {
        filter.predict(SCAN_S, &EGO);
        filter.correct(&seen(step, 0.5, false), 2.3, Some(0));
        filter.correct(&seen(step, 0.0, false), 2.3, Some(1));
    }
    let [_, across] = filter.estimate();
    assert!(across.position_m.abs() < 0.005, "{across:?}");
}

#[test]
fn a_lamp_counts_once_the_middle_has_not_been_seen_for_a_second() {
    // The vehicle moves into the next lane, with 1 m/s, while only a lamp in its middle is seen.
    let after = |seconds: f64| {
        let d_m = |step: u32| (SCAN_S * f64::from(step.saturating_sub(100))).min(3.75);
        let until = 100 + (seconds / SCAN_S) as u32;
        (across((0..until).map(|step| seen(step, d_m(step), step >= 100))), d_m(until - 1))
    };
    let (estimate, _) = after(0.9);
    assert!(estimate.position_m.abs() < 0.05, "{estimate:?}");
    for seconds in [2.5, 5.0, 8.0] {
        let (estimate, d_m) = after(seconds);
        let sd_m = estimate.position_variance_m2.sqrt();
        assert!((estimate.position_m - d_m).abs() < 3.0 * sd_m, "{estimate:?} instead of {d_m} m after {seconds} s");
        // Where the lamp is on the vehicle remains unknown.
        assert!((0.1..0.6).contains(&sd_m), "{estimate:?}");
    }
}

#[test]
fn a_camera_that_does_not_know_the_middle_does_not_silence_a_lamp() {
    let poor = |step: u32| {
        let across = AxisMeasurement { white_sd_m: 0.7, slow_sd_m: 0.7, ..seen(step, 0.0, false).across };
        Measurement { across, knows_middle: false, ..seen(step, 0.0, false) }
    };
    let estimate = across((0..200).map(|step| if step % 2 == 0 { poor(step) } else { seen(step, 0.7, true) }));
    assert!(estimate.position_m > 0.2, "{estimate:?}");
}
