//! A road as OpenDRIVE 1.8: one road, whose reference line is the left edge of the leftmost lane.
//!
//! ```text
//!  Closecall   d = 0 ─── left edge ──▶ s       lane 1, 2, … n
//!  OpenDRIVE   t = 0 ─ reference line ─▶ s − s₀   lane −1, −2, … −n
//! ```
//!
//! If the alignment lies beside the left edge, it is the reference line, and the lanes have an
//! offset. Lanes whose widths change have a polynomial of first degree for each stretch, and so has
//! the offset.
//!
//! An acceleration lane is lane −n, in three lane sections: with the full width, with a width that
//! falls to 0, and without the lane. Before the lane begins, the marking to its left is solid. If
//! traffic overtakes on the right, the acceleration lane is lane −1; the file has its full width
//! everywhere.

use closecall_traffic::{AccelerationLane, AlignmentPiece, Lane, Road, Side};

use super::element::Element;
use crate::date::today;

/// Difference of two coefficients of polynomials that are the same: numerical.
const SAME: f64 = 1e-12;

/// Length of the road before the first and behind the last position that is used (m): a player
/// looks ahead.
const MARGIN_M: f64 = 500.0;
/// Width of a marking of a motorway lane (m): the narrow line of RMS-1 (FGSV 1993).
const MARKING_WIDTH_M: f64 = 0.15;

/// The part of a road that a case uses.
#[derive(Clone, Copy, Debug)]
pub(super) struct UsedRoad<'a> {
    pub(super) road: &'a Road,
    /// Position at which the road of the file begins (m).
    pub(super) start_m: f64,
    length_m: f64,
}

impl<'a> UsedRoad<'a> {
    /// Returns the part of the road that contains these positions (m), in whole metres.
    pub(super) fn new(road: &'a Road, positions_m: impl Iterator<Item = f64>) -> Self {
        let (low_m, high_m) = positions_m
            .filter(|s_m| s_m.is_finite())
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), s_m| (low.min(s_m), high.max(s_m)));
        let (low_m, high_m) = if low_m <= high_m { (low_m, high_m) } else { (0.0, 0.0) };
        let start_m = (low_m - MARGIN_M).floor();
        Self { road, start_m, length_m: (high_m + MARGIN_M).ceil() - start_m }
    }

    /// Returns the positions at which the road begins and ends (m).
    pub(super) fn range_m(&self) -> [f64; 2] {
        [self.start_m, self.start_m + self.length_m]
    }

    /// Returns the document.
    pub(super) fn document(&self, name: &str) -> String {
        let header = Element::new("header")
            .with("revMajor", 1)
            .with("revMinor", 8)
            .with("name", name)
            .with("version", "1.00")
            .with("date", today())
            .with("vendor", "Closecall");
        Element::new("OpenDRIVE").child(header).child(self.element(name)).document()
    }

    fn element(&self, name: &str) -> Element {
        let speed = Element::new("speed").with("max", self.road.speed_limit_mps()).with("unit", "m/s");
        let sections = self.sections();
        let mut lanes = Element::new("lanes").children(self.offsets());
        for (number, section) in sections.iter().enumerate() {
            let before = number.checked_sub(1).map(|number| &sections[number]);
            lanes = lanes.child(self.section(section, [before, sections.get(number + 1)]));
        }
        Element::new("road")
            .with("name", name)
            .with("length", self.length_m)
            .with("id", 1)
            .with("junction", -1)
            .with("rule", "RHT")
            .child(Element::new("type").with("s", 0).with("type", "motorway").child(speed))
            .child(Element::new("planView").children(self.geometries()))
            .child(lanes)
    }

    /// Returns the pieces of the reference line: lines, arcs and spirals.
    fn geometries(&self) -> Vec<Element> {
        let [from_m, to_m] = self.range_m();
        let pieces: Vec<AlignmentPiece> = match self.road.alignment() {
            Some(alignment) => alignment.pieces(from_m, to_m).collect(),
            None => {
                let curvatures_per_m = [self.road.curvature_at_per_m(from_m); 2];
                vec![AlignmentPiece { start_m: from_m, length_m: self.length_m, curvatures_per_m }]
            }
        };
        let geometry = |piece: &AlignmentPiece| {
            let start = self.road.plane_pose(piece.start_m, self.road.alignment_d_m(), 0.0);
            let [from, to] = piece.curvatures_per_m;
            let shape = match (from == to, from == 0.0) {
                (true, true) => Element::new("line"),
                (true, false) => Element::new("arc").with("curvature", from),
                (false, _) => Element::new("spiral").with("curvStart", from).with("curvEnd", to),
            };
            Element::new("geometry")
                .with("s", piece.start_m - from_m)
                .with("x", start.x_m)
                .with("y", start.y_m)
                .with("hdg", start.yaw_rad)
                .with("length", piece.length_m)
                .child(shape)
        };
        pieces.iter().map(geometry).collect()
    }

    /// Returns the acceleration lane, if it is the rightmost lane.
    fn narrowing_lane(&self) -> Option<&AccelerationLane> {
        self.road.acceleration_lane().filter(|_| self.road.overtaking_side() == Side::Left)
    }

    /// Returns the stretches of the road with the same lanes, from the start of the file's road on.
    fn sections(&self) -> Vec<Section> {
        let lanes = self.road.lanes();
        let Some(lane) = self.narrowing_lane() else {
            return vec![Section { from_m: 0.0, to_m: self.length_m, lanes, is_taper: false }];
        };
        let [narrows_m, ends_m] = [lane.to_m, lane.taper_end_m].map(|s_m| s_m - self.start_m);
        let section = |from_m: f64, to_m: f64, lanes, is_taper| {
            let (from_m, to_m) = (from_m.max(0.0), to_m.min(self.length_m));
            (from_m < to_m).then_some(Section { from_m, to_m, lanes, is_taper })
        };
        let sections = [
            section(0.0, narrows_m, lanes, false),
            section(narrows_m, ends_m, lanes, true),
            section(ends_m, self.length_m, lanes - 1, false),
        ];
        sections.into_iter().flatten().collect()
    }

    /// Returns a lane section. `beside` holds the sections before and behind it.
    fn section(&self, section: &Section, beside: [Option<&Section>; 2]) -> Element {
        let centre =
            Element::new("lane").with("id", 0).with("type", "none").with("level", "false").child(marking("solid", 0.0));
        let right = (1..=section.lanes).map(|lane| {
            let ends = [("predecessor", beside[0]), ("successor", beside[1])];
            // A lane without a width at an end has no lane beyond it.
            let has_width = |name: &str| {
                let along_m = if name == "predecessor" { section.from_m } else { section.to_m };
                self.road.lane_width_m(Lane(lane), self.start_m + along_m) > 0.0
            };
            let links = ends
                .into_iter()
                .filter(|(name, other)| other.is_some_and(|other| lane <= other.lanes) && has_width(name));
            let links: Vec<Element> =
                links.map(|(name, _)| Element::new(name).with("id", format!("-{lane}"))).collect();
            let link = (!links.is_empty()).then(|| Element::new("link").children(links));
            Element::new("lane")
                .with("id", format!("-{lane}"))
                .with("type", "driving")
                .with("level", "false")
                .children(link)
                .children(self.widths(section, Lane(lane)))
                .children(self.markings(section, Lane(lane)))
        });
        // The standard lists the lanes of a section with descending numbers: from left to right.
        Element::new("laneSection")
            .with("s", section.from_m)
            .child(centre.within("center"))
            .child(Element::new("right").children(right))
    }

    /// Returns the widths of a lane in a section: a polynomial for each stretch.
    fn widths(&self, section: &Section, lane: Lane) -> Vec<Element> {
        let section_m = self.start_m + section.from_m;
        let narrowing = self.narrowing_lane().filter(|_| section.is_taper && lane.0 == section.lanes);
        let polynomial = |[from_m, to_m]: [f64; 2]| {
            let [full_m, end_m] = [from_m, to_m].map(|s_m| self.road.lane_width_m(lane, s_m));
            let slope = (end_m - full_m) / (to_m - from_m);
            // The product of the share and the width is a polynomial of second degree.
            let [a, b, c] = match narrowing {
                Some(narrowing) => {
                    let (share, falls) =
                        (narrowing.width_share(from_m), 1.0 / (narrowing.taper_end_m - narrowing.to_m));
                    match slope == 0.0 {
                        true => [full_m * share, -full_m / (narrowing.taper_end_m - narrowing.to_m), 0.0],
                        false => [full_m * share, slope * share - full_m * falls, -slope * falls],
                    }
                }
                None => [full_m, slope, 0.0],
            };
            Polynomial { from_m, a, b, c }
        };
        let polynomials = without_repetitions(self.stretches_m(section).into_iter().map(polynomial));
        let element = |polynomial: Polynomial| {
            let width = Element::new("width").with("sOffset", polynomial.from_m - section_m).with("a", polynomial.a);
            width.with("b", polynomial.b).with("c", polynomial.c).with("d", 0)
        };
        polynomials.into_iter().map(element).collect()
    }

    /// Returns the stretches of a section on which each boundary of the lanes is a line (m).
    fn stretches_m(&self, section: &Section) -> Vec<[f64; 2]> {
        let ends_m = [section.from_m, section.to_m].map(|along_m| self.start_m + along_m);
        match self.road.has_changing_lanes() {
            true => self.road.stretches_m(ends_m),
            false => vec![ends_m],
        }
    }

    /// Returns the distance of the left edge of the lanes from the reference line, if it is not
    /// always 0.
    fn offsets(&self) -> Vec<Element> {
        let beside_m = self.road.alignment_d_m();
        let offset = |from_m: f64, offset_m: f64, slope: f64| {
            let offset = Element::new("laneOffset").with("s", from_m - self.start_m).with("a", offset_m);
            offset.with("b", slope).with("c", 0).with("d", 0)
        };
        if !self.road.has_changing_lanes() {
            return (beside_m != 0.0).then(|| offset(self.start_m, -beside_m, 0.0)).into_iter().collect();
        }
        let polynomial = |[from_m, to_m]: [f64; 2]| {
            let [left_m, end_m] = [from_m, to_m].map(|s_m| self.road.full_boundary_m(0, s_m));
            Polynomial { from_m, a: left_m - beside_m, b: (end_m - left_m) / (to_m - from_m), c: 0.0 }
        };
        let offsets = without_repetitions(self.road.stretches_m(self.range_m()).into_iter().map(polynomial));
        let is_zero = offsets.iter().all(|Polynomial { a, b, .. }| [*a, *b] == [0.0; 2]);
        let offsets = offsets.into_iter().filter(|_| !is_zero);
        offsets.map(|Polynomial { from_m, a, b, .. }| offset(from_m, a, b)).collect()
    }

    /// Returns the markings to the right of a lane.
    fn markings(&self, section: &Section, lane: Lane) -> Vec<Element> {
        if lane.0 == section.lanes {
            return vec![marking("solid", 0.0)];
        }
        let begins_m = self
            .narrowing_lane()
            .filter(|_| lane.0 + 1 == self.road.lanes())
            .map_or(0.0, |entry| entry.from_m - self.start_m - section.from_m);
        match begins_m > 0.0 {
            false => vec![marking("broken", 0.0)],
            true if begins_m < self.length_m - section.from_m => {
                vec![marking("solid", 0.0), marking("broken", begins_m)]
            }
            true => vec![marking("solid", 0.0)],
        }
    }
}

/// A polynomial of second degree of the distance from a position (m).
#[derive(Clone, Copy, Debug, PartialEq)]
struct Polynomial {
    from_m: f64,
    a: f64,
    b: f64,
    c: f64,
}

impl Polynomial {
    /// Returns whether `next` is the same line.
    fn goes_on_as(&self, next: &Self) -> bool {
        let at_next_m = self.a + self.b * (next.from_m - self.from_m);
        [self.c, next.c] == [0.0; 2] && (self.b - next.b).abs() < SAME && (at_next_m - next.a).abs() < SAME
    }
}

/// Returns the polynomials without those that go on as the polynomial before them.
fn without_repetitions(polynomials: impl Iterator<Item = Polynomial>) -> Vec<Polynomial> {
    let mut different: Vec<Polynomial> = Vec::new();
    for polynomial in polynomials {
        if !different.last().is_some_and(|before| before.goes_on_as(&polynomial)) {
            different.push(polynomial);
        }
    }
    different
}

/// A stretch of the road with the same lanes.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Section {
    /// Where it begins and ends, from the start of the file's road (m).
    from_m: f64,
    to_m: f64,
    lanes: u8,
    /// Whether the rightmost lane narrows to nothing.
    is_taper: bool,
}

/// Returns a marking that begins this far behind the start of its lane section (m).
fn marking(kind: &str, from_m: f64) -> Element {
    let lane_change = if kind == "solid" { "none" } else { "both" };
    Element::new("roadMark")
        .with("sOffset", from_m)
        .with("type", kind)
        .with("weight", "standard")
        .with("color", "standard")
        .with("width", MARKING_WIDTH_M)
        .with("laneChange", lane_change)
}

#[cfg(test)]
mod tests {
    use closecall_traffic::{Alignment, AlignmentPoint};

    use super::*;

    const ENTRY: AccelerationLane = AccelerationLane { from_m: 100.0, to_m: 350.0, taper_end_m: 410.0 };

    /// The document of a road from −500 m to `last_m` + 500 m.
    fn document(road: &Road, last_m: f64) -> String {
        UsedRoad::new(road, [0.0, last_m].into_iter()).document("road")
    }

    fn count(text: &str, part: &str) -> usize {
        text.matches(part).count()
    }

    #[test]
    fn an_acceleration_lane_narrows_in_a_lane_section_and_is_not_in_the_next() {
        let plain = document(&Road::straight(3), 400.0);
        assert_eq!((count(&plain, "<laneSection"), count(&plain, "<link"), count(&plain, "id=\"-3\"")), (1, 0, 1));
        let text = document(&Road::straight(3).with_acceleration_lane(ENTRY), 400.0);
        assert_eq!(count(&text, "<laneSection"), 3);
        for start in ["<laneSection s=\"0\">", "<laneSection s=\"850\">", "<laneSection s=\"910\">"] {
            assert_eq!(count(&text, start), 1, "{start}: {text}");
        }
        assert_eq!(count(&text, "<lane id=\"-3\""), 2);
        assert_eq!(count(&text, "a=\"3.75\" b=\"-0.0625\""), 1);
        // Lanes 1 and 2 go on at both ends of the middle section; lane 3 does at its start alone.
        assert_eq!((count(&text, "<successor"), count(&text, "<predecessor")), (5, 5));
        // The marking is broken from the end of the ramp on, 600 m behind the start of the file's
        // road.
        let first = text.split("<laneSection").nth(1).unwrap();
        assert_eq!(count(first, "sOffset=\"600\" type=\"broken\""), 1, "{first}");
    }

    #[test]
    fn each_lane_has_its_own_width() {
        let road = Road::straight(3).with_lane_widths(&[3.75, 3.25, 3.5]);
        let widths = |text: &str| -> Vec<String> {
            let lanes = text.split("<width ").skip(1);
            lanes.map(|lane| lane.split("a=\"").nth(1).unwrap().split('"').next().unwrap().to_owned()).collect()
        };
        assert_eq!(widths(&document(&road, 400.0)), ["3.75", "3.25", "3.5"]);
        let text = document(&road.with_acceleration_lane(ENTRY), 400.0);
        assert_eq!(widths(&text), ["3.75", "3.25", "3.5", "3.75", "3.25", "3.5", "3.75", "3.25"]);
        assert_eq!(count(&text, &format!("a=\"3.5\" b=\"{}\"", -3.5 / 60.0)), 1, "{text}");
    }

    #[test]
    fn the_pieces_of_an_alignment_are_lines_arcs_and_spirals_that_follow_each_other() {
        let points = [[0.0, 0.0], [100.0, 0.002], [250.0, 0.002], [250.0, 0.0], [350.0, -0.001]];
        let points = points.map(|[s_m, curvature_per_m]| AlignmentPoint { s_m, curvature_per_m });
        let road = Road::straight(2).with_alignment(Alignment::new(&points).unwrap());
        let text = document(&road, 400.0);
        let shapes: Vec<&str> = text.split("<geometry ").skip(1).map(|part| part.split('<').nth(1).unwrap()).collect();
        let names: Vec<&str> = shapes.iter().map(|shape| shape.split([' ', '/']).next().unwrap()).collect();
        assert_eq!(names, ["line", "spiral", "arc", "spiral", "arc"]);
        assert!(shapes[1].contains("curvStart=\"0\" curvEnd=\"0.002\""), "{}", shapes[1]);
        assert!(shapes[3].contains("curvStart=\"0\" curvEnd=\"-0.001\""), "{}", shapes[3]);
        for (start, length) in [("0", "500"), ("500", "100"), ("600", "150"), ("750", "100"), ("850", "550")] {
            let piece = text.split("<geometry ").find(|part| part.starts_with(&format!("s=\"{start}\" "))).unwrap();
            assert!(piece.contains(&format!("length=\"{length}\"")), "{piece}");
            let pose = road.plane_pose(start.parse::<f64>().unwrap() - 500.0, 0.0, 0.0);
            for (key, value) in [("x", pose.x_m), ("y", pose.y_m), ("hdg", pose.yaw_rad)] {
                assert!(piece.contains(&format!("{key}=\"{value}\"")), "{key} {value}: {piece}");
            }
        }
        // A part within one piece is one piece.
        assert_eq!(count(&UsedRoad::new(&road, [2_000.0].into_iter()).document("road"), "<geometry"), 1);
        // An alignment beside the left edge is the reference line, and the lanes have an offset.
        assert_eq!(count(&text, "<laneOffset"), 0);
        let beside = Road::straight(2).with_alignment_at(Alignment::new(&points).unwrap(), 2.75);
        let text = document(&beside, 400.0);
        assert_eq!(count(&text, "<laneOffset s=\"0\" a=\"-2.75\" b=\"0\" c=\"0\" d=\"0\"/>"), 1, "{text}");
        let pose = beside.plane_pose(100.0, 2.75, 0.0);
        assert_eq!(count(&text, &format!("x=\"{}\" y=\"{}\"", pose.x_m, pose.y_m)), 1, "{text}");
    }

    #[test]
    fn a_file_of_a_part_of_the_road_has_the_lanes_of_that_part() {
        let road =
            Road::straight(3).with_acceleration_lane(AccelerationLane { to_m: 5_350.0, taper_end_m: 5_410.0, ..ENTRY });
        assert_eq!(count(&document(&road, 400.0), "<laneSection"), 1);
        let passed = AccelerationLane { from_m: -2_000.0, to_m: -1_000.0, taper_end_m: -900.0 };
        let text = document(&Road::straight(3).with_acceleration_lane(passed), 400.0);
        assert_eq!((count(&text, "<laneSection"), count(&text, "<lane id=\"-3\"")), (1, 0));
        // On the right-overtaking side the lane is the leftmost, whose width the file does not
        // change.
        let mirrored = Road::straight(3).with_acceleration_lane(ENTRY).mirrored().unwrap();
        assert_eq!(count(&document(&mirrored, 400.0), "<laneSection"), 1);
    }
}
