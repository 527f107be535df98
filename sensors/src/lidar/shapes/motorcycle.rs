//! The shapes of motorcycles with their riders. They have no plate in front.

use closecall_traffic::Dimensions;

use super::append_pair;
use crate::lidar::Material::{Glass, Lamp, Paint, Plastic, Textile, Tyre};
use crate::lidar::solid::{HalfWidth, Solid, corner};
use closecall_traffic::bodies::{HEAD_BACK_M, HIP_X_M, MotorcycleProportions, RIDER, WHEEL_RADIUS_M};

const TYRE_HALF_WIDTH_M: f64 = 0.07;
/// Half of the width of fork, lamp and instruments without a fairing (m).
const FORK_HALF_WIDTH_M: f64 = 0.13;
/// Height of their upper edge without a fairing (m).
const FORK_TOP_M: f64 = 1.0;
/// Half of the height of the handlebar with hands and controls (m).
const BAR_HALF_HEIGHT_M: f64 = 0.06;
const TORSO_HALF_WIDTH_M: f64 = 0.25;

pub(super) fn append(size: &Dimensions, shape: &MotorcycleProportions, solids: &mut Vec<Solid>) {
    let (front, half) = (0.5 * size.length_m, 0.5 * size.width_m);
    let wheel_m = 2.0 * f64::from(WHEEL_RADIUS_M);
    for from in [-front, front - wheel_m] {
        let low = [from, -TYRE_HALF_WIDTH_M, 0.0];
        solids.push(Solid::cuboid(low, [from + wheel_m, TYRE_HALF_WIDTH_M, wheel_m], Tyre));
    }
    append_front(size, shape, solids);
    // Engine and seat.
    solids.push(Solid::cuboid([-front + 0.4, -0.2, 0.25], [front - 0.65, 0.2, 0.55], Plastic));
    solids.push(Solid::cuboid([-front + 0.15, -0.17, 0.55], [front - 0.7, 0.17, 0.85], Paint));
    if shape.cases_m > 0.0 {
        let low = [-0.6 * front - 0.28, half - f64::from(shape.cases_m), 0.40];
        append_pair(low, [-0.6 * front + 0.28, half, 0.84], Paint, solids);
    }
    append_rider(front, size.height_m, f64::from(shape.lean_m), solids);
}

fn append_front(size: &Dimensions, shape: &MotorcycleProportions, solids: &mut Vec<Solid>) {
    let (front, half) = (0.5 * size.length_m, 0.5 * size.width_m);
    let head = front - f64::from(HEAD_BACK_M);
    let (half_width, upper) = match shape.fairing {
        None => (FORK_HALF_WIDTH_M, FORK_TOP_M),
        Some(fairing) => (f64::from(fairing.half_width_m), f64::from(fairing.top) * size.height_m),
    };
    let half_width = half_width.min(half);
    let profile = [
        corner(front - 0.20, 0.62, Paint),
        corner(front - 0.15, 0.85, Glass),
        corner(head - 0.05, upper, Glass),
        corner(head - 0.30, 0.62, Plastic),
    ];
    solids.push(Solid::prism(&profile, HalfWidth { bottom_m: half_width, top_m: 0.7 * half_width }, Paint));
    solids.push(Solid::cuboid([front - 0.25, -0.09, 0.74], [front - 0.12, 0.09, 0.88], Lamp));
    let bar = f64::from(shape.bar) * size.height_m;
    let [low, high] = [bar - BAR_HALF_HEIGHT_M, bar + BAR_HALF_HEIGHT_M];
    solids.push(Solid::cuboid([head - 0.2, -half, low], [head - 0.05, half, high], Textile));
}

fn append_rider(front: f64, top: f64, lean: f64, solids: &mut Vec<Solid>) {
    let hip = f64::from(HIP_X_M);
    let seat = f64::from(RIDER.seat) * top;
    let shoulder = top - f64::from(RIDER.shoulder_below_top_m);
    let torso = [
        corner(hip + 0.14, seat, Textile),
        corner(hip + lean + 0.16, shoulder - 0.10, Textile),
        corner(hip + lean + 0.06, shoulder, Textile),
        corner(hip + lean - 0.12, shoulder - 0.05, Textile),
        corner(hip - 0.14, seat, Textile),
    ];
    solids.push(Solid::prism(&torso, HalfWidth::straight(TORSO_HALF_WIDTH_M), Textile));
    // Thighs and knees.
    append_pair([front - 1.35, 0.14, 0.55], [front - 0.80, 0.30, 0.80], Textile, solids);
    let [along, across, _] = RIDER.head_radii_m.map(f64::from);
    let head = hip + lean + f64::from(RIDER.head_ahead_m);
    let chin = top - 2.0 * f64::from(RIDER.head_below_top_m);
    solids.push(Solid::cuboid([head - along, -across, chin], [head + along, across, top], Textile));
}
