//! The shapes of passenger cars: a hull, a cabin with windows on top of it, and the details of the
//! front.

use closecall_traffic::Dimensions;

use super::append_pair;
use crate::lidar::Material::{Glass, Lamp, Paint, Plastic, Plate, Tyre};
use crate::lidar::solid::{HalfWidth, Solid, corner};
use closecall_traffic::bodies::{CarProportions, GREENHOUSE_FOOT_HALF_WIDTH};

/// Protrusion of the plate from the painted front (m). Grille and lamps protrude by half of it.
const PROTRUSION_M: f64 = 0.01;
/// European plate: 520 × 110 mm (Council Regulation (EC) No 2411/98 gives its layout).
const PLATE_HALF_WIDTH_M: f64 = 0.26;
const PLATE_HEIGHT_M: f64 = 0.11;
const WHEEL_DIAMETER_M: f64 = 0.65;
const TYRE_WIDTH_M: f64 = 0.21;
/// Distance of each axle from the nearer end of the car (share of the length).
const OVERHANG: f64 = 0.19;

pub(super) fn append(size: &Dimensions, shape: &CarProportions, solids: &mut Vec<Solid>) {
    let (front, half, top) = (0.5 * size.length_m, 0.5 * size.width_m, size.height_m);
    let [nose, belt, floor] = [shape.nose, shape.belt, shape.clearance].map(|share| f64::from(share) * top);
    let from_front = |share: f32| front - f64::from(share) * size.length_m;
    // The plate ends exactly at the front end of the bounding box, so the painted body begins
    // behind it.
    let skin = front - PROTRUSION_M;
    let hull = [
        corner(skin - 0.04, floor, Paint),
        corner(skin, 0.5 * (floor + nose), Paint),
        corner(skin - 0.06, nose, Paint),
        corner(from_front(shape.cowl), belt, Paint),
        corner(-front, belt, Paint),
        corner(-front, floor, Plastic),
    ];
    solids.push(Solid::prism(&hull, HalfWidth::straight(half), Paint));
    let cabin = [
        corner(from_front(shape.cowl), belt, Glass),
        corner(from_front(shape.roof_front), top, Paint),
        corner(from_front(shape.roof_rear), top, Glass),
        corner(from_front(shape.deck), belt, Paint),
    ];
    let [bottom_m, top_m] =
        [GREENHOUSE_FOOT_HALF_WIDTH, shape.roof_half_width].map(|share| f64::from(share) * size.width_m);
    solids.push(Solid::prism(&cabin, HalfWidth { bottom_m, top_m }, Glass));
    append_front(front, half, [floor, nose], solids);
    append_wheels(front, half, size.length_m, solids);
}

/// Appends grille, plate and lamps, which protrude slightly from the painted front.
fn append_front(front: f64, half: f64, [floor, nose]: [f64; 2], solids: &mut Vec<Solid>) {
    let height = nose - floor;
    let at = |share: f64| floor + share * height;
    let base = front - 0.1;
    solids.push(Solid::cuboid(
        [base, -0.55 * half, at(0.12)],
        [front - 0.5 * PROTRUSION_M, 0.55 * half, at(0.62)],
        Plastic,
    ));
    let plate = at(0.38);
    solids.push(Solid::cuboid(
        [base, -PLATE_HALF_WIDTH_M, plate - 0.5 * PLATE_HEIGHT_M],
        [front, PLATE_HALF_WIDTH_M, plate + 0.5 * PLATE_HEIGHT_M],
        Plate,
    ));
    append_pair([base, 0.58 * half, at(0.68)], [front - 0.5 * PROTRUSION_M, 0.92 * half, at(0.93)], Lamp, solids);
}

fn append_wheels(front: f64, half: f64, length: f64, solids: &mut Vec<Solid>) {
    for axle in [front - OVERHANG * length, -front + OVERHANG * length] {
        let low = [axle - 0.5 * WHEEL_DIAMETER_M, half - TYRE_WIDTH_M, 0.0];
        append_pair(low, [axle + 0.5 * WHEEL_DIAMETER_M, half + 0.01, WHEEL_DIAMETER_M], Tyre, solids);
    }
}
