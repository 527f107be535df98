//! The rates of a campaign that fast sensors have sharpened, in each format.
//!
//! They inform, and decide nothing: gates judge the samples of the campaign alone, whose bounds are
//! exact.

use std::collections::BTreeMap;
use std::fmt;

use closecall_campaign::folder::{FAST_SAMPLES, Folder};
use closecall_studies::fidelity::{Fidelity, FidelityRate, FidelityReport, time_ratios};
use closecall_traffic::statistics::format::percent;
use closecall_traffic::words::counted;
use maud::{Markup, html};

use super::findings::Findings;
use super::html::{number, number_heads, table, text_heads};

/// What the rates are for.
const NOTE: &str = "The gates do not use these rates: they judge the samples of the campaign by their exact bounds.";
/// The text of an interval that is not there.
const NO_INTERVAL: &str = "too few or too many events";

/// The rates of one scenario, as lines for human readers.
#[derive(Clone, Copy, Debug)]
pub struct FidelityText<'a> {
    /// The rates.
    pub report: &'a FidelityReport,
    /// Mean wall time of a fast sample, relative to a sample of the full chain; `None` if it is not
    /// known.
    pub time_ratio: Option<f64>,
}

impl fmt::Display for FidelityText<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let FidelityReport { scenario, samples, more_samples, left_out, rates } = self.report;
        let both = counted(*samples, "sample");
        writeln!(f, "{scenario}: {both} in both modes, {more_samples} in the fast mode alone")?;
        if *left_out > 0 {
            writeln!(f, "  left out, because a run ended in an error: {}", counted(*left_out, "sample"))?;
        }
        if let Some(ratio) = self.time_ratio {
            writeln!(f, "  {}", time_sentence(self.report, ratio))?;
        }
        for rate in rates {
            let [low, high] = rate.plain_interval_95.map(percent);
            writeln!(f, "  {}: {} (95 %: {low} to {high}) by the full chain alone", rate.of, percent(rate.plain))?;
            let correlation = correlation(rate)
                .map_or_else(|| "one of the modes does not vary".to_owned(), |text| format!("correlation {text}"));
            match rate.estimate {
                Some(estimate) => {
                    let [low, high] = estimate.interval_95.map(percent);
                    let (value, worth) = (percent(estimate.value), estimate.worth_samples);
                    let error = percent(estimate.standard_error_ratio);
                    writeln!(
                        f,
                        "    with the fast runs: {value} (95 %: {low} to {high}), worth {worth:.0} samples of the full chain, {error} of \
                         its standard error; {correlation}"
                    )?;
                }
                None => writeln!(
                    f,
                    "    with the fast runs: no interval, because {} events are too few or too many; {correlation}",
                    rate.events
                )?,
            }
        }
        Ok(())
    }
}

/// Returns the time that the fast samples took, in samples of the full chain.
fn time_sentence(report: &FidelityReport, ratio: f64) -> String {
    let as_long_as = (report.samples + report.more_samples) as f64 * ratio;
    format!(
        "the fast samples took as long as {as_long_as:.1} samples of the full chain: without them, the same time gives {:.0}",
        report.samples as f64 + as_long_as
    )
}

/// Returns the rates of a campaign as lines for human readers. `folder` is the folder of the
/// campaign.
pub fn fidelity_text(folder: &Folder, fidelity: &Fidelity) -> String {
    let ratios = ratios(folder);
    let Fidelity { mode, factor, scenarios, .. } = fidelity;
    let mut text = format!("rates with {factor} times as many samples of the sensors `{mode}`, which no gate uses:\n");
    for report in scenarios {
        let time_ratio = ratios.get(&report.scenario).copied();
        text.push_str(&FidelityText { report, time_ratio }.to_string());
    }
    text
}

/// Returns the relative wall times of the fast samples of a campaign; nothing of a folder without
/// wall times.
fn ratios(folder: &Folder) -> BTreeMap<String, f64> {
    time_ratios(folder, &Folder::open(&folder.file(FAST_SAMPLES))).unwrap_or_default()
}

/// Returns the rates of the campaign of a report, if fast sensors have sharpened them.
pub(super) fn fidelity_of(findings: &Findings<'_>) -> Option<Fidelity> {
    findings.folder.and_then(Fidelity::read)
}

/// A rate in the cells of a table.
struct Row<'a> {
    scenario: &'a str,
    rate: &'a FidelityRate,
    /// The rate of the campaign alone, with its interval.
    alone: String,
    /// The rate with the fast samples, with its interval.
    sharpened: String,
    correlation: String,
    /// Standard error, relative to the samples of the campaign alone.
    error: String,
    worth: String,
}

fn rows(fidelity: &Fidelity) -> impl Iterator<Item = Row<'_>> {
    let with_interval = |value: f64, interval: [f64; 2]| {
        let [low, high] = interval.map(percent);
        format!("{} ({low} to {high})", percent(value))
    };
    let all = fidelity.scenarios.iter().flat_map(|report| report.rates.iter().map(move |rate| (report, rate)));
    all.map(move |(report, rate)| {
        let of_estimate = |text: fn(f64, f64) -> String| {
            let values = rate.estimate.map(|estimate| text(estimate.standard_error_ratio, estimate.worth_samples));
            values.unwrap_or_else(|| "-".to_owned())
        };
        Row {
            scenario: &report.scenario,
            rate,
            alone: with_interval(rate.plain, rate.plain_interval_95),
            sharpened: rate
                .estimate
                .map_or_else(|| NO_INTERVAL.to_owned(), |estimate| with_interval(estimate.value, estimate.interval_95)),
            correlation: correlation(rate).unwrap_or_else(|| "-".to_owned()),
            error: of_estimate(|ratio, _| percent(ratio)),
            worth: of_estimate(|_, worth| format!("{worth:.0}")),
        }
    })
}

fn correlation(rate: &FidelityRate) -> Option<String> {
    rate.correlation.map(|correlation| format!("{correlation:.2}"))
}

/// Returns what the table of rates shows.
fn introduction(fidelity: &Fidelity) -> String {
    let Fidelity { mode, factor, samples, .. } = fidelity;
    format!(
        "Each scenario ran {} as the campaign states, and {factor} times as many with the sensors `{mode}`. The fast rate is a control \
         variate: the correlation is estimated from the samples that both modes have.",
        counted(*samples, "sample")
    )
}

/// Returns the section of the report. A campaign without fast samples has none.
pub(super) fn section(findings: &Findings<'_>) -> Markup {
    let Some((folder, fidelity)) = findings.folder.and_then(|folder| Some((folder, Fidelity::read(folder)?))) else {
        return html! {};
    };
    let ratios = ratios(folder);
    let times = fidelity.scenarios.iter().filter_map(|report| Some((report, *ratios.get(&report.scenario)?)));
    let head = html! {
        (text_heads(&["scenario", "rate", "samples of the campaign (95 %)", "with the fast samples (95 %)"]))
        (number_heads(&["correlation", "standard error", "worth samples"]))
    };
    let body = html! {
        @for row in rows(&fidelity) {
            tr {
                td { (row.scenario) }
                td { (row.rate.of) }
                td { (row.alone) }
                td { (row.sharpened) }
                (number(row.correlation)) (number(row.error)) (number(row.worth))
            }
        }
    };
    html! {
        h2 { "Rates with fast sensors" }
        p { (introduction(&fidelity)) " " (NOTE) }
        (table(&head, &body))
        @for report in fidelity.scenarios.iter().filter(|report| report.left_out > 0) {
            p { (report.scenario) ": left out, because a run ended in an error: " (counted(report.left_out, "sample")) "." }
        }
        @for (report, ratio) in times { p.note { (report.scenario) ": " (time_sentence(report, ratio)) "." } }
    }
}

/// Returns the rates as Markdown. `cell` makes a text fit for a cell of a table.
pub(super) fn fidelity_markdown(fidelity: &Fidelity, cell: fn(&str) -> String) -> String {
    let mut text = format!(
        "**Rates with fast sensors.** {}\n\n| scenario | rate | samples of the campaign (95 %) | with the fast samples (95 %) | \
         correlation | standard error | worth samples |\n|---|---|---|---|---:|---:|---:|\n",
        introduction(fidelity)
    );
    for Row { scenario, rate, alone, sharpened, correlation, error, worth } in rows(fidelity) {
        let (scenario, of) = (cell(scenario), cell(&rate.of));
        text.push_str(&format!("| {scenario} | {of} | {alone} | {sharpened} | {correlation} | {error} | {worth} |\n"));
    }
    format!("{text}\n<sub>{NOTE}</sub>\n\n")
}

#[cfg(test)]
mod tests {
    use closecall_studies::fidelity::FidelityEstimate;

    use super::*;

    fn fidelity() -> Fidelity {
        let estimate =
            FidelityEstimate { value: 0.1, interval_95: [0.08, 0.12], worth_samples: 800.0, standard_error_ratio: 0.5 };
        let sharp = FidelityRate {
            of: "prevented".to_owned(),
            events: 20,
            plain: 0.1,
            plain_interval_95: [0.0624, 0.15],
            fast: 0.11,
            correlation: Some(0.9),
            estimate: Some(estimate),
        };
        let rare = FidelityRate {
            of: "induced".to_owned(),
            events: 1,
            plain: 0.005,
            plain_interval_95: [0.0001, 0.0275],
            fast: 0.0,
            correlation: None,
            estimate: None,
        };
        let report = FidelityReport {
            scenario: "a|b".to_owned(),
            samples: 200,
            more_samples: 3_800,
            left_out: 1,
            rates: vec![sharp, rare],
        };
        Fidelity { mode: "object".to_owned(), factor: 20, samples: 201, scenarios: vec![report] }
    }

    #[test]
    fn the_text_says_what_the_fast_samples_cost_and_what_they_are_worth() {
        let fidelity = fidelity();
        let text = FidelityText { report: &fidelity.scenarios[0], time_ratio: Some(0.01) }.to_string();
        for part in [
            "a|b: 200 samples in both modes, 3800 in the fast mode alone",
            "left out, because a run ended in an error: 1 sample",
            "took as long as 40.0 samples of the full chain: without them, the same time gives 240",
            "with the fast runs: 10 % (95 %: 8 % to 12 %), worth 800 samples of the full chain, 50 % of its standard error; correlation 0.90",
            "no interval, because 1 events are too few or too many; one of the modes does not vary",
        ] {
            assert!(text.contains(part), "{part}: {text}");
        }
        let text = FidelityText { report: &fidelity.scenarios[0], time_ratio: None }.to_string();
        assert!(!text.contains("as long as"), "{text}");
    }

    #[test]
    fn the_table_has_every_rate_and_says_that_no_gate_uses_it() {
        let text = fidelity_markdown(&fidelity(), |text| text.replace('|', "\\|"));
        for line in [
            "| a\\|b | prevented | 10 % (6.24 % to 15 %) | 10 % (8 % to 12 %) | 0.90 | 50 % | 800 |",
            "| a\\|b | induced | 0.5 % (0.01 % to 2.75 %) | too few or too many events | - | - | - |",
        ] {
            assert!(text.lines().any(|written| written == line), "{line}: {text}");
        }
        assert!(text.contains("201 samples") && text.contains("20 times as many") && text.contains(NOTE), "{text}");
    }
}
