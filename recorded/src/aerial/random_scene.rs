//! Random scenes for training and for evaluation.

use std::f64::consts::PI;

use closecall_sensors::camera::HELD_OUT_SHAPES;
use closecall_sensors::datasets::Set;
use closecall_traffic::geometry::OrientedBox;
use closecall_traffic::{BodyShape, Dimensions, Stream, Vehicle, VehicleClass};
use rand::RngExt;

use crate::aerial::camera::{AerialCamera, FOCAL_PX, View};
use crate::aerial::ground::Ground;
use crate::aerial::picture::{AerialScene, GroundVehicle, Light};

/// Largest number of attempts to place a vehicle clear of the others, after which it is left out.
const ATTEMPTS: usize = 12;
/// Least length of a truck (m).
const MIN_TRUCK_M: f64 = 7.0;
/// Least distance between vehicles (m).
const CLEARANCE_M: f64 = 0.4;

/// The sizes of random pictures: the strip in which a road is watched, or a square of about as many
/// pixels for which the camera looks in any direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame {
    /// Columns and rows (px).
    pub size_px: [usize; 2],
    /// True if the camera looks across the road, so that the road runs along the columns.
    pub is_across: bool,
}

/// Draws a scene with its camera.
pub fn random_scene(set: Set, frame: Frame, rng: &mut Stream) -> (AerialScene, AerialCamera) {
    let lanes = rng.random_range(2..=5_u32);
    let lane_m = rng.random_range(3.4..3.8);
    let markings_m: Vec<f64> = (0..=lanes).map(|lane| -lane_m * f64::from(lane)).collect();
    let width_m = lane_m * f64::from(lanes);
    let altitude_m = rng.random_range(80.0..120.0);
    let turned = if frame.is_across { rng.random_range(-0.1..0.1) } else { rng.random_range(-PI..PI) };
    let view = View {
        target_m: [rng.random_range(0.0..1_000.0), -rng.random_range(0.1..0.9) * width_m],
        altitude_m,
        off_nadir_rad: rng.random_range(0.0..0.6),
        azimuth_rad: 0.5 * PI + turned,
        focal_px: FOCAL_PX * altitude_m / 100.0 * rng.random_range(0.85..1.15),
        size_px: frame.size_px,
    };
    let light = Light {
        azimuth_rad: rng.random_range(-PI..PI),
        elevation_rad: rng.random_range(0.35..1.3),
        direct: rng.random_range(0.0..0.7),
        exposure: rng.random_range(0.6..1.5),
    };
    let ground = Ground {
        pavement: rng.random_range(0.07..0.3),
        verge: [0.07, 0.11, 0.03].map(|value| value * rng.random_range(0.6..2.2)),
        ..Ground::new(markings_m, rng.random())
    };
    let mut scene = AerialScene { ground, vehicles: Vec::new(), light, key: rng.random() };
    let camera = AerialCamera::new(view);
    let reach_m = 0.6 * frame.size_px[0].max(frame.size_px[1]) as f64 * altitude_m / view.focal_px;
    let density = rng.random_range(0.02..0.30);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small positive number")]
    let wanted = (density * reach_m).ceil() as u64 + 1;
    let road = VisibleRoad { middle_m: view.target_m[0], reach_m, lanes, lane_m };
    for id in 0..wanted {
        place(&mut scene, set, id, &road, rng);
    }
    (scene, camera)
}

/// The part of the road on which vehicles are placed.
struct VisibleRoad {
    /// Position of its middle along the road (m).
    middle_m: f64,
    /// Distance from the middle to either end (m).
    reach_m: f64,
    lanes: u32,
    /// Width of a lane (m).
    lane_m: f64,
}

fn place(scene: &mut AerialScene, set: Set, id: u64, road: &VisibleRoad, rng: &mut Stream) {
    let VisibleRoad { middle_m, reach_m, lanes, lane_m } = *road;
    let class = if rng.random_bool(0.4) { VehicleClass::Truck } else { VehicleClass::Car };
    let vehicle = random_vehicle(set, class, rng);
    for _ in 0..ATTEMPTS {
        let lane = rng.random_range(0..lanes);
        let at_m = [
            middle_m + rng.random_range(-reach_m..reach_m),
            -lane_m * (f64::from(lane) + 0.5) + rng.random_range(-0.6..0.6),
        ];
        let turned = if rng.random_bool(0.3) { rng.random_range(-0.12..0.12) } else { rng.random_range(-0.01..0.01) };
        let against = if rng.random_bool(0.5) { PI } else { 0.0 };
        // Half of the trucks have a cab and a load of the same colour.
        let livery = (class == VehicleClass::Truck && rng.random_bool(0.5))
            .then(|| random_paint(rng).map(|value| (f64::from(value) / 255.0).powi(2)));
        let candidate = GroundVehicle { id, vehicle, at_m, yaw_rad: turned + against, livery };
        let outline = footprint(&candidate);
        if scene.vehicles.iter().all(|other| footprint(other).distance_m(&outline) > CLEARANCE_M) {
            scene.vehicles.push(candidate);
            return;
        }
    }
}

fn footprint(vehicle: &GroundVehicle) -> OrientedBox {
    let Dimensions { length_m, width_m, .. } = vehicle.vehicle.dimensions;
    OrientedBox { x_m: vehicle.at_m[0], y_m: vehicle.at_m[1], yaw_rad: vehicle.yaw_rad, length_m, width_m }
}

/// Draws a vehicle of a class, with a body shape of this set.
pub fn random_vehicle(set: Set, class: VehicleClass, rng: &mut Stream) -> Vehicle {
    let is_of_set = |shape: &&BodyShape| HELD_OUT_SHAPES.contains(shape) == (set == Set::HeldOut);
    let shapes: Vec<BodyShape> = BodyShape::of_class(class).iter().filter(is_of_set).copied().collect();
    let body_shape = shapes[rng.random_range(0..shapes.len())];
    let usual = body_shape.usual_dimensions();
    let mut vehicle = Vehicle::typical(class);
    // Trucks are built in many lengths.
    let shortest = if class == VehicleClass::Truck && set == Set::Training { 0.6 } else { 0.93 };
    vehicle.dimensions = Dimensions {
        length_m: (usual.length_m * rng.random_range(shortest..1.07)).max(MIN_TRUCK_M.min(usual.length_m)),
        width_m: usual.width_m * rng.random_range(0.95..1.05),
        height_m: usual.height_m * rng.random_range(0.94..1.06),
    };
    vehicle.appearance.body_shape = body_shape;
    vehicle.appearance.paint_rgb = random_paint(rng);
    vehicle
}

/// Draws a paint: most cars are grey, black or white, the others coloured.
fn random_paint(rng: &mut Stream) -> [u8; 3] {
    if rng.random_bool(0.7) {
        return [rng.random_range(10..250); 3];
    }
    [0; 3].map(|_| rng.random_range(10..230))
}
