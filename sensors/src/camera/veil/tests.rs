//! What glare does to the pixels and to the classifier.

use closecall_traffic::{
    Check, Environment, Light, Num, Parameters, Road, Time, Vehicle, VehicleClass, VehicleState, maths,
};

use super::*;
use crate::camera::classifier::{Backend, Classifier};
use crate::camera::{Camera, CameraConfig, Crop, ExposureKey, PixelRect, RearCamera};

/// Strengths of the glare: from none to ten times that in a healthy eye.
const STRENGTHS: [f64; 7] = [0.0, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0];
/// Gaps of the car behind (m).
const GAPS_M: [f64; 3] = [25.0, 40.0, 60.0];
/// Number of exposures at each gap.
const EXPOSURES: u64 = 10;
/// Value from which a pixel counts as saturated: the noise of a saturated one at night has a
/// standard deviation of 8.
const SATURATED: u8 = 235;
/// Share of the exposures by which noise may raise the result (-): three of thirty. A network that
/// sees nothing but noise says anything.
const BY_CHANCE: f64 = 0.1;

fn vehicle(s_m: f64) -> SceneVehicle {
    let state = VehicleState { s_m, d_m: -5.6, speed_mps: 30.0, ..VehicleState::default() };
    SceneVehicle { actor: 1, vehicle: Vehicle::typical(VehicleClass::Car), state, pitch_rad: 0.0 }
}

/// Returns a camera that looks at a sun straight behind, at this elevation (rad).
fn camera(elevation_rad: f64) -> Camera {
    let mut config = CameraConfig::default();
    config.sun.azimuth_rad = Num::Fixed(std::f64::consts::PI);
    config.sun.elevation_rad = Num::Fixed(elevation_rad);
    config.check(&Parameters::default()).unwrap()
}

/// Calls `see` with a frame for each exposure of a car behind, and with the window around the car.
fn exposures(light: Light, camera: &Camera, fault: &CameraFault, mut see: impl FnMut(&mut Frame, PixelRect)) {
    let (road, environment, ego) = (Road::straight(3), Environment { light, ..Environment::CLEAR_DAY }, vehicle(500.0));
    for gap_m in GAPS_M {
        let size = ego.vehicle.dimensions;
        let others = [vehicle(500.0 - size.length_m - gap_m)];
        let scene = Scene { time: Time::ZERO, road: &road, environment: &environment, ego, others: &others };
        let body = crate::camera::GroundBox {
            x_m: -size.length_m - gap_m,
            y_m: 0.0,
            heading_rad: 0.0,
            length_m: size.length_m,
            width_m: size.width_m,
            height_m: size.height_m,
        };
        let window = RearCamera::new(*camera).project(&ego, &body).unwrap();
        for key in 0..EXPOSURES {
            let mut frame = Frame::new(camera, &scene, ExposureKey(key), &[window]);
            frame.add_glare(fault, &scene);
            see(&mut frame, window);
        }
    }
}

/// Returns the share of the exposures in which the network takes the car for one, and the share of
/// the samples that are saturated.
fn seen(light: Light, camera: &Camera, fault: &CameraFault) -> [f64; 2] {
    let mut network = Classifier::shipped(&Backend::Tract).unwrap();
    let mut crop = Crop::default();
    let (mut right, mut saturated, mut count) = (0.0, 0.0, 0.0);
    exposures(light, camera, fault, |frame, window| {
        frame.crop(window, &mut crop);
        let scores = network.classify(&crop).unwrap().0;
        let is_best = scores.iter().all(|score| *score <= scores[VehicleClass::Car as usize]);
        right += f64::from(u8::from(is_best));
        saturated += crop.rgb.iter().filter(|value| **value >= SATURATED).count() as f64 / crop.rgb.len() as f64;
        count += 1.0;
    });
    [right / count, saturated / count]
}

#[test]
fn the_veil_falls_with_the_square_of_the_angle_as_stiles_and_holladay_state() {
    let veil = Veil { towards: [-1.0, 0.0, 0.0], irradiance: [1.0; 3] };
    let at_deg = |angle_deg: f32| {
        let (sin, cos) = maths::sin_cos(angle_deg.to_radians());
        let mut light = [0.0; 3];
        veil.add_to([-cos, sin, 0.0], &mut light);
        light[0]
    };
    // 10 cd/m² per lux at 1°, a hundredth of it at 10°.
    for (angle_deg, expected) in [(0.0, 10.0), (0.5, 10.0), (1.0, 10.0), (2.0, 2.5), (10.0, 0.1), (30.0, 10.0 / 900.0)]
    {
        assert!((at_deg(angle_deg) / expected - 1.0).abs() < 0.03, "{angle_deg}: {}", at_deg(angle_deg));
    }
}

#[test]
fn a_source_behind_the_lens_or_one_that_does_not_shine_lays_no_veil() {
    let fault = CameraFault { sun_glare: 10.0, main_beam_glare: 10.0, ..CameraFault::default() };
    let veils = |light, camera: &Camera| {
        let mut most = 0;
        exposures(light, camera, &fault, |frame, _| most = most.max(frame.lists.veils.len()));
        most
    };
    let usual = CameraConfig::default().check(&Parameters::default()).unwrap();
    assert_eq!(veils(Light::Day, &usual), 0, "the sun is ahead of the ego, and a main beam is nothing by day");
    assert_eq!(veils(Light::Day, &camera(0.1)), 1, "the sun");
    assert_eq!(veils(Light::Night, &usual), 2, "the headlamps");
}

#[test]
fn stronger_glare_hides_a_car_more_and_saturation_hides_it_entirely() {
    let sun = |strength| CameraFault { sun_glare: strength, ..CameraFault::default() };
    let beam = |strength| CameraFault { main_beam_glare: strength, ..CameraFault::default() };
    for (name, scores) in [
        ("sun", STRENGTHS.map(|strength| seen(Light::Day, &camera(0.1), &sun(strength)))),
        ("main beam", STRENGTHS.map(|strength| seen(Light::Night, &camera(0.1), &beam(strength)))),
    ] {
        let falls = |pair: &[[f64; 2]]| pair[1][0] <= pair[0][0] + BY_CHANCE && pair[1][1] >= pair[0][1];
        assert!(scores.windows(2).all(falls), "{name}: {scores:?}");
        assert!(scores[0][0] > 0.9, "{name}: {scores:?}");
        assert!(scores.iter().any(|[_, saturated]| *saturated > 0.9), "{name}: {scores:?}");
        let lost = |[right, saturated]: &[f64; 2]| *saturated < 0.9 || *right <= BY_CHANCE;
        assert!(scores.iter().all(lost), "{name}: {scores:?}");
    }
}

#[test]
fn a_sun_far_from_the_car_hides_less_than_a_sun_near_it() {
    let fault = CameraFault { sun_glare: 1.0, ..CameraFault::default() };
    let saturated = [0.05, 0.2, 0.5].map(|elevation_rad| seen(Light::Day, &camera(elevation_rad), &fault)[1]);
    assert!(saturated[0] > 2.0 * saturated[2] && saturated[0] > saturated[1], "{saturated:?}");
}
