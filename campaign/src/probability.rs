//! The gate on the probability of a collision: it is low enough, too high, or undecided, each with
//! a confidence.
//!
//! ```text
//!     lower bound       upper bound
//!   ──────┼───────────────────┼──────────▶ probability
//!    allowed below: FAIL      allowed above: PASS      allowed in between: INCONCLUSIVE
//! ```
//!
//! Each scenario is judged alone: a mixture would hide one bad scenario behind many good ones. The
//! probability that all scenarios pass wrongly is no larger than for one of them
//! (intersection–union test: R. L. Berger, *Multiparameter hypothesis testing and acceptance
//! sampling*, Technometrics 24 (1982) 295–300). Passing therefore needs no correction for the
//! number of scenarios. The probability that some scenario *fails* wrongly grows with their number,
//! so the error of failing is divided by it (Bonferroni).

use serde::Serialize;

use super::gate::{GateSource, OpenReason, Standing, undecided};
use super::ledger::{ArmCounts, Inference};
use closecall_scenarios::criteria::GateConfig;
use closecall_traffic::statistics::binomial::at_most;
pub use closecall_traffic::statistics::format::percent;
use closecall_traffic::statistics::needed;
use closecall_traffic::statistics::sequence::{evidence_above, evidence_below, is_certain};

/// The largest collision probability that is allowed, and the confidence in the answer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProbabilityGate {
    max: f64,
    confidence: f64,
}

/// Limits that no gate can have.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum GateError {
    /// The probability is not between 0 and 1.
    #[error("{value} is not a probability that can be shown: a number above 0 and below 1 is needed")]
    Probability {
        /// The given value.
        value: f64,
    },
    /// The confidence is not between ½ and 1.
    #[error("{value} is not a confidence: a number above 0.5 and below 1 is needed")]
    Confidence {
        /// The given value.
        value: f64,
    },
}

impl ProbabilityGate {
    /// Default confidence (-).
    pub const CONFIDENCE: f64 = GateConfig::CONFIDENCE;

    /// Returns a gate with the largest probability `max`, between 0 and 1, and a confidence between
    /// ½ and 1.
    ///
    /// # Errors
    /// [`GateError`] if one of them is out of range.
    pub fn new(max: f64, confidence: f64) -> Result<Self, GateError> {
        if !(max > 0.0 && max < 1.0) {
            return Err(GateError::Probability { value: max });
        }
        if !(confidence > 0.5 && confidence < 1.0) {
            return Err(GateError::Confidence { value: confidence });
        }
        Ok(Self { max, confidence })
    }

    /// Returns the largest probability that is allowed.
    pub fn max(&self) -> f64 {
        self.max
    }

    /// Returns the confidence.
    pub fn confidence(&self) -> f64 {
        self.confidence
    }

    /// Judges the counts of one of `scenarios` scenarios.
    pub fn judge(&self, counts: &ArmCounts, scenarios: usize, inference: Inference) -> Finding {
        let (hits, samples) = (counts.collisions, counts.outcomes);
        let upper_bound = inference.upper_bound(hits, samples, self.confidence);
        let lower_bound = inference.lower_bound(hits, samples, self.confidence_to_fail(scenarios));
        let (max, confidence) = (self.max, self.confidence);
        let (Some(upper_bound), Some(lower_bound)) = (upper_bound, lower_bound) else {
            return Finding {
                answer: Answer::Open,
                max,
                confidence,
                lower_bound: 0.0,
                upper_bound: 1.0,
                missing: None,
            };
        };
        let answer = if upper_bound <= max {
            Answer::Below
        } else if lower_bound >= max {
            Answer::Above
        } else {
            Answer::Open
        };
        let missing = (answer == Answer::Open).then(|| self.missing(hits, samples, inference));
        Finding { answer, max, confidence, lower_bound, upper_bound, missing }
    }

    /// Returns true if the samples so far decide the gate for one of `scenarios` scenarios. Answers
    /// as [`Self::judge`] does with confidence sequences, without the bounds.
    pub fn is_settled(&self, counts: &ArmCounts, scenarios: usize) -> bool {
        let (hits, samples) = (counts.collisions, counts.outcomes);
        is_certain(evidence_below(hits, samples, self.max), self.confidence)
            || is_certain(evidence_above(hits, samples, self.max), self.confidence_to_fail(scenarios))
    }

    /// Returns the confidence with which one of `scenarios` scenarios has to fail, so that all
    /// together fail wrongly no more often than allowed.
    fn confidence_to_fail(&self, scenarios: usize) -> f64 {
        1.0 - (1.0 - self.confidence) / scenarios.max(1) as f64
    }

    /// Returns how many more samples the upper bound needs.
    fn missing(&self, hits: u64, samples: u64, inference: Inference) -> Missing {
        // Whether the upper bound is low enough, without computing the bound.
        let passes = |hits, samples| match inference {
            Inference::FixedSamples => at_most(hits, samples, self.max) <= 1.0 - self.confidence,
            Inference::Sequential => is_certain(evidence_below(hits, samples, self.max), self.confidence),
            Inference::Design => false,
        };
        let more = |total: Option<u64>| total.map(|total| total.saturating_sub(samples));
        // No number of samples is enough if the rate is not below the allowed probability.
        let is_low = hits as f64 / (samples as f64) < self.max || samples == 0;
        let at_rate = is_low.then(|| needed::samples_at_rate(hits, samples, passes)).flatten();
        Missing { without_collisions: more(needed::min_samples(hits, passes)), at_observed_rate: more(at_rate) }
    }
}

/// The statement of the samples about the probability.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Answer {
    /// The probability is at most the allowed one.
    Below,
    /// The probability is at least the allowed one.
    Above,
    /// The samples do not decide.
    Open,
}

/// The answer with its bounds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Finding {
    /// The statement of the samples.
    pub answer: Answer,
    /// The largest probability that is allowed.
    pub max: f64,
    /// The confidence.
    pub confidence: f64,
    /// One-sided lower bound of the probability.
    pub lower_bound: f64,
    /// One-sided upper bound of the probability.
    pub upper_bound: f64,
    /// How many more samples are needed if the samples do not decide; `None` also if no number of
    /// samples of this design decides.
    pub missing: Option<Missing>,
}

/// Numbers of further samples; `None` if more than a hundred million would be needed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Missing {
    /// The number if none of them ends in a collision: the smallest possible.
    pub without_collisions: Option<u64>,
    /// The number if collisions go on at the observed rate; `None` also if the bound is then never
    /// met.
    pub at_observed_rate: Option<u64>,
}

impl Finding {
    /// Returns how the gate fares, in the terms of every gate.
    pub const fn standing(&self) -> Standing {
        match self.answer {
            Answer::Below => Standing::Pass,
            Answer::Above => Standing::Fail,
            Answer::Open => Standing::Inconclusive,
        }
    }

    /// Returns the bounds that decide, or both if none decides, with the confidence: `one-sided
    /// upper 95 % bound 0.994 %`.
    pub fn bounds(&self) -> String {
        let confidence = percent(self.confidence);
        let [low, high] = [self.lower_bound, self.upper_bound].map(percent);
        match self.answer {
            Answer::Below => format!("one-sided upper {confidence} bound {high}"),
            Answer::Above => format!("one-sided lower {confidence} bound {low}"),
            Answer::Open => format!("one-sided {confidence} bounds {low} and {high}"),
        }
    }

    /// Returns the finding about a scenario in a line with the words of every gate: standing,
    /// scenario, the value and the required one, and the criterion with its origin.
    pub fn line(&self, scenario: &str, counts: &ArmCounts, source: &GateSource) -> String {
        let (standing, words) = (self.standing().word(), self.words(counts));
        format!("{standing}: {scenario}: {words} [{}; from {source}]", self.criterion())
    }

    /// Returns the criterion, as the command line has it.
    pub fn criterion(&self) -> String {
        format!("max-probability {}", self.max)
    }

    /// Returns the value and the required one, in plain words.
    pub fn words(&self, counts: &ArmCounts) -> String {
        let (hits, samples) = (counts.collisions, counts.outcomes);
        let share = match samples {
            0 => String::new(),
            samples => format!(" ({})", percent(hits as f64 / samples as f64)),
        };
        let is_above = hits as f64 > self.max * samples as f64;
        let missing = match self.missing {
            None => OpenReason::DependentSamples.text().to_owned(),
            Some(_) if is_above => format!("{}, and more like these would miss it", OpenReason::TooFewSamples.text()),
            Some(missing) => undecided(OpenReason::TooFewSamples, missing.total(samples)),
        };
        let open = if self.answer == Answer::Open { format!(" ({missing})") } else { String::new() };
        format!(
            "share of the samples in which the ego collides: {hits} of {samples}{share}, {}{open}; required: at most {}",
            self.bounds(),
            percent(self.max)
        )
    }
}

impl Missing {
    /// Returns the number of samples that decides if collisions go on at the observed rate.
    fn total(self, samples: u64) -> Option<u64> {
        self.at_observed_rate.map(|more| samples.saturating_add(more))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn judge(max: f64, collisions: u64, outcomes: u64, inference: Inference) -> Finding {
        let counts = ArmCounts { outcomes, collisions, ..ArmCounts::default() };
        ProbabilityGate::new(max, 0.95).unwrap().judge(&counts, 1, inference)
    }

    #[test]
    fn the_three_answers() {
        assert_eq!(judge(0.01, 0, 299, Inference::FixedSamples).answer, Answer::Below);
        assert_eq!(judge(0.01, 9, 300, Inference::FixedSamples).answer, Answer::Above);
        let open = judge(0.01, 0, 200, Inference::FixedSamples);
        assert_eq!(open.answer, Answer::Open);
        assert_eq!(open.missing, Some(Missing { without_collisions: Some(99), at_observed_rate: Some(99) }));
        assert_eq!(judge(0.01, 0, 0, Inference::FixedSamples).answer, Answer::Open, "nothing says nothing");
        let of_design = judge(0.01, 0, 100_000, Inference::Design);
        assert_eq!(
            (of_design.answer, of_design.missing),
            (Answer::Open, None),
            "points of a design show no probability"
        );
    }

    #[test]
    fn looking_on_the_way_costs_samples() {
        assert_eq!(judge(0.01, 0, 299, Inference::Sequential).answer, Answer::Open);
        let missing = judge(0.01, 0, 299, Inference::Sequential).missing.unwrap();
        let total = 299 + missing.without_collisions.unwrap();
        assert_eq!(judge(0.01, 0, total, Inference::Sequential).answer, Answer::Below);
        assert_eq!(judge(0.01, 0, total - 1, Inference::Sequential).answer, Answer::Open);
    }

    #[test]
    fn a_scenario_ends_exactly_where_its_bounds_answer() {
        let gate = ProbabilityGate::new(0.2, 0.95).unwrap();
        for collisions in 0..60 {
            for outcomes in collisions.max(1)..60 {
                let counts = ArmCounts { outcomes, collisions, ..ArmCounts::default() };
                let upper_bound = Inference::Sequential.upper_bound(collisions, outcomes, 0.95).unwrap();
                let lower_bound =
                    Inference::Sequential.lower_bound(collisions, outcomes, gate.confidence_to_fail(3)).unwrap();
                let answers = upper_bound <= gate.max() || lower_bound >= gate.max();
                assert_eq!(gate.is_settled(&counts, 3), answers, "{collisions} of {outcomes}");
            }
        }
    }

    #[test]
    fn the_line_has_the_words_of_every_gate_and_says_what_is_missing() {
        let gate = ProbabilityGate::new(0.01, 0.95).unwrap();
        let line = |collisions, outcomes| {
            let counts = ArmCounts { outcomes, collisions, ..ArmCounts::default() };
            gate.judge(&counts, 1, Inference::FixedSamples).line("a", &counts, &GateSource::CommandLine)
        };
        let said = |standing: &str, measured: &str| {
            format!(
                "{standing}: a: share of the samples in which the ego collides: {measured}; required: at most 1 % \
                 [max-probability 0.01; from command line]"
            )
        };
        assert_eq!(line(0, 300), said("met", "0 of 300 (0 %), one-sided upper 95 % bound 0.994 %"));
        assert_eq!(line(9, 300), said("NOT MET", "9 of 300 (3 %), one-sided lower 95 % bound 1.57 %"));
        for (collisions, measured, missing) in [
            (
                0,
                "0 of 200 (0 %), one-sided 95 % bounds 0 % and 1.49 %",
                "too few samples to decide, some 300 would if they are like these",
            ),
            (
                1,
                "1 of 200 (0.5 %), one-sided 95 % bounds 0.0256 % and 2.35 %",
                "too few samples to decide, some 1200 would if they are like these",
            ),
            (
                3,
                "3 of 200 (1.5 %), one-sided 95 % bounds 0.41 % and 3.83 %",
                "too few samples to decide, and more like these would miss it",
            ),
        ] {
            assert_eq!(line(collisions, 200), said("open", &format!("{measured} ({missing})")));
        }
    }

    #[test]
    fn nonsense_is_refused() {
        for max in [0.0, 1.0, -0.1, f64::NAN, f64::INFINITY] {
            assert!(matches!(ProbabilityGate::new(max, 0.95), Err(GateError::Probability { .. })), "{max}");
        }
        for confidence in [0.5, 1.0, 95.0, f64::NAN] {
            assert!(
                matches!(ProbabilityGate::new(0.01, confidence), Err(GateError::Confidence { .. })),
                "{confidence}"
            );
        }
    }

    #[test]
    fn more_scenarios_do_not_fail_by_chance() {
        let counts = ArmCounts { outcomes: 100, collisions: 4, ..ArmCounts::default() };
        let gate = ProbabilityGate::new(0.01, 0.95).unwrap();
        let alone = gate.judge(&counts, 1, Inference::FixedSamples);
        let of_twenty = gate.judge(&counts, 20, Inference::FixedSamples);
        assert!(of_twenty.lower_bound < alone.lower_bound);
        assert_eq!(of_twenty.upper_bound, alone.upper_bound);
    }
}
