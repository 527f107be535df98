//! Lanes that are estimated from the traffic, for files whose lanes are missing or unreliable.
//!
//! ```text
//!   share of   │   ╭╮      ╭─╮     ╭╮
//!   positions  │  ╱  ╲    ╱   ╲   ╱  ╲        density of the lateral positions
//!              │ ╱    ╲__╱     ╲_╱    ╲_
//!              └───┼────┬───┼────┬──┼─────▶ to the right
//!                mode 1 │ mode 2 │ mode 3     ┬: marking, halfway between two modes
//! ```
//!
//! 1. The lane width is the period of the density between 3.0 and 4.0 m: the width w with the largest
//!    resultant R = |Σ exp(2πi·d/w)| / n (the Rayleigh statistic of circular data; K. V. Mardia, P. E.
//!    Jupp, *Directional Statistics*, 2000, section 6.3). Lanes are 3.25 to 3.75 m wide on German
//!    motorways (RAA 2008), 3.66 m on US interstates, and 3.4 m in NGSIM.
//! 2. Within each period, the mode of the density is where vehicles drive. An empty lane between two others has
//!    its mode between theirs.
//! 3. A marking lies halfway between two modes. Drivers keep off the middle of their lanes by a
//!    common distance. If the modes lie near the middles of lanes that begin at d = 0, the left edge
//!    of lane 1 by the definition of the layouts, the markings are shifted back by it.
//!
//! The lanes of several carriageways, which lie more than 12 m apart, are estimated one by one. The
//! estimate fails if a carriageway has few vehicles or a single lane, or if no period stands out.

use std::collections::BTreeSet;
use std::f64::consts::PI;
use std::ops::RangeInclusive;

use closecall_traffic::{Lane, maths};

use super::markings::{CARRIAGEWAY_GAP_M, LaneMarkings};
use super::source::Row;

/// Lane widths that are tried (m), and their step.
pub(super) const WIDTHS_M: RangeInclusive<f64> = 3.0..=4.0;
const WIDTH_STEP_M: f64 = 0.02;

/// Bandwidth of the density (m): the spread of vehicles within their lanes. An assumption with a
/// plausible range of 0.2 to 0.5 m.
const BANDWIDTH_M: f64 = 0.35;
/// Step at which the density is evaluated (m).
const DENSITY_STEP_M: f64 = 0.05;
/// Part of a lane on either side of its middle in which its mode is searched (-).
const MODE_SHARE: f64 = 0.4;

/// Least resultant of the lane width (-). Positions of 15 vehicles that are spread evenly reach 0.4
/// at some width; the windows of US-101 have 0.6 to 0.75.
pub(super) const LEAST_RESULTANT: f64 = 0.5;
/// Least number of vehicles of a carriageway.
pub(super) const LEAST_VEHICLES: usize = 15;
/// Least share of the rows of its carriageway that a lane holds (-).
const LEAST_SHARE: f64 = 0.01;
/// Largest distance between the modes and the middles of lanes that begin at d = 0 (m): a third of a
/// lane. Beyond it, a mode may belong to either of two lanes. The windows of US-101 have 0.3 to 0.9 m.
const LARGEST_OFFSET_M: f64 = 1.1;
/// Number of rows that are evaluated.
const ENOUGH_ROWS: usize = 50_000;

/// The reason why the traffic shows no lanes.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub(super) enum NoLanesShown {
    #[error("{vehicles} vehicles are too few, {} are needed", LEAST_VEHICLES)]
    FewVehicles { vehicles: usize },
    #[error("no lane width stands out: the resultant is {resultant:.2}, but {} is needed", LEAST_RESULTANT)]
    NoWidth { resultant: f64 },
    #[error("the vehicles of a carriageway drive in a single lane")]
    SingleLane,
}

/// The lanes of one carriageway.
#[derive(Clone, Debug, PartialEq)]
struct Carriageway {
    /// Positions between which the carriageway lies (m).
    from_m: f64,
    to_m: f64,
    /// Number before the first lane.
    first_lane: u8,
    /// Markings between lanes, from left to right (m).
    markings_m: Vec<f64>,
    width_m: f64,
    /// Position of the left edge of the leftmost lane (m).
    left_m: f64,
}

/// Lanes that are estimated from the traffic.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct EstimatedLanes(Vec<Carriageway>);

impl EstimatedLanes {
    /// Estimates the lanes from the beginning of a file.
    ///
    /// # Errors
    /// The reason why the traffic shows no lanes.
    pub(super) fn of(rows: &[Row]) -> Result<Self, NoLanesShown> {
        let every = rows.len().div_ceil(ENOUGH_ROWS).max(1);
        let mut positions: Vec<(f64, u64)> = rows.iter().step_by(every).map(|row| (row.d_m, row.number)).collect();
        positions.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut carriageways: Vec<Carriageway> = Vec::new();
        let mut first_lane = 0_u8;
        for group in positions.chunk_by(|left, right| left.0 - right.0 < CARRIAGEWAY_GAP_M) {
            let carriageway = Carriageway::of(group, first_lane, carriageways.is_empty())?;
            let lanes = u8::try_from(carriageway.markings_m.len() + 1).unwrap_or(u8::MAX);
            first_lane = first_lane.saturating_add(lanes).saturating_add(1);
            carriageways.push(carriageway);
        }
        Ok(Self(carriageways))
    }

    /// Returns the lane at a lateral position.
    pub(super) fn at(&self, d_m: f64) -> u8 {
        let distance = |road: &Carriageway| (road.to_m - d_m).max(d_m - road.from_m).max(0.0);
        let nearest = self.0.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
        nearest.map_or(1, |road| {
            let passed = road.markings_m.iter().filter(|marking_m| **marking_m >= d_m).count();
            road.first_lane.saturating_add(u8::try_from(passed + 1).unwrap_or(u8::MAX))
        })
    }

    /// Returns the markings of the lanes.
    pub(super) fn markings(&self) -> LaneMarkings {
        LaneMarkings::from_right_edges(self.0.iter().flat_map(|road| {
            let last_m = road.markings_m.last().copied().unwrap_or(road.left_m) - road.width_m;
            let left = (road.first_lane > 0).then_some(road.left_m);
            let edges = left.into_iter().chain(road.markings_m.iter().copied()).chain([last_m]);
            let first = road.first_lane.saturating_add(u8::from(left.is_none()));
            (first..u8::MAX).map(Lane).zip(edges)
        }))
    }
}

impl Carriageway {
    /// Estimates the lanes of a carriageway from its positions, which fall to the right.
    fn of(positions: &[(f64, u64)], first_lane: u8, is_first: bool) -> Result<Self, NoLanesShown> {
        let vehicles: BTreeSet<u64> = positions.iter().map(|(_, vehicle)| *vehicle).collect();
        if vehicles.len() < LEAST_VEHICLES {
            return Err(NoLanesShown::FewVehicles { vehicles: vehicles.len() });
        }
        // To the right, as lanes are counted.
        let right_m: Vec<f64> = positions.iter().map(|(d_m, _)| -d_m).collect();
        let Period { resultant, width_m, phase_m } = Period::of(&right_m, WIDTHS_M);
        if !(resultant >= LEAST_RESULTANT) {
            return Err(NoLanesShown::NoWidth { resultant });
        }
        let modes_m = modes(&right_m, width_m, phase_m);
        if modes_m.len() < 2 {
            return Err(NoLanesShown::SingleLane);
        }
        let offset_m = if is_first { offset(&modes_m, width_m) } else { None };
        let markings_m = modes_m.windows(2).map(|pair| -(0.5 * (pair[0] + pair[1]) - offset_m.unwrap_or(0.0)));
        // Lanes to the left of the leftmost mode count, if they begin at d = 0.
        let before = offset_m.map_or(0, |offset_m| index_of(modes_m[0] - offset_m, width_m));
        let missing = (1..=before).map(|lane| -width_m * f64::from(lane));
        let (from_m, to_m) = (positions[0].0, positions[positions.len() - 1].0);
        let left_m = if offset_m.is_some() { 0.0 } else { 0.5 * width_m - modes_m[0] };
        let markings_m = missing.chain(markings_m).collect();
        Ok(Self { from_m, to_m, first_lane, markings_m, width_m, left_m })
    }
}

/// The period of lateral positions.
#[derive(Clone, Copy, Debug)]
pub(super) struct Period {
    /// Resultant at the width (-): 1 if all vehicles drive on lines that are a width apart.
    pub(super) resultant: f64,
    pub(super) width_m: f64,
    /// The middle of a lane, from 0 to the width (m).
    pub(super) phase_m: f64,
}

impl Period {
    /// Returns the period with the largest resultant of all widths in `widths_m`.
    pub(super) fn of(positions_m: &[f64], widths_m: RangeInclusive<f64>) -> Self {
        let steps = ((widths_m.end() - widths_m.start()) / WIDTH_STEP_M).round();
        let mut width_m = *widths_m.start();
        let mut best = Self { resultant: 0.0, width_m, phase_m: 0.0 };
        for _ in 0..=steps as u32 {
            let (mut cosine, mut sine) = (0.0, 0.0);
            for position_m in positions_m {
                let angle = 2.0 * PI * position_m / width_m;
                cosine += maths::cos(angle);
                sine += maths::sin(angle);
            }
            let resultant = maths::hypot(cosine, sine) / positions_m.len() as f64;
            if resultant > best.resultant {
                let phase_m = (maths::atan2(sine, cosine) / (2.0 * PI) * width_m).rem_euclid(width_m);
                best = Self { resultant, width_m, phase_m };
            }
            width_m += WIDTH_STEP_M;
        }
        best
    }
}

/// Returns the mode of each lane that holds vehicles, or lies between lanes that do, from left to right (m, to the
/// right).
fn modes(right_m: &[f64], width_m: f64, phase_m: f64) -> Vec<f64> {
    let (least_m, most_m) = (right_m[0], right_m[right_m.len() - 1]);
    let mut modes: Vec<f64> = Vec::new();
    // Number of empty lanes to the right of the last mode.
    let mut empty = 0_u32;
    let mut middle_m = phase_m + width_m * ((least_m - phase_m) / width_m).floor();
    while middle_m <= most_m + 0.5 * width_m {
        let within = |from_m: f64, to_m: f64| {
            let (first, last) = (right_m.partition_point(|d| *d < from_m), right_m.partition_point(|d| *d <= to_m));
            &right_m[first..last.max(first)]
        };
        let share = within(middle_m - 0.5 * width_m, middle_m + 0.5 * width_m).len() as f64 / right_m.len() as f64;
        if share >= LEAST_SHARE {
            let steps = (2.0 * MODE_SHARE * width_m / DENSITY_STEP_M).floor() as u32;
            let at = |step: u32| middle_m - MODE_SHARE * width_m + DENSITY_STEP_M * f64::from(step);
            let density = |at_m: f64| -> f64 {
                let near = within(at_m - 4.0 * BANDWIDTH_M, at_m + 4.0 * BANDWIDTH_M);
                near.iter().map(|d| maths::exp(-0.5 * ((d - at_m) / BANDWIDTH_M).powi(2))).sum()
            };
            let mode = (0..=steps).map(|step| (density(at(step)), at(step))).max_by(|a, b| a.0.total_cmp(&b.0));
            if let (Some(left_m), Some((_, mode_m))) = (modes.last().copied(), mode) {
                let step_m = (mode_m - left_m) / f64::from(empty + 1);
                modes.extend((1..=empty).map(|lane| left_m + step_m * f64::from(lane)));
            }
            modes.extend(mode.map(|(_, mode_m)| mode_m));
            empty = 0;
        } else {
            empty += 1;
        }
        middle_m += width_m;
    }
    modes
}

/// Returns the number of lanes to the left of a mode, if lanes begin at 0.
fn index_of(mode_m: f64, width_m: f64) -> u32 {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a float cast saturates")]
    let index = (mode_m / width_m - 0.5).round().max(0.0) as u32;
    index
}

/// Returns the median distance of the modes from the middles of lanes that begin at 0, or `None` if
/// the lanes begin elsewhere.
fn offset(modes_m: &[f64], width_m: f64) -> Option<f64> {
    let mut offsets: Vec<f64> =
        modes_m.iter().map(|mode_m| mode_m - (f64::from(index_of(*mode_m, width_m)) + 0.5) * width_m).collect();
    offsets.sort_by(f64::total_cmp);
    let upper = offsets[offsets.len() / 2];
    let lower = offsets[(offsets.len() - 1) / 2];
    Some(0.5 * (lower + upper)).filter(|offset_m| offset_m.abs() <= LARGEST_OFFSET_M)
}
