//! The Rerun viewer, on a virtual display, shows something in every view of the blueprint.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Mutex, PoisonError};

use closecall_testing::{Need, has_display, skip, viewer};

use crate::support::{closecall, folder, library, stdout};

/// The size of the viewer's window. The picture may have more pixels.
const WINDOW: &str = "1600x900";
/// The time after which the viewer is taken for hung (s). Without a graphics card it can need
/// minutes.
const HUNG_AFTER_S: &str = "600";

/// The kind of pixels that a view shows if it is not empty.
#[derive(Clone, Copy, Debug)]
enum Content {
    /// Coloured pixels: curves, bands, vehicles.
    Colour,
    /// Bright pixels: text.
    Text,
}

/// A view: its name, its left, top, right and bottom edge as shares of the picture, and its
/// content.
type View = (&'static str, [f64; 4], Content);

/// The views of a run without camera. The edges lie well within the frames of the views.
const RUN: [View; 7] = [
    ("verdict", [0.01, 0.09, 0.50, 0.23], Content::Text),
    ("from above", [0.05, 0.26, 0.50, 0.36], Content::Colour),
    ("scene", [0.05, 0.56, 0.50, 0.90], Content::Colour),
    ("time headway", [0.58, 0.08, 0.96, 0.25], Content::Colour),
    ("acceleration", [0.58, 0.34, 0.96, 0.45], Content::Colour),
    ("states", [0.58, 0.55, 0.96, 0.75], Content::Colour),
    ("log", [0.58, 0.85, 0.96, 0.95], Content::Colour),
];
/// The views of recorded traffic beside a run.
const BESIDE: [View; 8] = [
    ("verdict", [0.01, 0.09, 0.50, 0.23], Content::Text),
    ("from above: recorded", [0.05, 0.34, 0.50, 0.43], Content::Colour),
    ("from above: with MIS", [0.05, 0.50, 0.50, 0.58], Content::Colour),
    ("scene: recorded", [0.02, 0.72, 0.26, 0.95], Content::Colour),
    ("scene: with MIS", [0.29, 0.72, 0.53, 0.95], Content::Colour),
    ("time headway", [0.58, 0.08, 0.96, 0.25], Content::Colour),
    ("acceleration", [0.58, 0.34, 0.96, 0.45], Content::Colour),
    ("states", [0.58, 0.55, 0.96, 0.75], Content::Colour),
];
/// The smallest share of a view's pixels that shows content.
const LEAST_SHARE: f64 = 0.000_5;
/// The largest number of pictures that are taken of a file.
const PICTURES: usize = 5;
/// Held while a viewer runs. Two viewers at once, without a graphics card, slow each other so much
/// that neither loads its file in time.
static VIEWER: Mutex<()> = Mutex::new(());

/// Returns the viewer if it has a display to draw on.
fn viewer_with_display() -> Option<PathBuf> {
    viewer().filter(|_| has_display())
}

/// A picture: its size (px), the bytes per pixel, and all bytes.
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
    /// Returns the share of the pixels within the given edges that show content.
    fn share(&self, [left, top, right, bottom]: [f64; 4], content: Content) -> f64 {
        let at = |share: f64, extent: usize| (share * extent as f64) as usize;
        let (mut shown, mut all) = (0, 0);
        for row in at(top, self.height)..at(bottom, self.height) {
            for column in at(left, self.width)..at(right, self.width) {
                let first = (row * self.width + column) * self.channels;
                let rgb = &self.bytes[first..first + 3];
                let (low, high) = (rgb.iter().min().unwrap(), rgb.iter().max().unwrap());
                shown += usize::from(match content {
                    Content::Colour => high - low > 70,
                    Content::Text => *low > 150,
                });
                all += 1;
            }
        }
        shown as f64 / f64::from(all.max(1))
    }
}

/// Opens a recording in the viewer, and fails if one of its views is empty.
///
/// The viewer takes its picture after a number of frames: on a busy machine this can be before it
/// has loaded the whole file. A view counts as empty if it is empty in every picture.
fn assert_shows(viewer: &Path, file: &Path, views: &[View]) {
    let _guard = VIEWER.lock().unwrap_or_else(PoisonError::into_inner);
    let mut empty = Vec::new();
    for _ in 0..PICTURES {
        let Some(picture) = draw(viewer, file) else { return };
        let shares = views.iter().map(|(name, edges, content)| (name, picture.share(*edges, *content)));
        empty = shares.filter(|(_, share)| !(*share > LEAST_SHARE)).collect();
        if empty.is_empty() {
            return;
        }
    }
    panic!("empty views, with the share of their pixels that show content: {empty:?}");
}

/// Returns a picture of the viewer with a recording. Returns `None` if the viewer cannot draw on
/// this machine.
fn draw(viewer: &Path, file: &Path) -> Option<Picture> {
    let picture = file.with_extension("png");
    let output = Command::new("timeout")
        .args([HUNG_AFTER_S, "xvfb-run", "-a", "-s", "-screen 0 3840x2400x24"])
        .arg(viewer)
        .arg(file)
        .arg("--screenshot-to")
        .arg(&picture)
        .args(["--window-size", WINDOW, "--port", "0"])
        .output()
        .unwrap();
    let messages = String::from_utf8_lossy(&output.stderr);
    if !picture.exists() {
        // In one line, as every reason of a skipped test.
        let messages = messages.split_whitespace().collect::<Vec<_>>().join(" ");
        skip(Need::Display, &format!("the viewer cannot draw on this machine: {messages}"));
        return None;
    }
    let lower = messages.to_lowercase();
    assert!(!lower.contains("blueprint") && !lower.contains("entity"), "the viewer complains: {messages}");
    Some(read(&picture))
}

#[test]
fn every_view_of_a_run_shows_content() {
    let Some(viewer) = viewer_with_display() else { return };
    let folder = folder();
    let file = folder.path().join("run.rrd");
    let scenario = library("paper-figure");
    stdout(&closecall(["run", scenario.to_str().unwrap(), "--record", file.to_str().unwrap()]), 0);
    assert_shows(&viewer, &file, &RUN);
}

#[test]
fn every_view_of_recorded_traffic_beside_a_run_shows_content() {
    let Some(viewer) = viewer_with_display() else { return };
    let folder = folder();
    let [csv, file] = ["own.csv", "beside.rrd"].map(|name| folder.path().join(name));
    let (csv, scenario) = (csv.to_str().unwrap(), library("overtake-without-brake"));
    stdout(
        &closecall(["traffic", "record", scenario.to_str().unwrap(), "-n", "2", "--controller", "acc", "-o", csv]),
        0,
    );
    stdout(&closecall(["traffic", "reenact", csv, "--record", file.to_str().unwrap()]), 0);
    assert_shows(&viewer, &file, &BESIDE);
}
