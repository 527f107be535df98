//! The failing case that is nearest to the nominal case.
//!
//! ```text
//!  failing samples ─▶ nearest first ─▶ nominal labels, first failing point of the ray ─▶ nearest three ─▶ design point
//! ```
//!
//! Distances are in standard normal space, in which the parameters of the scenario are
//! independent, whatever their distributions and rank correlations are (for a Gaussian copula this
//! is the transformation of A. Nataf; P.-L. Liu and A. Der Kiureghian, *Multivariate distribution
//! models with prescribed marginals and covariances*, Probabilistic Engineering Mechanics 1 (1986)
//! 105–112). Of all failing cases, the nearest one has the largest probability density there.
//!
//! The random streams of drivers and sensors have no distance. Each search keeps the streams of the
//! sample from which it starts. A label that fails as well at its nominal value is set to it first;
//! the search then moves the numbers only.

use std::collections::BTreeMap;

use closecall_campaign::saved::SavedCampaign;
use closecall_scenarios::parameters::NormalPoint;
use closecall_traffic::{ActorId, ParameterName, Parameters, Stream, Value, stream};
use rayon::prelude::*;
use serde::Serialize;

use super::design_point::{Cases, DesignPoint};
use super::run::{Minimized, described, with_choice};
use super::trial::{Trial, WithoutOutcome};
use crate::case::{Case, CausesError, fails};
use crate::failures::{SampleErrors, passes};

/// Number of failing samples from which the rays to the nominal case are searched (-), and number
/// of rays with the nearest failures that are searched on (-): assumptions; 5 to 50 and 1 to 10 are
/// plausible.
const STARTS: usize = 12;
const CONTINUED: u64 = 3;
/// Runs of a case: one at the time step, and one at half of it (-).
const RUNS_OF_CASE: u64 = 2;
/// Key of the random streams of the search. Their channel contains a `/`, which the name of a
/// component never does.
const OWNER: &str = "scenario";

/// How a nearest failure was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct NearestFailure {
    /// Number of runs of the search.
    pub runs: u64,
    /// Largest number of runs that the search was allowed.
    pub most_runs: u64,
    /// Number of failing samples from which the search started.
    pub starts: u64,
    /// Number of failing samples.
    pub failing: u64,
    /// Whether the search ended because further steps came no nearer, and not because of the number
    /// of runs.
    pub has_converged: bool,
}

impl NearestFailure {
    /// Returns why the search ended, in words.
    pub(super) const fn why_it_ended(&self) -> &'static str {
        if self.has_converged {
            "further steps came no nearer, which proves nothing"
        } else {
            "the number of runs ended the search"
        }
    }
}

/// The search for the failing case of a saved campaign that is nearest to the nominal case.
#[derive(Debug)]
pub struct NearestSearch {
    case: Case,
    samples: Vec<u64>,
}

/// A failing sample with its place.
struct Start {
    case: Case,
    point: NormalPoint,
}

/// A failing case near the nominal case.
struct NearFailure<'a> {
    trial: Trial<'a>,
    point: NormalPoint,
    has_converged: bool,
}

/// The cases of a sample whose labels stay.
struct Labelled<'a, 'b> {
    trial: &'a Trial<'b>,
    labels: BTreeMap<ParameterName, String>,
    /// Number of runs that the trial may reach.
    most_runs: u64,
}

impl NearestSearch {
    /// Prepares a search from one sample, or from all failing samples. `scenario` may be left out
    /// if the campaign has only one, `controller` for the arm under test.
    ///
    /// # Errors
    /// [`CausesError`] if the campaign has no such scenario, sample or arm, no sample fails, or the
    /// folder cannot be read.
    pub fn of(
        saved: &SavedCampaign,
        scenario: Option<&str>,
        sample: Option<u64>,
        controller: Option<&str>,
    ) -> Result<Self, CausesError> {
        if let Some(sample) = sample {
            return Ok(Self { case: Case::of(saved, scenario, sample, controller)?, samples: vec![sample] });
        }
        let (file, arm) = (saved.file(scenario)?, saved.arm(controller)?);
        let (name, controller) = (file.config().name.clone(), arm.controller.name().to_owned());
        let mut samples = Vec::new();
        for record in saved.folder().records()? {
            let record = record?;
            let mut arms = record.arms.iter().filter(|arm| arm.controller == controller);
            if record.scenario == name && arms.any(|arm| arm.result.as_ref().is_ok_and(fails)) {
                samples.push(record.sample);
            }
        }
        let Some(&sample) = samples.first() else {
            // Only all samples together show that none fails.
            saved.folder().complete_records()?.try_for_each(|record| record.map(drop))?;
            return Err(match SampleErrors::of(saved, Some(&name), Some(&controller))?.map(Box::new) {
                Some(errors) => CausesError::NoFailureAmongOutcomes { scenario: name, controller, errors },
                None => CausesError::NoFailure { scenario: name, controller },
            });
        };
        let sampling = saved.manifest().sampling;
        Ok(Self { case: Case { file, sampling, sample, arm, parameters: None, reference: None }, samples })
    }

    /// Returns one of the failing samples: all of them share its scenario and its arm.
    pub const fn case(&self) -> &Case {
        &self.case
    }

    /// Searches, with about as many runs. The description of the result takes a few more.
    ///
    /// # Errors
    /// [`CausesError`] if no sample fails when it is run again, or the case cannot be described.
    pub fn run(&self, saved: &SavedCampaign, most_runs: u64) -> Result<Minimized, CausesError> {
        let starts = self.starts();
        let mut failures: Vec<NearFailure<'_>> = Vec::new();
        let (mut tried, mut runs) = (0, 0);
        let mut without_outcome: Option<WithoutOutcome> = None;
        for Start { case, point } in &starts {
            if !failures.is_empty() && runs >= most_runs / 2 {
                break;
            }
            let trial = Trial::new(case);
            let first = drawn_in(&trial, point.clone());
            tried += 1;
            runs += trial.runs();
            match first {
                Some((point, has_converged)) => failures.push(NearFailure { trial, point, has_converged }),
                None => without_outcome = WithoutOutcome::joined(without_outcome, trial.without_outcome()),
            }
            if failures.last().is_some_and(|failure| failure.length_sd() == 0.0) {
                break;
            }
        }
        failures.sort_by(|a, b| a.length_sd().total_cmp(&b.length_sd()));
        if failures.first().is_none_or(|failure| failure.length_sd() > 0.0) {
            for (index, failure) in failures.iter_mut().take(CONTINUED as usize).enumerate() {
                let share = most_runs.saturating_sub(runs) / (CONTINUED - index as u64);
                let before = failure.trial.runs();
                failure.search(before + share);
                runs += failure.trial.runs() - before;
            }
        }
        let Some(nearest) = failures.iter().min_by(|a, b| a.length_sd().total_cmp(&b.length_sd())) else {
            return Err(match without_outcome {
                Some(WithoutOutcome { message, .. }) => {
                    let controller = self.case.arm.controller.name().to_owned();
                    CausesError::NoOutcome { scenario: self.case.file.config().name.clone(), controller, message }
                }
                None => passes(saved, &self.case),
            });
        };
        let details = NearestFailure {
            runs,
            most_runs,
            starts: tried,
            failing: self.samples.len() as u64,
            has_converged: nearest.has_converged,
        };
        let (trial, values) = (&nearest.trial, values_at(&nearest.trial, &nearest.point));
        let is_off = |name: &&ParameterName| values.get(name) != trial.nominal.get(name);
        let names: Vec<ParameterName> = values.iter().map(|(name, _)| name).filter(is_off).cloned().collect();
        let described = described(trial, &values, &names, &[])?;
        let distance_sd = Some(nearest.length_sd());
        let further = failures.iter().map(|failure| failure.trial.without_outcome());
        let without_outcome = further.fold(without_outcome, WithoutOutcome::joined);
        let minimized = Minimized { nearest: Some(details), distance_sd, without_outcome, ..described };
        Ok(with_choice(saved.manifest(), minimized))
    }

    /// Returns the failing samples that are nearest to the nominal case, the nearest first. A
    /// sample with a value at a bound of its distribution is infinitely far, and no start.
    fn starts(&self) -> Vec<Start> {
        let space = self.case.file.space();
        let starts = self.samples.iter().filter_map(|sample| {
            let case = Case { sample: *sample, ..self.case.clone() };
            Some(Start { point: space.normal_point(&case.sampled())?, case })
        });
        let mut starts: Vec<Start> = starts.collect();
        starts.sort_by(|a, b| space.length_sd(&a.point).total_cmp(&space.length_sd(&b.point)));
        starts.truncate(STARTS);
        starts
    }
}

fn values_at(trial: &Trial<'_>, point: &NormalPoint) -> Parameters {
    trial.case.file.space().at_normal_point(point)
}

/// Moves a sample along the ray to the nominal case, with as many nominal labels as possible.
/// Returns the first failing case, and whether none can be nearer; `None` if the sample itself does
/// not fail.
fn drawn_in(trial: &Trial<'_>, mut point: NormalPoint) -> Option<(NormalPoint, bool)> {
    let does_fail = |point: &NormalPoint| trial.fails(&values_at(trial, point));
    if !does_fail(&point) {
        return None;
    }
    let origin = NormalPoint { normals: vec![0.0; point.normals.len()], labels: BTreeMap::new() };
    if does_fail(&origin) {
        return Some((origin, true));
    }
    point.labels.retain(|name, label| trial.nominal.get(name) != Some(&Value::Label(label.clone())));
    for name in point.labels.keys().cloned().collect::<Vec<_>>() {
        let mut nominal = point.clone();
        nominal.labels.remove(&name);
        if does_fail(&nominal) {
            point = nominal;
        }
    }
    let of_labels = NormalPoint { normals: origin.normals, labels: point.labels.clone() };
    if does_fail(&of_labels) {
        return Some((of_labels, false));
    }
    let NormalPoint { normals, labels } = point;
    let mut cases = Labelled { trial, labels: labels.clone(), most_runs: u64::MAX };
    let mut design_point = DesignPoint::new(&mut cases, normals);
    design_point.draw_in().unwrap_or_default();
    Some((NormalPoint { normals: design_point.into_point(), labels }, false))
}

impl NearFailure<'_> {
    fn length_sd(&self) -> f64 {
        self.trial.case.file.space().length_sd(&self.point)
    }

    /// Searches the design point from here on. The trial may reach so many runs.
    fn search(&mut self, most_runs: u64) {
        let (trial, labels) = (&self.trial, self.point.labels.clone());
        let mut cases = Labelled { trial, labels, most_runs };
        let mut design_point = DesignPoint::new(&mut cases, self.point.normals.clone());
        let mut rng = random_numbers(trial.case);
        self.has_converged = design_point.search(&mut rng);
        self.point.normals = design_point.into_point();
    }
}

/// Returns the random numbers of a search. They differ from the sample's numbers.
fn random_numbers(case: &Case) -> Stream {
    #[expect(clippy::expect_used, reason = "a constant, and every test draws from it")]
    let owner = ActorId::new(OWNER).expect("a legal name");
    stream(case.sampling.seed, case.sample, &owner, "minimize/nearest")
}

impl Cases for Labelled<'_, '_> {
    fn affordable(&self) -> usize {
        usize::try_from(self.most_runs.saturating_sub(self.trial.runs()) / RUNS_OF_CASE).unwrap_or(usize::MAX)
    }

    fn fail(&mut self, points: &[Vec<f64>]) -> Vec<bool> {
        let trial = self.trial;
        let at = |normals: &Vec<f64>| {
            values_at(trial, &NormalPoint { normals: normals.clone(), labels: self.labels.clone() })
        };
        let values: Vec<Parameters> = points.iter().map(at).collect();
        // Each case runs once, whatever the threads do, so that the number of runs is the same.
        let mut distinct: Vec<&Parameters> = Vec::new();
        for one in &values {
            if !distinct.contains(&one) {
                distinct.push(one);
            }
        }
        distinct.par_iter().for_each(|values| {
            trial.fails(values);
        });
        values.iter().map(|values| trial.fails(values)).collect()
    }
}
