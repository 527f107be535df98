//! Emergency braking held against crash records: does the simulation find what insurers found on
//! the road?
//!
//! ```text
//!  anchor-lead-brakes ─▶ its own drivers ─┐
//!                     ─▶ each member      ├─▶ human-aeb │ human+aeb ─▶ strikes, is struck ─▶ ratio of each, with its interval
//!                     ─▶ each variation ──┘     (the same samples)
//! ```
//!
//! Cicchino (Accident Analysis and Prevention, 2017, doi 10.1016/j.aap.2016.11.009) found that cars
//! with a warning and emergency braking strike other vehicles half as often as the same models
//! without, and are struck from behind 1.2 times as often. The range of the ratios over the driver
//! ensemble covers these values or not. The variations change one assumption at a time, and show
//! which one moves a ratio most. `docs/evidence/anchor.md` is the protocol; nothing here is chosen
//! by its effect on the ratios.

mod paired;
mod result;

use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;

use closecall_campaign::record::Record;
use closecall_campaign::runner::{Sampling, Work};
use closecall_campaign::sensitivity::RunErrors;
use closecall_campaign::stop::StopFlag;
use closecall_campaign::validity::CheckPlan;
use closecall_campaign::workers::{Workers, WorkersError};
use closecall_scenarios::member::{ApplyError, Ensemble, Member, ensemble_of};
use closecall_scenarios::{Function, ScenarioError, ScenarioFile, Setting};
use closecall_simulation::Arm;
use closecall_simulation::controller::ControllerChoice;

pub use paired::{Happened, LEAST_COLLISIONS, Paired};
pub use result::{Anchor, Quantity, Row};

/// The scenario of the library that is held against crash records.
pub const SCENARIO: &str = "anchor-lead-brakes";

/// The name of the row of the scenario's own drivers.
const OF_SCENARIO: &str = "the scenario's own drivers";

/// What is varied: in words, and as a setting of the scenario.
const VARIATIONS: [(&str, &str); 10] = [
    ("the follower keeps a short headway", "rear-cc1-s=0.5"),
    ("the follower keeps a long headway", "rear-cc1-s=1.5"),
    ("the follower reacts fast", "rear-reaction-s=0.75"),
    ("the follower reacts late", "rear-reaction-s=2.0"),
    ("the lead vehicle brakes gently", "brake-mps2=3.0"),
    ("the lead vehicle brakes hard", "brake-mps2=7.0"),
    ("emergency braking begins early", "actor.ego.driver.ego-stack.aeb.trigger-mps2=3.0"),
    ("emergency braking begins late", "actor.ego.driver.ego-stack.aeb.trigger-mps2=6.0"),
    ("emergency braking is weak", "actor.ego.driver.ego-stack.aeb.max-deceleration-mps2=5.0"),
    ("emergency braking is limited", "actor.ego.driver.ego-stack.aeb.max-deceleration-mps2=7.0"),
];

/// The reason for which the study cannot be prepared.
#[derive(Debug, thiserror::Error)]
pub enum AnchorError {
    /// A member does not fit the scenario.
    #[error(transparent)]
    Apply(#[from] ApplyError),
    /// A variation does not fit the scenario.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
}

/// Everything that determines the study.
#[derive(Clone, Debug)]
pub struct AnchorPlan {
    /// The scenario.
    pub file: ScenarioFile,
    /// How the samples of each row are drawn.
    pub sampling: Sampling,
    /// The number of worker threads, and the time limit of a run.
    pub workers: Workers,
    members: Vec<Entry>,
    without_effect: Vec<String>,
    variations: Vec<Entry>,
}

/// A row that is to be run.
#[derive(Clone, Debug)]
struct Entry {
    name: String,
    setting: Option<String>,
    file: ScenarioFile,
}

impl AnchorPlan {
    /// Prepares the study of `file` with these members, and with every variation.
    ///
    /// # Errors
    /// [`AnchorError`] if a member or a variation does not fit the scenario.
    pub fn new(
        file: ScenarioFile,
        members: &[Member],
        sampling: Sampling,
        workers: Workers,
    ) -> Result<Self, AnchorError> {
        let Ensemble { entries, without_effect } = ensemble_of(std::slice::from_ref(&file), members)?;
        let member = |file: ScenarioFile| {
            let name = file.config().name.split_once('@').map_or("", |(_, member)| member).to_owned();
            Entry { name, setting: None, file }
        };
        let own = Entry { name: OF_SCENARIO.to_owned(), setting: None, file: file.clone() };
        Ok(Self {
            members: std::iter::once(own).chain(entries.into_iter().map(member)).collect(),
            without_effect: without_effect.into_iter().map(|(_, member)| member).collect(),
            variations: VARIATIONS
                .into_iter()
                .map(|(name, text)| varied(&file, name, text))
                .collect::<Result<_, _>>()?,
            file,
            sampling,
            workers,
        })
    }

    /// Returns the number of samples of all rows.
    pub fn samples(&self) -> u64 {
        (self.members.len() + self.variations.len()) as u64 * self.sampling.samples
    }

    /// Runs the study. `None` if `stop` has ended it early. `on_sample` is called after each
    /// sample.
    ///
    /// # Errors
    /// [`WorkersError`] if no threads can be started.
    pub fn run(&self, stop: &StopFlag, on_sample: &mut dyn FnMut()) -> Result<Option<Anchor>, WorkersError> {
        let mut errors = RunErrors::default();
        let mut rows = |entries: &[Entry]| -> Result<Option<Vec<Row>>, WorkersError> {
            entries.iter().map(|entry| self.row(entry, stop, &mut errors, on_sample)).collect()
        };
        let (Some(members), Some(variations)) = (rows(&self.members)?, rows(&self.variations)?) else {
            return Ok(None);
        };
        Ok(Some(Anchor {
            scenario: self.file.config().name.clone(),
            settings: self.file.settings().iter().map(ToString::to_string).collect(),
            seed: self.sampling.seed,
            samples: self.sampling.samples,
            controllers: controllers().map(|controller| controller.to_string()),
            members,
            without_effect: self.without_effect.clone(),
            variations,
            errors,
        }))
    }

    /// Runs both arms of one row. `None` if `stop` has ended the runs early.
    fn row(
        &self,
        entry: &Entry,
        stop: &StopFlag,
        errors: &mut RunErrors,
        on_sample: &mut dyn FnMut(),
    ) -> Result<Option<Row>, WorkersError> {
        let arms = controllers().iter().map(|choice| Arm { controller: choice.factory(), sensors: None }).collect();
        let (file, sampling) = (entry.file.clone(), self.sampling);
        let work = Arc::new(Work { file, sampling, arms, checks: CheckPlan::off(), retry_crashed: 0 });
        let mut row = Row::new(entry.name.clone(), entry.setting.clone());
        let mut finished_samples = 0;
        self.workers.run(&work, work.samples(None), stop, |finished| {
            finished_samples += 1;
            count(&finished.record, &mut row, errors);
            on_sample();
            Ok::<_, WorkersError>(ControlFlow::Continue(()))
        })?;
        Ok((finished_samples == work.count()).then_some(row))
    }
}

/// Returns the arms: the human driver alone, and with emergency braking.
fn controllers() -> [ControllerChoice; 2] {
    ControllerChoice::of_function(Function::AebWithHuman)
}

/// Returns the scenario with one assumption changed.
fn varied(file: &ScenarioFile, name: &str, text: &str) -> Result<Entry, ScenarioError> {
    let setting: Result<Setting, _> = text.parse();
    let setting = setting.map_err(|source| ScenarioError::Set { path: file.path().to_owned(), source })?;
    let varied = ScenarioFile::parse(file.path(), file.text(), &[setting])?;
    varied.check()?;
    Ok(Entry { name: name.to_owned(), setting: Some(text.to_owned()), file: varied })
}

/// Counts what happened in both arms of a sample. A sample that lacks an outcome is an error, and
/// counts nowhere.
fn count(record: &Record, row: &mut Row, errors: &mut RunErrors) {
    let failures = record.arms.iter().filter_map(|arm| arm.result.as_ref().err());
    for failure in failures {
        let first = || (0, failure.message.clone());
        errors.kinds.entry(failure.kind.clone()).or_insert_with(first).0 += 1;
    }
    let outcomes: Vec<Happened> =
        record.arms.iter().filter_map(|arm| arm.result.as_ref().ok()).map(Happened::of).collect();
    match outcomes[..] {
        [without, with] => row.add(without, with),
        _ => errors.points += 1,
    }
}

/// Returns the path by which the scenario is loaded from the library.
pub fn path() -> &'static Path {
    Path::new(SCENARIO)
}

#[cfg(test)]
mod tests {
    use closecall_scenarios::member::members;
    use closecall_scenarios::sampling::Design;
    use closecall_scenarios::source;

    use super::*;

    fn plan(settings: &[&str], samples: u64) -> AnchorPlan {
        let settings: Vec<Setting> = settings.iter().map(|text| text.parse().unwrap()).collect();
        let sampling = Sampling { seed: 7, design: Design::Random, samples };
        let members = members(&["glances".into(), "steer-none".into()]).unwrap();
        AnchorPlan::new(source::load(path(), &settings).unwrap(), &members, sampling, Workers::default()).unwrap()
    }

    #[test]
    fn a_member_changes_ego_and_follower_and_every_variation_changes_the_scenario() {
        let plan = plan(&[], 1);
        assert_eq!(plan.members.iter().map(|entry| entry.name.as_str()).collect::<Vec<_>>(), [OF_SCENARIO, "glances"]);
        assert_eq!(plan.without_effect, ["steer-none"]);
        let text = plan.members[1].file.text();
        assert!(text.matches("lapse").count() >= 2, "{text}");
        for entry in &plan.variations {
            assert_ne!(entry.file.text(), plan.file.text(), "{}", entry.name);
        }
    }

    /// Where the ego never has to brake hard, emergency braking does nothing. A follower that is
    /// close and late strikes in both arms.
    #[test]
    fn an_arm_without_effect_has_the_ratio_1() {
        let gentle = [
            "brake-mps2=2",
            "ego-cc1-s=2.0",
            "ego-reaction-s=0.5",
            "rear-cc1-s=0.1",
            "rear-reaction-s=2.5",
            "actor.ego.driver.ego-stack.aeb.trigger-mps2=9",
        ];
        let mut plan = plan(&gentle, 12);
        plan.variations.clear();
        plan.members.truncate(1);
        let anchor = plan.run(&StopFlag::default(), &mut || {}).unwrap().unwrap();
        let Row { samples, striking, struck, .. } = anchor.members[0];
        assert_eq!((anchor.errors.points, samples), (0, 12));
        assert_eq!((striking, struck), (Paired::default(), Paired { both: 12, ..Paired::default() }));
        assert_eq!(struck.ratio().map(|ratio| ratio.value), Some(1.0));
    }

    /// A built case: the ego follows at 0.3 s, reacts late, and the lead vehicle brakes hard; the
    /// follower is far away.
    #[test]
    fn a_strike_without_emergency_braking_is_counted_and_its_prevention_too() {
        let built = ["following-mps=15", "ego-cc1-s=0.6", "ego-reaction-s=2.5", "brake-mps2=5", "rear-cc1-s=2.6"];
        let mut plan = plan(&built, 10);
        plan.variations.clear();
        plan.members.truncate(1);
        let anchor = plan.run(&StopFlag::default(), &mut || {}).unwrap().unwrap();
        let Row { striking, struck, .. } = anchor.members[0];
        assert_eq!((striking.without(), striking.only_without), (10, 10), "{striking:?}");
        assert_eq!(struck.without() + struck.with(), 0, "{struck:?}");
    }
}
