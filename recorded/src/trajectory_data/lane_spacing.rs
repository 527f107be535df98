//! Whether the lateral positions are metres across the road, by the distance between the middles of
//! the recorded lanes.
//!
//! ```text
//!   lane 1 ──●───────●──   middles of the recorded lanes: the median position of their rows
//!            ↕ 2.5 to 5.5 in metres, 8 to 18 in feet, 0.8 to 1.7 if metres are converted twice
//!   lane 2 ────●────●───
//! ```
//!
//! Lanes are 2.5 m (at roadworks) to 5.5 m (ramps) wide, as `markings` states. The lanes of US
//! interstates are 12 ft, 3.66 m (AASHTO, *A Policy on Design Standards: Interstate System*). A
//! single pair of lanes may be odd, as a ramp beyond a verge is. The lanes are refused if most
//! pairs are. Lanes are not too close if a single vehicle shows both: it may drive on the marking.

use std::collections::BTreeMap;

use closecall_traffic::statistics::quantiles::median;

use super::error::TrajectoryFileProblem;
use super::file_layout::Layout;
use super::markings::CARRIAGEWAY_GAP_M;
use super::source::{ReadError, Row};

/// Least number of rows of a lane whose position is judged.
const LEAST_ROWS: usize = 10;
/// Largest distance between the middles of two neighbouring lanes (m): above the widest lane,
/// 5.5 m, and below the narrowest in feet, 8.2.
const MOST_M: f64 = 6.0;
/// Least distance between them (m). If all vehicles change lanes at a constant rate, it is half a
/// lane, 1.5 m or more. Lanes of 3.75 m that are converted from feet although they are metres have
/// 1.14.
const LEAST_M: f64 = 1.4;

/// The positions of vehicles in a recorded lane.
struct LanePositions {
    d_m: Vec<f64>,
    /// Number of the vehicle, if it is the only one in the lane.
    only_vehicle: Option<u64>,
}

impl LanePositions {
    fn of_vehicle(vehicle: u64) -> Self {
        Self { d_m: Vec::new(), only_vehicle: Some(vehicle) }
    }

    fn add(&mut self, row: &Row) {
        self.d_m.push(row.d_m);
        self.only_vehicle = self.only_vehicle.filter(|vehicle| *vehicle == row.number);
    }
}

/// The middle of a recorded lane.
struct Middle {
    lane: u8,
    d_m: f64,
    /// Number of the vehicle, if it is the only one in the lane.
    only_vehicle: Option<u64>,
}

/// The distance between the middles of two lanes without a recorded lane between them.
struct Spacing {
    lanes: [u8; 2],
    /// Distance for each lane (m).
    per_lane_m: f64,
    /// `true` if a single vehicle shows both lanes.
    is_of_one_vehicle: bool,
}

impl Spacing {
    /// Returns the spacing of two lanes. Lanes between them may have no vehicle. `None` if a number
    /// is left out and a strip without vehicles is there: the lanes belong to two carriageways.
    fn of(first: &Middle, last: &Middle) -> Option<Self> {
        let (count, apart_m) = (last.lane - first.lane, (first.d_m - last.d_m).abs());
        let is_one_road = count == 1 || apart_m < CARRIAGEWAY_GAP_M;
        is_one_road.then(|| Self {
            lanes: [first.lane, last.lane],
            per_lane_m: apart_m / f64::from(count),
            is_of_one_vehicle: first.only_vehicle.is_some() && first.only_vehicle == last.only_vehicle,
        })
    }

    /// Returns true if the lanes are too far apart, or else too close.
    fn is_odd(&self, is_too_wide: bool) -> bool {
        if is_too_wide { self.per_lane_m > MOST_M } else { self.per_lane_m < LEAST_M && !self.is_of_one_vehicle }
    }
}

/// Rejects rows in which the middles of most neighbouring lanes are too far apart, or too close.
pub(super) fn check(rows: &[Row]) -> Result<(), ReadError> {
    let mut lanes: BTreeMap<u8, LanePositions> = BTreeMap::new();
    for row in rows.iter().filter(|row| row.lane > 0) {
        lanes.entry(row.lane).or_insert_with(|| LanePositions::of_vehicle(row.number)).add(row);
    }
    let judged = lanes.into_iter().filter(|(_, positions)| positions.d_m.len() >= LEAST_ROWS);
    let middle = |(lane, LanePositions { d_m, only_vehicle })| Middle { lane, d_m: median(d_m), only_vehicle };
    let middles: Vec<Middle> = judged.map(middle).collect();
    let spacings: Vec<Spacing> = middles.windows(2).filter_map(|pair| Spacing::of(&pair[0], &pair[1])).collect();
    for is_too_wide in [true, false] {
        let odd: Vec<&Spacing> = spacings.iter().filter(|spacing| spacing.is_odd(is_too_wide)).collect();
        if let Some(first) = odd.first().filter(|_| 2 * odd.len() > spacings.len()) {
            let Spacing { lanes, per_lane_m, .. } = **first;
            let cause = suspected_cause(Layout::Plain, is_too_wide);
            return Err(ReadError::of_file(TrajectoryFileProblem::LaneSpacing { lanes, per_lane_m, cause }));
        }
    }
    Ok(())
}

/// Returns the question for the likely cause of lanes that are too far apart, or too close.
pub(super) fn suspected_cause(layout: Layout, is_too_wide: bool) -> &'static str {
    match (layout, is_too_wide) {
        (Layout::Plain, true) => "is `d_m` in feet (0.3048 m)?",
        (Layout::Plain, false) => {
            "is `d_m` the distance from the middle of each lane, converted to metres twice, or in another unit?"
        }
        (Layout::Ngsim18 | Layout::Ngsim25, true) => "is `Local_X` in another unit than feet?",
        (Layout::Ngsim18 | Layout::Ngsim25, false) => "is `Local_X` in metres instead of feet?",
        _ => "are the lateral positions in another unit?",
    }
}

#[cfg(test)]
mod tests {
    use std::fmt::Write;
    use std::path::Path;

    use crate::lane_change::LaneReliability;
    use crate::trajectory_data::{ReadOptions, TrajectoryFileProblem, open_from};

    /// Metres of a foot.
    const FOOT_M: f64 = 0.3048;

    /// Reads a file with a vehicle in each of these lanes, at these positions to the right.
    fn read(lanes: &[(u8, f64)], reliability: LaneReliability) -> Result<usize, TrajectoryFileProblem> {
        let mut text =
            "track_id,frame,time_s,s_m,d_m,lane_id,speed_mps,accel_mps2,length_m,width_m,vehicle_class\n".to_owned();
        for (track, (lane, d_m)) in lanes.iter().enumerate() {
            for frame in 0..20 {
                let (time_s, s_m) = (0.1 * f64::from(frame), 3.0 * f64::from(frame));
                writeln!(text, "{track},{frame},{time_s:.1},{s_m},{d_m},{lane},30,0,4.5,1.8,car").unwrap();
            }
        }
        let options = ReadOptions { lanes: reliability, ..ReadOptions::default() };
        let tracks = open_from(text.as_bytes(), Path::new("a.csv"), options, usize::MAX);
        let data = tracks.and_then(|tracks| tracks.collect_all()).map_err(|error| error.problem)?;
        Ok(data.trajectories.len())
    }

    /// The middles of lanes of `width` that are numbered from 1.
    fn lanes(width: f64, count: u8) -> Vec<(u8, f64)> {
        (1..=count).map(|lane| (lane, width * (f64::from(lane) - 0.5))).collect()
    }

    fn problem(lanes: &[(u8, f64)]) -> Option<String> {
        read(lanes, LaneReliability::Reliable).err().map(|problem| problem.to_string())
    }

    #[test]
    fn positions_in_feet_are_refused_by_that_reason_and_widths_of_roads_are_not() {
        for width_m in [2.5, 2.75, 3.25, 3.66, 3.75, 4.2, 5.5] {
            for count in [2, 3, 5] {
                assert_eq!(problem(&lanes(width_m, count)), None, "{width_m} m");
                let in_feet = problem(&lanes(width_m / FOOT_M, count)).unwrap();
                assert!(in_feet.contains("in feet") && in_feet.contains("lanes 1 and 2"), "{in_feet}");
            }
        }
        for width_m in [2.75, 3.75, 4.2] {
            let twice = problem(&lanes(width_m * FOOT_M, 3)).unwrap();
            assert!(twice.contains("converted to metres twice"), "{twice}");
        }
        let of_each_lane = problem(&[(1, 0.1), (2, 0.0), (3, -0.1)]).unwrap();
        assert!(of_each_lane.contains("from the middle of each lane"), "{of_each_lane}");
    }

    #[test]
    fn a_single_vehicle_on_the_marking_is_no_other_unit() {
        let mut text =
            "track_id,frame,time_s,s_m,d_m,lane_id,speed_mps,accel_mps2,length_m,width_m,vehicle_class\n".to_owned();
        for frame in 0..40 {
            let (time_s, s_m, lane) = (0.1 * f64::from(frame), 3.0 * f64::from(frame), 1 + frame / 20);
            let d_m = 3.4 + 0.01 * f64::from(frame);
            writeln!(text, "1,{frame},{time_s:.1},{s_m},{d_m},{lane},30,0,4.5,1.8,car").unwrap();
        }
        let read = |text: &str| {
            let tracks = open_from(text.as_bytes(), Path::new("a.csv"), ReadOptions::default(), usize::MAX);
            tracks.and_then(|tracks| tracks.collect_all()).map(|data| data.trajectories.len())
        };
        assert!(matches!(read(&text), Ok(1)));
        // A second vehicle on the same marking shows that the positions are no metres across the road.
        let second: String = text.lines().skip(1).map(|row| row.replacen("1,", "2,", 1) + "\n").collect();
        assert!(read(&(text.clone() + &second)).is_err());
    }

    #[test]
    fn ramps_empty_lanes_and_other_carriageways_are_no_feet() {
        // A ramp beyond a verge, beside three lanes and beside two.
        assert_eq!(problem(&[(1, 1.8), (2, 5.4), (3, 9.0), (4, 25.0)]), None);
        assert_eq!(problem(&[(1, 1.8), (2, 5.4), (3, 21.0)]), None);
        // Lanes without vehicles, one and two of them.
        assert_eq!(problem(&[(1, 1.875), (3, 9.375)]), None);
        assert_eq!(problem(&[(1, 1.875), (4, 13.125)]), None);
        // A second carriageway, whose first number is left out, or which continues the count.
        assert_eq!(problem(&[(1, 1.8), (2, 5.4), (4, 25.0), (5, 28.6)]), None);
        assert_eq!(problem(&[(1, 1.8), (3, 25.0)]), None);
        assert_eq!(problem(&[(1, 1.8), (2, 5.4), (3, 25.0), (4, 28.6)]), None);
        // One lane says nothing.
        assert_eq!(problem(&[(2, 17.0)]), None);
    }

    #[test]
    fn lanes_that_do_not_count_are_not_judged() {
        assert!(read(&lanes(3.75 / FOOT_M, 3), LaneReliability::Unreliable).is_ok());
    }
}
