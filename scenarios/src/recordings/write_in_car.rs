//! Writing in-car logs, and what is true beside them.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use closecall_traffic::{Dimensions, Side, Time, VehicleClass};

use super::{MarkingDistances, WriteError};
use crate::atomic::write_atomically;

/// The columns that are written.
const HEADER: &str = "time_s,s_m,d_left_m,heading_rad,accel_mps2,yaw_rate_radps,speed_mps,left_marking_m,\
                      right_marking_m,length_m,width_m,vehicle_class";

const TRUTH_HEADER: &str = "direction,from_lane,to_lane,start_s,crossing_s,end_s,duration_s,speed_mps,complete";

/// What a test vehicle recorded.
#[derive(Clone, Debug, PartialEq)]
pub struct InCarLog {
    /// Kind of the vehicle.
    pub class: VehicleClass,
    /// Its size.
    pub dimensions: Dimensions,
    /// What it recorded, in the order of time.
    pub frames: Vec<InCarFrame>,
}

/// One row of an in-car log.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InCarFrame {
    /// When.
    pub time: Time,
    /// Position of the centre along the road [m].
    pub s_m: f64,
    /// Lateral position of the centre, positive to the left, 0 at the left edge of the leftmost lane [m].
    pub d_m: f64,
    /// Heading relative to the road, positive to the left [rad].
    pub heading_rad: f64,
    /// Acceleration along the vehicle [m/s²].
    pub acceleration_mps2: f64,
    /// Yaw rate, positive to the left [rad/s].
    pub yaw_rate_radps: f64,
    /// What the bus carries, on every fourth row.
    pub bus: Option<BusFrame>,
}

/// What a vehicle's bus carries.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BusFrame {
    /// Speed [m/s].
    pub speed_mps: f64,
    /// Distances to the markings of the own lane.
    pub markings: MarkingDistances,
}

/// A lane change as it truly was.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrueLaneChange {
    /// To the left or to the right.
    pub direction: Side,
    /// The lane before.
    pub from_lane: u8,
    /// The lane after.
    pub to_lane: u8,
    /// When the vehicle begins to move sideways [s].
    pub start_s: f64,
    /// First instant with the centre in the other lane [s].
    pub crossing_s: f64,
    /// When it no longer moves sideways [s].
    pub end_s: f64,
    /// Speed at the crossing [m/s].
    pub speed_mps: f64,
    /// True where start and end were both recorded.
    pub complete: bool,
}

/// Where the truth about the log at `path` is written: `drive.csv` has `drive.truth.csv` beside it.
pub fn truth_path(path: &Path) -> PathBuf {
    path.with_extension("truth.csv")
}

/// Writes an in-car log, times to 0.1 ms, lengths to 1 mm. The file appears at `path` as a whole, or not at all.
///
/// # Errors
/// [`WriteError`] where the file cannot be written, or a number is not finite.
pub fn write_in_car(log: &InCarLog, path: &Path) -> Result<(), WriteError> {
    for frame in &log.frames {
        check_finite(frame)?;
    }
    let written = write_atomically(path, |file| -> io::Result<()> {
        writeln!(file, "{HEADER}")?;
        log.frames.iter().try_for_each(|frame| write_frame(file, log, frame))
    });
    written.map_err(|source| WriteError::Io { path: path.to_owned(), source })
}

/// Writes what is true about a log. The file appears at `path` as a whole, or not at all.
///
/// # Errors
/// [`WriteError`] where the file cannot be written.
pub fn write_truth(changes: &[TrueLaneChange], path: &Path) -> Result<(), WriteError> {
    let written = write_atomically(path, |file| -> io::Result<()> {
        writeln!(file, "{TRUTH_HEADER}")?;
        changes.iter().try_for_each(|change| {
            let TrueLaneChange { direction, from_lane, to_lane, start_s, crossing_s, end_s, speed_mps, complete } =
                change;
            let direction = if *direction == Side::Left { "left" } else { "right" };
            let duration_s = end_s - start_s;
            writeln!(
                file,
                "{direction},{from_lane},{to_lane},{start_s:.2},{crossing_s:.2},{end_s:.2},{duration_s:.2},\
                 {speed_mps:.3},{complete}"
            )
        })
    });
    written.map_err(|source| WriteError::Io { path: path.to_owned(), source })
}

fn check_finite(frame: &InCarFrame) -> Result<(), WriteError> {
    let bus = frame.bus;
    let quantities = [
        ("the position along the road", frame.s_m),
        ("the lateral position", frame.d_m),
        ("the heading", frame.heading_rad),
        ("the acceleration", frame.acceleration_mps2),
        ("the yaw rate", frame.yaw_rate_radps),
        ("the speed", bus.map_or(0.0, |bus| bus.speed_mps)),
        ("the distance to the left marking", bus.and_then(|bus| bus.markings.left_m).unwrap_or_default()),
        ("the distance to the right marking", bus.and_then(|bus| bus.markings.right_m).unwrap_or_default()),
    ];
    match quantities.into_iter().find(|(_, value)| !value.is_finite()) {
        Some((what, _)) => Err(WriteError::NotFinite { track_id: 1, time_s: frame.time.s(), what }),
        None => Ok(()),
    }
}

fn write_frame(file: &mut dyn Write, log: &InCarLog, frame: &InCarFrame) -> io::Result<()> {
    let InCarFrame { time, s_m, d_m, heading_rad, acceleration_mps2, yaw_rate_radps, bus } = frame;
    write!(file, "{:.4},{s_m:.3},{d_m:.3},{heading_rad:.6},{acceleration_mps2:.3},{yaw_rate_radps:.6},", time.s())?;
    match bus {
        Some(BusFrame { speed_mps, markings }) => {
            let text = |distance: Option<f64>| distance.map(|metres| format!("{metres:.3}")).unwrap_or_default();
            write!(file, "{speed_mps:.3},{},{},", text(markings.left_m), text(markings.right_m))?;
        }
        None => write!(file, ",,,")?,
    }
    let Dimensions { length_m, width_m, .. } = log.dimensions;
    writeln!(file, "{length_m:.3},{width_m:.3},{}", log.class.name())
}
