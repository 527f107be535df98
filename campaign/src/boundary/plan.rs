//! The plan of a boundary: its two parameters, its event, and its runs.

use std::ops::ControlFlow;
use std::sync::Arc;

use closecall_scenarios::criteria::{Event, EventExpression};
use closecall_scenarios::{ScenarioError, ScenarioFile, SettingError};
use closecall_sensors::SensorMode;
use closecall_simulation::controller::ControllerChoice;
use closecall_simulation::{Arm, NoObserver, RunKey, SampleError};
use closecall_traffic::{ActorId, Check, stream};
use rand::Rng;

use super::axis::{Axis, AxisError};
use super::result::Boundary;
use super::search::{Margins, search};
use crate::campaign_error::WorkersError;
use crate::gate::value;
use crate::record::{Record, SampleFailure};
use crate::runner::{guarded, run_guarded};
use crate::sensitivity::{FactorRange, RunErrors};
use crate::stop::StopFlag;
use crate::workers::{Samples, UncheckedSamples, Workers};

/// A boundary that cannot be planned or run.
#[derive(Debug, thiserror::Error)]
pub enum BoundaryError {
    /// Not two parameters are named.
    #[error("a boundary needs two parameters, and {given} given: name both")]
    Count {
        /// The number of parameters with its verb.
        given: String,
    },
    /// A parameter is named twice.
    #[error("the parameter {key} is given twice: a boundary needs two different ones")]
    Twice {
        /// The key.
        key: String,
    },
    /// A parameter has no range.
    #[error(transparent)]
    Axis(#[from] AxisError),
    /// The key of a parameter is not a path of keys.
    #[error("the parameter {range} cannot be used: {source}")]
    Key {
        /// The parameter with its range.
        range: String,
        /// What is wrong.
        source: SettingError,
    },
    /// A corner of the rectangle is no valid scenario.
    #[error("the values {at} cannot be used: {source}")]
    Values {
        /// The values.
        at: String,
        /// What is wrong.
        source: Box<ScenarioError>,
    },
    /// The event is a flag.
    #[error(
        "`{event}` happens or does not, and has no distance from happening: a boundary needs a number with a bound, such as `min_gap_rear_m < 0.5`"
    )]
    Binary {
        /// The event.
        event: String,
    },
    /// The event is a difference of two.
    #[error(
        "`{event}` is a difference of two events: a boundary needs one number with a bound, such as `min_gap_rear_m < 0.5`"
    )]
    Difference {
        /// The events.
        event: String,
    },
    /// The event compares with a baseline that is not run.
    #[error("`{event}` needs a baseline beside the controller under test: name another controller")]
    NoBaseline {
        /// The event.
        event: String,
    },
    /// A controller from outside reports the number about itself.
    #[error(
        "`{event}`: a controller from outside reports this number about itself: name a measured number, such as min_gap_rear_m"
    )]
    Reported {
        /// The event.
        event: String,
    },
    /// A fault of the scenario cannot act in the mode of the sensors.
    #[error(transparent)]
    Fault(Box<ScenarioError>),
    /// The worker threads could not be started.
    #[error(transparent)]
    Workers(#[from] WorkersError),
}

/// Everything that determines a boundary.
#[derive(Clone)]
pub struct BoundaryPlan {
    /// The number of runs.
    pub budget: usize,
    /// The seed of the design and of the runs.
    pub seed: u64,
    /// The sample whose random numbers all runs share.
    pub sample: u64,
    /// The number of worker threads, and the time limit of a run.
    pub workers: Workers,
    pub(super) file: ScenarioFile,
    pub(super) axes: [FactorRange; 2],
    pub(super) event: Event,
    pub(super) arms: Vec<Arm>,
}

impl std::fmt::Debug for BoundaryPlan {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("BoundaryPlan")
            .field("axes", &self.axes)
            .field("event", &self.event)
            .field("seed", &self.seed)
            .finish_non_exhaustive()
    }
}

/// Default number of runs.
const BUDGET: usize = 60;

impl BoundaryPlan {
    /// Returns the plan of a boundary of `event` in `file` along two parameters. The last
    /// controller is the one under test; one before it is the baseline, which runs only for an
    /// event of the baseline.
    ///
    /// # Errors
    /// [`BoundaryError`] if the parameters or the event cannot be used.
    pub fn new(
        file: &ScenarioFile,
        axes: &[Axis],
        event: EventExpression,
        controllers: &[ControllerChoice],
        sensors: Option<SensorMode>,
    ) -> Result<Self, BoundaryError> {
        if let Some(mode) = sensors {
            file.check_faults_in(mode).map_err(|error| BoundaryError::Fault(Box::new(error)))?;
        }
        let event = continuous(event)?;
        let arms = arms_of(event, controllers, sensors)?;
        let [first, second] = axes else {
            let count = axes.len();
            let given = if count == 1 { "one is".to_owned() } else { format!("{count} are") };
            return Err(BoundaryError::Count { given });
        };
        if first.key == second.key {
            return Err(BoundaryError::Twice { key: first.key.clone() });
        }
        let axes = [first.range(file.space())?, second.range(file.space())?];
        for corner in [[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]] {
            at(file, &axes, corner)?.check().map_err(|source| values_failure(&axes, corner, source))?;
        }
        let file = file.clone();
        Ok(Self { budget: BUDGET, seed: 0, sample: 0, workers: Workers::default(), file, axes, event, arms })
    }

    /// Runs the points. `None` if `stop` has ended the runs early. `on_run` is called after each
    /// point.
    ///
    /// # Errors
    /// [`BoundaryError::Workers`] if no threads can be started.
    pub fn run(&self, stop: &StopFlag, on_run: &mut dyn FnMut()) -> Result<Option<Boundary>, BoundaryError> {
        let mut errors = RunErrors::default();
        let mut values: Vec<Option<f64>> = Vec::new();
        let evaluate = |points: &[[f64; 2]]| -> Result<Option<Margins>, WorkersError> {
            let begin = values.len();
            let runs = Arc::new(self.samples(points));
            self.workers.run_samples(&runs, 0..points.len() as u64, stop, |finished| {
                values.push(self.value(&finished.record, &mut errors));
                on_run();
                Ok::<_, WorkersError>(ControlFlow::Continue(()))
            })?;
            let margin = |value: &Option<f64>| self.margin((*value)?);
            Ok((values.len() == begin + points.len()).then(|| values[begin..].iter().map(margin).collect()))
        };
        let Some(searched) = search(self.budget, self.scramble(), evaluate)? else { return Ok(None) };
        Ok(Some(Boundary::new(self, &searched, &values, errors)))
    }

    /// Returns the value of the number in a run; `None` if the run ended in an error or does not
    /// have it.
    fn value(&self, record: &Record, errors: &mut RunErrors) -> Option<f64> {
        let failures: Vec<&SampleFailure> = record.arms.iter().filter_map(|arm| arm.result.as_ref().err()).collect();
        errors.points += u64::from(!failures.is_empty());
        for failure in &failures {
            errors.add_failure(failure);
        }
        if failures.is_empty() { value(self.event.quantity, record).filter(|value| value.is_finite()) } else { None }
    }

    /// Returns points of the unit square, ready to run.
    fn samples(&self, points: &[[f64; 2]]) -> impl Samples + use<> {
        let (plan, points) = (self.clone(), points.to_vec());
        UncheckedSamples::new(&self.file, self.arms.clone(), move |sample: u64, arm: &Arm| {
            let fail = |message: String| SampleFailure { kind: "scenario".to_owned(), message };
            let point = usize::try_from(sample).ok().and_then(|index| points.get(index));
            let point = point.ok_or_else(|| fail("there is no such point".to_owned()))?;
            let file = at(&plan.file, &plan.axes, *point).map_err(|error| fail(error.to_string()))?;
            let scenario = guarded(|| file.config().check(&file.space().nominal()).map_err(SampleError::Scenario))?;
            let key = RunKey { seed: plan.seed, sample: plan.sample };
            Ok(run_guarded(&scenario, key, arm, &mut NoObserver)?)
        })
    }

    /// Returns the margin of a value: positive if the event does not happen.
    pub(super) fn margin(&self, value: f64) -> Option<f64> {
        Some(-self.event.excess(value)?)
    }

    /// Returns the number that scrambles the first points.
    fn scramble(&self) -> u32 {
        #[expect(clippy::expect_used, reason = "a constant, and every test draws from it")]
        let owner = ActorId::new("boundary").expect("a legal name");
        stream(self.seed, 0, &owner, "start").next_u32()
    }
}

/// Returns the event, if it is one number with a bound.
fn continuous(expression: EventExpression) -> Result<Event, BoundaryError> {
    let EventExpression { first, second } = expression;
    if second.is_some() {
        return Err(BoundaryError::Difference { event: expression.to_string() });
    }
    match first.excess(0.0) {
        Some(_) => Ok(first),
        None => Err(BoundaryError::Binary { event: first.to_string() }),
    }
}

/// Returns the arms that the event needs: the one under test, and the baseline if the event is of
/// it.
fn arms_of(
    event: Event,
    controllers: &[ControllerChoice],
    sensors: Option<SensorMode>,
) -> Result<Vec<Arm>, BoundaryError> {
    let name = || event.to_string();
    let is_of_baseline = event.quantity.needs_pairs();
    if is_of_baseline && controllers.len() < 2 {
        return Err(BoundaryError::NoBaseline { event: name() });
    }
    let used = if is_of_baseline { controllers } else { &controllers[controllers.len().saturating_sub(1)..] };
    let arms: Vec<Arm> = used.iter().map(|choice| Arm { controller: choice.factory(), sensors }).collect();
    if let Some((measure, in_baseline)) = event.quantity.measure() {
        let arm = if in_baseline { arms.first() } else { arms.last() };
        if measure.is_reported() && arm.is_some_and(|arm| !arm.controller.is_built_in()) {
            return Err(BoundaryError::Reported { event: name() });
        }
    }
    Ok(arms)
}

/// Returns the file with the parameters at a point of the unit square.
fn at(file: &ScenarioFile, axes: &[FactorRange; 2], point: [f64; 2]) -> Result<ScenarioFile, BoundaryError> {
    let settings = axes
        .iter()
        .zip(point)
        .map(|(axis, u)| axis.at(u).map_err(|source| BoundaryError::Key { range: axis.to_string(), source }));
    let settings = settings.collect::<Result<Vec<_>, _>>()?;
    ScenarioFile::parse(file.path(), file.text(), &settings).map_err(|source| values_failure(axes, point, source))
}

fn values_failure(axes: &[FactorRange; 2], point: [f64; 2], source: ScenarioError) -> BoundaryError {
    let values =
        axes.iter().zip(point).map(|(axis, u)| axis.at(u).map_or_else(|_| axis.key.clone(), |set| set.to_string()));
    BoundaryError::Values { at: values.collect::<Vec<_>>().join(" and "), source: Box::new(source) }
}

#[cfg(test)]
mod tests {
    use closecall_scenarios::library;

    use super::*;

    fn plan(axes: &[&str], event: &str, controllers: &[ControllerChoice]) -> Result<BoundaryPlan, BoundaryError> {
        let name = "low-thw-overtake";
        let file = ScenarioFile::parse(&library::path(name), library::text(name).unwrap(), &[]).unwrap();
        let axes: Vec<Axis> = axes.iter().map(|axis| axis.parse().unwrap()).collect();
        BoundaryPlan::new(&file, &axes, event.parse().unwrap(), controllers, None)
    }

    #[test]
    fn an_event_without_a_distance_and_wrong_parameters_are_refused() {
        let both = [ControllerChoice::ACC, ControllerChoice::MIS];
        let near = "min_gap_rear_m < 2";
        let cases: [(&[&str], &str, &str); 9] = [
            (&["closing-mps", "reaction-s"], "collision", "`ego_collided` happens or does not"),
            (&["closing-mps", "reaction-s"], "induced", "`induced` happens or does not"),
            (&["closing-mps", "reaction-s"], "prevented - induced", "a difference of two events"),
            (&["closing-mps"], near, "two parameters, and one is given"),
            (&["closing-mps", "reaction-s", "brake-phase"], near, "two parameters, and 3 are given"),
            (&["closing-mps", "closing-mps=3..5"], near, "closing-mps is given twice"),
            (&["closing-mps", "closing"], near, "`closing` needs a range"),
            (&["closing-mps", "rear-class"], near, "`rear-class` needs a range"),
            (&["closing-mps", "actor.raer.start.behind.gap-m=90..120"], near, "did you mean `rear`?"),
        ];
        for (axes, event, expected) in cases {
            let message = plan(axes, event, &both).unwrap_err().to_string();
            assert!(message.contains(expected), "{axes:?} {event}: {message}");
        }
        let baseline = plan(&["closing-mps", "reaction-s"], "baseline.min_gap_rear_m < 2", &[ControllerChoice::ACC]);
        assert!(baseline.unwrap_err().to_string().contains("needs a baseline"));
    }

    #[test]
    fn only_an_event_of_the_baseline_runs_the_baseline() {
        let both = [ControllerChoice::ACC, ControllerChoice::MIS];
        let arms = |event: &str| plan(&["closing-mps=3..9", "reaction-s=0.5..2"], event, &both).unwrap().arms.len();
        assert_eq!((arms("min_gap_rear_m < 2"), arms("baseline.min_gap_rear_m < 2")), (1, 2));
    }

    #[test]
    fn a_margin_is_positive_if_the_event_does_not_happen() {
        let margin = |event: &str, value: f64| {
            plan(&["closing-mps=3..9", "reaction-s=0.5..2"], event, &[ControllerChoice::MIS]).unwrap().margin(value)
        };
        assert_eq!(margin("min_gap_rear_m < 2", 5.0), Some(3.0));
        assert_eq!(margin("max_jerk_mps3 >= 2", 5.0), Some(-3.0));
    }
}
