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
    reported(|findings| campaign(findings).unwrap().into_string())
}

/// Returns the data of a report of 30 samples with and without the margin increase system.
fn reported(report: impl FnOnce(&Findings<'_>) -> String) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/library/low-thw-overtake.toml");
    let file = ScenarioFile::load(&path, &[]).unwrap();
    let sampling = Sampling { seed: 1, design: Design::Random, samples: 30 };
    let controllers = vec![ControllerChoice::ACC, ControllerChoice::MIS];
    let mut plan = Plan::new(vec![file], sampling, controllers).unwrap();
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
    let xml = reported(|findings| {
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
        "figure { overflow-x: auto; } figure svg { width: auto; min-width: 640px; max-width: none !important; }",
        ".stills svg, .pair svg { min-width: 560px;",
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
