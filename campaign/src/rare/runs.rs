//! Runs points as samples of a scenario, and keeps their responses.

use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::{Duration, Instant};

use closecall_scenarios::ScenarioFile;
use closecall_simulation::{Arm, NoObserver, RunKey, SampleError};
use closecall_traffic::Check;

use super::error::RareError;
use super::journal::{RareJournal, RareRecord};
use super::nearness::Nearness;
use super::problem::{Point, Response, Simulator};
use super::report::Nearest;
use crate::record::{ArmRecord, Record, SampleFailure};
use crate::runner::{ArmRun, OnOutcome, guarded, run_guarded};
use crate::stop::StopFlag;
use crate::workers::{Samples, Workers};

/// Points of a scenario, ready to run. The number of a sample is the index of its point.
struct PointSamples {
    file: ScenarioFile,
    arms: Vec<Arm>,
    seed: u64,
    points: Vec<Point>,
}

impl Samples for PointSamples {
    fn scenario(&self) -> &str {
        &self.file.config().name
    }

    fn arms(&self) -> &[Arm] {
        &self.arms
    }

    fn run(&self, sample: u64, arm: usize, _: Duration, _: &OnOutcome<'_>) -> ArmRun {
        let (arm, started) = (&self.arms[arm], Instant::now());
        let result = usize::try_from(sample).ok().and_then(|index| self.points.get(index)).map_or_else(
            || Err(SampleError::Panic { message: "there is no such point".to_owned() }),
            |point| {
                let parameters = self.file.space().at_normals(&point.normals);
                let scenario = guarded(|| self.file.config().check(&parameters).map_err(SampleError::Scenario))?;
                let key = RunKey { seed: self.seed, sample: point.noise };
                run_guarded(&scenario, key, arm, &mut NoObserver)
            },
        );
        let record = ArmRecord::new(arm.controller.name().to_owned(), result.map_err(SampleFailure::from));
        ArmRun { record, wall_s: started.elapsed().as_secs_f64(), check_s: 0.0 }
    }
}

/// The runs of one scenario: first the runs of a journal, then new runs.
pub(super) struct Runs<'a> {
    pub(super) file: &'a ScenarioFile,
    pub(super) arms: &'a [Arm],
    pub(super) seed: u64,
    pub(super) nearness: Nearness,
    pub(super) workers: Workers,
    pub(super) stop: &'a StopFlag,
    pub(super) journal: Option<&'a mut RareJournal>,
    /// Called after each run.
    pub(super) on_run: &'a mut dyn FnMut(),
    /// Number of runs so far.
    pub(super) done: u64,
    /// Runs that ended in an error, and the first error.
    pub(super) errors: u64,
    pub(super) first_error: Option<SampleFailure>,
    /// The events that are nearest to the nominal case.
    pub(super) nearest: Vec<Nearest>,
}

/// Number of events that a report shows.
const SHOWN: usize = 3;

impl Runs<'_> {
    /// Counts a run, whether it is new or read from the journal.
    fn count(&mut self, point: &Point, response: &Response, failure: Option<&SampleFailure>) {
        self.done += 1;
        self.errors += u64::from(failure.is_some());
        if self.first_error.is_none() {
            self.first_error = failure.cloned();
        }
        if response.is_event() {
            let distance_sd = point.distance_sd();
            let rank = self.nearest.partition_point(|other| other.distance_sd <= distance_sd);
            if rank < SHOWN {
                let parameters = self.file.space().at_normals(&point.normals);
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
            let scenario = &self.file.config().name;
            let record = match self.journal.as_mut() {
                Some(journal) => journal.next(scenario, self.done, point)?,
                None => None,
            };
            let Some(RareRecord { response, failure, .. }) = record else { break };
            let response = response.into();
            self.count(point, &response, failure.as_ref());
            responses.push(response);
        }
        Ok(responses)
    }

    fn push(&mut self, point: &Point, record: &Record) -> Result<Response, RareError> {
        let response = self.nearness.response(record);
        let failure = record.arms.iter().find_map(|arm| arm.result.as_ref().err()).cloned();
        if let Some(journal) = self.journal.as_mut() {
            let scenario = self.file.config().name.clone();
            let (run, failure) = (self.done, failure.clone());
            journal.append(&RareRecord { scenario, run, point: point.into(), response: response.into(), failure })?;
        }
        self.count(point, &response, failure.as_ref());
        Ok(response)
    }
}

impl Simulator for Runs<'_> {
    type Error = RareError;

    fn run(&mut self, points: &[Point]) -> Result<Vec<Response>, RareError> {
        let mut responses = self.kept(points)?;
        let new = &points[responses.len()..];
        let samples = Arc::new(PointSamples {
            file: self.file.clone(),
            arms: self.arms.to_vec(),
            seed: self.seed,
            points: new.to_vec(),
        });
        let (workers, stop) = (self.workers, self.stop);
        let mut number = 0;
        workers.run_samples(&samples, 0..new.len() as u64, stop, |finished| {
            responses.push(self.push(&new[number], &finished.record)?);
            number += 1;
            Ok::<_, RareError>(ControlFlow::Continue(()))
        })?;
        if responses.len() < points.len() { Err(RareError::Stopped) } else { Ok(responses) }
    }
}
