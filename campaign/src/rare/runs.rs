//! Runs points as samples of a scenario, and keeps their responses.

use std::ops::ControlFlow;
use std::sync::Arc;

use super::error::RareError;
use super::journal::{RareJournal, RareRecord};
use super::nearness::Nearness;
use super::points::{PointRunner, point_samples};
use super::problem::{Point, Response, Simulator};
use super::relevance::Relevance;
use super::report::Nearest;
use crate::campaign_error::CampaignError;
use crate::gate::Course;
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
    /// Number of runs so far.
    pub(super) done: u64,
    /// Runs that ended in an error, and the first error.
    pub(super) errors: u64,
    pub(super) first_error: Option<SampleFailure>,
    /// What the runs show of the system under test.
    pub(super) relevance: Relevance,
    /// The events that are nearest to the nominal case.
    pub(super) nearest: Vec<Nearest>,
}

/// Number of events that a report shows.
const SHOWN: usize = 3;

impl Runs<'_> {
    /// Counts a run, whether it is new or read from the journal.
    fn count(&mut self, point: &Point, response: &Response, failure: Option<&SampleFailure>, course: Option<Course>) {
        self.relevance.count(self.done, course);
        self.done += 1;
        self.errors += u64::from(failure.is_some());
        if self.first_error.is_none() {
            self.first_error = failure.cloned();
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

    /// Returns the responses of the journal to the first of these points.
    fn kept(&mut self, points: &[Point]) -> Result<Vec<Response>, RareError> {
        let mut responses = Vec::new();
        for point in points {
            let scenario = &self.work.file.config().name;
            let record = match self.journal.as_mut() {
                Some(journal) => journal.next(scenario, self.done, point)?,
                None => None,
            };
            let Some(RareRecord { response, failure, course, .. }) = record else { break };
            let response = response.into();
            self.count(point, &response, failure.as_ref(), course);
            responses.push(response);
        }
        Ok(responses)
    }

    fn push(&mut self, point: &Point, record: &Record) -> Result<Response, CampaignError> {
        let (response, course) = (self.nearness.response(record), self.relevance.course(record));
        let failure = record.arms.iter().find_map(|arm| arm.result.as_ref().err()).cloned();
        if let Some(journal) = self.journal.as_mut() {
            let scenario = self.work.file.config().name.clone();
            let (run, failure, response) = (self.done, failure.clone(), response.into());
            journal.append(&RareRecord { scenario, run, point: point.into(), response, failure, course })?;
        }
        self.count(point, &response, failure.as_ref(), course);
        Ok(response)
    }
}

impl Simulator for Runs<'_> {
    type Error = RareError;

    fn run(&mut self, points: &[Point]) -> Result<Vec<Response>, RareError> {
        self.relevance.begin(points.len() as u64);
        let mut responses = self.kept(points)?;
        let new = &points[responses.len()..];
        let (index, work, workers, remote, stop) = (self.index, self.work, self.workers, self.remote, self.stop);
        let mut number = 0;
        let mut on_finished = |finished: Finished| {
            responses.push(self.push(&new[number], &finished.record)?);
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
