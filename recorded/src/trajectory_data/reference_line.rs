//! A reference line along a road, and the projection of points onto it.
//!
//! ```text
//!                 × point
//!      nearest    ┊ ╲
//!      position:  ┊  ╲  along the normal, whose direction turns steadily from vertex to vertex
//!   ●─────────────●───┴──────────●
//! ```
//!
//! At a kink, the nearest position of a polyline jumps for points on the inner side, and does not
//! move for points on the outer side. Therefore the normal of the line turns linearly along each
//! segment, between the bisectors of the kinks at its ends. (E. Héry, S. Masi, P. Xu, P. Bonnifait,
//! "Map-based curvilinear coordinates for autonomous vehicles", ITSC 2017.) Far inside a bend,
//! normals cross; points there get the nearest position instead.

use closecall_traffic::maths;

/// A point in a plane (m).
pub(super) type Point = (f64, f64);

/// Maximum distance at which two points count as one (m).
const SAME_POINT_M: f64 = 1e-6;

/// Share of a segment by which the foot of a normal may lie outside of it (-): rounding errors are
/// far below it.
const ROUNDING: f64 = 1e-9;

/// Value of 1 + cos θ below which a turn by θ counts as turning back (-): within about 8° of a half
/// turn.
const TURNS_BACK: f64 = 0.01;

/// Length at the end of a line whose mean direction the line continues (m): positions with errors of 0.3 m give
/// the direction to 0.015 rad, and in a bend with a radius of 1,000 m it is 0.02 rad off. An assumption with a
/// plausible range of 20 to 60 m.
const END_M: f64 = 40.0;

/// A polyline. It continues straight beyond both ends.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct ReferenceLine {
    vertices: Vec<Vertex>,
}

/// A point of the line.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Vertex {
    point: Point,
    /// Distance along the line (m).
    s_m: f64,
    /// Tangent of half the angle by which the line turns to the left here (-).
    half_turn: f64,
}

/// A segment between two vertices, and a point in its frame.
struct Segment {
    start: Vertex,
    end: Vertex,
    length_m: f64,
    /// Direction of the segment (-).
    direction: (f64, f64),
    /// Position of the point along the segment and to its left (m).
    along_m: f64,
    left_m: f64,
    is_first: bool,
    is_last: bool,
}

impl Segment {
    fn new(start: Vertex, end: Vertex, (x_m, y_m): Point) -> Self {
        let ((x0, y0), (x1, y1)) = (start.point, end.point);
        let length_m = end.s_m - start.s_m;
        let (ux, uy) = ((x1 - x0) / length_m, (y1 - y0) / length_m);
        let (dx, dy) = (x_m - x0, y_m - y0);
        Self {
            start,
            end,
            length_m,
            direction: (ux, uy),
            along_m: dx * ux + dy * uy,
            left_m: ux * dy - uy * dx,
            is_first: false,
            is_last: false,
        }
    }

    /// Returns the projection along a normal of this segment, or `None` if none of them leads to
    /// the point.
    fn along_normal(&self) -> Option<Projection> {
        let is_before = self.is_first && self.along_m < 0.0;
        if is_before || (self.is_last && self.along_m > self.length_m) {
            return Some(self.projection(self.along_m, 0.0));
        }
        // In the frame of the segment, the tangent at the share λ is (1, m). Its slope m goes from
        // the slope of the start to the slope of the end.
        let (from, to) = (-self.start.half_turn, self.end.half_turn);
        let spread_m = self.length_m - self.left_m * (to - from);
        let share = (self.along_m + self.left_m * from) / spread_m;
        // A point on the bisector of a kink belongs to one of its two segments, whatever the
        // rounding.
        let is_within = spread_m > 0.0 && (-ROUNDING..=1.0 + ROUNDING).contains(&share);
        is_within.then(|| self.projection(share * self.length_m, maths::atan(from + share * (to - from))))
    }

    /// Returns the projection onto the nearest position of this segment.
    fn nearest(&self) -> Projection {
        let low = if self.is_first { f64::NEG_INFINITY } else { 0.0 };
        let high = if self.is_last { f64::INFINITY } else { self.length_m };
        self.projection(self.along_m.clamp(low, high), 0.0)
    }

    /// Returns the projection onto the position `along_m` (m), at which the line has turned by
    /// `turned_rad` (rad) relative to the segment.
    fn projection(&self, along_m: f64, turned_rad: f64) -> Projection {
        Projection {
            s_m: self.start.s_m + along_m,
            d_m: maths::hypot(self.along_m - along_m, self.left_m).copysign(self.left_m),
            // A search asks one segment of many for its heading.
            heading_rad: maths::atan2(self.direction.1, self.direction.0) + turned_rad,
        }
    }
}

/// The position of a point relative to a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Projection {
    /// Distance along the line (m).
    pub(super) s_m: f64,
    /// Distance to the left of the line (m).
    pub(super) d_m: f64,
    /// Heading of the line at that position (rad).
    pub(super) heading_rad: f64,
}

impl ReferenceLine {
    /// Builds the line through `points`.
    pub(super) fn through(points: impl Iterator<Item = Point>) -> Self {
        let mut vertices: Vec<Vertex> = Vec::new();
        for point in points {
            let Some(last) = vertices.last() else {
                vertices.push(Vertex { point, s_m: 0.0, half_turn: 0.0 });
                continue;
            };
            let step_m = maths::hypot(point.0 - last.point.0, point.1 - last.point.1);
            if step_m > SAME_POINT_M {
                let s_m = last.s_m + step_m;
                vertices.push(Vertex { point, s_m, half_turn: 0.0 });
            }
        }
        let turns: Vec<f64> = vertices.windows(3).map(|w| half_turn(w[0].point, w[1].point, w[2].point)).collect();
        vertices.iter_mut().skip(1).zip(turns).for_each(|(vertex, half_turn)| vertex.half_turn = half_turn);
        Self { vertices }
    }

    /// Returns the largest distance between the line and the straight line between its ends (m).
    pub(super) fn bend_m(&self) -> f64 {
        let (Some(first), Some(last)) = (self.vertices.first(), self.vertices.last()) else { return 0.0 };
        let (dx, dy) = (last.point.0 - first.point.0, last.point.1 - first.point.1);
        let chord_m = maths::hypot(dx, dy);
        let beside_m = |vertex: &Vertex| {
            let (x_m, y_m) = (vertex.point.0 - first.point.0, vertex.point.1 - first.point.1);
            if chord_m > SAME_POINT_M { (dx * y_m - dy * x_m).abs() / chord_m } else { maths::hypot(x_m, y_m) }
        };
        self.vertices.iter().map(beside_m).fold(0.0, f64::max)
    }

    /// Returns the line with a straight piece at each end, in the mean direction of the last [`END_M`]: the last
    /// points alone, which lie close to each other, have the direction of their errors.
    pub(super) fn with_steady_ends(&self) -> Self {
        let points: Vec<Point> = self.vertices.iter().map(|vertex| vertex.point).collect();
        let backwards: Vec<Point> = points.iter().rev().copied().collect();
        let (before, after) = (beyond(&points), beyond(&backwards));
        Self::through(before.into_iter().chain(points).chain(after))
    }

    /// Returns the length of the line (m), or `None` if it has no extent.
    pub(super) fn length_m(&self) -> Option<f64> {
        self.vertices.last().filter(|_| self.vertices.len() > 1).map(|vertex| vertex.s_m)
    }

    /// Returns the point at `s_m` along the line and `left_m` to its left (m), or `None` if the line
    /// has no extent.
    pub(super) fn beside(&self, s_m: f64, left_m: f64) -> Option<Point> {
        let last = self.vertices.len().checked_sub(2)?;
        let after = self.vertices.partition_point(|vertex| vertex.s_m <= s_m);
        let (start, end) = match &self.vertices[after.saturating_sub(1).min(last)..] {
            [start, end, ..] => (start, end),
            _ => return None,
        };
        let length_m = end.s_m - start.s_m;
        let (ux, uy) = ((end.point.0 - start.point.0) / length_m, (end.point.1 - start.point.1) / length_m);
        let along_m = s_m - start.s_m;
        Some((start.point.0 + along_m * ux - left_m * uy, start.point.1 + along_m * uy + left_m * ux))
    }

    /// Projects a point onto the line: along the normal that leads to it, or, if none does, onto
    /// the nearest position.
    pub(super) fn project(&self, point: Point) -> Projection {
        let last = self.vertices.len().saturating_sub(2);
        let nearer = |a: &Projection, b: &Projection| a.d_m.abs().total_cmp(&b.d_m.abs());
        let segments = || {
            let pairs = self.vertices.windows(2).enumerate();
            pairs.map(|(k, pair)| Segment {
                is_first: k == 0,
                is_last: k == last,
                ..Segment::new(pair[0], pair[1], point)
            })
        };
        let along_normals = segments().filter_map(|segment| segment.along_normal()).min_by(nearer);
        let projection = along_normals.or_else(|| segments().map(|segment| segment.nearest()).min_by(nearer));
        projection.unwrap_or(Projection { s_m: 0.0, d_m: 0.0, heading_rad: 0.0 })
    }
}

/// Returns the point [`END_M`] before the first of `points`, in the direction between the middles of the two halves
/// of the points within [`END_M`]. Returns `None` if the points have no extent.
fn beyond(points: &[Point]) -> Option<Point> {
    let first = points.first()?;
    let is_near = |point: &&Point| maths::hypot(point.0 - first.0, point.1 - first.1) <= END_M;
    let near: Vec<Point> = points.iter().take_while(is_near).copied().collect();
    let middle = |part: &[Point]| {
        let sum = part.iter().fold((0.0, 0.0), |sum, point| (sum.0 + point.0, sum.1 + point.1));
        (sum.0 / part.len() as f64, sum.1 / part.len() as f64)
    };
    let (close, far) = near.split_at(near.len() / 2);
    let (close, far) = (middle(if close.is_empty() { &near } else { close }), middle(far));
    let length_m = maths::hypot(close.0 - far.0, close.1 - far.1);
    let share = END_M / length_m;
    (length_m > SAME_POINT_M).then_some((first.0 + share * (close.0 - far.0), first.1 + share * (close.1 - far.1)))
}

/// Returns the tangent of half the angle by which the way from `a` over `b` to `c` turns to the
/// left at `b` (-). A way that turns back has no bisector; it counts as straight.
fn half_turn(a: Point, b: Point, c: Point) -> f64 {
    let (first, second) = ((b.0 - a.0, b.1 - a.1), (c.0 - b.0, c.1 - b.1));
    let lengths = maths::hypot(first.0, first.1) * maths::hypot(second.0, second.1);
    let sine = (first.0 * second.1 - first.1 * second.0) / lengths;
    let one_plus_cosine = 1.0 + (first.0 * second.0 + first.1 * second.1) / lengths;
    if one_plus_cosine > TURNS_BACK { sine / one_plus_cosine } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_continues_straight_and_segments_without_a_kink_project_onto_the_nearest_position() {
        let line = ReferenceLine::through([(0.0, 0.0), (10.0, 0.0), (10.0, 0.0), (20.0, 0.0)].into_iter());
        assert_eq!(line.length_m(), Some(20.0));
        let at = |x, y| {
            let projection = line.project((x, y));
            (projection.s_m, projection.d_m)
        };
        assert_eq!(line.beside(14.0, -2.0), Some((14.0, -2.0)));
        assert_eq!(line.beside(-3.0, 1.0), Some((-3.0, 1.0)));
        assert_eq!(line.beside(25.0, -1.0), Some((25.0, -1.0)));
        assert_eq!(ReferenceLine::through([(1.0, 1.0)].into_iter()).beside(0.0, 0.0), None);
        assert_eq!(at(4.0, 1.0), (4.0, 1.0));
        assert_eq!(at(14.0, -2.0), (14.0, -2.0));
        assert_eq!(at(-3.0, 1.0), (-3.0, 1.0));
        assert_eq!(at(25.0, -1.0), (25.0, -1.0));
        assert_eq!(ReferenceLine::through([(1.0, 1.0), (1.0, 1.0)].into_iter()).length_m(), None);
    }

    #[test]
    fn an_end_with_errors_is_continued_in_the_direction_of_its_last_forty_metres() {
        // Points every 2 m. The last one is 0.3 m aside: the last segment points aside by 0.15 rad.
        let aside_m = |k: u32| if k == 50 { 0.3 } else { 0.0 };
        let line = ReferenceLine::through((0..=50).map(|k| (2.0 * f64::from(k), aside_m(k))));
        assert!(line.project((200.0, 0.0)).d_m < -14.0);
        let steady = line.with_steady_ends();
        assert_eq!(steady.length_m().map(f64::round), Some(180.0));
        for x_m in [-100.0, -20.0, 50.0, 120.0, 200.0] {
            assert!(steady.project((x_m, 0.0)).d_m.abs() < 0.6, "{x_m}: {:?}", steady.project((x_m, 0.0)));
        }
        // A bend is continued along its tangent, behind which the mean direction lags by 20 m.
        let bend = ReferenceLine::through((0..=50).map(|k| {
            let angle_rad = 0.002 * f64::from(k);
            (1_000.0 * maths::sin(angle_rad), 1_000.0 * (1.0 - maths::cos(angle_rad)))
        }));
        let heading_rad = bend.with_steady_ends().project((140.0, 9.0)).heading_rad;
        assert!((0.07..=0.1).contains(&heading_rad), "{heading_rad}");
        // Without an extent, nothing is continued.
        let point = ReferenceLine::through([(1.0, 1.0)].into_iter());
        assert_eq!(point.with_steady_ends(), point);
    }

    #[test]
    fn the_bend_of_a_line_is_its_distance_from_the_chord() {
        let bend_m = |points: &[Point]| ReferenceLine::through(points.iter().copied()).bend_m();
        assert_eq!(bend_m(&[(3.0, 4.0)]), 0.0);
        assert_eq!(bend_m(&[(0.0, 0.0), (10.0, 0.0), (40.0, 0.0)]), 0.0);
        assert!((bend_m(&[(0.0, 0.0), (10.0, 0.2), (30.0, -1.5), (40.0, 0.0)]) - 1.5).abs() < 1e-12);
    }

    #[test]
    fn at_a_right_angle_the_bisector_leads_to_the_corner() {
        let corner = ReferenceLine::through([(0.0, 0.0), (10.0, 0.0), (10.0, 10.0)].into_iter());
        for point in [(9.0, 1.0), (11.0, -1.0)] {
            let projection = corner.project(point);
            assert!((projection.s_m - 10.0).abs() < 1e-12 && (projection.d_m.abs() - 2_f64.sqrt()).abs() < 1e-12);
            assert!((projection.heading_rad - std::f64::consts::FRAC_PI_4).abs() < 1e-12);
        }
    }

    #[test]
    fn a_steady_drive_along_a_bend_moves_steadily_at_the_kinks() {
        // A bend of 400 m radius in chords of 20 m; the vehicle drives 11 m inside or outside of
        // it, between the first and the last chord, which have no kink at their outer ends.
        let (radius_m, chord_rad) = (400.0_f64, 0.05);
        let on_circle = |radius_m: f64, angle_rad: f64| {
            (radius_m * maths::sin(angle_rad), radius_m * (1.0 - maths::cos(angle_rad)))
        };
        let line = ReferenceLine::through((0..20).map(|k| on_circle(radius_m, chord_rad * f64::from(k))));
        for left_m in [11.0, -11.0] {
            let drive = (110..1_790).map(|k| {
                let (x_m, y_m) = on_circle(radius_m - left_m, 5e-4 * f64::from(k));
                line.project((x_m, y_m + left_m))
            });
            let drive: Vec<Projection> = drive.collect();
            for pair in drive.windows(2) {
                let step_m = pair[1].s_m - pair[0].s_m;
                assert!((step_m - 0.2).abs() < 0.002, "{left_m} m: a step of {step_m} m at {} m", pair[0].s_m);
                assert!((pair[1].d_m - pair[0].d_m).abs() < 0.01 && (pair[0].d_m - left_m).abs() < 0.15);
                assert!((pair[1].heading_rad - pair[0].heading_rad).abs() < 0.002);
            }
        }
    }
}
