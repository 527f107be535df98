//! The shapes of trucks: a cab, the load behind it, and the running gear.

use closecall_traffic::Dimensions;

use super::append_pair;
use crate::lidar::Material::{self, Glass, Lamp, Paint, Plastic, Plate, Steel, Tarpaulin, Tyre};
use crate::lidar::solid::{HalfWidth, Solid, corner};
use closecall_traffic::bodies::{
    CAB_M, CRATE, DECK, LOAD_FLOOR_M, LOAD_GAP_M, Load, SCREEN_RAKE_M, Slab, TANK_FLOOR_M, TruckProportions, VISOR,
};

/// Height of the cab's underside (m).
const CAB_FLOOR_M: f64 = 0.35;
/// Heights of the lower and the upper edge of the chassis frame (m).
const CHASSIS_M: [f64; 2] = [0.6, 1.1];
const WHEEL_DIAMETER_M: f64 = 1.0;
const TYRE_WIDTH_M: f64 = 0.3;
/// Heights of the lower and upper edge of the lateral guards between the axles (m). UN Regulation
/// 73 requires the guards.
const GUARD_M: [f64; 2] = [0.5, 0.95];

/// The measures of one truck (m), in its own frame.
struct Measures {
    /// Position of the front end.
    front: f64,
    /// Position of the windscreen's lower edge.
    screen: f64,
    /// Position of the front end of the load.
    load_front: f64,
    /// Half of the width.
    half: f64,
    /// Height.
    top: f64,
    /// Height of the cab's roof.
    roof: f64,
    /// Heights of the windscreen's lower and upper edge.
    windscreen: [f64; 2],
}

impl Measures {
    fn new(size: &Dimensions, shape: &TruckProportions) -> Self {
        let front = 0.5 * size.length_m;
        let screen = front - f64::from(shape.bonnet_m);
        let cab_m = f64::from(CAB_M).min(0.4 * size.length_m);
        let roof = f64::from(shape.cab_height) * size.height_m;
        Self {
            front,
            screen,
            load_front: (screen - cab_m - f64::from(LOAD_GAP_M)).max(-front + 0.5),
            half: 0.5 * size.width_m,
            top: size.height_m,
            roof,
            windscreen: shape.windscreen.map(|share| f64::from(share) * roof),
        }
    }
}

pub(super) fn append(size: &Dimensions, shape: &TruckProportions, solids: &mut Vec<Solid>) {
    let truck = Measures::new(size, shape);
    let cab_rear = match shape.load {
        Load::Coach => -truck.front,
        Load::Tarpaulin(_) | Load::Box(_) | Load::Tank | Load::Platform => {
            append_visor(&truck, solids);
            truck.load_front + f64::from(LOAD_GAP_M)
        }
    };
    append_cab(&truck, cab_rear, solids);
    if shape.bonnet_m > 0.0 {
        append_bonnet(&truck, solids);
    }
    append_front(&truck, shape.bonnet_m > 0.0, solids);
    append_load(&truck, &shape.load, solids);
    append_running_gear(&truck, solids);
}

fn append_cab(truck: &Measures, rear: f64, solids: &mut Vec<Solid>) {
    let skin = truck.screen - 0.02;
    let [upper, roof_front] = SCREEN_RAKE_M.map(|rake| truck.screen - f64::from(rake));
    let profile = [
        corner(skin, CAB_FLOOR_M, Paint),
        corner(skin, truck.windscreen[0], Glass),
        corner(upper, truck.windscreen[1], Paint),
        corner(roof_front, truck.roof, Paint),
        corner(rear, truck.roof, Paint),
        corner(rear, CAB_FLOOR_M, Plastic),
    ];
    solids.push(Solid::prism(&profile, HalfWidth::straight(truck.half - 0.02), Paint));
}

/// Appends the sun visor, which does not protrude beyond the windscreen's lower edge.
fn append_visor(truck: &Measures, solids: &mut Vec<Solid>) {
    let rear = truck.screen - f64::from(VISOR.back_m + VISOR.half_depth_m);
    let half = 2.0 * f64::from(VISOR.half_width) * truck.half;
    let centre = truck.windscreen[1] + f64::from(VISOR.above_screen_m);
    let half_height = f64::from(VISOR.half_height_m);
    let high = [truck.screen - 0.01, half, centre + half_height];
    solids.push(Solid::cuboid([rear, -half, centre - half_height], high, Plastic));
}

fn append_bonnet(truck: &Measures, solids: &mut Vec<Solid>) {
    let skin = truck.front - 0.02;
    let belt = truck.windscreen[0] - 0.05;
    let profile = [
        corner(skin, 0.5, Paint),
        corner(skin, belt - 0.35, Paint),
        corner(truck.screen, belt, Paint),
        corner(truck.screen, 0.5, Plastic),
    ];
    solids.push(Solid::prism(&profile, HalfWidth::straight(0.8 * truck.half), Paint));
}

/// Appends grille, plate and lamps, which protrude slightly from the painted front.
fn append_front(truck: &Measures, has_bonnet: bool, solids: &mut Vec<Solid>) {
    let (front, half) = (truck.front, truck.half);
    let base = front - 0.2;
    let grille_top = truck.windscreen[0] - if has_bonnet { 0.45 } else { 0.3 };
    solids.push(Solid::cuboid([base, -0.7 * half, 0.75], [front - 0.01, 0.7 * half, grille_top], Plastic));
    solids.push(Solid::cuboid([base, -0.26, 0.50], [front, 0.26, 0.61], Plate));
    append_pair([base, 0.66 * half, 0.55], [front - 0.01, 0.95 * half, 0.80], Lamp, solids);
}

fn append_load(truck: &Measures, load: &Load, solids: &mut Vec<Solid>) {
    let (front, half, top) = (truck.load_front, truck.half, truck.top);
    let rear = -truck.front;
    let panels = |material| {
        let floor = f64::from(LOAD_FLOOR_M).min(0.5 * top);
        Solid::cuboid([rear, -half, floor], [front, half, top], material)
    };
    match load {
        Load::Tarpaulin(_) => solids.push(panels(Tarpaulin)),
        Load::Box(_) => solids.push(panels(Paint)),
        Load::Tank => append_tank(truck, solids),
        Load::Platform => {
            let (middle, half_length) = (0.5 * (front + rear), 0.5 * (front - rear));
            let crate_middle = middle - 0.1 * half_length;
            solids.push(slab([rear, front], half, DECK, Plastic));
            let ends = [crate_middle - 0.75 * half_length, crate_middle + 0.75 * half_length];
            solids.push(slab(ends, 0.84 * half, CRATE, Tarpaulin));
        }
        Load::Coach => {
            let (floor, roof) = (0.42 * top, 0.84 * top);
            append_pair([rear + 0.4, half - 0.1, floor], [truck.front - 1.4, half - 0.01, roof], Glass, solids);
        }
    }
    // The chassis frame, a metre wide, joins the cab and the load.
    let [low, high] = CHASSIS_M;
    solids.push(Solid::cuboid([rear, -0.5, low], [truck.screen - f64::from(CAB_M), 0.5, high.min(0.5 * top)], Plastic));
}

/// Creates a block between two longitudinal positions.
fn slab([rear, front]: [f64; 2], half: f64, slab: Slab, material: Material) -> Solid {
    let (centre, half_height) = (f64::from(slab.centre_m), f64::from(slab.half_height_m));
    Solid::cuboid([rear, -half, centre - half_height], [front, half, centre + half_height], material)
}

/// Appends a tank: the camera's ellipsoid, in an upper and a lower half.
fn append_tank(truck: &Measures, solids: &mut Vec<Solid>) {
    let rear = -truck.front;
    let (middle, half_length) = (0.5 * (truck.load_front + rear), 0.5 * (truck.load_front - rear));
    let radius = 0.5 * (truck.top - f64::from(TANK_FLOOR_M));
    let centre = truck.top - radius;
    // Shares of the half length and of the radius at the edges between the ellipsoid's rings.
    let outline = [[-0.93, 0.0], [-0.93, 0.45], [-0.3, 1.0], [0.3, 1.0], [0.93, 0.45], [0.93, 0.0]];
    for (sign, narrow) in [(1.0, [0.9, 0.45]), (-1.0, [0.45, 0.9])] {
        let profile =
            outline.map(|[along, up]| corner(middle + along * half_length, centre + sign * up * radius, Steel));
        let [bottom_m, top_m] = narrow.map(|share| share * truck.half);
        solids.push(Solid::prism(&profile, HalfWidth { bottom_m, top_m }, Steel));
    }
}

/// Appends the wheels and the lateral guards between them.
fn append_running_gear(truck: &Measures, solids: &mut Vec<Solid>) {
    let (front, half, load_front) = (truck.front, truck.half, truck.load_front);
    let rear = -front;
    let length = 2.0 * front;
    // One block for each axle group: steered axle, driven axle, and the three axles at the rear of
    // a long vehicle.
    let rear_group_m = if length > 10.0 { 3.0 * WHEEL_DIAMETER_M + 0.6 } else { WHEEL_DIAMETER_M };
    let rear_from = rear + 0.1 * length;
    let groups = [
        [front - 1.9, front - 1.9 + WHEEL_DIAMETER_M],
        [load_front - 2.0, load_front - 2.0 + WHEEL_DIAMETER_M],
        [rear_from, rear_from + rear_group_m],
    ];
    for [from, to] in groups {
        append_pair([from, half - TYRE_WIDTH_M, 0.0], [to, half, WHEEL_DIAMETER_M], Tyre, solids);
    }
    let [guard_from, guard_to] = [rear_from + rear_group_m + 0.1, load_front - 2.1];
    if guard_to > guard_from {
        append_pair([guard_from, half - 0.1, GUARD_M[0]], [guard_to, half - 0.02, GUARD_M[1]], Plastic, solids);
    }
}
