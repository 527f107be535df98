//! A vehicle that follows a trajectory: a line through points that have times.
//!
//! ```text
//!  vertices: time, position ─▶ s, t on the road ─┬─▶ mean speeds between vertices ─▶ speeds at times
//!                                                └─▶ nearest lane of each ─▶ lane changes
//! ```
//!
//! A vehicle of a scenario keeps the centre of its lane, and changes lanes on a path of its own. A
//! lane change replaces a part of the trajectory. It takes the same time from 10 % to 90 % of the
//! way between the two centres.

use super::dom::{ImportError, Node};
use super::plane::RoadPoint;
use super::storyboard::{LaneChange, MOST_SPEED_MPS, STEP_S, Storyboard};

/// Share of the duration of a lane change that passes between 10 % and 90 % of the way, on the
/// quintic path 10 x³ − 15 x⁴ + 6 x⁵ of a scenario.
const MIDDLE_SHARE: f64 = 0.506_72;
/// Share of the way between two lanes at which a lane change is taken to have begun; its complement
/// is the end. An assumption; 0.05 to 0.2 are plausible.
const BEGUN: f64 = 0.1;
/// Largest distance along the road between a vehicle and the beginning of its trajectory (m): an
/// assumption; 0.1 to 2 are plausible.
const MOST_APART_M: f64 = 1.0;

/// Largest distance from the centre of the nearest lane (m): half the widest lane of a scenario
/// file.
const MOST_BESIDE_M: f64 = 2.5;
/// Speed at which a vehicle stands (m/s): numerical.
const STANDING_MPS: f64 = 1e-6;

/// A point of a trajectory.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Point {
    /// Time of the storyboard (s).
    at_s: f64,
    on_road: RoadPoint,
}

/// The speeds and lane changes of a vehicle on a trajectory.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Driven {
    /// Times (s) and speeds (m/s), linear in between.
    pub(super) speeds: Vec<(f64, f64)>,
    pub(super) lane_changes: Vec<LaneChange>,
}

/// A change to the next lane: indices in the list of lanes, and its time (s).
#[derive(Clone, Copy, Debug, PartialEq)]
struct Change {
    from: usize,
    to: usize,
    at_s: f64,
    duration_s: f64,
}

impl Storyboard<'_> {
    /// Returns the speeds and lane changes of a vehicle that follows a trajectory from now on.
    ///
    /// # Errors
    /// [`ImportError`] if the trajectory is not a line through points with times, does not begin at
    /// the vehicle, or leaves the lanes of the road.
    pub(super) fn trajectory(&self, node: &Node, vehicle: usize) -> Result<Driven, ImportError> {
        let reader = &self.reader;
        if reader.number_or(node, "initialDistanceOffset", 0.0)? != 0.0 {
            return Err(reader.error(node, "`initialDistanceOffset` must be 0: it is followed from its start"));
        }
        let Some(trajectory) = node.at(&["TrajectoryRef", "Trajectory"]).or_else(|| node.child("Trajectory")) else {
            return Err(reader.error(node, "it needs a `Trajectory`: one of a catalogue is not read"));
        };
        if matches!(trajectory.raw("closed"), Some("true" | "1")) {
            return Err(reader.error(trajectory, "`closed` must be `false`: a road has no loop"));
        }
        let line = reader.only(reader.child(trajectory, &["Shape"])?)?;
        if line.name != "Polyline" {
            return Err(reader.error(line, "it is not read: the shape of a trajectory must be a `Polyline`"));
        }
        let points = self.points(node, line)?;
        self.check_beginning(node, &points, vehicle)?;
        let lanes = &self.road.lanes;
        let mut lane_changes = Vec::new();
        let centre_m = |lane: usize, s_m: f64| self.road.file_centre_m(lane, s_m);
        let lane_near = |point: &RoadPoint| self.road.lane_near(point.s_m, point.t_m);
        let changes = changes(&points, centre_m, lane_near).map_err(|message| reader.error(line, message))?;
        for Change { from, to, at_s, duration_s } in changes {
            let (from, to, line, element) = (lanes[from], lanes[to], node.line, "FollowTrajectoryAction");
            lane_changes.push(LaneChange { vehicle, at_s, from, to, duration_s, line, element });
        }
        let speeds = speeds(&points, |at| self.road.path_scale(at.s_m, at.t_m))
            .map_err(|message| reader.error(line, message))?;
        Ok(Driven { speeds, lane_changes })
    }

    /// Returns the vertices of a line, in the order of the file.
    fn points(&self, node: &Node, line: &Node) -> Result<Vec<Point>, ImportError> {
        let reader = &self.reader;
        let reference = reader.child(node, &["TimeReference"])?;
        let timing = reader.only(reference)?;
        if timing.name != "Timing" {
            return Err(reader.error(reference, "it must hold `Timing`: a trajectory without times is not read"));
        }
        let begins_s = match reader.text(timing, "domainAbsoluteRelative")?.as_str() {
            "relative" => self.time_s,
            _ => 0.0,
        };
        let (scale, offset_s) = (reader.number(timing, "scale")?, reader.number(timing, "offset")?);
        let mut points: Vec<Point> = Vec::new();
        for vertex in line.all("Vertex") {
            let at_s = begins_s + offset_s + scale * reader.number(vertex, "time")?;
            if points.last().is_some_and(|last| !(at_s > last.at_s)) {
                return Err(reader.error(vertex, "`time` must grow from vertex to vertex"));
            }
            let position = reader.only(reader.child(vertex, &["Position"])?)?;
            let before_m = points.last().map(|last| last.on_road.s_m);
            points.push(Point { at_s, on_road: self.on_road(position, before_m)? });
        }
        match points.len() {
            0 | 1 => Err(reader.error(line, "it needs two vertices or more")),
            _ => Ok(points),
        }
    }

    /// Returns where a position lies on the road. `before_m` is the place of a position before it (m).
    ///
    /// # Errors
    /// [`ImportError`] for another kind of position, or if the road has no place in the plane.
    pub(super) fn on_road(&self, position: &Node, before_m: Option<f64>) -> Result<RoadPoint, ImportError> {
        let reader = &self.reader;
        match position.name.as_str() {
            "WorldPosition" => {
                let Some(line) = &self.road.line else {
                    let message = "a position in the plane needs a road whose course is imported, with its start";
                    return Err(reader.error(position, message));
                };
                Ok(line.road_point(reader.number(position, "x")?, reader.number(position, "y")?, before_m))
            }
            "LanePosition" => {
                let (s_m, lane) = self.on_lane(position)?;
                let Some(centre_m) = self.road.index(lane).map(|index| self.road.file_centre_m(index, s_m)) else {
                    let message = format!("lane {lane} is not a driving lane along the road");
                    return Err(reader.error(position, message));
                };
                Ok(RoadPoint { s_m, t_m: centre_m + reader.number_or(position, "offset", 0.0)? })
            }
            _ => Err(reader.error(position, "only `WorldPosition` and `LanePosition` are read here")),
        }
    }

    fn check_beginning(&self, node: &Node, points: &[Point], vehicle: usize) -> Result<(), ImportError> {
        let (Some(first), vehicle) = (points.first(), &self.vehicles[vehicle]) else { return Ok(()) };
        if (first.at_s - self.time_s).abs() > 1.5 * STEP_S {
            let (first_s, now_s) = (first.at_s, self.time_s);
            let message = format!("its trajectory begins at {first_s:.2} s, and its event at {now_s:.2} s");
            return Err(self.reader.error(node, message));
        }
        let lane = self.road.lane_near(first.on_road.s_m, first.on_road.t_m).map(|index| self.road.lanes[index]);
        if (first.on_road.s_m - vehicle.s_m).abs() > MOST_APART_M || lane != Some(vehicle.lane) {
            let message = format!(
                "its trajectory begins at s = {:.2} m, t = {:.2} m, and `{}` is at s = {:.2} m in lane {}",
                first.on_road.s_m, first.on_road.t_m, vehicle.name, vehicle.s_m, vehicle.lane
            );
            return Err(self.reader.error(node, message));
        }
        Ok(())
    }
}

/// Returns the speeds at the vertices and in the middle between them (m/s). In the middle it is the
/// mean speed from vertex to vertex, so that the vehicle passes each middle at its time. `scale` gives
/// the length of the path of a vehicle per metre of the reference line.
fn speeds(points: &[Point], scale: impl Fn(RoadPoint) -> f64) -> Result<Vec<(f64, f64)>, String> {
    let mut speeds: Vec<(f64, f64)> = Vec::new();
    let mut before: Option<(f64, f64)> = None;
    for pair in points.windows(2) {
        let duration_s = pair[1].at_s - pair[0].at_s;
        let [from, to] = [pair[0].on_road, pair[1].on_road];
        let middle = RoadPoint { s_m: 0.5 * (from.s_m + to.s_m), t_m: 0.5 * (from.t_m + to.t_m) };
        let mean_mps = scale(middle) * (to.s_m - from.s_m) / duration_s;
        // A vehicle that stands is written with rounding.
        if !(-STANDING_MPS..=MOST_SPEED_MPS).contains(&mean_mps) {
            return Err(format!("{mean_mps:.2} m/s from {:.2} s; 0 to {MOST_SPEED_MPS} m/s are needed", pair[0].at_s));
        }
        let mean_mps = mean_mps.max(0.0);
        let at_vertex_mps = before.map_or(mean_mps, |(other_s, other_mps)| {
            (other_mps * other_s + mean_mps * duration_s) / (other_s + duration_s)
        });
        speeds.push((pair[0].at_s, at_vertex_mps));
        speeds.push((pair[0].at_s + 0.5 * duration_s, mean_mps));
        before = Some((duration_s, mean_mps));
    }
    if let (Some(last), Some((_, mean_mps))) = (points.last(), before) {
        speeds.push((last.at_s, mean_mps));
    }
    Ok(speeds)
}

/// Returns the lane changes of a trajectory. `centre_m` gives the centre of a lane at a position along
/// the road (m), and `lane_near` the lane of a place.
fn changes(
    points: &[Point],
    centre_m: impl Fn(usize, f64) -> f64,
    lane_near: impl Fn(&RoadPoint) -> Option<usize>,
) -> Result<Vec<Change>, String> {
    let beside_m = |lane: usize, point: &Point| point.on_road.t_m - centre_m(lane, point.on_road.s_m);
    let lane_of = |point: &Point| {
        let lane = lane_near(&point.on_road);
        let lane = lane.filter(|lane| beside_m(*lane, point).abs() <= MOST_BESIDE_M);
        lane.ok_or_else(|| format!("at {:.2} s it leaves the lanes of the road", point.at_s))
    };
    let mut changes = Vec::new();
    let Some(first) = points.first() else { return Ok(changes) };
    let mut from = lane_of(first)?;
    let mut index = 1;
    while index < points.len() {
        let to = lane_of(&points[index])?;
        if to == from {
            index += 1;
            continue;
        }
        if to.abs_diff(from) > 1 {
            return Err(format!("at {:.2} s it passes more than one lane between two vertices", points[index].at_s));
        }
        let way_m = |s_m: f64| centre_m(to, s_m) - centre_m(from, s_m);
        let share = |point: &Point| beside_m(from, point) / way_m(point.on_road.s_m);
        let begin = (0..index).rev().find(|index| share(&points[*index]) <= BEGUN);
        let begun_s = begin.map_or(first.at_s, |begin| time_at(&points[begin..=begin + 1], share, BEGUN));
        let end = (index..points.len())
            .take_while(|index| share(&points[*index]) > BEGUN)
            .find(|index| share(&points[*index]) >= 1.0 - BEGUN);
        let Some(end) = end else {
            return Err(format!("the lane change at {:.2} s does not reach the next lane", points[index].at_s));
        };
        let ended_s = time_at(&points[end - 1..=end], share, 1.0 - BEGUN);
        let duration_s = (ended_s - begun_s) / MIDDLE_SHARE;
        let at_s = (0.5 * (begun_s + ended_s - duration_s)).max(first.at_s);
        changes.push(Change { from, to, at_s, duration_s });
        (from, index) = (to, end + 1);
    }
    Ok(changes)
}

/// Returns the time at which a share is reached between two points (s).
fn time_at(pair: &[Point], share: impl Fn(&Point) -> f64, reached: f64) -> f64 {
    let [before, after] = [0, pair.len() - 1].map(|index| &pair[index]);
    let (low, high) = (share(before), share(after));
    let part = if high > low { ((reached - low) / (high - low)).clamp(0.0, 1.0) } else { 1.0 };
    before.at_s + part * (after.at_s - before.at_s)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(at_s: f64, s_m: f64, t_m: f64) -> Point {
        Point { at_s, on_road: RoadPoint { s_m, t_m } }
    }

    #[test]
    fn the_speeds_pass_the_middle_of_each_piece_at_its_time() {
        let points = [(0.0, 0.0), (1.0, 30.0), (1.5, 42.0), (4.0, 92.0), (4.2, 96.0)].map(|(t, s)| point(t, s, -1.75));
        let speeds = speeds(&points, |_| 1.0).unwrap();
        let mut driven_m = 0.0;
        for (index, pair) in speeds.windows(2).enumerate() {
            driven_m += 0.5 * (pair[0].1 + pair[1].1) * (pair[1].0 - pair[0].0);
            if index % 2 == 0 {
                let (before, after) = (points[index / 2].on_road.s_m, points[index / 2 + 1].on_road.s_m);
                let error_m: f64 = driven_m - 0.5 * (before + after);
                assert!(error_m.abs() < 1e-9, "{index}: {error_m}");
            }
        }
        let of_two = |to_m: f64| super::speeds(&[point(0.0, 0.0, 0.0), point(1.0, to_m, 0.0)], |_| 1.0);
        assert!(of_two(-5.0).unwrap_err().contains("-5.00 m/s"));
        assert!(of_two(500.0).is_err());
        // On the inside of a bend of 500 m, 10 m beside the line, the path is shorter by 2 %.
        let inside = super::speeds(&[point(0.0, 0.0, 10.0), point(1.0, 30.0, 10.0)], |at| 1.0 - 0.002 * at.t_m);
        assert!((inside.unwrap()[0].1 - 29.4).abs() < 1e-9);
    }

    /// The lane changes among lanes of 3.5 m from the left on.
    fn changes(points: &[Point], lanes: u32) -> Result<Vec<Change>, String> {
        let centres_m: Vec<f64> = (0..lanes).map(|lane| -1.75 - 3.5 * f64::from(lane)).collect();
        let beside_m = |lane: usize, t_m: f64| (centres_m[lane] - t_m).abs();
        let near = |point: &RoadPoint| {
            (0..centres_m.len()).min_by(|a, b| beside_m(*a, point.t_m).total_cmp(&beside_m(*b, point.t_m)))
        };
        super::changes(points, |lane, _| centres_m[lane], near)
    }

    #[test]
    fn a_quintic_lane_change_is_found_with_its_time_and_duration() {
        let path = |x: f64| x * x * x * (10.0 + x * (6.0 * x - 15.0));
        let points: Vec<_> = (0..200)
            .map(|step| f64::from(step) * 0.1)
            .map(|t| point(t, 30.0 * t, -1.75 - 3.5 * path(((t - 4.0) / 6.0).clamp(0.0, 1.0))))
            .collect();
        let detected = changes(&points, 2).unwrap();
        let [change] = detected[..] else { panic!("{detected:?}") };
        assert_eq!((change.from, change.to), (0, 1));
        assert!((change.at_s - 4.0).abs() < 0.05 && (change.duration_s - 6.0).abs() < 0.05, "{change:?}");
        let broken_off: Vec<_> = points.iter().copied().take(75).collect();
        assert!(changes(&broken_off, 2).unwrap_err().contains("does not reach the next lane"));
        let jump = [point(0.0, 0.0, -1.75), point(1.0, 30.0, -8.75)];
        assert!(changes(&jump, 3).unwrap_err().contains("more than one lane"));
        let off_road = [point(0.0, 0.0, -1.75), point(1.0, 30.0, 4.0)];
        assert!(changes(&off_road, 2).unwrap_err().contains("leaves the lanes"));
    }
}
