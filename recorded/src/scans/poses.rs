//! The poses of the ego, and its place on a road.
//!
//! ```text
//!  time, x, y, yaw, speed ─▶ path of the ego ─▶ arc through its last 100 m ─▶ road, place on it
//!  s, d, heading, if a map gives them ─────────────────────────────────────▶
//! ```
//!
//! The chain looks back, so that the ego has driven the road that it needs. Without a map, the road
//! is the arc that has the mean curvature of the last 100 m of the ego's path, and the ego drives
//! along it in the middle of its lane.

use std::ops::RangeInclusive;
use std::path::Path;

use closecall_traffic::{Road, Time, VehicleState, maths};

use super::error::{Origin, ScanFileError, ScanFileProblem};
use super::text_table::{TableFormat, read_table};

/// Length of the path whose mean curvature the road has (m; assumption): the distance at which most
/// vehicles are first tracked.
const CURVATURE_OVER_M: f64 = 100.0;
/// Length of the path below which the road counts as straight (m).
const LEAST_PATH_M: f64 = 10.0;
/// Longest time between two poses (s): at 1 rad/s² a yaw rate errs by 0.1 rad/s within half of it.
const LONGEST_GAP: Time = Time::from_ms(500);
/// Time over which speeds and headings are compared with the path: the noise of two places is small
/// beside the way of a vehicle on a highway.
const CHORD: Time = Time::from_ms(1_000);
/// Least way in that time that is compared (m): the noise of the places of a vehicle that stands is
/// no path.
const LEAST_CHORD_M: f64 = 5.0;
/// Way from which on the speeds are compared with the path (m; assumption).
const LEAST_DRIVEN_M: f64 = 50.0;
/// Largest ratio of the ways by speeds and by places (assumption). Another unit differs by more:
/// knots by 1.9, miles per hour by 2.2.
const MOST_RATIO: f64 = 1.5;
/// Largest angle between heading and path in the median (rad; assumption). Angles of drift are
/// smaller, and other conventions differ by a quarter of a turn.
const MOST_BESIDE_RAD: f64 = 0.5;
/// Factor of the distance that the speeds allow from which on a vehicle jumps (assumption), as between the ways by
/// speeds and by places.
const JUMP_FACTOR: f64 = 2.0;
/// Distance beyond it (m; assumption): the noise of two places.
const JUMP_M: f64 = 5.0;
/// Yaw rate from which on the ego jumps to another heading (rad/s; assumption): some 1 rad/s at most in a bend of a
/// town.
const JUMP_RADPS: f64 = 3.0;
/// Change of the heading beyond it (rad; assumption): the noise of two headings.
const JUMP_RAD: f64 = 0.5;
/// Share of the poses up to which jumps are errors of single poses, rather than of a unit (assumption).
const FEW: f64 = 0.25;
/// Highest speed (m/s), as in the answer of a perception program.
const FASTEST_MPS: f64 = 150.0;
/// Positions along the road, as a scenario allows them (m).
const S_M: RangeInclusive<f64> = -10_000.0..=100_000.0;
/// Largest distance of the ego's centre beside the lanes (m; assumption): an ego that has left them drives on the
/// verge.
const BESIDE_M: f64 = 10.0;
/// A table of poses.
const FORMAT: TableFormat = TableFormat {
    columns: &["time_s", "x_m", "y_m", "yaw_rad", "speed_mps", "yaw_rate_radps", "s_m", "d_m", "heading_rad"],
    needed: 5,
    gives: "the poses of the ego",
};

/// The ego at one time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pose {
    /// Time.
    pub time: Time,
    /// Position in a frame that does not move, x and y, counter-clockwise seen from above (m).
    pub at_m: [f64; 2],
    /// Heading, counter-clockwise from x (rad).
    pub yaw_rad: f64,
    /// Speed (m/s).
    pub speed_mps: f64,
    /// Yaw rate, positive to the left (rad/s); `None` if it follows from the headings.
    pub yaw_rate_radps: Option<f64>,
    /// Position s and d on the road (m), and heading relative to it (rad), if a map gives them.
    pub on_road: Option<[f64; 3]>,
}

/// Two poses of the ego, and the share of the way from one to the other.
#[derive(Clone, Copy)]
struct Between {
    before: usize,
    after: usize,
    share: f64,
}

impl Between {
    /// Returns a value between two poses.
    fn mixed(self, of: &dyn Fn(usize) -> f64) -> f64 {
        let Self { before, after, share } = self;
        if share == 0.0 { of(before) } else { of(before) + share * (of(after) - of(before)) }
    }
}

/// A vehicle whose motion is compared with its path, in the words of messages.
#[derive(Clone, Copy)]
pub(super) struct Mover<'a> {
    pub(super) name: &'a str,
    /// What is needed of speeds and places, and of headings.
    pub(super) needed: [&'a str; 2],
    /// Whether its heading cannot jump, as the heading of a box that somebody has labelled can.
    pub(super) turns: bool,
}

const EGO: Mover<'_> = Mover {
    name: "the ego",
    needed: ["m/s and m are needed", "they are in rad, counter-clockwise from x to y"],
    turns: true,
};
/// The ego in its places on the road.
const ON_ROAD: Mover<'_> = Mover {
    name: "the ego",
    needed: ["`s_m` and `d_m` are in m along and across the road", "`heading_rad` is in rad relative to the road"],
    turns: true,
};

/// The poses of the ego, in order of time.
#[derive(Clone, Debug)]
pub struct Poses {
    origin: Origin,
    poses: Vec<Pose>,
    /// Headings without jumps of a turn (rad).
    yaw_rad: Vec<f64>,
    /// Length of the path up to each pose (m).
    driven_m: Vec<f64>,
}

impl Poses {
    /// Reads a table of poses.
    ///
    /// # Errors
    /// [`ScanFileError`] with the line and the column that is wrong.
    pub fn read(path: &Path) -> Result<Self, ScanFileError> {
        let rows = read_table(path, FORMAT)?;
        let mut poses: Vec<Pose> = Vec::with_capacity(rows.len());
        for row in &rows {
            let number = |column: usize| row.number(column);
            let on_road = [row.number_or_none(6)?, row.number_or_none(7)?, row.number_or_none(8)?];
            let pose = Pose {
                time: row.time(0)?,
                at_m: [number(1)?, number(2)?],
                yaw_rad: number(3)?,
                speed_mps: number(4)?,
                yaw_rate_radps: row.number_or_none(5)?,
                on_road: match on_road {
                    [Some(s_m), Some(d_m), Some(heading_rad)] => Some([s_m, d_m, heading_rad]),
                    [None, None, None] => None,
                    _ => {
                        let missing = 6 + on_road.iter().position(Option::is_none).unwrap_or_default();
                        let problem = "`s_m`, `d_m` and `heading_rad` belong together, and one of them is empty";
                        return Err(row.place(missing).error(ScanFileProblem::Csv(problem.to_owned())));
                    }
                },
            };
            if let Some((column, value, allowed)) = pose.out_of_range() {
                return Err(row.place(column).error(ScanFileProblem::OutOfRange { value, allowed }));
            }
            if let Some(previous) = poses.last().filter(|previous| previous.time >= pose.time) {
                return Err(row.place(0).error(goes_back(pose.time, previous.time)));
            }
            poses.push(pose);
        }
        Self::from_ordered(Origin::file(path), poses, |pose, column| rows[pose].place(column))
    }

    /// Returns the poses of a recording.
    ///
    /// # Errors
    /// [`ScanFileError`] if there are none, if a time is not after the previous one, or if speeds or
    /// headings contradict the path.
    pub(super) fn new(origin: Origin, poses: Vec<Pose>) -> Result<Self, ScanFileError> {
        if poses.is_empty() {
            return Err(origin.error(ScanFileProblem::NoRows));
        }
        if let Some(pair) = poses.windows(2).find(|pair| pair[0].time >= pair[1].time) {
            return Err(origin.error(goes_back(pair[1].time, pair[0].time)));
        }
        let of_message = |pose: usize, column: usize| {
            let message = format!("{}, message {pose}, `{}`", origin.place, FORMAT.columns[column]);
            origin.at(message.trim_start_matches(", "))
        };
        if let Some((pose, (column, value, allowed))) =
            poses.iter().enumerate().find_map(|(index, pose)| Some((index, pose.out_of_range()?)))
        {
            return Err(of_message(pose, column).error(ScanFileProblem::OutOfRange { value, allowed }));
        }
        Self::from_ordered(origin.clone(), poses, of_message)
    }

    /// `place` says where a column of a pose stands.
    fn from_ordered(
        origin: Origin,
        poses: Vec<Pose>,
        place: impl Fn(usize, usize) -> Origin,
    ) -> Result<Self, ScanFileError> {
        let of_motion = |columns: [usize; 3]| {
            let (origin, place) = (&origin, &place);
            move |wrong: WrongMotion| match wrong {
                WrongMotion::All(problem) => origin.error(problem),
                WrongMotion::Jump { pose, quantity, problem } => place(pose, columns[quantity]).error(problem),
            }
        };
        check_motion(EGO, &poses).map_err(of_motion([1, 2, 3]))?;
        let on_road = |pose: &Pose| {
            let [s_m, d_m, heading_rad] = pose.on_road?;
            Some(Pose { at_m: [s_m, d_m], yaw_rad: heading_rad, ..*pose })
        };
        if let Some(on_road) = poses.iter().map(on_road).collect::<Option<Vec<Pose>>>() {
            check_motion(ON_ROAD, &on_road).map_err(of_motion([6, 7, 8]))?;
        }
        let (mut yaw_rad, mut driven_m) = (Vec::with_capacity(poses.len()), Vec::with_capacity(poses.len()));
        for (index, pose) in poses.iter().enumerate() {
            match index.checked_sub(1) {
                None => {
                    yaw_rad.push(pose.yaw_rad);
                    driven_m.push(0.0);
                }
                Some(before) => {
                    let turn = std::f64::consts::TAU;
                    let turned = pose.yaw_rad - poses[before].yaw_rad;
                    yaw_rad.push(yaw_rad[before] + turned - turn * (turned / turn).round());
                    let [x_m, y_m] = [0, 1].map(|axis| pose.at_m[axis] - poses[before].at_m[axis]);
                    driven_m.push(driven_m[before] + maths::hypot(x_m, y_m));
                }
            }
        }
        Ok(Self { origin, poses, yaw_rad, driven_m })
    }

    /// Refuses poses that are not on this road, if they state their place on a road.
    ///
    /// # Errors
    /// [`ScanFileError`] with the first such pose.
    pub fn check_on(&self, road: &Road) -> Result<(), ScanFileError> {
        let [right_m, left_m] = [road.right_edge_m() - BESIDE_M, BESIDE_M];
        let beside = |pose: &&Pose| pose.on_road.is_some_and(|[_, d_m, _]| !(right_m..=left_m).contains(&d_m));
        match self.poses.iter().find(beside) {
            Some(Pose { time, on_road: Some([_, d_m, _]), .. }) => Err(self
                .origin
                .error(ScanFileProblem::BesideRoad { time_s: time.s(), d_m: *d_m, allowed_m: [right_m, left_m] })),
            _ => Ok(()),
        }
    }

    /// Returns the time of the last pose.
    pub fn last(&self) -> Time {
        self.poses.last().map_or(Time::ZERO, |pose| pose.time)
    }

    /// Returns whether the place on the road is recorded, rather than derived from the path.
    pub fn has_map(&self) -> bool {
        self.poses.iter().all(|pose| pose.on_road.is_some())
    }

    /// Returns the road and the state of the ego at `time`. Where the recording does not state its
    /// place on the road, the ego drives at the lateral position `d_m` of a road like `road`.
    ///
    /// # Errors
    /// [`ScanFileError`] if there is no pose at this time.
    pub fn place_at(&self, time: Time, road: &Road, d_m: f64) -> Result<(Road, VehicleState), ScanFileError> {
        let Some(between) = self.between(time) else {
            let [first_s, last_s] = [self.poses[0].time.s(), self.last().s()];
            return Err(self.origin.error(ScanFileProblem::NoPose { time_s: time.s(), first_s, last_s }));
        };
        let Between { before, after, .. } = between;
        let mixed = |of: &dyn Fn(usize) -> f64| between.mixed(of);
        let yaw_rate_radps = match self.poses[before].yaw_rate_radps {
            Some(_) => mixed(&|index| self.poses[index].yaw_rate_radps.unwrap_or_default()),
            None => self.yaw_rate_radps(before),
        };
        let state = VehicleState {
            speed_mps: mixed(&|index| self.poses[index].speed_mps),
            yaw_rate_radps,
            ..VehicleState::default()
        };
        let of_road = |axis: usize| move |index: usize| self.poses[index].on_road.unwrap_or_default()[axis];
        if self.poses[before].on_road.is_some() && self.poses[after].on_road.is_some() {
            let [s_m, d_m, heading_rad] = [0, 1, 2].map(|axis| mixed(&of_road(axis)));
            return Ok((road.clone(), VehicleState { s_m, d_m, heading_rad, ..state }));
        }
        let path_per_m = self.curvature_per_m(before);
        // The curvature of a road is the curvature of its left edge, where d is 0.
        let road = road.with_curvature(path_per_m / (1.0 + path_per_m * d_m));
        // A metre of the left edge is longer or shorter than a metre of the ego's path.
        let s_m = mixed(&|index| self.driven_m[index]) / road.path_scale(0.0, d_m);
        Ok((road, VehicleState { s_m, d_m, ..state }))
    }

    /// Returns the poses between which a time lies; `None` if there is no pose near enough.
    fn between(&self, time: Time) -> Option<Between> {
        let after = self.poses.partition_point(|pose| pose.time < time);
        if self.poses.get(after)?.time == time {
            return Some(Between { before: after, after, share: 0.0 });
        }
        let before = after.checked_sub(1)?;
        let gap = self.poses[after].time - self.poses[before].time;
        let share = (time - self.poses[before].time).s() / gap.s();
        (gap <= LONGEST_GAP).then_some(Between { before, after, share })
    }

    /// Returns the place of a point of the ego's frame in the frame that does not move (m), and the
    /// heading of the ego there (rad). `None` at a time without a pose.
    pub(super) fn unmoved(&self, time: Time, [x_m, y_m]: [f64; 2]) -> Option<([f64; 2], f64)> {
        let between = self.between(time)?;
        let [ego_x_m, ego_y_m] = [0, 1].map(|axis| between.mixed(&|index| self.poses[index].at_m[axis]));
        let yaw_rad = between.mixed(&|index| self.yaw_rad[index]);
        let (sin, cos) = maths::sin_cos(yaw_rad);
        Some(([ego_x_m + cos * x_m - sin * y_m, ego_y_m + sin * x_m + cos * y_m], yaw_rad))
    }

    /// Returns the mean curvature of the path before a pose (1/m).
    fn curvature_per_m(&self, last: usize) -> f64 {
        let driven_m = &self.driven_m[..=last];
        let first = driven_m.partition_point(|at_m| driven_m[last] - at_m > CURVATURE_OVER_M);
        let length_m = driven_m[last] - driven_m[first];
        if length_m < LEAST_PATH_M { 0.0 } else { (self.yaw_rad[last] - self.yaw_rad[first]) / length_m }
    }

    /// Returns the yaw rate between a pose and the next one (rad/s).
    fn yaw_rate_radps(&self, before: usize) -> f64 {
        let before = before.min(self.poses.len().saturating_sub(2));
        let elapsed_s = self.poses.get(before + 1).map_or(0.0, |next| (next.time - self.poses[before].time).s());
        if elapsed_s > 0.0 { (self.yaw_rad[before + 1] - self.yaw_rad[before]) / elapsed_s } else { 0.0 }
    }
}

impl Pose {
    /// Returns the column of a value that no vehicle has, the value, and what is allowed.
    fn out_of_range(&self) -> Option<(usize, f64, &'static str)> {
        let right_rad = std::f64::consts::FRAC_PI_2;
        if !(0.0..=FASTEST_MPS).contains(&self.speed_mps) {
            return Some((4, self.speed_mps, "a speed from 0 to 150 m/s"));
        }
        match self.on_road {
            Some([s_m, ..]) if !S_M.contains(&s_m) => Some((6, s_m, "a position from -10,000 to 100,000 m")),
            Some([.., heading_rad]) if !(-right_rad..=right_rad).contains(&heading_rad) => {
                Some((8, heading_rad, "an angle from -π/2 to π/2 rad"))
            }
            _ => None,
        }
    }
}

/// A contradiction in the motion of a vehicle.
pub(super) enum WrongMotion {
    /// In all of it: a unit or a frame is another.
    All(ScanFileProblem),
    /// From one pose to the next.
    Jump {
        /// The number of the later pose.
        pose: usize,
        /// The quantity that jumps: x, y or the heading.
        quantity: usize,
        /// The problem.
        problem: ScanFileProblem,
    },
}

/// Refuses speeds and headings that contradict the path, because their unit or their frame is another, and poses to
/// which the vehicle jumps.
pub(super) fn check_motion(mover: Mover<'_>, poses: &[Pose]) -> Result<(), WrongMotion> {
    let mut jumps = (1..poses.len()).filter_map(|pose| jump(mover, poses, pose));
    let first = jumps.next();
    let number = usize::from(first.is_some()) + jumps.count();
    let all = check_units(mover, poses).map_err(WrongMotion::All);
    match first {
        Some(first) if all.is_ok() || number as f64 <= FEW * poses.len() as f64 => Err(first),
        _ => all,
    }
}

/// Returns the jump from the previous pose to this one.
fn jump(mover: Mover<'_>, poses: &[Pose], pose: usize) -> Option<WrongMotion> {
    let [before, after] = [poses[pose - 1], poses[pose]];
    let elapsed_s = (after.time - before.time).s();
    let moved_m = [0, 1].map(|axis| after.at_m[axis] - before.at_m[axis]);
    let distance_m = maths::hypot(moved_m[0], moved_m[1]);
    let allowed_m = JUMP_FACTOR * before.speed_mps.abs().max(after.speed_mps.abs()) * elapsed_s + JUMP_M;
    let name = mover.name;
    if !(distance_m <= allowed_m) {
        let text = format!(
            "{name} moves {distance_m:.1} m in {elapsed_s:.3} s, but its speeds allow {allowed_m:.1} m at most, with {JUMP_M} m of noise"
        );
        let quantity = usize::from(moved_m[1].abs() > moved_m[0].abs());
        return Some(WrongMotion::Jump { pose, quantity, problem: ScanFileProblem::Motion(text) });
    }
    let turn = std::f64::consts::TAU;
    let turned_rad = after.yaw_rad - before.yaw_rad;
    let turned_rad = (turned_rad - turn * (turned_rad / turn).round()).abs();
    let allowed_rad = JUMP_RADPS * elapsed_s + JUMP_RAD;
    (mover.turns && !(turned_rad <= allowed_rad)).then(|| {
        let text =
            format!("{name} turns by {turned_rad:.1} rad in {elapsed_s:.3} s, but {allowed_rad:.1} rad is allowed");
        WrongMotion::Jump { pose, quantity: 2, problem: ScanFileProblem::Motion(text) }
    })
}

fn check_units(mover: Mover<'_>, poses: &[Pose]) -> Result<(), ScanFileProblem> {
    let Mover { name, needed, .. } = mover;
    let (mut path_m, mut by_speed_m, mut beside_rad, mut first) = (0.0_f64, 0.0_f64, Vec::new(), 0);
    for (last, pose) in poses.iter().enumerate() {
        let elapsed = pose.time - poses[first].time;
        if elapsed < CHORD {
            continue;
        }
        let [x_m, y_m] = [0, 1].map(|axis| pose.at_m[axis] - poses[first].at_m[axis]);
        let chord_m = maths::hypot(x_m, y_m);
        let speeds_mps = poses[first..=last].iter().map(|pose| pose.speed_mps);
        let driven_m = elapsed.s() * speeds_mps.sum::<f64>() / (last - first + 1) as f64;
        if chord_m.max(driven_m) >= LEAST_CHORD_M {
            path_m += chord_m;
            by_speed_m += driven_m;
        }
        if chord_m >= LEAST_CHORD_M {
            let off_rad = poses[first.midpoint(last)].yaw_rad - maths::atan2(y_m, x_m);
            let turn_rad = std::f64::consts::TAU;
            beside_rad.push((off_rad - turn_rad * (off_rad / turn_rad).round()).abs());
        }
        first = last;
    }
    let [less_m, more_m] = [path_m.min(by_speed_m), path_m.max(by_speed_m)];
    if more_m >= LEAST_DRIVEN_M && more_m > MOST_RATIO * less_m {
        return Err(ScanFileProblem::Motion(format!(
            "{name} drives {by_speed_m:.0} m by its speeds, and {path_m:.0} m by its places: {}",
            needed[0]
        )));
    }
    beside_rad.sort_by(f64::total_cmp);
    match beside_rad.get(beside_rad.len() / 2) {
        Some(off_rad) if *off_rad > MOST_BESIDE_RAD => Err(ScanFileProblem::Motion(format!(
            "half of the headings differ by {off_rad:.1} rad or more from the direction in which {name} drives: {}",
            needed[1]
        ))),
        _ => Ok(()),
    }
}

fn goes_back(time: Time, previous: Time) -> ScanFileProblem {
    ScanFileProblem::TimeGoesBack { time_s: time.s(), previous_s: previous.s(), of: String::new() }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An ego that drives 30 m/s along a bend to the left with a radius of 1 km.
    fn bend() -> Poses {
        let pose = |step: i64| {
            let time = Time::from_ms(100 * step);
            let yaw_rad = 3.0 + 0.03 * time.s();
            let (sin, cos) = maths::sin_cos(yaw_rad);
            Pose { time, at_m: [1_000.0 * sin, -1_000.0 * cos], yaw_rad, speed_mps: 30.0, ..Pose::default() }
        };
        Poses::new(Origin::file("bend"), (0..100).map(pose).collect()).unwrap()
    }

    #[test]
    fn the_road_of_an_ego_without_a_map_is_the_arc_that_it_has_driven() {
        let (road, ego) = bend().place_at(Time::from_ms(5_050), &Road::straight(3), -5.625).unwrap();
        // The left edge of the road is 5.6 m nearer to the centre of the bend.
        assert!(
            (1.0 / road.curvature_at_per_m(0.0) - (1_000.0 - 5.625)).abs() < 0.1,
            "{}",
            road.curvature_at_per_m(0.0)
        );
        assert_eq!((ego.heading_rad, ego.d_m, ego.speed_mps), (0.0, -5.625, 30.0));
        assert!((ego.yaw_rate_radps - 0.03).abs() < 1e-9);
        let (_, later) = bend().place_at(Time::from_ms(6_050), &Road::straight(3), -5.625).unwrap();
        let driven_m = (later.s_m - ego.s_m) * (1.0 + 5.625 * road.curvature_at_per_m(0.0));
        assert!((driven_m - 30.0).abs() < 0.01, "{driven_m}");
    }

    #[test]
    fn a_time_without_poses_and_times_that_go_back_are_refused() {
        let error = bend().place_at(Time::from_s(20.0), &Road::straight(3), -5.6).unwrap_err().to_string();
        assert!(error.contains("no pose at 20 s") && error.contains("from 0 to 9.9 s"), "{error}");
        let twice = vec![Pose::default(); 2];
        let error = Poses::new(Origin::file("odometry"), twice).unwrap_err().to_string();
        assert!(error.contains("odometry") && error.contains("times must increase"), "{error}");
    }

    #[test]
    fn speeds_and_headings_of_another_unit_or_frame_are_refused() {
        let error_of = |change: &dyn Fn(&mut Pose)| {
            let mut poses = bend().poses;
            poses.iter_mut().for_each(change);
            Poses::new(Origin::file("bend"), poses).err().map(|error| error.to_string()).unwrap_or_default()
        };
        for factor in [0.0, 3.6, 1.944, 2.237] {
            let error = error_of(&|pose| pose.speed_mps *= factor);
            assert!(error.contains("270 m by its places: m/s and m are needed"), "{factor}: {error}");
        }
        assert!(error_of(&|pose| pose.at_m = [0.0; 2]).contains("0 m by its places"));
        // Degrees, clockwise from north, from y, and backwards.
        for change in [
            &(|pose: &mut Pose| pose.yaw_rad = pose.yaw_rad.to_degrees()) as &dyn Fn(&mut Pose),
            &|pose| pose.yaw_rad = std::f64::consts::FRAC_PI_2 - pose.yaw_rad,
            &|pose| pose.yaw_rad -= std::f64::consts::FRAC_PI_2,
            &|pose| pose.yaw_rad += std::f64::consts::PI,
        ] {
            let error = error_of(change);
            assert!(error.contains("half of the headings differ by"), "{error}");
        }
        // A whole turn more, a slow ego, noise of the places of one that stands.
        assert_eq!(error_of(&|pose| pose.yaw_rad += std::f64::consts::TAU), "");
        assert_eq!(error_of(&|pose| pose.speed_mps *= 1.2), "");
        assert_eq!(error_of(&|pose| (pose.at_m, pose.speed_mps) = ([pose.at_m[0] % 3.0, 0.0], 0.0)), "");
    }

    #[test]
    fn a_pose_to_which_the_ego_jumps_is_named_with_its_quantity() {
        let on_map = || {
            let mut poses = bend().poses;
            poses.iter_mut().for_each(|pose| pose.on_road = Some([500.0 + 30.0 * pose.time.s(), -5.625, 0.0]));
            poses
        };
        let error_of = |poses: Vec<Pose>| {
            Poses::new(Origin::file("bend"), poses).err().map(|error| error.to_string()).unwrap_or_default()
        };
        assert_eq!(error_of(on_map()), "");
        let of_pose = |change: &dyn Fn(&mut Pose)| {
            let mut poses = on_map();
            change(&mut poses[57]);
            error_of(poses)
        };
        for (change, expected) in [
            (&(|pose: &mut Pose| pose.at_m[0] = -500.0) as &dyn Fn(&mut Pose), "message 57, `x_m`: the ego moves"),
            (&|pose| pose.at_m[1] = -500.0, "message 57, `y_m`: the ego moves"),
            (&|pose| pose.yaw_rad += 2.0, "message 57, `yaw_rad`: the ego turns by 2.0 rad in 0.100 s, but 0.8 rad"),
            (&|pose| pose.on_road = Some([-500.0, -5.625, 0.0]), "message 57, `s_m`: the ego moves"),
            (
                &|pose| pose.on_road = Some([671.0, -500.0, 0.0]),
                "message 57, `d_m`: the ego moves 494.4 m in 0.100 s, but",
            ),
            (&|pose| pose.on_road = Some([671.0, -5.625, 1.2]), "message 57, `heading_rad`: the ego turns by 1.2 rad"),
            (
                &|pose| pose.on_road = Some([671.0, -5.625, 3.1]),
                "`heading_rad`: 3.1 is out of range: an angle from -π/2",
            ),
            (
                &|pose| pose.on_road = Some([-2e4, -5.625, 0.0]),
                "`s_m`: -20000 is out of range: a position from -10,000",
            ),
            (&|pose| pose.speed_mps = 151.0, "`speed_mps`: 151 is out of range: a speed from 0 to 150 m/s is needed"),
        ] {
            let error = of_pose(change);
            assert!(error.contains(expected), "{error}");
        }
        // Where every pose is wrong, the unit is.
        let all = |change: &dyn Fn(&mut Pose)| {
            let mut poses = on_map();
            poses.iter_mut().for_each(change);
            error_of(poses)
        };
        let error = all(&|pose| pose.on_road = Some([500.0, -5.625, 0.0]));
        assert!(error.contains("0 m by its places: `s_m` and `d_m` are in m along"), "{error}");
        // A pose beside the road is beside each road that is narrower.
        let poses = |d_m: f64| {
            let mut poses = on_map();
            poses.iter_mut().for_each(|pose| pose.on_road = Some([500.0 + 30.0 * pose.time.s(), d_m, 0.0]));
            Poses::new(Origin::file("bend"), poses).unwrap().check_on(&Road::straight(3))
        };
        assert!(poses(-21.0).is_ok() && poses(9.0).is_ok());
        for d_m in [-500.0, -22.0, 11.0] {
            let error = poses(d_m).unwrap_err().to_string();
            assert!(error.contains("beside the road of the scenario: -21.25 to 10 m is allowed"), "{error}");
        }
    }

    #[test]
    fn the_place_on_a_map_is_kept_to_the_bit() {
        let on_road = Some([1_234.567_89, -5.1, 0.001]);
        let pose = Pose { time: Time::from_ms(40), on_road, ..Pose::default() };
        let (_, ego) =
            Poses::new(Origin::file("map"), vec![pose]).unwrap().place_at(pose.time, &Road::straight(3), 0.0).unwrap();
        assert_eq!(Some([ego.s_m, ego.d_m, ego.heading_rad]), on_road);
    }
}
