//! The 3D shapes of vehicles, each in the vehicle frame.
//!
//! ```text
//!            ╱▔▔▔▔▔╲            a body consists of frusta between a lower and an upper rectangle
//!       ▁▁▁▁╱_______╲▁▁▁
//!       ▏               ▏ ─▶ x
//!       ▔▔◯▔▔▔▔▔▔▔▔▔◯▔▔
//! ```

use closecall_traffic::{Dimensions, Vehicle, VehicleClass};
use rerun::Mesh3D;

use super::palette::{self, Rgba};

/// A solid between two horizontal rectangles. Lengths are shares of the vehicle's half length, half
/// width and height.
struct Frustum {
    /// Rear and front end of the lower and of the upper rectangle: −1 is the rear bumper, 1 the
    /// front bumper.
    along: [[f64; 2]; 2],
    /// Half width of the lower and of the upper rectangle.
    across: [f64; 2],
    /// Height of the lower and of the upper rectangle.
    up: [f64; 2],
    colour: Rgba,
}

/// Returns the body of `vehicle`, painted in `paint`.
pub(super) fn body(vehicle: &Vehicle, paint: Rgba) -> Mesh3D {
    let frusta = match vehicle.class {
        VehicleClass::Car => car(paint),
        VehicleClass::Truck => truck(paint),
        VehicleClass::Motorcycle => motorcycle(paint),
    };
    let mut solid = Solid::default();
    for frustum in &frusta {
        solid.add(frustum, &vehicle.dimensions);
    }
    solid.mesh()
}

fn car(paint: Rgba) -> Vec<Frustum> {
    let wheels = |at: f64| Frustum {
        along: [[at - 0.13, at + 0.13]; 2],
        across: [0.98, 0.98],
        up: [0.0, 0.38],
        colour: palette::TYRE,
    };
    vec![
        wheels(-0.6),
        wheels(0.6),
        Frustum { along: [[-1.0, 1.0], [-0.98, 0.96]], across: [0.94, 1.0], up: [0.14, 0.40], colour: paint },
        Frustum { along: [[-0.98, 0.96], [-0.94, 0.86]], across: [1.0, 0.92], up: [0.40, 0.60], colour: paint },
        Frustum {
            along: [[-0.90, 0.42], [-0.62, 0.08]],
            across: [0.88, 0.68],
            up: [0.60, 0.94],
            colour: palette::GLASS,
        },
        Frustum { along: [[-0.62, 0.08], [-0.56, 0.04]], across: [0.68, 0.64], up: [0.94, 1.0], colour: paint },
    ]
}

fn truck(paint: Rgba) -> Vec<Frustum> {
    let wheels = |at: f64| Frustum {
        along: [[at - 0.06, at + 0.06]; 2],
        across: [0.98, 0.98],
        up: [0.0, 0.25],
        colour: palette::TYRE,
    };
    vec![
        wheels(-0.75),
        wheels(-0.58),
        wheels(-0.41),
        wheels(0.52),
        wheels(0.84),
        Frustum { along: [[-1.0, 0.98]; 2], across: [0.4, 0.4], up: [0.14, 0.28], colour: palette::TYRE },
        Frustum { along: [[-1.0, 0.66]; 2], across: [1.0, 1.0], up: [0.28, 1.0], colour: palette::TRAILER },
        Frustum { along: [[0.72, 1.0], [0.72, 0.99]], across: [0.98, 0.98], up: [0.14, 0.45], colour: paint },
        Frustum { along: [[0.72, 0.99], [0.72, 0.95]], across: [0.98, 0.94], up: [0.45, 0.72], colour: palette::GLASS },
        Frustum { along: [[0.70, 0.95], [0.70, 0.84]], across: [0.96, 0.9], up: [0.72, 0.97], colour: paint },
    ]
}

fn motorcycle(paint: Rgba) -> Vec<Frustum> {
    let wheel = |at: f64| Frustum {
        along: [[at - 0.28, at + 0.28]; 2],
        across: [0.16, 0.16],
        up: [0.0, 0.40],
        colour: palette::TYRE,
    };
    vec![
        wheel(-0.7),
        wheel(0.7),
        Frustum { along: [[-0.85, 0.7], [-0.8, 0.55]], across: [0.35, 0.4], up: [0.25, 0.55], colour: paint },
        Frustum { along: [[0.35, 0.62], [0.30, 0.48]], across: [1.0, 0.5], up: [0.55, 0.68], colour: palette::TYRE },
        Frustum { along: [[-0.5, 0.0], [-0.15, 0.3]], across: [0.55, 0.6], up: [0.50, 0.84], colour: palette::GLASS },
        Frustum { along: [[0.0, 0.32], [0.04, 0.28]], across: [0.34, 0.3], up: [0.84, 1.0], colour: paint },
    ]
}

/// The triangle mesh of a body that is being built.
#[derive(Default)]
struct Solid {
    vertices: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    colours: Vec<Rgba>,
    triangles: Vec<[u32; 3]>,
}

impl Solid {
    /// Adds the faces of a frustum.
    fn add(&mut self, frustum: &Frustum, size: &Dimensions) {
        let corner = |level: usize, x: usize, left: f64| {
            [
                0.5 * size.length_m * frustum.along[level][x],
                0.5 * size.width_m * frustum.across[level] * left,
                size.height_m * frustum.up[level],
            ]
        };
        let ring =
            |level| [corner(level, 0, 1.0), corner(level, 0, -1.0), corner(level, 1, -1.0), corner(level, 1, 1.0)];
        let (below, above) = (ring(0), ring(1));
        for side in 0..4 {
            let next = (side + 1) % 4;
            self.add_face([below[side], below[next], above[next], above[side]], frustum.colour);
        }
        self.add_face(above, frustum.colour);
        self.add_face([below[3], below[2], below[1], below[0]], frustum.colour);
    }

    /// Adds a quadrilateral, whose corners are counter-clockwise as seen from outside. It has
    /// vertices and a normal of its own, so that it is shaded flat.
    fn add_face(&mut self, corners: [[f64; 3]; 4], colour: Rgba) {
        #[expect(clippy::cast_possible_truncation, reason = "a vehicle has some hundred vertices")]
        let first = self.vertices.len() as u32;
        let corners = corners.map(nalgebra::Vector3::from);
        let normal = (corners[2] - corners[0]).cross(&(corners[3] - corners[1]));
        let normal = normal.try_normalize(0.0).unwrap_or_else(nalgebra::Vector3::z);
        for corner in corners {
            self.vertices.push(corner.map(|value| value as f32).into());
            self.normals.push(normal.map(|value| value as f32).into());
            self.colours.push(colour);
        }
        self.triangles.push([first, first + 1, first + 2]);
        self.triangles.push([first, first + 2, first + 3]);
    }

    fn mesh(self) -> Mesh3D {
        Mesh3D::new(self.vertices)
            .with_triangle_indices(self.triangles)
            .with_vertex_normals(self.normals)
            .with_vertex_colors(self.colours)
    }
}
