//! Passenger cars: a lower body, a greenhouse with windows on top of it, and the details of the
//! front.

use super::Body;
use crate::camera::mesh::{Emission, Mesh, Rib, Surface};
use closecall_traffic::bodies::{CarProportions, GREENHOUSE_FOOT_HALF_WIDTH};

/// Appends the body in its own frame.
pub(super) fn append(mesh: &mut Mesh, body: &Body, shape: &CarProportions) {
    shell(mesh, body, shape);
    windows(mesh, body, shape);
    front(mesh, body, shape);
    let [length, width, height] = body.extents();
    let radius = (0.22 * height).min(0.36);
    for x in [0.32 * length, -0.30 * length] {
        for y in [-1.0, 1.0] {
            mesh.wheel([x, y * (width / 2.0 - 0.12), radius], 0.11);
        }
    }
}

/// Returns the four ribs of the greenhouse: bottom and top of the windscreen, top and bottom of the
/// rear window.
fn greenhouse(body: &Body, shape: &CarProportions) -> [Rib; 4] {
    let [length, width, height] = body.extents();
    let x = |share: f32| length * (0.5 - share);
    let belt = shape.belt * height;
    [
        [x(shape.cowl), belt - 0.02, GREENHOUSE_FOOT_HALF_WIDTH * width],
        [x(shape.roof_front), height, shape.roof_half_width * width],
        [x(shape.roof_rear), height, shape.roof_half_width * width],
        [x(shape.deck), belt - 0.02, 0.47 * width],
    ]
}

fn shell(mesh: &mut Mesh, body: &Body, shape: &CarProportions) {
    let [length, width, height] = body.extents();
    let (front, rear) = (length / 2.0, -length / 2.0);
    let [nose, belt] = [shape.nose, shape.belt].map(|share| share * height);
    let bottom = shape.clearance * height;
    let cowl = length * (0.5 - shape.cowl);
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

fn windows(mesh: &mut Mesh, body: &Body, shape: &CarProportions) {
    let [foot, top, back_top, back_foot] = greenhouse(body, shape);
    let left = |rib: Rib| [rib[0], rib[2], rib[1]];
    let right = |rib: Rib| [rib[0], -rib[2], rib[1]];
    mesh.decal([right(foot), left(foot), left(top), right(top)], 0.09, Surface::GLASS);
    mesh.decal([left(foot), left(back_foot), left(back_top), left(top)], 0.10, Surface::GLASS);
    mesh.decal([right(back_foot), right(foot), right(top), right(back_top)], 0.10, Surface::GLASS);
    mesh.decal([left(back_foot), right(back_foot), right(back_top), left(back_top)], 0.10, Surface::GLASS);
}

fn front(mesh: &mut Mesh, body: &Body, shape: &CarProportions) {
    let [length, width, height] = body.extents();
    let front = length / 2.0;
    let nose = shape.nose * height;
    let [lamp_y, lamp_z] = [shape.headlamp.width * width, shape.headlamp.height * height];
    let lamp_height = nose - 0.10 * height - lamp_z.min(0.05 * height);
    let grille = [shape.grille.width * width, shape.grille.height * height];
    mesh.front_decal(front, [0.0, lamp_height], grille, Surface::GRILLE);
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
