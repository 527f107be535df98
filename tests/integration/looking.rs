//! The real viewer, off screen: every view that the blueprint lays out has something in it.

use std::path::{Path, PathBuf};
use std::process::Command;

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

/// Where the views of a run without camera lie, well within their frames.
const VIEWS: [View; 11] = [
    ("scene", [0.05, 0.08, 0.50, 0.50], Sign::Colour),
    ("from above", [0.05, 0.58, 0.50, 0.70], Sign::Colour),
    ("states", [0.05, 0.78, 0.50, 0.94], Sign::Colour),
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

#[test]
fn every_view_shows_something_in_the_real_viewer() {
    let Some(viewer) = viewer() else { return };
    let folder = folder();
    let (file, picture) = (folder.path().join("run.rrd"), folder.path().join("run.png"));
    let scenario = library("paper-figure");
    stdout(&closecall(["run", scenario.to_str().unwrap(), "--record", file.to_str().unwrap()]), 0);
    let said = Command::new("timeout")
        .args([PATIENCE_S, "xvfb-run", "-a", "-s", "-screen 0 3840x2400x24"])
        .arg(viewer)
        .arg(&file)
        .arg("--screenshot-to")
        .arg(&picture)
        .args(["--window-size", WINDOW, "--port", "0"])
        .output()
        .unwrap();
    if !picture.exists() {
        skipped(&format!("the viewer could not draw here: {}", String::from_utf8_lossy(&said.stderr)));
        return;
    }
    let said = String::from_utf8_lossy(&said.stderr).to_lowercase();
    assert!(!said.contains("blueprint") && !said.contains("entity"), "the viewer complains: {said}");
    let picture = read(&picture);
    for (name, place, sign) in VIEWS {
        let share = picture.share(place, sign);
        assert!(share > LEAST_SHARE, "`{name}` is empty: {share} of it shows {sign:?}");
    }
}
