//! One vehicle behind another: reaction times as they show from outside.

use proptest::prelude::*;

use crate::drive::{Drive, gap_m};

const LEAD: usize = 0;
const FOLLOWER: usize = 1;

/// cc0, the gap at standstill (m).
const STANDSTILL_GAP_M: f64 = 1.5;

/// How much less than cc0 the gap at standstill may be (m).
const REST_M: f64 = 0.2;

/// A lead vehicle at 30 m/s that brakes at 5 s, and a follower at the same speed.
struct Pair {
    gap_m: f64,
    cc1_s: f64,
    reaction_s: f64,
    brake_mps2: f64,
}

impl Pair {
    fn drive(&self, duration_s: f64) -> Drive {
        let Self { gap_m, cc1_s, reaction_s, brake_mps2 } = self;
        let actors = format!(
            r#"
[[actor]]
id = "lead"
vehicle = {{ class = "car" }}
start = {{ absolute = {{ lane = 2, s-m = 200.0, speed-mps = 30.0 }} }}
driver = {{ prescribed = {{ profile = [[0.0, 30.0]] }} }}
[[actor.event]]
id = "lead-brakes"
when = {{ at-s = 5.0 }}
then = {{ brake = {{ deceleration-mps2 = {brake_mps2:?} }} }}

[[actor]]
id = "follower"
vehicle = {{ class = "car" }}
start = {{ behind = {{ of = "lead", gap-m = {gap_m:?}, speed-mps = 30.0 }} }}
driver = {{ wiedemann99 = {{ cc1-s = {cc1_s:?}, reaction-s = {reaction_s:?} }} }}
"#
        );
        Drive::new(&actors, duration_s)
    }

    /// Returns the least gap until both vehicles stand (m). If they collide, returns the speed of the impact as a
    /// negative number (m/s).
    fn ending(&self) -> f64 {
        let drive = self.drive(50.0);
        if let Some(collision) = drive.outcome.collisions.first() {
            return -collision.relative_speed_mps;
        }
        let gaps = drive.instants.iter().map(|instant| gap_m(&instant.vehicles[LEAD], &instant.vehicles[FOLLOWER]));
        gaps.fold(f64::INFINITY, f64::min)
    }
}

#[test]
fn deceleration_follows_the_brake_light_by_the_reaction_time() {
    for reaction_s in [0.4, 0.9, 1.5] {
        let drive = Pair { gap_m: 29.0, cc1_s: 0.9, reaction_s, brake_mps2: 6.0 }.drive(10.0);
        let light_s = drive.first_s(LEAD, 0.0, |lead| lead.brake_light).unwrap();
        let commands: Vec<(f64, f64)> = drive.commands(FOLLOWER).filter(|(time_s, _)| *time_s >= light_s).collect();
        let answers = |pair: &&[(f64, f64)]| pair[1].1 < pair[0].1.min(-0.5) - 1e-9;
        let answer_s = commands.windows(2).find(answers).unwrap()[1].0;
        let delay_s = answer_s - light_s;
        assert!((delay_s - reaction_s).abs() <= 0.02, "{delay_s} instead of {reaction_s}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    /// The follower is in the band of its model, and the lead vehicle brakes to a standstill at a constant rate. A
    /// follower that stops in time rolls up to cc0, so that the reaction time decides the least gap only if room is
    /// short. A follower that has to brake hard until the end may stop up to 0.2 m closer than cc0. That distance does
    /// not depend monotonically on the reaction time.
    #[test]
    fn a_longer_reaction_never_gives_a_larger_least_gap(
        in_band in 0.2..3.8, cc1_s in 0.2..1.5, reaction_s in 0.0..1.8, longer_s in 0.05..1.0, brake_mps2 in 2.0..8.0,
    ) {
        let gap_m = 1.5 + cc1_s * 30.0 + in_band;
        let quick = Pair { gap_m, cc1_s, reaction_s, brake_mps2 }.ending();
        let slow = Pair { gap_m, cc1_s, reaction_s: reaction_s + longer_s, brake_mps2 }.ending();
        let tolerance_m = if quick > STANDSTILL_GAP_M - REST_M { REST_M } else { 0.02 };
        prop_assert!(slow <= quick + tolerance_m, "{slow} {quick}");
    }
}
