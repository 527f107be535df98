//! The tables of tracks and clusters give the figures of the tracker's own tests.

use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;

use closecall_campaign::runner::{Sampling, concrete};
use closecall_report::tables::{RunTables, TableFiles};
use closecall_scenarios::ScenarioFile;
use closecall_scenarios::sampling::Design;
use closecall_sensors::{BoxRole, Innovation, SensorMode};
use closecall_simulation::controller::BuiltIn;
use closecall_simulation::{Arm, Observer, RunEvent, RunKey, StepView, TrackAuditor, simulate};
use closecall_testing::python_with;
use closecall_traffic::{Source, Time, TrackId, TrackStatus};

use crate::support::{ROOT, folder, library};

const SEED: u64 = 7;

/// Writes the tables of a run, and observes the same run with the tracker's own tests.
struct Observers {
    tables: RunTables,
    auditor: TrackAuditor,
    /// The normalised innovations squared (NIS) of the rear LiDAR along and across the road. Their
    /// mean is 1 for a consistent filter (Bar-Shalom, Li, Kirubarajan 2001, section 5.4.2).
    nis: Vec<[f64; 2]>,
    /// The scans whose boxes are in the tables.
    scans: Vec<u64>,
}

impl Observer for Observers {
    fn step(&mut self, view: &StepView<'_>) {
        self.tables.step(view);
        self.auditor.step(view);
        self.scans.extend(view.perception.rear_lidar().map(|lidar| lidar.scan));
        let used = view.perception.used_boxes().into_iter();
        // The first scans of a run end before it starts.
        let used = used.filter(|used| used.used.role == BoxRole::Corrects && self.scans.contains(&used.scan));
        let nis = |axis: Innovation| axis.innovation_m * axis.innovation_m / axis.variance_m2;
        self.nis.extend(used.filter_map(|used| Some(used.used.innovation?.map(nis))));
    }

    fn event(&mut self, time: Time, what: &RunEvent) {
        self.auditor.event(time, what);
        assert!(!matches!(what, RunEvent::Collision(_)), "the run has no collision");
    }
}

/// Returns the documented query.
fn query() -> String {
    let text = std::fs::read_to_string(Path::new(ROOT).join("docs/reference/output.md")).unwrap();
    let (_, after) = text.split_once("<!-- query: consistency -->\n```python\n").unwrap();
    after.split_once("```").unwrap().0.to_owned()
}

#[test]
fn the_documented_query_gives_the_consistency_that_the_tracker_s_own_tests_compute() {
    let Some(python) = python_with("duckdb, numpy") else { return };
    let folder = folder();
    let [tracks, clusters] = ["tracks.parquet", "clusters.parquet"].map(|name| folder.path().join(name));
    let file = ScenarioFile::load(&library("overtake-without-brake"), &[]).unwrap();
    let sampling = Sampling { seed: SEED, design: Design::Random, samples: 1 };
    let scenario = concrete(&file, sampling, 0).unwrap();
    let arm = Arm { controller: BuiltIn::Mis.factory(), sensors: Some(SensorMode::Full) };
    let files = TableFiles { tracks: Some(&tracks), clusters: Some(&clusters), ..TableFiles::default() };
    let tables = RunTables::new((&scenario, Some(&arm)), files).unwrap();
    let mut observers = Observers { tables, auditor: TrackAuditor::default(), nis: Vec::new(), scans: Vec::new() };
    simulate(&scenario, RunKey { seed: SEED, sample: 0 }, &arm, &mut observers).unwrap();
    observers.tables.finish().unwrap();
    let audit = observers.auditor.into_audit().unwrap();
    let mean = |axis: usize| observers.nis.iter().map(|nis| nis[axis]).sum::<f64>() / observers.nis.len() as f64;
    let expected = [audit.mean_nees().unwrap(), mean(0), mean(1)];
    assert!(audit.nees.len() > 100 && observers.nis.len() > 100);

    let script = format!("{}\nprint(*consistency({tracks:?}, {clusters:?}))\n", query());
    let output = Command::new(python).args(["-c", &script]).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let printed = String::from_utf8(output.stdout).unwrap();
    let computed: Vec<f64> = printed.split_whitespace().map(|word| word.parse().unwrap()).collect();
    assert_eq!(computed.len(), expected.len(), "{printed}");
    for (computed, expected) in computed.iter().zip(expected) {
        assert!((computed / expected - 1.0).abs() < 1e-6, "{printed}: {expected}");
    }
}

/// A truck as long as the European modular system allows, which passes the ego slowly in the right lane.
const LONGEST_TRUCK: &str = r#"
schema-version = 1
name = "longest-truck-passes"
description = "A truck of 25 m passes the ego slowly in the right lane."
duration-s = 60
road = { lanes = 3, lane-width-m = 3.75 }

[[actor]]
id = "ego"
vehicle = { class = "car" }
start = { absolute = { lane = 2, s-m = 500.0, speed-mps = 30.0 } }
driver = { ego-stack = { acc = { time-gap-s = 1.0, set-speed-mps = 30.0 }, mis = { max-deceleration-mps2 = 1.0, critical-gap-m = 5.0 } } }

[[actor]]
id = "truck"
vehicle = { class = "truck", length-m = 25.0 }
start = { absolute = { lane = 3, s-m = 455.2, speed-mps = 31.0 } }
driver = { prescribed = { profile = [[0.0, 31.0]] } }
"#;

/// The confirmed rear tracks of a run.
#[derive(Default)]
struct Followed {
    ids: BTreeSet<TrackId>,
    /// Number of steps with several confirmed tracks.
    several: usize,
}

impl Observer for Followed {
    fn step(&mut self, view: &StepView<'_>) {
        let is_confirmed =
            |track: &&closecall_traffic::Track| track.source == Source::Rear && track.status != TrackStatus::Tentative;
        let confirmed: Vec<TrackId> = view.tracks.iter().filter(is_confirmed).map(|track| track.id).collect();
        self.several += usize::from(confirmed.len() > 1);
        self.ids.extend(confirmed);
    }

    fn event(&mut self, _: Time, _: &RunEvent) {}
}

#[test]
fn the_tail_of_the_longest_truck_is_no_vehicle_of_its_own() {
    let folder = folder();
    let path = folder.path().join("longest-truck.toml");
    std::fs::write(&path, LONGEST_TRUCK).unwrap();
    let file = ScenarioFile::load(&path, &[]).unwrap();
    let scenario = file.concrete(&file.space().nominal()).unwrap();
    let arm = Arm { controller: BuiltIn::Mis.factory(), sensors: Some(SensorMode::Full) };
    for seed in [1, 2] {
        let mut followed = Followed::default();
        simulate(&scenario, RunKey { seed, sample: 0 }, &arm, &mut followed).unwrap();
        assert!(followed.ids.len() == 1 && followed.several == 0, "{seed}: {:?}, {}", followed.ids, followed.several);
    }
}
