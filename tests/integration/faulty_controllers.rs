//! Controllers that panic, hang, or answer nonsense: each is an error of its sample, with its reason, and the rest of
//! the campaign is what it would be without them.

use std::collections::BTreeMap;
use std::num::NonZeroUsize;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use closecall_campaign::verdict::Decision;
use closecall_campaign::execution::{Campaign, End};
use closecall_campaign::folder::Folder;
use closecall_campaign::ledger::Inference;
use closecall_campaign::manifest::{MANIFEST_VERSION, Manifest, ManifestScenario};
use closecall_campaign::record::{Record, SampleFailure};
use closecall_campaign::runner::{Sampling, Work};
use closecall_campaign::summary::Summary;
use closecall_campaign::validity::CheckPlan;
use closecall_campaign::verdict::{Gates, Verdict};
use closecall_campaign::workers::Workers;
use closecall_controllers::{ControllerError, EgoCommand, EgoController, EgoInput, EgoSettings, EgoStack};
use closecall_scenarios::sampling::Design;
use closecall_sensors::SensorMode;
use closecall_simulation::controller::{BuiltIn, ControllerChoice};
use closecall_simulation::outcome::Outcome;
use closecall_simulation::scenario::ScenarioFile;
use closecall_simulation::{Arm, ControllerFactory};
use closecall_traffic::Time;

use crate::support::{folder, library};

/// What a controller does to a sample that it does not like.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Fault {
    Panics,
    SleepsForever,
    AnswersNan,
}

/// The ego stack, with a fault in samples in which E is fast: a property that the controller itself can see.
struct Faulty {
    fault: Option<Fault>,
}

/// From this speed on the fault shows [m/s]: about one sample in six of those that the headline draws.
const FAULTY_FROM_MPS: f64 = 32.7;
/// When it shows.
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
/// Long for a sample of a few milliseconds, short for a test.
const TIMEOUT: Duration = Duration::from_secs(2);

fn campaign(fault: Option<Fault>, jobs: usize) -> Campaign {
    let file = ScenarioFile::load(&library("low-thw-overtake"), &[]).unwrap();
    let arm = |controller| Arm { controller, sensors: Some(SensorMode::GroundTruth) };
    let arms = vec![arm(BuiltIn::Acc.factory()), arm(Arc::new(Faulty { fault }))];
    let sampling = Sampling { seed: SEED, design: Design::Random, samples: SAMPLES };
    let workers = Workers { jobs: NonZeroUsize::new(jobs).unwrap(), sample_timeout: TIMEOUT };
    Campaign {
        works: vec![Arc::new(Work { file, sampling, arms, checks: CheckPlan::default() })],
        partition: None,
        workers,
    }
}

fn manifest(campaign: &Campaign) -> Manifest {
    let file = &campaign.works[0].file;
    Manifest {
        manifest_version: MANIFEST_VERSION,
        closecall_version: "test".to_owned(),
        scenarios: vec![ManifestScenario {
            name: file.config().name.clone(),
            path: String::new(),
            blake3: String::new(),
            text: file.text().to_owned(),
        }],
        sampling: campaign.works[0].sampling,
        partition: None,
        arms: vec![ControllerChoice::Acc, ControllerChoice::Mis],
        sensors: None,
        checks: CheckPlan::default(),
        inference: Inference::default(),
        models: Vec::new(),
        sample_timeout_s: TIMEOUT.as_secs_f64(),
        command: Vec::new(),
    }
}

fn run(fault: Option<Fault>, jobs: usize) -> (Vec<Record>, Summary) {
    let campaign = campaign(fault, jobs);
    let mut summary = campaign.summary();
    let mut records = Vec::new();
    let taken = campaign.run(None, |next| {
        summary.push(next.record);
        records.push(next.record.clone());
        ControlFlow::Continue(())
    });
    taken.unwrap();
    (records, summary)
}

fn tested(record: &Record) -> &Result<Outcome, SampleFailure> {
    &record.arms[1].result
}

#[test]
fn each_fault_is_an_error_with_its_reason_and_the_rest_is_right() {
    let (sound, sound_summary) = run(None, 2);
    assert_eq!(sound_summary.total().errors(), 0);
    let expected = BTreeMap::from([
        (Fault::Panics, ("panic", "a panic: index 7 of 3")),
        (Fault::SleepsForever, ("timeout", "no outcome within 2 s of wall time")),
        (Fault::AnswersNan, ("command", "the ego controller asked for an acceleration of NaN m/s² at 2.00 s")),
    ]);
    let mut hit: Vec<Vec<u64>> = Vec::new();
    for (fault, (kind, message)) in expected {
        // Few workers for many samples that hang: each that is given up must be replaced.
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
            assert_eq!(record.arms[0], sound.arms[0], "the other arm is not touched");
        }
        let judged = summary.judge(Gates::default());
        assert_eq!(judged.decision, Decision::SampleError, "{fault:?}");
        assert_ne!(judged.verdict, Verdict::Pass, "{fault:?}");
        assert_eq!(summary.total().errors(), failed.len() as u64);
        hit.push(failed);
    }
    assert!(hit[0] == hit[1] && hit[1] == hit[2], "the fault does not depend on its kind: {hit:?}");
}

/// Runs `campaign` in a folder until `samples` more have been run, as if it had been stopped there.
fn run_part(campaign: &Campaign, path: &Path, samples: usize) {
    let locked = Folder::lock(path, &manifest(campaign), true).unwrap();
    let mut left = samples;
    let taken = campaign.run(Some(&locked), |next| {
        left = if next.is_new { left - 1 } else { left };
        if left == 0 { ControlFlow::Break(End::Campaign) } else { ControlFlow::Continue(()) }
    });
    taken.unwrap();
}

#[test]
fn errors_are_results_and_are_kept_when_a_campaign_is_resumed() {
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
