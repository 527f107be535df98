//! The summary of a campaign in Markdown, short enough for a pull request.

use std::path::Path;

use super::coverage::line;
use super::ensemble::ensemble_markdown;
use super::fidelity::{fidelity_markdown, fidelity_of};
use super::findings::Findings;
use super::origins::Origins;
use super::overview::{FEW_EVENTS, ScenarioOverview, WorstSample};
use super::recordings::{Still, card_beside};
use super::text::{goals, imposed, not_prevented};
use super::words::{Reasons, p_text, sentence};
use crate::escape::{in_markdown, markdown_code};
use closecall_campaign::arm_pairs::{CORRECTION, pair_results};
use closecall_campaign::harm;
use closecall_campaign::ledger::Inference;
use closecall_campaign::summary::{Counts, Summary};
use closecall_campaign::verdict::Verdict;
use closecall_scenarios::causal::LETTERS;
use closecall_traffic::atomic::{WriteError, write_file};
use closecall_traffic::shown::shown;
use closecall_traffic::statistics::format::percent;

/// Largest number of reasons below the sentence of the verdict. The others are folded.
const SHOWN: usize = 12;
/// Largest number of samples that are listed for each scenario.
const LISTED: usize = 5;

/// Writes the summary into a file of its own.
///
/// # Errors
/// [`WriteError`] if the file cannot be written. An existing file then stays as it is.
pub fn write_markdown(path: &Path, findings: &Findings<'_>) -> Result<(), WriteError> {
    let text = markdown(findings);
    write_file(path, |file| file.write_all(text.as_bytes()))
}

/// Returns the summary.
pub fn markdown(findings: &Findings<'_>) -> String {
    let sentence = sentence(findings.judged, findings.files.len());
    let mut text = format!("## Closecall: {}\n\n", in_markdown(&sentence));
    let Reasons { weighty, settled } = Reasons::below(findings.judged, &sentence);
    let (first, more) = weighty.split_at(weighty.len().min(SHOWN));
    for reason in first {
        text.push_str(&format!("- {}\n", in_markdown(reason)));
    }
    text.push_str(&worst_recorded(findings, |card| format!("[incident card]({card})")));
    if let Some(origins) = findings.folder.and_then(Origins::of) {
        text.push_str(&format!("- {}\n", in_markdown(&origins.choice_sentence())));
    }
    if !settled.is_empty() || !more.is_empty() {
        let undecided = if more.is_empty() { String::new() } else { format!("{} more reasons, ", more.len()) };
        text.push_str(&format!(
            "\n<details><summary>{undecided}gates that are met, and remarks on single scenarios</summary>\n\n"
        ));
        for reason in more.iter().chain(&settled) {
            text.push_str(&format!("- {}\n", in_markdown(reason)));
        }
        text.push_str("\n</details>\n");
    }
    text.push('\n');
    text.push_str(&counts(findings.summary));
    if let Some(fidelity) = fidelity_of(findings) {
        text.push_str(&fidelity_markdown(&fidelity, cell));
    }
    text.push_str(&ensemble_markdown(findings.summary, findings.manifest));
    text.push_str(&requirements(findings));
    for (scenario, results) in &findings.judged.coverage {
        text.push_str(&format!("Coverage of {}:\n\n", cell(scenario)));
        results.iter().for_each(|result| text.push_str(&format!("- {}\n", in_markdown(&line(result)))));
        text.push('\n');
    }
    for scenario in &findings.overview.scenarios {
        text.push_str(&influence(findings, scenario));
        text.push_str(&worst(findings, scenario));
    }
    let (sampling, version) = (findings.manifest.sampling, &findings.manifest.closecall_version);
    let settings: String = findings
        .manifest
        .settings()
        .iter()
        .map(|setting| format!(", with <code>{}</code>", in_markdown(&setting.to_string())))
        .collect();
    text.push_str(&format!(
        "<sub>{LETTERS}. Rates are conditional on the sampled scenario: they are not the risk on a road. Seed {}, {} design{settings}, \
         closecall {version}.</sub>\n",
        sampling.seed, sampling.design,
    ));
    shown(&text).into_owned()
}

/// Returns what the recordings add to a summary that was written before them. A CI server shows it
/// apart from the folder, so that no link leads there.
pub(super) fn recorded(findings: &Findings<'_>, differences: &[String]) -> String {
    let mut text = String::new();
    for difference in differences {
        text.push_str(&format!("- {}: {}\n", Verdict::Invalid, in_markdown(difference)));
    }
    text.push_str(&worst_recorded(findings, markdown_code));
    if text.is_empty() { text } else { shown(&format!("\n**Recorded samples**\n\n{text}\n")).into_owned() }
}

/// Returns the worst recorded samples, each with its incident card.
fn worst_recorded(findings: &Findings<'_>, card: impl Fn(&str) -> String) -> String {
    let line = |(still, recording): (&Still, &str)| {
        let (verdict, scenario, sample) = (still.verdict, cell(&still.scenario), still.sample);
        let (sentence, card) = (cell(&still.sentence), card(&card_beside(recording)));
        format!("- {verdict}: {scenario}, sample {sample}: {sentence} ({card})\n")
    };
    findings.worst_stills().into_iter().map(line).collect()
}

fn counts(summary: &Summary) -> String {
    let mut text = "| scenario | controller | samples | collisions | touches | rate | 95 % interval | errors |\n\
                    |---|---|---:|---:|---:|---:|---|---:|\n"
        .to_owned();
    for (name, counts) in &summary.scenarios {
        for (controller, arm) in summary.controllers.iter().zip(&counts.arms) {
            let rate = arm.collision_rate().map_or_else(|| "-".to_owned(), percent);
            text.push_str(&format!(
                "| {} | {} | {} | {} | {} | {rate} | {} | {} |\n",
                cell(name),
                cell(controller),
                arm.outcomes,
                arm.collisions,
                arm.touches,
                interval(arm.interval_95(summary.inference)),
                arm.errors,
            ));
        }
    }
    text.push('\n');
    if summary.is_paired() {
        for (name, counts) in &summary.scenarios {
            text.push_str(&format!("{}: {}", cell(name), pairs(counts, summary.inference)));
            for sentence in [not_prevented(counts), goals(counts), imposed(summary, counts)].into_iter().flatten() {
                text.push_str(&format!("{}: {sentence}.\n\n", cell(name)));
            }
        }
    }
    if summary.has_references() {
        text.push_str(&arm_pairs(summary));
    }
    text
}

/// Returns an interval in words, or a dash if no interval is valid.
fn interval(interval: Option<[f64; 2]>) -> String {
    interval.map_or_else(|| "-".to_owned(), |[low, high]| format!("{} to {}", percent(low), percent(high)))
}

/// Returns the table of all pairs of arms.
fn arm_pairs(summary: &Summary) -> String {
    let mut text =
        "| scenario | from | to | prevented | 95 % | induced | 95 % | both | neither | McNemar p, corrected |\n\
                    |---|---|---|---:|---|---:|---|---:|---:|---:|\n"
            .to_owned();
    for (name, counts) in &summary.scenarios {
        for result in pair_results(summary, counts) {
            let (pairs, p_value) = (result.pairs, result.corrected_p.map_or_else(|| "-".to_owned(), p_text));
            text.push_str(&format!(
                "| {} | {} | {} | {} | {} | {} | {} | {} | {} | {p_value} |\n",
                cell(name),
                cell(result.baseline),
                cell(result.tested),
                pairs.prevented,
                interval(result.prevented_95),
                pairs.induced,
                interval(result.induced_95),
                pairs.both,
                pairs.neither,
            ));
        }
    }
    text.push_str(&format!(
        "\n<sub>All pairs of arms. McNemar mid-p, corrected for the number of pairs ({CORRECTION}).</sub>\n\n"
    ));
    text
}

fn pairs(counts: &Counts, inference: Inference) -> String {
    let pairs = &counts.pairs;
    let p_value = pairs
        .mcnemar_p(inference)
        .map_or_else(String::new, |p| format!(" McNemar mid-p of any collision {}.", p_text(p)));
    format!(
        "**{} prevented, {} induced**, {} in both arms, {} in neither.{p_value} Harm: {:.3} prevented, {:.3} induced ({}).\n\n",
        pairs.prevented,
        pairs.induced,
        pairs.both,
        pairs.neither,
        pairs.prevented_harm,
        pairs.induced_harm,
        harm::WEIGHT,
    )
}

fn requirements(findings: &Findings<'_>) -> String {
    let requirements = &findings.judged.requirements;
    if requirements.is_empty() {
        return String::new();
    }
    let mut text = "| requirement | scenario | result |\n|---|---|---|\n".to_owned();
    for requirement in requirements {
        let (mark, scenario) = (cell(&requirement.mark), cell(&requirement.scenario));
        text.push_str(&format!("| {mark} | {scenario} | {} |\n", requirement.standing.word()));
    }
    text.push('\n');
    text
}

/// Returns what moves the result of a scenario: the strongest parameters for each event.
fn influence(findings: &Findings<'_>, scenario: &ScenarioOverview) -> String {
    let mut text = format!("**What moves the result of {}**", cell(&scenario.name));
    let events = match scenario.influence.events(findings.manifest.sampling.design) {
        Ok(events) => events,
        Err(reason) => return format!("{text}: {reason}.\n\n"),
    };
    text.push_str(" (share of the variance that a parameter explains alone)\n\n");
    for event in events {
        let parameters = match &event.parameters {
            Some(parameters) => {
                let strongest = parameters.iter().take(LISTED).map(|(name, influence)| {
                    let [low, high] = influence.index.interval_95;
                    let value = influence.index.value;
                    format!("`{name}` {value:.2} ({low:.2} to {high:.2}; {})", event.from_to(influence))
                });
                strongest.collect::<Vec<_>>().join(", ")
            }
            None => FEW_EVENTS.to_owned(),
        };
        text.push_str(&format!("- {}, {} of {}: {parameters}\n", event.event.title(), event.events, event.samples));
    }
    text.push('\n');
    text
}

fn worst(findings: &Findings<'_>, scenario: &ScenarioOverview) -> String {
    let collided: Vec<&WorstSample> =
        scenario.worst.iter().filter(|sample| sample.delta_v_mps.is_some()).take(LISTED).collect();
    let mut text = String::new();
    for (arm, flaky) in &scenario.flaky {
        let first_line = flaky.message.lines().next().unwrap_or_default();
        let (count, sample) = (flaky.count, flaky.first_sample);
        text.push_str(&format!(
            "- {count} × FLAKY in {} (run again after a failure), first in sample {sample}: {}\n",
            cell(arm),
            cell(first_line)
        ));
    }
    if !text.is_empty() {
        text = format!("**Flaky samples of {}**\n\n{text}\n", cell(&scenario.name));
    }
    if collided.is_empty() {
        return text;
    }
    text.push_str(&format!(
        "<details><summary>Worst collisions in {}</summary>\n\n| sample | ego's ΔV | with | command to run it again |\n|---:|---:|---|---|\n",
        cell(&scenario.name)
    ));
    for sample in collided {
        let delta_v_mps = sample.delta_v_mps.unwrap_or_default();
        let with = sample.collision.as_ref().map(|(other, _)| other.to_string()).unwrap_or_default();
        let replay = findings.replay(&scenario.name, sample.sample);
        let replay = markdown_code(&replay).replace('|', "\\|");
        text.push_str(&format!("| {} | {delta_v_mps:.1} m/s | {} | {replay} |\n", sample.sample, cell(&with)));
    }
    text.push_str("\n</details>\n\n");
    text
}

/// Returns the text as it may stand in a cell of a table.
fn cell(text: &str) -> String {
    in_markdown(text).replace('|', "\\|")
}
