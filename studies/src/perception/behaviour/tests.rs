//! The measurement finds errors, delays and misses of known size.

use std::path::Path;

use rand::RngExt;

use closecall_scenarios::source;
use closecall_sensors::SensorMode;
use closecall_traffic::{ActorId, StandardNormal, Stream, maths, stream};

use super::*;

/// Deviations and correlation times of the synthetic errors: along (m), across (m) and of the speed
/// (m/s), and (s).
const SD: [f64; 3] = [0.05, 0.09, 0.3];
const TIME_S: [f64; 3] = [8.0, 2.0, 0.6];
/// Number of steps of an approach: 60 m at 4 m/s.
const STEPS: usize = 375;

fn rng(channel: &str) -> Stream {
    stream(3, 0, &ActorId::new("ego").unwrap(), channel)
}

/// Returns an approach with errors of a first-order Gauss–Markov process each.
fn approach(rng: &mut Stream) -> Vec<Step> {
    let decays = TIME_S.map(|time_s| maths::exp(-CONTROL_STEP.s() / time_s));
    let mut errors = SD.map(|sd| sd * rng.sample::<f64, _>(StandardNormal));
    (0..STEPS)
        .map(|step| {
            for axis in 0..3 {
                let fresh = SD[axis] * (1.0 - decays[axis] * decays[axis]).sqrt();
                errors[axis] = decays[axis] * errors[axis] + fresh * rng.sample::<f64, _>(StandardNormal);
            }
            let gap_m = GAPS_M[2] - (GAPS_M[2] - GAPS_M[0]) * step as f64 / STEPS as f64;
            Step { gap_m, seen: Some(Seen { errors: [errors[0], errors[1], errors[2], 0.0], is_coasting: false }) }
        })
        .collect()
}

fn shown(steps: Vec<Step>) -> Shown {
    Shown { steps, delays: Delays::default(), lags_s: None }
}

fn behaviour(mut change: impl FnMut(usize, &mut Vec<Step>)) -> Behaviour {
    let mut rng = rng("synthetic");
    let approaches = (0..400).map(|index| {
        let mut steps = approach(&mut rng);
        change(index, &mut steps);
        shown(steps)
    });
    Behaviour::of(&approaches.collect::<Vec<_>>())
}

#[test]
fn deviations_and_correlation_times_are_those_of_the_errors() {
    let measured = behaviour(|_, _| {});
    for axis in 0..3 {
        assert!((measured.sd[axis] / SD[axis] - 1.0).abs() < 0.1, "axis {axis}: {measured:?}");
        assert!((measured.time_s[axis] / TIME_S[axis] - 1.0).abs() < 0.25, "axis {axis}: {measured:?}");
    }
    assert_eq!([measured.missed, measured.longest_gap_s, measured.coasting], [0.0; 3]);
}

#[test]
fn errors_count_where_the_vehicle_is() {
    // Beyond 50 m, errors across are twice as large; beyond 80 m, they do not count.
    let measured = behaviour(|_, steps| {
        for step in steps.iter_mut().filter(|step| step.gap_m > 50.0) {
            step.seen.as_mut().unwrap().errors[1] *= 2.0;
        }
        let far = Seen { errors: [100.0; 4], is_coasting: false };
        steps.insert(0, Step { gap_m: 90.0, seen: Some(far) });
    });
    let [near, far] = measured.near_far_sd.map(|sd| sd[1]);
    assert!((near / SD[1] - 1.0).abs() < 0.1 && (far / SD[1] - 2.0).abs() < 0.2, "{near} {far}");
    assert!(measured.sd[0] < 0.06, "{measured:?}");
}

#[test]
fn misses_and_coasting_steps_are_counted_from_the_first_confirmation_on() {
    let measured = behaviour(|index, steps| {
        // Before the confirmation, nothing is missed. Afterwards 30 steps, in a gap of 10 and one
        // of 20; 50 coast.
        steps[..75].iter_mut().for_each(|step| step.seen = None);
        steps[100..110].iter_mut().for_each(|step| step.seen = None);
        steps[200..220].iter_mut().for_each(|step| step.seen = None);
        steps[300..350].iter_mut().for_each(|step| step.seen.as_mut().unwrap().is_coasting = index % 2 == 0);
    });
    assert!((measured.missed - 30.0 / 300.0).abs() < 1e-12, "{measured:?}");
    assert!((measured.longest_gap_s - 0.8).abs() < 1e-12, "{measured:?}");
    assert!((measured.coasting - 25.0 / 270.0).abs() < 1e-12, "{measured:?}");
}

#[test]
fn delays_are_means_of_the_vehicles_that_are_found_in_time() {
    let behaviour_with = |delays: &[Option<f64>]| {
        let shown = |confirmed_s: &Option<f64>| Shown {
            steps: Vec::new(),
            delays: Delays { confirmed_s: *confirmed_s, classified_s: confirmed_s.map(|after_s| after_s + 0.2) },
            lags_s: confirmed_s.map(|lag_s| [lag_s, 2.0 * lag_s]),
        };
        Behaviour::of(&delays.iter().map(shown).collect::<Vec<_>>())
    };
    let measured = behaviour_with(&[Some(0.16), Some(0.24), None]);
    assert!((measured.after_s[0] - 0.2).abs() < 1e-12 && (measured.after_s[1] - 0.4).abs() < 1e-12, "{measured:?}");
    assert!((measured.lag_s[0] - 0.2).abs() < 1e-12 && (measured.lag_s[1] - 0.4).abs() < 1e-12, "{measured:?}");
    let never = behaviour_with(&[Some(0.16), None, None]);
    assert_eq!((never.after_s, never.lag_s), ([f64::INFINITY; 2], [f64::INFINITY; 2]));
}

/// Returns the behaviour of the tracks of a usual car with an object-level sensor behind the ego,
/// with these settings.
fn object(settings: &[&str]) -> Behaviour {
    let settings: Vec<_> = settings.iter().map(|text| text.parse().unwrap()).collect();
    let file = source::load(Path::new("low-thw-overtake"), &settings).unwrap();
    let scenario = file.concrete(&file.space().nominal()).unwrap();
    let sensors = scenario.sensors.with_mode(SensorMode::Object);
    Behaviour::measure(&Case::usual(), &sensors, &scenario.road, [0, 20]).unwrap()
}

#[test]
fn the_latency_of_a_sensor_is_measured() {
    let [early, late] = ["0.04", "0.24"].map(|latency_s| {
        object(&[&format!("sensors.rear-object.latency-s={latency_s}"), "sensors.rear-object.dropout=0.0"])
    });
    for (early_s, late_s) in early.after_s.into_iter().zip(late.after_s) {
        assert!((late_s - early_s - 0.2).abs() < 0.02, "{early:?} {late:?}");
    }
}

#[test]
fn the_misses_of_a_sensor_are_measured() {
    // A car of this paint is also seen at a share of the distances beyond its range, and missed at the others.
    let whole = object(&["sensors.rear-object.dropout=0.0"]);
    let lossy = object(&["sensors.rear-object.dropout=0.3"]);
    assert!((lossy.coasting - whole.coasting - 0.3).abs() < 0.03, "{lossy:?} {whole:?}");
    assert!((lossy.missed - whole.missed).abs() < 0.01, "{lossy:?} {whole:?}");
    // Without coasting, a lost measurement ends the track, which three hits in five scans confirm
    // anew.
    let short = object(&["sensors.rear-object.dropout=0.3", "sensors.rear-object.coast-s=0.0"]);
    assert!(short.missed > 0.3 && short.longest_gap_s > 0.2 && short.coasting == 0.0, "{short:?}");
}
