//! A scenario with rear corner radars: its tracks know the speed of a new vehicle better, and its campaign runs.

use closecall_campaign::runner::{Sampling, concrete};
use closecall_scenarios::ScenarioFile;
use closecall_scenarios::sampling::Design;
use closecall_sensors::SensorMode;
use closecall_simulation::controller::BuiltIn;
use closecall_simulation::{Arm, Observer, RunEvent, RunKey, StepView, simulate};
use closecall_traffic::{Source, Time, Track, TrackId};

use crate::support::{closecall, folder, library, stdout};

const SEED: u64 = 11;
const SAMPLES: u64 = 6;
/// Time after the first scan that shows a vehicle (s).
const YOUNG_S: f64 = 0.6;

/// The speeds of the rear vehicle's track while the track is new.
#[derive(Default)]
struct NewTracks {
    first: Option<(TrackId, Time)>,
    /// Variances of the speed (m²/s²), and squared errors over them.
    variances_m2ps2: Vec<f64>,
    normalised: Vec<f64>,
}

/// Returns the rear track of the vehicle, whose position relative to the ego is known.
fn track_at(tracks: &[Track], [x_m, y_m]: [f64; 2]) -> Option<&Track> {
    let is_near = |track: &&Track| (track.x_m() - x_m).abs() < 4.0 && (track.y_m() - y_m).abs() < 1.5;
    tracks.iter().filter(|track| track.source == Source::Rear).find(is_near)
}

impl Observer for NewTracks {
    fn step(&mut self, view: &StepView<'_>) {
        let scenario = view.scenario;
        let rear = scenario.actors.iter().position(|actor| actor.id.as_str() == "rear").unwrap();
        let [ego, rear] = [scenario.ego, rear].map(|actor| view.vehicles[actor].state);
        let Some(track) = track_at(view.tracks, [rear.s_m - ego.s_m, rear.d_m - ego.d_m]) else { return };
        let (id, since) = *self.first.get_or_insert((track.id, view.time));
        if id == track.id && (view.time - since).s() <= YOUNG_S {
            let variance_m2ps2 = track.covariance[(2, 2)];
            let error_mps = track.vx_mps() - rear.speed_mps;
            self.variances_m2ps2.push(variance_m2ps2);
            self.normalised.push(error_mps * error_mps / variance_m2ps2);
        }
    }

    fn event(&mut self, _: Time, _: &RunEvent) {}
}

/// Returns the new tracks of the samples. The rear vehicle comes into the range of the LiDAR during the run.
fn new_tracks(more: &[&str]) -> NewTracks {
    let settings = ["sensors.rear-camera.pipeline=\"off\"", "actor.rear.start.behind.gap-m=160", "duration-s=16"];
    let settings: Vec<_> = settings.iter().chain(more).map(|text| text.parse().unwrap()).collect();
    let file = ScenarioFile::load(&library("low-thw-overtake"), &settings).unwrap();
    let sampling = Sampling { seed: SEED, design: Design::Random, samples: SAMPLES };
    let arm = Arm { controller: BuiltIn::Mis.factory(), sensors: Some(SensorMode::Full) };
    let mut all = NewTracks::default();
    for sample in 0..SAMPLES {
        let scenario = concrete(&file, sampling, sample).unwrap();
        let mut observer = NewTracks::default();
        simulate(&scenario, RunKey { seed: SEED, sample }, &arm, &mut observer).unwrap();
        all.variances_m2ps2.append(&mut observer.variances_m2ps2);
        all.normalised.append(&mut observer.normalised);
    }
    all
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

#[test]
fn rear_radars_make_the_speed_of_a_new_track_surer() {
    let alone = new_tracks(&[]);
    let fused = new_tracks(&["sensors.rear-radar.range-m=200"]);
    assert!(alone.variances_m2ps2.len() > 20 && fused.variances_m2ps2.len() > 20);
    // A further measurement of the speed makes it surer.
    let [alone_m2ps2, fused_m2ps2] = [&alone, &fused].map(|tracks| mean(&tracks.variances_m2ps2));
    assert!(fused_m2ps2 < alone_m2ps2, "{fused_m2ps2} with the radars, {alone_m2ps2} without");
    // The tracker claims no more than it knows: a consistent filter has 1.
    assert!(mean(&fused.normalised) < 3.0, "{}", mean(&fused.normalised));
}

#[test]
fn a_campaign_runs_with_rear_radars_and_their_faults() {
    let folder = folder();
    let scenario = folder.path().join("radars.toml");
    let text = "base = \"low-thw-overtake\"\nname = \"radars\"\ndescription = \"Rear radars. One of them dies.\"\n\
                sensors.mode = \"full\"\nsensors.rear-camera.pipeline = \"off\"\nsensors.rear-radar = {}\n\
                [[fault.rear-radar]]\nside = \"left\"\ndead = true\nfrom-s = 2.0\n";
    std::fs::write(&scenario, text).unwrap();
    let path = scenario.to_str().unwrap();
    assert!(stdout(&closecall(["check", path]), 0).contains("valid"));
    stdout(&closecall(["campaign", path, "-n", "2", "--seed", "1", "--paired", "--no-gate"]), 0);
}
