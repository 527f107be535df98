//! `closecall view`: opens the explorer of a campaign in the browser, and recordings in the
//! installed Rerun viewer.
//!
//! ```text
//!  PATH of a campaign ────────▶ explorer ───▶ browser ──(open in Rerun)──▶ rerun
//!  PATH of recordings ────────▶ recordings ─▶ rerun [--web-viewer] FILE…
//!  PATH with --recordings ────▶ recordings ─▶ rerun [--web-viewer] FILE…
//!  no PATH: the campaign in closecall-results; with --recordings its report is opened in the browser, too
//! ```
//!
//! A viewer is waited for. The explorer is served until Ctrl-C.

use std::fs;
use std::path::{Path, PathBuf};

use clap::Args;
use closecall_campaign::arguments::whole;
use closecall_campaign::folder::{EXPLORER, MANIFEST, RECORDINGS, REPORT};
use closecall_report::run::rerun::{RerunVersion, VersionError};
use closecall_traffic::input::named;

use super::CliError;
use super::explore::{ViewerChoice, explore, export};
use super::help::{examples, heading};
use super::output::{outln, print_error};
use super::protect::{files_of_campaign, protect};
use super::results::last_results;
use super::saved::{SavedArgs, refuse_rare};
use super::view_error::ViewError;
use super::viewer::{INSTALL, Viewer};
use crate::exit_code::ExitCode;

/// Arguments of `closecall view`.
#[derive(Debug, Args)]
#[command(after_help = examples([
    "closecall view",
    "closecall view pair.rrd",
    "closecall view closecall-results --export explorer.html",
]))]
pub(super) struct ViewArgs {
    /// Folder of a campaign, whose samples are explored in the browser; or a recording (.rrd) or a
    /// folder of recordings, for the viewer [default: the last campaign, in closecall-results]
    path: Option<PathBuf>,
    /// Open the recordings of the campaign in the viewer instead of the explorer, and the report if
    /// no folder is named
    #[arg(long, help_heading = heading::VIEWER)]
    recordings: bool,
    /// Write the explorer into a file, which needs no server, instead of opening it. It links to
    /// the recorded samples; put it into the campaign's folder
    #[arg(long, value_name = "FILE.html", conflicts_with_all = ["recordings", "web", "port", "no_open"], help_heading = heading::OUTPUT)]
    export: Option<PathBuf>,
    /// Use the web build of the viewer, in the browser, instead of its window
    #[arg(long, help_heading = heading::VIEWER)]
    web: bool,
    /// Port of the viewer, which is 9876 unless stated; with --web the port of its page, which is
    /// 9090 unless stated
    #[arg(long, value_parser = whole::<u16, 0, 65_535>, help_heading = heading::VIEWER)]
    port: Option<u16>,
    /// Open nothing, only print the paths of the report and the recordings, one per line
    #[arg(long, help_heading = heading::VIEWER)]
    no_open: bool,
    /// Program of the Rerun viewer
    #[arg(long, value_name = "PATH", env = "CLOSECALL_RERUN", hide_env_values = true, default_value = "rerun", help_heading = heading::VIEWER)]
    viewer: PathBuf,
    #[command(flatten)]
    saved: SavedArgs,
}

/// A recording, and the version of Rerun that it was written by.
#[derive(Debug)]
struct Recording {
    path: PathBuf,
    version: RerunVersion,
}

pub(super) fn view(args: &ViewArgs) -> Result<ExitCode, CliError> {
    let campaign = match &args.path {
        Some(path) => path.clone(),
        None => last_results()?.path().to_owned(),
    };
    refuse_rare(&campaign)?;
    let is_campaign = campaign.join(MANIFEST).is_file();
    if let Some(path) = &args.export {
        // The page itself is written anew.
        let inputs = files_of_campaign(&campaign).into_iter().filter(|input| !input.ends_with(EXPLORER));
        protect(&inputs.collect::<Vec<_>>(), &[("--export", Some(path))])?;
        if path.extension().is_none_or(|end| end != "html") || path.starts_with(campaign.join(RECORDINGS)) {
            return Err(CliError::usage(format!(
                "--export {}: a name that ends with .html, and is not in the folder of the recordings, is needed",
                path.display()
            )));
        }
        export(&args.saved.open(&campaign)?, path)?;
        return Ok(ExitCode::Pass);
    }
    if is_campaign && !args.recordings && !args.no_open {
        let viewer = ViewerChoice { program: &args.viewer, is_web: args.web, port: args.port };
        explore(&args.saved.open(&campaign)?, &viewer)?;
        return Ok(ExitCode::Pass);
    }
    let report = Some(campaign.join(REPORT)).filter(|report| args.path.is_none() || args.no_open && report.is_file());
    let recordings = match recordings(&campaign) {
        // A campaign without a collision has recorded nothing.
        Err(ViewError::Nothing { .. }) if report.is_some() => Vec::new(),
        recordings => recordings?,
    };
    for path in report.iter().chain(recordings.iter().map(|recording| &recording.path)) {
        outln!("{}", path.display());
    }
    if args.no_open {
        return Ok(ExitCode::Pass);
    }
    // Without a browser there is still the viewer.
    let opened = report.map_or(Ok(()), open_in_browser);
    if !recordings.is_empty() {
        show(args, &recordings)?;
    }
    opened?;
    Ok(ExitCode::Pass)
}

/// Returns the recordings of a path: the file itself, or the recordings of a folder and of its
/// folder of recordings.
fn recordings(path: &Path) -> Result<Vec<Recording>, ViewError> {
    let is_recording = |path: &PathBuf| path.extension().is_some_and(|extension| extension == "rrd");
    let read = |source| ViewError::Read { path: path.to_owned(), source };
    let mut files = Vec::new();
    if fs::metadata(path).map_err(|error| read(named(path, error)))?.is_dir() {
        let lower = path.join(RECORDINGS);
        for folder in [Some(path), Some(lower.as_path()).filter(|lower| lower.is_dir())].into_iter().flatten() {
            for entry in fs::read_dir(folder).map_err(read)? {
                files.push(entry.map_err(read)?.path());
            }
        }
    } else {
        files.push(path.to_owned());
    }
    files.retain(is_recording);
    files.sort();
    if files.is_empty() {
        return Err(ViewError::Nothing { path: path.to_owned() });
    }
    let with_version = |path: PathBuf| match RerunVersion::of_recording(&path) {
        Ok(version) => Ok(Recording { path, version }),
        Err(VersionError::Read(source)) => Err(ViewError::Read { path, source }),
        Err(VersionError::Foreign { reason }) => Err(ViewError::Foreign { path, reason }),
    };
    files.into_iter().map(with_version).collect()
}

/// Opens the report. The browser is not waited for.
fn open_in_browser(report: PathBuf) -> Result<(), ViewError> {
    let opened = std::path::absolute(&report).map_err(opener::OpenError::Io).and_then(opener::open_browser);
    opened.map_err(|source| ViewError::Browser { path: report, source })
}

/// Shows recordings in the viewer, and waits for its end.
fn show(args: &ViewArgs, recordings: &[Recording]) -> Result<(), ViewError> {
    let viewer = Viewer::find(&args.viewer)?;
    if let Some(warning) = mismatch(&viewer, recordings) {
        print_error(format_args!("warning: {warning}\n"));
    }
    let files: Vec<&Path> = recordings.iter().map(|recording| recording.path.as_path()).collect();
    Ok(viewer.show(&files, args.web, args.port)?)
}

/// Returns a message if the viewer is not made for all recordings.
fn mismatch(viewer: &Viewer, recordings: &[Recording]) -> Option<String> {
    let program = viewer.program.display();
    let Some(version) = viewer.version else {
        return Some(format!("`{program} --version` names no version; {INSTALL} installs the Rerun viewer"));
    };
    let other = recordings.iter().find(|recording| !recording.version.fits(version))?;
    Some(format!(
        "the viewer {program} is version {version}, and {} was written by version {}: `pip install rerun-sdk=={1}` installs the \
         viewer for it",
        other.path.display(),
        other.version
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The first bytes of a recording of Rerun 0.36.3.
    const START: &[u8] = b"RRF2\0\x24\x03\0\x01\x02\0\0";

    #[test]
    fn a_folder_without_recordings_is_refused_and_one_with_them_lists_both_levels() {
        let folder = tempfile::tempdir().unwrap();
        let listed = |path: &Path| -> Vec<PathBuf> {
            let recordings = recordings(path).unwrap().into_iter();
            recordings.map(|recording| recording.path.strip_prefix(folder.path()).unwrap().to_owned()).collect()
        };
        assert!(matches!(recordings(folder.path()), Err(ViewError::Nothing { .. })));
        fs::create_dir(folder.path().join(RECORDINGS)).unwrap();
        assert!(matches!(recordings(folder.path()), Err(ViewError::Nothing { .. })));
        for name in ["b.rrd", "recordings/a.rrd", "notes.txt"] {
            fs::write(folder.path().join(name), START).unwrap();
        }
        assert_eq!(listed(folder.path()), [Path::new("b.rrd"), Path::new("recordings/a.rrd")]);
        assert_eq!(listed(&folder.path().join("b.rrd")), [Path::new("b.rrd")]);
        assert!(matches!(recordings(&folder.path().join("notes.txt")), Err(ViewError::Nothing { .. })));
        assert!(matches!(recordings(&folder.path().join("none.rrd")), Err(ViewError::Read { .. })));
        fs::write(folder.path().join("b.rrd"), "RRF2").unwrap();
        assert!(matches!(recordings(&folder.path().join("b.rrd")), Err(ViewError::Foreign { .. })));
        assert!(matches!(recordings(folder.path()), Err(ViewError::Foreign { .. })));
    }
}
