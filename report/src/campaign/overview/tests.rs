use std::path::Path;

use closecall_traffic::{Absent, ParameterName, Parameters, Value};

use closecall_scenarios::ScenarioFile;

use super::*;
use crate::campaign::outcomes::tests::rows;
use closecall_campaign::record::{ArmRecord, Record, SampleFailure};

fn file() -> ScenarioFile {
    let text = include_str!("../../../../scenarios/library/low-thw-overtake.toml");
    ScenarioFile::parse(Path::new("low-thw-overtake.toml"), text, &[]).unwrap()
}

fn arms() -> Vec<String> {
    vec!["acc".to_owned(), "mis".to_owned()]
}

/// Returns a journal record whose arms collide as given. Beside `closing-mps` and `rear-class`, the
/// parameters do not depend on the outcome.
fn record(sample: u64, closing_mps: f64, class: &str, collided: [bool; 2]) -> Record {
    let rows = rows();
    let [hit, miss] = [0, 1].map(|row| rows[row].result.clone().unwrap());
    let named = |name: &str, value| (ParameterName::new(name).unwrap(), value);
    // A value that is independent of the outcome.
    let phase = 0.6 * ((sample * 37 % 101) as f64 / 101.0);
    let parameters: Parameters = [
        named("closing-mps", Value::Number(closing_mps)),
        named("brake-phase", Value::Number(phase)),
        named("rear-class", Value::Label(class.to_owned())),
    ]
    .into_iter()
    .collect();
    let arm = |(controller, collided): (String, bool)| {
        let mut outcome = if collided { hit.clone() } else { miss.clone() };
        (outcome.sample, outcome.parameters) = (sample, parameters.clone());
        outcome.controller.clone_from(&controller);
        ArmRecord::new(controller, Ok(outcome))
    };
    Record {
        scenario: "low-thw-overtake".to_owned(),
        sample,
        arms: arms().into_iter().zip(collided).map(arm).collect(),
    }
}

fn filled(samples: u64) -> Overview {
    let file = file();
    let mut overview = Overview::new([&file], &arms());
    for sample in 0..samples {
        let closing_mps = 2.8 + 11.1 * ((sample * 61 % 127) as f64 / 127.0);
        let is_fast = closing_mps > 8.0;
        let class = if sample.is_multiple_of(3) { "motorcycle" } else { "car" };
        overview.push(&record(sample, closing_mps, class, [is_fast, is_fast && sample.is_multiple_of(5)]));
    }
    overview
}

#[test]
fn the_map_shows_the_parameter_that_decides() {
    let overview = filled(900);
    let scenario = &overview.scenarios[0];
    let map = scenario.map().unwrap();
    assert!(map.axes.iter().any(|&axis| scenario.axes[axis].name() == "closing-mps"), "{:?}", map.axes);
    // Parameters without influence have no information beyond chance.
    let blind = scenario
        .pairs
        .iter()
        .find(|pair| pair.axes.iter().all(|&axis| ["brake-phase", "rear-class"].contains(&scenario.axes[axis].name())))
        .unwrap();
    assert!(
        blind.information_nat().abs() < 0.1 * map.information_nat(),
        "{} {}",
        blind.information_nat(),
        map.information_nat()
    );
}

#[test]
fn every_sample_is_counted_once() {
    let overview = filled(900);
    let scenario = &overview.scenarios[0];
    assert_eq!(scenario.totals.iter().map(|arm| arm.samples).collect::<Vec<_>>(), [900, 900]);
    for (axis, counts) in scenario.axes.iter().zip(&scenario.coverage) {
        let sampled = ["closing-mps", "brake-phase", "rear-class"].contains(&axis.name());
        let counted: u64 = counts.iter().flatten().sum();
        assert_eq!(counted, if sampled { 900 } else { 0 }, "{}", axis.name());
    }
    let binned = |bins: &MarginBins| bins.counts.iter().sum::<u64>() + bins.absent;
    assert!(scenario.margins.iter().flatten().all(|bins| binned(bins) == 900));
}

#[test]
fn the_number_of_points_is_bounded_and_their_choice_does_not_depend_on_the_order() {
    let file = file();
    let points = |order: &mut dyn Iterator<Item = u64>| {
        let mut overview = Overview::new([&file], &arms());
        order.for_each(|sample| overview.push(&record(sample, 5.0, "car", [false, false])));
        overview.scenarios[0].points().map(|point| point.sample).collect::<Vec<_>>()
    };
    let forward = points(&mut (0..3_000));
    assert_eq!(forward.len(), 400);
    assert_eq!(forward, points(&mut (0..3_000).rev()));
    // About half of the points are from the first half of the samples.
    let early = forward.iter().filter(|sample| **sample < 1_500).count();
    assert!((150..250).contains(&early), "{early}");
}

#[test]
fn the_worst_samples_come_first_and_nan_is_the_worst() {
    let file = file();
    let mut overview = Overview::new([&file], &arms());
    let mut push = |sample, ttc_s, delta_v_mps: Option<f64>| {
        // Sample 8 is induced, the other collisions are in both arms.
        let collided = delta_v_mps.is_some();
        let mut record = record(sample, 5.0, "car", [collided && sample != 8, collided]);
        let outcome = record.arms[1].result.as_mut().unwrap();
        outcome.margins.min_ttc_rear_s = ttc_s;
        if let Some(delta_v_mps) = delta_v_mps {
            outcome.collisions[0].delta_v_mps = [delta_v_mps, 99.0];
        }
        overview.push(&record);
    };
    push(1, Ok(3.0), None);
    push(2, Ok(1.0), None);
    push(3, Err(Absent::NotApproaching), None);
    push(4, Ok(2.0), Some(2.0));
    push(5, Ok(2.0), Some(7.0));
    push(6, Ok(f64::NAN), None);
    push(7, Ok(2.0), Some(f64::NAN));
    push(8, Ok(2.0), Some(0.5));
    let order: Vec<u64> = overview.scenarios[0].worst.iter().map(|sample| sample.sample).collect();
    assert_eq!(order, [8, 7, 5, 4, 6, 2, 1, 3]);
}

#[test]
fn an_error_is_not_a_pass() {
    let file = file();
    let mut overview = Overview::new([&file], &arms());
    let mut broken = record(7, 5.0, "car", [false, false]);
    broken.arms[1].result = Err(SampleFailure { kind: "panic".to_owned(), message: "a panic: no".to_owned() });
    overview.push(&broken);
    broken.sample = 9;
    overview.push(&broken);
    let scenario = &overview.scenarios[0];
    assert_eq!(scenario.totals[1], ArmTotals { samples: 2, failures: 0, errors: 2 });
    assert!(scenario.points().all(|point| point.fate == Fate::Error));
}
