//! The cross-sections of a road whose lanes change along it, and the line that a driver follows in such
//! a lane.
//!
//! ```text
//!   d = 0   ──────────────────────────────────────────   the leftmost place of the left edge
//!   lane 1                                                      s ──▶
//!           ── ── ── ── ── ── ── ── ── ── ── ── ── ──
//!   lane 2                    ___──── ── ── ── ── ──
//!           ─────────────____/                           each boundary is straight between two of them
//!           ↑                ↑       ↑
//!           cross-section    …       …
//! ```
//!
//! The boundaries are linear functions of the position between the sections, and do not change
//! before the first and behind the last one. A boundary has a kink at a section, which no vehicle
//! can follow. The driving line of a lane is therefore the mean over [`WINDOW_M`] of the *way* of the
//! lane: its direction does not jump, and its second derivative is bounded.
//!
//! The way is the centre of the lane. Where the lane is narrower than 2.5 m, the way leads to the
//! lane beside it, which it reaches where the lane has no width any more: towards the lane that is
//! wide enough along most of the road ([`Ways`]).

use std::cmp::Ordering;
use std::sync::{Arc, OnceLock};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::widths::{MOST_LANES, WIDTH_M, plural};
use crate::{ConfigError, KeyPath, Num, Parameters, Problem, Range, Segment};

/// The key in a scenario file.
const KEY: &str = "cross-sections";
/// Length over which a driver passes a kink of a lane (m). Assumption: 20 to 80 are plausible. A
/// driver steers for 1 to 2 s at 30 m/s. A lane that becomes 3.5 m wide over 60 m has a centre with
/// a slope of 0.03: at 30 m/s its kink then needs 0.7 m/s², and the line passes 0.15 m beside it.
const WINDOW_M: f64 = 40.0;
/// Steepest boundary (m/m). Assumption: 0.1 to 0.2 are plausible. The taper of an acceleration lane
/// of a German motorway has 3.75 m in 60 m, or 0.06 (FGSV 2008, RAA); a lane of 3.5 m that begins over
/// 50 m by a polynomial without a kink has 0.105.
pub(super) const STEEPEST: f64 = 0.15;
/// Largest number of sections. It bounds the memory of a file that is wrong.
const MOST_SECTIONS: usize = 4_096;
/// Least distance of two sections (m).
const LEAST_SPACING_M: f64 = 1.0;
/// Length of the road before the first section and behind the last one, in the choice of the lane to
/// which others lead (m): numerical.
const BEYOND_M: f64 = 1_000.0;
/// Width up to which a lane has ended (m): numerical.
const NO_WIDTH_M: f64 = 1e-6;
/// Difference of two positions that are the same (m): numerical.
const SAME_M: f64 = 1e-6;
/// Positions of sections (m).
const POSITION_M: Range = Range::closed(-10_000.0, 100_000.0);
/// Widths of a lane at a section (m): a lane may begin or end.
const SECTION_WIDTH_M: Range = Range::closed(0.0, WIDTH_M.high());
/// Lateral positions of the left edge (m).
const LEFT_EDGE_M: Range = Range::closed(-50.0, 0.0);

/// A cross-section of the road as a scenario file describes it: the lanes at one position.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct CrossSectionConfig {
    /// Position along the road (m).
    pub s_m: Num,
    /// Width of each lane there (m), from lane 1 on: 0 to 5, where 0 is no lane. Vehicles enter a lane
    /// of 2.5 m or more. A narrower lane narrows to 0, and one lane has 2.5 m or more along the whole
    /// road.
    pub widths_m: Vec<Num>,
    /// Lateral position of the left edge of lane 1 there (m), 0 or negative: 0 is the leftmost place of
    /// the lanes. Default: 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub left_edge_d_m: Option<Num>,
}

/// The boundaries of the lanes at one position.
#[derive(Clone, Copy, Debug, PartialEq)]
struct CrossSection {
    s_m: f64,
    /// Lateral positions of the boundaries (m); beyond the last lane, its right edge.
    edges_m: [f64; MOST_LANES + 1],
}

/// Checked boundaries of lanes whose widths change. Its clones share them.
#[derive(Clone, Debug)]
pub(super) struct CrossSections {
    sections: Arc<[CrossSection]>,
    /// Lateral position of the right edge of the road (m): the rightmost place of the lanes.
    right_edge_m: f64,
    /// Whether the lanes are counted from the other side than in the scenario.
    is_turned: bool,
    /// Only vehicles need them, not the sensors' views of the road.
    ways: Arc<OnceLock<Ways>>,
}

impl PartialEq for CrossSections {
    fn eq(&self, other: &Self) -> bool {
        (&self.sections, self.right_edge_m, self.is_turned) == (&other.sections, other.right_edge_m, other.is_turned)
    }
}

/// The ways of vehicles along the lanes.
#[derive(Debug)]
struct Ways {
    /// The lane that is wide enough along most of the road: a vehicle leaves another lane towards it.
    widest: u8,
    /// Of each lane, the places between which the way is a line.
    of_lanes: Vec<Vec<Place>>,
}

/// A place of a way.
#[derive(Clone, Copy, Debug)]
struct Place {
    s_m: f64,
    d_m: f64,
}

impl CrossSections {
    /// Checks the sections on a road with this number of lanes.
    pub(super) fn check(
        sections: &[CrossSectionConfig],
        lanes: u8,
        parameters: &Parameters,
    ) -> Result<Self, ConfigError> {
        if !(1..=MOST_SECTIONS).contains(&sections.len()) {
            let problem = Problem::WrongLength { value: sections.len() as u64, allowed: "1 to 4096" };
            return Err(ConfigError::new(KEY, problem));
        }
        let mut checked = Vec::with_capacity(sections.len());
        for (index, section) in sections.iter().enumerate() {
            let before = checked.last();
            let section = section.check(lanes, before, parameters);
            checked.push(section.map_err(|error| error.within_index(index).within(KEY))?);
        }
        let widest_m = |lane: usize| checked.iter().map(|section| section.width_m(lane)).fold(0.0, f64::max);
        if let Some(lane) = (1..=usize::from(lanes)).find(|lane| widest_m(*lane) < WIDTH_M.low()) {
            let least_m = WIDTH_M.low();
            let rule = format!("lane {lane} is narrower than {least_m} m everywhere, and no vehicle drives there");
            return Err(ConfigError::new(KEY, Problem::Contradiction { other: "lanes", rule }));
        }
        let sections = Self::of(checked);
        sections
            .check_ways(lanes)
            .map_err(|rule| ConfigError::new(KEY, Problem::Contradiction { other: "lanes", rule }))?;
        Ok(sections)
    }

    /// Checks that vehicles have a way everywhere: one lane is open along the whole road, and each other
    /// lane either is open or ends. The error is the rule that does not hold.
    fn check_ways(&self, lanes: u8) -> Result<(), String> {
        let least_m = WIDTH_M.low();
        let is_narrow = |section: &&CrossSection, lane: usize| section.width_m(lane) < least_m;
        let mut is_open = false;
        for lane in 1..=usize::from(lanes) {
            let mut rest = &self.sections[..];
            while let Some(from) = rest.iter().position(|section| is_narrow(&section, lane)) {
                let narrow = rest[from..].iter().take_while(|section| is_narrow(section, lane)).count();
                let (stretch, behind) = rest[from..].split_at(narrow);
                let narrowest = stretch.iter().min_by(|a, b| a.width_m(lane).total_cmp(&b.width_m(lane)));
                if let Some(narrowest) = narrowest.filter(|narrowest| narrowest.width_m(lane) > NO_WIDTH_M) {
                    let (width_m, s_m) = (narrowest.width_m(lane), narrowest.s_m);
                    return Err(format!(
                        "lane {lane} is {width_m:.2} m wide at {s_m} m: a lane has {least_m} m or more, or ends with the \
                         width 0"
                    ));
                }
                rest = behind;
            }
            is_open |= self.sections.iter().all(|section| section.width_m(lane) >= least_m);
        }
        match is_open {
            true => Ok(()),
            false => Err(format!("no lane has {least_m} m or more along the whole road, in which vehicles go on")),
        }
    }

    fn of(sections: Vec<CrossSection>) -> Self {
        // Beyond the last lane, the boundaries are its right edge.
        let right_edge_m = sections.iter().map(|section| section.edges_m[MOST_LANES]).fold(0.0, f64::min);
        Self { sections: sections.into(), right_edge_m, is_turned: false, ways: Arc::default() }
    }

    /// Creates the boundaries from the position (m), the left edge (m) and the widths of the lanes
    /// (m) at each section. Returns `None` if there is no section.
    pub(super) fn new(sections: &[(f64, f64, Vec<f64>)]) -> Option<Self> {
        let section =
            |(s_m, left_edge_m, widths_m): &(f64, f64, Vec<f64>)| CrossSection::new(*s_m, *left_edge_m, widths_m);
        (!sections.is_empty()).then(|| Self::of(sections.iter().map(section).collect()))
    }

    /// Returns the positions of the sections (m).
    pub(super) fn positions_m(&self) -> impl Iterator<Item = f64> {
        self.sections.iter().map(|section| section.s_m)
    }

    /// Returns the positions of the sections between two positions (m).
    pub(super) fn positions_between_m(&self, [from_m, to_m]: [f64; 2]) -> impl Iterator<Item = f64> {
        let first = self.sections.partition_point(|section| section.s_m <= from_m);
        self.sections[first..].iter().map(|section| section.s_m).take_while(move |s_m| *s_m < to_m)
    }

    /// Returns the lateral position of a boundary (m).
    fn edge_m(&self, number: usize, s_m: f64) -> f64 {
        let edge_m =
            |section: &CrossSection| section.edges_m.get(number).copied().unwrap_or(section.edges_m[MOST_LANES]);
        let place = |section: &CrossSection| Place { s_m: section.s_m, d_m: edge_m(section) };
        along(&self.sections, |section| section.s_m, place, s_m)[0]
    }

    /// Returns the lateral position of the right edge of lane `number` (m), or of the left edge of
    /// lane 1 if it is 0.
    #[inline(never)]
    pub(super) fn boundary_m(&self, number: u8, s_m: f64) -> f64 {
        self.edge_m(number.into(), s_m)
    }

    /// Returns the width of a lane (m).
    #[inline(never)]
    pub(super) fn width_m(&self, lane: u8, s_m: f64) -> f64 {
        lane.checked_sub(1).map_or(0.0, |left| self.boundary_m(left, s_m) - self.boundary_m(lane, s_m))
    }

    /// Returns the lateral position of the centre of a lane (m).
    #[inline(never)]
    pub(super) fn centre_m(&self, lane: u8, s_m: f64) -> f64 {
        0.5 * (self.boundary_m(lane.saturating_sub(1), s_m) + self.boundary_m(lane, s_m))
    }

    fn ways(&self, lanes: u8) -> &Ways {
        self.ways.get_or_init(|| Ways::new(self, lanes))
    }

    /// Returns the lateral position of the driving line of a lane of a road of `lanes` lanes (m), and
    /// its first (m/m) and second derivative (1/m) with respect to the position along the road.
    pub(super) fn driving_line(&self, lanes: u8, lane: u8, s_m: f64) -> [f64; 3] {
        let Some(way) = self.ways(lanes).of_lanes.get(usize::from(lane).wrapping_sub(1)) else {
            return [self.centre_m(lane, s_m), 0.0, 0.0];
        };
        let at = |s_m: f64| along(way, |place| place.s_m, |place| *place, s_m);
        let [from_m, to_m] = [s_m - 0.5 * WINDOW_M, s_m + 0.5 * WINDOW_M];
        // The way is linear between its places, so that the trapezoids are exact.
        let next = way.partition_point(|place| place.s_m <= from_m);
        let within = way[next..].iter().copied().take_while(|place| place.s_m < to_m);
        let [first, last] = [from_m, to_m].map(at);
        let (mut area_m2, mut before) = (0.0, Place { s_m: from_m, d_m: first[0] });
        for place in within.chain([Place { s_m: to_m, d_m: last[0] }]) {
            area_m2 += 0.5 * (before.d_m + place.d_m) * (place.s_m - before.s_m);
            before = place;
        }
        [area_m2 / WINDOW_M, (last[0] - first[0]) / WINDOW_M, (last[1] - first[1]) / WINDOW_M]
    }

    /// Returns the lane on whose driving line the driving line of a lane lies: another lane where the
    /// lane has no width.
    pub(super) fn followed(&self, lanes: u8, lane: u8, s_m: f64) -> u8 {
        let [from_m, to_m] = [s_m - 0.5 * WINDOW_M, s_m + 0.5 * WINDOW_M];
        let has_no_width = |at_m: f64| self.width_m(lane, at_m) <= 0.0;
        let mut within = self.positions_between_m([from_m, to_m]);
        match has_no_width(from_m) && has_no_width(to_m) && within.all(has_no_width) {
            true => beside_towards(lane, self.ways(lanes).widest).unwrap_or(lane),
            false => lane,
        }
    }

    /// Returns the lane of a road of `lanes` lanes in which a lateral position lies; beyond an edge,
    /// the lane at that edge. A lane without a width has no place.
    #[inline(never)]
    pub(super) fn lane_at(&self, lanes: u8, s_m: f64, d_m: f64) -> u8 {
        let passes = |number: &u8| d_m <= self.boundary_m(*number, s_m);
        let lane = (1..lanes).take_while(passes).last().unwrap_or_default() + 1;
        let has_width = |lane: &u8| self.width_m(*lane, s_m) > 0.0;
        (1..=lane).rev().chain(lane..=lanes).find(has_width).unwrap_or(lane)
    }

    /// Returns the lateral position of the right edge of the road (m): the rightmost place of the
    /// lanes.
    pub(super) fn right_edge_m(&self) -> f64 {
        self.right_edge_m
    }

    /// Returns the greatest width of a lane (m).
    pub(super) fn greatest_m(&self, lane: u8) -> f64 {
        self.positions_m().map(|s_m| self.width_m(lane, s_m)).fold(0.0, f64::max)
    }

    /// Returns the smallest and the largest width of a lane (m), of those that models cover.
    pub(super) fn width_range_m(&self, lanes: u8) -> [f64; 2] {
        let widths_m =
            self.sections.iter().flat_map(|section| (1..=usize::from(lanes)).map(|lane| section.width_m(lane)));
        let range = |[low_m, high_m]: [f64; 2], width_m: f64| [low_m.min(width_m), high_m.max(width_m)];
        widths_m.filter(|width_m| *width_m >= WIDTH_M.low()).fold([f64::INFINITY, f64::NEG_INFINITY], range)
    }

    /// Returns the boundaries as seen against the direction of the road or in a mirror: `to_m` gives
    /// the new position along the road, and the right edge is at d = 0.
    pub(super) fn turned(&self, lanes: u8, to_m: impl Fn(f64) -> f64) -> Self {
        let right_edge_m = self.right_edge_m;
        let last = usize::from(lanes);
        let turned = |section: &CrossSection| CrossSection {
            s_m: to_m(section.s_m),
            edges_m: std::array::from_fn(|number| right_edge_m - section.edges_m[last - number.min(last)]),
        };
        let mut sections: Vec<CrossSection> = self.sections.iter().map(turned).collect();
        sections.sort_by(|a, b| a.s_m.total_cmp(&b.s_m));
        Self { sections: sections.into(), right_edge_m, is_turned: !self.is_turned, ways: Arc::default() }
    }

    /// Returns the boundaries after a change of each width of 2.5 m or more (m).
    pub(super) fn changed(&self, lanes: u8, to_m: impl Fn(f64) -> f64) -> Self {
        let changed = |section: &CrossSection| {
            let width_m = |lane| match section.width_m(lane) {
                width_m if width_m >= WIDTH_M.low() => to_m(width_m),
                width_m => width_m,
            };
            let widths_m: Vec<f64> = (1..=usize::from(lanes)).map(width_m).collect();
            CrossSection::new(section.s_m, section.edges_m[0], &widths_m)
        };
        Self { is_turned: self.is_turned, ..Self::of(self.sections.iter().map(changed).collect()) }
    }
}

/// Returns the lateral position (m) and the slope (m/m) of a line between places, in their order. It
/// does not change before the first and behind the last one.
fn along<T>(places: &[T], s_of: impl Fn(&T) -> f64, place: impl Fn(&T) -> Place, s_m: f64) -> [f64; 2] {
    let next = places.partition_point(|place| s_of(place) <= s_m);
    match (next.checked_sub(1).map(|index| &places[index]), places.get(next)) {
        (Some(from), Some(to)) => {
            let (from, to) = (place(from), place(to));
            let slope = (to.d_m - from.d_m) / (to.s_m - from.s_m);
            [from.d_m + slope * (s_m - from.s_m), slope]
        }
        (Some(end), None) | (None, Some(end)) => [place(end).d_m, 0.0],
        (None, None) => [0.0; 2],
    }
}

/// Returns the lane beside a lane on the side of another one, or `None` if it is the same.
fn beside_towards(lane: u8, other: u8) -> Option<u8> {
    match lane.cmp(&other) {
        Ordering::Less => Some(lane + 1),
        Ordering::Equal => None,
        Ordering::Greater => Some(lane - 1),
    }
}

impl Ways {
    fn new(sections: &CrossSections, lanes: u8) -> Self {
        let open_m = |lane: u8| -> f64 {
            let is_open = |section: &CrossSection| section.width_m(lane.into()) >= WIDTH_M.low();
            let pairs = sections.sections.windows(2).filter(|pair| pair.iter().all(is_open));
            let ends = sections.sections.first().into_iter().chain(sections.sections.last());
            // Before the first section and behind the last one, the road goes on.
            let beyond_m: f64 = ends.filter(|section| is_open(section)).map(|_| BEYOND_M).sum();
            beyond_m + pairs.map(|pair| pair[1].s_m - pair[0].s_m).sum::<f64>()
        };
        // Of several, the leftmost one of the scenario.
        let widest = if sections.is_turned {
            (1..=lanes).max_by(|a, b| open_m(*a).total_cmp(&open_m(*b)))
        } else {
            (1..=lanes).rev().max_by(|a, b| open_m(*a).total_cmp(&open_m(*b)))
        };
        let widest = widest.unwrap_or(1);
        let mut of_lanes = vec![Vec::new(); lanes.into()];
        let outwards = (1..=widest).rev().chain(widest + 1..=lanes);
        for lane in outwards {
            let beside: Option<&Vec<Place>> =
                beside_towards(lane, widest).and_then(|beside| of_lanes.get(usize::from(beside) - 1));
            of_lanes[usize::from(lane) - 1] = sections.way(lane, beside.map_or(&[], Vec::as_slice));
        }
        Self { widest, of_lanes }
    }
}

impl CrossSections {
    /// Returns the way of a lane. Where the lane is too narrow, it leads to the way `beside` it, if
    /// there is one.
    fn way(&self, lane: u8, beside: &[Place]) -> Vec<Place> {
        let mut positions_m: Vec<f64> = self.positions_m().chain(beside.iter().map(|place| place.s_m)).collect();
        for pair in self.sections.windows(2) {
            let [from_m, to_m] = [0, 1].map(|index| pair[index].width_m(lane.into()));
            if (from_m < WIDTH_M.low()) != (to_m < WIDTH_M.low()) {
                let share = (WIDTH_M.low() - from_m) / (to_m - from_m);
                positions_m.push(pair[0].s_m + share * (pair[1].s_m - pair[0].s_m));
            }
        }
        positions_m.sort_by(f64::total_cmp);
        positions_m.dedup_by(|a, b| *a - *b < SAME_M);
        let place = |s_m: f64| {
            let centre_m = self.centre_m(lane, s_m);
            let share = (self.width_m(lane, s_m) / WIDTH_M.low()).clamp(0.0, 1.0);
            let d_m = match beside.is_empty() || share == 1.0 {
                true => centre_m,
                false => share * centre_m + (1.0 - share) * along(beside, |place| place.s_m, |place| *place, s_m)[0],
            };
            Place { s_m, d_m }
        };
        positions_m.into_iter().map(place).collect()
    }
}

impl CrossSection {
    fn new(s_m: f64, left_edge_m: f64, widths_m: &[f64]) -> Self {
        let mut edges_m = [left_edge_m; MOST_LANES + 1];
        for number in 1..edges_m.len() {
            edges_m[number] = edges_m[number - 1] - widths_m.get(number - 1).copied().unwrap_or_default();
        }
        Self { s_m, edges_m }
    }

    /// Returns the width of a lane (m).
    fn width_m(&self, lane: usize) -> f64 {
        self.edges_m[lane - 1] - self.edges_m[lane]
    }
}

impl CrossSectionConfig {
    /// Checks the lanes behind another section.
    fn check(
        &self,
        lanes: u8,
        before: Option<&CrossSection>,
        parameters: &Parameters,
    ) -> Result<CrossSection, ConfigError> {
        let s_m = parameters.number(&self.s_m, "s-m", POSITION_M)?;
        if before.is_some_and(|before| !(s_m >= before.s_m + LEAST_SPACING_M)) {
            let rule = "positions increase by 1 m or more from table to table".to_owned();
            return Err(ConfigError::new("s-m", Problem::Contradiction { other: "road.cross-sections", rule }));
        }
        if self.widths_m.len() != usize::from(lanes) {
            let (count, roads) = (plural(self.widths_m.len(), "width"), plural(lanes.into(), "lane"));
            let rule = format!("it has {count} and the road has {roads}: one for each lane is needed, 0 for no lane");
            return Err(ConfigError::new("widths-m", Problem::Contradiction { other: "road.lanes", rule }));
        }
        let mut widths_m = Vec::new();
        for (index, num) in self.widths_m.iter().enumerate() {
            let width_m = parameters.number(num, "widths-m", SECTION_WIDTH_M);
            let path = KeyPath(vec![Segment::Key("widths-m".to_owned()), Segment::Index(index)]);
            let at = |error: ConfigError| ConfigError { path, ..error };
            widths_m.push(width_m.map_err(at)?);
        }
        let left_edge_m = match &self.left_edge_d_m {
            Some(num) => parameters.number(num, "left-edge-d-m", LEFT_EDGE_M)?,
            None => 0.0,
        };
        let least_m = WIDTH_M.low();
        if widths_m.iter().all(|width_m| *width_m < least_m) {
            let rule = format!("each lane is narrower than {least_m} m there, and no vehicle passes");
            return Err(ConfigError::new("widths-m", Problem::Contradiction { other: "road.lanes", rule }));
        }
        let section = CrossSection::new(s_m, left_edge_m, &widths_m);
        let steepest = before.map_or(0.0, |before| before.steepest(&section));
        if !(steepest <= STEEPEST) {
            let rule = format!(
                "a boundary moves sideways by {steepest:.3} m in each metre behind the table before it, and {STEEPEST} \
                 m are allowed"
            );
            return Err(ConfigError::new("s-m", Problem::Contradiction { other: "widths-m", rule }));
        }
        Ok(section)
    }
}

impl CrossSection {
    /// Returns the slope of the steepest boundary between this section and the next one (m/m).
    fn steepest(&self, next: &Self) -> f64 {
        let moves_m = self.edges_m.iter().zip(&next.edges_m).map(|(from_m, to_m)| (to_m - from_m).abs());
        moves_m.fold(0.0, f64::max) / (next.s_m - self.s_m)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::RoadConfig;
    use crate::{Check, Lane, Parameters, Road, Side, VehicleState};

    /// A road with a lane that becomes wider, and a third lane that begins between 300 and 400 m.
    fn road() -> Road {
        Road::straight(3).with_cross_sections(&[
            (100.0, 0.0, vec![3.5, 3.25, 0.0]),
            (200.0, 0.0, vec![3.5, 3.75, 0.0]),
            (300.0, -0.5, vec![3.5, 3.75, 0.0]),
            (400.0, -0.5, vec![3.5, 3.75, 3.5]),
        ])
    }

    fn check(keys: &str) -> Result<Road, String> {
        let config: RoadConfig = toml::from_str(keys).map_err(|error| error.to_string())?;
        config.check(&Parameters::default()).map_err(|error| error.to_string())
    }

    #[test]
    fn boundaries_are_lines_between_the_cross_sections() {
        let road = road();
        let boundaries = |s_m: f64| [0, 1, 2, 3].map(|number| road.full_boundary_m(number, s_m));
        assert_eq!(boundaries(-50.0), [0.0, -3.5, -6.75, -6.75]);
        assert_eq!(boundaries(150.0), [0.0, -3.5, -7.0, -7.0]);
        assert_eq!(boundaries(250.0), [-0.25, -3.75, -7.5, -7.5]);
        assert_eq!(boundaries(350.0), [-0.5, -4.0, -7.75, -9.5]);
        assert_eq!(boundaries(900.0), [-0.5, -4.0, -7.75, -11.25]);
        assert_eq!([150.0, 350.0].map(|s_m| road.lane_width_m(Lane(3), s_m)), [0.0, 1.75]);
        assert_eq!([150.0, 350.0].map(|s_m| road.lane_centre_m(Lane(2), s_m)), [-5.25, -5.875]);
        assert_eq!((road.right_edge_m(), road.lane_width_range_m()), (-11.25, [3.25, 3.75]));
        assert_eq!(road.greatest_lane_width_m(Lane(3)), 3.5);
        assert_eq!((road.equal_lane_width_m(), road.has_changing_lanes()), (None, true));
    }

    #[test]
    fn a_lane_is_where_its_boundaries_are_and_one_without_a_width_is_nowhere() {
        let road = road();
        for (s_m, d_m, lane) in
            [(0.0, -6.7, 2), (0.0, -9.0, 2), (350.0, -7.7, 2), (350.0, -7.8, 3), (350.0, -99.0, 3), (0.0, 2.0, 1)]
        {
            assert_eq!(road.lane_at(s_m, d_m), Lane(lane), "{s_m} {d_m}");
        }
        let state = VehicleState { s_m: 350.0, d_m: -7.8, ..VehicleState::default() };
        assert_eq!(road.lane_of(&state), Lane(3));
        // The lane is 2.5 m wide from 371.4 m on.
        for (range_m, is_open) in [([0.0, 900.0], false), ([360.0, 500.0], false), ([372.0, 500.0], true)] {
            assert_eq!(road.is_open(Lane(3), range_m), is_open, "{range_m:?}");
        }
        assert!(road.is_open(Lane(2), [0.0, 900.0]) && Road::straight(3).is_open(Lane(3), [0.0, 900.0]));
        // Left of the road, the first lane with a width.
        let other = Road::straight(2).with_cross_sections(&[(0.0, 0.0, vec![0.0, 3.5]), (100.0, 0.0, vec![3.0, 3.5])]);
        assert_eq!([1.0, -0.1, -9.0].map(|d_m| other.lane_at(0.0, d_m)), [Lane(2); 3]);
    }

    #[test]
    fn the_driving_line_is_the_centre_without_its_kinks() {
        let road = road();
        // Far from a kink, it is the centre.
        for (s_m, lanes) in [(-500.0, 2), (50.0, 2), (150.0, 2), (250.0, 2), (350.0, 2), (800.0, 3)] {
            for lane in (1..=lanes).map(Lane) {
                let [line_m, ..] = road.driving_line(lane, s_m);
                assert!((line_m - road.lane_centre_m(lane, s_m)).abs() < 1e-12, "{lane} {s_m}: {line_m}");
            }
        }
        // At a kink, a mean over a length L lies beside it by an eighth of L times the kink.
        let [line_m, slope, second_per_m] = road.driving_line(Lane(3), 400.0);
        let kink = 3.5 / 100.0 / 2.0;
        assert!((line_m - (-9.5 + kink * super::WINDOW_M / 8.0)).abs() < 1e-12, "{line_m}");
        assert!((slope + 0.5 * kink).abs() < 1e-12 && (second_per_m - kink / super::WINDOW_M).abs() < 1e-12);
    }

    #[test]
    fn the_driving_line_of_a_lane_that_ends_leads_to_the_lane_beside_it() {
        // A third lane ends between 0 and 100 m, a first one begins between 200 and 300 m.
        let road = Road::straight(3).with_cross_sections(&[
            (0.0, -3.5, vec![0.0, 3.5, 3.5]),
            (100.0, -3.5, vec![0.0, 3.5, 0.0]),
            (200.0, -3.5, vec![0.0, 3.5, 0.0]),
            (300.0, 0.0, vec![3.5, 3.5, 0.0]),
        ]);
        let line_m = |lane, s_m| road.driving_line(Lane(lane), s_m)[0];
        for s_m in [-500.0, 0.0, 50.0, 130.0, 250.0, 900.0] {
            assert!((line_m(2, s_m) + 5.25).abs() < 1e-12, "{s_m}");
        }
        for (lane, at_m, line) in
            [(3, -30.0, -8.75), (3, 130.0, -5.25), (3, 900.0, -5.25), (1, 170.0, -5.25), (1, 330.0, -1.75)]
        {
            assert!((line_m(lane, at_m) - line).abs() < 1e-12, "{lane} {at_m}: {}", line_m(lane, at_m));
        }
        // It passes the marking on its way, without a jump of its direction.
        let slopes = (0..=1_000).map(|step| road.driving_line(Lane(3), 0.2 * f64::from(step)));
        let [mut steepest, mut sharpest_per_m]: [f64; 2] = [0.0; 2];
        for [_, slope, second_per_m] in slopes {
            (steepest, sharpest_per_m) = (steepest.max(slope.abs()), sharpest_per_m.max(second_per_m.abs()));
        }
        assert!((0.02..0.06).contains(&steepest) && sharpest_per_m < 0.0015, "{steepest} {sharpest_per_m}");
        let followed = [(3, 50.0, 3), (3, 110.0, 3), (3, 121.0, 2), (3, 900.0, 2), (1, 179.0, 2), (1, 250.0, 1)];
        for (lane, s_m, expected) in followed.into_iter().chain([(2, 150.0, 2)]) {
            assert_eq!(road.followed_lane(Lane(lane), s_m), Lane(expected), "{lane} {s_m}");
        }
        assert_eq!(Road::straight(3).followed_lane(Lane(3), 0.0), Lane(3));
    }

    #[test]
    fn a_reversed_and_a_mirrored_road_have_their_lanes_at_the_same_places() {
        for curvature in [0.0, 0.002, -0.002] {
            let road = road().with_curvature(curvature);
            let reversed = road.reversed();
            for (s_m, number) in [(150.0, 2), (250.0, 0), (350.0, 3), (800.0, 1)] {
                let (there_m, expected_m) = road.reversed_position_m(s_m, road.full_boundary_m(number, s_m));
                let edge_m = reversed.full_boundary_m(3 - number, there_m);
                assert!((edge_m - expected_m).abs() < 1e-9, "{curvature} {s_m} {number}: {edge_m} {expected_m}");
            }
            let again = reversed.reversed();
            for s_m in [150.0, 250.0, 350.0] {
                let [edge_m, expected_m] = [&again, &road].map(|road| road.full_boundary_m(2, s_m));
                assert!((edge_m - expected_m).abs() < 1e-9, "{edge_m} {expected_m}");
            }
        }
        let mirrored = road().mirrored().unwrap();
        for (number, expected_m) in [(0, -1.75), (1, -3.5), (2, -7.25), (3, -10.75)] {
            let edge_m = mirrored.full_boundary_m(number, 350.0);
            assert!((edge_m - expected_m).abs() < 1e-12, "{number}: {edge_m}");
        }
        assert_eq!(mirrored.beside(Lane(1), Side::Right), Some(Lane(2)));
    }

    #[test]
    fn a_wrong_map_changes_the_widths_of_lanes_and_begins_no_lane() {
        let map = road().with_added_lane_width(0.25);
        assert_eq!(map.lane_widths_m(0.0).collect::<Vec<_>>(), [3.75, 3.5, 0.0]);
        assert_eq!(map.lane_widths_m(900.0).collect::<Vec<_>>(), [3.75, 4.0, 3.75]);
    }

    #[test]
    fn a_wrong_cross_section_is_refused_by_its_key_and_what_is_allowed() {
        let sections = |text: &str| check(&format!("lanes = 2\ncross-sections = [{text}]"));
        let first = "{ s-m = 0.0, widths-m = [3.5, 3.5] }";
        let wide =
            sections(&format!("{first}, {{ s-m = 100.0, widths-m = [3.5, 4.5], left-edge-d-m = -1.0 }}")).unwrap();
        assert_eq!([0, 1, 2].map(|number| wide.full_boundary_m(number, 50.0)), [-0.5, -4.0, -8.0]);
        for (second, words) in [
            ("{ s-m = 0.5, widths-m = [3.5, 3.5] }", "`cross-sections[1].s-m` contradicts `road.cross-sections`"),
            ("{ s-m = -5.0, widths-m = [3.5, 3.5] }", "positions increase by 1 m or more"),
            ("{ s-m = nan, widths-m = [3.5, 3.5] }", "a finite number is needed"),
            ("{ s-m = 9.0, widths-m = [3.5] }", "it has 1 width and the road has 2 lanes: one for each lane"),
            (
                "{ s-m = 9.0, widths-m = [3.5, 5.5] }",
                "`cross-sections[1].widths-m[1]` is 5.5, but a number from 0 to 5",
            ),
            ("{ s-m = 9.0, widths-m = [3.5, \"$w\"] }", "`cross-sections[1].widths-m[1]` names the parameter `$w`"),
            ("{ s-m = 9.0, widths-m = [3.5, 3.5], left-edge-d-m = 0.1 }", "`cross-sections[1].left-edge-d-m` is 0.1"),
            ("{ s-m = 9.0, widths-m = [3.5, 5.0] }", "moves sideways by 0.167 m in each metre"),
            ("{ s-m = 90.0, widths-m = [2.4, 2.0] }", "each lane is narrower than 2.5 m there, and no vehicle passes"),
        ] {
            let error = sections(&format!("{first}, {second}")).unwrap_err();
            assert!(error.contains(words), "{second}: {error}");
        }
        // A lane that stays narrower than a vehicle's lane neither ends nor is one.
        let narrows = "{ s-m = 0.0, widths-m = [3.5, 3.5] }, { s-m = 90.0, widths-m = [3.5, 1.5] }";
        let error = sections(narrows).unwrap_err();
        assert!(error.contains("lane 2 is 1.50 m wide at 90 m: a lane has 2.5 m or more, or ends"), "{error}");
        assert!(sections(&format!("{narrows}, {{ s-m = 190.0, widths-m = [3.5, 0.0] }}")).is_ok());
        // Each lane is closed somewhere, so that no vehicle has a lane to go on in.
        let closed = "{ s-m = 200.0, widths-m = [3.5, 0.0] }, { s-m = 300.0, widths-m = [3.5, 3.5] }, \
                      { s-m = 400.0, widths-m = [3.5, 3.5] }, { s-m = 500.0, widths-m = [0.0, 3.5] }";
        let error = sections(&format!("{first}, {{ s-m = 100.0, widths-m = [3.5, 3.5] }}, {closed}")).unwrap_err();
        assert!(error.contains("no lane has 2.5 m or more along the whole road"), "{error}");
        let narrow = sections("{ s-m = 0.0, widths-m = [3.5, 1.0] }").unwrap_err();
        assert!(narrow.contains("lane 2 is narrower than 2.5 m everywhere"), "{narrow}");
        let both = check(&format!("lanes = 2\nlane-width-m = 3.5\ncross-sections = [{first}]")).unwrap_err();
        assert!(both.starts_with("`lane-width-m` contradicts `cross-sections`"), "{both}");
    }

    proptest! {
        #[test]
        fn the_slopes_of_the_driving_line_are_its_derivatives(s_m in 0.0..500.0_f64, lane in 1..=3_u8) {
            let road = road();
            let line = |s_m: f64| road.driving_line(Lane(lane), s_m);
            let [before, at, after] = [s_m - 1e-3, s_m, s_m + 1e-3].map(line);
            prop_assert!(((after[0] - before[0]) / 2e-3 - at[1]).abs() < 1e-6);
            // The second derivative jumps where the window reaches a cross-section.
            prop_assert!((after[1] - before[1]).abs() < 2e-3 * 0.002);
        }
    }
}
