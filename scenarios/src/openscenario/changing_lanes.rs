//! The lanes of an OpenDRIVE road whose widths or whose offset from the reference line change.
//!
//! A file gives widths and offset by polynomials of third degree. A scenario has lines between
//! cross-sections: the boundaries of the lanes at the start of each polynomial, and at as many places in
//! between as they need to stay within [`TOLERANCE_M`]. A lane that a lane section does not have has
//! the width 0 there. A lane that gets another number in the next section is the same lane
//! ([`super::numbering`]).

use std::collections::BTreeSet;

use closecall_traffic::Road;

use super::dom::Node;
use super::entry_lane::{DRIVING, EntryLane};
use super::numbering::Numbering;

/// Largest distance between a boundary of the file and the line between two cross-sections (m). An
/// assumption: 0.001 to 0.05 are plausible, because the markings of a lane are 0.15 m wide.
const TOLERANCE_M: f64 = 0.01;
/// Largest distance between a boundary of the file and its lines, with the errors of rounding of the
/// file (m).
const MOST_DEVIATION_M: f64 = 0.05;
/// Largest jump of a boundary from one polynomial to the next that is an error of rounding (m).
const ROUNDED_M: f64 = 0.02;
/// Largest number of lanes of a scenario.
const MOST_LANES: usize = 8;
/// Least distance of two cross-sections of a scenario (m), their largest number, and the largest
/// position of one (m).
const LEAST_SPACING_M: f64 = 1.0;
const MOST_SECTIONS: usize = 4_096;
const MOST_POSITION_M: f64 = 100_000.0;
/// Width up to which a lane has ended (m): numerical.
const NO_WIDTH_M: f64 = 1e-6;
/// Difference of two lateral positions that matters (m): numerical.
const SAME_M: f64 = 1e-9;
/// Distance between two places at which the lines are compared with the file (m).
const COMPARED_EVERY_M: f64 = 1.0;

/// The lanes at a position along the road.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct CrossSection {
    /// Distance from the start of the road (m).
    pub(super) s_m: f64,
    /// The boundaries of the lanes to the left of the reference line (m), from the left: one more than
    /// there are lanes.
    edges_m: Vec<f64>,
}

/// The driving lanes of a road along it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ChangingLanes {
    /// The numbers of the lanes, from the left.
    pub(super) ids: Vec<i32>,
    stations: Vec<CrossSection>,
    /// Largest distance between a boundary of the file and its line (m).
    pub(super) deviation_m: f64,
}

/// A polynomial of third degree from a position on.
struct Piece {
    from_m: f64,
    coefficients: [f64; 4],
}

/// A lane of a lane section.
struct FileLane {
    id: i32,
    /// The number of a driving lane in the import.
    number: Option<i32>,
    /// Whether the file gives its edge instead of its width.
    has_border: bool,
    /// Its widths (m), by the position along the road.
    widths: Vec<Piece>,
}

/// A lane section on the side of the lanes along the road.
struct Section {
    from_m: f64,
    to_m: f64,
    /// The lanes from the reference line outwards.
    lanes: Vec<FileLane>,
}

impl Section {
    /// Returns the driving lanes and the lanes between them and the reference line, outwards.
    fn driving_and_inner(&self) -> &[FileLane] {
        let count = self.lanes.iter().rposition(|lane| lane.number.is_some()).map_or(0, |last| last + 1);
        &self.lanes[..count]
    }
}

/// The side of a position from which a polynomial that begins there is seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Seen {
    Before,
    Behind,
}

impl Seen {
    /// Returns whether what begins at `from_m` has begun at `at_m`.
    fn has_begun(self, from_m: f64, at_m: f64) -> bool {
        match self {
            Self::Before => from_m < at_m,
            Self::Behind => from_m <= at_m,
        }
    }
}

/// Reads the lanes along a road of a length (m).
///
/// Returns `None` if they change nowhere, or the reason why a scenario has no such lanes.
pub(super) fn read(
    lanes: &Node,
    is_left_hand: bool,
    length_m: f64,
    (entry, numbering): (Option<&EntryLane>, Option<&Numbering>),
) -> Result<Option<ChangingLanes>, String> {
    let file = FileLanes::new(lanes, (is_left_hand, length_m), entry, numbering);
    let mut stations = file.stations()?;
    let first = stations.first().map(|station| station.edges_m.clone()).unwrap_or_default();
    let is_same = |station: &CrossSection| station.edges_m.iter().zip(&first).all(|(a, b)| (a - b).abs() <= SAME_M);
    // Lanes whose numbers change are told apart by their cross-sections.
    if stations.iter().all(is_same) && numbering.is_none() {
        return Ok(None);
    }
    simplify(&mut stations);
    let mut changing = ChangingLanes { ids: file.ids.clone(), stations, deviation_m: 0.0 };
    changing.deviation_m = file.deviation_m(&changing);
    changing.check()?;
    Ok(Some(changing))
}

/// The lanes of the file.
struct FileLanes<'a> {
    is_left_hand: bool,
    length_m: f64,
    entry: Option<&'a EntryLane>,
    offsets: Vec<Piece>,
    sections: Vec<Section>,
    /// The numbers of the driving lanes, from the left.
    ids: Vec<i32>,
}

impl<'a> FileLanes<'a> {
    fn new(
        lanes: &Node,
        (is_left_hand, length_m): (bool, f64),
        entry: Option<&'a EntryLane>,
        numbering: Option<&Numbering>,
    ) -> Self {
        let side = if is_left_hand { "left" } else { "right" };
        let nodes: Vec<&Node> = lanes.all("laneSection").collect();
        let section = |(index, node): (usize, &&Node)| {
            let from_m = value(node, "s");
            let lane = |lane: &Node| {
                #[expect(clippy::cast_possible_truncation, reason = "a whole number, as `shape::check` has checked")]
                let id = value(lane, "id") as i32;
                let is_driving = lane.raw("type").is_some_and(|kind| DRIVING.contains(&kind));
                let number = || numbering.map_or(Some(id), |numbering| numbering.number(index, id));
                FileLane {
                    id,
                    number: is_driving.then(number).flatten(),
                    has_border: lane.child("width").is_none() && lane.child("border").is_some(),
                    widths: pieces(lane, ("width", "sOffset"), from_m),
                }
            };
            let mut lanes: Vec<FileLane> = node.all(side).flat_map(|side| side.all("lane")).map(lane).collect();
            lanes.sort_by_key(|lane| lane.id.unsigned_abs());
            Section { from_m, to_m: nodes.get(index + 1).map_or(length_m, |next| value(next, "s")), lanes }
        };
        let sections: Vec<Section> = nodes.iter().enumerate().map(section).collect();
        let ids: BTreeSet<i32> =
            sections.iter().flat_map(|section| &section.lanes).filter_map(|lane| lane.number).collect();
        let offsets = pieces(lanes, ("laneOffset", "s"), 0.0);
        // A scenario has no place beyond.
        let length_m = length_m.min(MOST_POSITION_M);
        Self { is_left_hand, length_m, entry, offsets, sections, ids: ids.into_iter().rev().collect() }
    }

    /// Returns the boundaries of the driving lanes at a position (m), as the polynomials on one side of
    /// it give them.
    fn edges_m(&self, s_m: f64, seen: Seen) -> Result<Vec<f64>, String> {
        let begun = self.sections.partition_point(|section| seen.has_begun(section.from_m, s_m));
        let section = self.sections.get(begun.saturating_sub(1)).ok_or("there is no lane section")?;
        let within = section.driving_and_inner();
        if self.ids.is_empty() {
            return Err("there is no driving lane".to_owned());
        }
        if within.iter().any(|lane| lane.has_border) {
            return Err("a `border` instead of a `width`".to_owned());
        }
        let outwards = if self.is_left_hand { 1.0 } else { -1.0 };
        let width_m = |lane: &FileLane| polynomial_m(&lane.widths, s_m, seen).max(0.0);
        let inner = within.iter().position(|lane| lane.number.is_some()).unwrap_or_default();
        let inner_m: f64 = within[..inner].iter().map(width_m).sum();
        let mut at_m = polynomial_m(&self.offsets, s_m, seen) + outwards * inner_m;
        let mut edges_m = vec![at_m];
        let mut between_m = 0.0;
        let mut rest = within[inner..].iter().peekable();
        // From the reference line outwards.
        let mut ids = self.ids.clone();
        ids.sort_by_key(|id| id.unsigned_abs());
        for id in ids {
            let has_lane = within.iter().any(|lane| lane.number == Some(id));
            while let Some(lane) = rest.next_if(|lane| has_lane && lane.number != Some(id)) {
                between_m += width_m(lane);
            }
            let lane = rest.next_if(|_| has_lane);
            let width_m = match (self.entry.filter(|entry| entry.id == id), lane) {
                (Some(entry), _) => entry.width_m,
                (None, Some(lane)) => width_m(lane),
                (None, None) => 0.0,
            };
            if width_m > 0.0 && between_m > SAME_M {
                return Err("a lane for another use lies between driving lanes".to_owned());
            }
            at_m += outwards * width_m;
            edges_m.push(at_m);
        }
        if self.is_left_hand {
            edges_m.reverse();
        }
        Ok(edges_m)
    }

    /// Returns the positions at which a polynomial begins, and both ends of the road (m).
    fn nodes_m(&self) -> Vec<f64> {
        let widths = self.sections.iter().flat_map(|section| {
            let widths = section.driving_and_inner().iter().flat_map(|lane| &lane.widths);
            widths.map(|piece| piece.from_m).filter(move |s_m| *s_m < section.to_m)
        });
        let offsets = self.offsets.iter().map(|piece| piece.from_m);
        let starts = self.sections.iter().map(|section| section.from_m);
        let within = |s_m: &f64| 0.0 < *s_m && *s_m < self.length_m;
        let mut nodes_m: Vec<f64> = widths.chain(offsets).chain(starts).filter(within).collect();
        nodes_m.extend([0.0, self.length_m]);
        nodes_m.sort_by(f64::total_cmp);
        nodes_m.dedup();
        nodes_m
    }

    /// Returns the cross-sections: the starts of the polynomials, and the places in between that the lines
    /// need.
    fn stations(&self) -> Result<Vec<CrossSection>, String> {
        let mut stations: Vec<CrossSection> = Vec::new();
        let nodes_m = self.nodes_m();
        for (index, node_m) in nodes_m.iter().copied().enumerate() {
            let edges_m = self.edges_m(node_m, Seen::Behind)?;
            let before_m = self.edges_m(node_m, Seen::Before)?;
            let jump_m = edges_m.iter().zip(&before_m).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            if index > 0 && jump_m > ROUNDED_M {
                return Err(format!("a boundary jumps by {jump_m:.2} m at {node_m} m"));
            }
            stations.push(CrossSection { s_m: node_m, edges_m });
            let Some(next_m) = nodes_m.get(index + 1).copied() else { continue };
            let parts = self.parts([node_m, next_m])?;
            for part in 1..parts {
                let s_m = node_m + (next_m - node_m) * f64::from(part) / f64::from(parts);
                stations.push(CrossSection { s_m, edges_m: self.edges_m(s_m, Seen::Behind)? });
            }
        }
        let mut spaced: Vec<CrossSection> = Vec::new();
        for station in stations {
            if spaced.last().is_none_or(|last| station.s_m >= last.s_m + LEAST_SPACING_M) {
                spaced.push(station);
            }
        }
        Ok(spaced)
    }

    /// Returns the number of parts in which the lines between their ends follow the polynomials.
    fn parts(&self, [from_m, to_m]: [f64; 2]) -> Result<u32, String> {
        let mut parts = 1;
        while (to_m - from_m) / f64::from(2 * parts) >= LEAST_SPACING_M {
            let mut worst_m: f64 = 0.0;
            for part in 0..parts {
                let at = |share: f64| {
                    let s_m = from_m + (to_m - from_m) * (f64::from(part) + share) / f64::from(parts);
                    self.edges_m(s_m, if share == 1.0 { Seen::Before } else { Seen::Behind })
                };
                let [start, end] = [at(0.0)?, at(1.0)?];
                for share in [0.25, 0.5, 0.75] {
                    for ((start_m, end_m), at_m) in start.iter().zip(&end).zip(at(share)?) {
                        worst_m = worst_m.max((start_m * (1.0 - share) + end_m * share - at_m).abs());
                    }
                }
            }
            if worst_m <= TOLERANCE_M {
                break;
            }
            parts *= 2;
        }
        Ok(parts)
    }

    /// Returns the largest distance between the boundaries of the file and their lines (m).
    fn deviation_m(&self, lines: &ChangingLanes) -> f64 {
        let mut worst_m: f64 = 0.0;
        let mut s_m = 0.0;
        while s_m <= self.length_m {
            if let Ok(edges_m) = self.edges_m(s_m, Seen::Behind) {
                let away_m =
                    edges_m.iter().enumerate().map(|(number, edge_m)| (edge_m - lines.edge_m(number, s_m)).abs());
                worst_m = away_m.fold(worst_m, f64::max);
            }
            s_m += COMPARED_EVERY_M;
        }
        worst_m
    }
}

/// Leaves out the cross-sections that the line between their neighbours reproduces.
fn simplify(stations: &mut Vec<CrossSection>) {
    let mut kept: Vec<CrossSection> = Vec::new();
    for (index, station) in stations.iter().enumerate() {
        let is_on_line = kept.last().zip(stations.get(index + 1)).is_some_and(|(before, next)| {
            let share = (station.s_m - before.s_m) / (next.s_m - before.s_m);
            let lines = before.edges_m.iter().zip(&next.edges_m).zip(&station.edges_m);
            lines.into_iter().all(|((a, b), at)| (a * (1.0 - share) + b * share - at).abs() <= SAME_M)
        });
        if !is_on_line {
            kept.push(station.clone());
        }
    }
    *stations = kept;
}

impl ChangingLanes {
    /// Returns the lateral position of a boundary to the left of the reference line (m).
    fn edge_m(&self, number: usize, s_m: f64) -> f64 {
        let edge_m = |station: &CrossSection| station.edges_m.get(number).copied().unwrap_or_default();
        let next = self.stations.partition_point(|station| station.s_m <= s_m);
        match (next.checked_sub(1).map(|index| &self.stations[index]), self.stations.get(next)) {
            (Some(from), Some(to)) => {
                let share = (s_m - from.s_m) / (to.s_m - from.s_m);
                edge_m(from) * (1.0 - share) + edge_m(to) * share
            }
            (Some(end), None) | (None, Some(end)) => edge_m(end),
            (None, None) => 0.0,
        }
    }

    /// Returns the width of the lane with an index (m).
    pub(super) fn width_m(&self, index: usize, s_m: f64) -> f64 {
        self.edge_m(index, s_m) - self.edge_m(index + 1, s_m)
    }

    /// Returns the centre of the lane with an index to the left of the reference line (m).
    pub(super) fn centre_m(&self, index: usize, s_m: f64) -> f64 {
        0.5 * (self.edge_m(index, s_m) + self.edge_m(index + 1, s_m))
    }

    /// Returns the leftmost place of the lanes to the left of the reference line (m).
    pub(super) fn leftmost_m(&self) -> f64 {
        self.stations.iter().map(|station| station.edges_m[0]).fold(f64::NEG_INFINITY, f64::max)
    }

    /// Checks that a scenario can have such lanes.
    fn check(&self) -> Result<(), String> {
        if self.ids.len() > MOST_LANES {
            return Err(format!("{} driving lanes, and a scenario has 1 to {MOST_LANES}", self.ids.len()));
        }
        let widest_m = |index: usize| self.stations.iter().map(|at| self.width_m(index, at.s_m)).fold(0.0, f64::max);
        let [least_m, most_m] = [Road::LANE_WIDTH_M.low(), Road::LANE_WIDTH_M.high()];
        for (index, id) in self.ids.iter().enumerate() {
            let widest_m = widest_m(index);
            if !(least_m..=most_m).contains(&widest_m) {
                return Err(format!(
                    "lane {id} is up to {widest_m:.2} m wide, and {least_m} to {most_m} m are allowed"
                ));
            }
        }
        if let Some(last) = self.stations.last().filter(|last| last.s_m > MOST_POSITION_M) {
            return Err(format!("they change at {} m, and {MOST_POSITION_M} m are allowed", last.s_m));
        }
        if self.stations.len() > MOST_SECTIONS {
            let count = self.stations.len();
            return Err(format!("lines between {count} places are needed, and {MOST_SECTIONS} are allowed"));
        }
        self.check_ways(least_m)?;
        for pair in self.stations.windows(2) {
            let moves_m = pair[0].edges_m.iter().zip(&pair[1].edges_m).map(|(from_m, to_m)| (to_m - from_m).abs());
            let steepest = moves_m.fold(0.0, f64::max) / (pair[1].s_m - pair[0].s_m);
            if !(steepest <= Road::STEEPEST_BOUNDARY) {
                return Err(format!(
                    "a boundary moves sideways by {steepest:.3} m in each metre at {} m, and {} m are allowed",
                    pair[0].s_m,
                    Road::STEEPEST_BOUNDARY
                ));
            }
        }
        match self.deviation_m <= MOST_DEVIATION_M {
            true => Ok(()),
            false => Err(format!("lines between {} places deviate by {:.2} m", self.stations.len(), self.deviation_m)),
        }
    }

    /// Checks that one lane has this width (m) or more along the whole road, and that each other lane
    /// has, or ends.
    fn check_ways(&self, least_m: f64) -> Result<(), String> {
        let mut is_open = false;
        for (index, id) in self.ids.iter().enumerate() {
            let widths_m: Vec<f64> = self.stations.iter().map(|at| at.edges_m[index] - at.edges_m[index + 1]).collect();
            is_open |= widths_m.iter().all(|width_m| *width_m >= least_m);
            for stretch in widths_m.split(|width_m| *width_m >= least_m).filter(|stretch| !stretch.is_empty()) {
                let narrowest_m = stretch.iter().copied().fold(f64::INFINITY, f64::min);
                if narrowest_m > NO_WIDTH_M {
                    return Err(format!(
                        "lane {id} narrows to {narrowest_m:.2} m, and a lane has {least_m} m or more, or ends"
                    ));
                }
            }
        }
        match is_open {
            true => Ok(()),
            false => Err(format!("no lane has {least_m} m or more along the whole road")),
        }
    }

    /// Returns the value of `cross-sections` in a scenario.
    pub(super) fn text(&self) -> String {
        let rounded = |value_m: f64| (value_m * 1e9).round() / 1e9 + 0.0;
        let leftmost_m = self.leftmost_m();
        let station = |station: &CrossSection| {
            let widths_m: Vec<f64> = station.edges_m.windows(2).map(|pair| rounded(pair[0] - pair[1])).collect();
            let left_m = rounded(station.edges_m[0] - leftmost_m);
            let left = if left_m == 0.0 { String::new() } else { format!(", left-edge-d-m = {left_m:?}") };
            format!("{{ s-m = {:?}, widths-m = {widths_m:?}{left} }}", station.s_m)
        };
        format!("[{}]", self.stations.iter().map(station).collect::<Vec<_>>().join(", "))
    }
}

fn value(node: &Node, name: &str) -> f64 {
    node.raw(name).and_then(|text| text.trim().parse().ok()).unwrap_or(0.0)
}

/// Returns the polynomials of a name. The attribute `start` says where each of them begins, behind
/// `from_m`.
fn pieces(parent: &Node, (name, start): (&str, &str), from_m: f64) -> Vec<Piece> {
    let piece = |node: &Node| Piece {
        from_m: from_m + value(node, start),
        coefficients: ["a", "b", "c", "d"].map(|name| value(node, name)),
    };
    let mut pieces: Vec<Piece> = parent.all(name).map(piece).collect();
    pieces.sort_by(|a, b| a.from_m.total_cmp(&b.from_m));
    pieces
}

/// Returns the value of polynomials at a position (m), or 0 if there is none.
fn polynomial_m(pieces: &[Piece], at_m: f64, seen: Seen) -> f64 {
    let begun = pieces.partition_point(|piece| seen.has_begun(piece.from_m, at_m));
    pieces.get(begun.saturating_sub(1)).map_or(0.0, |piece| {
        let x = (at_m - piece.from_m).max(0.0);
        let [a, b, c, d] = piece.coefficients;
        a + x * (b + x * (c + x * d))
    })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::super::dom::parse;
    use super::*;

    /// Reads the lanes of a road of 1000 m.
    fn read(text: &str, is_left_hand: bool) -> Result<Option<ChangingLanes>, String> {
        let lanes = parse(Path::new("road.xodr"), &format!("<lanes>{text}</lanes>")).unwrap();
        super::read(&lanes, is_left_hand, 1_000.0, (None, None))
    }

    /// A lane section at this place on the right, with lanes of these numbers, types and widths.
    fn section(s_m: f64, lanes: &[(i32, &str, &str)]) -> String {
        let side = if lanes[0].0 < 0 { "right" } else { "left" };
        let lane =
            |(id, kind, widths): &(i32, &str, &str)| format!("<lane id=\"{id}\" type=\"{kind}\">{widths}</lane>");
        let lanes: String = lanes.iter().map(lane).collect();
        format!("<laneSection s=\"{s_m}\"><{side}>{lanes}</{side}></laneSection>")
    }

    const FULL: &str = "<width sOffset=\"0\" a=\"3.5\"/>";
    /// A width of 0 that grows to 3.5 m between 200 and 300 m, by a polynomial without a kink.
    const GROWS: &str = "<width sOffset=\"0\" a=\"0\"/><width sOffset=\"200\" a=\"0\" c=\"0.00105\" d=\"-0.000007\"/>\
                         <width sOffset=\"300\" a=\"3.5\"/>";

    #[test]
    fn lanes_that_do_not_change_are_none() {
        let two = section(0.0, &[(-1, "driving", FULL), (-2, "driving", FULL), (-3, "shoulder", GROWS)]);
        assert_eq!(read(&two, false), Ok(None));
        let again = section(400.0, &[(-1, "driving", FULL), (-2, "exit", FULL)]);
        assert_eq!(read(&format!("<laneOffset s=\"0\" a=\"2\"/>{two}{again}"), false), Ok(None));
    }

    #[test]
    fn a_lane_that_grows_by_a_polynomial_is_followed_within_the_tolerance() {
        for (side, is_left_hand) in [(-1, false), (1, true)] {
            let text = section(0.0, &[(side, "driving", FULL), (2 * side, "driving", GROWS)]);
            let lanes = read(&text, is_left_hand).unwrap().unwrap();
            assert!((4..=40).contains(&lanes.stations.len()), "{lanes:?}");
            assert!((0.001..=TOLERANCE_M).contains(&lanes.deviation_m), "{}", lanes.deviation_m);
            let grows = if is_left_hand { 0 } else { 1 };
            assert_eq!(lanes.ids, if is_left_hand { [2, 1] } else { [-1, -2] });
            for step in 0..=400 {
                let x = 0.25 * f64::from(step);
                let width_m = 0.00105 * x * x - 0.000_007 * x * x * x;
                let away_m = (lanes.width_m(grows, 200.0 + x) - width_m).abs();
                assert!(away_m <= TOLERANCE_M, "{x}: {away_m}");
                assert!((lanes.width_m(1 - grows, 200.0 + x) - 3.5).abs() < 1e-9);
            }
            assert_eq!([0.0, 150.0, 400.0].map(|s_m| lanes.width_m(grows, s_m)), [0.0, 0.0, 3.5]);
        }
    }

    #[test]
    fn an_offset_and_the_lanes_beside_the_reference_line_move_the_lanes() {
        // The offset rises by 1 m, and the median narrows by 0.5 m.
        let offset =
            "<laneOffset s=\"0\" a=\"-1\"/><laneOffset s=\"100\" a=\"-1\" b=\"0.01\"/><laneOffset s=\"200\" a=\"0\"/>";
        let median = "<width a=\"2\"/><width sOffset=\"500\" a=\"2\" b=\"-0.005\"/><width sOffset=\"600\" a=\"1.5\"/>";
        let text = offset.to_owned() + &section(0.0, &[(-1, "median", median), (-2, "driving", FULL)]);
        let lanes = read(&text, false).unwrap().unwrap();
        assert!(lanes.deviation_m < 1e-9 && lanes.stations.len() == 6, "{lanes:?}");
        for (s_m, left_m) in [(0.0, -3.0), (150.0, -2.5), (300.0, -2.0), (550.0, -1.75), (900.0, -1.5)] {
            assert!((lanes.centre_m(0, s_m) - (left_m - 1.75)).abs() < 1e-9, "{s_m}");
        }
        assert_eq!(lanes.leftmost_m(), -1.5);
        assert!(
            lanes.text().starts_with("[{ s-m = 0.0, widths-m = [3.5], left-edge-d-m = -1.5 }, "),
            "{}",
            lanes.text()
        );
    }

    #[test]
    fn a_lane_that_a_section_lacks_has_no_width_there() {
        let ends = "<width a=\"3.5\" b=\"-0.035\"/>";
        let both = [(-1, "driving", FULL), (-2, "driving", ends)];
        let text = section(0.0, &[(-1, "driving", FULL), (-2, "driving", FULL)])
            + &section(300.0, &both)
            + &section(400.0, &both[..1]);
        let lanes = read(&text, false).unwrap().unwrap();
        assert_eq!(
            [0.0, 350.0, 400.0, 900.0].map(|s_m| (lanes.width_m(1, s_m) * 1e9).round() / 1e9),
            [3.5, 1.75, 0.0, 0.0]
        );
    }

    #[test]
    fn a_road_that_goes_on_for_ever_is_read_as_far_as_a_scenario_has_places() {
        let text = section(0.0, &[(-1, "driving", FULL), (-2, "driving", GROWS)]);
        let lanes = parse(Path::new("road.xodr"), &format!("<lanes>{text}</lanes>")).unwrap();
        let read = super::read(&lanes, false, 1e9, (None, None)).unwrap().unwrap();
        assert_eq!([0.0, 400.0, 99_000.0].map(|s_m| read.width_m(1, s_m)), [0.0, 3.5, 3.5]);
    }

    #[test]
    fn lanes_that_no_scenario_has_are_refused_with_the_reason() {
        let one = section(0.0, &[(-1, "driving", FULL), (-2, "driving", FULL)]);
        let jumps = one.clone() + &section(300.0, &[(-1, "driving", FULL)]);
        let between = section(0.0, &[(-1, "driving", FULL), (-2, "biking", FULL), (-3, "driving", GROWS)]);
        let narrow = section(0.0, &[(-1, "driving", "<width a=\"1\"/><width sOffset=\"50\" a=\"1\" b=\"0.001\"/>")]);
        let narrows_to_1_5 =
            "<width a=\"3.5\"/><width sOffset=\"100\" a=\"3.5\" b=\"-0.02\"/><width sOffset=\"200\" a=\"1.5\"/>";
        let narrows = section(0.0, &[(-1, "driving", FULL), (-2, "driving", narrows_to_1_5)]);
        let ends = "<width a=\"3.5\"/><width sOffset=\"600\" a=\"3.5\" b=\"-0.035\"/><width sOffset=\"700\" a=\"0\"/>";
        let closed = section(0.0, &[(-1, "driving", GROWS), (-2, "driving", ends)]);
        for (text, reason) in [
            (jumps, "a boundary jumps by 3.50 m at 300 m"),
            (between, "a lane for another use lies between driving lanes"),
            (narrow, "lane -1 is up to 1.95 m wide, and 2.5 to 5 m are allowed"),
            (narrows, "lane -2 narrows to 1.50 m, and a lane has 2.5 m or more, or ends"),
            (closed, "no lane has 2.5 m or more along the whole road"),
        ] {
            let error = read(&text, false).unwrap_err();
            assert!(error.contains(reason), "{error}");
        }
    }
}
