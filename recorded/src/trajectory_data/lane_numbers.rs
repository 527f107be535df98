//! The numbers of strands across the road: by how many lanes each lies to the left of the reference
//! line.
//!
//! Within a chain, the order of the strands is known. Chains get their numbers one after the other:
//! strands with few rows last, and else the nearest to the reference line first. The position relative
//! to a strand that already has a number counts, where both are recorded beside each other: errors of
//! the line are the same for both there. Strands that lie apart, or between which vehicles change
//! lanes, get different numbers.

use std::collections::BTreeMap;

use closecall_traffic::statistics::quantiles::median;

use super::stated_lanes::{Strand, Strands};

/// Largest number of lanes on either side of the reference line.
const MAX_LANES_BESIDE: i64 = 20;

/// Least distance between two strands beside each other that are different lanes, as a share of the
/// lane width (-): vehicles that merge keep to the near side of a lane.
pub(super) const LEAST_APART: f64 = 0.4;

/// Share of the rows of the fullest strand below which a strand has few rows (-). It may be a ramp,
/// which lies where its neighbour does, or a piece that could not be joined. An assumption with a
/// plausible range of 0.05 to 0.3.
const FEW_ROWS: f64 = 0.2;

/// The lateral positions in a strand.
#[derive(Clone, Debug, Default)]
pub(super) struct StrandRows {
    rows: u64,
    sum_m: f64,
    /// Positions of vehicles (m), by section of the road.
    sections_m: BTreeMap<i64, Vec<f64>>,
}

impl StrandRows {
    /// Adds a row at `d_m` to the left of the line (m).
    pub(super) fn add(&mut self, d_m: f64) {
        self.rows += 1;
        self.sum_m += d_m;
    }

    /// Adds the position of a vehicle that follows the road in a section.
    pub(super) fn add_in_section(&mut self, section: i64, d_m: f64) {
        self.sections_m.entry(section).or_default().push(d_m);
    }
}

/// The numbers of the strands.
#[derive(Clone, Debug, Default)]
pub(super) struct LaneNumbers {
    /// By how many lanes each strand lies to the left of the reference line.
    pub(super) numbers: BTreeMap<Strand, i64>,
    /// `true` if the lane with the higher index lies to the right.
    pub(super) is_mirrored: bool,
}

/// Where a strand lies.
struct Measured {
    strand: Strand,
    rows: u64,
    mean_m: f64,
    /// Median position (m), by section of the road.
    medians_m: BTreeMap<i64, f64>,
}

impl Measured {
    /// Returns by how much this strand lies to the left of the other one (m), or `None` if they are
    /// not beside each other.
    fn left_m(&self, other: &Self) -> Option<f64> {
        let apart = self.medians_m.iter().filter_map(|(section, m)| Some(m - other.medians_m.get(section)?));
        let apart_m: Vec<f64> = apart.collect();
        (!apart_m.is_empty()).then(|| median(apart_m))
    }
}

impl LaneNumbers {
    /// Numbers the strands on a road with this lane width.
    pub(super) fn of_strands(rows: BTreeMap<Strand, StrandRows>, strands: &Strands, lane_width_m: f64) -> Self {
        let measured = rows.into_iter().map(|(strand, StrandRows { rows, sum_m, sections_m })| {
            let medians_m = sections_m.into_iter().map(|(section, positions_m)| (section, median(positions_m)));
            Measured { strand, rows, mean_m: sum_m / rows.max(1) as f64, medians_m: medians_m.collect() }
        });
        let mut measured: Vec<Measured> = measured.collect();
        let most = measured.iter().map(|lane| lane.rows).max().unwrap_or_default() as f64;
        let has_few = |lane: &Measured| (lane.rows as f64) < FEW_ROWS * most;
        measured.sort_by(|a, b| has_few(a).cmp(&has_few(b)).then(a.mean_m.abs().total_cmp(&b.mean_m.abs())));
        let is_mirrored = falls_with_index(&measured);
        let sense = if is_mirrored { -1 } else { 1 };
        let mut first_numbers: BTreeMap<u64, i64> = BTreeMap::new();
        let mut numbered: Vec<(&Measured, i64)> = Vec::new();
        for lane in &measured {
            let in_chain = lane.strand.number.saturating_mul(sense);
            let first = *first_numbers
                .entry(lane.strand.chain)
                .or_insert_with(|| beside_numbered(lane, &numbered, strands, lane_width_m).saturating_sub(in_chain));
            numbered.push((lane, clamped(first.saturating_add(in_chain))));
        }
        let numbers = numbered.into_iter().map(|(lane, number)| (lane.strand, number));
        Self { numbers: numbers.collect(), is_mirrored }
    }
}

/// Returns the number of a strand beside those that have one.
fn beside_numbered(lane: &Measured, numbered: &[(&Measured, i64)], strands: &Strands, lane_width_m: f64) -> i64 {
    let apart = numbered.iter().filter_map(|(other, number)| Some((lane.left_m(other)?, other.strand, *number)));
    let mut beside: Vec<(f64, Strand, i64)> = apart.collect();
    beside.sort_by(|a, b| a.0.abs().total_cmp(&b.0.abs()));
    let Some((nearest_m, _, nearest)) = beside.first() else { return lanes_of(lane.mean_m, lane_width_m) };
    let mut number = nearest + lanes_of(*nearest_m, lane_width_m);
    for (left_m, _, others_number) in &beside {
        if *left_m > LEAST_APART * lane_width_m {
            number = number.max(others_number + 1);
        } else if *left_m < -LEAST_APART * lane_width_m {
            number = number.min(others_number - 1);
        }
    }
    // A ramp may lie where the lane beside it does. It then takes the free side of that lane.
    let is_neighbour = |(_, other, others_number): &&(f64, Strand, i64)| {
        *others_number == number && strands.are_neighbours(lane.strand, *other)
    };
    let Some((left_m, ..)) = beside.iter().find(is_neighbour) else { return number };
    let sides = if *left_m > 0.0 { [number + 1, number - 1] } else { [number - 1, number + 1] };
    let is_free = |side: &i64| beside.iter().all(|(_, _, others_number)| others_number != side);
    sides.into_iter().find(is_free).unwrap_or(sides[0])
}

/// Returns `true` if most strands with a higher number in their chain lie to the right of those with a
/// lower one.
fn falls_with_index(measured: &[Measured]) -> bool {
    let mut rises: i64 = 0;
    for (k, lane) in measured.iter().enumerate() {
        let of_chain = measured[..k].iter().filter(|other| other.strand.chain == lane.strand.chain);
        for other in of_chain.filter(|other| other.strand.number != lane.strand.number) {
            let Some(left_m) = lane.left_m(other) else { continue };
            rises += if (left_m > 0.0) == (lane.strand.number > other.strand.number) { 1 } else { -1 };
        }
    }
    rises < 0
}

/// Returns the number of lane widths in a distance.
pub(super) fn lanes_of(d_m: f64, lane_width_m: f64) -> i64 {
    #[expect(clippy::cast_possible_truncation, reason = "a float cast saturates, and what is far away is clamped")]
    let lanes = (d_m / lane_width_m).round() as i64;
    clamped(lanes)
}

/// Returns a number of lanes that a road may have beside its reference line.
fn clamped(lanes: i64) -> i64 {
    lanes.clamp(-MAX_LANES_BESIDE, MAX_LANES_BESIDE)
}

#[cfg(test)]
mod tests {
    use super::super::stated_lanes::{LaneObserver, LaneRow, StatedLane};
    use super::*;

    #[test]
    fn a_ramp_that_lies_where_its_neighbour_does_takes_the_free_side() {
        // Vehicles change from lanelet 1 to lanelet 3, the ramp, which lies 0.1 m to its left.
        let mut observer = LaneObserver::default();
        for (vehicle, edge, changes_lane) in [(1, 1, false), (1, 3, true), (2, 2, false)] {
            let lane = StatedLane { edge, index: None };
            observer.add(LaneRow { vehicle, lane, changes_lane, s_m: 0.0 });
        }
        let strands = observer.strands();
        let mut rows: BTreeMap<Strand, StrandRows> = BTreeMap::new();
        for (edge, d_m, sections) in [(1, 0.0, 20), (2, 3.5, 20), (3, 0.1, 3)] {
            let strand = strands.of_lane(StatedLane { edge, index: None }).unwrap();
            let lane = rows.entry(strand).or_default();
            for section in 0..sections {
                lane.add(d_m);
                lane.add_in_section(section, d_m);
            }
        }
        let LaneNumbers { numbers, .. } = LaneNumbers::of_strands(rows, &strands, 3.5);
        assert_eq!(numbers.into_values().collect::<Vec<_>>(), [0, 1, -1]);
    }

    /// Numbers strands, given by chain, number, lateral position (m), and first and last section.
    fn numbers(lanes: &[(u64, i64, f64, i64, i64)]) -> (Vec<i64>, bool) {
        let mut rows: BTreeMap<Strand, StrandRows> = BTreeMap::new();
        for &(chain, number, d_m, first, last) in lanes {
            let strand = rows.entry(Strand { chain, number }).or_default();
            for section in first..=last {
                strand.add(d_m);
                strand.add_in_section(section, d_m);
            }
        }
        let LaneNumbers { numbers, is_mirrored } = LaneNumbers::of_strands(rows, &Strands::default(), 3.5);
        let number = |&(chain, number, ..): &(u64, i64, f64, i64, i64)| numbers[&Strand { chain, number }];
        (lanes.iter().map(number).collect(), is_mirrored)
    }

    #[test]
    fn lanes_of_one_chain_keep_their_order_although_the_ramp_lies_where_its_neighbour_does() {
        let lanes = [(1, 0, -3.6, 3, 5), (1, 1, -3.5, 0, 9), (1, 2, 0.1, 0, 9), (1, 3, 3.3, 0, 9)];
        assert_eq!(numbers(&lanes), (vec![-2, -1, 0, 1], false));
        let mirrored = lanes.map(|(chain, number, d_m, first, last)| (chain, number, -d_m, first, last));
        assert_eq!(numbers(&mirrored), (vec![2, 1, 0, -1], true));
    }

    #[test]
    fn lanes_of_other_widths_than_the_mean_get_one_number_each() {
        let lanes = [(1, 0, 0.0, 0, 9), (2, 0, 3.0, 0, 9), (3, 0, 6.0, 0, 9), (4, 0, 9.0, 0, 9), (5, 0, 12.0, 0, 9)];
        assert_eq!(numbers(&lanes), (vec![0, 1, 2, 3, 4], false));
        let wide = lanes.map(|(chain, number, d_m, first, last)| (chain, number, -1.4 * d_m, first, last));
        assert_eq!(numbers(&wide), (vec![0, -1, -2, -3, -4], false));
    }
}
