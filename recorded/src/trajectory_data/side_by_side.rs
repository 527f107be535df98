//! What vehicles side by side show of the recorded lanes.
//!
//! ```text
//!   lane 1 ──────■──────      two vehicles in neighbouring lanes: the one in the lane with the smaller
//!                ↕ 3.5 m      number is to the left, by about the width of a lane
//!   lane 2 ─────■───────
//!
//!   lane 1 ──■──────■───      two vehicles in one lane: one is behind the other
//! ```
//!
//! Only vehicles that are beside each other are compared: ramps have numbers beside the count, and
//! lie elsewhere along the road. In the windows of US-101, and in subsets of them down to a single
//! vehicle, vehicles of neighbouring lanes are in order, by 1.2 m or more. The median of 7 and more pairs of
//! vehicles is 2.7 to 4.7 m. At most 4 vehicles, of 13, have another one beside them in their lane,
//! and the vehicles of a lane are spread over 3.0 m at most.

use std::collections::{BTreeMap, BTreeSet};

use closecall_traffic::Time;
use closecall_traffic::statistics::quantiles::median;

use super::error::TrajectoryFileProblem;
use super::file_layout::Layout;
use super::lane_spacing::suspected_cause;
use super::markings::LANE_WIDTHS_M;
use super::source::{ReadError, Row};

/// Longest distance along the road of two vehicles side by side (m): a bend of a motorway departs by a
/// few centimetres from its tangent.
const ALONG_M: f64 = 15.0;
/// Number of later vehicles of the same instant with which a vehicle is compared.
const COMPARED: usize = 16;
/// Number of rows that are evaluated.
const ENOUGH_ROWS: usize = 1 << 18;

/// Least number of pairs of vehicles that show the order of two lanes.
const ORDER_PAIRS: usize = 2;
/// Least distance of two lanes that lie against their numbers (m), as in `axes`.
const LEAST_DISTANCE_M: f64 = 1.0;

/// Least number of pairs of vehicles that show the width of the lanes.
const WIDTH_PAIRS: usize = 8;
/// Mean distance of vehicles in neighbouring lanes that lanes may have (m): below the narrowest lane,
/// 2.5 m, and above half of a wide one, 4.2 m; above the widest lane, 5.5 m.
const DISTANCES_M: std::ops::RangeInclusive<f64> = 2.2..=6.0;

/// One in this number of pairs of vehicles that overlap along the road may be closer than neighbouring lanes.
const CLOSEST: usize = 10;

/// Least number of vehicles that show that lanes are not recorded.
const LEAST_VEHICLES: usize = 8;
/// Share of the vehicles with another one beside them in their lane above which lanes are in doubt
/// (-). An assumption with a plausible range of 0.35 to 0.6.
const BESIDE_SHARE: f64 = 0.4;
/// One in this number of the vehicles of a lane is left out on either side before their spread is
/// measured.
const LEFT_OUT: usize = 8;

/// The mean of a lateral position or distance.
#[derive(Clone, Copy, Debug, Default)]
struct Mean {
    sum_m: f64,
    count: u32,
}

impl Mean {
    fn add(&mut self, value_m: f64) {
        self.sum_m += value_m;
        self.count += 1;
    }

    fn get_m(self) -> f64 {
        self.sum_m / f64::from(self.count)
    }
}

/// A vehicle of a data set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Vehicle {
    origin: Time,
    number: u64,
}

/// Two vehicles in neighbouring lanes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Pair {
    left_lane: u8,
    left: Vehicle,
    right: Vehicle,
}

/// A lane of a data set, and a vehicle in it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct InLane {
    lane: u8,
    vehicle: Vehicle,
}

/// The vehicles of a lane, and the width that they take up.
#[derive(Clone, Copy, Debug)]
struct Spread {
    lane: u8,
    vehicles: usize,
    spread_m: f64,
}

/// What vehicles side by side show of the recorded lanes.
#[derive(Debug, Default)]
pub(super) struct SideBySide {
    /// Distance to the left of the vehicle in the lane with the smaller number (m).
    neighbours: BTreeMap<Pair, Mean>,
    /// Lateral position of each vehicle in each of its lanes (m).
    positions: BTreeMap<InLane, Mean>,
    vehicles: BTreeSet<Vehicle>,
    /// The vehicles that have another one beside them in their lane.
    doubled: BTreeSet<Vehicle>,
}

impl SideBySide {
    /// Compares the vehicles of the beginning of a file.
    pub(super) fn of(rows: &[Row]) -> Self {
        let mut sorted: Vec<&Row> = rows.iter().take(ENOUGH_ROWS).filter(|row| row.lane > 0).collect();
        sorted.sort_by(|a, b| (a.origin, a.time).cmp(&(b.origin, b.time)).then(a.s_m.total_cmp(&b.s_m)));
        let mut all = Self::default();
        for row in &sorted {
            let vehicle = vehicle(row);
            all.vehicles.insert(vehicle);
            all.positions.entry(InLane { lane: row.lane, vehicle }).or_default().add(row.d_m);
        }
        for instant in sorted.chunk_by(|a, b| (a.origin, a.time) == (b.origin, b.time)) {
            for (index, rear) in instant.iter().enumerate() {
                let beside = instant[index + 1..].iter().take_while(|front| front.s_m - rear.s_m <= ALONG_M);
                beside.take(COMPARED).for_each(|front| all.add(rear, front));
            }
        }
        all
    }

    fn add(&mut self, rear: &Row, front: &Row) {
        if rear.vehicle_id == front.vehicle_id {
            return;
        }
        let (left, right) = if rear.lane < front.lane { (rear, front) } else { (front, rear) };
        let apart_m = left.d_m - right.d_m;
        match right.lane - left.lane {
            0 => {
                let overlaps = front.s_m - rear.s_m < 0.5 * (front.length_m + rear.length_m);
                if overlaps && apart_m.abs() > 0.5 * (front.width_m + rear.width_m) {
                    self.doubled.extend([vehicle(rear), vehicle(front)]);
                }
            }
            1 => {
                let pair = Pair { left_lane: left.lane, left: vehicle(left), right: vehicle(right) };
                self.neighbours.entry(pair).or_default().add(apart_m);
            }
            _ => {}
        }
    }

    /// Rejects lanes that lie against the order of their numbers, or whose distance no road has.
    pub(super) fn check(&self, layout: Layout) -> Result<(), ReadError> {
        let mut lanes: BTreeMap<u8, Vec<f64>> = BTreeMap::new();
        for (pair, apart) in &self.neighbours {
            lanes.entry(pair.left_lane).or_default().push(apart.get_m());
        }
        for (left, distances_m) in lanes.iter().filter(|(_, distances_m)| distances_m.len() >= ORDER_PAIRS) {
            let apart_m = -median(distances_m.clone());
            if apart_m > LEAST_DISTANCE_M {
                let lanes = [*left, left + 1];
                return Err(ReadError::of_file(TrajectoryFileProblem::LanesOutOfOrder { lanes, apart_m }));
            }
        }
        let all_m: Vec<f64> = lanes.values().flatten().copied().collect();
        let Some(first) = lanes.keys().next().filter(|_| all_m.len() >= WIDTH_PAIRS) else { return Ok(()) };
        let per_lane_m = median(all_m);
        if DISTANCES_M.contains(&per_lane_m) {
            return Ok(());
        }
        let lanes = [*first, first + 1];
        let cause = suspected_cause(layout, per_lane_m > *DISTANCES_M.end());
        Err(ReadError::of_file(TrajectoryFileProblem::LaneSpacing { lanes, per_lane_m, cause }))
    }

    /// Returns why the recorded lanes are in doubt: vehicles of one lane drive beside each other, or
    /// take up more than a lane.
    pub(super) fn doubt(&self) -> Option<String> {
        let end = "the lanes are not recorded, or their numbers have another meaning; a search that takes no lane as recorded goes by \
                   the positions";
        if let Some(Spread { lane, vehicles, spread_m }) = self.widest() {
            return Some(format!(
                "the {vehicles} vehicles of lane {lane} are spread over {spread_m:.1} m, but lanes are up to {} m wide: {end}",
                LANE_WIDTHS_M.end()
            ));
        }
        let (doubled, vehicles) = (self.doubled.len(), self.vehicles.len());
        let is_common = doubled >= LEAST_VEHICLES && doubled as f64 > BESIDE_SHARE * vehicles as f64;
        is_common.then(|| {
            format!(
                "{doubled} of {vehicles} vehicles drive beside another one that is recorded in the same lane: {end}"
            )
        })
    }

    /// Returns the first lane whose vehicles are spread over more than the width of a lane.
    fn widest(&self) -> Option<Spread> {
        let mut lanes: BTreeMap<(u8, Time), Vec<f64>> = BTreeMap::new();
        for (InLane { lane, vehicle }, position) in &self.positions {
            lanes.entry((*lane, vehicle.origin)).or_default().push(position.get_m());
        }
        lanes.into_iter().find_map(|((lane, _), mut positions_m)| {
            let vehicles = positions_m.len();
            if vehicles < LEAST_VEHICLES {
                return None;
            }
            positions_m.sort_by(f64::total_cmp);
            let left_out = vehicles / LEFT_OUT;
            let spread_m = positions_m[vehicles - 1 - left_out] - positions_m[left_out];
            (spread_m > *LANE_WIDTHS_M.end()).then_some(Spread { lane, vehicles, spread_m })
        })
    }
}

/// Returns why the unit of the lateral position is in doubt, whatever the recorded lanes are: vehicles that
/// overlap along the road are further apart than neighbouring lanes.
pub(super) fn doubt_of_unit(rows: &[Row]) -> Option<String> {
    let mut sorted: Vec<&Row> = rows.iter().take(ENOUGH_ROWS).collect();
    sorted.sort_by(|a, b| (a.origin, a.time).cmp(&(b.origin, b.time)).then(a.s_m.total_cmp(&b.s_m)));
    let mut pairs: BTreeMap<[Vehicle; 2], Mean> = BTreeMap::new();
    for instant in sorted.chunk_by(|a, b| (a.origin, a.time) == (b.origin, b.time)) {
        for (index, rear) in instant.iter().enumerate() {
            for front in instant[index + 1..].iter().take(COMPARED) {
                let overlaps = front.s_m - rear.s_m < 0.5 * (front.length_m + rear.length_m);
                if overlaps && rear.vehicle_id != front.vehicle_id {
                    let pair = [vehicle(rear).min(vehicle(front)), vehicle(rear).max(vehicle(front))];
                    pairs.entry(pair).or_default().add((rear.d_m - front.d_m).abs());
                }
            }
        }
    }
    let mut apart_m: Vec<f64> = pairs.values().map(|apart| apart.get_m()).collect();
    apart_m.sort_by(f64::total_cmp);
    let closest_m = *apart_m.get(apart_m.len() / CLOSEST).filter(|_| apart_m.len() >= WIDTH_PAIRS)?;
    (closest_m > *DISTANCES_M.end()).then(|| {
        format!(
            "vehicles beside each other are {closest_m:.1} m apart or more, but lanes are up to {} m wide: the lateral position has \
             another unit",
            LANE_WIDTHS_M.end()
        )
    })
}

fn vehicle(row: &Row) -> Vehicle {
    Vehicle { origin: row.origin, number: row.vehicle_id }
}

#[cfg(test)]
mod tests {
    use std::fmt::Write;
    use std::path::Path;

    use crate::lane_change::LaneReliability;
    use crate::trajectory_data::{ReadOptions, TrajectoryData, TrajectoryFileProblem, open_from};

    /// Reads a file with vehicles side by side, three in each of these lanes at these positions to the
    /// right.
    fn read(lanes: &[(u8, f64)]) -> Result<TrajectoryData, TrajectoryFileProblem> {
        read_with(lanes, LaneReliability::Reliable)
    }

    fn read_with(lanes: &[(u8, f64)], reliability: LaneReliability) -> Result<TrajectoryData, TrajectoryFileProblem> {
        let mut text =
            "track_id,frame,time_s,s_m,d_m,lane_id,speed_mps,accel_mps2,length_m,width_m,vehicle_class\n".to_owned();
        for (index, (lane, d_m)) in lanes.iter().enumerate() {
            for row in 0..3 {
                for frame in 0..20 {
                    let (track, time_s) = (3 * index + row, 0.1 * f64::from(frame));
                    let s_m = 60.0 * row as f64 + 3.0 * f64::from(frame);
                    writeln!(text, "{track},{frame},{time_s:.1},{s_m},{d_m},{lane},30,0,4.5,1.8,car").unwrap();
                }
            }
        }
        let options = ReadOptions { lanes: reliability, ..ReadOptions::default() };
        let tracks = open_from(text.as_bytes(), Path::new("a.csv"), options, usize::MAX);
        tracks.and_then(|tracks| tracks.collect_all()).map_err(|error| error.problem)
    }

    #[test]
    fn lanes_that_lie_against_their_numbers_are_refused_wherever_they_are() {
        assert!(!read(&[(1, 1.8), (2, 5.4), (3, 9.0), (4, 12.6), (5, 16.2)]).unwrap().doubts_lanes);
        // A vehicle merges beside the marking, but lanes are in order.
        assert!(read(&[(1, 1.8), (2, 5.4), (3, 6.6)]).is_ok());
        let problem = read(&[(1, 1.8), (3, 5.4), (2, 9.0), (4, 12.6), (5, 16.2)]).unwrap_err().to_string();
        assert!(problem.contains("lane 3 lies 3.6 m to the left of lane 2"), "{problem}");
        assert!(!problem.contains("from the right"), "{problem}");
        let reversed = read(&[(3, 1.8), (2, 5.4), (1, 9.0)]).unwrap_err().to_string();
        assert!(reversed.contains("from the right"), "{reversed}");
    }

    #[test]
    fn half_of_a_lane_width_is_refused_and_narrow_lanes_are_not() {
        let lanes =
            |width: f64| -> Vec<(u8, f64)> { (1..=5).map(|lane| (lane, width * (f64::from(lane) - 0.5))).collect() };
        for width_m in [2.5, 3.5, 5.5] {
            assert!(read(&lanes(width_m)).is_ok(), "{width_m} m");
        }
        let problem = read(&lanes(1.7)).unwrap_err().to_string();
        assert!(problem.contains("1.7 m apart") && problem.contains("`d_m`"), "{problem}");
    }

    #[test]
    fn without_lanes_another_unit_is_in_doubt_by_the_vehicles_beside_each_other() {
        let without = |width: f64| {
            let lanes: Vec<(u8, f64)> = (0..5).map(|lane| (0, width * (f64::from(lane) + 0.5))).collect();
            read_with(&lanes, LaneReliability::Unreliable).unwrap()
        };
        assert!(!without(3.6).is_in_doubt, "{:?}", without(3.6).notes);
        for width in [3.6 / 0.3048, 150.0] {
            let data = without(width);
            assert!(
                data.is_in_doubt && data.notes.iter().any(|note| note.contains("another unit")),
                "{:?}",
                data.notes
            );
        }
    }

    #[test]
    fn one_number_for_all_lanes_is_in_doubt() {
        let beside = read(&[(1, 1.8), (1, 5.4), (1, 9.0)]).unwrap();
        assert!(beside.doubts_lanes && beside.is_in_doubt);
        assert!(beside.warnings().iter().any(|warning| warning.contains("lane 1 are spread over 7.2 m")));
        let two = read(&[(1, 1.0), (1, 3.0), (2, 5.0), (2, 7.0)]).unwrap();
        assert!(two.warnings().iter().any(|warning| warning.contains("12 of 12 vehicles drive beside another one")));
        // Six vehicles say too little.
        assert!(!read(&[(1, 1.8), (2, 5.4), (2, 7.6)]).unwrap().is_in_doubt);
    }
}
