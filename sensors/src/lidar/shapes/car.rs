//! Passenger cars: saloon, hatchback, sport utility vehicle, van.

use closecall_traffic::Vehicle;

use super::append_pair;
use crate::lidar::Material::{Glass, Lamp, Paint, Plastic, Plate, Tyre};
use crate::lidar::solid::{HalfWidth, Solid, corner};

/// Proportions of a body: lengths behind the front end, and heights as shares of the car's.
struct Body {
    /// Height of the bonnet's front edge (share of the height).
    nose: f64,
    /// Height of the belt line, where the windows begin (share of the height).
    belt: f64,
    /// Foot of the windscreen behind the front end (share of the length).
    screen_foot: f64,
    /// Front edge of the roof behind the front end (share of the length).
    roof_front: f64,
    /// Rear edge of the roof before the rear end (share of the length).
    roof_rear: f64,
    /// Foot of the rear window before the rear end (share of the length).
    rear_foot: f64,
    /// Height of the bumper's lower lip (m).
    ground_clearance_m: f64,
}

const BODIES: [Body; 4] = [
    // Saloon.
    Body {
        nose: 0.53,
        belt: 0.65,
        screen_foot: 0.26,
        roof_front: 0.43,
        roof_rear: 0.27,
        rear_foot: 0.10,
        ground_clearance_m: 0.18,
    },
    // Hatchback or estate.
    Body {
        nose: 0.53,
        belt: 0.64,
        screen_foot: 0.24,
        roof_front: 0.41,
        roof_rear: 0.08,
        rear_foot: 0.02,
        ground_clearance_m: 0.18,
    },
    // Sport utility vehicle.
    Body {
        nose: 0.58,
        belt: 0.66,
        screen_foot: 0.25,
        roof_front: 0.41,
        roof_rear: 0.07,
        rear_foot: 0.02,
        ground_clearance_m: 0.24,
    },
    // Van.
    Body {
        nose: 0.54,
        belt: 0.60,
        screen_foot: 0.16,
        roof_front: 0.31,
        roof_rear: 0.03,
        rear_foot: 0.01,
        ground_clearance_m: 0.20,
    },
];

/// How far the cabin's roof is narrower than its belt, on each side (share of the width).
const TUMBLEHOME: f64 = 0.09;
/// How far things stand out from the painted front (m).
const PROTRUSION_M: f64 = 0.01;
/// European plate: 520 × 110 mm (Council Regulation (EC) No 2411/98 gives its layout).
const PLATE_HALF_WIDTH_M: f64 = 0.26;
const PLATE_HEIGHT_M: f64 = 0.11;
const WHEEL_DIAMETER_M: f64 = 0.65;
const TYRE_WIDTH_M: f64 = 0.21;
/// Axle behind the front end, and before the rear end (share of the length).
const OVERHANG: f64 = 0.19;

pub(super) fn append(vehicle: &Vehicle, solids: &mut Vec<Solid>) {
    let size = vehicle.dimensions;
    let (front, half, top) = (0.5 * size.length_m, 0.5 * size.width_m, size.height_m);
    let body = &BODIES[usize::from(vehicle.appearance.body_shape) % BODIES.len()];
    let (nose, belt, floor) = (body.nose * top, body.belt * top, body.ground_clearance_m);
    let from_front = |share: f64| front - share * size.length_m;
    let from_rear = |share: f64| -front + share * size.length_m;
    // Nothing stands further forward than the front end: the body begins where plate and lamps end.
    let skin = front - PROTRUSION_M;
    let hull = [
        corner(skin - 0.04, floor, Paint),
        corner(skin, 0.5 * (floor + nose), Paint),
        corner(skin - 0.06, nose, Paint),
        corner(from_front(body.screen_foot), belt, Paint),
        corner(-front, belt, Paint),
        corner(-front, floor, Plastic),
    ];
    solids.push(Solid::prism(&hull, HalfWidth::straight(half), Paint));
    let cabin = [
        corner(from_front(body.screen_foot), belt, Glass),
        corner(from_front(body.roof_front), top, Paint),
        corner(from_rear(body.roof_rear), top, Glass),
        corner(from_rear(body.rear_foot), belt, Paint),
    ];
    let taper = HalfWidth { bottom_m: 0.97 * half, top_m: (0.97 - 2.0 * TUMBLEHOME) * half };
    solids.push(Solid::prism(&cabin, taper, Glass));
    append_front(front, half, [floor, nose], solids);
    append_wheels(front, half, size.length_m, solids);
}

/// Grille, plate and lamps, which stand a little before the painted front.
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
