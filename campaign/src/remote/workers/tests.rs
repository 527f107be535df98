use std::collections::VecDeque;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::{Mutex, PoisonError};

use closecall_scenarios::ScenarioFile;
use closecall_scenarios::sampling::Design;
use closecall_sensors::SensorMode;
use closecall_simulation::controller::ControllerChoice;

use super::super::{BlockRunner, Shipment};
use super::*;
use crate::execution::Campaign;
use crate::folder::Folder;
use crate::plan::Plan;
use crate::rare::{Goal, Method, Nearness, RareError, RarePlan, RareReport};
use crate::remote::error::EngineError;
use crate::sampling::Sampling;
use crate::stop::End;
use crate::workers::Workers;

const SAMPLES: u64 = 30;

fn plan(seed: u64) -> Plan {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/library/low-thw-overtake.toml");
    let file = ScenarioFile::load(&path, &[]).unwrap();
    let sampling = Sampling { seed, design: Design::Random, samples: SAMPLES };
    let mut plan = Plan::new(vec![file], sampling, vec![ControllerChoice::ACC, ControllerChoice::MIS]).unwrap();
    plan.use_sensors(Some(SensorMode::GroundTruth)).unwrap();
    plan
}

type Change = fn(u64, Vec<u8>) -> Vec<(u64, Vec<u8>)>;

/// Machines in this thread, which answer the latest block first.
struct Here {
    runner: BlockRunner,
    submitted: Mutex<VecDeque<(u64, Vec<u8>)>>,
    change: Change,
}

impl Here {
    fn lock(&self) -> std::sync::MutexGuard<'_, VecDeque<(u64, Vec<u8>)>> {
        self.submitted.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Cluster for Here {
    fn capacity(&self) -> Result<usize, EngineError> {
        Ok(2)
    }
    fn submit(&self, block: u64, work: usize, samples: &[u64]) -> Result<(), EngineError> {
        let bytes = self.runner.run(work, samples).unwrap();
        self.lock().push_front((block, bytes));
        Ok(())
    }
    fn wait(&self, _: Duration) -> Result<Vec<(u64, Vec<u8>)>, EngineError> {
        let done = self.lock().pop_front();
        Ok(done.into_iter().flat_map(|(block, bytes)| (self.change)(block, bytes)).collect())
    }
    fn cancel(&self) {
        self.lock().clear();
    }
    fn close(&self) {}
}

fn unchanged(block: u64, bytes: Vec<u8>) -> Vec<(u64, Vec<u8>)> {
    vec![(block, bytes)]
}

/// Returns machines for the campaign of the first seed that run the campaign of the second seed.
fn machines(seeds: [u64; 2], change: Change) -> (RemoteWorkers, Manifest) {
    let [here, there] = seeds.map(|seed| plan(seed).manifest(Vec::new()).unwrap());
    let runner = BlockRunner::prepare(&Shipment::of(&there).unwrap()).unwrap();
    let cluster = Here { runner, submitted: Mutex::default(), change };
    (RemoteWorkers::new(Box::new(cluster), &here), here)
}

/// Returns the campaign of the first seed on machines that run the campaign of the second seed.
fn campaign(seeds: [u64; 2], change: Change) -> (Campaign, Manifest) {
    let (machines, manifest) = machines(seeds, change);
    let mut campaign = plan(seeds[0]).campaign();
    campaign.remote = Some(Arc::new(machines));
    (campaign, manifest)
}

/// Returns the journal of a campaign, which is interrupted after `first` samples and resumed.
fn journal(campaign: &Campaign, manifest: &Manifest, first: u64) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    for last in [first, SAMPLES] {
        let locked = Folder::lock(folder.path(), manifest, true).unwrap();
        let mut count = 0;
        campaign
            .run(Some(&locked), |_| {
                count += 1;
                if count == last { ControlFlow::Break(End::Campaign) } else { ControlFlow::Continue(()) }
            })
            .unwrap();
        assert_eq!(count, last);
    }
    std::fs::read(folder.path().join("journal.jsonl")).unwrap()
}

#[test]
fn the_journal_is_that_of_one_machine_also_if_it_is_resumed() {
    let (remote, manifest) = campaign([3, 3], unchanged);
    let local = journal(&plan(3).campaign(), &manifest, SAMPLES);
    assert_eq!(local.iter().filter(|&&byte| byte == b'\n').count() as u64, SAMPLES);
    for first in [1, 7, SAMPLES] {
        assert!(journal(&remote, &manifest, first) == local, "interrupted after {first} samples");
    }
}

/// Returns the error of a campaign whose answers are changed, and the number of records before it.
fn error(seeds: [u64; 2], change: Change) -> (RemoteError, u64) {
    let (campaign, _) = campaign(seeds, change);
    let mut count = 0;
    let ended = campaign.run(None, |_| {
        count += 1;
        ControlFlow::Continue(())
    });
    match ended {
        Err(CampaignError::Remote(error)) => (error, count),
        other => panic!("{other:?}"),
    }
}

/// Returns the lines of an answer.
fn lines(bytes: &[u8]) -> Vec<&[u8]> {
    bytes.split_inclusive(|byte| *byte == b'\n').collect()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

/// Disguises an answer as an answer of the seed 3.
fn disguised(block: u64, bytes: Vec<u8>) -> Vec<(u64, Vec<u8>)> {
    let [claimed, other] = [3, 4].map(|seed| plan(seed).manifest(Vec::new()).unwrap().configuration());
    let disguised = text(&bytes).replace(&other, &claimed);
    assert_ne!(disguised.as_bytes(), bytes);
    vec![(block, disguised.into_bytes())]
}

#[test]
fn an_answer_that_is_not_that_of_the_block_is_an_error() {
    let cases: [([u64; 2], Change, &str); 8] = [
        ([3, 4], unchanged, "they are of another configuration"),
        ([3, 4], disguised, "sample 28 has an outcome of the seed 4, and the campaign has the seed 3"),
        // The answer lacks its last sample.
        ([3, 3], |id, bytes| vec![(id, lines(&bytes)[..2].concat())], "there are 1 instead of"),
        ([3, 3], |id, _| vec![(id, Vec::new())], "the answer has no header"),
        // A sample comes twice, in the place of another one.
        (
            [3, 3],
            |id, bytes| {
                let lines = lines(&bytes);
                vec![(id, [&[lines[0], lines[1]], &lines[1..lines.len() - 1]].concat().concat())]
            },
            "there is sample 28 of `low-thw-overtake` instead of 29",
        ),
        (
            [3, 3],
            |id, bytes| vec![(id, text(&bytes).replacen("thw", "tww", 1).into_bytes())],
            "the line does not agree with its checksum",
        ),
        (
            [3, 3],
            |id, bytes| vec![(id, text(&bytes).replacen("+", "+0", 1).into_bytes())],
            "they were made by Closecall",
        ),
        ([3, 3], |id, bytes| vec![(id, bytes.clone()), (id, bytes)], "which is not awaited"),
    ];
    for (seeds, change, message) in cases {
        let (error, count) = error(seeds, change);
        assert!(error.to_string().contains(message), "{message}: {error}");
        assert!(!error.is_input() && count == 0, "{message}: {count} records");
    }
}

/// Samples a collision of the seed 3 by importance sampling, here or on other machines.
fn rare(remote: Option<Arc<dyn PointRunner>>) -> Result<RareReport, RareError> {
    let nearness = Nearness::new("collision".parse().unwrap(), None).unwrap();
    let goal = Goal { relative_width: 0.5, budget: 600, value: 0 };
    let workers = Workers::default();
    let sampled = RarePlan { method: Method::Importance, nearness, goal, workers, remote, part: None };
    let work = plan(3).campaign().works[0].clone();
    sampled.run((0, &work), None, &StopFlag::default(), &mut || {})
}

#[test]
fn the_runs_of_a_rare_event_on_other_machines_are_those_of_one_machine() {
    let on_machines = |seed: u64, change: Change| rare(Some(Arc::new(machines([3, seed], change).0)));
    let here = rare(None).unwrap();
    assert!(here.runs > 0, "{here:?}");
    assert_eq!(on_machines(3, unchanged).unwrap(), here);
    let error = on_machines(4, disguised).unwrap_err().to_string();
    assert!(error.contains("the run of point 0 has another seed or other values"), "{error}");
    let error = on_machines(4, unchanged).unwrap_err().to_string();
    assert!(error.contains("they are of another configuration"), "{error}");
}

#[test]
fn a_machine_with_another_campaign_is_refused() {
    let manifest = plan(3).manifest(Vec::new()).unwrap();
    let shipment = Shipment::of(&manifest).unwrap();
    let error = |shipment: &Shipment| BlockRunner::prepare(shipment).unwrap_err();
    let other = Shipment { version: "0.0.1+00".to_owned(), ..shipment.clone() };
    let message = error(&other).to_string();
    assert!(message.contains("0.0.1+00") && message.contains(&manifest.closecall_version), "{message}");
    // The manifest's statements about the scenario must agree with the text that the machine reads.
    let mut changed = manifest.clone();
    changed.scenarios[0].blake3 = blake3::hash(b"").to_string();
    let other = Shipment::of(&changed).unwrap();
    assert!(error(&other).to_string().contains("has been changed"), "{}", error(&other));
    let mut changed = manifest;
    changed.models.push(crate::manifest::ManifestModel {
        name: "rear-classifier".to_owned(),
        blake3: "1a2b".to_owned(),
        backend: "tract".to_owned(),
    });
    let message = error(&Shipment::of(&changed).unwrap()).to_string();
    assert!(message.starts_with("this machine would not run the same campaign:\n  models"), "{message}");
    assert!(matches!(BlockRunner::prepare(&shipment).unwrap().run(1, &[0]), Err(RemoteError::NoBlock { work: 1 })));
    let outside = BlockRunner::prepare(&shipment).unwrap().run(0, &[0, SAMPLES]);
    assert!(matches!(outside, Err(RemoteError::NoBlock { work: 0 })));
}

#[test]
fn a_block_takes_about_a_second() {
    let pace = |samples, spent_s| Pace { samples, spent_s }.block_len();
    assert_eq!(Pace::default().block_len(), FIRST_BLOCK);
    assert_eq!(pace(100, 1.0), 100);
    assert_eq!(pace(4, 40.0), 1);
    assert_eq!((pace(4, 0.0), pace(4, f64::NAN)), (LARGEST_BLOCK, 1));
}
