//! The shapes of motorcycles with their riders: with and without a fairing. They have no plate in front.

use closecall_traffic::Vehicle;

use super::append_pair;
use crate::lidar::Material::{Glass, Lamp, Paint, Plastic, Textile, Tyre};
use crate::lidar::solid::{HalfWidth, Solid, corner};

const WHEEL_DIAMETER_M: f64 = 0.62;
const TYRE_HALF_WIDTH_M: f64 = 0.07;
/// Half the width of the front above the wheel (m): of fork and lamp, and of a fairing.
const FRONT_HALF_WIDTHS_M: [f64; 2] = [0.13, 0.27];
const TORSO_HALF_WIDTH_M: f64 = 0.25;
const HELMET_HALF_WIDTH_M: f64 = 0.14;
const HELMET_HEIGHT_M: f64 = 0.28;

pub(super) fn append(vehicle: &Vehicle, solids: &mut Vec<Solid>) {
    let size = vehicle.dimensions;
    let (front, half, top) = (0.5 * size.length_m, 0.5 * size.width_m, size.height_m);
    let shape = usize::from(vehicle.appearance.body_shape) % FRONT_HALF_WIDTHS_M.len();
    for from in [-front, front - WHEEL_DIAMETER_M] {
        let low = [from, -TYRE_HALF_WIDTH_M, 0.0];
        solids.push(Solid::cuboid(low, [from + WHEEL_DIAMETER_M, TYRE_HALF_WIDTH_M, WHEEL_DIAMETER_M], Tyre));
    }
    append_front(front, half, FRONT_HALF_WIDTHS_M[shape].min(half), solids);
    // Engine and seat.
    solids.push(Solid::cuboid([-front + 0.4, -0.2, 0.25], [front - 0.65, 0.2, 0.55], Plastic));
    solids.push(Solid::cuboid([-front + 0.15, -0.17, 0.55], [front - 0.7, 0.17, 0.85], Paint));
    append_rider(front, top, solids);
}

fn append_front(front: f64, half: f64, half_width: f64, solids: &mut Vec<Solid>) {
    let fairing = [
        corner(front - 0.20, 0.62, Paint),
        corner(front - 0.15, 0.90, Glass),
        corner(front - 0.45, 1.18, Glass),
        corner(front - 0.75, 0.62, Plastic),
    ];
    solids.push(Solid::prism(&fairing, HalfWidth { bottom_m: half_width, top_m: 0.7 * half_width }, Paint));
    solids.push(Solid::cuboid([front - 0.25, -0.09, 0.74], [front - 0.12, 0.09, 0.88], Lamp));
    // Handlebar with hands and mirrors.
    append_pair([front - 0.75, 0.2, 0.95], [front - 0.60, half, 1.07], Textile, solids);
}

fn append_rider(front: f64, top: f64, solids: &mut Vec<Solid>) {
    let chin = top - HELMET_HEIGHT_M;
    let torso = [
        corner(front - 1.15, 0.80, Textile),
        corner(front - 0.95, chin - 0.05, Textile),
        corner(front - 1.15, chin, Textile),
        corner(front - 1.45, 0.80, Textile),
    ];
    solids.push(Solid::prism(&torso, HalfWidth::straight(TORSO_HALF_WIDTH_M), Textile));
    // Thighs and knees.
    append_pair([front - 1.35, 0.14, 0.55], [front - 0.80, 0.30, 0.80], Textile, solids);
    let [low, high] = [front - 1.20, front - 0.92];
    solids.push(Solid::cuboid([low, -HELMET_HALF_WIDTH_M, chin], [high, HELMET_HALF_WIDTH_M, top], Textile));
}
