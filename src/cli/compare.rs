//! `closecall compare`: a campaign against an earlier one.

use std::path::PathBuf;

use clap::Args;
use serde_json::{Map, Value, json};

use super::CliError;
use super::args::Format;
use super::output::{out, outln};
use crate::exit_code::ExitCode;
use closecall_campaign::compare::{ScenarioComparison, compare as compare_folders};
use closecall_campaign::folder::Folder;

/// Arguments of `closecall compare`.
#[derive(Debug, Args)]
pub(super) struct CompareArgs {
    /// Folder of the earlier campaign
    baseline: PathBuf,
    /// Folder of the campaign to be judged, of the same samples
    dir: PathBuf,
    /// Newly failing samples that are no regression
    #[arg(long, default_value_t = 0, value_name = "K")]
    max_newly_failing: u64,
    /// Output for people or for programs
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

pub(super) fn compare(args: &CompareArgs) -> Result<ExitCode, CliError> {
    let (baseline, now) = (Folder::open(&args.baseline), Folder::open(&args.dir));
    let manifests = (baseline.manifest()?, now.manifest()?);
    let notes = manifests.0.differences(&manifests.1);
    let found = compare_folders(&baseline, &now)?;
    let code = judge(&found, args.max_newly_failing);
    match args.format {
        Format::Json => outln!("{:#}", to_json(&found, &notes, code)),
        Format::Human => print(&found, &notes, code),
    }
    Ok(code)
}

fn judge(found: &[ScenarioComparison], max_newly_failing: u64) -> ExitCode {
    let newly_failing: usize = found.iter().map(|scenario| scenario.newly_failing.len()).sum();
    let is_regression = newly_failing as u64 > max_newly_failing;
    let has_new_errors = found.iter().any(|scenario| !scenario.newly_in_error.is_empty());
    let codes = [(is_regression, ExitCode::Fail), (has_new_errors, ExitCode::SampleError)];
    ExitCode::first_of(codes.into_iter().filter(|(holds, _)| *holds).map(|(_, code)| code))
}

fn word(code: ExitCode) -> &'static str {
    match code {
        ExitCode::Pass => "NO REGRESSION",
        ExitCode::SampleError => "NEW ERRORS",
        _ => "REGRESSION",
    }
}

/// Numbers of samples that are listed for people.
const LISTED: usize = 12;

fn listed(samples: &[u64]) -> String {
    let mut text: Vec<String> = samples.iter().take(LISTED).map(u64::to_string).collect();
    if samples.len() > LISTED {
        text.push(format!("… {} more", samples.len() - LISTED));
    }
    if text.is_empty() { String::new() } else { format!(": {}", text.join(", ")) }
}

fn print(found: &[ScenarioComparison], notes: &[String], code: ExitCode) {
    for note in notes {
        outln!("differs: {note}");
    }
    for scenario in found {
        outln!("{}: {} samples, {} the same to the last bit", scenario.scenario, scenario.samples, scenario.same);
        outln!("  {:>6} newly failing{}", scenario.newly_failing.len(), listed(&scenario.newly_failing));
        outln!("  {:>6} fixed{}", scenario.fixed.len(), listed(&scenario.fixed));
        outln!("  {:>6} failing in both", scenario.still_failing);
        if !scenario.newly_in_error.is_empty() {
            outln!("  {:>6} newly in error{}", scenario.newly_in_error.len(), listed(&scenario.newly_in_error));
        }
        if !scenario.no_longer_in_error.is_empty() {
            let gone = &scenario.no_longer_in_error;
            outln!("  {:>6} no longer in error{}", gone.len(), listed(gone));
        }
        for moved in &scenario.margins {
            let Some([before, now]) = moved.means() else { continue };
            out!("  {:<16} mean {before:.3}, now {now:.3} ({:+.3})", moved.key, now - before);
            if let Some((sample, change)) = moved.worst {
                out!("; sample {sample} lost most ({change:+.3})");
            }
            outln!();
        }
    }
    outln!("{}", word(code));
}

fn to_json(found: &[ScenarioComparison], notes: &[String], code: ExitCode) -> Value {
    let scenario = |scenario: &ScenarioComparison| {
        let margins: Map<String, Value> = scenario
            .margins
            .iter()
            .map(|moved| {
                let means = moved.means();
                let of = |place: usize| means.map(|means| means[place]);
                let (sample, change) = (moved.worst.map(|worst| worst.0), moved.worst.map(|worst| worst.1));
                let value = json!({
                    "samples": moved.samples, "mean_baseline": of(0), "mean": of(1),
                    "worst_sample": sample, "worst_change": change,
                });
                (moved.key.to_owned(), value)
            })
            .collect();
        let object = json!({
            "samples": scenario.samples,
            "same": scenario.same,
            "newly_failing": scenario.newly_failing,
            "fixed": scenario.fixed,
            "still_failing": scenario.still_failing,
            "newly_in_error": scenario.newly_in_error,
            "no_longer_in_error": scenario.no_longer_in_error,
            "margins": margins,
        });
        (scenario.scenario.clone(), object)
    };
    json!({
        "verdict": if code == ExitCode::Pass { "PASS" } else { "FAIL" },
        "differences": notes,
        "scenarios": found.iter().map(scenario).collect::<Map<String, Value>>(),
    })
}
