//! Tests the same faults of each kind of object-level sensor: the front radar, the surround sensors
//! and the rear sensor.

use super::*;
use closecall_traffic::maths;

/// A sensor, with a car that it sees.
struct Kind {
    key: &'static str,
    source: Source,
    /// Gap of the car that it sees (m): ahead for the front radar, behind for the others.
    gap_m: f64,
    /// Speed at which the gap closes in tests of approaching vehicles (m/s).
    closing_mps: f64,
}

const KINDS: [Kind; 3] = [
    Kind { key: "front-radar", source: Source::Front, gap_m: 60.0, closing_mps: 10.0 },
    Kind { key: "surround", source: Source::Surround, gap_m: 10.0, closing_mps: 1.0 },
    Kind { key: "rear-object", source: Source::Rear, gap_m: 60.0, closing_mps: 10.0 },
];

impl Kind {
    /// Returns whether the car drives ahead of the ego.
    fn looks_ahead(&self) -> bool {
        self.source == Source::Front
    }

    /// Returns a car at this gap, `left_m` to the left of the ego, that closes in.
    fn car(&self, gap_m: f64, left_m: f64, closing_mps: f64) -> SceneVehicle {
        let d_m = OWN_LANE_M + left_m;
        if !self.looks_ahead() {
            return behind(gap_m, d_m, 30.0 + closing_mps);
        }
        let length_m = scene_vehicle(1, VehicleClass::Car, 0.0, d_m).vehicle.dimensions.length_m;
        with_speed(scene_vehicle(1, VehicleClass::Car, EGO_S_M + gap_m + length_m, d_m), 30.0 - closing_mps)
    }

    /// Returns the steps of a drive with this fault.
    fn drive(&self, fault: &str, car: SceneVehicle, steps: i64) -> Vec<Step> {
        let text = format!("[[{}]]\n{fault}\n", self.key);
        Drive { sensors: "mode = \"object\"", faults: &text, others: vec![car], steps, ..Drive::default() }.run()
    }

    /// Returns the confirmed track of this sensor in each step.
    fn tracks(&self, fault: &str, car: SceneVehicle, steps: i64) -> Vec<Option<Track>> {
        let of_sensor = |track: &&Track| track.source == self.source && track.status != TrackStatus::Tentative;
        self.drive(fault, car, steps).iter().map(|step| step.tracks.iter().find(of_sensor).cloned()).collect()
    }

    fn steady(&self) -> SceneVehicle {
        self.car(self.gap_m, 0.0, 0.0)
    }

    /// Returns the mean of a value of the settled tracks.
    fn mean(&self, fault: &str, car: SceneVehicle, value: impl Fn(&Track) -> f64) -> f64 {
        mean(self.tracks(fault, car, 100).iter().skip(50).flatten().map(value))
    }
}

#[test]
fn dropout_and_lost_frames_let_tracks_coast_and_the_loss_of_all_is_noticed() {
    for kind in &KINDS {
        let coasting = |fault: &str| {
            let tracks = kind.tracks(fault, kind.steady(), 100);
            tracks.iter().flatten().filter(|track| track.status == TrackStatus::Coasting).count()
        };
        let usual = coasting("dropout = 0.0");
        for fault in ["dropout = 0.5", "lost-frames = 0.5"] {
            let coasted = coasting(fault);
            assert!(usual < 10 && (30..70).contains(&coasted), "{} {fault}: {usual} {coasted}", kind.key);
        }
        for fault in ["lost-frames = 1.0", "dropout = 1.0", "dead = true"] {
            let steps = kind.drive(&format!("{fault}\nfrom-s = 2.0"), kind.steady(), 100);
            let noticed = steps.iter().position(|step| step.worst == Health::Failed).unwrap();
            assert_eq!(noticed as u32, 50 + NOTICED_AFTER_SCANS - 1, "{} {fault}", kind.key);
            assert!(!steps[99].tracks.iter().any(|track| track.source == kind.source), "{} {fault}", kind.key);
        }
        let lossy = kind.drive("lost-frames = 0.5", kind.steady(), 100);
        assert!(lossy.iter().all(|step| step.worst != Health::Failed), "{}", kind.key);
        assert_eq!(lossy[99].worst, Health::Degraded, "{}", kind.key);
    }
}

#[test]
fn a_lost_frame_loses_all_vehicles_at_once_and_dropout_each_for_itself() {
    let kind = &KINDS[2];
    let coasting = |fault: &str| {
        let text = format!("[[rear-object]]\n{fault}\n");
        let other = SceneVehicle { actor: 2, ..behind(40.0, LEFT_LANE_M, 30.0) };
        let steps = Drive {
            sensors: "mode = \"object\"",
            faults: &text,
            others: vec![kind.steady(), other],
            ..Drive::default()
        }
        .run();
        let counts = steps.iter().skip(20).map(|step| {
            let of_rear = step.tracks.iter().filter(|track| track.source == Source::Rear);
            of_rear.filter(|track| track.status == TrackStatus::Coasting).count()
        });
        counts.fold([0; 3], |mut histogram, count| {
            histogram[count] += 1;
            histogram
        })
    };
    let ([_, single, both], [_, alone, _]) = (coasting("lost-frames = 0.5"), coasting("dropout = 0.5"));
    assert!(both > 25 && single < 12 && alone > 25, "{both} {single} {alone}");
}

#[test]
fn a_frozen_sensor_repeats_its_tracks_until_it_is_noticed() {
    for kind in &KINDS {
        let steps = kind.drive("frozen = true\nfrom-s = 2.0\nuntil-s = 3.5", kind.steady(), 100);
        let state = |step: usize| steps[step].tracks.iter().find(|track| track.source == kind.source).unwrap().state;
        assert_eq!(state(50), state(80), "{}", kind.key);
        assert!(state(49) != state(50) && state(88) != state(90), "{}", kind.key);
        assert_eq!((steps[80].worst, steps[95].worst), (Health::Failed, Health::Ok), "{}", kind.key);
    }
}

#[test]
fn a_blocked_sector_hides_the_side_that_it_names() {
    for kind in &KINDS {
        // The car is 3.75 m to the left, and 3.5 or 12 degrees and more from the axis.
        let is_seen =
            |fault: &str, left_m: f64| kind.tracks(fault, kind.car(kind.gap_m, left_m, 0.0), 60)[59].is_some();
        let (left, right) =
            ("blocked-from-deg = 1.5\nblocked-to-deg = 40.0", "blocked-from-deg = -40.0\nblocked-to-deg = -1.5");
        for (fault, is_left_seen, is_right_seen) in
            [("dropout = 0.0", true, true), (left, false, true), (right, true, false)]
        {
            assert_eq!(is_seen(fault, 3.75), is_left_seen, "{} {fault}", kind.key);
            assert_eq!(is_seen(fault, -3.75), is_right_seen, "{} {fault}", kind.key);
        }
    }
    // Around the ego, a sector may also lie abreast or ahead of it, on both sides of half a turn.
    let surround = &KINDS[1];
    let ahead = |d_m: f64| with_speed(scene_vehicle(1, VehicleClass::Car, EGO_S_M + 9.0, d_m), 30.0);
    let is_seen = |fault: &str, d_m: f64| surround.tracks(fault, ahead(d_m), 60)[59].is_some();
    let both = "blocked-from-deg = 150.0\nblocked-to-deg = 180.0\n[[surround]]\nblocked-from-deg = -180.0\nblocked-to-deg = -150.0";
    assert!(!is_seen(both, OWN_LANE_M) && is_seen(both, LEFT_LANE_M + 3.0));
    assert!(is_seen("blocked-from-deg = 90.0\nblocked-to-deg = 120.0", OWN_LANE_M));
}

#[test]
fn dirt_leaves_its_share_of_the_range_and_less_than_half_is_a_degradation() {
    for kind in &KINDS {
        let range_m = |fault: &str| {
            let far_m = if kind.source == Source::Surround { 25.0 } else { 180.0 };
            let steps = kind.tracks(fault, kind.car(far_m, 0.0, kind.closing_mps.max(4.0)), 500);
            let first = steps.iter().flatten().next().unwrap();
            first.x_m().abs()
        };
        let (clean_m, dirty_m) = (range_m("dropout = 0.0"), range_m("range-share = 0.6"));
        // The first confirmed track comes some steps after the first measurement.
        let share = (dirty_m - 4.6) / (clean_m - 4.6);
        assert!((share - 0.6).abs() < 0.06, "{}: {dirty_m} of {clean_m} m", kind.key);
        let health = |share: &str| kind.drive(&format!("range-share = {share}"), kind.steady(), 3)[2].worst;
        assert_eq!((health("0.6"), health("0.4")), (Health::Ok, Health::Degraded), "{}", kind.key);
    }
}

#[test]
fn latency_and_jitter_confirm_later_and_show_no_scan_before_an_earlier_one() {
    for kind in &KINDS {
        let first = |fault: &str| kind.tracks(fault, kind.steady(), 60).iter().position(Option::is_some).unwrap();
        let usual = first("delay-s = 0.0");
        assert_eq!(first("delay-s = 0.2"), usual + 5, "{}", kind.key);
        let jittered = first("jitter-s = 0.32");
        assert!((usual + 1..=usual + 8).contains(&jittered), "{}: {usual} {jittered}", kind.key);
        // A track goes on as its vehicle does, by turns younger and older.
        let tracks = kind.tracks("jitter-s = 0.3", kind.car(kind.gap_m, 0.0, kind.closing_mps), 100);
        for (step, pair) in tracks.windows(2).enumerate().skip(jittered + 10) {
            let [before_m, after_m] = [0, 1].map(|at| pair[at].as_ref().unwrap().x_m().abs());
            assert!((after_m - before_m).abs() < 1.0, "{} step {step}: {before_m} {after_m}", kind.key);
        }
    }
}

#[test]
fn a_wrong_clock_moves_an_approaching_vehicle_by_its_closing_speed() {
    for kind in &KINDS {
        let closing_mps = kind.closing_mps;
        let x_m = |offset: &str| {
            let fault = format!("clock-offset-s = {offset}");
            kind.mean(&fault, kind.car(kind.gap_m, 0.0, closing_mps), |track| track.x_m())
        };
        let right_m = x_m("0.0");
        // Dated too early, a vehicle counts as having come nearer since. Ahead, nearer is less;
        // behind, it is more.
        let nearer = if kind.looks_ahead() { -1.0 } else { 1.0 };
        for offset_s in [-0.2, -0.1, 0.1, 0.2] {
            let shift_m = x_m(&format!("{offset_s:?}")) - right_m;
            let expected_m = -nearer * closing_mps * offset_s;
            assert!((shift_m - expected_m).abs() < 0.02 * closing_mps, "{} {offset_s}: {shift_m}", kind.key);
        }
    }
}

#[test]
fn a_mounting_turned_to_the_left_moves_vehicles_to_the_right() {
    for kind in &KINDS {
        let y_m = |yaw: &str| kind.mean(&format!("yaw-deg = {yaw}"), kind.steady(), |track| track.y_m());
        let right_m = y_m("0.0");
        // Seen from the sensor, the vehicle turns to the right: ahead that is the ego's right,
        // behind it is the ego's left.
        let mount_m = if kind.source == Source::Surround { 2.3 } else { 0.0 };
        let to_left = if kind.looks_ahead() { -1.0 } else { 1.0 };
        for yaw_deg in [-2.0_f64, 1.0, 2.0] {
            let shift_m = y_m(&format!("{yaw_deg:?}")) - right_m;
            let expected_m = to_left * (kind.gap_m + 2.3 + mount_m) * maths::sin(yaw_deg.to_radians());
            assert!((shift_m - expected_m).abs() < 0.05, "{} {yaw_deg}: {shift_m} {expected_m}", kind.key);
        }
    }
}

#[test]
fn added_noise_scatters_only_the_quantity_that_it_names() {
    for kind in &KINDS {
        let scatter = |fault: &str| {
            let tracks = kind.tracks(fault, kind.steady(), 400);
            let deviation = |value: fn(&Track) -> f64| {
                let values: Vec<f64> = tracks.iter().skip(100).flatten().map(value).collect();
                let centre = mean(values.iter().copied());
                mean(values.iter().map(|value| (value - centre).powi(2))).sqrt()
            };
            [deviation(Track::x_m), deviation(Track::y_m), deviation(Track::vx_mps)]
        };
        // The filters of the rear sensor switch between modes of motion by the situation along the
        // road, and so does the filter across the road.
        let (noise_m, slack) = if kind.source == Source::Rear { (0.3, 0.1) } else { (2.0, 1e-6) };
        let [usual_x, usual_y, _] = scatter("range-noise-m = 0.0");
        let [noisy_x, same_y, _] = scatter(&format!("range-noise-m = {noise_m:?}"));
        assert!(noisy_x > 2.0 * usual_x, "{}: {usual_x} {noisy_x}", kind.key);
        assert!((same_y / usual_y - 1.0).abs() < slack, "{}: {usual_y} {same_y}", kind.key);
        let [same_x, noisy_y, _] = scatter(&format!("lateral-noise-m = {noise_m:?}"));
        assert!(noisy_y > 2.0 * usual_y, "{}: {usual_y} {noisy_y}", kind.key);
        assert!((same_x / usual_x - 1.0).abs() < slack, "{}: {usual_x} {same_x}", kind.key);
    }
    let radar = &KINDS[0];
    let speed = |fault: &str| {
        let tracks = radar.tracks(fault, radar.steady(), 400);
        let errors = tracks.iter().skip(100).flatten().map(|track| (track.vx_mps() - 30.0).powi(2));
        mean(errors).sqrt()
    };
    let (usual, noisy) = (speed("speed-noise-mps = 0.0"), speed("speed-noise-mps = 2.0"));
    assert!(noisy > 3.0 * usual, "{usual} {noisy}");
}

#[test]
fn a_ghost_is_ahead_of_the_ego_for_the_front_radar_and_behind_it_for_the_others() {
    for kind in &KINDS {
        let text = format!("[[{}]]\nghost-gap-m = 20.0\nghost-closing-mps = 2.0\nfrom-s = 1.0\n", kind.key);
        let steps =
            Drive { sensors: "mode = \"object\"", faults: &text, others: vec![], steps: 60, ..Drive::default() }.run();
        assert!(steps[24].tracks.is_empty(), "{}", kind.key);
        let [first, last] = [25, 50].map(|step| steps[step].tracks[0].clone());
        let sign = if kind.looks_ahead() { 1.0 } else { -1.0 };
        assert_eq!(first.source, kind.source);
        assert!(sign * first.x_m() > 20.0, "{}: {}", kind.key, first.x_m());
        assert!((sign * (first.x_m() - last.x_m()) - 2.0).abs() < 1e-9, "{}", kind.key);
    }
}

#[test]
fn a_fault_holds_from_its_start_to_its_end_and_changes_nothing_else() {
    for kind in &KINDS {
        for fault in [
            "yaw-deg = 2.0",
            "lateral-noise-m = 1.0",
            "clock-offset-s = 0.2",
            "range-noise-m = 1.0",
            "lost-frames = 0.9",
        ] {
            let run = |fault: &str| kind.tracks(fault, kind.car(kind.gap_m, 0.0, kind.closing_mps), 100);
            let (usual, faulty) = (run("dropout = 0.0"), run(&format!("{fault}\nfrom-s = 1.0\nuntil-s = 1.4")));
            assert_eq!(usual[..25], faulty[..25], "{} {fault}", kind.key);
            assert_ne!(usual[25..40], faulty[25..40], "{} {fault}", kind.key);
            let [usual_m, faulty_m] = [&usual, &faulty].map(|tracks| tracks[99].as_ref().unwrap().y_m());
            assert!((usual_m - faulty_m).abs() < 0.1, "{} {fault}: {usual_m} {faulty_m}", kind.key);
        }
    }
}
