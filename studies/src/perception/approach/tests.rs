//! The counts of an approach, against values worked by hand.

use closecall_sensors::SensorHealth;
use closecall_traffic::{ClassScores, Environment, Time, TrackId};
use nalgebra::{Matrix4, Vector4};

use super::*;

/// Returns a confirmed track of a car whose front is at this place relative to the ego (m).
fn track(id: u32, [front_x_m, y_m]: [f64; 2], speed_mps: f64) -> Track {
    let length_m = 4.5;
    Track {
        id: TrackId(id),
        source: Source::Rear,
        status: TrackStatus::Confirmed,
        time: Time::ZERO,
        state: Vector4::new(front_x_m - 0.5 * length_m, y_m, speed_mps, 0.0),
        covariance: Matrix4::identity(),
        heading_rad: 0.0,
        length_m,
        width_m: 1.8,
        class: ClassScores::certain(VehicleClass::Car),
        existence: 0.99,
        lane: [0.0, 1.0, 0.0],
    }
}

fn gospa_of(truths_m: &[[f64; 2]], tracks_m: &[[f64; 2]]) -> f64 {
    let tracks: Vec<Track> = tracks_m.iter().zip(1..).map(|(at_m, id)| track(id, *at_m, 30.0)).collect();
    gospa_m(truths_m, &tracks.iter().collect::<Vec<_>>())
}

#[test]
fn gospa_is_that_of_worked_examples() {
    let close = |value: f64, expected: f64| assert!((value - expected).abs() < 1e-9, "{value} instead of {expected}");
    let alone_m2: f64 = 12.5; // Half of the square of the cut-off of 5 m: the share of a vehicle without a track, or of a track without a vehicle.
    close(gospa_of(&[], &[]), 0.0);
    close(gospa_of(&[[-30.0, 0.0]], &[]), alone_m2.sqrt());
    close(gospa_of(&[], &[[-30.0, 0.0], [-60.0, 0.0]]), 5.0);
    // 3 m along and 2 m across.
    close(gospa_of(&[[-30.0, 0.0]], &[[-33.0, 2.0]]), 13.0_f64.sqrt());
    // At the cut-off, a pair costs as much as a missed vehicle and a false track together.
    close(gospa_of(&[[-30.0, 0.0]], &[[-35.0, 0.0]]), 5.0);
    close(gospa_of(&[[-30.0, 0.0]], &[[-80.0, 0.0]]), 5.0);
    // Two vehicles, two tracks and a false one: the pairs that cross would cost 16 + 9 m², the
    // others 1 + 4 m².
    let truths_m = [[-30.0, 0.0], [-30.0, 3.0]];
    let tracks_m = [[-30.0, 5.0], [-31.0, 0.0], [-90.0, 0.0]];
    close(gospa_of(&truths_m, &tracks_m), (1.0_f64 + 4.0 + alone_m2).sqrt());
    // The nearest track of the first vehicle is left to the second vehicle, which no other track
    // reaches: 4 + 1 m² instead of 1 m² and two alone.
    close(gospa_of(&[[-30.0, 0.0], [-30.0, 2.0]], &[[-30.0, 1.0], [-30.0, -2.0]]), 5.0_f64.sqrt());
}

/// Perception that reports the truth, from step 100 on under another id, and between steps 50 and
/// 60 one more track 30 m farther away.
struct Scripted {
    step: u32,
    class: ClassScores,
    tracks: Vec<Track>,
}

impl Perception for Scripted {
    fn step(&mut self, scene: &Scene<'_>) -> Result<&[Track], SensorError> {
        let (ego, other) = (&scene.ego, &scene.others[0]);
        let front_x_m = other.state.s_m + 0.5 * other.vehicle.dimensions.length_m - ego.state.s_m;
        let at_m = [front_x_m, other.state.d_m - ego.state.d_m];
        let id = if self.step < 100 { 1 } else { 2 };
        self.tracks = vec![track(id, at_m, other.state.speed_mps)];
        if (50..60).contains(&self.step) {
            self.tracks.push(Track { class: self.class, ..track(9, [front_x_m - 30.0, 0.0], 30.0) });
        }
        self.step += 1;
        Ok(&self.tracks)
    }

    fn health(&self) -> SensorHealth {
        SensorHealth::default()
    }
}

#[test]
fn a_forced_change_of_the_id_and_a_forced_false_track_are_counted() {
    let (case, road) = (Case::usual(), Road::straight(3));
    assert_eq!(case.environment, Environment::CLEAR_DAY);
    let with_class = |class| {
        let traffic = Traffic::new(&case, &road, 150.0, 10.0);
        observe(&case, &road, traffic, &mut Scripted { step: 0, class, tracks: Vec::new() }).unwrap()
    };
    let approach = with_class(ClassScores::certain(VehicleClass::Car));
    assert_eq!((approach.id_switches, approach.false_tracks, approach.failed_steps), (1, 1, 0));
    // The true track has no error; the false one costs its share in each of its ten steps.
    for (step, observation) in approach.observations.iter().enumerate() {
        let expected = if (50..60).contains(&step) { 12.5_f64.sqrt() } else { 0.0 };
        assert!((observation.gospa_m - expected).abs() < 1e-6, "step {step}: {}", observation.gospa_m);
        assert!(observation.tracked.is_some_and(|track| track.position_m[0].abs() < 1e-6 && track.is_class_right));
    }
    // A track that is known to be no vehicle is no false track.
    let background = ClassScores([0.0, 0.0, 0.0, 1.0]);
    assert_eq!(with_class(background).false_tracks, 0);
}

/// Watches a vehicle that comes from 150 m to 5 m in steps of 0.5 m. It has a track between these
/// gaps, and is classified from the last gap on (m).
fn watched(tracks_m: &[[f64; 2]], classified_m: f64) -> Sightings {
    let mut watch = Watch::new();
    for step in 0..290 {
        let gap_m = 150.0 - 0.5 * f64::from(step);
        let is_tracked = tracks_m.iter().any(|[from_m, to_m]| gap_m <= *from_m && gap_m >= *to_m);
        watch.observe(gap_m, is_tracked.then_some(gap_m <= classified_m));
        if watch.is_settled(gap_m) {
            break;
        }
    }
    watch.sightings
}

#[test]
fn a_track_that_is_lost_for_long_does_not_last() {
    let expected = Sightings { first_m: 120.0, lasting_m: 87.0, classified_m: 87.0, beyond_m: 9.0 };
    assert_eq!(watched(&[[120.0, 115.0], [107.0, 103.0], [87.0, 5.0]], 150.0), expected);
    // A loss of 12 steps, here 6.5 m from track to track, does not count.
    let lasting = Sightings { first_m: 90.0, lasting_m: 90.0, classified_m: 90.0, beyond_m: 0.0 };
    assert_eq!(watched(&[[90.0, 86.5], [80.0, 5.0]], 150.0), lasting);
    let longer = watched(&[[90.0, 86.5], [79.5, 5.0]], 150.0);
    assert_eq!([longer.lasting_m, longer.beyond_m], [79.5, 3.5]);
    // The class of a track that is lost again does not count either.
    assert_eq!(watched(&[[120.0, 115.0], [67.0, 5.0]], 30.0).classified_m, 30.0);
    // Never seen, or never again.
    assert_eq!(watched(&[], 150.0), Sightings { first_m: 5.0, lasting_m: 5.0, classified_m: 5.0, beyond_m: 0.0 });
}
