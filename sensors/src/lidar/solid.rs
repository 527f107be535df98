//! Convex solids of which vehicles and roadside furniture are put together.

use nalgebra::{Point3, Vector3};

use super::Material;

/// The most faces of one solid: a side profile of six edges, and two sides.
pub(crate) const MAX_FACES: usize = 8;

/// One face: the half-space n·p ≤ w that the solid lies in.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SolidFace {
    /// Outward unit normal n.
    pub(crate) normal: Vector3<f64>,
    /// Distance w from the origin along the normal (m).
    pub(crate) offset_m: f64,
    pub(crate) material: Material,
}

/// A convex solid as the intersection of half-spaces, in the frame of what it belongs to.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Solid {
    faces: [SolidFace; MAX_FACES],
    count: usize,
    /// Corners of a box along the axes that holds the solid (m).
    pub(crate) low: Vector3<f64>,
    pub(crate) high: Vector3<f64>,
}

/// A corner of a side profile, with the material of the edge from here to the next corner.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Corner {
    pub(crate) x_m: f64,
    pub(crate) z_m: f64,
    pub(crate) material: Material,
}

/// Shorthand for one corner of a profile.
pub(crate) const fn corner(x_m: f64, z_m: f64, material: Material) -> Corner {
    Corner { x_m, z_m, material }
}

/// Half the width of a prism, which may taper upward.
#[derive(Clone, Copy, Debug)]
pub(crate) struct HalfWidth {
    pub(crate) bottom_m: f64,
    pub(crate) top_m: f64,
}

impl HalfWidth {
    pub(crate) const fn straight(half_m: f64) -> Self {
        Self { bottom_m: half_m, top_m: half_m }
    }
}

const NO_FACE: SolidFace =
    SolidFace { normal: Vector3::new(0.0, 0.0, 0.0), offset_m: 0.0, material: Material::Asphalt };

impl Solid {
    /// The faces.
    pub(crate) fn faces(&self) -> &[SolidFace] {
        &self.faces[..self.count]
    }

    /// The corners of the box along the axes that holds the solid (m).
    pub(crate) fn corners(&self) -> impl Iterator<Item = Point3<f64>> {
        let ends = [self.low, self.high];
        (0..8_usize).map(move |corner| Point3::from(Vector3::from_fn(|axis, _| ends[corner >> axis & 1][axis])))
    }

    /// A box along the axes, of one material.
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

    /// A convex side profile of at most six corners, in order around it, given width about y = 0.
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

    fn holds(solid: &Solid, point: [f64; 3]) -> bool {
        solid.faces().iter().all(|face| face.normal.dot(&Vector3::from(point)) <= face.offset_m + 1e-12)
    }

    #[test]
    fn a_block_holds_its_corners_and_nothing_beyond() {
        let block = Solid::cuboid([0.0, -1.0, 0.5], [2.0, 1.0, 1.5], Material::Paint);
        assert!(holds(&block, [2.0, 1.0, 1.5]) && holds(&block, [0.0, -1.0, 0.5]));
        assert!(!holds(&block, [2.01, 0.0, 1.0]) && !holds(&block, [1.0, 0.0, 0.49]));
    }

    #[test]
    fn a_prism_is_bounded_by_its_profile_and_tapers() {
        let glass = Material::Glass;
        let profile =
            [corner(2.0, 0.0, glass), corner(1.0, 1.0, glass), corner(-1.0, 1.0, glass), corner(-2.0, 0.0, glass)];
        let prism = Solid::prism(&profile, HalfWidth { bottom_m: 1.0, top_m: 0.5 }, Material::Paint);
        assert_eq!(prism.faces().len(), 6);
        assert!(holds(&prism, [1.5, 0.0, 0.5]) && !holds(&prism, [1.6, 0.0, 0.5]));
        assert!(holds(&prism, [0.0, 0.75, 0.5]) && !holds(&prism, [0.0, 0.76, 0.5]));
        let reversed: Vec<Corner> = profile.into_iter().rev().collect();
        assert!(holds(&Solid::prism(&reversed, HalfWidth::straight(1.0), Material::Paint), [1.5, 0.0, 0.5]));
    }
}
