//! Measures the peak memory of a campaign for several numbers of samples, and draws it as a chart.
//!
//! ```sh
//! cargo build --release && cargo run --release --example validate_memory -- [MAX_SAMPLES] [FILE.svg]
//! ```
//!
//! The scenario is `low-thw-overtake` with object-level sensors, cut to 2 s, so that a million samples take minutes. The
//! memory that a campaign needs for a sample does not depend on the sample's duration. The campaign writes all files of its
//! folder. The peak is the kernel's value of resident memory (`VmHWM`), read until the program ends; Linux only.

#![expect(clippy::print_stdout, reason = "a validation prints its result")]

use std::error::Error;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use plotters::prelude::*;

/// Largest allowed peak memory (MiB).
const LIMIT_MIB: f64 = 500.0;
const KIB_PER_MIB: f64 = 1_024.0;
/// Interval at which the kernel's value is read.
const LOOK_EVERY: Duration = Duration::from_millis(20);
const SIZE: (u32, u32) = (760, 360);

/// Returns the peak so far (MiB), or `None` if the program has ended.
fn peak_mib(process: u32) -> Option<f64> {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kib: f64 = line.trim().trim_end_matches("kB").trim().parse().ok()?;
    Some(kib / KIB_PER_MIB)
}

/// Runs a campaign and returns its peak memory (MiB).
fn measure(samples: u64) -> Result<f64, Box<dyn Error>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = tempfile::tempdir()?;
    let mut command = Command::new(root.join("target/release/closecall"));
    command.arg("campaign").arg(root.join("scenarios/library/low-thw-overtake.toml"));
    command.args(["-n", &samples.to_string(), "--seed", "1", "--sensors", "object", "--set", "duration-s=2", "--out"]);
    command.arg(folder.path().join("out")).stdout(Stdio::null());
    let mut child = command.spawn()?;
    let mut peak = 0.0_f64;
    let status = loop {
        if let Some(mib) = peak_mib(child.id()) {
            peak = peak.max(mib);
        }
        if let Some(status) = child.try_wait()? {
            break status;
        }
        std::thread::sleep(LOOK_EVERY);
    };
    if status.success() { Ok(peak) } else { Err(format!("{samples} samples: {status}").into()) }
}

/// Draws the peak memory (MiB) over the number of samples.
fn draw(path: &Path, points: &[(u64, f64)]) -> Result<(), Box<dyn Error>> {
    let most = points.last().map_or(1, |point| point.0);
    let first = points.first().map_or(1, |point| point.0);
    let canvas = SVGBackend::new(path, SIZE).into_drawing_area();
    canvas.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&canvas)
        .margin(16)
        .x_label_area_size(46)
        .y_label_area_size(64)
        .build_cartesian_2d((first as f64..most as f64).log_scale(), 0.0..LIMIT_MIB)?;
    chart
        .configure_mesh()
        .light_line_style(WHITE)
        .x_label_formatter(&|n| format!("{n:.0}"))
        .x_desc("samples")
        .y_desc("peak of resident memory [MiB]")
        .label_style(("sans-serif", 14))
        .draw()?;
    let line: Vec<(f64, f64)> = points.iter().map(|&(samples, mib)| (samples as f64, mib)).collect();
    chart.draw_series(LineSeries::new(line.clone(), BLUE.stroke_width(2)))?;
    chart.draw_series(line.into_iter().map(|point| Circle::new(point, 4, BLUE.filled())))?;
    canvas.present()?;
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut args = std::env::args().skip(1);
    let most: u64 = args.next().map_or(Ok(1_000_000), |most| most.parse())?;
    let mut points = Vec::new();
    let mut samples = 1_000;
    while samples < most {
        points.push(samples);
        samples *= 10;
    }
    points.push(most);
    let mut measured = Vec::with_capacity(points.len());
    for samples in points {
        let mib = measure(samples)?;
        println!("{samples:>9} samples: {mib:.0} MiB");
        measured.push((samples, mib));
    }
    if let Some(path) = args.next() {
        draw(Path::new(&path), &measured)?;
    }
    match measured.iter().find(|(_, mib)| !(*mib < LIMIT_MIB)) {
        None => Ok(()),
        Some((samples, mib)) => Err(format!("{mib:.0} MiB with {samples} samples, {LIMIT_MIB} MiB allowed").into()),
    }
}
