//! The acceleration lane of an OpenDRIVE road: a driving lane at the outer edge that some lane
//! sections have, and that narrows to nothing.

use std::collections::{BTreeMap, BTreeSet};

use closecall_traffic::AccelerationLane;

use super::dom::Node;

/// Names of the lane types on which vehicles drive.
pub(super) const DRIVING: [&str; 8] =
    ["driving", "entry", "exit", "onRamp", "offRamp", "connectingRamp", "mwyEntry", "mwyExit"];

/// Width below which a lane has narrowed to nothing (m): numerical.
const NO_WIDTH_M: f64 = 0.1;

/// An acceleration lane of a file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct EntryLane {
    /// The number.
    pub(super) id: i32,
    /// The full width (m).
    pub(super) width_m: f64,
    pub(super) positions: AccelerationLane,
}

/// A stretch of a lane in which one polynomial gives its width.
struct Stretch {
    from_m: f64,
    to_m: f64,
    /// Width at the start and at the end (m).
    widths_m: [f64; 2],
    is_constant: bool,
}

/// A lane section: where it begins (m), and its driving lanes.
pub(super) type Section<'a> = (f64, BTreeMap<i32, &'a Node>);

/// Returns the acceleration lane of a road, or `None` if the lanes that begin or end are no such
/// lane. `side` is the side of the reference line with the lanes along the road: `left` with
/// left-hand traffic.
pub(super) fn find(lanes: &Node, side: &str, length_m: f64) -> Option<EntryLane> {
    let sections: Vec<Section<'_>> = lanes.all("laneSection").map(|node| section(node, side)).collect::<Option<_>>()?;
    let numbers = |(_, lanes): &Section<'_>| lanes.keys().copied().collect::<BTreeSet<i32>>();
    let everywhere = sections.iter().map(numbers).reduce(|all, some| &all & &some)?;
    let anywhere: BTreeSet<i32> = sections.iter().flat_map(numbers).collect();
    let mut begin_or_end = anywhere.difference(&everywhere).copied();
    let (Some(id), None) = (begin_or_end.next(), begin_or_end.next()) else { return None };
    let outermost = if id < 0 { everywhere.first() } else { everywhere.last() };
    let inner = *outermost?;
    if inner.abs() >= id.abs() {
        return None;
    }
    let ends_m: Vec<f64> = sections.iter().skip(1).map(|(from_m, _)| *from_m).chain([length_m]).collect();
    let mut stretches: Vec<Stretch> = Vec::new();
    let mut from_m = f64::INFINITY;
    for ((section, lanes), end_m) in sections.iter().zip(&ends_m) {
        let Some(lane) = lanes.get(&id) else { continue };
        // The sections that have the lane follow each other.
        if stretches.last().is_some_and(|last| last.to_m != *section) {
            return None;
        }
        stretches.extend(widths(lane, [*section, *end_m])?);
        from_m = from_m.min(lanes.get(&inner).map_or(*section, |inner| opens_m(inner, *section)));
    }
    // A lane begins where it has a width.
    let begins = stretches.iter().position(|stretch| stretch.widths_m.iter().any(|width_m| *width_m >= NO_WIDTH_M))?;
    let stretches = &stretches[begins..];
    let is_rising = |stretch: &&Stretch| !stretch.is_constant;
    let falling = stretches.iter().rev().take_while(|stretch| !stretch.is_constant).count();
    let narrows = &stretches[stretches.len() - falling..];
    let (first, last) = (narrows.first()?, narrows.last()?);
    let full = stretches[..stretches.len() - falling].iter().find(|stretch| stretch.is_constant)?;
    // A lane that becomes wider or narrower on its way is another lane than the one of a scenario.
    let mut way = stretches[..stretches.len() - falling].iter().skip_while(is_rising);
    if way.any(|stretch| !stretch.is_constant || (stretch.widths_m[0] - full.widths_m[0]).abs() > NO_WIDTH_M) {
        return None;
    }
    let rises_to_m = stretches.iter().take_while(is_rising).last().map_or(full.from_m, |stretch| stretch.to_m);
    let ends = last.widths_m[1] < NO_WIDTH_M && last.to_m < length_m;
    let positions = AccelerationLane { from_m: from_m.max(rises_to_m), to_m: first.from_m, taper_end_m: last.to_m };
    let is_allowed = AccelerationLane::LENGTH_M.contains(positions.to_m - positions.from_m)
        && AccelerationLane::TAPER_M.contains(positions.taper_end_m - positions.to_m);
    (ends && is_allowed).then_some(EntryLane { id, width_m: full.widths_m[0], positions })
}

/// Returns the driving lanes of a lane section on one side of the reference line.
pub(super) fn section<'a>(node: &'a Node, side: &str) -> Option<Section<'a>> {
    let is_driving = |lane: &&Node| lane.raw("type").is_some_and(|kind| DRIVING.contains(&kind));
    let mut lanes = BTreeMap::new();
    for lane in node.children.iter().filter(|child| child.name == side).flat_map(|child| &child.children) {
        if lane.name == "lane" && is_driving(&lane) {
            #[expect(clippy::cast_possible_truncation, reason = "a small whole number, as `shape::check` has checked")]
            let id = value(lane, "id")? as i32;
            lanes.insert(id, lane);
        }
    }
    Some((value(node, "s").unwrap_or(0.0), lanes))
}

/// Returns the stretches of a lane in its lane section.
fn widths(lane: &Node, [section_m, end_m]: [f64; 2]) -> Option<Vec<Stretch>> {
    let widths: Vec<&Node> = lane.all("width").collect();
    let start_m = |width: &Node| section_m + value(width, "sOffset").unwrap_or(0.0);
    let stretch = |(index, width): (usize, &&Node)| {
        let (from_m, to_m) = (start_m(width), widths.get(index + 1).map_or(end_m, |next| start_m(next)));
        let [a, b, c, d] = ["a", "b", "c", "d"].map(|name| value(width, name).unwrap_or(0.0));
        let at = |ds_m: f64| a + ds_m * (b + ds_m * (c + ds_m * d));
        let widths_m = [at(0.0), at(to_m - from_m)];
        Stretch { from_m, to_m, widths_m, is_constant: [b, c, d] == [0.0; 3] }
    };
    let stretches: Vec<Stretch> = widths.iter().enumerate().map(stretch).collect();
    (!stretches.is_empty()).then_some(stretches)
}

/// Returns the position from which vehicles may cross the marking at the outer side of a lane (m):
/// the first broken line, or the start of the section without a marking. Infinite if the line is
/// solid.
fn opens_m(inner: &Node, section_m: f64) -> f64 {
    let mut marks = inner.all("roadMark").peekable();
    if marks.peek().is_none() {
        return section_m;
    }
    let open = marks.find(|mark| mark.raw("type").is_some_and(|kind| kind.contains("broken") || kind == "none"));
    open.map_or(f64::INFINITY, |mark| section_m + value(mark, "sOffset").unwrap_or(0.0))
}

fn value(node: &Node, name: &str) -> Option<f64> {
    node.raw(name).and_then(|text| text.trim().parse().ok())
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::super::dom::parse;
    use super::*;

    const FULL: &str = "<width sOffset=\"0\" a=\"3.5\" b=\"0\" c=\"0\" d=\"0\"/>";
    const RISES: &str = "<width sOffset=\"0\" a=\"0\" b=\"0.07\" c=\"0\" d=\"0\"/>\
                         <width sOffset=\"50\" a=\"3.5\" b=\"0\" c=\"0\" d=\"0\"/>";
    const FALLS: &str = "<width sOffset=\"0\" a=\"3.5\" b=\"-0.05\" c=\"0\" d=\"0\"/>";
    const SOLID: &str = "<roadMark sOffset=\"0\" type=\"solid\"/><roadMark sOffset=\"200\" type=\"broken\"/>";
    const BROKEN: &str = "<roadMark sOffset=\"0\" type=\"broken\"/>";

    /// A lane section that begins at this place, with lanes of these numbers and contents.
    fn section(s_m: f64, lanes: &[(i32, &str)]) -> String {
        let side = if lanes[0].0 < 0 { "right" } else { "left" };
        let lanes: Vec<String> =
            lanes.iter().map(|(id, inner)| format!("<lane id=\"{id}\" type=\"driving\">{inner}</lane>")).collect();
        format!("<laneSection s=\"{s_m}\"><{side}>{}</{side}></laneSection>", lanes.concat())
    }

    fn entry_lane_of(side: &str, sections: &[String]) -> Option<(i32, [f64; 3])> {
        let text = format!("<lanes>{}</lanes>", sections.concat());
        let lane = find(&parse(Path::new("road.xodr"), &text).unwrap(), side, 1_000.0)?;
        assert_eq!(lane.width_m, 3.5);
        Some((lane.id, [lane.positions.from_m, lane.positions.to_m, lane.positions.taper_end_m]))
    }

    /// The inner lane with a marking.
    fn inner(id: i32, mark: &str) -> (i32, String) {
        (id, format!("{FULL}{mark}"))
    }

    #[test]
    fn a_lane_at_the_outer_edge_that_narrows_to_nothing_is_an_acceleration_lane() {
        for (side, sign) in [("right", -1), ("left", 1)] {
            let (one, two) = (inner(sign, BROKEN), inner(2 * sign, SOLID));
            let of = |third: Option<&str>, s_m| {
                let mut lanes = vec![(one.0, one.1.as_str()), (two.0, two.1.as_str())];
                lanes.extend(third.map(|third| (3 * sign, third)));
                section(s_m, &lanes)
            };
            // From the start of the road on: the marking opens 200 m behind it.
            let ramp = [of(Some(FULL), 0.0), of(Some(FALLS), 400.0), of(None, 470.0)];
            assert_eq!(entry_lane_of(side, &ramp), Some((3 * sign, [200.0, 400.0, 470.0])));
            // It begins within the road: it rises to its width, and the marking opens behind that.
            let begins = [of(None, 0.0), of(Some(RISES), 100.0), of(Some(FALLS), 400.0), of(None, 470.0)];
            assert_eq!(entry_lane_of(side, &begins), Some((3 * sign, [300.0, 400.0, 470.0])));
            // No lane that begins or ends, a lane without an end, and one that ends at once.
            assert_eq!(entry_lane_of(side, &[of(Some(FULL), 0.0), of(Some(FULL), 400.0)]), None);
            assert_eq!(entry_lane_of(side, &[of(None, 0.0), of(Some(FULL), 400.0)]), None);
            assert_eq!(entry_lane_of(side, &[of(Some(FULL), 0.0), of(None, 400.0)]), None);
            // A lane that ends between others.
            let between = section(0.0, &[(sign, FULL), (2 * sign, FALLS), (3 * sign, FULL)]);
            assert_eq!(entry_lane_of(side, &[between, section(70.0, &[(sign, FULL), (3 * sign, FULL)])]), None);
        }
    }
}
