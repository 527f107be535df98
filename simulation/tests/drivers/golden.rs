//! The Wiedemann 99 driver beside an independent implementation, the one of SUMO, behind the same lead vehicles.
//!
//! `tests/golden/wiedemann99_sumo.py` generates the trajectories. They are a reference, not the truth: in SUMO cc9 has no
//! effect, the noise differs, and the terms for closing in and closing up diverge near their thresholds (the
//! documentation of `closecall_controllers` states what its model does instead). Two things have to agree: the time
//! headway to which the follower settles, and that no collision occurs if SUMO's follower avoids one.

use std::collections::BTreeMap;
use std::io::Write;

use crate::drive::{Drive, gap_m};

const GOLDEN: &str = include_str!("../golden/wiedemann99_sumo.csv");

/// How far the gap may leave [safe, safe + cc2] behind a lead vehicle of constant speed (m), because the actuators lag.
const OVERSHOOT_M: f64 = 0.1;

/// cc0 (m).
const CC0_M: f64 = 1.5;

/// cc2, the width of the band (m).
const CC2_M: f64 = 4.0;

/// One instant of a trajectory of SUMO.
#[derive(Clone, Copy, Debug)]
struct Row {
    time_s: f64,
    lead_mps: f64,
    follower_mps: f64,
    gap_m: f64,
}

/// One case of SUMO.
struct Case {
    cc1_s: f64,
    rows: Vec<Row>,
}

fn cases() -> BTreeMap<String, Case> {
    let mut cases = BTreeMap::new();
    for line in GOLDEN.lines().skip(1) {
        let cells: Vec<&str> = line.split(',').collect();
        let number = |index: usize| cells[index].parse::<f64>().unwrap();
        let case = cases.entry(cells[0].to_owned()).or_insert_with(|| Case { cc1_s: number(1), rows: Vec::new() });
        case.rows.push(Row { time_s: number(2), lead_mps: number(3), follower_mps: number(4), gap_m: number(5) });
    }
    cases
}

/// One instant of a follower.
#[derive(Clone, Copy)]
struct Seen {
    time_s: f64,
    gap_m: f64,
    speed_mps: f64,
}

impl Case {
    /// Returns what SUMO's follower does.
    fn sumo(&self) -> Vec<Seen> {
        let seen = |row: &Row| Seen { time_s: row.time_s, gap_m: row.gap_m, speed_mps: row.follower_mps };
        self.rows.iter().map(seen).collect()
    }

    /// Returns what the follower of the closed loop does behind the same lead vehicle. It brakes as strongly as SUMO's, 8 m/s².
    fn closed_loop(&self) -> Vec<Seen> {
        let profile: Vec<[f64; 2]> = self.rows.iter().map(|row| [row.time_s, row.lead_mps]).collect();
        let (start, cc1_s) = (self.rows[0], self.cc1_s);
        let actors = format!(
            r#"
[[actor]]
id = "lead"
vehicle = {{ class = "car" }}
start = {{ absolute = {{ lane = 2, s-m = 200.0, speed-mps = {:?} }} }}
driver = {{ prescribed = {{ profile = {profile:?} }} }}

[[actor]]
id = "follower"
vehicle = {{ class = "car" }}
start = {{ behind = {{ of = "lead", gap-m = {:?}, speed-mps = {:?} }} }}
driver = {{ wiedemann99 = {{ cc1-s = {cc1_s:?}, desired-speed-mps = 36.0, hardest-braking-mps2 = 8.0 }} }}
"#,
            start.lead_mps, start.gap_m, start.follower_mps
        );
        let drive = Drive::new(&actors, self.rows[self.rows.len() - 1].time_s);
        let seen = drive.instants.iter().map(|instant| {
            let [lead, follower, _] = &instant.vehicles[..] else { unreachable!("three vehicles") };
            Seen { time_s: instant.time.s(), gap_m: gap_m(lead, follower), speed_mps: follower.speed_mps }
        });
        seen.collect()
    }
}

/// Returns the mean time headway in the second half of a run (s).
fn mean_thw_s(seen: &[Seen]) -> f64 {
    let end_s = seen[seen.len() - 1].time_s;
    let late = seen.iter().filter(|seen| seen.time_s > 0.5 * end_s);
    let thw_s: Vec<f64> = late.map(|seen| seen.gap_m / seen.speed_mps).collect();
    thw_s.iter().sum::<f64>() / thw_s.len() as f64
}

fn least_gap_m(seen: &[Seen]) -> f64 {
    seen.iter().map(|seen| seen.gap_m).fold(f64::INFINITY, f64::min)
}

#[test]
fn behind_a_lead_vehicle_of_constant_speed_the_gap_settles_into_its_band_and_the_headway_is_that_of_sumo() {
    let mut compared = 0;
    for (name, case) in cases().iter().filter(|(name, _)| name.starts_with("constant")) {
        let seen = case.closed_loop();
        let settled = &seen[seen.len() / 2..];
        let safe_m = CC0_M + case.cc1_s * case.rows[0].lead_mps;
        let most_m = settled.iter().map(|seen| seen.gap_m).fold(0.0, f64::max);
        let least_m = least_gap_m(settled);
        let (thw_s, sumo_s) = (mean_thw_s(&seen), mean_thw_s(&case.sumo()));
        let limit_m = safe_m + CC2_M;
        writeln!(
            std::io::stdout(),
            "{name}: gap {least_m:.2} to {most_m:.2} m in [{safe_m:.2}, {limit_m:.2}], mean THW {thw_s:.3} s, SUMO {sumo_s:.3} s"
        )
        .unwrap();
        assert!(least_m > safe_m - OVERSHOOT_M && most_m < limit_m + OVERSHOOT_M, "{name}: {least_m} to {most_m}");
        if case.cc1_s <= 0.9 {
            compared += 1;
            assert!((thw_s - sumo_s).abs() < 0.1, "{name}: {thw_s} s instead of {sumo_s} s");
        }
    }
    assert_eq!(compared, 8);
}

#[test]
fn no_collision_with_a_braking_lead_vehicle_occurs_if_sumo_avoids_it() {
    let mut avoided = 0;
    for (name, case) in cases().iter().filter(|(name, _)| name.starts_with("braking")) {
        let (least_m, sumo_m) = (least_gap_m(&case.closed_loop()), least_gap_m(&case.sumo()));
        writeln!(std::io::stdout(), "{name}: least gap {least_m:.2} m, SUMO {sumo_m:.2} m").unwrap();
        if sumo_m > 0.0 {
            avoided += 1;
            assert!(least_m > 0.0, "{name}: {least_m} m, SUMO {sumo_m} m");
        }
    }
    assert!(avoided >= 20, "{avoided}");
}

#[test]
fn behind_a_lead_vehicle_of_oscillating_speed_the_mean_headway_is_near_that_of_sumo() {
    for (name, case) in cases().iter().filter(|(name, _)| name.starts_with("waves")) {
        let seen = case.closed_loop();
        let (thw_s, sumo_s) = (mean_thw_s(&seen), mean_thw_s(&case.sumo()));
        writeln!(std::io::stdout(), "{name}: mean THW {thw_s:.3} s, SUMO {sumo_s:.3} s").unwrap();
        assert!(case.cc1_s > 0.9 || (thw_s - sumo_s).abs() < 0.15, "{name}: {thw_s} s instead of {sumo_s} s");
        assert!(least_gap_m(&seen) > CC0_M);
    }
}
