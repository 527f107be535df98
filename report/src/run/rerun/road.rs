//! The road in the 3D scene: surface, lane markings, guard rails. It is written once per film.

use closecall_traffic::{Road, Side};
use rerun::{LineStrips3D, Mesh3D};

use super::RecordingError;
use super::fog;
use super::palette::{self, Rgba};
use super::stream::Writer;
use crate::run::film::Film;

/// Length of road shown beyond the smallest and the largest position of any vehicle (m).
const MARGIN_M: f64 = 300.0;
/// Length of the straight pieces of a curved road (m). At the tightest radius they deviate from the
/// arc by 3 cm.
const PIECE_M: f64 = 10.0;
/// Width of the hard shoulder beside the lanes (m).
const SHOULDER_M: f64 = 2.5;
/// Width of the verge beside the hard shoulder (m).
const VERGE_M: f64 = 40.0;
// Lane markings of German motorways (RMS): dashes of 6 m with gaps of 12 m, 0.15 m wide; edge lines
// 0.30 m wide.

/// Length of a dash (m).
const DASH_M: f64 = 6.0;
/// Distance from the start of a dash to the start of the next one (m).
const DASH_PERIOD_M: f64 = 18.0;
const DASH_WIDTH_M: f64 = 0.15;
const EDGE_WIDTH_M: f64 = 0.30;
/// Height of the guard rail's beam (m).
const RAIL_HEIGHT_M: f64 = 0.75;
/// Distance between two posts of the guard rail (m).
const POST_PERIOD_M: f64 = 4.0;
/// Lateral distance of the guard rail from the edge of the lanes (m).
const RAIL_OFFSET_M: f64 = SHOULDER_M - 0.5;

/// Height of the verge (m). Flat layers lie at different heights, which keeps each of them visible.
const VERGE_Z_M: f64 = -0.30;
/// Height of the lane markings (m).
const MARKING_Z_M: f64 = 0.03;

pub(super) fn write(writer: &Writer<'_>, film: &Film) -> Result<(), RecordingError> {
    let road = &film.road;
    let (first_m, last_m) = film.s_range_m();
    if !(first_m <= last_m) {
        return Ok(());
    }
    let (from_m, to_m) = (first_m - MARGIN_M, last_m + MARGIN_M);
    let left_m = SHOULDER_M;
    let right_m = road.right_edge_m() - SHOULDER_M;

    // Half of the fog's colour lies on the ground. Near things stay legible.
    let light = film.environment.light;
    let tint = |colour| palette::through_fog(palette::lit(colour, light), 0.5 + 0.5 * fog::clear_share(film), light);
    let mut verge = Ribbons::new(road, VERGE_Z_M);
    verge.add([from_m, to_m], [right_m - VERGE_M, left_m + VERGE_M]);
    writer.write_static("world/road/verge", &verge.mesh(tint(palette::VERGE)))?;

    let mut surface = Ribbons::new(road, 0.0);
    surface.add([from_m, to_m], [right_m, left_m]);
    writer.write_static("world/road/surface", &surface.mesh(tint(palette::ROAD)))?;

    writer.write_static(
        "world/road/markings",
        &markings(road, [from_m, to_m]).mesh(palette::lit(palette::MARKING, light)),
    )?;
    if road.has_guard_rails() {
        writer.write_static("world/road/guard_rails", &guard_rails(road, [from_m, to_m]))?;
    }
    Ok(())
}

fn markings(road: &Road, [from_m, to_m]: [f64; 2]) -> Ribbons<'_> {
    let mut markings = Ribbons::new(road, MARKING_Z_M);
    let around = |d_m: f64, width_m: f64| [d_m - 0.5 * width_m, d_m + 0.5 * width_m];
    for edge in [0, road.lanes()] {
        for along_m in road.stretches_m([from_m, to_m]) {
            markings.add_along(along_m, |s_m| around(road.boundary_at_m(edge, s_m), EDGE_WIDTH_M));
        }
    }
    for lane in 1..road.lanes() {
        for dash in multiples(DASH_PERIOD_M, [from_m, to_m]) {
            let line = |s_m| around(road.full_boundary_m(lane, s_m), DASH_WIDTH_M);
            markings.add_along([dash, dash + DASH_M], line);
        }
    }
    // No vehicle leaves the ramp before the acceleration lane begins.
    if let Some(lane) = road.acceleration_lane().filter(|lane| from_m < lane.from_m) {
        let inner = match road.overtaking_side() {
            Side::Left => road.lanes() - 1,
            Side::Right => 1,
        };
        for along_m in road.stretches_m([from_m, lane.from_m.min(to_m)]) {
            markings.add_along(along_m, |s_m| around(road.boundary_at_m(inner, s_m), DASH_WIDTH_M));
        }
    }
    markings
}

fn guard_rails(road: &Road, [from_m, to_m]: [f64; 2]) -> LineStrips3D {
    let mut strips: Vec<Vec<[f32; 3]>> = Vec::new();
    for d_m in [RAIL_OFFSET_M, road.right_edge_m() - RAIL_OFFSET_M] {
        let along = piece_ends(road, [from_m, to_m]);
        strips.push(along.iter().map(|&s_m| point(road, s_m, d_m, RAIL_HEIGHT_M)).collect());
        for s_m in multiples(POST_PERIOD_M, [from_m, to_m]) {
            strips.push(vec![point(road, s_m, d_m, 0.0), point(road, s_m, d_m, RAIL_HEIGHT_M)]);
        }
    }
    LineStrips3D::new(strips).with_colors([palette::RAIL]).with_radii([0.08_f32])
}

/// Returns the multiples of `period_m` in a range. Dashes and posts are thus at the same positions
/// in every recording.
fn multiples(period_m: f64, [from_m, to_m]: [f64; 2]) -> impl Iterator<Item = f64> {
    let first = (from_m / period_m).ceil();
    let mut count = 0.0;
    std::iter::from_fn(move || {
        let at_m = (first + count) * period_m;
        count += 1.0;
        (at_m <= to_m).then_some(at_m)
    })
}

/// Returns the positions along the road (m) at which a stretch of it is divided into straight
/// pieces.
fn piece_ends(road: &Road, [from_m, to_m]: [f64; 2]) -> Vec<f64> {
    if road.is_straight() {
        return vec![from_m, to_m];
    }
    let count = ((to_m - from_m) / PIECE_M).ceil().max(1.0);
    let mut ends = Vec::new();
    let mut piece = 0.0;
    while piece <= count {
        ends.push(from_m + (to_m - from_m) * piece / count);
        piece += 1.0;
    }
    ends
}

/// Returns the scene coordinates (m) of a point in the road frame.
fn point(road: &Road, s_m: f64, d_m: f64, z_m: f64) -> [f32; 3] {
    let pose = road.plane_pose(s_m, d_m, 0.0);
    [pose.x_m as f32, pose.y_m as f32, z_m as f32]
}

/// Flat ribbons along the road, made of quadrilaterals.
struct Ribbons<'a> {
    road: &'a Road,
    z_m: f64,
    vertices: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
}

impl<'a> Ribbons<'a> {
    fn new(road: &'a Road, z_m: f64) -> Self {
        Self { road, z_m, vertices: Vec::new(), triangles: Vec::new() }
    }

    /// Adds a ribbon between two positions along the road and two positions across it.
    fn add(&mut self, along_m: [f64; 2], across_m: [f64; 2]) {
        self.add_along(along_m, |_| across_m);
    }

    /// Adds a ribbon between two positions along the road. `across_m` returns its right and its
    /// left side at a position along the road.
    fn add_along(&mut self, along_m: [f64; 2], across_m: impl Fn(f64) -> [f64; 2]) {
        let mut previous = None;
        for s_m in piece_ends(self.road, along_m) {
            let [right_m, left_m] = across_m(s_m);
            #[expect(clippy::cast_possible_truncation, reason = "a road has far fewer than 2^32 vertices")]
            let here = self.vertices.len() as u32;
            self.vertices.push(point(self.road, s_m, right_m, self.z_m));
            self.vertices.push(point(self.road, s_m, left_m, self.z_m));
            if let Some(previous) = previous.replace(here) {
                self.triangles.push([previous, here, here + 1]);
                self.triangles.push([previous, here + 1, previous + 1]);
            }
        }
    }

    fn mesh(&self, colour: Rgba) -> Mesh3D {
        Mesh3D::new(self.vertices.iter().copied())
            .with_triangle_indices(self.triangles.iter().copied())
            .with_vertex_normals(vec![[0.0_f32, 0.0, 1.0]; self.vertices.len()])
            .with_vertex_colors(vec![colour; self.vertices.len()])
    }
}
