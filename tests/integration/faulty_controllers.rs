//! A controller that panics, hangs, or returns nonsense causes an error of its sample, with the
//! reason. All other samples have the same outcomes as without the fault.

use std::collections::BTreeMap;
use std::num::NonZeroUsize;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use closecall_campaign::execution::{Campaign, End};
use closecall_campaign::folder::Folder;
use closecall_campaign::gate::{GateSet, Judge};
use closecall_campaign::ledger::Inference;
use closecall_campaign::manifest::{MANIFEST_VERSION, Manifest, ManifestScenario};
use closecall_campaign::record::{Record, SampleFailure};
use closecall_campaign::runner::{Sampling, Work};
use closecall_campaign::summary::Summary;
use closecall_campaign::validity::CheckPlan;
use closecall_campaign::verdict::{Allowed, Decision, Judgement, Verdict, judge};
use closecall_campaign::workers::Workers;
use closecall_controllers::{ControllerError, EgoCommand, EgoController, EgoInput, EgoSettings, EgoStack};
use closecall_scenarios::ScenarioFile;
use closecall_scenarios::outcome::Outcome;
use closecall_scenarios::sampling::Design;
use closecall_sensors::SensorMode;
use closecall_simulation::controller::{BuiltIn, ControllerChoice};
use closecall_simulation::{Arm, ControllerFactory};
use closecall_traffic::Time;

use crate::support::{folder, library};

/// A fault of a controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Fault {
    Panics,
    SleepsForever,
    AnswersNan,
}

/// Builds ego stacks with a fault that shows in samples in which the ego is fast. The controller
/// itself can see this property.
struct Faulty {
    fault: Option<Fault>,
}

/// The lowest initial speed of the ego at which the fault shows (m/s): about one sample in six of
/// `low-thw-overtake`.
const FAULTY_FROM_MPS: f64 = 32.7;
/// The time at which the fault shows.
const FAULTY_AT: Time = Time::from_ms(2_000);

impl ControllerFactory for Faulty {
    fn name(&self) -> &str {
        "mis"
    }
    fn has_mis(&self, settings: &EgoSettings) -> bool {
        settings.mis().is_some()
    }
    fn build(&self, settings: &EgoSettings) -> Box<dyn EgoController> {
        Box::new(FaultyStack { fault: self.fault, stack: EgoStack::new(*settings), is_fast: None })
    }
}

struct FaultyStack {
    fault: Option<Fault>,
    stack: EgoStack,
    is_fast: Option<bool>,
}

impl EgoController for FaultyStack {
    fn step(&mut self, input: &EgoInput<'_>) -> Result<EgoCommand, ControllerError> {
        let is_fast = *self.is_fast.get_or_insert(input.odometry.speed_mps >= FAULTY_FROM_MPS);
        let command = self.stack.step(input)?;
        match self.fault {
            Some(fault) if is_fast && input.time >= FAULTY_AT => match fault {
                Fault::Panics => panic!("index 7 of 3"),
                Fault::SleepsForever => loop {
                    std::thread::park();
                },
                Fault::AnswersNan => Ok(EgoCommand { acceleration_mps2: f64::NAN, ..command }),
            },
            _ => Ok(command),
        }
    }
}

const SAMPLES: u64 = 32;
const SEED: u64 = 3;
/// The time that a sample may take. Every sample that hangs costs the test this time; a sound one
/// needs a few milliseconds.
const HANG_TIMEOUT: Duration = Duration::from_secs(5);
/// The same for faults that do not hang. The limit ends the test only if the program itself hangs.
const WATCHDOG: Duration = Duration::from_mins(10);

fn timeout(fault: Option<Fault>) -> Duration {
    if fault == Some(Fault::SleepsForever) { HANG_TIMEOUT } else { WATCHDOG }
}

fn campaign(fault: Option<Fault>, jobs: usize) -> Campaign {
    let file = ScenarioFile::load(&library("low-thw-overtake"), &[]).unwrap();
    let arm = |controller| Arm { controller, sensors: Some(SensorMode::GroundTruth) };
    let arms = vec![arm(BuiltIn::Acc.factory()), arm(Arc::new(Faulty { fault }))];
    let sampling = Sampling { seed: SEED, design: Design::Random, samples: SAMPLES };
    let workers = Workers { jobs: NonZeroUsize::new(jobs).unwrap(), sample_timeout: timeout(fault) };
    Campaign::new(
        vec![Arc::new(Work { file, sampling, arms, checks: CheckPlan::default(), retry_crashed: 0 })],
        workers,
    )
}

fn manifest(campaign: &Campaign) -> Manifest {
    let file = &campaign.works[0].file;
    Manifest {
        manifest_version: MANIFEST_VERSION,
        closecall_version: "test".to_owned(),
        scenarios: vec![ManifestScenario {
            name: file.config().name.clone(),
            path: String::new(),
            blake3: blake3::hash(file.text().as_bytes()).to_string(),
            text: file.text().to_owned(),
            settings: Vec::new(),
        }],
        sampling: campaign.works[0].sampling,
        partition: None,
        arms: vec![ControllerChoice::ACC, ControllerChoice::MIS],
        sensors: None,
        checks: CheckPlan::default(),
        inference: Inference::default(),
        models: Vec::new(),
        sample_timeout_s: WATCHDOG.as_secs_f64(),
        controllers: Vec::new(),
        working_folder: None,
        retry_crashed: 0,
        without_effect: Vec::new(),
        left_out: Vec::new(),
        has_drawn_seed: false,
        replaceable: false,
        command: Vec::new(),
    }
}

fn run(fault: Option<Fault>, jobs: usize) -> (Vec<Record>, Summary) {
    let campaign = campaign(fault, jobs);
    let mut summary = campaign.summary();
    let mut records = Vec::new();
    let finished = campaign.run(None, |next| {
        summary.push(next.record);
        records.push(next.record.clone());
        ControlFlow::Continue(())
    });
    finished.unwrap();
    (records, summary)
}

/// Returns the result of the arm with the faulty controller.
fn tested(record: &Record) -> &Result<Outcome, SampleFailure> {
    &record.arms[1].result
}

#[test]
fn each_fault_is_an_error_with_its_reason_and_leaves_the_other_samples_unchanged() {
    let (sound, sound_summary) = run(None, 2);
    assert_eq!(sound_summary.total().errors(), 0);
    let expected = BTreeMap::from([
        (Fault::Panics, ("panic", "a panic: index 7 of 3")),
        (Fault::SleepsForever, ("timeout", "no outcome within 5 s of wall time")),
        (
            Fault::AnswersNan,
            (
                "command",
                "the ego controller asked for an acceleration of NaN m/s² at 2.00 s: it must be a number from -100 to 100",
            ),
        ),
    ]);
    let mut failed_by_fault: Vec<Vec<u64>> = Vec::new();
    for (fault, (kind, message)) in expected {
        // There are fewer workers than samples that hang, so a worker that hangs must be replaced.
        let (records, summary) = run(Some(fault), 2);
        assert_eq!(records.iter().map(|record| record.sample).collect::<Vec<_>>(), (0..SAMPLES).collect::<Vec<_>>());
        let failed: Vec<u64> =
            records.iter().filter(|record| tested(record).is_err()).map(|record| record.sample).collect();
        assert!(failed.len() >= 3, "{fault:?}: {failed:?}");
        for (record, sound) in records.iter().zip(&sound) {
            match tested(record) {
                Err(failure) => assert_eq!((failure.kind.as_str(), failure.message.as_str()), (kind, message)),
                Ok(_) => assert_eq!(tested(record), tested(sound), "{fault:?}, sample {}", record.sample),
            }
            assert_eq!(record.arms[0], sound.arms[0], "the other arm differs in sample {}", record.sample);
        }
        let judged = judged(&summary, &campaign(Some(fault), 1));
        assert_eq!(judged.decision, Decision::SampleError, "{fault:?}");
        assert_eq!(judged.verdict(), Some(Verdict::Error), "{fault:?}");
        assert_eq!(summary.total().errors(), failed.len() as u64);
        failed_by_fault.push(failed);
    }
    assert!(
        failed_by_fault.iter().all(|failed| *failed == failed_by_fault[0]),
        "the faults hit different samples: {failed_by_fault:?}"
    );
}

/// Judges a summary without gates.
fn judged(summary: &Summary, campaign: &Campaign) -> Judgement {
    judge(summary, &Judge::new(&campaign.works, &GateSet::default(), campaign.inference), Allowed::default())
}

/// Runs `campaign` in a folder, and stops it after `samples` more samples.
fn run_part(campaign: &Campaign, path: &Path, samples: usize) {
    let locked = Folder::lock(path, &manifest(campaign), true).unwrap();
    let mut left = samples;
    let finished = campaign.run(Some(&locked), |next| {
        left = if next.is_new { left - 1 } else { left };
        if left == 0 { ControlFlow::Break(End::Campaign) } else { ControlFlow::Continue(()) }
    });
    finished.unwrap();
}

#[test]
fn a_resumed_campaign_keeps_the_errors_of_its_journal() {
    let folder = folder();
    let campaign = campaign(Some(Fault::Panics), 2);
    let (whole, parts) = (folder.path().join("whole"), folder.path().join("parts"));
    run_part(&campaign, &whole, usize::MAX);
    for _ in 0..4 {
        run_part(&campaign, &parts, 9);
    }
    let journal = |path: &Path| std::fs::read(path.join("journal.jsonl")).unwrap();
    assert!(journal(&whole) == journal(&parts));
    let errors = Folder::open(&whole).records().unwrap().filter(|record| tested(record.as_ref().unwrap()).is_err());
    assert!(errors.count() >= 3);
}
