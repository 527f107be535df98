//! A campaign from its first sample to its last, or from where it was stopped.

use std::ops::ControlFlow;
use std::sync::Arc;

use super::folder::{FolderError, Held, TakenUp};
use super::ledger::Inference;
use super::partition::Partition;
use super::record::Record;
use super::runner::Work;
use super::summary::Summary;
use super::wall_times::WallTime;
use super::workers::{Finished, Workers, WorkersError};
use closecall_scenarios::atomic::WriteError;

/// A campaign: its scenarios one after the other, the samples of each in the order of their numbers.
#[derive(Clone)]
pub struct Campaign {
    /// The scenarios.
    pub works: Vec<Arc<Work>>,
    /// Which part of the samples is run; all of them where absent.
    pub partition: Option<Partition>,
    /// Who runs them.
    pub workers: Workers,
    /// What the number of samples comes from.
    pub inference: Inference,
}

/// A campaign that could not be carried on. What its journal holds is good to go on with.
#[derive(Debug, thiserror::Error)]
pub enum CampaignError {
    /// The folder cannot be used.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// Results cannot be kept.
    #[error("{0}\nwhat was written before is kept: once there is room, go on with --resume")]
    Write(#[from] WriteError),
    /// The worker threads could not be started.
    #[error(transparent)]
    Workers(#[from] WorkersError),
}

/// What ends with a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// Its scenario: the next one begins.
    Scenario,
    /// The campaign.
    Campaign,
}

/// A record whose turn has come.
#[derive(Clone, Copy, Debug)]
pub struct Turn<'a> {
    /// The place of its scenario among the works.
    pub work: usize,
    /// The record.
    pub record: &'a Record,
    /// True where it was run now, false where it was found in the journal.
    pub is_new: bool,
}

impl Campaign {
    /// Returns a campaign that runs every sample of the given scenarios.
    pub fn new(works: Vec<Arc<Work>>, workers: Workers) -> Self {
        Self { works, partition: None, workers, inference: Inference::default() }
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
        self.run(None, |turn| {
            summary.push(turn.record);
            ControlFlow::Continue(())
        })?;
        Ok(summary)
    }

    /// How many samples there are in all.
    pub fn len(&self) -> u64 {
        self.works.iter().map(|work| work.samples(self.partition).count() as u64).sum()
    }

    /// True where there is no sample at all.
    pub fn is_empty(&self) -> bool {
        self.works.iter().all(|work| work.samples(self.partition).next().is_none())
    }

    /// Runs what is not in the folder's journal yet; everything where there is no folder. `take` gets every record in the
    /// order of the plan, those of the journal first; where it breaks, that scenario or the campaign ends with that
    /// record.
    ///
    /// Answers what was cut off the journal, where its end was torn.
    ///
    /// # Errors
    /// [`CampaignError`] where the folder cannot be read or written, or no threads can be had.
    pub fn run(
        &self,
        held: Option<&Held>,
        mut take: impl FnMut(Turn<'_>) -> ControlFlow<End>,
    ) -> Result<Option<(usize, String)>, CampaignError> {
        let mut place = Place { work: 0, done: 0, all: 0, is_over: false };
        let mut kept = match held {
            Some(held) => Some(self.take_up(held, &mut place, &mut take)?),
            None => None,
        };
        if !place.is_over {
            self.run_from(place, kept.as_mut(), &mut take)?;
        }
        if let Some(TakenUp { journal, wall_times, .. }) = &mut kept {
            journal.sync()?;
            wall_times.flush()?;
        }
        Ok(kept.and_then(|kept| kept.torn))
    }

    /// Hands on what the journal holds.
    fn take_up(
        &self,
        held: &Held,
        place: &mut Place,
        take: &mut impl FnMut(Turn<'_>) -> ControlFlow<End>,
    ) -> Result<TakenUp, FolderError> {
        let mut samples = self.works.first().map(|work| work.samples(self.partition));
        held.take_up(|record| {
            loop {
                let Some(work) = self.works.get(place.work) else { return false };
                match samples.as_mut().and_then(Iterator::next) {
                    Some(sample) => {
                        let fits = !place.is_over && is_of(record, work, sample);
                        if fits {
                            place.done += 1;
                            place.all += 1;
                            let end = take(Turn { work: place.work, record, is_new: false }).break_value();
                            place.is_over = end == Some(End::Campaign);
                            if end == Some(End::Scenario) {
                                (place.work, place.done) = (place.work + 1, 0);
                                samples = self.works.get(place.work).map(|work| work.samples(self.partition));
                            }
                        }
                        return fits;
                    }
                    None => {
                        (place.work, place.done) = (place.work + 1, 0);
                        samples = self.works.get(place.work).map(|work| work.samples(self.partition));
                    }
                }
            }
        })
    }

    fn run_from(
        &self,
        from: Place,
        mut kept: Option<&mut TakenUp>,
        take: &mut impl FnMut(Turn<'_>) -> ControlFlow<End>,
    ) -> Result<(), CampaignError> {
        let (mut place, mut is_over) = (from.all, false);
        for (number, work) in self.works.iter().enumerate().skip(from.work) {
            let done = if number == from.work { from.done } else { 0 };
            let samples = work.samples(self.partition).skip(done);
            self.workers.run(work, samples, |finished: Finished| {
                if let Some(kept) = kept.as_deref_mut() {
                    keep(kept, place, &finished)?;
                }
                place += 1;
                let end = take(Turn { work: number, record: &finished.record, is_new: true }).break_value();
                is_over = end == Some(End::Campaign);
                Ok::<_, CampaignError>(if end.is_some() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) })
            })?;
            if is_over {
                break;
            }
        }
        Ok(())
    }
}

/// Where a campaign stands.
#[derive(Clone, Copy)]
struct Place {
    /// Scenarios that are done.
    work: usize,
    /// Samples of the next one that are done.
    done: usize,
    /// Samples of all that are done.
    all: u64,
    /// True where `take` broke off.
    is_over: bool,
}

fn is_of(record: &Record, work: &Work, sample: u64) -> bool {
    record.scenario == work.file.config().name
        && record.sample == sample
        && record.arms.len() == work.arms.len()
        && record.arms.iter().zip(&work.arms).all(|(kept, arm)| kept.controller == arm.controller.name())
}

fn keep(kept: &mut TakenUp, place: u64, finished: &Finished) -> Result<(), WriteError> {
    kept.journal.append(&finished.record)?;
    kept.wall_times.append(&WallTime {
        place,
        scenario: finished.record.scenario.clone(),
        sample: finished.record.sample,
        wall_s: finished.wall_s.clone(),
    })
}
