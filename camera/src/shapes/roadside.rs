//! Roadside furniture: guard rails with their posts, delineator posts, and gantries with signs.
//!
//! The positions depend only on the road (multiples of a spacing along s), so that the furniture passes by as the ego
//! drives. Delineators stand every 50 m, as is German practice.

use closecall_traffic::Road;

use crate::hash::{mix_at, unit};
use crate::mesh::{Mesh, Surface, Vec3};
use closecall_traffic::guard_rail::{BEAM_DEPTH_M, BEAM_TOP_M, LEFT_OFFSET_M, POST_SPACING_M, RIGHT_OFFSET_M};

/// Lateral distance of the middle of the guard rails beyond the left and the right edge of the road (m).
const RAIL_OFFSET_M: [f64; 2] = [LEFT_OFFSET_M + 0.5 * BEAM_DEPTH_M, RIGHT_OFFSET_M + 0.5 * BEAM_DEPTH_M];
/// Distance between delineator posts (m).
const DELINEATOR_SPACING_M: f64 = 50.0;
/// Mean distance between gantries (m).
const GANTRY_SPACING_M: f64 = 400.0;
/// Distance behind the lens up to which roadside furniture is rendered (m).
const MAX_DISTANCE_M: f64 = 240.0;
/// Distance up to which the posts of rails are rendered (m). Beyond it they are thinner than a pixel.
const MAX_POST_DISTANCE_M: f64 = 90.0;
/// Key of the random positions and sizes of gantries and their signs.
const PLACEMENT_KEY: u64 = 0x706c_6163_6573;

/// One body of the roadside furniture, with its position in the road frame.
pub(crate) struct Roadside {
    /// Position along the road (m).
    pub(crate) s_m: f64,
    /// Lateral position (m).
    pub(crate) d_m: f64,
    /// Half length along the road, half width, and height (m).
    pub(crate) extent_m: Vec3,
    kind: Kind,
}

/// The kind of a roadside body.
enum Kind {
    Beam,
    Post,
    Delineator,
    Gantry { index: i32 },
}

impl Roadside {
    /// Builds the mesh: x along the road, y left, z up. It is built only for bodies that are in view.
    pub(crate) fn mesh(&self) -> Mesh {
        match self.kind {
            Kind::Beam => beam(self.extent_m[0]),
            Kind::Post => post(),
            Kind::Delineator => delineator(),
            Kind::Gantry { index } => gantry(self.extent_m[1] - 0.2, index),
        }
    }
}

/// Returns all roadside bodies from [`MAX_DISTANCE_M`] behind `s_m` up to `s_m`.
pub(crate) fn roadside(road: &Road, s_m: f64) -> Vec<Roadside> {
    let mut bodies = Vec::new();
    let sides = [RAIL_OFFSET_M[0], road.right_edge_m() - RAIL_OFFSET_M[1]];
    if road.has_guard_rails() {
        for d_m in sides {
            rail(&mut bodies, s_m, d_m);
        }
    } else {
        for index in spacing_indices(s_m, DELINEATOR_SPACING_M, MAX_DISTANCE_M) {
            for d_m in [1.5, road.right_edge_m() - 3.0] {
                let s_m = f64::from(index) * DELINEATOR_SPACING_M;
                bodies.push(Roadside { s_m, d_m, extent_m: [0.06, 0.06, 1.02], kind: Kind::Delineator });
            }
        }
    }
    for index in spacing_indices(s_m, GANTRY_SPACING_M, MAX_DISTANCE_M) {
        let shift = f64::from(unit(mix_at(PLACEMENT_KEY, index, 0))) * 0.6 * GANTRY_SPACING_M;
        let s_m = f64::from(index) * GANTRY_SPACING_M + shift;
        let half_m = (-road.right_edge_m() / 2.0 + 3.5) as f32;
        let d_m = road.right_edge_m() / 2.0;
        bodies.push(Roadside { s_m, d_m, extent_m: [0.4, half_m + 0.2, 7.2], kind: Kind::Gantry { index } });
    }
    bodies
}

/// Returns the indices of the multiples of `spacing_m` from `distance_m` behind `s_m` up to `s_m`.
#[expect(
    clippy::cast_possible_truncation,
    reason = "a float cast saturates: nothing stands two million kilometres away"
)]
fn spacing_indices(s_m: f64, spacing_m: f64, distance_m: f64) -> std::ops::RangeInclusive<i32> {
    ((s_m - distance_m) / spacing_m).ceil() as i32..=(s_m / spacing_m).floor() as i32
}

fn rail(bodies: &mut Vec<Roadside>, s_m: f64, d_m: f64) {
    // The beam consists of straight pieces, so that it follows a bend. Their length grows with the distance.
    const PIECES_M: [f64; 10] = [0.0, 8.0, 16.0, 28.0, 44.0, 64.0, 92.0, 128.0, 180.0, MAX_DISTANCE_M];
    for piece in PIECES_M.windows(2) {
        let half_m = ((piece[1] - piece[0]) / 2.0) as f32;
        let s_m = s_m - (piece[0] + piece[1]) / 2.0;
        bodies.push(Roadside { s_m, d_m, extent_m: [half_m, 0.03, BEAM_TOP_M as f32], kind: Kind::Beam });
    }
    for index in spacing_indices(s_m, POST_SPACING_M, MAX_POST_DISTANCE_M) {
        let s_m = f64::from(index) * POST_SPACING_M;
        bodies.push(Roadside { s_m, d_m, extent_m: [0.05, 0.06, 0.66], kind: Kind::Post });
    }
}

fn beam(half_m: f32) -> Mesh {
    let mut mesh = Mesh::default();
    for (z, half_z) in [(0.68, 0.07), (0.51, 0.06)] {
        mesh.block([0.0, 0.0, z], [half_m, 0.03, half_z], Surface::METAL);
    }
    mesh
}

fn post() -> Mesh {
    let mut mesh = Mesh::default();
    mesh.block([0.0, 0.0, 0.33], [0.05, 0.06, 0.33], Surface::METAL);
    mesh
}

fn delineator() -> Mesh {
    const WHITE: Surface = Surface::plain([0.75, 0.75, 0.75], 0.1);
    let mut mesh = Mesh::default();
    mesh.block([0.0, 0.0, 0.38], [0.06, 0.06, 0.38], WHITE);
    mesh.block([0.0, 0.0, 0.86], [0.06, 0.06, 0.10], Surface::PLASTIC);
    mesh.block([0.0, 0.0, 0.99], [0.05, 0.05, 0.03], WHITE);
    mesh
}

/// Builds a sign gantry as wide as the road. The rear camera sees the backs of its signs.
fn gantry(half_m: f32, index: i32) -> Mesh {
    const CLEAR_M: f32 = 5.2;
    const BACK: Surface = Surface::plain([0.30, 0.31, 0.32], 0.2);
    let mut mesh = Mesh::default();
    for side in [-1.0, 1.0] {
        mesh.block([0.0, side * half_m, (CLEAR_M + 1.0) / 2.0], [0.2, 0.2, (CLEAR_M + 1.0) / 2.0], Surface::METAL);
    }
    let beam: Vec3 = [0.15, half_m, 0.35];
    mesh.block([0.0, 0.0, CLEAR_M + 0.6], beam, Surface::METAL);
    for sign in 0..3 {
        let bits = mix_at(PLACEMENT_KEY, index, 1 + sign);
        let y = half_m * (unit(bits) - 0.5) * 1.4;
        mesh.block([0.3, y, CLEAR_M + 0.9], [0.05, 1.0 + unit(bits << 20), 0.8], BACK);
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_body_exceeds_its_extents() {
        let road = Road::straight(3);
        let mut bodies = roadside(&road, 3_000.0);
        rail(&mut bodies, 3_000.0, 1.0);
        assert!(bodies.iter().any(|body| matches!(body.kind, Kind::Gantry { .. })));
        for body in bodies {
            for vertex in body.mesh().vertices {
                let [along, across, up] = body.extent_m;
                assert!(vertex[0].abs() <= along && vertex[1].abs() <= across && vertex[2] <= up, "{vertex:?}");
            }
        }
    }
}
