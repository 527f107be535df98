//! The verdict of a campaign, from its gates, requirements, expectations and validity checks.
//!
//! | finding | decision | verdict | exit code |
//! |---|---|---|---|
//! | a sample ended in an error | [`Decision::SampleError`] | ERROR | 5 |
//! | a validity check failed, or what a scenario expects did not happen | [`Decision::Invalid`] | INVALID | 7 |
//! | a gate or the check of a requirement is not met, or more samples are flaky than allowed | [`Decision::Fail`] | FAIL | 1 |
//! | the samples do not decide a gate | [`Decision::Inconclusive`] | INCONCLUSIVE | 4 |
//! | no gate and no requirement was checked, in some scenario none on the system under test, or that system was not there to be tested, or a scenario was left out | [`Decision::NotJudged`] | NOT JUDGED | 4 |
//! | a setting, a gate or the baseline weakened what a file demands | [`Decision::Overridden`] | OVERRIDDEN | 4 |
//! | every gate that was checked is met | [`Decision::Pass`] | PASS | 0 |
//! | the campaign is a measurement (`--no-gate`) | [`Decision::Measured`] | none | 0 |
//!
//! If several hold, the first of the table decides.

use std::collections::BTreeSet;
use std::fmt;

use closecall_traffic::statistics::format::percent;
use closecall_traffic::words::{counted, was};
use serde::Serialize;

use super::attribution;
use super::coverage::CoverageResult;
use super::gate::MAX_FLIP_RATE;
use super::gate::{ExpectationResult, GateResult, GateSet, GateSource, Judge, RequirementResult, Standing};
use super::ledger::ArmCounts;
use super::left_out::{LeftOut, sentences};
use super::probability::{Answer, Finding};
use super::summary::{Counts, Summary};
use super::validity::{CheckCounts, Invariance, RunOfScenario};

/// Share of the outcomes in which the system under test may not be available for some time, and the
/// campaign still says what the system does (-). An assumption: with more, the usual run is one in
/// which the system cannot act as it was built to.
const MAX_UNAVAILABLE_SHARE: f64 = 0.5;

/// The answer of a campaign.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum Verdict {
    /// Every gate that was checked is met, and at least one was.
    #[serde(rename = "PASS")]
    Pass,
    /// Some gate is not met.
    #[serde(rename = "FAIL")]
    Fail,
    /// The samples do not decide a gate.
    #[serde(rename = "INCONCLUSIVE")]
    Inconclusive,
    /// No gate and no requirement was checked, or in some scenario none on the system under test,
    /// or that system was not available or never acted, or a scenario did not run.
    #[serde(rename = "NOT JUDGED")]
    NotJudged,
    /// A setting, a gate or the baseline of the command line weakened the criteria of a file.
    #[serde(rename = "OVERRIDDEN")]
    Overridden,
    /// Some sample ended in an error.
    #[serde(rename = "ERROR")]
    Error,
    /// The campaign cannot be believed.
    #[serde(rename = "INVALID")]
    Invalid,
}

/// What a limit says that the samples cannot miss.
const HOLDS_ALWAYS: &str =
    "which holds whatever happens in these samples, and says nothing of them: set a limit that can be missed";

impl Verdict {
    /// Returns the word for reports.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Pass => "PASS",
            Self::Fail => "FAIL",
            Self::Inconclusive => "INCONCLUSIVE",
            Self::NotJudged => "NOT JUDGED",
            Self::Overridden => "OVERRIDDEN",
            Self::Error => "ERROR",
            Self::Invalid => "INVALID",
        }
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.word())
    }
}

/// The finding that decides a judgement. If several hold, the first of [`Decision::PRECEDENCE`]
/// decides.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Decision {
    /// Every gate that was checked is met.
    Pass,
    /// Some gate is not met.
    Fail,
    /// The samples do not decide a gate.
    Inconclusive,
    /// Nothing was checked, or the system under test was not there to be tested.
    NotJudged,
    /// A setting weakened the criteria of a scenario.
    Overridden,
    /// Some sample ended in an error.
    SampleError,
    /// The campaign cannot be believed.
    Invalid,
    /// The campaign is a measurement, and nothing is judged.
    Measured,
}

impl Decision {
    /// The findings in the order in which they decide.
    pub const PRECEDENCE: [Self; 6] =
        [Self::SampleError, Self::Invalid, Self::Fail, Self::Inconclusive, Self::NotJudged, Self::Overridden];

    fn first_of(findings: &[Self]) -> Option<Self> {
        Self::PRECEDENCE.into_iter().find(|decision| findings.contains(decision))
    }

    /// Returns the verdict, or `None` for a measurement.
    pub const fn verdict(self) -> Option<Verdict> {
        match self {
            Self::Pass => Some(Verdict::Pass),
            Self::Fail => Some(Verdict::Fail),
            Self::Inconclusive => Some(Verdict::Inconclusive),
            Self::NotJudged => Some(Verdict::NotJudged),
            Self::Overridden => Some(Verdict::Overridden),
            Self::SampleError => Some(Verdict::Error),
            Self::Invalid => Some(Verdict::Invalid),
            Self::Measured => None,
        }
    }
}

/// A verdict with all that it rests on.
#[derive(Clone, Debug, PartialEq)]
pub struct Judgement {
    /// The finding that decides, which the exit code follows.
    pub decision: Decision,
    /// Every reason for it, in sentences. The reasons that decide come first, then remarks.
    pub reasons: Vec<String>,
    /// The reasons that decide nothing and are about one scenario each: what happened as expected,
    /// what extrapolates. There may be one for each scenario, so that a report folds them.
    pub background: Vec<String>,
    /// Every gate and every check of a requirement, with its answer.
    pub gates: Vec<GateResult>,
    /// How each requirement fares in each scenario that names it.
    pub requirements: Vec<RequirementResult>,
    /// Whether the expectations of the scenarios happened.
    pub expectations: Vec<ExpectationResult>,
    /// What the samples of each scenario say about the probability of a collision, if that was
    /// asked.
    pub probabilities: Vec<(String, Finding)>,
    /// What the samples of each scenario cover, if the scenario states what is to be covered.
    pub coverage: Vec<(String, Vec<CoverageResult>)>,
    /// The gate on the number of flaky samples, if there is one that can be missed.
    pub flaky: Option<FlakyGate>,
    /// Whether a system that does nothing passes as well.
    pub shows_no_benefit: bool,
}

impl Judgement {
    /// Returns the verdict, or `None` for a measurement.
    pub const fn verdict(&self) -> Option<Verdict> {
        self.decision.verdict()
    }

    /// Adds reasons for which the campaign cannot be believed, found outside its records.
    pub fn add_invalid(&mut self, reasons: Vec<String>) {
        if self.decision == Decision::SampleError {
            self.reasons.extend(reasons);
        } else if !reasons.is_empty() {
            self.decision = Decision::Invalid;
            // The first reason is the sentence of the verdict.
            self.reasons.splice(0..0, reasons);
        }
    }

    /// Adds the scenarios that did not run. A campaign without one of its scenarios does not pass.
    pub fn add_left_out(&mut self, left_out: &[LeftOut]) {
        if !left_out.is_empty() && matches!(self.decision, Decision::Pass | Decision::Overridden) {
            self.decision = Decision::NotJudged;
            self.reasons.splice(0..0, sentences(left_out));
        } else {
            self.reasons.extend(sentences(left_out));
        }
    }

    /// Adds a remark that decides nothing. It comes last, so that it is never the sentence of the
    /// verdict.
    pub fn add_remark(&mut self, remark: String) {
        self.reasons.push(remark);
    }

    /// Returns true if a gate, the check of a requirement, or a gate on the probability of a
    /// collision was judged.
    pub fn has_gates(&self) -> bool {
        self.verdict().is_some() && !(self.gates.is_empty() && self.probabilities.is_empty())
    }

    /// Returns the word for reports; a measurement has no verdict.
    pub fn word(&self) -> &'static str {
        self.verdict().map_or("measured, not judged", Verdict::word)
    }
}

/// The limits within which a campaign is believed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Allowed {
    /// Share of checked verdicts that may flip at half the time step.
    pub max_flip_rate: f64,
    /// Most flaky samples; any number if `None`.
    pub max_flaky: Option<u64>,
}

impl Default for Allowed {
    fn default() -> Self {
        Self { max_flip_rate: MAX_FLIP_RATE, max_flaky: None }
    }
}

impl From<&GateSet> for Allowed {
    fn from(gates: &GateSet) -> Self {
        Self { max_flip_rate: gates.max_flip_rate, max_flaky: gates.max_flaky }
    }
}

/// The number of flaky samples, and the gate on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct FlakyGate {
    /// Samples with an outcome only because they were run again after a failure.
    pub flaky: u64,
    /// Most such samples.
    pub max: u64,
}

impl FlakyGate {
    /// Returns true if there are no more than allowed.
    pub const fn is_met(self) -> bool {
        self.flaky <= self.max
    }
}

impl fmt::Display for FlakyGate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { flaky, max } = self;
        write!(f, "flaky samples: {flaky}, at most {max} allowed")
    }
}

/// Judges a campaign by the evidence that a judge has gathered.
pub fn judge(summary: &Summary, judge: &Judge, allowed: Allowed) -> Judgement {
    let mut findings = Findings::default();
    let total = summary.total();
    if total.errors() > 0 {
        findings.add(Decision::SampleError, format!("{} ended in an error", samples(total.errors())));
        summary.failures().for_each(|(scenario, failure)| findings.note(format!("{scenario}: {failure}")));
    }
    if summary.is_unchecked {
        findings.note("the validity of the simulator was not checked: the checks were switched off".to_owned());
    }
    let flaky = judge_flaky(&total, allowed.max_flaky, &mut findings);
    judge_validity(summary, &total.checks, allowed.max_flip_rate, &mut findings);
    let expectations = judge_expectations(judge, &mut findings);
    let attributed = judge_attribution(summary, &mut findings);
    judge_samples(summary, judge, &mut findings);
    judge_action(judge, &mut findings);
    for (name, weakened) in judge.overridden() {
        let weakenings = weakened.join("; ");
        findings.add(
            Decision::Overridden,
            format!("OVERRIDDEN: {name}: a setting weakened what the scenario is judged by: {weakenings}"),
        );
    }
    for (name, keys) in judge.unlike_library() {
        findings.note(format!("{name} differs from the library's scenario of this name in {}", keys.join(", ")));
    }
    let probabilities = judge_probabilities(summary, judge, &mut findings);
    let gates = judge.gates();
    for gate in &gates {
        match gate.standing() {
            Standing::Pass | Standing::NotChecked => findings.note(gate.to_string()),
            Standing::Inconclusive => findings.add(Decision::Inconclusive, gate.to_string()),
            Standing::Fail => findings.add(Decision::Fail, gate.to_string()),
        }
    }
    for subject in undecidable(&gates) {
        let reason = format!("{subject} has no value in any scenario, so that the gate on it says nothing");
        findings.add(Decision::Inconclusive, reason);
    }
    let mut requirements = judge.requirements(&gates);
    for requirement in requirements.iter_mut().filter(|requirement| requirement.mark == attribution::REQUIREMENT) {
        for (_, standing) in attributed.iter().filter(|(name, _)| *name == requirement.scenario) {
            requirement.standing = requirement.standing.max(*standing);
        }
    }
    let has_criteria = |requirement: &RequirementResult| {
        gates.iter().any(|gate| gate.scenario == requirement.scenario && gate.is_of(&requirement.mark))
    };
    for requirement in requirements.iter().filter(|requirement| !has_criteria(requirement)) {
        findings.background(format!("not checked: {}: {}: it has no criteria", requirement.scenario, requirement.mark));
    }
    let is_judged = !probabilities.is_empty() || is_judged(&gates);
    let decision = if judge.is_measurement() {
        // Errors, and a simulator that cannot be believed, spoil a measurement, too.
        let spoils = |decision: &Decision| matches!(decision, Decision::SampleError | Decision::Invalid);
        Decision::first_of(&findings.decisions()).filter(spoils).unwrap_or(Decision::Measured)
    } else {
        if !is_judged {
            findings.add(Decision::NotJudged, missing_judgement(&gates).to_owned());
        } else {
            let is_bounded = |name: &str| probabilities.iter().any(|(bounded, _)| bounded == name);
            for name in unjudged(judge, &gates).filter(|name| !is_bounded(name)) {
                let reason = format!(
                    "{name}: no gate and no check of a requirement judges the system under test there: set a gate on it, or leave the \
                     scenario out"
                );
                findings.add(Decision::NotJudged, reason);
            }
        }
        Decision::first_of(&findings.decisions()).unwrap_or(Decision::Pass)
    };
    judge_extrapolation(judge, &mut findings);
    let coverage = judge.coverage().map(|(name, results)| (name.to_owned(), results)).collect();
    let background = findings.background.clone();
    let reasons = findings.into_reasons(decision);
    Judgement {
        decision,
        reasons,
        background,
        gates,
        requirements,
        expectations,
        probabilities,
        coverage,
        flaky,
        shows_no_benefit: judge.shows_no_benefit(),
    }
}

/// Returns the subjects of the gates that somebody set and that no scenario decides: there is no
/// sample in which they have a value. A gate that says nothing does not pass.
fn undecidable(gates: &[GateResult]) -> BTreeSet<String> {
    let set = || gates.iter().filter(|gate| !matches!(gate.source, GateSource::Requirement(_)));
    let subjects = |gate: &GateResult| gate.expression.subject();
    let decided: BTreeSet<String> =
        set().filter(|gate| gate.standing() != Standing::NotChecked).map(subjects).collect();
    set().map(subjects).filter(|subject| !decided.contains(subject)).collect()
}

/// Returns the scenarios in which no gate and no check of a requirement judges the arm under test.
fn unjudged<'a>(judge: &'a Judge, gates: &'a [GateResult]) -> impl Iterator<Item = &'a str> {
    judge.scenarios().filter(move |name| !gates.iter().any(|gate| gate.scenario == *name && gate.judges_tested()))
}

/// Returns true if the gates say something: a gate that somebody set is decided, or every check of
/// every requirement is. A requirement that is checked in part is not checked.
fn is_judged(gates: &[GateResult]) -> bool {
    let (checks, set) = checks_and_set(gates);
    set.iter().any(|gate| gate.is_decided())
        || (!checks.is_empty() && checks.iter().all(|gate| gate.standing() != Standing::NotChecked))
}

/// Returns the checks of requirements, and the gates that somebody set.
fn checks_and_set(gates: &[GateResult]) -> (Vec<&GateResult>, Vec<&GateResult>) {
    gates.iter().partition(|gate| matches!(gate.source, GateSource::Requirement(_)))
}

/// Returns why gates that judge nothing do not.
fn missing_judgement(gates: &[GateResult]) -> &'static str {
    let (checks, set) = checks_and_set(gates);
    match (checks.is_empty(), set.is_empty()) {
        (true, true) => "no gate was set and no requirement was checked: set a gate, or measure without a verdict",
        (false, true) => "no gate was set, and not every check of the requirements is decided",
        (true, false) => "no gate that was set is decided",
        (false, false) => "no gate that was set is decided, and not every check of the requirements is",
    }
}

fn judge_flaky(total: &Counts, max: Option<u64>, findings: &mut Findings) -> Option<FlakyGate> {
    let (flaky, runs) = (total.flaky(), total.arms.iter().map(|arm| arm.outcomes).sum::<u64>());
    let Some(gate) = max.map(|max| FlakyGate { flaky, max }) else {
        if flaky > 0 {
            findings.note(format!("flaky: {} succeeded only when run again", samples(flaky)));
        }
        return None;
    };
    if gate.max > 0 && gate.max >= runs {
        findings.add(Decision::Inconclusive, format!("{gate}, {HOLDS_ALWAYS}"));
        return None;
    }
    if gate.is_met() {
        // Nothing was run again: there is nothing to say.
        if flaky > 0 {
            findings.note(gate.to_string());
        }
    } else {
        findings.add(Decision::Fail, gate.to_string());
    }
    Some(gate)
}

/// Returns why the samples cannot be believed, in sentences: what the validity checks found, and what
/// scenarios are about and did not happen.
pub(crate) fn disbelief(summary: &Summary, judge: &Judge, max_flip_rate: f64) -> Vec<String> {
    let mut findings = Findings::default();
    judge_validity(summary, &summary.total().checks, max_flip_rate, &mut findings);
    judge_expectations(judge, &mut findings);
    let is_decisive = |reason: &Reason| reason.decision == Some(Decision::Invalid);
    findings.reasons.into_iter().filter(is_decisive).map(|reason| reason.text).collect()
}

fn judge_validity(summary: &Summary, checks: &CheckCounts, max_flip_rate: f64, findings: &mut Findings) {
    if checks.not_checked > 0 {
        let sentence = format!(
            "not checked: {} of {} that {} chosen for the validity checks, because a check took too long, or its process failed (a \
             campaign that is resumed and repeats errors runs them again)",
            checks.not_checked,
            counted(checks.not_checked + checks.runs, "run"),
            was(checks.not_checked + checks.runs)
        );
        // The checks of the other arms and scenarios say nothing of these.
        match &without_check(summary)[..] {
            [] => findings.note(sentence),
            runs => findings.add(Decision::Inconclusive, format!("{sentence}: most of {}", runs.join(", "))),
        }
    }
    for (check, count) in checks.broken() {
        let first = first_refuted(summary, check);
        findings.add(Decision::Invalid, format!("{}: {} of {} checked{first}", check.finding(), count, checks.runs));
    }
    let allowed = allowed_flips(max_flip_rate, checks.runs);
    if max_flip_rate > MAX_FLIP_RATE && checks.runs > 0 && allowed >= checks.runs {
        let limit = format!("{} of {} checked verdicts may flip at half the time step", allowed, checks.runs);
        findings.add(Decision::Inconclusive, format!("{limit}, {HOLDS_ALWAYS}"));
    }
    if checks.flips == 0 {
        return;
    }
    let sentence = format!(
        "{} of {} checked verdicts flipped at half the time step, {allowed} allowed ({} of them, rounded up)",
        checks.flips,
        checks.runs,
        percent(max_flip_rate)
    );
    if checks.flips > allowed { findings.add(Decision::Invalid, sentence) } else { findings.note(sentence) }
}

/// Returns the scenarios and arms in which most runs that were chosen for the validity checks have no
/// result, in words.
fn without_check(summary: &Summary) -> Vec<String> {
    let arms = |(name, counts): &(String, Counts)| -> Vec<String> {
        let arms = counts.arms.iter().zip(&summary.controllers);
        let unchecked = arms.filter(|(counts, _)| counts.not_checked > counts.checked);
        unchecked.map(|(_, controller)| format!("{name} with {controller}")).collect()
    };
    summary.scenarios.iter().flat_map(arms).collect()
}

/// Returns which run a check refutes first, and its likely cause.
fn first_refuted(summary: &Summary, check: Invariance) -> String {
    let mut runs = summary.scenarios.iter().filter_map(|(name, counts)| Some((name, counts.checks.first(check)?)));
    let Some((name, RunOfScenario { sample, arm })) = runs.next() else { return String::new() };
    let controller = summary.controllers.get(arm).map_or("", String::as_str);
    let cause = summary.foreign_controller(arm).filter(|_| check.is_of_repeatability()).map_or_else(String::new, |foreign| {
        format!(
            "; the likely cause is {foreign}, which is not built in: a controller gives the same answers to the same \
             inputs, without random numbers, a clock, its process number, or state of another run"
        )
    });
    format!(", first in sample {sample} of {name} with {controller}{cause}")
}

fn judge_expectations(judge: &Judge, findings: &mut Findings) -> Vec<ExpectationResult> {
    let expectations = judge.expectations();
    for expectation in &expectations {
        if expectation.is_met() {
            findings.background(format!("happened as expected: {expectation}"));
        } else if expectation.samples > 0 {
            findings.add(Decision::Invalid, format!("what the scenario is about did not happen: {expectation}"));
        }
    }
    expectations
}

/// Returns the scenarios in which the ego slows down without a vehicle behind, or in which the runs
/// that show it have no result.
fn judge_attribution<'a>(summary: &'a Summary, findings: &mut Findings) -> Vec<(&'a str, Standing)> {
    let mut attributed = Vec::new();
    for (name, Counts { attribution, .. }) in &summary.scenarios {
        let of_scenario = |sentence: String| format!("{name} ({}): {sentence}", attribution::REQUIREMENT);
        if attribution.is_missed() {
            findings.add(Decision::Fail, of_scenario(attribution.sentence()));
            attributed.push((name.as_str(), Standing::Fail));
        } else if attribution.slowed > 0 {
            findings.background(of_scenario(attribution.sentence()));
        }
        if attribution.is_undecided() {
            findings.add(Decision::Inconclusive, of_scenario(attribution.not_checked_sentence()));
            attributed.push((name.as_str(), Standing::Inconclusive));
        } else if attribution.not_checked > 0 {
            findings.background(of_scenario(attribution.not_checked_sentence()));
        }
    }
    attributed
}

/// Says which parameters are sampled beyond what trajectory data show: the verdict is then one on
/// assumptions.
fn judge_extrapolation(judge: &Judge, findings: &mut Findings) {
    for (name, parameters) in judge.extrapolations() {
        findings.background(format!("{name}: extrapolates beyond recorded traffic: {}", parameters.join("; ")));
    }
}

/// States in how many samples the system under test was not available for some time. If their share
/// exceeds [`MAX_UNAVAILABLE_SHARE`], the samples do not decide about the system, even if it
/// engages before its sensors fail.
fn judge_availability(summary: &Summary, findings: &mut Findings) {
    let arms = summary.scenarios.iter().filter_map(|(name, counts)| Some((name.as_str(), counts.arms.last()?)));
    let (often, seldom): (Vec<_>, Vec<_>) = arms
        .filter(|(_, tested)| tested.unavailable > 0)
        .partition(|(_, tested)| tested.unavailable as f64 > MAX_UNAVAILABLE_SHARE * tested.outcomes as f64);
    let count = |tested: &ArmCounts| format!("{} of {}", tested.unavailable, samples(tested.outcomes));
    for (name, tested) in seldom {
        findings.background(format!("{name}: {NOT_AVAILABLE} in {}", count(tested)));
    }
    let most = percent(MAX_UNAVAILABLE_SHARE);
    match often[..] {
        [] => {}
        [(name, tested)] => findings.add(
            Decision::NotJudged,
            format!(
                "{name}: {NOT_AVAILABLE} in {}, more than {most}, and they do not decide what it does (it engaged in {})",
                count(tested),
                samples(tested.engagements)
            ),
        ),
        _ => {
            let told = |(name, tested): &(&str, &ArmCounts)| {
                format!("{name} (in {}; it engaged in {})", count(tested), tested.engagements)
            };
            let list: Vec<String> = often.iter().map(told).collect();
            let reason = format!(
                "in {} scenarios {NOT_AVAILABLE} in more than {most} of the samples, and they do not decide what it does: {}",
                often.len(),
                list.join(", ")
            );
            findings.add(Decision::NotJudged, reason);
        }
    }
}

/// The remark on a system whose sensors had failed.
const NOT_AVAILABLE: &str = "the system under test was not available, because sensors had failed,";

/// A system that never acted was not tested by a scenario that asks for action.
fn judge_action(judge: &Judge, findings: &mut Findings) {
    for (name, missing) in judge.without_action() {
        let reason = format!("{name}: the system under test {missing}, and they do not decide what it does");
        findings.add(Decision::NotJudged, reason);
    }
}

/// Judges whether there are samples at all.
fn judge_samples(summary: &Summary, judge: &Judge, findings: &mut Findings) {
    let outcomes = |tested: Option<u64>| tested.unwrap_or_default();
    if outcomes(summary.total().arms.last().map(|tested| tested.outcomes)) == 0 {
        findings.add(Decision::Inconclusive, "no sample has an outcome".to_owned());
        return;
    }
    judge_availability(summary, findings);
    for (name, counts) in &summary.scenarios {
        if counts.samples == 0 {
            findings.add(Decision::Inconclusive, format!("{name}: no sample was run"));
        }
        let repeated = judge.repeated(name);
        if repeated > 0 {
            findings.background(format!(
                "{name}: {} have the parameters or the outcome of an earlier one and do not count",
                samples(repeated)
            ));
        }
    }
}

fn judge_probabilities(summary: &Summary, judge: &Judge, findings: &mut Findings) -> Vec<(String, Finding)> {
    let specs: Vec<_> = judge.probabilities().collect();
    let mut probabilities = Vec::new();
    for (name, spec) in &specs {
        let Some(counts) = summary.tested(name) else { continue };
        if !judge.is_varied(name) {
            let sentence = format!("{name}: no parameter varies enough, so that no probability can be bounded");
            findings.add(Decision::Inconclusive, sentence);
            continue;
        }
        let finding = spec.gate.judge(counts, specs.len(), summary.inference);
        let line = finding.line(name, counts, &spec.source);
        match finding.answer {
            Answer::Below => findings.background(line),
            Answer::Above => findings.add(Decision::Fail, line),
            Answer::Open => findings.add(Decision::Inconclusive, line),
        }
        probabilities.push(((*name).to_owned(), finding));
    }
    probabilities
}

/// A reason, or a remark that decides nothing.
struct Reason {
    /// What it decides.
    decision: Option<Decision>,
    text: String,
}

/// Reasons and what they decide, as they are found.
#[derive(Default)]
struct Findings {
    reasons: Vec<Reason>,
    /// The texts of the remarks on one scenario each.
    background: Vec<String>,
}

impl Findings {
    fn note(&mut self, remark: String) {
        self.reasons.push(Reason { decision: None, text: remark });
    }

    /// Notes a remark on one scenario, which a report may fold.
    fn background(&mut self, remark: String) {
        self.background.push(remark.clone());
        self.note(remark);
    }

    fn add(&mut self, decision: Decision, reason: String) {
        self.reasons.push(Reason { decision: Some(decision), text: reason });
    }

    fn decisions(&self) -> Vec<Decision> {
        self.reasons.iter().filter_map(|reason| reason.decision).collect()
    }

    /// Returns the reasons in words. The reasons that led to the decision come first: the first
    /// that is no gate is the sentence of the verdict.
    fn into_reasons(self, decided: Decision) -> Vec<String> {
        let decides = |reason: &Reason| reason.decision == Some(decided);
        let (decisive, others): (Vec<Reason>, Vec<Reason>) = self.reasons.into_iter().partition(decides);
        decisive.into_iter().chain(others).map(|reason| reason.text).collect()
    }
}

/// Returns how many of `checked` verdicts may flip: the share, rounded up to whole ones.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of a count of samples")]
fn allowed_flips(max_flip_rate: f64, checked: u64) -> u64 {
    (max_flip_rate * checked as f64).ceil() as u64
}

fn samples(count: u64) -> String {
    counted(count, "sample")
}

#[cfg(test)]
mod tests;
