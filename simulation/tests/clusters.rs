//! The clusters of the LiDAR in all scenarios of the library follow the definition of DBSCAN,
//! with either implementation.
#![expect(clippy::unwrap_used, reason = "a test that cannot be set up has failed")]

use std::path::Path;

use closecall_scenarios::source::expand;
use closecall_scenarios::{Scenario, ScenarioError, ScenarioFile, Setting};
use closecall_sensors::SensorMode;
use closecall_sensors::lidar::{ClusteredPoints, ClusteringMethod};
use closecall_simulation::controller::BuiltIn;
use closecall_simulation::{Arm, Observer, RunEvent, RunKey, StepView, simulate};
use closecall_testing::dbscan_by_definition;
use closecall_traffic::Time;

/// Number of control steps from one compared scan to the next. The definition takes long.
const STRIDE: usize = 25;

/// Compares scans of all LiDARs.
#[derive(Default)]
struct Comparison {
    steps: usize,
    scans: usize,
    points: usize,
    different: usize,
}

impl Observer for Comparison {
    fn event(&mut self, _: Time, _: &RunEvent) {}

    fn step(&mut self, view: &StepView<'_>) {
        self.steps += 1;
        if !self.steps.is_multiple_of(STRIDE) {
            return;
        }
        for mounted in view.perception.lidars() {
            let ClusteredPoints { points, labels } = mounted.lidar.clustered().unwrap();
            if points.is_empty() {
                continue;
            }
            let expected = dbscan_by_definition(&points, ClusteredPoints::RADIUS, ClusteredPoints::CORE_POINTS);
            self.scans += 1;
            self.points += points.len();
            self.different += usize::from(labels != expected);
            let own = ClusteredPoints::by(ClusteringMethod::Grid, points);
            self.different += usize::from(own.labels != expected);
        }
    }
}

/// Returns the nominal scenario of a file with these settings.
fn nominal(path: &Path, settings: &[Setting]) -> Result<Scenario, ScenarioError> {
    let file = ScenarioFile::load(path, settings)?;
    file.concrete(&file.space().nominal())
}

#[test]
fn the_clusters_of_the_library_are_those_of_the_definition() {
    let library = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/library");
    let files = expand(&[library]).unwrap();
    assert!(files.len() > 90, "{files:?}");
    let mut comparison = Comparison::default();
    for path in files {
        let scenario = nominal(&path, &["sensors.rear-camera.pipeline=off".parse().unwrap()])
            // A fault of the camera needs the camera.
            .or_else(|_| nominal(&path, &[]))
            .unwrap();
        let arm = Arm { controller: BuiltIn::Mis.factory(), sensors: Some(SensorMode::Full) };
        simulate(&scenario, RunKey { seed: 1, sample: 0 }, &arm, &mut comparison).unwrap();
        assert_eq!(comparison.different, 0, "{}", path.display());
    }
    assert!(comparison.scans > 1_000, "{} scans with {} points", comparison.scans, comparison.points);
}
