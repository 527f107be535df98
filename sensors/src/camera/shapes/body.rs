//! The mesh of a vehicle, by its body shape.

use super::super::mesh::{Mesh, Surface, Vec3};
use super::{car, motorcycle, truck};
use closecall_traffic::bodies::Proportions;
use closecall_traffic::{BodyShape, Dimensions, Vehicle};

/// The body shapes that are reserved for evaluation.
pub const HELD_OUT_SHAPES: [BodyShape; 6] =
    [BodyShape::Coupe, BodyShape::Minivan, BodyShape::Tanker, BodyShape::Coach, BodyShape::Tourer, BodyShape::Chopper];

/// Builds the body of a vehicle in its own frame.
pub(crate) fn vehicle(vehicle: &Vehicle) -> Mesh {
    let mut mesh = Mesh::default();
    build_vehicle(&mut mesh, vehicle);
    mesh
}

/// Replaces `mesh` by the body of a vehicle in its own frame.
pub(crate) fn build_vehicle(mesh: &mut Mesh, vehicle: &Vehicle) {
    mesh.clear();
    let look = &vehicle.appearance;
    let paint = Surface::plain(look.paint_rgb.map(linear), 0.6);
    let body = Body { size: vehicle.dimensions, paint };
    match Proportions::of(look.body_shape) {
        Proportions::Car(shape) => car::append(mesh, &body, shape),
        Proportions::Truck(shape) => truck::append(mesh, &body, shape),
        Proportions::Motorcycle(shape) => motorcycle::append(mesh, &body, shape),
    }
}

/// The parameters from which a body is built.
pub(super) struct Body {
    pub(super) size: Dimensions,
    pub(super) paint: Surface,
}

impl Body {
    /// Returns length, width and height (m).
    pub(super) fn extents(&self) -> Vec3 {
        [self.size.length_m as f32, self.size.width_m as f32, self.size.height_m as f32]
    }
}

/// Converts an sRGB value to linear reflectance by a square, the inverse of the camera's
/// square-root encoding.
fn linear(value: u8) -> f32 {
    let share = f32::from(value) / 255.0;
    share * share
}

#[cfg(test)]
mod tests {
    use closecall_traffic::VehicleClass;

    use super::*;

    /// Maximum overhang of mirrors and handlebars beyond the box (m).
    const OVERHANG_M: f32 = 0.25;

    #[test]
    fn every_shape_fills_its_box_and_exceeds_it_only_by_mirrors_and_handlebars() {
        for class in VehicleClass::ALL {
            for &shape in BodyShape::of_class(class) {
                let mut typical = Vehicle::typical(class);
                typical.appearance.body_shape = shape;
                typical.dimensions = shape.usual_dimensions();
                let mesh = vehicle(&typical);
                let size = typical.dimensions;
                let half = [size.length_m / 2.0, size.width_m / 2.0].map(|half| half as f32);
                let extent = |axis: usize| mesh.vertices.iter().map(|v| v[axis].abs()).fold(0.0, f32::max);
                for axis in [0, 1] {
                    let name = format!("{shape} axis {axis}: {} of {}", extent(axis), half[axis]);
                    assert!(extent(axis) <= half[axis] + OVERHANG_M, "{name}");
                    assert!(extent(axis) >= half[axis] - 0.05, "{name}");
                }
                let top = extent(2);
                assert!((top - size.height_m as f32).abs() < 0.12, "{shape} top {top} of {}", size.height_m);
                assert!(!mesh.lamps.is_empty(), "{shape} has no lamps");
            }
        }
    }

    #[test]
    fn held_out_shapes_exist_and_leave_enough_to_train_on() {
        for class in VehicleClass::ALL {
            let held_out = HELD_OUT_SHAPES.iter().filter(|shape| shape.class() == class).count();
            assert!(held_out > 0 && BodyShape::of_class(class).len() >= held_out + 3);
        }
    }
}
