//! The shapes of passenger cars: saloon, hatchback or estate, sport utility vehicle, van.

use closecall_traffic::Vehicle;

use super::append_pair;
use crate::lidar::Material::{Glass, Lamp, Paint, Plastic, Plate, Tyre};
use crate::lidar::solid::{HalfWidth, Solid, corner};

/// The proportions of a car's body.
struct Body {
    /// Height of the bonnet's front edge (share of the height).
    nose: f64,
    /// Height of the belt line, where the windows begin (share of the height).
    belt: f64,
    /// Distance of the windscreen's foot from the front end (share of the length).
    screen_foot: f64,
    /// Distance of the roof's front edge from the front end (share of the length).
    roof_front: f64,
    /// Distance of the roof's rear edge from the rear end (share of the length).
    roof_rear: f64,
    /// Distance of the rear window's foot from the rear end (share of the length).
    rear_foot: f64,
    /// Height of the bumper's lower edge (m).
    ground_clearance_m: f64,
}

/// The body shapes, which `Appearance::body_shape` selects.
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

/// Inward lean of the windows: by how much the roof is narrower than the belt line on each side (share of the width).
const TUMBLEHOME: f64 = 0.09;
/// Protrusion of the plate from the painted front (m). Grille and lamps protrude by half of it.
const PROTRUSION_M: f64 = 0.01;
/// European plate: 520 × 110 mm (Council Regulation (EC) No 2411/98 gives its layout).
const PLATE_HALF_WIDTH_M: f64 = 0.26;
const PLATE_HEIGHT_M: f64 = 0.11;
const WHEEL_DIAMETER_M: f64 = 0.65;
const TYRE_WIDTH_M: f64 = 0.21;
/// Distance of each axle from the nearer end of the car (share of the length).
const OVERHANG: f64 = 0.19;

pub(super) fn append(vehicle: &Vehicle, solids: &mut Vec<Solid>) {
    let size = vehicle.dimensions;
    let (front, half, top) = (0.5 * size.length_m, 0.5 * size.width_m, size.height_m);
    let body = &BODIES[usize::from(vehicle.appearance.body_shape) % BODIES.len()];
    let (nose, belt, floor) = (body.nose * top, body.belt * top, body.ground_clearance_m);
    let from_front = |share: f64| front - share * size.length_m;
    let from_rear = |share: f64| -front + share * size.length_m;
    // The plate ends exactly at the front end of the bounding box, so the painted body begins behind it.
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
