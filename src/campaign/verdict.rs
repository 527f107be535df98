//! Whether a campaign passes its gates.

use std::fmt;

use serde::Serialize;

use super::ledger::{ArmCounts, Pairs};
use crate::exit_code::ExitCode;

/// What a campaign is judged by. Gates count samples in which E collided, in the arm under test.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Gates {
    /// Most samples with a collision of E.
    pub max_collisions: Option<u64>,
    /// Most samples in which E collides only with the system under test.
    pub max_induced: Option<u64>,
    /// Most by which E may fall below the speed of the vehicle ahead, in any sample [m/s].
    pub max_speed_deficit_mps: Option<f64>,
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

/// A verdict with its reasons.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Judgement {
    /// The answer.
    pub verdict: Verdict,
    /// Every reason for it, in sentences.
    pub reasons: Vec<String>,
    /// What the program ends with.
    pub exit_code: ExitCode,
}

/// What is judged.
#[derive(Clone, Copy, Debug)]
pub struct Evidence<'a> {
    /// The arm under test.
    pub tested: &'a ArmCounts,
    /// Errors in any arm.
    pub errors: u64,
    /// Samples whose repetition differed.
    pub invalid: u64,
    /// Pairs with the baseline, where there is one.
    pub pairs: Option<&'a Pairs>,
}

impl Gates {
    /// Judges a campaign.
    pub fn judge(&self, evidence: &Evidence<'_>) -> Judgement {
        let mut reasons = Vec::new();
        let mut codes = Vec::new();
        if evidence.errors > 0 {
            reasons.push(format!("{} ended in an error", samples(evidence.errors)));
            codes.push(ExitCode::SampleError);
        }
        if evidence.invalid > 0 {
            reasons.push(format!("{} gave another outcome when repeated", samples(evidence.invalid)));
            codes.push(ExitCode::Invalid);
        }
        if evidence.tested.outcomes == 0 {
            reasons.push("no sample has an outcome".to_owned());
            codes.push(ExitCode::Inconclusive);
        }
        self.judge_counts(evidence, &mut reasons, &mut codes);
        let verdict = match ExitCode::first_of(codes.iter().copied()) {
            ExitCode::Pass => Verdict::Pass,
            ExitCode::Fail => Verdict::Fail,
            ExitCode::Inconclusive => Verdict::Inconclusive,
            // An error of a sample leaves open what that sample would have ended in.
            _ if codes.contains(&ExitCode::Fail) => Verdict::Fail,
            ExitCode::SampleError => Verdict::Inconclusive,
            _ => Verdict::Invalid,
        };
        Judgement { verdict, reasons, exit_code: ExitCode::first_of(codes) }
    }

    fn judge_counts(&self, evidence: &Evidence<'_>, reasons: &mut Vec<String>, codes: &mut Vec<ExitCode>) {
        let collisions = evidence.tested.collisions;
        match self.max_collisions {
            Some(allowed) if collisions > allowed => {
                reasons.push(format!("E collided in {}, {allowed} allowed", samples(collisions)));
                codes.push(ExitCode::Fail);
            }
            Some(allowed) => reasons.push(format!("E collided in {}, {allowed} allowed", samples(collisions))),
            None => {}
        }
        match (self.max_induced, evidence.pairs) {
            (Some(allowed), Some(pairs)) => {
                reasons.push(format!("{} induced, {allowed} allowed", collisions_of(pairs.induced)));
                if pairs.induced > allowed {
                    codes.push(ExitCode::Fail);
                }
            }
            (Some(_), None) => {
                reasons.push("induced collisions are known only of paired samples".to_owned());
                codes.push(ExitCode::Inconclusive);
            }
            (None, _) => {}
        }
        if let Some(allowed_mps) = self.max_speed_deficit_mps {
            let most_mps = evidence.tested.max_speed_deficit_mps;
            reasons.push(format!(
                "E was up to {most_mps:.1} m/s slower than the vehicle ahead, {allowed_mps} m/s allowed"
            ));
            if !(most_mps <= allowed_mps) {
                codes.push(ExitCode::Fail);
            }
        }
        if *self == Self::default() {
            reasons.push("no gate was set: nothing was judged but that every sample has an outcome".to_owned());
        }
    }
}

fn samples(count: u64) -> String {
    if count == 1 { "1 sample".to_owned() } else { format!("{count} samples") }
}

fn collisions_of(count: u64) -> String {
    if count == 1 { "1 collision".to_owned() } else { format!("{count} collisions") }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn judge(gates: Gates, collisions: u64, errors: u64) -> Judgement {
        let tested = ArmCounts { outcomes: 100, collisions, ..ArmCounts::default() };
        gates.judge(&Evidence { tested: &tested, errors, invalid: 0, pairs: None })
    }

    #[test]
    fn the_gate_counts_samples_with_a_collision() {
        let gates = Gates { max_collisions: Some(3), max_induced: None, max_speed_deficit_mps: None };
        assert_eq!(judge(gates, 3, 0).exit_code, ExitCode::Pass);
        assert_eq!(judge(gates, 4, 0).exit_code, ExitCode::Fail);
    }

    #[test]
    fn an_error_is_graver_than_a_collision_and_never_passes() {
        let gates = Gates { max_collisions: Some(3), max_induced: None, max_speed_deficit_mps: None };
        let errors = judge(gates, 0, 1);
        assert_eq!((errors.exit_code, errors.verdict), (ExitCode::SampleError, Verdict::Inconclusive));
        let both = judge(gates, 4, 1);
        assert_eq!((both.exit_code, both.verdict), (ExitCode::SampleError, Verdict::Fail));
    }

    #[test]
    fn a_campaign_without_outcomes_does_not_pass() {
        let tested = ArmCounts::default();
        let judged = Gates::default().judge(&Evidence { tested: &tested, errors: 0, invalid: 0, pairs: None });
        assert_eq!(judged.exit_code, ExitCode::Inconclusive);
    }
}
