//! Random scenes behind the ego vehicle: road, weather, light, and vehicles of every shape and
//! paint.

use std::f64::consts::PI;

use closecall_traffic::metrics::bumper_gap_m;
use closecall_traffic::{
    BodyShape, CONTROL_STEP, Check, Choice, ConfigError, Dimensions, Environment, Indicator, Lane, Light, Num,
    Parameters, Road, RoadConfig, Side, Stream, Time, Vehicle, VehicleClass, VehicleState,
};
use rand::RngExt;

use super::Set;
use crate::camera::{Camera, CameraConfig, HELD_OUT_SHAPES, Pipeline, SunConfig};
use crate::{Scene, SceneVehicle};

/// Range of the distance from the ego's centre back to the front of a vehicle (m).
const BEHIND_M: std::ops::Range<f64> = 6.0..125.0;
/// Maximum number of attempts to place a vehicle clear of the others, after which it is left out.
const MAX_ATTEMPTS: usize = 8;
/// Minimum longitudinal gap between vehicles that are not laterally clear of each other (m).
const MIN_GAP_M: f64 = 2.0;

/// A random scene. It owns the data that a [`Scene`] borrows.
pub(super) struct RandomScene {
    pub(super) time: Time,
    pub(super) road: Road,
    pub(super) environment: Environment,
    pub(super) camera: Camera,
    pub(super) ego: SceneVehicle,
    pub(super) others: Vec<SceneVehicle>,
}

impl RandomScene {
    /// Draws a random scene with so many vehicles, or fewer if there is no room.
    pub(super) fn draw(
        set: Set,
        vehicles: std::ops::RangeInclusive<usize>,
        rng: &mut Stream,
    ) -> Result<Self, ConfigError> {
        let road = road(rng)?;
        let environment = environment(rng);
        let camera = camera(rng)?;
        let lane = Lane(rng.random_range(1..=road.lanes()));
        let state = VehicleState {
            s_m: rng.random_range(500.0..20_000.0),
            d_m: road.lane_centre_m(lane, 0.0) + rng.random_range(-0.5..0.5),
            heading_rad: rng.random_range(-0.01..0.01),
            speed_mps: rng.random_range(18.0..38.0),
            brake_light: rng.random_bool(0.2),
            ..VehicleState::default()
        };
        let pitch_rad = rng.random_range(-0.012..0.012);
        let ego = SceneVehicle { actor: 0, vehicle: Vehicle::typical(VehicleClass::Car), state, pitch_rad };
        let mut scene = Self {
            time: CONTROL_STEP * rng.random_range(0..1_000),
            road,
            environment,
            camera,
            ego,
            others: Vec::new(),
        };
        for actor in 1..=rng.random_range(vehicles) {
            scene.add_vehicle(actor, set, rng);
        }
        Ok(scene)
    }

    /// Returns the scene in the form that the sensors use.
    pub(super) fn scene(&self) -> Scene<'_> {
        Scene { time: self.time, road: &self.road, environment: &self.environment, ego: self.ego, others: &self.others }
    }

    fn add_vehicle(&mut self, actor: usize, set: Set, rng: &mut Stream) {
        let class = VehicleClass::ALL[rng.random_range(0..3)];
        let mut vehicle = Vehicle::typical(class);
        vehicle.appearance.body_shape = shape(set, class, rng);
        vehicle.appearance.paint_rgb = paint(set, rng);
        vehicle.dimensions = dimensions(vehicle.appearance.body_shape, rng);
        for _ in 0..MAX_ATTEMPTS {
            let lane = Lane(rng.random_range(1..=self.road.lanes()));
            let gap = vehicle.dimensions.length_m / 2.0 + rng.random_range(BEHIND_M);
            let changing = if rng.random_bool(0.15) { rng.random_range(-0.07..0.07) } else { 0.0 };
            let state = VehicleState {
                s_m: self.ego.state.s_m - gap,
                d_m: self.road.lane_centre_m(lane, 0.0) + rng.random_range(-0.7..0.7) + 20.0 * changing,
                heading_rad: rng.random_range(-0.01..0.01) + changing,
                speed_mps: self.ego.state.speed_mps + rng.random_range(-5.0..14.0),
                indicator: [Indicator::Off, Indicator::Left, Indicator::Right][rng.random_range(0..3)],
                ..VehicleState::default()
            };
            let candidate = SceneVehicle { actor, vehicle, state, pitch_rad: rng.random_range(-0.01..0.02) };
            if self.others.iter().all(|other| have_clearance(other, &candidate)) {
                self.others.push(candidate);
                return;
            }
        }
    }
}

fn have_clearance(a: &SceneVehicle, b: &SceneVehicle) -> bool {
    let lengths_m = [a, b].map(|vehicle| vehicle.vehicle.dimensions.length_m);
    let along = bumper_gap_m((a.state.s_m - b.state.s_m).abs(), lengths_m[0], lengths_m[1]);
    let across =
        (a.state.d_m - b.state.d_m).abs() - (a.vehicle.dimensions.width_m + b.vehicle.dimensions.width_m) / 2.0;
    along > MIN_GAP_M || across > 0.3
}

fn road(rng: &mut Stream) -> Result<Road, ConfigError> {
    let config = RoadConfig {
        lanes: rng.random_range(2..=4),
        lane_width_m: rng.random_range(3.5..3.8).into(),
        curvature_per_m: Num::Fixed(if rng.random_bool(0.5) { rng.random_range(-0.001..0.001) } else { 0.0 }),
        cross_sections: Vec::new(),
        alignment: Vec::new(),
        alignment_d_m: None,
        speed_limit_mps: Num::Fixed(36.1),
        overtaking_side: Side::Left,
        guard_rails: rng.random_bool(0.5),
        roadside: closecall_traffic::RoadsideConfig::default(),
        acceleration_lane: None,
    };
    config.check(&Parameters::default())
}

fn environment(rng: &mut Stream) -> Environment {
    let light = [Light::Day, Light::Day, Light::Dusk, Light::Night, Light::Night][rng.random_range(0..5)];
    let mut environment =
        Environment { light, visibility_m: rng.random_range(3_000.0..20_000.0), ..Environment::CLEAR_DAY };
    match rng.random_range(0..10) {
        0 => environment.visibility_m = rng.random_range(80.0..500.0),
        1..=4 => {
            environment.rain_mm_per_h = rng.random_range(0.5..15.0);
            environment.water_film_mm = rng.random_range(0.05..1.2);
            environment.visibility_m = rng.random_range(800.0..6_000.0);
        }
        // After rain: the road is wet, but no drops fall.
        5 => environment.water_film_mm = rng.random_range(0.05..0.8),
        _ => {}
    }
    environment
}

fn camera(rng: &mut Stream) -> Result<Camera, ConfigError> {
    let dirt: f64 = rng.random_range(0.0..0.55);
    let config = CameraConfig {
        pipeline: Choice::Fixed(Pipeline::CropClassifier),
        mount_height_m: Num::Fixed(rng.random_range(1.05..1.4)),
        mount_from_rear_m: Num::Fixed(rng.random_range(0.3..1.0)),
        pitch_rad: Num::Fixed(rng.random_range(0.0..0.06)),
        vibration_radps: Num::Fixed(rng.random_range(0.0..0.12)),
        dirt: Num::Fixed(dirt * dirt),
        exposure_ev: Num::Fixed(rng.random_range(-0.6..0.6)),
        sun: SunConfig {
            azimuth_rad: Num::Fixed(rng.random_range(-PI..PI)),
            elevation_rad: Num::Fixed(rng.random_range(0.08..1.2)),
        },
        ..CameraConfig::default()
    };
    config.check(&Parameters::default())
}

fn shape(set: Set, class: VehicleClass, rng: &mut Stream) -> BodyShape {
    let all = BodyShape::of_class(class);
    match set {
        Set::HeldOut => {
            let held_out: Vec<BodyShape> = HELD_OUT_SHAPES.into_iter().filter(|shape| shape.class() == class).collect();
            held_out[rng.random_range(0..held_out.len())]
        }
        Set::Training => loop {
            // The type of the range decides what is drawn: with `u8`, this is the data set that
            // trained the shipped network.
            let shape = all[usize::from(rng.random_range(0..all.len() as u8))];
            if !HELD_OUT_SHAPES.contains(&shape) {
                return shape;
            }
        },
    }
}

/// Draws the dimensions of a vehicle. A third of the vehicles have about the typical size of the
/// class regardless of their shape, as in a scenario file that does not state the size.
fn dimensions(shape: BodyShape, rng: &mut Stream) -> Dimensions {
    let usual = if rng.random_bool(1.0 / 3.0) { shape.class().typical_dimensions() } else { shape.usual_dimensions() };
    Dimensions {
        length_m: usual.length_m * rng.random_range(0.93..1.07),
        width_m: usual.width_m * rng.random_range(0.95..1.05),
        height_m: usual.height_m * rng.random_range(0.94..1.06),
    }
}

/// Draws the paint of a vehicle. Half of the vehicles are grey, the others coloured. The two sets
/// use disjoint bands of brightness (grey) and of hue (coloured).
fn paint(set: Set, rng: &mut Stream) -> [u8; 3] {
    /// Number of equal parts of the scale. The upper quarter of each part belongs to the held-out
    /// set.
    const BANDS: f64 = 5.0;
    let banded = |rng: &mut Stream| loop {
        let value: f64 = rng.random();
        let is_held_out = (value * BANDS).fract() > 0.75;
        if is_held_out == (set == Set::HeldOut) {
            return value;
        }
    };
    if rng.random_bool(0.5) {
        let grey = 0.05 + 0.9 * banded(rng);
        return [grey, grey, grey * rng.random_range(0.95..1.05)].map(byte);
    }
    let (hue, saturation, value) = (banded(rng), rng.random_range(0.3..0.95), rng.random_range(0.15..0.95));
    let channel = |shift: f64| {
        let sector = (hue + shift).fract() * 6.0;
        let share = ((sector - 3.0).abs() - 1.0).clamp(0.0, 1.0);
        value * (1.0 - saturation * (1.0 - share))
    };
    [channel(0.0), channel(2.0 / 3.0), channel(1.0 / 3.0)].map(byte)
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to 0 … 255 before the cast")]
fn byte(share: f64) -> u8 {
    (share * 255.0).round().clamp(0.0, 255.0) as u8
}
