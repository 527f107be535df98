//! Verdicts of synthetic campaigns.

use super::*;
use crate::ledger::Tally;

/// Returns what 10 samples decide. In some of them the system under test is not available, and
/// engages.
fn availability(unavailable: u64, engaged: u64) -> Findings {
    let mut summary = Summary::new(vec!["acc+mis".to_owned()], ["close".to_owned()]);
    for sample in 0..10 {
        let (unavailable, engaged) = (sample < unavailable, sample < engaged);
        let tally = Tally { collided: Some(false), unavailable, engaged, ..Tally::default() };
        summary.scenarios[0].1.arms[0].push(tally);
    }
    let mut findings = Findings::default();
    judge_availability(&summary, &mut findings);
    findings
}

#[test]
fn a_system_that_is_not_available_in_most_samples_is_not_tested_whether_it_engages_or_not() {
    for engaged in [0, 1, 10] {
        let findings = availability(6, engaged);
        assert_eq!(findings.decisions, [Decision::NotJudged], "{engaged} engagements");
        assert!(findings.reasons[0].contains("in 6 of 10 samples, more than 50 %"), "{}", findings.reasons[0]);
    }
    let half = availability(5, 0);
    assert!(half.decisions.is_empty() && half.reasons[0].contains("in 5 of 10 samples"), "{:?}", half.reasons);
    assert!(availability(0, 0).reasons.is_empty());
}

#[test]
fn a_gate_that_fails_decides_before_a_system_that_is_not_available() {
    assert_eq!(Decision::first_of(&[Decision::NotJudged, Decision::Fail]), Some(Decision::Fail));
    assert_eq!(Decision::first_of(&[Decision::Overridden, Decision::Fail]), Some(Decision::Fail));
    assert_eq!(Decision::first_of(&[Decision::Overridden]), Some(Decision::Overridden));
}
