//! Runs a campaign from its first sample to its last, or resumes one that was interrupted.

use std::ops::ControlFlow;
use std::sync::Arc;

use super::folder::{FolderError, LockedFolder, ResumedFiles, TornLine};
use super::gate::{GateSet, Judge};
use super::host::{Refusal, refusal};
use super::ledger::Inference;
use super::partition::Partition;
use super::record::Record;
use super::repair::{Repair, key_of, repair};
use super::runner::Work;
use super::stop::StopFlag;
use super::summary::Summary;
use super::verdict::{self, Judgement};
use super::wall_times::{SpentTime, WallTime};
use super::workers::{Finished, SampleRunner, Workers};
use closecall_traffic::atomic::WriteError;
use closecall_traffic::words::{counted, was};

pub use super::stop::End;

pub use super::campaign_error::CampaignError;

/// A campaign. Its scenarios run one after the other, and the samples of each scenario in the order
/// of their numbers.
#[derive(Clone)]
pub struct Campaign {
    /// The scenarios with their samples and arms.
    pub works: Vec<Arc<Work>>,
    /// The part of the samples that is run; `None` for all of them.
    pub partition: Option<Partition>,
    /// The number of worker threads, and the time limit of a sample.
    pub workers: Workers,
    /// The rule that determines the number of samples.
    pub inference: Inference,
    /// The runner of the samples, if the threads of this process do not run them.
    pub remote: Option<Arc<dyn SampleRunner>>,
    /// True if samples of the journal that ended in an error are run again.
    pub retry_errors: bool,
    /// True if the campaign goes on without its folder when results cannot be written, for example
    /// on a full disk. It then still counts every sample. If false, it ends there.
    pub goes_on_without_folder: bool,
    /// A request from outside to start no further samples.
    pub stop: StopFlag,
}

/// The state of the journal of a campaign that goes on.
#[derive(Debug, Default)]
pub struct ResumeReport {
    /// The line at which the journal was cut off: it and everything after it was damaged.
    pub torn: Option<TornLine>,
    /// Damaged lines before intact ones. Their samples were run again, and all other lines were
    /// kept.
    pub damaged: Vec<TornLine>,
    /// Number of samples that had ended in an error, and were run again.
    pub retried: u64,
    /// Number of lines that repeated another line, and were removed.
    pub doubled: u64,
    /// Number of samples that were added to a scenario before the next one, because the campaign
    /// has grown.
    pub added: u64,
    /// Why the last records are not in the folder, if the campaign went on without it.
    pub lost: Option<WriteError>,
}

impl ResumeReport {
    /// Returns these facts as messages for human readers.
    pub fn messages(&self) -> Vec<String> {
        let damaged = self.damaged.iter().map(|TornLine { line, reason }| {
            format!("line {line} of the journal was damaged ({reason}): its sample was run again")
        });
        let retried = (self.retried > 0).then(|| {
            format!("{} that had ended in an error {} run again", counted(self.retried, "sample"), was(self.retried))
        });
        let torn = self.torn.iter().map(|TornLine { line, reason }| {
            format!("the journal was torn at line {line} ({reason}): the samples from there on were run again")
        });
        let doubled = (self.doubled > 0).then(|| {
            format!(
                "{} of the journal that repeated another line {} removed",
                counted(self.doubled, "line"),
                was(self.doubled)
            )
        });
        let added = (self.added > 0)
            .then(|| format!("{} {} added to earlier scenarios", counted(self.added, "sample"), was(self.added)));
        damaged.chain(retried).chain(doubled).chain(added).chain(torn).collect()
    }
}

/// A record that [`Campaign::run`] passes on, in the order of the plan.
#[derive(Clone, Copy, Debug)]
pub struct NextRecord<'a> {
    /// Index of the record's scenario in [`Campaign::works`].
    pub work: usize,
    /// The record.
    pub record: &'a Record,
    /// True if the sample has just been run, false if the record was read from the journal.
    pub is_new: bool,
    /// The wall times of the sample; 0 if the record was read from the journal.
    pub spent: SpentTime,
}

impl Campaign {
    /// Returns a campaign that runs every sample of the given scenarios.
    pub fn new(works: Vec<Arc<Work>>, workers: Workers) -> Self {
        Self {
            works,
            partition: None,
            workers,
            inference: Inference::default(),
            remote: None,
            retry_errors: false,
            goes_on_without_folder: false,
            stop: StopFlag::default(),
        }
    }

    /// Returns a summary of no samples yet.
    pub fn summary(&self) -> Summary {
        Summary::of(&self.works).with_inference(self.inference)
    }

    /// Runs every sample, keeps nothing but the counts, and returns them.
    ///
    /// # Errors
    /// [`CampaignError::Workers`] if no threads can be started.
    pub fn count(&self) -> Result<Summary, CampaignError> {
        let mut summary = self.summary();
        self.run(None, |next| {
            summary.push(next.record);
            ControlFlow::Continue(())
        })?;
        Ok(summary)
    }

    /// Runs every sample, keeps nothing but the counts, and judges them.
    ///
    /// # Errors
    /// [`CampaignError::Workers`] if no threads can be started.
    pub fn judge(&self, gates: &GateSet) -> Result<(Summary, Judgement), CampaignError> {
        let mut summary = self.summary();
        let mut judge = Judge::new(&self.works, gates, self.inference);
        self.run(None, |next| {
            summary.push(next.record);
            judge.push(next.record);
            ControlFlow::Continue(())
        })?;
        let judged = verdict::judge(&summary, &judge, gates.into());
        Ok((summary, judged))
    }

    /// Returns what runs the samples, for a message: `8 threads`.
    pub fn place(&self) -> String {
        if self.remote.is_some() { "a cluster".to_owned() } else { counted(self.workers.jobs.get(), "thread") }
    }

    /// Returns the number of samples of all scenarios.
    pub fn len(&self) -> u64 {
        self.works.iter().map(|work| work.samples(self.partition).count() as u64).sum()
    }

    /// Returns true if the campaign has no samples.
    pub fn is_empty(&self) -> bool {
        self.works.iter().all(|work| work.samples(self.partition).next().is_none())
    }

    /// Runs the samples that the folder's journal does not hold yet; all samples if there is no
    /// folder.
    ///
    /// `on_record` receives every record in the order of the plan, the records of the journal
    /// first. If it breaks, the scenario or the campaign ends after that record.
    ///
    /// If [`Self::stop`] is set, no further sample starts, and the campaign ends with the samples
    /// that are done.
    ///
    /// Returns the state of the journal.
    ///
    /// # Errors
    /// [`CampaignError`] if the folder cannot be read or written, or no threads can be started.
    pub fn run(
        &self,
        folder: Option<&LockedFolder>,
        mut on_record: impl FnMut(NextRecord<'_>) -> ControlFlow<End>,
    ) -> Result<ResumeReport, CampaignError> {
        let Repair { damaged, retried, doubled, added } =
            folder.map(|folder| repair(self, folder)).transpose()?.unwrap_or_default();
        let mut report = ResumeReport { torn: None, damaged, retried, doubled, added, lost: None };
        if let Some(folder) = folder.filter(|folder| self.stop.is_set() && folder.journal_path().exists()) {
            // Damaged lines may be left: the journal is read, but not opened for appending, which
            // would cut it.
            for record in folder.folder.records()?.map_while(Result::ok) {
                let Some((work, _)) = key_of(self, &record) else { break };
                if on_record(NextRecord { work, record: &record, is_new: false, spent: SpentTime::default() })
                    .is_break()
                {
                    break;
                }
            }
            return Ok(report);
        }
        let mut position = Position { work: 0, done: 0, total: 0, is_over: false };
        let mut kept = KeptFiles { files: None, may_be_lost: self.goes_on_without_folder, lost: None };
        match folder.map(|folder| self.resume(folder, &mut position, &mut on_record)).transpose() {
            Ok(files) => kept.files = files,
            // All records of the journal have been read before the files are opened for appending.
            Err(FolderError::Write(error)) if kept.may_be_lost => kept.lost = Some(error),
            Err(error) => return Err(error.into()),
        }
        report.torn = kept.files.as_mut().and_then(|files| files.torn.take());
        if !position.is_over {
            self.run_from(position, &mut kept, &mut on_record)?;
        }
        kept.write(|files| {
            files.journal.sync()?;
            files.wall_times.flush()
        })?;
        report.lost = kept.lost;
        Ok(report)
    }

    /// Passes on the records of the journal, and moves `position` behind the last one.
    fn resume(
        &self,
        folder: &LockedFolder,
        position: &mut Position,
        on_record: &mut impl FnMut(NextRecord<'_>) -> ControlFlow<End>,
    ) -> Result<ResumedFiles, FolderError> {
        let mut samples = self.works.first().map(|work| work.samples(self.partition));
        folder.resume(|record| {
            loop {
                let out_of_order = || {
                    let (sample, scenario) = (record.sample, &record.scenario);
                    format!("sample {sample} of `{scenario}` is not the next sample of the campaign")
                };
                let Some(work) = self.works.get(position.work) else { return Err(out_of_order()) };
                match samples.as_mut().and_then(Iterator::next) {
                    Some(sample) => {
                        let is_next = record.scenario == work.file.config().name && record.sample == sample;
                        if position.is_over || !is_next {
                            return Err(out_of_order());
                        }
                        work.identity().check(record, sample)?;
                        position.done += 1;
                        position.total += 1;
                        let next =
                            NextRecord { work: position.work, record, is_new: false, spent: SpentTime::default() };
                        let end = on_record(next).break_value();
                        position.is_over = end == Some(End::Campaign);
                        if end == Some(End::Scenario) {
                            (position.work, position.done) = (position.work + 1, 0);
                            samples = self.works.get(position.work).map(|work| work.samples(self.partition));
                        }
                        return Ok(());
                    }
                    None => {
                        (position.work, position.done) = (position.work + 1, 0);
                        samples = self.works.get(position.work).map(|work| work.samples(self.partition));
                    }
                }
            }
        })
    }

    fn run_from(
        &self,
        start: Position,
        kept: &mut KeptFiles,
        on_record: &mut impl FnMut(NextRecord<'_>) -> ControlFlow<End>,
    ) -> Result<(), CampaignError> {
        let (mut index, mut is_over) = (start.total, false);
        for (number, work) in self.works.iter().enumerate().skip(start.work) {
            let done = if number == start.work { start.done } else { 0 };
            let samples = work.samples(self.partition).skip(done);
            self.run_samples((number, work), samples, |finished: Finished| {
                kept.write(|files| append(files, index, &finished))?;
                index += 1;
                let spent = SpentTime { runs_s: finished.wall_s.iter().sum(), checks_s: finished.check_s };
                let next = NextRecord { work: number, record: &finished.record, is_new: true, spent };
                let end = on_record(next).break_value();
                is_over = end == Some(End::Campaign);
                Ok(if end.is_some() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) })
            })?;
            if is_over || self.stop.is_set() {
                break;
            }
        }
        Ok(())
    }

    /// Runs samples of one scenario, which is given with its index, on this machine or on others.
    /// See [`Workers::run`].
    pub(super) fn run_samples(
        &self,
        (number, work): (usize, &Arc<Work>),
        mut samples: impl Iterator<Item = u64>,
        mut on_finished: impl FnMut(Finished) -> Result<ControlFlow<()>, CampaignError>,
    ) -> Result<(), CampaignError> {
        let mut on_finished = |finished: Finished| match refusal(&finished.record) {
            Some(Refusal { reason, has_changed }) => {
                Err(CampaignError::Refused { reason: reason.to_owned(), has_changed })
            }
            None => on_finished(finished),
        };
        match &self.remote {
            Some(remote) => remote.run((number, work), &mut samples, &self.stop, &mut on_finished),
            None => self.workers.run(work, samples, &self.stop, on_finished),
        }
    }
}

/// The files of a running campaign, if it has any.
struct KeptFiles {
    files: Option<ResumedFiles>,
    /// True if the campaign goes on when the files cannot be written.
    may_be_lost: bool,
    /// Why the files cannot be written.
    lost: Option<WriteError>,
}

impl KeptFiles {
    /// Writes to the files, if there are any.
    fn write(&mut self, write: impl FnOnce(&mut ResumedFiles) -> Result<(), WriteError>) -> Result<(), WriteError> {
        let Some(Err(error)) = self.files.as_mut().map(write) else { return Ok(()) };
        if !self.may_be_lost {
            return Err(error);
        }
        (self.files, self.lost) = (None, Some(error));
        Ok(())
    }
}

/// The next sample of a campaign.
#[derive(Clone, Copy)]
struct Position {
    /// Index of the current scenario: the number of scenarios that are done.
    work: usize,
    /// Number of samples of the current scenario that are done.
    done: usize,
    /// Number of samples of all scenarios that are done.
    total: u64,
    /// True if `on_record` has ended the campaign.
    is_over: bool,
}

fn append(files: &mut ResumedFiles, index: u64, finished: &Finished) -> Result<(), WriteError> {
    files.journal.append(&finished.record)?;
    files.wall_times.append(&WallTime {
        index,
        scenario: finished.record.scenario.clone(),
        sample: finished.record.sample,
        wall_s: finished.wall_s.clone(),
    })
}
