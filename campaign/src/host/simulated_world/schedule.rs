//! One schedule: a campaign that is disturbed, interrupted, damaged and resumed, and the properties
//! that must hold.

use std::fmt;
use std::fs;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use closecall_scenarios::ScenarioFile;
use closecall_scenarios::sampling::Design;
use closecall_simulation::controller::ControllerChoice;
use closecall_traffic::Stream;
use rand::{RngExt, SeedableRng};

use super::machine::{Machine, Reader};
use super::process::{State, Truth};
use crate::campaign_error::CampaignError;
use crate::execution::Campaign;
use crate::folder::{Folder, FolderError, JOURNAL};
use crate::gate::{GateSet, Judge};
use crate::journal::{self, Entry, FREE_BYTES};
use crate::manifest::Manifest;
use crate::plan::Plan;
use crate::record::Record;
use crate::sampling::Sampling;
use crate::stop::{End, StopFlag};
use crate::validity::CheckPlan;
use crate::verdict::{self, Verdict};
use crate::workers::Samples;

/// Number of samples of the campaign.
const SAMPLES: u64 = 6;
/// Seeds of the campaign, and of another campaign. A journal with a record of the other campaign
/// must be refused.
const SEEDS: [u64; 2] = [1, 2];
/// Largest number of disturbed runs before the last one.
const MOST_RUNS: u32 = 3;
/// Probabilities of a fault in the answer to a question (-).
const RATES: [f64; 3] = [0.02, 0.1, 0.3];
/// Probability of a signal at each question, in a run that has signals (-).
const SIGNAL_RATE: f64 = 0.05;
/// Room on a disk that may become full (bytes): some more than the journal needs.
const MOST_FREE_BYTES: usize = 100_000;

/// A broken property.
#[derive(Debug)]
pub(super) enum Violation {
    /// The journal has the outcome of another sample.
    OtherOutcome { sample: u64, arm: usize },
    /// A sample was run again after a failure, and its record does not say so.
    SilentRetry { arm: usize, sample: u64, crashes: u32, told: u32 },
    /// A check that took too long counts as a defect of the simulator.
    TimeAsDefect { sample: u64, arm: usize },
    /// A part of the samples counts as all samples.
    PartialData { has: u64 },
    /// The journal lacks records, and nobody is told.
    Lost { kept: u64, records: u64 },
    /// Samples have no outcome, and the verdict is not ERROR.
    HiddenError { errors: u64, verdict: Option<Verdict> },
    /// A journal with a line of another campaign was resumed.
    ForeignLine,
    /// The program refuses the journal that it has written.
    OwnJournalRefused { message: String },
    /// The last run, which has no fault, does not give the records of an undisturbed campaign.
    Unlike { difference: String },
}

impl fmt::Display for Violation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OtherOutcome { sample, arm } => {
                write!(f, "the journal files another outcome under sample {sample} of arm {arm}")
            }
            Self::SilentRetry { arm, sample, crashes, told } => {
                write!(f, "sample {sample} of arm {arm} has an outcome after {crashes} failures, and tells of {told}")
            }
            Self::TimeAsDefect { sample, arm } => {
                write!(f, "a check of sample {sample} in arm {arm} took too long, and counts as broken")
            }
            Self::PartialData { has } => write!(f, "{has} of {SAMPLES} records pass for all of them"),
            Self::Lost { kept, records } => write!(f, "{kept} of {records} records are kept, and nobody is told"),
            Self::HiddenError { errors, verdict } => write!(f, "{errors} errors, and the verdict is {verdict:?}"),
            Self::OwnJournalRefused { message } => write!(f, "the program refuses its own journal: {message}"),
            Self::ForeignLine => f.write_str("a journal with a line of another campaign is resumed"),
            Self::Unlike { difference } => {
                write!(f, "the last run, without faults, is unlike an undisturbed one: {difference}")
            }
        }
    }
}

/// The campaign that all schedules run.
pub(super) struct Setup {
    campaign: Campaign,
    manifest: Manifest,
    truth: Arc<Truth>,
    /// The lines of the journal of the other campaign.
    foreign: Vec<Vec<u8>>,
    gates: GateSet,
}

fn plan(seed: u64) -> Plan {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/fixtures/known-probability.toml");
    let file = ScenarioFile::load(&path, &[]).unwrap();
    let sampling = Sampling { seed, design: Design::Random, samples: SAMPLES };
    let controllers = vec![ControllerChoice::ACC, ControllerChoice::MIS];
    let mut plan = Plan::new(vec![file], sampling, controllers).unwrap();
    plan.checks = CheckPlan::off();
    plan
}

fn truth(campaign: &Campaign) -> Truth {
    let work = &campaign.works[0];
    let record = |arm, sample| work.run(sample, arm, Duration::MAX, &|_| {}).record;
    (0..work.arms.len()).map(|arm| (0..SAMPLES).map(|sample| record(arm, sample)).collect()).collect()
}

fn records(truth: &Truth, scenario: &str) -> Vec<Record> {
    let record = |sample: u64| Record {
        scenario: scenario.to_owned(),
        sample,
        arms: truth.iter().map(|arm| arm[usize::try_from(sample).unwrap()].clone()).collect(),
    };
    (0..SAMPLES).map(record).collect()
}

impl Setup {
    pub(super) fn new() -> Self {
        let [campaign, other] = SEEDS.map(|seed| plan(seed).campaign());
        let scenario = campaign.works[0].scenario().to_owned();
        let foreign = records(&truth(&other), &scenario).iter().map(|record| journal::line(record).unwrap()).collect();
        Self {
            truth: Arc::new(truth(&campaign)),
            foreign,
            manifest: plan(SEEDS[0]).manifest(Vec::new()).unwrap(),
            campaign,
            gates: GateSet::of(["upper(ego_collided) <= 0.99".parse().unwrap()]),
        }
    }

    /// Runs a schedule, and returns the number of its faults.
    pub(super) fn run(&self, seed: u64, reader: Reader) -> Result<u64, Violation> {
        let folder = tempfile::tempdir_in(memory_folder()).unwrap();
        let mut random = Stream::seed_from_u64(seed);
        let mut faults = 0;
        for _ in 0..random.random_range(1..=MOST_RUNS) {
            let rate = RATES[random.random_range(0..RATES.len())];
            let kill_after = random.random_bool(0.5).then(|| random.random_range(1..=SAMPLES));
            let retry_errors = random.random_bool(0.3);
            let retry_crashed = random.random_range(0..=2);
            let signal_rate = if random.random_bool(0.3) { SIGNAL_RATE } else { 0.0 };
            let free_bytes = random.random_bool(0.3).then(|| random.random_range(0..MOST_FREE_BYTES));
            let goes_on = random.random();
            let plan = Run { kill_after, retry_errors, retry_crashed, rate, signal_rate, free_bytes, goes_on };
            faults += self.run_once(folder.path(), &mut random, plan, reader)?.0;
            faults += u64::from(self.damage(folder.path(), &mut random, reader)?);
        }
        let last = Run {
            kill_after: None,
            retry_errors: true,
            retry_crashed: 0,
            rate: 0.0,
            signal_rate: 0.0,
            free_bytes: None,
            goes_on: false,
        };
        let (_, end) = self.run_once(folder.path(), &mut random, last, reader)?;
        self.compare_with_undisturbed(folder.path(), end)?;
        Ok(faults)
    }

    /// Runs or resumes the campaign once.
    fn run_once(
        &self,
        path: &Path,
        random: &mut Stream,
        run: Run,
        reader: Reader,
    ) -> Result<(u64, Option<Verdict>), Violation> {
        let state = State {
            now: Duration::ZERO,
            random: Stream::seed_from_u64(random.random()),
            rate: run.rate,
            signal_rate: run.signal_rate,
            faults: 0,
            crashes: 0,
        };
        let machine = Arc::new(Machine::new(state, &self.truth, reader));
        let mut campaign = self.campaign.clone();
        campaign.remote = Some(machine.clone());
        campaign.retry_errors = run.retry_errors;
        campaign.goes_on_without_folder = run.goes_on;
        campaign.stop = StopFlag::default();
        let work = campaign.works[0].as_ref().clone();
        campaign.works = vec![Arc::new(crate::runner::Work { retry_crashed: run.retry_crashed, ..work })];
        let (mut summary, mut records, mut run_now) = (campaign.summary(), 0, 0);
        let mut judge = Judge::new(&campaign.works, &self.gates, campaign.inference);
        let locked = Folder::lock(path, &self.manifest, true).unwrap();
        let before = if path.join(JOURNAL).exists() { journal_lines(path) } else { Vec::new() };
        FREE_BYTES.set(run.free_bytes);
        let ended = campaign.run(Some(&locked), |next| {
            summary.push(next.record);
            judge.push(next.record);
            records += 1;
            run_now += u64::from(next.is_new);
            match run.kill_after {
                Some(last) if next.is_new && last == run_now => ControlFlow::Break(End::Campaign),
                _ => ControlFlow::Continue(()),
            }
        });
        FREE_BYTES.set(None);
        let report = match ended {
            Ok(report) => Some(report),
            Err(CampaignError::Folder(error)) => {
                return Err(Violation::OwnJournalRefused { message: error.to_string() });
            }
            Err(CampaignError::Write(_)) if run.free_bytes.is_some() => None,
            Err(error) => panic!("{error}"),
        };
        if let Some(violation) = machine.violation.lock().unwrap().take() {
            return Err(violation);
        }
        self.check_outcomes(path)?;
        check_retries(&before, &journal_lines(path))?;
        let kept = journal_lines(path).len() as u64;
        if report.as_ref().is_some_and(|report| report.lost.is_none()) && kept < records {
            return Err(Violation::Lost { kept, records });
        }
        let complete: Result<Vec<Record>, FolderError> = locked.folder.complete_records().unwrap().collect();
        if complete.is_ok() != (kept == SAMPLES) {
            return Err(Violation::PartialData { has: records });
        }
        let errors = summary.total().errors();
        let is_judged = report.is_some() && records == SAMPLES;
        let verdict = is_judged.then(|| verdict::judge(&summary, &judge, (&self.gates).into()).verdict());
        let verdict = verdict.flatten();
        if errors > 0 && verdict.is_some_and(|verdict| verdict != Verdict::Error) {
            return Err(Violation::HiddenError { errors, verdict });
        }
        Ok((machine.faults(), verdict))
    }

    /// Checks that each record of the journal has the outcome of its own sample, and no broken
    /// check.
    fn check_outcomes(&self, path: &Path) -> Result<(), Violation> {
        for entry in journal::read(&path.join(JOURNAL)).unwrap() {
            let Entry::Record { record, .. } = entry.unwrap() else { break };
            let sample = record.sample;
            for (arm, there) in record.arms.iter().enumerate() {
                let truth = &self.truth[arm][usize::try_from(sample).unwrap()];
                let is_other = |outcome| !truth.result.as_ref().is_ok_and(|truth| truth.has_same_bits(outcome));
                if there.result.as_ref().is_ok_and(is_other) {
                    return Err(Violation::OtherOutcome { sample, arm });
                }
                // No check finds anything: the only faults of checks are hanging calls.
                if there.checks.as_ref().is_some_and(|checks| !checks.broken.is_empty()) {
                    return Err(Violation::TimeAsDefect { sample, arm });
                }
            }
        }
        Ok(())
    }

    /// Damages the journal as a power failure, a disk or a person does. Undoes the damage if the
    /// campaign refuses to resume. Returns whether the journal was damaged.
    fn damage(&self, path: &Path, random: &mut Stream, reader: Reader) -> Result<bool, Violation> {
        let journal = path.join(JOURNAL);
        let before = fs::read(&journal).unwrap();
        let mut lines: Vec<Vec<u8>> = before.split_inclusive(|byte| *byte == b'\n').map(<[u8]>::to_vec).collect();
        // A full disk has damaged the journal already, or a signal has ended its repair.
        let is_damaged = journal_lines(path).len() < lines.len();
        if lines.is_empty() || is_damaged || reader != Reader::OfTheProgram {
            return Ok(false);
        }
        let line = random.random_range(0..lines.len());
        let mut is_foreign = false;
        let after = match random.random_range(0..7) {
            0 => before[..random.random_range(0..before.len())].to_vec(),
            1 => {
                lines.insert(line, lines[line].clone());
                lines.concat()
            }
            2 => {
                let mut bytes = before.clone();
                let at = random.random_range(0..bytes.len());
                bytes[at] ^= 1 << random.random_range(0..8);
                bytes
            }
            3 => {
                is_foreign = true;
                lines[line] = self.foreign[line].clone();
                lines.concat()
            }
            4 => {
                lines.swap(line, 0);
                lines.concat()
            }
            5 => {
                lines.remove(line);
                lines.concat()
            }
            _ => return Ok(false),
        };
        fs::write(&journal, &after).unwrap();
        let mut campaign = self.campaign.clone();
        // No sample runs: only the journal is read.
        campaign.remote = Some(Arc::new(Refusing));
        let locked = Folder::lock(path, &self.manifest, true).unwrap();
        let complete: Result<Vec<Record>, FolderError> = locked.folder.complete_records().unwrap().collect();
        let records = complete.as_ref().map_or(0, Vec::len) as u64;
        if records > 0 && records < SAMPLES {
            return Err(Violation::PartialData { has: records });
        }
        let resumed = campaign.run(Some(&locked), |_| ControlFlow::Continue(()));
        match resumed {
            Err(CampaignError::Folder(_)) => fs::write(&journal, &before).unwrap(),
            _ if is_foreign => return Err(Violation::ForeignLine),
            // A sample had to be run: the next run does it, on the damaged journal.
            Err(_) => fs::write(&journal, &after).unwrap(),
            Ok(_) => {}
        }
        self.check_outcomes(path)?;
        Ok(true)
    }

    /// Compares the finished campaign with an undisturbed campaign, except for the notes of
    /// crashes. A check that took too long has run again.
    fn compare_with_undisturbed(&self, path: &Path, end: Option<Verdict>) -> Result<(), Violation> {
        let mut there = journal_lines(path);
        there.iter_mut().flat_map(|record| &mut record.arms).for_each(|arm| arm.flaky = None);
        let undisturbed = records(&self.truth, self.campaign.works[0].scenario());
        if there != undisturbed {
            return Err(Violation::Unlike { difference: format!("{} records", there.len()) });
        }
        match end {
            Some(Verdict::Pass) => Ok(()),
            other => Err(Violation::Unlike { difference: format!("the verdict is {other:?}") }),
        }
    }
}

/// Checks that each sample says so that had ended in an error before it had an outcome.
fn check_retries(before: &[Record], after: &[Record]) -> Result<(), Violation> {
    for record in after {
        let Some(earlier) = before.iter().find(|earlier| earlier.sample == record.sample) else { continue };
        for (index, (arm, earlier)) in record.arms.iter().zip(&earlier.arms).enumerate() {
            if arm.result.is_ok() && earlier.result.is_err() && arm.flaky.is_none() {
                return Err(Violation::SilentRetry { arm: index, sample: record.sample, crashes: 1, told: 0 });
            }
        }
    }
    Ok(())
}

/// The course of one run of the campaign.
#[derive(Clone, Copy)]
struct Run {
    /// The number of new records after which the program is killed.
    kill_after: Option<u64>,
    retry_errors: bool,
    retry_crashed: u32,
    /// Probability of a fault in the answer to a question (-).
    rate: f64,
    /// Probability of a signal at each question (-).
    signal_rate: f64,
    /// Room for the journal; `None` without a limit.
    free_bytes: Option<usize>,
    /// Whether the campaign goes on without its folder when the disk is full.
    goes_on: bool,
}

/// A runner that refuses every sample.
struct Refusing;

impl crate::workers::SampleRunner for Refusing {
    fn run(
        &self,
        _: (usize, &Arc<crate::runner::Work>),
        samples: &mut dyn Iterator<Item = u64>,
        _: &crate::stop::StopFlag,
        _: &mut crate::workers::OnFinished<'_>,
    ) -> Result<(), CampaignError> {
        match samples.next() {
            None => Ok(()),
            Some(sample) => {
                Err(CampaignError::Refused { reason: format!("sample {sample} is not run"), has_changed: true })
            }
        }
    }
}

fn journal_lines(path: &Path) -> Vec<Record> {
    let entries = journal::read(&path.join(JOURNAL)).unwrap();
    entries
        .map_while(|entry| match entry.unwrap() {
            Entry::Record { record, .. } => Some(*record),
            Entry::Torn { .. } => None,
        })
        .collect()
}

/// Returns a folder in memory, if the system has one.
fn memory_folder() -> PathBuf {
    let shared = PathBuf::from("/dev/shm");
    if shared.is_dir() { shared } else { std::env::temp_dir() }
}
