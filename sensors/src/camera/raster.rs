//! Which triangle each sample sees: an exact integer rasteriser with a depth buffer.
//!
//! Corners are snapped to 1/256 px. Whether a sample lies inside is then decided by edge functions in whole numbers
//! (Pineda, *A parallel algorithm for polygon rasterization*, 1988), which have no rounding: neighbouring triangles
//! leave no gaps, and the answer for one pixel cannot depend on which other pixels are drawn.

use super::mesh::{Vec3, cross, dot, sub};
use super::pinhole::{HEIGHT_PX, NEAR_M, WIDTH_PX};

/// Steps of the fixed-point grid in one pixel.
pub(crate) const STEPS: i32 = 256;

/// A triangle on the image, ready to be drawn.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ScreenTriangle {
    /// Edge functions a·x + b·y + c, all 0 or more inside.
    edges: [[i64; 3]; 3],
    /// Smallest and largest x, smallest and largest y [1/256 px].
    bounds: [i32; 4],
    /// 1/depth as a·x + b·y + c [1/m] over the fixed-point grid.
    inverse_depth: [f64; 3],
    /// Which face it is part of.
    face: u32,
}

/// The samples to be taken: a lattice of pixels, each sampled at the same place within itself.
#[derive(Clone, Debug)]
pub(crate) struct Lattice<'a> {
    /// Columns of the image, in rising order.
    pub(crate) columns: &'a [i32],
    /// Rows of the image, in rising order.
    pub(crate) rows: &'a [i32],
    /// Place within the pixel, x and y [1/256 px].
    pub(crate) within: [i32; 2],
}

/// What each sample sees.
#[derive(Clone, Debug, Default)]
pub(crate) struct Visibility {
    /// 1/depth [1/m]; 0 where no body is hit.
    pub(crate) inverse_depth: Vec<f32>,
    /// The face hit, where one is.
    pub(crate) face: Vec<u32>,
}

impl Visibility {
    /// Forgets everything and takes on the size of a lattice.
    pub(crate) fn clear(&mut self, samples: usize) {
        self.inverse_depth.clear();
        self.inverse_depth.resize(samples, 0.0);
        self.face.clear();
        self.face.resize(samples, u32::MAX);
    }

    /// Draws triangles over what is there.
    pub(crate) fn draw(&mut self, triangles: &[ScreenTriangle], lattice: &Lattice<'_>) {
        for triangle in triangles {
            self.draw_one(triangle, lattice);
        }
    }

    fn draw_one(&mut self, triangle: &ScreenTriangle, lattice: &Lattice<'_>) {
        let [left, right, top, bottom] = triangle.bounds;
        let [within_x, within_y] = lattice.within;
        let hit = |places: &[i32], within: i32, low: i32, high: i32| {
            let from = places.partition_point(|place| place * STEPS + within < low);
            let to = places.partition_point(|place| place * STEPS + within <= high);
            from..to
        };
        let columns = hit(lattice.columns, within_x, left, right);
        if columns.is_empty() {
            return;
        }
        let width = lattice.columns.len();
        for row in hit(lattice.rows, within_y, top, bottom) {
            let y = i64::from(lattice.rows[row] * STEPS + within_y);
            let of_row = triangle.edges.map(|[_, b, c]| b * y + c);
            let depth_of_row = triangle.inverse_depth[1] * y as f64 + triangle.inverse_depth[2];
            for column in columns.clone() {
                let x = i64::from(lattice.columns[column] * STEPS + within_x);
                let edge = |i: usize| triangle.edges[i][0] * x + of_row[i];
                if (edge(0) | edge(1) | edge(2)) < 0 {
                    continue;
                }
                let inverse_depth = (triangle.inverse_depth[0] * x as f64 + depth_of_row) as f32;
                let sample = row * width + column;
                if inverse_depth > self.inverse_depth[sample] {
                    self.inverse_depth[sample] = inverse_depth;
                    self.face[sample] = triangle.face;
                }
            }
        }
    }
}

/// Projects a triangle given in camera axes [m] and appends what is seen of it; nothing where it faces away.
pub(crate) fn project(corners: [Vec3; 3], focal_px: f32, face: u32, out: &mut Vec<ScreenTriangle>) {
    let normal = cross(sub(corners[1], corners[0]), sub(corners[2], corners[0]));
    let offset = dot(normal, corners[0]);
    // Camera axes: the lens is the origin, so a face is seen from outside where its plane has the lens in front of it.
    if !(offset < 0.0) {
        return;
    }
    let plane = Plane { normal: normal.map(f64::from), offset: f64::from(offset), focal_px: f64::from(focal_px) };
    let near = NEAR_M as f32;
    if corners.iter().all(|corner| corner[2] >= near) {
        append(corners.map(|corner| snap(corner, focal_px)), &plane, face, out);
        return;
    }
    let mut clipped: [Vec3; 4] = [[0.0; 3]; 4];
    let mut count = 0;
    for place in 0..3 {
        let (a, b) = (corners[place], corners[(place + 1) % 3]);
        if a[2] >= near {
            clipped[count] = a;
            count += 1;
        }
        if (a[2] >= near) != (b[2] >= near) {
            let part = (near - a[2]) / (b[2] - a[2]);
            clipped[count] = [a[0] + part * (b[0] - a[0]), a[1] + part * (b[1] - a[1]), near];
            count += 1;
        }
    }
    for last in 2..count {
        let corners = [clipped[0], clipped[last - 1], clipped[last]];
        append(corners.map(|corner| snap(corner, focal_px)), &plane, face, out);
    }
}

/// A face's plane in camera axes: normal · p = offset.
struct Plane {
    normal: [f64; 3],
    offset: f64,
    focal_px: f64,
}

/// The fixed-point place of a point in camera axes.
#[expect(clippy::cast_possible_truncation, reason = "a float cast saturates, and the near plane bounds the quotient")]
fn snap([x, y, z]: Vec3, focal_px: f32) -> [i32; 2] {
    let steps = STEPS as f32;
    let place = |centre: u16, offset: f32| ((f32::from(centre) / 2.0 + focal_px * offset / z) * steps).round() as i32;
    [place(WIDTH_PX, x), place(HEIGHT_PX, y)]
}

fn append(mut corners: [[i32; 2]; 3], plane: &Plane, face: u32, out: &mut Vec<ScreenTriangle>) {
    let [a, b, c] = corners.map(|corner| corner.map(i64::from));
    let doubled_area = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]);
    // Counter-clockwise from outside is clockwise in coordinates whose y points down: a negative area.
    if doubled_area >= 0 {
        return;
    }
    corners.swap(1, 2);
    let edges = [0, 1, 2].map(|place| edge(corners[place], corners[(place + 1) % 3]));
    let low = |axis: usize| corners.iter().map(|corner| corner[axis]).fold(i32::MAX, i32::min);
    let high = |axis: usize| corners.iter().map(|corner| corner[axis]).fold(i32::MIN, i32::max);
    // A ray (x, y, 1)·depth meets the plane where depth·(normal · ray) = offset.
    let steps = f64::from(STEPS);
    let [nx, ny, nz] = plane.normal.map(|part| part / plane.offset);
    let centre = [WIDTH_PX, HEIGHT_PX].map(|extent| f64::from(extent) / 2.0);
    let slope = [nx, ny].map(|part| part / (plane.focal_px * steps));
    let constant = nz - (nx * centre[0] + ny * centre[1]) / plane.focal_px;
    out.push(ScreenTriangle {
        edges,
        bounds: [low(0), high(0), low(1), high(1)],
        inverse_depth: [slope[0], slope[1], constant],
        face,
    });
}

/// The edge function from `a` to `b`, inside on the right of it; samples on the edge itself belong to the triangle
/// below or to the right of it (the top-left rule).
fn edge(a: [i32; 2], b: [i32; 2]) -> [i64; 3] {
    let [dx, dy] = [0, 1].map(|axis| i64::from(b[axis]) - i64::from(a[axis]));
    let is_top_left = dy < 0 || (dy == 0 && dx > 0);
    let constant = dy * i64::from(a[0]) - dx * i64::from(a[1]);
    [-dy, dx, constant - i64::from(!is_top_left)]
}

#[cfg(test)]
mod tests {
    use super::*;

    const FOCAL_PX: f32 = 1000.0;

    fn drawn(triangles: &[ScreenTriangle], columns: &[i32], rows: &[i32]) -> Visibility {
        let mut visibility = Visibility::default();
        visibility.clear(columns.len() * rows.len());
        visibility.draw(triangles, &Lattice { columns, rows, within: [128, 128] });
        visibility
    }

    /// Two triangles that make up the square from −1 to 1 at depth 10, seen from outside.
    fn square() -> Vec<ScreenTriangle> {
        let [a, b, c, d] = [[-1.0, 1.0, 10.0], [1.0, 1.0, 10.0], [1.0, -1.0, 10.0], [-1.0, -1.0, 10.0]];
        let mut out = Vec::new();
        project([a, b, c], FOCAL_PX, 0, &mut out);
        project([a, c, d], FOCAL_PX, 1, &mut out);
        out
    }

    #[test]
    fn triangles_that_share_an_edge_cover_each_pixel_exactly_once() {
        let columns: Vec<i32> = (530..750).collect();
        let rows: Vec<i32> = (290..510).collect();
        let triangles = square();
        let both = drawn(&triangles, &columns, &rows);
        let hits = |visibility: &Visibility| visibility.face.iter().filter(|face| **face != u32::MAX).count();
        assert_eq!(hits(&both), 200 * 200);
        let single: usize = triangles.iter().map(|one| hits(&drawn(std::slice::from_ref(one), &columns, &rows))).sum();
        assert_eq!(single, 200 * 200);
        assert!(both.inverse_depth.iter().all(|w| *w == 0.0 || (w - 0.1).abs() < 1e-6));
    }

    #[test]
    fn faces_that_look_away_are_not_drawn() {
        let mut out = Vec::new();
        project([[-1.0, 1.0, 10.0], [1.0, -1.0, 10.0], [1.0, 1.0, 10.0]], FOCAL_PX, 0, &mut out);
        assert!(out.is_empty());
    }

    #[test]
    fn the_nearer_one_hides_the_other_in_either_order() {
        let mut near = Vec::new();
        project([[-1.0, 1.0, 5.0], [1.0, 1.0, 5.0], [1.0, -1.0, 5.0]], FOCAL_PX, 7, &mut near);
        let forwards: Vec<_> = square().into_iter().chain(near.clone()).collect();
        let backwards: Vec<_> = near.into_iter().chain(square()).collect();
        let (columns, rows): (Vec<i32>, Vec<i32>) = ((600..700).collect(), (380..420).collect());
        assert_eq!(drawn(&forwards, &columns, &rows).face, drawn(&backwards, &columns, &rows).face);
        assert!(drawn(&forwards, &columns, &rows).face.contains(&7));
    }

    #[test]
    fn a_triangle_through_the_near_plane_is_cut_there() {
        let mut out = Vec::new();
        project([[-1.0, 1.0, -2.0], [-1.0, 1.0, 10.0], [-1.0, -1.0, 10.0]], FOCAL_PX, 0, &mut out);
        project([[-1.0, 1.0, -2.0], [-1.0, -1.0, 10.0], [-1.0, 1.0, 10.0]], FOCAL_PX, 0, &mut out);
        assert_eq!(out.len(), 2, "a quadrangle is left of the one that is seen from outside");
    }
}
