//! Trucks: a cab, and the load or trailer behind it.

use super::Body;
use crate::camera::mesh::{Emission, Mesh, Surface, Texture};

/// The part of the truck behind the cab.
enum Load {
    /// A box or a tarpaulin of this colour (linear red, green, blue).
    Panels([f32; 3]),
    /// A round tank.
    Tank,
    /// An open platform with a low load.
    Platform,
    /// The passenger compartment of a coach, which forms one body with the cab.
    Coach,
}

/// Proportions of one body shape.
pub(super) struct TruckShape {
    /// Usual length, width and height (m).
    pub(super) usual_m: [f64; 3],
    /// Height of the cab's roof (share of the height).
    cab_height: f32,
    /// Length of the bonnet ahead of the windscreen (m), or 0 for a cab over the engine.
    bonnet_m: f32,
    /// Height of the windscreen's lower and upper edge (shares of the cab's height).
    windscreen: [f32; 2],
    /// Half width and half height of the grille (shares of width and height).
    grille: [f32; 2],
    load: Load,
}

/// The body shapes in order: tractor with tarpaulin trailer, tractor with box trailer, tanker, bonneted tractor with
/// box trailer, platform truck, coach, rigid box truck.
pub(super) const SHAPES: [TruckShape; 7] = [
    TruckShape {
        usual_m: [16.5, 2.55, 4.0],
        cab_height: 0.90,
        bonnet_m: 0.0,
        windscreen: [0.52, 0.80],
        grille: [0.30, 0.10],
        load: Load::Panels([0.15, 0.25, 0.5]),
    },
    TruckShape {
        usual_m: [16.5, 2.55, 4.0],
        cab_height: 0.76,
        bonnet_m: 0.0,
        windscreen: [0.54, 0.88],
        grille: [0.36, 0.07],
        load: Load::Panels([0.75, 0.75, 0.74]),
    },
    TruckShape {
        usual_m: [15.0, 2.55, 3.7],
        cab_height: 0.88,
        bonnet_m: 0.0,
        windscreen: [0.50, 0.80],
        grille: [0.26, 0.12],
        load: Load::Tank,
    },
    TruckShape {
        usual_m: [18.0, 2.6, 4.1],
        cab_height: 0.78,
        bonnet_m: 1.6,
        windscreen: [0.60, 0.82],
        grille: [0.20, 0.16],
        load: Load::Panels([0.7, 0.7, 0.68]),
    },
    TruckShape {
        usual_m: [12.0, 2.5, 3.2],
        cab_height: 1.0,
        bonnet_m: 0.0,
        windscreen: [0.52, 0.86],
        grille: [0.30, 0.06],
        load: Load::Platform,
    },
    TruckShape {
        usual_m: [12.5, 2.55, 3.6],
        cab_height: 1.0,
        bonnet_m: 0.0,
        windscreen: [0.36, 0.86],
        grille: [0.15, 0.03],
        load: Load::Coach,
    },
    TruckShape {
        usual_m: [8.5, 2.4, 3.4],
        cab_height: 0.74,
        bonnet_m: 0.0,
        windscreen: [0.50, 0.88],
        grille: [0.30, 0.06],
        load: Load::Panels([0.65, 0.66, 0.6]),
    },
];

/// Length of a cab over the engine (m).
const CAB_M: f32 = 2.2;

/// Builds the body in its own frame.
pub(super) fn mesh(body: &Body) -> Mesh {
    let shape = &SHAPES[usize::from(body.shape) % SHAPES.len()];
    let mut mesh = Mesh::default();
    cab(&mut mesh, body, shape);
    front(&mut mesh, body, shape);
    load(&mut mesh, body, &shape.load);
    let [length, width, _] = body.extents();
    let front = length / 2.0;
    for x in [front - 1.4, front - 4.6, -0.22 * length, -0.32 * length] {
        for y in [-1.0, 1.0] {
            mesh.wheel([x, y * (width / 2.0 - 0.17), 0.5], 0.15);
        }
    }
    mesh
}

/// Returns the longitudinal position of the windscreen and the height of the cab's roof (m).
fn cab_front(body: &Body, shape: &TruckShape) -> (f32, f32) {
    let [length, _, height] = body.extents();
    (length / 2.0 - shape.bonnet_m, shape.cab_height * height)
}

fn cab(mesh: &mut Mesh, body: &Body, shape: &TruckShape) {
    let [length, width, _] = body.extents();
    let (screen, roof) = cab_front(body, shape);
    let back = if matches!(shape.load, Load::Coach) { -length / 2.0 } else { screen - CAB_M.min(0.4 * length) };
    let sill = shape.windscreen[0] * roof;
    let top = shape.windscreen[1] * roof;
    let ribs = [
        [screen, 0.35, 0.48 * width],
        [screen, sill, 0.5 * width],
        [screen - 0.12, top, 0.49 * width],
        [screen - 0.45, roof, 0.45 * width],
        [back, roof, 0.47 * width],
        [back, 0.5, 0.48 * width],
    ];
    mesh.prism(&ribs, 0.0, body.paint);
    let half = 0.45 * width;
    let screen_corners =
        [[screen, -half, sill], [screen, half, sill], [screen - 0.12, half, top], [screen - 0.12, -half, top]];
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

fn front(mesh: &mut Mesh, body: &Body, shape: &TruckShape) {
    let [length, width, height] = body.extents();
    let front = length / 2.0;
    let (_, roof) = cab_front(body, shape);
    let sill = shape.windscreen[0] * roof;
    mesh.block([front - 0.06, 0.0, 0.5], [0.05, 0.49 * width, 0.2], Surface::PLASTIC);
    let grille_z = (0.72 + sill) / 2.0;
    mesh.front_decal(front, [0.0, grille_z], [shape.grille[0] * width, shape.grille[1] * height], Surface::GRILLE);
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
            [front - shape.bonnet_m - 0.12, 0.0, shape.windscreen[1] * roof + 0.1],
            [0.14, 0.44 * width, 0.06],
            Surface::PLASTIC,
        );
    }
}

fn load(mesh: &mut Mesh, body: &Body, load: &Load) {
    let [length, width, height] = body.extents();
    let shape = &SHAPES[usize::from(body.shape) % SHAPES.len()];
    let (screen, _) = cab_front(body, shape);
    let ahead = screen - CAB_M.min(0.4 * length) - 0.35;
    let rear = -length / 2.0;
    let (middle, half) = ((ahead + rear) / 2.0, (ahead - rear) / 2.0);
    match load {
        Load::Panels(colour) => {
            let surface = Surface::plain(*colour, 0.2);
            let (floor, roof) = (1.15, height);
            mesh.block([middle, 0.0, (floor + roof) / 2.0], [half, width / 2.0, (roof - floor) / 2.0], surface);
            let panel = surface.with_texture(Texture::Panel);
            let y = width / 2.0;
            mesh.decal([[ahead, y, floor], [rear, y, floor], [rear, y, roof], [ahead, y, roof]], 0.01, panel);
            mesh.decal([[rear, -y, floor], [ahead, -y, floor], [ahead, -y, roof], [rear, -y, roof]], 0.01, panel);
        }
        Load::Tank => {
            let (centre, radius) = (1.1 + (height - 1.1) / 2.0, (height - 1.1) / 2.0);
            mesh.ellipsoid([middle, 0.0, centre], [half, width / 2.0, radius], Surface::METAL);
        }
        Load::Platform => {
            mesh.block([middle, 0.0, 1.15], [half, width / 2.0, 0.12], Surface::PLASTIC);
            let crate_colour = Surface::plain([0.3, 0.2, 0.1], 0.1);
            mesh.block([middle - 0.1 * half, 0.0, 1.8], [0.75 * half, 0.42 * width, 0.55], crate_colour);
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
