//! The solids of a vehicle, by its body shape.

use super::super::Material;
use super::super::solid::Solid;
use super::{car, motorcycle, truck};
use closecall_traffic::Vehicle;
use closecall_traffic::bodies::Proportions;

/// Appends the solids of a vehicle, in its own frame.
pub(crate) fn append_solids(vehicle: &Vehicle, solids: &mut Vec<Solid>) {
    let size = &vehicle.dimensions;
    match Proportions::of(vehicle.appearance.body_shape) {
        Proportions::Car(shape) => car::append(size, shape, solids),
        Proportions::Truck(shape) => truck::append(size, shape, solids),
        Proportions::Motorcycle(shape) => motorcycle::append(size, shape, solids),
    }
}

/// Appends a block and its mirror image on the other side of y = 0.
pub(super) fn append_pair(low: [f64; 3], high: [f64; 3], material: Material, solids: &mut Vec<Solid>) {
    solids.push(Solid::cuboid(low, high, material));
    solids.push(Solid::cuboid([low[0], -high[1], low[2]], [high[0], -low[1], high[2]], material));
}

#[cfg(test)]
mod tests {
    use closecall_traffic::{BodyShape, VehicleClass};

    use super::*;

    #[test]
    fn every_shape_fills_its_bounding_box() {
        for class in VehicleClass::ALL {
            for &shape in BodyShape::of_class(class) {
                let mut vehicle = Vehicle::typical(class);
                vehicle.appearance.body_shape = shape;
                let mut solids = Vec::new();
                append_solids(&vehicle, &mut solids);
                let size = vehicle.dimensions;
                let half = [0.5 * size.length_m, 0.5 * size.width_m];
                let most = |axis: usize| solids.iter().map(|solid| solid.high[axis]).fold(f64::MIN, f64::max);
                let least = |axis: usize| solids.iter().map(|solid| solid.low[axis]).fold(f64::MAX, f64::min);
                for (axis, half) in half.into_iter().enumerate() {
                    assert!((most(axis) - half).abs() < 0.03, "{shape}: {} for {half}", most(axis));
                    assert!((least(axis) + half).abs() < 0.03, "{shape}");
                }
                assert!((most(2) - size.height_m).abs() < 0.03, "{shape}: {}", most(2));
                assert!(least(2) >= 0.0 && least(2) < 0.05, "{shape}: wheels stand on the ground");
            }
        }
    }
}
