//! Tests that the moments of a pixel have the same bits whether they are computed at once or one by
//! one.

use crate::camera::effects::Effects;
use closecall_traffic::{
    Check, Environment, Light, Num, Parameters, Road, Scene, SceneVehicle, Time, Vehicle, VehicleClass, VehicleState,
};

use super::*;
use crate::camera::{CameraConfig, ExposureKey};

const NIGHT: Environment = Environment { light: Light::Night, ..Environment::CLEAR_DAY };
const RAIN: Environment =
    Environment { rain_mm_per_h: 8.0, water_film_mm: 1.0, visibility_m: 800.0, ..Environment::CLEAR_DAY };
const FOG: Environment = Environment { light: Light::Dusk, visibility_m: 100.0, ..Environment::CLEAR_DAY };

fn vehicle(class: VehicleClass, [s_m, d_m]: [f64; 2]) -> SceneVehicle {
    let state = VehicleState { s_m, d_m, speed_mps: 31.0, heading_rad: 0.01, ..VehicleState::default() };
    SceneVehicle { actor: 1, vehicle: Vehicle::typical(class), state, pitch_rad: 0.002 }
}

/// Compares both ways for a camera with this yaw (deg). Returns the number of pixels of one kind,
/// the number of pixels that show a body, and the number of all pixels.
fn compared(road: &Road, environment: &Environment, heading_rad: f64, yaw_deg: f64) -> [usize; 3] {
    let config = CameraConfig { yaw_deg: Num::Fixed(yaw_deg), ..CameraConfig::default() };
    let camera = config.check(&Parameters::default()).unwrap();
    let mut ego = vehicle(VehicleClass::Car, [731.3, -5.4]);
    ego.state.heading_rad = heading_rad;
    let others = [
        vehicle(VehicleClass::Car, [700.0, -5.6]),
        vehicle(VehicleClass::Truck, [660.0, -9.4]),
        vehicle(VehicleClass::Motorcycle, [712.0, -1.9]),
    ];
    let scene = Scene { time: Time::from_ms(1_400), road, environment, ego, others: &others };
    let mut frame = Frame::new(&camera, &scene, ExposureKey(3), &[camera.resolution.image()]);
    let columns: Vec<i32> = (0..1280).step_by(9).collect();
    let effects = Effects {
        patches: frame.lists.patches.clone(),
        clouds: frame.lists.clouds.clone(),
        glows: frame.lists.glows.clone(),
    };
    let mut counts = [0; 3];
    let mut rgb = vec![0; columns.len() * CHANNELS];
    for row in (0..800).step_by(3) {
        frame.draw(&columns, &[row], &mut rgb);
        let mut line = Line::new(&frame, &columns, crate::camera::line_memory::LineMemory::default());
        line.begin(&frame, row, &effects);
        for (place, column) in columns.iter().enumerate() {
            let (_, length) = line.centre(&frame, place);
            let singly = frame.moment_by_moment(place, place, length, &mut line);
            counts[2] += 1;
            if let Some(at_once) = frame.at_once(place, place, length, &mut line) {
                counts[0] += 1;
                counts[1] += usize::from(frame.instance(place) > 0);
                assert_eq!(bits(at_once), bits(singly), "row {row}, column {column}");
            }
        }
    }
    counts
}

fn bits((light, nearness): (Vec3, f32)) -> [u32; 4] {
    [light[0], light[1], light[2], nearness].map(f32::to_bits)
}

#[test]
fn pixels_of_one_kind_have_the_bits_of_their_moments() {
    let straight = Road::straight(3);
    for environment in [Environment::CLEAR_DAY, NIGHT, RAIN, FOG] {
        for (road, heading_rad) in
            [(&straight, 0.0), (&straight, -0.03), (&Road::straight(2).with_curvature(-0.002), 0.02)]
        {
            let [of_one_kind, of_bodies, all] = compared(road, &environment, heading_rad, 0.0);
            // Nearly all of the image is nothing but ground, sky or vehicles.
            assert!(of_one_kind * 10 > all * 8 && of_one_kind < all, "{of_one_kind} of {all}");
            assert!(of_bodies > 100, "{of_bodies}");
        }
    }
}

#[test]
fn pixels_of_a_turned_camera_have_the_bits_of_their_moments() {
    let curved = Road::straight(2).with_curvature(-0.002);
    for yaw_deg in [-25.0, 40.0] {
        for environment in [Environment::CLEAR_DAY, NIGHT, RAIN] {
            // Sky, woods and bodies are computed at once. The ground is not.
            let [of_one_kind, ..] = compared(&curved, &environment, 0.02, yaw_deg);
            assert!(of_one_kind > 1_000, "{of_one_kind}");
        }
    }
}
