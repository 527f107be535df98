//! Generates a synthetic trajectory file of any size, to measure memory use and reading speed.
//!
//! ```sh
//! cargo run --release -p closecall-xtask -- make-trajectory-file plain 10GB /tmp/big.csv
//! /usr/bin/time -v closecall traffic lane-changes /tmp/big.csv > /tmp/changes.txt     # peak memory, user time
//! /usr/bin/time -v closecall traffic inspect /tmp/big.csv
//! ```
//!
//! Layouts: `plain` (sorted by vehicle), `plain-by-time`, `ngsim` (18 columns in feet, sorted by
//! vehicle). Each vehicle is on the road for 60 s at 10 Hz, and one vehicle in three changes lanes
//! once on a quintic path. The size is a number of bytes, optionally with `MB` or `GB`. The same
//! arguments yield the same bytes.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::process::ExitCode;

/// Time between two frames (s).
const PERIOD_S: f64 = 0.1;
/// Number of frames per vehicle.
const FRAMES: u64 = 600;
/// Number of frames between the entries of two vehicles.
const HEADWAY_FRAMES: u64 = 12;
const LANES: u64 = 5;
const LANE_M: f64 = 3.5;
const FOOT_M: f64 = 0.3048;

/// One vehicle at one instant.
struct Instant {
    vehicle: u64,
    frame: u64,
    s_m: f64,
    /// Distance to the right of the road's left edge (m).
    right_m: f64,
    lane: u64,
    speed_mps: f64,
}

/// Returns the state of a vehicle at `age` frames after its first frame.
fn instant(vehicle: u64, age: u64) -> Instant {
    let time_s = PERIOD_S * age as f64;
    let lane = 1 + vehicle % LANES;
    let speed_mps = 22.0 + 3.0 * (LANES - lane) as f64 + 0.1 * (vehicle % 7) as f64;
    let start_s = 15.0 + (vehicle % 11) as f64;
    let duration_s = 4.0 + 0.5 * (vehicle % 9) as f64;
    let tau = ((time_s - start_s) / duration_s).clamp(0.0, 1.0);
    let shape = tau.powi(3) * (10.0 - 15.0 * tau + 6.0 * tau * tau);
    let shift = match vehicle % 3 {
        0 if lane < LANES => shape,
        0 => -shape,
        _ => 0.0,
    };
    let lane_position = lane as f64 - 0.5 + shift;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between 0 and the number of lanes")]
    let lane_now = lane_position.floor() as u64 + 1;
    let frame = vehicle * HEADWAY_FRAMES + age;
    Instant { vehicle, frame, s_m: speed_mps * time_s, right_m: LANE_M * lane_position, lane: lane_now, speed_mps }
}

fn write_plain(file: &mut impl Write, at: &Instant) -> std::io::Result<u64> {
    let Instant { vehicle, frame, s_m, right_m, lane, speed_mps } = at;
    let time_s = *frame as f64 * PERIOD_S;
    let row = format!(
        "made,{vehicle},{vehicle},{frame},{time_s:.1},{s_m:.3},{right_m:.3},{lane},{speed_mps:.2},0.0,0.0,{s_m:.3},{:.3},4.5,1.8,car,made\n",
        -right_m
    );
    file.write_all(row.as_bytes())?;
    Ok(row.len() as u64)
}

fn write_ngsim(file: &mut impl Write, at: &Instant) -> std::io::Result<u64> {
    let Instant { vehicle, frame, s_m, right_m, lane, speed_mps } = at;
    let feet = |metres: f64| metres / FOOT_M;
    let row = format!(
        "{vehicle} {frame} {FRAMES} {} {:.3} {:.3} 0.000 0.000 14.8 5.9 2 {:.2} 0.00 {lane} 0 0 0.00 0.00\n",
        frame * 100,
        feet(*right_m),
        feet(*s_m + 2.25),
        feet(*speed_mps),
    );
    file.write_all(row.as_bytes())?;
    Ok(row.len() as u64)
}

fn make(layout: &str, bytes: u64, path: &str) -> std::io::Result<bool> {
    let mut file = BufWriter::with_capacity(1 << 20, File::create(path)?);
    let mut written = 0;
    if layout.starts_with("plain") {
        writeln!(
            file,
            "recording_id,track_id,vehicle_id,frame,time_s,s_m,d_m,lane_id,speed_mps,accel_mps2,heading_rel_rad,x_m,y_m,\
             length_m,width_m,vehicle_class,source_scenario"
        )?;
    }
    match layout {
        "plain" | "ngsim" => {
            for vehicle in 0.. {
                for age in 0..FRAMES {
                    let at = instant(vehicle, age);
                    written +=
                        if layout == "plain" { write_plain(&mut file, &at)? } else { write_ngsim(&mut file, &at)? };
                }
                if written >= bytes {
                    break;
                }
            }
        }
        "plain-by-time" => {
            for frame in 0_u64.. {
                let oldest = (frame + HEADWAY_FRAMES).saturating_sub(FRAMES) / HEADWAY_FRAMES;
                for vehicle in oldest..=frame / HEADWAY_FRAMES {
                    written += write_plain(&mut file, &instant(vehicle, frame - vehicle * HEADWAY_FRAMES))?;
                }
                if written >= bytes {
                    break;
                }
            }
        }
        _ => return Ok(false),
    }
    file.flush()?;
    Ok(true)
}

fn size(text: &str) -> Option<u64> {
    let (digits, factor) = match text.split_at_checked(text.len().saturating_sub(2)) {
        Some((digits, "GB")) => (digits, 1_000_000_000),
        Some((digits, "MB")) => (digits, 1_000_000),
        _ => (text, 1),
    };
    digits.parse::<u64>().ok()?.checked_mul(factor)
}

#[expect(clippy::print_stderr, reason = "a task speaks to people")]
pub(crate) fn main(args: Vec<String>) -> ExitCode {
    if let [layout, bytes, path] = args.as_slice()
        && let Some(bytes) = size(bytes)
    {
        match make(layout, bytes, path) {
            Ok(true) => return ExitCode::SUCCESS,
            Ok(false) => {}
            Err(error) => {
                eprintln!("failed to write {path}: {error}");
                return ExitCode::FAILURE;
            }
        }
    }
    eprintln!("usage: make-trajectory-file plain|plain-by-time|ngsim SIZE PATH, with a size as 500MB or 10GB");
    ExitCode::from(2)
}
