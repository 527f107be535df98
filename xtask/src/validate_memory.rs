//! Measures the peak memory of a campaign for several numbers of samples, and draws it as a chart.
//!
//! ```sh
//! cargo build --release && cargo run --release -p closecall-xtask -- validate-memory [MAX_SAMPLES] [FILE.svg]
//! cargo build --release && cargo run --release -p closecall-xtask -- validate-memory modes
//! ```
//!
//! The second command runs short paired campaigns in each mode, with one and with two threads, with
//! and without recordings. It first reads the whole program into the kernel's cache. This is the
//! worst case: the kernel then maps the surroundings of each page that is used.
//!
//! The first command measures the growth with the samples. The scenario is `low-thw-overtake` with
//! object-level sensors, cut to 2 s: a million samples then take minutes. The memory that a
//! campaign needs for a sample does not depend on the sample's duration. The campaign writes all
//! files of its folder; within 2 s hardly anything happens. There is nothing to record, and the
//! campaign says that the encounter did not happen. The peak is the kernel's value of resident
//! memory (`VmHWM`), read until the program ends; Linux only.

#![expect(clippy::print_stdout, reason = "a validation prints its result")]

use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

use plotters::prelude::*;

/// Largest allowed peak memory (MB).
const LIMIT_MB: f64 = 100.0;
const MB_PER_KIB: f64 = 1.024e-3;
/// The modes, with numbers of samples that take a few seconds.
const MODES: [(&str, u64); 3] = [("ground-truth", 100), ("object", 100), ("full", 8)];
/// Numbers of threads.
const JOBS: [u32; 2] = [1, 2];
/// Recordings: none, and three of random samples, which do not depend on the outcomes.
const RECORDINGS: [&str; 2] = ["random:0", "random:3"];
/// Exit code of a campaign in which the encounter did not happen.
const DID_NOT_HAPPEN: i32 = 7;
/// Interval at which the kernel's value is read.
const LOOK_EVERY: Duration = Duration::from_millis(5);
const SIZE: (u32, u32) = (760, 360);

/// Returns the peak so far (MB), or `None` if the program has ended.
fn peak_mb(process: u32) -> Option<f64> {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kib: f64 = line.trim().trim_end_matches("kB").trim().parse().ok()?;
    Some(kib * MB_PER_KIB)
}

/// Returns the program.
fn program() -> PathBuf {
    Path::new(crate::ROOT).join("target/release/closecall")
}

/// Runs a campaign and returns its peak memory (MB). It must end with the given exit code.
fn measure(arguments: &[&str], code: i32) -> Result<f64, Box<dyn Error>> {
    let root = Path::new(crate::ROOT);
    let folder = tempfile::tempdir()?;
    let mut command = Command::new(program());
    command.arg("campaign").arg(root.join("scenarios/library/low-thw-overtake.toml")).args(arguments);
    command.arg("--out").arg(folder.path().join("out")).stdout(Stdio::null()).stderr(Stdio::null());
    let mut child = command.spawn()?;
    let mut peak = 0.0_f64;
    let status = loop {
        if let Some(mb) = peak_mb(child.id()) {
            peak = peak.max(mb);
        }
        if let Some(status) = child.try_wait()? {
            break status;
        }
        std::thread::sleep(LOOK_EVERY);
    };
    if status.code() == Some(code) { Ok(peak) } else { Err(format!("{}: {status}", arguments.join(" ")).into()) }
}

/// Measures every mode. Fails if one needs too much.
fn measure_modes() -> Result<(), Box<dyn Error>> {
    std::io::copy(&mut std::fs::File::open(program())?, &mut std::io::sink())?;
    let mut most = 0.0_f64;
    for (mode, samples) in MODES {
        let samples = samples.to_string();
        for (jobs, recordings) in
            JOBS.iter().flat_map(|jobs| RECORDINGS.map(|recordings| (jobs.to_string(), recordings)))
        {
            let campaign = ["-n", &samples, "--seed", "5", "--paired", "--no-gate", "--sensors", mode];
            let mb = measure(&[&campaign[..], &["--jobs", &jobs, "--record", recordings]].concat(), 0)?;
            println!("{mode}, --jobs {jobs}, --record {recordings}: {mb:.1} MB");
            most = most.max(mb);
        }
    }
    if most < LIMIT_MB { Ok(()) } else { Err(format!("{most:.1} MB, {LIMIT_MB} MB allowed").into()) }
}

/// Draws the peak memory (MB) over the number of samples.
fn draw(path: &Path, points: &[(u64, f64)]) -> Result<(), Box<dyn Error>> {
    let most = points.last().map_or(1, |point| point.0);
    let first = points.first().map_or(1, |point| point.0);
    let highest = points.iter().fold(LIMIT_MB, |highest, point| highest.max(point.1));
    let canvas = SVGBackend::new(path, SIZE).into_drawing_area();
    canvas.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&canvas)
        .margin(16)
        .x_label_area_size(46)
        .y_label_area_size(64)
        .build_cartesian_2d((first as f64..most as f64).log_scale(), 0.0..1.25 * highest)?;
    chart
        .configure_mesh()
        .light_line_style(WHITE)
        .x_label_formatter(&|n| format!("{n:.0}"))
        .x_desc("samples")
        .y_desc("peak of resident memory [MB]")
        .label_style(("sans-serif", 14))
        .draw()?;
    let line: Vec<(f64, f64)> = points.iter().map(|&(samples, mb)| (samples as f64, mb)).collect();
    chart.draw_series(LineSeries::new(line.clone(), BLUE.stroke_width(2)))?;
    chart.draw_series(line.into_iter().map(|point| Circle::new(point, 4, BLUE.filled())))?;
    canvas.present()?;
    Ok(())
}

pub(crate) fn main(words: Vec<String>) -> Result<(), Box<dyn Error>> {
    let mut args = words.into_iter().peekable();
    if args.peek().is_some_and(|argument| argument == "modes") {
        return measure_modes();
    }
    let most: u64 = args.next().map_or(Ok(1_000_000), |most| most.parse())?;
    let mut points = Vec::new();
    let mut samples = 100;
    while samples < most {
        points.push(samples);
        samples *= 10;
    }
    points.push(most);
    let mut measured = Vec::with_capacity(points.len());
    for samples in points {
        let samples_text = samples.to_string();
        let campaign = ["-n", &samples_text, "--seed", "1", "--sensors", "object", "--set", "duration-s=2"];
        let mb = measure(&campaign, DID_NOT_HAPPEN)?;
        println!("{samples:>9} samples: {mb:.1} MB");
        measured.push((samples, mb));
    }
    if let Some(path) = args.next() {
        draw(Path::new(&path), &measured)?;
    }
    match measured.iter().find(|(_, mb)| !(*mb < LIMIT_MB)) {
        None => Ok(()),
        Some((samples, mb)) => Err(format!("{mb:.1} MB with {samples} samples, {LIMIT_MB} MB allowed").into()),
    }
}
