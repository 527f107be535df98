//! An exact integer rasteriser with a depth buffer. It determines which triangle is visible at each
//! sample.
//!
//! Corners are snapped to a grid of 1/256 px. Integer edge functions (Pineda, *A parallel algorithm
//! for polygon rasterization*, 1988) then decide whether a sample lies inside a triangle. They have
//! no rounding error: adjacent triangles leave no gaps, and the result for one pixel does not
//! depend on which other pixels are rendered.

use super::body::MOMENTS;
use super::mesh::Vec3;
use super::optics::Optics;
use super::pinhole::NEAR_M;

/// Number of steps of the fixed-point grid per pixel.
pub(crate) const SUBPIXEL_STEPS: i32 = 256;

/// A triangle projected to the image, ready to be rasterised.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ScreenTriangle {
    /// Coefficients (a, b, c) of the edge functions a·x + b·y + c, which are all ≥ 0 inside the
    /// triangle.
    edges: [[i64; 3]; 3],
    /// Minimum and maximum x, minimum and maximum y (1/256 px).
    bounds: [i32; 4],
    /// Coefficients (a, b, c) of 1/depth = a·x + b·y + c (1/m), with x and y on the fixed-point
    /// grid.
    inverse_depth: [f64; 3],
    /// Index of the face that the triangle is part of.
    face: u32,
}

/// The samples to be rendered: a lattice of pixels, each sampled at the same offset within the
/// pixel.
#[derive(Clone, Debug)]
pub(crate) struct Lattice<'a> {
    /// Columns of the image, in ascending order.
    pub(crate) columns: &'a [i32],
    /// Rows of the image, in ascending order.
    pub(crate) rows: &'a [i32],
    /// Offset of the sample within the pixel, x and y (1/256 px).
    pub(crate) subpixel: [i32; 2],
}

/// The depth buffer, and the visible face of each sample, both by moment.
#[derive(Clone, Debug, Default)]
pub(crate) struct Visibility {
    /// 1/depth (1/m), or 0 if the sample shows no body.
    pub(crate) inverse_depth: Vec<[f32; MOMENTS]>,
    /// Index of the visible face, or `u32::MAX` if the sample shows no body.
    pub(crate) face: Vec<[u32; MOMENTS]>,
}

impl Visibility {
    /// Clears the buffer and resizes it to `samples` samples.
    pub(crate) fn clear(&mut self, samples: usize) {
        self.inverse_depth.clear();
        self.inverse_depth.resize(samples, [0.0; MOMENTS]);
        self.face.clear();
        self.face.resize(samples, [u32::MAX; MOMENTS]);
    }

    /// Rasterises the triangles of a moment into the buffer.
    pub(crate) fn draw(&mut self, moment: usize, triangles: &[ScreenTriangle], lattice: &Lattice<'_>) {
        for triangle in triangles {
            self.draw_one(moment, triangle, lattice);
        }
    }

    fn draw_one(&mut self, moment: usize, triangle: &ScreenTriangle, lattice: &Lattice<'_>) {
        let [left, right, top, bottom] = triangle.bounds;
        let [subpixel_x, subpixel_y] = lattice.subpixel;
        let misses = |positions: &[i32], subpixel: i32, low: i32, high: i32| match (positions.first(), positions.last())
        {
            (Some(first), Some(last)) => {
                last * SUBPIXEL_STEPS + subpixel < low || first * SUBPIXEL_STEPS + subpixel > high
            }
            _ => true,
        };
        if misses(lattice.rows, subpixel_y, top, bottom) || misses(lattice.columns, subpixel_x, left, right) {
            return;
        }
        let covered = |positions: &[i32], subpixel: i32, low: i32, high: i32| {
            let from = positions.partition_point(|position| position * SUBPIXEL_STEPS + subpixel < low);
            let to = positions.partition_point(|position| position * SUBPIXEL_STEPS + subpixel <= high);
            from..to
        };
        let columns = covered(lattice.columns, subpixel_x, left, right);
        if columns.is_empty() {
            return;
        }
        let width = lattice.columns.len();
        for row in covered(lattice.rows, subpixel_y, top, bottom) {
            let y = i64::from(lattice.rows[row] * SUBPIXEL_STEPS + subpixel_y);
            let of_row = triangle.edges.map(|[_, b, c]| b * y + c);
            let depth_of_row = triangle.inverse_depth[1] * y as f64 + triangle.inverse_depth[2];
            for column in columns.clone() {
                let x = i64::from(lattice.columns[column] * SUBPIXEL_STEPS + subpixel_x);
                let edge = |i: usize| triangle.edges[i][0] * x + of_row[i];
                if (edge(0) | edge(1) | edge(2)) < 0 {
                    continue;
                }
                let inverse_depth = (triangle.inverse_depth[0] * x as f64 + depth_of_row) as f32;
                let sample = row * width + column;
                let nearest = &mut self.inverse_depth[sample][moment];
                if inverse_depth > *nearest {
                    *nearest = inverse_depth;
                    self.face[sample][moment] = triangle.face;
                }
            }
        }
    }
}

/// The lens as the rasteriser sees it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Projection<'a> {
    /// Focal length (px).
    pub(crate) focal_px: f32,
    /// Middle of the image (px).
    pub(crate) middle_px: [f32; 2],
    /// How the lens differs from a pinhole. The corners of triangles are distorted, and their edges
    /// remain straight.
    pub(crate) optics: &'a Optics,
}

/// The plane of a triangle in camera axes, normal · p = offset. The length of the normal is twice
/// the triangle's area.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Facing {
    /// The normal, which points outwards (m²).
    pub(crate) normal: Vec3,
    /// The offset (m³). The lens is the origin of the camera axes, so that a triangle is seen from
    /// outside if the offset is negative.
    pub(crate) offset: f32,
}

/// Projects a triangle given in camera axes (m), which is seen from outside, and appends its
/// visible part to `out`.
pub(crate) fn project(
    corners: [Vec3; 3],
    Facing { normal, offset }: Facing,
    projection: Projection<'_>,
    face: u32,
    out: &mut Vec<ScreenTriangle>,
) {
    let focal_px = f64::from(projection.focal_px);
    let middle_px = projection.middle_px.map(f64::from);
    let plane = Plane { normal: normal.map(f64::from), offset: f64::from(offset), focal_px, middle_px };
    let near = NEAR_M as f32;
    if corners.iter().all(|corner| corner[2] >= near) {
        append(corners, projection, &plane, face, out);
        return;
    }
    let mut clipped: [Vec3; 4] = [[0.0; 3]; 4];
    let mut count = 0;
    for index in 0..3 {
        let (a, b) = (corners[index], corners[(index + 1) % 3]);
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
        append([clipped[0], clipped[last - 1], clipped[last]], projection, &plane, face, out);
    }
}

/// The plane of a face in camera axes, normal · p = offset, and the projection.
struct Plane {
    normal: [f64; 3],
    offset: f64,
    focal_px: f64,
    middle_px: [f64; 2],
}

impl Plane {
    /// Returns the coefficients of 1/depth on the fixed-point grid (1/m).
    fn inverse_depth(&self) -> [f64; 3] {
        // The ray (x, y, 1)·depth intersects the plane at depth·(normal · ray) = offset.
        let steps = f64::from(SUBPIXEL_STEPS);
        let [nx, ny, nz] = self.normal.map(|part| part / self.offset);
        let centre = self.middle_px;
        let slope = [nx, ny].map(|part| part / (self.focal_px * steps));
        let constant = nz - (nx * centre[0] + ny * centre[1]) / self.focal_px;
        [slope[0], slope[1], constant]
    }
}

/// Returns the coefficients a, b and c of a·x + b·y + c, which has these values at three points of
/// the fixed-point grid.
fn interpolated(corners: [[i32; 2]; 3], values: [f64; 3]) -> [f64; 3] {
    let [from, second, third] = corners.map(|corner| corner.map(f64::from));
    let [[x1, y1], [x2, y2]] = [second, third].map(|to| [to[0] - from[0], to[1] - from[1]]);
    let [w1, w2] = [values[1] - values[0], values[2] - values[0]];
    let area = x1 * y2 - x2 * y1;
    let (a, b) = ((w1 * y2 - w2 * y1) / area, (x1 * w2 - x2 * w1) / area);
    [a, b, values[0] - a * from[0] - b * from[1]]
}

/// Rounds to the nearest integer, and halves away from zero. `f32::round` gives the same, but calls
/// the C library.
#[expect(clippy::cast_possible_truncation, reason = "a float cast saturates")]
fn rounded(x: f32) -> i32 {
    // If a whole half were added to the number just below a half, the sum would round up to 1.
    const BELOW_HALF: f32 = 0.5_f32.next_down();
    (x + BELOW_HALF.copysign(x)) as i32
}

/// Projects a point in camera axes to the fixed-point grid.
fn snap([x, y, z]: Vec3, Projection { focal_px, middle_px, optics }: Projection<'_>) -> [i32; 2] {
    let steps = SUBPIXEL_STEPS as f32;
    let to_grid = |middle: f32, offset: f32| rounded((middle + offset) * steps);
    if optics.is_straight() {
        return [to_grid(middle_px[0], focal_px * x / z), to_grid(middle_px[1], focal_px * y / z)];
    }
    let [x, y] = optics.distorted([x / z, y / z].map(f64::from)).map(|part| focal_px * part as f32);
    [to_grid(middle_px[0], x), to_grid(middle_px[1], y)]
}

/// Appends a triangle whose corners lie in front of the near plane (m), unless it faces away from
/// the lens.
fn append(corners_m: [Vec3; 3], projection: Projection<'_>, plane: &Plane, face: u32, out: &mut Vec<ScreenTriangle>) {
    let mut corners = corners_m.map(|corner| snap(corner, projection));
    let [a, b, c] = corners.map(|corner| corner.map(i64::from));
    let doubled_area = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]);
    // Counter-clockwise corners have a negative area in image coordinates, because y points down.
    if doubled_area >= 0 {
        return;
    }
    let inverse_depth = if projection.optics.is_straight() {
        plane.inverse_depth()
    } else {
        interpolated(corners, corners_m.map(|corner| 1.0 / f64::from(corner[2])))
    };
    corners.swap(1, 2);
    let edges = [0, 1, 2].map(|index| edge(corners[index], corners[(index + 1) % 3]));
    let low = |axis: usize| corners.iter().map(|corner| corner[axis]).fold(i32::MAX, i32::min);
    let high = |axis: usize| corners.iter().map(|corner| corner[axis]).fold(i32::MIN, i32::max);
    out.push(ScreenTriangle { edges, bounds: [low(0), high(0), low(1), high(1)], inverse_depth, face });
}

/// Returns the edge function from `a` to `b`, which is positive to the right of the edge. A sample
/// on the edge belongs to the triangle below or to the right of it (the top-left rule).
fn edge(a: [i32; 2], b: [i32; 2]) -> [i64; 3] {
    let [dx, dy] = [0, 1].map(|axis| i64::from(b[axis]) - i64::from(a[axis]));
    let is_top_left = dy < 0 || (dy == 0 && dx > 0);
    let constant = dy * i64::from(a[0]) - dx * i64::from(a[1]);
    [-dy, dx, constant - i64::from(!is_top_left)]
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::camera::mesh::{cross, dot, sub};

    const PINHOLE: Projection<'_> = Projection { focal_px: 1000.0, middle_px: [640.0, 400.0], optics: &STRAIGHT };
    const STRAIGHT: Optics = Optics { distortion: [0.0; 2], vignetting: 0.0, surface_reflectance: 0.0 };

    fn rasterised(triangles: &[ScreenTriangle], columns: &[i32], rows: &[i32]) -> Visibility {
        let mut visibility = Visibility::default();
        visibility.clear(columns.len() * rows.len());
        visibility.draw(0, triangles, &Lattice { columns, rows, subpixel: [128, 128] });
        visibility
    }

    /// Projects a triangle, unless it faces away from the lens.
    fn project(corners: [Vec3; 3], projection: Projection<'_>, face: u32, out: &mut Vec<ScreenTriangle>) {
        let normal = cross(sub(corners[1], corners[0]), sub(corners[2], corners[0]));
        let offset = dot(normal, corners[0]);
        if offset < 0.0 {
            super::project(corners, Facing { normal, offset }, projection, face, out);
        }
    }

    proptest! {
        #[test]
        fn a_number_is_rounded_as_the_library_rounds_it(bits in any::<u32>(), steps in -2_000_i16..2_000) {
            let near_half = f32::from(steps) + 0.5;
            for x in [f32::from_bits(bits), near_half, near_half.next_down(), near_half.next_up()] {
                prop_assert_eq!(rounded(x), x.round() as i32, "{}", x);
            }
        }
    }

    /// Returns two triangles that form the square from −1 to 1 at depth 10, seen from outside.
    fn square() -> Vec<ScreenTriangle> {
        let [a, b, c, d] = [[-1.0, 1.0, 10.0], [1.0, 1.0, 10.0], [1.0, -1.0, 10.0], [-1.0, -1.0, 10.0]];
        let mut out = Vec::new();
        project([a, b, c], PINHOLE, 0, &mut out);
        project([a, c, d], PINHOLE, 1, &mut out);
        out
    }

    #[test]
    fn triangles_that_share_an_edge_cover_each_pixel_exactly_once() {
        let columns: Vec<i32> = (530..750).collect();
        let rows: Vec<i32> = (290..510).collect();
        let triangles = square();
        let both = rasterised(&triangles, &columns, &rows);
        let hits = |visibility: &Visibility| visibility.face.iter().filter(|face| face[0] != u32::MAX).count();
        assert_eq!(hits(&both), 200 * 200);
        let single: usize =
            triangles.iter().map(|triangle| hits(&rasterised(std::slice::from_ref(triangle), &columns, &rows))).sum();
        assert_eq!(single, 200 * 200);
        assert!(both.inverse_depth.iter().all(|[w, ..]| *w == 0.0 || (w - 0.1).abs() < 1e-6));
    }

    #[test]
    fn the_nearer_triangle_hides_the_farther_one_in_either_order() {
        let mut near = Vec::new();
        project([[-1.0, 1.0, 5.0], [1.0, 1.0, 5.0], [1.0, -1.0, 5.0]], PINHOLE, 7, &mut near);
        let forwards: Vec<_> = square().into_iter().chain(near.clone()).collect();
        let backwards: Vec<_> = near.into_iter().chain(square()).collect();
        let (columns, rows): (Vec<i32>, Vec<i32>) = ((600..700).collect(), (380..420).collect());
        assert_eq!(rasterised(&forwards, &columns, &rows).face, rasterised(&backwards, &columns, &rows).face);
        assert!(rasterised(&forwards, &columns, &rows).face.iter().any(|face| face[0] == 7));
    }

    #[test]
    fn a_triangle_across_the_near_plane_is_clipped() {
        let mut out = Vec::new();
        project([[-1.0, 1.0, -2.0], [-1.0, 1.0, 10.0], [-1.0, -1.0, 10.0]], PINHOLE, 0, &mut out);
        project([[-1.0, 1.0, -2.0], [-1.0, -1.0, 10.0], [-1.0, 1.0, 10.0]], PINHOLE, 0, &mut out);
        assert_eq!(out.len(), 2, "the triangle that is seen from outside becomes a quadrangle, which is two triangles");
    }
}
