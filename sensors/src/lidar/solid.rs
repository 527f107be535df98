//! Convex solids, the building blocks of vehicles and roadside furniture.

use nalgebra::{Point3, Vector3};

use super::Material;

/// Maximum number of faces of a solid: a side profile of six edges, and two sides.
pub(crate) const MAX_FACES: usize = 8;

/// A face of a solid: the half-space n·p ≤ w, which contains the solid.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SolidFace {
    /// Outward unit normal n.
    pub(crate) normal: Vector3<f64>,
    /// Distance w from the origin along the normal (m).
    pub(crate) offset_m: f64,
    pub(crate) material: Material,
}

/// A convex solid as an intersection of half-spaces, in the frame of the object that it is part of.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Solid {
    faces: [SolidFace; MAX_FACES],
    count: usize,
    /// Opposite corners of the axis-aligned bounding box (m).
    pub(crate) low: Vector3<f64>,
    pub(crate) high: Vector3<f64>,
}

/// A corner of a side profile, with the material of the edge from this corner to the next.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Corner {
    /// Longitudinal position (m).
    pub(crate) x_m: f64,
    /// Height (m).
    pub(crate) z_m: f64,
    pub(crate) material: Material,
}

/// Creates a corner of a profile.
pub(crate) const fn corner(x_m: f64, z_m: f64, material: Material) -> Corner {
    Corner { x_m, z_m, material }
}

/// Half the width of a prism, which may taper from bottom to top.
#[derive(Clone, Copy, Debug)]
pub(crate) struct HalfWidth {
    pub(crate) bottom_m: f64,
    pub(crate) top_m: f64,
}

impl HalfWidth {
    /// Creates the half-width of a prism that does not taper.
    pub(crate) const fn straight(half_m: f64) -> Self {
        Self { bottom_m: half_m, top_m: half_m }
    }
}

/// Placeholder for the unused faces of a solid.
const NO_FACE: SolidFace =
    SolidFace { normal: Vector3::new(0.0, 0.0, 0.0), offset_m: 0.0, material: Material::Asphalt };

impl Solid {
    /// Returns the faces.
    pub(crate) fn faces(&self) -> &[SolidFace] {
        &self.faces[..self.count]
    }

    /// Returns the eight corners of the axis-aligned bounding box (m).
    pub(crate) fn corners(&self) -> impl Iterator<Item = Point3<f64>> {
        let ends = [self.low, self.high];
        (0..8_usize).map(move |corner| Point3::from(Vector3::from_fn(|axis, _| ends[corner >> axis & 1][axis])))
    }

    /// Creates an axis-aligned box of one material.
    pub(crate) fn cuboid(low: [f64; 3], high: [f64; 3], material: Material) -> Self {
        let (low, high) = (Vector3::from(low), Vector3::from(high));
        let mut solid = Self { faces: [NO_FACE; MAX_FACES], count: 0, low, high };
        for axis in 0..3 {
            let mut normal = Vector3::zeros();
            normal[axis] = 1.0;
            solid.push(normal, high[axis], material);
            solid.push(-normal, -low[axis], material);
        }
        solid
    }

    /// Creates a prism that is symmetric about y = 0 from a convex side profile.
    ///
    /// The profile has at most six corners, in either direction around it. `side` is the material
    /// of both sides.
    pub(crate) fn prism(profile: &[Corner], width: HalfWidth, side: Material) -> Self {
        let max_half_m = width.bottom_m.max(width.top_m);
        let mut low = Vector3::new(f64::INFINITY, -max_half_m, f64::INFINITY);
        let mut high = Vector3::new(f64::NEG_INFINITY, max_half_m, f64::NEG_INFINITY);
        let (mut middle_x, mut middle_z) = (0.0, 0.0);
        for at in profile {
            low.x = low.x.min(at.x_m);
            low.z = low.z.min(at.z_m);
            high.x = high.x.max(at.x_m);
            high.z = high.z.max(at.z_m);
            middle_x += at.x_m / profile.len() as f64;
            middle_z += at.z_m / profile.len() as f64;
        }
        let mut solid = Self { faces: [NO_FACE; MAX_FACES], count: 0, low, high };
        for (index, from) in profile.iter().enumerate() {
            let to = profile[(index + 1) % profile.len()];
            let mut normal = Vector3::new(to.z_m - from.z_m, 0.0, from.x_m - to.x_m).normalize();
            let mut offset = normal.x * from.x_m + normal.z * from.z_m;
            if normal.x * middle_x + normal.z * middle_z > offset {
                (normal, offset) = (-normal, -offset);
            }
            solid.push(normal, offset, from.material);
        }
        for sign in [1.0, -1.0] {
            let normal = Vector3::new(0.0, sign * (high.z - low.z), width.bottom_m - width.top_m).normalize();
            solid.push(normal, sign * normal.y * width.bottom_m + normal.z * low.z, side);
        }
        solid
    }

    /// Appends a face, unless the solid already has [`MAX_FACES`].
    fn push(&mut self, normal: Vector3<f64>, offset_m: f64, material: Material) {
        if self.count < MAX_FACES {
            self.faces[self.count] = SolidFace { normal, offset_m, material };
            self.count += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn contains(solid: &Solid, point: [f64; 3]) -> bool {
        solid.faces().iter().all(|face| face.normal.dot(&Vector3::from(point)) <= face.offset_m + 1e-12)
    }

    #[test]
    fn a_cuboid_contains_its_corners_and_no_point_outside() {
        let cuboid = Solid::cuboid([0.0, -1.0, 0.5], [2.0, 1.0, 1.5], Material::Paint);
        assert!(contains(&cuboid, [2.0, 1.0, 1.5]) && contains(&cuboid, [0.0, -1.0, 0.5]));
        assert!(!contains(&cuboid, [2.01, 0.0, 1.0]) && !contains(&cuboid, [1.0, 0.0, 0.49]));
    }

    #[test]
    fn a_prism_is_bounded_by_its_profile_and_tapers() {
        let glass = Material::Glass;
        let profile =
            [corner(2.0, 0.0, glass), corner(1.0, 1.0, glass), corner(-1.0, 1.0, glass), corner(-2.0, 0.0, glass)];
        let prism = Solid::prism(&profile, HalfWidth { bottom_m: 1.0, top_m: 0.5 }, Material::Paint);
        assert_eq!(prism.faces().len(), 6);
        assert!(contains(&prism, [1.5, 0.0, 0.5]) && !contains(&prism, [1.6, 0.0, 0.5]));
        assert!(contains(&prism, [0.0, 0.75, 0.5]) && !contains(&prism, [0.0, 0.76, 0.5]));
        let reversed: Vec<Corner> = profile.into_iter().rev().collect();
        assert!(contains(&Solid::prism(&reversed, HalfWidth::straight(1.0), Material::Paint), [1.5, 0.0, 0.5]));
    }
}
