//! Body shapes: the geometry of vehicles of each class and of roadside furniture.
//!
//! A shape is a set of proportions that is scaled to the vehicle's box, so that the camera sees the same extents as the
//! LiDAR measures. The shapes in [`HELD_OUT_SHAPES`] never appear in training: the model card evaluates the classifier
//! on them.

mod car;
mod motorcycle;
mod roadside;
mod truck;

use closecall_traffic::{Dimensions, Vehicle, VehicleClass};

use super::mesh::{Mesh, Surface, Vec3};

pub(crate) use roadside::roadside;

/// Number of body shapes of each class, in the order of [`VehicleClass::ALL`].
pub const SHAPE_COUNTS: [u8; 3] = [car::SHAPES.len() as u8, truck::SHAPES.len() as u8, motorcycle::SHAPES.len() as u8];

/// The indices of the shapes of each class that are reserved for evaluation, in the order of [`VehicleClass::ALL`].
pub const HELD_OUT_SHAPES: [&[u8]; 3] = [&[3, 7], &[2, 5], &[2, 4]];

/// Builds the body of a vehicle in its own frame.
pub(crate) fn vehicle(vehicle: &Vehicle) -> Mesh {
    let look = &vehicle.appearance;
    let paint = Surface::plain(look.paint_rgb.map(linear), 0.6);
    let body = Body { size: vehicle.dimensions, paint, shape: look.body_shape };
    match vehicle.class {
        VehicleClass::Car => car::mesh(&body),
        VehicleClass::Truck => truck::mesh(&body),
        VehicleClass::Motorcycle => motorcycle::mesh(&body),
    }
}

/// Returns the usual dimensions of a body shape. The index `shape` is taken modulo the number of shapes.
pub fn usual_dimensions(class: VehicleClass, shape: u8) -> Dimensions {
    let index = usize::from(shape % SHAPE_COUNTS[class as usize]);
    let [length_m, width_m, height_m] = match class {
        VehicleClass::Car => car::SHAPES[index].usual_m,
        VehicleClass::Truck => truck::SHAPES[index].usual_m,
        VehicleClass::Motorcycle => motorcycle::SHAPES[index].usual_m,
    };
    Dimensions { length_m, width_m, height_m }
}

/// The parameters from which a body is built.
struct Body {
    size: Dimensions,
    paint: Surface,
    shape: u8,
}

impl Body {
    /// Returns length, width and height (m).
    fn extents(&self) -> Vec3 {
        [self.size.length_m as f32, self.size.width_m as f32, self.size.height_m as f32]
    }
}

/// Converts an sRGB value to linear reflectance by a square, the inverse of the camera's square-root encoding.
fn linear(value: u8) -> f32 {
    let share = f32::from(value) / 255.0;
    share * share
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Maximum overhang of mirrors and handlebars beyond the box (m).
    const OVERHANG_M: f32 = 0.25;

    #[test]
    fn every_shape_fills_its_box_and_exceeds_it_only_by_mirrors_and_handlebars() {
        for class in VehicleClass::ALL {
            for shape in 0..SHAPE_COUNTS[class as usize] {
                let mut typical = Vehicle::typical(class);
                typical.appearance.body_shape = shape;
                typical.dimensions = usual_dimensions(class, shape);
                let mesh = vehicle(&typical);
                let size = typical.dimensions;
                let half = [size.length_m / 2.0, size.width_m / 2.0].map(|half| half as f32);
                let extent = |axis: usize| mesh.vertices.iter().map(|v| v[axis].abs()).fold(0.0, f32::max);
                for axis in [0, 1] {
                    let name = format!("{class:?} {shape} axis {axis}: {} of {}", extent(axis), half[axis]);
                    assert!(extent(axis) <= half[axis] + OVERHANG_M, "{name}");
                    assert!(extent(axis) >= half[axis] - 0.05, "{name}");
                }
                let top = extent(2);
                assert!((top - size.height_m as f32).abs() < 0.12, "{class:?} {shape} top {top} of {}", size.height_m);
                assert!(!mesh.lamps.is_empty(), "{class:?} {shape} has no lamps");
            }
        }
    }

    #[test]
    fn held_out_shapes_exist_and_leave_enough_to_train_on() {
        for class in VehicleClass::ALL {
            let held_out = HELD_OUT_SHAPES[class as usize];
            assert!(held_out.iter().all(|shape| *shape < SHAPE_COUNTS[class as usize]));
            assert!(usize::from(SHAPE_COUNTS[class as usize]) >= held_out.len() + 3);
        }
    }
}
