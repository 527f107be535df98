//! The bodies of vehicles as plain triangles, for cameras other than the rear camera.

use closecall_traffic::Vehicle;

use super::shapes;

/// A triangle of a vehicle's body, in the frame of the vehicle: x forward, y left, z up, with the
/// origin on the ground below the centre of its box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyTriangle {
    /// The corners (m), counter-clockwise as seen from outside.
    pub corners_m: [[f32; 3]; 3],
    /// Diffuse reflectance of linear red, green and blue (0 to 1).
    pub albedo: [f32; 3],
}

/// Returns the body of a vehicle as triangles.
pub fn body_triangles(vehicle: &Vehicle) -> Vec<BodyTriangle> {
    let mesh = shapes::vehicle(vehicle);
    let triangle = |face: &super::mesh::Face| BodyTriangle {
        corners_m: face.corners.map(|corner| mesh.vertices[usize::from(corner)]),
        albedo: face.surface.albedo,
    };
    mesh.faces.iter().map(triangle).collect()
}
