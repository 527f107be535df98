//! The shapes of trucks: tractor with semi-trailer, and rigid truck.

use closecall_traffic::Vehicle;

use super::append_pair;
use crate::lidar::Material::{Glass, Lamp, Paint, Plastic, Plate, Tarpaulin, Tyre};
use crate::lidar::solid::{HalfWidth, Solid, corner};

/// Length of the cabin (m).
const CABIN_M: f64 = 2.3;
/// Gap between the cabin and the load (m): of a semi-trailer, which needs space to turn, and of a rigid truck's box.
const GAPS_M: [f64; 2] = [0.7, 0.15];
/// Height of the cabin's underside (m).
const CABIN_FLOOR_M: f64 = 0.35;
/// Height of the load's underside (m).
const LOAD_FLOOR_M: f64 = 1.1;
/// Height of the cabin's roof (share of the height).
const CABIN_TOP: f64 = 0.95;
/// Heights of the windscreen's lower and upper edge (share of the height of the cabin's roof).
const SCREEN: [f64; 2] = [0.50, 0.78];
const WHEEL_DIAMETER_M: f64 = 1.0;
const TYRE_WIDTH_M: f64 = 0.3;
/// Heights of the lower and upper edge of the lateral guards between the axles (m). UN Regulation 73 requires the
/// guards.
const GUARD_M: [f64; 2] = [0.5, 0.95];

pub(super) fn append(vehicle: &Vehicle, solids: &mut Vec<Solid>) {
    let size = vehicle.dimensions;
    let (front, half, top) = (0.5 * size.length_m, 0.5 * size.width_m, size.height_m);
    let gap = GAPS_M[usize::from(vehicle.appearance.body_shape) % GAPS_M.len()];
    append_cabin(front, half, CABIN_TOP * top, solids);
    let load_front = (front - CABIN_M - gap).max(-front + 0.5);
    solids.push(Solid::cuboid([-front, -half, LOAD_FLOOR_M.min(0.5 * top)], [load_front, half, top], Tarpaulin));
    // The chassis frame, a metre wide, joins the cabin and the load.
    solids.push(Solid::cuboid([-front + 0.3, -0.5, 0.6], [front - CABIN_M, 0.5, LOAD_FLOOR_M.min(0.5 * top)], Plastic));
    append_running_gear(front, half, load_front, solids);
}

fn append_cabin(front: f64, half: f64, top: f64, solids: &mut Vec<Solid>) {
    let skin = front - 0.02;
    let rear = front - CABIN_M;
    let screen = SCREEN.map(|share| share * top);
    let profile = [
        corner(skin, CABIN_FLOOR_M, Paint),
        corner(skin, screen[0], Glass),
        corner(skin - 0.10, screen[1], Paint),
        corner(skin - 0.35, top, Paint),
        corner(rear, top, Paint),
        corner(rear, CABIN_FLOOR_M, Plastic),
    ];
    solids.push(Solid::prism(&profile, HalfWidth::straight(half - 0.02), Paint));
    let base = front - 0.2;
    solids.push(Solid::cuboid([base, -0.7 * half, 0.75], [front - 0.01, 0.7 * half, screen[0] - 0.3], Plastic));
    solids.push(Solid::cuboid([base, -0.26, 0.50], [front, 0.26, 0.61], Plate));
    append_pair([base, 0.66 * half, 0.55], [front - 0.01, 0.95 * half, 0.80], Lamp, solids);
}

/// Appends the wheels and the lateral guards between them.
fn append_running_gear(front: f64, half: f64, load_front: f64, solids: &mut Vec<Solid>) {
    let rear = -front;
    let length = 2.0 * front;
    // One block for each axle group: steered axle, driven axle, and the three axles at the rear of a long vehicle.
    let rear_group_m = if length > 10.0 { 3.0 * WHEEL_DIAMETER_M + 0.6 } else { WHEEL_DIAMETER_M };
    let rear_from = rear + 0.1 * length;
    let groups = [
        [front - 1.9, front - 1.9 + WHEEL_DIAMETER_M],
        [load_front - 2.0, load_front - 2.0 + WHEEL_DIAMETER_M],
        [rear_from, rear_from + rear_group_m],
    ];
    for [from, to] in groups {
        append_pair([from, half - TYRE_WIDTH_M, 0.0], [to, half, WHEEL_DIAMETER_M], Tyre, solids);
    }
    let [guard_from, guard_to] = [rear_from + rear_group_m + 0.1, load_front - 2.1];
    if guard_to > guard_from {
        append_pair([guard_from, half - 0.1, GUARD_M[0]], [guard_to, half - 0.02, GUARD_M[1]], Plastic, solids);
    }
}
