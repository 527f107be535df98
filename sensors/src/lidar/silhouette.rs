//! The elevations at which a solid appears between two azimuths: bounds that are narrower than the
//! bounds of the whole solid.
//!
//! ```text
//!   tan θ ▲        ╭────────╮
//!         │    ╭───╯   :    ╰──╮ :        silhouette of a box: its upper and its lower edges
//!         │    ╰──╮    :   ╭───╯ :
//!         │       ╰────:───╯     :        bounds between two azimuths: those on the two azimuths (:), and the
//!         └────────────┴─────────┴─▶ φ    corners of the box between them
//! ```
//!
//! A ray of direction d = (cos φ, sin φ, t) with t = tan θ meets a convex solid if a u > 0 exists
//! that satisfies the inequalities of [`super::targets`]: u ≤ m·d for each front-facing and u ≥ m·d
//! for each back-facing face. At a given azimuth these are linear inequalities in t, and bound it.
//!
//! Along an edge, t = A·cos(φ − φ₀). Between two azimuths that are Δ apart, such an arc rises by at
//! most the factor 1/cos Δ above the higher of its ends.

use nalgebra::{Isometry3, Point3};

use super::Material;
use super::solid::Solid;
use super::targets::BOUND_MARGIN_DEG;
use closecall_traffic::maths;

/// Number of faces of a box.
const BOX_FACES: usize = 6;
/// Distance of a plane from the sensor below which the plane bounds nothing (m).
const MIN_OFFSET_M: f64 = 1e-3;

/// The bounding box of a solid, as seen from the sensor.
pub(super) struct Silhouette {
    /// Vectors m = n/w of the front-facing and of the back-facing planes (1/m), and the number of
    /// each.
    planes: [([[f64; 3]; BOX_FACES], usize); 2],
    /// Azimuth (rad) and tangent of the elevation of each corner.
    corners: [[f64; 2]; 8],
}

impl Silhouette {
    /// Returns the silhouette of a solid with this pose in the sensor's frame.
    pub(super) fn of(solid: &Solid, pose: &Isometry3<f64>) -> Self {
        let bounding_box = Solid::cuboid(solid.low.into(), solid.high.into(), Material::Asphalt);
        let mut planes = [([[0.0; 3]; BOX_FACES], 0); 2];
        for face in bounding_box.faces() {
            let normal = pose.rotation * face.normal;
            let offset_m = face.offset_m + normal.dot(&pose.translation.vector);
            if offset_m.abs() >= MIN_OFFSET_M {
                let (of_side, count) = &mut planes[usize::from(offset_m > 0.0)];
                of_side[*count] = (normal / offset_m).into();
                *count += 1;
            }
        }
        let mut corners = [[0.0; 2]; 8];
        for (seen, corner) in corners.iter_mut().zip(solid.corners()) {
            let corner: Point3<f64> = pose * corner;
            *seen = [maths::atan2(corner.y, corner.x), corner.z / maths::hypot(corner.x, corner.y)];
        }
        Self { planes, corners }
    }

    /// Returns bounds of the elevation between two azimuths (°), or `None` if the solid does not
    /// appear there.
    pub(super) fn elevations_deg(&self, azimuths_deg: [f64; 2]) -> Option<[f64; 2]> {
        let ends = [azimuths_deg[0] - BOUND_MARGIN_DEG, azimuths_deg[1] + BOUND_MARGIN_DEG].map(f64::to_radians);
        let mut bounds = [f64::INFINITY, f64::NEG_INFINITY];
        let on_ends = ends.into_iter().filter_map(|azimuth_rad| self.tangents_at(azimuth_rad));
        let inside = self.corners.iter().filter(|[azimuth_rad, _]| (ends[0]..=ends[1]).contains(azimuth_rad));
        for [low, high] in on_ends.chain(inside.map(|&[_, tan]| [tan; 2])) {
            bounds = [bounds[0].min(low), bounds[1].max(high)];
        }
        let rise = 1.0 / maths::cos(ends[1] - ends[0]);
        let [low, high] = [
            bounds[0] * if bounds[0] < 0.0 { rise } else { 1.0 },
            bounds[1] * if bounds[1] > 0.0 { rise } else { 1.0 },
        ];
        (low <= high).then(|| {
            [maths::atan(low).to_degrees() - BOUND_MARGIN_DEG, maths::atan(high).to_degrees() + BOUND_MARGIN_DEG]
        })
    }

    /// Returns the least and the greatest tangent of the elevation at one azimuth, or `None` if the
    /// solid does not appear there.
    fn tangents_at(&self, azimuth_rad: f64) -> Option<[f64; 2]> {
        let (sin, cos) = maths::sin_cos(azimuth_rad);
        // Each plane as (constant, slope) of m·d in t.
        let line = |plane: &[f64; 3]| [plane[0] * cos + plane[1] * sin, plane[2]];
        let mut bounds = [f64::NEG_INFINITY, f64::INFINITY];
        let mut require_positive = |[constant, slope]: [f64; 2]| {
            if slope > 0.0 {
                bounds[0] = f64::max(bounds[0], -constant / slope);
            } else if slope < 0.0 {
                bounds[1] = f64::min(bounds[1], -constant / slope);
            } else if constant < 0.0 {
                bounds = [f64::INFINITY, f64::NEG_INFINITY];
            }
        };
        let [fronts, backs] = self.planes.each_ref().map(|(planes, count)| &planes[..*count]);
        for front in fronts.iter().map(line) {
            require_positive(front);
            for back in backs.iter().map(line) {
                require_positive([front[0] - back[0], front[1] - back[1]]);
            }
        }
        (bounds[0] <= bounds[1]).then_some(bounds)
    }
}
