//! `paper` draws the figures of the published method for any set of trajectory files.

use std::fs;
use std::path::Path;

use closecall_testing::data;

use crate::support::{closecall, code, folder, library, message, stdout};

/// The pictures that the page holds.
const PICTURES: [&str; 6] = [
    "figure-3-noise.svg",
    "figure-5-width-by-class.svg",
    "figure-5-speed-by-file.svg",
    "figure-6-thw_s.svg",
    "figure-6-dce_m.svg",
    "figure-7-shares.svg",
];

fn check_figures(out: &Path, names: &[&str]) {
    for picture in PICTURES {
        let svg = fs::read_to_string(out.join(picture)).unwrap();
        assert!(svg.starts_with("<svg") && svg.ends_with("</svg>\n"), "{picture}");
    }
    let page = fs::read_to_string(out.join("index.html")).unwrap();
    for text in ["Figure 3", "Figure 5", "Figure 6", "Figure 7", "to the left (n = "].iter().chain(names) {
        assert!(page.contains(text), "{text}");
    }
    // The page has the style of every other page, in the dark, too. Each picture has a frame.
    assert!(page.contains("prefers-color-scheme: dark") && page.contains("name=\"viewport\""));
    assert_eq!(page.matches("<figure class=\"broad\"").count(), page.matches("<svg").count());
}

#[test]
fn one_command_draws_all_figures_of_our_own_traffic() {
    let folder = folder();
    let file = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    for (name, seed) in [("one.csv", "1"), ("two.csv", "2")] {
        let scenario = library("overtake-without-brake");
        let csv = file(name);
        let args = [
            "traffic",
            "record",
            scenario.to_str().unwrap(),
            "-n",
            "6",
            "--controller",
            "acc",
            "--seed",
            seed,
            "-o",
            &csv,
        ];
        stdout(&closecall(args), 0);
    }
    let (first, second, out) = (file("one.csv"), file("two.csv"), file("paper"));
    stdout(&closecall(["traffic", "paper", &first, &second, "-o", &out, "--repetitions", "2"]), 0);
    check_figures(Path::new(&out), &["overtake-without-brake"]);
    let twice = closecall(["traffic", "paper", &first, &first, "-o", &out]);
    assert_eq!(code(&twice), 2, "{}", message(&twice));
}

#[test]
fn the_figures_of_recorded_traffic_name_each_trajectory_file() {
    let Some(data) = data() else { return };
    let folder = folder();
    let out = folder.path().join("paper");
    let path = |name: &str| data.join(format!("ngsim_us101/trajectories/{name}.csv")).to_str().unwrap().to_owned();
    let (a, b) = (path("us101_a"), path("us101_b"));
    stdout(&closecall(["traffic", "paper", &a, &b, "-o", out.to_str().unwrap(), "--repetitions", "1"]), 0);
    check_figures(&out, &["us101_a", "us101_b"]);
}
