//! Runs a campaign from its first sample to its last, or resumes one that was interrupted.

use std::collections::BTreeSet;
use std::ops::ControlFlow;
use std::sync::Arc;

use super::ahead::{self, AheadFile, EarlySample, SampleKey};
use super::earlier_failures::EarlierFailures;
use super::folder::{AHEAD, FolderError, LockedFolder, ResumedFiles, TornLine};
use super::gate::{GateSet, Judge};
use super::host::{Refusal, refusal};
use super::ledger::Inference;
use super::partition::{Partition, samples_in};
use super::record::{ArmRecord, Record};
use super::repair::{Repair, key_of, repair};
use super::runner::Work;
use super::stop::StopFlag;
use super::summary::Summary;
use super::verdict::{self, Judgement};
use super::wall_times::{SpentTime, WallTime};
use super::workers::{Finished, SampleRunner, Workers};
use closecall_traffic::atomic::WriteError;
use closecall_traffic::words::{counted, was};

pub use super::ahead::Ahead;
pub use super::stop::End;

pub use super::campaign_error::CampaignError;

/// A campaign. Its scenarios run one after the other, and the samples of each scenario in the order
/// of their numbers. [`Campaign::run_first`] runs some of them before their turn.
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
    /// True if [`Campaign::run_first`] has passed the record on before.
    pub is_early: bool,
    /// The wall times of the sample; 0 if the record was read from the journal.
    pub spent: SpentTime,
}

impl<'a> NextRecord<'a> {
    /// Returns a record that was read from the journal, or from the file of samples that wait.
    fn read(work: usize, record: &'a Record) -> Self {
        Self { work, record, is_new: false, is_early: false, spent: SpentTime::default() }
    }

    /// Returns the record of a sample that has just been run.
    fn finished(work: usize, finished: &'a Finished) -> Self {
        let spent = SpentTime { runs_s: finished.wall_s.iter().sum(), checks_s: finished.check_s };
        Self { work, record: &finished.record, is_new: true, is_early: false, spent }
    }
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
        let samples = self.works.iter().map(|work| samples_in(self.partition, 0..work.count()));
        samples.fold(0, u64::saturating_add)
    }

    /// Returns true if the campaign has no samples.
    pub fn is_empty(&self) -> bool {
        self.works.iter().all(|work| work.samples(self.partition).next().is_none())
    }

    /// Runs samples before their turn: up to 10,000 samples that failed in an earlier campaign, in
    /// the order of the plan. A sample does not run again if the folder's journal has its record,
    /// or if an interrupted campaign has run it before its turn.
    ///
    /// `on_record` receives every record, first the records of the interrupted campaign. If it
    /// breaks, the campaign ends after that record: [`Self::run_after`] then runs no sample.
    ///
    /// Returns the results. They wait for their turn: the journal has the order of the plan.
    ///
    /// # Errors
    /// [`CampaignError`] if the folder cannot be read or written, or no threads can be started.
    pub fn run_first(
        &self,
        folder: Option<&LockedFolder>,
        first: &EarlierFailures,
        mut on_record: impl FnMut(NextRecord<'_>) -> ControlFlow<End>,
    ) -> Result<Ahead, CampaignError> {
        let path = folder.map(|folder| folder.folder.file(AHEAD));
        let kept = match &path {
            Some(path) => ahead::read(path, |record| self.place_of(record))
                .map_err(|source| FolderError::Read { path: path.clone(), source })?,
            None => ahead::Kept::default(),
        };
        let ahead::Kept { mut ahead, bytes } = kept;
        let mut wanted = self.planned_of(first);
        let looks = !wanted.is_empty() || ahead.waiting().next().is_some();
        if let Some(folder) = folder.filter(|folder| looks && folder.journal_path().exists()) {
            for record in folder.folder.records()?.map_while(Result::ok) {
                if let Some((work, sample)) = key_of(self, &record) {
                    wanted.remove(&SampleKey { work, sample });
                    ahead.take(SampleKey { work, sample });
                }
            }
        }
        let is_retried = |record: &Record| self.retry_errors && record.arms.iter().any(ArmRecord::is_incomplete);
        wanted.retain(|key| !ahead.contains(*key));
        let failed = ahead.take_all(is_retried);
        wanted.extend(failed.keys());
        let mut ends = |key: &SampleKey, record: &Record| on_record(NextRecord::read(key.work, record)).is_break();
        let is_over = ahead.entries().any(|(key, early)| ends(key, &early.finished.record));
        if is_over {
            ahead.is_over = true;
            return Ok(ahead);
        }
        let mut file = match path.as_deref().filter(|_| !wanted.is_empty()).map(|path| AheadFile::open(path, bytes)) {
            Some(Err(_)) if self.goes_on_without_folder => None,
            file => file.transpose()?,
        };
        for (number, work) in self.works.iter().enumerate() {
            let samples = wanted.iter().filter(|key| key.work == number).map(|key| key.sample);
            let samples: Vec<u64> = samples.take(ahead.room()).collect();
            if samples.is_empty() {
                continue;
            }
            self.run_samples(number, work, samples.into_iter(), |mut finished| {
                let key = SampleKey { work: number, sample: finished.record.sample };
                failed.get(&key).iter().for_each(|failed| finished.record.follow(failed));
                // Without its line, the sample runs again if the campaign is interrupted.
                match file.as_mut().map_or(Ok(()), |file| file.append(&finished)) {
                    Err(_) if self.goes_on_without_folder => file = None,
                    written => written?,
                }
                ahead.is_over = on_record(NextRecord::finished(number, &finished)).is_break();
                ahead.insert(key, EarlySample { finished, is_new: true });
                Ok(if ahead.is_over { ControlFlow::Break(()) } else { ControlFlow::Continue(()) })
            })?;
            if ahead.is_over || self.stop.is_set() {
                break;
            }
        }
        Ok(ahead)
    }

    /// Returns the samples of the campaign that failed in an earlier one.
    fn planned_of(&self, first: &EarlierFailures) -> BTreeSet<SampleKey> {
        let mut planned = BTreeSet::new();
        for (index, work) in self.works.iter().enumerate() {
            let failing = first.of(&work.file.config().name).iter().copied();
            let keys = failing.map(|sample| SampleKey { work: index, sample });
            planned.extend(keys.filter(|key| self.has(*key)));
        }
        planned
    }

    /// Returns true if the campaign has this sample.
    fn has(&self, key: SampleKey) -> bool {
        let is_in_part = self.partition.is_none_or(|part| part.contains(key.sample));
        is_in_part && self.works.get(key.work).is_some_and(|work| key.sample < work.count())
    }

    /// Returns the place of a record that belongs to a sample of the campaign; `None` for another
    /// record.
    fn place_of(&self, record: &Record) -> Option<SampleKey> {
        let (work, sample) = key_of(self, record)?;
        let key = Some(SampleKey { work, sample }).filter(|key| self.has(*key))?;
        self.works[work].identity().check(record, sample).ok().map(|()| key)
    }

    /// Does the same as [`Self::run_after`] without samples that have run before their turn.
    ///
    /// # Errors
    /// As [`Self::run_after`].
    pub fn run(
        &self,
        folder: Option<&LockedFolder>,
        on_record: impl FnMut(NextRecord<'_>) -> ControlFlow<End>,
    ) -> Result<ResumeReport, CampaignError> {
        self.run_after(folder, &mut Ahead::default(), on_record)
    }

    /// Runs the samples that neither the folder's journal nor `ahead` holds; all samples if there
    /// is no folder and `ahead` is empty. A sample of `ahead` is taken out when its turn has come.
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
    pub fn run_after(
        &self,
        folder: Option<&LockedFolder>,
        ahead: &mut Ahead,
        mut on_record: impl FnMut(NextRecord<'_>) -> ControlFlow<End>,
    ) -> Result<ResumeReport, CampaignError> {
        let Repair { damaged, retried, doubled, added } =
            folder.map(|folder| repair(self, folder)).transpose()?.unwrap_or_default();
        let mut report = ResumeReport { torn: None, damaged, retried, doubled, added, lost: None };
        let runs_nothing = self.stop.is_set() || ahead.is_over;
        if let Some(folder) = folder.filter(|folder| runs_nothing && folder.journal_path().exists()) {
            // Damaged lines may be left: the journal is read, but not opened for appending, which
            // would cut it.
            for record in folder.folder.records()?.map_while(Result::ok) {
                let Some((work, _)) = key_of(self, &record) else { break };
                if on_record(NextRecord::read(work, &record)).is_break() {
                    break;
                }
            }
            return Ok(report);
        }
        let mut position = Position { work: 0, done: 0, total: 0, is_over: false };
        let mut kept = KeptFiles { files: None, may_be_lost: self.goes_on_without_folder, lost: None };
        match folder.map(|folder| self.resume(folder, &mut position, ahead, &mut on_record)).transpose() {
            Ok(files) => kept.files = files,
            // All records of the journal have been read before the files are opened for appending.
            Err(FolderError::Write(error)) if kept.may_be_lost => kept.lost = Some(error),
            Err(error) => return Err(error.into()),
        }
        report.torn = kept.files.as_mut().and_then(|files| files.torn.take());
        let runs = !position.is_over && !ahead.is_over;
        let is_complete = runs && self.run_from(position, &mut kept, ahead, &mut on_record)?;
        kept.write(|files| {
            files.journal.sync()?;
            files.wall_times.flush()
        })?;
        if let Some(folder) = folder.filter(|_| is_complete) {
            kept.write(|_| folder.folder.remove(AHEAD))?;
        }
        report.lost = kept.lost;
        Ok(report)
    }

    /// Passes on the records of the journal, and moves `position` behind the last one. A sample of
    /// the journal waits no longer.
    fn resume(
        &self,
        folder: &LockedFolder,
        position: &mut Position,
        ahead: &mut Ahead,
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
                        let waited = ahead.take(SampleKey { work: position.work, sample }).is_some();
                        let next = NextRecord { is_early: waited, ..NextRecord::read(position.work, record) };
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

    /// Runs the samples from `start` on, and passes on the record of each sample in its turn. The
    /// samples of `ahead` have run, and only pass on their records. Returns true if nothing has
    /// ended the campaign before its last sample.
    fn run_from(
        &self,
        start: Position,
        kept: &mut KeptFiles,
        ahead: &mut Ahead,
        on_record: &mut impl FnMut(NextRecord<'_>) -> ControlFlow<End>,
    ) -> Result<bool, CampaignError> {
        let mut passing = Passing { kept, on_record, index: start.total, is_over: false };
        for (number, work) in self.works.iter().enumerate().skip(start.work) {
            let done = if number == start.work { start.done } else { 0 };
            let waiting = ahead.numbers(number);
            let mut turns = work.samples(self.partition).skip(done).peekable();
            let samples = work.samples(self.partition).skip(done).filter(|sample| !waiting.contains(sample));
            let key = |sample| SampleKey { work: number, sample };
            let mut has_ended = false;
            self.run_samples(number, work, samples, |finished: Finished| {
                while let Some(turn) = turns.next_if(|turn| *turn != finished.record.sample) {
                    has_ended = passing.pass_waiting(key(turn), ahead)?;
                    if has_ended {
                        return Ok(ControlFlow::Break(()));
                    }
                }
                turns.next();
                has_ended = passing.pass_on(&finished, NextRecord::finished(number, &finished))?;
                Ok(if has_ended { ControlFlow::Break(()) } else { ControlFlow::Continue(()) })
            })?;
            while !has_ended && let Some(turn) = turns.next_if(|turn| waiting.contains(turn)) {
                has_ended = passing.pass_waiting(key(turn), ahead)?;
            }
            if passing.is_over || self.stop.is_set() {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Runs samples of one scenario, which is given with its index, on this machine or on others.
    /// See [`Workers::run`].
    pub(super) fn run_samples(
        &self,
        number: usize,
        work: &Arc<Work>,
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

/// Passes finished samples on: to the files, and to the caller.
struct Passing<'a, F> {
    kept: &'a mut KeptFiles,
    on_record: &'a mut F,
    /// Index of the next record in the journal.
    index: u64,
    /// True if the caller has ended the campaign.
    is_over: bool,
}

impl<F: FnMut(NextRecord<'_>) -> ControlFlow<End>> Passing<'_, F> {
    /// Passes a sample on, whose turn it is. Returns true if the caller ends the scenario or the
    /// campaign after it.
    fn pass_on(&mut self, finished: &Finished, next: NextRecord<'_>) -> Result<bool, CampaignError> {
        let index = self.index;
        self.kept.write(|files| append(files, index, finished))?;
        self.index += 1;
        let end = (self.on_record)(next).break_value();
        self.is_over = end == Some(End::Campaign);
        Ok(end.is_some())
    }

    /// Does the same for a sample that waits; nothing if it does not.
    fn pass_waiting(&mut self, key: SampleKey, ahead: &mut Ahead) -> Result<bool, CampaignError> {
        let Some(EarlySample { finished, is_new }) = ahead.take(key) else { return Ok(false) };
        let next = NextRecord { is_new, is_early: true, ..NextRecord::finished(key.work, &finished) };
        self.pass_on(&finished, next)
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
