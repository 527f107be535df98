//! The numbers of an OpenDRIVE road: the import uses a part of them, and checks all that describe
//! the course and the lanes of the road.
//!
//! A number that no road can have is an error of its file, also if a scenario of parallel lanes has
//! no use for it: the road would not be the one that the file means. Objects, signals, junctions
//! and the data of other programs are not read.

use std::collections::BTreeSet;
use std::path::Path;

use closecall_traffic::maths;

use super::dom::{ImportError, Node, number};
use super::entry_lane::DRIVING;

/// Largest curvature of a road (1/m): no car drives through less than 5 m of radius. An assumption;
/// 0.1 to 0.25 are plausible.
const MOST_CURVATURE_PER_M: f64 = 0.2;
/// Largest coordinate in the plane (m): the circumference of the earth, which no projection
/// exceeds.
const MOST_COORDINATE_M: f64 = 4.1e7;
/// Largest heading (rad): some programs add up the turns of a road. An assumption; 7 to 1000 are
/// plausible.
const MOST_HEADING_RAD: f64 = 100.0;
/// Heights of a road (m): below the Dead Sea, and above each pass. An assumption; -11,000 to 9000
/// are the heights of the earth's surface.
const HEIGHT_M: [f64; 2] = [-11_000.0, 9_000.0];
/// Steepest road (m/m): an assumption; the steepest streets have 0.35.
const MOST_SLOPE: f64 = 1.0;
/// Largest bank of a road (rad): an assumption; test tracks have up to 0.9.
const MOST_BANK_RAD: f64 = 1.0;
/// Largest width of a lane, and largest offset of the lanes (m): an assumption; 20 to 1000 are
/// plausible.
const MOST_ACROSS_M: f64 = 100.0;
/// Largest number of a lane: an assumption; 10 to 1000 are plausible.
const MOST_LANE: f64 = 1_000.0;
/// Share of a length, and length (m), by which the pieces of a road may miss each other: an
/// assumption; 1e-6 to 0.05, and 0.01 to 5, are plausible.
const APART: (f64, f64) = (0.01, 1.0);

/// The types of a lane of OpenDRIVE 1.4 to 1.8 (`e_laneType`).
const LANE_TYPES: [&str; 31] = [
    "HOV",
    "bidirectional",
    "biking",
    "border",
    "bus",
    "connectingRamp",
    "curb",
    "driving",
    "entry",
    "exit",
    "median",
    "mwyEntry",
    "mwyExit",
    "none",
    "offRamp",
    "onRamp",
    "parking",
    "rail",
    "restricted",
    "roadWorks",
    "shared",
    "shoulder",
    "sidewalk",
    "slipLane",
    "special1",
    "special2",
    "special3",
    "stop",
    "taxi",
    "tram",
    "walking",
];
/// The shapes of a piece of the reference line.
const SHAPES: [&str; 5] = ["line", "arc", "spiral", "poly3", "paramPoly3"];
/// The coefficients of a polynomial of third degree.
const CUBIC: [&str; 4] = ["a", "b", "c", "d"];
/// The coefficients of a curve, along the road and across.
const CURVE: [[&str; 4]; 2] = [["aU", "bU", "cU", "dU"], ["aV", "bV", "cV", "dV"]];

/// Checks the numbers of a road, and returns its length (m).
///
/// # Errors
/// [`ImportError`] at the first element whose number no road can have.
pub(super) fn check(path: &Path, road: &Node) -> Result<f64, ImportError> {
    let length_m = length(path, road)?;
    let checker = Checker { path, length_m };
    for node in &road.children {
        match node.name.as_str() {
            "type" => {
                checker.place(node, "s")?;
            }
            "planView" => checker.plan(node)?,
            "elevationProfile" => {
                let slopes = Some([-MOST_SLOPE, MOST_SLOPE]);
                checker.cubics(node, "elevation", ("s", length_m), &Limits { unit: "m", values: HEIGHT_M, slopes })?;
            }
            "lateralProfile" => {
                let values = [-MOST_BANK_RAD, MOST_BANK_RAD];
                for name in ["superelevation", "crossfall"] {
                    checker.cubics(node, name, ("s", length_m), &Limits { unit: "rad", values, slopes: None })?;
                }
                for shape in node.all("shape") {
                    checker.place(shape, "s")?;
                    for name in ["t", "a", "b", "c", "d"] {
                        checker.number_or_0(shape, name)?;
                    }
                }
            }
            "lanes" => checker.lanes(node)?,
            _ => {}
        }
    }
    Ok(length_m)
}

/// Returns the length of a road or of a piece of it (m).
fn length(path: &Path, node: &Node) -> Result<f64, ImportError> {
    match number(path, node, "length")? {
        length_m if length_m > 0.0 => Ok(length_m),
        length_m => Err(node.error(path, format!("`length` is {length_m}; a length above 0 m is needed"))),
    }
}

/// Returns the distance by which a piece with a length may miss its end (m).
fn tolerance_m(length_m: f64) -> f64 {
    APART.0 * length_m + APART.1
}

/// Returns the value and the slope of a polynomial.
fn polynomial([a, b, c, d]: [f64; 4], x: f64) -> (f64, f64) {
    (a + x * (b + x * (c + x * d)), b + x * (2.0 * c + x * 3.0 * d))
}

/// What a polynomial along the road can be.
struct Limits {
    unit: &'static str,
    values: [f64; 2],
    slopes: Option<[f64; 2]>,
}

struct Checker<'a> {
    path: &'a Path,
    /// Length of the road (m).
    length_m: f64,
}

impl Checker<'_> {
    fn number_or_0(&self, node: &Node, name: &str) -> Result<f64, ImportError> {
        if node.raw(name).is_some() { number(self.path, node, name) } else { Ok(0.0) }
    }

    /// Checks a number that may be absent.
    fn within(&self, node: &Node, name: &str, [low, high]: [f64; 2], unit: &str) -> Result<f64, ImportError> {
        let value = self.number_or_0(node, name)?;
        match node.raw(name).is_none() || (low..=high).contains(&value) {
            true => Ok(value),
            false => Err(node.error(self.path, format!("`{name}` is {value}; {low} to {high}{unit} are possible"))),
        }
    }

    /// Checks a place along the road.
    fn place(&self, node: &Node, name: &str) -> Result<f64, ImportError> {
        let value = self.number_or_0(node, name)?;
        match (0.0..=self.length_m + tolerance_m(self.length_m)).contains(&value) {
            true => Ok(value),
            false => {
                let message =
                    format!("`{name}` is {value}; 0 to {} m, the length of the road, are possible", self.length_m);
                Err(node.error(self.path, message))
            }
        }
    }

    /// Refuses an element that does not begin after the element before it.
    fn ascends(&self, (node, name): (&Node, &str), does_ascend: bool) -> Result<(), ImportError> {
        let stated = node.raw(name).unwrap_or("0");
        match does_ascend {
            true => Ok(()),
            false => Err(node.error(self.path, format!("`{name}` is {stated}, not after the element before it"))),
        }
    }

    /// Checks the pieces of the reference line, each alone and with the piece after it.
    fn plan(&self, plan: &Node) -> Result<(), ImportError> {
        let mut before: Option<(&Node, f64)> = None;
        for geometry in plan.all("geometry") {
            let length_m = length(self.path, geometry)?;
            let s_m = self.place(geometry, "s")?;
            for name in ["x", "y"] {
                self.within(geometry, name, [-MOST_COORDINATE_M, MOST_COORDINATE_M], " m")?;
            }
            self.within(geometry, "hdg", [-MOST_HEADING_RAD, MOST_HEADING_RAD], " rad")?;
            match geometry.children.first().filter(|shape| SHAPES.contains(&shape.name.as_str())) {
                Some(shape) => self.shape(shape, length_m)?,
                None => {
                    let message = format!("its first element must be its shape, one of {}", SHAPES.join(", "));
                    return Err(geometry.children.first().unwrap_or(geometry).error(self.path, message));
                }
            }
            if let Some((other, other_m)) = before {
                self.follows(other, other_m, geometry)?;
            }
            let end_m = s_m + length_m;
            if !(end_m <= self.length_m + tolerance_m(self.length_m)) {
                let message = format!("it ends at {end_m} m, and the `length` of the road is {} m", self.length_m);
                return Err(geometry.error(self.path, message));
            }
            before = Some((geometry, length_m));
        }
        match before {
            Some((last, length_m)) if last.raw("s").is_some() => {
                let end_m = number(self.path, last, "s")? + length_m;
                match end_m + tolerance_m(self.length_m) >= self.length_m {
                    true => Ok(()),
                    false => {
                        let message = format!(
                            "the last one ends at {end_m} m, and the `length` of the road is {} m",
                            self.length_m
                        );
                        Err(last.error(self.path, message))
                    }
                }
            }
            _ => Ok(()),
        }
    }

    /// Checks that a piece of the reference line begins where the piece before it, with its length
    /// (m), ends.
    fn follows(&self, before: &Node, before_m: f64, geometry: &Node) -> Result<(), ImportError> {
        let has = |name: &str| before.raw(name).is_some() && geometry.raw(name).is_some();
        let step = |name: &str| -> Result<f64, ImportError> {
            Ok(number(self.path, geometry, name)? - number(self.path, before, name)?)
        };
        if has("s") {
            let step_m = step("s")?;
            if !((step_m - before_m).abs() <= tolerance_m(before_m)) {
                let message =
                    format!("`s` is {step_m} m behind the one of the piece before, whose length is {before_m} m");
                return Err(geometry.error(self.path, message));
            }
        }
        if has("x") && has("y") {
            let chord_m = maths::hypot(step("x")?, step("y")?);
            if !(chord_m <= before_m + tolerance_m(before_m)) {
                let message = format!(
                    "`x` and `y` lie {chord_m} m from the start of the piece before, whose length is {before_m} m"
                );
                return Err(geometry.error(self.path, message));
            }
        }
        Ok(())
    }

    /// Checks the shape of a piece of the reference line.
    fn shape(&self, shape: &Node, length_m: f64) -> Result<(), ImportError> {
        for name in ["curvature", "curvStart", "curvEnd"] {
            if shape.raw(name).is_some() && !(number(self.path, shape, name)?.abs() <= MOST_CURVATURE_PER_M) {
                let message = format!("`{name}` is beyond {MOST_CURVATURE_PER_M} 1/m: no vehicle can follow it");
                return Err(shape.error(self.path, message));
            }
        }
        let (curve, (end, unit)) = match shape.name.as_str() {
            // A curve that turns by up to 60° reaches half its length along the start direction.
            "poly3" => ([[0.0, 1.0, 0.0, 0.0], self.coefficients(shape, CUBIC)?], (0.5 * length_m, " m")),
            "paramPoly3" => {
                let end = match shape.raw("pRange") {
                    Some("arcLength") => (length_m, " m"),
                    None | Some("normalized") => (1.0, ""),
                    Some(other) => {
                        let message = format!("`pRange` is `{other}`; one of arcLength, normalized is needed");
                        return Err(shape.error(self.path, message));
                    }
                };
                ([self.coefficients(shape, CURVE[0])?, self.coefficients(shape, CURVE[1])?], end)
            }
            _ => return Ok(()),
        };
        for x in [0.0, 0.5 * end, end] {
            let [(u_m, u_slope), (v_m, v_slope)] = curve.map(|coefficients| polynomial(coefficients, x));
            let [u_bend, v_bend] = curve.map(|[_, _, c, d]| 2.0 * c + 6.0 * d * x);
            if [u_m, v_m, u_slope, v_slope, u_bend, v_bend].iter().any(|value| !value.is_finite()) {
                let message = format!("its coefficients are too large for a number at p = {x}{unit}");
                return Err(shape.error(self.path, message));
            }
            let chord_m = maths::hypot(u_m, v_m);
            if !(chord_m <= length_m + tolerance_m(length_m)) {
                let message = format!("it leads {chord_m} m away from its start, and its length is {length_m} m");
                return Err(shape.error(self.path, message));
            }
            let speed = maths::hypot(u_slope, v_slope);
            let speed_cubed = speed * speed * speed;
            if !(speed_cubed > 0.0) {
                let message = format!(
                    "its derivatives of U and V are 0 at p = {x}{unit}: it has no direction there, and no curvature"
                );
                return Err(shape.error(self.path, message));
            }
            let curvature_per_m = (u_slope * v_bend - v_slope * u_bend) / speed_cubed;
            if !(curvature_per_m.abs() <= MOST_CURVATURE_PER_M) {
                let message = format!(
                    "it has a curvature of {curvature_per_m} 1/m: no vehicle can follow one beyond \
                     {MOST_CURVATURE_PER_M} 1/m"
                );
                return Err(shape.error(self.path, message));
            }
        }
        Ok(())
    }

    fn coefficients(&self, node: &Node, names: [&str; 4]) -> Result<[f64; 4], ImportError> {
        let [a, b, c, d] = names.map(|name| self.number_or_0(node, name));
        Ok([a?, b?, c?, d?])
    }

    /// Checks the polynomials of one kind: each at its start and where the next one begins. `from`
    /// is the attribute of its start, and the end of the last one (m).
    fn cubics(&self, parent: &Node, name: &str, from: (&str, f64), limits: &Limits) -> Result<(), ImportError> {
        let pieces: Vec<&Node> = parent.all(name).collect();
        let mut starts_m = Vec::with_capacity(pieces.len());
        for piece in &pieces {
            let start_m = self.place(piece, from.0)?;
            self.ascends((piece, from.0), starts_m.last().is_none_or(|last_m| *last_m <= start_m))?;
            starts_m.push(start_m);
        }
        for (index, piece) in pieces.iter().enumerate() {
            let coefficients = self.coefficients(piece, CUBIC)?;
            let end_m = starts_m.get(index + 1).copied().unwrap_or(from.1);
            for at_m in [0.0, (end_m - starts_m[index]).max(0.0)] {
                let (value, slope) = polynomial(coefficients, at_m);
                let ([low, high], unit) = (limits.values, limits.unit);
                if !(low - APART.0..=high).contains(&value) {
                    let place = if at_m == 0.0 { "`a` is".to_owned() } else { format!("after {at_m} m it is") };
                    let message = format!("{place} {value}; a {name} has {low} to {high} {unit}");
                    return Err(piece.error(self.path, message));
                }
                if let Some([low, high]) = limits.slopes
                    && !(low..=high).contains(&slope)
                {
                    let message = format!("after {at_m} m its slope is {slope}; {low} to {high} are possible");
                    return Err(piece.error(self.path, message));
                }
            }
        }
        Ok(())
    }

    fn lanes(&self, lanes: &Node) -> Result<(), ImportError> {
        let across = Limits { unit: "m", values: [-MOST_ACROSS_M, MOST_ACROSS_M], slopes: None };
        self.cubics(lanes, "laneOffset", ("s", self.length_m), &across)?;
        let sections: Vec<&Node> = lanes.all("laneSection").collect();
        let mut starts_m = Vec::with_capacity(sections.len());
        for section in &sections {
            if section.raw("singleSide") == Some("true") {
                let message = "`singleSide` is not read: a section needs the lanes of both sides";
                return Err(section.error(self.path, message));
            }
            let start_m = self.place(section, "s")?;
            self.ascends((section, "s"), starts_m.last().is_none_or(|last_m| *last_m < start_m))?;
            if starts_m.is_empty() && start_m > tolerance_m(0.0) {
                return Err(section.error(self.path, format!("`s` is {start_m}; the first one begins at 0")));
            }
            starts_m.push(start_m);
        }
        for (index, section) in sections.iter().enumerate() {
            let end_m = starts_m.get(index + 1).copied().unwrap_or(self.length_m);
            let length_m = (end_m - starts_m[index]).max(0.0);
            let beside =
                [index.checked_sub(1), Some(index + 1)].map(|other| other.and_then(|other| sections.get(other)));
            let mut ids = BTreeSet::new();
            for side in &section.children {
                for lane in side.all("lane") {
                    let id = self.lane(lane, length_m)?;
                    self.lane_id(lane, id, &side.name)?;
                    if !ids.insert(id) {
                        return Err(lane.error(self.path, format!("a lane before it has the number {id} already")));
                    }
                    for (name, section) in ["predecessor", "successor"].into_iter().zip(beside) {
                        self.link(lane, name, section.copied())?;
                    }
                }
            }
        }
        Ok(())
    }

    /// Checks that a lane lies on its side, and that its type is one of the standard.
    fn lane_id(&self, lane: &Node, id: i32, side: &str) -> Result<(), ImportError> {
        let (is_there, signs) = match side {
            "left" => (id > 0, "above 0"),
            "right" => (id < 0, "below 0"),
            "center" => (id == 0, "0"),
            _ => return Ok(()),
        };
        if !is_there {
            return Err(lane.error(self.path, format!("`id` is {id}; lanes on the `{side}` have numbers {signs}")));
        }
        match lane.raw("type") {
            Some(kind) if !LANE_TYPES.contains(&kind) => {
                let message = format!("`type` is `{kind}`; one of {} is needed", LANE_TYPES.join(", "));
                Err(lane.error(self.path, message))
            }
            _ => Ok(()),
        }
    }

    /// Checks the lane with which a lane goes on in the lane section beside its own, if there is one.
    fn link(&self, lane: &Node, name: &str, section: Option<&Node>) -> Result<(), ImportError> {
        for link in lane.all("link").flat_map(|link| link.all(name)) {
            let id = number(self.path, link, "id")?;
            if id.fract() != 0.0 || !(id.abs() <= MOST_LANE) {
                let message = format!("`id` is {id}; a whole number from {} to {MOST_LANE} is needed", -MOST_LANE);
                return Err(link.error(self.path, message));
            }
            let is_it = |other: &Node| number(self.path, other, "id").is_ok_and(|other| other == id);
            let has_lane = |section: &Node| section.children.iter().flat_map(|side| side.all("lane")).any(is_it);
            if section.is_some_and(|section| !has_lane(section)) {
                let message = format!("`id` is {id}, and the lane section beside it has no such lane");
                return Err(link.error(self.path, message));
            }
        }
        Ok(())
    }

    /// Checks a lane of a section with a length (m). Returns its number.
    fn lane(&self, lane: &Node, length_m: f64) -> Result<i32, ImportError> {
        let id = number(self.path, lane, "id")?;
        if id.fract() != 0.0 || !(id.abs() <= MOST_LANE) {
            let message = format!("`id` is {id}; a whole number from {} to {MOST_LANE} is needed", -MOST_LANE);
            return Err(lane.error(self.path, message));
        }
        // The lane 0 in the middle has none, whatever its type.
        let is_driving = id != 0.0 && lane.raw("type").is_some_and(|kind| DRIVING.contains(&kind));
        if is_driving && lane.child("width").is_none() && lane.child("border").is_none() {
            return Err(lane.error(self.path, "it has no `width`"));
        }
        let width = Limits { unit: "m", values: [0.0, MOST_ACROSS_M], slopes: None };
        self.cubics(lane, "width", ("sOffset", length_m), &width)?;
        let across = Limits { unit: "m", values: [-MOST_ACROSS_M, MOST_ACROSS_M], slopes: None };
        self.cubics(lane, "border", ("sOffset", length_m), &across)?;
        for name in ["roadMark", "speed", "height", "material", "access"] {
            for node in lane.all(name) {
                self.place(node, "sOffset")?;
            }
        }
        #[expect(clippy::cast_possible_truncation, reason = "a small whole number, as checked above")]
        Ok(id as i32)
    }
}

#[cfg(test)]
mod tests {
    use super::super::dom::parse;
    use super::*;

    const ROAD: &str = "<road length=\"200\">\n<type s=\"0\"/>\n<planView>\n\
        <geometry s=\"0\" x=\"5e6\" y=\"-20\" hdg=\"0\" length=\"100\"><paramPoly3 aU=\"0\" bU=\"1\" cU=\"0\" dU=\"0\" \
        aV=\"0\" bV=\"0\" cV=\"1e-4\" dV=\"0\" pRange=\"arcLength\"/></geometry>\n\
        <geometry s=\"100\" x=\"5000100\" y=\"-19\" hdg=\"0.02\" length=\"100\"><spiral curvStart=\"0\" \
        curvEnd=\"0.001\"/></geometry>\n</planView>\n<elevationProfile><elevation s=\"0\" a=\"12\" b=\"0.03\" c=\"0\" d=\"0\"/>\n\
        <elevation s=\"150\" a=\"16.5\" b=\"0\" c=\"1e-4\" d=\"0\"/></elevationProfile>\n\
        <lateralProfile><superelevation s=\"0\" a=\"0.04\" b=\"0\" c=\"0\" d=\"0\"/></lateralProfile>\n\
        <lanes><laneOffset s=\"0\" a=\"1\" b=\"0\" c=\"0\" d=\"0\"/>\n<laneSection s=\"0\"><center><lane id=\"0\" \
        type=\"driving\"/></center><right>\n<lane id=\"-1\">\
        <width sOffset=\"0\" a=\"3.5\" b=\"0.001\" c=\"0\" d=\"0\"/>\n<roadMark sOffset=\"0\"/></lane></right>\
        </laneSection></lanes>\n<objects><object s=\"abc\"/></objects></road>";

    fn checked(text: &str) -> Result<f64, String> {
        let path = Path::new("road.xodr");
        check(path, &parse(path, text).unwrap()).map_err(|error| error.to_string())
    }

    #[test]
    fn each_number_of_the_course_and_of_the_lanes_is_a_finite_number() {
        assert_eq!(checked(ROAD), Ok(200.0));
        let names = [
            "length",
            "s",
            "x",
            "y",
            "hdg",
            "aU",
            "bU",
            "cU",
            "dU",
            "aV",
            "bV",
            "cV",
            "dV",
            "curvStart",
            "curvEnd",
            "a",
            "b",
            "c",
            "d",
            "id",
            "sOffset",
        ];
        let mut count = 0;
        let end = ROAD.find("<objects>").unwrap();
        for name in names {
            let key = format!(" {name}=\"");
            for (at, _) in ROAD[..end].match_indices(&key) {
                let from = at + key.len();
                let to = from + ROAD[from..].find('"').unwrap();
                for wrong in ["abc", "nan", "inf", "", "1e999", "-1e9"] {
                    let text = [&ROAD[..from], wrong, &ROAD[to..]].concat();
                    let line = 1 + ROAD[..at].matches('\n').count();
                    let message = checked(&text).unwrap_err();
                    assert!(message.contains(&format!("road.xodr:{line}: `")), "{name} {wrong}: {message}");
                    assert!(wrong == "-1e9" || message.contains(&format!("`{name}`")), "{name}: {message}");
                    count += 1;
                }
            }
        }
        assert!(count >= 6 * 40, "{count}");
    }

    #[test]
    fn a_piece_that_no_road_can_have_is_refused_with_what_is_possible() {
        for (right, wrong, word) in [
            ("<road length=\"200\"", "<road length=\"1e9\"", "`geometry`: the last one ends at 200 m"),
            ("s=\"100\" x", "s=\"150\" x", "`s` is 150 m behind the one of the piece before"),
            ("x=\"5000100\"", "x=\"5000300\"", "from the start of the piece before, whose length is 100 m"),
            ("x=\"5e6\"", "x=\"5e9\"", "`x` is 5000000000; -41000000 to 41000000 m are possible"),
            ("cV=\"1e-4\"", "cV=\"0.09\"", "m away from its start, and its length is 100 m"),
            ("cV=\"1e-4\" dV=\"0\"", "cV=\"0.4\" dV=\"-0.004\"", "no vehicle can follow one beyond 0.2 1/m"),
            ("arcLength", "arc", "`pRange` is `arc`; one of arcLength, normalized"),
            (
                "bU=\"1\"",
                "bU=\"0\"",
                "road.xodr:4: `paramPoly3`: its derivatives of U and V are 0 at p = 0 m: it has no",
            ),
            (
                "bU=\"1\" cU=\"0\" dU=\"0\" aV=\"0\" bV=\"0\" cV=\"1e-4\" dV=\"0\" pRange=\"arcLength\"",
                "bU=\"100\" cU=\"-50\" dU=\"0\" aV=\"0\" bV=\"0\" cV=\"0\" dV=\"0\"",
                "are 0 at p = 1: it has no direction",
            ),
            ("cV=\"1e-4\" dV=\"0\"", "cV=\"1e308\" dV=\"-1e308\"", "too large for a number at p = 0 m"),
            ("b=\"0.03\"", "b=\"3\"", "its slope is 3; -1 to 1 are possible"),
            ("s=\"150\" a=", "s=\"300\" a=", "`s` is 300; 0 to 200 m, the length of the road"),
            ("a=\"0.04\"", "a=\"4\"", "`a` is 4; a superelevation has -1 to 1 rad"),
            ("b=\"0.001\"", "b=\"-0.1\"", "`width`: after 200 m it is -16.5; a width has 0 to 100 m"),
            ("<spiral", "<bezier", "`bezier`: its first element must be its shape, one of line, arc, spiral, poly3"),
            (
                "<spiral curvStart=\"0\" curvEnd=\"0.001\"/>",
                "",
                "`geometry`: its first element must be its shape, one of line, arc, spiral, poly3",
            ),
            (
                "s=\"150\" a=\"16.5\" b=\"0\" c=\"1e-4\" d=\"0\"/>",
                "s=\"150\"/><elevation s=\"140\"/>",
                "`s` is 140, not after",
            ),
            (
                "<laneSection s=\"0\">",
                "<laneSection s=\"0\"/><laneSection s=\"0\">",
                "`s` is 0, not after the element before it",
            ),
            (
                "<laneSection s=\"0\">",
                "<laneSection s=\"0\"/><laneSection s=\"90\"/><laneSection s=\"50\">",
                "`s` is 50, not after the element before it",
            ),
            ("<lane id=\"-1\">", "<lane id=\"1\">", "`id` is 1; lanes on the `right` have numbers below 0"),
            ("<lane id=\"-1\">", "<lane id=\"-1\"/><lane id=\"-1\">", "a lane before it has the number -1 already"),
            ("<lane id=\"-1\">", "<lane id=\"-1\" type=\"drivng\">", "`type` is `drivng`; one of HOV, bidirectional"),
            (
                "</laneSection>",
                "<left><lane id=\"1\" type=\"driving\"/></left></laneSection>",
                "`lane`: it has no `width`",
            ),
            ("<roadMark", "<link><successor id=\"x\"/></link><roadMark", "`successor`: `id` is `x`"),
            (
                "</lane></right></laneSection>",
                "<link><successor id=\"-2\"/></link></lane></right></laneSection><laneSection s=\"90\"><right>\
                 <lane id=\"-1\"/></right></laneSection>",
                "`successor`: `id` is -2, and the lane section beside it has no such lane",
            ),
            ("<laneSection s=\"0\">", "<laneSection s=\"0\" singleSide=\"true\">", "`singleSide` is not read"),
            ("<laneSection s=\"0\">", "<laneSection s=\"100\">", "`s` is 100; the first one begins at 0"),
            ("id=\"-1\"", "id=\"-1.5\"", "`id` is -1.5; a whole number from -1000 to 1000"),
        ] {
            assert!(ROAD.contains(right), "{right}");
            let message = checked(&ROAD.replacen(right, wrong, 1)).unwrap_err();
            assert!(message.contains(word), "{wrong}: {message}");
        }
    }
}
