//! Whether a campaign passes its gates.

use std::fmt;

use serde::Serialize;

use super::ledger::{ArmCounts, Inference, Pairs};
use super::probability::{Answer, Finding, ProbabilityGate, percent};
use super::validity::CheckCounts;

/// Share of the checked verdicts that may flip at half the time step, where nobody says otherwise.
pub const MAX_FLIP_RATE: f64 = 0.05;

/// What a campaign is judged by. Gates count samples in which E collided, in the arm under test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gates {
    /// Most samples with a collision of E.
    pub max_collisions: Option<u64>,
    /// Most probable a collision of E may be, in each scenario.
    pub probability: Option<ProbabilityGate>,
    /// Most samples in which E collides only with the system under test.
    pub max_induced: Option<u64>,
    /// Largest share of the samples in which the system may engage, in each scenario.
    pub max_engagement_rate: Option<f64>,
    /// Most by which E may fall below the speed of the vehicle ahead, in any sample [m/s].
    pub max_speed_deficit_mps: Option<f64>,
    /// Largest jerk of E in any sample [m/s³].
    pub max_jerk_mps3: Option<f64>,
    /// Share of the checked verdicts that may flip at half the time step, rounded up to whole samples.
    pub max_flip_rate: f64,
}

impl Default for Gates {
    fn default() -> Self {
        Self {
            max_collisions: None,
            probability: None,
            max_induced: None,
            max_engagement_rate: None,
            max_speed_deficit_mps: None,
            max_jerk_mps3: None,
            max_flip_rate: MAX_FLIP_RATE,
        }
    }
}

/// The answer of a campaign.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "UPPERCASE")]
pub enum Verdict {
    /// Every gate is met.
    Pass,
    /// Some gate is not met.
    Fail,
    /// Too few samples to say.
    Inconclusive,
    /// The campaign cannot be believed.
    Invalid,
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Pass => "PASS",
            Self::Fail => "FAIL",
            Self::Inconclusive => "INCONCLUSIVE",
            Self::Invalid => "INVALID",
        })
    }
}

/// The finding that decides a judgement. If several hold, the first of [`Decision::PRECEDENCE`] decides.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Decision {
    /// Every gate is met.
    Pass,
    /// Some gate is not met.
    Fail,
    /// There are too few samples to say.
    Inconclusive,
    /// Some sample ended in an error.
    SampleError,
    /// A validity check of the simulator failed.
    Invalid,
}

impl Decision {
    /// The findings in the order in which they decide.
    pub const PRECEDENCE: [Self; 4] = [Self::SampleError, Self::Invalid, Self::Fail, Self::Inconclusive];

    fn first_of(found: &[Self]) -> Self {
        Self::PRECEDENCE.into_iter().find(|decision| found.contains(decision)).unwrap_or(Self::Pass)
    }
}

/// A verdict with its reasons.
#[derive(Clone, Debug, PartialEq)]
pub struct Judgement {
    /// The answer.
    pub verdict: Verdict,
    /// Every reason for it, in sentences.
    pub reasons: Vec<String>,
    /// The finding that decides, which the exit code follows.
    pub decision: Decision,
    /// What the samples of each scenario say about its probability, where that was asked.
    pub probabilities: Vec<(String, Finding)>,
}

/// What is judged.
#[derive(Clone, Copy, Debug)]
pub struct Evidence<'a> {
    /// The arm under test, over all scenarios.
    pub tested: &'a ArmCounts,
    /// The arm under test in each scenario, by name.
    pub scenarios: &'a [(&'a str, &'a ArmCounts)],
    /// Errors in any arm.
    pub errors: u64,
    /// What the validity checks found.
    pub checks: &'a CheckCounts,
    /// Pairs with the baseline, where there is one.
    pub pairs: Option<&'a Pairs>,
    /// What the number of samples came from.
    pub inference: Inference,
}

impl Gates {
    /// Judges a campaign.
    pub fn judge(&self, evidence: &Evidence<'_>) -> Judgement {
        let mut found = Found::default();
        if evidence.errors > 0 {
            found.add(Decision::SampleError, format!("{} ended in an error", samples(evidence.errors)));
        }
        self.judge_validity(evidence.checks, &mut found);
        if evidence.tested.outcomes == 0 {
            found.add(Decision::Inconclusive, "no sample has an outcome".to_owned());
        }
        let probabilities = self.judge_probability(evidence, &mut found);
        self.judge_counts(evidence, &mut found);
        self.judge_comfort(evidence, &mut found);
        if (Self { max_flip_rate: MAX_FLIP_RATE, ..*self }) == Self::default() {
            found.note("no gate was set: nothing was judged but that every sample has an outcome".to_owned());
        }
        let decision = Decision::first_of(&found.decisions);
        Judgement { verdict: verdict(decision, &found.decisions), reasons: found.reasons, decision, probabilities }
    }

    fn judge_validity(&self, checks: &CheckCounts, found: &mut Found) {
        for (check, count) in checks.broken() {
            found.add(Decision::Invalid, format!("{}: {} of {} checked", check.finding(), count, checks.runs));
        }
        if checks.flips == 0 {
            return;
        }
        let allowed = allowed_flips(self.max_flip_rate, checks.runs);
        let sentence = format!(
            "{} of {} checked verdicts flipped at half the time step, {allowed} allowed ({} of them, rounded up)",
            checks.flips,
            checks.runs,
            percent(self.max_flip_rate)
        );
        if checks.flips > allowed { found.add(Decision::Invalid, sentence) } else { found.note(sentence) }
    }

    fn judge_probability(&self, evidence: &Evidence<'_>, found: &mut Found) -> Vec<(String, Finding)> {
        let Some(gate) = &self.probability else { return Vec::new() };
        let count = evidence.scenarios.len();
        let judge = |&(name, counts): &(&str, &ArmCounts)| {
            let finding = gate.judge(counts, count, evidence.inference);
            let sentence = format!("{name}: {}", finding.sentence(counts));
            match finding.answer {
                Answer::Below => found.note(sentence),
                Answer::Above => found.add(Decision::Fail, sentence),
                Answer::Open => found.add(Decision::Inconclusive, sentence),
            }
            (name.to_owned(), finding)
        };
        evidence.scenarios.iter().map(judge).collect()
    }

    fn judge_counts(&self, evidence: &Evidence<'_>, found: &mut Found) {
        let collisions = evidence.tested.collisions;
        if let Some(allowed) = self.max_collisions {
            let sentence = format!("E collided in {}, {allowed} allowed", samples(collisions));
            found.judge(collisions <= allowed, sentence);
        }
        match (self.max_induced, evidence.pairs) {
            (Some(allowed), Some(pairs)) => {
                let sentence = format!("{} induced, {allowed} allowed", collisions_of(pairs.induced));
                found.judge(pairs.induced <= allowed, sentence);
            }
            (Some(_), None) => {
                let sentence = "induced collisions are known only of paired samples".to_owned();
                found.add(Decision::Inconclusive, sentence);
            }
            (None, _) => {}
        }
    }

    fn judge_comfort(&self, evidence: &Evidence<'_>, found: &mut Found) {
        if let Some(allowed) = self.max_engagement_rate {
            for (name, counts) in evidence.scenarios {
                let Some(rate) = counts.engagement_rate() else { continue };
                let (engaged, outcomes) = (counts.engagements, counts.outcomes);
                let (rate_percent, allowed_percent) = (percent(rate), percent(allowed));
                let sentence = format!(
                    "{name}: the system engaged in {engaged} of {outcomes} samples ({rate_percent}), {allowed_percent} allowed"
                );
                found.judge(rate <= allowed, sentence);
            }
        }
        if let Some(allowed_mps) = self.max_speed_deficit_mps {
            let most_mps = evidence.tested.max_speed_deficit_mps;
            let sentence =
                format!("E was up to {most_mps:.1} m/s slower than the vehicle ahead, {allowed_mps} m/s allowed");
            found.judge(most_mps <= allowed_mps, sentence);
        }
        if let Some(allowed_mps3) = self.max_jerk_mps3 {
            let most_mps3 = evidence.tested.max_jerk_mps3;
            let sentence = format!("E's jerk reached {most_mps3:.1} m/s³, {allowed_mps3} m/s³ allowed");
            found.judge(most_mps3 <= allowed_mps3, sentence);
        }
    }
}

/// Reasons and what they decide, as they are found.
#[derive(Default)]
struct Found {
    reasons: Vec<String>,
    decisions: Vec<Decision>,
}

impl Found {
    fn note(&mut self, reason: String) {
        self.reasons.push(reason);
    }

    fn add(&mut self, decision: Decision, reason: String) {
        self.decisions.push(decision);
        self.reasons.push(reason);
    }

    /// Notes the reason either way. A comparison with something that is not a number is false, and so fails.
    fn judge(&mut self, is_met: bool, reason: String) {
        if is_met { self.note(reason) } else { self.add(Decision::Fail, reason) }
    }
}

/// The verdict that goes with a decision, if all of `found` hold.
fn verdict(decision: Decision, found: &[Decision]) -> Verdict {
    match decision {
        Decision::Pass => Verdict::Pass,
        Decision::Fail => Verdict::Fail,
        Decision::Inconclusive => Verdict::Inconclusive,
        Decision::Invalid => Verdict::Invalid,
        // An error of a sample leaves open what that sample would have ended in.
        Decision::SampleError if found.contains(&Decision::Invalid) => Verdict::Invalid,
        Decision::SampleError if found.contains(&Decision::Fail) => Verdict::Fail,
        Decision::SampleError => Verdict::Inconclusive,
    }
}

/// How many of `checked` verdicts may flip: the share, rounded up to whole ones.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of a count of samples")]
fn allowed_flips(max_flip_rate: f64, checked: u64) -> u64 {
    (max_flip_rate * checked as f64).ceil() as u64
}

fn samples(count: u64) -> String {
    if count == 1 { "1 sample".to_owned() } else { format!("{count} samples") }
}

fn collisions_of(count: u64) -> String {
    if count == 1 { "1 collision".to_owned() } else { format!("{count} collisions") }
}

#[cfg(test)]
mod tests {
    use super::super::validity::Invariance;
    use super::*;

    /// Judges 100 samples of one scenario.
    fn judge(gates: Gates, tested: ArmCounts, errors: u64, checks: &CheckCounts) -> Judgement {
        let tested = ArmCounts { outcomes: 100, ..tested };
        let scenarios = [("low", &tested)];
        let inference = Inference::FixedSamples;
        gates.judge(&Evidence { tested: &tested, scenarios: &scenarios, errors, checks, pairs: None, inference })
    }

    fn collided(gates: Gates, collisions: u64, errors: u64) -> Judgement {
        judge(gates, ArmCounts { collisions, ..ArmCounts::default() }, errors, &CheckCounts::default())
    }

    const THREE: Gates = Gates {
        max_collisions: Some(3),
        probability: None,
        max_induced: None,
        max_engagement_rate: None,
        max_speed_deficit_mps: None,
        max_jerk_mps3: None,
        max_flip_rate: MAX_FLIP_RATE,
    };

    #[test]
    fn the_gate_counts_samples_with_a_collision() {
        assert_eq!(collided(THREE, 3, 0).decision, Decision::Pass);
        assert_eq!(collided(THREE, 4, 0).decision, Decision::Fail);
    }

    #[test]
    fn an_error_is_graver_than_a_collision_and_never_passes() {
        let errors = collided(THREE, 0, 1);
        assert_eq!((errors.decision, errors.verdict), (Decision::SampleError, Verdict::Inconclusive));
        let both = collided(THREE, 4, 1);
        assert_eq!((both.decision, both.verdict), (Decision::SampleError, Verdict::Fail));
    }

    #[test]
    fn a_campaign_without_outcomes_does_not_pass() {
        let tested = ArmCounts::default();
        let judged = Gates::default().judge(&Evidence {
            tested: &tested,
            scenarios: &[],
            errors: 0,
            checks: &CheckCounts::default(),
            pairs: None,
            inference: Inference::FixedSamples,
        });
        assert_eq!(judged.decision, Decision::Inconclusive);
    }

    #[test]
    fn the_probability_gate_passes_fails_or_asks_for_more() {
        let gates = |max| Gates { probability: ProbabilityGate::new(max, 0.95).ok(), ..Gates::default() };
        assert_eq!(collided(gates(0.03), 0, 0).decision, Decision::Pass);
        assert_eq!(collided(gates(0.03), 8, 0).decision, Decision::Fail);
        let open = collided(gates(0.01), 0, 0);
        assert_eq!((open.decision, open.verdict), (Decision::Inconclusive, Verdict::Inconclusive));
        assert!(open.reasons[0].contains("199 more samples"), "{:?}", open.reasons);
        // A count that fails is graver than a bound that is still open.
        let failed = collided(Gates { max_collisions: Some(0), ..gates(0.05) }, 2, 0);
        assert_eq!((failed.decision, failed.verdict), (Decision::Fail, Verdict::Fail));
    }

    #[test]
    fn comfort_and_engagements_are_judged_and_what_is_not_a_number_fails() {
        let gates = Gates { max_jerk_mps3: Some(10.0), max_engagement_rate: Some(0.05), ..Gates::default() };
        let with = |max_jerk_mps3, engagements| {
            let tested = ArmCounts { max_jerk_mps3, engagements, ..ArmCounts::default() };
            judge(gates, tested, 0, &CheckCounts::default()).decision
        };
        assert_eq!(with(10.0, 5), Decision::Pass);
        assert_eq!(with(10.1, 5), Decision::Fail);
        assert_eq!(with(10.0, 6), Decision::Fail);
        assert_eq!(with(f64::NAN, 0), Decision::Fail);
    }

    #[test]
    fn flips_are_bounded_and_a_broken_check_is_invalid() {
        let flipped = |flips| {
            let checks = CheckCounts { runs: 40, flips, ..CheckCounts::default() };
            judge(Gates::default(), ArmCounts::default(), 0, &checks)
        };
        assert_eq!(flipped(2).decision, Decision::Pass, "5 % of 40");
        assert_eq!((flipped(3).decision, flipped(3).verdict), (Decision::Invalid, Verdict::Invalid));
        let mut checks = CheckCounts { runs: 40, ..CheckCounts::default() };
        checks.count(Invariance::ActorOrder);
        let broken = judge(THREE, ArmCounts { collisions: 9, ..ArmCounts::default() }, 0, &checks);
        assert_eq!((broken.decision, broken.verdict), (Decision::Invalid, Verdict::Invalid));
        assert!(broken.reasons[0].contains("order of the actors"), "{:?}", broken.reasons);
    }

    #[test]
    fn no_flip_at_all_can_be_asked_for() {
        let gates = Gates { max_flip_rate: 0.0, ..Gates::default() };
        let checks = CheckCounts { runs: 5, flips: 1, ..CheckCounts::default() };
        assert_eq!(judge(gates, ArmCounts::default(), 0, &checks).decision, Decision::Invalid);
    }
}
