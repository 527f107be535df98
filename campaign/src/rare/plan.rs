//! Samples a rare event of one scenario.

use std::sync::Arc;

use super::error::RareError;
use super::importance::{Goal, importance};
use super::journal::RareJournal;
use super::method::Method;
use super::nearness::Nearness;
use super::points::PointRunner;
use super::problem::Seed;
use super::relevance::Relevance;
use super::report::RareReport;
use super::runs::Runs;
use super::search::search;
use super::subset::subset;
use crate::partition::Partition;
use crate::runner::Work;
use crate::stop::StopFlag;
use crate::workers::Workers;

/// How a rare event is sampled.
#[derive(Clone, Debug)]
pub struct RarePlan {
    /// The method.
    pub method: Method,
    /// The events, with what leads to them.
    pub nearness: Nearness,
    /// When the sampling ends.
    pub goal: Goal,
    /// The number of worker threads, and the time limit of a run.
    pub workers: Workers,
    /// The runner of the runs, if the threads of this process do not run them.
    pub remote: Option<Arc<dyn PointRunner>>,
    /// The part of the last runs that are run; `None` for all of them. Only importance sampling has
    /// parts.
    pub part: Option<Partition>,
}

impl RarePlan {
    /// Samples the events of a scenario, which is given with its index in the campaign. The runs of
    /// `journal` are not run again. `on_run` is called after each run.
    ///
    /// # Errors
    /// [`RareError`] if there is no result. The campaign can go on from its journal. A part ends
    /// with [`RareError::PartEnds`].
    pub fn run(
        &self,
        (index, work): (usize, &Arc<Work>),
        journal: Option<&mut RareJournal>,
        stop: &StopFlag,
        on_run: &mut dyn FnMut(),
    ) -> Result<RareReport, RareError> {
        let (file, seed) = (&work.file, work.sampling.seed);
        let dimensions = file.space().varying().count();
        if dimensions == 0 {
            return Err(RareError::NothingVaries { scenario: file.config().name.clone() });
        }
        let mut runs = Runs {
            work,
            index,
            nearness: self.nearness,
            workers: self.workers,
            remote: self.remote.as_deref(),
            stop,
            journal,
            on_run,
            part: self.part,
            done: 0,
            errors: 0,
            first_error: None,
            relevance: Relevance::of(work),
            nearest: Vec::new(),
            first: None,
        };
        let mut report = match self.method {
            Method::Importance => {
                let result = importance(&mut runs, dimensions, Seed(seed), self.goal)?;
                RareReport::of_importance(self, &result)
            }
            Method::Subset => RareReport::of_subset(self, &subset(&mut runs, dimensions, Seed(seed), self.goal)?),
            Method::Search => {
                runs.nearness = self.nearness.with_contrast();
                RareReport::of_search(self, &search(&mut runs, dimensions, Seed(seed), self.goal.budget)?)
            }
        };
        if let Some(journal) = &runs.journal {
            journal.sync()?;
        }
        report.scenario.clone_from(&file.config().name);
        report.parameters = file.space().varying().map(|(name, _)| name.to_string()).collect();
        report.not_judged = runs.relevance.not_judged();
        report.difference = runs.repeat_first()?;
        (report.errors, report.first_error, report.nearest) = (runs.errors, runs.first_error, runs.nearest);
        if report.errors > 0 {
            // A run that failed may have been an event.
            report.upper_bound_without_event = None;
        }
        Ok(report)
    }
}
