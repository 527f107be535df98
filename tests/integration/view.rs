//! `closecall view` passes recordings to the installed viewer, and the last report to the browser.

use std::fs;
use std::io::{BufRead, BufReader};
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::mpsc::channel;
use std::thread::{sleep, spawn};
use std::time::{Duration, Instant};

use closecall_testing::viewer;
use rustix::process::{Pid, Signal, kill_process_group};
use tempfile::TempDir;

use crate::support::{ROOT, closecall, code, folder, library, message, program, stderr, stdout};

/// The first bytes of a recording of Rerun 0.36.3.
const START: &[u8] = b"RRF2\0\x24\x03\0\x01\x02\0\0";
/// Time after which a program that should have started counts as absent.
const DEADLINE: Duration = Duration::from_secs(60);

/// Returns a program that replaces the viewer or the browser.
fn stand_in(name: &str) -> PathBuf {
    Path::new(ROOT).join("tests/fixtures/programs").join(name)
}

/// A working folder, and the folder into which the stand-ins write.
struct Place {
    working: TempDir,
    written: TempDir,
}

impl Place {
    fn new() -> Self {
        Self { working: folder(), written: folder() }
    }

    /// Writes the starts of recordings.
    fn with_recordings(names: &[&str]) -> Self {
        let place = Self::new();
        for name in names {
            let path = place.path(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, START).unwrap();
        }
        place
    }

    fn path(&self, name: &str) -> PathBuf {
        self.working.path().join(name)
    }

    /// Returns `closecall view`, ready to run with the stand-ins.
    fn view(&self, args: &[&str]) -> Command {
        let mut view = program();
        // The machine's own xdg-open may ask its table of programs before $BROWSER.
        let path = format!("{}:{}", stand_in("desktop").display(), std::env::var("PATH").unwrap_or_default());
        view.current_dir(self.working.path())
            .env("PATH", path)
            .env("WRITTEN", self.written.path())
            .env("BROWSER", stand_in("browser"))
            .env("CLOSECALL_RERUN", stand_in("rerun"))
            .env_remove("VIEWER_VERSION")
            .env_remove("VIEWER_STATUS")
            .arg("view")
            .args(args);
        view
    }

    fn run(&self, args: &[&str]) -> Output {
        self.view(args).output().unwrap()
    }

    /// Returns the arguments with which the viewer was started, apart from the address that it
    /// listens on, and forgets them. `None` if it was not started.
    fn viewer_args(&self) -> Option<Vec<String>> {
        let file = self.written.path().join("viewer");
        let text = fs::read_to_string(&file).ok()?;
        fs::remove_file(file).unwrap();
        let mut args: Vec<String> = text.lines().map(str::to_owned).collect();
        assert_eq!(args.drain(..2).collect::<Vec<_>>(), ["--bind", "127.0.0.1"], "{text}");
        Some(args)
    }

    /// Returns the arguments with which the browser was started.
    fn browser_args(&self) -> Vec<String> {
        let (file, start) = (self.written.path().join("browser"), Instant::now());
        loop {
            if let Ok(text) = fs::read_to_string(&file) {
                return text.lines().map(str::to_owned).collect();
            }
            assert!(start.elapsed() < DEADLINE, "the browser was not started, or has not outlived the command");
            sleep(Duration::from_millis(20));
        }
    }

    /// Returns the whole paths of files of the working folder.
    fn whole(&self, names: &[&str]) -> Vec<String> {
        names.iter().map(|name| self.path(name).display().to_string()).collect()
    }

    /// Writes the files of a campaign.
    fn with_results(names: &[&str]) -> Self {
        let place = Self::with_recordings(names);
        fs::create_dir_all(place.path("closecall-results")).unwrap();
        fs::write(place.path("closecall-results/report.html"), "").unwrap();
        place
    }
}

#[test]
fn a_recording_is_passed_to_the_viewer_also_if_its_name_has_spaces() {
    let place = Place::with_recordings(&["a worst case.rrd", "other.rrd", "-x.rrd"]);
    assert_eq!(stdout(&place.run(&["a worst case.rrd"]), 0), "a worst case.rrd\n");
    assert_eq!(place.viewer_args().unwrap(), place.whole(&["a worst case.rrd"]));
    // The name is no option of the viewer.
    stdout(&place.run(&["--", "-x.rrd"]), 0);
    assert_eq!(place.viewer_args().unwrap(), place.whole(&["-x.rrd"]));
}

#[test]
fn the_recordings_of_a_campaign_are_passed_to_the_viewer_and_no_other_file() {
    let names = ["first run/recordings/a b-3.rrd", "first run/recordings/c-1.rrd", "first run/z.rrd"];
    let place = Place::with_recordings(&names);
    for other in ["first run/recordings/index.html", "first run/report.html"] {
        fs::write(place.path(other), "").unwrap();
    }
    assert_eq!(stdout(&place.run(&["first run"]), 0), names.map(|name| format!("{name}\n")).concat());
    assert_eq!(place.viewer_args().unwrap(), place.whole(&names));
    stdout(&place.run(&["first run/recordings"]), 0);
    assert_eq!(place.viewer_args().unwrap(), place.whole(&names[..2]));
}

#[test]
fn web_and_port_are_options_of_the_viewer() {
    let place = Place::with_recordings(&["a.rrd"]);
    let file = place.whole(&["a.rrd"]);
    for (args, expected) in [
        (&["--web"][..], &["--web-viewer"][..]),
        (&["--port", "9000"], &["--port", "9000"]),
        (&["--web", "--port", "9000"], &["--web-viewer", "--web-viewer-port", "9000", "--port", "auto"]),
    ] {
        stdout(&place.run(&[&["a.rrd"], args].concat()), 0);
        let passed = place.viewer_args().unwrap();
        assert_eq!(passed[..expected.len()], *expected);
        assert_eq!(passed[expected.len()..], file);
    }
}

#[test]
fn the_viewer_is_that_of_the_option_of_the_variable_or_of_the_path() {
    let place = Place::with_recordings(&["a.rrd"]);
    let path = format!("{}:/usr/bin:/bin", stand_in("").display());
    stdout(&place.view(&["a.rrd"]).env_remove("CLOSECALL_RERUN").env("PATH", &path).output().unwrap(), 0);
    assert!(place.viewer_args().is_some());
    let other = place.view(&["a.rrd"]).env("CLOSECALL_RERUN", "/nowhere/rerun").env("PATH", &path).output().unwrap();
    assert_eq!(code(&other), 6, "{}", stderr(&other));
    let option = ["a.rrd", "--viewer", stand_in("rerun").to_str().unwrap()].map(str::to_owned);
    stdout(&place.view(&[]).args(option).env("CLOSECALL_RERUN", "/nowhere/rerun").output().unwrap(), 0);
    assert!(place.viewer_args().is_some());
}

#[test]
fn a_missing_viewer_is_named_with_the_command_that_installs_it() {
    let place = Place::with_recordings(&["a.rrd"]);
    for none in [
        place.run(&["a.rrd", "--viewer", "/nowhere/rerun"]),
        place.view(&["a.rrd"]).env_remove("CLOSECALL_RERUN").env("PATH", "/nowhere").output().unwrap(),
    ] {
        assert_eq!(code(&none), 6, "{}", stderr(&none));
        assert!(message(&none).contains("pip install rerun-sdk==0.36.3"), "{}", message(&none));
    }
    // A file that is no program.
    let none = place.run(&["a.rrd", "--viewer", "./a.rrd"]);
    assert_eq!(code(&none), 6, "{}", stderr(&none));
    assert!(message(&none).contains("failed to start the Rerun viewer (./a.rrd)"), "{}", message(&none));
}

#[test]
fn a_missing_path_and_a_folder_without_recordings_are_refused() {
    let place = Place::with_recordings(&["empty/recordings/notes.txt", "cut.rrd"]);
    for (path, expected, said) in [
        ("none.rrd", 6, "failed to read none.rrd"),
        ("empty", 3, "failed to find a recording in empty"),
        ("empty/recordings/notes.txt", 3, "name a file .rrd"),
    ] {
        let refused = place.run(&[path]);
        assert_eq!(code(&refused), expected, "{path}: {}", stderr(&refused));
        assert!(message(&refused).contains(said), "{path}: {}", message(&refused));
    }
    fs::write(place.path("cut.rrd"), "RRF").unwrap();
    let refused = place.run(&["cut.rrd"]);
    assert_eq!(code(&refused), 3, "{}", stderr(&refused));
    assert!(message(&refused).contains("cut.rrd: the file is no recording"), "{}", message(&refused));
    assert!(place.viewer_args().is_none());
}

#[test]
fn a_viewer_of_another_minor_version_opens_with_a_warning() {
    let place = Place::with_recordings(&["a.rrd"]);
    for (version, warned) in [
        ("rerun-cli 0.36.0 (native_viewer)", None),
        ("rerun-cli 0.35.2 (native_viewer)", Some("is version 0.35.2, and a.rrd was written by version 0.36.3")),
        ("rerun 1.0", Some("names no version")),
    ] {
        let output = place.view(&["a.rrd"]).env("VIEWER_VERSION", version).output().unwrap();
        stdout(&output, 0);
        assert!(place.viewer_args().is_some());
        match warned {
            Some(said) => assert!(message(&output).contains(said), "{version}: {}", message(&output)),
            None => assert_eq!(stderr(&output), "", "{version}"),
        }
    }
}

#[test]
fn a_viewer_that_fails_ends_the_command_with_the_code_for_files() {
    let place = Place::with_recordings(&["a.rrd"]);
    let failed = place.view(&["a.rrd"]).env("VIEWER_STATUS", "1").output().unwrap();
    assert_eq!(code(&failed), 6, "{}", stderr(&failed));
    assert!(message(&failed).contains("ended with exit status: 1"), "{}", message(&failed));
}

#[test]
fn without_opening_the_paths_are_printed_and_no_viewer_is_needed() {
    let names = ["closecall-results/recordings/a b.rrd", "closecall-results/recordings/c.rrd"];
    let place = Place::with_results(&names);
    let printed = place.run(&["--no-open", "--viewer", "/nowhere/rerun"]);
    let expected = format!("closecall-results/report.html\n{}\n{}\n", names[0], names[1]);
    assert_eq!(stdout(&printed, 0), expected);
    assert_eq!(stdout(&place.run(&["--no-open", names[0]]), 0), format!("{}\n", names[0]));
    assert!(place.viewer_args().is_none() && !place.written.path().join("browser").exists());
}

#[test]
fn the_last_results_open_in_the_browser_and_in_the_viewer() {
    let names = ["closecall-results/recordings/a b.rrd", "closecall-results/recordings/c.rrd"];
    let place = Place::with_results(&names);
    stdout(&place.run(&[]), 0);
    assert_eq!(place.browser_args(), place.whole(&["closecall-results/report.html"]));
    assert_eq!(place.viewer_args().unwrap(), place.whole(&names));
    // Each opens without the other.
    let no_browser = place.view(&[]).env("BROWSER", "/nowhere/browser").output().unwrap();
    assert_eq!(code(&no_browser), 6, "{}", stderr(&no_browser));
    assert!(message(&no_browser).contains("failed to open closecall-results/report.html"), "{}", message(&no_browser));
    assert!(place.viewer_args().is_some());
    let no_viewer = Place::with_results(&names);
    assert_eq!(code(&no_viewer.run(&["--viewer", "/nowhere/rerun"])), 6);
    no_viewer.browser_args();
}

#[test]
fn the_browser_outlives_the_command() {
    let place = Place::with_results(&[]);
    assert_eq!(stdout(&place.run(&[]), 0), "closecall-results/report.html\n");
    assert!(!place.browser_args().is_empty());
    assert!(place.viewer_args().is_none(), "there is no recording");
}

/// Writes a recording of the method's reference point.
fn record(file: &Path) {
    let scenario = library("paper-figure");
    stdout(&closecall(["run", scenario.to_str().unwrap(), "--record", file.to_str().unwrap()]), 0);
}

#[test]
fn the_installed_viewer_takes_the_options_and_lacks_nothing_but_a_display() {
    let Some(viewer) = viewer() else { return };
    let place = Place::new();
    record(&place.path("a run.rrd"));
    let output = place
        .view(&["a run.rrd", "--port", "0", "--viewer", viewer.to_str().unwrap()])
        .env_remove("DISPLAY")
        .env_remove("WAYLAND_DISPLAY")
        .env_remove("WAYLAND_SOCKET")
        .output()
        .unwrap();
    assert_eq!(code(&output), 6);
    assert!(message(&output).contains("DISPLAY is set"), "{}", message(&output));
    assert!(!message(&output).contains("warning: "), "the versions differ: {}", message(&output));
}

#[test]
fn the_installed_viewer_shows_a_recording_in_the_browser() {
    let Some(viewer) = viewer() else { return };
    let place = Place::new();
    record(&place.path("a run.rrd"));
    let mut view = place
        .view(&["a run.rrd", "--web", "--port", "0", "--viewer", viewer.to_str().unwrap()])
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .process_group(0)
        .spawn()
        .unwrap();
    let lines = BufReader::new(view.stderr.take().unwrap()).lines().map_while(Result::ok);
    let (sender, receiver) = channel();
    spawn(move || lines.map(|line| sender.send(line)).all(|sent| sent.is_ok()));
    // The viewer loads the file and serves its page at the same time.
    let mut missing = vec!["Hosting a web-viewer at http://127.0.0.1:", "/a run.rrd\""];
    let mut said = Vec::new();
    while !missing.is_empty()
        && let Ok(line) = receiver.recv_timeout(DEADLINE)
    {
        missing.retain(|part| !line.contains(part));
        said.push(line);
    }
    kill_process_group(Pid::from_child(&view), Signal::KILL).unwrap();
    view.wait().unwrap();
    assert!(missing.is_empty(), "{missing:?}: {said:?}");
}
