//! Passenger cars: a lower body, a greenhouse with windows on top of it, and the details of the front.
//!
//! ```text
//!            roof ________
//!               /  glass  \___ deck          heights are shares of the car's height,
//!   cowl ______/            \  |             positions are shares of its length, from the front
//!  nose /   bonnet             |
//!       |_( )____________( )___|
//! ```

use super::Body;
use crate::camera::mesh::{Emission, Mesh, Rib, Surface};

/// Proportions of one body shape.
pub(super) struct CarShape {
    /// Usual length, width and height (m).
    pub(super) usual_m: [f64; 3],
    /// Height of the nose's upper edge, and of the belt line below the windows (shares of the height).
    nose_belt: [f32; 2],
    /// Position of the windscreen's lower edge and of the roof's front edge (shares of the length, from the front).
    cowl_roof: [f32; 2],
    /// Position of the roof's rear edge and of the rear window's lower edge (shares of the length, from the front).
    roof_end_deck: [f32; 2],
    /// Half the width of the roof (share of the width).
    roof_half: f32,
    /// Half width and half height of a headlamp (shares of width and height).
    lamp: [f32; 2],
    /// Half width and half height of the grille (shares of width and height).
    grille: [f32; 2],
    /// Ground clearance below the body (share of the height).
    clearance: f32,
}

/// The body shapes in order: saloon, hatchback, estate, coupé, sport utility vehicle, van, small city car, minivan,
/// pickup.
pub(super) const SHAPES: [CarShape; 9] = [
    CarShape {
        usual_m: [4.75, 1.84, 1.45],
        nose_belt: [0.52, 0.64],
        cowl_roof: [0.27, 0.41],
        roof_end_deck: [0.70, 0.86],
        roof_half: 0.36,
        lamp: [0.11, 0.045],
        grille: [0.19, 0.065],
        clearance: 0.12,
    },
    CarShape {
        usual_m: [4.3, 1.8, 1.48],
        nose_belt: [0.54, 0.63],
        cowl_roof: [0.24, 0.40],
        roof_end_deck: [0.88, 0.98],
        roof_half: 0.37,
        lamp: [0.10, 0.055],
        grille: [0.22, 0.03],
        clearance: 0.12,
    },
    CarShape {
        usual_m: [4.85, 1.86, 1.5],
        nose_belt: [0.52, 0.62],
        cowl_roof: [0.26, 0.40],
        roof_end_deck: [0.92, 0.99],
        roof_half: 0.37,
        lamp: [0.12, 0.04],
        grille: [0.17, 0.08],
        clearance: 0.12,
    },
    CarShape {
        usual_m: [4.5, 1.88, 1.33],
        nose_belt: [0.52, 0.66],
        cowl_roof: [0.32, 0.48],
        roof_end_deck: [0.66, 0.93],
        roof_half: 0.33,
        lamp: [0.12, 0.04],
        grille: [0.25, 0.05],
        clearance: 0.09,
    },
    CarShape {
        usual_m: [4.7, 1.92, 1.72],
        nose_belt: [0.58, 0.64],
        cowl_roof: [0.25, 0.37],
        roof_end_deck: [0.90, 0.99],
        roof_half: 0.38,
        lamp: [0.10, 0.035],
        grille: [0.22, 0.085],
        clearance: 0.14,
    },
    CarShape {
        usual_m: [5.3, 2.0, 2.2],
        nose_belt: [0.46, 0.54],
        cowl_roof: [0.14, 0.26],
        roof_end_deck: [0.985, 0.995],
        roof_half: 0.45,
        lamp: [0.08, 0.055],
        grille: [0.22, 0.045],
        clearance: 0.10,
    },
    CarShape {
        usual_m: [3.6, 1.65, 1.5],
        nose_belt: [0.52, 0.62],
        cowl_roof: [0.18, 0.36],
        roof_end_deck: [0.90, 0.98],
        roof_half: 0.39,
        lamp: [0.09, 0.075],
        grille: [0.12, 0.03],
        clearance: 0.12,
    },
    CarShape {
        usual_m: [4.6, 1.84, 1.68],
        nose_belt: [0.50, 0.57],
        cowl_roof: [0.17, 0.36],
        roof_end_deck: [0.93, 0.99],
        roof_half: 0.39,
        lamp: [0.11, 0.06],
        grille: [0.20, 0.04],
        clearance: 0.11,
    },
    CarShape {
        usual_m: [5.3, 1.93, 1.8],
        nose_belt: [0.60, 0.66],
        cowl_roof: [0.26, 0.35],
        roof_end_deck: [0.58, 0.62],
        roof_half: 0.38,
        lamp: [0.09, 0.055],
        grille: [0.27, 0.08],
        clearance: 0.17,
    },
];

/// Builds the body in its own frame.
pub(super) fn mesh(body: &Body) -> Mesh {
    let shape = &SHAPES[usize::from(body.shape) % SHAPES.len()];
    let mut mesh = Mesh::default();
    shell(&mut mesh, body, shape);
    windows(&mut mesh, body, shape);
    front(&mut mesh, body, shape);
    let [length, width, height] = body.extents();
    let radius = (0.22 * height).min(0.36);
    for x in [0.32 * length, -0.30 * length] {
        for y in [-1.0, 1.0] {
            mesh.wheel([x, y * (width / 2.0 - 0.12), radius], 0.11);
        }
    }
    mesh
}

/// Returns the four ribs of the greenhouse: bottom and top of the windscreen, top and bottom of the rear window.
fn greenhouse(body: &Body, shape: &CarShape) -> [Rib; 4] {
    let [length, width, height] = body.extents();
    let x = |share: f32| length * (0.5 - share);
    let belt = shape.nose_belt[1] * height;
    [
        [x(shape.cowl_roof[0]), belt - 0.02, 0.475 * width],
        [x(shape.cowl_roof[1]), height, shape.roof_half * width],
        [x(shape.roof_end_deck[0]), height, shape.roof_half * width],
        [x(shape.roof_end_deck[1]), belt - 0.02, 0.47 * width],
    ]
}

fn shell(mesh: &mut Mesh, body: &Body, shape: &CarShape) {
    let [length, width, height] = body.extents();
    let (front, rear) = (length / 2.0, -length / 2.0);
    let [nose, belt] = shape.nose_belt.map(|share| share * height);
    let bottom = shape.clearance * height;
    let cowl = length * (0.5 - shape.cowl_roof[0]);
    let lower = [
        [front - 0.03 * length, bottom, 0.45 * width],
        [front, bottom + 0.08 * height, 0.465 * width],
        [front, nose - 0.12 * height, 0.475 * width],
        [front - 0.025 * length, nose, 0.46 * width],
        [cowl, belt, 0.495 * width],
        [rear + 0.01 * length, belt, 0.49 * width],
        [rear, 0.45 * height, 0.49 * width],
        [rear + 0.03 * length, bottom, 0.46 * width],
    ];
    mesh.prism(&lower, 0.0, body.paint);
    mesh.prism(&greenhouse(body, shape), 0.0, body.paint);
    for side in [-1.0, 1.0] {
        mesh.block([cowl - 0.25, side * (0.5 * width + 0.08), belt + 0.07], [0.06, 0.10, 0.07], body.paint);
    }
}

fn windows(mesh: &mut Mesh, body: &Body, shape: &CarShape) {
    let [foot, top, back_top, back_foot] = greenhouse(body, shape);
    let left = |rib: Rib| [rib[0], rib[2], rib[1]];
    let right = |rib: Rib| [rib[0], -rib[2], rib[1]];
    mesh.decal([right(foot), left(foot), left(top), right(top)], 0.09, Surface::GLASS);
    mesh.decal([left(foot), left(back_foot), left(back_top), left(top)], 0.10, Surface::GLASS);
    mesh.decal([right(back_foot), right(foot), right(top), right(back_top)], 0.10, Surface::GLASS);
    mesh.decal([left(back_foot), right(back_foot), right(back_top), left(back_top)], 0.10, Surface::GLASS);
}

fn front(mesh: &mut Mesh, body: &Body, shape: &CarShape) {
    let [length, width, height] = body.extents();
    let front = length / 2.0;
    let nose = shape.nose_belt[0] * height;
    let [lamp_y, lamp_z] = [shape.lamp[0] * width, shape.lamp[1] * height];
    let lamp_height = nose - 0.10 * height - lamp_z.min(0.05 * height);
    mesh.front_decal(front, [0.0, lamp_height], [shape.grille[0] * width, shape.grille[1] * height], Surface::GRILLE);
    let bumper = shape.clearance * height + 0.12 * height;
    mesh.front_decal(front, [0.0, bumper], [0.34 * width, 0.035 * height], Surface::PLASTIC);
    // A licence plate measures 0.52 m × 0.11 m.
    mesh.front_decal(front + 0.01, [0.0, bumper + 0.06 * height], [0.26, 0.055], Surface::PLATE);
    for side in [-1.0, 1.0] {
        let at = [side * (0.46 * width - lamp_y), lamp_height];
        mesh.front_decal(front, at, [lamp_y, lamp_z], Surface::HEADLAMP);
        let indicator = Surface::MARKER.with_emission(Emission::Indicator(side > 0.0));
        mesh.front_decal(front + 0.01, [side * 0.43 * width, lamp_height - lamp_z], [0.05, 0.015], indicator);
    }
}
