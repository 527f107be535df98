//! The tables of tracks and clusters give the figures of the tracker's own tests.

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
use closecall_traffic::Time;

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
