//! `closecall view DIR`: the explorer in a real browser, as a page that is served and as a file,
//! and attacks on its server.

use std::collections::BTreeMap;
use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};

use closecall_campaign::folder::Folder;
use closecall_campaign::record::Record;
use closecall_scenarios::harm::harm;
use closecall_testing::browser;
use serde_json::json;
use tempfile::TempDir;

use crate::foreign_folders::TELLING;
use crate::page::Page;
use crate::support::{code, folder, library, message, program, stdout};

/// The explorer of a campaign, while it is served.
struct Served {
    program: Child,
    address: String,
    written: TempDir,
}

impl Served {
    /// Serves the campaign in `folder`. A program that notes its arguments replaces the viewer.
    fn new(folder: &Path) -> Self {
        let written = crate::support::folder();
        let stand_in = Path::new(crate::support::ROOT).join("tests/fixtures/programs/rerun");
        let mut program = program();
        program
            .args(["view", "--port", "1"])
            .arg(folder)
            .env("WRITTEN", written.path())
            .env("CLOSECALL_RERUN", stand_in);
        program.env("BROWSER", "/nowhere/browser").env("PATH", "/nowhere:/usr/bin:/bin");
        let mut program = program.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
        let mut address = String::new();
        BufReader::new(program.stdout.take().unwrap()).read_line(&mut address).unwrap();
        Self { program, address: address.trim().to_owned(), written }
    }

    /// Returns host and port, and the path with the token.
    fn parts(&self) -> (&str, &str) {
        let rest = self.address.strip_prefix("http://").unwrap();
        let (host, _) = rest.split_once('/').unwrap();
        (host, &rest[host.len()..])
    }

    /// Asks for a path behind the token, and returns status and body.
    fn ask(&self, method: &str, path: &str) -> (u16, String) {
        let (host, token) = self.parts();
        let mut stream = TcpStream::connect(host).unwrap();
        write!(stream, "{method} {token}{path} HTTP/1.1\r\nHost: {host}\r\nOrigin: http://{host}\r\n\r\n").unwrap();
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer).unwrap();
        let answer = String::from_utf8_lossy(&answer).into_owned();
        let (head, body) = answer.split_once("\r\n\r\n").unwrap();
        (head.split_whitespace().nth(1).unwrap().parse().unwrap(), body.to_owned())
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        self.program.kill().unwrap();
        self.program.wait().unwrap();
    }
}

/// Runs a campaign. Returns its folder.
fn campaign(folder: &TempDir, samples: &str) -> PathBuf {
    let out = folder.path().join("out");
    let mut command = program();
    command.arg("campaign").arg(library("low-thw-overtake")).args(["-n", samples, "--seed", "1", "--paired"]);
    let ran = command.args(["--sensors", "object", "--out"]).arg(&out).output().unwrap();
    assert!([0, 1, 4].contains(&code(&ran)), "{}", message(&ran));
    out
}

fn open(folder: &TempDir, address: &str) -> Option<Page> {
    let mut page = Page::open(browser()?, &folder.path().join("profile"), address);
    page.wait_for("document.documentElement?.dataset.ready === 'yes'");
    Some(page)
}

/// Returns the requested addresses that do not begin like the page's own. Content of the page
/// itself is no request.
fn requests_but(page: &mut Page, server: &str) -> Vec<String> {
    let is_own = |url: &String| [server, "about:", "data:"].iter().any(|start| url.starts_with(start));
    page.requests().into_iter().filter(|url| !is_own(url)).collect()
}

/// Returns how many samples are chosen, from the line of counts.
const CHOSEN: &str = "Number(document.getElementById('counts').textContent.split(' of ')[0].replaceAll(',', ''))";

#[test]
fn a_failing_sample_is_found_looked_at_and_opened_in_the_viewer() {
    let folder = folder();
    let out = campaign(&folder, "300");
    let served = Served::new(&out);
    let Some(mut page) = open(&folder, &served.address) else { return };
    assert_eq!(page.evaluate(CHOSEN), json!(300));
    assert_eq!(page.evaluate("document.querySelectorAll('.js-plotly-plot').length"), json!(6));

    // A brush in the outcome map leaves the samples in it, in all charts. Escape clears it.
    let middle = "(() => { const box = document.querySelector('#map .nsewdrag').getBoundingClientRect(); \
                  return [box.left, box.top, box.width, box.height]; })()";
    page.set_window([1440, 900], false);
    page.evaluate("document.querySelector('#map').scrollIntoView(), new Promise(done => setTimeout(done, 500))");
    let at = page.evaluate(middle);
    let [left, top, width, height] = [0, 1, 2, 3].map(|index| at[index].as_f64().unwrap());
    let point = |x: f64, y: f64| [left + x * width, top + y * height];
    page.drag([point(0.2, 0.2), point(0.7, 0.8)]);
    page.wait_for(&format!("{CHOSEN} > 0 && {CHOSEN} < 300"));
    page.wait_for("!document.querySelector('#map [name=clear]').hidden");
    page.press("Escape", 27);
    page.wait_for(&format!("{CHOSEN} === 300"));
    // The chart tells of the brush later than this Escape. The brush stays cleared.
    page.drag([point(0.2, 0.2), point(0.7, 0.8)]);
    page.press("Escape", 27);
    page.evaluate("new Promise(done => setTimeout(done, 500))");
    assert_eq!(page.evaluate(CHOSEN), json!(300));

    // By the keyboard: a range of a histogram, and the number of a sample.
    page.evaluate("document.querySelector('#histogram-0 [name=from]').focus()");
    page.command("Input.insertText", &json!({ "text": "8" }));
    page.press("Enter", 13);
    page.evaluate("document.activeElement.blur()");
    page.wait_for(&format!("{CHOSEN} < 300"));
    page.evaluate("document.getElementById('reset').click()");
    page.wait_for(&format!("{CHOSEN} === 300"));

    // Without a number, and with one that no sample has, the field says so, and no sample is shown.
    let shown_before = page.evaluate("document.getElementById('sample').innerText");
    for wrong in ["", "300"] {
        let show = "document.querySelector('#filters [name=number]').value = 'WRONG'; document.querySelector('#filters [type=submit]').click()";
        page.evaluate(&show.replace("WRONG", wrong));
        let said = page.evaluate("document.querySelector('#filters [name=number]').validationMessage");
        assert_eq!(said, json!("No sample of this scenario has this number."), "{wrong}");
        assert_eq!(page.evaluate("document.getElementById('sample').innerText"), shown_before, "{wrong}");
    }

    // Outcomes are switched off: none but induced and shared collisions are left.
    page.evaluate(
        "document.querySelectorAll('#fates input').forEach(input => { if (input.value < 2 && input.checked) input.click(); })",
    );
    page.wait_for(&format!("{CHOSEN} < 60"));
    page.evaluate("document.querySelector('#list button').click()");
    page.wait_for("document.querySelectorAll('#sample .incident svg').length >= 4");
    let shown = page.evaluate("document.getElementById('sample').innerText");
    let shown = shown.as_str().unwrap();
    for part in ["struck E", "without MIS", "with MIS", "Parameters", "closecall replay"] {
        assert!(shown.contains(part), "{part}: {shown}");
    }
    // Both roads stand in one window, below the buttons and the verdict.
    let height_px = page.evaluate(
        "(() => { const roads = [...document.querySelectorAll('#sample .incident figure > svg:first-child')] \
         .map(svg => svg.getBoundingClientRect()); return roads.at(-1).bottom - roads[0].top; })()",
    );
    assert!((50.0..640.0).contains(&height_px.as_f64().unwrap()), "{height_px}");
    page.evaluate(
        "[...document.querySelectorAll('#sample button')].find(one => one.innerText === 'Passing twin').click()",
    );
    page.wait_for("document.getElementById('sample').innerText.includes('It passes when')");
    page.evaluate(
        "[...document.querySelectorAll('#sample button')].find(one => one.innerText === 'Open in Rerun').click()",
    );
    page.wait_for("document.querySelector('#sample [role=status]').innerText.includes('is open in the Rerun viewer')");
    let _ = fs::read_to_string(served.written.path().join("viewer")).unwrap();

    // Nothing is cut at any width, in either theme, and no request has left the machine.
    for (width, is_dark) in [(390, false), (390, true), (768, true), (1024, false), (1440, true), (1920, false)] {
        page.set_window([width, 900], is_dark);
        page.evaluate("new Promise(done => setTimeout(done, 300))");
        let over = page.evaluate("document.documentElement.scrollWidth - window.innerWidth");
        assert!(over.as_f64().unwrap() <= 0.0, "{width} px: {over}");
    }
    assert_eq!(requests_but(&mut page, &served.address), Vec::<String>::new());
    assert_eq!(page.errors(), Vec::<String>::new());
}

#[test]
fn the_file_needs_no_server_and_links_to_the_recorded_samples() {
    let folder = folder();
    let out = campaign(&folder, "100");
    let file = out.join("explorer.html");
    let exported = program().args(["view", "--export"]).arg(&file).arg(&out).output().unwrap();
    stdout(&exported, 0);
    // The page is written anew, and no other file of the folder is overwritten.
    stdout(&program().args(["view", "--export"]).arg(&file).arg(&out).output().unwrap(), 0);
    let refused = program().args(["view", "--export"]).arg(out.join("journal.jsonl")).arg(&out).output().unwrap();
    assert_eq!(code(&refused), 2, "{}", message(&refused));
    let Some(mut page) = open(&folder, &format!("file://{}", file.display())) else { return };
    page.evaluate("document.querySelector('#list a').closest('tr').querySelector('button').click()");
    let links =
        page.evaluate("[...document.querySelectorAll('#sample [role=status] a')].map(one => one.getAttribute('href'))");
    let links: Vec<&str> = links.as_array().unwrap().iter().filter_map(|link| link.as_str()).collect();
    assert_eq!(links.len(), 2);
    assert!(links.iter().all(|link| out.join(link).is_file()), "{links:?}");
    let shown = page.evaluate("document.getElementById('sample').innerText");
    let shown = shown.as_str().unwrap();
    assert!(!shown.contains("Open in Rerun"), "a file runs nothing");
    // Nobody is asked for the sample, and the page says what happened and why all the same.
    let (told, _) = shown.split_once("Parameters").unwrap();
    for part in ["acc: ", "mis: ", " struck ego at ", "reason of the MIS: "] {
        assert!(told.contains(part), "{part}: {told}");
    }
    assert_eq!(requests_but(&mut page, "file:"), Vec::<String>::new());
    assert_eq!(page.errors(), Vec::<String>::new());
}

#[test]
fn the_list_is_in_the_order_of_harm_and_says_how_many_samples_it_leaves_out() {
    let folder = folder();
    let out = campaign(&folder, "300");
    let file = out.join("explorer.html");
    stdout(&program().args(["view", "--export"]).arg(&file).arg(&out).output().unwrap(), 0);
    let Some(mut page) = open(&folder, &format!("file://{}", file.display())) else { return };
    let records = Folder::open(&out).records().unwrap().map(Result::unwrap);
    let harm_of = |record: &Record| harm(record.arms.last().unwrap().result.as_ref().unwrap());
    let harms: BTreeMap<u64, f64> = records.map(|record| (record.sample, harm_of(&record))).collect();
    let listed = page.evaluate(
        "[...document.querySelectorAll('#list tbody tr')].map(row => [Number(row.querySelector('button').innerText), \
         row.children[1].innerText])",
    );
    let listed: Vec<(u64, String)> = serde_json::from_value(listed).unwrap();
    assert_eq!(listed.len(), 25);
    for pair in listed.windows(2).filter(|pair| pair[0].1 == pair[1].1) {
        let [first, second] = [0, 1].map(|index| harms[&pair[index].0]);
        // The page has four digits.
        assert!(first >= 0.999 * second, "{pair:?}: {first} before {second}");
    }
    let harmful: Vec<u64> = harms.iter().filter(|(_, harm)| **harm > 0.0).map(|(sample, _)| *sample).collect();
    assert!((3..=25).contains(&harmful.len()), "{harmful:?}");
    assert!(harmful.iter().all(|sample| listed.iter().any(|(number, _)| number == sample)), "{harmful:?} {listed:?}");
    let note = page.evaluate("document.querySelector('#list p').innerText");
    assert!(note.as_str().unwrap().starts_with("25 of 300 chosen samples: by outcome, then by harm"), "{note}");
}

#[test]
fn the_server_leaves_its_folder_by_no_path_and_no_link() {
    let folder = folder();
    let out = campaign(&folder, "20");
    let secret = folder.path().join("secret.html");
    fs::write(&secret, "secret").unwrap();
    fs::create_dir_all(out.join("recordings")).unwrap();
    symlink(&secret, out.join("recordings/link.html")).unwrap();
    let fifo = out.join("recordings/fifo.html");
    assert!(std::process::Command::new("mkfifo").arg(&fifo).status().unwrap().success());
    fs::write(out.join("recordings/own.html"), "own").unwrap();
    let served = Served::new(&out);
    assert_eq!(served.ask("GET", "recordings/own.html"), (200, "own".to_owned()));
    assert_eq!(served.ask("GET", "report.html").0, 200);
    for path in [
        "recordings/link.html",
        "recordings/fifo.html",
        "recordings/..%2f..%2fsecret.html",
        "recordings/../../secret.html",
        "..%2fsecret.html",
        "%2e%2e/secret.html",
        "manifest.json",
        "journal.jsonl",
        "recordings/",
        "recordings/..",
        "report.html/",
        "sample/low-thw-overtake",
        "open/low-thw-overtake/1",
    ] {
        let (status, body) = served.ask("GET", path);
        assert_eq!((status, body.contains("secret")), (404, false), "{path}");
    }
    for path in
        ["sample/low-thw-overtake/20", "sample/none/1", "sample/low-thw-overtake/-1", "twin/low-thw-overtake/1e3"]
    {
        assert_eq!(served.ask("GET", path).0, 409, "{path}");
    }
    assert_eq!(served.ask("POST", "sample/low-thw-overtake/1").0, 404);
    // Also a folder that is a link.
    fs::rename(out.join("recordings"), folder.path().join("elsewhere")).unwrap();
    symlink(folder.path().join("elsewhere"), out.join("recordings")).unwrap();
    assert_eq!(served.ask("GET", "recordings/own.html").0, 404);
}

#[test]
fn commands_of_a_foreign_folder_do_not_run_by_a_click() {
    let place = folder();
    fs::write(place.path().join("telling.sh"), TELLING).unwrap();
    let of_user = |user: &str| {
        let mut command = program();
        command
            .current_dir(place.path())
            .env("XDG_STATE_HOME", place.path().join(user))
            .env("BROWSER", "/nowhere/browser");
        command
    };
    let campaign =
        ["campaign", "low-thw-overtake", "-n", "3", "--sensors", "object", "--no-gate", "--record", "failures:0"];
    let controller = ["--controller", "exec:sh telling.sh", "--controller-timeout-ms", "60000", "--out", "out"];
    stdout(&of_user("own").args(campaign).args(controller).output().unwrap(), 0);
    let ran = place.path().join("ran");
    fs::remove_file(&ran).unwrap();
    let mut served = of_user("foreign").args(["view", "out"]).stdout(Stdio::piped()).spawn().unwrap();
    let mut address = String::new();
    BufReader::new(served.stdout.take().unwrap()).read_line(&mut address).unwrap();
    let rest = address.trim().strip_prefix("http://").unwrap();
    let (host, _) = rest.split_once('/').unwrap();
    let path = &rest[host.len()..];
    for part in ["sample", "twin"] {
        let mut stream = TcpStream::connect(host).unwrap();
        write!(stream, "GET {path}{part}/low-thw-overtake/1 HTTP/1.1\r\nHost: {host}\r\n\r\n").unwrap();
        let mut answer = String::new();
        stream.read_to_string(&mut answer).unwrap();
        assert!(answer.starts_with("HTTP/1.1 409") && answer.contains("telling.sh"), "{answer}");
    }
    served.kill().unwrap();
    served.wait().unwrap();
    assert!(!ran.exists());
}
