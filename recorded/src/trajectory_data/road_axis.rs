//! The axis of a road, from the lateral positions of all of its vehicles.
//!
//! ```text
//!   lane 2   ~~~~~~~~~~~~~~~~~~   vehicles: middle of the lane + departure of the line
//!   lane 1   ~~~~~~~~~~~~~~~~~~
//!   line     ────╮      ╭──────   a first line, along the path of one vehicle, weaves
//!                ╰──────╯
//!   axis     ──────────────────   the line, moved by its departures
//! ```
//!
//! The lateral position of a vehicle is the sum of the middle of its lane, of the departure of the
//! line from the axis at that place, and of its own deviation. Middles and departures are fitted to
//! the positions of all vehicles in all sections of the road at once, by medians in turns (J. W.
//! Tukey, *Exploratory Data Analysis*, 1977, "median polish"). Each section is compared with the
//! middles of the whole road, and not with the section before it. Errors therefore do not add up
//! along the road.

use std::collections::BTreeMap;

use closecall_traffic::statistics::quantiles::median;

use super::reference_line::{Point, ReferenceLine};

/// Length of the sections in which the axis is measured, and half the length over which their
/// departures are averaged (m): drivers weave over 150 to 300 m, and bends begin within 50 to 100 m.
/// Assumptions with plausible ranges of 5 to 20 m and 15 to 40 m.
pub(super) const AXIS_SECTION_M: f64 = 10.0;
const AVERAGED_M: f64 = 25.0;

/// Least number of vehicles that show the departure in a section: the mean of ten drivers with a
/// standard deviation of 0.3 m is accurate to a decimetre.
const LEAST_DRIVERS: usize = 10;

/// Number of times that middles and departures are estimated in turns.
const TURNS: usize = 5;

/// Largest number of points of an axis, which then has a length of 100 km.
const MAX_POINTS: usize = 10_000;

/// Lateral positions of vehicles in their lanes, by section of the road.
#[derive(Clone, Debug)]
pub(super) struct LateralPositions<L> {
    section_m: f64,
    sections: BTreeMap<i64, Vec<(L, f64)>>,
}

/// What lateral positions show.
#[derive(Clone, Debug)]
pub(super) struct LateralFit<L> {
    /// Median distance of the vehicles in each lane to the left of the axis (m).
    pub(super) middles_m: BTreeMap<L, f64>,
    /// Number of positions in each lane.
    pub(super) counts: BTreeMap<L, usize>,
    pub(super) departures: Departures,
}

/// By how much the lanes are to the left of where they usually are (m), along the line (m), in order.
#[derive(Clone, Debug, Default)]
pub(super) struct Departures(Vec<(f64, f64)>);

impl<L: Copy + Ord> LateralPositions<L> {
    /// Creates a collection in sections of this length.
    pub(super) fn new(section_m: f64) -> Self {
        Self { section_m, sections: BTreeMap::new() }
    }

    /// Adds the position of a vehicle in a section.
    pub(super) fn add(&mut self, section: i64, lane: L, d_m: f64) {
        self.sections.entry(section).or_default().push((lane, d_m));
    }

    /// Returns the section at `s_m`.
    pub(super) fn section(&self, s_m: f64) -> i64 {
        #[expect(clippy::cast_possible_truncation, reason = "a float cast saturates")]
        let section = (s_m / self.section_m).floor() as i64;
        section
    }

    /// Returns the middle of a section (m).
    fn middle_m(&self, section: i64) -> f64 {
        (section as f64 + 0.5) * self.section_m
    }

    /// Returns the positions with other lanes. Positions without one are left out.
    pub(super) fn in_lanes<M: Copy + Ord>(&self, lane: impl Fn(L) -> Option<M>) -> LateralPositions<M> {
        let mut positions = LateralPositions::new(self.section_m);
        for (section, vehicles) in &self.sections {
            for (named, d_m) in vehicles {
                if let Some(lane) = lane(*named) {
                    positions.add(*section, lane, *d_m);
                }
            }
        }
        positions
    }

    /// Fits the middles of the lanes and the departures of the line. Sections with fewer than ten
    /// vehicles show no departure.
    pub(super) fn fit(&self) -> LateralFit<L> {
        let mut departures = Departures::default();
        let mut middles_m: BTreeMap<L, f64> = BTreeMap::new();
        let mut counts: BTreeMap<L, usize> = BTreeMap::new();
        for _ in 0..TURNS {
            let mut positions_m: BTreeMap<L, Vec<f64>> = BTreeMap::new();
            for (section, vehicles) in &self.sections {
                let departure_m = departures.at(self.middle_m(*section));
                for (lane, d_m) in vehicles {
                    positions_m.entry(*lane).or_default().push(d_m - departure_m);
                }
            }
            counts = positions_m.iter().map(|(lane, values)| (*lane, values.len())).collect();
            middles_m = positions_m.into_iter().map(|(lane, values)| (lane, median(values))).collect();
            let shown = self.sections.iter().filter(|(_, vehicles)| vehicles.len() >= LEAST_DRIVERS);
            let shown = shown.map(|(section, vehicles)| {
                let of_vehicles = vehicles.iter().filter_map(|(lane, d_m)| Some(d_m - middles_m.get(lane)?));
                (self.middle_m(*section), median(of_vehicles.collect()))
            });
            departures = Departures(shown.collect());
        }
        LateralFit { middles_m, counts, departures }
    }

    /// Returns the deviation of each position from the middle of its lane (m), by lane.
    pub(super) fn deviations_m(&self, fit: &LateralFit<L>) -> BTreeMap<L, Vec<f64>> {
        let mut deviations_m: BTreeMap<L, Vec<f64>> = BTreeMap::new();
        for (section, vehicles) in &self.sections {
            let departure_m = fit.departures.at(self.middle_m(*section));
            for (lane, d_m) in vehicles {
                let Some(middle_m) = fit.middles_m.get(lane) else { continue };
                deviations_m.entry(*lane).or_default().push(d_m - departure_m - middle_m);
            }
        }
        deviations_m
    }

    /// Returns the label and the position of each entry (m to the left).
    pub(super) fn all(&self) -> impl Iterator<Item = (L, f64)> {
        self.sections.values().flatten().copied()
    }

    /// Returns the positions with the lane at each of them.
    pub(super) fn by_position<M: Copy + Ord>(&self, lane: impl Fn(f64) -> M) -> LateralPositions<M> {
        let mut positions = LateralPositions::new(self.section_m);
        for (section, vehicles) in &self.sections {
            vehicles.iter().for_each(|(_, d_m)| positions.add(*section, lane(*d_m), *d_m));
        }
        positions
    }

    /// Returns the axis: the line, moved by its departures. Where no section shows a departure, the
    /// line moves as in the nearest section that shows one.
    pub(super) fn axis(&self, line: &ReferenceLine) -> ReferenceLine {
        self.fit().departures.averaged().moved(line, 0.0)
    }
}

impl Departures {
    /// Creates departures from pairs of the distance along the line and the departure to the left (m), in order.
    pub(super) fn new(departures_m: Vec<(f64, f64)>) -> Self {
        Self(departures_m)
    }

    /// Returns the line, moved by the departures and by `left_m` to the left. Without departures, a line
    /// moves by `left_m` alone.
    pub(super) fn moved(&self, line: &ReferenceLine, left_m: f64) -> ReferenceLine {
        let Some(length_m) = line.length_m() else { return line.clone() };
        let (first_m, last_m) = match self.ends_m() {
            Some(ends_m) => ends_m,
            None if left_m == 0.0 => return line.clone(),
            None => (0.0, length_m),
        };
        let (from_m, to_m) = (first_m.min(0.0), last_m.max(length_m));
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a float cast saturates")]
        let steps = (((to_m - from_m) / AXIS_SECTION_M).ceil() as usize).clamp(1, MAX_POINTS);
        let point = |step: usize| -> Option<Point> {
            let s_m = from_m + step as f64 * AXIS_SECTION_M;
            line.beside(s_m, self.at(s_m) + left_m)
        };
        ReferenceLine::through((0..=steps).filter_map(point))
    }

    /// Returns the departure at `s_m` (m). It is linear between two sections and constant beyond both
    /// ends.
    pub(super) fn at(&self, s_m: f64) -> f64 {
        let Self(departures_m) = self;
        let next = departures_m.partition_point(|(at_m, _)| *at_m < s_m);
        match (next.checked_sub(1).and_then(|before| departures_m.get(before)), departures_m.get(next)) {
            (Some((from_m, from)), Some((to_m, to))) => from + (to - from) * (s_m - from_m) / (to_m - from_m),
            (Some((_, value)), None) | (None, Some((_, value))) => *value,
            (None, None) => 0.0,
        }
    }

    /// Returns `true` if no section shows a departure.
    pub(super) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Returns the means of the departures within [`AVERAGED_M`].
    pub(super) fn averaged(&self) -> Self {
        let Self(departures_m) = self;
        let mean = |&(at_m, _): &(f64, f64)| {
            let first = departures_m.partition_point(|(m, _)| *m < at_m - AVERAGED_M);
            let after = departures_m.partition_point(|(m, _)| *m <= at_m + AVERAGED_M);
            let near = &departures_m[first..after];
            (at_m, near.iter().map(|(_, departure_m)| departure_m).sum::<f64>() / near.len() as f64)
        };
        Self(departures_m.iter().map(mean).collect())
    }

    /// Returns where the first and the last departure are (m), if there is one.
    fn ends_m(&self) -> Option<(f64, f64)> {
        let Self(departures_m) = self;
        Some((departures_m.first()?.0, departures_m.last()?.0))
    }
}

#[cfg(test)]
mod tests {
    use closecall_traffic::maths;

    use super::*;

    #[test]
    fn the_axis_is_straight_although_the_first_line_weaves_and_drifts_away() {
        // The line begins at x = 100 m, and drifts by 5 m over 400 m. The lanes are straight.
        let way = |k: u32| {
            let x_m = 100.0 + 4.0 * f64::from(k);
            (x_m, (x_m - 100.0) / 80.0 + 0.8 * maths::sin(x_m / 40.0))
        };
        let mut line = ReferenceLine::through((0..=100).map(way));
        for _ in 0..3 {
            let mut positions = LateralPositions::new(AXIS_SECTION_M);
            for vehicle in 0..48_u32 {
                let lane = vehicle % 3;
                let y_m = 3.5 * f64::from(lane) + 0.4 * maths::sin(f64::from(vehicle));
                // The vehicles are recorded for 200 m each, as in slow traffic.
                let first_m = 10.0 * f64::from(vehicle);
                for step in 0..=20_u32 {
                    let projection = line.project((first_m + 10.0 * f64::from(step), y_m));
                    positions.add(positions.section(projection.s_m), lane, projection.d_m);
                }
            }
            line = positions.axis(&line);
        }
        let at: Vec<f64> = (20..=45_u32).map(|k| line.project((10.0 * f64::from(k), 0.0)).d_m).collect();
        let (least_m, most_m) = at.iter().fold((f64::MAX, f64::MIN), |(l, m), d| (l.min(*d), m.max(*d)));
        assert!(most_m - least_m < 0.7, "{least_m} to {most_m} m: the first line has 6 m");
    }

    #[test]
    fn fewer_than_ten_vehicles_do_not_move_the_line() {
        let line = ReferenceLine::through([(0.0, 0.0), (100.0, 1.0)].into_iter());
        let mut positions = LateralPositions::new(AXIS_SECTION_M);
        (0..9).for_each(|section| positions.add(section, 1, 2.0));
        assert_eq!(positions.axis(&line), line);
    }
}
