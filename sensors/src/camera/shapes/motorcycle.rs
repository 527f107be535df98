//! Motorcycles with their riders. The rider is the larger part of the visible area.

use super::Body;
use crate::camera::mesh::{Emission, Mesh, Surface};
use closecall_traffic::bodies::{HEAD_BACK_M, HIP_X_M, Lamps, MotorcycleProportions, RIDER, WHEEL_RADIUS_M};

/// Appends the body in its own frame.
pub(super) fn append(mesh: &mut Mesh, body: &Body, shape: &MotorcycleProportions) {
    machine(mesh, body, shape);
    rider(mesh, body, shape);
}

fn machine(mesh: &mut Mesh, body: &Body, shape: &MotorcycleProportions) {
    let [length, width, height] = body.extents();
    let radius = WHEEL_RADIUS_M;
    let front = length / 2.0;
    for x in [front - radius, radius - front] {
        mesh.wheel([x, 0.0, radius], 0.065);
    }
    // Fork, engine, tank and tail.
    let head = front - HEAD_BACK_M;
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
    if let Some(fairing) = shape.fairing {
        let half = fairing.half_width_m;
        let top = fairing.top * height;
        let foot = 0.62;
        let ribs = [
            [front - 0.3, foot, 0.6 * half],
            [front - 0.28, 0.85, half],
            [head - 0.05, top, 0.6 * half],
            [head - 0.2, foot, half],
        ];
        mesh.prism(&ribs, 0.0, body.paint);
    }
    lamps(mesh, body, shape);
    if shape.cases_m > 0.0 {
        for side in [-1.0, 1.0] {
            let y = side * (width / 2.0 - shape.cases_m / 2.0);
            mesh.block([-0.6 * front, y, 0.62], [0.28, shape.cases_m / 2.0, 0.22], body.paint);
        }
    }
}

fn lamps(mesh: &mut Mesh, body: &Body, shape: &MotorcycleProportions) {
    let [length, width, height] = body.extents();
    let x = length / 2.0 - if shape.fairing.is_some() { 0.27 } else { 0.38 };
    let bar = shape.bar * height;
    let Lamps { half_width_m: half_y, half_height_m: half_z, half_distance_m: apart } = shape.lamps;
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

fn rider(mesh: &mut Mesh, body: &Body, shape: &MotorcycleProportions) {
    let [_, width, height] = body.extents();
    let suit = Surface::plain(shape.suit, 0.15);
    let seat = RIDER.seat * height;
    let shoulder = height - RIDER.shoulder_below_top_m;
    let hip = HIP_X_M;
    let lean = shape.lean_m;
    let torso = [
        [hip + 0.14, seat, 0.17],
        [hip + lean + 0.16, shoulder - 0.1, 0.22],
        [hip + lean + 0.06, shoulder, 0.18],
        [hip + lean - 0.12, shoulder - 0.05, 0.21],
        [hip - 0.14, seat, 0.17],
    ];
    mesh.prism(&torso, 0.0, suit);
    let head = [hip + lean + RIDER.head_ahead_m, 0.0, height - RIDER.head_below_top_m];
    mesh.ellipsoid(head, RIDER.head_radii_m, body.paint);
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
