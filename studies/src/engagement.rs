//! Why the margin increase system does not engage: the condition that is missing when the system is
//! closest to engaging.
//!
//! While the system follows, each command names the first missing condition for engaging, in the
//! order of the conditions. The last command of a run says nothing about the encounter: the rear
//! vehicle is past by then. The condition that counts is the one furthest in the order over all
//! control steps. Each sample without an engagement runs once more for it, with the same outcome.

use std::collections::BTreeMap;

use closecall_campaign::record::Record;
use closecall_campaign::runner::{Work, concrete, run_guarded};
use closecall_campaign::saved::{SavedCampaign, SavedError};
use closecall_controllers::{EgoState, Reason};
use closecall_scenarios::outcome::{Moment, Outcome};
use closecall_simulation::{Observer, RunEvent, RunKey, StepView};
use closecall_traffic::Time;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// The conditions for engaging in their order, each by the reason that names it if it is missing.
const CONDITIONS: [Reason; 14] = [
    Reason::NotAutomated,
    Reason::FrontSensorFailed,
    Reason::SurroundSensorsFailed,
    Reason::RearSensorsFailed,
    Reason::NoFront,
    Reason::FrontMarginLong,
    Reason::NoRear,
    Reason::RearUnconfirmed,
    Reason::RearUnclassified,
    Reason::RearFar,
    Reason::RearNotApproaching,
    Reason::NoPassingLane,
    Reason::PassingLaneUnknown,
    Reason::PassingLaneOccupied,
];

/// Number of samples of a scenario in which the system engages, and why it does not engage in the
/// others.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Engagement {
    /// Samples in which it engages.
    pub engaged: u64,
    /// Of these, the samples in which it engages before the lead vehicle brakes, as intended.
    /// Braking of the ego alone lets a vehicle behind approach.
    pub before_braking: u64,
    /// The other samples with an outcome, by the condition that was missing when the system was
    /// closest to engaging.
    pub missing: BTreeMap<String, u64>,
}

impl Engagement {
    /// Returns the number of samples.
    pub fn samples(&self) -> u64 {
        self.engaged + self.missing.values().sum::<u64>()
    }
}

/// Returns the engagements of the arm under test of each scenario of a campaign, by name.
///
/// # Errors
/// [`SavedError`] if the campaign cannot be read.
pub fn engagements(saved: &SavedCampaign) -> Result<BTreeMap<String, Engagement>, SavedError> {
    let works = saved.works()?;
    let mut all: BTreeMap<String, Engagement> =
        works.iter().map(|work| (work.file.config().name.clone(), Engagement::default())).collect();
    let mut others = Vec::new();
    for record in saved.folder().records()? {
        let record: Record = record?;
        let tested = record.arms.last().and_then(|arm| arm.result.as_ref().ok());
        let Some(mis) = tested.and_then(|outcome| outcome.mis.as_ref().ok()) else { continue };
        let work = works.iter().find(|work| work.file.config().name == record.scenario);
        let brakes_at_s = tested.and_then(|outcome| time_of(outcome, Moment::FrontBrakes));
        match (mis.engaged_at_s, work) {
            (Ok(at_s), _) => {
                let engagement = all.entry(record.scenario).or_default();
                engagement.engaged += 1;
                engagement.before_braking += u64::from(brakes_at_s.is_none_or(|brakes_at_s| at_s < brakes_at_s));
            }
            (Err(_), Some(work)) => others.push((work, record.sample, mis.reason)),
            (Err(_), None) => {}
        }
    }
    // The journal's reason replaces the condition of a sample that cannot be run again.
    let reasons: Vec<Reason> =
        others.par_iter().map(|(work, sample, last)| closest(work, *sample).unwrap_or(*last)).collect();
    for ((work, _, _), reason) in others.iter().zip(reasons) {
        let engagement = all.entry(work.file.config().name.clone()).or_default();
        *engagement.missing.entry(reason.text().to_owned()).or_default() += 1;
    }
    Ok(all)
}

/// Returns the time at which a moment of the encounter is reached (s).
fn time_of(outcome: &Outcome, moment: Moment) -> Option<f64> {
    outcome.moments.iter().find(|reached| reached.moment == moment).map(|reached| reached.time.s())
}

/// Returns the condition that is missing when the system is closest to engaging in a sample.
fn closest(work: &Work, sample: u64) -> Option<Reason> {
    let scenario = concrete(&work.file, work.sampling, sample).ok()?;
    let mut observer = Closest(None);
    run_guarded(&scenario, RunKey { seed: work.sampling.seed, sample }, work.arms.last()?, &mut observer).ok()?;
    observer.0.map(|index| CONDITIONS[index])
}

/// Keeps the furthest condition that was missing, as its index.
struct Closest(Option<usize>);

impl Observer for Closest {
    fn step(&mut self, view: &StepView<'_>) {
        if view.command.state == EgoState::Following {
            let index = CONDITIONS.iter().position(|reason| *reason == view.command.reason);
            self.0 = self.0.max(index);
        }
    }

    fn event(&mut self, _: Time, _: &RunEvent) {}
}
