//! The page of a small campaign that is run here.

use std::ops::ControlFlow;
use std::path::Path;

use closecall_campaign::gate::GateSet;
use closecall_campaign::manifest::Manifest;
use closecall_campaign::plan::Plan;
use closecall_campaign::runner::Sampling;
use closecall_scenarios::ScenarioFile;
use closecall_scenarios::sampling::Design;
use closecall_sensors::SensorMode;
use closecall_simulation::controller::ControllerChoice;

use super::report::campaign;
use crate::campaign::findings::{Findings, Recordings};
use crate::campaign::junit::write_junit;
use crate::campaign::timings::Timing;
use crate::campaign::xunit_schema::against_schema;
use crate::campaign::{Still, Tally};

/// Returns the page of 30 samples with and without the margin increase system.
fn page() -> String {
    reported(&["low-thw-overtake"], 30, |findings| campaign(findings).unwrap().into_string())
}

/// Returns what a report makes of some samples of scenarios of the library with and without the margin increase system.
fn reported(names: &[&str], samples: u64, report: impl FnOnce(&Findings<'_>) -> String) -> String {
    reported_with(names, samples, vec![ControllerChoice::ACC, ControllerChoice::MIS], report)
}

/// Returns what a report makes of some samples of scenarios of the library with these controllers.
fn reported_with(
    names: &[&str],
    samples: u64,
    controllers: Vec<ControllerChoice>,
    report: impl FnOnce(&Findings<'_>) -> String,
) -> String {
    let library = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/library");
    let file = |name: &&str| ScenarioFile::load(&library.join(format!("{name}.toml")), &[]).unwrap();
    let sampling = Sampling { seed: 1, design: Design::Random, samples };
    let mut plan = Plan::new(names.iter().map(file).collect(), sampling, controllers).unwrap();
    plan.sensors = Some(SensorMode::GroundTruth);
    let (running, manifest): (_, Manifest) = (plan.campaign(), plan.manifest(vec!["closecall".to_owned()]).unwrap());
    let gates = GateSet::of(["count(ego_collided) <= 0".parse().unwrap()]);
    let mut tally = Tally::new(&running, &gates);
    running
        .run(None, |turn| {
            tally.push(turn.record);
            ControlFlow::Continue(())
        })
        .unwrap();
    let judged = tally.judgement();
    let files: Vec<&ScenarioFile> = running.works.iter().map(|work| &work.file).collect();
    let (scenario, controller) = ("low-thw-overtake".to_owned(), "mis".to_owned());
    let worst = tally.overview.scenarios[0].worst[0].sample;
    let key = (scenario.clone(), worst, controller.clone());
    let recordings: Recordings = [(key, "recordings/low-thw-overtake-1.rrd".to_owned())].into_iter().collect();
    let findings = Findings {
        manifest: &manifest,
        files: &files,
        summary: &tally.summary,
        judged: &judged,
        overview: &tally.overview,
        recordings: &recordings,
        stills: &[Still {
            scenario: scenario.clone(),
            sample: worst,
            verdict: "BOTH COLLIDE",
            sentence: "R struck E from behind".to_owned(),
            svg: "<svg></svg>".to_owned(),
        }],
        gallery: Some("recordings/index.html"),
        folder: None,
        slowest: &[Timing { scenario, sample: 1, controller, wall_s: 0.25 }],
        command_for: |action| format!("closecall {action:?}"),
    };
    report(&findings)
}

#[test]
fn the_verdict_for_ci_servers_is_valid_by_the_schema_of_xunit() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("junit.xml");
    let xml = reported(&["low-thw-overtake"], 30, |findings| {
        write_junit(&path, findings, &[("low-thw-overtake".to_owned(), 1.25)]).unwrap();
        std::fs::read_to_string(&path).unwrap()
    });
    assert_eq!(against_schema(&xml), Vec::<String>::new(), "{xml}");
    assert!(xml.contains("<testsuite name=\"low-thw-overtake\"") && xml.contains("time=\"1.250\""), "{xml}");
    // The cases of a suite have its time together.
    let suite = xml.split("<testsuite ").find(|suite| suite.starts_with("name=\"low-thw-overtake\"")).unwrap();
    let time_s = |part: &str| part.split("time=\"").nth(1)?.split('"').next()?.parse::<f64>().ok();
    let cases: Vec<f64> = suite.split("<testcase ").skip(1).filter_map(time_s).collect();
    assert_eq!(cases.len(), suite.matches("<testcase ").count());
    assert!((cases.iter().sum::<f64>() - 1.25).abs() < 0.01 && cases.iter().all(|case_s| *case_s > 0.0), "{xml}");
}

#[test]
fn a_campaigns_page_has_all_parts_and_loads_nothing() {
    let page = page();
    for part in [
        "Collisions of the ego",
        "What the controller under test changes",
        "Requirements",
        "Worst samples",
        "recordings/low-thw-overtake-1.rrd",
        "Outcome map",
        "Margins of the ego",
        "Coverage of the sampled values",
        "Slowest samples",
        "How it was made",
        "closing [m/s]",
        "<a href=\"#part-0\">Gates</a>",
        "FAIL: the scenario misses a ",
        "R struck E from behind",
        "E is the ego, F the lead vehicle, R the rear vehicle",
        "recordings/low-thw-overtake-1.html",
        "Signature",
        "page written on",
        "prefers-color-scheme: dark",
        "figure svg { display: block; width: 100%; height: auto; margin: 0 auto; }",
    ] {
        assert!(page.contains(part), "{part}");
    }
    for loaded in ["<script", "<link", "<iframe", "<img", "url(", "@import", "http-equiv"] {
        assert!(!page.contains(loaded), "{loaded}");
    }
    for element in ["table", "tr", "td", "section", "figure", "svg", "div", "p", "ul", "header", "main", "body", "html"]
    {
        let opened = page.matches(&format!("<{element}>")).count() + page.matches(&format!("<{element} ")).count();
        assert_eq!(opened, page.matches(&format!("</{element}>")).count(), "{element}");
    }
    // Two arms, and the balance of pairs; one map, the margins and the coverage of each parameter.
    assert!(page.matches("<svg").count() > 3 + 1 + 8, "{}", page.matches("<svg").count());
}

/// Returns the head of a page.
fn head_of(page: &str) -> &str {
    page.split_once("</header>").unwrap().0.split_once("<header").unwrap().1
}

#[test]
fn the_first_screen_has_the_unmet_gate_right_below_the_sentence_and_then_the_counts() {
    let page = page();
    let head = head_of(&page);
    let at = |text: &str| head.find(text).unwrap_or_else(|| panic!("{text}: {head}"));
    let order = [
        "FAIL: the scenario misses a ",
        "NOT MET: low-thw-overtake: ",
        " collisions prevented, ",
        "30 samples, random design",
        "Reviewed by",
    ]
    .map(at);
    assert!(order.is_sorted(), "{order:?}: {head}");
}

#[test]
fn the_first_screen_of_a_campaign_without_a_baseline_counts_its_collisions() {
    let controllers = vec![ControllerChoice::ACC];
    let page = reported_with(&["low-thw-overtake"], 30, controllers, |findings| {
        let collisions = findings.summary.total().arms[0].collisions;
        assert!(collisions > 0);
        let stated = format!("<p class=\"headline\">the ego collides in {collisions} of 30 samples</p>");
        campaign(findings).unwrap().into_string().replace(&stated, "STATED")
    });
    let head = head_of(&page);
    assert!(head.contains("STATED") && !head.contains("collisions prevented,"), "{head}");
}

/// More scenarios than the first screen has room for. The first has gates that fail or stay open.
const MANY: [&str; 7] = [
    "low-thw-overtake",
    "overtake-without-brake",
    "slow-approach",
    "left-lane-blocked",
    "rear-follower-stays",
    "cut-in-into-margin",
    "empty-wet-road",
];

/// Returns a page without its folded parts.
fn without_folds(page: &str) -> String {
    let mut shown = String::new();
    let mut depth = 0_usize;
    for (index, part) in page.split("<details>").enumerate() {
        depth += usize::from(index > 0);
        for (number, piece) in part.split("</details>").enumerate() {
            depth -= usize::from(number > 0);
            if depth == 0 {
                shown.push_str(piece);
            }
        }
    }
    shown
}

#[test]
fn the_first_screen_of_many_scenarios_has_the_gates_and_no_list_of_their_names_or_expectations() {
    let page = reported(&MANY, 2, |findings| campaign(findings).unwrap().into_string());
    assert!(page.contains(": 7 scenarios</title>"), "{}", &page[..300]);
    let shown = without_folds(&page);
    let (head, body) = shown.split_once("</header>").unwrap();
    let head = head.split_once("<header").unwrap().1;
    // The sentence of the verdict names a few.
    assert!(MANY.iter().filter(|name| head.contains(**name)).count() < 5, "{head}");
    for folded in ["happened as expected", "extrapolates beyond recorded traffic", ">Collisions of the ego</h2>"] {
        assert!(page.contains(folded) && !shown.contains(folded), "{folded}");
    }
    let at = |text: &str| body.find(text).unwrap_or_else(|| panic!("{text}"));
    let order = ["; required: at ", "Counts of each scenario", "Worst samples of all scenarios"].map(at);
    assert!(order.is_sorted(), "{order:?}");
    // One row for each scenario on paper, and the words that are folded on the screen.
    let paper = body.split_once("<div class=\"paper counts\">").unwrap().1.split_once("</table>").unwrap().0;
    assert_eq!(paper.matches("<tr").count(), 1 + MANY.len(), "{paper}");
    assert!(MANY.iter().all(|name| paper.contains(&format!(">{name}</td>"))), "{paper}");
}

#[test]
fn paper_begins_with_the_signature_and_leaves_out_what_is_folded_and_each_scenario() {
    let page = page();
    assert!(page.find("Signature").unwrap() < page.find("<h2").unwrap());
    assert_eq!(page.matches("<section class=\"scenario\">").count(), 1);
    let (_, print) = page.split_once("/* Paper has what is signed").unwrap();
    let rule = print.split_once("*/").unwrap().1.trim_start();
    assert!(rule.starts_with("details, .scenario, .screen { display: none; } .paper { display: block; }"), "{rule}");
    // Colours of rules for the screen do not enlarge what is printed, and a link without words has a name.
    assert!(!page.contains("@media (max-width: 1600px)"));
    // The name of the link is what it shows: a name beside the texts of the picture would differ from them.
    let named = "<a href=\"recordings/low-thw-overtake-1.rrd\"><span role=\"img\" aria-label=\"Recording of low-thw-overtake, sample ";
    assert!(page.contains(named), "a link to a recording");
}
