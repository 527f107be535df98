//! The solids of a scene, as faces in the sensor's frame that are prepared for the ray cast.
//!
//! All rays start at the origin of the sensor's frame. A face is the half-space n·p ≤ w with the
//! outward unit normal n. It is stored as m = n/w: a ray of direction d meets the plane of the face
//! at the distance t with 1/t = m·d. In terms of the *inverse* distance u = 1/t, a ray is inside a
//! convex solid if
//!
//! ```text
//!   u ≤ m·d  for each front-facing face (w < 0: the sensor is on its outer side)
//!   u ≥ m·d  for each back-facing face,    and u > 0
//! ```
//!
//! The nearest point of the solid is therefore at the minimum of m·d over the front-facing faces.
//! No division is needed.

use std::ops::Range;

use nalgebra::{Isometry3, Point3, Vector3};

use super::pattern::{BLOCK_COLUMNS, Pattern};
use super::silhouette::Silhouette;
use super::solid::{MAX_FACES, Solid, SolidFace};
use super::{Material, MirrorSide, PointSource};
use closecall_traffic::maths;

/// Minimum distance of a face's plane from the sensor's centre (m). Nearer planes are moved to it,
/// so that n/w stays finite.
const MIN_OFFSET_M: f64 = 1e-4;
/// Margin added to a solid's bounds to cover rounding in single precision (°).
pub(super) const BOUND_MARGIN_DEG: f64 = 0.02;
/// Factor on the horizontal distance in the bounds of elevation, which covers the tilt of the
/// sensor's frame.
const DISTANCE_MARGIN: f64 = 0.98;
/// Minimum horizontal distance in the bounds of elevation (m).
const MIN_DISTANCE_M: f64 = 0.05;

/// A face, prepared for the ray cast.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Face {
    /// The vector m = n/w (1/m).
    pub(crate) inverse: [f32; 3],
    /// Distance |w| of the plane from the sensor (m).
    #[cfg(test)]
    pub(crate) offset_m: f32,
    /// ρ·|w| (m), with the reflectivity ρ. Times the inverse range it gives ρ·cos γ, with the
    /// incidence angle γ.
    pub(crate) strength_m: f32,
    pub(crate) material: Material,
    pub(crate) source: PointSource,
}

/// The faces of a solid, as ranges of indices in [`Targets::faces`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct FaceRange {
    /// The front-facing faces are `first..first_back`, the back-facing ones `first_back..end`.
    pub(crate) first: u32,
    pub(crate) first_back: u32,
    pub(crate) end: u32,
}

impl FaceRange {
    /// Returns the indices of the front-facing faces.
    pub(crate) fn front_facing(self) -> Range<usize> {
        self.first as usize..self.first_back as usize
    }

    /// Returns the indices of the back-facing faces.
    pub(crate) fn back_facing(self) -> Range<usize> {
        self.first_back as usize..self.end as usize
    }
}

/// A convex solid of the scene, or a range of its columns: its faces, and the columns and layers
/// that may hit it.
#[derive(Clone, Debug)]
pub(crate) struct Part {
    pub(crate) faces: FaceRange,
    /// Columns that may hit the solid.
    pub(crate) columns: Range<usize>,
    /// Bit mask of the layers that may hit the solid.
    pub(crate) layers: LayerMask,
    /// Whether the solid belongs to a guard rail.
    pub(crate) is_guard_rail: bool,
}

/// A bit mask of layers, the lowest layer in the lowest bit. Its width is the greatest number of
/// layers of a pattern, [`MAX_LAYERS`](super::kind::MAX_LAYERS).
pub(crate) type LayerMask = u128;

/// Returns the bit mask of the lowest layers, up to this number of them.
#[expect(clippy::cast_possible_truncation, reason = "a pattern has at most 128 layers")]
pub(crate) fn layers_below(end: usize) -> LayerMask {
    1_u128.checked_shl(end as u32).map_or(LayerMask::MAX, |next| next - 1)
}

/// The surface properties that all faces of an object have in common.
#[derive(Clone, Copy)]
pub(crate) struct Surface<'a> {
    pub(crate) source: PointSource,
    /// Reflectivity of each material.
    pub(crate) reflectivity: &'a dyn Fn(Material) -> f64,
}

/// The beams of a scan, used to find the beams that may hit a solid.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Beams<'a> {
    pub(crate) pattern: &'a Pattern,
    pub(crate) mirror_side: MirrorSide,
}

/// Least factor of a range due to the motion of a face during a scan (-; assumption): a vehicle
/// that is 10 m away and 50 m/s faster comes half of the way in 0.1 s.
const LEAST_DRIFT: f32 = 0.5;

/// The change of the range at which a beam meets a face while the face moves relative to the
/// sensor.
///
/// A face n·p = w that moves by v·Δ in the time Δ has the plane n·p = w + n·v·Δ. A beam then meets
/// it at 1 + (m·v)·Δ times the range, with m = n/w. Its rotation is neglected.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FaceDrift {
    /// Relative change of the range, m·v (1/s).
    per_s: f32,
    /// Time after the beginning of the scan at which the face is where the targets have it (s).
    at_s: f32,
}

impl FaceDrift {
    /// Returns the factor of the range for a beam of this time after the beginning of the scan (s).
    fn factor(self, offset_s: f32) -> f32 {
        // Of a face that is seen edge-on, w is near zero, and the factor is anything.
        (1.0 + self.per_s * (offset_s - self.at_s)).clamp(LEAST_DRIFT, 2.0 - LEAST_DRIFT)
    }
}

/// All solids of a scene. The allocated memory is reused from scan to scan.
#[derive(Clone, Debug, Default)]
pub(crate) struct Targets {
    /// Faces of all solids and plumes. The first is the road's surface.
    pub(crate) faces: Vec<Face>,
    /// Solids that at least one beam may hit.
    pub(crate) parts: Vec<Part>,
    /// How the faces move during a scan, in their order. Empty for a raster, whose neighbouring
    /// columns are measured one after the other: the solid is cast at their time.
    drifts: Vec<FaceDrift>,
}

impl Targets {
    /// Removes all faces and solids but keeps the allocated memory.
    pub(crate) fn clear(&mut self) {
        self.faces.clear();
        self.parts.clear();
        self.drifts.clear();
    }

    /// Notes how the faces move that have been appended since the last call: with `velocity_mps` in
    /// the sensor's frame (m/s). They are where the targets have them `at_s` after the beginning of
    /// the scan (s).
    #[expect(clippy::cast_possible_truncation, reason = "a factor of a range in single precision")]
    pub(crate) fn note_drift(&mut self, velocity_mps: Vector3<f64>, at_s: f64) {
        for face in &self.faces[self.drifts.len()..] {
            let [x, y, z] = face.inverse.map(f64::from);
            let per_s = x * velocity_mps.x + y * velocity_mps.y + z * velocity_mps.z;
            self.drifts.push(FaceDrift { per_s: per_s as f32, at_s: at_s as f32 });
        }
    }

    /// Returns the range at which a beam meets a face (m), `offset_ns` after the beginning of the
    /// scan, for the range at which it meets the face where the targets have it.
    #[inline(always)]
    pub(crate) fn drifted_m(&self, face: u32, range_m: f32, offset_ns: u32) -> f32 {
        match self.drifts.get(face as usize) {
            None => range_m,
            Some(drift) => range_m * drift.factor(offset_ns as f32 * 1e-9),
        }
    }

    /// Appends a solid, unless no beam can hit it from outside.
    pub(crate) fn push(&mut self, beams: Beams<'_>, solid: &Solid, pose: &Isometry3<f64>, surface: Surface<'_>) {
        let bounds = Bounds::of(solid, pose);
        let columns = beams.pattern.columns_between(bounds.azimuth_deg[0], bounds.azimuth_deg[1]);
        let layers = beams.pattern.layers_between(beams.mirror_side, bounds.elevation_deg[0], bounds.elevation_deg[1]);
        if columns.is_empty() || layers.is_empty() {
            return;
        }
        let faces = self.push_faces(solid, pose, surface);
        if faces.front_facing().is_empty() {
            return;
        }
        let is_guard_rail = surface.source == PointSource::GuardRail;
        let part = |columns, layers: Range<usize>| {
            let layers = layers_below(layers.end) & !layers_below(layers.start);
            Part { faces, columns, layers, is_guard_rail }
        };
        if columns.len() <= BLOCK_COLUMNS {
            self.parts.push(part(columns, layers));
            return;
        }
        // A long solid, such as a guard rail, covers few layers in each column, but other layers in
        // other columns.
        let silhouette = Silhouette::of(solid, pose);
        for start in columns.clone().step_by(BLOCK_COLUMNS) {
            let block = start..(start + BLOCK_COLUMNS).min(columns.end);
            if let Some([low_deg, high_deg]) = silhouette.elevations_deg(beams.pattern.azimuths_deg(&block)) {
                let narrow = beams.pattern.layers_between(beams.mirror_side, low_deg, high_deg);
                let layers = narrow.start.max(layers.start)..narrow.end.min(layers.end);
                if !layers.is_empty() {
                    self.parts.push(part(block, layers));
                }
            }
        }
    }

    /// Returns the columns that may hit a solid with this pose in the sensor's frame.
    pub(crate) fn columns_of(pattern: &Pattern, solid: &Solid, pose: &Isometry3<f64>) -> Range<usize> {
        let [low_deg, high_deg] = Bounds::of(solid, pose).azimuth_deg;
        pattern.columns_between(low_deg, high_deg)
    }

    /// Appends the road's surface, which is z = 0 in the plane's frame.
    pub(crate) fn push_ground(&mut self, sensor_from_plane: &Isometry3<f64>, surface: Surface<'_>) {
        let up = sensor_from_plane.rotation * Vector3::z();
        let face = (up, up.dot(&sensor_from_plane.translation.vector), Material::Asphalt);
        self.faces.push(prepare_face(face, surface));
    }

    /// Appends the faces of a solid with this pose in the sensor's frame, the front-facing faces
    /// first.
    #[expect(clippy::cast_possible_truncation, reason = "4 billion faces do not fit into memory")]
    pub(crate) fn push_faces(&mut self, solid: &Solid, pose: &Isometry3<f64>, surface: Surface<'_>) -> FaceRange {
        let first = self.faces.len() as u32;
        let mut back = [None; MAX_FACES];
        for (face, back) in placed_faces(solid, pose).zip(&mut back) {
            if face.1 < 0.0 {
                self.faces.push(prepare_face(face, surface));
            } else {
                *back = Some(face);
            }
        }
        let first_back = self.faces.len() as u32;
        self.faces.extend(back.into_iter().flatten().map(|face| prepare_face(face, surface)));
        FaceRange { first, first_back, end: self.faces.len() as u32 }
    }
}

/// A face in the sensor's frame: unit normal, signed distance w of its plane (m), material.
type PlacedFace = (Vector3<f64>, f64, Material);

/// Transforms the faces of a solid to the sensor's frame.
fn placed_faces(solid: &Solid, pose: &Isometry3<f64>) -> impl Iterator<Item = PlacedFace> {
    let turn = pose.rotation.to_rotation_matrix();
    let origin = pose.translation.vector;
    solid.faces().iter().map(move |SolidFace { normal, offset_m, material }| {
        let normal = turn * normal;
        (normal, offset_m + normal.dot(&origin), *material)
    })
}

#[expect(clippy::cast_possible_truncation, reason = "the ray cast is in single precision: 1e-5 m at 200 m")]
fn prepare_face((normal, offset_m, material): PlacedFace, surface: Surface<'_>) -> Face {
    let offset_m = if offset_m < 0.0 { offset_m.min(-MIN_OFFSET_M) } else { offset_m.max(MIN_OFFSET_M) };
    let inverse = normal / offset_m;
    Face {
        inverse: [inverse.x as f32, inverse.y as f32, inverse.z as f32],
        #[cfg(test)]
        offset_m: offset_m.abs() as f32,
        strength_m: ((surface.reflectivity)(material) * offset_m.abs()) as f32,
        material,
        source: surface.source,
    }
}

/// Conservative bounds of a solid's azimuth and elevation in the sensor's frame (°): too wide
/// rather than too narrow.
struct Bounds {
    azimuth_deg: [f64; 2],
    elevation_deg: [f64; 2],
}

impl Bounds {
    fn of(solid: &Solid, pose: &Isometry3<f64>) -> Self {
        let corners = corners(solid).map(|corner| pose * corner);
        let fold = |coordinate: fn(&Point3<f64>) -> f64| {
            corners
                .iter()
                .map(coordinate)
                .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)])
        };
        let [bottom, top] = fold(|corner| corner.z);
        let far = fold(|corner| corner.x * corner.x + corner.y * corner.y)[1].sqrt();
        let near = (distance_m(solid, pose) * DISTANCE_MARGIN).max(MIN_DISTANCE_M);
        let above =
            |z: f64, near_m: f64, far_m: f64| maths::atan(z / if z > 0.0 { near_m } else { far_m }).to_degrees();
        // The azimuth jumps by 360° if the solid crosses the half-plane y = 0, x ≤ 0, which extends
        // forward from the sensor.
        let crosses = fold(|corner| corner.x)[0] <= 0.0 && {
            let [min_y, max_y] = fold(|corner| corner.y);
            min_y <= 0.0 && max_y >= 0.0
        };
        let azimuth = if crosses { [-180.0, 180.0] } else { azimuths_deg(&corners) };
        Self {
            azimuth_deg: [azimuth[0] - BOUND_MARGIN_DEG, azimuth[1] + BOUND_MARGIN_DEG],
            elevation_deg: [above(bottom, far, near) - BOUND_MARGIN_DEG, above(top, near, far) + BOUND_MARGIN_DEG],
        }
    }
}

/// Returns the least and the greatest azimuth of the corners of a box (°), which must lie within a
/// half-plane as seen from the sensor.
fn azimuths_deg(corners: &[Point3<f64>; 8]) -> [f64; 2] {
    let [mut least, mut greatest] = [corners[0]; 2];
    for corner in corners {
        let turn_from = |point: Point3<f64>| point.x * corner.y - point.y * corner.x;
        if turn_from(least) < 0.0 {
            least = *corner;
        }
        if turn_from(greatest) > 0.0 {
            greatest = *corner;
        }
    }
    [least, greatest].map(|corner| maths::atan2(corner.y, corner.x).to_degrees())
}

fn corners(solid: &Solid) -> [Point3<f64>; 8] {
    std::array::from_fn(|index| {
        let pick = |axis: usize| if index >> axis & 1 == 0 { solid.low[axis] } else { solid.high[axis] };
        Point3::new(pick(0), pick(1), pick(2))
    })
}

/// Returns the horizontal distance between the sensor and the solid's bounding box (m), in the
/// solid's own frame.
fn distance_m(solid: &Solid, pose: &Isometry3<f64>) -> f64 {
    let sensor = pose.inverse() * Point3::origin();
    let beyond = |axis: usize| (solid.low[axis] - sensor[axis]).max(sensor[axis] - solid.high[axis]).max(0.0);
    maths::hypot(beyond(0), beyond(1))
}

#[cfg(test)]
mod tests {
    use nalgebra::{Translation3, UnitQuaternion};
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn the_azimuths_of_a_box_come_from_its_outermost_corners(
            at in prop::array::uniform3(-60.0..60.0), half in prop::array::uniform3(0.05..20.0), yaw_rad in -3.2..3.2,
        ) {
            let high: [f64; 3] = half;
            let solid = Solid::cuboid(high.map(|end| -end), high, Material::Paint);
            let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw_rad);
            let pose = Isometry3::from_parts(Translation3::from(at), turn);
            let corners = corners(&solid).map(|corner| pose * corner);
            let azimuths = corners.map(|corner| maths::atan2(corner.y, corner.x).to_degrees());
            let fold = |pick: fn(f64, f64) -> f64| azimuths.into_iter().reduce(pick).unwrap();
            let ends = [fold(f64::min), fold(f64::max)];
            // A box around the sensor, or one across the half-plane ahead of it, has all azimuths.
            let is_around = distance_m(&solid, &pose) == 0.0;
            if !is_around && ends[1] - ends[0] < 180.0 {
                let computed = azimuths_deg(&corners);
                prop_assert!((computed[0] - ends[0]).abs() < 1e-9 && (computed[1] - ends[1]).abs() < 1e-9, "{computed:?} {ends:?}");
            } else if !is_around {
                prop_assert!(Bounds::of(&solid, &pose).azimuth_deg[1] > 180.0);
            }
        }
    }
}
