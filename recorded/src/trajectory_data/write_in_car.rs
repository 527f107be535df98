//! Writer of in-car logs, and of the true lane changes that belong to them.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use closecall_traffic::{Dimensions, Side, Time, VehicleClass};

use super::data::MarkingDistances;
use super::error::WriteError;
use closecall_traffic::atomic::write_atomically;

/// The columns of the log.
const HEADER: &str = "time_s,s_m,d_left_m,heading_rad,accel_mps2,yaw_rate_radps,speed_mps,left_marking_m,\
                      right_marking_m,length_m,width_m,vehicle_class";

/// The columns of the ground truth.
const TRUTH_HEADER: &str = "direction,from_lane,to_lane,start_s,crossing_s,end_s,duration_s,speed_mps,complete";

/// The log of a test vehicle.
#[derive(Clone, Debug, PartialEq)]
pub struct InCarLog {
    /// Class of the vehicle.
    pub class: VehicleClass,
    /// Dimensions of the vehicle.
    pub dimensions: Dimensions,
    /// The recorded rows, ordered by time.
    pub frames: Vec<InCarFrame>,
}

/// One row of an in-car log.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InCarFrame {
    /// Time of the row.
    pub time: Time,
    /// Position of the vehicle's centre along the road (m).
    pub s_m: f64,
    /// Lateral position of the centre, positive to the left, 0 at the left edge of the leftmost
    /// lane (m).
    pub d_m: f64,
    /// Heading relative to the road, positive to the left (rad).
    pub heading_rad: f64,
    /// Acceleration along the vehicle's longitudinal axis (m/s²).
    pub acceleration_mps2: f64,
    /// Yaw rate, positive to the left (rad/s).
    pub yaw_rate_radps: f64,
    /// Data of the vehicle bus, on every fourth row.
    pub bus: Option<BusFrame>,
}

/// The data that the vehicle bus carries.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BusFrame {
    /// Speed (m/s).
    pub speed_mps: f64,
    /// Distances to the markings of the vehicle's own lane.
    pub markings: MarkingDistances,
}

/// The ground truth of one lane change.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrueLaneChange {
    /// Direction of the lane change.
    pub direction: Side,
    /// Lane before the change.
    pub from_lane: u8,
    /// Lane after the change.
    pub to_lane: u8,
    /// Time at which the vehicle begins to move laterally (s).
    pub start_s: f64,
    /// Time of the first frame with the vehicle's centre in the other lane (s).
    pub crossing_s: f64,
    /// Time at which the lateral movement ends (s).
    pub end_s: f64,
    /// Speed at the crossing (m/s).
    pub speed_mps: f64,
    /// `true` if the log contains both start and end.
    pub complete: bool,
}

/// Returns the path of the ground truth that belongs to the log at `path`: `drive.csv` has
/// `drive.truth.csv` beside it.
pub fn ground_truth_path(path: &Path) -> PathBuf {
    path.with_extension("truth.csv")
}

/// Writes an in-car log, with times rounded to 0.1 ms and lengths to 1 mm. The file appears at
/// `path` complete or not at all.
///
/// # Errors
/// Returns a [`WriteError`] if the file cannot be written or a number is not finite.
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

/// Writes the true lane changes of a log. The file appears at `path` complete or not at all.
///
/// # Errors
/// Returns a [`WriteError`] if the file cannot be written.
pub fn write_ground_truth(changes: &[TrueLaneChange], path: &Path) -> Result<(), WriteError> {
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
        Some((quantity, _)) => Err(WriteError::NotFinite { track_id: 1, time_s: frame.time.s(), quantity }),
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
