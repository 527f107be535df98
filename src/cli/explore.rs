//! The explorer of a campaign: a page in the browser that asks this program to run the samples that
//! are chosen.
//!
//! ```text
//!  GET  (nothing)             the page
//!  GET  sample/SCENARIO/N     a sample, run again in every arm
//!  GET  twin/SCENARIO/N       its smallest case that fails, and the nearest that passes
//!  POST open/SCENARIO/N       the sample, in the Rerun viewer
//!  GET  report.html, recordings/NAME.html
//! ```
//!
//! Samples run one at a time. Of the folder only pages are served, no link is followed, and they
//! run in a sandbox: another person may have written the folder.

use std::fs::{OpenOptions, symlink_metadata};
use std::io::{self, Read};
use std::path::Path;
use std::sync::{Mutex, PoisonError};

use closecall_campaign::folder::{RECORDINGS, REPORT};
use closecall_campaign::saved::SavedCampaign;
use closecall_report::campaign::explorer::{PagePlace, explorer_page, sample_part, twin_part};
use closecall_report::run::film::{Film, Level, film_arms};
use closecall_report::run::rerun::write_recording;
use closecall_scenarios::Setting;
use closecall_simulation::Arm;
use closecall_studies::case::Case;
use closecall_studies::minimize::minimize_sample;
use closecall_traffic::atomic::write_file;
use closecall_traffic::input::open_in_folder;
use closecall_traffic::shown::shown;
use tempfile::TempDir;

use super::CliError;
use super::actions::command_for;
use super::output::{during, outln, print_error, print_written};
use super::page_server::{Answer, Method, PageServer};
use super::view_error::ViewError;
use super::viewer::Viewer;

const HTML: &str = "text/html; charset=utf-8";
/// The rights of a page of the folder: to run its own scripts, without access to this server.
const SANDBOX: &str = "Content-Security-Policy: sandbox allow-scripts allow-popups; default-src 'none'; \
                       style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:\r\n";
/// Largest page of the folder that is served (bytes).
const MOST_BYTES: u64 = 256 << 20;

/// How the viewer is started.
pub(super) struct ViewerChoice<'a> {
    pub(super) program: &'a Path,
    pub(super) is_web: bool,
    pub(super) port: Option<u16>,
}

/// Writes the page into a file, which needs no server.
pub(super) fn export(saved: &SavedCampaign, path: &Path) -> Result<(), CliError> {
    let to_folder = path_to(saved.folder().path(), path);
    if to_folder.is_none() {
        print_error(format_args!(
            "note: {} is not in the campaign's folder or above it, so that it links neither report nor recordings\n",
            path.display()
        ));
    }
    let place = PagePlace::File(to_folder);
    let page = during("making the page".to_owned(), || explorer_page(saved, &place, command_for))?;
    write_file(path, |file| file.write_all(shown(&page).as_bytes()))?;
    print_written(path);
    Ok(())
}

/// Returns the path of a link from a page to a folder that lies beside it or below: empty, or ending with `/`.
fn path_to(folder: &Path, page: &Path) -> Option<String> {
    let beside = page.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let (folder, beside) = (folder.canonicalize().ok()?, beside.canonicalize().ok()?);
    let names: Option<Vec<&str>> = folder.strip_prefix(beside).ok()?.iter().map(|name| name.to_str()).collect();
    Some(names?.iter().map(|name| format!("{}/", percent_encoded(name))).collect())
}

/// Returns a name as a part of an address.
fn percent_encoded(name: &str) -> String {
    let is_plain = |byte: u8| byte.is_ascii_alphanumeric() || b"-._~".contains(&byte);
    name.bytes()
        .map(|byte| if is_plain(byte) { char::from(byte).to_string() } else { format!("%{byte:02X}") })
        .collect()
}

/// Serves the explorer until a signal ends the program.
pub(super) fn explore(saved: &SavedCampaign, viewer: &ViewerChoice<'_>) -> Result<(), CliError> {
    let page = shown(&explorer_page(saved, &PagePlace::Served, command_for)?).into_owned();
    let served = |source| ViewError::Serve { source };
    let server = PageServer::bind().map_err(served)?;
    let address = server.address();
    outln!("{address}");
    print_error(format_args!("the explorer is open until Ctrl-C\n"));
    if let Err(error) = opener::open_browser(&address) {
        print_error(format_args!("warning: no browser can be opened: {error}; the address above leads to the page\n"));
    }
    let explorer = Explorer { saved, page, viewer, running: Mutex::default(), recordings: folder().map_err(served)? };
    server.serve(&|method, path| explorer.answer(method, path)).map_err(served)?;
    Ok(())
}

/// Creates the folder of the recordings that the viewer reads. Only this user can look into it.
fn folder() -> io::Result<TempDir> {
    tempfile::Builder::new().prefix("closecall-").tempdir()
}

struct Explorer<'a> {
    saved: &'a SavedCampaign,
    page: String,
    viewer: &'a ViewerChoice<'a>,
    /// Held while samples run.
    running: Mutex<()>,
    recordings: TempDir,
}

impl Explorer<'_> {
    fn answer(&self, method: Method, path: &str) -> Answer {
        let parts: Vec<&str> = path.split('/').collect();
        let page = |text: String| Answer { status: "200 OK", kind: HTML, headers: "", body: text.into_bytes() };
        let made = match (method, &parts[..]) {
            (Method::Get, [""]) => return page(self.page.clone()),
            (Method::Get, [REPORT]) => return self.file(Path::new(REPORT)),
            (Method::Get, [RECORDINGS, name]) => return self.recorded(name),
            (Method::Get, ["sample", scenario, number]) => {
                self.of(number, |sample| self.sample(scenario, sample)).map(page)
            }
            (Method::Get, ["twin", scenario, number]) => {
                self.of(number, |sample| self.twin(scenario, sample)).map(page)
            }
            (Method::Post, ["open", scenario, number]) => {
                self.of(number, |sample| self.open(scenario, sample)).map(|said| Answer::text("200 OK", said))
            }
            _ => return Answer::missing(),
        };
        made.unwrap_or_else(|error| Answer::text("409 Conflict", shown(&error.to_string())))
    }

    /// Acts on the sample of this number, one sample at a time.
    fn of(&self, number: &str, make: impl FnOnce(u64) -> Result<String, CliError>) -> Result<String, CliError> {
        let sample = number.parse().map_err(|_| CliError::usage("a sample has a whole number"))?;
        let _running = self.running.lock().unwrap_or_else(PoisonError::into_inner);
        make(sample)
    }

    /// Runs a sample again in all arms. Returns the films, and a message if one of them is another
    /// run than the campaign's.
    fn films(&self, scenario: &str, sample: u64, level: Level) -> Result<(Vec<Film>, Option<String>), CliError> {
        let (concrete, key) = self.saved.sample(Some(scenario), sample)?;
        let films = film_arms(&concrete, key, &self.saved.arms()?, level)
            .map_err(|source| CliError::Sample { sample, source })?;
        let outcomes: Vec<_> = films.iter().filter_map(Film::outcome).collect();
        let difference = self.saved.folder().difference_of_sample(&outcomes)?;
        Ok((films, difference))
    }

    fn sample(&self, scenario: &str, sample: u64) -> Result<String, CliError> {
        let (films, difference) = self.films(scenario, sample, Level::Objects)?;
        Ok(sample_part(&films, difference.as_deref()))
    }

    fn twin(&self, scenario: &str, sample: u64) -> Result<String, CliError> {
        let case = Case::of(self.saved, Some(scenario), sample, None)?;
        let minimized = minimize_sample(self.saved, &case)?;
        let film = |settings: &[String], name: &str| -> Result<Film, CliError> {
            let settings = settings.iter().map(|text| text.parse()).collect::<Result<Vec<Setting>, _>>();
            let concrete = case.concrete(&settings.map_err(closecall_studies::CausesError::from)?)?;
            let arms: [Arm; 1] = [case.arm.clone()];
            let films = film_arms(&concrete, case.key(), &arms, Level::Objects);
            let film = films.map_err(|source| CliError::Sample { sample, source })?.remove(0);
            Ok(film.with_arm(name.to_owned()))
        };
        let mut films = vec![film(&minimized.settings, "the smallest case that fails")?];
        if let Some(twin) = &minimized.twin {
            films.push(film(&twin.settings, "its twin that passes")?);
        }
        Ok(twin_part(&minimized, &films))
    }

    /// Opens a sample in the viewer, and does not wait for it.
    fn open(&self, scenario: &str, sample: u64) -> Result<String, CliError> {
        let viewer = Viewer::find(self.viewer.program).map_err(ViewError::from)?;
        let (films, difference) = self.films(scenario, sample, Level::Full)?;
        let path = self.recordings.path().join(format!("{sample}.rrd"));
        write_recording(&path, &films)?;
        viewer.start(&path, self.viewer.is_web, self.viewer.port).map_err(ViewError::from)?;
        let difference = difference.map_or_else(String::new, |difference| format!(" But {difference}."));
        Ok(format!("Sample {sample} is open in the Rerun viewer.{difference}"))
    }

    /// Returns a page of the recordings.
    fn recorded(&self, name: &str) -> Answer {
        // The folder of the recordings may be a link, and a name may lead out of it.
        let folder = self.saved.folder().file(RECORDINGS);
        let is_name = Path::new(name).file_name().is_some_and(|file| file == name) && !name.starts_with('.');
        if !is_name || !name.ends_with(".html") || !symlink_metadata(folder).is_ok_and(|folder| folder.is_dir()) {
            return Answer::missing();
        }
        self.file(&Path::new(RECORDINGS).join(name))
    }

    /// Returns a file of the folder.
    fn file(&self, path: &Path) -> Answer {
        let read = || -> io::Result<Vec<u8>> {
            let file = open_in_folder(&self.saved.folder().path().join(path), OpenOptions::new().read(true))?;
            let mut body = Vec::new();
            file.take(MOST_BYTES).read_to_end(&mut body)?;
            Ok(body)
        };
        read()
            .map_or_else(|_| Answer::missing(), |body| Answer { status: "200 OK", kind: HTML, headers: SANDBOX, body })
    }
}
