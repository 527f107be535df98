//! Trucks: a cab, and the load or trailer behind it.

use super::Body;
use crate::camera::mesh::{Emission, Mesh, Surface, Texture};
use closecall_traffic::bodies::{
    CAB_M, CRATE, DECK, LOAD_FLOOR_M, LOAD_GAP_M, Load, SCREEN_RAKE_M, TANK_FLOOR_M, TruckProportions, VISOR,
};

/// Appends the body in its own frame.
pub(super) fn append(mesh: &mut Mesh, body: &Body, shape: &TruckProportions) {
    cab(mesh, body, shape);
    front(mesh, body, shape);
    load(mesh, body, shape);
    let [length, width, _] = body.extents();
    let front = length / 2.0;
    for x in [front - 1.4, front - 4.6, -0.22 * length, -0.32 * length] {
        for y in [-1.0, 1.0] {
            mesh.wheel([x, y * (width / 2.0 - 0.17), 0.5], 0.15);
        }
    }
}

/// Returns the longitudinal position of the windscreen and the height of the cab's roof (m).
fn cab_front(body: &Body, shape: &TruckProportions) -> (f32, f32) {
    let [length, _, height] = body.extents();
    (length / 2.0 - shape.bonnet_m, shape.cab_height * height)
}

fn cab(mesh: &mut Mesh, body: &Body, shape: &TruckProportions) {
    let [length, width, _] = body.extents();
    let (screen, roof) = cab_front(body, shape);
    let back = if matches!(shape.load, Load::Coach) { -length / 2.0 } else { screen - CAB_M.min(0.4 * length) };
    let sill = shape.windscreen[0] * roof;
    let top = shape.windscreen[1] * roof;
    let ribs = [
        [screen, 0.35, 0.48 * width],
        [screen, sill, 0.5 * width],
        [screen - SCREEN_RAKE_M[0], top, 0.49 * width],
        [screen - SCREEN_RAKE_M[1], roof, 0.45 * width],
        [back, roof, 0.47 * width],
        [back, 0.5, 0.48 * width],
    ];
    mesh.prism(&ribs, 0.0, body.paint);
    let half = 0.45 * width;
    let upper = screen - SCREEN_RAKE_M[0];
    let screen_corners = [[screen, -half, sill], [screen, half, sill], [upper, half, top], [upper, -half, top]];
    mesh.decal(screen_corners, 0.03, Surface::GLASS);
    for side in [-1.0, 1.0] {
        let pane = [[screen - 0.3, sill], [screen - 1.2, sill], [screen - 1.2, top], [screen - 0.35, top]];
        let mut corners = pane.map(|[x, z]| [x, side * 0.497 * width, z]);
        if side < 0.0 {
            corners.swap(0, 1);
            corners.swap(2, 3);
        }
        mesh.decal(corners, 0.05, Surface::GLASS);
        // Mirrors protrude on both sides.
        mesh.block([screen - 0.1, side * (0.5 * width + 0.1), top - 0.35], [0.06, 0.09, 0.32], Surface::PLASTIC);
    }
    if shape.bonnet_m > 0.0 {
        let (nose, belt) = (length / 2.0, sill - 0.05);
        let bonnet = [
            [nose, 0.5, 0.40 * width],
            [nose, belt - 0.35, 0.36 * width],
            [screen, belt, 0.40 * width],
            [screen, 0.5, 0.46 * width],
        ];
        mesh.prism(&bonnet, 0.0, body.paint);
    }
}

fn front(mesh: &mut Mesh, body: &Body, shape: &TruckProportions) {
    let [length, width, height] = body.extents();
    let front = length / 2.0;
    let (_, roof) = cab_front(body, shape);
    let sill = shape.windscreen[0] * roof;
    mesh.block([front - 0.06, 0.0, 0.5], [0.05, 0.49 * width, 0.2], Surface::PLASTIC);
    let grille_z = (0.72 + sill) / 2.0;
    let grille = [shape.grille.width * width, shape.grille.height * height];
    mesh.front_decal(front, [0.0, grille_z], grille, Surface::GRILLE);
    mesh.front_decal(front + 0.01, [0.0, 0.5], [0.26, 0.055], Surface::PLATE);
    for side in [-1.0, 1.0] {
        mesh.front_decal(front, [side * 0.40 * width, 0.62], [0.19, 0.10], Surface::HEADLAMP);
        let indicator = Surface::MARKER.with_emission(Emission::Indicator(side > 0.0));
        mesh.front_decal(front, [side * 0.46 * width, 0.78], [0.06, 0.04], indicator);
        // High marker lamps make a truck recognisable at night.
        mesh.front_decal(
            front - shape.bonnet_m - 0.42,
            [side * 0.42 * width, roof - 0.06],
            [0.07, 0.03],
            Surface::MARKER,
        );
    }
    if !matches!(shape.load, Load::Coach) {
        mesh.block(
            [front - shape.bonnet_m - VISOR.back_m, 0.0, shape.windscreen[1] * roof + VISOR.above_screen_m],
            [VISOR.half_depth_m, VISOR.half_width * width, VISOR.half_height_m],
            Surface::PLASTIC,
        );
    }
}

fn load(mesh: &mut Mesh, body: &Body, shape: &TruckProportions) {
    let [length, width, height] = body.extents();
    let (screen, _) = cab_front(body, shape);
    let ahead = screen - CAB_M.min(0.4 * length) - LOAD_GAP_M;
    let rear = -length / 2.0;
    let (middle, half) = ((ahead + rear) / 2.0, (ahead - rear) / 2.0);
    match shape.load {
        Load::Tarpaulin(colour) | Load::Box(colour) => {
            let surface = Surface::plain(colour, 0.2);
            let (floor, roof) = (LOAD_FLOOR_M, height);
            mesh.block([middle, 0.0, (floor + roof) / 2.0], [half, width / 2.0, (roof - floor) / 2.0], surface);
            let panel = surface.with_texture(Texture::Panel);
            let y = width / 2.0;
            mesh.decal([[ahead, y, floor], [rear, y, floor], [rear, y, roof], [ahead, y, roof]], 0.01, panel);
            mesh.decal([[rear, -y, floor], [ahead, -y, floor], [ahead, -y, roof], [rear, -y, roof]], 0.01, panel);
        }
        Load::Tank => {
            let radius = (height - TANK_FLOOR_M) / 2.0;
            let centre = TANK_FLOOR_M + radius;
            mesh.ellipsoid([middle, 0.0, centre], [half, width / 2.0, radius], Surface::METAL);
        }
        Load::Platform => {
            mesh.block([middle, 0.0, DECK.centre_m], [half, width / 2.0, DECK.half_height_m], Surface::PLASTIC);
            let crate_colour = Surface::plain([0.3, 0.2, 0.1], 0.1);
            let extent = [0.75 * half, 0.42 * width, CRATE.half_height_m];
            mesh.block([middle - 0.1 * half, 0.0, CRATE.centre_m], extent, crate_colour);
        }
        Load::Coach => {
            let (floor, roof) = (0.42 * height, 0.84 * height);
            let (from, to) = (length / 2.0 - 1.4, rear + 0.4);
            let y = width / 2.0 - 0.02;
            mesh.decal([[from, y, floor], [to, y, floor], [to, y, roof], [from, y, roof]], 0.01, Surface::GLASS);
            mesh.decal([[to, -y, floor], [from, -y, floor], [from, -y, roof], [to, -y, roof]], 0.01, Surface::GLASS);
            return;
        }
    }
    mesh.block([middle, 0.0, 0.9], [half, 0.3 * width, 0.15], Surface::PLASTIC);
}
