//! Judges a campaign, record by record.

use std::sync::Arc;

use closecall_scenarios::criteria::{Aggregate, Expression, FlagName, LEAD_BRAKED, Quantity};
use closecall_scenarios::sampling::Design;
use closecall_scenarios::{Function, WEAKENED_COVERAGE, library};
use closecall_simulation::Arm;
use closecall_simulation::controller::ControllerChoice;

use super::course::{Course, is_idle, least_action, missing_action};
use super::evaluate::{Accumulator, Answer, Evaluation, Evidence};
use super::result::{ExpectationResult, GateResult, RequirementResult, Standing};
use super::set::{GateSet, GateSource, GateSpec, ProbabilitySpec};
use crate::attribution;
use crate::coverage::{CoverageCounter, CoverageResult};
use crate::ledger::Inference;
use crate::record::Record;
use closecall_scenarios::parameters::SpaceEntry;
use closecall_traffic::ParameterName;
use closecall_traffic::statistics::format::percent;
use closecall_traffic::words::counted;

use crate::repeats::{Repeats, is_varied};
use crate::runner::Work;

/// A gate that is being judged.
#[derive(Clone, Debug)]
struct Gate {
    spec: GateSpec,
    accumulator: Accumulator,
    /// The evidence with the baseline in place of the arm under test.
    of_baseline: Accumulator,
}

impl Gate {
    fn new(spec: &GateSpec) -> Self {
        let accumulator = Accumulator::new(spec.expression);
        Self { of_baseline: accumulator.clone(), accumulator, spec: spec.clone() }
    }
}

/// The judged parts of one scenario.
#[derive(Clone, Debug)]
struct Judged {
    scenario: String,
    is_varied: bool,
    repeats: Repeats,
    repeated: u64,
    gates: Vec<Gate>,
    probability: Option<ProbabilitySpec>,
    requirements: Vec<String>,
    expects: Vec<FlagName>,
    least_share: f64,
    happened: u64,
    samples: u64,
    overridden: Vec<String>,
    /// What sets the scenario apart from the library's scenario of the same name.
    unlike_library: Vec<String>,
    /// The share of the samples in which the system under test acts, which it must exceed to be
    /// tested; `None` if the scenario asks for no action.
    least_action: Option<f64>,
    /// The function that the scenario judges.
    function: Function,
    /// The parameters that are sampled beyond what trajectory data show, in words.
    extrapolations: Vec<String>,
    /// What the samples cover.
    coverage: CoverageCounter,
    /// Samples in which the system under test acted: it slowed the ego for a vehicle behind, or
    /// moved it otherwise than the baseline.
    acted: u64,
}

/// Gathers the evidence for every gate, requirement and expectation of a campaign.
#[derive(Clone, Debug)]
pub struct Judge {
    is_paired: bool,
    is_measurement: bool,
    /// Whether the baseline, and the arm under test, are controllers of this program.
    is_built_in: [bool; 2],
    inference: Inference,
    is_weighted: bool,
    scenarios: Vec<Judged>,
}

/// Returns a message if another controller stands in for the baseline of the scenario's function,
/// and a check or `MIS-9` compares with the baseline. The collisions that it fails to prevent would
/// count for the system under test. A controller from outside is the user's own baseline.
fn other_baseline(work: &Work) -> Option<String> {
    let config = work.file.config();
    let [baseline, _] = ControllerChoice::of_function(config.function);
    let arm = work.arms.first().filter(|arm| work.arms.len() > 1 && arm.controller.is_built_in())?;
    let (name, expected) = (arm.controller.name(), baseline.name());
    // MIS-9 allows the ego to slow down as much as the baseline does.
    let is_attributed = config.requirements.iter().any(|mark| mark == attribution::REQUIREMENT);
    let compares = is_attributed || config.checks.values().flatten().any(Expression::needs_pairs);
    (compares && name != expected).then(|| format!("the baseline is `{name}` and not `{expected}`"))
}

/// Returns what the settings, the gates and the baseline of a campaign demand less than the
/// scenario file, or than the project file. A measurement demands nothing.
fn overridden(work: &Work, set: &GateSet) -> Vec<String> {
    let asks_coverage = set.of_scenario(&work.file).iter().any(|gate| gate.expression.aggregate == Aggregate::Coverage);
    let counts = |weakening: &&String| asks_coverage || *weakening != WEAKENED_COVERAGE;
    let settings = work.file.config().overridden.iter().filter(counts).cloned();
    settings.chain(set.weakened_in(&work.file)).chain(other_baseline(work)).collect()
}

impl Judge {
    /// Returns a judge without samples.
    pub fn new(works: &[Arc<Work>], set: &GateSet, inference: Inference) -> Self {
        let judged = |work: &Arc<Work>| {
            let config = work.file.config();
            Judged {
                scenario: config.name.clone(),
                is_varied: is_varied(work.file.space()),
                repeats: Repeats::of(work.file.space()),
                repeated: 0,
                gates: set.of_scenario(&work.file).iter().map(Gate::new).collect(),
                probability: set.probability_of(&work.file),
                requirements: config.requirements.clone(),
                expects: config.expects.clone(),
                least_share: config.expects_share,
                happened: 0,
                samples: 0,
                overridden: overridden(work, set),
                unlike_library: library::differences(&work.file),
                least_action: least_action(config),
                function: config.function,
                extrapolations: work.file.space().iter().filter_map(extrapolation).collect(),
                coverage: CoverageCounter::new(work),
                acted: 0,
            }
        };
        let arms = works.first().map_or(&[][..], |work| &work.arms);
        let is_built_in = |arm: Option<&Arm>| arm.is_none_or(|arm| arm.controller.is_built_in());
        Self {
            is_paired: works.first().is_some_and(|work| work.arms.len() > 1),
            is_measurement: set.is_measurement,
            is_built_in: [is_built_in(arms.first()), is_built_in(arms.last())],
            inference,
            is_weighted: works.iter().any(|work| work.sampling.design == Design::Coverage),
            scenarios: works.iter().map(judged).collect(),
        }
    }

    /// Adds one sample. A record of a scenario that is not in the plan does not count.
    pub fn push(&mut self, record: &Record) {
        let Some(judged) = self.scenarios.iter_mut().find(|judged| judged.scenario == record.scenario) else { return };
        if !judged.repeats.counts(record) {
            judged.repeated += 1;
            return;
        }
        judged.observe_expectations(record);
        judged.coverage.push(record);
        let of_baseline = record.of_baseline();
        for gate in &mut judged.gates {
            gate.accumulator.push(record);
            of_baseline.iter().for_each(|record| gate.of_baseline.push(record));
        }
    }

    /// Returns true if the campaign is a mere measurement.
    pub const fn is_measurement(&self) -> bool {
        self.is_measurement
    }

    /// Returns the samples of a scenario that repeat the parameters or the outcome of an earlier
    /// one, and are not counted as evidence.
    pub fn repeated(&self, scenario: &str) -> u64 {
        self.scenarios.iter().find(|judged| judged.scenario == scenario).map_or(0, |judged| judged.repeated)
    }

    /// Returns what settings weakened, by scenario.
    pub fn overridden(&self) -> impl Iterator<Item = (&str, &[String])> {
        let judged = self.scenarios.iter().filter(|judged| !judged.overridden.is_empty());
        judged.map(|judged| (judged.scenario.as_str(), judged.overridden.as_slice()))
    }

    /// Returns the scenarios that have the name of a scenario of the library and are another one,
    /// with the keys in which they differ.
    pub fn unlike_library(&self) -> impl Iterator<Item = (&str, &[String])> {
        let judged = self.scenarios.iter().filter(|judged| !judged.unlike_library.is_empty());
        judged.map(|judged| (judged.scenario.as_str(), judged.unlike_library.as_slice()))
    }

    /// Returns the names of the scenarios.
    pub fn scenarios(&self) -> impl Iterator<Item = &str> {
        self.scenarios.iter().map(|judged| judged.scenario.as_str())
    }

    /// Returns the scenarios that ask for action of the system under test, and in which it never or
    /// hardly ever acted, with what it did not do in words.
    pub fn without_action(&self) -> impl Iterator<Item = (&str, String)> {
        let is_told = |judged: &Judged| self.is_paired || judged.function == Function::Mis;
        let idle = self
            .scenarios
            .iter()
            .filter(move |judged| is_told(judged) && is_idle(judged.least_action, (judged.acted, judged.samples)));
        idle.map(|judged| {
            let runs = counted(judged.samples, "sample");
            (judged.scenario.as_str(), missing_action(judged.function, judged.acted, &runs))
        })
    }

    /// Returns true if a system that does nothing passes as well: in a paired campaign the baseline
    /// meets every gate in place of the system under test, and in another one nothing happens in any
    /// scenario, and its file alone judges. Passing then shows only that the system does no harm.
    pub fn shows_no_benefit(&self) -> bool {
        self.scenarios.iter().all(|judged| {
            let evidence = self.evidence(judged.is_varied);
            let is_met_by_baseline = |gate: &Gate| match gate.spec.expression.quantity {
                Quantity::Covered(_) => true,
                _ => gate.of_baseline.evaluate(&evidence).answer == Answer::Met,
            };
            let is_of_file = |gate: &Gate| matches!(gate.spec.source, GateSource::Requirement(_));
            let is_quiet = judged.function == Function::Mis
                && judged.least_action.is_none()
                && judged.expects.iter().all(|flag| flag.measure().name != LEAD_BRAKED);
            let does_no_more = match self.is_paired {
                true => judged.gates.iter().all(is_met_by_baseline),
                false => is_quiet && judged.gates.iter().all(is_of_file),
            };
            does_no_more && judged.probability.is_none()
        })
    }

    /// Returns the values that each scenario samples beyond trajectory data, in words.
    pub fn extrapolations(&self) -> impl Iterator<Item = (&str, &[String])> {
        let judged = self.scenarios.iter().filter(|judged| !judged.extrapolations.is_empty());
        judged.map(|judged| (judged.scenario.as_str(), judged.extrapolations.as_slice()))
    }

    /// Returns true if some parameter of the scenario varies.
    pub fn is_varied(&self, scenario: &str) -> bool {
        self.scenarios.iter().any(|judged| judged.scenario == scenario && judged.is_varied)
    }

    /// Returns the gates on the probability of a collision, by scenario.
    pub fn probabilities(&self) -> impl Iterator<Item = (&str, &ProbabilitySpec)> {
        self.scenarios.iter().filter_map(|judged| Some((judged.scenario.as_str(), judged.probability.as_ref()?)))
    }

    /// Returns the result of every gate and requirement check, scenario by scenario.
    pub fn gates(&self) -> Vec<GateResult> {
        let result = |gate: &Gate, judged: &Judged| GateResult {
            scenario: judged.scenario.clone(),
            expression: gate.spec.expression,
            source: gate.spec.source.clone(),
            evaluation: match gate.spec.expression.quantity {
                Quantity::Covered(name) => {
                    Evaluation::of_coverage(&gate.spec.expression, judged.coverage.share(name.as_str()))
                }
                _ => gate.accumulator.evaluate(&self.evidence(judged.is_varied)),
            },
        };
        let of_scenario =
            |judged: &Judged| -> Vec<GateResult> { judged.gates.iter().map(|gate| result(gate, judged)).collect() };
        self.scenarios.iter().flat_map(of_scenario).collect()
    }

    /// Returns what the samples of each scenario cover, for those that state what is to be covered.
    pub fn coverage(&self) -> impl Iterator<Item = (&str, Vec<CoverageResult>)> {
        let results = self.scenarios.iter().map(|judged| (judged.scenario.as_str(), judged.coverage.results()));
        results.filter(|(_, results)| !results.is_empty())
    }

    /// Returns the first gate of a scenario that fails whatever its remaining `rest` samples are.
    pub fn lost(&self, scenario: &str, rest: u64) -> Option<Expression> {
        let judged = self.scenarios.iter().find(|judged| judged.scenario == scenario)?;
        let evidence = self.evidence(judged.is_varied);
        let lost = judged.gates.iter().find(|gate| gate.accumulator.is_lost(&evidence, rest));
        lost.map(|gate| gate.spec.expression)
    }

    fn evidence(&self, is_varied: bool) -> Evidence {
        let Self { is_paired, is_built_in, inference, is_weighted, .. } = *self;
        Evidence { is_paired, is_varied, is_built_in, inference, is_weighted }
    }

    /// Returns how each requirement fares in each scenario that names it, in the order of the
    /// marks.
    pub fn requirements(&self, gates: &[GateResult]) -> Vec<RequirementResult> {
        let mut results = Vec::new();
        for judged in &self.scenarios {
            for mark in &judged.requirements {
                let is_check = |gate: &&GateResult| gate.scenario == judged.scenario && gate.is_of(mark);
                let standing = gates.iter().filter(is_check).map(GateResult::standing).max();
                results.push(RequirementResult {
                    mark: mark.clone(),
                    scenario: judged.scenario.clone(),
                    standing: standing.unwrap_or(Standing::NotChecked),
                });
            }
        }
        results.sort_by(|a, b| (&a.mark, &a.scenario).cmp(&(&b.mark, &b.scenario)));
        results
    }

    /// Returns whether the expectations of the scenarios happened.
    pub fn expectations(&self) -> Vec<ExpectationResult> {
        let result = |judged: &Judged| ExpectationResult {
            scenario: judged.scenario.clone(),
            expects: judged.expects.clone(),
            happened: judged.happened,
            samples: judged.samples,
            least_share: judged.least_share,
        };
        self.scenarios.iter().filter(|judged| !judged.expects.is_empty()).map(result).collect()
    }
}

/// Returns how far a parameter is sampled beyond what trajectory data show; `None` if it is not.
fn extrapolation((name, entry): (&ParameterName, &SpaceEntry)) -> Option<String> {
    let (observed, beyond) = entry.beyond_observed()?;
    let [low, high] = entry.distribution.bounds()?;
    let range = if entry.distribution.is_fixed() { format!("{low}") } else { format!("{low:.3} to {high:.3}") };
    Some(format!(
        "{name} {range}, observed {} to {} ({} observations), {} of the distribution beyond",
        observed.min,
        observed.max,
        observed.n,
        percent(beyond)
    ))
}

impl Judged {
    fn observe_expectations(&mut self, record: &Record) {
        let Some(Course { happened, acted, .. }) = Course::of(record, &self.expects, self.function, &[]) else {
            return;
        };
        self.samples += 1;
        self.happened += u64::from(happened);
        self.acted += u64::from(acted);
    }
}
