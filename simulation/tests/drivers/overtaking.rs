//! The overtaking driver behind one slow vehicle: the driver signals, gives up, and returns.

use closecall_controllers::DriverNote;
use closecall_traffic::{Indicator, Lane};

use crate::drive::{Drive, gap_m};

const SLOW: usize = 0;
const REAR: usize = 1;

/// A slow vehicle at 28 m/s in the middle lane.
const SLOW_VEHICLE: &str = r#"
[[actor]]
id = "slow"
vehicle = { class = "car" }
start = { absolute = { lane = 2, s-m = 200.0, speed-mps = 28.0 } }
driver = { prescribed = { profile = [[0.0, 28.0]] } }
"#;

/// A vehicle at 36 m/s that starts 90 m behind the slow one, and overtakes.
struct Overtaker {
    cut_out_thw_s: f64,
    cc1_s: f64,
    /// More keys of the driver, each preceded by a comma.
    more: &'static str,
}

impl Overtaker {
    const TYPICAL: Self = Self { cut_out_thw_s: 0.4, cc1_s: 0.1, more: "" };

    /// Runs the slow vehicle, the overtaker and the tables `others`. No vehicle may collide.
    fn drive(&self, others: &str, duration_s: f64) -> Drive {
        let Self { cut_out_thw_s, cc1_s, more } = self;
        let rear = format!(
            r#"
[[actor]]
id = "rear"
vehicle = {{ class = "car" }}
start = {{ behind = {{ of = "slow", gap-m = 90.0, speed-mps = 36.0 }} }}

[actor.driver.overtaker]
cut-out-thw-s = {cut_out_thw_s:?}
reaction-s = 0.8
lane-change-duration-s = 5.0
follow = {{ wiedemann99 = {{ cc1-s = {cc1_s:?} }} }}
{more}
"#
        );
        let drive = Drive::new(&format!("{SLOW_VEHICLE}{rear}{others}"), duration_s);
        assert_eq!(drive.outcome.collisions, []);
        drive
    }
}

#[test]
fn the_overtaker_signals_before_it_pulls_out() {
    let drive = Overtaker::TYPICAL.drive("", 60.0);
    let signals_s = drive.first_s(REAR, 0.0, |rear| rear.indicator == Indicator::Left).unwrap();
    let before_s = drive.noted_s(REAR, DriverNote::CutOutStarted).unwrap() - signals_s;
    assert!((1.8..2.2).contains(&before_s), "{before_s}");
}

#[test]
fn the_overtaker_crosses_the_marking_at_the_requested_headway() {
    for cut_out_thw_s in [0.15, 0.2, 0.3, 0.4] {
        let drive = Overtaker { cut_out_thw_s, cc1_s: 0.02, more: "" }.drive("", 60.0);
        let crossing_s = drive.first_s(REAR, 0.0, |rear| drive.road.lane_at(rear.s_m, rear.d_m) == Lane(1)).unwrap();
        let [slow, rear] = [SLOW, REAR].map(|actor| drive.at(actor, crossing_s));
        let thw_s = gap_m(slow, rear) / rear.speed_mps;
        assert!((thw_s - cut_out_thw_s).abs() < 0.1, "{thw_s} instead of {cut_out_thw_s}");
        assert!(drive.noted_s(REAR, DriverNote::Passed).is_some(), "{cut_out_thw_s}");
    }
}

#[test]
fn the_overtaker_returns_after_passing_if_the_scenario_says_so() {
    let returns = Overtaker { more: "returns = { after-s = 1.0, thw-s = 0.8 }", ..Overtaker::TYPICAL };
    let drive = returns.drive("", 60.0);
    let passed_s = drive.noted_s(REAR, DriverNote::Passed).unwrap();
    assert_eq!(drive.lane(REAR, passed_s), Lane(1));
    let signals_s = drive.first_s(REAR, passed_s, |rear| rear.indicator == Indicator::Right).unwrap();
    assert!(signals_s - passed_s >= 1.0);
    let centre_m = drive.road.lane_centre_m(Lane(2), 0.0);
    let returned_s = drive.first_s(REAR, signals_s, |rear| rear.d_m <= centre_m + 1e-9).unwrap();
    // The headway is long enough when the vehicle begins to return. It then grows, because the vehicle is faster.
    assert!(gap_m(drive.at(REAR, returned_s), drive.at(SLOW, returned_s)) > 0.8 * 28.0);
}

#[test]
fn the_overtaker_stays_in_the_passing_lane_if_the_scenario_has_no_key_returns() {
    let drive = Overtaker::TYPICAL.drive("", 60.0);
    assert_eq!(drive.lane(REAR, 59.9), Lane(1));
}

#[test]
fn the_overtaker_gives_up_and_brakes_if_the_gap_closes() {
    let cut_out_s = Overtaker::TYPICAL.drive("", 60.0).noted_s(REAR, DriverNote::CutOutStarted).unwrap();
    // A motorcycle in the passing lane, 20 m behind at the same speed, accelerates as soon as the overtaker pulls out. A
    // car of the simulation would accelerate at 4 m/s² at most. If the motorcycle started 30 m behind, the driver would give
    // up 0.25 m before the marking, at a lateral speed of 1.4 m/s. The plant keeps that speed at first, and the centre would
    // get 0.4 m past the marking.
    let (from_s, to_s) = (cut_out_s + 0.1, cut_out_s + 2.1);
    let shoots = format!(
        r#"
[[actor]]
id = "shoots"
vehicle = {{ class = "motorcycle" }}
start = {{ behind = {{ of = "rear", gap-m = 20.0, speed-mps = 36.0, lane = 1 }} }}
driver = {{ prescribed = {{ acceleration-profile = [[{from_s:?}, 5.0], [{to_s:?}, 0.0]] }} }}
"#
    );
    let drive = Overtaker::TYPICAL.drive(&shoots, 90.0);
    let aborted_s = drive.noted_s(REAR, DriverNote::CutOutAborted).unwrap();
    let centre_m = drive.road.lane_centre_m(Lane(2), 0.0);
    let back_s = drive.first_s(REAR, aborted_s + 0.1, |rear| (rear.d_m - centre_m).abs() < 1e-9).unwrap();
    let meanwhile = || {
        let instants = drive.instants.iter().filter(|instant| (aborted_s..back_s).contains(&instant.time.s()));
        instants.map(|instant| &instant.vehicles[REAR])
    };
    assert!(meanwhile().all(|rear| drive.road.lane_at(rear.s_m, rear.d_m) == Lane(2)));
    let hardest_mps2 = meanwhile().map(|rear| rear.acceleration_mps2).fold(0.0, f64::min);
    assert!(hardest_mps2 < -1.0, "{hardest_mps2}");
    // Once the other vehicle is past, the driver overtakes after all.
    assert!(drive.noted_s(REAR, DriverNote::Passed).is_some_and(|passed_s| passed_s > back_s));
}

#[test]
fn the_overtaker_follows_a_slow_vehicle_that_changes_lanes_in_front_of_it() {
    // The slower vehicle comes into the driver's way after the driver has begun to pull out, 1.2 s behind it.
    let pulls_out = |at_s: f64| {
        format!(
            r#"
[[actor]]
id = "slow"
vehicle = {{ class = "car" }}
start = {{ absolute = {{ lane = 2, s-m = 200.0, speed-mps = 28.0 }} }}
driver = {{ prescribed = {{ profile = [[0.0, 28.0]], lane-changes = [{{ at-s = {at_s:?}, to = "left", duration-s = 4.0 }}] }} }}

[[actor]]
id = "rear"
vehicle = {{ class = "car" }}
start = {{ behind = {{ of = "slow", gap-m = 90.0, speed-mps = 36.0 }} }}

[actor.driver.overtaker]
cut-out-thw-s = 1.2
reaction-s = 0.8
lane-change-duration-s = 5.0
follow = {{ wiedemann99 = {{ cc1-s = 0.9 }} }}
"#
        )
    };
    let begins_s = Drive::new(&pulls_out(50.0), 60.0).noted_s(REAR, DriverNote::CutOutStarted).unwrap();
    let drive = Drive::new(&pulls_out(begins_s + 1.5), 60.0);
    assert_eq!(drive.outcome.collisions, []);
    assert_eq!([SLOW, REAR].map(|actor| drive.lane(actor, 59.9)), [Lane(1); 2]);
    assert!(drive.noted_s(REAR, DriverNote::Passed).is_none());
    let [slow, rear] = [SLOW, REAR].map(|actor| drive.at(actor, 59.9));
    assert!((rear.speed_mps - 28.0).abs() < 1.5, "{}", rear.speed_mps);
    assert!((15.0..60.0).contains(&gap_m(slow, rear)), "{}", gap_m(slow, rear));
}

/// Returns the time at which a follower commands more than 1 m/s² of braking, if the vehicle ahead brakes at 3 s (s).
fn answers_at_s(lapse: &str) -> f64 {
    let brakes = r#"
[[actor.event]]
id = "slow-brakes"
when = { at-s = 3.0 }
then = { brake = { deceleration-mps2 = 4.0 } }
"#;
    let follower = format!(
        r#"
[[actor]]
id = "rear"
vehicle = {{ class = "car" }}
start = {{ behind = {{ of = "slow", gap-m = 27.4, speed-mps = 28.0 }} }}
driver = {{ wiedemann99 = {{ cc1-s = 0.9, reaction-s = 0.7{lapse} }} }}
"#
    );
    let drive = Drive::new(&format!("{SLOW_VEHICLE}{brakes}{follower}"), 6.0);
    drive.commands(REAR).find(|(_, commanded_mps2)| *commanded_mps2 < -1.0).unwrap().0
}

#[test]
fn a_driver_who_looks_away_reacts_to_a_brake_light_later() {
    let attentive_s = answers_at_s("");
    assert!((3.7..3.9).contains(&attentive_s), "{attentive_s}");
    let lapse_s = answers_at_s(", lapse = { at-s = 2.5, duration-s = 1.2 }");
    assert!((lapse_s - (2.5 + 1.2 + 0.7)).abs() < 0.05, "{lapse_s}");
}
