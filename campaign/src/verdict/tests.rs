//! Verdicts of synthetic campaigns.

use super::*;
use crate::ledger::Tally;

/// Returns what 10 samples decide. In some of them the system under test is not available, and
/// engages.
fn availability(unavailable: u64, engaged: u64) -> Findings {
    availability_in(&["close"], unavailable, engaged)
}

fn availability_in(scenarios: &[&str], unavailable: u64, engaged: u64) -> Findings {
    let mut summary = Summary::new(vec!["acc+mis".to_owned()], scenarios.iter().map(|&name| name.to_owned()));
    for (_, counts) in &mut summary.scenarios {
        for sample in 0..10 {
            let (unavailable, engaged) = (sample < unavailable, sample < engaged);
            let tally = Tally { collided: Some(false), unavailable, engaged, ..Tally::default() };
            counts.arms[0].push(tally);
        }
    }
    let mut findings = Findings::default();
    judge_availability(&summary, &mut findings);
    findings
}

#[test]
fn a_system_that_is_not_available_in_most_samples_is_not_tested_whether_it_engages_or_not() {
    for engaged in [0, 1, 10] {
        let findings = availability(6, engaged);
        assert_eq!(findings.decisions(), [Decision::NotJudged], "{engaged} engagements");
        let reason = &findings.reasons[0].text;
        assert!(reason.contains("in 6 of 10 samples, more than 50 %"), "{reason}");
    }
    let half = availability(5, 0);
    let reason = &half.reasons[0].text;
    assert!(half.decisions().is_empty() && reason.contains("in 5 of 10 samples"), "{reason}");
    assert!(availability(0, 0).reasons.is_empty());
}

/// Returns a paired campaign of one scenario whose counts are changed.
fn paired(change: impl FnOnce(&mut Counts)) -> Summary {
    let mut summary = Summary::new(vec!["acc".to_owned(), "own".to_owned()], ["close".to_owned()]);
    let (_, counts) = &mut summary.scenarios[0];
    counts.arms.iter_mut().for_each(|arm| arm.outcomes = 20);
    change(counts);
    summary
}

#[test]
fn checks_of_the_baseline_do_not_stand_for_checks_of_the_arm_under_test() {
    let judged = |checked: [u64; 2], not_checked: [u64; 2]| {
        let summary = paired(|counts| {
            for (arm, (checked, not_checked)) in counts.arms.iter_mut().zip(checked.into_iter().zip(not_checked)) {
                (arm.checked, arm.not_checked) = (checked, not_checked);
            }
            (counts.checks.runs, counts.checks.not_checked) = (checked.iter().sum(), not_checked.iter().sum());
        });
        let mut findings = Findings::default();
        judge_validity(&summary, &summary.total().checks, MAX_FLIP_RATE, &mut findings);
        findings
    };
    let unchecked = judged([2, 0], [0, 2]);
    assert_eq!(unchecked.decisions(), [Decision::Inconclusive]);
    assert!(unchecked.reasons[0].text.ends_with(": most of close with own"), "{}", unchecked.reasons[0].text);
    assert_eq!(judged([0, 0], [2, 2]).decisions(), [Decision::Inconclusive]);
    assert_eq!(judged([2, 1], [0, 2]).decisions(), [Decision::Inconclusive]);
    assert!(judged([2, 1], [0, 1]).decisions().is_empty(), "one of two is checked, and the other one is named");
    assert!(judged([2, 2], [0, 0]).reasons.is_empty());
}

#[test]
fn runs_without_vehicles_behind_that_take_too_long_do_not_meet_the_requirement() {
    let judged = |runs: u64, not_checked: u64| {
        let summary = paired(|counts| {
            (counts.attribution.runs, counts.attribution.not_checked) = (runs, not_checked);
        });
        let mut findings = Findings::default();
        let standings: Vec<Standing> =
            judge_attribution(&summary, &mut findings).into_iter().map(|(_, standing)| standing).collect();
        (findings.decisions(), standings)
    };
    assert_eq!(judged(0, 2), (vec![Decision::Inconclusive], vec![Standing::Inconclusive]));
    assert_eq!(judged(12, 1), (vec![], vec![]));
    assert_eq!(judged(2, 0), (vec![], vec![]));
}

#[test]
fn a_limit_of_flaky_samples_or_flips_that_cannot_be_missed_is_open() {
    let flaky = |max: u64| {
        let mut findings = Findings::default();
        judge_flaky(&paired(|_| ()).total(), Some(max), &mut findings);
        findings.decisions()
    };
    assert!(flaky(0).is_empty() && flaky(39).is_empty(), "20 samples in two arms");
    assert_eq!(flaky(40), [Decision::Inconclusive]);
    let flips = |rate: f64, runs: u64| {
        let mut findings = Findings::default();
        let checks = CheckCounts { runs, ..CheckCounts::default() };
        judge_validity(&paired(|_| ()), &checks, rate, &mut findings);
        findings.decisions()
    };
    assert!(flips(MAX_FLIP_RATE, 1).is_empty() && flips(0.5, 4).is_empty());
    assert_eq!([flips(1.0, 4), flips(0.9, 4)], [[Decision::Inconclusive], [Decision::Inconclusive]]);
}

#[test]
fn several_scenarios_without_an_available_system_are_one_remark() {
    let findings = availability_in(&["dead", "frozen"], 6, 2);
    let texts: Vec<&str> = findings.reasons.iter().map(|reason| reason.text.as_str()).collect();
    assert_eq!(
        texts,
        [
            "in 2 scenarios the system under test was not available, because sensors had failed, in more than 50 % of the samples, \
             and they do not decide what it does: dead (in 6 of 10 samples; it engaged in 2), frozen (in 6 of 10 samples; it engaged in 2)"
        ]
    );
    assert_eq!(findings.decisions(), [Decision::NotJudged]);
}

#[test]
fn the_reasons_that_decide_come_before_remarks_and_lesser_reasons() {
    let findings = || {
        let mut findings = Findings::default();
        findings.note("the validity of the simulator was not checked".to_owned());
        findings.add(Decision::NotJudged, "the system never acted".to_owned());
        findings.add(Decision::Overridden, "a setting".to_owned());
        findings.note("flaky".to_owned());
        findings.add(Decision::Overridden, "another setting".to_owned());
        findings
    };
    assert_eq!(findings().into_reasons(Decision::Overridden)[..2], ["a setting", "another setting"]);
    let judged = findings().into_reasons(Decision::NotJudged);
    assert_eq!(judged[..2], ["the system never acted", "the validity of the simulator was not checked"]);
    assert_eq!(judged.len(), 5);
    let measured = findings().into_reasons(Decision::Measured);
    assert_eq!(measured[0], "the validity of the simulator was not checked", "nothing decides a measurement");
}

#[test]
fn a_gate_that_fails_decides_before_a_system_that_is_not_available() {
    assert_eq!(Decision::first_of(&[Decision::NotJudged, Decision::Fail]), Some(Decision::Fail));
    assert_eq!(Decision::first_of(&[Decision::Overridden, Decision::Fail]), Some(Decision::Fail));
    assert_eq!(Decision::first_of(&[Decision::Overridden]), Some(Decision::Overridden));
}

#[test]
fn a_remark_on_one_scenario_is_a_reason_that_a_report_may_fold() {
    let mut findings = Findings::default();
    findings.note("the validity of the simulator was not checked".to_owned());
    findings.background("happened as expected: a".to_owned());
    findings.add(Decision::Fail, "a gate".to_owned());
    assert_eq!(findings.background, ["happened as expected: a"]);
    assert_eq!(findings.decisions(), [Decision::Fail]);
    assert_eq!(findings.into_reasons(Decision::Fail).len(), 3);
}
