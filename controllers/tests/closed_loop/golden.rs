//! Wiedemann 99 beside SUMO's: the same leaders, an independent implementation.
//!
//! `tests/golden/wiedemann99_sumo.py` makes the trajectories. They are a reference, not the truth: SUMO's cc9 has no
//! effect, its noise is its own, and its terms for closing in and closing up diverge near their thresholds (the model's
//! documentation says what is done here instead). What has to agree is the headway that it settles at, and that a
//! leader whom SUMO's follower survives is survived.

use std::collections::BTreeMap;
use std::io::Write;

use closecall_controllers::{DriverConfig, PrescribedConfig, Wiedemann99Config};
use closecall_traffic::{ActorId, Lane, Road, Time, Vehicle, VehicleClass, stream};

use crate::encounter::human;
use crate::world::{Actor, Who, World, gap_m};

const GOLDEN: &str = include_str!("../golden/wiedemann99_sumo.csv");

/// How far the gap may leave [safe, safe + cc2] behind a constant leader [m]: what the actuators' lag costs.
const OVERSHOOT_M: f64 = 0.1;

/// One instant of a golden trajectory.
#[derive(Clone, Copy, Debug)]
struct Row {
    time_s: f64,
    leader_mps: f64,
    follower_mps: f64,
    gap_m: f64,
}

/// One case: cc1 [s] and its rows.
struct Case {
    cc1_s: f64,
    rows: Vec<Row>,
}

fn cases() -> BTreeMap<String, Case> {
    let mut cases = BTreeMap::new();
    for line in GOLDEN.lines().skip(1) {
        let cells: Vec<&str> = line.split(',').collect();
        let number = |place: usize| cells[place].parse::<f64>().unwrap();
        let case = cases.entry(cells[0].to_owned()).or_insert_with(|| Case { cc1_s: number(1), rows: Vec::new() });
        case.rows.push(Row { time_s: number(2), leader_mps: number(3), follower_mps: number(4), gap_m: number(5) });
    }
    cases
}

/// Our follower behind the same leader: time, gap and speed at each step.
fn ours(case: &Case) -> Vec<(f64, f64, f64)> {
    let road = Road::straight(3);
    let d_m = road.lane_centre_m(Lane(2));
    let car = Vehicle::typical(VehicleClass::Car);
    let who = |config: &DriverConfig, name: &str| {
        Who::Human(human(config).build(), Box::new(stream(0, 0, &ActorId::new(name).unwrap(), "driver")))
    };
    let profile: Vec<_> = case.rows.iter().map(|row| [row.time_s, row.leader_mps]).collect();
    let leads = DriverConfig::Prescribed(PrescribedConfig::speeds(&profile));
    let follows = DriverConfig::Wiedemann99(Wiedemann99Config {
        cc1_s: Some(case.cc1_s.into()),
        desired_speed_mps: Some(36.0.into()),
        ..Wiedemann99Config::default()
    });
    let start = case.rows[0];
    let ahead_m = 100.0 + start.gap_m + car.dimensions.length_m;
    let leader = Actor::new(who(&leads, "leader"), car, ahead_m, d_m, start.leader_mps);
    let follower = Actor::new(who(&follows, "follower"), car, 100.0, d_m, start.follower_mps);
    let mut world = World::new(vec![leader, follower], road);
    let end = Time::from_s(case.rows[case.rows.len() - 1].time_s);
    let mut seen = Vec::new();
    while world.time < end {
        world.step();
        let [leader, follower] = &world.actors[..] else { unreachable!("two vehicles drive here") };
        seen.push((world.time.s(), gap_m(leader, follower), follower.state.speed_mps));
    }
    seen
}

/// Mean time headway in the second half of a run [s].
fn mean_thw_s(seen: impl Iterator<Item = (f64, f64, f64)> + Clone) -> f64 {
    let end_s = seen.clone().map(|(time_s, ..)| time_s).fold(0.0, f64::max);
    let late: Vec<f64> =
        seen.filter(|(time_s, ..)| *time_s > 0.5 * end_s).map(|(_, gap_m, speed_mps)| gap_m / speed_mps).collect();
    late.iter().sum::<f64>() / late.len() as f64
}

fn least_gap_m(seen: impl Iterator<Item = f64>) -> f64 {
    seen.fold(f64::INFINITY, f64::min)
}

#[test]
fn behind_a_constant_leader_the_gap_settles_into_its_band_and_the_headway_is_that_of_sumo() {
    let mut compared = 0;
    for (name, case) in cases().iter().filter(|(name, _)| name.starts_with("constant")) {
        let seen = ours(case);
        let settled: Vec<f64> = seen[seen.len() / 2..].iter().map(|(_, gap_m, _)| *gap_m).collect();
        let safe_m = 1.5 + case.cc1_s * case.rows[0].leader_mps;
        let (least_m, most_m) = (least_gap_m(settled.iter().copied()), settled.iter().copied().fold(0.0, f64::max));
        let thw_s = mean_thw_s(seen.iter().copied());
        let sumo_s = mean_thw_s(case.rows.iter().map(|row| (row.time_s, row.gap_m, row.follower_mps)));
        writeln!(
            std::io::stdout(),
            "{name}: gap {least_m:.2} to {most_m:.2} m in [{safe_m:.2}, {:.2}], mean THW {thw_s:.3} s, SUMO {sumo_s:.3} s",
            safe_m + 4.0
        )
        .unwrap();
        assert!(least_m > safe_m - OVERSHOOT_M && most_m < safe_m + 4.0 + OVERSHOOT_M, "{name}: {least_m} to {most_m}");
        if case.cc1_s <= 0.9 {
            compared += 1;
            assert!((thw_s - sumo_s).abs() < 0.1, "{name}: {thw_s} s instead of {sumo_s} s");
        }
    }
    assert_eq!(compared, 8);
}

#[test]
fn a_braking_leader_whom_sumo_survives_is_survived() {
    let mut survived = 0;
    for (name, case) in cases().iter().filter(|(name, _)| name.starts_with("braking")) {
        let sumo_m = least_gap_m(case.rows.iter().map(|row| row.gap_m));
        let least_m = least_gap_m(ours(case).iter().map(|(_, gap_m, _)| *gap_m));
        writeln!(std::io::stdout(), "{name}: least gap {least_m:.2} m, SUMO {sumo_m:.2} m").unwrap();
        if sumo_m > 0.0 {
            survived += 1;
            assert!(least_m > 0.0, "{name}: {least_m} m, SUMO {sumo_m} m");
        }
    }
    assert!(survived >= 20, "{survived}");
}

#[test]
fn behind_a_leader_whose_speed_swings_the_mean_headway_is_near_that_of_sumo() {
    for (name, case) in cases().iter().filter(|(name, _)| name.starts_with("waves")) {
        let seen = ours(case);
        let thw_s = mean_thw_s(seen.iter().copied());
        let sumo_s = mean_thw_s(case.rows.iter().map(|row| (row.time_s, row.gap_m, row.follower_mps)));
        writeln!(std::io::stdout(), "{name}: mean THW {thw_s:.3} s, SUMO {sumo_s:.3} s").unwrap();
        assert!(case.cc1_s > 0.9 || (thw_s - sumo_s).abs() < 0.15, "{name}: {thw_s} s instead of {sumo_s} s");
        assert!(least_gap_m(seen.iter().map(|(_, gap_m, _)| *gap_m)) > 1.5);
    }
}
