//! What stands along the road: guard rails with their posts, delineator posts, and gantries with signs.
//!
//! All of it stands at places that the road alone decides (multiples of a spacing along s), so that it flows past as
//! E drives. Dimensions follow German practice: rails 0.75 m high with posts every 4 m, delineators every 50 m.

use closecall_traffic::Road;

use crate::camera::hash::{mix_at, unit};
use crate::camera::mesh::{Mesh, Surface, Vec3};

/// How far beyond the left edge, and beyond the right edge with its hard shoulder, a guard rail stands [m]: where the
/// LiDAR's model has it too.
const RAIL_BESIDE_M: [f64; 2] = [0.79, 3.04];
/// Distance between the posts of a rail [m].
const POST_EVERY_M: f64 = 4.0;
/// Distance between delineator posts [m].
const DELINEATOR_EVERY_M: f64 = 50.0;
/// Mean distance between gantries [m].
const GANTRY_EVERY_M: f64 = 400.0;
/// Rails are drawn to this distance behind the lens [m].
const RAIL_TO_M: f64 = 240.0;
/// Posts of rails are drawn to this distance [m]: beyond, they are thinner than a pixel.
const POSTS_TO_M: f64 = 90.0;
/// Keys the choices of places.
const PLACES: u64 = 0x706c_6163_6573;

/// One body of the roadside, placed in the road frame.
pub(crate) struct Roadside {
    /// Its place along the road [m].
    pub(crate) s_m: f64,
    /// Its lateral place [m].
    pub(crate) d_m: f64,
    /// Half its length along the road, half its width, its height [m].
    pub(crate) extent_m: Vec3,
    kind: Kind,
}

/// What stands there.
enum Kind {
    Beam,
    Post,
    Delineator,
    Gantry { place: i32 },
}

impl Roadside {
    /// Its body: x along the road, y left, z up. Built only for what comes into view.
    pub(crate) fn mesh(&self) -> Mesh {
        match self.kind {
            Kind::Beam => beam(self.extent_m[0]),
            Kind::Post => post(),
            Kind::Delineator => delineator(),
            Kind::Gantry { place } => gantry(self.extent_m[1] - 0.2, place),
        }
    }
}

/// Everything that stands between `RAIL_TO_M` behind `s_m` and `s_m`.
pub(crate) fn roadside(road: &Road, s_m: f64) -> Vec<Roadside> {
    let mut bodies = Vec::new();
    let sides = [RAIL_BESIDE_M[0], road.right_edge_m() - RAIL_BESIDE_M[1]];
    if road.has_guard_rails() {
        for d_m in sides {
            rail(&mut bodies, s_m, d_m);
        }
    } else {
        for place in places(s_m, DELINEATOR_EVERY_M, RAIL_TO_M) {
            for d_m in [1.5, road.right_edge_m() - 3.0] {
                let s_m = f64::from(place) * DELINEATOR_EVERY_M;
                bodies.push(Roadside { s_m, d_m, extent_m: [0.06, 0.06, 1.02], kind: Kind::Delineator });
            }
        }
    }
    for place in places(s_m, GANTRY_EVERY_M, RAIL_TO_M) {
        let shift = f64::from(unit(mix_at(PLACES, place, 0))) * 0.6 * GANTRY_EVERY_M;
        let s_m = f64::from(place) * GANTRY_EVERY_M + shift;
        let half_m = (-road.right_edge_m() / 2.0 + 3.5) as f32;
        let d_m = road.right_edge_m() / 2.0;
        bodies.push(Roadside { s_m, d_m, extent_m: [0.4, half_m + 0.2, 7.2], kind: Kind::Gantry { place } });
    }
    bodies
}

/// The multiples of a spacing between `to_m` behind `s_m` and `s_m`.
#[expect(
    clippy::cast_possible_truncation,
    reason = "a float cast saturates: nothing stands two million kilometres away"
)]
fn places(s_m: f64, every_m: f64, to_m: f64) -> std::ops::RangeInclusive<i32> {
    ((s_m - to_m) / every_m).ceil() as i32..=(s_m / every_m).floor() as i32
}

fn rail(bodies: &mut Vec<Roadside>, s_m: f64, d_m: f64) {
    // Beams in pieces that grow with the distance, so that they follow a bend.
    const PIECES_M: [f64; 10] = [0.0, 8.0, 16.0, 28.0, 44.0, 64.0, 92.0, 128.0, 180.0, RAIL_TO_M];
    for piece in PIECES_M.windows(2) {
        let half_m = ((piece[1] - piece[0]) / 2.0) as f32;
        let s_m = s_m - (piece[0] + piece[1]) / 2.0;
        bodies.push(Roadside { s_m, d_m, extent_m: [half_m, 0.03, 0.75], kind: Kind::Beam });
    }
    for place in places(s_m, POST_EVERY_M, POSTS_TO_M) {
        let s_m = f64::from(place) * POST_EVERY_M;
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

/// A sign bridge as wide as the road; its signs are seen from behind when one looks back.
fn gantry(half_m: f32, place: i32) -> Mesh {
    const CLEAR_M: f32 = 5.2;
    const BACK: Surface = Surface::plain([0.30, 0.31, 0.32], 0.2);
    let mut mesh = Mesh::default();
    for side in [-1.0, 1.0] {
        mesh.block([0.0, side * half_m, (CLEAR_M + 1.0) / 2.0], [0.2, 0.2, (CLEAR_M + 1.0) / 2.0], Surface::METAL);
    }
    let beam: Vec3 = [0.15, half_m, 0.35];
    mesh.block([0.0, 0.0, CLEAR_M + 0.6], beam, Surface::METAL);
    for sign in 0..3 {
        let bits = mix_at(PLACES, place, 1 + sign);
        let y = half_m * (unit(bits) - 0.5) * 1.4;
        mesh.block([0.3, y, CLEAR_M + 0.9], [0.05, 1.0 + unit(bits << 20), 0.8], BACK);
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_reaches_beyond_its_extents() {
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
