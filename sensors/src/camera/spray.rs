//! Spray: the water that tyres throw up from a wet road, as a chain of thin round clouds behind each axle.
//!
//! A ray loses light by the chord that it cuts through each cloud, as far as the cloud lies in front of what the ray
//! hits, and gains light of the air instead. Density grows with the film's height and with the square of the speed,
//! and starts at about 40 km/h (as measured, for instance, by Weir, Strange and Heffley, *Reduction of adverse
//! aerodynamic effects of large trucks*, FHWA 1978).

use closecall_traffic::VehicleClass;

use super::hash::{mix, mix_at, unit};
use super::mesh::{Vec3, dot};
use crate::{Scene, SceneVehicle};

/// Below this speed no spray is thrown [m/s].
const FROM_SPEED_MPS: f64 = 11.0;
/// The speed at which density has its full value [m/s].
const FULL_SPEED_MPS: f64 = 30.0;
/// The film at which density has its full value [mm].
const FULL_FILM_MM: f64 = 1.0;
/// Extinction in the middle of a fresh cloud of a car, at full speed and film [1/m].
const DENSITY_PER_M: f32 = 0.55;
/// Clouds in one chain.
const CLOUDS: i32 = 6;
/// Distance between the clouds of a chain [m].
const CLOUD_EVERY_M: f32 = 1.7;

/// One cloud, in the ground frame relative to the lens.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cloud {
    pub(crate) at: Vec3,
    pub(crate) radius_m: f32,
    /// Extinction in its middle [1/m].
    per_m: f32,
    /// Square of the way from the lens to where a tangent touches the cloud [m²].
    clear_m2: f32,
}

impl Cloud {
    fn new(at: Vec3, radius_m: f32, per_m: f32) -> Self {
        Self { at, radius_m, per_m, clear_m2: dot(at, at) - radius_m * radius_m }
    }

    /// Optical depth along the unit vector `towards`, in front of what lies `until_m` away.
    pub(crate) fn optical_depth(&self, towards: Vec3, until_m: f32) -> f32 {
        let middle = dot(self.at, towards);
        let half = middle * middle - self.clear_m2;
        if half <= 0.0 {
            return 0.0;
        }
        let half = half.sqrt();
        let (from, to) = ((middle - half).max(0.0), (middle + half).min(until_m));
        // Thinner towards the rim: weighted with how deep the ray passes.
        self.per_m * (to - from).max(0.0) * half / self.radius_m
    }
}

/// Edge of the cells of the road that spray is keyed by [m]: no two vehicles have their centres in one.
const CELL_M: f64 = 0.1;

/// The cell that a vehicle's centre is in. Keyed by it and not by its place in a list, spray does not change with the
/// order of the vehicles.
#[expect(clippy::cast_possible_truncation, reason = "a float cast saturates, far beyond the ends of any road")]
fn cell(vehicle: &SceneVehicle) -> u64 {
    let [along, across] = [vehicle.state.s_m, vehicle.state.d_m].map(|place_m| (place_m / CELL_M).round() as i32);
    (u64::from(along.cast_unsigned()) << 32) | u64::from(across.cast_unsigned())
}

/// The clouds behind one vehicle, given its place [m] and its heading's cosine and sine in the ground frame.
pub(crate) fn behind(
    vehicle: &SceneVehicle,
    scene: &Scene<'_>,
    at: [f32; 2],
    turn: [f32; 2],
    lens_height_m: f32,
    key: u64,
) -> Vec<Cloud> {
    let speed = (vehicle.state.speed_mps - FROM_SPEED_MPS) / (FULL_SPEED_MPS - FROM_SPEED_MPS);
    let film = (scene.environment.water_film_mm / FULL_FILM_MM).min(2.0);
    if !(speed > 0.0 && film > 0.0) {
        return Vec::new();
    }
    let (large, thick) = match vehicle.vehicle.class {
        VehicleClass::Car => (1.0, 1.0),
        VehicleClass::Truck => (1.9, 1.6),
        VehicleClass::Motorcycle => (0.6, 0.5),
    };
    let density = DENSITY_PER_M * thick * (speed * speed).min(1.5) as f32 * film as f32;
    let size = vehicle.vehicle.dimensions;
    let half_track = (0.40 * size.width_m) as f32;
    let mut clouds = Vec::new();
    let key = mix(key ^ cell(vehicle));
    for axle_m in [0.3 * size.length_m as f32, -0.35 * size.length_m as f32] {
        for side in [-1_i8, 1] {
            for place in 0..CLOUDS {
                let bits = mix_at(key, place, i32::from(side) + if axle_m > 0.0 { 10 } else { 0 });
                let back = axle_m - 0.6 - CLOUD_EVERY_M * (place as f32 + 0.6 * unit(bits));
                let grown = 0.35 + 0.13 * place as f32;
                let radius_m = large * grown * (0.8 + 0.5 * unit(bits << 12));
                let left = f32::from(side) * half_track * (1.0 + 0.06 * place as f32) + 0.3 * (unit(bits << 24) - 0.5);
                let up = 0.7 * radius_m - lens_height_m;
                let fresh = 1.0 / (1.0 + 0.35 * place as f32);
                let middle = [at[0] + turn[0] * back - turn[1] * left, at[1] + turn[1] * back + turn[0] * left, up];
                clouds.push(Cloud::new(middle, radius_m, density * fresh * (0.3 + 1.4 * unit(bits << 36))));
            }
        }
    }
    clouds
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cloud_dims_what_is_behind_it_and_not_what_is_before_it() {
        let cloud = Cloud::new([-10.0, 0.0, 0.0], 1.0, 0.5);
        let towards = [-1.0, 0.0, 0.0];
        assert_eq!(cloud.optical_depth(towards, 8.0), 0.0);
        assert!((cloud.optical_depth(towards, 100.0) - 1.0).abs() < 1e-6);
        assert_eq!(cloud.optical_depth([1.0, 0.0, 0.0], 100.0), 0.0);
        assert_eq!(cloud.optical_depth([0.0, 1.0, 0.0], 100.0), 0.0);
    }
}
