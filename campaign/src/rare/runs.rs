//! Runs points as samples of a scenario, and keeps their responses.

use std::ops::ControlFlow;
use std::sync::Arc;

use super::error::RareError;
use super::journal::{KeptResponse, RareJournal, RareRecord};
use super::nearness::Nearness;
use super::points::{PointRunner, point_samples};
use super::problem::{Point, Response, Simulator};
use super::relevance::Relevance;
use super::report::Nearest;
use crate::campaign_error::CampaignError;
use crate::late_repetition::{difference, is_foreign};
use crate::partition::Partition;
use crate::record::{Record, SampleFailure};
use crate::runner::Work;
use crate::stop::StopFlag;
use crate::workers::{Finished, Workers};

/// The runs of one scenario: first the runs of a journal, then new runs.
pub(super) struct Runs<'a> {
    /// The scenario with its arms, and its index in the campaign.
    pub(super) work: &'a Arc<Work>,
    pub(super) index: usize,
    pub(super) nearness: Nearness,
    pub(super) workers: Workers,
    /// The runner of the points, if the threads of this process do not run them.
    pub(super) remote: Option<&'a dyn PointRunner>,
    pub(super) stop: &'a StopFlag,
    pub(super) journal: Option<&'a mut RareJournal>,
    /// Called after each run.
    pub(super) on_run: &'a mut dyn FnMut(),
    /// The part of the last runs that are run; `None` for all of them.
    pub(super) part: Option<Partition>,
    /// Number of runs so far.
    pub(super) done: u64,
    /// Runs that ended in an error, and the first error.
    pub(super) errors: u64,
    pub(super) first_error: Option<SampleFailure>,
    /// What the runs show of the system under test.
    pub(super) relevance: Relevance,
    /// The events that are nearest to the nominal case.
    pub(super) nearest: Vec<Nearest>,
    /// The first run, with its response.
    pub(super) first: Option<(Point, Response)>,
}

/// Number of events that a report shows.
const SHOWN: usize = 3;

impl Runs<'_> {
    /// Counts a run, whether it is new or read from the journal.
    fn count(&mut self, point: &Point, record: &RareRecord) {
        self.relevance.count(record.run, record.course);
        self.done += 1;
        self.errors += u64::from(record.failure.is_some());
        if self.first_error.is_none() {
            self.first_error.clone_from(&record.failure);
        }
        let response = Response::from(record.response);
        if self.first.is_none() && record.failure.is_none() {
            self.first = Some((point.clone(), response));
        }
        if response.is_event() {
            let distance_sd = point.distance_sd();
            let rank = self.nearest.partition_point(|other| other.distance_sd <= distance_sd);
            if rank < SHOWN {
                let parameters = self.work.file.space().at_normals(&point.normals);
                let nearest = Nearest { distance_sd, noise: point.noise, events: response.events, parameters };
                self.nearest.insert(rank, nearest);
                self.nearest.truncate(SHOWN);
            }
        }
        (self.on_run)();
    }

    /// Returns the responses of the journal to the first of these points, which have these numbers.
    fn kept(&mut self, points: &[Point], numbers: &[u64]) -> Result<Vec<Response>, RareError> {
        let mut responses = Vec::new();
        for (point, run) in points.iter().zip(numbers) {
            let scenario = &self.work.file.config().name;
            let record = match self.journal.as_mut() {
                Some(journal) => journal.next(scenario, *run, point)?,
                None => None,
            };
            let Some(record) = record else { break };
            self.count(point, &record);
            responses.push(record.response.into());
        }
        Ok(responses)
    }

    fn push(&mut self, run: u64, point: &Point, record: &Record) -> Result<Response, CampaignError> {
        let response = self.nearness.response(record);
        let kept = RareRecord {
            scenario: self.work.file.config().name.clone(),
            run,
            point: point.into(),
            response: response.into(),
            failure: record.arms.iter().find_map(|arm| arm.result.as_ref().err()).cloned(),
            course: self.relevance.course(record),
        };
        if let Some(journal) = self.journal.as_mut() {
            journal.append(&kept)?;
        }
        self.count(point, &kept);
        Ok(response)
    }

    /// Runs the first run again, after the last one, if its controllers or its perception may change
    /// with the time. Returns what differs, in words. The journal does not get it.
    pub(super) fn repeat_first(&mut self) -> Result<Option<String>, RareError> {
        let is_closed = self.journal.as_ref().is_some_and(|journal| journal.is_closed());
        let Some((point, response)) = self.first.take().filter(|_| is_foreign(self.work) && !is_closed) else {
            return Ok(None);
        };
        let (work, nearness, mut again) = (self.work, self.nearness, None);
        let mut on_finished = |finished: Finished| {
            let has_outcome = finished.record.arms.iter().all(|arm| arm.result.is_ok());
            again = has_outcome.then(|| nearness.response(&finished.record));
            Ok::<_, CampaignError>(ControlFlow::Continue(()))
        };
        let points = std::slice::from_ref(&point);
        match self.remote {
            Some(remote) => remote.run_points((self.index, work), points, self.stop, &mut on_finished)?,
            None => {
                let samples = Arc::new(point_samples(work, points));
                self.workers.run_samples(&samples, 0..1, self.stop, on_finished)?;
            }
        }
        // A score that is not finite has no place in the journal.
        let differs = again.is_some_and(|again| KeptResponse::from(again) != KeptResponse::from(response));
        Ok(differs.then(|| difference("the first run", &work.file.config().name, None)))
    }

    /// Returns the responses of points, which have these numbers.
    fn respond(&mut self, points: &[Point], numbers: &[u64]) -> Result<Vec<Response>, RareError> {
        let mut responses = self.kept(points, numbers)?;
        let (new, of_new) = (&points[responses.len()..], &numbers[responses.len()..]);
        let is_closed = self.journal.as_ref().is_some_and(|journal| journal.is_closed());
        if let Some(run) = of_new.first().filter(|_| is_closed) {
            return Err(RareError::MissingRun { scenario: self.work.file.config().name.clone(), run: *run });
        }
        let (index, work, workers, remote, stop) = (self.index, self.work, self.workers, self.remote, self.stop);
        let mut number = 0;
        let mut on_finished = |finished: Finished| {
            responses.push(self.push(of_new[number], &new[number], &finished.record)?);
            number += 1;
            Ok::<_, CampaignError>(ControlFlow::Continue(()))
        };
        match remote {
            Some(remote) => remote.run_points((index, work), new, stop, &mut on_finished)?,
            None => {
                let samples = Arc::new(point_samples(work, new));
                workers.run_samples(&samples, 0..new.len() as u64, stop, on_finished)?;
            }
        }
        if responses.len() < points.len() { Err(RareError::Stopped) } else { Ok(responses) }
    }
}

impl Simulator for Runs<'_> {
    type Error = RareError;

    fn run(&mut self, points: &[Point]) -> Result<Vec<Response>, RareError> {
        self.relevance.begin(points.len() as u64);
        let numbers: Vec<u64> = (self.done..).take(points.len()).collect();
        self.respond(points, &numbers)
    }

    /// A part runs those whose number belongs to it. All runs before are the same in every part, so
    /// that the number of a run is the same, too.
    fn run_last(&mut self, points: &[Point]) -> Result<Vec<Response>, RareError> {
        let Some(part) = self.part else { return self.run(points) };
        self.relevance.begin(points.len() as u64);
        let of_part = points.iter().cloned().zip(self.done..).filter(|(_, run)| part.contains(*run));
        let (points, numbers): (Vec<Point>, Vec<u64>) = of_part.unzip();
        self.respond(&points, &numbers)?;
        if let Some(journal) = &self.journal {
            journal.sync()?;
        }
        Err(RareError::PartEnds { runs: self.done })
    }
}
