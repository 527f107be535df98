//! The real viewer, off screen: every view that the blueprint lays out has something in it.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Mutex, PoisonError};

use crate::support::{closecall, folder, library, skipped, stdout};

/// Size of the viewer's window; the picture may have more pixels.
const WINDOW: &str = "1600x900";
/// Longest time that the viewer may take on a machine without graphics.
const PATIENCE_S: &str = "240";

/// What tells that a view is not empty.
#[derive(Clone, Copy, Debug)]
enum Sign {
    /// Colours: curves, bands, vehicles.
    Colour,
    /// Bright letters.
    Letters,
}

/// A view: its name, its left, top, right and bottom edge as shares of the picture, and what is to be seen in it.
type View = (&'static str, [f64; 4], Sign);

/// Where the views of a run without camera lie, well within their frames: on the left those of the road.
const RUN: [View; 3] = [
    ("scene", [0.05, 0.08, 0.50, 0.50], Sign::Colour),
    ("from above", [0.05, 0.58, 0.50, 0.70], Sign::Colour),
    ("states", [0.05, 0.78, 0.50, 0.94], Sign::Colour),
];
/// The same of a recorded encounter beside a run.
const BESIDE: [View; 5] = [
    ("scene: recorded", [0.02, 0.08, 0.26, 0.47], Sign::Colour),
    ("scene: mis", [0.29, 0.08, 0.53, 0.47], Sign::Colour),
    ("from above: recorded", [0.05, 0.53, 0.50, 0.61], Sign::Colour),
    ("from above: mis", [0.05, 0.67, 0.50, 0.74], Sign::Colour),
    ("states: mis", [0.05, 0.81, 0.50, 0.94], Sign::Colour),
];
/// On the right the plots and the words, wherever the road is seen.
const RIGHT: [View; 8] = [
    ("time headway", [0.56, 0.06, 0.76, 0.22], Sign::Colour),
    ("gap", [0.56, 0.27, 0.76, 0.43], Sign::Colour),
    ("encounter", [0.56, 0.48, 0.76, 0.63], Sign::Colour),
    ("speed", [0.79, 0.06, 0.98, 0.22], Sign::Colour),
    ("acceleration", [0.79, 0.27, 0.98, 0.43], Sign::Colour),
    ("margin gained", [0.79, 0.48, 0.98, 0.63], Sign::Colour),
    ("story", [0.56, 0.70, 0.76, 0.95], Sign::Letters),
    ("log", [0.79, 0.70, 0.98, 0.95], Sign::Letters),
];
/// At least this share of a view's pixels shows the sign [1].
const LEAST_SHARE: f64 = 0.000_5;
/// Most pictures that are taken of a file.
const PICTURES: usize = 5;
/// Two viewers at once, drawing without graphics, keep each other from loading their files in time.
static VIEWER: Mutex<()> = Mutex::new(());

/// The viewer, where it and a screen that is none can be had.
fn viewer() -> Option<PathBuf> {
    let has_screen = Command::new("xvfb-run").arg("--help").output().is_ok_and(|output| output.status.success());
    match std::env::var_os("CLOSECALL_RERUN").map(PathBuf::from) {
        None => skipped("CLOSECALL_RERUN does not name the Rerun viewer"),
        Some(_) if !has_screen => skipped("xvfb-run is not installed: the viewer has no screen to draw on"),
        viewer => return viewer,
    }
    None
}

/// A picture's size, its channels and its bytes.
struct Picture {
    width: usize,
    height: usize,
    channels: usize,
    bytes: Vec<u8>,
}

fn read(path: &Path) -> Picture {
    let file = std::io::BufReader::new(std::fs::File::open(path).unwrap());
    let mut reader = png::Decoder::new(file).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut bytes).unwrap();
    let channels = info.color_type.samples();
    Picture { width: info.width as usize, height: info.height as usize, channels, bytes }
}

impl Picture {
    /// Share of the pixels of a view that show a sign of something.
    fn share(&self, [left, top, right, bottom]: [f64; 4], sign: Sign) -> f64 {
        let at = |share: f64, extent: usize| (share * extent as f64) as usize;
        let (mut shown, mut all) = (0, 0);
        for row in at(top, self.height)..at(bottom, self.height) {
            for column in at(left, self.width)..at(right, self.width) {
                let first = (row * self.width + column) * self.channels;
                let rgb = &self.bytes[first..first + 3];
                let (low, high) = (rgb.iter().min().unwrap(), rgb.iter().max().unwrap());
                shown += usize::from(match sign {
                    Sign::Colour => high - low > 70,
                    Sign::Letters => *low > 150,
                });
                all += 1;
            }
        }
        shown as f64 / f64::from(all.max(1))
    }
}

/// Has the viewer draw a file, and looks into each of its views.
///
/// The viewer takes its picture after a number of frames: on a busy machine before it has loaded the whole file. What is
/// empty in every picture is empty.
fn look(viewer: &Path, file: &Path, views: &[View]) {
    let _alone = VIEWER.lock().unwrap_or_else(PoisonError::into_inner);
    let mut empty = Vec::new();
    for _ in 0..PICTURES {
        let Some(picture) = draw(viewer, file) else { return };
        let shares = views.iter().chain(&RIGHT).map(|(name, place, sign)| (name, picture.share(*place, *sign)));
        empty = shares.filter(|(_, share)| !(*share > LEAST_SHARE)).collect();
        if empty.is_empty() {
            return;
        }
    }
    panic!("empty, with the shares of them that show anything: {empty:?}");
}

/// A picture of the viewer with a file; nothing where it cannot draw here.
fn draw(viewer: &Path, file: &Path) -> Option<Picture> {
    let picture = file.with_extension("png");
    let said = Command::new("timeout")
        .args([PATIENCE_S, "xvfb-run", "-a", "-s", "-screen 0 3840x2400x24"])
        .arg(viewer)
        .arg(file)
        .arg("--screenshot-to")
        .arg(&picture)
        .args(["--window-size", WINDOW, "--port", "0"])
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&said.stderr);
    if !picture.exists() {
        skipped(&format!("the viewer could not draw here: {said}"));
        return None;
    }
    let complaint = said.to_lowercase();
    assert!(!complaint.contains("blueprint") && !complaint.contains("entity"), "the viewer complains: {said}");
    Some(read(&picture))
}

#[test]
fn every_view_shows_something_in_the_real_viewer() {
    let Some(viewer) = viewer() else { return };
    let folder = folder();
    let file = folder.path().join("run.rrd");
    let scenario = library("paper-figure");
    stdout(&closecall(["run", scenario.to_str().unwrap(), "--record", file.to_str().unwrap()]), 0);
    look(&viewer, &file, &RUN);
}

#[test]
fn every_view_of_recorded_traffic_beside_a_run_shows_something() {
    let Some(viewer) = viewer() else { return };
    let folder = folder();
    let [csv, file] = ["own.csv", "beside.rrd"].map(|name| folder.path().join(name));
    let (csv, scenario) = (csv.to_str().unwrap(), library("overtake-without-brake"));
    stdout(&closecall(["record", scenario.to_str().unwrap(), "-n", "2", "--controller", "acc", "-o", csv]), 0);
    stdout(&closecall(["reenact", csv, "--record", file.to_str().unwrap()]), 0);
    look(&viewer, &file, &BESIDE);
}
