//! Writer of the plain layout.

use std::io::{self, Write};
use std::path::Path;

use closecall_traffic::{Dimensions, Time, Trajectory, TrajectoryPoint, maths};

use super::data::TrajectoryData;
use super::error::WriteError;
use super::plain::HEADER;
use closecall_traffic::atomic::write_atomically;

/// Value of the column `source_scenario`.
const SOURCE: &str = "closecall";

/// Maximum deviation of a time from a frame, as a share of the period.
const MAX_DEVIATION: f64 = 0.01;

/// Writes `data` in the plain layout, one row per track and frame. `x_m` and `y_m` are the
/// coordinates on a straight road.
///
/// Lengths are rounded to 0.1 mm. The file appears at `path` complete or not at all.
///
/// # Errors
/// Returns a [`WriteError`] if the file cannot be written, a number is not finite, or an instant
/// lies between two frames.
pub fn write_trajectories(data: &TrajectoryData, path: &Path) -> Result<(), WriteError> {
    let name = data.name.replace(['"', '\n', '\r', ','], "_");
    write_atomically(path, |file| {
        writeln!(file, "{}", HEADER.join(","))?;
        for track in &data.trajectories {
            for point in &track.points {
                check_finite(track, point)?;
                let frame = frame(track, point, data.period)?;
                write_row(file, &name, track, point, frame)?;
            }
        }
        Ok(())
    })
    .map_err(|failure| match failure {
        Failure::Invalid(error) => error,
        Failure::Io(source) => WriteError::Io { path: path.to_owned(), source },
    })
}

/// The reason why writing stopped, before the path of the file is attached.
enum Failure {
    Invalid(WriteError),
    Io(io::Error),
}

impl From<io::Error> for Failure {
    fn from(error: io::Error) -> Self {
        Self::Io(error)
    }
}

impl From<WriteError> for Failure {
    fn from(error: WriteError) -> Self {
        Self::Invalid(error)
    }
}

/// Returns the frame number of a point.
fn frame(track: &Trajectory, point: &TrajectoryPoint, period: Time) -> Result<i64, WriteError> {
    let frames = point.time.s() / period.s();
    let frame = frames.round();
    if !((frames - frame).abs() <= MAX_DEVIATION && frame >= 0.0) {
        let (track_id, time_s, period_s) = (track.track_id, point.time.s(), period.s());
        return Err(WriteError::OffClock { track_id, time_s, period_s });
    }
    #[expect(clippy::cast_possible_truncation, reason = "a whole number of frames, far below 2⁵³")]
    Ok(frame as i64)
}

/// Checks the numbers of a point and the size of its vehicle.
///
/// # Errors
/// Fails if a number is not finite.
pub(crate) fn check_finite(track: &Trajectory, point: &TrajectoryPoint) -> Result<(), WriteError> {
    let quantities = [
        ("the position along the road", point.s_m),
        ("the lateral position", point.d_m),
        ("the speed", point.speed_mps),
        ("the acceleration", point.acceleration_mps2),
        ("the lateral speed", point.lateral_speed_mps),
        ("the length", track.dimensions.length_m),
        ("the width", track.dimensions.width_m),
    ];
    match quantities.into_iter().find(|(_, value)| !value.is_finite()) {
        Some((quantity, _)) => {
            Err(WriteError::NotFinite { track_id: track.track_id, time_s: point.time.s(), quantity })
        }
        None => Ok(()),
    }
}

fn write_row(
    file: &mut dyn Write,
    name: &str,
    track: &Trajectory,
    point: &TrajectoryPoint,
    frame: i64,
) -> io::Result<()> {
    let TrajectoryPoint { s_m, d_m, lane, speed_mps, acceleration_mps2, .. } = point;
    write!(file, "{name},{},{},{frame},{},", track.track_id, track.vehicle_id, point.time.s())?;
    write!(file, "{s_m:.4},{:.4},{lane},{speed_mps:.4},{acceleration_mps2:.4},", -d_m)?;
    write!(file, "{:.6},{s_m:.4},{d_m:.4},", maths::atan2(point.lateral_speed_mps, *speed_mps))?;
    let Dimensions { length_m, width_m, .. } = track.dimensions;
    writeln!(file, "{length_m:.4},{width_m:.4},{},{SOURCE}", track.class.name())
}
