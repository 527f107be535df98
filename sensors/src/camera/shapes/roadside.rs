//! Roadside furniture: guard rails with their posts, delineator posts, signs, gantries, and trees.
//!
//! The positions depend only on the road (multiples of a spacing along s), so the furniture passes
//! by as the ego drives. Delineators are 50 m apart, as is German practice.

use closecall_traffic::Road;

use crate::camera::hash::{mix_at, unit};
use crate::camera::mesh::{Mesh, Surface, Vec3};
use closecall_traffic::guard_rail::{BEAM_DEPTH_M, BEAM_TOP_M, LEFT_OFFSET_M, POST_SPACING_M, RIGHT_OFFSET_M};
use closecall_traffic::roadside::{BESIDE_M, GANTRY_M, LEG_HALF_M, SHEET_M, SIGN_M, TREE_M, outer_edge, positions_m};

/// Lateral distance of the middle of the guard rails beyond the left and the right edge of the road
/// (m).
const RAIL_OFFSET_M: [f64; 2] = [LEFT_OFFSET_M + 0.5 * BEAM_DEPTH_M, RIGHT_OFFSET_M + 0.5 * BEAM_DEPTH_M];
/// Distance between delineator posts (m).
const DELINEATOR_SPACING_M: f64 = 50.0;
/// Mean distance between gantries (m).
const GANTRY_SPACING_M: f64 = 400.0;
/// Distance behind the lens up to which roadside furniture is rendered (m).
const MAX_DISTANCE_M: f64 = 240.0;
/// Distance up to which the posts of rails are rendered (m). Beyond it they are thinner than a
/// pixel.
const MAX_POST_DISTANCE_M: f64 = 90.0;
/// Height of the lower end of a tree's crown, half of its width, and height of its upper end (m)
/// (assumption).
const CROWN_M: [f64; 3] = [4.5, 2.0, 9.0];
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
    Sign,
    PlainGantry,
    Tree,
}

impl Roadside {
    /// Replaces `mesh` by the mesh of the body: x along the road, y left, z up. It is built only
    /// for bodies that are in view.
    pub(crate) fn build(&self, mesh: &mut Mesh) {
        mesh.clear();
        match self.kind {
            Kind::Beam => beam(mesh, self.extent_m[0]),
            Kind::Post => post(mesh),
            Kind::Delineator => delineator(mesh),
            Kind::Gantry { index } => gantry(mesh, self.extent_m[1] - 0.2, index),
            Kind::Sign => sign(mesh),
            Kind::PlainGantry => plain_gantry(mesh, self.extent_m[1] - LEG_HALF_M[1] as f32),
            Kind::Tree => tree(mesh),
        }
    }
}

/// Replaces `bodies` by all roadside bodies from [`MAX_DISTANCE_M`] behind `s_m` up to `s_m`.
pub(crate) fn roadside(road: &Road, s_m: f64, bodies: &mut Vec<Roadside>) {
    bodies.clear();
    let sides = [RAIL_OFFSET_M[0], road.right_edge_m() - RAIL_OFFSET_M[1]];
    if road.has_guard_rails() {
        for d_m in sides {
            rail(bodies, s_m, d_m);
        }
    } else {
        for index in spacing_indices(s_m, DELINEATOR_SPACING_M, MAX_DISTANCE_M) {
            for d_m in [1.5, road.right_edge_m() - 3.0] {
                let s_m = f64::from(index) * DELINEATOR_SPACING_M;
                bodies.push(Roadside { s_m, d_m, extent_m: [0.06, 0.06, 1.02], kind: Kind::Delineator });
            }
        }
    }
    configured(bodies, road, s_m);
    if road.roadside().gantry_spacing_m.is_some() {
        return;
    }
    for index in spacing_indices(s_m, GANTRY_SPACING_M, MAX_DISTANCE_M) {
        let shift = f64::from(unit(mix_at(PLACEMENT_KEY, index, 0))) * 0.6 * GANTRY_SPACING_M;
        let s_m = f64::from(index) * GANTRY_SPACING_M + shift;
        let half_m = (-road.right_edge_m() / 2.0 + 3.5) as f32;
        let d_m = road.right_edge_m() / 2.0;
        bodies.push(Roadside { s_m, d_m, extent_m: [0.4, half_m + 0.2, 7.2], kind: Kind::Gantry { index } });
    }
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
    // The beam consists of straight pieces, so that it follows a bend. Their length grows with the
    // distance.
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

/// Appends the objects that a scenario places along the road. The LiDARs see them at the same
/// places.
fn configured(bodies: &mut Vec<Roadside>, road: &Road, s_m: f64) {
    let (edge_m, outward) = outer_edge(road);
    let roadside = road.roadside();
    let mut append = |spacing_m, d_m, extent_m: [f64; 3], kind: fn() -> Kind| {
        let extent_m = extent_m.map(|part| part as f32);
        let at = positions_m(spacing_m, s_m, MAX_DISTANCE_M);
        bodies.extend(at.map(|s_m| Roadside { s_m, d_m, extent_m, kind: kind() }));
    };
    let [width, height, low] = SIGN_M;
    let sign_d_m = edge_m + outward * (BESIDE_M + 0.5 * width);
    let thickness_m = SHEET_M + 2.0 * LEG_HALF_M[0];
    append(roadside.sign_spacing_m, sign_d_m, [thickness_m, 0.5 * width, low + height], || Kind::Sign);
    let middle_m = 0.5 * road.right_edge_m();
    let half_m = middle_m.abs() + BESIDE_M + LEG_HALF_M[1];
    append(roadside.gantry_spacing_m, middle_m, [LEG_HALF_M[1], half_m, GANTRY_M[1]], || Kind::PlainGantry);
    let [beside, ..] = TREE_M;
    let [_, crown_half_m, crown_top_m] = CROWN_M;
    let extent_m = [crown_half_m, crown_half_m, crown_top_m];
    append(roadside.tree_spacing_m, edge_m + outward * beside, extent_m, || Kind::Tree);
}

/// Builds a sign as the rear camera sees it: the back of its sheet, and its post.
fn sign(mesh: &mut Mesh) {
    let ([width, height, low], [half, _]) = (SIGN_M.map(|part| part as f32), LEG_HALF_M.map(|part| part as f32));
    mesh.block([0.0, 0.0, low + 0.5 * height], [SHEET_M as f32, 0.5 * width, 0.5 * height], Surface::METAL);
    let top = 0.5 * (low + height);
    mesh.block([-half, 0.0, top], [half, half, top], Surface::METAL);
}

/// Builds a gantry whose signs are as wide as the road.
fn plain_gantry(mesh: &mut Mesh, half_m: f32) {
    let ([low, high], leg) = (GANTRY_M.map(|part| part as f32), LEG_HALF_M[1] as f32);
    for side in [-1.0, 1.0] {
        mesh.block([0.0, side * half_m, 0.5 * high], [leg, leg, 0.5 * high], Surface::METAL);
    }
    mesh.block([0.0, 0.0, 0.5 * (low + high)], [SHEET_M as f32, half_m, 0.5 * (high - low)], Surface::METAL);
}

/// Builds a tree: its stem, and a crown of two blocks above the beams of the LiDARs.
fn tree(mesh: &mut Mesh) {
    const BARK: Surface = Surface::plain([0.08, 0.06, 0.045], 0.0);
    const LEAVES: Surface = Surface::plain([0.04, 0.07, 0.025], 0.0);
    let [_, half, height] = TREE_M.map(|part| part as f32);
    let [low, wide, high] = CROWN_M.map(|part| part as f32);
    let (middle, quarter) = (0.5 * (low + high), 0.25 * (high - low));
    mesh.block([0.0, 0.0, 0.5 * height], [half, half, 0.5 * height], BARK);
    mesh.block([0.0, 0.0, middle], [wide, wide, quarter], LEAVES);
    mesh.block([0.0, 0.0, middle], [0.6 * wide, 0.6 * wide, 2.0 * quarter], LEAVES);
}

fn beam(mesh: &mut Mesh, half_m: f32) {
    for (z, half_z) in [(0.68, 0.07), (0.51, 0.06)] {
        mesh.block([0.0, 0.0, z], [half_m, 0.03, half_z], Surface::METAL);
    }
}

fn post(mesh: &mut Mesh) {
    mesh.block([0.0, 0.0, 0.33], [0.05, 0.06, 0.33], Surface::METAL);
}

fn delineator(mesh: &mut Mesh) {
    const WHITE: Surface = Surface::plain([0.75, 0.75, 0.75], 0.1);
    mesh.block([0.0, 0.0, 0.38], [0.06, 0.06, 0.38], WHITE);
    mesh.block([0.0, 0.0, 0.86], [0.06, 0.06, 0.10], Surface::PLASTIC);
    mesh.block([0.0, 0.0, 0.99], [0.05, 0.05, 0.03], WHITE);
}

/// Builds a sign gantry as wide as the road. The rear camera sees the backs of its signs.
fn gantry(mesh: &mut Mesh, half_m: f32, index: i32) {
    const CLEAR_M: f32 = 5.2;
    const BACK: Surface = Surface::plain([0.30, 0.31, 0.32], 0.2);
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
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_body_exceeds_its_extents() {
        let road = Road::straight(3);
        let (mut bodies, mut mesh) = (Vec::new(), Mesh::default());
        roadside(&road, 3_000.0, &mut bodies);
        rail(&mut bodies, 3_000.0, 1.0);
        assert!(bodies.iter().any(|body| matches!(body.kind, Kind::Gantry { .. })));
        for body in bodies {
            body.build(&mut mesh);
            for vertex in &mesh.vertices {
                let [along, across, up] = body.extent_m;
                assert!(vertex[0].abs() <= along && vertex[1].abs() <= across && vertex[2] <= up, "{vertex:?}");
            }
        }
    }
}
