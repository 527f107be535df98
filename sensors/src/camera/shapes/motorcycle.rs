//! Motorcycles with their riders. The rider is the larger part of the visible area.

use super::Body;
use crate::camera::mesh::{Emission, Mesh, Surface};

/// Proportions of one body shape.
pub(super) struct MotorcycleShape {
    /// Usual length, width and height (m).
    pub(super) usual_m: [f64; 3],
    /// Half width (m) and height (share of the height) of the upper edge of the fairing or shield; 0 for none.
    fairing: [f32; 2],
    /// Half width and half height of a headlamp, and half the distance between two headlamps (m). A distance of 0 means
    /// a single headlamp.
    lamp_m: [f32; 3],
    /// Distance by which the rider's shoulders lean forward (m).
    lean_m: f32,
    /// Height of the handlebar (share of the height).
    bar: f32,
    /// Half width of the side cases (m); 0 for none.
    cases_m: f32,
    /// Reflectance of the rider's suit (linear red, green, blue).
    suit: [f32; 3],
}

/// The body shapes in order: naked bike, sport bike, tourer with cases, scooter, chopper, trail bike.
pub(super) const SHAPES: [MotorcycleShape; 6] = [
    MotorcycleShape {
        usual_m: [2.1, 0.80, 1.65],
        fairing: [0.0, 0.0],
        lamp_m: [0.09, 0.09, 0.0],
        lean_m: 0.15,
        bar: 0.66,
        cases_m: 0.0,
        suit: [0.03, 0.03, 0.035],
    },
    MotorcycleShape {
        usual_m: [2.05, 0.72, 1.5],
        fairing: [0.26, 0.72],
        lamp_m: [0.07, 0.05, 0.10],
        lean_m: 0.40,
        bar: 0.60,
        cases_m: 0.0,
        suit: [0.35, 0.04, 0.03],
    },
    MotorcycleShape {
        usual_m: [2.25, 0.95, 1.72],
        fairing: [0.32, 0.80],
        lamp_m: [0.10, 0.07, 0.09],
        lean_m: 0.05,
        bar: 0.63,
        cases_m: 0.18,
        suit: [0.12, 0.13, 0.14],
    },
    MotorcycleShape {
        usual_m: [1.9, 0.75, 1.62],
        fairing: [0.24, 0.68],
        lamp_m: [0.08, 0.07, 0.0],
        lean_m: 0.0,
        bar: 0.64,
        cases_m: 0.0,
        suit: [0.10, 0.14, 0.25],
    },
    MotorcycleShape {
        usual_m: [2.4, 0.90, 1.55],
        fairing: [0.0, 0.0],
        lamp_m: [0.09, 0.09, 0.0],
        lean_m: -0.10,
        bar: 0.74,
        cases_m: 0.12,
        suit: [0.05, 0.03, 0.02],
    },
    MotorcycleShape {
        usual_m: [2.2, 0.85, 1.75],
        fairing: [0.18, 0.74],
        lamp_m: [0.08, 0.09, 0.0],
        lean_m: 0.05,
        bar: 0.66,
        cases_m: 0.0,
        suit: [0.45, 0.42, 0.05],
    },
];

/// Builds the body in its own frame.
pub(super) fn mesh(body: &Body) -> Mesh {
    let shape = &SHAPES[usize::from(body.shape) % SHAPES.len()];
    let mut mesh = Mesh::default();
    machine(&mut mesh, body, shape);
    rider(&mut mesh, body, shape);
    mesh
}

fn machine(mesh: &mut Mesh, body: &Body, shape: &MotorcycleShape) {
    let [length, width, height] = body.extents();
    let radius = 0.31;
    let front = length / 2.0;
    for x in [front - radius, radius - front] {
        mesh.wheel([x, 0.0, radius], 0.065);
    }
    // Fork, engine, tank and tail.
    let head = front - 0.45;
    mesh.prism(
        &[[front - 0.28, 0.4, 0.09], [front - 0.34, 0.4, 0.09], [head - 0.06, 0.95, 0.1], [head, 0.95, 0.1]],
        0.0,
        Surface::METAL,
    );
    mesh.block([0.0, 0.0, 0.45], [0.35, 0.20, 0.22], Surface::PLASTIC);
    mesh.prism(&[[head, 0.7, 0.1], [head - 0.1, 1.0, 0.16], [-0.2, 0.85, 0.15], [-0.2, 0.65, 0.15]], 0.0, body.paint);
    mesh.prism(
        &[[-0.15, 0.65, 0.14], [-0.15, 0.85, 0.14], [0.05 - front, 0.92, 0.1], [0.05 - front, 0.72, 0.1]],
        0.0,
        body.paint,
    );
    let bar = shape.bar * height;
    mesh.block([head - 0.1, 0.0, bar], [0.03, width / 2.0, 0.025], Surface::PLASTIC);
    let [half, top] = shape.fairing;
    if half > 0.0 {
        let top = top * height;
        let foot = 0.62;
        let ribs = [
            [front - 0.3, foot, 0.6 * half],
            [front - 0.28, 0.85, half],
            [head - 0.05, top, 0.6 * half],
            [head - 0.2, foot, half],
        ];
        mesh.prism(&ribs, 0.0, body.paint);
    }
    lamps(mesh, [front - if half > 0.0 { 0.27 } else { 0.38 }, width, bar], shape);
    if shape.cases_m > 0.0 {
        for side in [-1.0, 1.0] {
            let y = side * (width / 2.0 - shape.cases_m / 2.0);
            mesh.block([-0.6 * front, y, 0.62], [0.28, shape.cases_m / 2.0, 0.22], body.paint);
        }
    }
}

fn lamps(mesh: &mut Mesh, [x, width, bar]: [f32; 3], shape: &MotorcycleShape) {
    let [half_y, half_z, apart] = shape.lamp_m;
    let at_z = 0.86;
    mesh.block([x - 0.06, 0.0, at_z], [0.05, half_y + apart + 0.02, half_z + 0.02], Surface::PLASTIC);
    let sides: &[f32] = if apart > 0.0 { &[-1.0, 1.0] } else { &[0.0] };
    for side in sides {
        mesh.front_decal(x, [side * apart, at_z], [half_y, half_z], Surface::HEADLAMP);
    }
    for side in [-1.0, 1.0] {
        let indicator = Surface::MARKER.with_emission(Emission::Indicator(side > 0.0));
        mesh.front_decal(x, [side * 0.24, at_z], [0.035, 0.025], indicator);
        mesh.block([x - 0.25, side * 0.4 * width, bar + 0.14], [0.02, 0.07, 0.05], Surface::PLASTIC);
    }
}

fn rider(mesh: &mut Mesh, body: &Body, shape: &MotorcycleShape) {
    let [_, width, height] = body.extents();
    let suit = Surface::plain(shape.suit, 0.15);
    let seat = 0.48 * height;
    let shoulder = height - 0.30;
    let hip = -0.35;
    let lean = shape.lean_m;
    let torso = [
        [hip + 0.14, seat, 0.17],
        [hip + lean + 0.16, shoulder - 0.1, 0.22],
        [hip + lean + 0.06, shoulder, 0.18],
        [hip + lean - 0.12, shoulder - 0.05, 0.21],
        [hip - 0.14, seat, 0.17],
    ];
    mesh.prism(&torso, 0.0, suit);
    let head = [hip + lean + 0.1, 0.0, height - 0.15];
    mesh.ellipsoid(head, [0.15, 0.13, 0.15], body.paint);
    let visor = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
        .map(|(a, b)| [head[0] + 0.145, a * 0.09, head[2] + b * 0.045]);
    mesh.decal(visor, 0.0, Surface::GLASS);
    for side in [-1.0, 1.0] {
        // Thigh, shin, and the arm that reaches to the handlebar.
        mesh.prism(
            &[[hip, seat + 0.02, 0.08], [0.15, seat - 0.02, 0.07], [0.15, seat - 0.18, 0.07], [hip, seat - 0.14, 0.08]],
            side * 0.22,
            suit,
        );
        mesh.prism(
            &[[0.16, seat - 0.02, 0.06], [0.02, seat - 0.05, 0.06], [-0.1, 0.25, 0.05], [0.0, 0.22, 0.05]],
            side * 0.24,
            suit,
        );
        let hand = [0.55, shape.bar * height];
        let arm = [
            [hip + lean + 0.08, shoulder - 0.02, 0.055],
            [hand[0], hand[1] + 0.04, 0.05],
            [hand[0], hand[1] - 0.04, 0.05],
            [hip + lean, shoulder - 0.16, 0.055],
        ];
        mesh.prism(&arm, side * (0.5 * width - 0.10).min(0.30), suit);
    }
}
