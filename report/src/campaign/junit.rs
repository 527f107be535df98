//! The verdict of a campaign as JUnit XML, which CI servers show: one suite for each scenario, one
//! case for each gate and each check of a requirement.
//!
//! | case | passes | fails | error | skipped |
//! |---|---|---|---|---|
//! | gate, requirement check | met | not met | the samples do not decide it | it cannot be checked in this campaign, or the campaign is only measured |
//! | probability gate | shown | refuted | not decided | |
//! | `at most N flaky samples` | met | not met | | the campaign is only measured |
//! | `verdict` | PASS, measured | | ERROR, INVALID, INCONCLUSIVE, NOT JUDGED, OVERRIDDEN | FAIL: the gates say it |
//!
//! The failures are the failed gates and requirement checks, and nothing else. Samples stand in
//! `samples.xml`.
//!
//! By the convention of JUnit, the time of a suite is the sum of the times of its cases, and not
//! the time on the clock while they ran side by side. The time of a suite is the time of its
//! samples, summed over all threads. Its cases are judged on the same samples: each has an equal
//! share of the time.
//!
//! Both files are valid by the schema of Jenkins' plugin xUnit (`junit-10.xsd`). The library
//! `quick-junit` does not write them: version 0.8.0 adds `skipped` to `testsuites`, which the
//! schema refuses, and holds all cases of a file in memory.

use std::io::{self, Write};
use std::path::Path;

use closecall_campaign::action::Action;
use closecall_campaign::arm_pairs::{PairResult, pair_results};
use closecall_campaign::gate::{GateResult, Standing};
use closecall_campaign::probability::Answer;
use closecall_campaign::summary::{Counts, Summary};
use closecall_campaign::verdict::{Judgement, Verdict};
use closecall_traffic::atomic::{WriteError, write_file};
use closecall_traffic::words::counted;
use quick_xml::Writer;
use quick_xml::events::{BytesDecl, BytesEnd, BytesStart, BytesText, Event};

use super::findings::Findings;
use super::overview::ErrorGroup;
use super::recordings::card_beside;
use super::samples_xml::legal_xml;
use super::words::{gate_line, probability_line, reasons};

/// The answer of one case.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Status {
    Passed,
    Failed,
    Error,
    Skipped,
}

/// One case: a gate, the check of a requirement, or the verdict.
#[derive(Clone, Debug)]
struct Case {
    suite: String,
    name: String,
    status: Status,
    message: String,
}

/// The suite of what concerns all scenarios together.
const CAMPAIGN_SUITE: &str = "campaign";

fn cases(judged: &Judgement, summary: &Summary) -> Vec<Case> {
    let is_measured = judged.verdict().is_none();
    let gate = |gate: &GateResult| Case {
        suite: gate.scenario.clone(),
        name: gate.name(),
        status: match gate.standing() {
            Standing::Pass => Status::Passed,
            Standing::Fail if !is_measured => Status::Failed,
            Standing::Inconclusive if !is_measured => Status::Error,
            Standing::Fail | Standing::Inconclusive | Standing::NotChecked => Status::Skipped,
        },
        message: gate_line(gate),
    };
    let mut cases: Vec<Case> = judged.gates.iter().map(gate).collect();
    for (scenario, finding) in &judged.probabilities {
        cases.push(Case {
            suite: scenario.clone(),
            name: format!("{scenario}: probability of a collision at most {}", finding.max),
            status: match finding.answer {
                Answer::Below => Status::Passed,
                Answer::Above => Status::Failed,
                Answer::Open => Status::Error,
            },
            message: probability_line(scenario, finding, summary),
        });
    }
    if let Some(gate) = judged.flaky {
        cases.push(Case {
            suite: CAMPAIGN_SUITE.to_owned(),
            name: format!("at most {}", counted(gate.max, "flaky sample")),
            status: match (gate.is_met(), is_measured) {
                (true, _) => Status::Passed,
                (false, false) => Status::Failed,
                (false, true) => Status::Skipped,
            },
            message: gate.to_string(),
        });
    }
    cases.push(Case {
        suite: CAMPAIGN_SUITE.to_owned(),
        name: "verdict".to_owned(),
        status: match judged.verdict() {
            None | Some(Verdict::Pass) => Status::Passed,
            Some(Verdict::Fail) => Status::Skipped,
            Some(
                Verdict::Error | Verdict::Invalid | Verdict::Inconclusive | Verdict::NotJudged | Verdict::Overridden,
            ) => Status::Error,
        },
        message: format!("{}: {}", judged.word(), reasons(judged).join("; ")),
    });
    cases
}

/// Writes the file. `wall_s` is the wall time of the samples of each scenario (s), by name.
///
/// # Errors
/// [`WriteError`] if the file cannot be written. An existing file then stays as it is.
pub fn write_junit(path: &Path, findings: &Findings<'_>, wall_s: &[(String, f64)]) -> Result<(), WriteError> {
    write_file(path, |file| report(file, findings, wall_s))
}

fn report(file: impl Write, findings: &Findings<'_>, wall_s: &[(String, f64)]) -> io::Result<()> {
    let cases = cases(findings.judged, findings.summary);
    let mut xml = Writer::new_with_indent(file, b' ', 4);
    xml.write_event(Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None)))?;
    let all: Vec<&Case> = cases.iter().collect();
    let total_s = wall_s.iter().map(|(_, wall_s)| wall_s).sum();
    xml.write_event(Event::Start(totals("testsuites", "closecall", &all, total_s)))?;
    let scenarios = findings.files.iter().map(|file| file.config().name.clone());
    for suite in scenarios.chain([CAMPAIGN_SUITE.to_owned()]) {
        let of_suite: Vec<&Case> = cases.iter().filter(|case| case.suite == suite).collect();
        let suite_s = wall_s.iter().find(|(name, _)| *name == suite).map_or(0.0, |(_, wall_s)| *wall_s);
        xml.write_event(Event::Start(totals("testsuite", &suite, &of_suite, suite_s)))?;
        properties(&mut xml, findings, &suite)?;
        let share_s = suite_s / of_suite.len().max(1) as f64;
        for case in of_suite {
            write_case(&mut xml, case, share_s)?;
        }
        xml.write_event(Event::End(BytesEnd::new("testsuite")))?;
    }
    xml.write_event(Event::End(BytesEnd::new("testsuites")))?;
    xml.into_inner().write_all(b"\n")
}

fn totals<'a>(element: &'a str, name: &'a str, cases: &[&Case], wall_s: f64) -> BytesStart<'a> {
    let count = |status| cases.iter().filter(|case| case.status == status).count().to_string();
    let mut start = BytesStart::new(element);
    start.push_attribute(("name", name));
    start.push_attribute(("tests", cases.len().to_string().as_str()));
    // The schema has the count of each suite, and not the sum.
    if element == "testsuite" {
        start.push_attribute(("skipped", count(Status::Skipped).as_str()));
    }
    start.push_attribute(("errors", count(Status::Error).as_str()));
    start.push_attribute(("failures", count(Status::Failed).as_str()));
    start.push_attribute(("time", format!("{wall_s:.3}").as_str()));
    start
}

/// Writes the basis of a suite: seed, settings, and the counts of each controller.
fn properties<W: Write>(xml: &mut Writer<W>, findings: &Findings<'_>, suite: &str) -> io::Result<()> {
    let manifest = findings.manifest;
    let mut properties = vec![
        ("seed".to_owned(), manifest.sampling.seed.to_string()),
        ("closecall".to_owned(), manifest.closecall_version.clone()),
        ("command".to_owned(), (findings.command_for)(&Action::Repeat(&manifest.command))),
    ];
    properties.extend(manifest.settings().iter().map(|setting| ("setting".to_owned(), setting.to_string())));
    if let Some((_, counts)) = findings.summary.scenarios.iter().find(|(name, _)| name == suite) {
        properties.push(("samples".to_owned(), counts.samples.to_string()));
        for (controller, arm) in findings.summary.controllers.iter().zip(&counts.arms) {
            properties.push((format!("{controller}.collisions"), arm.collisions.to_string()));
            properties.push((format!("{controller}.touches"), arm.touches.to_string()));
            properties.push((format!("{controller}.imposed_hard"), arm.imposed.to_string()));
            properties.push((format!("{controller}.errors"), arm.errors.to_string()));
            properties.push((format!("{controller}.flaky"), arm.flaky.to_string()));
        }
        if let Some(scenario) = findings.overview.scenarios.iter().find(|scenario| scenario.name == suite) {
            let first = |(arm, flaky): (&String, &ErrorGroup)| {
                (format!("{arm}.flaky.first"), format!("sample {}: {}", flaky.first_sample, flaky.message))
            };
            properties.extend(scenario.flaky.iter().map(first));
        }
        let of_suite = findings.worst_stills().into_iter().filter(|(still, _)| still.scenario == suite);
        properties.extend(of_suite.map(|(_, recording)| ("incident card".to_owned(), card_beside(recording))));
        if findings.summary.has_references() {
            properties.extend(arm_pair_properties(findings, counts));
        }
    }
    if suite == CAMPAIGN_SUITE {
        properties.extend(reasons(findings.judged).into_iter().map(|reason| ("reason".to_owned(), reason)));
    }
    xml.write_event(Event::Start(BytesStart::new("properties")))?;
    for (name, value) in properties {
        let property = xml.create_element("property").with_attribute(("name", legal_xml(&name).as_str()));
        property.with_attribute(("value", legal_xml(&value).as_str())).write_empty()?;
    }
    xml.write_event(Event::End(BytesEnd::new("properties")))
}

/// Returns the counts of all pairs of arms, such as `FROM.TO.prevented`.
fn arm_pair_properties(findings: &Findings<'_>, counts: &Counts) -> Vec<(String, String)> {
    let properties = |result: PairResult<'_>| {
        let pairs = result.pairs;
        let p_value = result.corrected_p.map_or_else(|| "-".to_owned(), |p| p.to_string());
        let values = [
            ("prevented", pairs.prevented.to_string()),
            ("induced", pairs.induced.to_string()),
            ("both", pairs.both.to_string()),
            ("neither", pairs.neither.to_string()),
            ("mcnemar_p_corrected", p_value),
        ];
        values.map(|(name, value)| (format!("{}.{}.{name}", result.baseline, result.tested), value))
    };
    pair_results(findings.summary, counts).into_iter().flat_map(properties).collect()
}

fn write_case<W: Write>(xml: &mut Writer<W>, case: &Case, share_s: f64) -> io::Result<()> {
    let mut start = BytesStart::new("testcase");
    start.push_attribute(("name", legal_xml(&case.name).as_str()));
    start.push_attribute(("classname", legal_xml(&case.suite).as_str()));
    start.push_attribute(("time", format!("{share_s:.3}").as_str()));
    xml.write_event(Event::Start(start))?;
    let element = match case.status {
        Status::Passed => None,
        Status::Failed => Some("failure"),
        Status::Error => Some("error"),
        Status::Skipped => Some("skipped"),
    };
    let message = legal_xml(&case.message);
    match element {
        Some(element) => {
            let element = xml.create_element(element).with_attribute(("message", message.as_str()));
            element.with_attribute(("type", "gate")).write_empty()?;
        }
        // What is met is read with its value, too.
        None => {
            xml.create_element("system-out").write_text_content(BytesText::new(&message))?;
        }
    }
    xml.write_event(Event::End(BytesEnd::new("testcase")))
}
