//! The reports of a campaign: an HTML page, a step summary, JUnit and Parquet.

use std::fs;
use std::path::PathBuf;
use std::process::Command;
use std::sync::LazyLock;

use closecall_testing::browser;

use crate::support::{folder, library, program, shared_folder, stdout, words_of_gate};

/// A campaign of two scenarios with 480 samples each, with the fast sensors, as the reports do not
/// depend on them.
struct Reported {
    out: PathBuf,
    /// The step summary of the CI server.
    step: PathBuf,
    printed: String,
}

impl Reported {
    fn new(more: &[&str], expected: i32) -> Self {
        let folder = shared_folder();
        let [out, step] = ["out", "step.md"].map(|name| folder.join(name));
        fs::write(&step, EARLIER).unwrap();
        let mut command = program();
        command.arg("campaign").args(["low-thw-overtake-at-cut-out", "overtake-without-brake"].map(library));
        command.args(["-n", "480", "--seed", "1", "--paired", "--sensors", "object"]).args(more);
        let output = command.arg("--out").arg(&out).env("GITHUB_STEP_SUMMARY", &step).output().unwrap();
        Self { out, step, printed: stdout(&output, expected) }
    }
}

const EARLIER: &str = "the summary of an earlier step\n";

static PASSED: LazyLock<Reported> = LazyLock::new(|| Reported::new(&["--recordings", "0"], 0));
static FAILED: LazyLock<Reported> =
    LazyLock::new(|| Reported::new(&["--recordings", "1", "--gate", "count(ego_collided) <= 0"], 1));

/// Returns the values of an attribute in a page.
fn attributes<'a>(page: &'a str, name: &str) -> Vec<&'a str> {
    let opening = format!(" {name}=\"");
    page.match_indices(&opening).filter_map(|(index, _)| page[index + opening.len()..].split('"').next()).collect()
}

#[test]
fn the_page_loads_nothing_and_holds_the_reasons_of_the_verdict() {
    let Reported { out, printed, .. } = &*FAILED;
    let page = fs::read_to_string(out.join("report.html")).unwrap();
    for loaded in ["<script", "<link", "<iframe", "<img", "@import", "http-equiv"] {
        assert!(!page.contains(loaded), "{loaded}");
    }
    // An address in a drawing names another part of it.
    assert_eq!(page.matches("url(").count(), page.matches("url(#").count());
    assert!(attributes(&page, "src").is_empty());
    // Links lead to parts of the page, or to existing files of this folder.
    let links = attributes(&page, "href");
    assert!(links.iter().any(|link| link.ends_with(".rrd")), "{links:?}");
    for link in links {
        match link.strip_prefix('#') {
            Some(part) => assert!(page.contains(&format!("id=\"{part}\"")), "{link}"),
            None => assert!(out.join(link).is_file(), "{link}"),
        }
    }
    let reasons: Vec<&str> =
        printed.lines().skip_while(|line| !line.starts_with("FAIL")).skip(1).map(str::trim).collect();
    assert!(!reasons.is_empty());
    for reason in reasons {
        let escaped = words_of_gate(reason).replace('<', "&lt;").replace('>', "&gt;").replace(" %", "\u{a0}%");
        assert!(page.contains(&escaped), "{reason}");
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
    // Every opened element is closed.
    for element in ["table", "tr", "td", "section", "figure", "svg", "div", "p", "ul", "header", "main", "body", "html"]
    {
        let opened = page.matches(&format!("<{element}>")).count() + page.matches(&format!("<{element} ")).count();
        assert_eq!(opened, page.matches(&format!("</{element}>")).count(), "{element}");
    }
}

#[test]
fn a_browser_shows_every_element_of_the_page() {
    let Some(browser) = browser() else { return };
    let folder = folder();
    let out = &PASSED.out;
    let address = format!("file://{}", out.join("report.html").display());
    let profile = format!("--user-data-dir={}", folder.path().join("profile").display());
    let shown = Command::new(browser)
        .args(["--headless", "--no-sandbox", "--disable-gpu", &profile, "--dump-dom", &address])
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&shown.stdout);
    // The browser's document has the verdict as its title, and the charts with their bars and
    // points.
    assert!(text.contains("<title>PASS: low-thw-overtake-at-cut-out, overtake-without-brake</title>"), "{text}");
    let file = fs::read_to_string(out.join("report.html")).unwrap();
    for element in ["<svg", "<circle", "<rect", "<table", "<tr"] {
        assert_eq!(text.matches(element).count(), file.matches(element).count(), "{element}");
    }
}

#[test]
fn the_summary_is_appended_to_the_step_summary_of_the_ci_server() {
    let text = fs::read_to_string(&PASSED.step).unwrap();
    let summary = fs::read_to_string(PASSED.out.join("summary.md")).unwrap();
    assert_eq!(text, format!("{EARLIER}{summary}"));
    assert!(summary.starts_with("## Closecall: PASS"), "{summary}");
    assert!(
        summary.contains("| low-thw-overtake-at-cut-out | mis | 480 |")
            && summary.contains("| MIS-1 | low-thw-overtake-at-cut-out | met |"),
        "{summary}"
    );
    // Every row of a table has as many cells as the head.
    for table in summary.split("\n\n").filter(|block| block.starts_with('|')) {
        let cells: Vec<usize> = table.lines().map(|line| line.matches('|').count()).collect();
        assert!(cells.iter().all(|count| *count == cells[0]), "{table}");
    }
}

#[test]
fn the_step_summary_names_the_worst_recorded_samples_without_a_link_into_the_folder() {
    let text = fs::read_to_string(&FAILED.step).unwrap();
    let summary = fs::read_to_string(FAILED.out.join("summary.md")).unwrap();
    let worst: Vec<&str> = summary.lines().filter_map(|line| Some(line.split_once(" ([incident card](")?.0)).collect();
    assert!(!worst.is_empty(), "{summary}");
    for line in worst {
        assert!(text.contains(line), "{line}: {text}");
    }
    assert!(text.contains("`recordings/") && !text.contains("](recordings/"), "{text}");
}

#[test]
fn the_samples_have_a_case_for_every_outcome_and_attachments_that_exist() {
    let out = &FAILED.out;
    let xml = fs::read_to_string(out.join("samples.xml")).unwrap();
    assert_eq!(xml.matches("<testcase ").count(), 2 * 2 * 480);
    assert!(xml.contains("<testsuites name=\"closecall\" tests=\"1920\""));
    let failures = xml.matches("<failure ").count();
    assert!(failures > 0 && xml.contains(&format!("failures=\"{failures}\"")), "{failures}");
    let attached: Vec<&str> = xml
        .match_indices("[[ATTACHMENT|")
        .filter_map(|(index, opening)| xml[index + opening.len()..].split("]]").next())
        .collect();
    assert!(!attached.is_empty());
    for path in attached {
        assert!(out.join(path).is_file(), "{path}");
    }
}

#[test]
fn junit_fails_for_failed_gates_and_for_nothing_else() {
    let xml = fs::read_to_string(FAILED.out.join("junit.xml")).unwrap();
    // The headline has collisions with the system; the scenario without braking has none.
    assert_eq!(xml.matches("<failure ").count(), 1, "{xml}");
    assert!(xml.contains("low-thw-overtake-at-cut-out: count(ego_collided) &lt;= 0"), "{xml}");
    assert_eq!(xml.matches("<error ").count(), 0, "{xml}");
}

#[test]
fn the_parquet_file_holds_the_units_of_its_columns() {
    let bytes = fs::read(PASSED.out.join("outcomes.parquet")).unwrap();
    let text = String::from_utf8_lossy(&bytes);
    for key in ["unit:param_closing_mps", "closecall:manifest", "unit:min_ttc_rear_s", "unit:max_jerk_mps3"] {
        assert!(text.contains(key), "{key}");
    }
}
