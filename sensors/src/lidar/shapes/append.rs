//! The solids of a vehicle, by its body shape.

use super::super::Material;
use super::super::solid::Solid;
use super::{car, motorcycle, truck};
use closecall_traffic::bodies::Proportions;
use closecall_traffic::{Vehicle, VehicleClass};

/// Appends the solids of a vehicle, in its own frame.
pub(crate) fn append_solids(vehicle: &Vehicle, solids: &mut Vec<Solid>) {
    let size = &vehicle.dimensions;
    match Proportions::of(vehicle.appearance.body_shape) {
        Proportions::Car(shape) => car::append(size, shape, solids),
        Proportions::Truck(shape) => truck::append(size, shape, solids),
        Proportions::Motorcycle(shape) => motorcycle::append(size, shape, solids),
    }
}

/// Height of the middle of the rear plate (m): between 0.30 m for its lower and 1.20 m for its
/// upper edge, which Commission Regulation (EU) No 1003/2010 allows (assumption).
const REAR_PLATE_M: f64 = 0.75;
/// Half extents of the rear plate of a motorcycle, and of other vehicles (m): 180 × 200 mm and 520
/// × 110 mm.
const REAR_PLATES_M: [[f64; 2]; 2] = [[0.09, 0.10], [0.26, 0.055]];
/// Distance by which the rear plate stands out from the rear end (m).
const REAR_PLATE_OUT_M: f64 = 0.01;

/// Appends the plate at the rear of a vehicle, which only a sensor behind the vehicle sees.
pub(crate) fn append_rear_plate(vehicle: &Vehicle, solids: &mut Vec<Solid>) {
    let rear = -0.5 * vehicle.dimensions.length_m;
    let [half, up] = REAR_PLATES_M[usize::from(vehicle.class != VehicleClass::Motorcycle)];
    let low = [rear - REAR_PLATE_OUT_M, -half, REAR_PLATE_M - up];
    solids.push(Solid::cuboid(low, [rear + 0.1, half, REAR_PLATE_M + up], Material::Plate));
}

/// Appends a block and its mirror image on the other side of y = 0.
pub(super) fn append_pair(low: [f64; 3], high: [f64; 3], material: Material, solids: &mut Vec<Solid>) {
    solids.push(Solid::cuboid(low, high, material));
    solids.push(Solid::cuboid([low[0], -high[1], low[2]], [high[0], -low[1], high[2]], material));
}

#[cfg(test)]
mod tests {
    use closecall_traffic::BodyShape;

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
