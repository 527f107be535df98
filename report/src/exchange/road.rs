//! A road as OpenDRIVE 1.8: one road, whose reference line is the left edge of the leftmost lane.
//!
//! ```text
//!  Closecall   d = 0 ─── left edge ──▶ s       lane 1, 2, … n
//!  OpenDRIVE   t = 0 ─ reference line ─▶ s − s₀   lane −1, −2, … −n
//! ```

use closecall_traffic::Road;

use super::element::Element;
use crate::date::today;

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
        let start = self.road.plane_pose(self.start_m, 0.0, 0.0);
        let curvature = self.road.curvature_per_m();
        let shape = match curvature == 0.0 {
            true => Element::new("line"),
            false => Element::new("arc").with("curvature", curvature),
        };
        let geometry = Element::new("geometry")
            .with("s", 0)
            .with("x", start.x_m)
            .with("y", start.y_m)
            .with("hdg", start.yaw_rad)
            .with("length", self.length_m)
            .child(shape);
        let speed = Element::new("speed").with("max", self.road.speed_limit_mps()).with("unit", "m/s");
        let lanes = self.road.lanes();
        let centre =
            Element::new("lane").with("id", 0).with("type", "none").with("level", "false").child(marking("solid"));
        let right = (1..=lanes).map(|lane| {
            let width = Element::new("width")
                .with("sOffset", 0)
                .with("a", self.road.lane_width_m())
                .with("b", 0)
                .with("c", 0)
                .with("d", 0);
            let line = if lane == lanes { "solid" } else { "broken" };
            Element::new("lane")
                .with("id", format!("-{lane}"))
                .with("type", "driving")
                .with("level", "false")
                .child(width)
                .child(marking(line))
        });
        // The standard lists the lanes of a section with descending numbers: from left to right.
        let section = Element::new("laneSection")
            .with("s", 0)
            .child(centre.within("center"))
            .child(Element::new("right").children(right));
        Element::new("road")
            .with("name", name)
            .with("length", self.length_m)
            .with("id", 1)
            .with("junction", -1)
            .with("rule", "RHT")
            .child(Element::new("type").with("s", 0).with("type", "motorway").child(speed))
            .child(geometry.within("planView"))
            .child(section.within("lanes"))
    }
}

fn marking(kind: &str) -> Element {
    let lane_change = if kind == "solid" { "none" } else { "both" };
    Element::new("roadMark")
        .with("sOffset", 0)
        .with("type", kind)
        .with("weight", "standard")
        .with("color", "standard")
        .with("width", MARKING_WIDTH_M)
        .with("laneChange", lane_change)
}
