//! Spray: water that tyres throw up from a wet road, modelled as a chain of thin spherical clouds
//! behind each wheel.
//!
//! A cloud attenuates a ray according to the part of the ray that lies in the cloud and in front of
//! the object that the ray hits. Light scattered by the air replaces the lost light. The density
//! grows with the height of the water film and with the square of the speed, and starts at about 40
//! km/h (as measured, for instance, by Weir, Strange and Heffley, *Reduction of adverse aerodynamic
//! effects of large trucks*, FHWA 1978).

use closecall_traffic::VehicleClass;

use super::hash::{mix, mix_at, unit};
use super::mesh::{Vec3, dot};
use closecall_traffic::{Scene, SceneVehicle};

/// Speed up to which there is no spray (m/s).
const MIN_SPEED_MPS: f64 = 11.0;
/// Speed at which the density has its nominal value (m/s).
const NOMINAL_SPEED_MPS: f64 = 30.0;
/// Height of the water film at which the density has its nominal value (mm).
const NOMINAL_FILM_MM: f64 = 1.0;
/// Extinction coefficient in the middle of the first cloud behind a car's wheel, at the nominal
/// speed and water film (1/m).
const DENSITY_PER_M: f32 = 0.55;
/// Number of clouds in one chain.
const CLOUDS: usize = 6;
/// Distance between the clouds of a chain (m).
const CLOUD_SPACING_M: f32 = 1.7;

/// A spherical cloud of spray. Its position is in the ground frame, relative to the lens.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cloud {
    pub(crate) at: Vec3,
    pub(crate) radius_m: f32,
    /// Extinction coefficient in the middle of the cloud (1/m).
    extinction_per_m: f32,
    /// Squared length of a tangent from the lens to the cloud (m²).
    tangent_squared_m2: f32,
}

impl Cloud {
    fn new(at: Vec3, radius_m: f32, extinction_per_m: f32) -> Self {
        Self { at, radius_m, extinction_per_m, tangent_squared_m2: dot(at, at) - radius_m * radius_m }
    }

    /// Returns the optical depth along the unit vector `towards`, up to the distance
    /// `max_distance_m`.
    pub(crate) fn optical_depth(&self, towards: Vec3, max_distance_m: f32) -> f32 {
        let middle = dot(self.at, towards);
        let half = middle * middle - self.tangent_squared_m2;
        if half <= 0.0 {
            return 0.0;
        }
        let half = half.sqrt();
        let (from, to) = ((middle - half).max(0.0), (middle + half).min(max_distance_m));
        // The cloud is thinner towards its rim: the depth is weighted by the half chord relative to
        // the radius.
        self.extinction_per_m * (to - from).max(0.0) * half / self.radius_m
    }
}

/// Side of the road cells that serve as keys of the spray (m). It is so small that no two vehicles
/// have their centres in the same cell.
const CELL_M: f64 = 0.1;

/// Returns the key of the road cell that contains the vehicle's centre. Because this key, not the
/// index in a list, seeds the spray, the spray does not depend on the order of the vehicles.
#[expect(clippy::cast_possible_truncation, reason = "a float cast saturates, far beyond the ends of any road")]
fn cell_key(vehicle: &SceneVehicle) -> u64 {
    let [along, across] = [vehicle.state.s_m, vehicle.state.d_m].map(|position_m| (position_m / CELL_M).round() as i32);
    (u64::from(along.cast_unsigned()) << 32) | u64::from(across.cast_unsigned())
}

/// Number of clouds behind one vehicle: a chain behind each of four wheels.
const CLOUDS_BEHIND: usize = 4 * CLOUDS;

/// Returns the clouds behind one vehicle, given its position `at` (m) and the cosine and sine of
/// its heading, `turn`, in the ground frame. Returns `None` if it throws up no spray.
pub(crate) fn clouds_behind(
    vehicle: &SceneVehicle,
    scene: &Scene<'_>,
    at: [f32; 2],
    turn: [f32; 2],
    lens_height_m: f32,
    key: u64,
) -> Option<[Cloud; CLOUDS_BEHIND]> {
    let speed = (vehicle.state.speed_mps - MIN_SPEED_MPS) / (NOMINAL_SPEED_MPS - MIN_SPEED_MPS);
    let film = (scene.environment.water_film_mm / NOMINAL_FILM_MM).min(2.0);
    if !(speed > 0.0 && film > 0.0) {
        return None;
    }
    let (size_factor, density_factor) = match vehicle.vehicle.class {
        VehicleClass::Car => (1.0, 1.0),
        VehicleClass::Truck => (1.9, 1.6),
        VehicleClass::Motorcycle => (0.6, 0.5),
    };
    let density = DENSITY_PER_M * density_factor * (speed * speed).min(1.5) as f32 * film as f32;
    let size = vehicle.vehicle.dimensions;
    let half_track = (0.40 * size.width_m) as f32;
    let key = mix(key ^ cell_key(vehicle));
    let axles_m = [0.3 * size.length_m as f32, -0.35 * size.length_m as f32];
    Some(std::array::from_fn(|cloud| {
        let (wheel, index) = (cloud / CLOUDS, (cloud % CLOUDS) as i32);
        let (axle_m, side) = (axles_m[wheel / 2], [-1_i8, 1][wheel % 2]);
        let bits = mix_at(key, index, i32::from(side) + if axle_m > 0.0 { 10 } else { 0 });
        let back = axle_m - 0.6 - CLOUD_SPACING_M * (index as f32 + 0.6 * unit(bits));
        let relative_radius = 0.35 + 0.13 * index as f32;
        let radius_m = size_factor * relative_radius * (0.8 + 0.5 * unit(bits << 12));
        let left = f32::from(side) * half_track * (1.0 + 0.06 * index as f32) + 0.3 * (unit(bits << 24) - 0.5);
        let up = 0.7 * radius_m - lens_height_m;
        let dilution = 1.0 / (1.0 + 0.35 * index as f32);
        let middle = [at[0] + turn[0] * back - turn[1] * left, at[1] + turn[1] * back + turn[0] * left, up];
        Cloud::new(middle, radius_m, density * dilution * (0.3 + 1.4 * unit(bits << 36)))
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cloud_attenuates_only_what_lies_behind_it() {
        let cloud = Cloud::new([-10.0, 0.0, 0.0], 1.0, 0.5);
        let towards = [-1.0, 0.0, 0.0];
        assert_eq!(cloud.optical_depth(towards, 8.0), 0.0);
        assert!((cloud.optical_depth(towards, 100.0) - 1.0).abs() < 1e-6);
        assert_eq!(cloud.optical_depth([1.0, 0.0, 0.0], 100.0), 0.0);
        assert_eq!(cloud.optical_depth([0.0, 1.0, 0.0], 100.0), 0.0);
    }
}
