//! The result of a campaign as text for human readers.

use std::fmt;

use closecall_campaign::arm_pairs::{CORRECTION, pair_results};
use closecall_campaign::harm;
use closecall_campaign::ledger::{ArmCounts, Inference};
use closecall_campaign::probability::percent;
use closecall_campaign::summary::{Counts, Summary};
use closecall_campaign::verdict::Judgement;
use closecall_scenarios::outcome::IMPOSED_BRAKING_MPS2;
use closecall_traffic::words::counted;

use super::overview::{ErrorGroup, Overview};
use super::pareto::ParetoText;
use super::words::{Reasons, p_text, sentence};

/// Width of the names of the arms in the output, at least.
const NAME_WIDTH: usize = 5;

/// The counts of each scenario. Scenarios are never pooled into one sample.
#[derive(Clone, Copy, Debug)]
pub struct CountsText<'a>(pub &'a Summary);

impl fmt::Display for CountsText<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let summary = self.0;
        for (name, counts) in &summary.scenarios {
            writeln!(f, "{name}: {}", counted(counts.samples, "sample"))?;
            write_scenario(f, summary, counts)?;
        }
        if summary.inference == Inference::Sequential {
            writeln!(
                f,
                "Intervals are confidence sequences: they are valid for any rule that determines the number of samples."
            )?;
        }
        if summary.inference == Inference::Design {
            writeln!(
                f,
                "No rate has an interval: the samples of the designs sobol, grid and coverage are not independent."
            )?;
        }
        writeln!(f, "Rates are conditional on the sampled scenario: they are not the risk on a road.")
    }
}

/// The flaky samples of each scenario and arm, with the message of the first failure. Empty if there
/// are none.
#[derive(Clone, Copy, Debug)]
pub struct FlakyText<'a>(pub &'a Overview);

impl fmt::Display for FlakyText<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for scenario in &self.0.scenarios {
            for (arm, ErrorGroup { count, first_sample, message }) in &scenario.flaky {
                let first_line = message.lines().next().unwrap_or_default();
                writeln!(
                    f,
                    "FLAKY: {}: {count} × {arm}, run again after a failure, first in sample {first_sample}: {first_line}",
                    scenario.name
                )?;
            }
        }
        Ok(())
    }
}

/// Largest number of reasons that are all below the sentence of the verdict: they fit on a screen.
const MOST_TOGETHER: usize = 12;
/// Largest number of reasons below the sentence if there are more: with the paths of the written
/// files, they fit on a screen even if each takes a few lines.
const MOST_BELOW: usize = 5;

/// The verdict in one sentence, with its reasons in plain words: below it the gates that are not
/// met, the worst first. If there are many reasons, gates that are met and remarks on single
/// scenarios come before the sentence, so that the last screen of the output has the verdict.
#[derive(Clone, Copy, Debug)]
pub struct VerdictText<'a> {
    /// The verdict.
    pub judged: &'a Judgement,
    /// The number of scenarios.
    pub scenarios: usize,
}

impl fmt::Display for VerdictText<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let sentence = sentence(self.judged, self.scenarios);
        let Reasons { weighty, settled } = Reasons::below(self.judged, &sentence);
        if weighty.len() + settled.len() <= MOST_TOGETHER {
            writeln!(f, "{sentence}")?;
            return weighty.iter().chain(&settled).try_for_each(|reason| writeln!(f, "  {reason}"));
        }
        let (below, more) = weighty.split_at(weighty.len().min(MOST_BELOW));
        writeln!(f, "Gates and remarks that the verdict does not repeat:")?;
        settled.iter().chain(more).try_for_each(|reason| writeln!(f, "  {reason}"))?;
        writeln!(f, "{sentence}")?;
        below.iter().try_for_each(|reason| writeln!(f, "  {reason}"))?;
        match more.len() {
            0 => Ok(()),
            count => writeln!(f, "  and {count} more above the verdict"),
        }
    }
}

fn write_scenario(f: &mut fmt::Formatter<'_>, summary: &Summary, counts: &Counts) -> fmt::Result {
    let width = summary.controllers.iter().map(String::len).fold(NAME_WIDTH, usize::max);
    for (name, arm) in summary.controllers.iter().zip(&counts.arms) {
        write_arm(f, &format!("{name:<width$}"), arm, summary.inference)?;
    }
    if summary.is_paired() {
        let pairs = counts.pairs;
        let [prevented, induced] = [pairs.prevented, pairs.induced];
        write!(f, "  pairs: {prevented} prevented, {induced} induced, {} both, {} neither", pairs.both, pairs.neither)?;
        if let Some(p) = pairs.mcnemar_p(summary.inference) {
            let [without, with] = [pairs.any_prevented, pairs.any_induced];
            write!(f, "  (any vehicle: {without} to {with}, McNemar mid-p {})", p_text(p))?;
        }
        writeln!(f)?;
        if let Some(sentence) = not_prevented(counts) {
            writeln!(f, "  {sentence}")?;
        }
        let of_others = pairs.induced_of_others + pairs.both_of_others;
        if of_others > 0 {
            let tested = summary.controllers.last().map_or("", String::as_str);
            writeln!(
                f,
                "  in {of_others} of the induced and both, only vehicles other than the ego collide with {tested}"
            )?;
        }
        if counts.arms.iter().any(|arm| arm.harm > 0.0) {
            writeln!(
                f,
                "  harm: {:.3} prevented, {:.3} induced ({})",
                pairs.prevented_harm,
                pairs.induced_harm,
                harm::WEIGHT
            )?;
        }
    }
    for sentence in [goals(counts), imposed(summary, counts)].into_iter().flatten() {
        writeln!(f, "  {sentence}")?;
    }
    if summary.has_references() {
        write_arm_pairs(f, summary, counts)?;
        if let Some(pareto) = ParetoText::of(summary, counts) {
            write!(f, "{pareto}")?;
        }
    }
    let checks = &counts.checks;
    if checks.not_checked > 0 {
        let runs = counted(checks.not_checked, "run");
        writeln!(f, "  not checked: {runs}, because a check took too long, or its process failed")?;
    }
    if let Some(rate) = checks.flip_rate() {
        writeln!(
            f,
            "  checked: {}, {} flipped at half the time step ({})",
            counted(checks.runs, "run"),
            checks.flips,
            percent(rate)
        )?;
    }
    Ok(())
}

/// Returns the reasons for which the system under test did not prevent collisions, the most
/// frequent first; `None` if there are none.
pub(super) fn not_prevented(counts: &Counts) -> Option<String> {
    let reason = |(hindrance, times): &(_, u64)| format!("{hindrance} in {times}");
    let texts: Vec<String> = counts.not_prevented.iter().map(reason).collect();
    let all = counts.pairs.prevented + counts.pairs.both;
    (!texts.is_empty())
        .then(|| format!("prevented {} of {all}; of the others: {}", counts.pairs.prevented, texts.join(", ")))
}

/// Returns the results for the method's goal, the most frequent first; `None` if there was none.
pub(super) fn goals(counts: &Counts) -> Option<String> {
    let all: u64 = counts.goals.iter().map(|(_, times)| times).sum();
    let texts: Vec<String> = counts.goals.iter().map(|(goal, times)| format!("{} in {times}", goal.text())).collect();
    (all > 0).then(|| format!("goal (2 s of headway) in {}: {}", counted(all, "encounter"), texts.join(", ")))
}

/// Returns in how many samples each arm makes the vehicle behind brake hard; `None` if none does.
pub(super) fn imposed(summary: &Summary, counts: &Counts) -> Option<String> {
    let braking = |(name, arm): (&String, &ArmCounts)| {
        let mean_mps2 = arm.mean_cost()?.imposed_braking_mps2;
        Some(format!(
            "{name} {} of {} ({}, mean {mean_mps2:.1} m/s²)",
            arm.imposed,
            arm.costed,
            percent(arm.imposed_share()?)
        ))
    };
    let texts: Vec<String> = summary.controllers.iter().zip(&counts.arms).filter_map(braking).collect();
    counts.arms.iter().any(|arm| arm.imposed > 0).then(|| {
        format!(
            "the vehicle behind brakes harder than {IMPOSED_BRAKING_MPS2:.0} m/s² before the lead vehicle brakes (UN Regulation 157): {}",
            texts.join(", ")
        )
    })
}

/// Writes all pairs of arms.
fn write_arm_pairs(f: &mut fmt::Formatter<'_>, summary: &Summary, counts: &Counts) -> fmt::Result {
    writeln!(
        f,
        "  all pairs of arms (95 % intervals of the shares; p: McNemar mid-p of any collision, corrected for the pairs by {CORRECTION}):"
    )?;
    for result in pair_results(summary, counts) {
        let pairs = result.pairs;
        let interval = |interval: Option<[f64; 2]>| {
            interval.map_or_else(String::new, |[low, high]| format!(" ({:.1} to {:.1} %)", 100.0 * low, 100.0 * high))
        };
        write!(f, "    {:<28}", format!("{} -> {}:", result.baseline, result.tested))?;
        write!(f, " {} prevented{},", pairs.prevented, interval(result.prevented_95))?;
        write!(f, " {} induced{},", pairs.induced, interval(result.induced_95))?;
        write!(f, " {} both, {} neither", pairs.both, pairs.neither)?;
        writeln!(f, "{}", result.corrected_p.map_or_else(String::new, |p| format!(", p {}", p_text(p))))?;
    }
    Ok(())
}

fn write_arm(f: &mut fmt::Formatter<'_>, name: &str, arm: &ArmCounts, inference: Inference) -> fmt::Result {
    let rate = arm.collision_rate().map_or("-".to_owned(), |rate| format!("{:.1} %", 100.0 * rate));
    let noun = if arm.collisions == 1 { "collision" } else { "collisions" };
    write!(f, "  {name} {:>6} {noun:<10}  {rate:>7}", arm.collisions)?;
    if let Some([low, high]) = arm.interval_95(inference) {
        write!(f, "  (95 %: {:.1} to {:.1} %)", 100.0 * low, 100.0 * high)?;
    }
    if arm.collisions > 0 {
        write!(f, "  delta-v up to {:.1} m/s", arm.max_delta_v_mps)?;
    }
    if arm.touches > 0 {
        write!(f, "  {}", counted(arm.touches, "touch"))?;
    }
    if arm.engagements > 0 {
        write!(f, "  {} engaged, goal in reach in {}", arm.engagements, arm.goals_in_reach)?;
    }
    if arm.unavailable > 0 {
        write!(f, "  not available in {}", arm.unavailable)?;
    }
    // Without an outcome, nothing was measured.
    if arm.outcomes > 0 {
        write!(f, "  up to {:.1} m/s slower than the lead vehicle", arm.max_speed_deficit_mps)?;
    }
    if arm.errors > 0 {
        write!(f, "  {}", counted(arm.errors, "ERROR").to_uppercase())?;
    }
    if arm.flaky > 0 {
        write!(f, "  {} FLAKY", arm.flaky)?;
    }
    writeln!(f)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use closecall_campaign::gate::{Answer, Evaluation, GateResult, GateSource};
    use closecall_campaign::verdict::Decision;

    use super::*;

    fn gate(index: usize, value: f64, answer: Answer) -> GateResult {
        let samples = 30;
        GateResult {
            scenario: format!("s{index}"),
            expression: "count(ego_collided) <= 0".parse().unwrap(),
            source: GateSource::CommandLine,
            evaluation: Evaluation {
                value: Some(value),
                interval_95: None,
                certainty: None,
                samples,
                hits: 0,
                answer,
                needed: None,
            },
        }
    }

    #[test]
    fn the_last_lines_are_the_verdict_and_its_worst_gates_whatever_happened_as_expected() {
        let missed = (0..8).map(|index| gate(index, 1.0 + index as f64, Answer::Missed));
        let met = (8..104).map(|index| gate(index, 0.0, Answer::Met));
        let background: Vec<String> = (0..104).map(|index| format!("happened as expected: s{index}: x")).collect();
        let judged = Judgement {
            decision: Decision::Fail,
            reasons: background.clone(),
            background,
            gates: missed.chain(met).collect(),
            requirements: Vec::new(),
            expectations: Vec::new(),
            probabilities: Vec::new(),
            coverage: Vec::new(),
            flaky: None,
            shows_no_benefit: false,
        };
        let text = VerdictText { judged: &judged, scenarios: 104 }.to_string();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines.len(), 1 + 104 + 96 + 8 + 1 + 1);
        let verdict = &lines[lines.len() - 7..];
        assert!(verdict[0].starts_with("FAIL: 8 of 104 scenarios miss a gate: s7, "), "{verdict:?}");
        for (line, scenario) in verdict[1..6].iter().zip(["s7", "s6", "s5", "s4", "s3"]) {
            assert!(line.starts_with(&format!("  NOT MET: {scenario}: number of samples")), "{verdict:?}");
        }
        assert_eq!(verdict[6], "  and 3 more above the verdict");
        assert!(lines[lines.len() - 8].starts_with("  NOT MET: s0: "), "{lines:?}");
        // A campaign with few reasons has them below its verdict, the met ones last.
        let gates = vec![gate(1, 0.0, Answer::Met), gate(0, 1.0, Answer::Missed)];
        let few = Judgement { reasons: Vec::new(), background: Vec::new(), gates, ..judged };
        let text = VerdictText { judged: &few, scenarios: 2 }.to_string();
        let lines: Vec<&str> = text.lines().collect();
        assert!(lines[0].starts_with("FAIL: 1 of 2 scenarios misses a gate: s0"), "{lines:?}");
        assert!(lines[1].starts_with("  NOT MET: s0: ") && lines[2].starts_with("  met: s1: "), "{lines:?}");
        assert_eq!(lines.len(), 3);
    }
}
