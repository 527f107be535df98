//! Checks whether the recorded lanes agree with the lateral positions. Options repair a file in
//! which they do not.
//!
//! Lane 1 is the leftmost lane, and `d` falls to the right. A file that counts its lanes from the
//! right, or whose lateral position points the other way, has every lane change on the wrong side.

use std::collections::BTreeMap;

use super::error::TrajectoryFileProblem;
use super::source::{ReadError, Row};

/// Least number of rows of a lane whose position is judged.
const LEAST_ROWS: usize = 10;
/// Least distance between the middles of two lanes (m). Below it, the positions say nothing about
/// the order of the lanes.
const LEAST_DISTANCE_M: f64 = 1.0;

/// Directions of the file that differ from the documented ones.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AxisOptions {
    /// The lateral position points to the other side than the layout states.
    pub mirror_d: bool,
    /// Lane 1 is the rightmost lane.
    pub lanes_from_right: bool,
}

/// What turns the rows of a file into the documented directions.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Axes {
    mirror_d: bool,
    /// The sum of the old and the new number of a lane, if lanes are counted from the right.
    lane_sum: Option<u8>,
}

impl Axes {
    /// Returns the choices of the options for a file that begins with `rows`.
    pub(super) fn new(options: AxisOptions, rows: &[Row]) -> Self {
        let most = rows.iter().map(|row| row.lane).max().unwrap_or(0);
        Self { mirror_d: options.mirror_d, lane_sum: options.lanes_from_right.then(|| most.saturating_add(1)) }
    }

    /// Turns a row. Lane 0, which means no lane, stays.
    pub(super) fn turn(self, row: &mut Row) {
        if self.mirror_d {
            row.d_m = -row.d_m;
        }
        if let Some(sum) = self.lane_sum
            && row.lane > 0
        {
            row.lane = sum.saturating_sub(row.lane).max(1);
        }
    }
}

/// Rejects rows in which more neighbouring lanes lie in the opposite order of their numbers than in
/// their order.
pub(super) fn check(rows: &[Row]) -> Result<(), ReadError> {
    let mut lanes: BTreeMap<u8, Vec<f64>> = BTreeMap::new();
    for row in rows.iter().filter(|row| row.lane > 0) {
        lanes.entry(row.lane).or_default().push(row.d_m);
    }
    let middles: Vec<(u8, f64)> = lanes
        .into_iter()
        .filter(|(_, positions)| positions.len() >= LEAST_ROWS)
        .map(|(lane, mut positions)| {
            let middle = positions.len() / 2;
            (lane, *positions.select_nth_unstable_by(middle, f64::total_cmp).1)
        })
        .collect();
    let (mut agree, mut contradict) = (0, 0);
    // Ramps and bays have numbers beside the count: only neighbours are compared.
    for pair in middles.windows(2).filter(|pair| pair[0].0 + 1 == pair[1].0) {
        agree += usize::from(pair[0].1 - pair[1].1 > LEAST_DISTANCE_M);
        contradict += usize::from(pair[1].1 - pair[0].1 > LEAST_DISTANCE_M);
    }
    let (Some(first), Some(last)) = (middles.first(), middles.last()) else { return Ok(()) };
    if contradict <= agree {
        return Ok(());
    }
    // To the right of the left edge, positions are negative.
    let is_mirrored = first.1 + last.1 > 0.0;
    let lanes = [first.0, last.0];
    let apart_m = last.1 - first.1;
    Err(ReadError::of_file(TrajectoryFileProblem::LanesAgainstPosition { lanes, apart_m, is_mirrored }))
}

#[cfg(test)]
mod tests {
    use crate::trajectory_data::{AxisOptions, ReadOptions, TrajectoryFileProblem, open_from};
    use std::fmt::Write;
    use std::path::Path;

    /// Returns a file with two vehicles in two lanes.
    fn file(lanes: [u8; 2], to_the_right_m: [f64; 2]) -> String {
        let mut text =
            "track_id,frame,time_s,s_m,d_m,lane_id,speed_mps,accel_mps2,length_m,width_m,vehicle_class\n".to_owned();
        for (track, (lane, d_m)) in lanes.into_iter().zip(to_the_right_m).enumerate() {
            for frame in 0..20 {
                let (time_s, s_m) = (0.1 * f64::from(frame), 3.0 * f64::from(frame));
                writeln!(text, "{track},{frame},{time_s:.1},{s_m},{d_m},{lane},30,0,4.5,1.8,car").unwrap();
            }
        }
        text
    }

    fn read(text: &str, axes: AxisOptions) -> Result<Vec<(u8, f64)>, TrajectoryFileProblem> {
        let options = ReadOptions { axes, ..ReadOptions::default() };
        let tracks = open_from(text.as_bytes(), Path::new("a.csv"), options, usize::MAX);
        let data = tracks.and_then(|tracks| tracks.collect_all()).map_err(|error| error.problem)?;
        Ok(data.trajectories.iter().map(|track| (track.points[0].lane.0, track.points[0].d_m)).collect())
    }

    #[test]
    fn lanes_against_the_lateral_position_are_refused_and_the_named_option_mends_them() {
        let right = vec![(1, -1.875), (2, -5.625)];
        let as_documented = AxisOptions::default();
        assert_eq!(read(&file([1, 2], [1.875, 5.625]), as_documented).unwrap(), right);
        let from_right = file([2, 1], [1.875, 5.625]);
        let error = read(&from_right, as_documented).unwrap_err();
        assert!(error.to_string().contains("from the right"), "{error}");
        assert_eq!(read(&from_right, AxisOptions { lanes_from_right: true, mirror_d: false }).unwrap(), right);
        let mirrored = file([1, 2], [-1.875, -5.625]);
        let error = read(&mirrored, as_documented).unwrap_err();
        assert!(error.to_string().contains("points to the left"), "{error}");
        assert_eq!(read(&mirrored, AxisOptions { mirror_d: true, lanes_from_right: false }).unwrap(), right);
        // The wrong option does not pass either.
        assert!(read(&file([1, 2], [1.875, 5.625]), AxisOptions { mirror_d: true, lanes_from_right: false }).is_err());
    }
}
