//! The monitors of the sensors raise nothing in all faultless scenarios of the library.

use std::path::Path;

use closecall_scenarios::sampling::Design;
use closecall_scenarios::source::expand;
use closecall_scenarios::{ScenarioFile, Setting};
use closecall_sensors::SensorMode;
use closecall_sensors::monitors::{Alarm, Alarms};
use closecall_simulation::controller::BuiltIn;
use closecall_simulation::{Arm, Observer, RunEvent, RunKey, StepView, simulate};
use closecall_traffic::{CONTROL_STEP, Check, Time};

const SEED: u64 = 11;
/// Number of samples of each scenario.
const SAMPLES: u64 = 4;
const WITHOUT_CAMERA: &str = "sensors.rear-camera.pipeline=off";

/// Notes the false alarms of a run.
#[derive(Default)]
struct FalseAlarms {
    steps: u64,
    /// Time of the first, and what it was.
    first: Option<(Time, Alarms)>,
}

impl Observer for FalseAlarms {
    fn event(&mut self, _: Time, _: &RunEvent) {}

    fn step(&mut self, view: &StepView<'_>) {
        self.steps += 1;
        let alarms = view.perception.alarms();
        let all = alarms.front.and(alarms.surround).and(alarms.rear);
        // Weather may leave less than half of the range. That is no false alarm.
        if self.first.is_none() && all.iter().any(|alarm| alarm != Alarm::ShortRange) {
            self.first = Some((view.time, all));
        }
    }
}

#[test]
fn no_monitor_raises_an_alarm_in_a_scenario_without_a_fault() {
    let library = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/library");
    let mut files = expand(&[library]).unwrap();
    files.retain(|path| !std::fs::read_to_string(path).unwrap().contains("[fault"));
    assert!(files.len() > 20, "{files:?}");
    let mut steps = 0;
    let mut alarms = Vec::new();
    for path in files {
        // The second time, a LiDAR looks ahead.
        for texts in [&[WITHOUT_CAMERA][..], &[WITHOUT_CAMERA, "sensors.front-lidar={}"]] {
            let settings: Vec<Setting> = texts.iter().map(|text| text.parse().unwrap()).collect();
            let file = ScenarioFile::load(&path, &settings).unwrap();
            for sample in 0..SAMPLES {
                let parameters = file.space().sample(Design::Random, SEED, sample, SAMPLES);
                let scenario = file.config().check(&parameters).unwrap();
                let arm = Arm { controller: BuiltIn::Mis.factory(), sensors: Some(SensorMode::Full) };
                let mut noted = FalseAlarms::default();
                simulate(&scenario, RunKey { seed: SEED, sample }, &arm, &mut noted).unwrap();
                steps += noted.steps;
                let first =
                    noted.first.map(|(time, all)| format!("{} {sample}: {all} at {} s", path.display(), time.s()));
                alarms.extend(first);
            }
        }
    }
    assert!(alarms.is_empty(), "{}", alarms.join("\n"));
    let hours = steps as f64 * CONTROL_STEP.s() / 3_600.0;
    assert!(hours > 1.0, "{hours} h");
}
