//! What a campaign leaves for people and for CI servers.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::support::{folder, library, skipped, stdout};

fn campaign(out: &Path, more: &[&str], summary: Option<&Path>, expected: i32) -> String {
    let scenarios = ["low-thw-overtake", "overtake-without-brake"].map(library);
    let mut command = Command::new(env!("CARGO_BIN_EXE_closecall"));
    command.current_dir(env!("CARGO_MANIFEST_DIR")).arg("campaign").args(&scenarios);
    command.args(["-n", "120", "--seed", "1", "--paired"]).args(more).arg("--out").arg(out);
    match summary {
        Some(path) => command.env("GITHUB_STEP_SUMMARY", path),
        None => command.env_remove("GITHUB_STEP_SUMMARY"),
    };
    stdout(&command.output().unwrap(), expected)
}

/// The values of an attribute in a page.
fn attributes<'a>(page: &'a str, name: &str) -> Vec<&'a str> {
    let opening = format!(" {name}=\"");
    page.match_indices(&opening).filter_map(|(place, _)| page[place + opening.len()..].split('"').next()).collect()
}

#[test]
fn the_page_is_alone_and_says_what_the_program_says() {
    let folder = folder();
    let out = folder.path().join("out");
    let printed = campaign(&out, &["--max-collisions", "0", "--recordings", "1"], None, 1);
    let page = fs::read_to_string(out.join("report.html")).unwrap();
    for loaded in ["<script", "<link", "<iframe", "<img", "url(", "@import", "http-equiv"] {
        assert!(!page.contains(loaded), "{loaded}");
    }
    assert!(attributes(&page, "src").is_empty());
    // Links lead to files of this folder, and they are there.
    let links = attributes(&page, "href");
    assert!(links.iter().any(|link| link.ends_with(".rrd")), "{links:?}");
    for link in links {
        assert!(out.join(link).is_file(), "{link}");
    }
    let reasons: Vec<&str> = printed.lines().skip_while(|line| *line != "FAIL").skip(1).map(str::trim).collect();
    assert!(!reasons.is_empty());
    for reason in reasons {
        assert!(page.contains(reason), "{reason}");
    }
    for part in [
        "Requirements",
        "MIS-1",
        "MIS-3",
        "Outcome map",
        "Margins of the ego",
        "Coverage",
        "Slowest samples",
        "prevented",
    ] {
        assert!(page.contains(part), "{part}");
    }
    // Every element that is opened is closed.
    for element in ["table", "tr", "td", "section", "figure", "svg", "div", "p", "ul", "header", "main", "body", "html"]
    {
        let opened = page.matches(&format!("<{element}>")).count() + page.matches(&format!("<{element} ")).count();
        assert_eq!(opened, page.matches(&format!("</{element}>")).count(), "{element}");
    }
}

#[test]
fn a_browser_shows_the_page() {
    let Some(browser) = ["chromium", "chromium-browser", "google-chrome"]
        .into_iter()
        .find(|name| Command::new(name).arg("--version").output().is_ok_and(|found| found.status.success()))
    else {
        skipped("there is no Chromium");
        return;
    };
    let folder = folder();
    let out = folder.path().join("out");
    campaign(&out, &["--recordings", "0"], None, 0);
    let address = format!("file://{}", out.join("report.html").display());
    let profile = format!("--user-data-dir={}", folder.path().join("profile").display());
    let shown = Command::new(browser)
        .args(["--headless", "--no-sandbox", "--disable-gpu", &profile, "--dump-dom", &address])
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&shown.stdout);
    // What the browser made of the page: charts with their bars and points, and the verdict as the title.
    assert!(text.contains("<title>PASS: low-thw-overtake, overtake-without-brake</title>"), "{text}");
    let file = fs::read_to_string(out.join("report.html")).unwrap();
    for element in ["<svg", "<circle", "<rect", "<table", "<tr"] {
        assert_eq!(text.matches(element).count(), file.matches(element).count(), "{element}");
    }
}

#[test]
fn the_step_summary_is_appended_to_where_one_is_asked_for() {
    let folder = folder();
    let out = folder.path().join("out");
    let summary = folder.path().join("step.md");
    fs::write(&summary, "what an earlier step said\n").unwrap();
    campaign(&out, &["--recordings", "0"], Some(&summary), 0);
    let text = fs::read_to_string(&summary).unwrap();
    let own = fs::read_to_string(out.join("summary.md")).unwrap();
    assert_eq!(text, format!("what an earlier step said\n{own}"));
    assert!(own.starts_with("## Closecall: PASS"), "{own}");
    assert!(own.contains("| low-thw-overtake | mis | 120 |") && own.contains("| MIS-1 | low-thw-overtake ("), "{own}");
    // Tables are whole: every row has as many cells as its head.
    for table in own.split("\n\n").filter(|block| block.starts_with('|')) {
        let cells: Vec<usize> = table.lines().map(|line| line.matches('|').count()).collect();
        assert!(cells.iter().all(|count| *count == cells[0]), "{table}");
    }
}

#[test]
fn junit_has_a_case_for_every_outcome_and_attachments_that_are_there() {
    let folder = folder();
    let out = folder.path().join("out");
    campaign(&out, &["--recordings", "1"], None, 0);
    let xml = fs::read_to_string(out.join("junit.xml")).unwrap();
    assert_eq!(xml.matches("<testcase ").count(), 2 * 2 * 120);
    assert!(xml.contains("<testsuites name=\"closecall\" tests=\"480\""));
    let failures = xml.matches("<failure ").count();
    assert!(failures > 0 && xml.contains(&format!("failures=\"{failures}\"")), "{failures}");
    let attached: Vec<&str> = xml
        .match_indices("[[ATTACHMENT|")
        .filter_map(|(place, opening)| xml[place + opening.len()..].split("]]").next())
        .collect();
    assert!(!attached.is_empty());
    for path in attached {
        assert!(out.join(path).is_file(), "{path}");
    }
}

#[test]
fn units_stand_in_the_metadata_of_the_table() {
    let folder = folder();
    let out = folder.path().join("out");
    campaign(&out, &["--recordings", "0"], None, 0);
    let bytes = fs::read(out.join("outcomes.parquet")).unwrap();
    let text = String::from_utf8_lossy(&bytes);
    for key in ["unit:param:closing-mps", "unit:min_ttc_rear_s", "unit:max_jerk_mps3"] {
        assert!(text.contains(key), "{key}");
    }
}
