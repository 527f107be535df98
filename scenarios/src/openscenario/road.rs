//! The part of an OpenDRIVE road that a scenario of parallel lanes has: driving lanes of one
//! direction, width, curvature, speed.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use closecall_traffic::words::counted;
use closecall_traffic::{AccelerationLane, Alignment, Road};

use super::changing_lanes::{self, ChangingLanes};
use super::course;
use super::dom::{ImportError, Node, number, parse};
use super::entry_lane::{self, DRIVING};
use super::numbering::Numbering;
use super::plane::ReferenceLine;
use super::reader::Reader;
use super::sections::LaneSections;
use super::shape;

/// Numbers of lanes of a scenario file.
const LANES: std::ops::RangeInclusive<usize> = 1..=8;
/// Highest speed limit of a scenario file (m/s).
const MOST_SPEED_LIMIT_MPS: f64 = 100.0;
/// The words of the standard for no speed limit. Its type `t_maxSpeed` has these words and the
/// numbers of at least 0: some programs write -1, which has no meaning there.
const NO_LIMIT: [&str; 2] = ["no limit", "undefined"];

/// Largest distance between two lanes that lie beside each other (m): the numbers of a file are
/// rounded.
const MOST_GAP_M: f64 = 0.01;
/// Coefficient, and difference of two, up to which a polynomial does not change: numerical.
const ROUNDED: f64 = 1e-9;
/// Distance between lanes whose width changes and their lines from which on a note states it (m):
/// numerical.
const NOTED_DEVIATION_M: f64 = 1e-6;

/// The part of a file's road that a scenario can use.
#[derive(Clone, Debug)]
pub(super) struct ImportedRoad {
    pub(super) id: String,
    /// Whether traffic keeps left, so that its lanes are on the left of the reference line.
    pub(super) is_left_hand: bool,
    pub(super) length_m: f64,
    /// The lanes of OpenDRIVE on which traffic drives along the reference line, from the left.
    pub(super) lanes: Vec<i32>,
    /// The lanes of a road whose lanes change along it.
    pub(super) changing: Option<ChangingLanes>,
    /// The centres of the lanes of another road, to the left of the reference line (m).
    centres_m: Vec<f64>,
    /// The widths of these lanes (m).
    pub(super) widths_m: Vec<f64>,
    pub(super) curvature_per_m: f64,
    /// The course of a road whose curvature changes, or whose lanes lie beside its reference line.
    pub(super) alignment: Option<Alignment>,
    /// Lateral position of the reference line of the file: to the left of the left edge of the
    /// lanes (m).
    pub(super) alignment_d_m: f64,
    /// Where along the road the lanes are.
    pub(super) sections: LaneSections,
    /// The numbers of lanes that have another number in another lane section.
    numbering: Option<Numbering>,
    pub(super) acceleration_lane: Option<AccelerationLane>,
    /// The reference line, or `None` if the road has another course than its reference line.
    pub(super) line: Option<ReferenceLine>,
    pub(super) speed_limit_mps: Option<f64>,
    /// The properties that the scenario's road lacks.
    pub(super) notes: Vec<String>,
}

impl ImportedRoad {
    /// Returns the index of a lane of OpenDRIVE, from the left.
    pub(super) fn index(&self, lane: i32) -> Option<usize> {
        self.lanes.iter().position(|other| *other == lane)
    }

    /// Returns the number in the import of the lane that has a number in the file at `s_m`.
    pub(super) fn number(&self, id: i32, s_m: f64) -> Option<i32> {
        match &self.numbering {
            Some(numbering) => numbering.number(self.sections.at(s_m), id),
            None => Some(id),
        }
    }

    /// Returns half the width at a position of the lane with an index (m).
    pub(super) fn half_width_m(&self, index: usize, s_m: f64) -> f64 {
        0.5 * match &self.changing {
            Some(changing) => changing.width_m(index, s_m),
            None => self.widths_m.get(index).copied().unwrap_or_default(),
        }
    }

    /// Returns the centre at a position of the lane with an index, to the left of the reference line of
    /// the file (m).
    pub(super) fn file_centre_m(&self, index: usize, s_m: f64) -> f64 {
        match &self.changing {
            Some(changing) => changing.centre_m(index, s_m),
            None => self.centres_m.get(index).copied().unwrap_or(f64::NAN),
        }
    }

    /// Returns the lateral position in the scenario of the centre at a position of the lane with an
    /// index (m).
    pub(super) fn centre_m(&self, index: usize, s_m: f64) -> f64 {
        match &self.changing {
            Some(changing) => changing.centre_m(index, s_m) + self.alignment_d_m,
            None => -(self.widths_m.iter().take(index).sum::<f64>() + self.half_width_m(index, s_m)),
        }
    }

    /// Returns the length of the path that a vehicle covers per metre of the reference line (m/m): below 1
    /// on the inside of a bend. The vehicle is at `s_m`, `t_m` to the left of the line.
    pub(super) fn path_scale(&self, s_m: f64, t_m: f64) -> f64 {
        self.line.as_ref().map_or(1.0, |line| line.course.path_scale(s_m, t_m))
    }

    /// Returns the index of the lane in which a place (m) lies, or to whose edge it is nearest: at
    /// `s_m`, to the left of the reference line.
    pub(super) fn lane_near(&self, s_m: f64, t_m: f64) -> Option<usize> {
        let beyond_m = |index: usize| (self.file_centre_m(index, s_m) - t_m).abs() - self.half_width_m(index, s_m);
        // A lane that has no width has no place.
        let has_width = |index: &usize| self.changing.is_none() || self.half_width_m(*index, s_m) > 0.0;
        (0..self.lanes.len()).filter(has_width).min_by(|a, b| beyond_m(*a).total_cmp(&beyond_m(*b)))
    }
}

/// The road that a scenario uses.
#[derive(Clone, Debug)]
pub(super) enum UsedRoad<'a> {
    /// The road of this number; a vehicle uses this lane. A position of the scenario says so, and
    /// is wrong if there is no such road or lane.
    Lane { road_id: String, lane: i32, reader: &'a Reader, position: &'a Node },
    /// The only road of the network.
    Only,
}

/// A driving lane of the file.
#[derive(Clone, Copy, Debug)]
struct DrivingLane {
    id: i32,
    width_m: f64,
}

impl DrivingLane {
    /// Returns the width of the lane in the scenario (m). A width at `s_m` that no lane of a scenario
    /// has becomes the width of the ego's lane, with a note.
    fn width_in_scenario_m(&self, own: Self, s_m: f64, notes: &mut Vec<String>) -> f64 {
        let Self { id, width_m } = *self;
        if Road::LANE_WIDTH_M.contains(width_m) {
            return width_m;
        }
        let allowed = "a lane of a scenario has a width of 2.5 to 5 m";
        let own_m = own.width_m;
        notes.push(format!(
            "lane {id} with a width of {width_m} m at {s_m} m, and {allowed}: it has the {own_m} m of the ego's lane"
        ));
        own_m
    }
}

/// A place along a road.
#[derive(Clone, Copy, Debug)]
struct Place {
    /// Distance from the start of the road (m).
    s_m: f64,
    /// Distance from the start of the lane section (m).
    within_section_m: f64,
}

/// Returns the road of a network that the scenario uses.
fn used_road<'a>(path: &Path, root: &'a Node, used: &UsedRoad<'_>) -> Result<&'a Node, ImportError> {
    let mut ids = BTreeSet::new();
    for road in root.all("road") {
        if let Some(id) = road.raw("id")
            && !ids.insert(id)
        {
            return Err(road.error(path, format!("a road before it has the number `{id}` already")));
        }
    }
    let roads: Vec<_> = root.all("road").filter_map(|road| road.raw("id")).collect();
    let road_id = match (used, &roads[..]) {
        (UsedRoad::Lane { road_id, .. }, _) => road_id.as_str(),
        (UsedRoad::Only, [only]) => *only,
        (UsedRoad::Only, _) => {
            let message = "no position of the scenario says on which of its roads: it must have exactly one";
            return Err(root.error(path, message));
        }
    };
    root.all("road").find(|road| road.raw("id") == Some(road_id)).ok_or_else(|| {
        let named = if roads.is_empty() { "none".to_owned() } else { roads.join(", ") };
        let message = format!("there is no road `{road_id}` in {}, only {named}", path.display());
        match used {
            UsedRoad::Lane { reader, position, .. } => reader.error(position, message),
            UsedRoad::Only => root.error(path, message),
        }
    })
}

/// Returns the driving lanes on one side of a lane section, in the order of the file, with their
/// widths at a place.
fn driving_lanes(
    path: &Path,
    along: &Node,
    place: Place,
    used: &UsedRoad<'_>,
) -> Result<Vec<DrivingLane>, ImportError> {
    let mut driving: Vec<DrivingLane> = Vec::new();
    for node in along.all("lane").filter(|node| node.raw("type").is_some_and(|kind| DRIVING.contains(&kind))) {
        let id = number(path, node, "id")?;
        let Some(width) = node.child("width") else {
            let (node, message) = match node.child("border") {
                Some(border) => (border, "the width of a lane is read from `width`, and it has none"),
                None => (node, "it has no `width`"),
            };
            return Err(node.error(path, message));
        };
        number(path, width, "a")?;
        let width_m = width_m(node, place.within_section_m);
        #[expect(clippy::cast_possible_truncation, reason = "a small whole number, as `shape::check` has checked")]
        let id = id as i32;
        let is_used = matches!(used, UsedRoad::Lane { lane, .. } if *lane == id);
        if is_used && !Road::LANE_WIDTH_M.contains(width_m) {
            let message = format!("at {} m it is {width_m}; a lane of a scenario has a width of 2.5 to 5 m", place.s_m);
            return Err(width.error(path, message));
        }
        if driving.iter().any(|other| other.id == id) {
            return Err(node.error(path, format!("a lane before it has the number {id} already")));
        }
        driving.push(DrivingLane { id, width_m });
    }
    Ok(driving)
}

/// Returns a note on the lanes of a section that a scenario has no place for: lanes beside the
/// driving lanes of `side`, such as a shoulder, and oncoming lanes.
fn left_out(section: &Node, side: &str) -> Option<String> {
    let kinds = |side: &str| -> BTreeSet<String> {
        let lanes = section.child(side).into_iter().flat_map(|lanes| lanes.all("lane"));
        lanes.filter_map(|lane| lane.raw("type")).map(str::to_owned).collect()
    };
    let is_driving = |kind: &str| DRIVING.contains(&kind);
    let beside = kinds(side).into_iter().filter(|kind| !is_driving(kind) && kind != "none");
    let mut left_out: Vec<String> = beside.map(|kind| format!("`{kind}`")).collect();
    if kinds(if side == "left" { "right" } else { "left" }).iter().any(|kind| is_driving(kind)) {
        left_out.push("oncoming ones".to_owned());
    }
    (!left_out.is_empty()).then(|| format!("lanes that a scenario does not have: {}", left_out.join(", ")))
}

/// Returns the driving lane that the scenario uses. `along` holds the lanes of one side.
fn used_lane(
    path: &Path,
    along: &Node,
    driving: &[DrivingLane],
    used: &UsedRoad<'_>,
) -> Result<DrivingLane, ImportError> {
    let used_lane = match used {
        UsedRoad::Lane { lane, .. } => driving.iter().find(|other| other.id == *lane),
        UsedRoad::Only => driving.iter().find(|other| Road::LANE_WIDTH_M.contains(other.width_m)),
    };
    used_lane.copied().ok_or_else(|| match used {
        UsedRoad::Lane { road_id, lane, reader, position } => {
            let lanes: Vec<_> = driving.iter().map(|other| other.id.to_string()).collect();
            let named = if lanes.is_empty() { "none".to_owned() } else { lanes.join(", ") };
            let place = format!("on the {} of road {road_id} in {}", along.name, path.display());
            reader.error(position, format!("lane {lane} is not a driving lane {place}, only {named}"))
        }
        UsedRoad::Only => along.error(path, "none of its lanes is a driving lane with a width of 2.5 to 5 m"),
    })
}

/// Returns the numbers of lanes that have another number in another lane section.
fn numbering(lanes: &Node, side: &str) -> Option<Numbering> {
    let sections: Option<Vec<_>> = lanes.all("laneSection").map(|node| entry_lane::section(node, side)).collect();
    Numbering::read(&sections?)
}

/// Reads the road that a scenario uses.
///
/// # Errors
/// [`ImportError`] if the document is no OpenDRIVE, has a number that no road has, or has no such
/// road or no such lane.
pub(super) fn read(path: &Path, text: &str, used: &UsedRoad<'_>) -> Result<ImportedRoad, ImportError> {
    let root = parse(path, text)?;
    if root.name != "OpenDRIVE" {
        return Err(root.error(path, "the root element must be `OpenDRIVE`"));
    }
    let road = used_road(path, &root, used)?;
    let length_m = shape::check(path, road)?;
    let Some(lanes) = road.child("lanes") else { return Err(road.error(path, "it has no `lanes`")) };
    let Some(first) = lanes.child("laneSection") else { return Err(lanes.error(path, "it has no `laneSection`")) };
    let mut notes = surroundings(&root, road);
    // With left-hand traffic, the lanes along the road are those on the left.
    let is_left_hand = match road.raw("rule") {
        Some("LHT") => true,
        None | Some("RHT") => false,
        Some(other) => return Err(road.error(path, format!("`rule` is `{other}`; one of RHT, LHT is needed"))),
    };
    let side = if is_left_hand { "left" } else { "right" };
    let entry = entry_lane::find(lanes, side, length_m);
    let mut sections = LaneSections::read(path, lanes, side);
    // The place that gives the lanes: the start of a vehicle, or of a road with an acceleration
    // lane.
    let (section, s_m) = match (used, &entry) {
        (UsedRoad::Lane { reader, position, .. }, None) => {
            let s_m = reader.number(position, "s")?;
            (lanes.all("laneSection").nth(sections.at(s_m)).unwrap_or(first), s_m)
        }
        _ => (first, 0.0),
    };
    let place = Place { s_m, within_section_m: (s_m - start_m(section)).max(0.0) };
    let numbering = numbering(lanes, side).filter(|_| entry.is_none());
    let changing = changing_lanes::read(lanes, is_left_hand, length_m, (entry.as_ref(), numbering.as_ref()));
    let (changing, why_not) = match changing {
        Ok(changing) => (changing, String::new()),
        Err(reason) => (None, format!(" ({reason})")),
    };
    let numbering = numbering.filter(|_| changing.is_some());
    if let Some(numbering) = &numbering {
        sections.renumber(numbering);
        notes.push(
            "lanes that get another number: notes and messages number the lanes of all sections together".to_owned(),
        );
    }
    if let Some(changing) = &changing {
        let deviation_m = changing.deviation_m;
        if deviation_m > NOTED_DEVIATION_M {
            notes.push(format!("lanes whose width or place changes: lines follow them within {deviation_m:.3} m"));
        }
    }
    if sections.differ() && entry.is_none() && changing.is_none() {
        notes.push(format!("lanes that begin or end{why_not}: the lane section at {s_m} m gives the lanes"));
    }
    let along = section.child(side).ok_or_else(|| section.error(path, format!("it has no lanes on the {side}")))?;
    let mut driving = driving_lanes(path, along, place, used)?;
    // The acceleration lane may begin in a later section.
    let later_entry = entry.filter(|entry| driving.iter().all(|lane| lane.id != entry.id));
    let outermost = driving.iter().max_by_key(|lane| lane.id.abs()).copied();
    driving.extend(later_entry.map(|entry| DrivingLane { id: entry.id, width_m: entry.width_m }));
    driving.sort_by_key(|lane| std::cmp::Reverse(lane.id));
    let used_lane = used_lane(path, along, &driving, used)?;
    if !LANES.contains(&driving.len()) {
        let message = format!("it has {} driving lanes; a scenario has 1 to 8", driving.len());
        return Err(along.error(path, message));
    }
    notes.extend(left_out(section, side));
    if let Some(lane) = inner_lanes(along, &driving).find(|lane| lane.child("width").is_none())
        && let Some(border) = lane.child("border")
    {
        return Err(border.error(path, "the width of a lane is read from `width`, and it has none"));
    }
    let entry_id = entry.map(|entry| entry.id);
    let is_kept = changing.is_some();
    if !is_kept && widths_change(lanes.all("laneSection").filter_map(|section| section.child(side)), &driving, entry_id)
    {
        notes.push(format!("lanes whose width changes{why_not}: each has the width at {s_m} m"));
    }
    let widths_m: Vec<f64> = match is_kept {
        true => Vec::new(),
        false => driving.iter().map(|lane| lane.width_in_scenario_m(used_lane, s_m, &mut notes)).collect(),
    };
    if !is_kept && changes(lanes, "laneOffset") {
        notes.push(format!("a lane offset that changes{why_not}: the lanes have the offset at {s_m} m"));
    }
    let speed_limit_mps = speed_limits(path, road, &mut notes)?;
    let mut centres_m = centres_m(lanes, along, &driving, place);
    if let (Some(entry), Some(outermost)) = (later_entry, outermost) {
        let to_centre_m = 0.5 * (outermost.width_m + entry.width_m);
        match (is_left_hand, centres_m.first().copied(), centres_m.last().copied()) {
            (true, Some(first_m), _) => centres_m.insert(0, first_m + to_centre_m),
            (false, _, Some(last_m)) => centres_m.push(last_m - to_centre_m),
            _ => {}
        }
    }
    if !is_kept {
        note_gaps(&driving, &centres_m, &mut notes);
    }
    // The lane of the ego keeps its place, also if others are elsewhere in the file.
    let used_index = driving.iter().position(|lane| lane.id == used_lane.id).unwrap_or_default();
    let centre_m = centres_m.get(used_index).copied().unwrap_or_default();
    let left_edge_m = centre_m + widths_m.iter().take(used_index).sum::<f64>() + 0.5 * used_lane.width_m;
    let left_edge_m = changing.as_ref().map_or(left_edge_m, ChangingLanes::leftmost_m);
    let alignment_d_m = (-left_edge_m * 1e9).round() / 1e9 + 0.0;
    let (curvature_per_m, alignment) = curvature(path, road, alignment_d_m, &mut notes)?;
    let lanes: Vec<i32> = match &changing {
        Some(changing) => changing.ids.clone(),
        None => driving.iter().map(|lane| lane.id).collect(),
    };
    let line = reference_line(path, road, length_m, curvature_per_m, alignment.as_ref());
    Ok(ImportedRoad {
        id: road.raw("id").unwrap_or_default().to_owned(),
        is_left_hand,
        length_m,
        lanes,
        changing,
        centres_m,
        widths_m,
        curvature_per_m,
        alignment,
        alignment_d_m,
        sections,
        numbering,
        acceleration_lane: entry.map(|entry| entry.positions),
        line,
        speed_limit_mps,
        notes,
    })
}

/// Returns the notes on the network and the heights of a road, which a scenario does not have.
fn surroundings(root: &Node, road: &Node) -> Vec<String> {
    let mut notes = Vec::new();
    if let others @ 1.. = root.all("road").count().saturating_sub(1) {
        notes.push(format!("{} beside it in its file, and a scenario has one road", counted(others, "road")));
    }
    let has = |profile: &str, names: &[&str]| {
        let pieces = road.child(profile).into_iter().flat_map(|profile| &profile.children);
        pieces.into_iter().any(|piece| names.iter().any(|name| value(piece, name) != 0.0))
    };
    let heights = road.child("elevationProfile").into_iter().flat_map(|profile| profile.all("elevation"));
    let heights: Vec<f64> = heights.map(|piece| value(piece, "a")).collect();
    if has("elevationProfile", &["b", "c", "d"]) || heights.windows(2).any(|pair| pair[0] != pair[1]) {
        notes.push("a height that changes, and the road of a scenario is level".to_owned());
    }
    if has("lateralProfile", &["a", "b", "c", "d"]) {
        notes.push("a slope across it, and the road of a scenario is level".to_owned());
    }
    notes
}

/// Returns a number that `shape::check` has checked, or 0 if it is absent.
fn value(node: &Node, name: &str) -> f64 {
    node.raw(name).and_then(|text| text.trim().parse().ok()).unwrap_or(0.0)
}

/// Returns the position at which a lane section begins (m).
fn start_m(section: &Node) -> f64 {
    value(section, "s")
}

/// Returns the value at a place of the polynomials of a name (m). The attribute `start` says where
/// each of them begins.
fn polynomial_m(parent: &Node, name: &str, start: &str, at_m: f64) -> f64 {
    let pieces: Vec<&Node> = parent.all(name).collect();
    let last = pieces.iter().rev().find(|piece| value(piece, start) <= at_m).or(pieces.first());
    last.map_or(0.0, |piece| {
        let x = (at_m - value(piece, start)).max(0.0);
        let [a, b, c, d] = ["a", "b", "c", "d"].map(|name| value(piece, name));
        a + x * (b + x * (c + x * d))
    })
}

/// Returns the width of a lane at a distance from the start of its section (m).
fn width_m(lane: &Node, within_section_m: f64) -> f64 {
    polynomial_m(lane, "width", "sOffset", within_section_m).max(0.0)
}

/// Returns the centres of driving lanes to the left of the reference line (m), from the left.
/// `along` holds the lanes of one side.
fn centres_m(lanes: &Node, along: &Node, driving: &[DrivingLane], place: Place) -> Vec<f64> {
    #[expect(clippy::cast_possible_truncation, reason = "as the lanes that they are compared with")]
    let of_node =
        |node: &Node| DrivingLane { id: value(node, "id") as i32, width_m: width_m(node, place.within_section_m) };
    let mut all: Vec<DrivingLane> = along.all("lane").map(of_node).collect();
    // From the reference line outwards.
    all.sort_by_key(|lane| lane.id.unsigned_abs());
    let mut from_m = polynomial_m(lanes, "laneOffset", "s", place.s_m);
    let mut centres_m = Vec::new();
    // A shoulder may have the number that the acceleration lane has in a later section.
    let is_driving = |id: i32| {
        let kind = along.all("lane").find(|lane| value(lane, "id") == f64::from(id)).and_then(|lane| lane.raw("type"));
        kind.is_some_and(|kind| DRIVING.contains(&kind))
    };
    for lane in all {
        let to_m = from_m + lane.width_m * f64::from(lane.id.signum());
        if driving.iter().any(|other| other.id == lane.id) && is_driving(lane.id) {
            centres_m.push((lane.id, 0.5 * (from_m + to_m)));
        }
        from_m = to_m;
    }
    centres_m.sort_by_key(|(id, _)| std::cmp::Reverse(*id));
    centres_m.dedup_by_key(|(id, _)| *id);
    centres_m.into_iter().map(|(_, centre_m)| centre_m).collect()
}

/// Notes driving lanes that do not lie beside each other, as between a lane for another use.
fn note_gaps(driving: &[DrivingLane], centres_m: &[f64], notes: &mut Vec<String>) {
    for (lanes, centres_m) in driving.windows(2).zip(centres_m.windows(2)) {
        let gap_m = centres_m[0] - centres_m[1] - 0.5 * (lanes[0].width_m + lanes[1].width_m);
        if gap_m.abs() > MOST_GAP_M {
            let [left, right] = [lanes[0].id, lanes[1].id];
            notes.push(format!("{gap_m:.2} m between its lanes {left} and {right}: they lie beside each other here"));
        }
    }
}

/// Returns the reference line of a road of a length (m) in the plane, or `None` if it is not the
/// course of the imported road, or the file does not say where it begins.
fn reference_line(
    path: &Path,
    road: &Node,
    length_m: f64,
    curvature_per_m: f64,
    alignment: Option<&Alignment>,
) -> Option<ReferenceLine> {
    let geometries: Vec<&Node> = road.child("planView")?.all("geometry").collect();
    let first = geometries.first()?;
    let is_followed = match first.children.first()?.name.as_str() {
        _ if alignment.is_some() => true,
        "arc" => geometries.len() == 1 && curvature_per_m != 0.0,
        "line" => geometries.iter().all(|geometry| {
            let is_line = geometry.children.first().is_some_and(|shape| shape.name == "line");
            is_line && geometry.raw("hdg") == first.raw("hdg")
        }),
        _ => false,
    };
    let value = |name| number(path, first, name).ok();
    let straight = Road::straight(1);
    let course = match alignment {
        Some(line) => straight.with_alignment(line.clone()),
        None => straight.with_curvature(curvature_per_m),
    };
    let (x_m, y_m, heading_rad) = (value("x")?, value("y")?, value("hdg")?);
    is_followed.then_some(ReferenceLine { x_m, y_m, heading_rad, length_m, course })
}

/// Returns the curvature of a road of lines, or of one arc at the edge of the lanes; or the
/// alignment of a road with other pieces. The reference line lies `beside_m` to the left of the
/// lanes. If no alignment follows the road, returns the curvature of a straight road with a note.
fn curvature(
    path: &Path,
    road: &Node,
    beside_m: f64,
    notes: &mut Vec<String>,
) -> Result<(f64, Option<Alignment>), ImportError> {
    let plan = road.child("planView").ok_or_else(|| road.error(path, "it has no `planView`"))?;
    let shapes: Vec<&Node> = plan.all("geometry").filter_map(|geometry| geometry.children.first()).collect();
    if shapes.is_empty() {
        return Err(plan.error(path, "it has no geometry"));
    }
    if let [arc] = &shapes[..]
        && arc.name == "arc"
        && beside_m == 0.0
    {
        let curvature = number(path, arc, "curvature")?;
        if Road::CURVATURE_PER_M.contains(curvature) {
            return Ok((curvature, None));
        }
    }
    let is_polygon = shapes.len() > 1 && shapes.iter().all(|shape| shape.name == "line");
    if is_polygon && let Err(reason) = course::alignment(path, plan, notes)? {
        notes.push(format!("{reason}: the road is straight"));
    }
    if shapes.iter().any(|shape| shape.name != "line") {
        let [low_m, high_m] = [Road::ALIGNMENT_D_M.low(), Road::ALIGNMENT_D_M.high()];
        if !Road::ALIGNMENT_D_M.contains(beside_m) {
            let allowed = format!("{low_m} to {high_m} m are possible");
            notes.push(format!("a reference line {beside_m} m beside its lanes, and {allowed}: the road is straight"));
            return Ok((0.0, None));
        }
        match course::alignment(path, plan, notes)? {
            Ok(alignment) => return Ok((0.0, Some(alignment))),
            Err(reason) => notes.push(format!("{reason}: the road is straight")),
        }
    }
    Ok((0.0, None))
}

/// Returns the lanes from the reference line to the outermost driving lane: their widths say where the
/// driving lanes are.
fn inner_lanes<'a>(along: &'a Node, driving: &[DrivingLane]) -> impl Iterator<Item = &'a Node> {
    let outermost = driving.iter().map(|lane| lane.id.unsigned_abs()).max().unwrap_or_default();
    along.all("lane").filter(move |lane| value(lane, "id").abs() <= f64::from(outermost))
}

/// Returns whether a lane does not have the same width everywhere on one side of all sections. The
/// acceleration lane narrows to nothing, as in the scenario.
fn widths_change<'a>(
    sides: impl Iterator<Item = &'a Node>,
    driving: &[DrivingLane],
    acceleration_lane: Option<i32>,
) -> bool {
    let mut firsts: BTreeMap<&str, f64> = BTreeMap::new();
    let mut lanes = sides.flat_map(|along| inner_lanes(along, driving));
    lanes.any(|lane| {
        let id = lane.raw("id").unwrap_or_default().trim();
        let width_m = width_m(lane, 0.0);
        let is_other = *firsts.entry(id).or_insert(width_m) != width_m;
        acceleration_lane.is_none_or(|entry| value(lane, "id") != f64::from(entry))
            && (is_other || changes(lane, "width"))
    })
}

/// Returns whether the polynomials of a name do not have the same value everywhere.
fn changes(parent: &Node, name: &str) -> bool {
    let is_sloped = |piece: &Node| ["b", "c", "d"].iter().any(|name| value(piece, name).abs() > ROUNDED);
    let first = parent.child(name).map(|piece| value(piece, "a")).unwrap_or_default();
    parent.all(name).any(|piece| is_sloped(piece) || (value(piece, "a") - first).abs() > ROUNDED)
}

/// Returns the first speed limit of a road (m/s), with a note if it has others.
fn speed_limits(path: &Path, road: &Node, notes: &mut Vec<String>) -> Result<Option<f64>, ImportError> {
    let sections = road.all("lanes").flat_map(|lanes| lanes.all("laneSection"));
    let lanes = sections.flat_map(|section| &section.children).flat_map(|side| side.all("lane"));
    let driving = lanes.filter(|lane| lane.raw("type").is_some_and(|kind| DRIVING.contains(&kind)));
    let speeds = road.all("type").chain(driving).flat_map(|node| node.all("speed"));
    let limits_mps = speeds.map(|node| speed_limit(path, node)).collect::<Result<Vec<_>, _>>()?;
    if limits_mps.iter().any(|limit_mps| *limit_mps != limits_mps[0]) {
        let rule = "the scenario has the first one, and the vehicles have the speeds of the storyboard";
        notes.push(format!("speed limits that change from place to place: {rule}"));
    }
    Ok(limits_mps.first().copied().flatten())
}

/// Returns the speed limit (m/s), or `None` if there is none.
fn speed_limit(path: &Path, node: &Node) -> Result<Option<f64>, ImportError> {
    let factor = match node.raw("unit") {
        None | Some("m/s") => 1.0,
        Some("km/h") => 1.0 / 3.6,
        Some("mph") => 0.44704,
        Some(other) => {
            return Err(node.error(path, format!("`unit` is `{other}`; one of m/s, km/h, mph is needed")));
        }
    };
    if node.raw("max").is_none_or(|max| NO_LIMIT.contains(&max.trim())) {
        return Ok(None);
    }
    let limit = number(path, node, "max")?;
    let limit_mps = limit * factor;
    if !(0.0..=MOST_SPEED_LIMIT_MPS).contains(&limit_mps) {
        let unit = node.raw("unit").unwrap_or("m/s");
        let message = format!(
            "`max` is {limit} {unit}; 0 to {MOST_SPEED_LIMIT_MPS} m/s are needed, or `no limit` or `undefined`: the \
             standard has no number for a road without a limit"
        );
        return Err(node.error(path, message));
    }
    Ok(Some(limit_mps))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn road(rule: &str, side: &str, sign: &str) -> Result<ImportedRoad, String> {
        road_with([3.5, 3.5], rule, side, sign)
    }

    /// A road with two driving lanes of these widths beside a median.
    fn road_with(widths_m: [f64; 2], rule: &str, side: &str, sign: &str) -> Result<ImportedRoad, String> {
        let lane = |number: u32, kind: &str, width_m: f64| {
            format!("<lane id=\"{sign}{number}\" type=\"{kind}\"><width a=\"{width_m}\"/></lane>")
        };
        let lanes = [lane(1, "median", 2.0), lane(2, "driving", widths_m[0]), lane(3, "driving", widths_m[1])].concat();
        let text = format!(
            "<OpenDRIVE><road id=\"7\" length=\"900\" rule=\"{rule}\"><planView><geometry x=\"0\" y=\"0\" hdg=\"0\" \
             length=\"900\"><line/></geometry></planView><lanes><laneOffset a=\"1\"/><laneSection><{side}>{lanes}</{side}>\
             </laneSection></lanes></road></OpenDRIVE>"
        );
        read(Path::new("road.xodr"), &text, &UsedRoad::Only).map_err(|error| error.to_string())
    }

    #[test]
    fn the_words_of_the_standard_are_no_limit_and_a_negative_number_is_refused() {
        let limit = |attributes: &str| {
            let node = parse(Path::new("road.xodr"), &format!("<speed {attributes}/>")).unwrap();
            speed_limit(Path::new("road.xodr"), &node).map_err(|error| error.to_string())
        };
        for none in ["max=\"no limit\"", "max=\"undefined\" unit=\"km/h\"", "max=\" no limit \"", "unit=\"mph\""] {
            assert_eq!(limit(none), Ok(None), "{none}");
        }
        assert_eq!(limit("max=\"36\" unit=\"km/h\""), Ok(Some(10.0)));
        assert_eq!(limit("max=\"0\""), Ok(Some(0.0)));
        for (wrong, word) in [
            (
                "max=\"-1\"",
                "road.xodr:1: `speed`: `max` is -1 m/s; 0 to 100 m/s are needed, or `no limit` or `undefined`",
            ),
            ("max=\"-1\" unit=\"km/h\"", "`max` is -1 km/h; 0 to 100 m/s"),
            ("max=\"400\" unit=\"km/h\"", "`max` is 400 km/h"),
            ("max=\"No limit\"", "`max` is `No limit`"),
        ] {
            let message = limit(wrong).unwrap_err();
            assert!(message.contains(word), "{message}");
        }
    }

    #[test]
    fn each_lane_has_its_own_width_and_lies_beside_the_others() {
        let right = road_with([3.25, 4.0], "RHT", "right", "-").unwrap();
        assert_eq!(
            (&right.widths_m[..], &right.centres_m[..], right.notes.len()),
            (&[3.25, 4.0][..], &[-2.625, -6.25][..], 1)
        );
        assert_eq!([0, 1].map(|index| right.centre_m(index, 0.0)), [-1.625, -5.25]);
        assert_eq!(right.alignment_d_m, 1.0);
        // A place belongs to the lane between whose edges it lies, though another centre may be nearer.
        let near = [-0.9, -4.2, -4.3, -4.5, -99.0].map(|t_m| right.lane_near(0.0, t_m));
        assert_eq!(near, [Some(0), Some(0), Some(1), Some(1), Some(1)]);
        // With left-hand traffic, the lane with the greatest number is the leftmost.
        let left = road_with([3.25, 4.0], "LHT", "left", "").unwrap();
        assert_eq!((&left.lanes[..], &left.widths_m[..]), (&[3, 2][..], &[4.0, 3.25][..]));
        assert_eq!(left.alignment_d_m, -10.25);
    }

    #[test]
    fn a_width_that_no_lane_of_a_scenario_has_becomes_the_ego_s_with_a_note() {
        let wide = road_with([3.5, 6.0], "RHT", "right", "-").unwrap();
        assert_eq!(wide.widths_m, [3.5, 3.5]);
        let note = "lane -3 with a width of 6 m at 0 m, and a lane of a scenario has a width of 2.5 to 5 m: \
                    it has the 3.5 m of the ego's lane";
        assert_eq!(wide.notes, ["lanes that a scenario does not have: `median`", note]);
    }

    #[test]
    fn a_width_that_no_scenario_has_is_noted_wherever_it_moves_the_lanes() {
        let lane = |id: i32, kind: &str, widths: &str| format!("<lane id=\"{id}\" type=\"{kind}\">{widths}</lane>");
        let (narrow, wide) = ("<width a=\"3\"/>", "<width a=\"3.5\"/>");
        let widens = "<width a=\"3\"/><width sOffset=\"50\" a=\"3\" b=\"0.01\"/>";
        let imported = |sections: &[&[String]]| {
            let section = |(index, lanes): (usize, &&[String])| {
                format!("<laneSection s=\"{}\"><right>{}</right></laneSection>", 300 * index, lanes.concat())
            };
            let text = format!(
                "<OpenDRIVE><road id=\"7\" length=\"900\"><planView><geometry x=\"0\" y=\"0\" hdg=\"0\" length=\"900\">\
                 <line/></geometry></planView><lanes>{}</lanes></road></OpenDRIVE>",
                sections.iter().enumerate().map(section).collect::<String>()
            );
            read(Path::new("road.xodr"), &text, &UsedRoad::Only)
                .map(|road| road.notes)
                .map_err(|error| error.to_string())
        };
        let two = |second: &str| [lane(-1, "driving", narrow), lane(-2, "driving", second)];
        let note = |reason| Ok(vec![format!("lanes whose width changes ({reason}): each has the width at 0 m")]);
        assert_eq!(imported(&[&two(narrow), &two(narrow)]), Ok(vec![]));
        assert_eq!(imported(&[&two(narrow), &two(wide)]), note("a boundary jumps by 0.50 m at 300 m"));
        let too_wide = "lane -2 is up to 8.50 m wide, and 2.5 to 5 m are allowed";
        assert_eq!(imported(&[&two(narrow), &two(widens)]), note(too_wide));
        // What is beside the driving lanes moves none of them; what is between them and the reference line does.
        let beside = |at: i32, widths: &str| {
            let driving = if at == -1 { -2 } else { -1 };
            imported(&[&[lane(driving, "driving", narrow), lane(at, "none", widths)]])
        };
        assert_eq!(beside(-2, widens), Ok(vec![]));
        let steep = "<width a=\"3\"/><width sOffset=\"50\" a=\"3\" b=\"0.2\"/><width sOffset=\"60\" a=\"5\"/>";
        let too_steep = "a boundary moves sideways by 0.200 m in each metre at 50 m, and 0.15 m are allowed";
        assert_eq!(beside(-1, steep), note(too_steep));
        let border = beside(-1, "<border a=\"-2\"/>").unwrap_err();
        assert!(border.contains("`border`: the width of a lane is read from `width`, and it has none"), "{border}");
    }

    #[test]
    fn a_course_of_lines_that_turn_or_lie_apart_is_noted() {
        let notes = |second: &str| {
            let text = format!(
                "<OpenDRIVE><road id=\"7\" length=\"200\"><planView><geometry s=\"0\" x=\"0\" y=\"0\" hdg=\"0\" \
                 length=\"100\"><line/></geometry><geometry s=\"100\" {second} length=\"100\"><line/></geometry>\
                 </planView><lanes><laneSection s=\"0\"><right><lane id=\"-1\" type=\"driving\"><width a=\"3\"/></lane>\
                 </right></laneSection></lanes></road></OpenDRIVE>"
            );
            read(Path::new("road.xodr"), &text, &UsedRoad::Only).unwrap().notes
        };
        assert_eq!(notes("x=\"100\" y=\"0\" hdg=\"0\""), Vec::<String>::new());
        for second in ["x=\"100\" y=\"0\" hdg=\"0.3\"", "x=\"99\" y=\"5\" hdg=\"0\""] {
            let [note] = &notes(second)[..] else { panic!("{second}") };
            assert!(note.contains("deviate by") && note.ends_with("the road is straight"), "{note}");
        }
    }

    #[test]
    fn a_lane_for_another_use_between_driving_lanes_is_noted() {
        let lanes = [(-1, "driving"), (-2, "biking"), (-3, "driving")]
            .map(|(id, kind)| format!("<lane id=\"{id}\" type=\"{kind}\"><width a=\"3\"/></lane>"));
        let text = format!(
            "<OpenDRIVE><road id=\"7\" length=\"900\"><planView><geometry x=\"0\" y=\"0\" hdg=\"0\" length=\"900\">\
             <line/></geometry></planView><lanes><laneSection><right>{}</right></laneSection></lanes></road></OpenDRIVE>",
            lanes.concat()
        );
        let road = read(Path::new("road.xodr"), &text, &UsedRoad::Only).unwrap();
        assert_eq!(
            road.notes,
            [
                "lanes that a scenario does not have: `biking`",
                "3.00 m between its lanes -1 and -3: they lie beside each other here"
            ]
        );
    }

    #[test]
    fn the_lanes_of_each_rule_are_those_along_the_road_from_the_left() {
        let right = road("RHT", "right", "-").unwrap();
        assert_eq!(
            (right.is_left_hand, &right.lanes[..], &right.centres_m[..]),
            (false, &[-2, -3][..], &[-2.75, -6.25][..])
        );
        let left = road("LHT", "left", "").unwrap();
        assert_eq!((left.is_left_hand, &left.lanes[..], &left.centres_m[..]), (true, &[3, 2][..], &[8.25, 4.75][..]));
        assert!(road("RHT", "left", "").unwrap_err().contains("no lanes on the right"));
        assert!(road("LHT", "right", "-").unwrap_err().contains("no lanes on the left"));
    }
}
